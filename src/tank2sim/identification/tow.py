"""Surge mass and drag of a body from short accelerating tows (paper 1, Wilinski & Zellman 1984).

Three methods estimate M and the chosen drag terms of (1.5):

- ``paper``: a quadratic through the mean speeds, Simpson's rule, the normal equations (1.12);
- ``qr``: the same least squares by QR, with standard errors;
- ``output_error``: (1.5) integrated from rest, fitted to all readings of all tows, with standard errors.

The added mass is lambda11 = M - m.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from tank2sim.dynamics.surge import DRAG_POWERS
from tank2sim.errors import InputError
from tank2sim.identification import tow_equation_error as equation_error
from tank2sim.identification import tow_output_error as output_error
from tank2sim.identification.conditioning import SINGULAR, Matrix, Vector, scaled_condition
from tank2sim.identification.tow_findings import findings
from tank2sim.identification.tow_fit import TowFit
from tank2sim.records.tows import Tows

METHODS = ("paper", "qr", "output_error")


@dataclass(frozen=True, eq=False, kw_only=True)
class TowResult:
    """What tows tell of a body.

    Parameters
    ----------
    tows : Tows
        The readings.
    force_N, mass_kg : float
        Towing force T and mass m of the body with the water in it.
    terms : tuple of str
        Drag terms, in the order of (1.5).
    speed_polynomial : tuple of float
        Coefficients of v*(t) in rising powers of t, m/s over s (eq. 2.1).
    fits : dict
        Method to its estimates.
    warnings : tuple of str
        What the user should know before using them, in whole sentences.
    """

    tows: Tows
    force_N: float
    mass_kg: float
    terms: tuple[str, ...]
    speed_polynomial: tuple[float, ...]
    fits: dict[str, TowFit]
    warnings: tuple[str, ...]

    def as_json(self) -> dict[str, Any]:
        """The result as plain data; the unit of a number stands in its key, J is in N s^(1/2)."""
        return {
            "tows": str(self.tows.path),
            "force_N": self.force_N,
            "mass_kg": self.mass_kg,
            "terms": list(self.terms),
            "readings": int(np.sum(self.tows.counts)),
            "top_speed_mps": self.tows.top_speed_mps,
            "speed_polynomial": list(self.speed_polynomial),
            "methods": {name: fit.as_json() for name, fit in self.fits.items()},
            "warnings": list(self.warnings),
        }


def parse_terms(text: str) -> tuple[str, ...]:
    """Drag terms from an option's text, ``"B3,B2,B1"`` or ``"none"``, in the order of (1.5).

    Raises
    ------
    InputError
        A term is unknown or stands twice.
    """
    return () if text.strip().lower() == "none" else _checked_terms([word.strip() for word in text.split(",")])


def identify_tow(
    tows: Tows,
    force_N: float | None = None,
    mass_kg: float | None = None,
    *,
    terms: Iterable[str] = tuple(DRAG_POWERS),
    methods: Iterable[str] = METHODS,
    speed_degree: int = 2,
) -> TowResult:
    """Estimate the surge mass and drag of (1.5) from tows by a constant force from rest.

    Parameters
    ----------
    tows : Tows
        The readings.
    force_N, mass_kg : float, optional
        Towing force T and mass m with the water in the body; by default those in the file of the tows.
    terms : iterable of str
        Drag terms to estimate beside M, any of B1, B2, B3; the others are zero.
    methods : iterable of str
        Of :data:`METHODS`.
    speed_degree : int
        Degree of the speed polynomial of the first two methods, at least 2; the paper has 2.

    Raises
    ------
    InputError
        Force or mass is missing or not positive, a term is unknown or stands twice, or the tows do not determine
        the unknowns at all (too few readings, no motion, no acceleration).
    """
    force = _positive(tows, "force_N", force_N, tows.force_N)
    mass = _positive(tows, "mass_kg", mass_kg, tows.mass_kg)
    terms, methods = _checked_terms(terms), tuple(methods)
    if not set(methods) <= set(METHODS) or speed_degree < 2:
        raise ValueError(f"unknown among {methods}, or degree {speed_degree} below 2")
    speed = equation_error.fit_mean_speed(tows, speed_degree)
    problem = equation_error.discretise(speed.polynomial, tows.time_s, terms, force)
    _check_solvable(tows, problem)
    solutions = _solutions(tows, speed, problem, methods)
    fits = {name: _fit(name, solution, tows, mass, problem) for name, solution in solutions.items()}
    return TowResult(
        tows=tows,
        force_N=force,
        mass_kg=mass,
        terms=terms,
        speed_polynomial=tuple(float(value) for value in speed.polynomial.coef),
        fits=fits,
        warnings=(*_notes(tows, force, mass, set(methods) - set(fits)), *findings(tows, force, speed.polynomial, fits)),
    )


class _Solution(NamedTuple):
    values: Vector
    design: Matrix
    covariance: Matrix | None = None


def _solutions(
    tows: Tows, speed: equation_error.SpeedFit, problem: equation_error.EquationError, methods: tuple[str, ...]
) -> dict[str, _Solution]:
    found: dict[str, _Solution] = {}
    if "paper" in methods:
        found["paper"] = _Solution(equation_error.solve_normal_equations(problem), problem.design)
    if "qr" in methods:
        values = equation_error.solve_by_qr(problem)
        found["qr"] = _Solution(values, problem.design, equation_error.covariance(problem, values, speed))
    if "output_error" in methods:
        fit = output_error.fit_speeds(tows, problem.force_N, problem.terms)
        if fit is not None:
            found["output_error"] = _Solution(fit.estimates, fit.design, fit.covariance)
    return found


def _fit(method: str, solution: _Solution, tows: Tows, mass_kg: float, problem: equation_error.EquationError) -> TowFit:
    fit = TowFit(
        method=method,
        terms=problem.terms,
        values=solution.values,
        covariance=solution.covariance,
        mass_kg=mass_kg,
        design=solution.design,
        J=problem.J(solution.values),
        largest_speed_error_mps=0.0,
    )
    speeds = output_error.simulated_speeds(fit.coefficients, problem.force_N, tows.time_s)
    error = float(np.max(np.abs(speeds - tows.mean_speed_mps))) if np.isfinite(speeds).all() else math.inf
    return replace(fit, largest_speed_error_mps=error)


def _notes(tows: Tows, force_N: float, mass_kg: float, failed: set[str]) -> list[str]:
    notes = []
    for name, used, written in (("force_N", force_N, tows.force_N), ("mass_kg", mass_kg, tows.mass_kg)):
        if written is not None and written != used:
            notes.append(f"The file of the tows says {name} {written:g}, and {used:g} was given and used.")
    if tows.time_s[0] == 0 and np.nanmax(np.abs(tows.speed_mps[0])) > 0:
        notes.append("The speed at t_s = 0 is not zero in every tow, and a start from rest at that moment is assumed.")
    for method in failed:
        notes.append(f"{method}: the fit did not converge and is left out; take fewer terms (--terms B3).")
    return notes


def _positive(tows: Tows, name: str, given: float | None, written: float | None) -> float:
    option = "--" + name.replace("_", "-")
    value = given if given is not None else written
    if value is None:
        raise InputError(tows.path, "", f"does not tell {name}", f"give {option}, or add a line '# {name}: VALUE'")
    if not np.isfinite(value) or value <= 0:
        raise InputError(option, "", f"is {value:g}", "a positive number was expected")
    return float(value)


def _checked_terms(terms: Iterable[str]) -> tuple[str, ...]:
    terms = tuple(terms)
    for term in terms:
        if term not in DRAG_POWERS:
            raise InputError("--terms", "", f"there is no drag term {term!r}", "take any of B3,B2,B1, or none")
        if terms.count(term) > 1:
            raise InputError("--terms", "", f"{term} stands twice", "give each term once")
    return tuple(term for term in DRAG_POWERS if term in terms)


def _check_solvable(tows: Tows, problem: equation_error.EquationError) -> None:
    if tows.top_speed_mps <= 0:
        raise InputError(tows.path, "", "no tow has a speed above zero", "give tows in which the body moves forward")
    # A steady tow leaves rounding noise as acceleration, which scaling would blow up to a column like any other.
    gain = np.abs(problem.basis[:, 0]).max() * (tows.time_s[-1] - tows.time_s[0])
    if gain < 1e-6 * tows.top_speed_mps:
        silent = "the speed does not change, so that the tows tell nothing of the mass"
        raise InputError(tows.path, "", silent, "give tows that accelerate from rest")
    if scaled_condition(problem.design) > SINGULAR:
        unknowns = ", ".join(("M", *problem.terms))
        raise InputError(tows.path, "", f"the equations for {unknowns} are singular", "take fewer terms (--terms B3)")
