"""The card of a craft with what was estimated."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

from tank2sim.cards.card import SteeredCard
from tank2sim.cards.reading import changed_text, parse_card
from tank2sim.cards.small_craft import speed_held
from tank2sim.dynamics.small_craft import THRUSTER_PARAMETERS
from tank2sim.errors import InputError
from tank2sim.identification.craft.fit import CraftFit
from tank2sim.identification.craft.order_response import OrderResponse
from tank2sim.identification.craft.problem import COMPASS_SPREADS, twins
from tank2sim.units import from_si

CRUISING_SHARE = 0.9
"""Cruising speed over the largest one, where the card's is beyond it: room to steer (project choice)."""

_KEYS = {part: key for key, part in THRUSTER_PARAMETERS.items()}


def identified_craft(
    card: SteeredCard, fit: CraftFit, responses: Mapping[str, OrderResponse] | None = None
) -> SteeredCard:
    """The card with the estimates and their standard errors, in the scaling of its own text.

    `card`: The card of the problem; numbers that were not estimated stay. `responses`: Thruster to its response to
    orders: lag, and dead band where it is determined. Raises InputError: With the estimates the damping of the craft
    would drive it on.
    """
    changes: dict[str, object] = {}

    def write(section: str, key: str, value: float, error: float) -> None:
        changes[f"{section}.{key}"] = float(value)
        changes[f"{section}.uncertainty.{key}"] = float(error)

    for number, thruster in enumerate(card.thrusters):
        response, place = (responses or {}).get(thruster.name), f"thrusters.{number}"
        if response is not None:
            write(place, "time_constant_s", response.lag_s, response.lag_error_s)
        if response is not None and response.dead_band is not None:
            in_rpm = card.spelt.get(f"{place}.dead_band_radps", "").endswith("_rpm")
            key, unit = ("dead_band_rpm", from_si("n_rpm", 1.0)) if in_rpm else ("dead_band_radps", 1.0)
            value, error = response.dead_band
            write(place, key, value * unit, error * unit)
    values, errors = fit.estimate.values.tolist(), fit.estimate.standard_errors.tolist()
    estimates = {name: (values[at], errors[at]) for name, at in estimated_numbers(card, fit).items()}
    return craft_with(card, estimates, changes, comment="identified")


def craft_with(
    card: SteeredCard,
    estimates: Mapping[str, tuple[float, float]],
    others: Mapping[str, object] | None = None,
    *,
    comment: str,
) -> SteeredCard:
    """The card of a craft with estimates and their standard errors, in the scaling of its own text.

    A cruising speed that the thrusters no longer hold is lowered, unless the numbers of the text are scaled with it.

    `estimates`: Parameter of the model (``derivatives.Xu``, ``thrusters.port.ahead``) to value and standard error, SI;
    `others`: further values at keys of the text; `comment`: next to each. Raises InputError: With the estimates the
    damping of the craft would drive it on.
    """
    changes: dict[str, object] = dict(others or {})
    numbers = {thruster.name: number for number, thruster in enumerate(card.thrusters)}
    held = speed_held(_with_values(card, {name: value for name, (value, _) in estimates.items()}))
    if held < card.model.speed_mps and card.model.scaling == "dimensional":
        changes["model.speed_mps"] = math.floor(CRUISING_SHARE * held * 1000) / 1000
    for name, (value, error) in estimates.items():
        section, *rest = name.split(".")
        if section == "derivatives":
            factor = card.file_factor(rest[0])
            changes[name] = value * factor
            changes[f"uncertainty.{rest[0]}"] = error * abs(factor)
        else:
            place, key = f"thrusters.{numbers[rest[0]]}", _KEYS[rest[1]]
            changes |= {f"{place}.{key}": max(0.0, value), f"{place}.uncertainty.{key}": error}
    try:
        return parse_card(changed_text(card.text, card.source, changes, comment=comment), card.source).steered()
    except InputError as error:
        problem = f"fitted to these trials, it {error.problem}"
        remedy = (
            "check the mass, the inertia, and places and largest revolutions of the thrusters: they are taken as exact"
        )
        raise card.fault(error.place, problem, remedy) from error


def _with_values(card: SteeredCard, values: Mapping[str, float]) -> SteeredCard:
    """The card with other coefficients (SI), not checked."""
    thrusters = [
        thruster.model_copy(
            update={
                key: max(0.0, values[name])
                for part, key in _KEYS.items()
                if (name := f"thrusters.{thruster.name}.{part}") in values
            }
        )
        for thruster in card.thrusters
    ]
    hull = {name.partition(".")[2]: value for name, value in values.items() if name.startswith("derivatives.")}
    return replace(card, derivatives={**card.derivatives, **hull}, thrusters=tuple(thrusters))


def estimated_numbers(card: SteeredCard, fit: CraftFit) -> dict[str, int]:
    """Parameter of the model to the place of its estimate; twins of an estimated number have its place.

    `card`: The card of the problem.
    """
    found, free = {}, fit.problem.free
    for place, name in enumerate(free):
        if name in COMPASS_SPREADS:  # of the instruments, and not of the craft
            continue
        found[name] = place
        if name == "derivatives.Yrdot" and "derivatives.Nvdot" not in free:
            found["derivatives.Nvdot"] = place
        if name.startswith(f"thrusters.{card.thrusters[0].name}."):
            key = name.rpartition(".")[2]
            found |= {f"thrusters.{other}.{key}": place for other in twins(card)}
    return found
