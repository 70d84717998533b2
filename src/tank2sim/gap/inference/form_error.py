"""By how much the force of a real effect may differ from its formula, as columns of the least squares."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from tank2sim.arrays import Array
from tank2sim.gap.inference.batch import MeasuredBatch
from tank2sim.gap.inference.kalman_filter import FORCE_STATES

FORM = 0.15
"""Standard deviation of the factors by which the force of a real effect differs from its formula, as a whole and with
rudder, yaw rate and loss of speed, and of the time by which it differs, in blocks (project choice; 10 to 20 % is the
accuracy of empirical force formulas). Without it the difference would be taken for a second effect where the noise is
small."""


class Forms:
    """Shapes of the error of a formula, along one motion.

    Parameters
    ----------
    motion : MeasuredBatch
    steering : array (R, T - 1)
        What steers (:meth:`.Hypothesis.steered`).
    """

    def __init__(self, motion: MeasuredBatch, steering: Array):
        self.motion, self.steering = motion, steering

    def columns(self, added: Array, *, directed: bool) -> Array:
        """Driving of each form error, for one standard deviation (R, T - 1, 6, nf).

        Only accelerations have form errors: the formulas of kinematics and sensors are exact. As a whole the
        accelerations differ from one another alone, for their common size is a parameter of the effect.

        Parameters
        ----------
        added : array (R, T - 1, 6)
            Driving that the effect adds by its formula.
        directed : bool
            It comes from a direction of the compass (wind), and may differ with the heading as well.
        """
        added = added[..., :FORCE_STATES]
        late = np.diff(added, axis=1, prepend=added[:, :1])
        parts = [added[..., [row]] * np.eye(6)[row] for row in range(FORCE_STATES)]
        whole = [parts[0] - parts[1] - parts[2], parts[1] - parts[2]]
        shapes = (*self._shapes, *(self._turns if directed else ()))
        shaped = [part * shape for shape in shapes for part in parts]
        delayed = [late[..., [row]] * np.eye(6)[row] for row in range(FORCE_STATES)]
        columns: Array = FORM * np.stack([*whole, *shaped, *delayed], axis=-1)
        return columns

    @cached_property
    def _shapes(self) -> tuple[Array, ...]:
        """Steering, yaw rate and loss of speed between -1 and 1 of their range (R, T - 1, 1)."""
        motion = self.motion
        steering = np.abs(self.steering)[..., None]
        speed, rate = motion.block_states[..., [0]], np.abs(motion.block_states[..., [2]])
        return tuple(2 * (signal - signal.min()) / (np.ptp(signal) or 1.0) - 1 for signal in (steering, rate, -speed))

    @cached_property
    def _turns(self) -> tuple[Array, ...]:
        """Once and twice round the compass (R, T - 1, 1)."""
        heading = self.motion.block_states[..., [3]]
        return np.cos(heading), np.sin(heading), np.cos(2 * heading), np.sin(2 * heading)
