"""Estimates from tows by one method, and findings on them for the user, each a sentence."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.polynomial import Polynomial
from scipy import stats

from tank2sim.apps.rigs.tow.output_error import simulated_speeds
from tank2sim.apps.rigs.tow.records import Tows
from tank2sim.apps.rigs.tow.surge import DELAY, DRAG_POWERS, TOW_PARAMETERS, SurgeCoefficients
from tank2sim.arrays import Array, Unbounded
from tank2sim.identification.conditioning import COLLINEAR, scaled_condition
from tank2sim.notices import Notice, caution

ADDED_SHARES = (0.0, 1.0)
"""Added mass in surge over the mass with the water inside. A sphere has 0.5, slender bodies less (Lamb 1932, art. 92
and 114); the upper limit, blunt ends near the surface, is a project choice."""

USUAL_SHARES = (-0.05, 0.7)
"""The same of usual bodies, with the error of an estimate, by which a foreign unit is recognised (project choice)."""

FOREIGN_UNITS = {
    "the force is in kgf": 9.80665,
    "the force is in lbf": 4.4482216,
    "the force is in kN": 1e3,
    "the force is in gf": 9.80665e-3,
    "the mass is in t": 1e-3,
    "the mass is in lb": 1 / 0.45359237,
    "the mass is in g": 1e3,
    "the speeds are in cm/s": 1e2,
    "the speeds are in mm/s": 1e3,
    "the speeds are in knots": 3600 / 1852,
    "the speeds are in km/h": 3.6,
    "the speeds are in ft/s": 1 / 0.3048,
    "the times are in ms": 1e-3,
    "the times are in min": 60.0,
}
"""Slips, and the factor by which each makes M over m too small."""

_CORRELATED = 0.99
_TWO_SIDED_95 = 1.96
_SIGNIFICANCE = 0.05


@dataclass(frozen=True, eq=False, kw_only=True)
class TowFit:
    """Estimates of M, the chosen drag terms of (1.5) and the start delay by one method.

    Parameters
    ----------
    method : str
        ``paper``, ``qr`` or ``output_error``.
    unknowns : tuple of str
        M, the drag terms in the order of (1.5), and ``delay`` if it was estimated.
    estimated : tuple of str
        Unknowns that are estimated: all, or all but a given M.
    estimates : dict
        Name with unit (:data:`TOW_PARAMETERS`, ``added_mass_kg``) to value, SI.
    standard_errors : dict
        Name with unit to standard error (one standard deviation); empty if the method gives none. A given mass has 0.
    correlation : array (unknowns, unknowns), optional
        Correlations of the unknowns.
    condition, condition_scaled : float
        Condition number of the normal matrix, of (b_ij) in (1.12); and of that matrix with a diagonal of ones, which
        is free of the units.
    J : float
        J of (1.6), N s^(1/2), with the polynomial speed of the tows.
    largest_speed_error_mps : float
        Largest absolute difference of the integrated speed from the mean of the tows; infinite where it overflows.
    """

    method: str
    unknowns: tuple[str, ...]
    estimated: tuple[str, ...]
    estimates: dict[str, float]
    standard_errors: dict[str, float]
    correlation: Array | None
    condition: Unbounded
    condition_scaled: Unbounded
    J: float
    largest_speed_error_mps: Unbounded

    @property
    def values(self) -> Array:
        """Estimates (unknowns,), SI."""
        return np.array([self.estimates[TOW_PARAMETERS[name]] for name in self.unknowns])

    @property
    def errors(self) -> Array | None:
        """Standard errors (unknowns,), SI; None where the method gives none."""
        known = self.standard_errors
        return np.array([known[TOW_PARAMETERS[name]] for name in self.unknowns]) if known else None

    @property
    def drag_terms(self) -> dict[str, float]:
        """Drag term of (1.5) to its coefficient, SI."""
        return {name: self.estimates[TOW_PARAMETERS[name]] for name in self.unknowns if name in DRAG_POWERS}

    @property
    def start_delay_s(self) -> float:
        """Time from t = 0 to the start of the body, s; 0 if it was not estimated."""
        return self.estimates.get(TOW_PARAMETERS[DELAY], 0.0)

    @property
    def coefficients(self) -> SurgeCoefficients:
        """Mass and drag; terms that were not estimated are 0."""
        return SurgeCoefficients.of(dict(zip(self.unknowns, self.values.tolist(), strict=True)))

    @property
    def added_mass_kg(self) -> float:
        """lambda11 = M - m."""
        return self.estimates["added_mass_kg"]


def tow_findings(
    tows: Tows, force: Polynomial, speed: Polynomial, fits: Mapping[str, TowFit], designs: Mapping[str, Array]
) -> Iterator[Notice]:
    """Sentences on terms that are not identifiable, impossible values, and misfits beyond the scatter.

    `force` is in N over s, `speed` is v*(t) of the equation error, m/s over s; `designs` are the design matrices (rows,
    free unknowns) by method. The method of the paper is omitted: QR has the same estimates.
    """
    chosen = [fit for name, fit in fits.items() if name != "paper"]
    yield from _collinear(chosen, designs)
    for fit in chosen:
        yield from _uncertain(fit)
    for fit in chosen:
        yield from _impossible(fit, tows.top_speed_mps)
    yield from _polynomial_findings(tows, speed, fits["qr"])
    if "output_error" in fits:
        yield from _misfit(tows, force, fits["output_error"])
    for first, second in combinations(chosen, 2):
        yield from _difference(first, second)


def _misfit(tows: Tows, force: Polynomial, fit: TowFit) -> Iterator[Notice]:
    """A misfit of the integrated speeds beyond the scatter."""
    speeds = simulated_speeds(fit.coefficients, force, tows.time_s, fit.start_delay_s)
    row = _worst_misfit(tows, speeds, len(fit.estimated))
    if row is not None:
        fast = speeds[row] - tows.mean_speed_mps[row]
        yield Notice(
            f"output_error: the equation does not follow the tows within their scatter: at {tows.time_s[row]:g} s "
            f"it is {abs(fast):.3g} m/s too {'fast' if fast > 0 else 'slow'}; "
            f"{'' if fit.start_delay_s else 'a late start or '}a force that it lacks is likely."
        )


def _difference(first: TowFit, second: TowFit) -> Iterator[Notice]:
    """Masses of two methods that differ by more than their errors."""
    if first.errors is None or second.errors is None:
        return
    difference = abs(first.values[0] - second.values[0])
    if difference > _TWO_SIDED_95 * math.hypot(first.errors[0], second.errors[0]):
        yield Notice(
            f"{first.method} and {second.method} differ in M by {difference:.3g} kg, more than their standard "
            "errors explain; this is the accuracy of the mass."
        )


def identifiable_terms(fits: Sequence[TowFit], designs: Mapping[str, Array]) -> tuple[str, ...]:
    """The largest set of drag terms that all fits (of one model) can distinguish from M and each other.

    Among sets of equal size the one with the lower powers of the speed is taken.
    """
    terms = tuple(fits[0].drag_terms)
    for count in range(len(terms), 0, -1):
        for chosen in combinations(reversed(terms), count):
            left = [
                designs[fit.method][:, [name in chosen or name not in terms for name in fit.estimated]] for fit in fits
            ]
            if all(scaled_condition(design) <= COLLINEAR for design in left):
                return chosen
    return ()


def _collinear(fits: Sequence[TowFit], designs: Mapping[str, Array]) -> Iterator[Notice]:
    collinear = [fit for fit in fits if fit.condition_scaled > COLLINEAR**2]
    if collinear:
        numbers = " and ".join(f"{fit.condition_scaled:.2g} ({fit.method})" for fit in collinear)
        yield Notice(
            f"{', '.join(collinear[-1].estimated)} cannot all be identified from these tows: the scaled condition "
            f"number is {numbers}, above the limit of {COLLINEAR**2:g}; take fewer terms "
            f'(terms="{",".join(identifiable_terms(fits, designs)) or "none"}").'
        )


def _uncertain(fit: TowFit) -> Iterator[Notice]:
    """Pairs of unknowns that are almost one, and unknowns that may be zero."""
    if fit.correlation is None or fit.errors is None:
        return
    pairs = [
        f"{fit.unknowns[i]} and {fit.unknowns[j]} ({fit.correlation[i, j]:+.4f})"
        for i, j in combinations(range(len(fit.unknowns)), 2)
        if abs(fit.correlation[i, j]) > _CORRELATED
    ]
    if pairs:
        yield Notice(f"{fit.method}: almost fully correlated are {', '.join(pairs)}; only their combination is known.")
    zero = [
        f"{name} ({value:.3g}, standard error {error:.2g})"
        for name, value, error in zip(fit.unknowns, fit.values, fit.errors, strict=True)
        if _TWO_SIDED_95 * error > abs(value)
    ]
    if zero:
        yield Notice(f"{fit.method}: not distinguishable from zero at 95 %: {', '.join(zero)}.")


def _impossible(fit: TowFit, top_speed_mps: float) -> Iterator[Notice]:
    """Masses, speeds and drags that no body has."""
    if fit.values[0] <= 0:
        yield Notice(
            f"{fit.method}: the mass M is negative ({fit.values[0]:.4g} kg), which no body has; do not use this fit."
        )
    else:
        yield from _added_mass(fit)
    if not np.isfinite(fit.largest_speed_error_mps):
        yield Notice(f"{fit.method}: the speed with these values grows without bound; do not use this fit.")
    speeds = np.linspace(0.0, top_speed_mps, 401)[1:]
    drags = fit.coefficients.drag_N(speeds)
    minus = ", ".join(term for term, value in fit.drag_terms.items() if value < 0)
    if drags.min() < 0:
        yield Notice(
            f"{fit.method}: the drag is negative over {100 * np.mean(drags < 0):.0f} % of the speeds up to "
            f"{top_speed_mps:.3g} m/s reached, down to {drags.min():.2g} N at {speeds[drags.argmin()]:.2g} "
            "m/s; no hull has that."
        )
    elif minus:
        yield Notice(
            f"{fit.method}: the drag terms have opposite signs ({minus} negative) and largely cancel each other."
        )


def _added_mass(fit: TowFit) -> Iterator[Notice]:
    """An added mass that is none, or more than the mass, by more than its error."""
    mass_kg = fit.values[0] - fit.added_mass_kg
    share = fit.added_mass_kg / mass_kg
    error = _TWO_SIDED_95 * fit.standard_errors.get("total_mass_kg", 0.0) / mass_kg
    low, high = ADDED_SHARES
    if low - error <= share <= high + error:
        if share < 0:
            yield Notice(
                f"{fit.method}: the added mass is negative ({fit.added_mass_kg:.4g} kg), but not beyond its error."
            )
        return
    usual = {name: (1 + share) * factor - 1 for name, factor in FOREIGN_UNITS.items()}
    units = [f"{name} (then {own:.2g})" for name, own in usual.items() if USUAL_SHARES[0] <= own <= USUAL_SHARES[1]]
    likely = f"; it would fit a body if {' or if '.join(units)}" if units else ""
    yield caution(
        f"{fit.method}: the added mass is {fit.added_mass_kg:.4g} kg, {share:.3g} times the mass, and bodies "
        f"that are towed have {low:g} to {high:g}{likely}; check force, mass and speeds."
    )


def _polynomial_findings(tows: Tows, speed: Polynomial, fit: TowFit) -> Iterator[Notice]:
    if len(fit.estimated) > len(speed.coef):
        yield Notice(
            f"{fit.method}: {len(fit.estimated)} unknowns are estimated from the {len(speed.coef)} coefficients of a "
            f"speed polynomial of degree {speed.degree()}; the standard errors then reflect the arithmetic, not the "
            "drag."
        )
    speeds = speed(tows.time_s)
    row = _worst_misfit(tows, speeds, len(speed.coef))
    if row is not None:
        yield Notice(
            f"{fit.method}: a speed polynomial of degree {speed.degree()} does not follow the tows within their "
            f"scatter: at {tows.time_s[row]:g} s it is off by {abs(speeds[row] - tows.mean_speed_mps[row]):.3g} m/s; "
            "prefer output_error, which needs no polynomial."
        )


def _worst_misfit(tows: Tows, speeds: Array, estimates: int) -> int | None:
    """Row of the largest departure of speeds (times,) from the mean of the tows, if it exceeds the scatter.

    The test is the F test of lack of fit, with the scatter of the tows about their mean as pure error. None also with
    too few repetitions for the test.
    """
    moving = tows.time_s > 0
    counts, mean = tows.counts[moving], tows.mean_speed_mps[moving]
    pure = float(np.nansum((tows.speed_mps[moving] - mean[:, None]) ** 2))
    lack = counts * (mean - speeds[moving]) ** 2
    lack_freedom, pure_freedom = len(mean) - estimates, int(np.sum(counts - 1))
    if lack_freedom < 1 or pure_freedom < 1 or pure == 0:
        return None
    ratio = float(np.sum(lack)) / lack_freedom / (pure / pure_freedom)
    if stats.f.sf(ratio, lack_freedom, pure_freedom) > _SIGNIFICANCE:
        return None
    return int(np.flatnonzero(moving)[np.argmax(lack)])
