"""The tiles of the page of a result: the values that the reader of each kind looks for first."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from tank2sim.answer.parts import KeyFigure, Verdict
from tank2sim.report.json_values import VERDICT_TEXTS, Json, cell, is_number_value, is_scalar, words
from tank2sim.report.results.result_types import ResultType
from tank2sim.simulation.card_range import entry_name

_MOST_FIGURES = 8


def headlines(result: Mapping[str, Json], kind: ResultType) -> list[KeyFigure]:
    """Return the tiles of a result, at most eight."""
    return _plain(result, kind.headlines)[:_MOST_FIGURES]


def _plain(result: Mapping[str, Json], paths: Sequence[str]) -> list[KeyFigure]:
    values = {path: _at(result, path) for path in paths}
    figures = result.get("figures")
    if isinstance(figures, Mapping):
        values |= {
            entry_name("overshoots_deg", place): value
            for place, value in enumerate(figures.get("overshoots_deg") or [])
        }
        values |= {key: value for key, value in figures.items() if is_number_value(value)}
    return [_figure(path, value) for path, value in values.items() if value is not None and is_scalar(value)]


def _figure(path: str, value: Json) -> KeyFigure:
    key = path.rpartition(".")[2]
    label, unit = words(key)
    if isinstance(value, bool):
        verdict = (Verdict.PASSED if value else Verdict.FAILED) if key in VERDICT_TEXTS else Verdict.NONE
        return KeyFigure(label=label, value="yes" if value else "no", verdict=verdict)
    return KeyFigure(label=label, value=value if is_number_value(value) else str(cell(key, value)), unit=unit)


def _at(result: Json, path: str) -> Json:
    for key in path.split("."):
        result = result.get(key) if isinstance(result, Mapping) else None
    return result
