"""What a force may depend on: the motion of the lanes it acts on."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gap_truth.ship import Array, Hull

Index = NDArray[np.intp]


@dataclass(frozen=True)
class Motion:
    """State of some lanes, each (n,): SI and radians, prime v' = v/U and r' = r L/U, rudder to starboard.

    `rpm_ratio` is n/n_0; `steering` (3, n) the rudder's X', Y', N' of the polynomial; `t_s` one number.
    """

    hull: Hull
    t_s: float
    u: Array
    v: Array
    r: Array
    psi: Array
    speed: Array
    v_prime: Array
    r_prime: Array
    rudder: Array
    rpm_ratio: Array
    steering: Array

    def of(self, lanes: Index) -> Motion:
        """The same of some lanes only."""
        rows = (self.u, self.v, self.r, self.psi, self.speed, self.v_prime, self.r_prime, self.rudder, self.rpm_ratio)
        picked = [row[lanes] for row in rows]
        return Motion(self.hull, self.t_s, *picked, steering=np.ascontiguousarray(self.steering[:, lanes]))  # type: ignore[misc]

    @property
    def u_loss(self) -> Array:
        """1 - u/u0, the share of speed lost."""
        return 1.0 - self.u / self.hull.speed_mps

    @property
    def nominal(self) -> Array:
        """(u0/U)^2, which turns a force scaled with u0 into the prime system."""
        return (self.hull.speed_mps / self.speed) ** 2

    @property
    def length_time(self) -> Array:
        """L/U, the time scale of the prime system in seconds."""
        return self.hull.length_m / self.speed


Parameters = dict[str, Array]
Force = Callable[[Motion, Parameters], tuple[Array | float, Array | float, Array | float]]
"""Prime surge, sway and yaw on top of the polynomial."""
