"""The page of a reduction to the MMG method: coefficients, and computed readings against measured ones."""

from __future__ import annotations

from collections.abc import Mapping

import altair as alt

from tank2sim.answer.charts.parts import NUMBER, Chart, data
from tank2sim.answer.page import Page
from tank2sim.answer.parts import Cell, Column, Illustration, KeyFigure, Section, Table, Verdict
from tank2sim.report.captive.charts import derivative_certainty_chart
from tank2sim.report.json_values import Json

_CHANNELS = {
    "X": "surge force",
    "Y": "sway force",
    "N": "yaw moment",
    "T": "thrust",
    "F_N": "normal force of the rudder",
    "T_left": "thrust of the left propeller",
    "F_N_left": "normal force of the left rudder",
    "Q": "torque of the propeller",
}


def mmg_reduction_page(found: Json) -> Page:
    """The page of a result of ``reduce --model mmg``."""
    coefficients = found["coefficients"]
    known = {name: entry for name, entry in coefficients.items() if entry["standard_error"] and entry["value"]}
    opened = [name for name, entry in coefficients.items() if entry["origin"] == "open"]
    rows = [[name, entry["value"], entry["standard_error"], entry["origin"]] for name, entry in coefficients.items()]
    rows.append(["x_R + a_H x_H", found["yaw_arm"]["value"], found["yaw_arm"]["standard_error"], "measured"])
    heads = ("coefficient", "value", "standard error", "origin")
    left = [
        [_CHANNELS[name], entry["unit"], entry["standard_deviation"], 100 * entry["unexplained"]]
        for name, entry in found["channels"].items()
    ]
    sources = list(dict.fromkeys(source for entry in coefficients.values() for source in entry["type_b"]))
    shares: list[list[Cell]] = [
        [
            name,
            *(
                round(100 * (part / entry["standard_error"]) ** 2, 2)
                for part in (entry["type_a"], *(entry["type_b"].get(source, 0.0) for source in sources))
            ),
            entry["standard_error"],
            2 * entry["standard_error"],
        ]
        for name, entry in coefficients.items()
    ]
    budget = Table(
        caption="Shares of the variance",
        columns=[
            *(Column(title=""), Column(title="scatter", unit="%", digits=3)),
            *(Column(title=source.rpartition("_")[0], unit="%", digits=3) for source in sources),
            *(Column(title="combined", digits=3), Column(title="expanded, k = 2", digits=3)),
        ],
        rows=shares,
    )
    left_heads = ("", "unit", "standard deviation", "% of the rms")
    return Page(
        title=f"{found['model']}: coefficients of the MMG method",
        subtitle=f"From {len(found['conditions'])} steady captive conditions",
        verdict=_verdict(found["channels"], sum(row[-1] == "measured" for row in rows[:-1])),
        figures=[
            *(
                KeyFigure(
                    label=f"{_CHANNELS[name].capitalize()} followed within",
                    value=float(f"{100 * entry['unexplained']:.2g}"),
                    unit="%",
                    note=f"rms, {entry['standard_deviation']:.3g} {entry['unit'].replace('.', ' ')}",
                )
                for name, entry in found["channels"].items()
            ),
            KeyFigure(
                label="Left open by the tests",
                value=len(opened),
                verdict=Verdict.CAUTION if opened else Verdict.NONE,
                note=", ".join(opened) or "none",
            ),
        ],
        sections=[
            Section(
                heading="Computed against measured",
                text="Each point is a condition; on the line the method gives what the gauge showed.",
                charts=[
                    Illustration(chart=computed_chart(name, readings), half=True)
                    for name, readings in found["readings"].items()
                ],
                tables=[Table(caption="What is left", columns=[Column(title=head) for head in left_heads], rows=left)],
                notes=found["notices"],
            ),
            Section(
                heading="Coefficients",
                text="One weighted regression of all readings. The hull is in prime II, by 1/2 rho L d U².",
                charts=[Illustration(chart=derivative_certainty_chart(known, title="Certainty of the coefficients"))]
                if known
                else [],
                tables=[Table(caption="Coefficients", columns=[Column(title=head) for head in heads], rows=rows)],
            ),
            Section(
                heading="Uncertainty budget",
                text="After ITTC 7.5-02-06-04: the scatter of the tests, and errors common to all of them as "
                "[uncertainty] of the campaign states them.",
                tables=[budget],
                folded=True,
            ),
        ],
    )


def _verdict(channels: Mapping[str, Json], count: int) -> str:
    worst = max(channels, key=lambda name: channels[name]["unexplained"])
    return (
        f"{count} coefficients are measured. With them the method follows every force within "
        f"{100 * channels[worst]['unexplained']:.2g} % of its rms; the {_CHANNELS[worst]} is the worst."
    )


def computed_chart(name: str, readings: Mapping[str, Json], *, size_px: int = 300) -> alt.LayerChart:
    """Computed over measured readings of one channel, with the line on which both are the same.

    Parameters
    ----------
    name : str
        Of the channel.
    readings : mapping
        ``unit``, and ``measured`` and ``computed``, (conditions,).
    size_px : int
        Width and height.
    """
    points = [{"m": m, "c": c} for m, c in zip(readings["measured"], readings["computed"], strict=True)]
    unit = readings["unit"].replace(".", " ")
    x = alt.X("m:Q", title=f"{name} measured ({unit})")
    y = alt.Y("c:Q", title=f"{name} computed ({unit})")
    tooltip = [alt.Tooltip("m:Q", title="measured", format=NUMBER), alt.Tooltip("c:Q", title="computed", format=NUMBER)]
    ends = [min(readings["measured"]), max(readings["measured"])]
    line = Chart(data([{"m": end, "c": end} for end in ends])).mark_line(opacity=0.5).encode(x=x, y=y)
    dots = Chart(data(points)).mark_circle(size=36, opacity=0.7).encode(x=x, y=y, tooltip=tooltip)
    return alt.layer(line, dots).properties(
        title=_CHANNELS[name].capitalize(),
        width=size_px,
        height=size_px,
        description=f"Computed and measured {_CHANNELS[name]}.",
    )
