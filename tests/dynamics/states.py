"""Changed cards, and what a model has at states by name: what tests of dynamics share."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import casadi as ca
import numpy as np

from tank2sim.dynamics.model import Model


def replaced(text: str, *pairs: tuple[str, str]) -> str:
    """A card's text with parts of it replaced, each of which it has."""
    for old, new in pairs:
        assert old in text
        text = text.replace(old, new, 1)
    return text


def at_start(model: Model, at: Mapping[str, float]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """State, inputs and parameters at the start of a run, with what `at` has of each, in range or not."""
    p = np.array(model.parameter_values())
    found = np.array(model.initial(p)).ravel(), np.array(model.input_values()), p
    place = {}
    for values, names in zip(found, (model.state_names, model.input_names, model.parameter_names), strict=True):
        place |= {name: (values, number) for number, name in enumerate(names)}
    for name, value in at.items():
        values, number = place[name]
        values[number] = value
    return found


def rates(model: Model, at: Mapping[str, float]) -> dict[str, float]:
    """Derivatives of all states."""
    return dict(zip(model.state_names, np.array(model.rhs(*at_start(model, at))).ravel().tolist(), strict=True))


def values(model: Model, names: Sequence[str], at: Mapping[str, float]) -> np.ndarray:
    """Quantities by name."""
    expression = model.expand(ca.vcat([model.symbol(name) for name in names]))
    return np.array(ca.Function("f", [model.x, model.u, model.p], [expression])(*at_start(model, at))).ravel()


def accelerations(model: Model, at: Mapping[str, float]) -> np.ndarray:
    """udot, vdot, rdot."""
    return values(model, ("motion.udot", "motion.vdot", "motion.rdot"), at)


def motion(u: float, v: float, r: float) -> dict[str, float]:
    return {"motion.u": u, "motion.v": v, "motion.r": r}
