"""A linear toy in place of a ship: x' = A x + b(t) + sum of theta_j shape_j(t) + sum of c_j term_j(t)."""

from __future__ import annotations

from dataclasses import dataclass, field
from types import SimpleNamespace

import numpy as np
from scipy.integrate import solve_ivp

from tank2sim.dynamics.effects import EffectParameter
from tank2sim.gap.inference.batch import MEASURED_STATES, MeasuredBatch
from tank2sim.gap.inference.hypothesis import EstimatedParameter

A = np.zeros((6, 6))
A[:3, :3] = [[-0.05, 0.0, 0.0], [0.0, -0.2, -0.3], [0.0, 0.1, -0.4]]
A[3, 2] = A[4, 0] = A[5, 1] = 1.0

SHAPES = (
    lambda t: np.stack([0 * t, 0 * t, 0.05 * np.sign(np.sin(t / 5)), 0 * t, 0 * t, 0 * t], axis=-1),
    lambda t: np.stack([0.1 * np.sin(t / 3), 0 * t, 0 * t, 0 * t, 0 * t, 0 * t], axis=-1),
    lambda t: np.stack([0 * t, 0.1 * np.cos(t / 7), 0 * t, 0 * t, 0 * t, 0 * t], axis=-1),
)
NAMES = (
    *("gyro_bias", "current", "hull_fouling", "cross_flow_drag", "rudder_bias", "rudder_lag", "rudder_time_offset"),
    *("rudder_backlash", "rudder_dead_band"),
)
"""Of the forces of :data:`SHAPES`: effects of three kinds, whatever these do; the others are for scores alone."""

TERMS = (
    lambda t: np.stack([0.05 + 0 * t, 0 * t, 0 * t, 0 * t, 0 * t, 0 * t], axis=-1),
    lambda t: np.stack([0 * t, 0.1 * np.cos(t / 4), 0.02 * np.cos(t / 4), 0 * t, 0 * t, 0 * t], axis=-1),
)


def pushed(t):
    """What drives the toy and is known, (..., 6)."""
    t = np.asarray(t, dtype=float)
    return np.stack([0.3 + 0 * t, 0.2 * np.sin(t / 6), 0.1 * np.sin(t / 6), 0 * t, 0 * t, 0 * t], axis=-1)


@dataclass
class Toy:
    """What a likelihood asks of an explanation; `priors` mean and standard deviation of each theta, or None.

    Its effects are the first of :data:`SHAPES`, or those at the places `indices`. On its card are effects that push it
    by `known` times the first of them.
    """

    priors: tuple = ()
    directed: bool = False
    indices: tuple | None = None
    known: float = 0.0
    card: SimpleNamespace = field(default_factory=lambda: SimpleNamespace(steering_gear=None, effects=()))
    model = SimpleNamespace(input_names=("rudder.command",))
    each = recorded = ()
    moves_clock = False

    @property
    def moved_together(self):
        return tuple((place,) for place in range(len(self.priors)))

    @property
    def effects(self):
        return tuple(NAMES[place] for place in self.places)

    @property
    def places(self):
        return tuple(range(len(self.priors))) if self.indices is None else self.indices

    @property
    def estimated(self):
        size = EffectParameter("size", "size", -10.0, 10.0, absent=0.0, typical=(1.0,))
        return tuple(EstimatedParameter(name, size, f"{name}.size") for name in self.effects)

    unmeasured = ()

    @property
    def influences(self):
        return False, bool(self.priors), False

    @property
    def prior(self):
        pairs = [(0.0, 0.0) if pair is None else (pair[0], 1 / pair[1] ** 2) for pair in self.priors]
        return np.array([pair[0] for pair in pairs]), np.array([pair[1] for pair in pairs])

    @property
    def bounds(self):
        return np.full(len(self.priors), -10.0), np.full(len(self.priors), 10.0)

    @property
    def steps(self):
        return np.full(len(self.priors), 0.01)

    def steered(self, inputs):
        return inputs[..., 0]

    def unmeasured_states(self, motion, theta, p=None):
        return np.zeros((*motion.states.shape[:2], 0))

    def rates_between(self, motion, theta):
        x = 0.5 * (motion.states[:, 1:] + motion.states[:, :-1])
        t = motion.begin_s[:, None] + (np.arange(x.shape[1]) + 0.5) * motion.step_s
        added = sum(size * SHAPES[place](t) for size, place in zip(theta, self.places, strict=True))
        return x @ A.T + pushed(t) + self.known * SHAPES[0](t) + added

    def fine_rates(self, motion, theta):
        return motion.over_blocks(self.rates_between(motion, theta))

    def rates(self, motion, theta, unmeasured=None):
        return self.fine_rates(motion, theta)  # linear: the mean of the rates is the rate at the mean

    def readings(self, motion, theta, unmeasured=None):
        return motion.in_blocks(motion.states)

    def slopes(self, motion, theta, names=()):
        runs, blocks = motion.inside.shape
        return np.tile(A, (runs, blocks - 1, 1, 1)), np.tile(np.eye(6), (runs, blocks, 1, 1))

    def coefficient_slopes(self, motion, theta, names):
        t = motion.times[:, :-1] + motion.block_s / 2
        return np.stack([TERMS[int(name)](t) for name in names], axis=-1)


WHITE = np.array([0.02, 0.02, 0.005, 0.005, 0.1, 0.1])


def toy_motion(theta=(), coefficients=(), **how) -> MeasuredBatch:
    """The motion of :func:`toy_trials` alone."""
    return toy_trials(theta, coefficients, **how)[0]


def toy_trials(theta=(), coefficients=(), *, seed=1, blocks=(24, 17), fine=5, step=0.2):
    """The toy integrated by scipy: smoothed motion with a slow error, block means with noise; and the true motion."""
    rng = np.random.default_rng(seed)
    n = max(blocks) * fine
    times = step * np.arange(n)

    def rate(t, x):
        added = [
            size * shape(t)
            for size, shape in zip((*theta, *coefficients), (*SHAPES[: len(theta)], *TERMS), strict=False)
        ]
        return A @ x + pushed(t) + np.sum([np.zeros(6), *added], axis=0)

    states, measured, truths = [], [], []
    for run, count in enumerate(blocks):
        start = [3.0 + run, 0.1, 0.0, 0.3, 0.0, 0.0]
        true = solve_ivp(rate, (0, times[-1]), start, t_eval=times, rtol=1e-8, atol=1e-10, max_step=0.5).y.T
        means = true.reshape(max(blocks), fine, 6).mean(axis=1) + WHITE * rng.standard_normal((max(blocks), 6))
        means[count:] = np.nan
        measured.append(means)
        smooth = true + WHITE * np.sin(times[:, None] / 5 + np.arange(6))
        smooth[count * fine :] = smooth[count * fine - 1]  # padded as trials are
        states.append(smooth)
        truths.append(true)
    measured = np.array(measured)
    measured[0, 3:5, 2] = np.nan
    return MeasuredBatch(
        names=("a", "b"),
        seen=MEASURED_STATES,
        step_s=step,
        fine=fine,
        begin_s=np.zeros(2),
        lengths=np.array(blocks),
        states=np.array(states),
        inputs=np.tile(np.sin(times[:-1, None] / 5), (2, 1, 1)),
        measured=measured,
        noise=WHITE,
        unsure_s=np.zeros(2),
        at_execute=np.zeros(2, dtype=bool),
    ), np.array(truths)
