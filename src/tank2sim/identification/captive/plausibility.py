"""Added masses from captive tests that no body has, and the convention of the forces that would explain them.

Prime system, rudder positive to starboard, without inertia terms.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from tank2sim.cards.plausibility import ADDED_MASSES, Caution

ADDED_SHARE = (0.1, 3.0)
"""Range of added mass over mass, and of added yaw inertia over yaw inertia; about 0.9 and 0.7 are usual."""


def force_convention(
    derivatives: Mapping[str, float], mass_prime: float, inertia_prime: float, convention: str
) -> Iterator[Caution]:
    """Added masses that no body has, and whether the opposite sign of the forces would correct them.

    Parameters
    ----------
    derivatives : mapping
        Prime values; Yvdot and Nrdot are checked.
    mass_prime, inertia_prime : float
        m' and J_z'. With forces of the wrong sign Y_vdot comes out as 2 m' - Y_vdot and N_rdot as 2 J_z' - N_rdot,
        by (4.4) of paper 2 and its equivalent for yaw.
    convention : str
        ``force_convention`` of the campaign.
    """
    inertias = ((mass_prime, "mass"), (inertia_prime, "yaw inertia"))
    for name, (inertia, what) in zip(ADDED_MASSES, inertias, strict=True):
        value = derivatives.get(name)
        if value is not None and value > 0:
            message = f"{name} is {value:.3g}: the added {what} is negative"
            if value >= inertia:
                message += f", and with that of the model ({inertia:.3g}) the whole is too"
            yield Caution("force convention", f"{message}; {_likely_cause(value, inertia, convention)}.")


def _likely_cause(value: float, inertia: float, convention: str) -> str:
    """Likely cause of a positive acceleration derivative."""
    least, most = ADDED_SHARE
    opposite = {"on_model": "on_gauge", "on_gauge": "on_model"}.get(convention)
    if opposite is None:
        return f"check that the model's inertia is indeed removed from the forces ({convention})"
    for corrected, instead, cause in (
        (2 * inertia - value, opposite, "the signs look reversed"),
        (value - inertia, "hydrodynamic", "the inertia of the model looks removed already"),
    ):
        if -most * inertia <= corrected <= -least * inertia:
            return f'force_convention = "{instead}" would give {corrected:.3g}, as of a ship: {cause}'
    if abs(value - inertia) < least * inertia:
        return "the forces hardly show the model's own inertia: check the unit of the gauges"
    return "check force_convention, the mass and the unit of the gauges"
