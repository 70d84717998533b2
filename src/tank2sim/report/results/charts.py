"""Charts of what the JSON of a result holds: series, matrices, values with standard errors, and the known diagrams."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import altair as alt
import numpy as np

from tank2sim.answer.charts.analysis import (
    FrequencyResponse,
    OutputError,
    PolesZeros,
    bode_chart,
    error_chart,
    pole_zero_chart,
)
from tank2sim.answer.charts.before_after import misfit_maps
from tank2sim.answer.charts.parts import (
    LINE_SAMPLES,
    NUMBER,
    Chart,
    ChartRecord,
    axis_above,
    data,
    every,
    plain,
    stacked,
    with_unit,
)
from tank2sim.answer.parts import Illustration
from tank2sim.report.json_values import Json, is_matrix, is_number_value, rises, words

ACROSS = (
    "time_s",
    "t_s",
    "omega_radps",
    "frequency_Hz",
    "rudder_deg",
    "yaw_rate_degps",
    "speed_mps",
    "trim_by_stern_over_length",
    "lag_s",
)
"""What lies along the horizontal axis of series, the first of these that is there; else the first that rises."""

# One series takes the first colour of the palette, which is another on a dark screen.
_ONE = alt.Color("run:N", legend=None)

_MOST_PANELS = 6
_MOST_BARS = 60
_MOST_CELLS = 60
_WIDTH = 720


def series_chart(heading: str, series: Mapping[str, Sequence[Json]]) -> Illustration | None:
    """Panels of series of one length over the one that lies across; None where nothing lies across or up.

    A series of truth values divides the lines: dashed where it is false.
    """
    truths = {key: column for key, column in series.items() if all(isinstance(value, bool) for value in column)}
    numbers = {
        key: column for key, column in series.items() if any(is_number_value(v) for v in column) and key not in truths
    }
    across = next((key for key in ACROSS if key in numbers), next((k for k, v in numbers.items() if rises(v)), None))
    up = [key for key in numbers if key != across][:_MOST_PANELS]
    if across is None or not up:
        return None
    truth = next(iter(truths), None)
    rows = [
        {"run": "", "i": place, "x": _plain(x), "truth": truths[truth][place] if truth else True, "part": 0}
        | {f"y{panel}": _plain(numbers[key][place]) for panel, key in enumerate(up)}
        for place, x in enumerate(numbers[across])
    ]
    rows = _parted(every(rows, LINE_SAMPLES), bool(truth))
    logarithmic = across in ("omega_radps", "frequency_Hz") and all(row["x"] and row["x"] > 0 for row in rows)
    panels = [
        _panel(rows, panel, key, (across, logarithmic, panel == len(up) - 1), truth) for panel, key in enumerate(up)
    ]
    names = ", ".join(words(key)[0] for key in up)
    caption = f"Dashed where {words(truth)[0]} is false." if truth and not all(truths[truth]) else ""
    chart = stacked(panels, title=heading, description=f"{heading}: {names} over {words(across)[0]}.")
    return Illustration(chart=chart, caption=caption)


def _parted(rows: list[ChartRecord], divided: bool) -> list[ChartRecord]:
    # Each part shares its last row with the next, so that the line is whole.
    if not divided:
        return rows
    parted: list[ChartRecord] = []
    for row in rows:
        if parted and parted[-1]["truth"] != row["truth"]:
            parted.append({**row, "truth": parted[-1]["truth"], "part": parted[-1]["part"]})
            parted.append({**row, "part": parted[-1]["part"] + 1})
        else:
            parted.append({**row, "part": parted[-1]["part"] if parted else 0})
    return parted


def _panel(
    rows: list[ChartRecord], panel: int, key: str, across: tuple[str, bool, bool], truth: str | None
) -> alt.LayerChart:
    name, logarithmic, last = across
    scale = alt.Scale(type="log") if logarithmic else alt.Scale(zero=False, nice=False)
    x = alt.X("x:Q", scale=scale, axis=alt.Axis(title=with_unit(*words(name)) if last else None, labels=last))
    y = alt.Y(f"y{panel}:Q", scale=alt.Scale(zero=False), axis=axis_above(with_unit(*words(key))))
    dash = alt.StrokeDash("truth:N", scale=alt.Scale(domain=[True, False], range=[[1, 0], [4, 3]]), legend=None)
    tooltip = [
        alt.Tooltip("x:Q", title=words(name)[0], format=NUMBER),
        alt.Tooltip(f"y{panel}:Q", title=words(key)[0], format=NUMBER),
    ]
    chart = Chart(data(rows))
    encoded = {"x": x, "y": y, "color": _ONE, "order": alt.Order("i:Q"), "detail": alt.Detail("part:N")}
    line = chart.mark_line().encode(**encoded, **({"strokeDash": dash} if truth else {}))
    points = chart.mark_point(size=60, opacity=0).encode(x=x, y=y, tooltip=tooltip)
    return alt.layer(line, points).properties(width=_WIDTH, height=130)


def heat_map(
    heading: str, names: Sequence[str], across: Sequence[str], matrix: Sequence[Sequence[Json]]
) -> Illustration:
    """A matrix as coloured cells, each with its number; colours diverge from 0 where there are both signs."""
    rows: list[ChartRecord] = [
        {"row": name, "column": title, "value": _plain(matrix[place][column])}
        for place, name in enumerate(names)
        for column, title in enumerate(across)
    ]
    values = [row["value"] for row in rows if row["value"] is not None]
    largest = max((abs(value) for value in values), default=1.0) or 1.0
    both = min(values, default=0.0) < 0
    scale = alt.Scale(scheme="purpleorange" if both else "blues", domain=[-largest if both else 0, largest])
    x = alt.X("column:N", sort=list(across), title=None, axis=alt.Axis(labelAngle=-40))
    y = alt.Y("row:N", sort=list(names), title=None)
    base = Chart(data(rows)).encode(x=x, y=y)
    cells = base.mark_rect().encode(
        color=alt.Color("value:Q", scale=scale, legend=None),
        tooltip=["row:N", "column:N", alt.Tooltip("value:Q", format=NUMBER)],
    )
    dark = f"abs(datum.value) > {0.55 * largest:.6g}"
    numbers = base.mark_text(fontSize=10).encode(
        text=alt.Text("value:Q", format=",.3~r"),
        color=alt.condition(dark, alt.value("#ffffff"), alt.value("#16212c")),
    )
    layers = [cells, numbers] if len(across) <= 14 else [cells]
    height = 26 * len(names)
    chart = alt.layer(*layers).properties(width=min(_WIDTH, 52 * len(across)), height=height, title=heading)
    return Illustration(
        chart=chart.properties(description=f"{heading}: a map of {len(names)} by {len(across)} values.")
    )


def matrix_chart(heading: str, value: Mapping[str, Json]) -> Illustration | None:
    """The correlation of what is named next to it (``of`` or ``names``), where that is given."""
    names = value.get("of") or value.get("names")
    matrix: Json = value.get("matrix") or value.get("correlation")
    if not (isinstance(names, list) and is_matrix(matrix) and len(names) == len(matrix) == len(matrix[0])):
        return None
    if not 1 < len(names) <= _MOST_CELLS:
        return None
    texts = [str(name) for name in names]
    return heat_map(heading, texts, texts, matrix)


def error_bars(heading: str, values: Mapping[str, Mapping[str, Json]]) -> Illustration | None:
    """Standard errors of named values, in per cent of each, the surest at the top; None where none has one."""
    known = [
        {"name": name, "percent": _plain(100 * abs(value["standard_error"] / value["value"])), "value": value["value"]}
        for name, value in values.items()
        if is_number_value(value.get("value")) and is_number_value(value.get("standard_error")) and value["value"] != 0
    ]
    known = sorted((row for row in known if row["percent"]), key=lambda row: float(row["percent"]))[:_MOST_BARS]
    if len(known) < 2:
        return None
    low = 10 ** math.floor(math.log10(min(float(row["percent"]) for row in known)))
    scale = alt.Scale(type="log", domainMin=low, nice=False)
    axis = alt.Axis(title="standard error (% of the value)", format="~r")
    base = Chart(data([{**row, "run": "", "low": low} for row in known])).encode(
        color=_ONE,
        y=alt.Y("name:N", sort=[row["name"] for row in known], title=None),
        tooltip=["name:N", alt.Tooltip("value:Q", format=NUMBER), alt.Tooltip("percent:Q", format=NUMBER)],
    )
    x = alt.X("percent:Q", scale=scale, axis=axis)
    stems = base.mark_rule(style="stem").encode(x=alt.X("low:Q", scale=scale, axis=axis), x2="percent:Q")
    chart = alt.layer(stems, base.mark_point(filled=True, size=60).encode(x=x))
    chart = chart.properties(width=560, height=18 * len(known), title=heading)
    return Illustration(chart=chart.properties(description=f"{heading}: standard error of {len(known)} values."))


def force_fit(heading: str, runs: Sequence[Mapping[str, Json]]) -> Illustration | None:
    """Measured against predicted, one point a run; a point off the diagonal is a run that the fit does not follow."""
    rows: list[ChartRecord] = [
        {"run": str(run.get("run", "")), "type": str(run.get("type", "")).replace("_", " ")}
        | {"measured": _plain(run["measured"]), "predicted": _plain(run["predicted"])}
        for run in runs
        if is_number_value(run.get("measured")) and is_number_value(run.get("predicted"))
    ]
    if len(rows) < 3:
        return None
    ends = [float(row[key]) for row in rows for key in ("measured", "predicted")]
    diagonal = [{"measured": end, "predicted": end} for end in (min(ends), max(ends))]
    x = alt.X("measured:Q", scale=alt.Scale(zero=False), title="measured")
    y = alt.Y("predicted:Q", scale=alt.Scale(zero=False), axis=axis_above("predicted"))
    line = Chart(data(diagonal)).mark_line(style="reference").encode(x=x, y=y)
    looks = {"color": alt.Color("type:N", legend=alt.Legend()), "shape": alt.Shape("type:N", legend=alt.Legend())}
    tooltip = ["run:N", "type:N", alt.Tooltip("measured:Q", format=NUMBER), alt.Tooltip("predicted:Q", format=NUMBER)]
    points = Chart(data(rows)).mark_point(size=50).encode(x=x, y=y, tooltip=tooltip, **looks)
    chart = alt.layer(line, points).properties(width=480, height=340, title=heading)
    return Illustration(
        chart=chart.properties(description=f"{heading}: measured against predicted for {len(rows)} runs."),
        caption="Each run predicted from all others.",
    )


def misfits(heading: str, trials: Sequence[Mapping[str, Json]]) -> Illustration | None:
    """Misfit of each signal in each trial as a map, to switch between before, after and what else there is."""
    rows = [
        {"group": _GROUPS.get(trial.get("held_out"), ""), "trial": str(trial.get("trial", ""))}
        | {"signal": words(signal)[0], "model": model.replace("_", " "), "misfit": float(value)}
        for trial in trials
        for signal, models in (trial.get("signals") or {}).items()
        for model, value in models.items()
        if is_number_value(value)
    ]
    models = list(dict.fromkeys(row["model"] for row in rows))
    if not models:
        return None
    return Illustration(chart=misfit_maps(rows, models, title=heading), caption="1 is noise.")


_GROUPS: dict[object, str] = {True: "held out trials", False: "fitting trials"}


def bode(heading: str, label: str, value: Mapping[str, Json]) -> Illustration:
    """A Bode diagram from ``omega_radps``, ``magnitude_dB`` and ``phase_deg``."""
    gain = 10 ** (np.array(value["magnitude_dB"], dtype=float) / 20)
    response = gain * np.exp(1j * np.radians(np.array(value["phase_deg"], dtype=float)))
    found = FrequencyResponse(label=label, omega_radps=value["omega_radps"], response=response)
    return Illustration(chart=bode_chart([found], title=heading))


def poles(heading: str, label: str, found: Json, zeros: Json = ()) -> Illustration:
    """Poles and zeros, [real, imaginary] each."""
    both = [[complex(*number) for number in numbers or []] for numbers in (found, zeros)]
    return Illustration(chart=pole_zero_chart([PolesZeros(label=label, poles=both[0], zeros=both[1])], title=heading))


def errors(heading: str, found: Json, limits: Json) -> Illustration | None:
    """Errors of an FMU's outputs, by kind, each next to its limit; None where these are none."""
    if not (isinstance(found, Mapping) and isinstance(limits, Mapping)):
        return None
    all_of_them = [
        OutputError(kind=kind, output=output, error=error, limit=limits[kind])
        for kind, outputs in found.items()
        for output, error in (outputs.items() if isinstance(outputs, Mapping) else ())
        if is_number_value(error) and is_number_value(limits.get(kind))
    ]
    return Illustration(chart=error_chart(all_of_them, title=heading)) if all_of_them else None


def influences(heading: str, found: Mapping[str, Mapping[str, Json]]) -> Illustration | None:
    """The strongest influences of parameters on figures, in per cent, as a map."""

    def size(of: Json) -> float | None:
        value = of.get("exact", of.get("difference")) if isinstance(of, Mapping) else of
        return float(value) if is_number_value(value) else None

    strongest: dict[str, float] = {}
    for values in found.values():
        for name, influence in values.items():
            strongest[name] = max(strongest.get(name, 0.0), abs(size(influence) or 0.0))
    names = sorted(strongest, key=lambda name: -strongest[name])[:20]
    if not names:
        return None
    figures = list(found)
    matrix = [[size(found[figure].get(name)) for figure in figures] for name in names]
    shown = [" ".join(part for part in words(figure) if part) for figure in figures]
    return heat_map(heading, [name.removeprefix("derivatives.") for name in names], shown, matrix)


def _plain(value: Json) -> float | None:
    return plain(float(value)) if is_number_value(value) else None
