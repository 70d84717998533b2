"""Where the right-hand side of a model has kinks, found in its equations: the event indicators of an FMU.

A solver with variable steps loses its order in a step across a kink (a rate limit that is reached, a dead band that is
left). It steps up to the kink instead if it is reported a function that changes sign there (Hairer, Norsett and Wanner
1993, Solving Ordinary Differential Equations I, II.6).
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache

import casadi as ca

from tank2sim.dynamics.model import Model, Quantity

EVENT_SHIFT = 1e-9
"""An indicator is this much (SI) less than the difference that vanishes at its kink: project choice, far above what
rounds and far below what a ship or a solver notices. Many kinks are approached for ever or never left (a rudder at its
order, an order at the largest angle), where the difference itself would change sign with each rounding."""

# |a| is left out: it appears as a |a| in these equations, whose derivative is continuous.
_KINKED = (ca.OP_FMIN, ca.OP_FMAX, ca.OP_LT, ca.OP_LE)


@lru_cache(maxsize=4)  # an export asks for one model's again and again
def kinks(model: Model) -> tuple[Quantity, ...]:
    """Quantities ``kinks.<quantity>[1]`` and on that change sign where the right-hand side of `model` has a kink.

    For each minimum, maximum or comparison of a and b in a quantity on which a derivative of a state depends, a - b
    less :data:`EVENT_SHIFT`; those that hold neither a state nor an input are left out. Their values are expanded,
    and they are not part of the model.
    """
    variables = ca.vertcat(model.x, model.u)
    found: list[Quantity] = []
    seen: set[int] = set()
    for quantity in _behind_rates(model):
        differences = (model.expand(difference) for difference in _differences(quantity.value, seen))
        varying = [difference for difference in differences if ca.depends_on(difference, variables)]
        found += (_indicator(quantity, place, value) for place, value in enumerate(varying, start=1))
    return tuple(found)


def _indicator(quantity: Quantity, place: int, difference: ca.SX) -> Quantity:
    return Quantity(
        f"kinks.{quantity.name}[{place}]",
        "1",
        f"Event indicator: changes sign where the equation of {quantity.name} has a kink, in its SI units",
        difference - EVENT_SHIFT,
    )


def _behind_rates(model: Model) -> list[Quantity]:
    """The quantities that the derivatives of the states use, themselves or through others, in the model's order."""
    by_symbol = {quantity.symbol.element_hash(): quantity for quantity in model.quantities}
    waiting = [model.symbol(state.derivative).element_hash() for state in model.states]
    used: set[int] = set()
    while waiting:
        key = waiting.pop()
        if key in by_symbol and key not in used:
            used.add(key)
            waiting += (symbol.element_hash() for symbol in ca.symvar(by_symbol[key].value))
    return [quantity for key, quantity in by_symbol.items() if key in used]


def _differences(expression: ca.SX, seen: set[int]) -> Iterator[ca.SX]:
    """a - b of each kink in an expression; `seen` holds the nodes that have been gone through, and grows."""
    waiting = [expression]
    while waiting:
        node = waiting.pop()
        if node.element_hash() in seen or node.is_leaf():
            continue
        seen.add(node.element_hash())
        parts = [node.dep(place) for place in range(node.n_dep())]
        if node.op() in _KINKED:
            yield parts[0] - parts[1]
        waiting += parts
