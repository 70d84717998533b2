"""The parameters of the program shipmmg (https://pypi.org/project/shipmmg) for an MMG card, as a Python file.

Its wake is w_P0 exp(-4 beta_P^2) in place of C_1, C_2, and its U and beta are of v - x_G r: the file holds what it can.
"""

from __future__ import annotations

import math

from tank2sim.cards.card import MmgCard
from tank2sim.dynamics.mmg.hull import HULL_TERMS


def shipmmg_values(card: MmgCard) -> tuple[dict[str, float], dict[str, float]]:
    """Keyword arguments of ``Mmg3DofBasicParams`` and ``Mmg3DofManeuveringParams``.

    Raises
    ------
    InputError
        The ship has two propellers, or an asymmetric hull (Y0, N0).
    """
    if card.propeller.number != 1:
        raise card.fault("propeller.number", "is 2, and shipmmg has one propeller", "convert it --to mss or pvs")
    if card.roll is not None:
        raise card.fault("roll", "is given, and shipmmg's ship does not roll", "convert it --to mss or pvs")
    for key, place in card.interaction_places().items():
        if key in ("tau", "eta", "C_Rv"):
            raise card.fault(place, "is no coefficient of shipmmg", "convert it --to mss or pvs")
    for name in ("Y0", "N0", "Yrdot", "Nvdot"):
        if card.derivatives.get(name):
            raise card.fault(f"derivatives.{name}", "is no coefficient of shipmmg", "leave it out")
    length, scales, body = card.ship.length_m, card.scales, card.rigid_body
    mass = body.mass * scales.mass
    known = card.derivatives
    basic = {
        "L_pp": length,
        "B": card.ship.beam_m if card.ship.beam_m is not None else math.nan,
        "d": card.ship.draught_m,
        "x_G": body.x_G * length,
        "D_p": card.ship.propeller_diameter_m,
        "m": mass,
        "I_zG": (body.yaw_inertia - body.mass * body.x_G**2) * scales.inertia,
        "A_R": card.ship.rudder_area_m2,
        "η": card.ship.propeller_diameter_m / card.rudder.height_m,
        "m_x": -known.get("Xudot", 0.0) * scales.mass,
        "m_y": -known.get("Yvdot", 0.0) * scales.mass,
        "J_z": -known.get("Nrdot", 0.0) * scales.inertia,
        "f_α": card.interaction("f_alpha"),
        "ϵ": card.rudder.eps,
        "t_R": card.rudder.t_R,
        "x_R": card.rudder.x_R * length,
        "a_H": card.rudder.a_H,
        "x_H": card.rudder.x_H * length,
        "γ_R_minus": card.interaction("gamma_R_minus"),
        "γ_R_plus": card.interaction("gamma_R_plus"),
        "l_R": card.interaction("l_R"),
        "κ": card.rudder.kappa,
        "t_P": card.propeller.t_P,
        "w_P0": card.propeller.w_P0,
        "x_P": card.propeller.x_P,
    }
    hull = {key: card.interaction(key) for key in ("k_0", "k_1", "k_2")}
    ratio = length / card.ship.draught_m
    hull["R_0_dash"] = -known.get("X0", 0.0) * ratio
    for force, names in HULL_TERMS.items():
        for name in names:
            if not name.endswith("0"):
                hull[f"{force}_{name[1:]}_dash"] = known.get(name, 0.0) * ratio
    return {key: float(value) for key, value in basic.items()}, {key: float(value) for key, value in hull.items()}


def shipmmg_text(card: MmgCard) -> str:
    """A Python file that makes ``basic_params``, ``maneuvering_params``, ``u0``, ``nps``, ``rho`` of a card.

    Raises
    ------
    InputError
        As :func:`shipmmg_values`.
    """
    basic, hull = shipmmg_values(card)

    def call(values: dict[str, float]) -> str:
        return "".join(f"    {key}={_number_text(value)},\n" for key, value in values.items())

    n = card.propulsion.nominal_radps / (2 * math.pi) if card.propulsion else 0.0
    title = f"{card.ship.name}: parameters for shipmmg, written by tank2sim convert."
    return (
        f'"""{_plain(title)}\n\n'
        "SI; rudder positive to starboard. shipmmg has another wake than the card: w_P0 exp(-4 beta_P^2), no C_1\n"
        f'and C_2. Source of the coefficients: {_plain(card.ship.source)}\n"""\n\n'
        "from shipmmg.mmg_3dof import Mmg3DofBasicParams, Mmg3DofManeuveringParams\n\n"
        f"u0 = {card.model.speed_mps!r}  # m/s, the approach\n"
        f"nps = {n!r}  # 1/s, revolutions of the approach\n"
        f"rho = {card.environment.water_density_kgpm3!r}  # kg/m3\n\n"
        f"basic_params = Mmg3DofBasicParams(\n{call(basic)})\n\n"
        f"maneuvering_params = Mmg3DofManeuveringParams(\n{call(hull)})\n"
    )


def _number_text(value: float) -> str:
    return 'float("nan")' if math.isnan(value) else repr(value)


def _plain(text: str) -> str:
    """Text that ends no string and opens no escape."""
    return text.replace("\\", "/").replace('"', "'").replace("\n", " ")
