"""One weighted regression of all steady captive tests on the MMG method, by the equations of the simulated ship.

The readings of each condition (u, v, r, delta, n) are X, Y, N, T and F_N of :mod:`tank2sim.dynamics.mmg`; the points of
the open-water curve are K_T = k_0 + k_1 J + k_2 J^2. Torque, where it was measured, is Q = rho n^2 D^5 K_Q/eta_R with
K_Q = q_0 + q_1 J + q_2 J^2 of the open-water test at the J of the thrust, eta_R the relative rotative efficiency (ITTC
7.5-02-03-01.4). All coefficients theta are found together:

    minimise  sum_c sum_i (y_ci - f_c(theta))^2/sigma_c^2 + sum_k (theta_k - m_k)^2/s_k^2

The error sigma_c of a channel is estimated from what is left, sigma_c^2 = RSS_c/(n_c - p_c), p_c the trace of its share
of the projection (variance components: Förstner 1979). m_k and s_k describe ordinary ships with one screw, wide
enough that only what the tests leave open takes its value from there; such coefficients are marked. m_x' and m_y',
which steady tests do not show, are taken from a published estimate: its error is part of the errors of Y_r' and
X_vr'. The covariance is the inverse of the normal matrix, plus Type B errors, which the scatter of the conditions
does not show (ITTC 7.5-02-06-04): each error of ``[uncertainty]`` is applied to the tests with one standard
deviation, the change of the misfit moves the coefficients as the linearised regression says, and the outer product of
these moves is added.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache

import casadi as ca
import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares
from threadpoolctl import threadpool_limits

from tank2sim.arrays import Array
from tank2sim.cards.card import TORQUE_COEFFICIENTS, MmgCard
from tank2sim.cards.mmg import open_water_fit
from tank2sim.dynamics.build import build
from tank2sim.dynamics.mmg.hull import HULL_TERMS, MMG_TERMS
from tank2sim.dynamics.mmg.propeller import torque_over_density
from tank2sim.dynamics.model import Model
from tank2sim.dynamics.rigid_body import inertial_forces
from tank2sim.errors import InputError
from tank2sim.identification.captive_mmg.card_text import estimated_masses, tested_card
from tank2sim.identification.captive_mmg.steady_tests import TORQUE, SteadyTests

ORDINARY: dict[str, tuple[float, float]] = {
    "t_P": (0.2, 0.1),
    "w_P0": (0.35, 0.2),
    "C_1": (2.0, 2.0),
    "C_2_plus": (1.4, 0.5),
    "C_2_minus": (1.2, 0.5),
    "t_R": (0.35, 0.2),
    "a_H": (0.3, 0.3),
    "x_H": (-0.45, 0.2),
    "eps": (1.1, 0.3),
    "kappa": (0.5, 0.3),
    "l_R": (-0.8, 0.4),
    "gamma_R_plus": (0.5, 0.3),
    "gamma_R_minus": (0.5, 0.3),
}
"""Mean and standard deviation among ordinary ships with one screw. Project choice: they enclose the KVLCC2
(Yasukawa and Yoshimura 2015) within one deviation or about it."""
_LIMITS: dict[str, tuple[float, float]] = {
    "t_P": (-0.9, 0.9),
    "w_P0": (-0.9, 0.9),
    "C_1": (0.0, 50.0),
    "C_2_plus": (0.0, 5.0),
    "C_2_minus": (0.0, 5.0),
    "eps": (0.2, 3.0),
    "kappa": (0.0, 3.0),
    "eta_R": (0.5, 1.5),
}
"""Limits in which a coefficient is looked for. Project choice: beyond them no ship has it; the regression
would otherwise fit a normal force of the other sign by eps < 0."""
OPEN = 0.7
"""Standard error over the spread of ordinary ships from which a coefficient is called open. Project choice: the tests
then halve the variance at best."""
OFFSETS = ("Y0", "N0", "rudder_offset")
"""Asymmetries of a model: force and moment straight ahead, and the angle of no rudder force."""
KEPT_FROM = 3.0
"""Standard errors from which an offset is kept. Project choice: by chance in three of a thousand."""
_QUANTITIES = {
    "X": "force.X",
    "Y": "force.Y",
    "N": "force.N",
    "T": "propeller.thrust",
    "F_N": "rudder.normal_force",
    "T_left": "propeller.thrust_left",
    "F_N_left": "rudder.normal_force_left",
}
"""Channel to the quantity of the model that it reads; with two sides the right one ends in ``_right``."""
_MOTION = ("motion.u", "motion.v", "motion.r", "rudder.angle", "propeller.speed")
_START_X0 = -0.02
"""X_0' (prime II) with which the regression starts: the KVLCC2 has -0.022."""
_START_SIGMA = 0.05
"""Error of a channel over its standard deviation with which the regression starts (project choice, without effect on
the result)."""
_SETTLED = 1e-3
"""Relative change of the errors of the channels at which they have converged (project choice)."""
_ROUNDS = 12
"""Rounds of the variance components; they converge in four to eight (project choice)."""
_FEWEST = 12
"""Conditions below which no regression is tried. Project choice: the method has some 25 coefficients, and five readings
a condition."""


@dataclass(frozen=True, eq=False, kw_only=True)
class MmgFit:
    """Coefficients of the MMG method from steady tests."""

    tests: SteadyTests
    names: tuple[str, ...]  # Coefficients; the hull's in prime II; ``rudder_offset`` in rad
    values: Array  # (k,)
    covariance: Array  # (k, k): Covariance of both types
    random: Array  # (k,): Standard errors by the scatter alone (Type A)
    common: Mapping[str, Array]  # Key of ``[uncertainty]`` to the standard errors by it (Type B), (k,)
    # (channels + 1 or 2,): Standard deviation of what is left of the channels (N, N m), of K_T, and with torque of K_Q
    sigmas: Array
    residuals: Array  # (conditions, channels): Measured less computed, N and N m
    explained: Array  # (channels,): Share of the variance of each channel that is explained
    not_excited: tuple[str, ...]  # Coefficients of the hull that no condition shows; zero

    @cached_property
    def errors(self) -> Array:
        """Standard errors, (k,)."""
        return np.sqrt(np.diag(self.covariance))

    @property
    def curves_unexplained(self) -> dict[str, float]:
        """Standard deviation of open-water points from the fitted curve over their rms: K_T, and K_Q with torque."""
        points = np.sqrt(np.mean(self.tests.open_water[:, 1:] ** 2, axis=0))
        shares = self.sigmas[len(self.tests.channels) :] / points
        return dict(zip(("K_T", "K_Q"), map(float, shares), strict=False))

    @property
    def open(self) -> tuple[str, ...]:
        """Coefficients that the tests leave open; they keep the values of ordinary ships."""
        pairs = zip(self.names, self.random, strict=True)
        return tuple(name for name, error in pairs if name in ORDINARY and error > OPEN * ORDINARY[name][1])

    @property
    def at_limit(self) -> tuple[str, ...]:
        """Coefficients at a limit of what is looked for: their standard errors do not hold."""
        return tuple(
            name
            for name, (low, high) in _LIMITS.items()
            if name in self.names and not low + 1e-3 * (high - low) < self.value(name) < high - 1e-3 * (high - low)
        )

    def in_errors(self, name: str) -> float:
        """Size of a coefficient over its standard error by the scatter."""
        return abs(self.value(name)) / float(self.random[self.names.index(name)])

    def value(self, name: str) -> float:
        """A coefficient; 0 if it was not fitted."""
        return float(self.values[self.names.index(name)]) if name in self.names else 0.0

    def yaw_arm(self) -> tuple[float, float]:
        """x_R' + a_H x_H', which tests show better than x_H' itself, and its standard error."""
        assert self.tests.form.rudder is not None
        a_H, x_H = self.value("a_H"), self.value("x_H")
        slopes = np.zeros(len(self.names))
        slopes[self.names.index("a_H")], slopes[self.names.index("x_H")] = x_H, a_H
        return self.tests.form.rudder.x_R + a_H * x_H, float(np.sqrt(slopes @ self.covariance @ slopes))


def fit_mmg(tests: SteadyTests) -> MmgFit:
    """Fit all coefficients that the tests show.

    Raises InputError: There are too few conditions, or none with the rudder over, or none at drift: no hull or no
    rudder is found.
    """
    _refuse_poor(tests)
    names, not_excited = _fitted_names(tests)
    model = build(start_card(tests))
    with threadpool_limits(limits=1, user_api="blas"):  # several threads take ten times as long
        found = _Regression(tests, model, tuple(names)).fit(not_excited)
        while weak := {name: t for name in OFFSETS if name in names and (t := found.in_errors(name)) < KEPT_FROM}:
            names.remove(min(weak, key=lambda name: weak[name]))
            found = _Regression(tests, model, tuple(names)).fit(not_excited)
    return found


def _refuse_poor(tests: SteadyTests) -> None:
    count, remedy = len(tests.names), "test it, or reduce the others to a polynomial"
    if count < _FEWEST:
        raise InputError(tests.path, "averages", f"has {count} conditions", f"{_FEWEST} and more are needed")
    for column, what in ((3, "rudder angle"), (1, "drift angle")):
        if len(np.unique(np.round(tests.motion[:, column], 6))) < 3:
            raise InputError(tests.path, "averages", f"has less than three values of the {what}", remedy)
    for channel, readings in zip(tests.channels, tests.readings.T, strict=True):
        if not np.ptp(readings) > 0:
            raise InputError(tests.path, "averages", f"{channel} is the same in all conditions", "the gauge is dead")


def _fitted_names(tests: SteadyTests) -> tuple[list[str], tuple[str, ...]]:
    """Names to fit, and terms of the hull that no condition excites."""
    v, r = -tests.motion[:, 1] / tests.speed_mps, tests.yaw_rate_prime
    hull, missing = [], []
    columns: dict[str, list[Array]] = {force: [] for force in HULL_TERMS}
    for force, terms in HULL_TERMS.items():
        for name in terms:
            powers = name[1:]
            column = v ** powers.count("v") * r ** powers.count("r")
            trial = np.column_stack([*columns[force], column])
            scaled = trial / np.maximum(np.linalg.norm(trial, axis=0), 1e-12)
            if np.linalg.svd(scaled, compute_uv=False)[-1] < 1e-3:
                missing.append(name)
                continue
            columns[force].append(column)
            hull.append(name)
    turning = ("l_R", "Xudot", "Yvdot")
    others = [name for name in (*ORDINARY, "Xudot", "Yvdot") if name not in turning or np.any(r)]
    torque = TORQUE_COEFFICIENTS if TORQUE in tests.channels else ()
    return ["k_0", "k_1", "k_2", *others, *hull, *torque, "rudder_offset"], tuple(missing)


def start_card(tests: SteadyTests) -> MmgCard:
    """A card with the coefficients of ordinary ships and no hull but its resistance."""
    values = {name: mean for name, (mean, _) in ORDINARY.items()}
    values |= dict(zip(("k_0", "k_1", "k_2"), map(float, _open_water(tests)), strict=True))
    hull = {name: 0.0 for names in HULL_TERMS.values() for name in names}
    return tested_card(tests, {**hull, **values, "X0": _START_X0}, {}, "start of the regression")


def _open_water(tests: SteadyTests) -> Array:
    """k_0, k_1, k_2 of the open-water points alone, with which the regression starts."""
    J, K_T = tests.open_water.T[:2].tolist()
    return open_water_fit(J, K_T, str(tests.path)).coefficients


def computed_readings(model: Model, names: Sequence[str], units: Array, channels: Sequence[str]) -> ca.Function:
    """The readings and their slopes: (motion (5,), theta (k,)) to (readings (c,), slopes (c, k)).

    The torque is among the c channels if its coefficients are among the names.

    `model`: Model of an MMG card; `units` (k,): A coefficient's unit in the model: L/d for the hull's.
    """
    theta, motion = ca.SX.sym("theta", len(names)), ca.SX.sym("motion", len(_MOTION))
    given = {name: motion[i] for i, name in enumerate(_MOTION)}
    for i, name in enumerate(names):
        given[_variable(name)] = units[i] * theta[i]
    if "rudder_offset" in names:
        given["rudder.angle"] = motion[3] + theta[names.index("rudder_offset")]
    given["low_speed.bound"] = ca.SX(0)  # captive tests are steady: the polynomial holds at every speed of them
    states = ca.vertcat(*(given.get(name, ca.SX(0)) for name in model.state_names))
    inputs = ca.vertcat(
        *(given.get(name, value) for name, value in zip(model.input_names, model.input_values(), strict=True))
    )
    parameters = ca.vertcat(*(given.get(name, value) for name, value in model.defaults.items()))
    right = "_right" if "T_left" in channels else ""
    read = [_QUANTITIES[channel] for channel in channels if channel != TORQUE]
    read = [name + right * (name in (_QUANTITIES["T"], _QUANTITIES["F_N"])) for name in read]
    quantities = model.expand(ca.vertcat(*(model.symbol(name) for name in (*read, f"propeller.inflow{right}"))))
    found = ca.Function("forces", [model.x, model.u, model.p], [quantities])(states, inputs, parameters)
    forces = found[:-1]
    if "eta_R" in names:
        curve = {name: theta[names.index(name)] for name in TORQUE_COEFFICIENTS} | {"astern": 0.0}
        of_ship = model.defaults
        density, diameter = of_ship["ship.water_density"], of_ship["ship.propeller_diameter"]
        torque = density * torque_over_density(curve, ca.SX(diameter), motion[4] / (2 * ca.pi), found[-1])
        forces = ca.vertcat(forces, torque)
    return ca.Function("readings", [motion, theta], [forces, ca.jacobian(forces, theta)])


def _variable(name: str) -> str:
    """Name of a coefficient's parameter in the model."""
    return f"derivatives.{name}" if name in MMG_TERMS else f"mmg.{name}"


@dataclass(frozen=True, eq=False)
class _Regression:
    """The regression of one set of coefficients `names` of a model on steady tests."""

    tests: SteadyTests
    model: Model
    names: tuple[str, ...]

    @cached_property
    def priors(self) -> dict[int, tuple[float, float]]:
        """Place of a coefficient to mean and standard deviation."""
        known = {**ORDINARY, **estimated_masses(self.tests)}
        return {i: known[name] for i, name in enumerate(self.names) if name in known}

    @cached_property
    def limits(self) -> tuple[Array, Array]:
        """Lowest and highest coefficients, (k,) each."""
        pairs = np.array([_LIMITS.get(name, (-np.inf, np.inf)) for name in self.names])
        return pairs[:, 0], pairs[:, 1]

    @cached_property
    def powers(self) -> Array:
        """1, J, J^2 of the open-water points, (points, 3)."""
        return np.vander(self.tests.open_water[:, 0], 3, increasing=True)

    @cached_property
    def channel(self) -> NDArray[np.int_]:
        """Channel of each equation: of the conditions, then K_T and K_Q of the open-water points."""
        (count, channels), (points, columns) = self.tests.readings.shape, self.tests.open_water.shape
        curves = channels + np.repeat(np.arange(columns - 1), points)
        return np.concatenate([np.repeat(np.arange(channels), count), curves])

    @cached_property
    def curve_slopes(self) -> Array:
        """Slopes of the open-water points by the coefficients, (points of K_T and K_Q, k)."""
        blocks = []
        for first in ("k_0", "q_0")[: self.tests.open_water.shape[1] - 1]:
            place = self.names.index(first)
            blocks.append(np.pad(self.powers, ((0, 0), (place, len(self.names) - 3 - place))))
        return np.vstack(blocks)

    @cached_property
    def _computed(self) -> Callable[[bytes], tuple[Array, Array]]:
        """Readings and their slopes by the coefficients; the last are kept, for both are asked for one by one."""
        form, count = self.tests.form, len(self.tests.names)
        assert form.model.draught_m is not None
        ratio = form.model.draught_m / form.model.length_m
        units = np.array([ratio if _variable(name).startswith("derivatives") else 1.0 for name in self.names])
        function = computed_readings(self.model, self.names, units, self.tests.channels).map(count)

        @lru_cache(maxsize=1)
        def computed(theta: bytes) -> tuple[Array, Array]:
            forces, jacobian = function(self.tests.motion.T, np.tile(np.frombuffer(theta)[:, None], count))
            return np.array(forces), np.array(jacobian)

        return computed

    def misfit(self, theta: Array) -> Array:
        """Measured less computed, (equations,), N, N m and K_T."""
        forces, _ = self._computed(theta.tobytes())
        curve = self.tests.open_water[:, 1:].T.ravel() - self.curve_slopes @ theta
        return np.concatenate([(self.tests.readings.T - forces).ravel(), curve])

    def slopes(self, theta: Array) -> Array:
        """Slopes of the misfit by the coefficients, (equations, k)."""
        _, jacobian = self._computed(theta.tobytes())
        by_condition = jacobian.reshape(len(self.tests.channels), len(self.tests.names), len(self.names))
        return -np.vstack([*by_condition, self.curve_slopes])

    def start(self) -> Array:
        """Means of ordinary ships, no hull but its resistance."""
        theta = np.zeros(len(self.names))
        for i, (mean, _) in self.priors.items():
            theta[i] = mean
        theta[:3] = _open_water(self.tests)
        theta[self.names.index("X0")] = _START_X0
        if "eta_R" in self.names:
            place = self.names.index("q_0")
            theta[place : place + 3] = np.linalg.lstsq(self.powers, self.tests.open_water[:, 2], rcond=None)[0]
            theta[self.names.index("eta_R")] = 1.0
        return theta

    def fit(self, not_excited: tuple[str, ...]) -> MmgFit:
        """Least squares and variance components in turn until both stay."""
        tests, channel = self.tests, self.channel
        sizes = np.concatenate([tests.readings.std(axis=0), tests.open_water[:, 1:].std(axis=0)])
        theta, sigmas = self.start(), _START_SIGMA * sizes
        by_prior = np.array([np.eye(len(theta))[i] / spread for i, (_, spread) in self.priors.items()])
        means = np.array([mean / spread for mean, spread in self.priors.values()])
        for _ in range(_ROUNDS):
            weights = 1 / sigmas[channel]

            def weighted(theta: Array, weights: Array = weights) -> Array:
                return np.concatenate([weights * self.misfit(theta), by_prior @ theta - means])

            def weighted_slopes(theta: Array, weights: Array = weights) -> Array:
                return np.vstack([weights[:, None] * self.slopes(theta), by_prior])

            theta = least_squares(weighted, theta, jac=weighted_slopes, bounds=self.limits, x_scale="jac", xtol=1e-12).x
            orthogonal, triangle = np.linalg.qr(weighted_slopes(theta))
            free = 1 - np.sum(orthogonal[: len(channel)] ** 2, axis=1)
            squares = np.bincount(channel, self.misfit(theta) ** 2)
            before = sigmas
            sigmas = np.maximum(np.sqrt(squares / np.maximum(np.bincount(channel, free), 1.0)), 1e-6 * sizes)
            if np.all(np.abs(sigmas / before - 1) < _SETTLED):
                break
        inverse = np.linalg.inv(triangle)
        covariance = inverse @ inverse.T
        random, common = np.sqrt(np.diag(covariance)), dict[str, Array]()
        for source, erring in erring_tests(tests):
            change = (replace(self, tests=erring).misfit(theta) - self.misfit(theta)) * weights
            moved = inverse @ (orthogonal[: len(channel)].T @ change)
            covariance = covariance + np.outer(moved, moved)
            common[source] = np.hypot(common.get(source, 0.0), moved)
        count = len(tests.names)
        channels = len(tests.channels)
        residuals = self.misfit(theta)[: count * channels].reshape(channels, count).T
        return MmgFit(
            tests=tests,
            names=self.names,
            values=theta,
            covariance=covariance,
            random=random,
            common=common,
            sigmas=sigmas,
            residuals=residuals,
            explained=1 - residuals.var(axis=0) / tests.readings.var(axis=0),
            not_excited=not_excited,
        )


def erring_tests(tests: SteadyTests) -> Iterator[tuple[str, SteadyTests]]:
    """Stated errors, by their key in ``[uncertainty]``, and the tests with one standard deviation of each.

    The calibration gives one for each gauge, whose errors are independent. An error of the yaw inertia or of a delay
    does not show in steady tests.
    """
    stated = tests.form.uncertainty
    if size := stated.calibration_relative:
        for place in range(len(tests.channels)):
            gains = np.ones(len(tests.channels))
            gains[place] += size
            yield "calibration_relative", replace(tests, readings=tests.readings * gains)
    if size := stated.alignment_rad:
        u, v = tests.motion[:, 0], tests.motion[:, 1]
        turned = [u * np.cos(size) + v * np.sin(size), v * np.cos(size) - u * np.sin(size)]
        yield "alignment_rad", _with_motion(tests, np.column_stack([*turned, tests.motion[:, 2:]]))
    if size := stated.rudder_rad:
        yield "rudder_rad", _with_motion(tests, tests.motion + size * np.eye(5)[3])
    for key in ("speed_relative", "blockage_relative"):
        if size := getattr(stated, key):
            yield key, _with_motion(tests, tests.motion * np.array([1 + size, 1 + size, 1, 1, 1]))
    if (size := stated.mass_relative) and not _inertia_removed(tests):
        carried = np.zeros_like(tests.readings)
        carried[:, :3] = size * _inertia(tests)
        yield "mass_relative", replace(tests, readings=tests.readings - carried)


def _with_motion(tests: SteadyTests, motion: Array) -> SteadyTests:
    """The tests with another motion; forces of the water alone have been given the inertia of the recorded one."""
    moved = replace(tests, motion=motion)
    if not _inertia_removed(tests):
        return moved
    readings = tests.readings.copy()
    readings[:, :3] += _inertia(moved) - _inertia(tests)
    return replace(moved, readings=readings)


def _inertia_removed(tests: SteadyTests) -> bool:
    return tests.form.test.force_convention == "hydrodynamic"


def _inertia(tests: SteadyTests) -> Array:
    """Reaction of the carried body, (conditions, 3), N and N m."""
    u, v, r = tests.motion[:, :3].T
    return np.column_stack(inertial_forces(tests.form.model.mass_kg, tests.form.model.x_G_m, u, v, r))
