"""The measured motion of a captive run: its frequency, its whole periods, and smooth histories.

Frequencies and amplitudes come from the record, never from the test sheet. Histories are mean and harmonics by least
squares, so that accelerations are exact derivatives of the mechanism's motion and noise of the motion sensors does not
enter the products of (3.8).
"""

from __future__ import annotations

import math
from collections.abc import Hashable, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from tank2sim.arrays import Array
from tank2sim.errors import InputError
from tank2sim.records.captive_record import CaptiveRun

MOTION_HARMONICS = 3
"""Number of harmonics of the mechanism's motion."""
_WHOLE = 0.02
"""Share of a period by which a record may fall short of a whole number of them: rounding of its ends."""
_FEWEST_PER_PERIOD = 16
_ITERATIONS = 8
_SETTLED = 1e-8
"""Relative step of the frequency that is the last: the next would be smaller by as much again (project choice)."""
_FEW_PERIODS = 2.5


@dataclass(frozen=True, eq=False, kw_only=True)
class CaptiveMotion:
    """Smooth motion of a run over whole periods; SI, radians, rudder to starboard."""

    kept: slice  # Rows of the record used
    # (rows,): Of those rows, less the delay of the forces behind the motion; in an oscillating run counted from a
    # moment at which the leading velocity (v in pure sway, else r) is greatest, so that it is cos(omega t) and its
    # acceleration is -sin(omega t)
    time_s: Array
    frequency_radps: float  # omega; 0 in a steady run
    periods: int  # Whole periods kept; 0 in a steady run
    # `v_mps`, `r_radps`, `speed_mps`, `delta_rad`, `vdot_mps2`, `rdot_radps2`: (rows,): ``speed_mps`` is U through the
    # water
    v_mps: Array
    r_radps: Array
    speed_mps: Array
    delta_rad: Array
    vdot_mps2: Array
    rdot_radps2: Array
    heel_rad: float = 0.0  # At which the model is held
    # What :mod:`tank2sim.identification.captive.equations` has projected on the harmonics of this motion, kept because
    # a campaign's equations are set up several times
    projections: dict[Hashable, Array] = field(init=False, repr=False, default_factory=dict)
    # The same of this motion with an error, by its kind and size
    erring: dict[tuple[str, float], dict[Hashable, Array]] = field(init=False, repr=False, default_factory=dict)

    @cached_property
    def mean_speed_mps(self) -> float:
        """Mean of U."""
        return float(np.mean(self.speed_mps))

    @cached_property
    def largest(self) -> tuple[float, float, float]:
        """Largest magnitudes of v (m/s), r (rad/s) and the rudder's angle (rad)."""
        v, r, delta = (float(np.max(np.abs(values))) for values in (self.v_mps, self.r_radps, self.delta_rad))
        return v, r, delta

    @cached_property
    def accelerates(self) -> tuple[bool, bool]:
        """True for a sway velocity, and for a yaw rate, that changes."""
        return bool(np.any(self.vdot_mps2)), bool(np.any(self.rdot_radps2))

    def with_error(self, source: str, size: float, changed: CaptiveMotion) -> CaptiveMotion:
        """This motion `changed` by an error of a kind and size; what is projected of it is kept here."""
        object.__setattr__(changed, "projections", self.erring.setdefault((source, size), changed.projections))
        return changed

    def amplitude(self, values: Array) -> float:
        """Half the range of a history."""
        return 0.5 * float(np.ptp(values))


def leading(run: CaptiveRun) -> Array:
    """The leading velocity of a type of run: v in pure sway, r in yaw."""
    return run.v_mps if run.type == "pure_sway" else run.r_radps


def run_motion(run: CaptiveRun) -> CaptiveMotion:
    """The motion of a run.

    Raises InputError: An oscillating run has no oscillation, less than one whole period, or too few readings a period.
    """
    return _oscillating(run) if run.oscillates else _steady(run)


def _steady(run: CaptiveRun) -> CaptiveMotion:
    count = len(run.time_s)

    def level(values: Array) -> Array:
        return np.broadcast_to(np.mean(values), count)  # of one number: a campaign of millions of rows fits in memory

    return CaptiveMotion(
        kept=slice(0, count),
        time_s=run.time_s,
        frequency_radps=0.0,
        periods=0,
        v_mps=level(run.v_mps),
        r_radps=level(run.r_radps),
        speed_mps=level(run.speed_mps),
        delta_rad=level(run.delta_rad),
        vdot_mps2=np.broadcast_to(0.0, count),
        rdot_radps2=np.broadcast_to(0.0, count),
        heel_rad=run.heel_rad,
    )


def _oscillating(run: CaptiveRun) -> CaptiveMotion:
    if len(run.time_s) < _FEWEST_PER_PERIOD:
        raise InputError(run.name, "", f"has only {len(run.time_s)} readings", "a whole period is needed")
    if np.ptp(leading(run)) == 0.0:
        name = "v_mps" if run.type == "pure_sway" else "r_radps"
        raise InputError(run.name, f"column {name}", f"does not change, in a run of {run.type}", "correct its type")
    frequency = measured_frequency(run)
    kept, periods = _whole_periods(run, frequency)
    time = run.time_s[kept]
    if len(time) < _FEWEST_PER_PERIOD * periods:
        problem = f"has {len(time) / periods:.3g} readings a period"
        raise InputError(run.name, "", problem, f"sample it at least {_FEWEST_PER_PERIOD} times a period")
    first = _fitted(leading(run)[kept], harmonic_basis(time, frequency, 1))
    time = time - math.atan2(first[2], first[1]) / frequency
    basis = harmonic_basis(time, frequency, MOTION_HARMONICS)
    v, r, speed, rudder = (
        _fitted(values[kept], basis) for values in (run.v_mps, run.r_radps, run.speed_mps, run.delta_rad)
    )
    # The forces of a row belong to the motion one delay earlier.
    time = time - run.force_delay_s
    basis = harmonic_basis(time, frequency, MOTION_HARMONICS)
    slope = _derivative_basis(basis, frequency)
    return CaptiveMotion(
        kept=kept,
        time_s=time,
        frequency_radps=frequency,
        periods=periods,
        v_mps=basis @ v,
        r_radps=basis @ r,
        speed_mps=basis @ speed,
        delta_rad=basis @ rudder,
        vdot_mps2=slope @ v,
        rdot_radps2=slope @ r,
        heel_rad=run.heel_rad,
    )


def harmonic_basis(time: Array, frequency: float, harmonics: int) -> Array:
    """Columns 1, cos(wt), sin(wt), cos(2wt), ..., (rows, 1 + 2 harmonics)."""
    basis = np.ones((1 + 2 * harmonics, len(time)))
    if harmonics:
        angle = frequency * time
        basis[1], basis[2] = np.cos(angle), np.sin(angle)
    for order in range(2, harmonics + 1):  # by the addition theorem, five times as fast as further cosines
        cosine, sine = 2 * order - 1, 2 * order
        basis[cosine] = basis[1] * basis[cosine - 2] - basis[2] * basis[sine - 2]
        basis[sine] = basis[2] * basis[cosine - 2] + basis[1] * basis[sine - 2]
    return basis.T


def _derivative_basis(basis: Array, frequency: float) -> Array:
    """Time derivative of :func:`harmonic_basis`, column by column."""
    slope = np.zeros_like(basis)
    orders = frequency * np.arange(1, basis.shape[1] // 2 + 1)
    slope[:, 1::2], slope[:, 2::2] = -orders * basis[:, 2::2], orders * basis[:, 1::2]
    return slope


def _fitted(values: Array, basis: Array) -> Array:
    # Over whole periods the columns are nearly orthogonal: the normal equations are accurate and fast.
    return np.asarray(np.linalg.solve(basis.T @ basis, basis.T @ values), dtype=np.float64)


def measured_frequency(run: CaptiveRun) -> float:
    """omega, rad/s, of an oscillating run: least squares of all its motion signals on harmonics of one frequency.

    The highest line of the spectrum starts a Gauss-Newton iteration in which each signal counts by its
    signal-to-noise ratio.
    """
    signals = _oscillating_signals(run)
    frequency = _spectral_line(run.time_s, leading(run))
    bin_width = 2 * math.pi / run.duration_s
    for _ in range(_ITERATIONS):
        centred = run.time_s - 0.5 * (run.time_s[0] + run.time_s[-1])
        step = _frequency_step(centred, signals, frequency)
        step = float(np.clip(step, -0.5 * bin_width, 0.5 * bin_width))
        frequency = max(frequency + step, 0.1 * bin_width)
        if abs(step) < _SETTLED * frequency:
            break
    return float(frequency)


def _oscillating_signals(run: CaptiveRun) -> list[Array]:
    signals = [leading(run)]
    position = run.y_m if run.type == "pure_sway" else run.psi_rad
    if position is not None and np.ptp(position) > 0:
        signals.append(position)
    return signals


def _spectral_line(time: Array, values: Array) -> float:
    """Frequency of the highest line of a signal's spectrum, padded so that lines lie close, rad/s."""
    count = len(values)
    padded = 4 * count
    spectrum = np.abs(np.fft.rfft((values - float(np.mean(values))) * np.hanning(count), padded))
    # Less than half a cycle in the record is not an oscillation.
    spectrum[: max(2, padded // (2 * count))] = 0.0
    step = (time[-1] - time[0]) / (count - 1)
    line = 2 * math.pi * int(np.argmax(spectrum)) / (padded * step)
    bin_width = 2 * math.pi / (count * step)
    if line > _FEW_PERIODS * bin_width:
        return float(line)
    # With a period or two the lines of positive and negative frequency overlap, and half the frequency may have the
    # highest line; the best fit of a sinusoid finds the right one.
    trials = bin_width * np.arange(0.5, _FEW_PERIODS + 1.0, 0.1)
    return float(min(trials, key=lambda trial: _misfit(values, harmonic_basis(time, trial, 1))))


def _misfit(values: Array, basis: Array) -> float:
    residual = values - basis @ _fitted(values, basis)
    return float(residual @ residual)


def _frequency_step(time: Array, signals: Sequence[Array], frequency: float) -> float:
    """Gauss-Newton step of the frequency."""
    basis = harmonic_basis(time, frequency, MOTION_HARMONICS)
    normal = np.asarray(np.linalg.pinv(basis.T @ basis), dtype=np.float64)
    total = weight = 0.0
    for values in signals:
        coefficients = normal @ (basis.T @ values)
        residual = values - basis @ coefficients
        slope = time * (_derivative_basis(basis, 1.0) @ coefficients)
        slope = slope - basis @ (normal @ (basis.T @ slope))
        noise = float(residual @ residual) / len(values) + 1e-24 * float(values @ values) + 1e-300
        total += float(slope @ residual) / noise
        weight += float(slope @ slope) / noise
    return total / weight if weight > 0 else 0.0


def _whole_periods(run: CaptiveRun, frequency: float) -> tuple[slice, int]:
    """The last rows of the record that span a whole number of periods, and how many periods."""
    period = 2 * math.pi / frequency
    periods = math.floor(run.duration_s / period + _WHOLE)
    if periods < 1:
        problem = f"has {run.duration_s / period:.2f} of a period ({period:.4g} s)"
        raise InputError(run.name, "", problem, "one whole period at least is needed")
    count = len(run.time_s)
    rows = min(count, round(periods * period * count / run.duration_s))
    return slice(count - rows, count), periods
