"""The damped Gauss-Newton search of the estimators (Levenberg 1944; Marquardt 1963)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol, TypeVar

import numpy as np

from tank2sim.arrays import Array
from tank2sim.errors import InputError

MOST_ATTEMPTS = 10
"""Most attempts of a step, each with ten times the damping of the previous one: the last steps are negligible."""


class StoppedSearchError(InputError):
    """A search that could not take a single step, although the data ask for one: its estimate would be the start."""


def is_minimum(H: Array, g: Array, *, variance: float = 1.0, bounded: tuple[Array, Array, Array] | None = None) -> bool:
    """Whether a point is a minimum of a sum of squares, within its scatter.

    The step that the normal equations ask for lowers the sum by ``g' H^-1 g``: at a minimum by less than one variance
    for each unknown.

    `H`, `g` (k, k) and (k,): Normal equations at the point. `variance`: Variance of the residuals. `bounded` (array,
    array, array): Values (k,) and their least and largest: an unknown that is pressed against a bound stays there.

    Examples
    --------
    >>> import numpy as np
    >>> is_minimum(np.eye(2), np.array([0.5, 0.5])), is_minimum(np.eye(2), np.array([0.5, 3.0]))
    (True, False)
    """
    free = np.ones(len(g), dtype=bool)
    if bounded is not None:
        values, low, high = bounded
        free = ~(((values <= low) & (g > 0)) | ((values >= high) & (g < 0)))
    H, g = H[np.ix_(free, free)], g[free]
    if not (np.isfinite(H).all() and np.isfinite(g).all()):
        return False
    return bool(g @ np.linalg.lstsq(H, g, rcond=None)[0] <= variance * max(1, len(g)))


def refuse_stopped(method: str, at_minimum: bool) -> None:
    """Raise StoppedSearchError for a search by `method` that never moved, unless its start is a minimum."""
    if not at_minimum:
        problem = f"the search by {method} could not take a step from its start, which does not fit the data"
        raise StoppedSearchError(
            "trials", "", problem, "give a start that is nearer, or check the records and the card"
        )


def within_bounds(H: Array, g: Array, values: Array, bounds: tuple[Array, Array]) -> Array:
    """The step of the normal equations ``H step = -g`` with unknowns that reach a bound held there.

    `H`, `g` (k, k) and (k,). `values` (k,): Where the step begins, within the bounds. `bounds` (array, array): Least
    and largest values (k,).

    Examples
    --------
    >>> import numpy as np
    >>> H, g = np.array([[2.0, 1.0], [1.0, 2.0]]), np.array([3.0, 3.0])
    >>> within_bounds(H, g, np.zeros(2), (np.array([0.0, -9.0]), np.array([9.0, 9.0])))
    array([ 0. , -1.5])
    """
    low, high = bounds[0] - values, bounds[1] - values
    step, free = np.zeros(len(g)), np.ones(len(g), dtype=bool)
    while free.any():
        pull = g + H @ np.where(free, 0.0, step)
        step[free] = -np.linalg.solve(H[np.ix_(free, free)], pull[free])
        beyond = free & ((step < low) | (step > high))
        if not beyond.any():
            break
        step[beyond] = np.clip(step, low, high)[beyond]
        free &= ~beyond
    return step


class _WithCost(Protocol):
    @property
    def cost(self) -> float: ...


Point = TypeVar("Point", bound=_WithCost)
System = TypeVar("System")


def damped_gauss_newton(
    start: Point,
    linearise: Callable[[Point], System],
    move: Callable[[Point, System, float], Point],
    report: Callable[[Point, float], bool],
    steps: int,
    damping_range: tuple[float, float] = (1e-6, 1e-3),
) -> tuple[Point, tuple[float, ...], System | None]:
    """Steps that each lower the cost, until none does.

    `start`: With its ``cost``. `linearise`: Normal equations at a point. `move`: ``move(point, system, damping) ->
    point``. `report`: ``report(point, gain) -> bool``, called with each better point: True ends the search. `steps`:
    Most steps. `damping_range`: A damping up to the first falls to 0 after a step; the second is the least after a
    failed attempt. Returns `costs`: Costs of all points after the start, the best last. Returns `system`: Normal
    equations at the best point; None where they were not computed.
    """
    point, damping = start, 0.0
    costs: tuple[float, ...] = ()
    for _ in range(steps):
        system = linearise(point)
        for _attempt in range(MOST_ATTEMPTS):
            moved = move(point, system, damping)
            if moved.cost < point.cost:
                break
            damping = max(10 * damping, damping_range[1])
        else:
            return point, costs, system
        damping = damping / 10 if damping > damping_range[0] else 0.0
        point, gain, costs = moved, point.cost - moved.cost, (*costs, moved.cost)
        if report(point, gain):
            break
    return point, costs, None


@dataclass(frozen=True, eq=False)
class _Residuals:
    """Unknowns (k,), residuals (n,) there, and their sum of squares."""

    at: Array
    residual: Array

    @property
    def cost(self) -> float:
        return float(self.residual @ self.residual)


def least_squares_steps(
    misfit: Callable[[Array], Array],
    start: tuple[Array, Array],
    slopes: Callable[[Array, Array], Array],
    steps: int = 1,
    least_gain: float = 0.0,
) -> tuple[Array, Array]:
    """Unknowns (k,) and residuals (n,) after some steps that each lower the sum of squares.

    `misfit`: ``misfit(at) -> residuals``; may be nan where a motion exceeds all bounds: such points are never taken.
    `start` (k,), (n,): First unknowns and their residuals. `slopes`: ``slopes(at, residuals) -> derivatives`` (n, k).
    `steps`: Most steps. `least_gain`: Share of the sum of squares: a step that lowers it by less is the last.
    """

    def move(point: _Residuals, J: Array, damping: float) -> _Residuals:
        stiff = np.diag(np.sqrt(damping * np.sum(J**2, axis=0)))
        right = np.append(point.residual, np.zeros(len(stiff)))
        at = point.at - np.linalg.lstsq(np.concatenate([J, stiff]), right, rcond=None)[0]
        return _Residuals(at, misfit(at))

    found = damped_gauss_newton(
        _Residuals(*start),
        lambda point: slopes(point.at, point.residual),
        move,
        lambda better, gain: gain < least_gain * (better.cost + gain),
        steps,
    )[0]
    return found.at, found.residual
