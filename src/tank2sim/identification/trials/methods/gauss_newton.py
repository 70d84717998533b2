"""The damped Gauss-Newton search that the estimators of free-running trials share (Levenberg 1944; Marquardt 1963)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol, TypeVar


class _WithCost(Protocol):
    @property
    def cost(self) -> float: ...


Point = TypeVar("Point", bound=_WithCost)
System = TypeVar("System")


@dataclass(frozen=True)
class SearchLimits:
    """Limits of a search.

    Parameters
    ----------
    steps, attempts : int
        Most steps, and most attempts of each with ten times the damping of the previous one.
    first_damping : float
        Least damping after a failed attempt.
    last_damping : float
        A damping up to this value falls to 0 after a step, a larger one to a tenth.
    """

    steps: int
    attempts: int
    first_damping: float = 1e-3
    last_damping: float = 1e-6


def damped_gauss_newton(
    start: Point,
    linearise: Callable[[Point], System],
    move: Callable[[Point, System, float], Point],
    limits: SearchLimits,
    is_last: Callable[[float, float], bool],
    report: Callable[[Point], None],
) -> tuple[list[Point], System | None]:
    """Steps that each lower the cost, until none does.

    Parameters
    ----------
    start : Point
        With its ``cost``.
    linearise : callable
        Normal equations at a point.
    move : callable
        ``move(point, system, damping) -> point``.
    limits : SearchLimits
    is_last : callable
        ``is_last(gain, cost)``: True ends the search after a step.
    report : callable
        Called with each better point.

    Returns
    -------
    path : list
        All points, the best last.
    system : System or None
        Normal equations at the last point; None where they were not computed.
    """
    path, damping = [start], 0.0
    for _ in range(limits.steps):
        point = path[-1]
        system = linearise(point)
        for _attempt in range(limits.attempts):
            moved = move(point, system, damping)
            if moved.cost < point.cost:
                break
            damping = max(10 * damping, limits.first_damping)
        else:
            return path, system
        path.append(moved)
        damping = damping / 10 if damping > limits.last_damping else 0.0
        report(moved)
        if is_last(point.cost - moved.cost, moved.cost):
            break
    return path, None
