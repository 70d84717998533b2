"""Evaluation of single oscillation tests: derivatives of each run by (4.4), and their dependence on amplitude.

The in-phase and quadrature parts of the first harmonic over the velocity amplitude are the damping and the added mass
of one run, the form in which a tank reports planar motion tests. With third-order terms the first harmonic depends on
the amplitude (Y_v + 3/4 Y_vvv v_a^2) and there is a third harmonic (1/4 Y_vvv v_a^3): two independent estimates of the
same number (Fourier against amplitude; ITTC 7.5-02-06-02).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from tank2sim.arrays import Array
from tank2sim.identification.captive import tank_conditions
from tank2sim.identification.captive.equations import rigid_body_force
from tank2sim.identification.captive.harmonics import ReducedRun
from tank2sim.notices import Notice
from tank2sim.records.campaigns import Campaign

_DIFFER = 3.0
"""Standard errors by which the two estimates of a third-order term may differ."""
_DISTINCT = 0.02
"""Relative difference from which two frequencies or amplitudes count as distinct."""


@dataclass(frozen=True, kw_only=True)
class OscillationDerivatives:
    """One run's derivatives by (4.4), prime and "hydrodynamic"."""

    run: str
    type: str
    letter: str  # ``v`` in pure sway, else ``r``
    # `frequency_radps`, `amplitude`: omega, and the prime amplitude of v or r
    frequency_radps: float
    amplitude: float
    # `reduced_frequency`, `frequency_parameter`: omega L/U and omega U/g
    reduced_frequency: float
    frequency_parameter: float
    # `values`, `standard_errors`: ``Yv``, ``Nv``, ``Yvdot``, ``Nvdot`` (or r) at this frequency and amplitude; errors
    # within the run
    values: Mapping[str, float]
    standard_errors: Mapping[str, float]
    # ``Yvvv``, ``Nvvv`` (or rrr) from the third harmonic, value and standard error
    third: Mapping[str, tuple[float, float]]


@dataclass(frozen=True, kw_only=True)
class CubicByTwoWays:
    """Two estimates of a third-order term: (value, standard error), None if the runs do not allow it."""

    name: str
    from_third_harmonic: tuple[float, float]
    from_amplitude: tuple[float, float] | None

    @property
    def ratio(self) -> float:
        """Difference of the estimates over its standard error; 0 for a single estimate."""
        if self.from_amplitude is None:
            return 0.0
        (first, first_error), (second, second_error) = self.from_third_harmonic, self.from_amplitude
        return (first - second) / float(np.hypot(first_error, second_error))


def oscillations(campaign: Campaign, runs: Sequence[ReducedRun]) -> tuple[OscillationDerivatives, ...]:
    """Derivatives of each oscillating run."""
    return tuple(_oscillation(campaign, run) for run in runs if run.run.oscillates)


def run_frequency_parameter(campaign: Campaign, run: ReducedRun) -> float:
    """omega U/g of an oscillating run (paper 2, section 5); 0 of a steady one."""
    return tank_conditions.brard_number(
        run.motion.frequency_radps, run.motion.mean_speed_mps, campaign.test.gravity_mps2
    )


def _oscillation(campaign: Campaign, run: ReducedRun) -> OscillationDerivatives:
    motion, model = run.motion, campaign.model
    speed, length, frequency = motion.mean_speed_mps, model.length_m, motion.frequency_radps
    letter = "v" if run.run.type == "pure_sway" else "r"
    history = motion.v_mps / speed if letter == "v" else motion.r_radps * length / speed
    amplitude = float(run.projected(history[:, None])[1, 0])
    reduced = frequency * length / speed
    inertial = rigid_body_force(campaign, motion)
    values: dict[str, float] = {}
    errors: dict[str, float] = {}
    third: dict[str, tuple[float, float]] = {}
    for force in "YN":
        unit = campaign.scales_at(speed).unit(force)
        fit = run.fits[force]
        water = (fit.coefficients[: run.regressed] + run.projected(inertial[force][:, None])[:, 0]) / unit
        error: Array = np.sqrt(np.diag(fit.covariance))[: run.regressed] / unit
        # velocity is a cos(wt), acceleration -a w sin(wt); in the prime system w L/U
        values[f"{force}{letter}"], errors[f"{force}{letter}"] = water[1] / amplitude, error[1] / amplitude
        scale = -amplitude * reduced
        values[f"{force}{letter}dot"], errors[f"{force}{letter}dot"] = water[2] / scale, error[2] / abs(scale)
        third[f"{force}{3 * letter}"] = (4 * water[5] / amplitude**3, 4 * error[5] / amplitude**3)
    return OscillationDerivatives(
        run=run.run.name,
        type=run.run.type,
        letter=letter,
        frequency_radps=frequency,
        amplitude=amplitude,
        reduced_frequency=reduced,
        frequency_parameter=run_frequency_parameter(campaign, run),
        values={name: float(value) for name, value in values.items()},
        standard_errors={name: float(error) for name, error in errors.items()},
        third={name: (float(value), float(error)) for name, (value, error) in third.items()},
    )


def distinct(values: Sequence[float]) -> int:
    """Number of values that differ by more than 2 %."""
    ordered = sorted(values)
    return sum(place == 0 or value > ordered[place - 1] * (1 + _DISTINCT) for place, value in enumerate(ordered))


def cubics(found: Sequence[OscillationDerivatives]) -> tuple[CubicByTwoWays, ...]:
    """Third-order terms of pure sway and pure yaw from the third harmonic, and from the amplitude."""
    result = []
    for kind in ("pure_sway", "pure_yaw"):
        rows = [row for row in found if row.type == kind]
        if not rows:
            continue
        for name in rows[0].third:
            third = np.array([row.third[name] for row in rows])
            weight = 1.0 / np.maximum(third[:, 1], 1e-300) ** 2
            mean = float(np.sum(weight * third[:, 0]) / np.sum(weight))
            linear = name[:2]
            result.append(
                CubicByTwoWays(
                    name=name,
                    from_third_harmonic=(mean, float(np.sum(weight) ** -0.5)),
                    from_amplitude=_from_amplitude(rows, linear),
                )
            )
    return tuple(result)


def _from_amplitude(rows: Sequence[OscillationDerivatives], name: str) -> tuple[float, float] | None:
    """Third-order term from the slope of the damping against the square of the amplitude, one level a frequency."""
    amplitude = np.array([row.amplitude for row in rows])
    if distinct([abs(value) for value in amplitude]) < 2:
        return None
    frequencies = np.array([row.frequency_radps for row in rows])
    order = np.argsort(frequencies)
    group = np.empty(len(rows), dtype=int)
    group[order] = np.cumsum(
        np.diff(frequencies[order], prepend=frequencies[order[0]]) > _DISTINCT * frequencies[order]
    )
    design = np.column_stack([group[:, None] == np.arange(group.max() + 1), 0.75 * amplitude**2]).astype(float)
    values = np.array([row.values[name] for row in rows])
    errors = np.array([row.standard_errors[name] for row in rows])
    if np.linalg.matrix_rank(design) < design.shape[1]:
        return None
    inverse = np.linalg.pinv(design / errors[:, None])
    slope = float((inverse @ (values / errors))[-1])
    return slope, float(np.linalg.norm(inverse[-1]))


def cubic_findings(found: Sequence[CubicByTwoWays]) -> list[Notice]:
    """Sentences on third-order terms that the third harmonic and the amplitude give differently."""
    messages = []
    for cubic in found:
        if cubic.from_amplitude is None or abs(cubic.ratio) <= _DIFFER:
            continue
        (first, first_error), (second, second_error) = cubic.from_third_harmonic, cubic.from_amplitude
        messages.append(
            Notice(
                f"{cubic.name} is {first:.3g} ± {first_error:.2g} by the third harmonic and {second:.3g} ± "
                f"{second_error:.2g} by the amplitude, {abs(cubic.ratio):.1f} standard errors apart: the force is not "
                "cubic in this range, or it depends on the frequency."
            )
        )
    return messages
