"""The paper's nonlinear least squares: (3) integrated under the recorded current, fitted to the recorded angle.

The paper fits J, f_c, f_1, f_662 to runs with prescribed currents; the same is done here with whatever current the
record has. Each hump has a start of its own, fitted with the rest, so that what the record's small errors add up to
does not run on from hump to hump.
"""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca
import numpy as np
from scipy.optimize import least_squares

from tank2sim.dynamics.yaw_rig import YawRig, yaw_rig_model
from tank2sim.errors import InputError
from tank2sim.identification.conditioning import Matrix, Vector, column_norms
from tank2sim.identification.yaw.energy import estimate_from
from tank2sim.identification.yaw.estimate import YawEstimate
from tank2sim.identification.yaw.intervals import Interval, smooth_angle
from tank2sim.records.yaw import YawRecord
from tank2sim.simulation.scheme import runge_kutta_step

_STEP_S = 0.02
"""Step of the integration, at least a record's own. The current is its mean over a step."""
_SUBSTEPS = 2
"""Runge-Kutta steps in one: a light body in air is so stiff in its dry friction that one alone may be unstable."""
_AWAKE = 0.2
"""Share of the programme's rate below which a hump is left out: there the body may stick, and what holds it then says
nothing of the inertia."""
_TRIES = 40
"""Steps of the search: from the energy least squares it takes three to ten."""
_NAMES = {
    "inertia": "added.inertia",
    "coulomb": "friction.coulomb",
    "viscous": "friction.viscous",
    "quadratic": "friction.quadratic",
}
"""Term to the parameter of the model that it is; J_zz is 0 there, so that the added inertia is the total."""


@dataclass(frozen=True, eq=False)
class _Hump:
    time_s: Vector
    angle_rad: Vector
    current_A: Vector
    start: tuple[float, float]


@dataclass(frozen=True, eq=False, kw_only=True)
class AngleFit:
    """What the fitted model leaves of the angle: times (s), residuals (rad), in the order of the humps."""

    estimate: YawEstimate
    time_s: Vector
    residual_rad: Vector


def fit_angle(records: tuple[YawRecord, ...], rig: YawRig, first: YawEstimate, ideal: Interval) -> AngleFit | None:
    """Fit (3) to the angle of all humps; None if it does not converge.

    Parameters
    ----------
    records : tuple of YawRecord
        Of one body in one medium.
    rig : YawRig
        Its torque constant, and what is known beyond (3).
    first : YawEstimate
        Where to start, and the terms to fit.
    ideal : Interval
        The programme's, whose dissipation is told.
    """
    terms = tuple(term for term in _NAMES if term == "inertia" or term in first.friction)
    humps = [hump for record in records for hump in _humps(record)]
    predict = _predictor(rig, terms)
    values = np.array([first.total_inertia_kgm2, *(first.friction[term][0] for term in terms[1:])])
    scale = np.maximum(np.abs(values), 1e-3 * first.total_inertia_kgm2)
    count = len(terms)
    begin = np.concatenate([values / scale, *(hump.start for hump in humps)])

    def evaluate(unknown: Vector) -> tuple[Vector, Matrix]:
        left, slopes = [], []
        for place, hump in enumerate(humps):
            at = count + 2 * place
            angle, sensitivity = predict(unknown[:count] * scale, unknown[at : at + 2], hump)
            left.append(angle - hump.angle_rad)
            wide = np.zeros((len(angle), len(unknown)))
            wide[:, :count], wide[:, at : at + 2] = sensitivity[:, :count] * scale, sensitivity[:, count:]
            slopes.append(wide)
        return np.concatenate(left), np.vstack(slopes)

    last: list[tuple[Vector, Vector, Matrix]] = []

    def kept(unknown: Vector) -> tuple[Vector, Matrix]:
        if not last or not np.array_equal(last[0][0], unknown):
            last[:] = [(unknown.copy(), *evaluate(unknown))]
        return last[0][1], last[0][2]

    try:
        found = least_squares(lambda z: kept(z)[0], begin, lambda z: kept(z)[1], xtol=1e-7, ftol=1e-8, max_nfev=_TRIES)
    except ValueError:  # the integration ran away
        return None
    if not found.success or not np.isfinite(found.x).all():
        return None
    covariance = _covariance(found.fun, evaluate(found.x)[1], humps)[:count, :count] * np.outer(scale, scale)
    misfit = float(np.sqrt(np.mean(found.fun**2)))
    estimate = estimate_from("output_error", terms, found.x[:count] * scale, covariance, ideal, misfit)
    return AngleFit(estimate=estimate, time_s=np.concatenate([h.time_s for h in humps]), residual_rad=found.fun)


def _covariance(residuals: Vector, design: Matrix, humps: list[_Hump]) -> Matrix:
    """Covariance with each hump taken as one draw: the residuals within one hang together over seconds.

    With one hump alone there is no other to compare it with, and its residuals are taken as independent.
    """
    norms = column_norms(design)
    inverse = np.linalg.pinv(design / norms) / norms[:, None]
    ends = np.cumsum([len(hump.angle_rad) for hump in humps])
    draws = np.array([part.sum(axis=1) for part in np.split(inverse * residuals, ends[:-1], axis=1)]).T
    alone: Matrix = inverse @ inverse.T * float(residuals @ residuals) / max(1, len(residuals) - design.shape[1])
    if len(humps) == 1:
        return alone
    # The start of a hump is free and soaks up its own draw, so the sums are nearly those of the shared terms alone.
    together: Matrix = len(humps) / (len(humps) - 1) * draws @ draws.T
    larger = np.maximum(1.0, np.sqrt(np.diag(together) / np.diag(alone)))
    widened: Matrix = alone * np.outer(larger, larger)
    return widened


def _humps(record: YawRecord) -> list[_Hump]:
    programme, time = record.programme, record.time_s
    step = max(_STEP_S, float(np.median(np.diff(time))))
    work = np.concatenate([[0.0], np.cumsum(np.diff(time) * (record.current_A[1:] + record.current_A[:-1]) / 2)])
    humps = []
    for number in range(programme.humps):
        begin = programme.start_s + number * programme.period_s
        fine = np.linspace(begin, begin + 3 * programme.rise_s, 601)
        awake = fine[np.abs(programme.at(fine).rate_radps) > _AWAKE * abs(programme.max_rate_radps)]
        last = min(float(awake[-1]), float(time[-1]))
        own = np.arange(float(awake[0]), last, step)
        if len(own) < 10:
            raise InputError(record.path, "column t_s", f"has fewer than 10 rows in hump {number + 1}", "sample faster")
        spline = smooth_angle(record, (float(own[0]), float(own[0]) + programme.rise_s))
        humps.append(
            _Hump(
                own,
                np.interp(own, time, record.angle_rad),
                np.diff(np.interp(own, time, work)) / np.diff(own),
                (float(spline(own[0])), float(spline(own[0], 1))),
            )
        )
    return humps


def _predictor(rig: YawRig, terms: tuple[str, ...]):  # type: ignore[no-untyped-def]
    """``predict(values, start, hump) -> (angles (n,), sensitivities (n, terms + 2))``."""
    model = yaw_rig_model("body", rig, with_current_loop=False)
    parameters = model.parameter_values({"body.inertia": 0.0})
    chosen = [model.parameter_names.index(_NAMES[term]) for term in terms]
    braking = model.parameter_names.index("friction.quadratic_braking")
    rougher = rig.quadratic_braking - rig.quadratic_Nms2
    given, x = ca.SX.sym("c", len(terms)), model.x
    whole = ca.SX(parameters)
    for place, value in zip(chosen, ca.vertsplit(given), strict=True):
        whole[place] = value
    whole[braking] = whole[model.parameter_names.index("friction.quadratic")] + rougher
    h = ca.SX.sym("h")
    following = x
    for _ in range(_SUBSTEPS):
        following = runge_kutta_step(model)(following, model.u, whole, h / _SUBSTEPS)
    sensitivity = ca.SX.sym("S", x.numel(), len(terms) + 2)
    moved = ca.jacobian(following, x) @ sensitivity
    moved[:, : len(terms)] += ca.jacobian(following, given)
    step = ca.Function(
        "step", [ca.horzcat(x, sensitivity), model.u, h, given], [ca.horzcat(following, moved)], {"cse": True}
    )
    width = 1 + len(terms) + 2
    first = np.hstack([np.zeros((2, len(terms))), np.eye(2)])
    loops: dict[int, ca.Function] = {}

    def predict(values: Vector, start: Vector, hump: _Hump) -> tuple[Vector, Matrix]:
        count = len(hump.current_A)
        loops.setdefault(count, step.mapaccum(count))
        begin = np.hstack([start[:, None], first])
        intervals = np.diff(hump.time_s)[None, :]
        path = loops[count](begin, hump.current_A[None, :], intervals, np.repeat(values[:, None], count, axis=1))
        row = np.asarray(path)[0].reshape(-1, width)
        at = np.vstack([begin[0], row])
        return at[:, 0], at[:, 1:]

    return predict
