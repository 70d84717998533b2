"""Charts of the yaw rig: the record beside its programme, the energy balance, estimates by method, residuals."""

from __future__ import annotations

from collections.abc import Sequence

import altair as alt
import numpy as np

from tank2sim.identification.yaw.identify import YawResult
from tank2sim.records.yaw import YawRecord
from tank2sim.report.chart_parts import NUMBER, Record, data, plain, series_look
from tank2sim.report.motion_charts import History, Signal, history_chart

_NORMAL = 1.959964
_SIGNALS = (
    Signal(name="rate", title="yaw rate", unit="rad/s"),
    Signal(name="error", title="tracking error", unit="rad"),
    Signal(name="current", title="motor current", unit="A"),
)


def record_chart(result: YawResult, record: YawRecord) -> alt.VConcatChart:
    """Rate where it is evaluated beside the programme's, tracking error, and current, over the whole record."""
    programme = record.programme
    every = slice(None, None, max(1, len(record.time_s) // 6000))
    time = record.time_s[every]
    reference = programme.at(time)
    rate = np.full(len(time), np.nan)
    first = next(number for number, own in enumerate(result.records) if own is record)
    before = sum(own.programme.humps for own in result.records[:first])
    for pair in result.fit.balance.pairs[before : before + programme.humps]:
        for own in pair:
            inside = (time >= own.time_s[0]) & (time <= own.time_s[-1])
            rate[inside] = np.interp(time[inside], own.time_s, own.rate_radps)
    offset = record.angle_rad[0] - float(programme.at(record.time_s[:1]).angle_rad[0])
    error = reference.angle_rad + offset - record.angle_rad[every]
    histories = [
        History(
            label=record.path.name,
            time_s=time,
            values={"rate": rate, "error": error, "current": record.current_A[every]},
        ),
        History(label="programme", time_s=time, values={"rate": reference.rate_radps}),
    ]
    return history_chart(histories, _SIGNALS, title=f"{record.path.name}: programme and record")


def balance_chart(result: YawResult, *, width_px: int = 340) -> alt.HConcatChart:
    """Work of the motor in each subinterval (points) and what it is spent on (bars), the mean over all pairs."""
    balance, parts = result.fit.balance, result.fit.balance.parts
    spent = balance.rows * result.fit.coefficients
    shape = (len(balance.pairs), 2, parts)
    terms = [term.replace("_", " ") for term in balance.terms]
    look = series_look([*terms, "motor"], as_points=["motor"])
    panels = []
    for stage, name in enumerate(("accelerating", "braking")):
        bars, points = list[Record](), list[Record]()
        # Braking parts are counted as mirror images; shown in the order of time.
        order = range(parts) if stage == 0 else range(parts - 1, -1, -1)
        for place, part in enumerate(order, start=1):
            for column, term in enumerate(terms):
                value = 1e3 * float(spent[:, column].reshape(shape)[:, stage, part].mean())
                bars.append({"part": place, "run": term, "v": plain(value)})
            motor = 1e3 * float(balance.work_J.reshape(shape)[:, stage, part].mean())
            points.append({"part": place, "run": "motor", "v": plain(motor)})
        x = alt.X("part:O", title=f"{name}: part of the interval", axis=alt.Axis(labelAngle=0))
        y = alt.Y("v:Q", title="work (mJ)")
        tooltip = [
            alt.Tooltip("run:N", title="spent on"),
            alt.Tooltip("part:O", title="part"),
            alt.Tooltip("v:Q", title="work (mJ)", format=NUMBER),
        ]
        stacked = alt.Chart(data(bars)).mark_bar(opacity=0.75).encode(x=x, y=y, color=look.colour, tooltip=tooltip)
        motors = alt.Chart(data(points)).mark_point(size=60, strokeWidth=2)
        motors = motors.encode(x=x, y=y, color=look.colour, shape=look.shape, tooltip=tooltip)
        panels.append(alt.layer(stacked, motors).properties(width=width_px, height=260))
    title = "Work of the motor, and what it goes into"
    description = (
        "Energy balance of each subinterval: kinetic energy and each term of friction against the motor's work."
    )
    return alt.hconcat(*panels, spacing=24).resolve_scale(y="shared").properties(title=title, description=description)


def estimates_chart(result: YawResult, *, width_px: int = 560) -> alt.LayerChart:
    """Inertia by each method with its 95 % interval: the added one, or the total where J_zz is not known."""
    rows: list[Record] = []
    names = []
    for method, estimate in result.estimates.items():
        value, error = result.added_inertia(method) or (estimate.total_inertia_kgm2, estimate.inertia_error_kgm2)
        spread = _NORMAL * (error or 0.0)
        names.append(method.replace("_", " "))
        rows.append(
            {"name": names[-1], "v": plain(1e4 * value)}
            | {"low": plain(1e4 * (value - spread)), "high": plain(1e4 * (value + spread))}
        )
    words = "total inertia" if result.body is None else "added inertia"
    scale = alt.Scale(zero=False, nice=True)
    y = alt.Y("name:N", sort=names, axis=alt.Axis(title=None, grid=True, labelLimit=260))
    tooltip = [
        alt.Tooltip("name:N", title="method"),
        alt.Tooltip("v:Q", title="10⁻⁴ kg m²", format=NUMBER),
        alt.Tooltip("low:Q", title="from", format=NUMBER),
        alt.Tooltip("high:Q", title="to", format=NUMBER),
    ]
    x = alt.X("v:Q", scale=scale, title=f"{words} (10⁻⁴ kg m²)")
    best = alt.Chart(data([{"v": rows[0]["v"]}])).mark_rule(style="reference", strokeDash=[4, 3]).encode(x=x)
    base = alt.Chart(data(rows)).encode(y=y, tooltip=tooltip)
    bars = base.mark_rule(strokeWidth=2).encode(x=alt.X("low:Q", scale=scale), x2="high:Q")
    points = base.mark_point(size=70, filled=True).encode(x=x)
    return alt.layer(best, bars, points).properties(
        title=f"{words.capitalize()} by method",
        width=width_px,
        height=34 * len(rows),
        description=f"{words.capitalize()} by each method with its 95 % interval.",
    )


def energy_residual_chart(result: YawResult, *, width_px: int = 720) -> alt.LayerChart:
    """What the least squares leave of each subinterval's work, against the rate in its middle."""
    balance = result.fit.balance
    rows = list[Record]()
    place = 0
    for pair in balance.pairs:
        for own in pair:
            for part in range(balance.parts):
                rate = own.part(part, balance.parts).rate_radps
                rows.append(
                    {"run": "braking" if own.braking else "accelerating", "hump": own.number + 1}
                    | {
                        "w": plain(float(np.degrees(np.mean(rate)))),
                        "v": plain(1e6 * float(result.fit.residuals_J[place])),
                    }
                )
                place += 1
    look = series_look(["accelerating", "braking"], as_points=["accelerating", "braking"])
    tooltip = [
        alt.Tooltip("run:N", title="interval"),
        alt.Tooltip("hump:O", title="hump"),
        alt.Tooltip("v:Q", title="left over (µJ)", format=NUMBER),
    ]
    zero = alt.Chart(data([{"v": 0.0}])).mark_rule(style="reference").encode(y="v:Q")
    points = (
        alt.Chart(data(rows))
        .mark_point()
        .encode(
            x=alt.X("w:Q", title="mean rate of the subinterval (deg/s)", scale=alt.Scale(zero=False)),
            y=alt.Y("v:Q", title="work left over (µJ)"),
            color=look.colour,
            shape=look.shape,
            tooltip=tooltip,
        )
    )
    return alt.layer(zero, points).properties(
        title="Residuals of the energy balance",
        width=width_px,
        height=220,
        description="Work that the energy least squares do not explain, by subinterval.",
    )


def angle_residual_chart(time_s: Sequence[float], residual_rad: Sequence[float]) -> alt.VConcatChart:
    """What the integrated equation leaves of the angle, over time; a gap where nothing is fitted."""
    time, left = np.asarray(time_s, dtype=float), np.asarray(residual_rad, dtype=float)
    breaks = np.flatnonzero(np.abs(np.diff(time)) > 1.0) + 1
    time = np.insert(time, breaks, time[breaks - 1] + 0.01)
    left = np.insert(left, breaks, np.nan)
    history = History(label="integrated less measured", time_s=time, values={"left": left})
    signal = Signal(name="left", title="angle, integrated less measured", unit="rad")
    return history_chart([history], [signal], title="Residuals of the nonlinear least squares")
