"""What is said besides the verdict: of effects that were not tried, and of winds that some trials recorded."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from tank2sim.gap.outcome.notices import _of_what_remains, _partly_measured, of_tried_effects
from tank2sim.identification.trials.problem.prepare_trials import Measured
from tank2sim.records.trials import Trial
from tests.gap import made_up

TIME = np.arange(20.0)
WIND = {"wind_speed_mps": np.full(20, 8.0), "wind_direction_rad": np.full(20, 1.0)}


def trial(name: str, *, windy: bool) -> Trial:
    motion = {"u_mps": np.full(20, 5.0), "delta_rad": np.zeros(20)}
    return Trial(Path(f"{name}.csv"), TIME, motion | (WIND if windy else {}))


@pytest.mark.parametrize(("windy", "said"), [((True, False, True), 1), ((True, True, True), 0), ((False,) * 3, 0)])
def test_a_wind_that_some_trials_recorded_is_said_to_be_unused(windy, said) -> None:
    trials = tuple(trial(name, windy=has) for name, has in zip("abc", windy, strict=True))
    notices = _partly_measured(Measured(trials, "angle", ()))
    assert len(notices) == said
    if said:
        assert "wind was measured in 2 of 3 trials (a, c)" in notices[0]


def test_effects_that_were_not_tried_are_counted() -> None:
    assert of_tried_effects(("wind", "current"), ("current", "wind")) == ()
    (notice,) = of_tried_effects(("wind",), ("current", "wind", "rudder_bias"))
    assert "wind of 3 possible effects" in notice


def test_the_few_effects_that_were_left_out_are_named() -> None:
    (notice,) = of_tried_effects(("wind", "current"), ("current", "wind", "rudder_bias"))
    assert notice.startswith("not tried, as asked: rudder_bias of 3 possible effects")


def test_trials_that_a_simulation_leaves_are_reported_in_words() -> None:
    proof = SimpleNamespace(results=(made_up.passed("turn20", 4.0, np.nan),))
    none = SimpleNamespace(best=SimpleNamespace(hypothesis=SimpleNamespace(effects=())))
    (notice,) = _of_what_remains(made_up.card(), SimpleNamespace(proof=proof, decision=none))  # type: ignore[arg-type]
    assert "one diverges" in notice and "inf" not in notice
