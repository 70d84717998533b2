"""The linear polynomial that an MMG ship is equal to on a straight course, on one side of it.

In the prime system, with k = A_R/L^2 f_alpha (u_R/U)^2 and the flow u_R to the rudder at the revolutions of the
approach, for each rudder:

    Y_d = -(1 + a_H) k,   N_d = -(x_R' + a_H x_H') k
    Y_v + Y_d gamma_R U/u_R,   Y_r - m_x' + Y_d gamma_R l_R' U/u_R,   N likewise without m_x'

(with C_Rv for gamma_R and C_Rr for gamma_R l_R' where a card gives those).

The two sides differ by their gamma_R: there is no single linear ship at beta_R = 0.
"""

from __future__ import annotations

from dataclasses import fields
from typing import Any, Literal

import casadi as ca

from tank2sim.cards.card import ManoeuvringCard, MmgCard
from tank2sim.dynamics.abkowitz import ACCELERATION_TERMS
from tank2sim.dynamics.model import Model


def straight_inflow(model: Model, name: str = "rudder.inflow") -> float:
    """A flow (m/s) straight ahead at ``ship.speed`` and nominal revolutions; of the right side of two."""
    known = name if name in model else f"{name}_right"
    values = model.defaults
    states = ca.DM(model.initial(model.parameter_values()))
    for state, value in (("motion.u", values["ship.speed"]), ("motion.v", 0.0), ("motion.r", 0.0)):
        states[model.state_names.index(state)] = value
    inflow = ca.Function("inflow", [model.x, model.u, model.p], [model.expand(model.symbol(known))])
    return float(inflow(states, model.input_values(), model.parameter_values()))


def linear_equivalent(card: MmgCard, model: Model, side: Literal["plus", "minus"]) -> dict[str, float]:
    """Yd, Nd, Yv, Yr, Nv, Nr (prime, rudder to starboard) with the gamma_R of one side; Yr with -m_x'.

    `model`: model of the card. `side`: ``plus`` for beta_R > 0, ``minus`` for beta_R < 0.
    """
    rudder, known = card.rudder, card.derivatives
    ratio = straight_inflow(model) / card.model.speed_mps
    k = rudder.number * card.ship.rudder_area_m2 / card.ship.length_m**2 * (rudder.f_alpha or 0.0) * ratio**2
    by_sway, by_yaw = (value / ratio for value in _cross_flow(card, side))
    slopes = {"Yd": -(1 + rudder.a_H) * k, "Nd": -(rudder.x_R + rudder.a_H * rudder.x_H) * k}
    found = dict(slopes)
    for force in "YN":
        slope = slopes[f"{force}d"]
        found[f"{force}v"] = known.get(f"{force}v", 0.0) + slope * by_sway
        found[f"{force}r"] = known.get(f"{force}r", 0.0) + slope * by_yaw
    found["Yr"] += known.get("Xudot", 0.0)
    return found


def _cross_flow(card: MmgCard, side: Literal["plus", "minus"]) -> tuple[float, float]:
    """-d(v_R/U)/dv' and -d(v_R/U)/dr' of straight motion: gamma_R and gamma_R l_R', or C_Rv and C_Rr."""
    if card.rudder.C_Rv is not None:
        return card.interaction("C_Rv"), card.interaction("C_Rr")
    both = [card.interaction(f"gamma_R_{name}") for name in ("plus", "minus")]
    # Of two rudders one always has the other side's.
    gamma = sum(both) / 2 if card.rudder.number == 2 else card.interaction(f"gamma_R_{side}")
    return gamma, gamma * card.interaction("l_R")


def linear_form(card: MmgCard, model: Model) -> ManoeuvringCard:
    """The ship as a linear card, for comparison: :func:`linear_equivalent`, mean of both sides, and its added masses.

    It states no standard error of the velocity terms.

    `model`: model of the card.
    """
    plus, minus = (linear_equivalent(card, model, side) for side in ("plus", "minus"))
    derivatives = {name: 0.5 * (plus[name] + minus[name]) for name in plus}
    derivatives |= {name: card.derivatives[name] for name in ACCELERATION_TERMS if name in card.derivatives}
    own: dict[str, Any] = {field.name: getattr(card, field.name) for field in fields(ManoeuvringCard)}
    own |= {
        "model": card.model.model_copy(update={"kind": "linear"}),
        "derivatives": derivatives,
        "uncertainty": {name: error for name, error in card.uncertainty.items() if name in ACCELERATION_TERMS},
    }
    return ManoeuvringCard(**own)
