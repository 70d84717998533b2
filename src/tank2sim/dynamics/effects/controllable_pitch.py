"""A propeller whose pitch is ordered: its thrust by the Wageningen B-series."""

from __future__ import annotations

import csv
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import casadi as ca

from tank2sim.cards.card import MmgCard, SteeredCard
from tank2sim.dynamics.effects.effect import Effect, EffectParameter, EffectSymbols, refuse_given, with_steps_for
from tank2sim.dynamics.effects.forces import scales, with_forces, with_validity
from tank2sim.dynamics.hull import inside_range
from tank2sim.dynamics.model import Model, Parameter, Quantity, State

# Oosterveld and van Oossanen (1975), Further computer-analyzed data of the Wageningen B-screw series, International
# Shipbuilding Progress 22, 251-262; the numbers are alike in three public transcriptions, one of them of Bernitsas, Ray
# and Kinley (1981), K_T, K_Q and efficiency curves for the Wageningen B-series propellers. The paper was not at hand.
_ROWS = list(csv.DictReader(Path(__file__).with_name("b_series.csv").read_text(encoding="ascii").splitlines()))
B_SERIES, B_SERIES_TORQUE = (
    [(float(row["C"]), *(int(row[power]) for power in "stuv")) for row in _ROWS if row["of"] == curve]
    for curve in ("thrust", "torque")
)
"""C, s, t, u, v of K_T = sum of C J^s (P/D)^t (A_E/A_0)^u Z^v, at a Reynolds number of 2e6, and the same of K_Q; alike
in public transcriptions except for the 40th number of K_Q, which is that of most of them."""

LEAST_PITCH, LARGEST_PITCH, LARGEST_J = 0.5, 1.4, 1.6
"""P/D of the series, and the J beyond which no curve of it goes."""

PLATE_DRAG = 1.17
"""Drag coefficient of a plate across the stream (Hoerner 1965, Fluid-Dynamic Drag): of blades at zero pitch."""

ASTERN_OF_CAMBER = 0.7
"""Thrust at rest with a negative pitch over that with the same ahead: blades are then cambered and twisted the wrong
way. Project choice, a little below that of a reversed propeller (:data:`tank2sim.cards.form.ASTERN_THRUST`)."""

SECTION_DRAG = 0.01
"""Drag coefficient of a blade's section along the stream, both sides and form: of blades that turn at zero pitch.
Project choice, in the middle of 0.008 to 0.012 of thin sections."""

ADVANCE_SHARE = 0.7
"""J of the design over P/D where a card states no propeller: a slip of 30 %. Project choice."""

_STOPPED = 0.02  # revolutions over the nominal ones below which J is held: the thrust goes with their square


def b_series_thrust(J: Any, pitch: Any, area: Any, blades: Any) -> Any:
    """Return K_T of a propeller of the Wageningen B-series.

    Parameters
    ----------
    J, pitch : float or symbol
        Advance ratio, and P/D of 0.5 to 1.4.
    area, blades : float or symbol
        A_E/A_0 of 0.30 to 1.05, and Z of 2 to 7.
    """
    return _of_series(B_SERIES, J, pitch, area, blades)


def b_series_torque(J: Any, pitch: Any, area: Any, blades: Any) -> Any:
    """Return K_Q of a propeller of the Wageningen B-series.

    Parameters
    ----------
    J, pitch, area, blades : float or symbol
        As in :func:`b_series_thrust`.
    """
    return _of_series(B_SERIES_TORQUE, J, pitch, area, blades)


def _of_series(table: Sequence[tuple[float, ...]], J: Any, pitch: Any, area: Any, blades: Any) -> Any:
    total: Any = 0.0
    for coefficient, s, t, u, v in table:
        total = total + coefficient * J**s * pitch**t * area**u * blades**v
    return total


def pitch_thrust(J: ca.SX, pitch: ca.SX, area: ca.SX, blades: ca.SX, astern: ca.SX) -> ca.SX:
    """K_T at any P/D, which beyond that of the series goes linearly to blades at zero pitch, and is mirrored below it.

    K_T(J, P/D) = K_0 + (P/D)/0.5 (K_T(J, 0.5) - K_0) from 0 to 0.5,   K_0 = -C_D pi/8 A_E/A_0 J^2
    K_T(J, -P/D) = K_0 - a K_T(0, P/D)

    `area` is A_E/A_0, `blades` Z, `astern` a.
    """
    plate = -PLATE_DRAG * math.pi / 8 * area * J**2

    def ahead(J: ca.SX, wanted: ca.SX, flat: ca.SX) -> ca.SX:
        inside = b_series_thrust(J, ca.fmin(ca.fmax(wanted, LEAST_PITCH), LARGEST_PITCH), area, blades)
        return ca.SX(flat + ca.fmin(wanted / LEAST_PITCH, 1) * (inside - flat))

    none = ca.SX(0)
    total: ca.SX = ahead(J, ca.fmax(pitch, 0), plate) - astern * ahead(none, ca.fmax(-pitch, 0), none)
    return total


def pitch_torque(J: ca.SX, pitch: ca.SX, area: ca.SX, blades: ca.SX) -> ca.SX:
    """K_Q at any P/D, positive with either sign: linear below the pitches of the series, astern the value at rest.

    K_Q(J, P/D) = K_0 + (P/D)/0.5 (K_Q(J, 0.5) - K_0) from 0 to 0.5,   K_Q(J, -P/D) = K_Q(0, P/D)
    K_0 = 1/2 C_D pi/4 A_E/A_0 (0.7 pi)^2 0.35

    K_0 is the drag of the blades at 0.7 of the radius with :data:`SECTION_DRAG`. `J` is the advance ratio, `pitch` is
    P/D, `area` A_E/A_0, `blades` Z.
    """
    idle = SECTION_DRAG / 2 * math.pi / 4 * area * (0.7 * math.pi) ** 2 * 0.35
    size = ca.fabs(pitch)
    met = ca.if_else(pitch > 0, J, 0)
    inside = b_series_torque(met, ca.fmin(ca.fmax(size, LEAST_PITCH), LARGEST_PITCH), area, blades)
    return ca.SX(idle + ca.fmin(size / LEAST_PITCH, 1) * (inside - idle))


def _with_pitch(model: Model, given: EffectSymbols, card: SteeredCard) -> Model:
    """The pitch follows its order, and the thrust changes as in the series; the revolutions are as ordered:

        d(P/D)/dt = sat((order - P/D)/T),   T = T_card + rho n^2 D^4 (K_T(J, P/D) - K_T(J, P_0/D))

    for n > 0, J = u_P/(n D), the rate no larger than 2 P_0/D in the time of reversal. P_0 is the pitch at which the
    card's own thrust is. On an MMG card T enters the race on the rudder too. A polynomial states neither D nor wake:
    there X gains (n/n_0)^2 of the card's thrust times (K_T(J, P/D) - K_T(J, P_0/D))/K_T(J_0, P_0/D), with
    J = J_0 (u/u_0)/(n/n_0). The torque of a card with K_Q gains rho n^2 D^5 (K_Q(J, P/D) - K_Q(J, P_0/D))/eta_R; where
    a card states D and no K_Q, it is rho n^2 D^5 K_Q(J, P/D), for n > 0.
    """
    if "propeller.speed_actual" not in model:
        raise card.fault("propulsion", "is missing", "controllable_pitch needs the revolutions of the propeller")
    start = Parameter(
        "initial.propeller_pitch",
        "1",
        "Pitch of the propeller over its diameter at the start",
        minimum=-LARGEST_PITCH,
        maximum=LARGEST_PITCH,
        start=next(one.start for one in model.inputs if one.name == "propeller.pitch"),
        tunable=False,
    )
    pitch = State(
        "propeller.pitch_actual",
        "1",
        "Pitch of the propeller over its diameter, negative: pushes astern",
        derivative="propeller.pitch_rate",
        start=start.symbol,
        trim=given["pitch"],
    )
    limit = 2 * given["design_pitch"] / given["reversal"]
    rate = Quantity(
        pitch.derivative,
        "1/s",
        "Rate of the pitch over the diameter",
        ca.fmax(-limit, ca.fmin(limit, (given["pitch"] - pitch.symbol) / given["time_constant"])),
        nominal=0.1,
    )
    inside = inside_range(LEAST_PITCH - pitch.symbol, LEAST_PITCH)
    model = model.extend(start, pitch, rate, outputs=[pitch.name])
    model = with_validity(model, "pitch", "the pitch of the propeller, below that of the series", inside)
    model = with_steps_for(model, "controllable_pitch.time_constant")

    blades = given["area_ratio"], given["blades"]

    def coefficients(J: ca.SX) -> Coefficients:
        held = ca.fmin(ca.fmax(J, 0), LARGEST_J)
        both = pitch.symbol, given["design_pitch"]
        thrusts = [pitch_thrust(held, one, *blades, given["astern"]) for one in both]
        return Coefficients(*thrusts, *(pitch_torque(held, one, *blades) for one in both))

    if isinstance(card, MmgCard):
        refuse_given(card, CONTROLLABLE_PITCH.name, "advance_share", "leave it out: the card's own J holds")
        return _on_each_side(model, coefficients)
    turning = model.symbol("propeller.speed_actual") / model.symbol("propulsion.nominal_speed")
    designed = given["advance_share"] * given["design_pitch"]
    found = coefficients(designed * model.symbol("motion.u") / model.symbol("ship.speed") / ca.fmax(turning, _STOPPED))
    nominal = scales(model, model.symbol("ship.speed")).force * model.symbol("propulsion.Xnn")
    thrust = nominal * ca.fmax(turning, 0) ** 2 * (found.thrust - found.own_thrust) / coefficients(designed).own_thrust
    model = with_forces(model, X=thrust)
    if card.ship.propeller_diameter_m is None:
        return model
    scale = model.symbol("ship.water_density") * model.symbol("ship.propeller_diameter") ** 5
    n = ca.fmax(model.symbol("propeller.speed_actual"), 0) / (2 * math.pi)
    return _with_torques(model, {"": scale * n**2 * found.torque})


@dataclass(frozen=True)
class Coefficients:
    """K_T and K_Q at the pitch, and the own ones of the card, at the pitch of the design."""

    thrust: ca.SX
    own_thrust: ca.SX
    torque: ca.SX
    own_torque: ca.SX


def _on_each_side(model: Model, coefficients: Callable[[ca.SX], Coefficients]) -> Model:
    """The model with thrust and torque of each propeller of an MMG ship changed by its `coefficients` at J."""
    diameter, density = model.symbol("ship.propeller_diameter"), model.symbol("ship.water_density")
    least = _STOPPED * model.symbol("propulsion.nominal_speed") / (2 * math.pi)
    has_torque = "propeller.power" in model
    torques = {}
    for name in [quantity.name for quantity in model.quantities if quantity.name.startswith("propeller.thrust")]:
        suffix = name.removeprefix("propeller.thrust")
        n = model.symbol(f"propeller.speed_actual{suffix}") / (2 * math.pi)
        found = coefficients(model.symbol(f"propeller.inflow{suffix}") / (ca.fmax(n, least) * diameter))
        unit = density * ca.fmax(n, 0) ** 2 * diameter**4
        more = unit * (found.thrust - found.own_thrust)
        model = model.redefine(name, lambda thrust, more=more: thrust + more)  # type: ignore[misc]
        if has_torque:
            more = unit * diameter * (found.torque - found.own_torque) / model.symbol("mmg.eta_R")
            model = model.redefine(f"propeller.torque{suffix}", lambda torque, more=more: torque + more)  # type: ignore[misc]
        else:
            torques[suffix] = unit * diameter * found.torque
    unused = "controllable_pitch.advance_share"
    model = replace(model, parameters=tuple(one for one in model.parameters if one.name != unused))
    return model if has_torque else _with_torques(model, torques)


def _with_torques(model: Model, torques: Mapping[str, ca.SX]) -> Model:
    """The model with outputs ``propeller.torque`` (N m), by the suffix of each propeller, and ``propeller.power``."""
    each = [
        Quantity(
            f"propeller.torque{suffix}",
            "N.m",
            "Torque that turns the propeller, by the Wageningen B-series",
            torque,
            nominal=1e5,
        )
        for suffix, torque in torques.items()
    ]
    power = sum(
        (
            torque.symbol * model.symbol(f"propeller.speed_actual{suffix}")
            for suffix, torque in zip(torques, each, strict=True)
        ),
        ca.SX(0),
    )
    delivered = Quantity("propeller.power", "W", "Power delivered to the propellers", power, nominal=1e6)
    return model.extend(*each, delivered, outputs=[*(torque.name for torque in each), delivered.name])


def _pitch(name: str, description: str, lowest: float, **more: Any) -> EffectParameter:
    return EffectParameter(name, description, lowest, LARGEST_PITCH, **more)


CONTROLLABLE_PITCH = Effect(
    name="controllable_pitch",
    acts_on="propulsion",
    description="The pitch of the propeller is ordered, and reverses its thrust while it turns as before.",
    source="Oosterveld and van Oossanen (1975), Wageningen B-series",
    parameters=(
        _pitch(
            "pitch",
            "ordered pitch over the diameter, negative: astern",
            -LARGEST_PITCH,
            input_name="propeller.pitch",
            typical=(0.6,),
        ),
        _pitch("design_pitch", "pitch over the diameter at which the card's thrust is", LEAST_PITCH, typical=(0.8,)),
        EffectParameter("blades", "number of blades", 2.0, 7.0, 4.0),
        EffectParameter("area_ratio", "expanded area of the blades over the disc", 0.3, 1.05, 0.55),
        EffectParameter(
            "astern", "thrust at rest with a negative pitch over that with the same ahead", 0.0, 1.0, ASTERN_OF_CAMBER
        ),
        EffectParameter(
            "reversal_s",
            "least time in which the pitch goes from design_pitch to as much astern, by default 0.7 L/u0",
            0.1,
            600.0,
            # 15 s where L/u0 is 20 s (project choice)
            lambda card: 0.7 * card.ship.length_m / card.model.speed_mps,
        ),
        EffectParameter(
            "time_constant_s",
            "time constant of the pitch, by default a twentieth of L/u0",
            0.01,
            60.0,
            lambda card: 0.05 * card.ship.length_m / card.model.speed_mps,
        ),
        EffectParameter(
            "advance_share",
            "J at u0 and nominal revolutions over design_pitch (of an MMG card its own)",
            0.3,
            0.9,
            ADVANCE_SHARE,
        ),
    ),
    equations=_with_pitch,
    sought=False,
    states_behind={"propeller.pitch_actual": "propeller.pitch"},
    terminal="Propulsion: ordered and actual revolutions and pitch",
)
