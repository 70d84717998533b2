"""Charts of the yaw rig: the record next to its programme, the energy balance, estimates by method, residuals."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import altair as alt

from tank2sim.answer.charts.motion import History, Signal, history_chart
from tank2sim.answer.charts.parts import NUMBER, STACKS, Chart, ChartRecord, data, plain, series_look
from tank2sim.apps.rigs.yaw.study import EnergyBalance, EnergyResidual, YawMethodEstimate
from tank2sim.arrays import Columns

_NORMAL = 1.959964
_SIGNALS = (
    Signal(name="rate", title="yaw rate", unit="rad/s"),
    Signal(name="error", title="tracking error", unit="rad"),
    Signal(name="current", title="motor current", unit="A"),
)


def record_chart(name: str, columns: Columns) -> alt.VConcatChart:
    """Rate where it is evaluated next to the programme's, tracking error, and current, over the whole record."""
    time = columns["t_s"]
    columns_shown = {"rate": "rate_radps", "error": "tracking_error_rad", "current": "current_A"}
    values = {key: columns[column] for key, column in columns_shown.items()}
    programme = {"rate": columns["programme_rate_radps"]}
    histories = [
        History(label=name, time_s=time, values=values),
        History(label="programme", time_s=time, values=programme),
    ]
    return history_chart(histories, _SIGNALS, title=f"{name}: programme and record")


def balance_chart(balance: EnergyBalance, *, width_px: int = 340) -> alt.HConcatChart:
    """Work of the motor in each subinterval (points) and its uses (bars), means over all pairs."""
    terms = {term.replace("_", " "): parts for term, parts in balance.spent_J.items()}
    look = series_look([*terms, "motor"], as_points=["motor"])
    panels = []
    for name in ("accelerating", "braking"):
        bars = [
            {"part": place, "run": term, "v": plain(1e3 * value)}
            for term, parts in terms.items()
            for place, value in enumerate(parts[name].tolist(), start=1)
        ]
        motor = enumerate(balance.motor_J[name].tolist(), start=1)
        points = [{"part": place, "run": "motor", "v": plain(1e3 * value)} for place, value in motor]
        x = alt.X("part:O", title=f"{name}: part of the interval", axis=alt.Axis(labelAngle=0))
        y = alt.Y("v:Q", title="work (mJ)")
        tooltip = [
            alt.Tooltip("run:N", title="spent on"),
            alt.Tooltip("part:O", title="part"),
            alt.Tooltip("v:Q", title="work (mJ)", format=NUMBER),
        ]
        stacked = Chart(data(bars)).mark_bar(opacity=0.75).encode(x=x, y=y, color=look.colour, tooltip=tooltip)
        motors = Chart(data(points)).mark_point(size=60, strokeWidth=2)
        motors = motors.encode(x=x, y=y, color=look.colour, shape=look.shape, tooltip=tooltip)
        panels.append(alt.layer(stacked, motors).properties(width=width_px, height=260))
    title = "Work of the motor and its uses"
    description = (
        "Energy balance of each subinterval: kinetic energy and each term of friction against the motor's work."
    )
    return (
        alt.hconcat(*panels, spacing=24)
        .resolve_scale(y="shared")
        .properties(title=title, description=description, usermeta=STACKS)
    )


def estimates_chart(methods: Mapping[str, YawMethodEstimate], *, width_px: int = 560) -> alt.LayerChart:
    """Inertia by each method with its 95 % interval: the added one, or the total where J_zz is not known."""
    rows: list[ChartRecord] = []
    names, kind = [], "added"
    for method, estimate in methods.items():
        kind, value, error = estimate.inertia
        spread = _NORMAL * (error or 0.0)
        names.append(method.replace("_", " "))
        rows.append(
            {"name": names[-1], "v": plain(1e4 * value)}
            | {"low": plain(1e4 * (value - spread)), "high": plain(1e4 * (value + spread))}
        )
    words = f"{kind} inertia"
    scale = alt.Scale(zero=False, nice=True)
    y = alt.Y("name:N", sort=names, axis=alt.Axis(title=None, grid=True, labelLimit=260))
    tooltip = [
        alt.Tooltip("name:N", title="method"),
        alt.Tooltip("v:Q", title="10⁻⁴ kg m²", format=NUMBER),
        alt.Tooltip("low:Q", title="from", format=NUMBER),
        alt.Tooltip("high:Q", title="to", format=NUMBER),
    ]
    x = alt.X("v:Q", scale=scale, title=f"{words} (10⁻⁴ kg m²)")
    best = Chart(data([{"v": rows[0]["v"]}])).mark_rule(style="reference", strokeDash=[4, 3]).encode(x=x)
    base = Chart(data(rows)).encode(y=y, tooltip=tooltip)
    bars = base.mark_rule(strokeWidth=2).encode(x=alt.X("low:Q", scale=scale), x2="high:Q")
    points = base.mark_point(size=70, filled=True).encode(x=x)
    return alt.layer(best, bars, points).properties(
        title=f"{words.capitalize()} by method",
        width=width_px,
        height=34 * len(rows),
        description=f"{words.capitalize()} by each method with its 95 % interval.",
    )


def energy_residual_chart(residuals: Sequence[EnergyResidual], *, width_px: int = 720) -> alt.LayerChart:
    """Residual work of each subinterval, against the rate in its middle."""
    rows: list[ChartRecord] = [
        {
            "run": residual.stage,
            "hump": residual.hump,
            "w": plain(residual.rate_degps),
            "v": plain(1e6 * residual.left_J),
        }
        for residual in residuals
    ]
    look = series_look(["accelerating", "braking"], as_points=["accelerating", "braking"])
    tooltip = [
        alt.Tooltip("run:N", title="interval"),
        alt.Tooltip("hump:O", title="hump"),
        alt.Tooltip("v:Q", title="left over (µJ)", format=NUMBER),
    ]
    zero = Chart(data([{"v": 0.0}])).mark_rule(style="reference").encode(y="v:Q")
    points = (
        Chart(data(rows))
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


def angle_residual_chart(residual: Columns) -> alt.VConcatChart:
    """Residual angle of the integrated equation over time."""
    history = History(
        label="integrated less measured", time_s=residual["t_s"], values={"left": residual["residual_rad"]}
    )
    signal = Signal(name="left", title="angle, integrated less measured", unit="rad")
    return history_chart([history], [signal], title="Residuals of the nonlinear least squares")
