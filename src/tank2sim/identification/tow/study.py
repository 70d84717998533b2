"""Study of a towed body: its estimates, and those of other models from the same readings."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from scipy import stats

from tank2sim.arrays import Array
from tank2sim.dynamics.surge_theory import (
    VISCOSITY_M2PS,
    WATER_KGPM3,
    DragPolynomial,
    MassByTheory,
    TowedBody,
    drag_polynomial,
    masses_by_theory,
)
from tank2sim.errors import InputError
from tank2sim.identification.conditioning import COLLINEAR
from tank2sim.identification.tow.equation_error import discretise, fit_mean_speed, solve_by_qr
from tank2sim.identification.tow.identify import TowIdentification
from tank2sim.identification.tow.model_selection import (
    SIMPLE,
    SIMPLE_LATE,
    FittedModel,
    TowByTow,
    compare_models,
    mass_range,
    tow_by_tow,
)
from tank2sim.identification.tow.output_error import simulated_speeds
from tank2sim.identification.tow.paper import are_of_the_paper
from tank2sim.records.tows import Tows

_LEVEL = 0.95
_DEGREES = range(4)


class SpeedPolynomial(NamedTuple):
    """A row of Table 2: the least-squares polynomial through the mean speeds.

    `coefficients` are in rising powers of t, m/s over s; `rms_mps` is the root mean square of its errors at the means,
    by the number n of times, which is the measure of Table 2, and `rms_less_one_mps` by n - 1.
    """

    degree: int
    coefficients: tuple[float, ...]
    rms_mps: float
    rms_less_one_mps: float


class Ellipse(NamedTuple):
    """Joint 95 % region of M and B3, linearised: centre and outline, kg and kg/m."""

    label: str
    centre: tuple[float, float]
    mass_kg: Array
    B3_kgpm: Array


@dataclass(frozen=True, eq=False, kw_only=True)
class TowStudy:
    """Estimates from tows, with alternative models and their spread.

    Parameters
    ----------
    result : TowIdentification
        The estimates.
    polynomials : tuple of SpeedPolynomial
        Degrees 0 to 3 through the mean speeds, as far as the readings test them.
    models : tuple of FittedModel
        Models of different size, by output error.
    by_tow : tuple of TowByTow
        Single-tow and jackknife estimates; empty for fewer than three tows.
    body : TowedBody or None
        Size of the body, if known.
    drags : dict
        Method to C(v) referred to L^2; empty without the size.
    theory : tuple of MassByTheory
        (2.5); empty without the size.
    """

    result: TowIdentification
    polynomials: tuple[SpeedPolynomial, ...]
    models: tuple[FittedModel, ...]
    by_tow: tuple[TowByTow, ...]
    body: TowedBody | None
    drags: dict[str, DragPolynomial]
    theory: tuple[MassByTheory, ...]

    @property
    def mass_range_kg(self) -> tuple[float, float] | None:
        """Range of M from these tows; None without a usable model."""
        return mass_range(self.models)

    @property
    def best(self) -> FittedModel | None:
        """The model of lowest AIC among the plausible ones that these tows determine."""
        usable = [model for model in self.models if model.plausible and model.determined]
        return min(usable, key=lambda fitted: fitted.fit.aic, default=None)

    def simulated(self) -> tuple[Array, dict[str, Array]]:
        """Times (n,), s, and speeds (n,), m/s, of the best usable model and of the methods, each motion once."""
        result, time = self.result, np.linspace(0.0, float(self.result.tows.time_s[-1]), 301)
        found: dict[str, Array] = {}
        if self.best is not None:
            label = f"best usable: {self.best.model.label}"
            found[label] = simulated_speeds(self.best.coefficients, result.force, time, self.best.delay_s)
        for name in ("output_error", "qr"):
            if name in result.fits:
                fit = result.fits[name]
                speeds = simulated_speeds(fit.coefficients, result.force, time, fit.start_delay_s)
                if np.isfinite(speeds).all() and not any(np.allclose(speeds, drawn) for drawn in found.values()):
                    found[f"{name.replace('_', ' ')}: {', '.join(fit.unknowns)}"] = speeds
        return time, found

    def _speeds_as_json(self) -> dict[str, Any]:
        time, found = self.simulated()
        tows = self.result.tows
        return {
            "t_s": tows.time_s.tolist(),
            "measured_mps": {f"tow {n}": speed.tolist() for n, speed in enumerate(tows.speed_mps.T, start=1)},
            "simulated_t_s": time.tolist(),
            "simulated_mps": {label: [float(f"{v:.7g}") for v in speeds] for label, speeds in found.items()},
        }

    @property
    def ellipses(self) -> tuple[Ellipse, ...]:
        """Regions of M and B3, without and with a start delay."""
        found = [confidence_ellipse(model) for model in self.models if model.model in (SIMPLE, SIMPLE_LATE)]
        return tuple(found)

    @property
    def notes(self) -> tuple[str, ...]:
        """Messages for the user: the warnings, and the findings of the model comparison."""
        return (*self.result.warnings, *_notes(self), *_continued(self))

    def as_json(self) -> dict[str, Any]:
        """The study as plain data, including that of the result."""
        studies: dict[str, Any] = {
            "tows_of_the_paper": are_of_the_paper(self.result.tows),
            "speed_polynomials": [polynomial._asdict() for polynomial in self.polynomials],
            "models": [model.as_json() for model in self.models],
            "mass_range_kg": self.mass_range_kg,
            "tow_by_tow": {method.label: method.as_json() for method in self.by_tow},
            "confidence_ellipses": [ellipse._asdict() for ellipse in self.ellipses],
            "mass_by_theory": [mass.as_json() for mass in self.theory],
            "speeds": self._speeds_as_json(),
        }
        if self.body is not None:
            factor = self.body.area_ratio
            studies["body"] = dict(vars(self.body))
            studies["drag_coefficients"] = {
                name: {"by_length_squared": drag.as_json(), "by_volume_two_thirds": drag.times(factor).as_json()}
                for name, drag in self.drags.items()
            }
        return {**self.result.as_json(), **studies, "warnings": list(self.notes)}


def study_tows(result: TowIdentification, body: TowedBody | None = None) -> TowStudy:
    """The study of a result; with the size of the body also its drag coefficients and the theory."""
    tows, force = result.tows, result.force
    fits = result.fits.items()
    return TowStudy(
        result=result,
        polynomials=tuple(speed_polynomials(tows)),
        models=compare_models(tows, force),
        by_tow=tow_by_tow(tows, force, result.terms, len(result.speed_polynomial) - 1),
        body=body,
        drags={name: drag_polynomial(fit.coefficients, body) for name, fit in fits} if body else {},
        theory=masses_by_theory(body) if body else (),
    )


def towed_body(tows: Tows, mass_kg: float, given: Mapping[str, float | None]) -> TowedBody | None:
    """The body from the given values, else from the file of the tows; None if its length is unknown.

    The default volume is the mass of the body, with the water inside, over the density of water: it floats.

    Parameters
    ----------
    mass_kg : float
        m, with the water inside.
    given : mapping
        Keys of :data:`tank2sim.records.tows.BODY_KEYS` to values, None if not given.

    Raises
    ------
    InputError
        A given value is not positive.
    """
    for key, value in given.items():
        if value is not None and not (np.isfinite(value) and value > 0):
            raise InputError("--" + key.replace("_", "-"), "", f"is {value:g}", "a positive number was expected")
    known = {**tows.body, **{key: value for key, value in given.items() if value is not None}}
    if "length_m" not in known:
        return None
    density = known.get("water_density_kgpm3", WATER_KGPM3)
    return TowedBody(
        length_m=known["length_m"],
        beam_m=known.get("beam_m"),
        volume_m3=known.get("volume_m3", mass_kg / density),
        density_kgpm3=density,
        viscosity_m2ps=known.get("kinematic_viscosity_m2ps", VISCOSITY_M2PS),
    )


def speed_polynomials(tows: Tows, degrees: Sequence[int] = _DEGREES) -> Iterator[SpeedPolynomial]:
    """Rows of Table 2, while readings outnumber coefficients."""
    for degree in degrees:
        try:
            fitted = fit_mean_speed(tows, degree).polynomial
        except InputError:
            return
        square = float(np.sum((fitted(tows.time_s) - tows.mean_speed_mps) ** 2))
        count = len(tows.time_s)
        coefficients = tuple(float(value) for value in fitted.coef)
        yield SpeedPolynomial(degree, coefficients, (square / count) ** 0.5, (square / (count - 1)) ** 0.5)


def confidence_ellipse(fitted: FittedModel, points: int = 121) -> Ellipse:
    """Joint 95 % region of M and B3, the first unknowns of a model, by the linearised covariance and Fisher's F."""
    fit = fitted.fit
    radius = np.sqrt(2 * stats.f.ppf(_LEVEL, 2, fit.freedom))
    angle = np.linspace(0, 2 * np.pi, points)
    circle = radius * np.vstack([np.cos(angle), np.sin(angle)])
    # By the eigenvectors, which also describe a region without width.
    squares, axes = np.linalg.eigh(fit.covariance[:2, :2])
    outline = axes * np.sqrt(np.maximum(squares, 0.0)) @ circle + fit.estimates[:2, None]
    return Ellipse(fitted.model.label, (float(fit.estimates[0]), float(fit.estimates[1])), outline[0], outline[1])


def _continued(study: TowStudy) -> Iterator[str]:
    """Notes on tows that end early: the paper's estimate with their polynomial continued to the end."""
    tows, result = study.result.tows, study.result
    if not study.by_tow:
        return
    for number, alone in enumerate(study.by_tow[0].alone):
        single = tows.only(number)
        if single.time_s[-1] >= tows.time_s[-1] or not np.isfinite(alone).all():
            continue
        speed = fit_mean_speed(single, len(result.speed_polynomial) - 1).polynomial
        problem = discretise(speed, tows.time_s, result.terms, result.force)
        yield (
            f"Tow {number + 1} ends at {single.time_s[-1]:g} s: over that time the published method gives M "
            f"{alone[0]:.0f} kg; with its polynomial continued to the {tows.time_s[-1]:g} s of the other tows, "
            f"{solve_by_qr(problem)[0]:.0f} kg."
        )


def _notes(study: TowStudy) -> Iterator[str]:
    result = study.result
    span = study.mass_range_kg
    if span is not None:
        low, high = span
        yield (
            f"These tows determine M only within {low:.0f} to {high:.0f} kg (added mass {low - result.mass_kg:.0f} to "
            f"{high - result.mass_kg:.0f} kg): 95 % intervals of the plausible models that they determine."
        )
    best = min(study.models, key=lambda fitted: fitted.fit.aic, default=None)
    if best is not None and not (best.plausible and best.determined):
        yield (
            f"The model of lowest AIC is {best.model.label}, with "
            + ("a drag that is negative at some speeds" if not best.plausible else "unknowns that cannot be separated")
            + "; a better fit is not a better model."
        )
    late = {model.model: model.fit.aic for model in study.models}
    if not result.options.start_delay and late.get(SIMPLE_LATE, 0.0) < late.get(SIMPLE, 0.0) - 4:
        yield "A start delay explains these tows much better than none (--start-delay)."
    if any(fit.condition_scaled > COLLINEAR**2 for fit in result.fits.values()):
        theory = study.theory[0].near_surface_kg if study.theory else None
        known = f"{theory:.0f} by (2.5)" if theory is not None else "by theory"
        if theory is not None and span is not None and not span[0] <= theory <= span[1]:
            known += ", which these tows contradict"
        yield f"Take the drag as B3 v^2 alone (--terms B3), or hold M at a known value (--total-mass-kg, {known})."
    if result.force.degree() > 0:
        yield (
            f"A card holds one force: the mean, {result.force_N:.4g} N; a simulation of these tows must be given the "
            "force over time (input tow.force)."
        )
    if result.options.start_delay:
        yield "A card has no start delay: a simulation of these tows begins later by it."
