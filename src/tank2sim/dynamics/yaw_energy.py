"""The energy method of paper 3 on two intervals: (1) and (2), as equations between works and speeds.

A body turns under a motor; in the interval 1-2 it speeds up, in 5-6 it slows down as its mirror image. W is the work
of the motor, int M w dt, of which any known part (walls, differences between the two) has been taken off already:

    W12 = (J + lambda)/2 (w2^2 - w1^2) + (B + D),   W56 = -(J + lambda)/2 (w2^2 - w1^2) + (B + D)

so that half their difference is kinetic energy, and half their sum is what was dissipated.
"""

from __future__ import annotations


def inertia_from_work(work_12_J: float, work_56_J: float, w1_radps: float, w2_radps: float) -> float:
    """J + lambda661 in kg m2, (1): (W12 - W56) / (w2^2 - w1^2)."""
    return (work_12_J - work_56_J) / (w2_radps**2 - w1_radps**2)


def dissipation_from_work(work_12_J: float, work_56_J: float) -> float:
    """B + D in J, (2): (W12 + W56) / 2.

    The print divides the corrections for accelerating and braking and for the walls by (w2^2 - w1^2), which is not
    energy; here they are part of the work, without a divisor.
    """
    return (work_12_J + work_56_J) / 2
