"""Data of the charts of a reduced captive campaign: fits with their bands, loops and harmonics."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import groupby
from typing import Literal

import numpy as np

from tank2sim.arrays import Array, Columns
from tank2sim.cards.terms import known_term
from tank2sim.dynamics.abkowitz import polynomial
from tank2sim.identification.captive.equations import rigid_body_force
from tank2sim.identification.captive.harmonics import ReducedRun
from tank2sim.identification.captive.oscillation import OscillationDerivatives
from tank2sim.identification.captive.reduction import ForceResult, Reduction
from tank2sim.records.thinning import drawn_columns

_NORMAL = 1.959964
_SAMPLES = 81
_LOOPS = 4
_LOOP_SAMPLES = 200
"""Loops of a chart, the largest of each frequency, and samples of each. Project choice: a panel is 560 pixels wide."""


_ACROSS = {
    "static_drift": ("drift angle", "rad"),
    "static_rudder": ("rudder angle", "rad"),
    "steady_turn": ("yaw rate r'", "1"),
}
"""Kind of steady run to the motion that it varies, and its unit."""
_LETTER = {"static_drift": "v", "static_rudder": "d", "steady_turn": "r"}
_ZERO = 1e-9
"""Smaller angles (rad) count as zero."""


def _nothing() -> Array:
    return np.zeros(0)


@dataclass(frozen=True, eq=False, kw_only=True)
class ForceSeries:
    """One force against an angle or an amplitude."""

    label: str  # Name of the series, such as ``pure sway, 0.45 rad/s``
    # `x`, `value`: (n,): Measured points
    x: Array = field(default_factory=_nothing)
    value: Array = field(default_factory=_nothing)
    half_width: Array | None = None  # (n,): Half the 95 % interval of each point, in its unit
    # `fit_x`, `fit_value`, `fit_half_width`: (m,): The fit and half its 95 % band; a fit without half widths has no
    # band
    fit_x: Array = field(default_factory=_nothing)
    fit_value: Array = field(default_factory=_nothing)
    fit_half_width: Array | None = None


@dataclass(frozen=True, eq=False, kw_only=True)
class ForceLoop:
    """Forces over the motion in one run, in the order of time."""

    label: str  # Name of the run
    motion: Array  # (n,): Sway velocity or yaw rate
    forces: Columns  # Name of a force to its values (n,)
    fitted_motion: Array = field(default_factory=_nothing)  # (m,)
    fitted: Columns = field(default_factory=dict)  # Name of a force to the values (m,) of the fit


@dataclass(frozen=True, eq=False, kw_only=True)
class Harmonics:
    """Amplitudes of the harmonics (1, 2, 3, ... in this order) of a force in one run, measured and fitted."""

    run: str
    amplitude: Array
    fitted: Array | None = None


@dataclass(frozen=True, eq=False, kw_only=True)
class ForcePlot:
    """A force against the motion: titles of both, and the unit of the motion."""

    title: str
    across: str
    unit: str
    up: str
    series: tuple[ForceSeries, ...]
    kind: Literal["force"] = "force"


@dataclass(frozen=True, eq=False, kw_only=True)
class HarmonicsPlot:
    """Harmonics of a force in the oscillating runs."""

    title: str
    up: str
    runs: tuple[Harmonics, ...]
    kind: Literal["harmonics"] = "harmonics"


@dataclass(frozen=True, eq=False, kw_only=True)
class LoopPlot:
    """Loops of ``Y`` and ``N`` over the motion, with its title and unit."""

    title: str
    across: str
    unit: str
    loops: tuple[ForceLoop, ...]
    kind: Literal["loops"] = "loops"


ReductionPlot = ForcePlot | HarmonicsPlot | LoopPlot


def reduction_plots(reduction: Reduction) -> dict[str, ReductionPlot]:
    """Return the data of the charts of a reduction by file stem, as far as the campaign has runs for them."""
    plots: dict[str, ReductionPlot | None] = {}
    for force in reduction.forces:
        for kind, across in _ACROSS.items():
            plots[f"{kind}_{force}"] = _steady_plot(reduction, force, kind, across)
        for kind, words in (("pure_sway", "sway velocity amplitude v'"), ("pure_yaw", "yaw rate amplitude r'")):
            if force != "X":
                plots[f"{kind}_{force}"] = _amplitude_plot(reduction, force, kind, words)
        if force != "X":
            plots[f"harmonics_{force}"] = _harmonics(reduction, force)
    for kind in ("pure_sway", "pure_yaw", "yaw_with_drift"):
        plots[f"loops_{kind}"] = _loops(reduction, kind)
    return {stem: plot for stem, plot in plots.items() if plot is not None}


def _steady_plot(reduction: Reduction, force: str, kind: str, across_title: tuple[str, str]) -> ForcePlot | None:
    """Force coefficient of the steady runs at the test speed against the one motion that they vary."""
    runs = [run for run in reduction.runs if _varies(run, kind)]
    straight_runs = [run for run in reduction.runs if _varies_alone(run, kind) and run not in runs]
    if len(runs) < 2:
        return None
    letter = _LETTER[kind]
    found = [
        (_motion_of(run, letter, reduction.campaign.model.length_m), *_coefficient(reduction, force, run))
        for run in (*runs, *straight_runs)
    ]
    angle, value, error = (np.array(column) for column in zip(*found, strict=True))
    across = np.linspace(angle.min(), angle.max(), _SAMPLES)
    motions = dict.fromkeys("vrd", 0 * across) | {letter: -np.sin(across) if letter == "v" else across}
    fit, width = _fitted(reduction.forces[force], _regressors(reduction.forces[force], motions))
    series = ForceSeries(
        label=kind.replace("_", " "),
        x=angle,
        value=value,
        half_width=_NORMAL * error,
        fit_x=across,
        fit_value=fit,
        fit_half_width=width,
    )
    return ForcePlot(
        title=f"{force}' against {across_title[0]}",
        across=across_title[0],
        unit=across_title[1],
        up=f"{force}'",
        series=(series,),
    )


def _varies(run: ReducedRun, kind: str) -> bool:
    """A run of a kind that is upright, a steady turn without drift and rudder."""
    if run.run.type != kind or run.motion.heel_rad:
        return False
    return kind != "steady_turn" or all(abs(_motion_of(run, letter)) < _ZERO for letter in "vd")


def _varies_alone(run: ReducedRun, kind: str) -> bool:
    """A static run in which all but the motion of a kind is zero: the straight run belongs to all kinds."""
    others = [letter for letter in "vd" if letter != _LETTER[kind]]
    upright = run.run.type.startswith("static") and not run.motion.heel_rad
    return upright and all(abs(_motion_of(run, letter)) < _ZERO for letter in others)


def _motion_of(run: ReducedRun, letter: str, length_m: float = 1.0) -> float:
    """Drift angle -asin(v/U), r L/U or the rudder angle of a steady run."""
    motion = run.motion
    if letter == "d":
        return float(motion.delta_rad[0])
    if letter == "r":
        return float(motion.r_radps[0]) * length_m / motion.mean_speed_mps
    return -math.asin(float(motion.v_mps[0]) / motion.mean_speed_mps)


def _coefficient(reduction: Reduction, force: str, run: ReducedRun) -> tuple[float, float]:
    """Mean coefficient of the water's force in a steady run, and its standard error with the run's zero error."""
    unit = float(reduction.campaign.scales_at(run.motion.mean_speed_mps).unit(force))
    result = reduction.forces[force].selection
    place = result.equations.runs.index(run)
    root = result.spread.run_roots(result.equations)[place] * result.equations.unit
    inertia = rigid_body_force(reduction.campaign, run.motion)[force]
    return (float(run.fits[force].coefficients[0]) + float(np.mean(inertia))) / unit, float(
        np.linalg.norm(root[0])
    ) / unit


def _regressors(result: ForceResult, motions: Mapping[str, Array]) -> Array:
    """Force per unit of each term's coefficient, (samples, terms), at the test speed, in motions v, r and d."""
    columns, samples = [], len(motions["v"])
    for name in result.solution.names:
        term = known_term(name.partition(" ")[0])
        acts = not term.acceleration and not term.u and not term.phi and " " not in name
        value = polynomial([term.name], {term.name: 1.0}, **motions) if acts else 0.0
        columns.append(value * np.ones(samples))
    return np.column_stack(columns) if columns else np.zeros((samples, 0))


def _fitted(result: ForceResult, regressors: Array) -> tuple[Array, Array]:
    """Value of the fit and half its 95 % band."""
    solution = result.solution
    variance = np.einsum("ij,jk,ik->i", regressors, solution.covariance, regressors)
    return regressors @ solution.values, _NORMAL * np.sqrt(np.maximum(variance, 0.0))


def _amplitude_plot(reduction: Reduction, force: str, kind: str, words: str) -> ForcePlot | None:
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
    series = [ForceSeries(label="fit", fit_x=amplitude, fit_value=fit, fit_half_width=width)]
    name = force + letter
    for _, at_frequency in groupby(sorted(rows, key=_frequency), key=_frequency):
        series.append(_frequency_series([*at_frequency], name))
    title = f"{name} of single runs against the amplitude"
    return ForcePlot(title=title, across=words, unit="1", up=name, series=tuple(series))


def _frequency(row: OscillationDerivatives) -> float:
    return round(row.frequency_radps, 2)


def _frequency_series(rows: Sequence[OscillationDerivatives], name: str) -> ForceSeries:
    return ForceSeries(
        label=f"{_frequency(rows[0]):g} rad/s",
        x=np.array([abs(row.amplitude) for row in rows]),
        value=np.array([row.values[name] for row in rows]),
        half_width=_NORMAL * np.array([row.standard_errors[name] for row in rows]),
    )


def _harmonics(reduction: Reduction, force: str) -> HarmonicsPlot | None:
    """Harmonics of the water's force in every oscillating run, and those that the derivatives give."""
    equations, solution = reduction.forces[force].selection.equations, reduction.forces[force].solution
    values = np.array([solution.value(name) for name in equations.names])
    bars = []
    for place, run in enumerate(equations.runs):
        if not run.run.oscillates:
            continue
        rows, root = equations.rows[place], equations.roots[place]
        measured = root @ equations.values[rows]
        fitted = root @ (equations.design[rows] @ values)
        bars.append(Harmonics(run=run.run.name, amplitude=_amplitudes(measured), fitted=_amplitudes(fitted)))
    if not bars:
        return None
    title = f"Harmonics of {force}', without the body's inertia"
    return HarmonicsPlot(title=title, up=f"{force}'", runs=tuple(bars))


def _amplitudes(coefficients: Array) -> Array:
    amplitudes: Array = np.hypot(coefficients[1::2], coefficients[2::2])
    return amplitudes


def _loops(reduction: Reduction, kind: str) -> LoopPlot | None:
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
    words, unit = ("sway velocity", "m/s") if kind == "pure_sway" else ("yaw rate", "rad/s")
    title = f"Loops of {kind.replace('_', ' ')}: the opening is the added mass"
    loops = tuple(_loop(reduction, run) for run in chosen)
    return LoopPlot(title=title, across=words, unit=unit, loops=loops)


def _velocity(run: ReducedRun) -> Array:
    return run.motion.v_mps if run.run.type == "pure_sway" else run.motion.r_radps


def _loop(reduction: Reduction, run: ReducedRun) -> ForceLoop:
    """Motion, and Y and N of the water, over the whole run and one period of the fit; thinned to draw."""
    inertia: Mapping[str, Array] = rigid_body_force(reduction.campaign, run.motion)
    kept, velocity = run.motion.kept, _velocity(run)
    one_period = slice(0, len(run.motion.time_s) // run.motion.periods + 1)
    measured = {force: run.run.force(force)[kept] + inertia[force] for force in "YN"}
    fitted = {force: (run.fitted(force) + inertia[force])[one_period] for force in "YN"}
    forces = drawn_columns({"motion": velocity, **measured}, _LOOP_SAMPLES)
    fit = drawn_columns({"motion": velocity[one_period], **fitted}, _LOOP_SAMPLES)
    return ForceLoop(
        label=run.run.name,
        motion=forces.pop("motion"),
        forces=forces,
        fitted_motion=fit.pop("motion"),
        fitted=fit,
    )
