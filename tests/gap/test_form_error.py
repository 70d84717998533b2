"""By how much a formula may be wrong, against the shapes written out."""

from __future__ import annotations

import numpy as np
import pytest

from tank2sim.gap.inference.form_error import FORM, Forms
from tests.gap.toy import Toy, toy_motion

SIZES = np.array([0.8, -0.6, 0.9])
"""Of a hidden force in yaw, in surge and in sway."""


def pushes(motion) -> np.ndarray:
    """What that force adds to the three speeds in each block (R, T - 1, 3), 0 beyond a run's end."""
    change = Toy((None,) * 3).rates_between(motion, SIZES) - Toy().rates_between(motion, [])
    return motion.block_s * np.where(motion.inside[:, 1:, None], motion.over_blocks(change)[..., :3], 0.0)


def everywhere(force: np.ndarray) -> np.ndarray:
    """With what kinematics add, of which nothing is in doubt (R, T - 1, 6)."""
    return np.concatenate([force, np.ones_like(force)], axis=-1)


def shapes(motion) -> list[np.ndarray]:
    """Rudder, yaw rate and loss of speed, each from -1 where it is least to 1 where it is largest."""
    courses = np.abs(motion.block_inputs[..., 0]), np.abs(motion.block_states[..., 2]), -motion.block_states[..., 0]
    return [np.interp(course, (course.min(), course.max()), (-1, 1)) for course in courses]


@pytest.mark.parametrize("directed", [False, True])
def test_the_form_of_a_force_may_differ_by_shares_of_it(directed: bool) -> None:
    motion = toy_motion(tuple(SIZES))
    force = pushes(motion)
    found = Forms(motion, motion.block_inputs[..., 0]).columns(everywhere(force), directed=directed) / FORM
    assert np.all(found[..., 3:, :] == 0)
    expected = [force * [1, -1, -1], force * [0, 1, -1]]
    heading = motion.block_states[..., 3]
    turns = [np.cos(heading), np.sin(heading), np.cos(2 * heading), np.sin(2 * heading)] if directed else []
    for shape in (*shapes(motion), *turns):
        expected += [force * shape[..., None] * np.eye(3)[axis] for axis in range(3)]
    late = np.concatenate([0 * force[:, :1], np.diff(force, axis=1)], axis=1)
    expected += [late * np.eye(3)[axis] for axis in range(3)]
    assert found[..., :3, :] == pytest.approx(np.stack(expected, axis=-1), abs=1e-12)


def test_the_form_of_a_force_leaves_its_size_to_the_effect() -> None:
    """Surge, sway and yaw may be wrong against each other; all larger together is the effect's own parameter."""
    motion = toy_motion(tuple(SIZES))
    force = pushes(motion)
    first, second, *_ = np.moveaxis(
        Forms(motion, motion.block_inputs[..., 0]).columns(everywhere(force), directed=False), -1, 0
    )
    whole = np.stack([driving[..., :3].ravel() for driving in (first, second, force)], axis=-1)
    assert np.linalg.matrix_rank(whole) == 3
    residual = force.ravel() - whole[:, :2] @ np.linalg.lstsq(whole[:, :2], force.ravel(), rcond=None)[0]
    assert np.linalg.norm(residual) > 0.3 * np.linalg.norm(force)
