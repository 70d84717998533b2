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
from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple, TypeVar

import numpy as np
from numpy.polynomial import Polynomial

from tank2sim.apps.rigs.tow import equation_error, output_error
from tank2sim.apps.rigs.tow.findings import TowFit, tow_findings
from tank2sim.apps.rigs.tow.output_error import WHOLE_EQUATION, TowModel
from tank2sim.apps.rigs.tow.records import Tows, as_force, checked_force, force_words, mean_force
from tank2sim.apps.rigs.tow.surge import DELAY, TOW_PARAMETERS, SurgeCoefficients
from tank2sim.arrays import Array
from tank2sim.cards.writing import card_text
from tank2sim.errors import ArgumentError, InputError
from tank2sim.identification.conditioning import SINGULAR_CONDITION, correlation_matrix, scaled_condition
from tank2sim.notices import Notice


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


def identify_tow(
    tows: Tows,
    force: float | Polynomial | None = None,
    mass_kg: float | None = None,
    model: TowModel = WHOLE_EQUATION,
    *,
    speed_degree: int = 2,
) -> TowIdentification:
    """Estimate the surge mass and drag of (1.5) from tows by a known force from rest.

    Parameters
    ----------
    force : float or Polynomial, optional
        Towing force, N: a constant, or T(t) over s as in (1.13); by default from the file of the tows.
    mass_kg : float, optional
        Mass m with the water in the body; by default from the file of the tows.
    model : TowModel
        Unknowns; other drag terms are zero. Output error alone estimates a start delay; the other methods use the
        polynomial without it.
    speed_degree : int
        Degree of the speed polynomial of the first two methods, at least 2; the paper has 2.

    Raises
    ------
    InputError
        Force or mass is missing, the force does not pull forward, no unknown remains, or the tows do not determine the
        unknowns (too few readings, no motion, no acceleration).
    """
    pull = checked_force(as_force(_known(tows, "force_N", force)), tows.time_s)
    mass = _known(tows, "mass_kg", mass_kg)
    if model.total_mass_kg is not None and not model.terms:
        raise ArgumentError("total_mass_kg", "", "leaves nothing to estimate", 'take drag terms (terms="B3")')
    speed = equation_error.fit_mean_speed(tows, speed_degree)
    problem = equation_error.discretise(speed.polynomial, tows.time_s, model.terms, pull, mass_kg=model.total_mass_kg)
    _check_solvable(tows, problem)
    values, notes = equation_error.solve_by_qr(problem), list(_notes(tows, force, mass))
    solutions = {
        "paper": _Solution(equation_error.solve_normal_equations(problem), problem.free_design, None),
        "qr": _Solution(values, problem.free_design, equation_error.covariance(problem, values, speed)),
    }
    if fitted := output_error.fit_speeds(tows, pull, model):
        solutions["output_error"] = _Solution(fitted.estimates, fitted.design, fitted.covariance)
    else:
        notes.append('output_error: the fit did not converge and is left out; take fewer terms (terms="B3").')
    fits = {name: _fit(name, solution, (tows, mass, pull), problem) for name, solution in solutions.items()}
    designs = {name: solution.design for name, solution in solutions.items()}
    return TowIdentification(
        tows=str(tows.path),
        force_N=mean_force(pull, tows.time_s),
        force_polynomial=tuple(pull.coef.tolist()),
        mass_kg=mass,
        terms=model.terms,
        start_delay=model.start_delay,
        given_total_mass_kg=model.total_mass_kg,
        readings=int(np.sum(tows.counts)),
        top_speed_mps=tows.top_speed_mps,
        speed_polynomial=tuple(speed.polynomial.coef.tolist()),
        methods=fits,
        notices=(*map(Notice, notes), *tow_findings(tows, pull, speed.polynomial, fits, designs)),
    )


class _Solution(NamedTuple):
    """Estimates, SI, M first; design without the column of a known M; covariance of all, where the method gives one."""

    estimates: Array
    design: Array
    covariance: Array | None


def _fit(
    method: str, solution: _Solution, known: tuple[Tows, float, Polynomial], problem: equation_error.EquationError
) -> TowFit:
    """A solution with the names of its unknowns, and its errors."""
    (values, design, spread), (tows, mass_kg, force) = solution, known
    unknowns = ("M", *problem.terms, DELAY)[: len(values)]
    names = [TOW_PARAMETERS[name] for name in unknowns]
    estimates = dict(zip(names, values.tolist(), strict=True))
    errors: dict[str, float] = {}
    if spread is not None:
        errors = dict(zip(names, np.sqrt(np.maximum(np.diag(spread), 0.0)).tolist(), strict=True))
        errors["added_mass_kg"] = errors["total_mass_kg"]
    coefficients = SurgeCoefficients.of(dict(zip(unknowns, values.tolist(), strict=True)))
    delay = estimates.get(TOW_PARAMETERS[DELAY], 0.0)
    speeds = output_error.simulated_speeds(coefficients, force, tows.time_s, delay)
    return TowFit(
        method=method,
        unknowns=unknowns,
        estimated=unknowns[len(unknowns) - design.shape[1] :],
        estimates={**estimates, "added_mass_kg": estimates["total_mass_kg"] - mass_kg},
        standard_errors=errors,
        correlation=None if spread is None else correlation_matrix(spread),
        condition=float(np.linalg.cond(design) ** 2),
        condition_scaled=scaled_condition(design) ** 2,
        J=problem.J(values[: 1 + len(problem.terms)]),
        largest_speed_error_mps=(
            float(np.max(np.abs(speeds - tows.mean_speed_mps))) if np.isfinite(speeds).all() else math.inf
        ),
    )


def _notes(tows: Tows, force: float | Polynomial | None, mass_kg: float) -> Iterator[str]:
    """Differences of what is given from the file, and a motion at the release."""
    words = force_words(force) if isinstance(force, Polynomial) else f"{tows.force_N if force is None else force:g}"
    for name, given, stated in (("force_N", words, tows.force_N), ("mass_kg", f"{mass_kg:g}", tows.mass_kg)):
        if stated is not None and given != f"{stated:g}":
            yield f"The file of the tows states '{name}: {stated:g}'; {given} was given and used."
    if tows.time_s[0] == 0 and np.nanmax(np.abs(tows.speed_mps[0])) > 0:
        yield "The speed at t_s = 0 is not zero in every tow; a start from rest at that time is assumed."


_K = TypeVar("_K", bound=float | Polynomial)


def _known(tows: Tows, name: str, given: _K | None) -> _K | float:
    """The number that is given, or that the file states; InputError without one."""
    value = getattr(tows, name) if given is None else given
    if value is None:
        raise InputError(tows.path, "", f"does not state {name}", f"give {name}, or add a line '# {name}: VALUE'")
    known: _K | float = value
    return known


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
        raise InputError(tows.path, "", f"the equations for {unknowns} are singular", 'take fewer terms (terms="B3")')


def tow_card_text(
    result: TowIdentification, fit: TowFit, *, name: str, source: str, length_m: float | None = None
) -> str:
    """TOML text of the card with the numbers of one method; its notes are the notices of the result.

    `fit` is one of ``result.methods``; name of the body, source of the numbers, and length if known.
    """
    values = {key: value for key, value in fit.estimates.items() if key not in ("added_mass_kg", "start_delay_s")}
    return card_text(
        {
            "ship": {"name": name, "length_m": length_m, "source": source, "notes": " ".join(result.notices)},
            "model": {"kind": "surge", "valid_speed_mps": [0.0, result.top_speed_mps]},
            "surge": {**values, "force_N": result.force_N, "dry_mass_kg": result.mass_kg},
            "uncertainty": {key: value for key, value in fit.standard_errors.items() if key in values},
        }
    )
