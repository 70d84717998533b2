"""The result of an identification as JSON, and its table rows for screen and page."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import Any

import numpy as np

from tank2sim.arrays import Array, Columns
from tank2sim.cards.card import ManoeuvringCard
from tank2sim.cards.reading import changed_text
from tank2sim.escaping import one_line
from tank2sim.files import BYTE_ORDER_MARK
from tank2sim.identification.trials.assessment.evaluation import (
    Comparison,
    FigureComparison,
    Following,
    Passage,
    comparison_windows,
    misfit,
    pooled,
)
from tank2sim.identification.trials.identify import Identification
from tank2sim.identification.trials.methods.posterior import scaled_prior
from tank2sim.identification.trials.methods.posterior_sampling import PosteriorSamples
from tank2sim.identification.trials.problem.prepare_trials import Measured
from tank2sim.identification.trials.problem.problem_from_card import problem_from_card
from tank2sim.identification.trials.problem.sampled_runs import OBSERVED_SIGNALS
from tank2sim.marks import FORCED
from tank2sim.records.signals.columns import SignalName
from tank2sim.records.thinning import drawn_columns
from tank2sim.units import from_si

SET_KEYS = {"fitted": "fit", "held out": "holdout"}
"""Words for a set of trials to its key in the JSON."""

POSTERIOR_LEVELS = (0.025, 0.25, 0.5, 0.75, 0.975)
"""Levels of the quantiles of a posterior: its median, and the intervals that hold half and 95 % of it."""

NO_YAW = 3.0
"""A run whose yaw rate stays below this many times its noise is straight."""

FIGURES_ARE = "simulated in closed loop with the card found, from each trial's measured start, rudder rate and lag"
"""Origin of the figures: ``simulate`` uses the card's approach speed and steering gear instead."""


def identification_as_json(result: Identification, messages: tuple[str, ...] = ()) -> dict[str, object]:
    """The complete result: ``derivatives``, ``effects``, ``misfit``, ``figures``, ``identifiability``, ...

    `messages` are warnings in addition to the notices of the result.
    """
    estimate, known = result.estimate, result.identifiability
    parameters = _parameters(result)
    forced = [f"{FORCED}: {'; '.join(result.forced)}"] if result.forced else []
    unfinished = [] if result.posterior is None or result.posterior.converged else result.posterior.notices
    comparisons = {SET_KEYS[word]: (before, found) for word, before, found in result.comparisons}
    return {
        "ship": result.card.ship.name,
        "method": estimate.method,
        "method_reason": None if result.choice is None else result.choice.reason,
        "current": _current(result),
        "structure": result.structure,
        "forced": list(result.forced),
        "manoeuvres": dict(result.manoeuvres),
        "derivatives": {
            name.partition(".")[2]: entry for name, entry in parameters.items() if name.startswith("derivatives.")
        },
        "effects": {name: entry for name, entry in parameters.items() if not name.startswith("derivatives.")},
        "effects_of_card": [effect.name for effect in result.card.effects],
        "misfit": _misfit(result),
        "yaw_rate_error_over_windows": {
            "fit": _windows(result.fit),
            "holdout": _windows(result.holdout) if result.holdout else None,
        },
        "errors_over_windows": {
            key: _errors_over_windows(*comparisons[key]) if key in comparisons else [] for key in SET_KEYS.values()
        },
        "figures_are": FIGURES_ARE,
        "figures": {key: _figures(*comparisons[key]) if key in comparisons else [] for key in SET_KEYS.values()},
        "structures": {
            name: {
                "errors": structure.errors,
                "left_out": [list(fold.held_out) for fold in (*structure.single, structure.extrapolation)],
                **({"weight": result.weights.get(name, 0.0)} if result.weights else {}),
            }
            for name, structure in result.structures.items()
        },
        "criteria": None if result.criteria is None else asdict(result.criteria),
        "posterior": _posterior(result.posterior),
        "bootstrap": _bootstrap(result),
        "residual_noise": dict(estimate.noise),
        "prior_scale": dict(estimate.prior_scale),
        "cost": list(estimate.cost),
        "identifiability": {
            "parameters": [name.removeprefix("derivatives.") for name in known.free],
            "condition": known.condition,
            "singular_values": known.singular_values,
            "correlation": np.round(known.correlation, 7),
            "correlated_pairs": [[first, second, value] for first, second, value in known.pairs],
            "unseen": [list(direction) for direction in known.unseen],
            "notices": list(known.notices),
        },
        "notices": [*unfinished, *forced, *result.notices],
        "warnings": [*unfinished, *result.notices, *known.notices, *messages],
    }


def _current(result: Identification) -> dict[str, object] | None:
    current = result.current
    if current is None:
        return None
    speed_error, direction_error = current.errors
    return {
        "speed_mps": current.speed_mps,
        "direction_deg": float(np.degrees(current.direction_rad)),
        "speed_standard_error_mps": speed_error,
        "direction_standard_error_deg": float(np.degrees(direction_error)),
        "largest_standard_error_mps": current.standard_error_mps,
        "determined": current.determined,
    }


def _parameters(result: Identification) -> dict[str, dict[str, float]]:
    estimate, known = result.estimate, result.identifiability
    return {
        name: {
            "value": value,
            "standard_error": error,
            "before": before,
            "before_standard_error": before_error,
            "prior_standard_error": prior_error,
            "share_from_trials": share,
        }
        for name, value, error, before, before_error, prior_error, share in zip(
            estimate.free,
            estimate.values,
            estimate.standard_errors,
            result.problem.prior_mean,
            result.problem.prior_error,
            scaled_prior(result.problem, estimate.prior_scale),
            known.share,
            strict=True,
        )
    }


def _misfit(result: Identification) -> dict[str, object]:
    return {
        "noise": dict(result.noise),
        "fit": misfit(result.fit, result.noise),
        "holdout": misfit(result.holdout, result.noise) if result.holdout else None,
        "before": {
            "fit": misfit(result.before, result.noise),
            "holdout": misfit(result.before_holdout, result.noise) if result.before_holdout else None,
        },
    }


def _posterior(samples: PosteriorSamples | None) -> dict[str, object] | None:
    if samples is None:
        return None
    quantiles = np.quantile(samples.flat, POSTERIOR_LEVELS, axis=0).T
    return {
        "sampler": samples.sampler,
        "chains": len(samples.values),
        "draws": len(samples.flat),
        "simulations": samples.simulations,
        "converged": samples.converged,
        "quantile_levels": list(POSTERIOR_LEVELS),
        "parameters": {
            name.removeprefix("derivatives."): {
                "r_hat": r_hat,
                "effective_sample_size": effective,
                "quantiles": list(values),
            }
            for name, r_hat, effective, values in zip(
                samples.free, samples.r_hat, samples.effective, quantiles, strict=True
            )
        },
    }


def posterior_rows(found: Mapping[str, Any]) -> list[list[object]]:
    """Name, 95 % interval, R-hat and effective sample size of each sampled parameter of the JSON."""
    return [
        [
            name,
            f"{entry['quantiles'][0]:.5g} to {entry['quantiles'][-1]:.5g}",
            f"{as_number(entry['r_hat']):.4f}",
            f"{as_number(entry['effective_sample_size']):.0f}",
        ]
        for name, entry in (found["posterior"] or {"parameters": {}})["parameters"].items()
    ]


def _bootstrap(result: Identification) -> dict[str, object] | None:
    if result.bootstrap is None:
        return None
    errors = np.std(result.bootstrap, axis=0, ddof=1)
    return {"members": len(result.bootstrap), "standard_errors": dict(zip(result.estimate.free, errors, strict=True))}


def parameters_of(found: Mapping[str, Any]) -> dict[str, Any]:
    """Name to entry of ``derivatives`` or ``effects``, in the order of the estimate."""
    entries = {**found["derivatives"], **found["effects"]}
    return {name: entries[name] for name in found["identifiability"]["parameters"]}


def as_number(value: float | None) -> float:
    """A number of the JSON; infinity for null."""
    return np.inf if value is None else value


def value_with_error(value: float, error: float | None) -> str:
    """Value and standard error in words: ``-0.0035 ± 0.00012``."""
    return f"{value:.5g} ± {as_number(error):.2g}"


def estimate_rows(found: Mapping[str, Any]) -> list[list[object]]:
    """Name, estimate, before, share of the information from the trials: a row for each free parameter of the JSON."""
    return [
        [
            name,
            value_with_error(entry["value"], entry["standard_error"]),
            value_with_error(entry["before"], entry["before_standard_error"]),
            f"{100 * as_number(entry['share_from_trials']):.0f} %",
        ]
        for name, entry in parameters_of(found).items()
    ]


def following_rows(found: Mapping[str, Any]) -> list[list[object]]:
    """Run, fitted or held out, yaw-rate error over windows before and after, of the JSON."""
    noise = from_si("r_degps", found["misfit"]["noise"].get("motion.r") or 0.0)
    return [
        [trial["trial"], word, _yaw_error(trial["before"], noise), _yaw_error(trial["found"], noise)]
        for word, key in SET_KEYS.items()
        for trial in found["errors_over_windows"][key]
    ]


def structure_rows(found: Mapping[str, Any]) -> list[list[object]]:
    """Structure, mean yaw-rate error of single runs held out, and of the runs of largest amplitude held out, %."""
    errors = {
        name: [100 * as_number(error) for error in structure["errors"]]
        for name, structure in found["structures"].items()
    }
    return [[name, float(np.mean(single)), largest] for name, (*single, largest) in errors.items()]


def figure_error(figure: Mapping[str, Any], key: str = "predicted") -> float:
    """Predicted less measured by the JSON; for distances as a share of the measured one; nan where not reached.

    `key` is ``predicted`` or, for the card before, ``before``.
    """
    if figure[key] is None:
        return np.nan
    difference = float(figure[key] - figure["measured"])
    return difference / figure["measured"] if figure["figure"].endswith("_m") else difference


def figure_rows(found: Mapping[str, Any]) -> list[list[object]]:
    """Trial, fitted or held out, figure, measured, predicted before and after, error after, 95 % interval."""
    rows: list[list[object]] = []
    for word, key in SET_KEYS.items():
        for figure in found["figures"][key]:
            error, interval = figure_error(figure), figure["interval_95"]
            text = f"{100 * error:+.1f} %" if figure["figure"].endswith("_m") else f"{error:+.2f}"
            numbers = [figure[name] for name in ("measured", "before", "predicted")]
            expected = " to ".join(f"{as_number(end):.4g}" for end in interval) if interval else "-"
            rows.append([figure["trial"], word, figure["figure"], *numbers, "-" if np.isnan(error) else text, expected])
    return rows


def identified_card_text(result: Identification, trials: list[str]) -> str:
    """Text of the card found, with the names of the trials in its source."""
    card = result.card
    origin = f"identified by tank2sim ({result.estimate.method}, {result.structure}) from {', '.join(trials)}"
    if result.forced:
        origin = f"{FORCED}, although not of this ship by the rudder's moment: {origin}"
    changes: dict[str, object] = {"ship.source": f"{card.ship.source}; {origin}"}
    if card.ship.notes:
        changes["ship.notes"] = f"Before it was {origin}: {card.ship.notes}"
    head = f"# {one_line(origin[0].upper() + origin[1:])}.\n"
    head += "# Comments below are of the card before, except keys marked as identified.\n"
    text = changed_text(card.text, card.source, changes)
    mark = BYTE_ORDER_MARK if text.startswith(BYTE_ORDER_MARK) else ""
    return mark + head + text.removeprefix(mark)


def _windows(comparison: Comparison) -> dict[str, float]:
    runs = {run.name: run.relative("motion.r") for run in comparison.following if "motion.r" in run.windows}
    return {**runs, "all": pooled(comparison.following, "motion.r")}


def _errors_over_windows(before: Comparison, found: Comparison) -> list[dict[str, object]]:
    """Of each trial the errors of both cards by column, with the size of the signal that they are a share of."""
    return [
        {"trial": new.name, "before": _window_errors(old), "found": _window_errors(new)}
        for old, new in zip(before.following, found.following, strict=True)
    ]


def _window_errors(following: Following) -> dict[str, dict[str, float]]:
    return {
        column: {"rms_error": from_si(column, error), "rms_signal": from_si(column, size)}
        for column, (error, size) in ((_OBSERVED[name], errors) for name, errors in following.windows.items())
    }


def relative_error(errors: Mapping[str, float | None]) -> float:
    """Error over windows as a share of the signal, of the JSON."""
    size = errors["rms_signal"]
    return as_number(errors["rms_error"]) / size if size else np.inf


def pooled_error(trials: Sequence[Mapping[str, Any]], card: str) -> float:
    """Error of the yaw rate over windows of all trials together, as a share of it, of the JSON.

    `trials` are those of ``errors_over_windows``, `card` is ``before`` or ``found``.
    """
    errors = [trial[card]["r_degps"] for trial in trials if "r_degps" in trial[card]]
    following = [Following("", {"r": (as_number(error["rms_error"]), error["rms_signal"])}, {}) for error in errors]
    return pooled(following, "r")


def _yaw_error(windows: Mapping[str, Any], noise: float) -> str:
    """Error of the yaw rate over windows, %; a phrase where such a share has no meaning."""
    if "r_degps" not in windows:
        return "no yaw rate measured"
    if as_number(windows["r_degps"]["rms_signal"]) < NO_YAW * noise:
        return "no yaw"
    return f"{100 * relative_error(windows['r_degps']):.3g} %"


def _figures(before: Comparison, found: Comparison) -> list[dict[str, object]]:
    given = {(figure.trial, figure.name): figure.predicted for figure in before.figures}
    return [_figure(figure, given.get((figure.trial, figure.name))) for figure in found.figures]


def _figure(figure: FigureComparison, before: float | None) -> dict[str, object]:
    return {
        "trial": figure.trial,
        "figure": figure.name,
        "measured": figure.measured,
        "before": before,
        "predicted": figure.predicted,
        "error": None if figure.predicted is None else figure.predicted - figure.measured,
        "interval_95": figure.interval,
    }


_OBSERVED = {variable: SignalName(signal).file for signal, variable in OBSERVED_SIGNALS.items()}
"""Variable of a model to the column of a trial file that measures it."""

_COLUMNS = {
    "rudder": "delta_deg",
    "motion.psi": "psi_deg",
    "motion.r": "r_degps",
    "motion.speed": "speed_mps",
    "motion.beta": "beta_deg",
    "motion.x": "x_m",
    "motion.y": "y_m",
}
_SAMPLES = 240


def replays(card: ManoeuvringCard, result: Identification, trials: Measured) -> tuple[tuple[Passage, Passage], ...]:
    """Each trial, whole, with the simulation by `card`, the given card, and with that by the card found."""
    both = []
    for each_card in (card, result.card):
        problem = problem_from_card(each_card, trials.trials, trials.driven_by, whole=True)
        both.append(comparison_windows(problem, each_card, trials.trials, result.estimate.noise))
    return tuple(zip(*both, strict=True))


def replays_as_json(found: Sequence[tuple[Passage, Passage]], *, held_out: bool) -> list[dict[str, object]]:
    """JSON form: columns of the measurement and of both simulations, each over its own time, thinned for a chart."""
    return [
        {
            "trial": after.name,
            "held_out": held_out,
            "closed_loop": after.closed_loop,
            "measured": _columns(after.time_s, after.measured),
            "before": _columns(before.model_time_s, before.simulated),
            "found": _columns(after.model_time_s, after.simulated),
        }
        for before, after in found
    ]


def _columns(time_s: Array, signals: Mapping[str, Array]) -> Columns:
    if not len(time_s):
        return {}
    columns = {_COLUMNS[name]: from_si(_COLUMNS[name], 1.0) * values for name, values in signals.items()}
    return drawn_columns({"t_s": time_s, **columns}, _SAMPLES)
