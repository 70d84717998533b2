"""Charts of a gap between simulation and measurement: tracks, the worst places, the misfit by signal and trial."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from tank2sim.answer.charts.before_after import misfit_maps
from tank2sim.answer.charts.parts import extent, plain, records, with_unit
from tank2sim.answer.charts.vega import ChartRecord, ChartSpec, heading, layer, layered, panel_title, tooltips
from tank2sim.gap.outcome.study import GapReplay, GapStudy
from tank2sim.gap.result import MisfitPlace
from tank2sim.records.signals.columns import SignalName
from tank2sim.records.thinning import thin_points
from tank2sim.results.gap_text import trial_name
from tank2sim.results.trial_charts import (
    AFTER,
    BEFORE,
    MEASURED,
    MOST_TRIALS,
    panel_grid,
    place_over_time,
    series_marks,
    track_grid,
    whole_range,
    worst_trials,
)
from tank2sim.simulation.motion_record import OBSERVED_SIGNALS
from tank2sim.units import to_si

FEW_TRIALS = 3
"""Tracks below the verdict: one row of pictures. Project choice."""

MOST_PLACES = 6
"""Worst places that are shown over time: two rows of pictures (project choice)."""

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


def changes_simulation(study: GapStudy) -> bool:
    """Whether anything was added to the card, or found in the records, that changes a simulation."""
    return any(
        not np.array_equal(values, replay.found[name], equal_nan=True)
        for replay in study.replays
        for name, values in replay.before.items()
    )


def shown_models(study: GapStudy) -> tuple[str, ...]:
    """Which simulations differ: before alone where nothing was added."""
    return ("before", "after") if changes_simulation(study) else ("before",)


def worst_replays(study: GapStudy, *, held_out: bool, most: int = MOST_TRIALS) -> list[GapReplay]:
    """Replays of held-out or of fitting trials with the largest misfits before, in the order of the trials."""
    chosen = [place for place, trial in enumerate(study.trials) if trial.held_out == held_out]
    replays = [replace(study.replays[place], trial=trial_name(study.replays[place].trial)) for place in chosen]
    return worst_trials(replays, [study.trials[place].misfit.get("before", np.inf) for place in chosen], most)


def worst_tracks(study: GapStudy, *, title: str = "") -> ChartSpec | None:
    """Tracks of the few trials with the largest misfit before, held-out ones where there are any; None without."""
    held_out = any(trial.held_out for trial in study.trials)
    return track_grid(worst_replays(study, held_out=held_out, most=FEW_TRIALS), title=title)


def shown_places(study: GapStudy) -> list[MisfitPlace]:
    """The worst places, one of each signal of a trial; where none were found, the signals of the largest misfit."""
    signals = {trial.trial: trial.signals for trial in study.trials}
    places = [place for place in study.where if place.signal in signals.get(place.trial, ())]
    if not places:
        times = {replay.trial: replay.measured["t_s"] for replay in study.replays}
        whole = [
            MisfitPlace(trial, name, float(times[trial][0]), float(times[trial][-1]), np.nan)
            for trial, names in signals.items()
            for name in names
        ]
        places = sorted(whole, key=lambda place: -signals[place.trial][place.signal]["before"])
    first = {(place.trial, place.signal): place for place in reversed(places)}
    return sorted(first.values(), key=places.index)[:MOST_PLACES]


def place_chart(study: GapStudy, *, title: str = "") -> ChartSpec | None:
    """Signals over time where the misfit is worst, above; simulated less measured and the band of the noise, below.

    The shaded time is that of the place. None without any measurement.
    """
    replays = {replay.trial: replay for replay in study.replays}
    noise = study.misfit.noise
    panels = [_place_panels(replays[place.trial], place, noise[place.signal].sigma) for place in shown_places(study)]
    if not panels:
        return None
    return panel_grid(
        panels,
        heading(title, "Above: the signal. Below: simulated less measured; grey: 95 % of the noise."),
        "Time histories of the worst places, and what is left next to the noise.",
    )


def _place_panels(replay: GapReplay, place: MisfitPlace, sigma: float) -> ChartSpec:
    name, time_s = signal_of(place.signal), replay.measured["t_s"]
    measured, times = replay.measured[name.file], extent(time_s)
    known = np.flatnonzero(np.isfinite(measured))
    points = known[thin_points([measured[known]], SHOWN_POINTS)]
    rows = records(MEASURED, {"t": time_s[points], "v": measured[points]})
    residuals: list[ChartRecord] = []
    for label, values in {BEFORE: replay.before[name.file], AFTER: replay.found[name.file]}.items():
        kept = thin_points([values], SHOWN_SAMPLES)
        rows += records(label, {"t": time_s[kept], "v": values[kept]})
        kept = known[thin_points([(values - measured)[known]], SHOWN_SAMPLES)]
        residuals += records(label, {"t": time_s[kept], "v": (values - measured)[kept]})
    spans = [] if (place.t_start_s, place.t_end_s) == times else [(place.t_start_s, place.t_end_s)]
    region: list[ChartRecord] = [{"t": plain(begin), "to": plain(end)} for begin, end in spans]
    low, high = -NOISE_BAND * sigma, NOISE_BAND * sigma
    panels = []
    for drawn, words, height, ends in (
        (rows, name.words, 86, ()),
        (residuals, "simulated − measured", 66, (low, high)),
    ):
        up = with_unit(words, name.unit)
        axes = place_over_time(times, whole_range(drawn, "v", ends), up, "v", labelled=bool(ends))
        said = axes | {"tooltip": tooltips({"run:N": "by", "t:Q": "time (s)", "v:Q": up})}
        behind = [layer("rect", region, {"x": axes["x"], "x2": "to"}, style="region", clip=True)] if region else []
        if ends:
            band = {"y": axes["y"] | {"field": "low"}, "y2": "high"}
            strip: list[ChartRecord] = [{"low": plain(low), "high": plain(high)}]
            behind.append(layer("rect", strip, band, style="reference", opacity=0.3))
        panels.append(layered([*behind, *series_marks(said)], size=(200, height), data={"values": drawn}))
    return {"vconcat": panels, "spacing": 16, "title": panel_title(f"{trial_name(place.trial)} · {name.words}")}


def misfit_chart(study: GapStudy, *, title: str = "") -> ChartSpec:
    """Misfit of each signal in each trial in noise units, to switch between before, after and both side by side."""
    measured = {name for trial in study.trials for name in trial.signals}
    ordered = [SignalName(name).file for name in OBSERVED_SIGNALS]
    signals = [name for name in ordered if name in measured] + sorted(measured.difference(ordered))
    models = shown_models(study)
    words = {held: f"{word} trials" for word, held in SETS.items()}
    rows = [
        {"group": words[trial.held_out], "trial": trial_name(trial.trial), "model": model}
        | {"signal": name.rpartition("_")[0].replace("_", " "), "misfit": trial.signals[name][model]}
        for trial in sorted(study.trials, key=lambda trial: not trial.held_out)
        for name in signals
        if name in trial.signals
        for model in models
    ]
    return misfit_maps(rows, models, title=title)
