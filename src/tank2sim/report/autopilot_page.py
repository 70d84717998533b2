"""The page of an autopilot: what it is, how much its loop bears, what it does in calm, in weather and on a track."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from tank2sim.analysis.heading.control import INTEGRAL_BAND_RAD
from tank2sim.analysis.heading.margins import LoopMargins, closed_loop_transfer, loop_transfer
from tank2sim.analysis.heading.study import AutopilotStudy
from tank2sim.dynamics.model import Model, Vector
from tank2sim.report.analysis_charts import FrequencyResponse, PolesZeros, bode_chart, pole_zero_chart
from tank2sim.report.autopilot_charts import (
    CrossTrack,
    cross_track_chart,
    nyquist_chart,
    sensitivity_chart,
)
from tank2sim.report.motion_charts import History, Signal, Track, history_chart, track_chart
from tank2sim.report.page import Cell, Column, Figure, Illustration, Page, Section, Table, Verdict
from tank2sim.simulation.trajectory import Trajectory

HIGHEST_PEAK = 2.0
"""Ms above which a loop is thought to be weak: Astrom & Hagglund (2006), Advanced PID Control, take 1.2 to 2."""

_DECADES = (-2.0, 1.3)
"""What frequencies are shown, in decades from the crossover."""

_WAVES_SHOWN = 40
"""Of course keeping: more are a smear."""

_SIGNALS = (
    Signal(name="motion.psi", title="heading", unit="rad"),
    Signal(name="rudder.angle", title="rudder", unit="rad"),
    Signal(name="motion.r", title="yaw rate", unit="rad/s"),
)


def autopilot_page(ship: Model, study: AutopilotStudy) -> Page:
    """The page.

    Parameters
    ----------
    ship : Model
        That the study is of, without its weather.
    study : AutopilotStudy
    """
    sections = [_controller(study), _loop(ship, study), _calm(study), _weather(study)]
    if study.tracks:
        sections.append(_track(study))
    if study.notices:
        sections.append(Section(heading="Notes", notes=study.notices))
    return Page(
        title=f"{study.design.found.name}: heading autopilot",
        subtitle=study.design.source,
        figures=_figures(study),
        sections=sections,
    )


def _figures(study: AutopilotStudy) -> list[Figure]:
    first, change = study.margins[0], study.changes["change"]
    peak = Verdict.PASSED if first.sensitivity_peak <= HIGHEST_PEAK else Verdict.CAUTION
    stable = all(one.stable for one in study.margins)
    return [
        Figure(label="Phase margin", value=first.phase_margin_deg, unit="deg"),
        Figure(label="Ms", value=first.sensitivity_peak, verdict=peak, note=f"no more than {HIGHEST_PEAK:g}"),
        Figure(label="Delay margin", value=first.delay_margin_s, unit="s"),
        Figure(
            label="Stable",
            value=f"{sum(one.stable for one in study.margins)} of {len(study.margins)}",
            verdict=Verdict.PASSED if stable else Verdict.FAILED,
            note="speeds" if len(study.margins) > 1 else "speed of the design",
        ),
        Figure(
            label="Overshoot",
            value=change.overshoot_deg,
            unit="deg",
            note=f"in a change by {change.ordered_deg:.3g} deg",
        ),
        Figure(label="Heading error", value=study.keeping.heading_error_rms_deg, unit="deg", note="rms, in weather"),
    ]


def _controller(study: AutopilotStudy) -> Section:
    rows: list[list[Cell]] = [[name, value] for name, value in study.design.gains.items()]
    nomoto = study.design.found.nomoto
    text = (
        f"The ship at {study.design.found.speed_mps:.4g} m/s: K = {nomoto.K_per_s:.4g} 1/s, T = {nomoto.T_s:.4g} s, "
        f"{'stable' if study.design.found.stable else 'unstable'} on a straight course by herself."
    )
    limits = study.limits
    text += f"\n\nThe rudder is ordered no further than {limits['largest_rudder_deg']:.3g} deg either way."
    if "anti_windup_time_s" in limits:
        text += (
            f" The integral takes no more than {math.degrees(INTEGRAL_BAND_RAD):.3g} deg of a heading error: what is "
            "larger is a change of course, no disturbance, and would fill it and make the ship swing past. While the "
            f"rudder is at its limit the integral is emptied, with a time constant of "
            f"{limits['anti_windup_time_s']:.3g} s."
        )
    return Section(
        heading="Controller",
        text=text,
        tables=[
            Table(
                caption="Figures of the controller", columns=[Column(title="figure"), Column(title="value")], rows=rows
            )
        ],
    )


def _loop(ship: Model, study: AutopilotStudy) -> Section:
    pilot, first = study.design.autopilot, study.margins[0]
    shown = sorted({first.speed_mps, min(_speeds(study)), max(_speeds(study))}, key=lambda v: v != first.speed_mps)
    loops, sensitivities = [], []
    for speed in shown:
        loop = loop_transfer(ship, pilot, speed)
        omega = first.crossover_radps * np.logspace(*_DECADES, 1500)
        value = np.asarray(loop(1j * omega)).ravel()
        label = f"{speed:.3g} m/s"
        loops.append(_from_the_near_end(label, omega, value))
        sensitivities.append(FrequencyResponse(label=f"S, {label}", omega_radps=omega, response=1 / (1 + value)))
        if speed == first.speed_mps:
            heading = np.asarray(closed_loop_transfer(ship, pilot, speed)(1j * omega))[0].ravel()
            closed = FrequencyResponse(label=f"heading by its order, {label}", omega_radps=omega, response=heading)
    poles = [PolesZeros(label=f"{one.speed_mps:.3g} m/s", poles=_shown_poles(one)) for one in study.margins[:1]]
    charts = [
        Illustration(chart=bode_chart(loops, title="Loop transfer"), caption="Broken at the rudder order."),
        Illustration(
            chart=nyquist_chart(loops, first.sensitivity_peak, title="Nyquist curve"),
            caption="Cross: the critical point. Red: the circle 1/Ms about it.",
        ),
        Illustration(
            chart=sensitivity_chart([*sensitivities, closed], title="Sensitivity and closed loop"),
            caption="S above 0 dB: what the loop makes worse. Waves should lie to the right of its peak.",
        ),
        Illustration(
            chart=pole_zero_chart(poles, title="Poles of the closed loop"),
            caption="Poles as slow as the ship are shown; those of the gear lie farther to the left.",
        ),
    ]
    steps = [math.degrees(one) for one in (study.steps.within_rate_rad, study.steps.within_angle_rad)]
    text = (
        "The ship with her steering gear, linearised at each speed, and the gains of the design. Changes of course "
        f"stay linear up to {steps[0]:.3g} deg (rate of the gear) and {steps[1]:.3g} deg (largest rudder)."
    )
    return Section(heading="Loop", text=text, tables=[_margins(study.margins)], charts=charts)


def _from_the_near_end(label: str, omega: Vector, value: NDArray[np.complex128]) -> FrequencyResponse:
    """The loop in the order in which its phase, unwrapped from its first value, is that of the loop.

    Near the crossover of a stable loop it is between -180 and 0 deg. Beyond that at both ends (an unstable ship), what
    is at the upper end is left out.
    """
    middle = int(np.argmin(np.abs(np.abs(value) - 1)))
    phase = np.unwrap(np.angle(value))
    phase -= 2 * math.pi * math.ceil((phase[middle] - math.pi) / (2 * math.pi))
    if abs(phase[0]) <= math.pi:
        return FrequencyResponse(label=label, omega_radps=omega, response=value)
    last = int(np.flatnonzero(np.abs(phase) < math.pi)[-1])
    return FrequencyResponse(label=label, omega_radps=omega[last::-1], response=value[last::-1])


def _speeds(study: AutopilotStudy) -> list[float]:
    return [one.speed_mps for one in study.margins]


def _shown_poles(margins: LoopMargins) -> list[complex]:
    return [pole for pole in margins.poles if abs(pole) < 5 * margins.crossover_radps]


def _margins(margins: Sequence[LoopMargins]) -> Table:
    columns = [
        Column(title="speed", unit="m/s"),
        Column(title="gain may grow by", digits=3),
        Column(title="and fall to", digits=3),
        Column(title="phase margin", unit="deg", digits=3),
        Column(title="delay margin", unit="s", digits=3),
        Column(title="Ms", digits=3),
        Column(title="bandwidth", unit="rad/s", digits=3),
        Column(title="stable"),
    ]
    rows: list[list[Cell]] = [
        [
            one.speed_mps,
            one.gain_margin_up if math.isfinite(one.gain_margin_up) else "any",
            one.gain_margin_down,
            one.phase_margin_deg,
            one.delay_margin_s,
            one.sensitivity_peak,
            one.bandwidth_radps,
            one.stable,
        ]
        for one in margins
    ]
    return Table(caption="Margins, the first at the speed of the design", columns=columns, rows=rows)


def _history(label: str, run: Trajectory, begin_s: float = 0.0) -> History:
    part = run.t >= begin_s
    return History(label=label, time_s=run.t[part], values={one.name: run[one.name][part] for one in _SIGNALS})


def _calm(study: AutopilotStudy) -> Section:
    columns = [
        Column(title="run"),
        Column(title="ordered", unit="deg", digits=3),
        Column(title="rise time", unit="s", digits=3),
        Column(title="overshoot", unit="deg", digits=3),
        Column(title="settling time", unit="s", digits=3),
        Column(title="largest rudder", unit="deg", digits=3),
        Column(title="at full rate", unit="s", digits=3),
    ]
    rows: list[list[Cell]] = [[name, *vars(one).values()] for name, one in study.changes.items()]
    large = [_history(name, run) for name, run in study.runs.items() if name.startswith("large")]
    ordinary = f"{study.changes['change'].ordered_deg:.3g} deg"
    charts = [
        Illustration(
            chart=history_chart(
                [_history("change", study.runs["change"])], _SIGNALS, title=f"Course change by {ordinary}"
            )
        ),
        Illustration(
            chart=history_chart(large, _SIGNALS, title="A change that takes the rudder to its limit"),
            caption="Without anti-windup the integral fills while the rudder is at its limit: the ship swings past.",
        ),
    ]
    text = (
        "On the nonlinear model with the limits of the gear, in calm water, from a course that the autopilot has kept: "
        f"it holds the {study.design.found.rudder_deg:.3g} deg of rudder that the ship needs for it."
    )
    return Section(
        heading="Course changes",
        text=text,
        tables=[Table(caption="Figures of course changes", columns=columns, rows=rows)],
        charts=charts,
    )


def _weather(study: AutopilotStudy) -> Section:
    weather, kept = study.weather, study.keeping
    text = (
        f"Steering north in a current of {weather.current_mps:.3g} m/s towards "
        f"{math.degrees(weather.current_towards_rad):.0f} deg, wind of {weather.wind_mps:.3g} m/s from "
        f"{math.degrees(weather.wind_from_rad):.0f} deg, and waves of {weather.wave_radps:.3g} rad/s that alone would "
        f"yaw the ship by {math.degrees(weather.wave_yaw_rad):.3g} deg (standard deviation); seed {weather.seed}."
    )
    columns = [Column(title="figure"), Column(title="value"), Column(title="unit")]
    rows: list[list[Cell]] = [
        ["heading error, rms", kept.heading_error_rms_deg, "deg"],
        ["heading error, mean", kept.heading_error_mean_deg, "deg"],
        ["integral of heading error squared", kept.heading_error_deg2s, "deg² s"],
        ["rudder about its mean, rms", kept.rudder_rms_deg, "deg"],
        ["integral of rudder squared", kept.rudder_deg2s, "deg² s"],
        ["rudder on the move, mean", kept.rudder_travel_degps, "deg/s"],
        ["at full rate", kept.rate_limited_percent, "%"],
    ]
    run = study.runs["keeping"]
    begin = run.t[-1] - _WAVES_SHOWN * 2 * math.pi / weather.wave_radps
    chart = history_chart([_history("course keeping", run, begin)], _SIGNALS, title="Course keeping, the last waves")
    table = Table(caption=f"Over the last {kept.duration_s:.0f} s", columns=columns, rows=rows)
    return Section(heading="Course keeping", text=text, tables=[table], charts=[Illustration(chart=chart)])


def _track(study: AutopilotStudy) -> Section:
    assert study.waypoints is not None
    columns = [
        Column(title="guidance"),
        Column(title="length", unit="m"),
        Column(title="time", unit="s"),
        Column(title="finished"),
        Column(title="largest error", unit="m", digits=3),
        Column(title="rms error", unit="m", digits=3),
        Column(title="largest on legs", unit="m", digits=3),
        Column(title="what stays", unit="m", digits=3),
    ]
    rows: list[list[Cell]] = [[name, *vars(one.figures).values()] for name, one in study.tracks.items()]
    sailed = [
        Track(label=name, x_m=one.trajectory["motion.x"], y_m=one.trajectory["motion.y"], time_s=one.trajectory.t)
        for name, one in study.tracks.items()
    ]
    points = study.waypoints
    wanted = Track(label="waypoints", x_m=points[:, 0], y_m=points[:, 1], time_s=np.zeros(len(points)), measured=True)
    errors = [CrossTrack(label=name, time_s=one.time_s, error_m=one.error_m) for name, one in study.tracks.items()]
    text = (
        "Line of sight with lookahead, in the current and the wind of the course keeping. Errors leap where a leg "
        "ends, for the next one counts from there; those on legs are of the second half of each."
    )
    return Section(
        heading="Track keeping",
        text=text,
        tables=[Table(caption="Cross-track errors, positive to starboard", columns=columns, rows=rows)],
        charts=[
            Illustration(chart=track_chart([wanted, *sailed], title="Track")),
            Illustration(chart=cross_track_chart(errors, title="Cross-track error")),
        ],
    )
