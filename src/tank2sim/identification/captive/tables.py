"""Table rows of a reduction for screen and page."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from tank2sim.identification.captive.equations import HEEL_TERMS
from tank2sim.identification.captive.reduction import Reduction
from tank2sim.identification.captive.result_card import Contents
from tank2sim.identification.captive.selection import Choice

LEFT_OUT = ("collinear", "not determined")
"""Reasons for which a term that the runs excite is not in the result."""

_FEWEST_RUNS = 3
"""Least number of runs of a type whose range gives a scale for the error of their prediction."""


@dataclass(frozen=True)
class Stepped:
    """A derivative by the paper's order (prime): value, standard error, and the types of run behind it."""

    value: float
    standard_error: float
    found_in: str


@dataclass(frozen=True)
class DerivativeRow:
    """A derivative (prime); ``stepped`` is None if the paper's order does not give it."""

    name: str
    value: float
    standard_error: float
    stepped: Stepped | None
    origin: str
    """``measured`` or ``estimated``."""


def derivative_rows(reduction: Reduction, card: Contents) -> list[DerivativeRow]:
    """The derivatives of the card, in its order, and those of the heel, which the card does not have."""
    rows = []
    for name, entry in card.entries.items():
        estimated = name in card.estimated
        stepped = None if estimated else by_the_papers_order(reduction, name)
        origin = "estimated" if estimated else "measured"
        rows.append(DerivativeRow(name, float(entry.value), float(entry.standard_error), stepped, origin))
    for name in terms_of_heel(reduction):
        found = reduction.derivatives[name]
        stepped = by_the_papers_order(reduction, name)
        rows.append(DerivativeRow(name, found.value, found.standard_error, stepped, "measured"))
    return rows


def terms_of_heel(reduction: Reduction) -> list[str]:
    """Names of the derivatives of the heel that were found."""
    names = [name for terms in HEEL_TERMS.values() for name in terms]
    return [name for name in names if name in reduction.derivatives]


def by_the_papers_order(reduction: Reduction, name: str) -> Stepped | None:
    """A derivative by the paper's order; None if it does not give it."""
    steps = reduction.forces[name[0]].stepwise
    if name not in steps.names:
        return None
    place = steps.names.index(name)
    return Stepped(float(steps.values[place]), float(steps.standard_errors[place]), str(steps.found_in[place]))


def terms_left_out(reduction: Reduction) -> list[Choice]:
    """Terms that the runs excite and that are not in the result."""
    return [choice for choice in _choices(reduction) if choice.reason in LEFT_OUT]


def terms_not_excited(reduction: Reduction) -> list[str]:
    """Names of the terms that no run excites."""
    return [choice.name for choice in _choices(reduction) if choice.reason == "not excited"]


def prediction_rows(errors: Mapping[str, Mapping[str, Any]]) -> dict[str, dict[str, float]]:
    """Root mean square error of runs predicted from the others, % of their range, by type of run and force.

    Parameters
    ----------
    errors : mapping
        As :func:`prediction_errors` or the JSON has it. Types with less than three runs have no range.
    """
    return {
        kind: {force: 100 * error["relative"] for force, error in forces.items() if error["relative"] is not None}
        for kind, forces in errors.items()
        if any(error["runs"] >= _FEWEST_RUNS for error in forces.values())
    }


def prediction_errors(reduction: Reduction) -> dict[str, dict[str, dict[str, float]]]:
    """Leave-one-condition-out errors: type of run to force to root mean square, largest, and the range (prime).

    ``relative`` is the root mean square over the range of what was measured in runs of that type.
    """
    found: dict[str, dict[str, dict[str, float]]] = {}
    for force, result in reduction.forces.items():
        for kind in dict.fromkeys(row.type for row in result.left_out):
            rows = [row for row in result.left_out if row.type == kind]
            errors = np.array([row.error for row in rows])
            span = float(np.ptp([row.measured for row in rows]))
            rms = float(np.sqrt(np.mean(errors**2)))
            found.setdefault(kind, {})[force] = {
                "rms": rms,
                "largest": float(np.max(np.abs(errors))),
                "range": span,
                "relative": rms / span if span > 0 else np.nan,
                "runs": len(rows),
            }
    return found


def _choices(reduction: Reduction) -> list[Choice]:
    return [choice for result in reduction.forces.values() for choice in result.selection.choices]
