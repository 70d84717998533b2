"""An autopilot of heading and speed for a craft with thrusters: designed and tried, as a result with its FMU."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING

from tank2sim.analysis.heading.craft import CraftAutopilot, study_craft_autopilot
from tank2sim.analysis.heading.study import check_course_change
from tank2sim.answer.parts import Table
from tank2sim.api.autopilot import AutopilotFmu, ResultWithAutopilot
from tank2sim.api.result import screen_table
from tank2sim.api.ship import Ship
from tank2sim.cards import CraftCard
from tank2sim.dynamics.model import Model
from tank2sim.errors import InputError
from tank2sim.simulation.trial_file import histories, trial_columns

if TYPE_CHECKING:
    import pandas as pd


class CraftAutopilotResult(ResultWithAutopilot):
    """The autopilot of a craft with fixed thrusters: gains, poles, a change of course and one of speed.

    Parameters
    ----------
    ship : Ship
    study : CraftAutopilot
        SI and radians.
    fmu : AutopilotFmu, optional
        Of the autopilot, if one was made.
    """

    command = "autopilot"

    def __init__(self, ship: Ship, study: CraftAutopilot, fmu: AutopilotFmu | None = None) -> None:
        super().__init__(ship, fmu)
        self.study = study

    @property
    def controller(self) -> tuple[Model, str]:
        """As of every result with an FMU: the model of the controller, and how it was found."""
        return self.study.model, self.study.source

    @property
    def gains(self) -> dict[str, float]:
        """Gains by name: yaw moment (N m) by heading error and yaw rate, surge force (N) by speed error."""
        gains = self.study.as_json()["gains"]
        assert isinstance(gains, dict)
        return gains

    @property
    def runs(self) -> dict[str, pd.DataFrame]:
        """The motions ``course`` and ``speed``, one row a step, as a trial file has them."""
        import pandas as pd

        return {name: pd.DataFrame(trial_columns(run)) for name, run in self.study.runs.items()}

    def content(self) -> Mapping[str, object]:
        """As :meth:`.OldResult.content`."""
        export = {"export": self.fmu.as_json()} if self.fmu else {}
        return {
            "ship": self.ship.name,
            **self.study.as_json(),
            "histories": {name: histories(run) for name, run in self.study.runs.items()},
            "notices": list(self.notices),
            **export,
        }

    @property
    def headline(self) -> tuple[str, ...]:
        """How it was found, its largest yaw moment, and its FMU."""
        low, high = self.study.gains.largest_moment_Nm
        lines = [self.study.source, f"Yaw moment ordered up to {-low:.3g} N m to port and {high:.3g} N m to starboard"]
        if self.fmu:
            lines.append(self.fmu.text)
        return tuple(lines)

    @property
    def tables(self) -> tuple[Table, ...]:
        """Gains, and figures of the changes of course and speed."""
        study, limits = self.study, self.study.at_limit_share
        changes = (("course", study.course, math.degrees(1.0)), ("speed", study.speed, 1.0))
        rows: list[list[object]] = [
            [
                name,
                scale * figures.ordered,
                figures.rise_time_s,
                scale * figures.overshoot,
                figures.settling_time_s,
                100 * limits[name],
            ]
            for name, figures, scale in changes
        ]
        columns = ("change", "ordered", "rise (s)", "overshoot", "settled (s)", "a thruster at its limit (%)")
        tables = [
            screen_table("Controller", ("gain", "value"), list(self.gains.items())),
            screen_table("Changes of course (deg) and of speed (m/s)", columns, rows),
        ]
        if self.fmu and (compared := self.fmu.table):
            tables.append(compared)
        return tuple(tables)


def pilot_craft(ship: Ship, *, speed_mps: float | None, course_change_deg: float) -> CraftAutopilotResult:
    """Design the autopilot of a craft and try it. Raises as :meth:`.Ship.autopilot`.

    Parameters
    ----------
    ship : Ship
        With the card of a craft.
    speed_mps : float, optional
        Of the design and of its runs; by default that of the card.
    course_change_deg : float
        To try, + to starboard.
    """
    assert isinstance(ship.card, CraftCard)
    change = math.radians(course_change_deg)
    check_course_change(change)
    if speed_mps is not None and not 0 < speed_mps < math.inf:
        raise InputError("--speed", "", f"{speed_mps:g} m/s is not a speed ahead", "give a positive one")
    return CraftAutopilotResult(
        ship, study_craft_autopilot(ship.card, ship.model, speed_mps=speed_mps, course_change_rad=change)
    )
