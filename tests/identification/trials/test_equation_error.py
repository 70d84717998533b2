"""Equation error in its weak form: against ships that were integrated without tank2sim."""

import time
from dataclasses import replace

import numpy as np
import pytest

from tank2sim.errors import InputError
from tank2sim.identification.trials.methods.equation_error import EquationErrorSettings, equation_error
from tank2sim.identification.trials.methods.weak_form import WeakForm
from tests.identification.trials.made_up_ship import (
    ESTIMATED,
    TRUTH,
    accelerations,
    gusts,
    problem,
    trial,
    turn,
    zigzag,
)

EXACT = np.array([TRUTH[name] for name in ESTIMATED])


def runs(**more):
    rudders = {"zigzag": zigzag(20), "port": turn(-30), "starboard": turn(25)}
    return [trial(rudder, name=name, seed=place, **more) for place, (name, rudder) in enumerate(rudders.items())]


@pytest.fixture(scope="module")
def quiet():
    return runs(noise=0.0)


@pytest.fixture(scope="module")
def noisy():
    return runs()


def test_the_true_coefficients_leave_no_residual(quiet):
    asked = problem(quiet)
    residuals = WeakForm(asked).at(EXACT).residuals
    change = WeakForm(asked).change
    assert np.all(np.abs(residuals).max(axis=0) < 2e-3 * np.abs(change).max(axis=0))


def test_the_jacobian_is_that_of_differences(noisy):
    asked = problem(noisy[:1])
    form = WeakForm(asked)
    jacobian = form.at(EXACT).jacobian
    for place in range(len(EXACT)):
        change = np.zeros(len(EXACT))
        change[place] = 0.01 * EXACT[place]
        after, before = form.at(EXACT + change).residuals, form.at(EXACT - change).residuals
        expected = -(after - before) / (2 * change[place])
        np.testing.assert_allclose(jacobian[:, :, place], expected, rtol=1e-6, atol=1e-9 * np.abs(expected).max())


def test_the_jacobian_goes_through_what_is_simulated(noisy):
    ordered = [replace(one, signals=_ordered(one.signals)) for one in noisy[:1]]
    asked = problem(ordered, by_angle=False, free=("Nd",))
    asked = replace(asked, free=(*asked.free, "steering.time_constant"), prior_mean=np.array([0.0015, 2.0]))
    asked = replace(asked, prior_error=np.array([1e-4, 1.0]))
    form, point = WeakForm(asked), np.array([0.0015, 2.0])
    jacobian = form.at(point).jacobian[:, :, 1]
    after, before = (form.at(point + np.array([0, change])).residuals for change in (1e-3, -1e-3))
    expected = -(after - before) / 2e-3
    assert np.abs(expected[:, 2]).max() > 0
    np.testing.assert_allclose(jacobian, expected, rtol=1e-3, atol=1e-5 * np.abs(expected).max())


def _ordered(signals):
    return {
        **{name: values for name, values in signals.items() if name != "delta_rad"},
        "delta_order_rad": signals["delta_rad"],
    }


def test_without_noise_the_coefficients_come_back(quiet):
    found = equation_error(problem(quiet), settings=EquationErrorSettings(scale_prior=False))
    np.testing.assert_allclose(found.values, EXACT, rtol=0.01)


def test_the_start_does_not_matter(noisy):
    asked = problem(noisy)
    found = equation_error(asked)
    far = equation_error(asked, start=-3 * EXACT)
    np.testing.assert_allclose(far.values, found.values, atol=0.01 * found.standard_errors.min())


def test_standard_errors_hold_under_sensor_noise():
    off = []
    for seed in range(6):
        trials = [
            trial(rudder, seed=10 * seed + place, duration=200.0)
            for place, rudder in enumerate([zigzag(20), turn(-30)])
        ]
        found = equation_error(problem(trials, seed=seed))
        off.append((found.values - EXACT) / found.standard_errors)
    assert 0.7 < np.sqrt(np.mean(np.square(off))) < 1.4


@pytest.mark.slow
def test_standard_errors_hold_under_gentle_coloured_forces():
    """Two percent of the rudder's force; stronger ones move the ship with themselves, and pull Nv, Nr, Nd down."""
    off = []
    for seed in range(3):
        trials = [
            trial(rudder, seed=10 * seed + place, force=gusts(1501, 0.2, (1e-5, 4e-5, 1e-5), 15.0, 10 * seed + place))
            for place, rudder in enumerate([zigzag(20), turn(-30), turn(25)])
        ]
        found = equation_error(problem(trials, seed=seed))
        off.append((found.values - EXACT) / found.standard_errors)
    assert 0.6 < np.sqrt(np.mean(np.square(off))) < 1.4


def test_port_and_starboard_are_mirrors(noisy):
    mirrored = [
        replace(
            one,
            signals={
                name: -values if name in ("v_mps", "r_radps", "psi_rad", "y_m", "delta_rad") else values
                for name, values in one.signals.items()
            },
        )
        for one in noisy
    ]
    found, other = equation_error(problem(noisy)), equation_error(problem(mirrored))
    np.testing.assert_allclose(other.values, found.values, rtol=1e-8)


def test_velocities_are_derived_from_heading_and_positions(noisy):
    asked = problem(noisy, seen=("motion.psi", "motion.x", "motion.y"))
    found = equation_error(asked)
    assert any("slope" in notice for notice in found.notices)
    yaw = [ESTIMATED.index(name) for name in ("Nv", "Nr", "Nd")]
    np.testing.assert_allclose(found.values[yaw], EXACT[yaw], rtol=0.05)
    assert np.all(np.abs(found.values - EXACT) < 4 * found.standard_errors)


def test_velocities_slower_than_the_heading_are_enough(noisy):
    """Speeds of a log once a second next to a yaw rate of five a second."""
    slow = []
    for one in noisy:
        signals = dict(one.signals)
        for name in ("u_mps", "v_mps"):
            signals[name] = np.where(np.arange(len(one.time_s)) % 5 == 0, signals[name], np.nan)
        slow.append(replace(one, signals=signals))
    found = equation_error(problem(slow))
    assert np.abs((found.values - EXACT) / found.standard_errors).max() < 4.0
    fewer = found.standard_errors / equation_error(problem(noisy)).standard_errors
    assert 1.0 < np.median(fewer) < 2 * np.sqrt(5)


def test_what_cannot_be_derived_is_refused(noisy):
    with pytest.raises(InputError, match="neither velocities nor positions; give u_mps and v_mps"):
        equation_error(problem(noisy, seen=("motion.r", "motion.psi")))
    with pytest.raises(InputError, match="neither yaw rate nor heading"):
        equation_error(problem(noisy, seen=("motion.u", "motion.v")))


def test_a_gap_takes_its_windows_only(noisy):
    holed = noisy[0].signals["r_radps"].copy()
    holed[500:600] = np.nan
    gapped = replace(noisy[0], signals={**noisy[0].signals, "r_radps": holed})
    form = WeakForm(problem([gapped]))
    assert len(form.pieces) == 2
    found = equation_error(problem([gapped, *noisy[1:]]))
    assert np.all(np.abs(found.values - EXACT) < 4 * found.standard_errors)


def test_a_run_without_long_stretches_is_refused(noisy):
    holed = noisy[0].signals["r_radps"].copy()
    holed[::20] = holed[1::20] = holed[2::20] = holed[3::20] = np.nan
    holed_trial = replace(noisy[0], signals={**noisy[0].signals, "r_radps": holed})
    with pytest.raises(InputError, match="no stretch long enough"):
        equation_error(problem([holed_trial], seen=("motion.u", "motion.v", "motion.r")))
    derived = WeakForm(problem([holed_trial])).runs[0]  # by the heading, which has no gaps
    assert len(derived.change) and any("readings of r" in notice for notice in derived.motion.notices)


def test_velocities_that_were_read_in_short_bursts_are_derived_from_heading_and_positions(noisy):
    """A log that had a fix now and then: rows exist, and u, v and r are in a quarter of them."""
    bursts = []
    for one in noisy:
        known = one.time_s % 20.0 < 5.0
        seldom = {name: np.where(known, one.signals[name], np.nan) for name in ("u_mps", "v_mps", "r_radps")}
        bursts.append(replace(one, signals={**one.signals, **seldom}))
    found = equation_error(problem(bursts))
    by_positions = equation_error(problem(noisy, seen=("motion.psi", "motion.x", "motion.y")))
    np.testing.assert_allclose(found.values, by_positions.values, rtol=1e-6)
    assert any("readings of u, v, r are too far apart" in notice for notice in found.notices)


def test_noise_left_in_regressors_is_reported():
    loud = [trial(zigzag(5), noise=20.0)]
    assert any("is noise" in notice for notice in equation_error(problem(loud)).notices)


def test_a_parameter_that_no_acceleration_depends_on_is_reported(noisy):
    asked = problem(noisy, free=("Nd",))
    blind = replace(
        asked, free=(*asked.free, "initial.psi"), prior_mean=np.array([0.0015, 0.3]), prior_error=np.array([3e-4, 0.1])
    )
    found = equation_error(blind)
    assert found.values[1] == 0.3
    assert found.standard_errors[1] == pytest.approx(0.1)
    assert any("initial.psi" in notice for notice in found.notices)


def test_progress_may_stop_it(noisy):
    def stop(stage, values, cost):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        equation_error(problem(noisy), progress=stop)


@pytest.mark.slow
def test_seven_runs_take_a_second_or_two():
    asked = problem([trial(zigzag(20), duration=100.0)])
    equation_error(asked)  # compiles
    long = problem([trial(zigzag(20), duration=460.0, step=0.1, seed=seed) for seed in range(2)])
    asked = asked.with_runs((*long.runs, *long.runs, *long.runs, long.runs[0]))
    begin = time.perf_counter()
    equation_error(asked)
    assert time.perf_counter() - begin < 10.0  # 0.5 s on an idle core; others may run beside


def test_the_made_up_ship_is_the_one_of_the_model():
    """The two writings of the equations agree: else every test here would be in vain."""
    asked = problem([trial(zigzag(20), duration=30.0)])
    state = np.array([4.6, 0.4, -0.02, 0.3, 0.0, 0.0])
    model = asked.model
    x = np.zeros(len(model.states))
    for name, value in zip(("u", "v", "r", "psi", "x", "y"), state, strict=True):
        x[model.state_names.index(f"motion.{name}")] = value
    rates = np.array(model.rhs(x, model.input_values({"rudder.command": 0.2}), model.parameter_values())).ravel()
    own = [rates[model.state_names.index(f"motion.{name}")] for name in "uvr"]
    np.testing.assert_allclose(own, accelerations(4.6, 0.4, -0.02, 0.2, TRUTH), rtol=1e-10)


def test_correlated_knowledge_is_weighed_as_in_the_formula_of_a_normal_prior(noisy):
    """The model is linear in its coefficients: the estimate is (I + P)^-1 (I best + P mean), P the full precision."""
    plain = problem(noisy[:1])
    k = len(plain.free)
    correlation = 0.95 ** np.abs(np.subtract.outer(np.arange(k), np.arange(k)))
    asked = replace(plain, prior_inverse=np.linalg.inv(correlation))
    settings = EquationErrorSettings(rounds=1, scale_prior=False)
    wide = equation_error(replace(plain, prior_error=1e6 * plain.prior_error), settings=settings)
    found = equation_error(asked, settings=settings)
    P = np.linalg.inv(correlation * np.outer(plain.prior_error, plain.prior_error))
    information = wide.information
    expected = np.linalg.solve(information + P, information @ wide.values + P @ plain.prior_mean)
    np.testing.assert_allclose(found.values, expected, rtol=1e-5, atol=1e-3 * plain.prior_error.min())
    independent = equation_error(plain, settings=settings).values
    assert np.abs(found.values - independent).max() > 0.01 * plain.prior_error.max()
    P = asked.without(plain.free[:2]).prior_precision(plain.prior_error[2:])
    whole = asked.prior_precision(plain.prior_error)
    np.testing.assert_allclose(P, whole[2:, 2:])
