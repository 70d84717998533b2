"""The tiles of the page of a result: the values that the reader of each kind looks for first."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence

from tank2sim.answer.numbers import format_number
from tank2sim.answer.parts import KeyFigure, Verdict
from tank2sim.report.gap.text import effect_in_words, parameter_in_words, with_error
from tank2sim.report.json_values import VERDICT_TEXTS, Json, cell, is_number_value, is_scalar, words
from tank2sim.report.results.result_types import ResultType
from tank2sim.simulation.card_range import entry_name

_MOST_FIGURES = 8
_NOISE = "times the noise, before → after"


def headlines(result: Mapping[str, Json], kind: ResultType) -> list[KeyFigure]:
    """Return the tiles of a result, at most eight."""
    tiles = _TILES.get(kind.title)
    return [*(tiles(result) if tiles else []), *_plain(result, kind.headlines)][:_MOST_FIGURES]


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


def _estimate(label: str, value: float, error: float | None, unit: str, note: str = "") -> KeyFigure:
    shown = with_error(value, math.nan if error is None else error)
    return KeyFigure(label=label, value=shown, unit=unit, note=note)


def _gap(result: Mapping[str, Json]) -> list[KeyFigure]:
    """The verdict, each effect's parameters, and what the named effects do to the trials held out."""
    named = [effect["name"] for effect in result.get("effects") or []]
    figures = [KeyFigure(label="Verdict", value=result["verdict"], note=" and ".join(map(effect_in_words, named)))]
    for effect in result.get("effects") or []:
        for parameter, value in effect["parameters"].items():
            label, unit = parameter_in_words(effect["name"], parameter)
            if is_number_value(value):
                error = effect["standard_errors"].get(parameter)
                figures.append(_estimate(f"{effect_in_words(effect['name'])}: {label}", value, error, unit))
    misfit = result.get("misfit") or {}
    return [*figures[: _MOST_FIGURES - 1], *_misfit(misfit.get("before") or {}, misfit.get("after") or {})]


def _misfit(before: Mapping[str, Json], after: Mapping[str, Json]) -> list[KeyFigure]:
    trials = "holdout" if is_number_value(after.get("holdout")) else "fit"
    old, new = before.get(trials), after.get(trials)
    if not (is_number_value(old) and is_number_value(new)):
        return []
    label = "Misfit of the trials held out" if trials == "holdout" else "Misfit of the fitted trials; none was held out"
    comparison = "better" if new < old else "worse" if new > old else "no better"
    verdict = Verdict.CAUTION if new > old else Verdict.NONE
    value = f"{format_number(old, 3)} → {format_number(new, 3)}"
    return [KeyFigure(label=label, value=value, verdict=verdict, note=f"{comparison}; {_NOISE}")]


_TILES: Mapping[str, Callable[[Mapping[str, Json]], list[KeyFigure]]] = {
    "The missing effect": _gap,
}
