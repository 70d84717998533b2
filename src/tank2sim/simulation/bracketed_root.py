"""The root of a function in an interval, by the method of Ridders (1979, IEEE Trans. Circuits Syst. 26, 979).

``scipy.optimize.ridder`` is equivalent, but its import takes a third of a second, half of a short simulation.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import pairwise

_MOST_STEPS = 200
"""Each step at least halves the interval; 200 steps exceed the number of bits of a double. Project choice."""


def bracketed_root(function: Callable[[float], float], low: float, high: float, tolerance: float = 1e-13) -> float:
    """The x between `low` and `high` at which a continuous function is zero, to `tolerance` in x.

    Raises
    ------
    ValueError
        The function has the same sign at both ends.
    """
    at_low, at_high = function(low), function(high)
    for x, value in ((low, at_low), (high, at_high)):
        if value == 0:
            return x
    if at_low * at_high > 0:
        raise ValueError(f"no change of sign between {low:g} and {high:g}")
    best = math.inf
    for _ in range(_MOST_STEPS):
        middle = (low + high) / 2
        at_middle = function(middle)
        root = math.sqrt(at_middle * at_middle - at_low * at_high)
        if root == 0:
            return middle
        before, best = best, middle + (middle - low) * math.copysign(1.0, at_low - at_high) * at_middle / root
        value = function(best)
        if value == 0 or abs(best - before) <= tolerance:
            return best
        ends = sorted([(low, at_low), (middle, at_middle), (best, value), (high, at_high)])
        (low, at_low), (high, at_high) = next(pair for pair in pairwise(ends) if pair[0][1] * pair[1][1] <= 0)
        if abs(high - low) <= tolerance:
            return (low + high) / 2
    return best
