"""Water and air whose motion changes with time and place, as a simulator hands it over from a chart or a solver."""

from __future__ import annotations

import math
from collections.abc import Callable

import casadi as ca
import numpy as np

from tank2sim.arguments import range_of
from tank2sim.cards.card import SteeredCard
from tank2sim.dynamics.effects.effect import Effect, EffectParameter, EffectSymbols, with_steps_for
from tank2sim.dynamics.effects.forces import with_forces
from tank2sim.dynamics.effects.froude_scale import first, speeds, time_scale_passages, wave_speeds
from tank2sim.dynamics.effects.particulars import with_particulars
from tank2sim.dynamics.effects.surroundings import STILL_MPS, WIND, bearing, relative_air
from tank2sim.dynamics.kinematics import earth_velocity
from tank2sim.dynamics.model import Model, Parameter, Quantity, State
from tank2sim.quantities import WindSpeed

STATIONS_IN_WIND = 4
"""Gauss-Legendre stations along the side: exact for a wind that does not change its side along the ship."""


def _horizontal(
    medium: str,
    prefix: str,
    direction: str,
    largest_mps: float,
    typical: Callable[[SteeredCard], tuple[float, ...]],
) -> tuple[EffectParameter, ...]:
    """Inputs of a horizontal velocity: speed and `direction`, and components that are added to it."""
    return (
        EffectParameter(
            "speed_mps",
            f"speed of the {medium} over the ground at the ship",
            0.0,
            largest_mps,
            input_name=f"{prefix}speed",
            absent=0.0,
            typical=typical,
        ),
        bearing(direction, f"{prefix}direction"),
        *(
            EffectParameter(
                f"{side}_mps",
                f"velocity of the {medium} to {side}, added to that by speed and direction",
                -largest_mps,
                largest_mps,
                0.0,
                input_name=f"{prefix}{side}",
                absent=0.0,
            )
            for side in ("north", "east")
        ),
    )


def _with_changing_current(model: Model, given: EffectSymbols, card: SteeredCard) -> Model:
    """Water that moves over the ground by w, which follows the input w_i in the time T in which the hull comes into it:

        dw/dt = (w_i - w)/T,   dx/dt, dy/dt gain w,
        X -= m a_x,   Y -= m a_y,   N -= m x_G a_y,   a = dw/dt in body axes

    so that the inertia of the ship's own mass is that of its motion over the ground, and that of the added mass of its
    motion through the water: M_RB da/dt + M_A da_r/dt = F(u_r), Fossen (2011), 8.3. In a steady current nothing but the
    kinematics is left. w is uniform over the hull, and its change does not heel the ship.
    """
    states: list[State] = []
    starts: list[Parameter] = []
    rates: list[Quantity] = []
    direction = given["direction"]
    by_direction = {"north": ca.cos(direction), "east": ca.sin(direction)}
    inputs = {variable.name: variable.start for variable in model.inputs}
    angle = inputs["current.direction"]
    started = {"north": math.cos(angle), "east": math.sin(angle)}
    for side in ("north", "east"):
        start = Parameter(
            f"initial.current_{side}",
            "m/s",
            f"Velocity to {side} at the start of the water in which the ship is",
            display_unit="knots",
            start=inputs["current.speed"] * started[side] + inputs[f"current.{side}"],
            tunable=False,
        )
        target = given["speed"] * by_direction[side] + given[side]
        state = State(
            f"current_field.{side}_reached",
            "m/s",
            f"Velocity to {side} of the water in which the ship is",
            display_unit="knots",
            derivative=f"current_field.{side}_rate",
            start=start.symbol,
            trim=target,
        )
        rate = Quantity(
            f"current_field.{side}_rate",
            "m/s2",
            f"Acceleration to {side} of the water in which the ship is",
            (target - state.symbol) / given["entry_time"],
        )
        states, starts, rates = [*states, state], [*starts, start], [*rates, rate]
    carried = model.extend(*states, *starts, *rates)
    for state, name in zip(states, ("motion.xdot", "motion.ydot"), strict=True):
        carried = carried.redefine(name, lambda velocity, state=state: velocity + state.symbol)  # type: ignore[misc]
    forward, starboard = earth_velocity(rates[0].symbol, rates[1].symbol, -model.symbol("motion.psi"))
    mass = model.symbol("ship.mass")
    pulled = with_forces(
        carried, X=-mass * forward, Y=-mass * starboard, N=-mass * model.symbol("ship.x_G") * starboard
    )
    return with_steps_for(pulled, "current_field.entry_time")


CURRENT_FIELD = Effect(
    name="current_field",
    acts_on="force",
    description="Water whose motion changes with time and place carries the ship, and takes its time to speed it up.",
    source="Fossen (2011), Handbook of Marine Craft Hydrodynamics and Motion Control, 8.3",
    parameters=(
        *_horizontal("water", "current.", "towards which the current sets", 5.0, speeds(0.05)),
        EffectParameter(
            "entry_time_s",
            "time in which the hull comes into the water of the input, by default L/u0",
            0.1,
            600.0,
            first(time_scale_passages(1.0)),
        ),
    ),
    equations=_with_changing_current,
    sought=False,
    terminal="Current of the water over the ground",
)


def _with_wind_along_the_side(model: Model, given: EffectSymbols, card: SteeredCard) -> Model:
    """Wind force with the side area A_L along the ship: a share s at the superstructure's x_s, the rest evenly.

        Y = 1/2 rho_air c_Y A_L sum over x of a(x) V(x) v(x),   N = sum of x Y(x) + 1/2 rho_air c_N A_L L * 2 u v
        v(x) = v_air - x r,   V(x) = sqrt(u_air^2 + v(x)^2)

    of the air's velocity relative to the ship, forward u_air and to starboard v_air. A stopped ship that drifts turns
    the end without superstructure into the wind, and the air damps its swing.
    """
    density = card.environment.air_density_kgpm3
    model, (front, side) = with_particulars(model, card, "projected_area_front_m2", "projected_area_side_m2")
    half, rate, share = model.symbol("ship.length") / 2, model.symbol("motion.r"), given["superstructure_share"]
    nodes, weights = np.polynomial.legendre.leggauss(STATIONS_IN_WIND)
    places = [
        (half * float(node), (1 - share) * float(weight) / 2) for node, weight in zip(nodes, weights, strict=True)
    ]
    places.append((given["superstructure_forward"], share))

    def force(north: ca.SX, east: ca.SX) -> ca.SX:
        forward, starboard = relative_air(model, north, east)
        speed = ca.sqrt(forward**2 + starboard**2 + STILL_MPS**2)
        Y = N = ca.SX(0)
        for x, part in places:
            across = starboard - x * rate
            local = 0.5 * density * side * given["sway_coefficient"] * part * across
            local *= ca.sqrt(forward**2 + across**2 + STILL_MPS**2)
            Y, N = Y + local, N + x * local
        turning = -density * side * model.symbol("ship.length") * given["yaw_coefficient"] * forward * starboard
        X = 0.5 * density * front * given["surge_coefficient"] * speed * forward
        return ca.vertcat(X, Y, N + turning)

    speed, direction = given["speed"], given["direction"]
    felt = force(given["north"] - speed * ca.cos(direction), given["east"] - speed * ca.sin(direction))
    X, Y, N = ca.vertsplit(felt - (1 - given["still_air"]) * force(ca.SX(0), ca.SX(0)))
    return with_forces(model, X=X, Y=Y, N=N)


WIND_FIELD = Effect(
    name="wind_field",
    acts_on="force",
    description="Wind that changes pushes a ship whose side area is not the same all along.",
    source="Fossen (2011), 8.1, with the side area along the ship",
    parameters=(
        *_horizontal("air", "wind.", "from which the wind comes", range_of(WindSpeed)[1], wave_speeds(0.25)),
        *(
            parameter
            for parameter in WIND.parameters
            if parameter.name in ("surge_coefficient", "sway_coefficient", "yaw_coefficient", "still_air")
        ),
        EffectParameter("superstructure_share", "share of the side area in the superstructure", 0.0, 1.0, 0.0),
        EffectParameter(
            "superstructure_forward_m", "middle of the superstructure forward of midships", -200.0, 200.0, 0.0
        ),
    ),
    equations=_with_wind_along_the_side,
    sought=False,
    terminal="True wind",
)
