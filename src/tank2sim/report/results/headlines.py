"""What stands on the tiles of the page of a result: the values that the reader of each kind looks for first."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from pathlib import PurePath

from tank2sim.records.signals.statistics import Stationary
from tank2sim.report.gap.text import effect_in_words, parameter_in_words, with_error
from tank2sim.report.kit.json_values import VERDICT_TEXTS, Json, cell, is_number_value, is_scalar, words
from tank2sim.report.kit.numbers import format_number
from tank2sim.report.kit.page import KeyFigure, Verdict
from tank2sim.report.results.result_types import ResultType
from tank2sim.simulation.card_range import entry_name

_MOST_FIGURES = 8
_NOISE = "times the noise, before → after"


def headlines(result: Mapping[str, Json], kind: ResultType) -> list[KeyFigure]:
    """The tiles of a result, at most eight."""
    own = _TILES.get(kind.title)
    return [*(own(result) if own else []), *_plain(result, kind.headlines)][:_MOST_FIGURES]


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
    named = [one["name"] for one in result.get("effects") or []]
    figures = [KeyFigure(label="Verdict", value=result["verdict"], note=" and ".join(map(effect_in_words, named)))]
    for one in result.get("effects") or []:
        for own, value in one["parameters"].items():
            label, unit = parameter_in_words(one["name"], own)
            if is_number_value(value):
                error = one["standard_errors"].get(own)
                figures.append(_estimate(f"{effect_in_words(one['name'])}: {label}", value, error, unit))
    misfit = result.get("misfit") or {}
    return [*figures[: _MOST_FIGURES - 1], *_misfit(misfit.get("before") or {}, misfit.get("after") or {})]


def _identified(result: Mapping[str, Json]) -> list[KeyFigure]:
    """How the card found follows the trials held out, next to the card given."""
    misfit = result.get("misfit") or {}
    return _misfit(misfit.get("before") or {}, misfit)


def _misfit(before: Mapping[str, Json], after: Mapping[str, Json]) -> list[KeyFigure]:
    which = "holdout" if is_number_value(after.get("holdout")) else "fit"
    old, new = before.get(which), after.get(which)
    if not (is_number_value(old) and is_number_value(new)):
        return []
    label = "Misfit of the trials held out" if which == "holdout" else "Misfit of the fitted trials; none was held out"
    told = "better" if new < old else "worse" if new > old else "no better"
    verdict = Verdict.CAUTION if new > old else Verdict.NONE
    value = f"{format_number(old, 3)} → {format_number(new, 3)}"
    return [KeyFigure(label=label, value=value, verdict=verdict, note=f"{told}; {_NOISE}")]


def _reduced(result: Mapping[str, Json]) -> list[KeyFigure]:
    """How many derivatives, and the least sure of them."""
    derivatives = result["derivatives"]
    relative = {
        name: 100 * abs(derivative["standard_error"] / derivative["value"])
        for name, derivative in derivatives.items()
        if is_number_value(derivative.get("standard_error"))
        and is_number_value(derivative.get("value"))
        and derivative["value"] != 0
    }
    figures = [KeyFigure(label="Derivatives found", value=len(derivatives))]
    if relative:
        worst = max(relative, key=lambda name: relative[name])
        value = float(f"{relative[worst]:.3g}")
        figures.append(KeyFigure(label="Largest standard error", value=value, unit="%", note=f"of the value, {worst}"))
    return figures


def _towed(result: Mapping[str, Json]) -> list[KeyFigure]:
    """Total mass and linear drag by the methods that give a standard error, and what of M the tows fix."""
    figures = []
    for key, label in (("total_mass_kg", "Total mass M"), ("B3_kgpm", "Drag coefficient B3")):
        for method, one in result["methods"].items():
            value, error = one["estimates"].get(key), (one.get("standard_errors") or {}).get(key)
            if is_number_value(value) and is_number_value(error):
                how = method.replace("_", " ").replace("qr", "QR")
                figures.append(_estimate(label, value, error, words(key)[1], f"by {how}, ± one standard error"))
    if span := result.get("mass_range_kg"):
        low, high = (format_number(round(one)) for one in span)
        note = "over all models that the tows can tell"
        figures.append(KeyFigure(label="What these tows fix of M", value=f"{low} to {high}", unit="kg", note=note))
    return figures


def _yawed(result: Mapping[str, Json]) -> list[KeyFigure]:
    """Inertia and dissipation by the first method."""
    method, best = next(iter(result["methods"].items()))
    which = "added" if is_number_value(best.get("added_inertia_kgm2")) else "total"
    note = f"{method.replace('_', ' ')}, ± one standard error"
    inertia, error = best[f"{which}_inertia_kgm2"], best.get(f"{which}_inertia_standard_error_kgm2")
    figures = [_estimate(f"{which.capitalize()} yaw inertia", inertia, error, "kg m²", note)]
    if is_number_value(dissipation := best.get("dissipation_J")):
        figures.append(_estimate("Dissipation", dissipation, best.get("dissipation_standard_error_J"), "J", note))
    return figures


def _signals(result: Mapping[str, Json]) -> list[KeyFigure]:
    """How many of the signals are stationary, and the verdict of each that a page of one trial has room for."""
    trials = result["trials"]
    found = [
        (name, one["stationarity"]["verdict"])
        for trial in trials
        for name, one in trial["columns"].items()
        if one.get("stationarity")
    ]
    steady = [words(name)[0] for name, verdict in found if verdict == Stationary.YES.value]
    where = PurePath(str(trials[0]["trial"])).name if len(trials) == 1 else ""
    told = ", ".join(steady) if len(trials) == 1 else ""
    return [
        KeyFigure(label="Trials", value=len(trials), note=where),
        KeyFigure(label="Stationary signals", value=f"{len(steady)} of {len(found)}", note=told),
    ]


_TILES: Mapping[str, Callable[[Mapping[str, Json]], list[KeyFigure]]] = {
    "The missing effect": _gap,
    "Coefficients from trials": _identified,
    "Captive tests": _reduced,
    "Towed vehicle": _towed,
    "Yaw rig": _yawed,
    "Signals": _signals,
}
