"""Documentation of a simulation model that ITTC 7.5-02-06-03 asks for, as far as its card states it."""

from __future__ import annotations

import math

from tank2sim.cards.card import SteeredCard
from tank2sim.cards.form import ShipModel
from tank2sim.dynamics.model import Model
from tank2sim.units import from_si

_KINDS = {
    "abkowitz": "third-order polynomial (Abkowitz), whole ship",
    "linear": "linear",
    "mmg": "MMG standard method: hull, propeller, rudder and their interactions",
    "small_craft": "Fossen's equations: linear and quadratic damping, thrusters",
}
"""Kind of model to what a report calls it."""


def model_documentation(card: SteeredCard, system: Model) -> dict[str, str]:
    """Return what a card and its model state about each item, in words."""
    ship, model, environment = card.ship, card.model, card.environment
    froude = model.speed_mps / math.sqrt(environment.gravity_mps2 * ship.length_m)
    reynolds = model.speed_mps * ship.length_m / environment.kinematic_viscosity_m2ps
    slowest, fastest = model.speed_range_mps
    least = slowest / model.speed_mps
    stated = "" if model.valid_speed_mps else f" (not stated: {least:.2g} to 1.2 times the speed of expansion)"
    items = {
        "Ship": _particulars(card),
        "Mathematical model": f"{_KINDS[model.kind]}; surge, sway and yaw, {len(system.states)} states",
        "Source of the coefficients": ship.source,
        "Notes of the card": ship.notes or "none",
        "Speed of expansion": f"{model.speed_mps:.4g} m/s, Froude number {froude:.3g}",
        "Range of speeds": f"{slowest:.4g} to {fastest:.4g} m/s{stated}",
        "Scaling and signs": _conventions(card),
        "Scale effects": f"Reynolds number {reynolds:.3g}; no correction between model and ship is made",
        "Steering gear": _gear(card),
        "Autopilot": "none: orders by the manoeuvre (zigzag reversed at its heading) or by the record",
        "Propulsion": _propulsion(card),
        "Effects": "; ".join(effect.name for effect in card.effects) or "none",
        "Environment": _environment(card),
        "Integration": f"classical Runge-Kutta, fourth order, step {system.step_s:.3g} s",
    }
    if isinstance(model, ShipModel):
        low = f"below {model.low_speed_bound_mps:.4g} m/s: cross-flow drag and linear damping without division by speed"
        items["Low speed"] = low
    return items


def _gear(card: SteeredCard) -> str:
    if card.thrusters:
        return f"thrusters {', '.join(thruster.name for thruster in card.thrusters)}"
    gear = card.steering_gear
    if gear is None:
        return "not stated: a short lag is taken, without limits"
    lag = "lag not stated" if gear.time_constant_s is None else f"lag {gear.time_constant_s:.3g} s"
    limits = [
        f"{name} {math.degrees(value):.3g} {unit}"
        for name, value, unit in (("rate", gear.max_rate_radps, "deg/s"), ("angle", gear.max_angle_rad, "deg"))
        if value is not None
    ]
    return ", ".join([lag, *limits])


def _particulars(card: SteeredCard) -> str:
    ship = card.ship
    parts = [f"length {ship.length_m:.5g} m"]
    for name, value, unit in (
        ("breadth", ship.beam_m, "m"),
        ("draught", ship.draught_m, "m"),
        ("displacement", ship.displacement_kg, "kg"),
        ("block coefficient", ship.block_coefficient, ""),
    ):
        parts.append(f"{name} {'not stated' if value is None else f'{value:.5g} {unit}'.strip()}")
    return ", ".join(parts)


def _conventions(card: SteeredCard) -> str:
    model = card.model
    if not isinstance(model, ShipModel):
        return model.scaling
    return (
        f"{model.scaling}, by the {model.speed_scale} speed; yaw rate terms {model.yaw_rate_terms}; rudder positive to "
        f"{model.rudder_sign} in the file"
    )


def _propulsion(card: SteeredCard) -> str:
    if card.thrusters:
        largest = max(from_si("n_rpm", thruster.max_radps) for thruster in card.thrusters)
        return f"thrust with n|n| less the loss by speed, up to {largest:.4g} rpm"
    if card.propulsion is None:
        return "none: revolutions constant, no stopping"
    rpm = card.propulsion.nominal_radps * 30 / math.pi
    if card.model.kind == "mmg":
        delay = "reached at once unless an effect delays them"
        return f"open-water thrust, wake and thrust deduction; about {rpm:.4g} rpm, {delay}"
    return f"surge force with n|n| about {rpm:.4g} rpm, reached at once unless an effect delays them"


def _environment(card: SteeredCard) -> str:
    depth = card.ship.water_depth_m
    water = "depth not stated" if depth is None else f"depth {depth:.4g} m"
    return f"water {card.environment.water_density_kgpm3:.5g} kg/m3, {water}; calm unless effects say otherwise"
