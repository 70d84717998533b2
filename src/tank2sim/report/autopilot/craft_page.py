"""The page of the autopilot of a craft with thrusters: its gains, its poles, and changes of course and speed."""

from __future__ import annotations

import numpy as np

from tank2sim.answer.charts.analysis import PolesZeros, pole_zero_chart
from tank2sim.answer.charts.motion import History, Signal, history_chart
from tank2sim.answer.page import Page
from tank2sim.answer.parts import Cell, Column, Illustration, KeyFigure, Section, Table
from tank2sim.report.autopilot.page import exported_section, gains_table
from tank2sim.report.json_values import Json
from tank2sim.units import to_si

_HEADING = Signal(name="psi_deg", title="heading", unit="rad")
_SPEED = Signal(name="u_mps", title="surge velocity", unit="m/s")


def craft_autopilot_page(found: Json) -> Page:
    """The page, from the JSON of a :class:`.CraftAutopilotResult`."""
    sections = [_runs(found), _controller(found)]
    if exported := found.get("export"):
        sections.append(exported_section(exported))
    if found["notices"]:
        sections.append(Section(heading="Notes", notes=found["notices"]))
    return Page(
        title=f"{found['ship']}: autopilot of heading and speed",
        subtitle=found["source"],
        verdict=_verdict(found),
        figures=_figures(found),
        sections=sections,
    )


def _verdict(found: Json) -> str:
    course, speed = found["course_change"], found["speed_change"]
    turned = f"A change of course by {course['ordered']:.3g} deg"
    if course["settling_time_s"] is None or speed["settling_time_s"] is None:
        return f"{turned}, or one of speed by {speed['ordered']:.3g} m/s, does not settle in the run."
    share = max(found["at_limit_percent"].values())
    limit = (
        f"A thruster is at its limit for {share:.2g} % of the time." if share > 0 else "No thruster is at its limit."
    )
    return (
        f"{turned} settles in {course['settling_time_s']:.3g} s with {course['overshoot']:.2g} deg of overshoot, "
        f"one of speed by {speed['ordered']:.3g} m/s in {speed['settling_time_s']:.3g} s. {limit}"
    )


def _figures(found: Json) -> list[KeyFigure]:
    course, speed = found["course_change"], found["speed_change"]
    by, more = f"in a change by {course['ordered']:.3g} deg", f"in a change by {speed['ordered']:.3g} m/s"
    settled = [
        KeyFigure(label=label, value=value, unit="s", note=note)
        for label, value, note in (
            ("Heading settled", course["settling_time_s"], by),
            ("Speed settled", speed["settling_time_s"], more),
        )
        if value is not None
    ]
    return [
        KeyFigure(label="Overshoot of heading", value=course["overshoot"], unit="deg", note=by),
        KeyFigure(label="Overshoot of speed", value=speed["overshoot"], unit="m/s", note=more),
        *settled,
    ]


def _runs(found: Json) -> Section:
    thrusters = sorted(key for key in found["histories"]["course"] if key.startswith("n_"))
    turning = [
        Signal(name=key, title=key.removeprefix("n_").removesuffix("_rpm").replace("_", " "), unit="rad/s",
               display_unit="rpm")
        for key in thrusters
    ]  # fmt: skip
    charts = [
        Illustration(chart=history_chart([_history(name, columns)], [first, *others, *turning], title=title), half=True)
        for name, columns, first, others, title in (
            ("course", found["histories"]["course"], _HEADING, [_SPEED], "Change of course"),
            ("speed", found["histories"]["speed"], _SPEED, [], "Change of speed"),
        )
    ]
    rows: list[list[Cell]] = [
        [
            f"{words}, {found[key]['ordered']:.3g} {unit}",
            *list(found[key].values())[1:],
            found["at_limit_percent"][name],
        ]
        for words, key, unit, name in (
            ("course", "course_change", "deg", "course"),
            ("speed", "speed_change", "m/s", "speed"),
        )
    ]
    columns = [
        Column(title="change"),
        Column(title="rise time", unit="s", digits=3),
        Column(title="overshoot", unit="deg or m/s", digits=3),
        Column(title="settling time", unit="s", digits=3),
        Column(title="a thruster at its limit", unit="%", digits=2),
    ]
    return Section(
        heading="Changes of course and speed",
        text="On the nonlinear craft in calm water, from a steady course; revolutions are those of the thrusters.",
        charts=charts,
        tables=[Table(caption="Figures of the changes", columns=columns, rows=rows)],
    )


def _history(name: str, columns: Json) -> History:
    values = {"psi_deg": np.radians(columns["psi_deg"]), "u_mps": np.array(columns["u_mps"])}
    values |= {
        key: np.array(column) * to_si("n_rpm", 1.0)[1] for key, column in columns.items() if key.startswith("n_")
    }
    return History(label=name, time_s=columns["t_s"], values=values)


def _controller(found: Json) -> Section:
    low, high = found["largest_moment_Nm"]
    text = (
        f"A yaw moment of {-low:.3g} N m to port and {high:.3g} N m to starboard is ordered at most; the surge force "
        "takes what the thrusters have left. Thrusts become revolutions by the thrust curves of the card, at the speed "
        "of the moment."
    )
    poles = [complex(*pole) for pole in found["poles"]]
    drawn = [PolesZeros(label=f"{found['speed_mps']:.3g} m/s", poles=poles)]
    return Section(
        heading="Controller",
        text=text,
        tables=[gains_table(found["gains"])],
        charts=[Illustration(chart=pole_zero_chart(drawn, title="Poles of the closed loop"))],
    )
