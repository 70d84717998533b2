"""Results of ``autopilot``: a heading controller of a ship, and one of heading and speed of a craft with thrusters."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar, Literal, Self, TypeVar

import numpy as np

from tank2sim.analysis.heading.craft import CraftAutopilotStudy
from tank2sim.analysis.heading.designs import INTEGRAL_BAND_RAD
from tank2sim.analysis.heading.margins import LoopResponse
from tank2sim.analysis.heading.piloted import AutopilotExport, Piloted
from tank2sim.analysis.heading.runs import CourseKeeping, CraftKeeping
from tank2sim.analysis.heading.study import HELD_DEG, AutopilotStudy
from tank2sim.answer.charts.analysis import (
    FrequencyResponse,
    PolesZeros,
    bode_chart,
    nyquist_chart,
    pole_zero_chart,
    sensitivity_chart,
)
from tank2sim.answer.charts.curves import Plot, PlotSeries, curve_chart
from tank2sim.answer.charts.motion import History, Signal, TrackData, history_chart, track_chart
from tank2sim.answer.charts.vega import PlotAxis, Rule
from tank2sim.answer.numbers import format_number
from tank2sim.answer.parts import (
    Cell,
    Illustration,
    KeyFigure,
    Section,
    Verdict,
    data_frame,
    quantities,
    records_table,
    table,
)
from tank2sim.answer.result import Result
from tank2sim.errors import InputError
from tank2sim.files import FMU, refuse_other_ending, write_together
from tank2sim.simulation.trial_file import trial_columns

if TYPE_CHECKING:
    import pandas as pd

HIGHEST_PEAK = 2.0
"""Ms above which a loop is thought to be weak: Astrom & Hagglund (2006), Advanced PID Control, take 1.2 to 2."""

_HEADING = Signal("psi_deg", "heading", "deg")
_SPEED = Signal("u_mps", "surge velocity", "m/s")
_SIGNALS = (_HEADING, Signal("delta_deg", "rudder", "deg"), Signal("r_degps", "yaw rate", "deg/s"))

_KEPT = {
    "heading_error_deg2s": "integral_of_squared_heading_error_deg2s",
    "rudder_deg2s": "integral_of_squared_rudder_angle_deg2s",
    "rudder_travel_degps": "mean_rudder_rate_degps",
    "rate_limited_percent": "rate_limit_reached_percent",
    "at_limit_percent": "a_thruster_at_its_limit_percent",
}
"""Figures of course keeping whose names do not say enough, and names that do."""

_S = TypeVar("_S", AutopilotStudy, CraftAutopilotStudy)


@dataclass(frozen=True, eq=False, repr=False)
class ResultWithController(Result[_S]):
    """A result whose controller can be written as an FMU.

    Parameters
    ----------
    study : dataclass
    piloted : Piloted, optional
        The ship, the controller and the motions; None if the result was read from its JSON.
    files : mapping
        The FMU by its path, if one was made.
    """

    study: _S
    piloted: Piloted | None = None
    files: Mapping[Path, bytes] = field(default_factory=dict)
    command: ClassVar[str] = "autopilot"

    @property
    def subtitle(self) -> str:
        """How the controller was found."""
        return self.study.source

    @property
    def gains(self) -> dict[str, float]:
        """Figures of the controller by name with its unit."""
        return dict(self.study.gains)

    @property
    def runs(self) -> dict[str, pd.DataFrame]:
        """The motions by name, one row a step, with the columns of a trial file: ``t_s``, ``psi_deg``, ``x_m``, ..."""
        motions = self.piloted.runs if self.piloted else {}
        return {name: data_frame(trial_columns(run)) for name, run in motions.items()}

    def make_fmu(
        self,
        path: str | Path,
        *,
        fmi: Literal[2, 3] = 2,
        verify: bool = False,
        report: Callable[[str], None] = lambda _: None,
    ) -> Self:
        """The result with the FMU of the controller in :attr:`files`; it is not written yet.

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
            No compiler is found, or the result was read from its JSON, which has no model.
        """
        from tank2sim.fmu.autopilot import make_autopilot_fmu, verify_together  # takes most of a second to import

        if self.piloted is None:
            raise InputError(path, "", "the JSON of a result has no model to export", "design the autopilot again")
        autopilot = self.piloted.autopilot
        made = make_autopilot_fmu(autopilot, self.study.source, fmi=fmi, file=Path(path), report=report)
        compared = None
        if verify:
            report("co-simulating ship and autopilot")
            compared = verify_together(self.piloted.ship, autopilot, made)
        export = AutopilotExport(
            path=str(path),
            fmi=made.fmi,
            model_identifier=made.model_identifier,
            token=made.token,
            platforms=made.platforms,
            size_bytes=len(made.content),
            co_simulation=compared,
        )
        return replace(self, study=replace(self.study, export=export), files={Path(path): made.content})

    def to_fmu(self, path: str | Path, *, fmi: Literal[2, 3] = 2, verify: bool = False) -> Self:
        """Write the FMU of the controller, and return the result with it.

        Parameters
        ----------
        path, fmi, verify
            As of :meth:`make_fmu`.

        Raises
        ------
        InputError
            As :meth:`make_fmu`; or the file cannot be written.
        """
        refuse_other_ending(Path(path), FMU)
        found = self.make_fmu(path, fmi=fmi, verify=verify)
        origin = self.piloted.ship.origin if self.piloted else ""
        write_together(found.files, inputs=[Path(origin)])
        return found

    def _tracks(self) -> list[Section]:
        """The track that was kept, if one was given."""
        if not self.study.track:
            return []
        study, runs, points = self.study, self.study.track_histories.items(), self.study.waypoints_m
        sailed: list[TrackData] = [
            TrackData(name, x_m=one["x_m"], y_m=one["y_m"], time_s=one["t_s"]) for name, one in runs
        ]
        wanted: list[TrackData] = [
            TrackData(label, x_m=points[:, 0], y_m=points[:, 1], time_s=np.zeros(len(points)), measured=measured)
            for label, measured in (("legs", False), ("waypoints", True))
        ]
        errors = [PlotSeries(name, x=one["t_s"], y=one["cross_track_error_m"]) for name, one in runs]
        plot = Plot(errors, up=PlotAxis("cross-track error (m)"), height_px=220, rules=[Rule([0.0])])
        apart = curve_chart(plot, PlotAxis("time (s)", nice=False), title="Cross-track error", window=["x"])
        section = Section(
            "Track keeping",
            text="Line of sight with lookahead, in the current and the wind of the course keeping. Errors leap at the "
            "end of a leg, where the next one begins to count; errors on legs are taken from the second half of each.",
            tables=[
                records_table(
                    "Cross-track errors, positive to starboard", study.track, first="guidance", fields=_TRACK, digits=3
                )
            ],
            charts=[Illustration(track_chart([*sailed, *wanted], title="Track and its legs")), Illustration(apart)],
        )
        return [section]

    def _keeping(self, kept: CourseKeeping | CraftKeeping, chart: Illustration, **more: float) -> Section:
        """The weather of the course keeping, its figures with `more`, and its histories."""
        weather, figures = self.study.weather, asdict(kept) | more
        caption = f"Course keeping, over the last {figures.pop('duration_s'):.0f} s"
        text = (
            f"Steering north in a current of {weather['current_mps']:.3g} m/s towards "
            f"{weather['current_towards_deg']:.0f} deg, wind of {weather['wind_mps']:.3g} m/s from "
            f"{weather['wind_from_deg']:.0f} deg, and waves of {weather['wave_radps']:.3g} rad/s that alone would "
            f"yaw the ship by {weather['wave_yaw_deg']:.3g} deg (standard deviation); seed {weather['seed']:.0f}."
        )
        shown = {_KEPT.get(name, name): value for name, value in figures.items()}
        return Section("Course keeping", text=text, tables=[quantities(caption, shown)], charts=[chart])

    def _drawn(self, title: str, signals: Sequence[Signal], *names: str, until_s: float = math.inf) -> Illustration:
        """Signals of runs over time."""
        drawn = []
        for name in names:
            columns = self.study.histories[name]
            shown = columns["t_s"] <= until_s
            values = {signal.name: columns[signal.name][shown] for signal in signals}
            drawn.append(History(name, time_s=columns["t_s"][shown], values=values))
        return Illustration(history_chart(drawn, signals, title=title))

    def _fmu_line(self) -> tuple[str, ...]:
        """The FMU in a line, if there is one."""
        export = self.study.export
        return (f"{export.path}: FMI {export.fmi}, {export.size_bytes / 1000:.0f} kB",) if export else ()

    def _fmu(self) -> list[Section]:
        """The section on the FMU, if there is one."""
        if (export := self.study.export) is None:
            return []
        facts: dict[str, Cell] = {"fmi": export.fmi, "model_identifier": export.model_identifier, "token": export.token}
        facts["size_bytes"] = export.size_bytes
        tables = [quantities("The controller as an FMU", facts, on_screen=False)]
        if found := export.co_simulation:
            caption = f"Ship and autopilot co-simulated, against one model: order {found.order:.2f}"
            words = {"step_s": "communication step", "error_deg": "largest difference of heading"}
            tables.append(records_table(caption, found.steps, fields=words))
        return [Section("FMU", tables=tables)]

    @property
    def cross_track(self) -> pd.DataFrame:
        """Figures of the track by guidance, m and s; empty without a track."""
        return data_frame({name: asdict(one) for name, one in self.study.track.items()}).T


@dataclass(frozen=True, eq=False, repr=False)
class AutopilotResult(ResultWithController[AutopilotStudy]):
    """A heading controller of a ship: gains, margins at several speeds, course changes, weather, tracks.

    Parameters as for :class:`ResultWithController`, with the study :class:`.AutopilotStudy`.
    """

    subject: ClassVar[str] = "heading autopilot"

    @property
    def margins(self) -> pd.DataFrame:
        """Margins by speed (m/s), the first at the speed of the design; infinite ones have no limit."""
        return data_frame([asdict(one) for one in self.study.margins], index="speed_mps").drop(columns="poles")

    @property
    def course_changes(self) -> pd.DataFrame:
        """Figures of the changes of course by name: rise and settling time (s), overshoot and largest rudder (deg)."""
        return data_frame({name: asdict(one) for name, one in self.study.closed_loop.course_changes.items()}).T

    @property
    def course_keeping(self) -> dict[str, float]:
        """Figures of course keeping in current, wind and waves, deg and s."""
        return asdict(self.study.closed_loop.course_keeping)

    @property
    def headline(self) -> tuple[str, ...]:
        """The course change, course keeping, and the margin of the loop."""
        study, loop = self.study, self.study.closed_loop
        if unstable := [f"{one.speed_mps:.3g}" for one in study.margins if not one.stable]:
            return (f"The loop is unstable at {', '.join(unstable)} m/s.", f"{study.source}.")
        change, kept = loop.course_changes["change"], loop.course_keeping
        share = kept.rate_limited_percent
        settled = "does not settle in the run," if change.settling_time_s is None else _settles(change.settling_time_s)
        weather = f"In weather the heading is {kept.heading_error_rms_deg:.2g} deg off (rms)"
        if max(abs(kept.heading_error_mean_deg), kept.heading_error_rms_deg) <= HELD_DEG:
            weather += (
                f", by {kept.rudder_rms_deg:.2g} deg of rudder. Mean rudder rate {kept.rudder_travel_degps:.2g} deg/s, "
                + ("no rate limit is stated" if share is None else f"rate limit reached {share:.2g} % of the time")
            )
        return (
            f"A change of course by {change.ordered_deg:.3g} deg {settled} with {change.overshoot_deg:.2g} deg of "
            f"overshoot. {weather}. The loop has {study.margins[0].phase_margin_deg:.3g} deg of phase margin.",
            f"{study.source}.",
            *self._fmu_line(),
        )

    @property
    def key_figures(self) -> Sequence[KeyFigure]:
        """Overshoot, heading error, margins."""
        first, margins, loop = self.study.margins[0], self.study.margins, self.study.closed_loop
        change, stable = loop.course_changes["change"], sum(one.stable for one in margins)
        return [
            KeyFigure("Overshoot", change.overshoot_deg, "deg", note=f"in a change by {change.ordered_deg:.3g} deg"),
            KeyFigure("Heading error", loop.course_keeping.heading_error_rms_deg, "deg", note="rms, in weather"),
            KeyFigure("Phase margin", first.phase_margin_deg, "deg"),
            KeyFigure(
                "Peak of sensitivity, Ms",
                first.sensitivity_peak,
                verdict=Verdict.PASSED if first.sensitivity_peak <= HIGHEST_PEAK else Verdict.CAUTION,
                note=f"no more than {HIGHEST_PEAK:g}",
                limit=HIGHEST_PEAK,
            ),
            KeyFigure("Delay margin", first.delay_margin_s, "s"),
            KeyFigure(
                "Stable",
                f"{stable} of {len(margins)}",
                verdict=Verdict.PASSED if stable == len(margins) else Verdict.FAILED,
                note="speeds" if len(margins) > 1 else "speed of the design",
            ),
        ]

    @property
    def sections(self) -> Sequence[Section]:
        """Course changes, the track, course keeping, the loop, the controller and its FMU."""
        return [
            self._course_changes(),
            *self._tracks(),
            self._keeping(
                self.study.closed_loop.course_keeping, self._histories("Course keeping, the last waves", "keeping")
            ),
            self._loop(),
            self._controller(),
            *self._fmu(),
        ]

    def _course_changes(self) -> Section:
        changes = self.study.closed_loop.course_changes
        large = [name for name in changes if name.startswith("large")]
        return Section(
            "Course changes",
            text="On the nonlinear model with the limits of the gear, in calm water, from a course that the autopilot "
            f"has kept: it holds the {self.study.ship_alone.rudder_deg:.3g} deg of rudder that the ship needs for it.",
            tables=[records_table("Course changes", changes, first="run", fields=_CHANGES, digits=3)],
            charts=[
                self._histories(
                    f"Course change by {changes['change'].ordered_deg:.3g} deg",
                    "change",
                    caption="Up to twice the settling time.",
                ),
                self._histories(
                    "A change that takes the rudder to its limit",
                    *large,
                    caption="Without anti-windup the integral fills while the rudder is at its limit: the ship swings "
                    "past.",
                ),
            ],
        )

    def _loop(self) -> Section:
        margins, steps = self.study.margins, self.study.closed_loop.largest_steps
        near = [pole for pole in margins[0].poles if abs(pole) < 5 * margins[0].crossover_radps]
        limits = {"rate of the gear": steps.within_rate_deg, "largest rudder": steps.within_angle_deg}
        linear = [f"{step:.3g} deg ({name})" for name, step in limits.items() if math.isfinite(step)]
        poles = [PolesZeros(f"{margins[0].speed_mps:.3g} m/s", poles=near)]
        return Section(
            "Loop",
            text="The ship with its steering gear, linearised at each speed, and the gains of the design."
            + (f" Changes of course stay linear up to {' and '.join(linear)}." if linear else ""),
            tables=[records_table("Margins, the first at the speed of the design", margins, fields=_MARGINS, digits=3)],
            charts=[
                *self._responses(),
                Illustration(
                    pole_zero_chart(poles, title="Poles of the closed loop"),
                    caption="Poles as slow as the ship are shown; the poles of the gear lie farther to the left.",
                ),
            ],
        )

    def _responses(self) -> list[Illustration]:
        loops, curves, first = [], [], self.study.responses[0]
        for one in self.study.responses:
            loops.append(_from_the_near_end(one))
            sensitivity = FrequencyResponse(
                f"S, {one.speed_mps:.3g} m/s", omega_radps=one.omega_radps, response=1 / (1 + one.loop)
            )
            curves.append(sensitivity)
        label = f"heading by its order, {first.speed_mps:.3g} m/s"
        curves.append(FrequencyResponse(label, omega_radps=first.omega_radps, response=first.heading))
        peak = self.study.margins[0].sensitivity_peak
        return [
            Illustration(bode_chart(loops, title="Loop transfer"), caption="Broken at the rudder order."),
            Illustration(
                nyquist_chart(loops, peak, title="Nyquist curve"),
                caption="Cross: the critical point. Red: the circle 1/Ms about it.",
            ),
            Illustration(
                sensitivity_chart(curves, title="Sensitivity and closed loop"),
                caption="Where S is above 0 dB the loop amplifies. Waves should lie to the right of its peak.",
            ),
        ]

    def _controller(self) -> Section:
        alone, limits = self.study.ship_alone, self.study.limits
        text = (
            f"The ship at {alone.speed_mps:.4g} m/s: K = {alone.K_per_s:.4g} 1/s, T = {alone.T_s:.4g} s, "
            f"{'stable' if alone.stable else 'unstable'} on a straight course by itself.\n\n"
            f"The rudder is ordered up to {limits['largest_rudder_deg']:.3g} deg either way."
        )
        if "anti_windup_time_s" in limits:
            text += (
                f" The integral takes up to {math.degrees(INTEGRAL_BAND_RAD):.3g} deg of a heading error: a larger one "
                "is a change of course, no disturbance, and would fill it and make the ship swing past. While the "
                "rudder is at its limit the integral is emptied, with a time constant of "
                f"{limits['anti_windup_time_s']:.3g} s."
            )
        return Section("Controller", text=text, tables=[quantities("Gains", self.study.gains)], folded=True)

    def _histories(self, title: str, *names: str, caption: str = "") -> Illustration:
        """Heading, rudder and yaw rate of runs; changes of course up to twice the time in which all settle."""
        changes = self.study.closed_loop.course_changes
        settled = [changes[name].settling_time_s if name in changes else None for name in names]
        until = max(math.inf if seconds is None else 2 * seconds for seconds in settled)
        return replace(self._drawn(title, _SIGNALS, *names, until_s=until), caption=caption)


_CHANGES = {
    "ordered_deg": "",
    "rise_time_s": "",
    "overshoot_deg": "",
    "settling_time_s": "",
    "largest_rudder_deg": "",
    "rate_limited_s": "at full rate",
}
_TRACK = {
    "length_m": "",
    "duration_s": "time",
    "finished": "",
    "largest_error_m": "",
    "rms_error_m": "",
    "largest_error_on_legs_m": "largest on legs",
    "mean_error_at_end_m": "at the end, mean",
}
_MARGINS = {
    "speed_mps": "",
    "gain_margin_up": "gain may grow by",
    "gain_margin_down": "and fall to",
    "phase_margin_deg": "",
    "delay_margin_s": "",
    "sensitivity_peak": "Ms",
    "bandwidth_radps": "",
    "stable": "",
}


@dataclass(frozen=True, eq=False, repr=False)
class CraftAutopilotResult(ResultWithController[CraftAutopilotStudy]):
    """The autopilot of a craft with fixed thrusters: gains, poles, a change of course and one of speed.

    Parameters as for :class:`ResultWithController`, with the study :class:`.CraftAutopilotStudy`.
    """

    subject: ClassVar[str] = "autopilot of heading and speed"

    @property
    def headline(self) -> tuple[str, ...]:
        """Changes of course and speed, and the thrusters at their limits."""
        course, speed = self.study.course_change, self.study.speed_change
        turned = f"A change of course by {course.ordered:.3g} deg"
        more = (f"{self.study.source}.", *self._fmu_line())
        if course.settling_time_s is None or speed.settling_time_s is None:
            return (f"{turned}, or one of speed by {speed.ordered:.3g} m/s, does not settle in the run.", *more)
        share = max(self.study.at_limit_percent[name] for name in ("course", "speed"))
        kept = f"In weather the heading is {self.study.course_keeping.heading_error_rms_deg:.2g} deg off (rms)"
        limit = f"A thruster is at its limit for {format_number(share, 2)} % of the time"
        limit = limit if share else "No thruster is at its limit"
        return (
            f"{turned} {_settles(course.settling_time_s)} with {course.overshoot:.2g} deg of overshoot, one of speed "
            f"by {speed.ordered:.3g} m/s in {speed.settling_time_s:.3g} s. {limit}. {kept}.",
            *more,
        )

    @property
    def key_figures(self) -> Sequence[KeyFigure]:
        """Overshoots, and settling times where the craft settles."""
        overshoots, settled = [], []
        changes = (("heading", "deg", self.study.course_change), ("speed", "m/s", self.study.speed_change))
        for words, unit, change in changes:
            note = f"in a change by {change.ordered:.3g} {unit}"
            overshoots.append(KeyFigure(f"Overshoot of {words}", change.overshoot, unit, note=note))
            if change.settling_time_s is not None:
                settled.append(KeyFigure(f"{words.capitalize()} settled", change.settling_time_s, "s", note=note))
        return [*overshoots, *settled]

    @property
    def sections(self) -> Sequence[Section]:
        """Changes of course and speed, the controller and its FMU."""
        return [
            self._changes(),
            *self._tracks(),
            self._keeping(
                self.study.course_keeping,
                self._drawn("Course keeping", [_HEADING, _SPEED, *self._revolutions], "keeping"),
                at_limit_percent=self.study.at_limit_percent["keeping"],
            ),
            self._controller(),
            *self._fmu(),
        ]

    @property
    def _revolutions(self) -> list[Signal]:
        names = sorted(name for name in self.study.histories["course"] if name.startswith("n_"))
        titles = [name.removeprefix("n_").removesuffix("_rpm").replace("_", " ") for name in names]
        return [Signal(name, title, "rpm") for name, title in zip(names, titles, strict=True)]

    def _changes(self) -> Section:
        study, turning = self.study, self._revolutions
        charts = [
            self._drawn("Change of course", [_HEADING, _SPEED, *turning], "course"),
            self._drawn("Change of speed", [_SPEED, *turning], "speed"),
        ]
        rows: list[list[Cell]] = [
            [
                f"{words}, {change.ordered:.3g} {unit}",
                *(change.rise_time_s, change.overshoot, change.settling_time_s, study.at_limit_percent[words]),
            ]
            for words, unit, change in (("course", "deg", study.course_change), ("speed", "m/s", study.speed_change))
        ]
        settling = ("rise time (s)", "overshoot (deg or m/s)", "settling time (s)")
        heads = ("change", *settling, "a thruster at its limit (%)")
        return Section(
            "Changes of course and speed",
            text="On the nonlinear craft in calm water, from a steady course.",
            charts=[replace(chart, half=True) for chart in charts],
            tables=[table("Changes of course and speed", heads, rows, digits=3)],
        )

    def _controller(self) -> Section:
        low, high = self.study.largest_moment_Nm
        drawn = [PolesZeros(f"{self.study.speed_mps:.3g} m/s", poles=self.study.poles)]
        return Section(
            "Controller",
            text=f"The largest yaw moment is {-low:.3g} N m to port and {high:.3g} N m to starboard; the surge force "
            "takes the thrust that is left. Thrusts become revolutions by the thrust curves of the card, at the "
            "present speed.",
            tables=[quantities("Gains", self.study.gains)],
            charts=[Illustration(pole_zero_chart(drawn, title="Poles of the closed loop"))],
        )


def _settles(seconds: float) -> str:
    return f"settles in {seconds:.3g} s"


def _from_the_near_end(response: LoopResponse) -> FrequencyResponse:
    """The loop in the order in which its phase, unwrapped from its first value, is the phase of the loop.

    Near the crossover of a stable loop it is between -180 and 0 deg. If both ends are beyond that (an unstable ship),
    the upper end is left out.
    """
    label, omega, value = f"{response.speed_mps:.3g} m/s", response.omega_radps, response.loop
    middle = int(np.argmin(np.abs(np.abs(value) - 1)))
    phase = np.unwrap(np.angle(value))
    phase -= 2 * math.pi * math.ceil((phase[middle] - math.pi) / (2 * math.pi))
    if abs(phase[0]) <= math.pi:
        return FrequencyResponse(label, omega_radps=omega, response=value)
    last = int(np.flatnonzero(np.abs(phase) < math.pi)[-1])
    return FrequencyResponse(label, omega_radps=omega[last::-1], response=value[last::-1])
