"""Study of a ship's heading controller: gains, margins at several speeds, course changes, weather."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np

from tank2sim.analysis.heading.designs import LARGEST_RUDDER_RAD, HeadingDesign, LqrWeights, design_heading
from tank2sim.analysis.heading.disturbances import (
    Weather,
    angles_in_degrees,
    in_weather,
    wave_yaw_acceleration,
    weather_for,
)
from tank2sim.analysis.heading.margins import (
    LargestSteps,
    LoopMargins,
    LoopResponse,
    growing_effects,
    largest_steps,
    loop_margins,
    loop_response,
)
from tank2sim.analysis.heading.piloted import Piloted, PilotStudy
from tank2sim.analysis.heading.runs import (
    CourseChange,
    CourseKeeping,
    CraftKeeping,
    HeadingLoop,
    course_change,
    course_keeping,
    without_anti_windup,
)
from tank2sim.analysis.heading.track_keeping import Guidance, TrackRun, keep_track
from tank2sim.arrays import Array, Columns
from tank2sim.cards.card import ManoeuvringCard, SteeredCard
from tank2sim.dynamics.autopilot_loop import YAW_DISTURBANCE
from tank2sim.dynamics.effects import undisturbed_inputs
from tank2sim.dynamics.model import Model
from tank2sim.errors import ArgumentError, InputError
from tank2sim.notices import Notice, caution
from tank2sim.simulation.trajectory import Trajectory
from tank2sim.simulation.trial_file import histories

INTEGRAL_SHARE = 0.25
"""Share of the integral in the line of sight: critically damped
(:class:`tank2sim.analysis.heading.track_keeping.Guidance`)."""

_CHANGE_TIMES = 60
"""Length of a course change in 1/w, w = sqrt(K/T): six times the slowest placed mode.

Project choice: the change has settled then.
"""
_KEEPING_TIMES = 120
"""Length of course keeping in 1/w; figures use its later half."""

_WAVES_SHOWN = 40
"""Interval of the histories of course keeping. Project choice: it shows single waves."""

HELD_DEG = 10.0
"""Heading error, mean or root mean square, from which a course is not held. Project choice: in seas that a ship can
stand an autopilot keeps within a few degrees."""

_BUSY_PERCENT = 10.0
"""Share of the time at full rate from which a notice reports that waves overload the gear.

Project choice: well above what a calm sea needs.
"""

_BEGUN_AT = "the runs begin at {:g} m/s, with the engine as it is at the card's speed"


@dataclass(frozen=True, kw_only=True)
class StudySettings:
    """Settings of the study.

    Parameters
    ----------
    kind : str
        One of :data:`tank2sim.analysis.heading.designs.DESIGNS`.
    speed_mps : float, optional
        Speed of the design; by default the expansion speed.
    weights : LqrWeights
        Weights of the LQR.
    wave_filter_radps : float, optional
        Frequency of the wave filter of the PID.
    course_change_rad : float
        The ordinary change of course, positive to starboard.
    large_change_rad : float
        A change of course that takes the rudder to its limit, to show the anti-windup.
    weather : mapping
        Fields of :class:`Weather` that replace the defaults; None: the defaults.
    waypoints : array (n, 2), optional
        A track to keep, m.
    """

    kind: str = "pid"
    speed_mps: float | None = None
    weights: LqrWeights = field(default_factory=LqrWeights)
    wave_filter_radps: float | None = None
    course_change_rad: float = math.radians(20.0)
    large_change_rad: float = math.radians(90.0)
    weather: Mapping[str, float | None] = field(default_factory=dict)
    waypoints: Array | None = None

    @property
    def start(self) -> dict[str, float]:
        """Parameters of a start at the speed of the design."""
        return {} if self.speed_mps is None else {"initial.u": self.speed_mps}


@dataclass(frozen=True, kw_only=True)
class ShipAlone:
    """The ship at the speed of the design, without a controller: Nomoto's K and T, and the rudder of its straight
    course (deg, positive to starboard)."""

    speed_mps: float
    stable: bool
    rudder_deg: float
    K_per_s: float
    T_s: float


@dataclass(frozen=True, kw_only=True)
class ClosedLoop:
    """Motion of the ship under its controller.

    Parameters
    ----------
    largest_steps : LargestSteps
        At the speed of the design.
    course_changes : dict
        Figures by run: ``change``, ``large``, ``large without anti-windup`` (with an integral).
    course_keeping : CourseKeeping
        In current, wind and waves.
    """

    largest_steps: LargestSteps
    course_changes: dict[str, CourseChange]
    course_keeping: CourseKeeping


@dataclass(frozen=True, eq=False, kw_only=True)
class AutopilotStudy(PilotStudy):
    """A heading controller, its margins and its runs; gains in rad of rudder for rad of heading, and s.

    Parameters
    ----------
    design : str
        Way of design.
    limits : dict
        ``largest_rudder_deg``, and with an integral ``anti_windup_time_s`` and ``integral_band_deg`` (for designs with
        their own states ``integral_limit_radps``, the band times its gain).
    margins : tuple of LoopMargins
        At the speed of the design, then at others, all with the gains of the design.
    responses : tuple of LoopResponse
        At the speed of the design, and at the slowest and the fastest of `margins`.
    """

    design: str
    limits: dict[str, float]
    ship_alone: ShipAlone
    margins: tuple[LoopMargins, ...]
    responses: tuple[LoopResponse, ...]
    closed_loop: ClosedLoop


def _limits(autopilot: Model) -> dict[str, float]:
    """Limits of the controller by name."""
    names = {
        "autopilot.max_rudder": "largest_rudder_rad",
        "autopilot.anti_windup_time": "anti_windup_time_s",
        "autopilot.integral_band": "integral_band_rad",
        "autopilot.integral_limit": "integral_limit_radps",
    }
    found = {names[one.name]: one.start for one in autopilot.parameters if one.name in names}
    if "autopilot.integral" not in autopilot:
        found.pop("anti_windup_time_s", None)
    return angles_in_degrees(found)


def _histories(runs: Mapping[str, Trajectory], weather: Weather) -> dict[str, Columns]:
    """Histories of the runs by name; course keeping shows the last waves alone, so that single ones remain visible."""
    last = runs["keeping"].t[-1] - _WAVES_SHOWN * 2 * math.pi / weather.wave_radps
    return {name: histories(run, last if name == "keeping" else 0.0) for name, run in runs.items()}


@dataclass(frozen=True, eq=False)
class WeatherRuns:
    """Course keeping on course 0 in current, wind and waves, and tracks in the same current and wind.

    `loop`: ship and autopilot with inputs of the weather; `run`: the course keeping; `notices`: of the ship.
    """

    weather: Weather
    loop: HeadingLoop
    run: Trajectory
    tracks: Mapping[str, TrackRun]
    waypoints_m: Array
    notices: tuple[Notice, ...]

    @staticmethod
    def of(ship: Model, card: SteeredCard, autopilot: Model, settings: StudySettings, duration_s: float) -> WeatherRuns:
        """Keep course for `duration_s`, and the track of the settings, if there is one.

        Raises
        ------
        InputError
            As :func:`keep_track` and :meth:`HeadingLoop.run`.
        """
        weather = weather_for(card.ship.length_m, **settings.weather)
        outside, inputs = in_weather(ship, card, weather)
        loop = HeadingLoop(outside, autopilot)
        if settings.speed_mps is not None and "speed.command" in loop.model:
            inputs["speed.command"] = settings.speed_mps
        step = loop.model.step_s
        waves = wave_yaw_acceleration(weather, step, round(duration_s / step))
        order: dict[str, float | Array] = {**inputs, YAW_DISTURBANCE: waves, "heading.command": 0.0}
        return WeatherRuns(
            weather=weather,
            loop=loop,
            run=loop.run(order, len(waves) * step, parameters=settings.start),
            tracks=_keep_tracks(loop, settings.waypoints, inputs),
            waypoints_m=np.zeros((0, 2)) if settings.waypoints is None else settings.waypoints,
            notices=outside.notices,
        )

    @property
    def reported(self) -> dict[str, Any]:
        """Fields of :class:`.PilotStudy`."""
        return {
            "weather": angles_in_degrees(asdict(self.weather)),
            "track": {name: track.figures for name, track in self.tracks.items()},
            "waypoints_m": self.waypoints_m,
            "track_histories": {name: track.histories() for name, track in self.tracks.items()},
        }

    @property
    def unfinished(self) -> list[Notice]:
        """Notices on tracks that were not sailed to their ends."""
        lost = [name for name, track in self.tracks.items() if not track.figures.finished]
        return [Notice(f"the track is not finished, {name}") for name in lost]


def study_autopilot(card: ManoeuvringCard, ship: Model, settings: StudySettings) -> tuple[AutopilotStudy, Piloted]:
    """Design a heading controller and test it.

    Parameters
    ----------
    card, ship : ManoeuvringCard, Model
        The card, and the model built of it.

    Raises
    ------
    InputError
        As :func:`design_heading`, :func:`keep_track` and :meth:`HeadingLoop.run`; or the loop is not stable.
    """
    only = card.model.kind == "linear"
    _refuse_fixed_speed(card, settings.speed_mps if only else None)
    design = _design(ship, settings)
    margins, notices = _margins(ship, design, settings.speed_mps, design_speed_only=only)
    if not margins[0].stable:
        raise _not_stable(ship, design, settings.speed_mps)
    unit = math.sqrt(design.found.nomoto.dimensional.T_s / design.found.nomoto.dimensional.K_per_s)
    outside = WeatherRuns.of(ship, card, design.autopilot, settings, _KEEPING_TIMES * unit)
    runs, changes = _changes(outside.loop, design, settings, _CHANGE_TIMES * unit)
    runs["keeping"] = outside.run
    kept = course_keeping(outside.run, 0.0, outside.run.t[-1] / 2)
    begin = len(outside.run.t) // 2
    later = {name: float(np.mean(outside.run[name][begin:])) for name in ("motion.u", "rudder.angle")}
    alone = design.found
    study = AutopilotStudy(
        ship=alone.ship,
        design=design.kind,
        source=design.source,
        gains=dict(design.gains),
        limits=_limits(design.autopilot),
        ship_alone=ShipAlone(
            speed_mps=alone.operating_point.speed_mps,
            stable=alone.stability_criterion.stable,
            rudder_deg=alone.operating_point.rudder_deg,
            K_per_s=alone.nomoto.dimensional.K_per_s,
            T_s=alone.nomoto.dimensional.T_s,
        ),
        margins=margins,
        responses=_responses(ship, design, margins),
        closed_loop=ClosedLoop(
            largest_steps=largest_steps(ship, design.autopilot, settings.speed_mps),
            course_changes=changes,
            course_keeping=kept,
        ),
        histories=_histories(runs, outside.weather),
        notices=(
            *not_held(kept, outside.weather, later["motion.u"], later["rudder.angle"]),
            *outside.notices,
            *notices,
            *([] if settings.speed_mps is None else [Notice(_BEGUN_AT.format(settings.speed_mps))]),
            *_notices(margins, runs, changes),
            *outside.unfinished,
            *_of_the_gear(ship, design, kept, outside.weather),
        ),
        **outside.reported,
    )
    return study, Piloted(ship, design.autopilot, runs)


def not_held(
    kept: CourseKeeping | CraftKeeping, weather: Weather, speed_mps: float, rudder_rad: float | None = None
) -> list[Notice]:
    """Marks of a weather in which the ship leaves its course, or is carried away.

    Parameters
    ----------
    kept : CourseKeeping or CraftKeeping
    speed_mps : float
        Mean speed through the water.
    rudder_rad : float, optional
        Mean rudder.
    """
    found = []
    if max(abs(kept.heading_error_mean_deg), kept.heading_error_rms_deg) > HELD_DEG:
        steered = "" if rudder_rad is None else f", with {math.degrees(rudder_rad):.3g} deg of rudder"
        found.append(
            caution(
                f"the ship cannot hold its course in a wind of {weather.wind_mps:.3g} m/s and a current of "
                f"{weather.current_mps:.3g} m/s: its mean heading error is {kept.heading_error_mean_deg:.3g} deg"
                f"{steered}; the figures of course keeping mean nothing."
            )
        )
    if weather.current_mps >= abs(speed_mps):
        found.append(
            caution(
                f"the current of {weather.current_mps:.3g} m/s is faster than the ship ({speed_mps:.3g} m/s through "
                "the water): it may hold its heading, but cannot hold a course over the ground."
            )
        )
    return found


def _keep_tracks(loop: HeadingLoop, waypoints: Array | None, inputs: Mapping[str, float]) -> dict[str, TrackRun]:
    """Runs along waypoints (n, 2) by guidance without and with an integral; empty without waypoints."""
    if waypoints is None:
        return {}
    shares = {"line of sight": 0.0, "with integral": INTEGRAL_SHARE}
    return {name: keep_track(loop, waypoints, Guidance(integral_share=share), inputs) for name, share in shares.items()}


def _refuse_fixed_speed(card: ManoeuvringCard, speed: float | None) -> None:
    card_speed = card.model.speed_mps
    if speed is not None and abs(speed / card_speed - 1) > 1e-6:
        problem = f"{speed:g} m/s is not the speed of {card.ship.name}, whose forces are linear"
        raise ArgumentError("speed_mps", "", problem, f"leave it out: a linear card holds at {card_speed:g} m/s alone")


def _not_stable(ship: Model, design: HeadingDesign, speed: float | None) -> InputError:
    problem = f"the loop of the {design.kind} design is not stable"
    if growing := growing_effects(ship, speed):
        problem += f": the ship's own motion in {', '.join(growing)} grows, with the rudder fixed, too"
        return ship.fault("effects", problem, "check the parameters of the effect that it belongs to")
    return ship.fault("", problem, "choose another design, or check the steering gear of the card")


def _design(ship: Model, settings: StudySettings) -> HeadingDesign:
    return design_heading(
        ship,
        settings.kind,
        speed_mps=settings.speed_mps,
        weights=settings.weights,
        wave_filter_radps=settings.wave_filter_radps,
    )


def _margins(
    ship: Model, design: HeadingDesign, speed: float | None, *, design_speed_only: bool
) -> tuple[tuple[LoopMargins, ...], list[Notice]]:
    """Margins at the speed of the design and at five across the card's range, and notices of speeds without any."""
    values = ship.defaults
    design_speed = values["ship.speed"] if speed is None else speed
    found, notices = [loop_margins(ship, design.autopilot, design_speed)], []
    if design_speed_only:
        return tuple(found), [
            Notice(f"margins at {design_speed:.4g} m/s alone: a linear card does not hold at other speeds")
        ]
    for card_speed in np.linspace(values["ship.slowest"], values["ship.fastest"], 5).tolist():
        if abs(card_speed / design_speed - 1) < 1e-6:
            continue
        try:
            found.append(loop_margins(ship, design.autopilot, card_speed))
        except InputError as error:  # the polynomial of a card may lose its rudder at an end of its range
            notices.append(Notice(f"no margins at {card_speed:.4g} m/s: {error.problem}"))
    return tuple(found), notices


def _responses(ship: Model, design: HeadingDesign, margins: tuple[LoopMargins, ...]) -> tuple[LoopResponse, ...]:
    first, speeds = margins[0], [margin.speed_mps for margin in margins]
    shown = dict.fromkeys((first.speed_mps, min(speeds), max(speeds)))
    return tuple(loop_response(ship, design.autopilot, speed, first.crossover_radps) for speed in shown)


def _changes(
    loop: HeadingLoop, design: HeadingDesign, settings: StudySettings, duration: float
) -> tuple[dict[str, Trajectory], dict[str, CourseChange]]:
    """Changes of course in calm water, without wind."""
    calm, start = undisturbed_inputs(loop.model), settings.start
    courses = {"change": (settings.course_change_rad, start), "large": (settings.large_change_rad, start)}
    if bare := without_anti_windup(design.autopilot):
        courses["large without anti-windup"] = (settings.large_change_rad, {**start, **bare})
    begin = loop.kept_course(calm, duration, start)
    runs = {
        name: loop.run({**calm, "heading.command": order}, duration, parameters=values, begin=begin)
        for name, (order, values) in courses.items()
    }
    return runs, {name: course_change(run, courses[name][0]) for name, run in runs.items()}


def _notices(
    margins: tuple[LoopMargins, ...],
    runs: Mapping[str, Trajectory],
    changes: Mapping[str, CourseChange],
) -> list[Notice]:
    notices = [
        caution(f"the loop is not stable at {margin.speed_mps:.4g} m/s") for margin in margins if not margin.stable
    ]
    notices += [
        Notice(f"the course change {name!r} is not settled after {runs[name].t[-1]:.0f} s")
        for name, change in changes.items()
        if change.settling_time_s is None
    ]
    return notices


def _of_the_gear(ship: Model, design: HeadingDesign, kept: CourseKeeping, weather: Weather) -> list[Notice]:
    """Notices on the load of the gear in waves, and on limits of the autopilot below the gear's."""
    notices: list[str] = []
    if kept.rate_limited_percent is None:
        notices.append(
            caution(
                "the card states no largest rate of the steering gear, and nothing limits the rudder, which moves at "
                f"{kept.rudder_travel_degps:.3g} deg/s in the mean; state steering_gear.max_rate_degps on the card"
            )
        )
    elif kept.rate_limited_percent > _BUSY_PERCENT:
        remedy = f"wave_filter_radps={weather.wave_radps:.3g}"
        remedy += "" if design.kind == "pid" else ' with design="pid"'
        filtered = "wave_filter_radps" in design.gains
        notices.append(
            f"keeping a course in waves the rudder is at full rate {kept.rate_limited_percent:.0f} % of the time: "
            + ("the waves are more than this gear can follow" if filtered else f"{remedy} lets it rest")
        )
    limit = ship.defaults.get("steering.max_angle", 0.0)
    if limit > LARGEST_RUDDER_RAD * (1 + 1e-9):
        notices.append(
            f"the autopilot orders no more than {math.degrees(LARGEST_RUDDER_RAD):.0f} deg of rudder, the angle that "
            f"SOLAS II-1, regulation 29, requires of a gear; this gear goes to {math.degrees(limit):.3g} deg"
        )
    return [text if isinstance(text, Notice) else Notice(text) for text in notices]
