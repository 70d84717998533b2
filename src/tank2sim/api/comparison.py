"""Cards of one ship compared, by coefficients and by trajectories, as a result."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from tank2sim.analysis.validation.coefficients import BEYOND_STANDARD_ERRORS
from tank2sim.analysis.validation.comparison import CardComparison, compare_cards
from tank2sim.analysis.validation.standard_trials import MEMBERS
from tank2sim.answer.parts import Table
from tank2sim.api.bounds import SmallEnsemble, checked
from tank2sim.api.result import OldResult, screen_table, section_charts
from tank2sim.api.ship import Ship, as_ship
from tank2sim.cards import Card, CraftCard, SteeredCard
from tank2sim.units import in_words

if TYPE_CHECKING:
    import altair as alt
    import pandas as pd

_MOST = 10
"""Coefficients of each card that the tables show; JSON and page have all. Project choice: they fit a screen."""

_SHOWN = ("advance_m", "tactical_diameter_m", "overshoot_1_deg", "overshoot_2_deg", "track_reach_m")
_SHOWN_OF_CRAFT = ("final_speed_mps", "steady_diameter_m", "steady_rate_degps", "final_rate_degps")


class ComparisonResult(OldResult):
    """Cards of one ship compared; the first is the reference.

    Parameters
    ----------
    cards : sequence of SteeredCard
    comparison : CardComparison
        In the convention and at the size of the reference.
    """

    command = "compare"

    def __init__(self, cards: Sequence[SteeredCard], comparison: CardComparison) -> None:
        self.ships, self.comparison = tuple(Ship(card) for card in cards), comparison
        self.notices = comparison.notices

    @property
    def labels(self) -> tuple[str, ...]:
        """Names of the cards in the tables, the reference first."""
        return self.comparison.labels

    @property
    def summary(self) -> pd.DataFrame:
        """By card but the reference (index): coefficients compared, the same number, beyond 2 standard errors, rms."""
        import pandas as pd

        found = self.comparison
        rows = [
            (label, len(found.in_errors(place)), found.same(place), found.beyond(place), found.rms(place))
            for place, label in self._others()
        ]
        columns = ["card", "compared", "same_number", "beyond_two_standard_errors", "rms_standard_errors"]
        return pd.DataFrame(rows, columns=columns).set_index("card")

    @property
    def coefficients(self) -> pd.DataFrame:
        """A row each coefficient and card but the reference, in the reference's convention (prime; of effects SI).

        Those of craft are in SI.

        ``difference_percent`` is in per cent of the reference's size, ``standard_errors`` the difference over the root
        of both variances; missing where they cannot be compared.
        """
        import pandas as pd

        rows = [
            (
                label,
                row.name,
                row.cards[0].value,
                row.cards[place].value,
                apart.percent,
                apart.standard_errors,
            )
            for place, label in self._others()
            for row in self.comparison.rows
            for apart in [row.differences[place - 1]]
        ]
        columns = ["card", "coefficient", "reference", "value", "difference_percent", "standard_errors"]
        return pd.DataFrame(rows, columns=columns)

    @property
    def figures(self) -> pd.DataFrame:
        """Figures of the standard trials, a row each with its card: value, standard deviation, difference from the
        reference, the same in standard errors; in the unit of the figure's name."""
        import pandas as pd

        rows = [
            (trial.name, row.name, label, row.values[place], row.deviations[place])
            + ((row.difference(place), row.in_errors(place)) if place else (None, None))
            for trial in self.comparison.trials
            for row in trial.figures
            for place, label in enumerate(self.labels)
        ]
        columns = ["trial", "figure", "card", "value", "standard_deviation", "difference", "standard_errors"]
        return pd.DataFrame(rows, columns=columns)

    def content(self) -> Mapping[str, object]:
        """As :meth:`.OldResult.content`."""
        return self.comparison.as_json()

    @property
    def headline(self) -> tuple[str, ...]:
        """Of each card how many coefficients differ from the reference's."""
        found, lines = self.comparison, []
        for place, label in self._others():
            rms, same = found.rms(place), found.same(place)
            rms_text = "" if rms is None else f", rms {rms:.3g} (1 by chance)"
            rms_text += f"; {same} more are the reference's own numbers" if same else ""
            lines.append(
                f"{label} against {self.labels[0]}: of {len(found.in_errors(place))} coefficients "
                f"{found.beyond(place)} differ by more than {BEYOND_STANDARD_ERRORS:g} standard errors{rms_text}"
            )
        return tuple(lines)

    @property
    def tables(self) -> tuple[Table, ...]:
        """Of each card the coefficients farthest from the reference, and the main figures of all."""
        shown = _SHOWN_OF_CRAFT if isinstance(self.ships[0].card, CraftCard) else _SHOWN
        figures = screen_table(
            "Figures (standard deviation)",
            ("trial", "figure", *self.labels),
            [
                [
                    trial.name,
                    " ".join(part for part in in_words(row.name) if part),
                    *map(_with_error, row.values, row.deviations),
                ]
                for trial in self.comparison.trials
                for row in trial.figures
                if row.name in shown
            ],
        )
        return *(self._farthest(place, label) for place, label in self._others()), figures

    def charts(self) -> dict[str, alt.TopLevelMixin]:
        """Differences in standard errors, and the tracks of each standard trial."""
        return section_charts(self.layout().sections)

    def _others(self) -> list[tuple[int, str]]:
        return list(enumerate(self.labels))[1:]

    def _farthest(self, place: int, label: str) -> Table:
        every = [(row, row.differences[place - 1]) for row in self.comparison.rows]
        known = [(abs(found.standard_errors), row, found) for row, found in every if found.standard_errors is not None]
        # Without any standard error (two languages) by their share.
        by_share = [(abs(found.percent), row, found) for row, found in every if found.percent]
        rows = sorted(known or by_share, key=lambda entry: -entry[0])
        columns = ("coefficient", self.labels[0], label, "difference (%)", "standard errors")
        cells = [
            [row.name, row.cards[0].value, row.cards[place].value, difference.percent, difference.standard_errors]
            for _, row, difference in rows[:_MOST]
        ]
        return screen_table(f"Farthest apart: {label}", columns, cells)


@checked
def compare(cards: Sequence[Ship | Card | str | Path], *, members: SmallEnsemble = MEMBERS) -> ComparisonResult:
    """Compare cards of one ship, or of ships and models of one form; the first is the reference, whose size is taken.

    Cards of a craft with thrusters are compared at its own size, by a straight run, turns by difference and a spin.

    Parameters
    ----------
    cards : sequence of Ship, Card, str or path
        Two or more (captive, trial, estimate: in any order).
    members : int
        Ships drawn within the errors of each card for the deviations of the figures; 0 for none.

    Raises
    ------
    InputError
        There is only one card, a card is not one of a ship or craft that manoeuvres, or both are mixed.

    Examples
    --------
    >>> import tank2sim as t2s
    >>> ship = t2s.load("mariner")
    >>> found = t2s.compare([ship, ship.replace({"derivatives.Yv": -0.012})], members=0)
    >>> changed = found.coefficients.query("difference_percent != 0").set_index("coefficient")
    >>> list(changed.index)
    ['Yv']
    """
    ships = [as_ship(card).steered() for card in ([cards] if isinstance(cards, str | Path) else cards)]
    return ComparisonResult(ships, compare_cards(ships, members))


def _with_error(value: float | None, error: float | None) -> str:
    if value is None:
        return "-"
    return f"{value:.4g}" + ("" if error is None else f" ({error:.3g})")
