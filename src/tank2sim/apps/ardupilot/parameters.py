"""Parameters of ArduPilot's Rover that a card determines: cruise, feed-forward of the steering, largest turn."""

from __future__ import annotations

import math
from dataclasses import dataclass

from tank2sim.apps.ardupilot.physics import NEUTRAL_US, REACH_US, REST_FORCE_MPS2, SitlShip
from tank2sim.dynamics.effects.surroundings import in_calm
from tank2sim.dynamics.model import Model

CRUISE_PERCENT = 50
"""Throttle of the cruise, per cent: ArduPilot's own default of CRUISE_THROTTLE."""

_SETTLING = 60.0
"""Time in which speed and rate of turn settle, L/u0. Project choice: as in a pull-out."""


@dataclass(frozen=True, kw_only=True)
class BoatParameters:
    """Figures of a boat for ArduPilot.

    Parameters
    ----------
    skid : bool
        Whether it is steered by the difference of two thrusters.
    cruise_throttle_percent, cruise_speed_mps : float
        Steady speed straight ahead at that throttle.
    rate_at_full_steering_radps : float
        Steady rate of turn at that throttle with full steering to starboard.
    lateral_g : float
        Speed times rate of turn there, over gravity.
    radius_m : float
        Radius of that turn.
    """

    skid: bool
    cruise_throttle_percent: float
    cruise_speed_mps: float
    rate_at_full_steering_radps: float
    lateral_g: float
    radius_m: float

    @property
    def text(self) -> str:
        """The parameter file (``--add-param-file``)."""
        first, third = (73, 74) if self.skid else (26, 70)
        ends = {"MIN": NEUTRAL_US - REACH_US, "TRIM": NEUTRAL_US, "MAX": NEUTRAL_US + REACH_US}
        rows: dict[str, float] = {"FRAME_CLASS": 2, "SERVO1_FUNCTION": first, "SERVO3_FUNCTION": third}
        rows |= {f"SERVO{servo}_{end}": value for servo in (1, 3) for end, value in ends.items()}
        rows |= {
            "CRUISE_THROTTLE": self.cruise_throttle_percent,
            "CRUISE_SPEED": self.cruise_speed_mps,
            "WP_SPEED": self.cruise_speed_mps,
            "WP_RADIUS": max(1.0, self.radius_m),
            "ATC_STR_RAT_FF": 1.0 / self.rate_at_full_steering_radps,
            "TURN_MAX_G": self.lateral_g,
        }
        return "".join(f"{name} {value:.4g}\n" for name, value in rows.items())


def boat_parameters(model: Model) -> BoatParameters:
    """Return the parameters of a boat, from its steady motion in calm water, straight ahead and with full steering.

    Parameters
    ----------
    model : Model

    Raises
    ------
    InputError
        The model has neither thrusters at both sides, nor a rudder and an engine, or steering to starboard does not
        turn it there.
    """
    model = in_calm(model)
    SitlShip(model)  # refuses a vessel that has not even a length
    values = model.defaults
    settle = _SETTLING * values["ship.length"] / values["ship.speed"]
    part = CRUISE_PERCENT / 100
    ship = SitlShip(model, values["ship.speed"])
    ship.u = ship.orders(part, part) if ship.skid else ship.orders(0.0, part)
    ship.advance(settle)
    cruise = ship.state("motion.u")
    # Steering adds to the throttle of one side and takes from the other, each within its range.
    ship.u = ship.orders(1.0, part - 1.0) if ship.skid else ship.orders(1.0, part)
    ship.advance(settle)
    rate, speed = ship.state("motion.r"), math.hypot(ship.state("motion.u"), ship.state("motion.v"))
    if not rate > 0:
        problem = f"turns with {math.degrees(rate):.3g} deg/s at full steering to starboard"
        raise model.fault("", problem, "check the signs and sizes of the card with simulate")
    return BoatParameters(
        skid=ship.skid,
        cruise_throttle_percent=CRUISE_PERCENT,
        cruise_speed_mps=cruise,
        rate_at_full_steering_radps=rate,
        lateral_g=speed * rate / REST_FORCE_MPS2,
        radius_m=speed / rate,
    )
