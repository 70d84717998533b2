"""Frames of ArduPilot's SITL and the ship that answers them, in lock-step.

SITL sends the outputs of the autopilot to its servos and waits for the motion; its clock follows the timestamps of the
replies (``libraries/SITL/examples/JSON/readme.md`` and ``SIM_JSON.h`` of ArduPilot). Its axes are body
forward-right-down and earth north-east-down, as here.
"""

from __future__ import annotations

import math
import struct
from dataclasses import dataclass

import casadi as ca
import numpy as np

from tank2sim.analysis.stability.imo import TRIAL_RUDDER
from tank2sim.arrays import Array
from tank2sim.dynamics.model import Input, Model, Parameter
from tank2sim.simulation.integrator import Integrator
from tank2sim.simulation.thruster_manoeuvres import thruster_sides

FRAMES = {struct.Struct("<HHI16H"): 18458, struct.Struct("<HHI32H"): 29569}
"""Packets of SITL with 16 and 32 channels, and their first number: magic, rate (Hz), count, pulses (us)."""

NEUTRAL_US, REACH_US = 1500, 500
"""Pulse of a servo at rest, and from there to either end: 1000 and 2000 us, as the parameter file sets them."""

_DRIVEN_US = 800, 2200
"""Pulses that drive a servo; others (0 while disarmed) leave it at rest. Project choice: the range of hobby servos."""

REST_FORCE_MPS2 = 9.80665
"""Gravity that SITL expects of an accelerometer at rest."""

_RATES = ("motion.x", "motion.y", "motion.u", "motion.v")


def share(pulse_us: int) -> float:
    """Deflection of a servo, -1 to 1; 0 where it is not driven.

    Parameters
    ----------
    pulse_us : int

    Examples
    --------
    >>> share(1500), share(2000), share(1250), share(0)
    (0.0, 1.0, -0.5, 0.0)
    """
    if not _DRIVEN_US[0] <= pulse_us <= _DRIVEN_US[1]:
        return 0.0
    return max(-1.0, min(1.0, (pulse_us - NEUTRAL_US) / REACH_US))


@dataclass(frozen=True)
class SitlFrame:
    """A packet of SITL: its rate (Hz), its count, and the shares of the first and the third channel."""

    rate_hz: int
    count: int
    first: float
    third: float

    @classmethod
    def read(cls, data: bytes) -> SitlFrame | None:
        """Return the frame of a packet; None if it is none.

        Parameters
        ----------
        data : bytes
        """
        for form, magic in FRAMES.items():
            if len(data) == form.size:
                number, rate, count, *pulses = form.unpack(data)
                if number == magic and rate > 0:
                    return cls(rate, count, share(pulses[0]), share(pulses[2]))
        return None


class SitlShip:
    """A ship that moves by the frames of SITL.

    Channels as for a Rover of the frame class boat: 1 is the left thruster and 3 the right one (skid steering),
    or 1 the rudder and 3 the throttle.

    Parameters
    ----------
    model : Model
        With thrusters at both sides, or with a rudder and a propeller.
    speed_mps : float
        Speed at which it begins, m/s.

    Raises
    ------
    InputError
        It has neither.
    """

    def __init__(self, model: Model, speed_mps: float = 0.0) -> None:
        self.model, self.integrator = model, Integrator(model)
        self.sides = {name: side for name, side in thruster_sides(model).items() if side}
        self.skid = {1.0, -1.0} <= set(self.sides.values())
        if not self.skid and not {"rudder.command", "propeller.speed"} <= set(model.input_names):
            remedy = "give a craft with thrusters at both sides, or a ship with [propulsion]"
            raise model.fault("", "has no thrusters at both sides, and no rudder with an engine", remedy)
        start = {"initial.u": speed_mps} if "initial.u" in model.parameter_names else {}
        self._p = model.parameter_values(start)
        places = [model.state_names.index(name) for name in _RATES]
        self._rates = ca.Function("rates", [model.x, model.u, model.p], [model.rates[places]], {"cse": True})
        self.restarts = self.repeated = 0
        self.frame: int | None = None
        self._begin()

    def _begin(self) -> None:
        self.time = 0.0
        self.x: Array = np.array(self.model.initial(self._p)).ravel()
        self.u: Array = self.orders(0.0, 0.0)

    def orders(self, first: float, third: float) -> Array:
        """Inputs of the model (nu,) by the shares of the channels 1 and 3.

        Parameters
        ----------
        first, third : float
        """
        u = self.model.input_values()
        given: dict[str, float] = {}
        if self.skid:
            # More thrust at port turns to starboard.
            given = {name: self._of_range(name, first if side > 0 else third) for name, side in self.sides.items()}
        else:
            given = {"rudder.command": first * self.largest_rudder, "propeller.speed": third * self._nominal}
        for name, value in given.items():
            u[self.model.input_names.index(name)] = value
        return u

    def _of_range(self, name: str, part: float) -> float:
        variable = self.model[name]
        assert isinstance(variable, Input)
        low, high = variable.minimum or 0.0, variable.maximum or 0.0
        return part * high if part >= 0 else -part * low

    @property
    def largest_rudder(self) -> float:
        """Rudder at full steering, rad."""
        if "steering.max_angle" not in self.model.parameter_names:
            return TRIAL_RUDDER
        stop = self.model["steering.max_angle"]
        assert isinstance(stop, Parameter)
        return min(float(stop.start), math.radians(89.0))

    @property
    def _nominal(self) -> float:
        propeller = self.model["propeller.speed"]
        assert isinstance(propeller, Input)
        return float(propeller.start)

    def advance(self, duration_s: float) -> None:
        """Move for a time with the present orders, in steps of the model's or shorter.

        Parameters
        ----------
        duration_s : float
        """
        count = max(1, math.ceil(duration_s / self.model.step_s * (1 - 1e-9)))
        self.x = self.integrator.rollout(self.x, self.u, self._p, duration_s / count, count)[-1]
        self.time += duration_s

    def answer(self, data: bytes) -> bytes | None:
        """The reply to a packet of SITL; None to one that is none of its frames.

        A frame that is repeated is answered again without a step; a smaller count restarts the ship, as SITL was.

        Parameters
        ----------
        data : bytes
        """
        frame = SitlFrame.read(data)
        if frame is None:
            return None
        if self.frame is not None and frame.count < self.frame:
            self.restarts += 1
            self._begin()
        if frame.count == self.frame:
            self.repeated += 1
        else:
            self.u = self.orders(frame.first, frame.third)
            self.advance(1.0 / frame.rate_hz)
        self.frame = frame.count
        return self.reply()

    def state(self, name: str) -> float:
        """A state of the ship; 0 if its model does not have it.

        Parameters
        ----------
        name : str
        """
        return float(self.x[self.model.state_names.index(name)]) if name in self.model.state_names else 0.0

    def reply(self) -> bytes:
        """The motion in the text that SITL searches: one line, a newline before and after it."""
        north, east, udot, vdot = np.array(self._rates(self.x, self.u, self._p)).ravel().tolist()
        u, v, r = (self.state(f"motion.{name}") for name in "uvr")
        heading = (self.state("motion.psi") + math.pi) % math.tau - math.pi
        # The specific force; a current that is constant adds none to it.
        force = (udot - v * r, vdot + u * r, -REST_FORCE_MPS2)
        text = (
            f'{{"timestamp":{self.time:.6f},"imu":{{"gyro":{_list(self.state("motion.p"), 0.0, r)},'
            f'"accel_body":{_list(*force)}}},"position":{_list(self.state("motion.x"), self.state("motion.y"), 0.0)},'
            f'"attitude":{_list(self.state("motion.phi"), 0.0, heading)},"velocity":{_list(north, east, 0.0)}}}'
        )
        return f"\n{text}\n".encode("ascii")


def _list(*values: float) -> str:
    return f"[{','.join(f'{value:.9f}' for value in values)}]"
