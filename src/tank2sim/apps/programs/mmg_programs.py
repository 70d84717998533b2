"""The parameters of other MMG programs for an MMG card, as a Python file: shipmmg and mmgdynamics.

shipmmg (https://pypi.org/project/shipmmg): its wake is w_P0 exp(-4 beta_P^2) in place of C_1, C_2, and its U and beta
are of v - x_G r. mmgdynamics (https://github.com/nikpau/mmgdynamics): the same; its wake with C_1, C_2 lacks a bracket,
which leaves (3 - C_2)(1 - w_P0) straight ahead, so that they are not given to it; its rudder is at -L/2. The files hold
what they can.
"""

from __future__ import annotations

import math

from tank2sim.cards.card import MmgCard
from tank2sim.dynamics.mmg.hull import HULL_TERMS
from tank2sim.escaping import python_text

_OTHER_PROGRAMS = 'convert it with to="mss" or to="pvs"'


def _shared_values(card: MmgCard, program: str) -> dict[str, float]:
    """Numbers that both programs have, SI, by their names in mmgdynamics.

    Raises InputError: The ship has what the programs lack.
    """
    _refuse_what_others_lack(card, program)
    ship, body, rudder, interaction = card.ship, card.rigid_body, card.rudder, card.interaction
    return {
        "Lpp": ship.length_m,
        "B": math.nan if ship.beam_m is None else ship.beam_m,
        "d": ship.draught_m,
        "m": body.mass * card.scales.mass,
        "x_G": body.x_G * ship.length_m,
        "I_zG": (body.yaw_inertia - body.mass * body.x_G**2) * card.scales.inertia,
        "D_p": ship.propeller_diameter_m,
        "w_P0": card.propeller.w_P0,
        "t_P": card.propeller.t_P,
        "A_R": ship.rudder_area_m2,
        "eta": ship.propeller_diameter_m / rudder.height_m,
        "epsilon": rudder.eps,
        "kappa": rudder.kappa,
        "t_R": rudder.t_R,
        "a_H": rudder.a_H,
        **{key: interaction(key) for key in ("f_alpha", "l_R", "gamma_R_plus", "gamma_R_minus")},
    }


_OF_SHIPMMG = {
    "Lpp": "L_pp",
    "eta": "η",
    "f_alpha": "f_α",
    "epsilon": "ϵ",
    "kappa": "κ",
    "gamma_R_minus": "γ_R_minus",
    "gamma_R_plus": "γ_R_plus",
}
"""Names of mmgdynamics to other names in shipmmg."""


def shipmmg_values(card: MmgCard) -> tuple[dict[str, float], dict[str, float]]:
    """Keyword arguments of ``Mmg3DofBasicParams`` and ``Mmg3DofManeuveringParams``.

    Raises InputError: The ship has two propellers, or an asymmetric hull (Y0, N0).
    """
    length, scales, rudder = card.ship.length_m, card.scales, card.rudder
    basic = {_OF_SHIPMMG.get(key, key): value for key, value in _shared_values(card, "shipmmg").items()}
    added = {name: -card.derivatives.get(name, 0.0) for name in ("Xudot", "Yvdot", "Nrdot")}
    basic |= {"m_x": added["Xudot"] * scales.mass, "m_y": added["Yvdot"] * scales.mass}
    basic |= {"J_z": added["Nrdot"] * scales.inertia, "x_R": rudder.x_R * length, "x_H": rudder.x_H * length}
    basic["x_P"] = card.propeller.x_P
    return {key: float(value) for key, value in basic.items()}, _hull_in_prime_ii(card)


def mmgdynamics_values(card: MmgCard) -> dict[str, float]:
    """The dictionary of a vessel of mmgdynamics: SI, and Prime II where a name ends in ``_dash``.

    Its moment of the rudder is (-L/2 + a_H x_H) F_N cos(delta): x_H makes the sum equal to the card's.

    Raises InputError: As :func:`shipmmg_values`, or the card has no beam, or x_R is not -0.5 and a_H is 0.
    """
    shared = _shared_values(card, "mmgdynamics")
    ship, rudder, density = card.ship, card.rudder, card.environment.water_density_kgpm3
    if ship.beam_m is None:
        raise card.fault("ship.beam_m", "is missing, and mmgdynamics needs it", "add it")
    arm = rudder.x_R + rudder.a_H * rudder.x_H
    if not rudder.a_H and rudder.x_R != -0.5:
        raise card.fault("rudder.x_R", f"is {rudder.x_R:g}, and mmgdynamics has -0.5", _OTHER_PROGRAMS)
    ratio = ship.length_m / ship.draught_m
    added = (("m_x_dash", "Xudot"), ("m_y_dash", "Yvdot"), ("J_z_dash", "Nrdot"))
    values = {
        "rho": density,
        "C_b": shared["m"] / density / (ship.length_m * ship.beam_m * ship.draught_m),
        **shared,
        "x_P": card.propeller.x_P * ship.length_m,
        "x_H_dash": (arm + 0.5) / rudder.a_H if rudder.a_H else rudder.x_H,
        **{key: -card.derivatives.get(name, 0.0) * ratio for key, name in added},
        **_hull_in_prime_ii(card),
    }
    return {key: float(value) for key, value in values.items()}


def _refuse_what_others_lack(card: MmgCard, program: str) -> None:
    """Raise InputError if the ship has two propellers, an asymmetric hull (Y0, N0), rolls, or has other forms."""
    remedy = _OTHER_PROGRAMS
    if card.propeller.number != 1:
        raise card.fault("propeller.number", f"is 2, and {program} has one propeller", remedy)
    if card.roll is not None:
        raise card.fault("roll", f"is given, and the ships of {program} do not roll", remedy)
    for key, place in card.interaction_places().items():
        if key in ("tau", "eta", "C_Rv"):
            raise card.fault(place, f"is not a coefficient of {program}", remedy)
    for name in ("Y0", "N0", "Yrdot", "Nvdot"):
        if card.derivatives.get(name):
            raise card.fault(f"derivatives.{name}", f"is not a coefficient of {program}", "leave it out")


def _hull_in_prime_ii(card: MmgCard) -> dict[str, float]:
    """``k_0`` to ``k_2``, ``R_0_dash``, ``Y_v_dash`` and so on."""
    ratio = card.ship.length_m / card.ship.draught_m
    hull = {key: float(card.interaction(key)) for key in ("k_0", "k_1", "k_2")}
    hull["R_0_dash"] = -card.derivatives.get("X0", 0.0) * ratio
    for force, names in HULL_TERMS.items():
        for name in names:
            if not name.endswith("0"):
                hull[f"{force}_{name[1:]}_dash"] = card.derivatives.get(name, 0.0) * ratio
    return hull


def mmgdynamics_text(card: MmgCard) -> str:
    """A Python file with the dictionary ``vessel``, and ``u0``, ``nps``, of a card.

    Raises InputError: As :func:`mmgdynamics_values`.
    """
    entries = "".join(f'    "{key}": {_number_text(value)},\n' for key, value in mmgdynamics_values(card).items())
    about = (
        "SI, and Prime II where a name ends in _dash; rudder positive to starboard. C_1 and C_2 of the wake are left\n"
        "out: the wake is w_P0 exp(-4 beta_P^2), as in shipmmg.\n"
    )
    return f"{_head(card, 'a vessel of mmgdynamics', about)}{_approach(card)}\nvessel = {{\n{entries}}}\n"


def shipmmg_text(card: MmgCard) -> str:
    """A Python file that makes ``basic_params``, ``maneuvering_params``, ``u0``, ``nps``, ``rho`` of a card.

    Raises InputError: As :func:`shipmmg_values`.
    """
    basic, hull = (
        "".join(f"    {key}={_number_text(value)},\n" for key, value in values.items())
        for values in shipmmg_values(card)
    )
    about = (
        "SI; rudder positive to starboard. shipmmg has another wake than the card: w_P0 exp(-4 beta_P^2), no C_1\n"
        "and C_2. "
    )
    return (
        f"{_head(card, 'parameters for shipmmg', about)}"
        "from shipmmg.mmg_3dof import Mmg3DofBasicParams, Mmg3DofManeuveringParams\n\n"
        f"{_approach(card)}rho = {card.environment.water_density_kgpm3!r}  # kg/m3\n\n"
        f"basic_params = Mmg3DofBasicParams(\n{basic})\n\n"
        f"maneuvering_params = Mmg3DofManeuveringParams(\n{hull})\n"
    )


def _head(card: MmgCard, what: str, about: str) -> str:
    """The docstring of the file."""
    title = python_text(f"{card.ship.name}: {what}, written by tank2sim convert.")
    return f'"""{title}\n\n{about}Source of the coefficients: {python_text(card.ship.source)}\n"""\n\n'


def _approach(card: MmgCard) -> str:
    n = card.propulsion.nominal_radps / (2 * math.pi) if card.propulsion else 0.0
    return f"u0 = {card.model.speed_mps!r}  # m/s, the approach\nnps = {n!r}  # 1/s, revolutions of the approach\n"


def _number_text(value: float) -> str:
    return 'float("nan")' if math.isnan(value) else repr(value)
