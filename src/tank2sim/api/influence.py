"""Influence coefficients of a ship's card, and the card tuned to figures."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from tank2sim.api.verbs import Output, named_numbers, verb
from tank2sim.arguments import PROCESSES, EnsembleSize, Seed, TuningRange
from tank2sim.errors import ArgumentError, InputError
from tank2sim.files import CARD
from tank2sim.notices import Notice

if TYPE_CHECKING:
    from tank2sim.analysis.ensemble.results import FigureBands
    from tank2sim.analysis.influence.card_influence import InfluenceStudy
    from tank2sim.analysis.influence.figures import InfluenceFigure
    from tank2sim.analysis.influence.study import Study
    from tank2sim.api.ensemble import EnsembleOptions
    from tank2sim.cards import SteeredCard
    from tank2sim.dynamics.vessel import Vessel
    from tank2sim.results.influence import InfluenceResult, TuningResult

DEFAULT_FIGURES = (
    "criterion_C",
    "steady_radius_m@20",
    "advance_m@35",
    "tactical_diameter_m@35",
    "overshoot_1_deg@20/20",
)
"""Figures where none is given. Project choice: one of each kind that is looked at most."""

_INDEPENDENT = (
    "tuning takes standard errors as if they were independent: its bounds, and what counts as a small move, leave out "
    "the covariance next to the card"
)


def _read_joint_variation(given: Sequence[str]) -> dict[str, float]:
    """Change in per cent by name, from words ``NAME=PERCENT`` and TOML files with a number by each name."""
    read = named_numbers("joint_variation", "Yv=0.62")
    found: dict[str, float] = {}
    for text in given:
        for name, value in (read([text]) if "=" in text else _percents_of_file(Path(text))).items():
            if name in found:
                raise ArgumentError("joint_variation", name, "is given twice", "give each parameter once")
            found[name] = value
    return found


def _percents_of_file(path: Path) -> dict[str, float]:
    from tank2sim.cards.reading import parsed_toml
    from tank2sim.files import read_exact_text

    if not path.is_file():
        remedy = "give, for example, Yv=0.62"
        raise ArgumentError("joint_variation", str(path), "is neither NAME=PERCENT nor a file", remedy)

    def flat(content: Mapping[str, object], section: str) -> dict[str, float]:
        found: dict[str, float] = {}
        for key, value in content.items():
            if isinstance(value, dict):
                found |= flat(value, f"{section}{key}.")
            elif isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value):
                found[section + key] = float(value)
            else:
                raise InputError(path, section + key, f"is {value!r}", "give a change in per cent")
        return found

    return flat(parsed_toml(read_exact_text(path), path), "")


def _read_bounds(given: Sequence[str]) -> dict[str, tuple[float, float]]:
    """Lowest and highest value by name, from words ``NAME=LOW..HIGH``."""
    found = {}
    for text in given:
        name, _, ends = text.partition("=")
        try:
            low, high = map(float, ends.split(".."))
        except ValueError:
            low = high = math.nan
        if not name.strip() or not (math.isfinite(low) and math.isfinite(high)):
            raise ArgumentError("bounds", text, "is not of the form NAME=LOW..HIGH", "give, as Yv=-0.013..-0.010")
        found[name.strip()] = low, high
    return found


def _refuse_empty(bounds: Mapping[str, tuple[float, float]]) -> None:
    for name, (low, high) in bounds.items():
        if not low < high:
            raise ArgumentError("bounds", name, "leaves no room", "give LOW..HIGH with LOW below HIGH")


@verb(
    "the card changed until figures have given values",
    Output("-o", CARD, "Write the tuned card.", lambda result, path: result.card.files(path), "CARD.toml"),
    options={"targets": "--tune"},
    texts={"joint_variation": _read_joint_variation, "bounds": _read_bounds},
    choices={"by": {"fewest": "the fewest parameters", "uncertain": "the least sum of squares, in standard errors"}},
)
def tune_ship(
    ship: Vessel,
    targets: str | Sequence[str],
    *,
    figures: str | Sequence[str] = (),
    by: Literal["fewest", "uncertain"] = "uncertain",
    within: TuningRange = 3.0,
    hold: Sequence[str] = (),
    bounds: Mapping[str, tuple[float, float]] | None = None,
    joint_variation: Mapping[str, float] | None = None,
    members: EnsembleSize = 0,
    seed: Seed = 0,
    executor: str = PROCESSES,
) -> TuningResult:
    """Change the card of a ship until figures have the values that a trial or a standard gives.

    Targets that contradict each other are a result, with the nearest figures that can be reached; it has no card.

    Parameters
    ----------
    ship : Vessel
    targets : str or sequence of str
        Change the card until figures have these values: ``steady_radius_m@20=424``, ``overshoot_1_deg@20/20<=25``,
        ``>=``.
    figures : str or sequence of str
        Further figures to compute, as of :func:`find_influence`.
    by : str
        Choice of the changes.
    within : float
        Bounds of each move, standard errors of the card.
    hold : sequence of str
        Parameters that do not change (``Nr``).
    bounds : mapping, optional
        Lowest and highest value by name, in the conventions of the card's file, in place of `within`:
        ``{"Yv": (-0.013, -0.010)}``, on the command line ``Yv=-0.013..-0.010``.
    joint_variation : mapping, optional
        Parameters that move only together, as of :func:`find_influence`.
    members : int
        Ships drawn from the standard errors of the card before tuning, as of :func:`find_influence`.
    seed : int
        Seed of the drawn ships.
    executor : str
        Where the drawn ships are simulated: ``processes`` of this machine, or a cluster, ``dask://host:port``.

    Raises
    ------
    InputError
        A target cannot be read, a name is unknown, or nothing is left to change.
    """
    from tank2sim.analysis.influence.card_influence import influence
    from tank2sim.analysis.influence.figures import parse_figure
    from tank2sim.analysis.influence.study import Study
    from tank2sim.analysis.tuning.result import Means, tuned_text
    from tank2sim.analysis.tuning.targets import parse_target
    from tank2sim.analysis.tuning.tune import tune
    from tank2sim.api.ensemble import EnsembleOptions
    from tank2sim.cards.covariance_reading import derived_card
    from tank2sim.dynamics.card_parameters import joint_errors
    from tank2sim.results.influence import TuningResult

    ensemble = EnsembleOptions(members, seed, executor)
    bounds = bounds or {}
    if not targets:
        raise ArgumentError("targets", "", "has no target", "give FIGURE=VALUE, as steady_radius_m@20=424")
    _refuse_empty(bounds)
    parsed = [parse_target(text) for text in _listed(targets)]
    asked = [*(parse_figure(text) for text in _listed(figures)), *(target.figure for target in parsed)]
    means = Means(by=by, within=within, hold=hold, bounds=bounds, agreed=joint_variation or {})
    card = ship.steered()
    study = Study(card, list(dict.fromkeys(asked)))
    tuned = tune(study, parsed, means)
    found = influence(study, means.agreed)
    changed, notices = derived_card(card, tuned_text(card, tuned), "the tuned card") if tuned.reached else (None, ())
    if joint_errors(card, study.parameters).together:
        notices = (Notice(_INDEPENDENT), *notices)
    reported = replace(_reported(found, notices), tuned=tuned, ensemble=_bands(ship, study, ensemble))
    return TuningResult(reported, ship, changed)


@verb(
    "sensitivity of manoeuvring figures; tuning",
    options={"figures": "--figures"},
    texts={"joint_variation": _read_joint_variation},
    variants={"tune": tune_ship},
    name="influence",
    results=("tank2sim.results.influence:InfluenceResult",),
)
def find_influence(
    ship: Vessel,
    figures: str | Sequence[str] = (),
    *,
    joint_variation: Mapping[str, float] | None = None,
    members: EnsembleSize = 0,
    seed: Seed = 0,
    executor: str = PROCESSES,
) -> InfluenceResult:
    """Find by how many per cent figures of a ship change for 10 % more of each number on its card.

    The coefficients come from exact slopes and from a difference of 10 %. On the command line the models of a steering
    card (``poznyakov-yudin``) are compared, and a card can be tuned.

    Parameters
    ----------
    ship : Vessel
    figures : str or sequence of str
        Figures to examine; by default one of each kind. On a straight course K_per_s, T_s, T1_s, T2_s, T3_s, K_prime,
        T_prime and criterion_C; in a steady turn with ``@20``, the rudder in deg, positive to starboard,
        steady_radius_m, steady_diameter_m, steady_rate_degps, steady_drift_deg, steady_speed_mps and
        speed_loss_percent; in a turning circle with ``@35`` advance_m, transfer_m, tactical_diameter_m,
        advance_lengths, tactical_diameter_lengths, time_90_s and time_180_s; in a zigzag with ``@20/20``
        overshoot_1_deg, overshoot_2_deg, overshoot_3_deg, overshoot_4_deg, initial_turning_distance_m,
        initial_turning_lengths and initial_turning_time_s. For a craft with thrusters, in rpm:
        final_speed_mps@straight:600; with ``@difference:200`` advance_m, transfer_m, tactical_diameter_m, time_90_s,
        time_180_s, steady_diameter_m, steady_rate_degps and steady_speed_mps; with ``@spin:400`` time_180_s,
        time_360_s and final_rate_degps.
    joint_variation : mapping, optional
        Changes in per cent of numbers that change together (Kc), by name: ``{"Yv": 0.62, "Nv": 1.7}``, on the command
        line ``Yv=0.62 Nv=1.7`` or a TOML file of them.
    members : int
        Ships drawn from the standard errors of the card, for bands of 5, 50 and 95 %: 100 for a first look, 2000 for
        figures to report; 0 for none.
    seed : int
        Seed of the drawn ships.
    executor : str
        Where the drawn ships are simulated: ``processes`` of this machine, or a cluster, ``dask://host:port``.

    Raises
    ------
    InputError
        A figure or a name is unknown, or the ship does not show a figure.
    """
    from tank2sim.analysis.influence.card_influence import influence
    from tank2sim.analysis.influence.figures import parse_figure
    from tank2sim.analysis.influence.study import Study
    from tank2sim.api.ensemble import EnsembleOptions
    from tank2sim.results.influence import InfluenceResult

    ensemble = EnsembleOptions(members, seed, executor)
    card = ship.steered()
    asked = [parse_figure(text) for text in dict.fromkeys(_listed(figures))]
    if not asked:
        asked = default_figures(card)
    study = Study(card, asked)
    reported = _reported(influence(study, joint_variation or {}))
    return InfluenceResult(replace(reported, ensemble=_bands(ship, study, ensemble)), ship)


def default_figures(card: SteeredCard) -> list[InfluenceFigure]:
    """Figures where none is given: of a ship usual ones, of a craft its top speed, turn and spin in standard trials."""
    from tank2sim.analysis.influence.figures import parse_figure
    from tank2sim.analysis.validation.standard_trials import craft_trials
    from tank2sim.cards import SteeredBy
    from tank2sim.simulation.thruster_manoeuvres import DifferenceTurn, StraightRun

    if card.steered_by is SteeredBy.RUDDER:
        return [parse_figure(text) for text in DEFAULT_FIGURES]
    names = {StraightRun: ["final_speed_mps"], DifferenceTurn: ["steady_diameter_m", "steady_rate_degps"]}
    trials = craft_trials([card]).values()
    return [
        parse_figure(f"{name}@{trial.words}")
        for trial in trials
        for name in names.get(type(trial), ["final_rate_degps"])
    ]


def _listed(texts: str | Sequence[str]) -> list[str]:
    return [texts] if isinstance(texts, str) else list(texts)


def _reported(found: InfluenceStudy, notices: Sequence[Notice] = ()) -> InfluenceStudy:
    """The study, with further notices."""
    from tank2sim.simulation.integrator import compiler_notices

    return replace(found, notices=tuple(dict.fromkeys([*found.notices, *notices, *compiler_notices()])))


def _bands(ship: Vessel, study: Study, ensemble: EnsembleOptions) -> FigureBands | None:
    from tank2sim.analysis.ensemble.results import named_bands
    from tank2sim.api.ensemble import FEW_IN_LANES

    names = [figure.text for figure in study.figures]
    return ensemble.drawn(lambda *request: named_bands(ship.steered(), names, *request), FEW_IN_LANES)
