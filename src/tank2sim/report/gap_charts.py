"""Charts of a gap between simulation and measurement: tracks, the worst places, the misfit by signal and trial."""

from __future__ import annotations

import math
from collections.abc import Sequence

import altair as alt
import numpy as np

from tank2sim.gap.as_json import measured_in, signal_name
from tank2sim.gap.result import Gap, Passed, Place
from tank2sim.identification.trials.evaluation import Passage
from tank2sim.identification.trials.runs import SEEN
from tank2sim.report.chart_parts import (
    NUMBER,
    Record,
    SeriesLook,
    axis_above,
    data,
    extent,
    plain,
    records,
    series_look,
    with_unit,
)
from tank2sim.report.identification_charts import ACROSS, AFTER, BEFORE, MEASURED, Pair, track_grid
from tank2sim.report.thinning import Vector, thin_points

MOST_TRIALS = 12
"""Tracks in one picture: those of the largest misfit before; more are hard to look at (ours)."""

MOST_PLACES = 6
"""Worst places that are shown over time: two rows of pictures (ours)."""

SHOWN_SAMPLES, SHOWN_POINTS = 140, 50
"""Samples of a line, and points of what was measured, in a panel of about 200 px."""

NOISE_BAND = 2.0
"""Half the width of the noise band, in standard deviations of the noise: 95 % of the measurements are inside."""

MISFIT_SHOWN = 100.0
"""Misfit in noise units at which the darkest colour begins (ours): far from any doubt."""

SETS = {"held out": True, "fitting": False}
"""Words for the two kinds of trials to whether they were held out; the honest ones first."""


def added(gap: Gap) -> bool:
    """Whether anything was added to the card, or found in the records, that changes a simulation."""
    return any(
        not np.array_equal(one.before[name], one.after[name], equal_nan=True)
        for one in gap.passed
        for name in one.noise
    )


def shown_models(gap: Gap) -> tuple[str, ...]:
    """Which simulations of :class:`Passed` differ: before alone where nothing was added."""
    return ("before", "after") if added(gap) else ("before",)


def gap_tracks(gap: Gap, *, held_out: bool, title: str = "") -> alt.ConcatChart | None:
    """Tracks as measured, by the card before and by the card found, a panel a trial; None without any.

    Of many trials those are shown whose misfit before was largest.
    """
    chosen = [one for one in gap.passed if one.held_out == held_out]
    worst = {one.name for one in sorted(chosen, key=lambda one: -one.misfit("before"))[:MOST_TRIALS]}
    return track_grid([_pair(one) for one in chosen if one.name in worst], title=title)


def _pair(one: Passed) -> Pair:
    measured = {name: one.measured[name] for name in measured_in(one) if name in ("motion.x", "motion.y")}
    before, after = (
        Passage(one.name, False, one.time_s, measured, one.time_s, simulated) for simulated in (one.before, one.after)
    )
    return Pair(before=before, after=after)


def shown_places(gap: Gap) -> list[Place]:
    """The worst places, one of each signal of a trial; where none were found, the signals of the largest misfit."""
    known = {one.name: one for one in gap.passed}
    found = [place for place in gap.where if place.trial in known and place.signal in measured_in(known[place.trial])]
    if not found:
        whole = [
            Place(one.name, name, float(one.time_s[0]), float(one.time_s[-1]), math.nan)
            for one in gap.passed
            for name in measured_in(one)
        ]
        found = sorted(whole, key=lambda place: -known[place.trial].misfit("before", place.signal))
    first = {(place.trial, place.signal): place for place in reversed(found)}
    return sorted(first.values(), key=found.index)[:MOST_PLACES]


def place_chart(gap: Gap, *, title: str = "") -> alt.ConcatChart | None:
    """Signals over time where the misfit is worst, above; simulated less measured and the band of the noise, below.

    The shaded time is that of the place. None without any measurement.
    """
    known = {one.name: one for one in gap.passed}
    panels = [_place_panels(known[place.trial], place) for place in shown_places(gap)]
    if not panels:
        return None
    grid = alt.concat(*panels, columns=ACROSS, spacing=26)
    shared = grid.resolve_scale(color="shared", strokeDash="shared", shape="shared")
    return shared.properties(
        title=alt.Title(title, subtitle="Above: the signal. Below: simulated less measured; grey: 95 % of the noise."),
        description="Time histories of the worst places, and what is left beside the noise.",
    )


def _place_panels(one: Passed, place: Place) -> alt.VConcatChart:
    name, look = signal_name(place.signal), series_look([AFTER, BEFORE, MEASURED], as_points=[MEASURED])
    measured = name.factor * one.measured[place.signal]
    models = {BEFORE: name.factor * one.before[place.signal], AFTER: name.factor * one.after[place.signal]}
    there = np.flatnonzero(np.isfinite(measured))
    points = there[thin_points([measured[there]], SHOWN_POINTS)]
    rows = records(MEASURED, {"t": one.time_s[points], "v": measured[points]})
    left: list[Record] = []
    for label, values in models.items():
        kept = thin_points([values], SHOWN_SAMPLES)
        rows += records(label, {"t": one.time_s[kept], "v": values[kept]})
        kept = there[thin_points([(values - measured)[there]], SHOWN_SAMPLES)]
        left += records(label, {"t": one.time_s[kept], "v": (values - measured)[kept]})
    band = NOISE_BAND * name.factor * one.noise[place.signal]
    times = extent(one.time_s)
    above = _over_time(rows, times, with_unit(name.words, name.unit), look, labelled=False)
    below = _over_time(left, times, with_unit("simulated − measured", name.unit), look, labelled=True)
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
    rows: Sequence[Record], times: tuple[float, float], up: str, look: SeriesLook, *, labelled: bool
) -> list[alt.Chart]:
    axis = alt.Axis(title="time (s)", tickCount=4) if labelled else alt.Axis(title=None, labels=False, ticks=False)
    x = alt.X("t:Q", scale=alt.Scale(domain=list(times), nice=False, zero=False), axis=axis)
    y = alt.Y("v:Q", scale=alt.Scale(zero=False), axis=axis_above(up, tickCount=3))
    tooltip = [
        alt.Tooltip("run:N", title="by"),
        alt.Tooltip("t:Q", title="time (s)", format=NUMBER),
        alt.Tooltip("v:Q", title=up, format=NUMBER),
    ]
    lines = alt.Chart(data([row for row in rows if row["run"] != MEASURED])).mark_line(clip=True, strokeWidth=1.5)
    drawn = [lines.encode(x=x, y=y, color=look.colour, strokeDash=look.dash, order="i:Q", tooltip=tooltip)]
    if points := [row for row in rows if row["run"] == MEASURED]:
        marks = alt.Chart(data(points)).mark_point(clip=True, size=14, strokeWidth=1)
        drawn.insert(0, marks.encode(x=x, y=y, color=look.colour, shape=look.shape, tooltip=tooltip))
    return drawn


def misfit_chart(gap: Gap, *, title: str = "") -> alt.VConcatChart:
    """Misfit of each signal in each trial in noise units, before and after side by side, in one scale of colours."""
    there = {name for one in gap.passed for name in measured_in(one)}
    signals = [name for name in SEEN.values() if name in there] + sorted(there - set(SEEN.values()))
    rows: list[alt.HConcatChart] = []
    for word, held in SETS.items():
        trials = [one for one in gap.passed if one.held_out == held]
        if trials:
            maps = [
                _misfit_map(trials, signals, which, f"{word} trials, {which}", head=not rows)
                for which in shown_models(gap)
            ]
            rows.append(alt.hconcat(*maps, spacing=16))
    subtitle = "Number and colour: root mean square of simulated less measured, in standard deviations of the noise."
    return alt.vconcat(*rows, spacing=18).properties(
        title=alt.Title(title, subtitle=subtitle),
        description="Misfit by trial and signal in noise units, before and after.",
    )


def _misfit_map(
    trials: Sequence[Passed], signals: Sequence[str], which: str, title: str, *, head: bool
) -> alt.LayerChart:
    words = {name: signal_name(name).file.rpartition("_")[0].replace("_", " ") for name in signals}
    rows = [
        {
            "trial": one.name,
            "signal": words[name],
            "misfit": min(one.misfit(which, name), MISFIT_SHOWN),
            "text": in_noise(one.misfit(which, name)),
        }
        for one in trials
        for name in measured_in(one)
    ]
    named = which == "before"
    side = alt.Axis(title=None, labelLimit=230) if named else alt.Axis(title=None, labels=False, ticks=False)
    y = alt.Y("trial:N", sort=[one.name for one in trials], axis=side)
    x = alt.X("signal:N", sort=list(words.values()), scale=alt.Scale(domain=list(words.values())))
    x = x.axis(title="signal", orient="bottom", labelAngle=0)
    colours = alt.Scale(type="log", domain=[1, MISFIT_SHOWN], scheme="blues", clamp=True)
    legend = alt.Legend(title="misfit (noise units)", gradientLength=180) if named and head else None
    tooltip = [alt.Tooltip("trial:N"), alt.Tooltip("signal:N"), alt.Tooltip("text:N", title="misfit (noise units)")]
    base = alt.Chart(data(rows)).encode(x=x, y=y, tooltip=tooltip)
    cells = base.mark_rect().encode(color=alt.Color("misfit:Q", scale=colours, legend=legend))
    ink = alt.condition("datum.misfit > 18", alt.value("white"), alt.value("black"))  # on the cell, whatever the page
    numbers = base.mark_text(fontSize=10.5).encode(text="text:N", color=ink)
    size = {"width": 40 * len(signals), "height": 21 * len(trials)}
    return alt.layer(cells, numbers).properties(title=small(title), **size)


def in_noise(misfit: float) -> str:
    """A misfit as a cell shows it: two figures, or more where it has them before the point."""
    if not math.isfinite(misfit):
        return "∞"
    if misfit >= 1e4:
        return f"{misfit:.0e}".replace("e+0", "e").replace("e+", "e")
    return f"{misfit:.0f}" if misfit >= 9.95 else f"{misfit:.1f}"


def small(text: str) -> alt.Title:
    """Title of one panel among several."""
    return alt.Title(text, fontSize=11, offset=22, limit=260)


def signal_misfit(gap: Gap, which: str, variable: str, *, held_out: bool) -> float | None:
    """Misfit of one signal over all trials of a set that measured it, in noise units; None without any."""
    trials = [one for one in gap.passed if one.held_out == held_out and variable in measured_in(one)]
    if not trials or (which == "black_box" and not all(variable in one.black_box for one in trials)):
        return None
    squares: Vector = np.array([one.misfit(which, variable) ** 2 for one in trials])
    return float(np.sqrt(squares.mean()))
