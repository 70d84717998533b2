"""Charts of a plan."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from tank2sim.apps.design.result import run_planes


@pytest.mark.parametrize("repeats", [1, 2, 5])
def test_the_legend_of_the_points_has_numbers_of_runs_that_there_can_be(repeats: int) -> None:
    run = SimpleNamespace(type="static_drift", frequency_radps=None, drift_deg=5.0, rudder_deg=0.0)
    straight = SimpleNamespace(type="static_drift", frequency_radps=None, drift_deg=0.0, rudder_deg=0.0)
    (chart,) = run_planes(SimpleNamespace(runs=[run] * repeats + [straight]))  # type: ignore[arg-type]
    values = chart["layer"][0]["encoding"]["size"]["legend"]["values"]
    assert values[0] == 1 and values[-1] == repeats and values == sorted(set(values))
