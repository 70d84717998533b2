"""Effects with states of their own: roll, and the memory of the flow."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gap_truth.lane import Lane
from gap_truth.motion import Index, Motion, Parameters
from gap_truth.ship import GRAVITY_MPS2, Array


def _gathered(lanes: Sequence[Lane], effect: str) -> tuple[Index, Parameters]:
    index = np.array([i for i, lane in enumerate(lanes) if effect in lane.effects], int)
    if not index.size:
        return index, {}
    names = lanes[index[0]].effects[effect]
    return index, {name: np.array([lanes[i].effects[effect][name] for i in index]) for name in names}


class Roll:
    """Heel phi (rad, starboard down) as an oscillator; the heeled hull is pushed and turned.

    Outwards by the centrifugal force, heel_ratio u r / g when steady, and inwards by the rudder at the start of a
    turn, up to 1.2 degrees at 35 degrees of rudder; states (2, n): phi and its rate.
    """

    def __init__(self, lanes: Sequence[Lane]) -> None:
        self.lanes, self.parameters = _gathered(lanes, "roll_coupling")

    def start(self) -> Array:
        """Upright."""
        return np.zeros((2, self.lanes.size))

    def forces(self, m: Motion, state: Array, coefficients: dict[str, Array]) -> tuple[tuple[Array, Array], Array]:
        """Y' and N', and the rates of the states."""
        del coefficients
        p = self.parameters
        omega = 2.0 * np.pi / p["roll_period_s"]
        heel = -p["heel_ratio"] * m.u * m.r / GRAVITY_MPS2 + 0.035 * m.rudder * (m.speed / m.hull.speed_mps) ** 2
        phi, rate = state
        restoring = omega * omega * (heel - phi * (1.0 + 0.5 * phi * phi))
        return (p["Yphi"] * phi, p["Nphi"] * phi), np.stack([rate, restoring - 2.0 * p["damping"] * omega * rate])


class FlowMemory:
    """A share of the hull's linear sway force and yaw moment follows the motion late, by a first-order lag.

    The linear force of drift, remembered by two layers of the flow, one of half and one of one and a half times the
    time constant; states (4, n): the late force and moment of each.
    """

    def __init__(self, lanes: Sequence[Lane]) -> None:
        self.lanes, self.parameters = _gathered(lanes, "flow_memory")

    def start(self) -> Array:
        """Straight flow."""
        return np.zeros((4, self.lanes.size))

    def forces(self, m: Motion, state: Array, coefficients: dict[str, Array]) -> tuple[tuple[Array, Array], Array]:
        """Y' and N', and the rates of the states."""
        p, c = self.parameters, {name: coefficients[name][self.lanes] for name in ("Yv", "Nv")}
        sway, yaw = c["Yv"] * m.v_prime, c["Nv"] * m.v_prime
        late = 0.5 * (state[:2] + state[2:])
        parts = (p["share"] * (late[0] - sway), p["share"] * (late[1] - yaw))
        now = np.stack([sway, yaw])
        time = p["time_constant_s"]
        return parts, np.concatenate([(now - state[:2]) / (0.5 * time), (now - state[2:]) / (1.5 * time)])
