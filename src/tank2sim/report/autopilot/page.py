"""The page of an autopilot: what it is, the margins of its loop, what it does in calm, in weather and on a track."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from tank2sim.analysis.heading.control import INTEGRAL_BAND_RAD
from tank2sim.answer.charts.analysis import FrequencyResponse, PolesZeros, bode_chart, pole_zero_chart
from tank2sim.answer.charts.motion import History, Signal, TrackData, history_chart, track_chart
from tank2sim.answer.page import Page
from tank2sim.answer.parts import Cell, Column, Illustration, KeyFigure, Section, Table, Verdict
from tank2sim.arrays import Array
from tank2sim.report.autopilot.charts import (
    CrossTrack,
    cross_track_chart,
    nyquist_chart,
    sensitivity_chart,
)
from tank2sim.report.json_values import Json, quantities

HIGHEST_PEAK = 2.0
"""Ms above which a loop is thought to be weak: Astrom & Hagglund (2006), Advanced PID Control, take 1.2 to 2."""

_UNITS = {
    "_per_s": "1/s",
    "_s": "s",
    "_radpmps": "rad s/m",
    "_radps": "rad/s",
    "_Nms": "N m s",
    "_Nmps": "N m/s",
    "_Nm": "N m",
    "_kgps": "kg/s",
    "_Npm": "N/m",
}
"""Ends of the names of gains in JSON to their units."""

_SIGNALS = (
    Signal(name="psi_deg", title="heading", unit="rad"),
    Signal(name="delta_deg", title="rudder", unit="rad"),
    Signal(name="r_degps", title="yaw rate", unit="rad/s"),
)


def autopilot_page(found: Json) -> Page:
    """The page, from the JSON of an :class:`.AutopilotStudy`."""
    sections = [_calm(found)]
    if found["track"]:
        sections.append(_track(found))
    sections += [_weather(found), _loop(found), _controller(found)]
    if exported := found.get("export"):
        sections.append(exported_section(exported))
    if found["notices"]:
        sections.append(Section(heading="Notes", notes=found["notices"]))
    return Page(
        title=f"{found['ship']}: heading autopilot",
        subtitle=found["source"],
        verdict=_verdict(found),
        figures=_figures(found),
        sections=sections,
    )


def _verdict(found: Json) -> str:
    """What the autopilot does in calm and in weather, and how far its loop is from its limits."""
    change, keeping = found["closed_loop"]["course_changes"]["change"], found["closed_loop"]["course_keeping"]
    first, speeds = found["margins"]["at_design"], found["margins"]["at_speeds"]
    unstable = [f"{one['speed_mps']:.3g}" for one in speeds if not one["stable"]]
    if unstable:
        return f"The loop is unstable at {', '.join(unstable)} m/s."
    turned = f"A change of course by {change['ordered_deg']:.3g} deg"
    seconds = change["settling_time_s"]
    settled = "does not settle in the run," if seconds is None else f"settles in {seconds:.3g} s"
    return (
        f"{turned} {settled} with {change['overshoot_deg']:.2g} deg of overshoot. In weather the heading is "
        f"{keeping['heading_error_rms_deg']:.2g} deg off (rms), by {keeping['rudder_rms_deg']:.2g} deg of rudder. The "
        f"loop has {first['phase_margin_deg']:.3g} deg of phase margin."
    )


def _figures(found: Json) -> list[KeyFigure]:
    first, speeds = found["margins"]["at_design"], found["margins"]["at_speeds"]
    change, keeping = found["closed_loop"]["course_changes"]["change"], found["closed_loop"]["course_keeping"]
    peak = Verdict.PASSED if first["sensitivity_peak"] <= HIGHEST_PEAK else Verdict.CAUTION
    stable = sum(speed["stable"] for speed in speeds)
    return [
        KeyFigure(
            label="Overshoot",
            value=change["overshoot_deg"],
            unit="deg",
            note=f"in a change by {change['ordered_deg']:.3g} deg",
        ),
        KeyFigure(label="Heading error", value=keeping["heading_error_rms_deg"], unit="deg", note="rms, in weather"),
        KeyFigure(label="Phase margin", value=first["phase_margin_deg"], unit="deg"),
        KeyFigure(
            label="Peak of sensitivity, Ms",
            value=first["sensitivity_peak"],
            verdict=peak,
            note=f"no more than {HIGHEST_PEAK:g}",
            limit=HIGHEST_PEAK,
        ),
        KeyFigure(label="Delay margin", value=first["delay_margin_s"], unit="s"),
        KeyFigure(
            label="Stable",
            value=f"{stable} of {len(speeds)}",
            verdict=Verdict.PASSED if stable == len(speeds) else Verdict.FAILED,
            note="speeds" if len(speeds) > 1 else "speed of the design",
        ),
    ]


def _controller(found: Json) -> Section:
    alone, limits = found["ship_alone"], found["limits"]
    text = (
        f"The ship at {alone['speed_mps']:.4g} m/s: K = {alone['K_per_s']:.4g} 1/s, T = {alone['T_s']:.4g} s, "
        f"{'stable' if alone['stable'] else 'unstable'} on a straight course by itself."
    )
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
        tables=[gains_table(found["gains"])],
        folded=True,
    )


def gains_table(gains: Mapping[str, float]) -> Table:
    """The gains of a controller by the names that the JSON has, units apart."""
    rows: list[list[Cell]] = []
    for name, value in gains.items():
        suffix = next((suffix for suffix in _UNITS if name.endswith(suffix)), "")
        rows.append([name.removesuffix(suffix).replace("_", " "), value, _UNITS.get(suffix, "")])
    return Table(caption="Gains", columns=[Column(title=title) for title in ("gain", "value", "unit")], rows=rows)


def _loop(found: Json) -> Section:
    margins = found["margins"]["at_speeds"]
    charts = loop_charts(found["responses"], margins[0])
    poles = [complex(*pole) for pole in margins[0]["poles"]]
    near = [pole for pole in poles if abs(pole) < 5 * margins[0]["crossover_radps"]]
    drawn = [PolesZeros(label=f"{margins[0]['speed_mps']:.3g} m/s", poles=near)]
    charts.append(
        Illustration(
            chart=pole_zero_chart(drawn, title="Poles of the closed loop"),
            caption="Poles as slow as the ship are shown; those of the gear lie farther to the left.",
        )
    )
    loop = found["closed_loop"]
    limits = {"rate of the gear": "largest_step_within_rate_limit_deg"}
    limits |= {"largest rudder": "largest_step_within_angle_limit_deg"}
    steps = [f"{loop[key]:.3g} deg ({name})" for name, key in limits.items() if loop[key] is not None]
    linear = f" Changes of course stay linear up to {' and '.join(steps)}." if steps else ""
    text = f"The ship with its steering gear, linearised at each speed, and the gains of the design.{linear}"
    return Section(heading="Loop", text=text, tables=[_margins(margins)], charts=charts)


def loop_charts(responses: Sequence[Mapping[str, Json]], first: Mapping[str, Json]) -> list[Illustration]:
    """Bode diagram, Nyquist curve and sensitivities; `first` are the margins at the speed of the design."""
    loops, sensitivities, closed = [], [], []
    for response in responses:
        omega, label = np.array(response["omega_radps"], dtype=float), f"{response['speed_mps']:.3g} m/s"
        loop, heading = (_complex(response, name) for name in ("loop", "heading"))
        loops.append(_from_the_near_end(label, omega, loop))
        sensitivities.append(FrequencyResponse(label=f"S, {label}", omega_radps=omega, response=1 / (1 + loop)))
        if response["speed_mps"] == first["speed_mps"]:
            label = f"heading by its order, {label}"
            closed.append(FrequencyResponse(label=label, omega_radps=omega, response=heading))
    return [
        Illustration(chart=bode_chart(loops, title="Loop transfer"), caption="Broken at the rudder order."),
        Illustration(
            chart=nyquist_chart(loops, first["sensitivity_peak"], title="Nyquist curve"),
            caption="Cross: the critical point. Red: the circle 1/Ms about it.",
        ),
        Illustration(
            chart=sensitivity_chart([*sensitivities, *closed], title="Sensitivity and closed loop"),
            caption="S above 0 dB: what the loop makes worse. Waves should lie to the right of its peak.",
        ),
    ]


def _complex(response: Mapping[str, Json], name: str) -> NDArray[np.complex128]:
    parts = (np.array(response[f"{name}_{part}"], dtype=float) for part in ("real", "imaginary"))
    real, imaginary = parts
    return np.asarray(real + 1j * imaginary)


def _from_the_near_end(label: str, omega: Array, value: NDArray[np.complex128]) -> FrequencyResponse:
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


def _margins(margins: Sequence[Mapping[str, Json]]) -> Table:
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
    keys = ("gain_margin_down", "phase_margin_deg", "delay_margin_s", "sensitivity_peak", "bandwidth_radps", "stable")
    rows: list[list[Cell]] = [
        [
            margin["speed_mps"],
            "any" if margin["gain_margin_up"] is None else margin["gain_margin_up"],
            *(margin[key] for key in keys),
        ]
        for margin in margins
    ]
    return Table(caption="Margins, the first at the speed of the design", columns=columns, rows=rows)


def _history(label: str, columns: Mapping[str, Json], until_s: float = math.inf) -> History:
    time = np.array(columns["t_s"], dtype=float)
    shown = time <= until_s
    values = {signal.name: np.radians(np.array(columns[signal.name], dtype=float)[shown]) for signal in _SIGNALS}
    return History(label=label, time_s=time[shown], values=values)


def _shown_until(*changes: Mapping[str, Json]) -> float:
    """Time, s, from which on the charts of course changes would show a steady course: twice the settling time."""
    settled = [change["settling_time_s"] for change in changes]
    return math.inf if None in settled else 2 * max(settled)


def _calm(found: Json) -> Section:
    changes = found["closed_loop"]["course_changes"]
    columns = [
        Column(title="run"),
        Column(title="ordered", unit="deg", digits=3),
        Column(title="rise time", unit="s", digits=3),
        Column(title="overshoot", unit="deg", digits=3),
        Column(title="settling time", unit="s", digits=3),
        Column(title="largest rudder", unit="deg", digits=3),
        Column(title="at full rate", unit="s", digits=3),
    ]
    rows: list[list[Cell]] = [[name, *change.values()] for name, change in changes.items()]
    names = [name for name in found["histories"] if name.startswith("large")]
    until = _shown_until(*(changes[name] for name in names))
    large = [_history(name, found["histories"][name], until) for name in names]
    course = _history("change", found["histories"]["change"], _shown_until(changes["change"]))
    ordinary = f"{changes['change']['ordered_deg']:.3g} deg"
    charts = [
        Illustration(
            chart=history_chart([course], _SIGNALS, title=f"Course change by {ordinary}"),
            caption="Up to twice the settling time.",
        ),
        Illustration(
            chart=history_chart(large, _SIGNALS, title="A change that takes the rudder to its limit"),
            caption="Without anti-windup the integral fills while the rudder is at its limit: the ship swings past.",
        ),
    ]
    text = (
        "On the nonlinear model with the limits of the gear, in calm water, from a course that the autopilot has kept: "
        f"it holds the {found['ship_alone']['rudder_deg']:.3g} deg of rudder that the ship needs for it."
    )
    return Section(
        heading="Course changes",
        text=text,
        tables=[Table(caption="Figures of course changes", columns=columns, rows=rows)],
        charts=charts,
    )


def _weather(found: Json) -> Section:
    weather, kept = found["weather"], found["closed_loop"]["course_keeping"]
    text = (
        f"Steering north in a current of {weather['current_mps']:.3g} m/s towards "
        f"{weather['current_towards_deg']:.0f} deg, wind of {weather['wind_mps']:.3g} m/s from "
        f"{weather['wind_from_deg']:.0f} deg, and waves of {weather['wave_radps']:.3g} rad/s that alone would "
        f"yaw the ship by {weather['wave_yaw_deg']:.3g} deg (standard deviation); seed {weather['seed']}."
    )
    columns = [Column(title="figure"), Column(title="value"), Column(title="unit")]
    rows: list[list[Cell]] = [
        ["heading error, rms", kept["heading_error_rms_deg"], "deg"],
        ["heading error, mean", kept["heading_error_mean_deg"], "deg"],
        ["integral of heading error squared", kept["heading_error_deg2s"], "deg² s"],
        ["rudder about its mean, rms", kept["rudder_rms_deg"], "deg"],
        ["integral of rudder squared", kept["rudder_deg2s"], "deg² s"],
        ["rudder on the move, mean", kept["rudder_travel_degps"], "deg/s"],
        ["at full rate", kept["rate_limited_percent"], "%"],
    ]
    history = _history("course keeping", found["histories"]["keeping"])
    chart = history_chart([history], _SIGNALS, title="Course keeping, the last waves")
    table = Table(caption=f"Over the last {kept['duration_s']:.0f} s", columns=columns, rows=rows)
    return Section(heading="Course keeping", text=text, tables=[table], charts=[Illustration(chart=chart)])


def _track(found: Json) -> Section:
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
    rows: list[list[Cell]] = [[name, *one.values()] for name, one in found["track"].items()]
    runs = found["track_histories"].items()
    sailed = [TrackData(label=name, x_m=one["x_m"], y_m=one["y_m"], time_s=one["t_s"]) for name, one in runs]
    points = np.array(found["waypoints_m"], dtype=float)
    wanted = [
        TrackData(label=label, x_m=points[:, 0], y_m=points[:, 1], time_s=np.zeros(len(points)), measured=measured)
        for label, measured in (("legs", False), ("waypoints", True))
    ]
    errors = [CrossTrack(label=name, time_s=one["t_s"], error_m=one["cross_track_error_m"]) for name, one in runs]
    text = (
        "Line of sight with lookahead, in the current and the wind of the course keeping. Errors leap where a leg "
        "ends, for the next one counts from there; those on legs are of the second half of each."
    )
    return Section(
        heading="Track keeping",
        text=text,
        tables=[Table(caption="Cross-track errors, positive to starboard", columns=columns, rows=rows)],
        charts=[
            Illustration(chart=track_chart([*sailed, *wanted], title="Track and its legs")),
            Illustration(chart=cross_track_chart(errors, title="Cross-track error")),
        ],
    )


def exported_section(exported: Mapping[str, Json]) -> Section:
    """The section on the FMU of an autopilot."""
    values = {key: value for key, value in exported.items() if not isinstance(value, list | dict)}
    return Section(heading="FMU", tables=[quantities("The controller as an FMU", values)])
