"""A made-up third-order ship that gusts push about: once as a model to be identified, once in plain numpy and scipy."""

from __future__ import annotations

import casadi as ca
import numpy as np
from scipy.integrate import solve_ivp

from tank2sim.dynamics.model import Input, Model, Parameter, Quantity, State, Variable
from tank2sim.identification.trials.problem.estimation_problem import Problem
from tank2sim.identification.trials.problem.sampled_runs import SampledRun

TRUTH = {
    "Xu": -0.04,
    "Xrr": -40.0,
    "Yv": -0.05,
    "Yr": -2.0,
    "Yd": -0.1,
    "Nv": 5e-4,
    "Nr": -0.1,
    "Nrrr": -60.0,
    "Nd": 0.01,
}
"""Accelerations per unit of motion and rudder, in m, s and rad."""

VALUES = np.array(list(TRUTH.values()))
SPEED, STEP = 5.0, 1.0
SEEN = ("motion.u", "motion.v", "motion.r", "motion.psi", "motion.x", "motion.y")
NOISE = np.array([0.03, 0.03, 4e-4, 3e-3, 0.6, 0.6])
PUSH = np.array([0.01, 0.01, 2e-4])
"""Standard deviations of the random accelerations on u, v and r."""

TIME = 8.0
"""Their time constant, s."""

STATES = (
    ("x", "m", "m/s", 50.0),
    ("y", "m", "m/s", 50.0),
    ("psi", "rad", "rad/s", 1.0),
    ("u", "m/s", "m/s2", SPEED),
    ("v", "m/s", "m/s2", 0.5),
    ("r", "rad/s", "rad/s2", 0.03),
)
PLANS = ((240, 0.17, 80.0), (240, 0.35, 120.0), (200, 0.35, 1000.0))
"""Seconds, rudder to and fro by that angle, and its period, of three runs."""


def model() -> Model:
    """The equations in CasADi."""
    states = tuple(
        State(
            name=f"motion.{name}",
            unit=unit,
            description=name,
            nominal=nominal,
            derivative=f"motion.{name}dot",
            start=SPEED if name == "u" else 0.0,
        )
        for name, unit, _, nominal in STATES
    )
    parameters = tuple(Parameter(name=name, unit="1", description=name, start=value) for name, value in TRUTH.items())
    rudder = Input(name="rudder.command", unit="rad", description="rudder")
    size = (
        Parameter(name="ship.length", unit="m", description="L", start=100.0),
        Parameter(name="ship.speed", unit="m/s", description="U", start=SPEED),
    )
    quantities = tuple(
        Quantity(name=f"motion.{name}dot", unit=unit, description=name, value=rate)
        for (name, _, unit, _), rate in zip(STATES, _rates(states, rudder, parameters), strict=True)
    )
    return Model("made-up", "a ship of no yard", states, (rudder,), (*parameters, *size), quantities, (), step_s=STEP)


def _rates(states: tuple[Variable, ...], rudder: Variable, parameters: tuple[Variable, ...]) -> tuple[ca.SX, ...]:
    _, _, psi, u, v, r = (state.symbol for state in states)
    delta = rudder.symbol
    p = {parameter.name: parameter.symbol for parameter in parameters}
    return (
        u * ca.cos(psi) - v * ca.sin(psi),
        u * ca.sin(psi) + v * ca.cos(psi),
        r,
        p["Xu"] * (u - SPEED) + p["Xrr"] * r**2,
        p["Yv"] * v + p["Yr"] * r + p["Yd"] * delta,
        p["Nv"] * v + p["Nr"] * r + p["Nrrr"] * r**3 + p["Nd"] * delta,
    )


def orders(seconds: int, angle: float, period: float) -> np.ndarray:
    """Rudder held over each second: to and fro."""
    time = np.arange(seconds + 1.0)
    return angle * np.sign(np.sin(2 * np.pi * (time + 0.5) / period)) * (time > 10)


def trial(
    rng: np.random.Generator, delta: np.ndarray, push: np.ndarray, noise: np.ndarray
) -> tuple[SampledRun, np.ndarray]:
    """One run of the ship, pushed about and measured badly; and the true accelerations (n, 3) that pushed her."""
    n, fine = len(delta), 10
    kept = np.exp(-STEP / fine / TIME)
    force = np.empty((n * fine + 1, 3))
    force[0] = rng.normal(size=3)
    for k in range(n * fine):
        force[k + 1] = kept * force[k] + np.sqrt(1 - kept**2) * rng.normal(size=3)
    force *= push

    def rates(t, s):
        _, _, psi, u, v, r = s
        d = delta[min(int(t / STEP + 1e-9), n - 1)]
        fu, fv, fr = force[min(int(t / STEP * fine), n * fine)]
        return [
            u * np.cos(psi) - v * np.sin(psi),
            u * np.sin(psi) + v * np.cos(psi),
            r,
            TRUTH["Xu"] * (u - SPEED) + TRUTH["Xrr"] * r * r + fu,
            TRUTH["Yv"] * v + TRUTH["Yr"] * r + TRUTH["Yd"] * d + fv,
            TRUTH["Nv"] * v + TRUTH["Nr"] * r + TRUTH["Nrrr"] * r**3 + TRUTH["Nd"] * d + fr,
        ]

    states = np.empty((n, 6))
    states[0] = [0.0, 0.0, 0.3, SPEED, 0.05, 0.001]
    for k in range(n - 1):  # stop at each change of the rudder
        states[k + 1] = solve_ivp(rates, (k * STEP, (k + 1) * STEP), states[k], max_step=0.25, rtol=1e-6).y[:, -1]
    measured = states[:, [3, 4, 5, 2, 0, 1]] + noise * rng.normal(size=(n, 6))
    run = SampledRun(f"angle {delta.max():.2f} of {n} s", 0.0, STEP, delta[:, None], measured, SEEN)
    return run, force[:-1].reshape(n, fine, 3).mean(axis=1)


def pushed_problem(
    seed: int, push: np.ndarray = PUSH, noise: np.ndarray = NOISE
) -> tuple[Problem, tuple[np.ndarray, ...]]:
    """Three runs, and a prior that is 25 % off with a standard error of 50 %; and the true random accelerations."""
    rng = np.random.default_rng(seed)
    made = [trial(rng, orders(*plan), push, noise) for plan in PLANS]
    runs, forces = zip(*made, strict=True)
    return Problem(model(), tuple(TRUTH), 1.25 * VALUES, 0.5 * abs(VALUES), runs), forces
