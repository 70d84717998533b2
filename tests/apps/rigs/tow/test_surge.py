"""Equation (1.5): against closed forms and the integrations of the paper."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from tank2sim.apps.rigs.tow.surge import SurgeCoefficients, drag, surge_model
from tank2sim.simulation.scheme import runge_kutta_step

FORCE_N = 11.63
TIMES_S = np.arange(0, 51, 5.0)
# mean speeds as printed in Table 1
PRINTED_MEAN_MPS = np.array([0, 0.0148, 0.0282, 0.0536, 0.074, 0.095, 0.11, 0.1224, 0.1408, 0.1524, 0.169])


def run(model, duration_s, step_s=None, inputs=None, parameters=None):
    """States (steps + 1, 2) from the start, at every step."""
    step_s = step_s or model.step_s
    count = round(duration_s / step_s)
    along = runge_kutta_step(model).mapaccum(count)
    p = model.parameter_values(parameters)
    start = model.initial(p)
    path = along(start, model.input_values(inputs), p, step_s)
    return np.vstack([np.array(start).T, np.array(path).T])


def coefficients(mass, b1=0.0, b2=0.0, b3=0.0):
    return SurgeCoefficients(total_mass_kg=mass, B1_kgs2pm3=b1, B2_kgspm2=b2, B3_kgpm=b3)


@pytest.mark.parametrize(
    ("values", "largest", "at_s", "tolerance"),
    [
        ((2550, 92418, -26096, 2015), 0.0142, 10.0, 1e-4),  # (2.4)
        ((2775.71, 13033.2, -4553.94, 557.27), 0.0128, 10.0, 1e-4),  # solution of (1.12)
        ((2550, 92418, 26096, 2015), 0.113, 50.0, 5e-4),  # the sign printed in (2.3)
    ],
)
def test_distance_from_the_tows_is_that_of_the_paper(values, largest, at_s, tolerance):
    path = run(surge_model("vehicle", coefficients(*values), FORCE_N), 50.0)
    distance = np.abs(path[::50, 1] - PRINTED_MEAN_MPS)
    assert distance.max() == pytest.approx(largest, abs=tolerance)
    assert TIMES_S[distance.argmax()] == at_s


def test_quadratic_drag_gives_the_closed_form():
    mass, b3 = 3000.0, 150.0
    path = run(surge_model("vehicle", coefficients(mass, b3=b3), FORCE_N), 200.0)
    t = np.linspace(0, 200, len(path))
    top, time_constant = np.sqrt(FORCE_N / b3), mass / np.sqrt(FORCE_N * b3)
    np.testing.assert_allclose(path[:, 1], top * np.tanh(t / time_constant), atol=1e-11)
    np.testing.assert_allclose(path[:, 0], top * time_constant * np.log(np.cosh(t / time_constant)), atol=1e-9)


def test_every_term_acts_with_its_power():
    mass, b1, b2, b3 = 3000.0, 30000.0, 2000.0, 100.0
    truth = solve_ivp(
        lambda t, v: (FORCE_N - b1 * v**4 - b2 * v**3 - b3 * v**2) / mass, (0, 50), [0.0], rtol=1e-12, atol=1e-14
    )
    path = run(surge_model("vehicle", coefficients(mass, b1, b2, b3), FORCE_N), 50.0)
    assert path[-1, 1] == pytest.approx(truth.y[0, -1], rel=1e-9)


def test_drag_opposes_motion_astern_as_ahead():
    speeds = np.linspace(0.01, 2, 50)
    ahead = drag(speeds, 3.0, 2.0, 1.0)
    np.testing.assert_allclose(ahead, 3 * speeds**4 + 2 * speeds**3 + speeds**2, rtol=1e-14)
    np.testing.assert_allclose(drag(-speeds, 3.0, 2.0, 1.0), -ahead, rtol=1e-14)


def test_a_body_going_astern_slows_down_without_force():
    model = surge_model("vehicle", coefficients(100.0, 5.0, 5.0, 5.0), 0.0)
    path = run(model, 10.0, parameters={"initial.u": -1.0, "initial.x": 3.0})
    assert path[0, 0] == 3.0
    assert -1.0 < path[-1, 1] < 0
    assert np.all(np.diff(path[:, 1]) > 0)


def test_halving_the_step_changes_nothing_that_matters():
    fast = surge_model("small model", coefficients(12.0, b3=6.0), 6.0)
    assert run(fast, 10.0)[-1, 1] == pytest.approx(run(fast, 10.0, fast.step_s / 2)[-1, 1], rel=1e-7)


def test_interface_is_that_of_the_surge_model():
    model = surge_model("vehicle", coefficients(2550, 92418, -26096, 2015), FORCE_N)
    assert model.state_names == ("motion.x", "motion.u")
    assert model.input_names == ("tow.force",)
    surge = [f"surge.{name}" for name in ("total_mass", "B1", "B2", "B3")]
    assert model.parameter_names == (*surge, "initial.x", "initial.u")
    assert model.outputs == ("motion.x", "motion.u", "motion.udot", "force.drag")
    np.testing.assert_array_equal(model.parameter_values(), [2550, 92418, -26096, 2015, 0, 0])
    np.testing.assert_array_equal(model.input_values(), [FORCE_N])
    assert [p.name for p in model.parameters if not p.tunable] == ["initial.x", "initial.u"]
    x, u, acceleration, resistance = np.array(model.output([1.0, 0.1], [FORCE_N], model.parameter_values())).ravel()
    assert (x, u) == (1.0, 0.1)
    assert resistance == pytest.approx(9.2418 - 26.096 + 20.15, rel=1e-12)
    assert acceleration == pytest.approx((FORCE_N - resistance) / 2550, rel=1e-12)


def test_validity_is_one_in_the_range_and_falls_to_zero_outside():
    model = surge_model("vehicle", coefficients(100.0), 1.0, valid_speed_mps=(0.2, 0.6))
    place = model.outputs.index("validity")
    speeds = [0.2, 0.4, 0.6, 0.7, 0.1, 0.8, 0.0, 2.0, -1.0]
    values = [float(model.output([0, u], [1.0], model.parameter_values())[place]) for u in speeds]
    np.testing.assert_allclose(values, [1, 1, 1, 0.5, 0.5, 0, 0, 0, 0], atol=1e-12)
