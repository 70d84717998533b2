"""The added yaw inertia as N_rdot of a ship's card, or in a card of the rig."""

from __future__ import annotations

import math
from collections.abc import Sequence

import tomlkit

from tank2sim.apps.rigs.yaw.card import YawRig
from tank2sim.apps.rigs.yaw.energy import YawMethodEstimate
from tank2sim.apps.rigs.yaw.identify import YawEstimates
from tank2sim.apps.rigs.yaw.records import YawRecord
from tank2sim.cards import ManoeuvringCard, parse_card
from tank2sim.cards.reading import changed_text
from tank2sim.cards.scaling import Scales
from tank2sim.cards.writing import card_text
from tank2sim.errors import ArgumentError, InputError
from tank2sim.files import BYTE_ORDER_MARK

TANK_WATER_KGPM3 = 1000.0
"""Density of the tank's water where no record states it; fresh water, as in the paper."""

_OF_THE_RIG = (
    "current_lag_s max_current_A inertia_accelerating_kgm2 inertia_braking_kgm2 gravity_Nm gravity_angle_rad "
    "pulses_per_turn"
).split()
"""Numbers of a card that the records do not change."""


def known_added_inertia(found: YawEstimates, method: str) -> tuple[float, float | None]:
    """lambda661 and its standard error, kg m2.

    InputError if it is unknown, because the records are of air or J_zz is unknown; or negative, which is impossible.
    """
    source, estimate = found.records[0], found.methods[method]
    added = estimate.added_inertia_kgm2
    if added is None:
        remedy = "give records in water, and the inertia of the body: records in air, or inertia_kgm2"
        raise InputError(source, "", "does not separate the added inertia from the inertia of the body", remedy)
    if added <= 0:
        raise InputError(source, "", "gives a negative added inertia, which no body has", "check J_zz and k_t")
    return added, estimate.added_inertia_standard_error_kgm2


def nrdot_prime(
    found: YawEstimates, records: Sequence[YawRecord], method: str, length_m: float | None
) -> tuple[float, float | None]:
    """N_rdot' = -lambda661 / (1/2 rho L^5) of the body in the tank, and its standard error.

    At equal Froude number the ship's is the same: an added inertia does not depend on viscosity. By default the length
    is the records'. InputError as :func:`known_added_inertia`, or if the length is not known.
    """
    value, error = known_added_inertia(found, method)
    length = length_m if length_m is not None else _stated(records, "length_m")
    if length is None:
        remedy = "give length_m, the model's length between perpendiculars, or a line '# length_m: 0.67'"
        raise InputError(found.records[0], "", "does not state the length of the model", remedy)
    scale = float(Scales(_tank_density(records), length, 1.0).inertia)
    return -value / scale, None if error is None else error / scale


def _stated(records: Sequence[YawRecord], key: str) -> float | None:
    """A constant of the first record that states it."""
    return next((record.constants[key] for record in records if key in record.constants), None)


def _tank_density(records: Sequence[YawRecord]) -> float:
    return _stated(records, "water_density_kgpm3") or TANK_WATER_KGPM3


def with_nrdot(card: ManoeuvringCard, value: float, error: float | None, method: str) -> ManoeuvringCard:
    """The ship's card with N_rdot' of the model on the rig; the old values are in comments."""
    factor, key = card.file_factor("Nrdot"), card.places.get("Nrdot", "Nrdot")
    text = _replaced(card.text, card.source, ("derivatives", key), value * factor, method)
    if error is not None:
        spelt = next((name for name in _section(text, "uncertainty") if name.lower() == "nrdot"), key)
        text = _replaced(text, card.source, ("uncertainty", spelt), error * abs(factor), method)
    new = parse_card(text, card.source)
    assert isinstance(new, ManoeuvringCard)
    return new


def _section(text: str, section: str) -> tomlkit.items.Table | dict[str, object]:
    found = tomlkit.parse(text.removeprefix(BYTE_ORDER_MARK)).get(section, {})
    return found if isinstance(found, tomlkit.items.Table) else {}


def _replaced(text: str, source: str, key: tuple[str, str], value: float, method: str) -> str:
    section, name = key
    old = _section(text, section)
    was = f"was {old[name].as_string()}" if name in old else "not stated before"  # type: ignore[union-attr]
    changes = {f"{section}.{name}": float(f"{value:.6g}")}
    return changed_text(text, source, changes, comment=f"yaw rig, {method}; {was}")


def rig_card_text(found: YawEstimates, records: Sequence[YawRecord], method: str, *, name: str, known: YawRig) -> str:
    """TOML text of a rig card with the numbers of one method; the notes come from the result.

    InputError if the method gives no friction, or as :func:`known_added_inertia`.
    """
    estimate = found.methods[method]
    if not estimate.friction:
        remedy = "take energy_least_squares, as_many_equations or output_error"
        raise ArgumentError("method", "", f"{method} gives no friction, and a rig card needs it", remedy)
    rows = _inertias(found, method) | {
        key: (value, estimate.friction_standard_errors[key])
        for key, value in estimate.friction.items()
        if key in ("coulomb_Nm", "viscous_Nms", "quadratic_Nms2")
    }
    values = {key: getattr(known, key) for key in _OF_THE_RIG}
    values |= {key: float(f"{value:.6g}") for key, (value, _) in rows.items()} | _gravity(estimate, known)
    programme, files = records[0].programme, " ".join(record.path.name for record in records)
    wet, notes = found.medium == "water", " ".join(found.notices)
    source, length = f"tank2sim yaw {files}, method {method}", _stated(records, "length_m")
    return card_text(
        {
            "ship": {"name": name, "length_m": length, "source": source, "notes": notes},
            "environment": {"water_density_kgpm3": _tank_density(records)} if wet else None,
            "model": {"kind": "yaw_rig"},
            "yaw_rig": {**values, "torque_constant_NmpA": found.torque_constant_NmpA},
            "programme": {
                "kind": programme.kind,
                "max_rate_degps": float(f"{math.degrees(programme.max_rate_radps):.9g}"),
                "rise_s": programme.rise_s,
                "settle_s": programme.settle_s,
                "humps": programme.humps,
            },
            "uncertainty": {key: float(f"{error:.3g}") for key, (_, error) in rows.items() if error},
        }
    )


def _inertias(found: YawEstimates, method: str) -> dict[str, tuple[float, float | None]]:
    """Keys of a rig card to its inertias with their standard errors, kg m2."""
    if found.medium == "air":
        estimate = found.methods[method]
        return {"inertia_kgm2": (estimate.total_inertia_kgm2, estimate.total_inertia_standard_error_kgm2)}
    body = found.body_inertia_kgm2 or 0.0, found.body_inertia_standard_error_kgm2
    return {"inertia_kgm2": body, "added_inertia_kgm2": known_added_inertia(found, method)}


def _gravity(estimate: YawMethodEstimate, known: YawRig) -> dict[str, float]:
    """G and psi_0 of the estimated moment plus the known moment: -G sin(psi - psi_0)."""
    found = [estimate.friction.get(f"gravity_{part}_Nm", 0.0) for part in ("sine", "cosine")]
    if not any(found):
        return {}
    sine = found[0] + known.gravity_Nm * math.cos(known.gravity_angle_rad)
    cosine = found[1] - known.gravity_Nm * math.sin(known.gravity_angle_rad)
    moment, angle = math.hypot(sine, cosine), math.atan2(-cosine, sine)
    return {"gravity_Nm": float(f"{moment:.6g}"), "gravity_angle_rad": float(f"{angle:.6g}")}
