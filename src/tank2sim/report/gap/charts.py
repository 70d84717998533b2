"""Charts of a gap between simulation and measurement: tracks, the worst places, the misfit by signal and trial."""

from __future__ import annotations

import math
from collections.abc import Sequence

import altair as alt
import numpy as np

from tank2sim.arrays import Array
from tank2sim.gap.outcome.export import measured_in, signal_display_name
from tank2sim.gap.result import Gap, MisfitPlace, Passed
from tank2sim.identification.trials.problem.sampled_runs import OBSERVED_SIGNALS
from tank2sim.records.thinning import thin_points
from tank2sim.report.identification.charts import (
    AFTER,
    BEFORE,
    MEASURED,
    MODEL_SERIES,
    PANELS_PER_ROW,
    SERIES,
    history_grid,
    track_grid,
)
from tank2sim.report.kit.before_after import before_after_switch, misfit_maps, switch
from tank2sim.report.kit.chart_parts import (
    NUMBER,
    ChartRecord,
    SeriesLook,
    axis_above,
    data,
    extent,
    plain,
    records,
    series_look,
    with_unit,
)
from tank2sim.report.kit.json_values import Json

MOST_TRIALS_DRAWN = 12
"""Tracks in one picture: those of the largest misfit before; more are hard to look at (project choice)."""

MOST_PLACES = 6
"""Worst places that are shown over time: two rows of pictures (project choice)."""

_PER_SHEET = 6
"""Trials in one picture of histories: as many as are readable on a sheet of paper."""

HISTORIES = {
    "psi_deg": "heading",
    "r_degps": "yaw rate",
    "u_mps": "velocity ahead",
    "v_mps": "velocity to starboard",
    "u_ground_mps": "velocity ahead, ground",
    "v_ground_mps": "to starboard, ground",
    "sog_mps": "speed over ground",
}
"""Column of a trial that is shown over time, to its words."""

SHOWN_SAMPLES, SHOWN_POINTS = 140, 50
"""Samples of a line, and points of what was measured, in a panel of about 200 px."""

NOISE_BAND = 2.0
"""Half the width of the noise band, in standard deviations of the noise: 95 % of the measurements are inside."""

SETS = {"held out": True, "fitting": False}
"""Words for the two kinds of trials to whether they were held out; the honest ones first."""


def changes_simulation(gap: Gap) -> bool:
    """Whether anything was added to the card, or found in the records, that changes a simulation."""
    return any(
        not np.array_equal(replay.before[name], replay.after[name], equal_nan=True)
        for replay in gap.passed
        for name in replay.noise
    )


def shown_models(gap: Gap) -> tuple[str, ...]:
    """Which simulations of :class:`Passed` differ: before alone where nothing was added."""
    return ("before", "after") if changes_simulation(gap) else ("before",)


def gap_tracks(gap: Gap, *, held_out: bool, title: str = "") -> alt.ConcatChart | None:
    """Tracks as measured, by the card before and by the card found, a panel a trial; None without any.

    Of many trials those are shown whose misfit before was largest.
    """
    chosen = [replay for replay in gap.passed if replay.held_out == held_out]
    worst = {trial.name for trial in sorted(chosen, key=lambda trial: -trial.misfit("before"))[:MOST_TRIALS_DRAWN]}
    return track_grid([_columns(trial) for trial in chosen if trial.name in worst], title=title)


def gap_histories(gap: Gap, *, held_out: bool, title: str = "") -> list[alt.ConcatChart]:
    """Motions over time as measured, by the card before and by the card found, a column a trial, in sheets.

    Of many trials those are shown whose misfit before was largest.
    """
    chosen = [
        replay
        for replay in gap.passed
        if replay.held_out == held_out
        and any(signal_display_name(name).file in HISTORIES for name in measured_in(replay))
    ]
    worst = {trial.name for trial in sorted(chosen, key=lambda trial: -trial.misfit("before"))[:MOST_TRIALS_DRAWN]}
    columns = [_columns(trial) for trial in chosen if trial.name in worst]
    sheets = [columns[first : first + _PER_SHEET] for first in range(0, len(columns), _PER_SHEET)]
    return [history_grid(sheet, signals=HISTORIES, title=title) for sheet in sheets]


def _columns(replay: Passed) -> Json:
    """A trial in the form of ``replays`` in the JSON of an identification."""
    names = {name: signal_display_name(name) for name in measured_in(replay)}
    runs = {MEASURED: replay.measured, BEFORE: replay.before, AFTER: replay.after}
    return {"trial": replay.name} | {
        SERIES[label]: {"t_s": replay.time_s}
        | {column.file: column.factor * values[name] for name, column in names.items()}
        for label, values in runs.items()
    }


def shown_places(gap: Gap) -> list[MisfitPlace]:
    """The worst places, one of each signal of a trial; where none were found, the signals of the largest misfit."""
    known = {replay.name: replay for replay in gap.passed}
    found = [place for place in gap.where if place.trial in known and place.signal in measured_in(known[place.trial])]
    if not found:
        whole = [
            MisfitPlace(replay.name, name, float(replay.time_s[0]), float(replay.time_s[-1]), math.nan)
            for replay in gap.passed
            for name in measured_in(replay)
        ]
        found = sorted(whole, key=lambda place: -known[place.trial].misfit("before", place.signal))
    first = {(place.trial, place.signal): place for place in reversed(found)}
    return sorted(first.values(), key=found.index)[:MOST_PLACES]


def place_chart(gap: Gap, *, title: str = "") -> alt.ConcatChart | None:
    """Signals over time where the misfit is worst, above; simulated less measured and the band of the noise, below.

    The shaded time is that of the place. None without any measurement.
    """
    known = {replay.name: replay for replay in gap.passed}
    panels = [_place_panels(known[place.trial], place) for place in shown_places(gap)]
    if not panels:
        return None
    grid = alt.concat(*panels, columns=PANELS_PER_ROW, spacing=26, params=switch(list(MODEL_SERIES)))
    shared = grid.resolve_scale(color="shared", strokeDash="shared", shape="shared")
    return shared.properties(
        title=alt.Title(title, subtitle="Above: the signal. Below: simulated less measured; grey: 95 % of the noise."),
        description="Time histories of the worst places, and what is left next to the noise.",
    )


def _place_panels(replay: Passed, place: MisfitPlace) -> alt.VConcatChart:
    name, look = signal_display_name(place.signal), series_look([AFTER, BEFORE, MEASURED], as_points=[MEASURED])
    measured = name.factor * replay.measured[place.signal]
    models = {BEFORE: name.factor * replay.before[place.signal], AFTER: name.factor * replay.after[place.signal]}
    known = np.flatnonzero(np.isfinite(measured))
    points = known[thin_points([measured[known]], SHOWN_POINTS)]
    rows = records(MEASURED, {"t": replay.time_s[points], "v": measured[points]})
    residuals: list[ChartRecord] = []
    for label, values in models.items():
        kept = thin_points([values], SHOWN_SAMPLES)
        rows += records(label, {"t": replay.time_s[kept], "v": values[kept]})
        kept = known[thin_points([(values - measured)[known]], SHOWN_SAMPLES)]
        residuals += records(label, {"t": replay.time_s[kept], "v": (values - measured)[kept]})
    band = NOISE_BAND * name.factor * replay.noise[place.signal]
    times = extent(replay.time_s)
    above = _over_time(rows, times, with_unit(name.words, name.unit), look, labelled=False)
    below = _over_time(
        residuals, times, with_unit("simulated − measured", name.unit), look, labelled=True, included=(-band, band)
    )
    noise = alt.Chart(data([{"low": plain(-band), "high": plain(band)}])).mark_rect(style="reference", opacity=0.3)
    spans = alt.Chart(data([{"from": plain(place.t_start_s), "to": plain(place.t_end_s)}])).mark_rect(
        style="region", clip=True
    )
    when = spans.encode(x="from:Q", x2="to:Q")
    behind = [when] if (place.t_start_s, place.t_end_s) != times else []
    return alt.vconcat(
        alt.layer(*behind, *above).properties(width=200, height=86),
        alt.layer(*behind, noise.encode(y="low:Q", y2="high:Q"), *below).properties(width=200, height=66),
        spacing=16,
    ).properties(title=small(f"{place.trial} · {name.words}"))


def _over_time(
    rows: Sequence[ChartRecord],
    times: tuple[float, float],
    up: str,
    look: SeriesLook,
    *,
    labelled: bool,
    included: Sequence[float] = (),
) -> list[alt.Chart]:
    axis = alt.Axis(title="time (s)", tickCount=4) if labelled else alt.Axis(title=None, labels=False, ticks=False)
    x = alt.X("t:Q", scale=alt.Scale(domain=list(times), nice=False, zero=False), axis=axis)
    # The scale is reported: it stays when the switch takes a line away.
    ends = [row["v"] for row in rows if row["v"] is not None] + list(included)
    scale = alt.Scale(domain=list(extent(np.array(ends, dtype=float))), nice=True, zero=False)
    y = alt.Y("v:Q", scale=scale, axis=axis_above(up, tickCount=3))
    tooltip = [
        alt.Tooltip("run:N", title="by"),
        alt.Tooltip("t:Q", title="time (s)", format=NUMBER),
        alt.Tooltip("v:Q", title=up, format=NUMBER),
    ]
    lines = alt.Chart(data([row for row in rows if row["run"] != MEASURED])).mark_line(clip=True, strokeWidth=1.5)
    lines = lines.transform_filter(before_after_switch(MODEL_SERIES))
    drawn = [lines.encode(x=x, y=y, color=look.colour, strokeDash=look.dash, order="i:Q", tooltip=tooltip)]
    if points := [row for row in rows if row["run"] == MEASURED]:
        marks = alt.Chart(data(points)).mark_point(clip=True, size=14, strokeWidth=1)
        drawn.insert(0, marks.encode(x=x, y=y, color=look.colour, shape=look.shape, tooltip=tooltip))
    return drawn


def misfit_chart(gap: Gap, *, title: str = "") -> alt.VConcatChart:
    """Misfit of each signal in each trial in noise units, to switch between before, after and both side by side."""
    measured = {name for replay in gap.passed for name in measured_in(replay)}
    signals = [name for name in OBSERVED_SIGNALS.values() if name in measured] + sorted(
        measured - set(OBSERVED_SIGNALS.values())
    )
    words = {name: signal_display_name(name).file.rpartition("_")[0].replace("_", " ") for name in signals}
    rows = [
        {"group": f"{word} trials", "trial": replay.name, "signal": words[name], "model": model}
        | {"misfit": replay.misfit(model, name)}
        for word, held in SETS.items()
        for replay in gap.passed
        if replay.held_out == held
        for name in signals
        if name in measured_in(replay)
        for model in shown_models(gap)
    ]
    return misfit_maps(rows, shown_models(gap), title=title)


def small(text: str) -> alt.Title:
    """Title of one panel among several."""
    return alt.Title(text, fontSize=11, offset=22, limit=260)


def signal_misfit(gap: Gap, model: str, variable: str, *, held_out: bool) -> float | None:
    """Misfit of one signal over all trials of a set that measured it, in noise units; None without any."""
    trials = [replay for replay in gap.passed if replay.held_out == held_out and variable in measured_in(replay)]
    if not trials or (model == "black_box" and not all(variable in trial.black_box for trial in trials)):
        return None
    squares: Array = np.array([trial.misfit(model, variable) ** 2 for trial in trials])
    return float(np.sqrt(squares.mean()))
