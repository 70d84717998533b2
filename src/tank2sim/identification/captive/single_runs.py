"""One captive run by itself, as soon as it ends: Fourier coefficients with errors, averaged cycle, repeats.

Fourier coefficients of a force F over whole periods of the motion, F = mean + sum_n (cos_n cos(n omega t) + sin_n
sin(n omega t)), with t counted from a moment at which the leading velocity (v in pure sway, else r) is greatest, are
those in which the SIMMAN workshops compare planar motion tests; their amplitude and phase do not depend on that choice
but by n times its angle. Standard errors include coloured noise within the run
(:mod:`tank2sim.identification.captive.harmonics`).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import chdtrc

from tank2sim.arrays import Array, Columns, Number
from tank2sim.identification.captive.equations import rigid_body_force
from tank2sim.identification.captive.harmonics import ReducedRun, reduced_run
from tank2sim.identification.captive.motion import harmonic_basis
from tank2sim.identification.captive.oscillation import OscillationDerivatives, oscillations
from tank2sim.identification.captive.run_faults import motion_faults, record_faults, reduced_faults
from tank2sim.notices import Notice, caution
from tank2sim.records.campaigns import Campaign
from tank2sim.records.captive_record import FORCE_COLUMNS, FORCE_UNITS_SI, CaptiveRun
from tank2sim.records.thinning import drawn_columns

CYCLE_BINS = 72
"""Parts of the averaged cycle, of 5 deg each. Project choice: the fifth harmonic then has 14 points."""
SAME_MOTION = 0.02
"""Relative difference of frequency, amplitude and speed within which two runs are repeats, as those of a campaign
are (:mod:`tank2sim.identification.captive.consistency`)."""
REPEATS_DIFFER = 0.01
"""Probability below which repeats differ by more than the noise within them. Project choice."""


@dataclass(frozen=True, kw_only=True)
class FourierCoefficient:
    """A Fourier coefficient of a run."""

    # ``X``, ``Y``, ``N`` as measured (hydrodynamic sense), ``X_water`` ... without the body's inertia, or ``v``, ``r``,
    # ``speed``, ``delta``
    signal: str
    unit: str  # ``N``, ``N m``, ``m/s``, ``rad/s`` or ``rad``
    order: int  # 0 for the mean
    # `cosine`, `sine`: For order 0 ``cosine`` is the mean, and ``sine`` is 0
    cosine: float
    sine: float
    # `cosine_error`, `sine_error`: Standard errors; 0 for motions, which are fitted as the mechanism makes them
    cosine_error: Number
    sine_error: Number
    # `amplitude`, `amplitude_error`: Amplitude (for order 0 the size of the mean), and its standard error to first
    # order
    amplitude: float
    amplitude_error: Number
    # `phase_rad`, `phase_error_rad`: Phase by which it lags the leading velocity, a cos(n omega t - phase), and its
    # standard error to first order; pi without an amplitude
    phase_rad: float
    phase_error_rad: Number


@dataclass(frozen=True, eq=False, kw_only=True)
class AveragedCycle:
    """A force over the phase of the motion, averaged over the periods of a run."""

    phase_rad: Array  # (bins,): Middle of each bin, from the greatest leading velocity
    # `mean`, `deviation`, `fit`: (bins,): Mean, standard deviation between readings of the bin, and the harmonics; N or
    # N m. nan in an empty bin
    mean: Array
    deviation: Array
    fit: Array
    count: Array  # (bins,): Readings


@dataclass(frozen=True, eq=False, kw_only=True)
class SingleRun:
    """One run reduced by itself."""

    name: str
    type: str
    # `speed_mps`, `frequency_radps`: Mean speed; frequency of the oscillation, 0 in a steady run
    speed_mps: float
    frequency_radps: float
    # `periods`, `readings`: Whole periods that are used, and their readings
    periods: int
    readings: int
    coefficients: tuple[FourierCoefficient, ...]
    cycles: dict[str, AveragedCycle]  # ``X``, ``Y``, ``N`` to the averaged cycle; empty for a steady run
    residual_rms: dict[str, float]  # Force to the root mean square of record less harmonics and trend, N or N m
    # Derivatives of an oscillating run whose model is known, by its first and third harmonics
    derivatives: OscillationDerivatives | None
    # Columns ``t_s``, and record, fit and residual of each force (``X_N``, ``X_fit_N``, ``X_residual_N``), to draw
    history: Columns
    faults: tuple[str, ...]  # Contradictions in the record

    def coefficient(self, signal: str, order: int) -> FourierCoefficient:
        """The coefficient of a signal and order.

        Raises KeyError: There is none.
        """
        for found in self.coefficients:
            if (found.signal, found.order) == (signal, order):
                return found
        raise KeyError(f"{signal} {order}")


@dataclass(frozen=True, kw_only=True)
class RepeatedCoefficient:
    """A Fourier coefficient in repeats of a run."""

    # `signal`, `unit`, `order`, `part`: ``part`` is ``mean``, ``cos`` or ``sin``
    signal: str
    unit: str
    order: int
    part: str
    values: tuple[float, ...]  # In the order of the runs
    # `mean`, `deviation`: Over the runs; the standard deviation of one run
    mean: float
    deviation: float
    expected: Number  # Deviation that the noise within the runs explains
    chance: Number  # Probability of a larger scatter by that noise alone

    @property
    def differs(self) -> bool:
        """Whether the runs differ by more than the noise within them."""
        return self.chance < REPEATS_DIFFER

    @property
    def notice(self) -> Notice:
        """The difference in words."""
        part = f"{self.signal} {self.part} {self.order or ''}".rstrip()
        expected = f"their noise explains {self.expected:.2g} (chance {self.chance:.1g})"
        return Notice(f"Repeats differ in {part} by {self.deviation:.3g} {self.unit}; {expected}.")


@dataclass(frozen=True, eq=False, kw_only=True)
class CaptiveRunStudy:
    """Captive runs reduced by themselves."""

    runs: tuple[SingleRun, ...]
    # Scatter of the coefficients between the runs; empty for a single one and for runs of different tests
    repeats: tuple[RepeatedCoefficient, ...]
    inertia_removed: bool  # Whether the model is known, and its inertia removed
    notices: tuple[Notice, ...]


def study_runs(
    runs: Sequence[CaptiveRun], campaign: Campaign | None, remarks: Sequence[Notice] = ()
) -> tuple[CaptiveRunStudy, tuple[ReducedRun, ...]]:
    """Reduce runs, each by itself, and compare repeats.

    `campaign`: Model and test; without them no inertia is removed and no derivatives are given; `remarks`: Notices on
    the records.

    Raises InputError: As of :func:`single_run`.
    """
    single, reduced = zip(*(single_run(run, campaign) for run in runs), strict=True)
    alike = same_test(single)
    repeats = repeated_coefficients(single) if alike and len(runs) > 1 else ()
    notices = [*remarks, *(caution(fault) for run in single for fault in run.faults)]
    if campaign is None:
        notices.append(
            Notice(
                "Without a campaign the forces are as recorded, with the reaction of the model's inertia, and no "
                'derivatives are given: give campaign="campaign.toml".'
            )
        )
    if not alike:
        notices.append(Notice("The runs are of different tests (angles, frequency, amplitude or speed): not compared."))
    notices += [row.notice for row in repeats if row.differs]
    study = CaptiveRunStudy(runs=single, repeats=repeats, inertia_removed=campaign is not None, notices=tuple(notices))
    return study, reduced


def single_run(run: CaptiveRun, campaign: Campaign | None) -> tuple[SingleRun, ReducedRun]:
    """Reduce one run.

    `campaign`: Model and test; without them no inertia is removed and no derivatives are given.

    Raises InputError: An oscillating run has no whole period or too few readings a period, or no carriage moves so.
    """
    for fault in motion_faults(run):
        raise fault
    reduced = reduced_run(run)
    faults = [*(record_faults(campaign, run) if campaign else ()), *reduced_faults(reduced)]
    coefficients = [*_motion_coefficients(reduced), *_force_coefficients(reduced)]
    if campaign is not None:
        coefficients += _force_coefficients(reduced, rigid_body_force(campaign, reduced.motion))
    motion = reduced.motion
    return SingleRun(
        name=run.name,
        type=run.type,
        speed_mps=motion.mean_speed_mps,
        frequency_radps=motion.frequency_radps,
        periods=motion.periods,
        readings=len(motion.time_s),
        coefficients=tuple(coefficients),
        cycles={force: averaged_cycle(reduced, force) for force in FORCE_COLUMNS} if run.oscillates else {},
        residual_rms={force: float(np.sqrt(np.mean(reduced.residual(force) ** 2))) for force in FORCE_COLUMNS},
        derivatives=oscillations(campaign, [reduced])[0] if campaign is not None and run.oscillates else None,
        history=_history(reduced),
        faults=tuple(str(fault) for fault in faults),
    ), reduced


def _history(reduced: ReducedRun) -> Columns:
    """Record, fit and residual of each force, thinned to draw."""
    kept = reduced.motion.kept
    columns = {"t_s": reduced.run.time_s[kept]}
    for force in FORCE_COLUMNS:
        record, fit, unit = (
            reduced.run.force(force)[kept],
            reduced.fitted(force),
            FORCE_COLUMNS[force][2:],
        )
        named = {force: record, f"{force}_fit": fit, f"{force}_residual": record - fit}
        columns |= {f"{name}_{unit}": values for name, values in named.items()}
    return drawn_columns(columns)


def averaged_cycle(run: ReducedRun, force: str) -> AveragedCycle:
    """A force averaged over the periods of a run, by phase.

    The mean of a bin is the value of the harmonics at its middle plus the mean residual inside it: the curvature of
    the force over the bin does not bias it, and a trend of the zero does not widen it.
    """
    fit, left = run.fits[force], run.residual(force)
    waves = [place for place, label in enumerate(run.labels) if label != "trend"]
    # Phase as recorded: the time of the motion has the delay of the forces taken out, and so have the harmonics.
    phase = np.mod(run.motion.frequency_radps * run.motion.time_s, 2 * math.pi)
    place = np.minimum((phase / (2 * math.pi) * CYCLE_BINS).astype(int), CYCLE_BINS - 1)
    count = np.bincount(place, minlength=CYCLE_BINS).astype(float)
    with np.errstate(divide="ignore", invalid="ignore"):
        residual = np.bincount(place, left, CYCLE_BINS) / count
        square = np.bincount(place, left**2, CYCLE_BINS) / count
        spread = np.sqrt(np.maximum(square - residual**2, 0.0) * count / (count - 1))
    middle = (np.arange(CYCLE_BINS) + 0.5) * 2 * math.pi / CYCLE_BINS
    harmonics = harmonic_basis(middle, 1.0, len(waves) // 2) @ fit.coefficients[waves]
    return AveragedCycle(
        phase_rad=middle,
        mean=harmonics + residual,
        deviation=np.where(np.isfinite(spread), spread, np.nan),
        fit=harmonics,
        count=count,
    )


def same_test(runs: Sequence[SingleRun]) -> bool:
    """True for repeats of one test: motions whose Fourier coefficients are the same within :data:`SAME_MOTION`."""
    return all(_same_motion(runs[0], other) for other in runs[1:])


def _same_motion(first: SingleRun, other: SingleRun) -> bool:
    frequency = first.frequency_radps
    if other.type != first.type or abs(other.frequency_radps - frequency) > SAME_MOTION * frequency:
        return False
    for signal, order, scale in (("v", 0, 0.1), ("v", 1, 0.1), ("r", 0, 0.1), ("r", 1, 0.1), ("speed", 0, 0.0)):
        if order > 0 and not frequency:
            continue
        a, b = (run.coefficient(signal, order).amplitude for run in (first, other))
        if abs(b - a) > SAME_MOTION * max(a, scale * first.speed_mps):
            return False
    rudders = first.coefficient("delta", 0).cosine, other.coefficient("delta", 0).cosine
    return abs(rudders[0] - rudders[1]) <= math.radians(0.2)


def repeated_coefficients(runs: Sequence[SingleRun]) -> tuple[RepeatedCoefficient, ...]:
    """Fourier coefficients of the forces in repeats of one run: their scatter, and what their noise explains."""
    found = []
    for first in runs[0].coefficients:
        if first.signal not in FORCE_COLUMNS:
            continue
        same = [run.coefficient(first.signal, first.order) for run in runs]
        parts = (("mean", "cosine"),) if first.order == 0 else (("cos", "cosine"), ("sin", "sine"))
        for part, key in parts:
            values = np.array([getattr(each, key) for each in same])
            errors = np.array([getattr(each, f"{key}_error") for each in same])
            weights = errors**-2.0
            scatter = float(np.sum(weights * (values - np.sum(weights * values) / weights.sum()) ** 2))
            found.append(
                RepeatedCoefficient(
                    signal=first.signal,
                    unit=first.unit,
                    order=first.order,
                    part=part,
                    values=tuple(values.tolist()),
                    mean=float(values.mean()),
                    deviation=float(values.std(ddof=1)),
                    expected=float(np.sqrt(np.mean(errors**2))),
                    chance=float(chdtrc(len(values) - 1, scatter)),
                )
            )
    return tuple(found)


def _motion_coefficients(run: ReducedRun) -> list[FourierCoefficient]:
    motion = run.motion
    found = []
    for signal, unit, values in (
        ("v", "m/s", motion.v_mps),
        ("r", "rad/s", motion.r_radps),
        ("speed", "m/s", motion.speed_mps),
        ("delta", "rad", motion.delta_rad),
    ):
        coefficients = run.projected(values[:, None])[:, 0]
        found += _pairs(signal, unit, coefficients, np.zeros(len(coefficients)))
    return found


def _force_coefficients(run: ReducedRun, inertial: Mapping[str, Array] | None = None) -> list[FourierCoefficient]:
    """Coefficients of the forces as recorded; with the force of the carried body (n,), the water's."""
    found = []
    for force, fit in run.fits.items():
        values, errors, part = fit.coefficients.copy(), np.sqrt(np.diag(fit.covariance)), ""
        if inertial is not None:
            values[: run.regressed] += run.projected(inertial[force][:, None])[:, 0]
            part = "_water"
        found += _pairs(f"{force}{part}", FORCE_UNITS_SI[force], values, errors)
    return found


def _pairs(signal: str, unit: str, values: Array, errors: Array) -> list[FourierCoefficient]:
    """Mean and pairs of cosine and sine, without the trend, which follows the last pair."""
    found = []
    for order in range((len(values) - 1) // 2 + 1):
        places = [0] if order == 0 else [2 * order - 1, 2 * order]
        cosine, sine = [*values[places].tolist(), 0.0][:2]
        cosine_error, sine_error = [*errors[places].tolist(), 0.0][:2]
        amplitude = math.hypot(cosine, sine)
        amplitude_error, phase_error = math.hypot(cosine_error, sine_error), math.pi
        if amplitude:
            amplitude_error = math.hypot(cosine * cosine_error, sine * sine_error) / amplitude
            phase_error = min(math.hypot(sine * cosine_error, cosine * sine_error) / amplitude**2, math.pi)
        found.append(
            FourierCoefficient(
                signal=signal,
                unit=unit,
                order=order,
                cosine=cosine,
                sine=sine,
                cosine_error=cosine_error,
                sine_error=sine_error,
                amplitude=amplitude,
                amplitude_error=amplitude_error,
                phase_rad=math.atan2(sine, cosine),
                phase_error_rad=phase_error,
            )
        )
    return found
