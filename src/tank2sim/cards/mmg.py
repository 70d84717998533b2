"""Content of an MMG card, checked and completed: revolutions that hold the speed, K_T, f_alpha, both sides' values."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from tank2sim.arrays import Array
from tank2sim.cards.card import (
    CROSS_FLOW_AT_RUDDER,
    PROPELLER_COEFFICIENTS,
    RUDDER_COEFFICIENTS,
    WAKE_BY_DRIFT,
    MmgCard,
)
from tank2sim.cards.form import MmgForm, MmgPropeller, MmgRudder, ShipCard
from tank2sim.errors import InputError

_THRUST, _TORQUE = ("k_0", "k_1", "k_2"), ("q_0", "q_1", "q_2")

WITH_BOTH_SIDES = {
    "propeller": (("C_2_plus", "C_2_minus"),),
    "rudder": (("gamma_R_plus", "gamma_R_minus"),),
}
"""Section to pairs of keys for the two sides."""


def fujii(aspect_ratio: float) -> float:
    """f_alpha = 6.13 Lambda/(2.25 + Lambda), the slope of a rudder's normal force: Fujii and Tsuda (1961)."""
    return 6.13 * aspect_ratio / (2.25 + aspect_ratio)


def mmg_fields(form: MmgForm, source: str) -> tuple[dict[str, Any], ShipCard]:
    """The fields that only an MMG card has, and the form without them.

    Raises InputError: a value is given for one side alone, K_T or the slope of the rudder is given twice or not at all,
    or eta > 1.
    """
    _refuse_one_side(form, source)
    propeller = _propeller(form.propeller, source)
    rudder = _rudder(form.rudder, source)
    if rudder.number != propeller.number:
        problem = f"is {rudder.number} behind {propeller.number} propeller{'s' * (propeller.number > 1)}"
        raise InputError(source, "rudder.number", problem, "give as many rudders as propellers")
    if rudder.eta is None and form.ship.propeller_diameter_m / rudder.height_m > 1:
        ratio = form.ship.propeller_diameter_m / rudder.height_m
        problem = f"is less than the propeller's diameter (eta = D_P/H_R = {ratio:.3g})"
        raise InputError(source, "rudder.height_m", problem, "check both: the race covers a share eta of the rudder")
    known = (*PROPELLER_COEFFICIENTS, *RUDDER_COEFFICIENTS)
    errors = {key: error for key, error in form.uncertainty.items() if key in known}
    if form.propeller.J is not None and (key := next((key for key in (*_THRUST, *_TORQUE) if key in errors), "")):
        remedy = "give k_0, k_1, k_2 in place of J and K_T (q_0, q_1, q_2 of K_Q), or leave it out"
        raise InputError(source, f"uncertainty.{key}", "is of a polynomial, and [propeller] has a table", remedy)
    remaining = {key: error for key, error in form.uncertainty.items() if key not in errors}
    own = {"propeller": propeller, "rudder": rudder, "interaction_errors": errors}
    return own, form.model_copy(update={"propulsion": None, "uncertainty": remaining})


def _refuse_one_side(form: MmgForm, source: str) -> None:
    for name, pairs in WITH_BOTH_SIDES.items():
        for pair in pairs:
            if len(given := _given(getattr(form, name), pair)) == 1:
                absent = next(key for key in pair if key not in given)
                raise InputError(source, f"{name}.{absent}", "is missing", f"{given[0]} is of one side: give both")


def _given(section: MmgPropeller | MmgRudder, keys: Sequence[str]) -> list[str]:
    return [key for key in keys if getattr(section, key) is not None]


def _complete(given: Sequence[str], keys: Sequence[str], source: str) -> None:
    """Raise InputError if some but not all of the `keys` of ``[propeller]`` are given."""
    if given and (absent := [key for key in keys if key not in given]):
        raise InputError(source, f"propeller.{absent[0]}", "is missing", f"{given[0]} is given: give {', '.join(keys)}")


def _propeller(section: MmgPropeller, source: str) -> MmgPropeller:
    polynomial, table = _given(section, _THRUST), _given(section, ("J", "K_T"))
    _refuse_both(polynomial, table, source)
    _complete(polynomial, _THRUST, source)
    _complete(table, ("J", "K_T"), source)
    if not polynomial and not table:
        raise InputError(source, "propeller.k_0", "is missing", "give k_0, k_1, k_2 or points J, K_T of the curve")
    update = _curve(section, "K_T", _THRUST, source) | _torque(section, source)
    if _one_form(section, "propeller", WAKE_BY_DRIFT, source):
        update |= {key: getattr(section, key) or 0.0 for key in WAKE_BY_DRIFT[1]}
    else:
        _complete(_given(section, WAKE_BY_DRIFT[0]), WAKE_BY_DRIFT[0], source)
        update |= {} if section.C_1 is not None else {"C_1": 0.0, "C_2_plus": 1.0, "C_2_minus": 1.0}
    if section.number == 2 and section.y_P is None:
        raise InputError(
            source, "propeller.y_P", "is missing", "two propellers need their distance to midships, over L"
        )
    return section.model_copy(update=update)


def _refuse_both(polynomial: Sequence[str], table: Sequence[str], source: str) -> None:
    if polynomial and table:
        raise InputError(source, f"propeller.{table[0]}", f"is given, and {polynomial[0]} too", "give one of the two")


def _torque(section: MmgPropeller, source: str) -> dict[str, float]:
    """q_0, q_1, q_2 and eta_R, as given or of a table of K_Q; empty without K_Q."""
    given, table = _given(section, _TORQUE), _given(section, ("K_Q",))
    _refuse_both(given, table, source)
    _complete(given, _TORQUE, source)
    if table and section.J is None:
        raise InputError(source, "propeller.J", "is missing", "give the J of each K_Q")
    if given or table:
        return {"eta_R": 1.0 if section.eta_R is None else section.eta_R} | _curve(section, "K_Q", _TORQUE, source)
    if section.eta_R is not None:
        raise InputError(source, "propeller.eta_R", "is given without K_Q", "give q_0, q_1, q_2 or leave it out")
    return {}


def _curve(section: MmgPropeller, curve: str, keys: Sequence[str], source: str) -> dict[str, float]:
    """Coefficients of a table; empty without one."""
    values = getattr(section, curve)
    if values is None or section.J is None:
        return {}
    return dict(zip(keys, open_water_fit(section.J, values, source, curve).coefficients.tolist(), strict=True))


def _one_form(
    section: MmgPropeller | MmgRudder, name: str, forms: tuple[tuple[str, ...], tuple[str, ...]], source: str
) -> bool:
    """True if a section has the second form of two, whose keys `forms` has; keys of both are refused."""
    first, second = (_given(section, keys) for keys in forms)
    if first and second:
        remedy = f"give {', '.join(forms[0])} or {', '.join(forms[1])}"
        raise InputError(source, f"{name}.{second[0]}", f"is given, and {first[0]} too", remedy)
    return bool(second)


class OpenWaterFit(NamedTuple):
    """Coefficients of 1, J, J^2 in an open-water curve, and its largest error."""

    coefficients: Array
    largest_error: float


def open_water_fit(J: list[float], values: list[float], source: str, curve: str = "K_T") -> OpenWaterFit:
    """Least squares of a curve, K_T or K_Q, on 1, J, J^2.

    Raises InputError: the lists differ in length, or have fewer than three different J.
    """
    if len(J) != len(values):
        problem = f"has {len(values)} values and J {len(J)}"
        raise InputError(source, f"propeller.{curve}", problem, f"give a {curve} for each J")
    if len(set(J)) < 3:
        raise InputError(source, "propeller.J", f"has {len(set(J))} different values", "a quadratic needs three")
    powers = np.vander(J, 3, increasing=True)
    coefficients = np.linalg.lstsq(powers, np.array(values), rcond=None)[0]
    return OpenWaterFit(coefficients, float(np.abs(powers @ coefficients - values).max()))


def _rudder(section: MmgRudder, source: str) -> MmgRudder:
    update: dict[str, float] = {}
    if _one_form(section, "rudder", CROSS_FLOW_AT_RUDDER, source):
        update = {key: getattr(section, key) or 0.0 for key in CROSS_FLOW_AT_RUDDER[1]}
    elif section.gamma_R_plus is None:
        raise InputError(source, "rudder.gamma_R_plus", "is missing", "give gamma_R_plus and gamma_R_minus")
    elif section.l_R is None:
        raise InputError(source, "rudder.l_R", "is missing", "give l_R, the effective place of the rudder in yaw")
    if section.f_alpha is None:
        if section.aspect_ratio is None:
            raise InputError(source, "rudder.f_alpha", "is missing", "give f_alpha or aspect_ratio")
        update["f_alpha"] = fujii(section.aspect_ratio)
    if section.number == 2 and section.y_R is None:
        raise InputError(source, "rudder.y_R", "is missing", "two rudders need their distance to midships, over L")
    return section.model_copy(update=update)


def equilibrium_revolutions(
    resistance: float, inflow: float, diameter: float, coefficients: tuple[float, float, float]
) -> float | None:
    """n (1/s) at which K_T rho n^2 D^4 is a resistance over rho, at an inflow u_P; None if there is none.

    `resistance`: T/rho of one propeller, m4/s2. `inflow`: (1 - w_P0) u, m/s. `diameter`: D_P, m. `coefficients`: k_0,
    k_1, k_2.
    """
    k_0, k_1, k_2 = coefficients
    # k_0 D^4 n^2 + k_1 D^3 u_P n + k_2 D^2 u_P^2 - T/rho = 0
    quadratic, linear, constant = (
        k_0 * diameter**4,
        k_1 * diameter**3 * inflow,
        k_2 * (diameter * inflow) ** 2 - resistance,
    )
    root = linear**2 - 4 * quadratic * constant
    if quadratic <= 0 or root < 0:
        return None
    n = (-linear + math.sqrt(root)) / (2 * quadratic)
    return n if n > 0 else None


def nominal_revolutions(card: MmgCard, stated: float | None) -> float:
    """Revolutions (rad/s) of the approach: those stated, or those that hold ``model.speed_mps`` straight ahead.

    Raises InputError: None do.
    """
    if stated is not None:
        return stated
    propeller, speed = card.propeller, card.model.speed_mps
    over_density = -0.5 * (card.ship.length_m * speed) ** 2 * card.derivatives.get("X0", 0.0)
    thrust = over_density / ((1 - propeller.t_P) * propeller.number)
    curve = propeller.k_0 or 0.0, propeller.k_1 or 0.0, propeller.k_2 or 0.0
    n = equilibrium_revolutions(thrust, (1 - propeller.w_P0) * speed, card.ship.propeller_diameter_m, curve)
    if n is None:
        problem = f"no revolutions hold {speed:g} m/s against the resistance"
        remedy = "check R0, k_0 to k_2, t_P and w_P0, or give propulsion.nominal_rpm"
        raise card.fault(f"derivatives.{card.places.get('X0', 'R0')}", problem, remedy)
    return 2 * math.pi * n


_SLENDER_WING = (0.3, 8.0)
"""Range of Y_v' over the value of a slender wing, -pi (d/L)^2 (Jones 1946): Clarke, Gedling and Hine (1983) have
1 + 0.4 C_B B/d, 1.5 to 2.5 times it. Prime II taken for prime, or the other way, is a factor of L/d = 8 to 25. The
bounds are a project choice."""


def refuse_other_scaling(card: MmgCard) -> None:
    """Raise InputError if Y_v is of another scaling, length or draught than the card's.

    Raises InputError: Y_v is not within :data:`_SLENDER_WING`.
    """
    draught, value = card.ship.draught_m, card.derivatives.get("Yv", 0.0)
    if draught is None or not value:
        return
    ratio = -value / (math.pi * (draught / card.ship.length_m) ** 2)
    if not _SLENDER_WING[0] < ratio < _SLENDER_WING[1]:
        problem = (
            f'is {ratio:.2g} times -pi (d/L)^2 by scaling = "{card.model.scaling}"; hulls have 1.5 to 2.5 times it'
        )
        raise card.fault("derivatives.Yv", problem, "check its sign, scaling, length_m and draught_m")
