"""Stability and turning of a craft with thrusters as a result."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING

from tank2sim.analysis.stability.craft import CraftAtSpeed, CraftStability, SteadyCraftTurn, craft_stability
from tank2sim.answer.parts import Table
from tank2sim.api.result import OldResult, screen_table
from tank2sim.api.stability import four_digits
from tank2sim.cards import CraftCard
from tank2sim.units import from_si

if TYPE_CHECKING:
    from tank2sim.api.ship import Ship

STRAIGHT_FROM_LENGTHS = 100.0
"""Diameter over length of a loop from which it is called nearly straight. Project choice: it turns the craft by a
degree for each length, which wind, waves and errors of a few per cent in its coefficients do as well."""

NO_RUDDER = "the criteria of IMO MSC.137(76) and the spirals are of a rudder, and are not judged"


class CraftStabilityResult(OldResult):
    """Straight-line stability, surge and turning of a craft with thrusters at both sides.

    Parameters
    ----------
    ship : Ship
    study : CraftStability
        SI and radians.

    Examples
    --------
    >>> import tank2sim as t2s
    >>> t2s.load("otter").stability().stable
    True
    """

    command = "stability"

    def __init__(self, ship: Ship, study: CraftStability) -> None:
        self.ship = ship
        self.study: CraftStability = study
        self.notices = (*ship.model.notices, NO_RUDDER)

    @property
    def stable(self) -> bool:
        """True if the craft holds a straight course with its revolutions held: every mode decays."""
        return self.study.run.stable

    @property
    def _length_m(self) -> float:
        card = self.ship.card
        assert isinstance(card, CraftCard)
        return card.ship.length_m

    @property
    def nearly_straight(self) -> bool:
        """True if the craft, with no difference of revolutions, holds a straight course or a loop wider than
        :data:`STRAIGHT_FROM_LENGTHS`.
        """
        turns = self.study.turns
        alone = turns[0] if turns and not turns[0].difference_radps else None
        return self.stable or (alone is not None and alone.diameter_m > STRAIGHT_FROM_LENGTHS * self._length_m)

    def content(self) -> Mapping[str, object]:
        """As :meth:`.OldResult.content`."""
        study = self.study
        return {
            "ship": study.name,
            "straight_run": study.run.as_json(),
            "nearly_straight": self.nearly_straight,
            "speeds": [run.as_json() for run in study.speeds],
            "highest_speed_mps": study.highest_speed_mps,
            "difference_turns": [
                {
                    "difference_rpm": from_si("n_rpm", turn.difference_radps),
                    "speed_mps": turn.speed_mps,
                    "yaw_rate_degps": math.degrees(turn.yaw_rate_radps),
                    "drift_deg": math.degrees(turn.drift_rad),
                    "diameter_m": turn.diameter_m,
                }
                for turn in study.turns
            ],
            "notices": list(self.notices),
        }

    @property
    def headline(self) -> tuple[str, ...]:
        """Stability on a straight course, the time constant of surge, and the fastest steady turn."""
        study, run = self.study, self.study.run
        verdict = "stable" if run.stable else "unstable"
        surge = "" if run.surge_time_constant_s is None else f"; surge time constant {run.surge_time_constant_s:.3g} s"
        unstable = [one.speed_mps for one in study.speeds if not one.stable]
        others = f"; at {', '.join(f'{speed:.3g}' for speed in unstable)} m/s it is unstable" if unstable else ""
        lines = [
            f"{study.name} at {run.speed_mps:.4g} m/s ({from_si('n_rpm', run.revolutions_radps):.4g} rpm) is {verdict} "
            f"on a straight course, revolutions held{surge}{others}"
        ]
        if study.turns and not study.turns[0].difference_radps:
            lines.append(_left_alone(study.turns[0], self._length_m))
        if study.turns and (last := study.turns[-1]).difference_radps:
            lines.append(
                f"Steady turns: up to {math.degrees(last.yaw_rate_radps):.3g} deg/s, {last.diameter_m:.3g} m wide, at "
                f"{from_si('n_rpm', last.difference_radps):.4g} rpm of difference"
            )
        return tuple(lines)

    @property
    def tables(self) -> tuple[Table, ...]:
        """Eigenvalues, Nomoto's model and surge by speed, and steady turns by difference."""
        study, run = self.study, self.study.run
        eigenvalues = screen_table(
            "Eigenvalues of surge, sway and yaw",
            ("real (1/s)", "imaginary (1/s)", "time constant (s)"),
            four_digits([value.real, value.imag, -1 / value.real if value.real else None] for value in run.eigenvalues),
        )
        by_speed = screen_table(
            "By speed; K: deg/s by 100 rpm of port less starboard, times in s",
            ("m/s", "rpm", "stable", "surge", "K", "T", "T1", "T2", "T3"),
            four_digits(_row(one) for one in sorted((run, *study.speeds), key=lambda one: one.speed_mps)),
        )
        turns = screen_table(
            f"Steady turns about {from_si('n_rpm', run.revolutions_radps):.4g} rpm",
            ("difference (rpm)", "yaw rate (deg/s)", "speed (m/s)", "drift (deg)", "diameter (m)"),
            four_digits(
                [
                    from_si("n_rpm", turn.difference_radps),
                    math.degrees(turn.yaw_rate_radps),
                    turn.speed_mps,
                    math.degrees(turn.drift_rad),
                    turn.diameter_m,
                ]
                for turn in study.turns
            ),
        )
        return eigenvalues, by_speed, turns


def _left_alone(turn: SteadyCraftTurn, length_m: float) -> str:
    """What an unstable craft does without a difference of revolutions."""
    if turn.diameter_m > STRAIGHT_FROM_LENGTHS * length_m:
        per_length = math.degrees(2 * length_m / turn.diameter_m)
        return f"Left alone it stays nearly straight: it settles on a curve of {per_length:.1g} deg for each length"
    rate = math.degrees(turn.yaw_rate_radps)
    return f"It turns by itself, to either side: {rate:.3g} deg/s, {turn.diameter_m:.3g} m wide"


def _row(run: CraftAtSpeed) -> list[object]:
    per_100_rpm = math.degrees(run.K) * 100 / from_si("n_rpm", 1.0)
    times = (run.T_s, run.T1_s, run.T2_s, run.T3_s)
    return [
        *(run.speed_mps, from_si("n_rpm", run.revolutions_radps), run.stable, run.surge_time_constant_s, per_100_rpm),
        *times,
    ]


def judge_craft_stability(ship: Ship, speed_mps: float | None) -> CraftStabilityResult:
    """Stability of a craft. Raises as :meth:`.Ship.stability`."""
    assert isinstance(ship.card, CraftCard)
    return CraftStabilityResult(ship, craft_stability(ship.card, speed_mps))
