"""Random forces: found in trials that were made by an exact recursion, drawn as theory says, and what they do."""

import pickle
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from tank2sim.cards import parse_card
from tank2sim.errors import InputError
from tank2sim.identification.trials.assessment.prediction_intervals import (
    HARMONICS,
    LEVELS,
    Disturbances,
    bands,
    bootstrap,
    disturbances_of,
    disturbed,
    draw_disturbances,
    flat,
    generators,
    motion_factor,
)
from tank2sim.identification.trials.methods.equation_error import EquationErrorSettings as Equations
from tank2sim.identification.trials.methods.equation_error import equation_error
from tank2sim.identification.trials.methods.output_error import OutputErrorSettings, output_error
from tank2sim.identification.trials.problem.estimation_problem import DrivenShip, Estimate, Problem
from tank2sim.identification.trials.problem.problem_from_card import problem_from_card
from tank2sim.simulation.manoeuvres import Turn, Zigzag
from tank2sim.simulation.run import simulate
from tests.identification.trials.made_up_ship import (
    CARD,
    DENSITY,
    ESTIMATED,
    LENGTH,
    SPEED,
    TRUTH,
    gusts,
    model,
    problem,
    trial,
    turn,
    zigzag,
)
from tests.marks import first_fast

EXACT = np.array([TRUTH[name] for name in ESTIMATED])
UNITS = 0.5 * DENSITY * LENGTH**2 * SPEED**2 * np.array([1, 1, LENGTH])
SHIP = DrivenShip(CARD, "order")
FORCES = Disturbances(np.diag(([2e-5, 8e-5, 2e-5] * UNITS) ** 2), 15.0)


def known(error: float = 0.0, names=("Nd",)) -> Estimate:
    values = np.array([TRUTH[name] for name in names])
    covariance = np.diag((error * values) ** 2)
    free = tuple(f"derivatives.{name}" for name in names)
    return Estimate("made_up", free, values, covariance, np.eye(len(names)))


@first_fast("correlation_s", [4.0, 15.0])
def test_forces_of_trials_are_found(correlation_s):
    deviations = np.array([2e-5, 8e-5, 2e-5])
    trials = [
        trial(rudder, seed=k, duration=400.0, force=gusts(2001, 0.2, deviations, correlation_s, 10 + k))
        for k, rudder in enumerate([zigzag(20), turn(-30)])
    ]
    found = disturbances_of(problem(trials), EXACT)
    assert found.correlation_s == pytest.approx(correlation_s, rel=0.6)  # 800 s tell no better
    np.testing.assert_allclose(np.sqrt(np.diag(found.covariance)) / UNITS, deviations, rtol=0.3)


@pytest.fixture(scope="module")
def pushed() -> tuple[Problem, Estimate, Disturbances]:
    """Trials under random forces, their fit by output error, and the true forces."""
    deviations, correlation_s = np.array([2e-5, 8e-5, 2e-5]), 15.0
    trials = [
        trial(rudder, seed=k, duration=400.0, force=gusts(2001, 0.2, deviations, correlation_s, 10 + k))
        for k, rudder in enumerate([zigzag(20), turn(-30)])
    ]
    posed = replace(problem(trials), ship=DrivenShip(CARD, "angle"))
    estimate = output_error(posed, EXACT, OutputErrorSettings(piece_s=5 * posed.ship_time))
    return posed, estimate, Disturbances(np.diag((deviations * UNITS) ** 2), correlation_s)


@first_fast("times", [2.0, 1.0, 4.0])
def test_forces_that_moved_the_ship_have_their_size_and_others_are_sized_by_the_motion(pushed, times):
    posed, estimate, forces = pushed
    assert motion_factor(posed, estimate, forces.times(times)) == pytest.approx(1 / times, rel=0.25)


def test_without_forces_the_motion_calls_for_none():
    trials = [trial(rudder, seed=k) for k, rudder in enumerate([zigzag(20), turn(-30)])]
    posed = replace(problem(trials), ship=DrivenShip(CARD, "angle"))
    estimate = output_error(posed, EXACT, OutputErrorSettings(piece_s=5 * posed.ship_time))
    forces = Disturbances(np.diag(([2e-5, 8e-5, 2e-5] * UNITS) ** 2), 15.0)
    assert motion_factor(posed, estimate, forces) < 0.3, "of the motion, sensor noise is all"
    off = replace(estimate, values=np.where(np.array(ESTIMATED) == "Nd", 0.98, 1.0) * estimate.values)
    assert motion_factor(posed, off, forces) < 0.3, "an error that coefficients explain is no force"
    assert motion_factor(posed, estimate, forces.times(0.0)) == 1.0, "no force has no size"


def test_sensor_noise_is_not_taken_for_forces():
    trials = [trial(rudder, seed=k) for k, rudder in enumerate([zigzag(20), turn(-30)])]
    found = np.sqrt(np.diag(disturbances_of(problem(trials), EXACT).covariance)) / UNITS
    assert np.all(found < [2e-5, 8e-5, 2e-5])


def test_drawn_forces_have_the_covariance_of_a_gauss_markov_process():
    covariance = np.array([[4.0, 1.0, 0.0], [1.0, 9.0, -5.0], [0.0, -5.0, 16.0]])
    forces, rng = Disturbances(covariance, 20.0), np.random.default_rng(1)
    lags = np.array([0.0, 5.0, 20.0, 40.0])
    total = np.zeros((len(lags), 3, 3))
    for _ in range(3000):
        values = draw_disturbances(forces, 1e3, rng)
        rates = np.array([values[f"disturbance.rate_{j}"] for j in range(HARMONICS)])
        a, b = (
            np.array([[values[f"disturbance.{force}_{wave}_{j}"] for j in range(HARMONICS)] for force in "XYN"])
            for wave in ("cos", "sin")
        )
        now = a.sum(axis=1)
        later = [a @ np.cos(rates * lag) + b @ np.sin(rates * lag) for lag in lags]
        total += [np.outer(one, now) for one in later]
    expected = np.exp(-lags / 20.0)[:, None, None] * covariance
    np.testing.assert_allclose(total / 3000, expected, atol=1.0)


def test_a_force_accelerates_the_mass_and_time_moves_it():
    ship = disturbed(model(by_angle=False))
    p = ship.parameter_values({"disturbance.rate_0": np.pi, "disturbance.X_cos_0": 1e5})
    rest = ship.parameter_values()
    x = np.array(ship.initial(p)).ravel()
    mass = (0.010 + 0.0006) * 0.5 * DENSITY * LENGTH**3
    for time, force in ((0.0, 1e5), (1.0, -1e5)):
        x[ship.state_names.index("disturbance.clock")] = time
        change = np.array(ship.rhs(x, ship.input_values(), p)) - np.array(ship.rhs(x, ship.input_values(), rest))
        assert change[ship.state_names.index("motion.u"), 0] == pytest.approx(force / mass, rel=1e-9)


def test_without_forces_and_scatter_all_members_are_the_manoeuvre_itself():
    found = bands(SHIP, known(), Turn(0.35), generators(3))
    plain = flat(simulate(model(by_angle=False), Turn(0.35)).figures)
    for name, values in found.items():
        np.testing.assert_allclose(values, plain[name], rtol=1e-9)


@pytest.mark.slow
def test_small_scatter_of_a_coefficient_goes_through_linearly():
    error = 0.01
    found = bands(SHIP, known(error), Turn(0.35), generators(80))
    ship = model(by_angle=False)
    after, before = (
        flat(simulate(ship, Turn(0.35), parameters={"derivatives.Nd": TRUTH["Nd"] * (1 + side * error)}).figures)
        for side in (1, -1)
    )
    for name in ("advance_m", "tactical_diameter_m", "time_90_s"):
        expected = abs(after[name] - before[name]) / 2
        assert found[name].std() == pytest.approx(expected, rel=0.25)
        low, middle, high = np.nanquantile(found[name], LEVELS)
        assert high - low == pytest.approx(2 * 1.96 * expected, rel=0.35)
        assert low < middle < high


def test_port_and_starboard_have_the_same_bands():
    port, starboard = (bands(SHIP, known(0.05, ("Nr", "Nd")), Turn(angle), generators(10)) for angle in (-0.4, 0.4))
    np.testing.assert_allclose(port["advance_m"], starboard["advance_m"], rtol=1e-9)


def test_members_hang_on_the_seed_and_not_on_the_executor():
    asked = SHIP, known(0.05), Zigzag(0.35, 0.35)
    here = bands(*asked, generators(6, 4), FORCES)
    with ThreadPoolExecutor(3) as executor:
        there = bands(*asked, generators(6, 4), FORCES, executor)
    for name, values in here.items():
        np.testing.assert_array_equal(values, there[name])
    other = bands(*asked, generators(6, 5), FORCES)
    assert not np.allclose(other["overshoots_deg.1"], here["overshoots_deg.1"])
    assert here["overshoots_deg.1"].std() > 0.05
    pickle.loads(pickle.dumps((asked, FORCES, generators(6))))


def test_a_ship_that_always_runs_away_is_reported():
    wild = replace(known(), free=("derivatives.Yvvv",), values=np.array([1e6]))
    with pytest.raises(InputError, match="every member"):
        bands(SHIP, wild, Turn(0.35), generators(2))


@pytest.mark.slow
def test_bootstrap_scatters_as_the_standard_errors_say():
    card = parse_card(CARD, "made_up.toml")
    trials = [trial(zigzag(20), name="zigzag", seed=1, duration=200.0), trial(turn(-30), seed=2, duration=200.0)]
    posed = problem_from_card(card, trials, "angle")
    keep = [posed.free.index(f"derivatives.{name}") for name in ("Nv", "Nr", "Nd")]
    few = replace(
        posed,
        free=tuple(posed.free[place] for place in keep),
        prior_mean=posed.prior_mean[keep],
        prior_error=10 * posed.prior_error[keep],
    )
    estimator = partial(equation_error, settings=Equations(rounds=2, scale_prior=False))
    found = estimator(few)
    quiet = Disturbances(np.zeros((3, 3)), 10.0)
    again = bootstrap(few, found, estimator, quiet, generators(16))
    assert again.shape == (16, 3)
    ratio = again.std(axis=0, ddof=1) / found.standard_errors
    assert np.all((ratio > 0.35) & (ratio < 1.5))  # few blocks of time: the standard errors are on the safe side


@pytest.mark.long
def test_bands_hold_what_happens():
    """Manoeuvres of the made-up ship in gusts of an exact recursion, integrated by scipy: 95 % of them in the band."""
    found = bands(SHIP, known(), Turn(0.35), generators(200, 1), FORCES)
    inside = []
    for seed in range(60):
        force = gusts(601, 0.5, [2e-5, 8e-5, 2e-5], 15.0, seed)
        run = trial(turn(np.degrees(0.35), 30.0, 0.0), duration=300.0, step=0.5, noise=0.0, force=force)
        psi, x, y = (run.signals[name] for name in ("psi_rad", "x_m", "y_m"))
        at = float(np.interp(np.pi / 2, psi - psi[0], run.time_s))
        along = np.interp(at, run.time_s, x * np.cos(psi[0]) + y * np.sin(psi[0]))
        low, _, high = np.nanquantile(found["advance_m"], LEVELS)
        inside.append(low < along < high)
    assert 0.85 <= np.mean(inside) <= 1.0
