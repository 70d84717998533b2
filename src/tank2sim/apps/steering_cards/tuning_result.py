"""Result of ``influence --through``: hull and rudder scaled until the steady turns meet two points."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

from tank2sim.answer.parts import Cell, KeyFigure, Section, Table, data_frame, quantities, table
from tank2sim.answer.result import Result
from tank2sim.apps.steering_cards.two_point_tuning import TwoPointStudy, TwoPointTuning
from tank2sim.cards import Card

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True, eq=False, repr=False)
class TurnTuningResult(Result[TwoPointStudy]):
    """A ship whose steady turns go through two points.

    Parameters
    ----------
    study : TwoPointStudy
    ship : Ship, optional
        The ship before (:class:`tank2sim.Ship`); None if the result was read from its JSON.
    card : Card, optional
        The scaled card, with the part of the covariance that still holds; ``card.save("tuned.toml")`` writes it.

    Examples
    --------
    >>> import tank2sim as t2s
    >>> found = t2s.load("mariner").tune_through(["35@35", "1400m@3"])
    >>> [round(radius) for radius in found.turns["radius_after_m"]][1]
    1400
    """

    study: TwoPointStudy
    ship: Any = None
    card: Card | None = None
    command: ClassVar[str] = "influence"

    @property
    def title(self) -> str:
        """The ship."""
        return f"{self.study.ship}: tuned to two turns"

    @property
    def subtitle(self) -> str:
        """The two points."""
        return f"Points: {' and '.join(self.study.points)}"

    @property
    def hull_factor(self) -> float:
        """The static moment is divided by it, the damping multiplied: above 1 the ship is steadier."""
        return self.study.hull_factor

    @property
    def rudder_factor(self) -> float:
        """All terms of the rudder are multiplied by it."""
        return self.study.rudder_factor

    @property
    def tuned_ship(self) -> Any:
        """The ship of the scaled card (:class:`tank2sim.Ship`); None if the result was read from its JSON."""
        return type(self.ship)(self.card) if self.card else None

    @property
    def turns(self) -> pd.DataFrame:
        """Both turns: rudder (deg), yaw rate (deg/min) and radius (m) before and after; + to starboard."""
        columns = ["rudder_deg", "rate_before_degpmin", "rate_after_degpmin", "radius_before_m", "radius_after_m"]
        return data_frame(_turn_rows(self.study), columns=columns)

    @property
    def headline(self) -> tuple[str, ...]:
        """The factors, and whether the ship has become stable or unstable on a straight course."""
        hull, rudder = self.study.hull_factor, self.study.rudder_factor
        return (
            f"{self.study.ship}: both points are met with a hull factor of {hull:.4g} and a rudder factor of "
            f"{rudder:.4g}.",
            *stability_change(self.study),
        )

    @property
    def key_figures(self) -> Sequence[KeyFigure]:
        """The two factors."""
        return [
            KeyFigure("Hull factor", self.hull_factor, note="above 1 the ship is steadier"),
            KeyFigure("Rudder factor", self.rudder_factor, note="all terms of the rudder"),
        ]

    @property
    def sections(self) -> Sequence[Section]:
        """Both turns, and the scaled parameters."""
        return [
            Section("Turns", text=TUNING_TEXT, tables=[turn_table(self.study)]),
            Section(
                "Scaled parameters",
                tables=[quantities("Parameters of the model", self.study.parameters, on_screen=False)],
            ),
        ]


TUNING_TEXT = (
    "A steadier hull (static moment divided, damping multiplied by one factor) and a better rudder are found so that "
    "two points of the steering diagram are met."
)


def _turn_rows(tuning: TwoPointTuning) -> list[list[Cell]]:
    """Both turns: rudder (deg), yaw rate before and after (deg/min), radius before and after (m)."""
    return [
        [after.rudder_deg, before.yaw_rate_degpmin, after.yaw_rate_degpmin, before.radius_m, after.radius_m]
        for before, after in zip(tuning.before, tuning.after, strict=True)
    ]


def turn_table(tuning: TwoPointTuning) -> Table:
    """Return both turns before and after."""
    heads = ("rudder (deg)", "rate before (deg/min)", "rate after (deg/min)", "radius before (m)", "radius after (m)")
    return table("Turns before and after, positive to starboard", heads, _turn_rows(tuning))


def stability_change(tuning: TwoPointTuning) -> tuple[str, ...]:
    """Return a sentence if scaling made the ship stable or unstable on a straight course."""
    if tuning.course_stable_before == tuning.course_stable_after:
        return ()
    verdict = "stable" if tuning.course_stable_after else "unstable"
    return (f"The factors that meet the two points make the ship {verdict} on a straight course.",)
