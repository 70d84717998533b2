"""Effects of the ship's surroundings: current, wind, waves, a bank."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import casadi as ca

from tank2sim.arguments import range_of
from tank2sim.cards.card import SteeredCard
from tank2sim.dynamics.effects.effect import Effect, EffectParameter, EffectSymbols, side_force
from tank2sim.dynamics.effects.forces import scales, with_forces, with_side_force
from tank2sim.dynamics.effects.froude_scale import DIRECTION_SIGNS, lengths, speeds, wave_speeds
from tank2sim.dynamics.effects.particulars import AREA_ERROR, with_particulars
from tank2sim.dynamics.kinematics import earth_velocity
from tank2sim.dynamics.model import Model
from tank2sim.quantities import WindSpeed

STILL_MPS = 1e-6
"""Added to the square of a relative speed, so that its root has a slope at rest; far below any speed of air."""

_WEATHER = {
    *("current.speed", "current.north", "current.east", "initial.current_north", "initial.current_east"),
    *("wind.speed", "wind.north", "wind.east", "waves.height", "wave_drift.height"),
}
"""Inputs and parameters that are zero in calm water."""


def bearing(words: str, input_name: str | None = None) -> EffectParameter:
    """Parameter ``direction_rad``: the direction that the `words` say, of the input `input_name` if it is one."""
    description, turn = f"direction {words}, clockwise from north", 2 * math.pi
    return EffectParameter("direction_rad", description, -turn, turn, input_name=input_name, typical=DIRECTION_SIGNS)


def in_calm(model: Model) -> Model:
    """The ship of a model without wind, waves and current, unless its inputs are set to others."""
    still = model.with_values({name: 0.0 for name in _WEATHER if name in model.parameter_names})
    inputs = (replace(one, start=0.0) if one.name in _WEATHER else one for one in still.inputs)
    return replace(still, inputs=tuple(inputs))


def _with_current(model: Model, given: EffectSymbols, card: SteeredCard) -> Model:
    """Water that moves uniformly over the ground: dx/dt and dy/dt gain its velocity.

    u and v are through the water; a uniform steady current is only another inertial frame, so that no force changes.
    """
    speed, direction = given["speed"], given["direction"]
    return model.redefine("motion.xdot", lambda north: north + speed * ca.cos(direction)).redefine(
        "motion.ydot", lambda east: east + speed * ca.sin(direction)
    )


CURRENT = Effect(
    name="current",
    acts_on="kinematics",
    description="The water moves over the ground and carries the ship with it.",
    source="kinematics of a moving frame; formats of the ship card",
    parameters=(
        EffectParameter(
            "speed_mps",
            "speed of the current over the ground",
            0.0,
            5.0,
            input_name="current.speed",
            absent=0.0,
            typical=speeds(0.05),  # 0.4 m/s at 15 knots (project choice)
        ),
        bearing("towards which the current sets", "current.direction"),
    ),
    equations=_with_current,
    of_craft=True,
    measured_as={"speed_mps": "current_speed_mps", "direction_rad": "current_direction_rad"},
    terminal="Current of the water over the ground",
)


def air_over_ship(model: Model, speed: ca.SX, direction: ca.SX) -> tuple[ca.SX, ca.SX]:
    """Velocity of the air relative to the ship, forward and to starboard in body axes (m/s).

    Parameters
    ----------
    model : Model
        Model of the ship; its velocity over the ground holds a current if the model has one.
    speed, direction : casadi.SX
        True wind (m/s) and the direction from which it comes (rad, clockwise from north).
    """
    return relative_air(model, -speed * ca.cos(direction), -speed * ca.sin(direction))


def relative_air(model: Model, north: ca.SX, east: ca.SX) -> tuple[ca.SX, ca.SX]:
    """As :func:`air_over_ship`, from the velocity of the air over the ground to north and to east (m/s)."""
    north, east = north - model.symbol("motion.xdot"), east - model.symbol("motion.ydot")
    return earth_velocity(north, east, -model.symbol("motion.psi"))


def _with_wind(model: Model, given: EffectSymbols, card: SteeredCard) -> Model:
    """Wind force on hull and superstructure, with V_R and gamma_R (from, clockwise from the bow) of the relative wind:

        X = -1/2 rho_air V_R^2 c_X A_F cos(gamma_R)
        Y = -1/2 rho_air V_R^2 c_Y A_L sin(gamma_R)
        N = -1/2 rho_air V_R^2 c_N A_L L sin(2 gamma_R) + x_A Y

    Fossen (2011), Handbook of Marine Craft Hydrodynamics and Motion Control, 8.1: c_X 0.5 to 0.9, c_Y 0.7 to 0.95,
    c_N 0.05 to 0.2 for ships with symmetric superstructures; the defaults are in the middle of the first two, and for
    c_N that of Blendermann (1994), J. Wind Eng. Ind. Aerodyn. 51, whose arm 0.18 (pi/2 - gamma) L gives
    0.10 at 45 deg. x_A is the centroid of the side area; L between perpendiculars is used for the length over all.
    The whole relative wind acts, so that a ship meets still air too. Where the card's X holds that resistance already
    it would count twice: a share 1 - a of the force in still air is taken off, a the parameter ``still_air``.
    """
    density = card.environment.air_density_kgpm3
    model, (front, side) = with_particulars(model, card, "projected_area_front_m2", "projected_area_side_m2")

    def force(forward: ca.SX, starboard: ca.SX) -> ca.SX:
        speed = ca.sqrt(forward**2 + starboard**2 + STILL_MPS**2)
        X = 0.5 * density * front * given["surge_coefficient"] * speed * forward
        Y = 0.5 * density * side * given["sway_coefficient"] * speed * starboard
        # sin(2 gamma) = 2 sin cos, forward = -V cos, starboard = -V sin
        turning = -density * side * model.symbol("ship.length") * given["yaw_coefficient"] * forward * starboard
        return ca.SX(ca.vertcat(X, Y, turning + given["centroid_forward"] * Y))

    felt = force(*air_over_ship(model, given["speed"], given["direction"]))
    in_still_air = force(*air_over_ship(model, ca.SX(0), ca.SX(0)))
    X, Y, N = ca.vertsplit(felt - (1 - given["still_air"]) * in_still_air)
    return with_forces(model, X=X, Y=Y, N=N)


def _coefficient_error(error: float, value: float, area: str) -> Callable[[SteeredCard], float]:
    """Standard error of a wind coefficient, wider where the area is estimated, for only their product acts."""
    return lambda card: error if getattr(card.ship, area) else math.hypot(error, AREA_ERROR * value)


WIND = Effect(
    name="wind",
    acts_on="force",
    description="Wind pushes and turns the part of the ship above the water.",
    source="Fossen (2011), Handbook of Marine Craft Hydrodynamics and Motion Control, 8.1; Blendermann (1994)",
    parameters=(
        EffectParameter(
            "speed_mps",
            "true speed of the wind",
            *range_of(WindSpeed),
            input_name="wind.speed",
            absent=0.0,
            typical=wave_speeds(0.25),  # 10 m/s, a fresh breeze (Beaufort 5), for a ship of 160 m (project choice)
        ),
        bearing("from which the wind comes", "wind.direction"),
        # Spreads: half the ranges of Fossen (2011) above; the centroid's spread is a project choice.
        EffectParameter(
            "surge_coefficient",
            "wind force coefficient in surge, on the frontal area",
            0.0,
            2.0,
            0.7,
            spread=_coefficient_error(0.15, 0.7, "projected_area_front_m2"),
        ),
        EffectParameter(
            "sway_coefficient",
            "wind force coefficient in sway, on the side area",
            0.0,
            2.0,
            0.8,
            spread=_coefficient_error(0.15, 0.8, "projected_area_side_m2"),
        ),
        EffectParameter(
            "yaw_coefficient",
            "wind moment coefficient, on the side area and length",
            -0.5,
            0.5,
            0.1,
            spread=_coefficient_error(0.05, 0.1, "projected_area_side_m2"),
        ),
        EffectParameter(
            "centroid_forward_m",
            "centroid of the side area forward of midships",
            -200.0,
            200.0,
            0.0,
            spread=lambda card: 0.03 * card.ship.length_m,
        ),
        EffectParameter(
            "still_air",
            "share of the resistance of still air that the card's own forces lack (0: they hold it)",
            0.0,
            1.0,
            1.0,
            absent=0.0,
            spread=0.5,  # cards seldom say which it is (project choice)
        ),
    ),
    equations=_with_wind,
    of_craft=True,
    measured_as={"speed_mps": "wind_speed_mps", "direction_rad": "wind_direction_rad"},
    terminal="True wind",
)


def _with_wave_drift(model: Model, given: EffectSymbols, card: SteeredCard) -> Model:
    """Mean second-order force of short irregular waves that the side and a round bow reflect:

        X = -rho g Hs^2/16 B c_X |cos(chi)| cos(chi)
        Y = -rho g Hs^2/16 L c_Y |sin(chi)| sin(chi)
        N = -rho g Hs^2/16 L^2 c_N sin(2 chi)

    chi is the direction from which the waves come, clockwise from the bow; rho g Hs^2/16 is the mean of
    1/2 rho g zeta^2 over the spectrum. Faltinsen (1990), Sea Loads on Ships and Offshore Structures, chapter 5:
    c_Y = 1 for a vertical side, c_X = 2/3 for a semicircular bow; c_N = 0 for a hull alike fore and aft.
    """
    model, (beam,) = with_particulars(model, card, "beam_m")
    chi = given["direction"] - model.symbol("motion.psi")
    length = model.symbol("ship.length")
    pressure = model.symbol("ship.water_density") * card.environment.gravity_mps2 * given["height"] ** 2 / 16
    along, across = ca.cos(chi), ca.sin(chi)
    return with_forces(
        model,
        X=-pressure * beam * given["surge_coefficient"] * ca.fabs(along) * along,
        Y=-pressure * length * given["sway_coefficient"] * ca.fabs(across) * across,
        N=-pressure * length**2 * given["yaw_coefficient"] * ca.sin(2 * chi),
    )


WAVE_DRIFT = Effect(
    name="wave_drift",
    acts_on="force",
    description="Waves that the hull throws back push it slowly along with them.",
    source="Faltinsen (1990), Sea Loads on Ships and Offshore Structures, chapter 5 (short waves)",
    parameters=(
        EffectParameter(
            "height_m",
            "significant wave height",
            0.0,
            20.0,
            absent=0.0,
            typical=lengths(0.0125),  # 2 m, sea state 4, for a ship of 160 m (project choice)
        ),
        bearing("from which the waves come"),
        # Spreads: waves that are not short are reflected in part, and hulls differ (project choice).
        EffectParameter(
            "surge_coefficient", "wave drift coefficient in surge, on the beam", 0.0, 3.0, 2 / 3, spread=0.3
        ),
        EffectParameter("sway_coefficient", "wave drift coefficient in sway, on the length", 0.0, 3.0, 1.0, spread=0.3),
        EffectParameter(
            "yaw_coefficient", "wave drift moment coefficient, on the length squared", -1.0, 1.0, 0.0, spread=0.05
        ),
    ),
    equations=_with_wave_drift,
    of_craft=True,
)


def _with_bank_suction(model: Model, given: EffectSymbols, card: SteeredCard) -> Model:
    """Y, N = 1/2 rho L^2 u^2 Y', 1/2 rho L^3 u^2 N': a ship that runs along a bank or wall at one distance.

    Norrbin (1974), Bank effects on a ship moving through a short dredged channel: force and moment are proportional to
    the square of the speed. A bank to starboard draws the ship (Y' > 0) and turns its bow away (N' < 0).
    """
    return with_side_force(model, given, scales(model, model.symbol("motion.u")).force)


BANK_SUCTION = Effect(
    name="bank_suction",
    acts_on="force",
    description="A bank or wall alongside draws the ship to it and turns its bow away.",
    source="Norrbin (1974), 10th Symposium on Naval Hydrodynamics, 71-88",
    # A tenth of the Mariner's force and moment at 10 deg of rudder: a bank that is felt (project choice).
    parameters=side_force("by a bank, prime", 5e-5, -2.5e-5),
    equations=_with_bank_suction,
)
