"""Linear response of the yaw rate to the rudder about the straight course: poles, zeros, Bode, step.

Responses of three systems, all by python-control: sway and yaw (with the states of effects that act on them: roll,
the memory of the flow) with the rudder angle as input, the same behind the steering gear (input the order; its rate
limit is not linear and neglected), and Nomoto's first-order model K/(1 + T s), for slow motion.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from tank2sim.analysis.linearisation import OperatingPoint, state_space
from tank2sim.analysis.stability.straight_line import Nomoto, steering_states
from tank2sim.arrays import Array, ComplexArray, Unbounded
from tank2sim.dynamics.model import Model

if TYPE_CHECKING:
    import control

HULL, GEAR, FIRST_ORDER = "rudder angle to yaw rate", "rudder order to yaw rate", "Nomoto, first order"

_FREQUENCIES = 121
_FEWEST, _MOST, _IN_A_PERIOD = 201, 1601, 16
"""Times of a step response in each period of the fastest oscillating mode, with least and largest total."""
_STABLE_STEP, _UNSTABLE_STEP = 5.0, 2.5
"""Length of the step response in slowest time constants: to 99 % of the end, or to twelve times the beginning."""


@dataclass(frozen=True, eq=False)
class SteeringResponse:
    """Response of the yaw rate (rad/s) to the rudder (rad), + to starboard.

    `label`: the system: :data:`HULL`, :data:`GEAR` or :data:`FIRST_ORDER`; `poles`, `zeros`: 1/s; `gain_per_s`: r/delta
    at rest, 1/s; for an unstable ship about an unstable steady turn; `omega_radps`, `response` (n,): frequency, and
    r/delta (complex, 1/s); `time_s`, `step_per_s` (m,): yaw rate after a step of the rudder, per rad of it.
    """

    label: str
    poles: ComplexArray
    zeros: ComplexArray
    gain_per_s: Unbounded
    omega_radps: Array
    response: ComplexArray
    time_s: Array
    step_per_s: Array


def steering_responses(model: Model, point: OperatingPoint, nomoto: Nomoto) -> tuple[SteeringResponse, ...]:
    """The systems about a straight course that respond to the rudder (without one in the play of its gear)."""
    import control  # slow to load

    steering = steering_states(model)
    hull = state_space(model, point, states=steering, inputs=["rudder.angle"], outputs=["motion.r"])
    systems = {HULL: hull}
    gear = [name for name in model.state_names if not name.startswith("motion.") and name not in steering]
    systems[GEAR] = state_space(
        model, point, states=[*steering, *gear], inputs=["rudder.command"], outputs=["motion.r"]
    )
    if math.isfinite(nomoto.K_per_s) and math.isfinite(nomoto.T_s):
        systems[FIRST_ORDER] = control.tf2ss(control.tf([nomoto.K_per_s], [nomoto.T_s, 1.0]))
    rates = np.abs(hull.poles())
    rates = rates[rates > 1e-12]
    if not len(rates):
        return ()
    slowest, fastest = float(rates.min()), float(rates.max())
    omega = np.geomspace(slowest / 20, fastest * 20, _FREQUENCIES)
    time = _times(hull.poles(), slowest)
    found = [system_response(label, system, omega, time) for label, system in systems.items()]
    return tuple(candidate for candidate in found if np.all(np.abs(candidate.response) > 0))


def _times(poles: NDArray[np.complex128], slowest: float) -> NDArray[np.float64]:
    """Times (m,) that show a step response: to its end, or until it has grown."""
    growth = float(poles.real.max())
    length = _STABLE_STEP / slowest
    if growth >= 0:
        length = min(length, _UNSTABLE_STEP / max(growth, 0.5 * slowest))
    cycles = length * float(np.abs(poles.imag).max()) / (2 * math.pi)
    return np.linspace(0.0, length, int(min(max(_FEWEST, math.ceil(_IN_A_PERIOD * cycles) + 1), _MOST)))


def system_response(label: str, system: control.StateSpace, omega: Array, time: Array) -> SteeringResponse:
    """The response of a linear `system` of a `label`, at the frequencies `omega` (n,), rad/s, and `time` (m,), s."""
    import control

    response = np.asarray(system(1j * omega), dtype=complex).ravel()
    step = np.asarray(control.step_response(system, T=time).outputs, dtype=float).ravel()
    return SteeringResponse(
        label=label,
        poles=np.asarray(system.poles(), dtype=complex),
        zeros=np.asarray(system.zeros(), dtype=complex),
        gain_per_s=float(np.real(control.dcgain(system))),
        omega_radps=omega,
        response=response,
        time_s=time,
        step_per_s=step,
    )
