"""The result of an identification as JSON, and its table rows for screen and page."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict

import numpy as np

from tank2sim.arrays import Array
from tank2sim.cards.card import ManoeuvringCard
from tank2sim.cards.reading import changed_text
from tank2sim.files import BYTE_ORDER_MARK
from tank2sim.identification.trials.assessment.comparison import Comparison, misfit
from tank2sim.identification.trials.assessment.evaluation import (
    FigureComparison,
    Following,
    Passage,
    comparison_windows,
    pooled,
)
from tank2sim.identification.trials.identify import Identification
from tank2sim.identification.trials.problem.prepare_trials import Measured
from tank2sim.identification.trials.problem.problem_from_card import problem_from_card
from tank2sim.marks import FORCED
from tank2sim.records.thinning import drawn_columns
from tank2sim.units import from_si

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
    return {
        "method": estimate.method,
        "structure": result.structure,
        "forced": list(result.forced),
        "manoeuvres": dict(result.manoeuvres),
        "derivatives": {
            name.partition(".")[2]: entry for name, entry in parameters.items() if name.startswith("derivatives.")
        },
        "effects": {name: entry for name, entry in parameters.items() if not name.startswith("derivatives.")},
        "misfit": _misfit(result),
        "yaw_rate_error_over_windows": {
            "fit": _windows(result.fit),
            "holdout": _windows(result.holdout) if result.holdout else None,
        },
        "figures_are": FIGURES_ARE,
        "figures": {
            "fit": [_figure(figure) for figure in result.fit.figures],
            "holdout": [_figure(figure) for figure in result.holdout.figures] if result.holdout else [],
        },
        "structures": {
            name: {
                "errors": structure.errors,
                "left_out": [list(fold.held_out) for fold in (*structure.single, structure.extrapolation)],
            }
            for name, structure in result.structures.items()
        },
        "criteria": None if result.criteria is None else asdict(result.criteria),
        "bootstrap": _bootstrap(result),
        "residual_noise": dict(estimate.noise),
        "prior_scale": dict(estimate.prior_scale),
        "cost": list(estimate.cost),
        "identifiability": {
            "condition": known.condition,
            "singular_values": known.singular_values,
            "correlated_pairs": [[first, second, value] for first, second, value in known.pairs],
            "unseen": [list(direction) for direction in known.unseen],
        },
        "warnings": [*result.notices, *known.notices, *messages],
    }


def _parameters(result: Identification) -> dict[str, dict[str, float]]:
    estimate, known = result.estimate, result.identifiability
    return {
        name: {
            "value": value,
            "standard_error": error,
            "before": before,
            "before_standard_error": before_error,
            "share_from_trials": share,
        }
        for name, value, error, before, before_error, share in zip(
            estimate.free,
            estimate.values,
            estimate.standard_errors,
            result.problem.prior_mean,
            result.problem.prior_error,
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


def _bootstrap(result: Identification) -> dict[str, object] | None:
    if result.bootstrap is None:
        return None
    errors = np.std(result.bootstrap, axis=0, ddof=1)
    return {"members": len(result.bootstrap), "standard_errors": dict(zip(result.estimate.free, errors, strict=True))}


def estimate_rows(result: Identification) -> list[list[object]]:
    """Name, estimate, before, share of the information from the trials: a row for each free parameter."""
    rows: list[list[object]] = []
    problem, estimate = result.problem, result.estimate
    for place, name in enumerate(estimate.free):
        fitted = f"{estimate.values[place]:.5g} ± {estimate.standard_errors[place]:.2g}"
        before = f"{problem.prior_mean[place]:.5g} ± {problem.prior_error[place]:.2g}"
        share = f"{100 * result.identifiability.share[place]:.0f} %"
        rows.append([name.removeprefix("derivatives."), fitted, before, share])
    return rows


def following_rows(result: Identification) -> list[list[object]]:
    """Run, fitted or held out, yaw-rate error over windows and over the whole run, before and after."""
    noise = result.noise.get("motion.r", 0.0)
    return [
        [new.name, word, _yaw_error(old, noise), _yaw_error(new, noise)]
        for word, before, after in result.comparisons
        for old, new in zip(before.following, after.following, strict=True)
    ]


def structure_rows(result: Identification) -> list[list[object]]:
    """Structure, mean yaw-rate error of single runs held out, and of the runs of largest amplitude held out, %."""
    return [
        [name, 100 * float(np.mean(structure.errors[:-1])), 100 * float(structure.errors[-1])]
        for name, structure in result.structures.items()
    ]


def figure_rows(result: Identification) -> list[list[object]]:
    """Trial, fitted or held out, figure, measured, predicted before and after, error after, 95 % interval."""
    rows: list[list[object]] = []
    for word, before, after in result.comparisons:
        old = {(figure.trial, figure.name): figure for figure in before.figures}
        for figure in after.figures:
            earlier = old.get((figure.trial, figure.name))
            error = f"{100 * figure.error:+.1f} %" if figure.name.endswith("_m") else f"{figure.error:+.2f}"
            rows.append(
                [
                    figure.trial,
                    word,
                    figure.name,
                    figure.measured,
                    earlier.predicted if earlier else None,
                    figure.predicted,
                    "-" if np.isnan(figure.error) else error,
                    f"{figure.interval[0]:.4g} to {figure.interval[1]:.4g}" if figure.interval else "-",
                ]
            )
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
    head = f"# {origin[0].upper()}{origin[1:]}.\n"
    head += "# Comments below are of the card before, except keys marked as identified.\n"
    text = changed_text(card.text, card.source, changes)
    mark = BYTE_ORDER_MARK if text.startswith(BYTE_ORDER_MARK) else ""
    return mark + head + text.removeprefix(mark)


def _windows(comparison: Comparison) -> dict[str, float]:
    runs = {run.name: run.relative("motion.r") for run in comparison.following if "motion.r" in run.windows}
    return {**runs, "all": pooled(comparison.following, "motion.r")}


def _yaw_error(following: Following, noise: float) -> str:
    """Error of the yaw rate over windows, %; a phrase where such a share has no meaning."""
    if "motion.r" not in following.windows:
        return "no yaw rate measured"
    if following.windows["motion.r"][1] < NO_YAW * noise:
        return "no yaw"
    return f"{100 * following.relative('motion.r'):.3g} %"


def _figure(figure: FigureComparison) -> dict[str, object]:
    return {
        "trial": figure.trial,
        "figure": figure.name,
        "measured": figure.measured,
        "predicted": figure.predicted,
        "error": None if figure.predicted is None else figure.predicted - figure.measured,
        "interval_95": figure.interval,
    }


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
    """Each trial with the simulation by `card`, the given card, and with that by the card found."""
    both = []
    whole = card.model.valid_speed_mps is None  # the card found states only the speeds of the fitted trials
    for each_card in (card, result.card):
        problem = problem_from_card(each_card, trials.trials, trials.driven_by, whole=whole)
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


def _columns(time_s: Array, signals: Mapping[str, Array]) -> dict[str, list[float]]:
    if not len(time_s):
        return {}
    columns = {_COLUMNS[name]: from_si(_COLUMNS[name], 1.0) * values for name, values in signals.items()}
    return drawn_columns({"t_s": time_s, **columns}, _SAMPLES)
