"""Measured signals from the JSON of their analysis: charts of each, then one table a statistic with a row a signal."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import PurePath

from tank2sim.report.kit.json_values import Json, is_scalar, is_series, rows_of, titled, words
from tank2sim.report.kit.page import Illustration, PageSection, PageTable
from tank2sim.report.results import charts

_DRAWN = {
    "autocorrelation": "Autocorrelation",
    "probability_density": "Probability density",
    "spectrum": "Spectrum",
}
_PEAK = {"frequency_hz": "peak_Hz", "density": "peak_density", "distinct": "peak_distinct"}

_NOT_TOLD = ("constant", "on_circle")


def signals_drawn(result: Json) -> list[PageSection]:
    """Two sections a trial: its charts, then its tables."""
    return [section for one in result["trials"] for section in _trial(one)]


def _trial(trial: Mapping[str, Json]) -> list[PageSection]:
    columns: Mapping[str, Mapping[str, Json]] = trial["columns"]
    name = PurePath(str(trial["trial"])).name
    drawn = [
        _drawn(titled_kind, column, one[kind]) for column, one in columns.items() for kind, titled_kind in _kinds(one)
    ]
    steering = trial.get("rudder_to_yaw_rate") or {}
    drawn += [_drawn("Cross-correlation", "rudder and yaw rate", steering.get("cross_correlation") or {})]
    drawn += [_drawn("Transfer function", "rudder to yaw rate", steering)]
    tables = [_table("Signals", columns), *(_statistic(kind, columns) for kind in ("stationarity", "normality"))]
    notes = [str(one) for one in [*(trial.get("notices") or []), *(steering.get("notices") or [])]]
    tables = [table for table in tables if table.rows]
    return [
        PageSection(heading=name, charts=[one for one in drawn if one], notes=notes),
        PageSection(heading=f"Statistics of {name}", tables=tables),
    ]


def _kinds(one: Mapping[str, Json]) -> list[tuple[str, str]]:
    return [(kind, title) for kind, title in _DRAWN.items() if one.get(kind)]


def _drawn(title: str, of: str, value: Mapping[str, Json]) -> Illustration | None:
    series = {key: one for key, one in value.items() if is_series(one)}
    longest = max((len(one) for one in series.values()), default=0)
    together = {key: one for key, one in series.items() if len(one) == longest}
    return charts.series_chart(f"{title}: {words(of)[0]}", together) if together else None


def _table(caption: str, columns: Mapping[str, Mapping[str, Json]]) -> PageTable:
    """What stands in cells of each signal, with the peak of its spectrum."""
    rows = []
    for name, column in columns.items():
        peak = (column.get("spectrum") or {}).get("peak") or {}
        own = {key: value for key, value in column.items() if key not in _NOT_TOLD}
        rows.append((words(name)[0], own | {told: peak[key] for key, told in _PEAK.items() if key in peak}))
    return rows_of(caption, rows, "signal")


def _statistic(kind: str, columns: Mapping[str, Mapping[str, Json]]) -> PageTable:
    rows = [(words(name)[0], _flat(column[kind], "")) for name, column in columns.items() if column.get(kind)]
    return rows_of(titled(kind).capitalize(), rows, "signal")


def _flat(value: Mapping[str, Json], above: str) -> dict[str, Json]:
    """An object with those under it in one row: ``p_values.about_level.kpss`` is "kpss p about level"."""
    found: dict[str, Json] = {}
    for key, one in value.items():
        if isinstance(one, Mapping):
            own = "p" if key == "p_values" else words(key)[0]
            found |= _flat(one, f"{above} {own}".strip())
        elif is_scalar(one) and key != "meaning":
            found[f"{words(key)[0]} {above}".strip()] = one
    return found
