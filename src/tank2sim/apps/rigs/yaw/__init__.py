"""Added yaw inertia and dissipation from records of a yaw rig (Alyshev 2019)."""

from typing import Literal

YawMethod = Literal[
    "energy_least_squares",
    "as_many_equations",
    "two_intervals",
    "output_error",
    "energy_least_squares_reference",
    "two_intervals_reference",
]
"""Methods, the best one first."""
