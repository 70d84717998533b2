"""Continuation of a curve of solutions of n equations in n + 1 unknowns, by pseudo-arclength, through its folds.

    F(y) = 0,   y = (z, lambda)

Each step follows the tangent and returns to the curve at right angles to it (Keller 1977, Numerical solution of
bifurcation and nonlinear eigenvalue problems), so that a fold, where lambda turns back, is a regular point. The
unknowns should be scaled to about one.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from tank2sim.arrays import Array

ContinuationEquations = Callable[[Array], tuple[Array, Array]]
"""Residual (n,) and its Jacobian (n, n + 1) at a point (n + 1,)."""

LARGEST_STEP = 0.04
"""Arc length of a step, in the scaled unknowns. Project choice: half a diagram takes some fifty steps."""

LEAST_STEP = 1e-7
LARGEST_BEND = 0.1
"""Largest angle between neighbouring tangents, rad: small enough for a smooth chart. Project choice."""

CORNER = 1e-6
"""How far from the start, in the scaled unknowns, a slope to that side is taken where the curve has a corner there: an
equation with a kink on the straight course. Project choice."""

_ACCURACY = 1e-11
_ITERATIONS = 8

EDGE, OUTSIDE, STALLED, LONG = "edge", "outside", "stalled", "long"


@dataclass(frozen=True)
class Curve:
    """Points (k, n + 1) of a curve and its unit tangents (k, n + 1), in order.

    `ended` states the reason of its end: `edge`, lambda reached its limit (at the last point); `outside`, an unknown
    left its bounds; `stalled`, no further point was found; `long`, the limit of steps.
    """

    points: Array
    tangents: Array
    ended: str


@dataclass(frozen=True)
class Bounds:
    """Bounds of a curve: `least` and `most` (n + 1,), the last entry for lambda, and a number of steps."""

    least: Array
    most: Array
    steps: int = 3000


def corrector_step(equations: ContinuationEquations, guess: Array, row: Array) -> tuple[Array, Array, int] | None:
    """The solution near `guess` in the plane through it whose normal is `row` (n + 1,): point, Jacobian, iterations.

    None if Newton's method does not converge.

    Parameters
    ----------
    equations : callable
        Residual (n,) and Jacobian (n, n + 1) at a point (n + 1,).
    guess, row : array (n + 1,)
    """
    point = guess.copy()
    for iteration in range(_ITERATIONS):
        residual, jacobian = equations(point)
        whole = np.vstack([jacobian, row])
        if not np.isfinite(whole).all() or not np.isfinite(residual).all():
            return None
        try:
            change = np.linalg.solve(whole, np.append(-residual, row @ (guess - point)))
        except np.linalg.LinAlgError:
            return None
        point = point + change
        if np.max(np.abs(change)) < _ACCURACY:
            return point, jacobian, iteration
    return None


def tangent(jacobian: Array, along: Array) -> Array | None:
    """Unit tangent (n + 1,) of the curve, to the side of `along`; None at a singular point."""
    try:
        direction = np.linalg.solve(np.vstack([jacobian, along]), np.eye(len(along))[-1])
    except np.linalg.LinAlgError:
        return None
    direction /= np.linalg.norm(direction)
    return direction if np.isfinite(direction).all() else None


def follow_branch(equations: ContinuationEquations, start: Array, direction: Array, bounds: Bounds) -> Curve:
    """The curve from a point on it, to the side of a direction.

    Parameters
    ----------
    equations : callable
        Residual (n,) and Jacobian (n, n + 1) at a point (n + 1,).
    start, direction : array (n + 1,)
    """
    curve = _follow(equations, start, tangent(equations(start)[1], direction), direction, bounds)
    if curve.ended == STALLED and len(curve.points) == 1:
        # A corner: the Jacobian at the point itself may belong to the other side.
        beyond = start + CORNER * direction / np.linalg.norm(direction)
        curve = _follow(equations, start, tangent(equations(beyond)[1], direction), direction, bounds)
    return curve


def _follow(
    equations: ContinuationEquations, start: Array, found: Array | None, direction: Array, bounds: Bounds
) -> Curve:
    """The curve from a point with the tangent that was found there."""
    if found is None:
        return Curve(start[None, :], direction[None, :] / np.linalg.norm(direction), STALLED)
    points, tangents, ended = [start], [found], LONG
    step = LARGEST_STEP / 8
    for _ in range(bounds.steps):
        solution, step = _next(equations, points[-1], tangents[-1], step)
        if solution is None:
            ended = STALLED
            break
        point, direction = solution
        if not bounds.least[-1] < point[-1] < bounds.most[-1]:
            last = _on_edge(equations, points[-1], point, direction, bounds)
            points, tangents = points + last[:1], tangents + last[1:]
            ended = EDGE if last else STALLED
            break
        if np.any(point < bounds.least) or np.any(point > bounds.most):
            ended = OUTSIDE
            break
        points.append(point)
        tangents.append(direction)
    return Curve(np.array(points), np.array(tangents), ended)


def _next(
    equations: ContinuationEquations, point: Array, direction: Array, step: float
) -> tuple[tuple[Array, Array] | None, float]:
    """Point and tangent of the next step, and the trial length of the step after it."""
    while step > LEAST_STEP:
        found = corrector_step(equations, point + step * direction, direction)
        further = tangent(found[1], direction) if found else None
        if found and further is not None and np.arccos(np.clip(further @ direction, -1, 1)) < LARGEST_BEND:
            return (found[0], further), min(LARGEST_STEP, step * (1.6 if found[2] <= 3 else 1.0))
        step /= 2
    return None, step


def _on_edge(
    equations: ContinuationEquations, before: Array, after: Array, direction: Array, bounds: Bounds
) -> list[Array]:
    """Point and tangent where lambda is at its limit, between two points; empty if there is none."""
    edge = bounds.most[-1] if after[-1] >= bounds.most[-1] else bounds.least[-1]
    share = (edge - before[-1]) / (after[-1] - before[-1])
    guess = before + share * (after - before)
    guess[-1] = edge
    found = corrector_step(equations, guess, np.eye(len(before))[-1])
    further = tangent(found[1], direction) if found else None
    return [found[0], further] if found and further is not None else []
