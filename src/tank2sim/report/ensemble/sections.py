"""Bands of an ensemble: next to the run of the card itself in a picture, and as a section of a page."""

from __future__ import annotations

from collections.abc import Mapping

import altair as alt

from tank2sim.analysis.ensemble.questions import ENSEMBLE_SIGNALS
from tank2sim.analysis.ensemble.results import ManoeuvreBands, StabilityBands
from tank2sim.files import plain_json
from tank2sim.report.ensemble.charts import curve_charts
from tank2sim.report.kit.charts import History, TrackData, history_chart, track_chart
from tank2sim.report.kit.json_values import Json
from tank2sim.report.kit.page import Cell, Column, PageSection, PageTable
from tank2sim.report.kit.run_series import SHIP_SIGNALS, history_of, signals_of, track_data
from tank2sim.report.results.motions import HIGH, LOW, MIDDLE
from tank2sim.report.stability.page import BEYOND_CARD_TEXT
from tank2sim.simulation.bands import Band, small_edge_first
from tank2sim.simulation.trajectory import Trajectory
from tank2sim.units import in_words

_TEXT = (
    "Members of the ensemble are this ship with numbers drawn from the standard errors of its card, and from their "
    "covariance where the card has one. Nine of ten lie between the 5 and the 95 % quantile. Each member has a random "
    "stream of its own, so that the same seed gives the same members everywhere."
)
_CHANCES = (
    " A criterion is met with the probability told: the share of all usable members that meet it, with the 95 % "
    "interval that their number leaves (Wilson). A member whose trial does not show the figure counts as one that "
    "does not meet it. Where the trial of the card itself leaves the card's range no probability is reported."
)


def banded_chart(label: str, run: Trajectory, bands: ManoeuvreBands) -> alt.VConcatChart:
    """Track and histories of the card itself, with the quantiles of the ensemble; those of the track across it."""
    tracks = [track_data(label, run)]
    if bands.track is not None:
        middle = bands.track.middle
        small, large = small_edge_first(bands.track.low, middle, bands.track.high)
        lines = ((LOW, small), (MIDDLE, middle), (HIGH, large))
        kept = slice(bands.track.count)
        tracks += [
            TrackData(label=name, x_m=line[kept, 0], y_m=line[kept, 1], time_s=bands.times_s[kept])
            for name, line in lines
        ]
    track = track_chart(tracks, title=label)
    track.usermeta = alt.Undefined  # only a chart by itself may carry it
    names = {variable: (name, factor) for name, (variable, factor) in ENSEMBLE_SIGNALS.items()}
    histories = [history_of(label, run, SHIP_SIGNALS)]
    for quantile, name in ((LOW, "low"), (MIDDLE, "median"), (HIGH, "high")):
        own = {
            variable: getattr(bands.histories[names[variable][0]], name) / names[variable][1]
            for variable in SHIP_SIGNALS
        }
        histories.append(History(label=quantile, time_s=bands.times_s, values=own))
    return alt.vconcat(track, history_chart(histories, signals_of(run.model, SHIP_SIGNALS)))


def stability_section(found: StabilityBands) -> PageSection:
    """The section of a page of stability."""
    rows: list[list[Cell]] = []
    for chance in found.chances:
        ends: list[Cell] = (
            [chance.band.low, chance.band.median, chance.band.high] if chance.band else [None, None, None]
        )
        between = f"{chance.between[0]:.3f} to {chance.between[1]:.3f}" if chance.between else None
        criterion = chance.criterion
        met: Cell = BEYOND_CARD_TEXT if criterion.beyond_card and chance.met is not None else chance.met
        between = None if criterion.beyond_card else between
        rows.append([criterion.name, *ends, criterion.allowed, criterion.unit, met, between, chance.undecided])
    heads = ["criterion", LOW, MIDDLE, HIGH, "allowed", "unit", "probability met", "95 % interval", "not shown by"]
    columns = [Column(title=head) for head in heads]
    stable = "" if found.stable is None else f" It is stable on a straight course with probability {found.stable:.3g}."
    criteria = PageTable(caption="IMO MSC.137(76), worse side, over the ensemble.", columns=columns, rows=rows)
    straight = _table("The straight course at the card's speed.", found.figures)
    return PageSection(
        heading=f"Ensemble of {found.asked.members}",
        text=_TEXT + _CHANCES + stable,
        tables=[criteria, straight],
        charts=curve_charts(plain_json(found.curves.as_json())) if found.curves else (),
        notes=found.asked.notices,
    )


def figures_section(found: Json) -> PageSection:
    """The section of a page of influence coefficients, from what JSON has of a
    :class:`tank2sim.analysis.ensemble.results.FigureBands`."""
    bands = {name: Band(one["p5"], one["p50"], one["p95"], one["shown_by"]) for name, one in found["figures"].items()}
    return PageSection(
        heading=f"Ensemble of {found['members']}",
        text=_TEXT,
        tables=[_table("Figures over the ensemble.", bands)],
        notes=found["notices"],
    )


def _table(caption: str, bands: Mapping[str, Band]) -> PageTable:
    columns = [Column(title=head) for head in ("figure", "unit", LOW, MIDDLE, HIGH, "shown by")]
    rows: list[list[Cell]] = []
    for name, band in bands.items():
        kind, at, argument = name.partition("@")
        words, unit = in_words(kind)
        rows.append([words + at + argument, unit, band.low, band.median, band.high, band.shown])
    return PageTable(caption=caption, columns=columns, rows=rows)
