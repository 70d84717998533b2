"""Charts of the yaw rig: the record next to its programme, the energy balance, estimates by method, residuals."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from tank2sim.answer.charts.motion import History, Signal, history_chart
from tank2sim.answer.charts.parts import plain, series_look
from tank2sim.answer.charts.rows import RowPlot, row_chart
from tank2sim.answer.charts.vega import (
    STACKS,
    ChartRecord,
    ChartSpec,
    PlotAxis,
    Rule,
    channel,
    layer,
    layered,
    tooltips,
)
from tank2sim.apps.rigs.yaw.study import EnergyBalance, EnergyResidual, YawMethodEstimate
from tank2sim.arrays import Columns

_NORMAL = 1.959964
_SIGNALS = (
    Signal(name="rate", title="yaw rate", unit="rad/s"),
    Signal(name="error", title="tracking error", unit="rad"),
    Signal(name="current", title="motor current", unit="A"),
)


def record_chart(name: str, columns: Columns) -> ChartSpec:
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


def balance_chart(balance: EnergyBalance) -> ChartSpec:
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
        place = {
            "x": channel("part:O", title=f"{name}: part of the interval", axis={"labelAngle": 0}),
            "y": PlotAxis(title="work (mJ)", zero=True).channel("v"),
            "color": look.colour,
            "tooltip": tooltips({"run:N": "spent on", "part:O": "part", "v:Q": "work (mJ)"}),
        }
        marks = [
            layer("bar", bars, place, opacity=0.75),
            layer("point", points, {**place, "shape": look.shape}, size=60, strokeWidth=2),
        ]
        panels.append(layered(marks, size=(340, 260)))
    return {
        "hconcat": panels,
        "spacing": 24,
        "resolve": {"scale": {"y": "shared"}},
        "title": "Work of the motor and its uses",
        "description": "Energy balance of each subinterval: kinetic energy and each term of friction against the "
        "motor's work.",
        "usermeta": STACKS,
    }


def estimates_chart(methods: Mapping[str, YawMethodEstimate]) -> ChartSpec:
    """Inertia by each method with its 95 % interval: the added one, or the total where J_zz is not known."""
    rows: list[ChartRecord] = []
    kind = "added"
    for method, estimate in methods.items():
        kind, value, error = estimate.inertia
        spread = _NORMAL * (error or 0.0)
        rows.append(
            {"name": method.replace("_", " "), "v": plain(1e4 * value)}
            | {"low": plain(1e4 * (value - spread)), "high": plain(1e4 * (value + spread))}
        )
    words = f"{kind} inertia"
    return row_chart(
        RowPlot(
            rows=rows,
            across=PlotAxis(title=f"{words} (10⁻⁴ kg m²)"),
            rules=[Rule(at=[rows[0]["v"]], dash=(4, 3))],
            side={"labelLimit": 260},
            shown={"name:N": "method", "v:Q": "10⁻⁴ kg m²", "low:Q": "from", "high:Q": "to"},
        ),
        title=f"{words.capitalize()} by method",
        described=f"{words.capitalize()} by each method with its 95 % interval.",
        width_px=560,
        step_px=34,
        span_px=2,
        filled=True,
        size=70,
    )


def energy_residual_chart(residuals: Sequence[EnergyResidual]) -> ChartSpec:
    """Residual work of each subinterval, against the rate in its middle."""
    rows: list[ChartRecord] = [
        {"run": one.stage, "hump": one.hump, "x": plain(one.rate_degps), "v": plain(1e6 * one.left_J)}
        for one in residuals
    ]
    look = series_look(["accelerating", "braking"], as_points=["accelerating", "braking"])
    up = PlotAxis(title="work left over (µJ)", zero=True).channel("v")
    place = {
        "x": PlotAxis(title="mean rate of the subinterval (deg/s)").channel("x"),
        "y": up,
        "color": look.colour,
        "shape": look.shape,
        "tooltip": tooltips({"run:N": "interval", "hump:O": "hump", "v:Q": "left over (µJ)"}),
    }
    return layered(
        [Rule(at=[0.0]).layer(up), layer("point", rows, place)],
        size=(720, 220),
        title="Residuals of the energy balance",
        description="Work that the energy least squares do not explain, by subinterval.",
    )


def angle_residual_chart(residual: Columns) -> ChartSpec:
    """Residual angle of the integrated equation over time."""
    history = History(
        label="integrated less measured", time_s=residual["t_s"], values={"left": residual["residual_rad"]}
    )
    signal = Signal(name="left", title="angle, integrated less measured", unit="rad")
    return history_chart([history], [signal], title="Residuals of the nonlinear least squares")
