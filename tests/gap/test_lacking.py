"""The missing force or signal of a study: points over a state, means of bins with intervals, means over time."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tank2sim.gap.outcome.lacking import FORCE_POINTS, PARTS_OVER_TIME, lacking_study, means_of_bins
from tank2sim.gap.result import MissingSignal
from tests.gap import made_up

FILES = {"turn35": "turn35.csv", "zigzag": "zigzag.dat"}


def test_means_of_bins_err_by_the_spread_between_trials() -> None:
    """Two trials a unit apart: mean 0.5, standard error 0.5; a third alone in its bin has no interval."""
    state = np.array([0.0] * 20 + [1.0] * 5)
    force = np.array([0.0] * 10 + [1.0] * 10 + [7.0] * 5)
    means = means_of_bins(state, force, np.array(["a"] * 10 + ["b"] * 10 + ["c"] * 5))
    assert means["value"].tolist() == [0.5, 7.0] and means["trials"].tolist() == [2, 1]
    assert means["high_95"][0] - means["low_95"][0] == pytest.approx(2 * 1.96 * 0.5, rel=1e-4)
    assert np.isnan(means["low_95"][1]) and np.isnan(means["high_95"][1])


def test_a_force_is_given_over_one_turn_of_the_compass_and_over_time() -> None:
    force = made_up.force()
    found = lacking_study(force, FILES)
    assert found is not None and found.equation == "Y" and found.explained == force.explained
    assert list(found.points) == ["turn35.csv", "zigzag.dat"] == list(found.over_time)
    force_N, heading_deg = (
        np.concatenate([points[name] for points in found.points.values()]) for name in ("force_N", "heading_deg")
    )
    assert force_N == pytest.approx(force.force, rel=1e-6)
    assert heading_deg == pytest.approx(np.rad2deg(force.states["heading"]) % 360, rel=1e-6)
    parts = found.over_time["turn35.csv"]
    assert len(parts["t_start_s"]) == PARTS_OVER_TIME
    assert parts["t_start_s"][1:].tolist() == parts["t_end_s"][:-1].tolist()
    assert {len(values) for values in found.means.values()} == {12}


def test_many_instants_are_thinned_with_their_extremes_and_unknown_ones_are_left_out() -> None:
    count = 20 * FORCE_POINTS
    force = np.sin(np.arange(count) / 300)
    force[17], force[4001] = np.nan, 50.0
    long = replace(
        made_up.force(),
        trials=("turn35",) * count,
        time_s=np.arange(count, dtype=float),
        force=force,
        states={"rudder": np.linspace(-0.6, 0.6, count)},
        explaining="rudder",
    )
    found = lacking_study(long, FILES)
    assert found is not None
    points = found.points["turn35.csv"]
    assert len(points["force_N"]) <= FORCE_POINTS + 4 and max(points["force_N"]) == 50.0
    assert np.isfinite(points["force_N"]).all()
    assert points["rudder_deg"][0] == pytest.approx(np.rad2deg(-0.6), rel=1e-6)


@pytest.mark.parametrize(("quantity", "column"), [("turning", "rate_degps"), ("east", "velocity_mps")])
def test_a_contradiction_has_the_unit_of_its_quantity(quantity, column) -> None:
    count = 5
    values, state = np.full(count, 0.1), {"speed": np.linspace(4.0, 5.0, count)}
    signal = MissingSignal(quantity, ("zigzag",) * count, np.arange(5.0), values, values, state, "speed", {"speed": 1})
    found = lacking_study(signal, FILES)
    assert found is not None and found.quantity == quantity
    expected = np.rad2deg(0.1) if quantity == "turning" else 0.1
    points = found.points["zigzag.dat"]
    assert points[column] == pytest.approx([expected] * count, rel=1e-6)
    assert points["speed_mps"] == pytest.approx(state["speed"])


def test_nothing_is_given_where_nothing_is_missing() -> None:
    assert lacking_study(None, {}) is None
