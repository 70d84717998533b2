"""The transient glider against independent integrations, closed forms, the balance of energy and mirrors; its card."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import cumulative_simpson, solve_ivp

from tank2sim.apps.rigs.glider.card import GliderCard
from tank2sim.apps.rigs.glider.model import glider_warnings
from tank2sim.cards import parse_card, read_card
from tank2sim.dynamics import build
from tank2sim.errors import InputError
from tank2sim.simulation.integrator import Integrator

PROBE = read_card("kulikovsky-velikanov")
MODEL = build(PROBE)
MASS, AXIAL, NORMAL, HALF, G = 50.0, 1.78, 46.7, 0.5 * 1000 * 0.1579936973, 9.81
LAGS = (10.0, 5.0, 5.0)


@pytest.fixture(scope="module")
def integrator():
    return Integrator(MODEL)


def start(**values: float) -> np.ndarray:
    x = np.zeros(9)
    for name, value in values.items():
        x[MODEL.state_names.index(name.replace("_", "."))] = value
    return x


def orders(buoyancy: float, pitch: float, roll: float = 0.0) -> np.ndarray:
    return MODEL.input_values({"buoyancy.command": buoyancy, "pitch.command": pitch, "roll.command": roll})


def flown(integrator, x, u, duration):
    p = MODEL.parameter_values()
    states = integrator.rollout(x, u, p, MODEL.step_s, round(duration / MODEL.step_s))
    return states, integrator.outputs(states, np.repeat(u[None], len(states), axis=0), p)


def signal(y, name):
    return y[:, MODEL.outputs.index(name)]


def turned(axis: int, angle: float) -> np.ndarray:
    """Rotation matrix about an axis (0 x, 1 y, 2 z), right-handed."""
    c, s = math.cos(angle), math.sin(angle)
    matrix = np.eye(3)
    i, j = (axis + 1) % 3, (axis + 2) % 3
    matrix[i, i] = matrix[j, j] = c
    matrix[i, j], matrix[j, i] = -s, s
    return matrix


def carried(q: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Momentum, velocity and axis of the lift (north, east, down) for u, w, course, pitch and roll."""
    u, w, course, pitch, roll = q
    alpha = math.atan2(w, u)
    path = turned(2, course) @ turned(1, pitch - alpha) @ turned(0, roll)
    body = path @ turned(1, alpha)
    own = np.array([u, 0.0, w])
    return body @ (np.array([MASS + AXIAL, MASS, MASS + NORMAL]) * own), body @ own, -path[:, 2]


def independent(_, x: np.ndarray, u: np.ndarray) -> np.ndarray:
    """dP/dt = F in earth axes, the derivatives of the momentum by differences."""
    motion, controls = x[3:6], x[6:9]
    rates = (u - controls) / np.array(LAGS)
    q = np.array([motion[1], motion[2], motion[0], controls[1], controls[2]])
    columns = []
    for place in range(5):
        step = np.zeros(5)
        step[place] = 1e-6
        columns.append((carried(q + step)[0] - carried(q - step)[0]) / 2e-6)
    _, velocity, up = carried(q)
    speed, alpha = float(np.linalg.norm(velocity)), math.atan2(q[1], q[0])
    held = max(-math.radians(30), min(math.radians(30), alpha))
    lift = HALF * speed**2 * (11.76 * held + 4.6 * held * abs(held))
    drag = HALF * speed * (0.214 + 32.2 * held**2)
    force = lift * up - drag * velocity + np.array([0, 0, -controls[0] * G])
    left = force - columns[3] * rates[1] - columns[4] * rates[2]
    udot, wdot, turn = np.linalg.solve(np.column_stack(columns[:3]), left)
    return np.array([*velocity, turn, udot, wdot, *rates])


@pytest.mark.parametrize(
    ("begin", "order"),
    [
        ((-0.25, -0.48, 0.0), (0.25, 0.48, 0.0)),  # from dive to climb
        ((-0.25, -0.48, 0.0), (-0.3, -0.6, 0.3)),  # into a turn, steeper and heavier
        ((0.25, 0.5, -0.2), (0.1, 0.9, 0.3)),  # from turn to turn while climbing
    ],
)
def test_the_motion_is_that_of_an_independent_integration(integrator, begin, order) -> None:
    x = start(
        motion_u=0.24,
        motion_w=-math.copysign(0.01, begin[1]),
        motion_psi=0.4,
        buoyancy_mass=begin[0],
        pitch_angle=begin[1],
        roll_angle=begin[2],
    )
    states, _ = flown(integrator, x, orders(*order), 40.0)
    truth = solve_ivp(
        independent, (0, 40.0), x, args=(np.array(order),), method="LSODA", rtol=1e-9, atol=1e-10, t_eval=[10, 25, 40.0]
    )
    found = states[[round(t / MODEL.step_s) for t in truth.t]].T
    assert found == pytest.approx(truth.y, rel=2e-6, abs=2e-7)


def test_without_buoyancy_a_level_glider_coasts_as_the_closed_form(integrator) -> None:
    x, speed = start(motion_u=0.3), 0.3
    states, y = flown(integrator, x, orders(0.0, 0.0), 100.0)
    time = np.arange(len(states)) * MODEL.step_s
    rate = HALF * 0.214 * speed / (MASS + AXIAL)
    assert states[:, 4] == pytest.approx(speed / (1 + rate * time), rel=1e-9)
    assert states[:, 0] == pytest.approx(speed / rate * np.log1p(rate * time), rel=1e-9)
    assert signal(y, "motion.z") == pytest.approx(0, abs=1e-15)


@pytest.mark.parametrize(("buoyancy", "w"), [(-0.25, 0.05), (0.4, -0.03), (0.0, 0.04)])
def test_power_is_buoyancy_times_climb_less_drag(integrator, buoyancy, w) -> None:
    pitch = -0.5 if buoyancy < 0 else 0.5
    x = start(motion_u=0.35, motion_w=w, buoyancy_mass=buoyancy, pitch_angle=pitch)
    states, y = flown(integrator, x, orders(buoyancy, pitch), 60.0)
    energy = 0.5 * ((MASS + AXIAL) * states[:, 4] ** 2 + (MASS + NORMAL) * states[:, 5] ** 2)
    climb = signal(y, "motion.speed") * np.sin(signal(y, "motion.path_angle"))
    power = buoyancy * G * climb - signal(y, "force.drag") * signal(y, "motion.speed")
    work = cumulative_simpson(power, dx=MODEL.step_s, initial=0.0)
    # Simpson's rule is of the fourth order at every second sample alone.
    assert (energy - energy[0])[::2] == pytest.approx(work[::2], abs=2e-5 * energy[0])
    if not buoyancy:
        assert np.all(np.diff(energy) < 0)


def test_nothing_moves_at_rest_without_buoyancy_and_a_glider_starts_from_rest(integrator) -> None:
    states, _ = flown(integrator, np.zeros(9), orders(0.0, 0.0), 10.0)
    assert np.all(states == 0)
    states, y = flown(integrator, np.zeros(9), orders(-0.25, -0.4858, 0.1), 400.0)
    assert np.isfinite(states).all()
    assert signal(y, "motion.speed")[-1] == pytest.approx(0.2434, abs=1e-3)


@settings(max_examples=20, deadline=None)
@given(
    st.floats(0.05, 1.0), st.floats(-0.3, 0.3), st.floats(-1.0, 1.0), st.floats(-0.8, 0.8), st.floats(-0.5, 0.5)
)  # fmt: skip
def test_mirrors_left_to_right_and_upside_down(u, w, buoyancy, pitch, roll) -> None:
    p = MODEL.parameter_values()

    def rates(w, buoyancy, pitch, roll):
        x = start(motion_u=u, motion_w=w, buoyancy_mass=buoyancy, pitch_angle=pitch, roll_angle=roll)
        return np.array(MODEL.rhs(x, orders(-buoyancy, 0.5 * pitch, 0.2 * roll), p)).ravel()

    here = rates(w, buoyancy, pitch, roll)
    #                      x   y   z  psi  u   w  m0  th  ga
    across = np.array([1, -1, 1, -1, 1, 1, 1, 1, -1])
    over = np.array([1, 1, -1, 1, 1, -1, -1, -1, -1])
    assert rates(w, buoyancy, pitch, -roll) == pytest.approx(across * here, rel=1e-10, abs=1e-13)
    assert rates(-w, -buoyancy, -pitch, -roll) == pytest.approx(over * here, rel=1e-10, abs=1e-13)


def test_halving_the_step_changes_nothing_that_matters(integrator) -> None:
    x, u = start(motion_u=0.24, buoyancy_mass=-0.25, pitch_angle=-0.5), orders(0.25, 0.5, 0.2)
    p = MODEL.parameter_values()
    coarse = integrator.rollout(x, u, p, MODEL.step_s, 800)[-1]
    fine = integrator.rollout(x, u, p, MODEL.step_s / 2, 1600)[-1]
    assert coarse == pytest.approx(fine, rel=1e-6, abs=1e-7)


def test_the_card_is_reported_to_contradict_itself() -> None:
    reported = " ".join(MODEL.notices)
    assert "0.0628 m3" in reported and "+12.8 kg" in reported and "0.05 m3" in reported
    assert "V^(2/3)" in reported and "attitude is prescribed" in reported
    right = read_card("kulikovsky-velikanov", {"glider.volume_m3": 0.05, "glider.reference_area_m2": 0.0356})
    assert glider_warnings(right) == ()


def test_the_interface_is_that_of_a_glider() -> None:
    assert MODEL.input_names == ("buoyancy.command", "pitch.command", "roll.command")
    assert {"motion.z", "motion.psi", "motion.incidence", "force.lift", "validity"} <= set(MODEL.outputs)


def test_the_step_follows_the_size_of_the_glider() -> None:
    assert MODEL.step_s == 0.05
    small = {"mass_kg": 0.5, "volume_m3": 0.0005, "buoyancy_kg": 0.01, "reference_area_m2": 0.006}
    small |= {"added_mass_axial_kg": 0.02, "added_mass_normal_kg": 0.45}
    model = build(read_card("kulikovsky-velikanov", {f"glider.{key}": value for key, value in small.items()}))
    assert model.step_s == 0.01
    x = np.array(model.initial(model.parameter_values())).ravel()
    own = Integrator(model, compiled=False)
    arguments = (x, model.input_values({"pitch.command": 0.5, "buoyancy.command": 0.01}), model.parameter_values())
    coarse, fine = (own.rollout(*arguments, model.step_s / n, 1000 * n)[-1] for n in (1, 2))
    assert coarse == pytest.approx(fine, rel=1e-5, abs=1e-6)


def test_the_bundled_probe_has_the_numbers_of_the_paper() -> None:
    assert isinstance(PROBE, GliderCard) and PROBE.model.kind == "glider"
    own = PROBE.glider
    assert (own.lift_slope, own.lift_quadratic, own.drag_zero, own.drag_quadratic) == (11.76, 4.6, 0.214, 32.2)
    assert (own.mass_kg, own.volume_m3) == (50.0, 0.0628)
    assert own.reference_area_m2 == pytest.approx(0.0628 ** (2 / 3), rel=1e-9)


@pytest.mark.parametrize(
    ("key", "value", "words"),
    [
        ("reference_area_m2", -0.1, "glider.reference_area_m2"),
        ("drag_zero", 0, "glider.drag_zero"),
        ("mass_kg", float("nan"), "glider.mass_kg"),
        ("span_m", 1.0, "glider.span_m"),
    ],
)
def test_a_value_at_fault_is_refused_with_its_key(key, value, words) -> None:
    with pytest.raises(InputError, match=words):
        read_card("kulikovsky-velikanov", {f"glider.{key}": value})


def test_a_card_without_its_reference_area_is_refused() -> None:
    text = "\n".join(line for line in PROBE.text.splitlines() if not line.startswith("reference_area_m2"))
    with pytest.raises(InputError, match="reference_area_m2: is missing"):
        parse_card(text, "probe.toml")
