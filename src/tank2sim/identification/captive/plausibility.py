"""Physics warnings on the derivatives that captive tests gave: values that no known ship has.

Prime system, rudder positive to starboard, without inertia terms.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping

from tank2sim.identification.captive.expected_signs import EXPECTED_SIGNS, ExpectedSign
from tank2sim.identification.captive.physics_warning import Caution

ADDED_SHARE = (0.1, 3.0)
"""Added mass and added yaw inertia of ships over their own lie between; about 0.9 and 0.7 are usual."""

DEEP_ADDED_SHARES = {"Yvdot": (0.5, 1.6), "Nrdot": (0.25, 2.0)}
"""Added mass over mass, and added yaw inertia over yaw inertia, of ships in deep water: 0.76 and 0.60 (KVLCC2), 0.89
(S175), 0.94 and 1.12 (Mariner); a project choice on either side. With half the mass, whose reaction the gauges then
seem to show in the water, 0.94 becomes 2.9."""

ADDED_MASSES = ("Yvdot", "Nrdot")
"""Derivatives that tell a wrong convention of the forces; their sign is judged with it."""

LEVERS = (
    ("Nv", "Yv", (-0.1, 0.6), "the force of a small drift angle"),
    ("Nd", "Yd", (-0.55, -0.35), "the force of the rudder"),
)
"""Moment and force, and the range of their ratio, lengths forward of midships. The rudder stands at -0.5, and the force
it raises on the hull is forward of it; drift: 0.23 (Mariner) to 0.44 (KVLCC2)."""

_SIGNIFICANT = 2.0


def force_convention(
    derivatives: Mapping[str, float], mass_prime: float, inertia_prime: float, convention: str
) -> Iterator[Caution]:
    """Added masses that no body has, and whether the opposite sign of the forces would correct them.

    Parameters
    ----------
    derivatives : mapping
        Prime values; Yvdot and Nrdot are looked at.
    mass_prime, inertia_prime : float
        m' and J_z'. With forces of the wrong sign Y_vdot comes out as 2 m' - Y_vdot and N_rdot as 2 J_z' - N_rdot,
        by (4.4) of paper 2 and its like for yaw.
    convention : str
        ``force_convention`` as the campaign has it.
    """
    inertias = ((mass_prime, "mass"), (inertia_prime, "yaw inertia"))
    for name, (inertia, what) in zip(ADDED_MASSES, inertias, strict=True):
        value = derivatives.get(name)
        if value is not None and value > 0:
            message = f"{name} is {value:.3g}: the added {what} is negative"
            if value >= inertia:
                message += f", and with that of the model ({inertia:.3g}) the whole is too"
            yield Caution("force convention", f"{message}; {_likely_cause(value, inertia, convention)}.")


def added_masses(
    derivatives: Mapping[str, float],
    standard_errors: Mapping[str, float],
    mass_prime: float,
    inertia_prime: float | None,
) -> Iterator[Caution]:
    """Added mass or yaw inertia that no known ship has in deep water next to its own, by more than two standard errors.

    Of positive derivatives :func:`force_convention` speaks.
    """
    inertias = ((mass_prime, "mass", "mass_kg"), (inertia_prime, "yaw inertia", "yaw_inertia_kgm2"))
    for name, (inertia, what, key) in zip(ADDED_MASSES, inertias, strict=True):
        value = derivatives.get(name)
        if value is None or value > 0 or not inertia:
            continue
        low, high = DEEP_ADDED_SHARES[name]
        share, doubt = -value / inertia, _SIGNIFICANT * standard_errors.get(name, 0.0) / inertia
        if not low - doubt <= share <= high + doubt:
            yield Caution(
                "mass",
                f"{name} is {value:.3g}: the added {what} would be {share:.2g} times the model's own ({inertia:.3g}), "
                f"and known ships have {low:g} to {high:g} in deep water; check [model] {key} and the unit of the "
                "gauges.",
            )


def _likely_cause(value: float, inertia: float, convention: str) -> str:
    """What makes of a ship's acceleration derivative the positive value found."""
    least, most = ADDED_SHARE
    other = {"on_model": "on_gauge", "on_gauge": "on_model"}.get(convention)
    if other is None:
        return f"check that the model's inertia is indeed removed from the forces ({convention})"
    for mended, instead, cause in (
        (2 * inertia - value, other, "the signs look reversed"),
        (value - inertia, "hydrodynamic", "the inertia of the model looks removed already"),
    ):
        if -most * inertia <= mended <= -least * inertia:
            return f'force_convention = "{instead}" would give {mended:.3g}, as of a ship: {cause}'
    if abs(value - inertia) < least * inertia:
        return "the forces hardly show the model's own inertia: check the unit of the gauges"
    return "check force_convention, the mass and the unit of the gauges"


def unusual_signs(derivatives: Mapping[str, float], standard_errors: Mapping[str, float]) -> Iterator[Caution]:
    """Derivatives whose sign no known ship has, by more than two standard errors, each with the reason for the sign."""
    for name, expected in EXPECTED_SIGNS.items():
        value = derivatives.get(name)
        if value is None or value * expected.sign > 0:
            continue
        if abs(value) > _SIGNIFICANT * standard_errors.get(name, 0.0):
            yield Caution("sign", _sign_message(name, value, expected))


def yaw_force(derivatives: Mapping[str, float], mass_prime: float) -> Iterator[Caution]:
    """Y_r of m' or more: the water would then push a yawing ship inwards by more than the centrifugal force."""
    value = derivatives.get("Yr")
    if value is not None and value >= mass_prime:
        yield Caution(
            "sign",
            f"Yr is {value:.3g}, not below m' = {mass_prime:.3g}; Y_r - m' is negative of every known ship. Was the "
            "inertia of the model taken out of the forces twice?",
        )


def levers(derivatives: Mapping[str, float], standard_errors: Mapping[str, float]) -> Iterator[Caution]:
    """Points of attack where no ship has them, by more than two standard errors: N_v/Y_v and N_delta/Y_delta."""
    for moment, force, (low, high), what in LEVERS:
        if not derivatives.get(moment) or not derivatives.get(force):
            continue
        lever = derivatives[moment] / derivatives[force]
        parts = (standard_errors.get(name, 0.0) / derivatives[name] for name in (moment, force))
        doubt = _SIGNIFICANT * abs(lever) * math.hypot(*parts)
        if not low - doubt <= lever <= high + doubt:
            yield Caution(
                "lever",
                f"{moment}/{force} is {lever:+.2f}: {what} would act {abs(lever):.2f} lengths "
                f"{'forward of' if lever > 0 else 'abaft'} midships, and known ships have {low:g} to {high:g}; check "
                "to which point moments are referred.",
            )


def _sign_message(name: str, value: float, expected: ExpectedSign) -> str:
    usual = "positive" if expected.sign > 0 else "negative"
    return f"{name} is {value:+.3g}; it is {usual} of every known ship: {expected.reason}."
