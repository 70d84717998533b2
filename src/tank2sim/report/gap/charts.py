"""Charts of a gap between simulation and measurement: tracks, the worst places, the misfit by signal and trial."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import altair as alt
import numpy as np

from tank2sim.answer.charts.before_after import before_after_switch, misfit_maps, switch
from tank2sim.answer.charts.parts import (
    NUMBER,
    Chart,
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
from tank2sim.arrays import Array
from tank2sim.identification.trials.problem.sampled_runs import OBSERVED_SIGNALS
from tank2sim.identification.trials.study import TrialMotions
from tank2sim.records.signals.columns import SignalName
from tank2sim.records.thinning import thin_points
from tank2sim.report.gap.text import or_nan, trial_name
from tank2sim.report.json_values import Json, as_number
from tank2sim.results.trial_charts import (
    AFTER,
    BEFORE,
    MEASURED,
    MODEL_SERIES,
    PANELS_PER_ROW,
    SERIES,
    history_grid,
    track_grid,
)
from tank2sim.units import to_si

MOST_TRIALS_DRAWN = 12
"""Tracks in one picture: those of the largest misfit before; more are hard to look at (project choice)."""

FEW_TRIALS = 3
"""Tracks below the verdict: one row of pictures. Project choice."""

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


def signal_of(column: str) -> SignalName:
    """The signal of a column of a trial file."""
    return SignalName(to_si(column, 1.0)[0])


def changes_simulation(found: Json) -> bool:
    """Whether anything was added to the card, or found in the records, that changes a simulation."""
    return any(replay["before"] != replay["found"] for replay in found["replays"])


def shown_models(found: Json) -> tuple[str, ...]:
    """Which simulations differ: before alone where nothing was added."""
    return ("before", "after") if changes_simulation(found) else ("before",)


def gap_tracks(found: Json, *, held_out: bool, title: str = "") -> alt.ConcatChart | None:
    """Tracks as measured, by the card before and by the card found, a panel a trial; None without any.

    Of many trials those are shown whose misfit before was largest.
    """
    return track_grid(_worst(found, lambda trial: trial["held_out"] == held_out), title=title)


def worst_tracks(found: Json, *, title: str = "") -> alt.ConcatChart | None:
    """Tracks of the few trials whose misfit before was largest, those held out where there are any; None without."""
    held_out = any(trial["held_out"] for trial in found["trials"])
    return track_grid(_worst(found, lambda trial: trial["held_out"] == held_out, FEW_TRIALS), title=title)


def gap_histories(found: Json, *, held_out: bool, title: str = "") -> list[alt.ConcatChart]:
    """Motions over time as measured, by the card before and by the card found, a column a trial, in sheets.

    Of many trials those are shown whose misfit before was largest.
    """
    columns = _worst(
        found, lambda trial: trial["held_out"] == held_out and not HISTORIES.keys().isdisjoint(trial["signals"])
    )
    sheets = [columns[first : first + _PER_SHEET] for first in range(0, len(columns), _PER_SHEET)]
    return [history_grid(sheet, signals=HISTORIES, title=title) for sheet in sheets]


def _worst(found: Json, chosen: Callable[[Json], bool], most: int = MOST_TRIALS_DRAWN) -> list[TrialMotions]:
    """Replays of the chosen trials, of many those whose misfit before was largest, by the names of the trials."""
    misfits = {
        place: as_number(trial["misfit"].get("before")) for place, trial in enumerate(found["trials"]) if chosen(trial)
    }
    worst = sorted(misfits, key=lambda place: -misfits[place])[:most]
    return [_motions(found["replays"][place]) for place in sorted(worst)]


def _motions(replay: Json) -> TrialMotions:
    """A replay of the JSON."""
    series = {
        key: {name: np.array(values, dtype=float) for name, values in replay[key].items()} for key in SERIES.values()
    }
    return TrialMotions(trial=trial_name(replay["trial"]), **series)


def shown_places(found: Json) -> list[Json]:
    """The worst places, one of each signal of a trial; where none were found, the signals of the largest misfit.

    Each has the keys of an entry of ``where``.
    """
    signals = {trial["trial"]: trial["signals"] for trial in found["trials"]}
    places = [place for place in found["where"] if place["signal"] in signals.get(place["trial"], ())]
    if not places:
        times = {replay["trial"]: replay["measured"]["t_s"] for replay in found["replays"]}
        whole = [
            {"trial": trial, "signal": name, "t_start_s": times[trial][0], "t_end_s": times[trial][-1]}
            for trial, names in signals.items()
            for name in names
        ]
        places = sorted(whole, key=lambda place: -as_number(signals[place["trial"]][place["signal"]]["before"]))
    first = {(place["trial"], place["signal"]): place for place in reversed(places)}
    return sorted(first.values(), key=places.index)[:MOST_PLACES]


def place_chart(found: Json, *, title: str = "") -> alt.ConcatChart | None:
    """Signals over time where the misfit is worst, above; simulated less measured and the band of the noise, below.

    The shaded time is that of the place. None without any measurement.
    """
    replays = {replay["trial"]: replay for replay in found["replays"]}
    noise = found["misfit"]["noise"]
    panels = [
        _place_panels(replays[place["trial"]], place, noise[place["signal"]]["sigma"]) for place in shown_places(found)
    ]
    if not panels:
        return None
    grid = alt.concat(*panels, columns=PANELS_PER_ROW, spacing=26, params=switch(list(MODEL_SERIES)))
    shared = grid.resolve_scale(color="shared", strokeDash="shared", shape="shared")
    return shared.properties(
        title=alt.Title(title, subtitle="Above: the signal. Below: simulated less measured; grey: 95 % of the noise."),
        description="Time histories of the worst places, and what is left next to the noise.",
    )


def _place_panels(replay: Json, place: Json, sigma: float) -> alt.VConcatChart:
    name, look = signal_of(place["signal"]), series_look([AFTER, BEFORE, MEASURED], as_points=[MEASURED])
    time_s, measured, before, found = (
        np.array(replay[key][column], dtype=float)
        for key, column in (("measured", "t_s"), *((key, name.file) for key in SERIES.values()))
    )
    models = {BEFORE: before, AFTER: found}
    known = np.flatnonzero(np.isfinite(measured))
    points = known[thin_points([measured[known]], SHOWN_POINTS)]
    rows = records(MEASURED, {"t": time_s[points], "v": measured[points]})
    residuals: list[ChartRecord] = []
    for label, values in models.items():
        kept = thin_points([values], SHOWN_SAMPLES)
        rows += records(label, {"t": time_s[kept], "v": values[kept]})
        kept = known[thin_points([(values - measured)[known]], SHOWN_SAMPLES)]
        residuals += records(label, {"t": time_s[kept], "v": (values - measured)[kept]})
    band = NOISE_BAND * sigma
    times = extent(time_s)
    above = _over_time(rows, times, with_unit(name.words, name.unit), look, labelled=False)
    below = _over_time(
        residuals, times, with_unit("simulated − measured", name.unit), look, labelled=True, included=(-band, band)
    )
    noise = Chart(data([{"low": plain(-band), "high": plain(band)}])).mark_rect(style="reference", opacity=0.3)
    begin, end = or_nan(place["t_start_s"]), or_nan(place["t_end_s"])
    spans = Chart(data([{"from": plain(begin), "to": plain(end)}])).mark_rect(style="region", clip=True)
    when = spans.encode(x="from:Q", x2="to:Q")
    behind = [when] if (begin, end) != times else []
    return alt.vconcat(
        alt.layer(*behind, *above).properties(width=200, height=86),
        alt.layer(*behind, noise.encode(y="low:Q", y2="high:Q"), *below).properties(width=200, height=66),
        spacing=16,
    ).properties(title=small(f"{trial_name(place['trial'])} · {name.words}"))


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
    lines = Chart(data([row for row in rows if row["run"] != MEASURED])).mark_line(clip=True, strokeWidth=1.5)
    lines = lines.transform_filter(before_after_switch(MODEL_SERIES))
    drawn = [lines.encode(x=x, y=y, color=look.colour, strokeDash=look.dash, order="i:Q", tooltip=tooltip)]
    if points := [row for row in rows if row["run"] == MEASURED]:
        marks = Chart(data(points)).mark_point(clip=True, size=14, strokeWidth=1)
        drawn.insert(0, marks.encode(x=x, y=y, color=look.colour, shape=look.shape, tooltip=tooltip))
    return drawn


def misfit_chart(found: Json, *, title: str = "") -> alt.VConcatChart:
    """Misfit of each signal in each trial in noise units, to switch between before, after and both side by side."""
    measured = {name for trial in found["trials"] for name in trial["signals"]}
    ordered = [SignalName(name).file for name in OBSERVED_SIGNALS]
    signals = [name for name in ordered if name in measured] + sorted(measured.difference(ordered))
    rows = [
        {"group": f"{word} trials", "trial": trial_name(trial["trial"]), "model": model}
        | {"signal": name.rpartition("_")[0].replace("_", " "), "misfit": as_number(trial["signals"][name][model])}
        for word, held in SETS.items()
        for trial in found["trials"]
        if trial["held_out"] == held
        for name in signals
        if name in trial["signals"]
        for model in shown_models(found)
    ]
    return misfit_maps(rows, shown_models(found), title=title)


def small(text: str) -> alt.Title:
    """Title of one panel among several."""
    return alt.Title(text, fontSize=11, offset=22, limit=260)


def signal_misfit(found: Json, model: str, column: str, *, held_out: bool) -> float | None:
    """Misfit of one signal over all trials of a set that measured it, in noise units; None without any."""
    trials = [
        trial["signals"][column]
        for trial in found["trials"]
        if trial["held_out"] == held_out and column in trial["signals"]
    ]
    if not trials or (model == "black_box" and not all(model in misfits for misfits in trials)):
        return None
    squares: Array = np.array([as_number(misfits[model]) ** 2 for misfits in trials])
    return float(np.sqrt(squares.mean()))
