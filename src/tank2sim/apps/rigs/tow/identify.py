"""Surge mass and drag of a body from short accelerating tows (paper 1, Wilinski & Zellman 1984).

Three methods estimate M and the chosen drag terms of (1.5):

- ``paper``: a quadratic through the mean speeds, Simpson's rule, the normal equations (1.12);
- ``qr``: the same least squares by QR, with standard errors;
- ``output_error``: (1.5) integrated from rest, fitted to all readings of all tows, with standard errors.

The added mass is lambda11 = M - m. The last method can estimate a start delay as well, and all can hold M at a
known value.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np
from numpy.polynomial import Polynomial

from tank2sim.apps.rigs.tow import equation_error, output_error
from tank2sim.apps.rigs.tow.findings import tow_findings
from tank2sim.apps.rigs.tow.fit import TowFit, TowSolution
from tank2sim.apps.rigs.tow.output_error import AT_ONCE, TowOptions
from tank2sim.apps.rigs.tow.records import Tows, as_force, checked_force, force_words, mean_force
from tank2sim.apps.rigs.tow.surge import DRAG_POWERS
from tank2sim.cards.writing import SurgeResult, surge_card_text
from tank2sim.errors import InputError
from tank2sim.identification.conditioning import SINGULAR_CONDITION, scaled_condition
from tank2sim.notices import Notice

TOW_METHODS = ("paper", "qr", "output_error")


@dataclass(frozen=True, eq=False, kw_only=True)
class TowIdentification:
    """Estimates of a towed body.

    Parameters
    ----------
    tows : str
        File of the readings.
    force_N : float
        Mean of the towing force over the time of the record.
    force_polynomial : tuple of float
        Coefficients of the towing force T(t) in rising powers of t, N over s.
    mass_kg : float
        Mass m of the body with the water in it.
    terms : tuple of str
        Drag terms, in the order of (1.5).
    start_delay : bool
        Whether a start delay is estimated.
    given_total_mass_kg : float, optional
        M, if it was given.
    readings : int
        Number of readings.
    top_speed_mps : float
        The highest reading.
    speed_polynomial : tuple of float
        Coefficients of v*(t) in rising powers of t, m/s over s (eq. 2.1).
    methods : dict
        Method to its estimates.
    notices : tuple of Notice
        Messages for the user, in sentences.
    """

    tows: str
    force_N: float
    force_polynomial: tuple[float, ...]
    mass_kg: float
    terms: tuple[str, ...]
    start_delay: bool
    given_total_mass_kg: float | None
    readings: int
    top_speed_mps: float
    speed_polynomial: tuple[float, ...]
    methods: dict[str, TowFit]
    notices: tuple[Notice, ...]

    @property
    def force(self) -> Polynomial:
        """Towing force T(t), N over s."""
        return Polynomial(self.force_polynomial)


def parse_terms(text: str) -> tuple[str, ...]:
    """Drag terms from an option's text, ``"B3,B2,B1"`` or ``"none"``, in the order of (1.5).

    Raises
    ------
    InputError
        A term is unknown or repeated.
    """
    return () if text.strip().lower() == "none" else _checked_terms([word.strip() for word in text.split(",")])


def identify_tow(
    tows: Tows,
    force: float | Polynomial | None = None,
    mass_kg: float | None = None,
    *,
    terms: Iterable[str] = tuple(DRAG_POWERS),
    speed_degree: int = 2,
    options: TowOptions = AT_ONCE,
) -> TowIdentification:
    """Estimate the surge mass and drag of (1.5) from tows by a known force from rest.

    Parameters
    ----------
    force : float or Polynomial, optional
        Towing force, N: a constant, or T(t) over s as in (1.13); by default from the file of the tows.
    mass_kg : float, optional
        Mass m with the water in the body; by default from the file of the tows.
    terms : iterable of str
        Drag terms to estimate in addition to M, any of B1, B2, B3; other terms are zero.
    speed_degree : int
        Degree of the speed polynomial of the first two methods, at least 2; the paper has 2.
    options : TowOptions
        A start delay (of output error; the other methods use the polynomial without delay), or a known M.

    Raises
    ------
    InputError
        Force or mass is missing or not positive, a term is unknown or repeated, no unknown remains, or the tows do not
        determine the unknowns (too few readings, no motion, no acceleration).
    """
    pull = _force(tows, force)
    mass = _positive(tows, "mass_kg", mass_kg, tows.mass_kg)
    terms = _checked_terms(terms)
    _check_assumptions(tows, terms, speed_degree, options)
    speed = equation_error.fit_mean_speed(tows, speed_degree)
    problem = equation_error.discretise(speed.polynomial, tows.time_s, terms, pull, mass_kg=options.total_mass_kg)
    _check_solvable(tows, problem)
    solutions = _solutions(tows, speed, problem, pull, options)
    fits = {name: _fit(name, solution, (tows, mass, pull), problem) for name, solution in solutions.items()}
    designs = {name: solution.design for name, solution in solutions.items()}
    notes = _notes(tows, force, mass, set(TOW_METHODS) - set(fits))
    return TowIdentification(
        tows=str(tows.path),
        force_N=mean_force(pull, tows.time_s),
        force_polynomial=tuple(pull.coef.tolist()),
        mass_kg=mass,
        terms=terms,
        start_delay=options.start_delay,
        given_total_mass_kg=options.total_mass_kg,
        readings=int(np.sum(tows.counts)),
        top_speed_mps=tows.top_speed_mps,
        speed_polynomial=tuple(speed.polynomial.coef.tolist()),
        methods=fits,
        notices=(*notes, *tow_findings(tows, pull, speed.polynomial, fits, designs)),
    )


def _solutions(
    tows: Tows,
    speed: equation_error.SpeedFit,
    problem: equation_error.EquationError,
    force: Polynomial,
    options: TowOptions,
) -> dict[str, TowSolution]:
    design = problem.free_design
    values = equation_error.solve_by_qr(problem)
    found = {
        "paper": TowSolution(equation_error.solve_normal_equations(problem), design),
        "qr": TowSolution(values, design, equation_error.covariance(problem, values, speed)),
    }
    fit = output_error.fit_speeds(tows, force, problem.terms, options)
    if fit is not None:
        covariance = np.zeros((len(problem.known) + len(fit.estimates),) * 2)
        covariance[len(problem.known) :, len(problem.known) :] = fit.covariance
        found["output_error"] = TowSolution(np.concatenate([problem.known, fit.estimates]), fit.design, covariance)
    return found


def _fit(
    method: str, solution: TowSolution, known: tuple[Tows, float, Polynomial], problem: equation_error.EquationError
) -> TowFit:
    tows, mass_kg, force = known
    J = problem.J(solution.values[: 1 + len(problem.terms)])
    fit = solution.fit(method, problem.terms, mass_kg, J)
    speeds = output_error.simulated_speeds(fit.coefficients, force, tows.time_s, fit.start_delay_s)
    error = float(np.max(np.abs(speeds - tows.mean_speed_mps))) if np.isfinite(speeds).all() else math.inf
    return replace(fit, largest_speed_error_mps=error)


def _notes(tows: Tows, force: float | Polynomial | None, mass_kg: float, failed: set[str]) -> list[Notice]:
    notes = []
    used = force if isinstance(force, float | int) else tows.force_N
    for name, used_value, written in (("force_N", used, tows.force_N), ("mass_kg", mass_kg, tows.mass_kg)):
        if written is not None and written != used_value:
            notes.append(f"The file of the tows states {name} {written:g}; {used_value:g} was given and used.")
    if isinstance(force, Polynomial) and tows.force_N is not None:
        notes.append(f"The file of the tows states force_N {tows.force_N:g}; {force_words(force)} was given and used.")
    if tows.time_s[0] == 0 and np.nanmax(np.abs(tows.speed_mps[0])) > 0:
        notes.append("The speed at t_s = 0 is not zero in every tow; a start from rest at that time is assumed.")
    for method in failed:
        notes.append(f"{method}: the fit did not converge and is left out; take fewer terms (--terms B3).")
    return [Notice(text) for text in notes]


def _force(tows: Tows, given: float | Polynomial | None) -> Polynomial:
    if isinstance(given, Polynomial):
        return checked_force(given, tows.time_s)
    return as_force(_positive(tows, "force_N", given, tows.force_N))


def _positive(tows: Tows, name: str, given: float | None, written: float | None) -> float:
    option = "--" + name.replace("_", "-")
    value = given if given is not None else written
    if value is None:
        raise InputError(tows.path, "", f"does not state {name}", f"give {option}, or add a line '# {name}: VALUE'")
    if not np.isfinite(value) or value <= 0:
        raise InputError(option, "", f"is {value:g}", "a positive number was expected")
    return float(value)


def _checked_terms(terms: Iterable[str]) -> tuple[str, ...]:
    terms = tuple(terms)
    for term in terms:
        if term not in DRAG_POWERS:
            raise InputError("--terms", "", f"{term!r} is not a drag term", "take any of B3,B2,B1, or none")
        if terms.count(term) > 1:
            raise InputError("--terms", "", f"{term} is repeated", "give each term once")
    return tuple(term for term in DRAG_POWERS if term in terms)


def _check_assumptions(tows: Tows, terms: tuple[str, ...], speed_degree: int, options: TowOptions) -> None:
    if speed_degree < 2:
        raise ValueError(f"degree {speed_degree} below 2")
    if options.total_mass_kg is not None:
        _positive(tows, "total_mass_kg", options.total_mass_kg, None)
        if not terms:
            raise InputError("--total-mass-kg", "", "leaves nothing to estimate", "take drag terms (--terms B3)")


def _check_solvable(tows: Tows, problem: equation_error.EquationError) -> None:
    if tows.top_speed_mps <= 0:
        raise InputError(tows.path, "", "no tow has a speed above zero", "give tows in which the body moves forward")
    # The acceleration of a steady tow is rounding noise, which scaling would make a column like any other.
    gain = np.abs(problem.basis[:, 0]).max() * (tows.time_s[-1] - tows.time_s[0])
    if problem.mass_kg is None and gain < 1e-6 * tows.top_speed_mps:
        problem_text = "the speed does not change, so that the tows do not determine the mass"
        raise InputError(tows.path, "", problem_text, "give tows that accelerate from rest")
    if scaled_condition(problem.free_design) > SINGULAR_CONDITION:
        unknowns = ", ".join(("M", *problem.terms)[len(problem.known) :])
        raise InputError(tows.path, "", f"the equations for {unknowns} are singular", "take fewer terms (--terms B3)")


def tow_card_text(
    result: TowIdentification, fit: TowFit, *, name: str, source: str, length_m: float | None = None
) -> str:
    """TOML text of the card with the numbers of one method; its notes are the notices of the result.

    Parameters
    ----------
    fit : TowFit
        One of ``result.methods``.
    name, source : str
        Name of the body, and source of the numbers.
    length_m : float, optional
        Length of the body, if known.
    """
    values = {key: value for key, value in fit.estimates.items() if key not in ("added_mass_kg", "start_delay_s")}
    return surge_card_text(
        SurgeResult(
            name=name,
            source=source,
            values={**values, "force_N": result.force_N, "dry_mass_kg": result.mass_kg},
            standard_errors={key: value for key, value in fit.standard_errors.items() if key in values},
            top_speed_mps=result.top_speed_mps,
            length_m=length_m,
            notes=" ".join(result.notices),
        )
    )
