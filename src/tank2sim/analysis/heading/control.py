"""A heading autopilot for a ship: gains by pole placement on Nomoto's model of its steering."""

from __future__ import annotations

import math

from tank2sim.analysis.stability.straight_line import Nomoto, stability
from tank2sim.dynamics.autopilot import HeadingGains, autopilot_model
from tank2sim.dynamics.model import Model
from tank2sim.errors import InputError

DAMPING = 0.9
"""Relative damping of the heading, between the 0.8 and 1 that Fossen (2011), 12.2, recommends for ships."""

SLOWNESS = 0.1
"""The pole of the integral over the natural frequency, so that it does not disturb a course change (Fossen, 12.2)."""

INTEGRAL_BAND_RAD = math.radians(2.0)
"""Heading error that counts as a change of course, not a disturbance: project choice, twice a helmsman's."""

LARGEST_RUDDER_RAD = math.radians(35.0)
"""Limit without one on the card: the rudder angle that SOLAS II-1, regulation 29 requires of a gear."""


def heading_gains(nomoto: Nomoto, largest_rudder_rad: float = LARGEST_RUDDER_RAD) -> HeadingGains:
    """Gains that put the poles of heading, yaw rate and integral where (s^2 + 2 z w s + w^2)(s + a) = 0.

    With T dr/dt + r = K delta the loop is T s^3 + (1 + K Kd) s^2 + K Kp s + K Ki; w = sqrt(K/T), which makes the rudder
    that a heading error orders about as large as the error (project choice, amid the 0.5 to 2 of practice), z is
    :data:`DAMPING` and a is :data:`SLOWNESS` w. It also holds for a ship that is unstable (K and T negative). Raises
    ValueError: K/T is not positive: the rudder turns the ship the wrong way.
    """
    K, T = nomoto.K_per_s, nomoto.T_s
    if not K / T > 0:
        raise ValueError("the rudder turns the ship the wrong way")
    w = math.sqrt(K / T)
    a = SLOWNESS * w
    proportional = T / K * (w**2 + 2 * DAMPING * w * a)
    integral = T / K * w**2 * a
    return HeadingGains(
        proportional=proportional,
        derivative=(T * (2 * DAMPING * w + a) - 1) / K,
        integral=integral,
        integral_band_rad=INTEGRAL_BAND_RAD,
        anti_windup_time_s=1 / w,  # as fast as the heading
        largest_rudder_rad=largest_rudder_rad,
    )


def heading_autopilot(ship: Model) -> Model:
    """The autopilot of a ship, at its speed of expansion.

    Raises InputError: the model is not a ship, has no straight course, or its rudder turns it the wrong way.
    """
    limit = ship.defaults.get("steering.max_angle", LARGEST_RUDDER_RAD)
    try:
        gains = heading_gains(stability(ship).nomoto.dimensional, min(limit, LARGEST_RUDDER_RAD))
    except ValueError as error:
        raise InputError(ship.origin, "", str(error), "check Yd and Nd of the card, and its rudder_sign") from None
    return autopilot_model(f"Autopilot of {ship.name}", gains, ship.step_s)
