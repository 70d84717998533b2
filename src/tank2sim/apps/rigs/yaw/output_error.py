"""The paper's nonlinear least squares: (3) integrated under the recorded current, fitted to the recorded angle.

The paper fits J, f_c, f_1, f_662 to runs with prescribed currents; this module uses the recorded current. Each hump has
its own start, fitted with the other unknowns, so that errors do not accumulate from hump to hump.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import casadi as ca
import numpy as np
from scipy.optimize import OptimizeResult
from scipy.stats import t as student

from tank2sim.apps.rigs.search import WithSlopes, least_misfit, pseudo_inverse
from tank2sim.apps.rigs.yaw.card import YawRig
from tank2sim.apps.rigs.yaw.energy import EnergyFit, Interval, YawMethodEstimate, estimate_from, smooth_angle
from tank2sim.apps.rigs.yaw.model import yaw_rig_model
from tank2sim.apps.rigs.yaw.records import YawRecord
from tank2sim.arrays import Array
from tank2sim.records.audit.weak import newey_west
from tank2sim.simulation.scheme import runge_kutta_step
from tank2sim.simulation.sensitivity import augmented_step

_STEP_S = 0.02
"""Least step of the integration; a record with a longer step uses its own. The current is its mean over a step."""
_SUBSTEPS = 2
"""Runge-Kutta steps in one step: a single one may be unstable with the stiff dry friction of a light body in air."""
_AWAKE = 0.25
"""Rise times omitted at both ends of a hump, where the programme's rate is below a fifth: the body may stick there, and
static friction does not depend on the inertia."""
_MEMORY = 0.2
"""Share of a hump over which its residuals may be correlated: long enough for the accumulated noise of the current."""
_SIGMA_LEVEL = 0.8413
"""Probability of less than one standard error, which makes Student's distribution comparable."""
_TRIES = 40
"""Most steps of the search: from the energy least squares it needs three to ten."""
_GRAVITY = ("gravity_sine", "gravity_cosine")
_NAMES = {
    "inertia": "added.inertia",
    "coulomb": "friction.coulomb",
    "viscous": "friction.viscous",
    "quadratic": "friction.quadratic",
}
"""Term to the parameter of the model; its J_zz is 0, so that the added inertia is the total."""


class _Hump(NamedTuple):
    """Angles (n,), mean currents of the steps (n - 1,), angle and rate at the start, and variance of such a current."""

    time_s: Array
    angle_rad: Array
    current_A: Array
    start: tuple[float, float]
    noise_A2: float


class AngleFit(NamedTuple):
    """The estimate, and the residuals of the angle (n,) of all humps with their times."""

    estimate: YawMethodEstimate
    time_s: Array
    residual_rad: Array


def fit_angle(records: tuple[YawRecord, ...], rig: YawRig, first: EnergyFit, ideal: Interval) -> AngleFit | None:
    """Fit (3) to the angle of all humps; None if it does not converge.

    `rig` has the torque constant and known effects beyond (3), `first` the start values and the terms; the dissipation
    reported belongs to the programme's interval `ideal`.
    """
    known = dict(zip(first.balance.terms, first.coefficients.tolist(), strict=True))
    terms = tuple(term for term in (*_NAMES, *_GRAVITY) if term in known)
    humps = [hump for record in records for hump in _humps(record)]
    predict = _predictor(rig, terms)
    values = np.array([known[term] for term in terms])
    scale = np.maximum(np.abs(values), 1e-3 * abs(values[0]))
    count = len(terms)

    def misfit(unknown: Array) -> tuple[Array, Array]:
        residuals, slopes = [], []
        for place, hump in enumerate(humps):
            at = count + 2 * place
            angle, sensitivity = predict(unknown[:count] * scale, unknown[at : at + 2], hump)
            residuals.append(angle - hump.angle_rad)
            wide = np.zeros((len(angle), len(unknown)))
            wide[:, :count], wide[:, at : at + 2] = sensitivity[:, :count] * scale, sensitivity[:, count:]
            slopes.append(wide)
        return np.concatenate(residuals), np.vstack(slopes)

    found = _search(misfit, np.concatenate([values / scale, *(hump.start for hump in humps)]), count)
    if found is None or found.x[0] == 0:
        return None
    values = found.x[:count] * scale
    best = dict(zip(terms, values, strict=True))
    # 1/s, at which a disturbance of the rate dies away, at the mean rate of the interval.
    rate = float(np.abs(ideal.rate_radps).mean())
    decay = max(0.0, best.get("viscous", 0.0) + 2 * rate * best.get("quadratic", 0.0)) / abs(best["inertia"])
    gain = rig.torque_constant_NmpA / best["inertia"], decay
    covariance = _covariance(found.fun, misfit(found.x)[1], humps, gain)[:count, :count] * np.outer(scale, scale)
    estimate = estimate_from(terms, values, covariance, ideal)
    return AngleFit(estimate, np.concatenate([hump.time_s for hump in humps]), found.fun)


def _search(misfit: WithSlopes, begin: Array, count: int) -> OptimizeResult | None:
    """The search from `begin`; if the integration diverges with negative friction, a second one from zero friction."""
    upright = begin.copy()
    upright[1:count] = np.maximum(upright[1:count], 0.0)
    searches = (least_misfit(misfit, z, tolerances=(1e-7, 1e-8, 1e-8), most_steps=_TRIES) for z in (begin, upright))
    return next((found for found in searches if found is not None), None)


def _covariance(residuals: Array, design: Array, humps: list[_Hump], gain: tuple[float, float]) -> Array:
    """Covariance; the residuals are correlated over seconds, and from hump to hump.

    The largest of four, term by term: independent residuals plus the noise of the current; each hump as a draw, with
    Student's factor for their small number; and single and stacked humps, with the correlation along them (Newey & West
    1987). The last includes errors common to all humps, such as those of the encoder where the humps turn by whole
    counts. `gain` is k_t/J and the decay of the rate.
    """
    inverse = pseudo_inverse(design)
    alone: Array = inverse @ inverse.T * float(residuals @ residuals) / max(1, len(residuals) - design.shape[1])
    ends = np.cumsum([len(hump.angle_rad) for hump in humps])[:-1]
    parts = np.split(inverse * residuals, ends, axis=1)
    folded = np.zeros((len(inverse), max(part.shape[1] for part in parts)))
    for part in parts:
        folded[:, : part.shape[1]] += part
    lags = max(1, round(_MEMORY * folded.shape[1]))
    along = [newey_west(folded.T, lags), sum(newey_west(part.T, lags) for part in parts)]
    noise = _from_current(np.split(inverse, ends, axis=1), humps, gain)
    variances = [np.diag(alone) + noise, *(np.diag(matrix) / (1 - _MEMORY) for matrix in along)]
    if len(humps) > 1:
        # The free start of a hump absorbs its draw, so that the sums nearly equal the shared terms' alone.
        draws = np.array([part.sum(axis=1) for part in parts]).T
        few = float(student.ppf(_SIGMA_LEVEL, len(humps) - 1)) ** 2
        variances.append(few * len(humps) / (len(humps) - 1) * np.sum(draws**2, axis=1))
    wider = np.sqrt(np.max(variances, axis=0) / np.diag(alone))
    return alone * np.outer(wider, wider)


def _from_current(parts: list[Array], humps: list[_Hump], gain: tuple[float, float]) -> Array:
    """Variances that the noise of the current gives, which the model takes for moments that were there."""
    variances = np.zeros(len(parts[0]))
    for part, hump in zip(parts, humps, strict=True):
        since = np.maximum(0.0, hump.time_s[:, None] - hump.time_s[None, 1:])
        # Angle after a step of moment on a body that the water brakes.
        swung = -np.expm1(-gain[1] * since) / gain[1] if gain[1] > 1e-6 else since
        response = gain[0] * np.diff(hump.time_s) * swung
        variances += hump.noise_A2 * np.sum((part @ response) ** 2, axis=1)
    return variances


def _humps(record: YawRecord) -> list[_Hump]:
    programme, time = record.programme, record.time_s
    interval = float(np.median(np.diff(time)))
    step = max(_STEP_S, interval)
    work = np.concatenate([[0.0], np.cumsum(np.diff(time) * (record.current_A[1:] + record.current_A[:-1]) / 2)])
    # Third differences of the current are nearly its noise; the median ignores the instants at which the body breaks
    # loose.
    noise_A2 = (1.4826 * float(np.median(np.abs(np.diff(record.current_A, 3))))) ** 2 / 20
    humps = []
    for number in range(programme.humps):
        begin = programme.start_s + number * programme.period_s
        first = begin + _AWAKE * programme.rise_s
        last = min(begin + (3 - _AWAKE) * programme.rise_s, float(time[-1]))
        # With room for rounding: a step more or less changes the result by a good part of its error.
        times: Array = first + step * np.arange(int((last - first) / step + 1e-6), dtype=np.float64)
        if len(times) < 10:
            raise record.fault("column t_s", f"has fewer than 10 rows in hump {number + 1}", "sample faster")
        spline = smooth_angle(record, (first, first + programme.rise_s))
        angles, currents = np.interp(times, time, record.angle_rad), np.diff(np.interp(times, time, work))
        start = float(spline(times[0])), float(spline(times[0], 1))
        humps.append(_Hump(times, angles, currents / np.diff(times), start, noise_A2 * interval / step))
    return humps


def _predictor(rig: YawRig, terms: tuple[str, ...]) -> Callable[[Array, Array, _Hump], tuple[Array, Array]]:
    """``predict(values, start, hump) -> (angles (n,), sensitivities (n, terms + 2))``."""
    model = yaw_rig_model("body", rig, with_current_loop=False)
    places = {name: place for place, name in enumerate(model.parameter_names)}
    given, x, h = ca.SX.sym("c", len(terms)), model.x, ca.SX.sym("h")
    values = dict(zip(terms, ca.vertsplit(given), strict=True))
    whole = ca.SX(model.parameter_values({"body.inertia": 0.0}))
    for term, name in _NAMES.items():
        if term in values:
            whole[places[name]] = values[term]
    if any(term in values for term in _GRAVITY):
        sine = rig.gravity_Nm * math.cos(rig.gravity_angle_rad) + values.get("gravity_sine", 0.0)
        cosine = values.get("gravity_cosine", 0.0) - rig.gravity_Nm * math.sin(rig.gravity_angle_rad)
        whole[places["gravity.moment"]] = ca.sqrt(sine**2 + cosine**2 + 1e-24)
        whole[places["gravity.angle"]] = ca.atan2(-cosine, sine)
    rougher = rig.quadratic_braking - rig.quadratic_Nms2
    whole[places["friction.quadratic_braking"]] = whole[places["friction.quadratic"]] + rougher
    following = x
    for _ in range(_SUBSTEPS):
        following = runge_kutta_step(model)(following, model.u, whole, h / _SUBSTEPS)
    step = augmented_step(following, x, given, (model.u, h, given), of_starts=2)
    first = np.hstack([np.zeros((2, len(terms))), np.eye(2)])
    loops: dict[int, ca.Function] = {}

    def predict(values: Array, start: Array, hump: _Hump) -> tuple[Array, Array]:
        count = len(hump.current_A)
        loops.setdefault(count, step.mapaccum(count))
        begin = np.hstack([start[:, None], first])
        intervals = np.diff(hump.time_s)[None, :]
        path = loops[count](begin, hump.current_A[None, :], intervals, np.repeat(values[:, None], count, axis=1))
        at = np.vstack([begin[0], np.asarray(path)[0].reshape(-1, begin.shape[1])])
        return at[:, 0], at[:, 1:]

    return predict
