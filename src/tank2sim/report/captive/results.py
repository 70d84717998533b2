"""The charts of a reduced captive campaign: fits with their bands, loops, harmonics and residuals."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import altair as alt
import numpy as np

from tank2sim.arrays import Array
from tank2sim.cards.scaling import Scales
from tank2sim.cards.terms import parse_term
from tank2sim.dynamics.abkowitz import polynomial
from tank2sim.identification.captive.equations import rigid_body_force
from tank2sim.identification.captive.harmonics import ReducedRun
from tank2sim.identification.captive.reduction import ForceResult, Reduction
from tank2sim.report.captive.charts import (
    Across,
    ForceLoop,
    ForceSeries,
    Harmonics,
    Residual,
    force_chart,
    harmonic_chart,
    loop_chart,
    residual_chart,
)

_NORMAL = 1.959964
_SAMPLES = 81
_LOOPS = 4


def reduction_charts(reduction: Reduction) -> dict[str, alt.TopLevelMixin]:
    """File stem to chart: what the campaign has runs for."""
    charts: dict[str, alt.TopLevelMixin] = {}
    for force in reduction.forces:
        for kind, words in (("static_drift", "drift angle"), ("static_rudder", "rudder angle")):
            if chart := _angle_chart(reduction, force, kind, words):
                charts[f"{kind}_{force}"] = chart
        for kind, words in (("pure_sway", "sway velocity amplitude v'"), ("pure_yaw", "yaw rate amplitude r'")):
            if force != "X" and (chart := _amplitude_chart(reduction, force, kind, words)):
                charts[f"{kind}_{force}"] = chart
        if force != "X" and (chart := _harmonics(reduction, force)):
            charts[f"harmonics_{force}"] = chart
    for kind in ("pure_sway", "pure_yaw", "yaw_with_drift"):
        if loops := _loops(reduction, kind):
            charts[f"loops_{kind}"] = loops
    charts["residuals"] = residual_chart(
        [
            Residual(run=row.run, kind=row.type.replace("_", " "), force=force, value=-row.error / row.standard_error)
            for force, result in reduction.forces.items()
            for row in result.left_out
        ],
        title="Each run against its prediction from all the others",
    )
    return charts


def _angle_chart(reduction: Reduction, force: str, kind: str, words: str) -> alt.LayerChart | None:
    """Force coefficient of the steady runs at the test speed against the angle that they vary."""
    runs = [run for run in reduction.runs if run.run.type == kind]
    straight_runs = [run for run in reduction.runs if _varies_alone(run, kind) and run not in runs]
    if len(runs) < 2:
        return None
    found = [(_angle(run, kind), *_coefficient(reduction, force, run)) for run in (*runs, *straight_runs)]
    angle, value, error = (np.array(column) for column in zip(*found, strict=True))
    across = np.linspace(angle.min(), angle.max(), _SAMPLES)
    v, rudder = (-np.sin(across), 0 * across) if kind == "static_drift" else (0 * across, across)
    fit, width = _fitted(reduction.forces[force], _regressors(reduction.forces[force], v, 0 * across, rudder))
    series = ForceSeries(
        label=kind.replace("_", " "),
        x=angle,
        value=value,
        half_width=_NORMAL * error,
        fit_x=across,
        fit_value=fit,
        fit_half_width=width,
    )
    return force_chart([series], Across(title=words, unit="rad"), f"{force}'", title=f"{force}' against {words}")


def _varies_alone(run: ReducedRun, kind: str) -> bool:
    """A steady run in which the other angle is zero: the straight run belongs to both kinds."""
    still = run.motion.delta_rad[0] if kind == "static_drift" else run.motion.v_mps[0]
    return not run.run.oscillates and run.run.type.startswith("static") and abs(float(still)) < 1e-9


def _angle(run: ReducedRun, kind: str) -> float:
    motion = run.motion
    if kind == "static_rudder":
        return float(motion.delta_rad[0])
    return -math.asin(float(motion.v_mps[0]) / motion.mean_speed_mps)


def _coefficient(reduction: Reduction, force: str, run: ReducedRun) -> tuple[float, float]:
    """Mean force coefficient of a steady run, and its standard error with the run's zero error."""
    unit = _unit(reduction, force, run)
    result = reduction.forces[force].selection
    place = result.equations.runs.index(run)
    root = result.spread.run_root(result.equations, place) * result.equations.unit
    return float(run.fits[force].coefficients[0]) / unit, float(np.linalg.norm(root[0])) / unit


def _unit(reduction: Reduction, force: str, run: ReducedRun) -> float:
    campaign = reduction.campaign
    scales = Scales(campaign.test.water_density_kgpm3, campaign.model.length_m, run.motion.mean_speed_mps)
    return float(scales.force * (scales.length if force == "N" else 1.0))


def _regressors(result: ForceResult, v: Array, r: Array, rudder: Array) -> Array:
    """What each term of a force gives per unit of its coefficient, (samples, terms), at the test speed."""
    columns = []
    for name in result.solution.names:
        term = parse_term(name.partition(" ")[0])
        assert term is not None
        acts = not term.acceleration and not term.u and " " not in name
        value = polynomial([term.name], {term.name: 1.0}, v, r, rudder, 0.0) if acts else 0.0
        columns.append(value * np.ones(len(v)))
    return np.column_stack(columns) if columns else np.zeros((len(v), 0))


def _fitted(result: ForceResult, regressors: Array) -> tuple[Array, Array]:
    """Value of the fit and half its 95 % band."""
    solution = result.solution
    variance = np.einsum("ij,jk,ik->i", regressors, solution.covariance, regressors)
    return regressors @ solution.values, _NORMAL * np.sqrt(np.maximum(variance, 0.0))


def _amplitude_chart(reduction: Reduction, force: str, kind: str, words: str) -> alt.LayerChart | None:
    """Damping of each run by (4.4) against its amplitude, a series a frequency; the third order bends the fit."""
    rows = [row for row in reduction.oscillations if row.type == kind and row.run not in reduction.not_used]
    if not rows:
        return None
    letter = rows[0].letter
    result = reduction.forces[force]
    names = result.solution.names
    amplitude = np.linspace(0.0, max(abs(row.amplitude) for row in rows), _SAMPLES)
    regressors = np.zeros((_SAMPLES, len(names)))
    for name, column in ((force + letter, 0 * amplitude + 1), (force + 3 * letter, 0.75 * amplitude**2)):
        if name in names:
            regressors[:, names.index(name)] = column
    fit, width = _fitted(result, regressors)
    series = [
        ForceSeries(label="fit", x=[], value=[], fit_x=amplitude, fit_value=fit, fit_half_width=width),
    ]
    for frequency in sorted({round(row.frequency_radps, 2) for row in rows}):
        at_frequency = [row for row in rows if round(row.frequency_radps, 2) == frequency]
        series.append(
            ForceSeries(
                label=f"{frequency:g} rad/s",
                x=[abs(row.amplitude) for row in at_frequency],
                value=[row.values[force + letter] for row in at_frequency],
                half_width=[_NORMAL * row.standard_errors[force + letter] for row in at_frequency],
            )
        )
    title = f"{force}{letter} of single runs by (4.4) against the amplitude"
    return force_chart(series, Across(title=words), f"{force}{letter}", title=title)


def _harmonics(reduction: Reduction, force: str) -> alt.VConcatChart | None:
    """Harmonics of the water's force in every oscillating run, and those that the derivatives give."""
    equations, solution = reduction.forces[force].selection.equations, reduction.forces[force].solution
    values = np.array([solution.value(name) for name in equations.names])
    bars = []
    for place, run in enumerate(equations.runs):
        if not run.run.oscillates:
            continue
        start, root = int(equations.first_rows[place]), equations.roots[place]
        rows = slice(start, start + len(root))
        measured = root @ equations.values[rows]
        fitted = root @ (equations.design[rows] @ values)
        bars.append(Harmonics(run=run.run.name, amplitude=_amplitudes(measured), fitted=_amplitudes(fitted)))
    if not bars:
        return None
    return harmonic_chart(bars, f"{force}'", title=f"Harmonics of {force}', the body's inertia taken out")


def _amplitudes(coefficients: Array) -> Array:
    amplitudes: Array = np.hypot(coefficients[1::2], coefficients[2::2])
    return amplitudes


def _loops(reduction: Reduction, kind: str) -> alt.VConcatChart | None:
    """Y and N of the water over the velocity: the largest amplitude of each frequency."""
    runs: dict[float, ReducedRun] = {}
    for run in reduction.runs:
        if run.run.type == kind:
            frequency = round(run.motion.frequency_radps, 2)
            if frequency not in runs or np.ptp(_velocity(run)) > np.ptp(_velocity(runs[frequency])):
                runs[frequency] = run
    if not runs:
        return None
    chosen = [runs[frequency] for frequency in sorted(runs)][:_LOOPS]
    across = (
        Across(title="sway velocity", unit="m/s") if kind == "pure_sway" else Across(title="yaw rate", unit="rad/s")
    )
    words = {"Y": "Y of the water (N)", "N": "N of the water (N m)"}
    title = f"Loops of {kind.replace('_', ' ')}: the opening is the added mass"
    return loop_chart([_loop(reduction, run) for run in chosen], across, words, title=title)


def _velocity(run: ReducedRun) -> Array:
    return run.motion.v_mps if run.run.type == "pure_sway" else run.motion.r_radps


def _loop(reduction: Reduction, run: ReducedRun) -> ForceLoop:
    inertia: Mapping[str, Array] = rigid_body_force(reduction.campaign, run.motion)
    kept = run.motion.kept
    forces: dict[str, Sequence[float] | Array] = {}
    fitted: dict[str, Sequence[float] | Array] = {}
    one_period = slice(0, len(run.motion.time_s) // run.motion.periods + 1)
    for force in "YN":
        fit = run.fits[force]
        forces[force] = run.run.force(force)[kept] + inertia[force]
        fitted[force] = (run.basis @ fit.coefficients + inertia[force])[one_period]
    return ForceLoop(
        label=run.run.name,
        motion=_velocity(run),
        forces=forces,
        fitted_motion=_velocity(run)[one_period],
        fitted=fitted,
    )
