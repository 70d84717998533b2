"""Errors common to all conditions: what each one does to motions and readings, by hand, and that physics stays."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tank2sim.errors import InputError
from tank2sim.identification.captive_mmg.regression import erring_tests
from tank2sim.identification.captive_mmg.steady_tests import (
    SteadyTests,
    read_steady_tests,
    refuse_impossible_sizes,
    refuse_other_curve,
)
from tests.identification.captive_mmg.tank import KVLCC2, MASS, X_G, write_campaign

SIZES = {
    "calibration_relative": 0.01, "alignment_deg": 0.5, "rudder_deg": 0.3, "speed_relative": 0.02,
    "blockage_relative": 0.015, "mass_relative": 0.03,
}  # fmt: skip


@pytest.fixture(scope="module")
def campaign(tmp_path_factory) -> Callable[[str, str], SteadyTests]:
    """Tests of a convention of the forces with one error stated."""

    def read(convention: str, key: str) -> SteadyTests:
        path = write_campaign(tmp_path_factory.mktemp("tank"), KVLCC2)
        text = path.read_text().replace('"on_gauge"', f'"{convention}"')
        path.write_text(f"[uncertainty]\n{key} = {SIZES[key]}\n{text}")
        return read_steady_tests(path)

    return read


def inertia(tests: SteadyTests) -> np.ndarray:
    """m (v r + x_G r^2), -m u r, -m x_G u r: the centrifugal force of the carried body."""
    u, v, r = tests.motion[:, :3].T
    return np.column_stack([MASS * (v * r + X_G * r**2), -MASS * u * r, -MASS * X_G * u * r])


CONVENTIONS = pytest.mark.parametrize("convention", ["on_gauge", "hydrodynamic"])


@CONVENTIONS
@pytest.mark.parametrize("key", ["alignment_deg", "rudder_deg", "speed_relative", "blockage_relative"])
def test_an_error_of_the_motion_leaves_what_the_file_states_of_the_forces(campaign, convention: str, key: str) -> None:
    """On the gauge the readings; of the water alone the readings without the inertia of the motion they belong to."""
    tests = campaign(convention, key)
    ((name, erring),) = erring_tests(tests)
    assert name == key.replace("_deg", "_rad")
    assert not np.allclose(erring.motion, tests.motion, rtol=1e-4)
    if convention == "on_gauge":
        np.testing.assert_array_equal(erring.readings, tests.readings)
    else:
        before, after = (one.readings[:, :3] - inertia(one) for one in (tests, erring))
        np.testing.assert_allclose(after, before, rtol=1e-9, atol=1e-9)
        np.testing.assert_array_equal(erring.readings[:, 3:], tests.readings[:, 3:])


def test_a_model_set_askew_drifts_by_the_same_angle_in_all_conditions_at_the_same_speed(campaign) -> None:
    tests = campaign("on_gauge", "alignment_deg")
    ((_, erring),) = erring_tests(tests)
    drifts = [np.arctan2(-one.motion[:, 1], one.motion[:, 0]) for one in (tests, erring)]
    assert np.abs(drifts[1] - drifts[0]) == pytest.approx(math.radians(0.5))
    assert np.ptp(np.sign(drifts[1] - drifts[0])) == 0
    np.testing.assert_allclose(erring.speed_mps, tests.speed_mps, rtol=1e-12)
    np.testing.assert_array_equal(erring.motion[:, 2:], tests.motion[:, 2:])


def test_errors_of_rudder_and_speed_change_them_alone(campaign) -> None:
    for key, change in {
        "rudder_deg": lambda motion: np.add(motion, [0, 0, 0, math.radians(0.3), 0]),
        "speed_relative": lambda motion: motion * [1.02, 1.02, 1, 1, 1],
        "blockage_relative": lambda motion: motion * [1.015, 1.015, 1, 1, 1],
    }.items():
        tests = campaign("on_gauge", key)
        ((_, erring),) = erring_tests(tests)
        np.testing.assert_allclose(erring.motion, change(tests.motion), rtol=1e-12)


def test_each_gauge_has_an_error_of_its_calibration(campaign) -> None:
    tests = campaign("on_gauge", "calibration_relative")
    found = [erring.readings / tests.readings for _, erring in erring_tests(tests)]
    np.testing.assert_allclose(found, [np.ones_like(tests.readings) + 0.01 * row for row in np.eye(5)], rtol=1e-9)


def test_an_error_of_the_mass_is_in_what_the_gauge_carries_and_not_in_forces_of_the_water(campaign) -> None:
    tests = campaign("on_gauge", "mass_relative")
    ((_, erring),) = erring_tests(tests)
    carried = tests.readings - erring.readings
    np.testing.assert_allclose(carried[:, :3], 0.03 * inertia(tests), rtol=1e-9, atol=1e-9)
    assert np.abs(carried[:, :3]).max() > 1 and not carried[:, 3:].any()
    assert not list(erring_tests(campaign("hydrodynamic", "mass_relative")))


@pytest.mark.parametrize(
    ("key", "low", "high"),
    [
        ("rudder.height_m", None, 1.5 * 0.46),
        ("model.rudder_area_m2", 0.002 * 7.0 * 0.46, 0.1 * 7.0 * 0.46),
        ("model.propeller_diameter_m", 0.1 * 0.46, 1.5 * 0.46),
        ("propeller.x_P", -0.65, -0.25),
        ("rudder.x_R", -0.65, -0.25),
    ],
)
def test_sizes_are_refused_just_beyond_the_bounds_of_ships_and_taken_just_within(
    campaign, key: str, low: float | None, high: float
) -> None:
    form = campaign("on_gauge", "rudder_deg").form
    section, name = key.split(".")

    def at(value: float) -> object:
        return form.model_copy(update={section: getattr(form, section).model_copy(update={name: value})})

    for bound, beyond in ((low, -1), (high, 1)):
        if bound is None:
            continue
        refuse_impossible_sizes(at(bound - beyond * 0.01 * abs(bound)), Path("x.toml"))
        with pytest.raises(InputError) as refused:
            refuse_impossible_sizes(at(bound + beyond * 0.01 * abs(bound)), Path("x.toml"))
        assert refused.value.place == key


@pytest.mark.parametrize(("at_rest", "taken"), [(0.06, True), (0.045, False), (1.1, True), (1.3, False)])
def test_an_open_water_curve_is_one_by_its_value_at_rest_and_its_fall(at_rest: float, taken: bool) -> None:
    J = np.linspace(0.1, 0.8, 8)
    curve = np.column_stack([J, at_rest * (1 - 0.9 * J - 0.2 * J**2)])
    if taken:
        refuse_other_curve(curve, Path("x.toml"))
        refuse_other_curve(curve[::-1], Path("x.toml"))
        with pytest.raises(InputError, match="falls with J"):
            refuse_other_curve(curve * [1, -1], Path("x.toml"))
    else:
        with pytest.raises(InputError, match="at J = 0"):
            refuse_other_curve(curve, Path("x.toml"))


def test_errors_that_steady_tests_do_not_show_give_none(campaign) -> None:
    tests = campaign("on_gauge", "rudder_deg")
    stated = tests.form.uncertainty.model_copy(update={"rudder_rad": 0.0})
    assert not list(erring_tests(replace(tests, form=tests.form.model_copy(update={"uncertainty": stated}))))
