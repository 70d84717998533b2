"""Type B uncertainty of the MMG regression: errors common to all conditions, which their scatter does not show.

ITTC 7.5-02-06-04. Each error of ``[uncertainty]`` is applied to the tests with one standard deviation; what the misfit
changes by moves the coefficients as the linearised regression says. Different errors are independent.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from tank2sim.arrays import Array
from tank2sim.dynamics.rigid_body import inertial_forces
from tank2sim.identification.captive_mmg.steady_tests import SteadyTests


def erring_tests(tests: SteadyTests) -> Iterator[tuple[str, SteadyTests]]:
    """Stated errors, by their key in ``[uncertainty]``, and the tests with one standard deviation of each.

    The calibration gives one for each gauge, whose errors are independent. An error of the yaw inertia or of a delay
    does not show in steady tests.
    """
    stated = tests.form.uncertainty
    if size := stated.calibration_relative:
        for place in range(len(tests.channels)):
            gains = np.ones(len(tests.channels))
            gains[place] += size
            yield "calibration_relative", replace(tests, readings=tests.readings * gains)
    if size := stated.alignment_rad:
        u, v = tests.motion[:, 0], tests.motion[:, 1]
        turned = [u * np.cos(size) + v * np.sin(size), v * np.cos(size) - u * np.sin(size)]
        yield "alignment_rad", _with_motion(tests, np.column_stack([*turned, tests.motion[:, 2:]]))
    if size := stated.rudder_rad:
        yield "rudder_rad", _with_motion(tests, tests.motion + size * np.eye(5)[3])
    for key in ("speed_relative", "blockage_relative"):
        if size := getattr(stated, key):
            yield key, _with_motion(tests, tests.motion * np.array([1 + size, 1 + size, 1, 1, 1]))
    if (size := stated.mass_relative) and not _inertia_removed(tests):
        carried = np.zeros_like(tests.readings)
        carried[:, :3] = size * _inertia(tests)
        yield "mass_relative", replace(tests, readings=tests.readings - carried)


def _with_motion(tests: SteadyTests, motion: Array) -> SteadyTests:
    """The tests with another motion; forces of the water alone have been given the inertia of the recorded one."""
    moved = replace(tests, motion=motion)
    if not _inertia_removed(tests):
        return moved
    readings = tests.readings.copy()
    readings[:, :3] += _inertia(moved) - _inertia(tests)
    return replace(moved, readings=readings)


def _inertia_removed(tests: SteadyTests) -> bool:
    return tests.form.test.force_convention == "hydrodynamic"


def _inertia(tests: SteadyTests) -> Array:
    """Reaction of the carried body, (conditions, 3), N and N m."""
    u, v, r = tests.motion[:, :3].T
    return np.column_stack(inertial_forces(tests.form.model.mass_kg, tests.form.model.x_G_m, u, v, r))
