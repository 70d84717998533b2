"""The added yaw inertia as N_rdot of a ship's card, or in a card of the rig."""

from __future__ import annotations

import math

import tomlkit

from tank2sim.apps.rigs.yaw.card import YawRig
from tank2sim.apps.rigs.yaw.energy import YawEstimate
from tank2sim.apps.rigs.yaw.identify import YAW_METHODS, YawIdentification
from tank2sim.apps.rigs.yaw.model import UNKNOWN_RIG
from tank2sim.cards import ManoeuvringCard, parse_card
from tank2sim.cards.reading import changed_text
from tank2sim.cards.scaling import Scales
from tank2sim.cards.writing import YawRigResult, yaw_rig_card_text
from tank2sim.errors import ArgumentError, InputError
from tank2sim.files import BYTE_ORDER_MARK

TANK_WATER_KGPM3 = 1000.0
"""Density of the tank's water where no record states it; fresh water, as in the paper."""


def nrdot_prime(
    result: YawIdentification, method: str, length_m: float, density_kgpm3: float
) -> tuple[float, float | None]:
    """N_rdot' = -lambda661 / (1/2 rho L^5) of the body in the tank, and its standard error.

    At equal Froude number the ship's is the same: an added inertia does not depend on viscosity. Raises as
    :func:`known_added_inertia`.
    """
    value, error = known_added_inertia(result, method)
    scale = float(Scales(density_kgpm3, length_m, 1.0).inertia)
    return -value / scale, None if error is None else error / scale


def known_added_inertia(result: YawIdentification, method: str) -> tuple[float, float | None]:
    """lambda661 and its standard error, kg m2.

    Raises
    ------
    InputError
        It is unknown, because the records are of air or J_zz is unknown; or it is negative, which is impossible.
    """
    source = result.records[0].path
    found = result.added_inertia(method)
    if found is None:
        remedy = "give records in water, and the inertia of the body: records in air, or inertia_kgm2"
        raise InputError(source, "", "does not separate the added inertia from the inertia of the body", remedy)
    if found[0] <= 0:
        raise InputError(source, "", "gives a negative added inertia, which no body has", "check J_zz and k_t")
    return found


def body_length(result: YawIdentification, given_m: float | None) -> float:
    """The body's length that makes N_rdot non-dimensional.

    Raises
    ------
    InputError
        Neither the argument nor a record states it.
    """
    for value in (given_m, *(record.constants.get("length_m") for record in result.records)):
        if value is not None:
            return value
    remedy = "give length_m, the model's length between perpendiculars, or a line '# length_m: 0.67'"
    raise InputError(result.records[0].path, "", "does not state the length of the model", remedy)


def tank_density(result: YawIdentification) -> float:
    """Density of the tank's water, kg/m3."""
    stated = [record.constants.get("water_density_kgpm3") for record in result.records]
    return next((value for value in stated if value is not None), TANK_WATER_KGPM3)


def with_nrdot(card: ManoeuvringCard, result: YawIdentification, method: str, length_m: float) -> ManoeuvringCard:
    """The ship's card with N_rdot of the model on the rig; the old values are in comments.

    Raises
    ------
    InputError
        As :func:`known_added_inertia`.
    """
    value, error = nrdot_prime(result, method, length_m, tank_density(result))
    factor = card.file_factor("Nrdot")
    key = card.places.get("Nrdot", "Nrdot")
    text = _replace_key(card.text, card.source, f"derivatives.{key}", value * factor, f"yaw rig, {method}")
    if error is not None:
        spelt = next(
            (key_in_file for key_in_file in _section(text, "uncertainty") if key_in_file.lower() == "nrdot"), key
        )
        text = _replace_key(text, card.source, f"uncertainty.{spelt}", error * abs(factor), f"yaw rig, {method}")
    new = parse_card(text, card.source)
    assert isinstance(new, ManoeuvringCard)
    return new


def _section(text: str, section: str) -> tomlkit.items.Table | dict[str, object]:
    found = tomlkit.parse(text.removeprefix(BYTE_ORDER_MARK)).get(section, {})
    return found if isinstance(found, tomlkit.items.Table) else {}


def _replace_key(text: str, source: str, key: str, value: float, origin: str) -> str:
    section, _, name = key.partition(".")
    old = _section(text, section)
    was = f"was {old[name].as_string()}" if name in old else "not stated before"  # type: ignore[union-attr]
    return changed_text(text, source, {key: float(f"{value:.6g}")}, comment=f"{origin}; {was}")


def rig_card_text(result: YawIdentification, method: str, *, name: str, source: str, known: YawRig | None) -> str:
    """TOML text of a rig card with the numbers of one method; the notes come from the result.

    Raises
    ------
    InputError
        The method gives no friction, or as :func:`known_added_inertia`.
    """
    estimate = result.estimates[method]
    if not estimate.friction:
        remedy = "take energy_least_squares, as_many_equations or output_error"
        raise ArgumentError("method", "", f"{method} gives no friction, and a rig card needs it", remedy)
    added = known_added_inertia(result, method) if result.medium == "water" else None
    base = known or UNKNOWN_RIG
    kept = ("current_lag_s", "max_current_A", "inertia_accelerating_kgm2", "inertia_braking_kgm2", "gravity_Nm",
            "gravity_angle_rad", "pulses_per_turn")  # fmt: skip
    values = {name: getattr(base, name) for name in kept}
    errors: dict[str, float] = {}
    inertia = [("inertia_kgm2", estimate.total_inertia_kgm2, estimate.inertia_error_kgm2)]
    if added and result.body:
        inertia = [("inertia_kgm2", result.body.value_kgm2, result.body.error_kgm2)]
        inertia.append(("added_inertia_kgm2", *added))
    units = {"coulomb": "coulomb_Nm", "viscous": "viscous_Nms", "quadratic": "quadratic_Nms2"}
    friction = [(key, *estimate.friction[term]) for term, key in units.items() if term in estimate.friction]
    for key, value, error in [*inertia, *friction]:
        values[key] = float(f"{value:.6g}")
        if error:
            errors[key] = float(f"{error:.3g}")
    values |= _gravity(estimate, base)
    values["torque_constant_NmpA"] = result.torque_constant_NmpA
    programme = result.records[0].programme
    motion = {"kind": programme.kind, "max_rate_degps": float(f"{math.degrees(programme.max_rate_radps):.9g}")}
    return yaw_rig_card_text(
        YawRigResult(
            name=name,
            source=source,
            notes=" ".join(result.notices),
            values=values,
            standard_errors=errors,
            programme={**motion, "rise_s": programme.rise_s, "settle_s": programme.settle_s, "humps": programme.humps},
            water_density_kgpm3=tank_density(result) if result.medium == "water" else None,
            length_m=next(
                (record.constants["length_m"] for record in result.records if "length_m" in record.constants), None
            ),
        )
    )


def _gravity(estimate: YawEstimate, known: YawRig) -> dict[str, float]:
    """G and psi_0 of the estimated moment plus the known moment: -G sin(psi - psi_0)."""
    found = [estimate.friction.get(term, (0.0, None))[0] for term in ("gravity_sine", "gravity_cosine")]
    if not any(found):
        return {}
    sine = found[0] + known.gravity_Nm * math.cos(known.gravity_angle_rad)
    cosine = found[1] - known.gravity_Nm * math.sin(known.gravity_angle_rad)
    moment, angle = math.hypot(sine, cosine), math.atan2(-cosine, sine)
    return {"gravity_Nm": float(f"{moment:.6g}"), "gravity_angle_rad": float(f"{angle:.6g}")}


BEST = YAW_METHODS[0]
"""Default method for the numbers of a card."""
