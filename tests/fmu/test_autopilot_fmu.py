"""Ship and autopilot as two FMUs come to what they are as one model, the nearer the shorter their step."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from fmpy.validation import validate_fmu

from tank2sim.analysis.heading.designs import HeadingDesign, design_heading
from tank2sim.dynamics.model import Model
from tank2sim.errors import InputError
from tank2sim.fmu.autopilot import co_simulate_heading, loop_difference, make_autopilot_fmu
from tests.fmu.driving import ShipFmu

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def design(mariner: Model) -> HeadingDesign:
    return design_heading(mariner, "lqr")


@pytest.fixture(scope="module", params=[2, pytest.param(3, marks=pytest.mark.slow)])
def pair(
    request: pytest.FixtureRequest, design: HeadingDesign, mariner_fmu: ShipFmu, tmp_path_factory
) -> tuple[Path, Path]:
    path = tmp_path_factory.mktemp("autopilot") / "autopilot.fmu"
    path.write_bytes(make_autopilot_fmu(design.autopilot, design.source, fmi=request.param).content)
    return mariner_fmu(request.param), path


def test_the_fmu_of_a_controller_is_valid(pair: tuple[Path, Path]) -> None:
    assert validate_fmu(str(pair[1])) == []


def test_two_fmus_agree_with_one_model_in_proportion_to_their_step(
    mariner: Model, design: HeadingDesign, pair: tuple[Path, Path]
) -> None:
    found = loop_difference(mariner, design.autopilot, pair, math.radians(20.0), steps_s=(2.0, 0.4, 0.1))
    assert found.order == pytest.approx(1.0, abs=0.1)
    error = {one.step_s: one.error_deg for one in found.steps}
    assert 0.005 < error[0.1] < 0.02
    # In proportion: what a straight line through two of them leaves at a step of 0 is nothing.
    rest = (4 * error[0.1] - error[0.4]) / 3
    assert abs(rest) < 1e-3


def test_the_first_order_is_the_gain_times_the_error(design: HeadingDesign, pair: tuple[Path, Path]) -> None:
    run = co_simulate_heading(*pair, math.radians(10.0), step_s=1.0, duration_s=5.0)
    assert run.orders["rudder.command"][0] == pytest.approx(design.gains["Kp"] * math.radians(10.0))
    assert np.all(np.diff(run.heading_rad) >= 0)


def test_an_fmu_that_is_no_autopilot_is_reported(pair: tuple[Path, Path]) -> None:
    with pytest.raises(InputError, match=r"has no heading\.command"):
        co_simulate_heading(pair[0], pair[0], 0.1, step_s=1.0, duration_s=1.0)
