"""A heading autopilot of a ship: designed, judged and tried, as a result with its FMU."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from copy import copy
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Self

import numpy as np

from tank2sim.analysis.heading.control import INTEGRAL_BAND_RAD
from tank2sim.analysis.heading.study import HELD_DEG, AutopilotStudy, StudySettings, check_settings, study_autopilot
from tank2sim.analysis.heading.track_keeping import check_waypoints, read_waypoints
from tank2sim.answer.parts import Table
from tank2sim.api.result import PagedResult, screen_table
from tank2sim.api.ship import Ship
from tank2sim.arrays import Array
from tank2sim.cards import ManoeuvringCard
from tank2sim.dynamics.model import Model
from tank2sim.errors import InputError
from tank2sim.files import write_together
from tank2sim.native.compiler import find_compiler
from tank2sim.simulation.integrator import NO_COMPILER
from tank2sim.simulation.trial_file import trial_columns

if TYPE_CHECKING:
    import pandas as pd

    from tank2sim.fmu.autopilot import LoopDifference
    from tank2sim.fmu.export import ExportedFmu


@dataclass(frozen=True)
class AutopilotFmu:
    """The FMU of a controller: where it goes, its content, and how co-simulation with the ship compares."""

    path: Path
    exported: ExportedFmu
    difference: LoopDifference | None

    def as_json(self) -> dict[str, object]:
        """As JSON has it."""
        compared = {"co_simulation": self.difference.as_json()} if self.difference else {}
        return {**self.exported.as_json(), **compared}

    @property
    def text(self) -> str:
        """Where it goes, its version of FMI, and its size."""
        return f"{self.path}: FMI {self.exported.fmi}, {len(self.exported.content) / 1000:.0f} kB"

    @property
    def table(self) -> Table | None:
        """The differences of the co-simulation, if there was one."""
        if self.difference is None:
            return None
        return screen_table(
            f"Ship and autopilot co-simulated, against one model: order {self.difference.order:.2f}",
            ("communication step (s)", "largest difference of heading (deg)"),
            [[step, error] for step, error in sorted(self.difference.error_deg.items())],
        )


class ResultWithAutopilot(PagedResult):
    """A result whose controller can be written as an FMU.

    Parameters
    ----------
    ship : Ship
        That it steers.
    fmu : AutopilotFmu, optional
        Of the controller, if one was made.
    """

    def __init__(self, ship: Ship, fmu: AutopilotFmu | None) -> None:
        self.ship, self.fmu = ship, fmu
        self.notices: tuple[str, ...] = () if find_compiler() else (NO_COMPILER,)

    @property
    def controller(self) -> tuple[Model, str]:
        """The model of the controller, and how it was found."""
        raise NotImplementedError

    def make_fmu(
        self,
        path: str | Path,
        *,
        fmi: int = 3,
        verify: bool = False,
        report: Callable[[str], None] = lambda _: None,
    ) -> Self:
        """The result with the FMU of the controller, which is not written yet.

        Parameters
        ----------
        path : path
            Where it goes.
        fmi : int
            2 or 3.
        verify : bool
            Co-simulate it with the FMU of the ship, and compare with both in one model.
        report : callable
            Called with the stage that begins.

        Raises
        ------
        InputError
            No compiler is found.
        """
        from tank2sim.fmu.autopilot import make_autopilot_fmu, verify_together  # takes most of a second to import

        autopilot, source = self.controller
        made = make_autopilot_fmu(autopilot, source, fmi=fmi, report=report)
        difference = None
        if verify:
            report("co-simulating ship and autopilot")
            difference = verify_together(self.ship.model, autopilot, made)
        found = copy(self)
        found.fmu = AutopilotFmu(Path(path), made, difference)
        return found

    def to_fmu(self, path: str | Path, *, fmi: int = 3, verify: bool = False) -> Self:
        """Write the FMU of the controller, and return the result with it.

        Parameters
        ----------
        path, fmi, verify
            As of :meth:`make_fmu`.

        Raises
        ------
        InputError
            No compiler is found, or the file cannot be written.
        """
        found = self.make_fmu(path, fmi=fmi, verify=verify)
        write_together(found.files, inputs=[Path(self.ship.card.source)])
        return found

    @property
    def files(self) -> dict[Path, str | bytes]:
        """The FMU by its path, if one was made."""
        return {self.fmu.path: self.fmu.exported.content} if self.fmu else {}


class AutopilotResult(ResultWithAutopilot):
    """A heading controller of a ship: gains, margins at several speeds, course changes, weather, tracks.

    Parameters
    ----------
    ship : Ship
    study : AutopilotStudy
        SI and radians.
    fmu : AutopilotFmu, optional
        Of the controller, if one was made.
    """

    command = "autopilot"

    def __init__(self, ship: Ship, study: AutopilotStudy, fmu: AutopilotFmu | None = None) -> None:
        super().__init__(ship, fmu)
        self.study = study
        self.notices = (*study.notices, *self.notices)

    @property
    def controller(self) -> tuple[Model, str]:
        """As of every result with an FMU: the model of the controller, and how it was found."""
        return self.study.design.autopilot, self.study.design.source

    @property
    def gains(self) -> dict[str, float]:
        """Figures of the controller by name; rad of rudder for rad of heading, and s."""
        return dict(self.study.design.gains)

    @property
    def margins(self) -> pd.DataFrame:
        """Margins of the loop by speed (m/s), the first that of the design: gain, phase (deg), delay (s), Ms."""
        import pandas as pd

        rows = [{**each.as_json(), "speed_mps": each.speed_mps} for each in self.study.margins]
        return pd.DataFrame(rows).drop(columns="poles").set_index("speed_mps")

    @property
    def course_changes(self) -> pd.DataFrame:
        """Figures of the changes of course by name: rise and settling time (s), overshoot and largest rudder (deg)."""
        import pandas as pd

        return pd.DataFrame({name: asdict(change) for name, change in self.study.changes.items()}).T

    @property
    def course_keeping(self) -> dict[str, float]:
        """Figures of course keeping in current, wind and waves, deg and s."""
        return asdict(self.study.keeping)

    @property
    def cross_track(self) -> pd.DataFrame:
        """Figures of the track by guidance, m and s; empty without a track."""
        import pandas as pd

        return pd.DataFrame({name: asdict(track.figures) for name, track in self.study.tracks.items()}).T

    @property
    def runs(self) -> dict[str, pd.DataFrame]:
        """The motions by name, one row a step: ``t_s``, ``delta_deg``, ``r_degps``, ``psi_deg``, ``x_m``, ``y_m``."""
        import pandas as pd

        return {name: pd.DataFrame(trial_columns(run)) for name, run in self.study.runs.items()}

    def content(self) -> Mapping[str, object]:
        """As :meth:`.OldResult.content`."""
        return {**self.study.as_json(), **({"export": self.fmu.as_json()} if self.fmu else {})}

    @property
    def headline(self) -> tuple[str, ...]:
        """How the controller was found, its limits, where it stays linear, course keeping, and its FMU."""
        study, kept = self.study, self.study.keeping
        rate, angle = (math.degrees(step) for step in (study.steps.within_rate_rad, study.steps.within_angle_rad))
        lines = [
            study.design.source,
            _limits_text(study.limits),
            f"Linear up to a step of {rate:.3g} deg (rate of the gear) and {angle:.3g} deg (angle)",
            f"Course keeping in current, wind and waves over {kept.duration_s:.0f} s: heading error "
            f"{kept.heading_error_rms_deg:.3g} deg rms (mean {kept.heading_error_mean_deg:.2g})",
        ]
        if max(abs(kept.heading_error_mean_deg), kept.heading_error_rms_deg) <= HELD_DEG:
            lines[-1] += (
                f", rudder {kept.rudder_rms_deg:.3g} deg rms, {kept.rudder_travel_degps:.3g} deg/s on the move, at "
                f"full rate {kept.rate_limited_percent:.3g} % of the time"
            )
        if self.fmu:
            lines.append(self.fmu.text)
        return tuple(lines)

    @property
    def tables(self) -> tuple[Table, ...]:
        """Gains, margins, course changes, tracks, and co-simulation with the ship."""
        study = self.study
        tables = [
            screen_table("Controller", ("figure", "value"), list(study.design.gains.items())),
            screen_table(
                "Margins with the steering gear, the first at the speed of the design",
                ("speed (m/s)", "gain up", "gain down to", "phase (deg)", "delay (s)", "Ms", "-3 dB (rad/s)", "stable"),
                [
                    [
                        margins.speed_mps,
                        *_three_digits(
                            margins.gain_margin_up,
                            margins.gain_margin_down,
                            margins.phase_margin_deg,
                            margins.delay_margin_s,
                            margins.sensitivity_peak,
                            margins.bandwidth_radps,
                        ),
                        margins.stable,
                    ]
                    for margins in study.margins
                ],
            ),
            screen_table(
                "Course changes",
                (
                    "run",
                    "ordered (deg)",
                    "rise (s)",
                    "overshoot (deg)",
                    "settled (s)",
                    "rudder (deg)",
                    "at full rate (s)",
                ),
                [[name, *vars(change).values()] for name, change in study.changes.items()],
            ),
        ]
        if study.tracks:
            columns = ("guidance", "length (m)", "time (s)", "finished", "largest (m)", "rms (m)", "on legs (m)")
            tracks = [[name, *vars(track.figures).values()] for name, track in study.tracks.items()]
            tables.append(screen_table("Cross-track error", (*columns, "stays (m)"), tracks))
        if self.fmu and (compared := self.fmu.table):
            tables.append(compared)
        return tuple(tables)


def pilot_ship(
    ship: Ship,
    settings: StudySettings,
    track: pd.DataFrame | Sequence[Sequence[float]] | Array | str | Path | None,
) -> AutopilotResult:
    """Design a heading controller and simulate it. Raises as :meth:`.Ship.autopilot`.

    Parameters
    ----------
    ship : Ship
        It is steered.
    settings : StudySettings
        Of the design and its runs.
    track : DataFrame, array, path or None
        Waypoints, as of :meth:`.Ship.autopilot`.
    """
    card = ship.card
    if not isinstance(card, ManoeuvringCard):
        raise InputError(
            card.source,
            "model.kind",
            "has no rudder",
            "an autopilot needs a ship with a rudder, or a craft with thrusters",
        )
    check_settings(settings)
    try:
        found = study_autopilot(card, ship.model, replace(settings, waypoints=_waypoints(track)))
    except InputError as fault:
        if not isinstance(track, str | Path) or fault.source != "--track":
            raise
        raise InputError(track, fault.place, fault.problem, fault.remedy) from None  # the library knows no file
    return AutopilotResult(ship, found)


def _waypoints(track: pd.DataFrame | Sequence[Sequence[float]] | Array | str | Path | None) -> Array | None:
    if track is None:
        return None
    if isinstance(track, str | Path):
        return read_waypoints(track)
    import pandas as pd

    try:
        table = track[["x_m", "y_m"]] if isinstance(track, pd.DataFrame) else track
        points = np.asarray(table, dtype=float)
    except (KeyError, TypeError, ValueError):
        points = np.zeros(0)
    if points.ndim != 2 or points.shape[1] != 2:
        raise InputError("--track", "", "is not a table of x_m and y_m", "give waypoints (n, 2), m north and east")
    check_waypoints(points, "--track", lambda row: f"waypoint {row + 1}")
    return points


def _limits_text(limits: Mapping[str, float]) -> str:
    text = f"Rudder ordered up to {limits['largest_rudder_deg']:.3g} deg"
    if "anti_windup_time_s" in limits:
        text += f"; the integral takes up to {math.degrees(INTEGRAL_BAND_RAD):.3g} deg of a heading error"
    return text


def _three_digits(*values: float) -> Iterable[float]:
    """More digits do not fit next to each other, and mean nothing of a margin."""
    return (float(f"{value:.3g}") for value in values)
