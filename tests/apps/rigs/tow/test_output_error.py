"""The fit of the integrated speeds: the re-analysis of the tows, closed forms, sensitivities."""

import numpy as np
import pytest
from numpy.polynomial import Polynomial
from scipy import stats
from scipy.integrate import solve_ivp

from tank2sim.apps.rigs.tow.output_error import TowModel, fit_speeds, simulated_speeds, speed_predictor
from tank2sim.apps.rigs.tow.study import SIMPLE
from tank2sim.apps.rigs.tow.surge import SurgeCoefficients
from tank2sim.errors import InputError
from tank2sim.identification.conditioning import scaled_condition
from tests.apps.rigs.tow.made_tows import tows_of

FORCE_N = 11.63


# papers.md 1.7: estimates, their 95 % half-widths, scatter, scaled condition of J'J
@pytest.mark.parametrize(
    ("terms", "estimates", "half_widths", "scatter", "condition"),
    [
        ((), [3336], [63], 0.00689, 1),
        (("B3",), [3148, 97], [141, 66], 0.00641, 19),
        (("B2", "B3"), [3344, 3381, -388], [295, 4413, 643], 0.00629, 1.6e3),
        (("B1", "B2", "B3"), [4047, -306602, 82889, -5520], [571, 222881, 58490, 3864], 0.00570, 5.5e5),
    ],
)
def test_table_1_gives_the_estimates_of_the_reanalysis(table_1, terms, estimates, half_widths, scatter, condition):
    fit = fit_speeds(table_1, FORCE_N, TowModel(terms))
    found = stats.t.ppf(0.975, 48 - len(estimates)) * np.sqrt(np.diag(fit.covariance))
    np.testing.assert_allclose(fit.estimates, estimates, rtol=0.01)
    np.testing.assert_allclose(found, half_widths, rtol=0.04)
    assert fit.scatter_mps == pytest.approx(scatter, abs=5e-6)
    assert scaled_condition(fit.design) ** 2 == pytest.approx(condition, rel=0.06)


def test_each_tow_alone(table_1):
    expected = [(3374, 56), (3350, 37), (3100, 89), (2898, 185), (3067, 103)]
    for number, pair in enumerate(expected):
        np.testing.assert_allclose(fit_speeds(table_1.only(number), FORCE_N, SIMPLE).estimates, pair, atol=0.6)


def test_speeds_are_those_of_the_closed_form_at_uneven_times():
    mass, b3 = 3000.0, 150.0
    top, time_constant = np.sqrt(FORCE_N / b3), mass / np.sqrt(FORCE_N * b3)
    times = np.array([0.03, 0.1, 0.35, 7.0, 7.5, 60.0])
    coefficients = SurgeCoefficients(total_mass_kg=mass, B3_kgpm=b3)
    np.testing.assert_allclose(simulated_speeds(coefficients, FORCE_N, times), top * np.tanh(times / time_constant))
    with_start = simulated_speeds(coefficients, FORCE_N, np.array([0.0, 5.0]))
    np.testing.assert_allclose(with_start, [0, top * np.tanh(5.0 / time_constant)])


@pytest.mark.parametrize(
    ("model", "force", "point"),
    [
        (TowModel(), FORCE_N, [3000.0, 20000.0, 500.0, 100.0]),
        (TowModel(("B2", "B3"), start_delay=True), Polynomial([12.0, 0.1, -0.0015]), [3000.0, 500.0, 100.0, 6.3]),
    ],
)
def test_sensitivities_are_those_of_differences(model, force, point):
    point = np.array(point)
    predict = speed_predictor(np.array([0.0, 5, 20, 50]), force, model)
    sensitivity = predict(point)[1]
    at_rest = 2 if model.start_delay else 1
    assert np.all(sensitivity[:at_rest] == 0)
    for k, value in enumerate(point):
        change = np.zeros(4)
        change[k] = 1e-4 * value
        difference = (predict(point + change)[0] - predict(point - change)[0]) / (2 * change[k])
        np.testing.assert_allclose(sensitivity[:, k], difference, rtol=1e-6, atol=1e-15)


@pytest.mark.parametrize(
    ("truth", "force", "end_s"),
    [
        ({"M": 3000.0, "B3": 150.0}, 11.63, 60.0),
        ({"M": 3000.0, "B2": 600.0, "B3": 100.0}, 11.63, 200.0),
        ({"M": 12.0, "B3": 6.0}, 3.0, 8.0),  # a small model that nearly reaches its steady speed
        ({"M": 9e6, "B3": 5e3}, 2e5, 300.0),
    ],
)
def test_the_truth_comes_back_from_exact_tows(truth, force, end_s):
    def rate(_, v):
        return (force - sum(truth.get(f"B{n}", 0) * v ** (5 - n) for n in (1, 2, 3))) / truth["M"]

    times = np.linspace(0, end_s, 41)
    speeds = solve_ivp(rate, (0, end_s), [0.0], t_eval=times, rtol=1e-11, atol=1e-13).y[0]
    readings = np.column_stack([speeds, speeds])
    readings[3, 1] = np.nan
    tows = tows_of(times, readings)
    fit = fit_speeds(tows, force, TowModel(tuple(name for name in truth if name != "M")))
    np.testing.assert_allclose(fit.estimates, list(truth.values()), rtol=1e-5)


@pytest.mark.slow
def test_standard_errors_are_the_spread_of_repeated_tows():
    rng = np.random.default_rng(3)
    coefficients = SurgeCoefficients(total_mass_kg=3000.0, B3_kgpm=150.0)
    times = np.arange(0, 51, 5.0)
    exact = simulated_speeds(coefficients, FORCE_N, times)
    fits = []
    for _ in range(150):
        noise = 0.006 * rng.standard_normal((11, 5))
        noise[0] = 0
        fits.append(fit_speeds(tows_of(times, exact[:, None] + noise), FORCE_N, SIMPLE))
    spread = np.std([fit.estimates for fit in fits], axis=0)
    reported = np.median([np.sqrt(np.diag(fit.covariance)) for fit in fits], axis=0)
    np.testing.assert_allclose(reported, spread, rtol=0.2)


def test_too_few_readings_are_refused():
    tows = tows_of(np.arange(3.0), [0.0, 0.1, 0.2], "few.csv")
    with pytest.raises(InputError, match=r"few\.csv: 2 readings after the release do not test 2 estimates"):
        fit_speeds(tows, FORCE_N, SIMPLE)
