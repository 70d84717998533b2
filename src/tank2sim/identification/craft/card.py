"""The card of a craft with what was estimated."""

from __future__ import annotations

from collections.abc import Mapping

from tank2sim.cards.card import SteeredCard
from tank2sim.cards.reading import changed_text, parse_card
from tank2sim.dynamics.small_craft import THRUSTER_PARAMETERS
from tank2sim.errors import InputError
from tank2sim.identification.craft.fit import CraftFit
from tank2sim.identification.craft.order_response import OrderResponse
from tank2sim.identification.craft.problem import twins
from tank2sim.units import from_si

_KEYS = {part: key for key, part in THRUSTER_PARAMETERS.items()}


def identified_craft(
    card: SteeredCard, fit: CraftFit, responses: Mapping[str, OrderResponse] | None = None
) -> SteeredCard:
    """The card with the estimates and their standard errors, in the scaling of its own text.

    Parameters
    ----------
    card : SteeredCard
        The card of the problem; numbers that were not estimated stay.
    fit : CraftFit
    responses : mapping, optional
        Thruster to its response to orders: lag, and dead band where it is determined.

    Raises
    ------
    InputError
        With the estimates the damping of the craft would drive it on.
    """
    changes: dict[str, object] = {}
    for number, thruster in enumerate(card.thrusters):
        response = (responses or {}).get(thruster.name)
        if response is None:
            continue
        place = f"thrusters.{number}"
        changes[f"{place}.time_constant_s"] = float(response.lag_s)
        changes[f"{place}.uncertainty.time_constant_s"] = float(response.lag_error_s)
        if response.dead_band is None:
            continue
        in_rpm = card.spelt.get(f"{place}.dead_band_radps", "").endswith("_rpm")
        key, unit = ("dead_band_rpm", from_si("n_rpm", 1.0)) if in_rpm else ("dead_band_radps", 1.0)
        value, error = response.dead_band
        changes[f"{place}.{key}"] = float(value * unit)
        changes[f"{place}.uncertainty.{key}"] = float(error * unit)
    shared = twins(card)
    estimates = zip(fit.problem.free, fit.estimate.values, fit.estimate.standard_errors, strict=True)
    for name, value, error in estimates:
        first, *rest = name.split(".")
        if first == "derivatives":
            factor = card.file_factor(rest[0])
            names = ["Yrdot", "Nvdot"] if rest[0] == "Yrdot" and "derivatives.Nvdot" not in fit.problem.free else rest
            for term in names:
                changes[f"derivatives.{term}"] = float(value * factor)
                changes[f"uncertainty.{term}"] = float(error * abs(factor))
            continue
        for number, thruster in enumerate(card.thrusters):
            twin = thruster.name in shared and rest[0] == card.thrusters[0].name
            if thruster.name == rest[0] or twin:
                key = _KEYS[rest[1]]
                changes[f"thrusters.{number}.{key}"] = max(0.0, float(value))
                changes[f"thrusters.{number}.uncertainty.{key}"] = float(error)
    try:
        return parse_card(changed_text(card.text, card.source, changes, comment="identified"), card.source).steered()
    except InputError as error:
        problem = f"fitted to these trials, it {error.problem}"
        remedy = (
            "check the mass, the inertia, and places and largest revolutions of the thrusters: they are taken as exact"
        )
        raise InputError(card.source, error.place, problem, remedy) from error
