"""Sizes and signs of derivatives that every known ship has.

Prime system, rudder positive to starboard, without inertia terms.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

DEEP_ADDED_SHARES = {"Yvdot": (0.5, 1.6), "Nrdot": (0.25, 2.0)}
"""Added mass over mass, and added yaw inertia over yaw inertia, of ships in deep water: 0.76 and 0.60 (KVLCC2), 0.89
(S175), 0.94 and 1.12 (Mariner); both limits are a project choice. If half the mass is stated, the reaction of the other
half seems to come from the water, and 0.94 becomes 2.9."""

ADDED_MASSES = ("Yvdot", "Nrdot")
"""Derivatives that reveal a wrong convention of the forces; their sign is checked with it."""

LEVERS = (
    ("Nv", "Yv", (-0.1, 0.6), "the force of a small drift angle"),
    ("Nd", "Yd", (-0.55, -0.35), "the force of the rudder"),
)
"""Moment and force, and the range of their ratio, lengths forward of midships. The rudder is at -0.5, and its force
on the hull acts forward of it; drift: 0.23 (Mariner) to 0.44 (KVLCC2)."""

YAW_DAMPING = (0.05, 1.0)
"""Range of N_r' over the value of a slender hull, -pi (d/L)^2. Clarke, Gedling and Hine (1983) have 1/4 + 0.039 B/d -
0.56 B/L times it, 0.2 to 0.4; the KVLCC2 0.24 without and 0.29 with its rudder. The bounds, a factor of three and more
away, are a project choice: a yaw rate r L/U taken for deg/s makes N_r' about ten times as large, one in rad/s five
times."""

_SIGNIFICANT = 2.0


@dataclass(frozen=True)
class ExpectedSign:
    """The sign, +1 or -1, and its reason, written after a colon."""

    sign: int
    reason: str


EXPECTED_SIGNS: dict[str, ExpectedSign] = {
    "Yv": ExpectedSign(-1, "the water resists sideways motion"),
    "Nv": ExpectedSign(-1, "the force of a drift angle acts forward of midships (Munk moment)"),
    "Nr": ExpectedSign(-1, "the water damps yawing"),
    "Yd": ExpectedSign(-1, "a rudder that turns to starboard pushes the stern to port"),
    "Nd": ExpectedSign(+1, "a rudder that turns to starboard, at the stern, pushes the bow to starboard"),
    "Yvdot": ExpectedSign(-1, "accelerating sideways takes water along (added mass)"),
    "Nrdot": ExpectedSign(-1, "accelerating in yaw takes water along (added inertia)"),
    "Xudot": ExpectedSign(-1, "accelerating ahead takes water along (added mass)"),
    "Xdd": ExpectedSign(-1, "a rudder at an angle has more drag"),
}
"""Signs of derivatives that every known ship has. Compared with the Mariner (Chislett and Strom-Tejsen 1965) and the
KVLCC2 (Yasukawa and Yoshimura 2015, converted); derivatives whose sign differs between ships, such as Y_r, Y_rdot and
N_vdot, are not listed."""


@dataclass(frozen=True)
class Caution:
    """A warning."""

    kind: str  # Subject, such as ``"frequency parameter"``
    fact: str  # One sentence, with figures and source
    runs: tuple[str, ...] = ()  # The runs concerned; empty for the whole campaign
    missing: str = ""  # The missing key that prevents the check; empty if the check was made
    remedy: str = ""  # What to check in the campaign that the numbers are from

    @property
    def message(self) -> str:
        """The fact and what to check, one sentence."""
        return f"{self.fact}; {self.remedy}." if self.remedy else self.fact


def added_masses(
    derivatives: Mapping[str, float],
    standard_errors: Mapping[str, float],
    mass_prime: float,
    inertia_prime: float | None,
) -> Iterator[Caution]:
    """Added mass or yaw inertia that no known ship has in deep water, by more than two standard errors.

    Positive derivatives are the subject of :func:`force_convention`. `derivatives` and `standard_errors` are prime, as
    `mass_prime` and `inertia_prime` (None if unknown).
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
                f"and known ships have {low:g} to {high:g} in deep water",
                remedy=f"check [model] {key} and the unit of the gauges",
            )


def unusual_signs(derivatives: Mapping[str, float], standard_errors: Mapping[str, float]) -> Iterator[Caution]:
    """Derivatives whose sign no known ship has, by more than two standard errors, each with the reason for the sign.

    `derivatives` and `standard_errors` are prime.
    """
    for name, expected in EXPECTED_SIGNS.items():
        value = derivatives.get(name)
        if value is None or value * expected.sign > 0:
            continue
        if abs(value) > _SIGNIFICANT * standard_errors.get(name, 0.0):
            yield Caution("sign", _sign_fact(name, value, expected))


def yaw_force(derivatives: Mapping[str, float], mass_prime: float) -> Iterator[Caution]:
    """Y_r of m' or more: the water would push a yawing ship inwards by more than the centrifugal force.

    `derivatives` are prime, as `mass_prime`.
    """
    value = derivatives.get("Yr")
    if value is not None and value >= mass_prime:
        yield Caution(
            "sign",
            f"Yr is {value:.3g}, not below m' = {mass_prime:.3g}: Y_r - m' is negative for every known ship",
            remedy="check whether the inertia of the model was taken out of the forces twice",
        )


def yaw_damping(
    derivatives: Mapping[str, float], standard_errors: Mapping[str, float], draught_ratio: float | None
) -> Iterator[Caution]:
    """N_r of a size that no hull has, by more than two standard errors.

    `derivatives` and `standard_errors` are prime; `draught_ratio` is d/L, None if unknown.
    """
    value = derivatives.get("Nr")
    if value is None or value > 0 or not draught_ratio:
        return
    unit = math.pi * draught_ratio**2
    ratio, doubt = -value / unit, _SIGNIFICANT * standard_errors.get("Nr", 0.0) / unit
    low, high = YAW_DAMPING
    if not low - doubt <= ratio <= high + doubt:
        yield Caution(
            "size",
            f"Nr is {value:.3g}, {ratio:.2g} times -pi (d/L)², and hulls have 0.2 to 0.4 times it",
            remedy="check the unit of the yaw rate (r L/U, rad/s or deg/s)",
        )


def levers(
    derivatives: Mapping[str, float], standard_errors: Mapping[str, float], room: float = 0.0
) -> Iterator[Caution]:
    """Points of attack that no ship has, by more than two standard errors: N_v/Y_v and N_delta/Y_delta.

    `derivatives` and `standard_errors` are prime; `room` (over L) widens the range on both sides.
    """
    for moment, force, (low, high), what in LEVERS:
        if not derivatives.get(moment) or not derivatives.get(force):
            continue
        lever = derivatives[moment] / derivatives[force]
        parts = (standard_errors.get(name, 0.0) / derivatives[name] for name in (moment, force))
        doubt = _SIGNIFICANT * abs(lever) * math.hypot(*parts)
        if not low - room - doubt <= lever <= high + room + doubt:
            yield Caution(
                "lever",
                f"{moment}/{force} is {lever:+.2f}: {what} would act {abs(lever):.2f} lengths "
                f"{'forward of' if lever > 0 else 'abaft'} midships, and known ships have {low:g} to {high:g}",
                remedy="check to which point moments are referred",
            )


def _sign_fact(name: str, value: float, expected: ExpectedSign) -> str:
    usual = "positive" if expected.sign > 0 else "negative"
    return f"{name} is {value:+.3g}, and it is {usual} for every known ship: {expected.reason}"
