"""Where shooting begins: at what was measured."""

from __future__ import annotations

import numpy as np
import pytest

from tank2sim.identification.trials.methods.output_error import _start
from tests.identification.trials.made_up_ship import problem, trial, zigzag


def test_the_first_state_is_what_was_measured_there() -> None:
    asked = problem([trial(zigzag(20), name="zigzag", seed=1, duration=100.0, noise=0.0)], free=("Yv",))
    run, first = asked.runs[0], 250
    state = dict(zip(asked.model.state_names, _start(asked, run, first), strict=True))
    for name in ("motion.u", "motion.v", "motion.r", "motion.psi", "motion.x", "motion.y"):
        if name in run.seen:
            near = run.column(name)[first - 1 : first + 2]
            size = np.ptp(run.column(name))
            assert state[name] == pytest.approx(near.mean(), abs=0.02 * size), name
    assert "motion.v" in run.seen and abs(state["motion.v"]) > 0
