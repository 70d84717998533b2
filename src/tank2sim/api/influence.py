"""Influence coefficients of a ship's card, and the card tuned to figures, as results."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from tank2sim.analysis.ensemble.results import EnsembleRequest, FigureBands, named_bands
from tank2sim.analysis.influence.card_influence import CardInfluence, influence
from tank2sim.analysis.influence.figures import InfluenceFigure, parse_figure
from tank2sim.analysis.influence.study import Study
from tank2sim.analysis.tuning.result import Means, Tuned, tuned_text
from tank2sim.analysis.tuning.targets import TARGET_OPTION, Target, parse_target
from tank2sim.analysis.tuning.tune import tune
from tank2sim.analysis.validation.standard_trials import craft_trials
from tank2sim.answer.parts import Table
from tank2sim.api.ensemble import FEW_IN_LANES, EnsembleOptions
from tank2sim.api.result import PagedResult, screen_table
from tank2sim.api.ship import Ship
from tank2sim.cards import Card, CraftCard
from tank2sim.cards.covariance_reading import derived_card
from tank2sim.errors import InputError
from tank2sim.native.compiler import find_compiler
from tank2sim.results.ensembles import band_table
from tank2sim.simulation.integrator import NO_COMPILER
from tank2sim.simulation.thruster_manoeuvres import DifferenceTurn, StraightRun

if TYPE_CHECKING:
    import pandas as pd


DEFAULT_FIGURES = (
    "criterion_C",
    "steady_radius_m@20",
    "advance_m@35",
    "tactical_diameter_m@35",
    "overshoot1_deg@20/20",
)
"""Figures where none is given. Project choice: one of each kind that is looked at most."""

ROWS = 15
"""Parameters in the printed tables, the most influential; JSON and page have all. Project choice: a screen of them."""

TABLE_FIGURES = 3
"""Figures in one table of coefficients. Project choice: with pairs of coefficients they fit in 80 columns."""

_INDEPENDENT = (
    "tuning takes standard errors as if they were independent: its bounds, and what counts as a small move, leave out "
    "the covariance next to the card"
)
_TUNED_CARD = "the tuned card"


class InfluenceResult(PagedResult):
    """How much each number on a card moves the figures of the ship.

    Parameters
    ----------
    ship : Ship
    found : CardInfluence
        SI and radians.
    bands : FigureBands, optional
        Of an ensemble.

    Examples
    --------
    >>> import tank2sim as t2s
    >>> found = t2s.load("mariner").influence("steady_radius_m@20")
    >>> float(found.coefficients.loc["derivatives.Nd", "steady_radius_m@20"].round(1))
    -7.6
    """

    command = "influence"

    def __init__(self, ship: Ship, found: CardInfluence, bands: FigureBands | None = None) -> None:
        self.ship, self.found, self.bands = ship, found, bands
        compiler = [] if find_compiler() else [NO_COMPILER]
        self._notices = tuple(dict.fromkeys([*found.notices, *self._card_notices(), *compiler]))
        self.notices = tuple(dict.fromkeys([*self._notices, *(bands.notices if bands else ())]))

    @property
    def figures(self) -> pd.DataFrame:
        """The figures by name, in the units of their names: value and standard error."""
        import pandas as pd

        columns = {"value": self.found.values, "standard_error": self.found.standard_errors}
        return pd.DataFrame(columns, index=pd.Index(self._names, name="figure"))

    @property
    def parameters(self) -> pd.DataFrame:
        """The numbers of the card by dotted key, as its file has them: value and standard error."""
        import pandas as pd

        rows = [
            (each.key, each.value * each.factor, each.standard_error * abs(each.factor))
            for each in self.found.parameters
        ]
        return pd.DataFrame(rows, columns=["parameter", "value", "standard_error"]).set_index("parameter")

    @property
    def coefficients(self) -> pd.DataFrame:
        """K %, the change of a figure (columns) for 10 % more of a number of the card (rows), by exact slopes."""
        return self._frame(self.found.exact)

    @property
    def differences(self) -> pd.DataFrame:
        """As :attr:`coefficients`, computed with 10 % more; nan where the changed ship does not show the figure."""
        return self._frame(self.found.difference)

    @property
    def variance_shares(self) -> pd.DataFrame:
        """Share of the variance of each figure (columns) that would go if a number (rows) were known exactly."""
        return self._frame(self.found.shares)

    def content(self) -> Mapping[str, object]:
        """As :meth:`.OldResult.content`."""
        ensemble = {"ensemble": asdict(self.bands)} if self.bands else {}
        return {**self.found.as_json(), **ensemble, "notices": self._notices}

    @property
    def headline(self) -> tuple[str, ...]:
        """Name of the ship and number of parameters."""
        return (f"{self.ship.name}: {len(self.found.parameters)} parameters",)

    @property
    def tables(self) -> tuple[Table, ...]:
        """Figures, coefficients, joint variation; bands of an ensemble."""
        bands = (band_table(self.bands, self.bands.figures),) if self.bands else ()
        return *_influence_tables(self.found), *bands

    @property
    def _names(self) -> list[str]:
        return [figure.text for figure in self.found.figures]

    def _card_notices(self) -> Sequence[str]:
        return ()

    def _frame(self, values: np.ndarray) -> pd.DataFrame:
        import pandas as pd

        index = pd.Index([each.key for each in self.found.parameters], name="parameter")
        return pd.DataFrame(values.T, index=index, columns=self._names)


class TuningResult(InfluenceResult):
    """A card tuned to figures, and its influence coefficients before.

    Parameters
    ----------
    ship : Ship
        Before.
    found : CardInfluence
    tuned : Tuned
    after : array (nf,)
        All figures of `found`, of the tuned ship.
    bands : FigureBands, optional
        Of an ensemble of the ship before.

    Examples
    --------
    >>> import tank2sim as t2s
    >>> tuning = t2s.load("mariner").tune("steady_radius_m@20=640", by="fewest")
    >>> list(tuning.moves.index)
    ['derivatives.Nd']
    >>> round(tuning.targets.loc["steady_radius_m@20=640", "after"])
    640
    """

    def __init__(
        self, ship: Ship, found: CardInfluence, tuned: Tuned, after: np.ndarray, bands: FigureBands | None = None
    ) -> None:
        self.tuned, self.after = tuned, after
        super().__init__(ship, found, bands)

    @property
    def reached(self) -> bool:
        """True if all targets are met."""
        return self.tuned.reached

    @property
    def card(self) -> Card:
        """The tuned card, with what of the covariance still holds; ``card.save("tuned.toml")`` writes it.

        Raises
        ------
        InputError
            The targets cannot be reached.
        """
        if not self.reached:
            remedy = "widen --within or state --bound, or give a nearer target"
            raise InputError(TARGET_OPTION, "", contradiction_text(self.tuned), remedy)
        return self._derived[0]

    @property
    def tuned_ship(self) -> Ship:
        """The ship of the tuned card. Raises as :attr:`card`."""
        return Ship(self.card)

    @property
    def targets(self) -> pd.DataFrame:
        """The targets by their text, in the units of the figures: value before and after."""
        import pandas as pd

        index = pd.Index([target.text for target in self.tuned.targets], name="target")
        return pd.DataFrame({"before": self.tuned.before, "after": self.tuned.after}, index=index)

    @property
    def moves(self) -> pd.DataFrame:
        """The numbers of the card that changed, as its file has them: before, after, the move in standard errors."""
        import pandas as pd

        rows = [
            (move.parameter.key, *_move_cells(move.parameter.factor, move.before, move.after), move.in_standard_errors)
            for move in self.tuned.moves
        ]
        return pd.DataFrame(rows, columns=["parameter", "before", "after", "standard_errors"]).set_index("parameter")

    def content(self) -> Mapping[str, object]:
        """As :meth:`.OldResult.content`."""
        figures = dict(zip(self._names, self.after.tolist(), strict=True))
        return {**super().content(), "tuned": self.tuned.as_json(figures)}

    @property
    def headline(self) -> tuple[str, ...]:
        """Name of the ship; what cannot be reached; how many times the joint variation was taken."""
        times = self.tuned.agreed_times
        return (
            *super().headline,
            *(() if self.reached else (contradiction_text(self.tuned),)),
            *(() if times is None else (f"the joint variation {times:+.3g} times",)),
        )

    @property
    def tables(self) -> tuple[Table, ...]:
        """Targets and moves, then those of :class:`InfluenceResult`."""
        tuned = self.tuned
        targets = zip(tuned.targets, tuned.before.tolist(), tuned.after.tolist(), strict=True)
        moves = [
            [
                move.parameter.short,
                *_move_cells(move.parameter.factor, move.before, move.after),
                move.in_standard_errors,
            ]
            for move in tuned.moves
        ]
        return (
            screen_table(
                "Tuning" if self.reached else "Nearest that can be reached",
                ("target", "before", "after"),
                [[target.text, before, after] for target, before, after in targets],
            ),
            screen_table(
                f"Parameters changed ({tuned.means.by}): {len(moves)}",
                ("", "before", "after", "standard errors"),
                moves[:ROWS],
            ),
            *super().tables,
        )

    @cached_property
    def _derived(self) -> tuple[Card, tuple[str, ...]]:
        card = self.ship.steered()
        return derived_card(card, tuned_text(card, self.tuned), _TUNED_CARD)

    def _card_notices(self) -> Sequence[str]:
        independent = (_INDEPENDENT,) if self.found.errors.together else ()
        return (*independent, *(self._derived[1] if self.reached else ()))


def influence_of_ship(
    ship: Ship, figures: Sequence[str], joint_variation: Mapping[str, float], ensemble: EnsembleOptions
) -> InfluenceResult:
    """Influence coefficients of a ship. Raises as :meth:`.Ship.influence`.

    Parameters
    ----------
    ship, figures, joint_variation
        As of :meth:`.Ship.influence`.
    ensemble : EnsembleOptions
        Of its bands.
    """
    card = ship.steered()
    asked = [parse_figure(text) for text in dict.fromkeys(figures)]
    if not asked:
        asked = craft_figures(card) if isinstance(card, CraftCard) else [parse_figure(text) for text in DEFAULT_FIGURES]
    study = Study(card, asked)
    return InfluenceResult(ship, influence(study, joint_variation), _bands(ship, study, ensemble))


def craft_figures(card: CraftCard) -> list[InfluenceFigure]:
    """Figures of a craft where none is given: top speed, a turn by half of the largest difference, and a spin.

    Parameters
    ----------
    card : CraftCard
    """
    names = {StraightRun: ["final_speed_mps"], DifferenceTurn: ["steady_diameter_m", "steady_rate_degps"]}
    trials = craft_trials([card]).values()
    return [
        parse_figure(f"{name}@{trial.words}")
        for trial in trials
        for name in names.get(type(trial), ["final_rate_degps"])
    ]


def tune_ship(
    ship: Ship, targets: Sequence[str], figures: Sequence[str], means: Means, ensemble: EnsembleOptions
) -> TuningResult:
    """Tune a ship's card to targets. Raises as :meth:`.Ship.tune`.

    Parameters
    ----------
    ship, targets, figures
        As of :meth:`.Ship.tune`.
    means : Means
        How the card may be changed.
    ensemble : EnsembleOptions
        Of the bands of its figures.
    """
    if not targets:
        raise InputError(TARGET_OPTION, "", "has no target", "give FIGURE=VALUE, as steady_radius_m@20=424")
    parsed: list[Target] = [parse_target(text) for text in targets]
    asked = [*(parse_figure(text) for text in figures), *(target.figure for target in parsed)]
    study = Study(ship.steered(), list(dict.fromkeys(asked)))
    tuned = tune(study, parsed, means)
    found = influence(study, means.agreed)
    return TuningResult(ship, found, tuned, study.figures_at(tuned.values), _bands(ship, study, ensemble))


def _bands(ship: Ship, study: Study, ensemble: EnsembleOptions) -> FigureBands | None:
    if not ensemble.members:
        return None
    names = [figure.text for figure in study.figures]
    with ensemble.computing(FEW_IN_LANES) as executor:
        return named_bands(ship.manoeuvring(), names, EnsembleRequest(ensemble.members, ensemble.seed), executor)


def contradiction_text(tuned: Tuned) -> str:
    """Which targets cannot be reached, and the nearest that can."""
    names = [target.text for target in tuned.contradiction]
    pairs = zip(tuned.targets, tuned.after, strict=True)
    nearest = ", ".join(f"{target.figure.text} {value:.5g}" for target, value in pairs)
    what = f"{names[0]} cannot be reached" if len(names) == 1 else f"{' and '.join(names)} contradict each other"
    return f"{what} within the bounds; the nearest is {nearest}"


def _move_cells(factor: float, before: float, after: float) -> tuple[float, float]:
    return before * factor, after * factor


def _influence_tables(found: CardInfluence) -> list[Table]:
    figures = screen_table(
        "Figures",
        ("figure", "value", "standard error", "most of it from"),
        [
            [figure.text, float(found.values[row]), float(found.standard_errors[row]), _largest_shares(found, row)]
            for row, figure in enumerate(found.figures)
        ],
        (found.of_errors[:1].upper() + found.of_errors[1:],),
    )
    tables = [figures, *_coefficient_tables(found)]
    if joint := found.agreed:
        columns = zip(joint.predicted, joint.predicted_by_difference, joint.direct, strict=True)
        tables.append(
            screen_table(
                "Joint variation, change in %",
                ("figure", "sum of Kc K, exact", "by differences", "direct"),
                [[figure.text, *row] for figure, row in zip(found.figures, columns, strict=True)],
            )
        )
    return tables


def _coefficient_tables(found: CardInfluence) -> list[Table]:
    """Coefficients of the most influential parameters, a few figures in each table."""
    exact, difference = found.exact, found.difference
    largest = np.nan_to_num(np.abs(exact)).max(axis=0)
    order = [place for place in np.argsort(-largest, kind="stable") if largest[place] > 0][:ROWS]
    count = len(found.figures)
    each = -(-count // -(-count // TABLE_FIGURES))  # as even as it goes
    return [
        screen_table(
            "K %: change for 10 % more, by exact slopes | by the 10 % difference",
            ("", *(figure.text.replace("@", "\n@") for figure in found.figures[first : first + each])),
            [
                [
                    found.parameters[k].short,
                    *(_pair(exact[row, k], difference[row, k]) for row in range(first, min(first + each, count))),
                ]
                for k in order
            ],
        )
        for first in range(0, count, each)
    ]


def _pair(exact: float, difference: float) -> str:
    return " | ".join(f"{round(value, 2) + 0.0:+.2f}" if math.isfinite(value) else "-" for value in (exact, difference))


def _largest_shares(found: CardInfluence, row: int) -> str:
    shares = found.shares[row]
    return ", ".join(
        f"{found.parameters[k].short} {100 * shares[k]:.0f} %" for k in np.argsort(-shares)[:3] if shares[k]
    )
