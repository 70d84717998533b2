"""Thrusters that turn about a vertical axis and push any way."""

from __future__ import annotations

import math

import casadi as ca

from tank2sim.cards.card import SteeredCard
from tank2sim.dynamics.effects.controllable_pitch import ADVANCE_SHARE
from tank2sim.dynamics.effects.effect import Effect, EffectParameter, EffectSymbols, with_steps_for
from tank2sim.dynamics.effects.forces import with_forces
from tank2sim.dynamics.effects.froude_scale import first, lengths, rates, time_scale_passages
from tank2sim.dynamics.effects.harbour import largest_force
from tank2sim.dynamics.effects.particulars import model_particular
from tank2sim.dynamics.model import Input, Model, Quantity, State

UNITS_OF_SHIP = 2
"""Azimuths of the effect: one to each side of the stern, as most ships that are driven by them have. Project choice."""

AZIMUTH_PLACE, AZIMUTH_SIDE = -0.46, 0.25
"""Place forward of midships over L, and from the centre line over the beam, where a card gives none: project choice."""


def _with_azimuths(model: Model, given: EffectSymbols, card: SteeredCard) -> Model:
    """X, Y = sum of T_i (cos a_i, sin a_i), N = sum of x_i Y_i - y_i X_i; with s = n_i/n_0:

        T_i = F s (s - u_i/u_z) for s > 0, else -f F s^2;   u_i = (u - y_i r) cos a_i + (v + x_i r) sin a_i
        dn_i/dt = (order - n_i)/T_n,   da_i/dt = sat((order - a_i)/T_a)

    K_T linear in J, zero where the water meets the unit at u_z at nominal revolutions; the turn at the largest rate of
    the card. Fossen (2021), Handbook of Marine Craft Hydrodynamics and Motion Control, 9.1 and 9.4. The angle goes to
    its order the way that it is ordered, round and round. What hull and units take from each other is left out.
    """
    X = Y = N = ca.SX(0)
    u, v, r = (model.symbol(f"motion.{name}") for name in "uvr")
    nominal, limit = given["nominal"], given["max_rate"]
    for unit in range(1, UNITS_OF_SHIP + 1):
        turning, angle = (
            State(
                f"azimuth.{name}_actual_{unit}",
                order.unit,
                f"{description} of azimuth {unit}",
                display_unit=order.display_unit,
                nominal=scale,
                derivative=f"azimuth.{name}_rate_{unit}",
                start=order.start,
                trim=given[f"{name}_{unit}"],
            )
            for name, description, scale in (
                ("revolutions", "Revolutions", 10.0),
                ("angle", "Direction of the force, clockwise from the bow,", 1.0),
            )
            if isinstance(order := model[f"azimuth.{name}_{unit}"], Input)
        )
        share = turning.symbol / nominal
        forward, starboard = given[f"forward_{unit}"], given[f"starboard_{unit}"]
        along, across = ca.cos(angle.symbol), ca.sin(angle.symbol)
        met = (u - starboard * r) * along + (v + forward * r) * across
        ahead, astern = ca.fmax(share, 0), ca.fmin(share, 0)
        value = given["force"] * (ahead * (ahead - met / given["no_thrust"]) - given["astern"] * astern**2)
        thrust = Quantity(
            f"azimuth.thrust_{unit}", "N", f"Thrust of azimuth {unit} in its direction", value, nominal=1e5
        )
        wanted = (given[f"angle_{unit}"] - angle.symbol) / given["angle_time_constant"]
        rates = (
            Quantity(
                turning.derivative,
                "rad/s2",
                f"Rate of the revolutions of azimuth {unit}",
                (given[f"revolutions_{unit}"] - turning.symbol) / given["time_constant"],
            ),
            Quantity(
                angle.derivative,
                "rad/s",
                f"Rate at which azimuth {unit} turns, clockwise",
                ca.fmax(-limit, ca.fmin(limit, wanted)),
                display_unit="deg/s",
            ),
        )
        model = model.extend(turning, angle, thrust, *rates, outputs=[turning.name, angle.name, thrust.name])
        push, side = thrust.symbol * along, thrust.symbol * across
        X, Y, N = X + push, Y + side, N + forward * side - starboard * push
    for name in ("time_constant", "angle_time_constant"):
        model = with_steps_for(model, f"azimuths.{name}")
    return with_forces(model, X=X, Y=Y, N=N)


def _unit(unit: int) -> tuple[EffectParameter, ...]:
    default, side = (None, "starboard") if unit == 1 else (0.0, "port")

    def off_the_centre_line(card: SteeredCard) -> float:
        return (AZIMUTH_SIDE if unit == 1 else -AZIMUTH_SIDE) * model_particular(card, "beam_m")

    return (
        EffectParameter(
            f"revolutions_{unit}_radps",
            f"revolutions of azimuth {unit}, on the {side} side, positive pushes in its direction",
            -400.0,
            400.0,
            default,
            input_name=f"azimuth.revolutions_{unit}",
            absent=0.0,
            typical=rates(200.0),  # as of a merchant ship (project choice)
        ),
        EffectParameter(
            f"angle_{unit}_rad",
            f"direction of the force of azimuth {unit}, clockwise from the bow",
            -2 * math.pi,
            2 * math.pi,
            default,
            input_name=f"azimuth.angle_{unit}",
            typical=(math.pi / 4,),
        ),
        EffectParameter(
            f"forward_{unit}_m",
            f"place of azimuth {unit} forward of midships",
            -250.0,
            250.0,
            first(lengths(AZIMUTH_PLACE)),
        ),
        EffectParameter(
            f"starboard_{unit}_m", f"place of azimuth {unit} to starboard", -50.0, 50.0, off_the_centre_line
        ),
    )


AZIMUTHS = Effect(
    name="azimuths",
    acts_on="force",
    description="Thrusters that turn about a vertical axis push the ship any way.",
    source="Fossen (2021), Handbook of Marine Craft Hydrodynamics and Motion Control, 9.1 and 9.4",
    parameters=(
        *(parameter for unit in range(1, UNITS_OF_SHIP + 1) for parameter in _unit(unit)),
        EffectParameter(
            "force_N",
            "thrust of each unit at rest and nominal revolutions",
            0.0,
            1e7,
            typical=lambda card: (4 * largest_force(card),),  # four tunnel thrusters (project choice)
        ),
        EffectParameter("nominal_radps", "nominal revolutions of each unit", 0.1, 400.0, typical=rates(300.0)),
        EffectParameter(
            "no_thrust_mps",
            "speed of the water along the unit at which it has no thrust at nominal revolutions",
            0.1,
            60.0,
            # as of a propeller with a slip of 30 % at u0
            lambda card: card.model.speed_mps / ADVANCE_SHARE,
        ),
        EffectParameter("astern", "thrust at reversed revolutions over that ahead, at rest", 0.0, 1.0, 0.6),
        # 5 s, 1 s and 12 deg/s, two turns in a minute, of a ship whose L/u0 is 20 s, by Froude's law (project choices).
        EffectParameter(
            "time_constant_s",
            "time constant of the revolutions, by default a quarter of L/u0",
            0.01,
            600.0,
            first(time_scale_passages(0.25)),
        ),
        EffectParameter(
            "angle_time_constant_s",
            "time constant of the turn of the unit, by default a twentieth of L/u0",
            0.01,
            600.0,
            first(time_scale_passages(0.05)),
        ),
        EffectParameter(
            "max_rate_radps",
            "largest rate at which a unit turns, by default 240 deg in L/u0",
            0.001,
            6.3,
            first(rates(math.radians(240.0))),
        ),
    ),
    equations=_with_azimuths,
    sought=False,
    states_behind={
        f"azimuth.{name}_actual_{unit}": f"azimuth.{name}_{unit}"
        for unit in range(1, UNITS_OF_SHIP + 1)
        for name in ("revolutions", "angle")
    },
    terminal="Azimuth thrusters: ordered and actual revolutions and directions",
)
