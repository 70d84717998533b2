"""Study of a towed body: its estimates, and estimates by other models from the same readings."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.polynomial import Polynomial
from scipy import stats

from tank2sim.apps.rigs.tow.equation_error import discretise, fit_mean_speed, solve_by_qr
from tank2sim.apps.rigs.tow.identify import TowIdentification
from tank2sim.apps.rigs.tow.output_error import OutputErrorFit, TowModel, fit_speeds, simulated_speeds
from tank2sim.apps.rigs.tow.paper import are_of_the_paper
from tank2sim.apps.rigs.tow.records import Tows
from tank2sim.apps.rigs.tow.surge import DELAY, SurgeCoefficients
from tank2sim.apps.rigs.tow.theory import (
    VISCOSITY_M2PS,
    WATER_KGPM3,
    DragPolynomial,
    MassByTheory,
    TowedBody,
    drag_polynomial,
    masses_by_theory,
)
from tank2sim.arrays import Array, Columns, Number, Unbounded
from tank2sim.errors import InputError
from tank2sim.identification.conditioning import COLLINEAR, SINGULAR_CONDITION, scaled_condition
from tank2sim.notices import Notice, caution
from tank2sim.records.thinning import drawn_columns


@dataclass(frozen=True, kw_only=True)
class SpeedPolynomial:
    """A row of Table 2: the least-squares polynomial through the mean speeds.

    Parameters
    ----------
    coefficients : tuple of float
        In rising powers of t, m/s over s.
    rms_mps : float
        Root mean square of its errors at the means, by the number n of times, which is the measure of Table 2.
    rms_less_one_mps : float
        The same by n - 1.
    """

    degree: int
    coefficients: tuple[float, ...]
    rms_mps: float
    rms_less_one_mps: float


@dataclass(frozen=True, eq=False, kw_only=True)
class Ellipse:
    """Joint 95 % region of M and B3, linearised: centre and outline (n,), kg and kg/m; the label names the unknowns."""

    label: str
    centre: tuple[float, float]
    mass_kg: Array
    B3_kgpm: Array


@dataclass(frozen=True, kw_only=True)
class DragCoefficients:
    """Drag coefficients C(v) referred to L^2 and to V^(2/3)."""

    by_length_squared: DragPolynomial
    by_volume_two_thirds: DragPolynomial


@dataclass(frozen=True, eq=False, kw_only=True)
class TowSpeeds:
    """Speeds to draw.

    Parameters
    ----------
    t_s : array (n,)
        Times of the readings.
    measured_mps : dict
        Tow to its readings (n,); nan where nothing was read.
    simulated_t_s : array (m,)
        Times of the simulations.
    simulated_mps : dict
        The best usable model and the methods to their speeds (m,), each motion once.
    """

    t_s: Array
    measured_mps: Columns
    simulated_t_s: Array
    simulated_mps: Columns


@dataclass(frozen=True, eq=False, kw_only=True)
class TowStudy(TowIdentification):
    """Estimates from tows, with alternative models and their spread.

    :class:`.TowIdentification` has the other parameters.

    Parameters
    ----------
    tows_of_the_paper : bool
        Whether these are the tows of Table 1.
    speed_polynomials : tuple of SpeedPolynomial
        Degrees 0 to 3 through the mean speeds, as far as the readings test them.
    models : tuple of FittedModel
        Models of different size, by output error.
    mass_range_kg : tuple of two floats, optional
        Range of M from these tows; None without a usable model.
    tow_by_tow : dict
        Single-tow and jackknife estimates by method; empty for fewer than three tows.
    confidence_ellipses : tuple of Ellipse
        Regions of M and B3, without and with a start delay.
    mass_by_theory : tuple of MassByTheory
        (2.5); empty without the size.
    body : TowedBody, optional
        Size of the body, if known.
    drag_coefficients : dict
        Method to C(v); empty without the size.
    """

    tows_of_the_paper: bool
    speed_polynomials: tuple[SpeedPolynomial, ...]
    models: tuple[FittedModel, ...]
    mass_range_kg: tuple[float, float] | None
    tow_by_tow: dict[str, TowByTow]
    confidence_ellipses: tuple[Ellipse, ...]
    mass_by_theory: tuple[MassByTheory, ...]
    speeds: TowSpeeds
    body: TowedBody | None
    drag_coefficients: dict[str, DragCoefficients]

    @property
    def best(self) -> FittedModel | None:
        """The model of lowest AIC among the plausible ones that these tows determine."""
        return best_model(self.models)


def study_tows(result: TowIdentification, tows: Tows, body: TowedBody | None = None) -> TowStudy:
    """The study of a result of tows; with the size of the body also its drag coefficients and the theory."""
    models = compare_models(tows, result.force)
    near = [model for model in models if model.unknowns in (SIMPLE.unknowns, SIMPLE_LATE.unknowns)]
    study = TowStudy(
        **vars(result),
        tows_of_the_paper=are_of_the_paper(tows),
        speed_polynomials=tuple(speed_polynomials(tows)),
        models=models,
        mass_range_kg=mass_range(models),
        tow_by_tow=tow_by_tow(tows, result.force, result.terms, len(result.speed_polynomial) - 1),
        confidence_ellipses=tuple(confidence_ellipse(model) for model in near),
        mass_by_theory=masses_by_theory(body) if body else (),
        speeds=_speeds(result, tows, best_model(models)),
        body=body,
        drag_coefficients=_drag_coefficients(result, body) if body else {},
    )
    return replace(
        study, notices=(*result.notices, *_notes_on_models(study), *_notes_on_cards(study), *_continued(study, tows))
    )


def _drag_coefficients(result: TowIdentification, body: TowedBody) -> dict[str, DragCoefficients]:
    drags = {name: drag_polynomial(fit.coefficients, body) for name, fit in result.methods.items()}
    return {
        name: DragCoefficients(by_length_squared=drag, by_volume_two_thirds=drag.times(body.area_ratio))
        for name, drag in drags.items()
    }


def _speeds(result: TowIdentification, tows: Tows, best: FittedModel | None) -> TowSpeeds:
    """Readings, and speeds of the best usable model and of the methods, each motion once."""
    time = np.linspace(0.0, float(tows.time_s[-1]), 301)
    found: Columns = {}
    if best is not None:
        delay = best.estimates.get(DELAY, 0.0)
        found[f"best usable: {best.label}"] = simulated_speeds(best.coefficients, result.force, time, delay)
    for name in ("output_error", "qr"):
        if name in result.methods:
            fit = result.methods[name]
            speeds = simulated_speeds(fit.coefficients, result.force, time, fit.start_delay_s)
            if np.isfinite(speeds).all() and not any(np.allclose(speeds, drawn) for drawn in found.values()):
                found[f"{name.replace('_', ' ')}: {', '.join(fit.unknowns)}"] = speeds
    columns = drawn_columns({"t_s": time, **found})
    return TowSpeeds(
        t_s=tows.time_s,
        measured_mps={f"tow {number}": speed for number, speed in enumerate(tows.speed_mps.T, start=1)},
        simulated_t_s=columns.pop("t_s"),
        simulated_mps=columns,
    )


def towed_body(tows: Tows, mass_kg: float, given: Mapping[str, float | None]) -> TowedBody | None:
    """The body from the `given` values of :data:`.BODY_KEYS`, else from the tows' file; None if its length is unknown.

    The default volume is the mass of the body, with the water inside, over the density of water: it floats.
    """
    known = tows.body | {key: value for key, value in given.items() if value is not None}
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


def speed_polynomials(tows: Tows) -> Iterator[SpeedPolynomial]:
    """Rows of Table 2, degrees 0 to 3, while readings outnumber coefficients."""
    for degree in range(4):
        try:
            fitted = fit_mean_speed(tows, degree).polynomial
        except InputError:
            return
        square = float(np.sum((fitted(tows.time_s) - tows.mean_speed_mps) ** 2))
        count = len(tows.time_s)
        yield SpeedPolynomial(
            degree=degree,
            coefficients=tuple(fitted.coef.tolist()),
            rms_mps=(square / count) ** 0.5,
            rms_less_one_mps=(square / (count - 1)) ** 0.5,
        )


def confidence_ellipse(fitted: FittedModel) -> Ellipse:
    """Joint 95 % region of M and B3, the first unknowns of a model, by the linearised covariance and Fisher's F."""
    radius = np.sqrt(2 * stats.f.ppf(0.95, 2, fitted.freedom))
    angle = np.linspace(0, 2 * np.pi, 121)
    circle = radius * np.vstack([np.cos(angle), np.sin(angle)])
    # By the eigenvectors, which also describe a region without width.
    squares, axes = np.linalg.eigh(fitted.covariance[:2, :2])
    mass, drag = fitted.estimates["M"], fitted.estimates["B3"]
    outline = axes * np.sqrt(np.maximum(squares, 0.0)) @ circle
    return Ellipse(label=fitted.label, centre=(mass, drag), mass_kg=mass + outline[0], B3_kgpm=drag + outline[1])


def _continued(study: TowStudy, tows: Tows) -> Iterator[Notice]:
    """Notes on tows that end early: the paper's estimate with their polynomial continued to the end."""
    published = next(iter(study.tow_by_tow.values()), None)
    for number, alone in enumerate(published.alone if published else ()):
        single = tows.only(number)
        if single.time_s[-1] >= tows.time_s[-1] or not np.isfinite(alone).all():
            continue
        speed = fit_mean_speed(single, len(study.speed_polynomial) - 1).polynomial
        problem = discretise(speed, tows.time_s, study.terms, study.force)
        yield Notice(
            f"Tow {number + 1} ends at {single.time_s[-1]:g} s: over that time the published method gives M "
            f"{alone[0]:.0f} kg; with its polynomial continued to the {tows.time_s[-1]:g} s of the other tows, "
            f"{solve_by_qr(problem)[0]:.0f} kg."
        )


def _notes_on_models(study: TowStudy) -> Iterator[Notice]:
    """What the tows leave open, and which model they prefer."""
    span, given = study.mass_range_kg, study.given_total_mass_kg
    if given is not None and span is not None and not span[0] <= given <= span[1]:
        yield caution(
            f"The mass given, {given:g} kg, is outside the {span[0]:.0f} to {span[1]:.0f} kg that the tows leave by "
            "themselves: check the force, and whether the mass includes the water."
        )
    if span:
        low, high = span
        yield Notice(
            f"These tows determine M only within {low:.0f} to {high:.0f} kg (added mass {low - study.mass_kg:.0f} to "
            f"{high - study.mass_kg:.0f} kg): 95 % intervals of the plausible models that they determine."
        )
    best = min(study.models, key=lambda fitted: fitted.aic, default=None)
    if best is not None and not best.usable:
        separated = "unknowns that cannot be separated"
        fault = separated if best.drag_nowhere_negative else "a drag that is negative at some speeds"
        yield Notice(f"The model of lowest AIC is {best.label}, with {fault}; a better fit is not a better model.")
    late = {model.unknowns: model.aic for model in study.models}
    if not study.start_delay and late.get(SIMPLE_LATE.unknowns, 0.0) < late.get(SIMPLE.unknowns, 0.0) - 4:
        yield Notice("A start delay explains these tows much better than none (start_delay=True).")
    if any(fit.condition_scaled > COLLINEAR**2 for fit in study.methods.values()):
        yield Notice(
            'Take the drag as B3 v^2 alone (terms="B3"), or hold M at a known value (total_mass_kg, '
            f"{_mass_by_theory(study)})."
        )


def _mass_by_theory(study: TowStudy) -> str:
    """Words for M by (2.5)."""
    if not study.mass_by_theory:
        return "by theory"
    theory, span = study.mass_by_theory[0].near_surface_kg, study.mass_range_kg
    contradicts = span is not None and not span[0] <= theory <= span[1]
    return f"{theory:.0f} by (2.5){', which these tows contradict' if contradicts else ''}"


def _notes_on_cards(study: TowStudy) -> Iterator[Notice]:
    """What a card cannot hold."""
    if study.force.degree() > 0:
        yield Notice(
            f"A card holds one force: the mean, {study.force_N:.4g} N; a simulation of these tows must be given the "
            "force over time (input tow.force)."
        )
    if study.start_delay:
        yield Notice("A card has no start delay: a simulation of these tows begins later by it.")


_NO_DELAY_S = 1e-3
_FAR_BEHIND = 20.0
"""AIC above the best from which a model is excluded: project choice. The usual 10 (Burnham & Anderson 2002) is for
independent readings, and errors within a tow may be correlated."""


MODELS = tuple(
    TowModel(terms, late) for terms in ((), ("B3",), ("B2", "B3"), ("B1", "B2", "B3")) for late in (False, True)
)
"""From the mass alone to all of (1.5), each without and with a start delay."""

SIMPLE, SIMPLE_LATE = TowModel(("B3",)), TowModel(("B3",), start_delay=True)
"""The models that are also fitted to each tow: short tows determine their unknowns."""


@dataclass(frozen=True, eq=False, kw_only=True)
class FittedModel:
    """A model fitted to all readings by output error; SI.

    Parameters
    ----------
    unknowns : tuple of str
        M, the drag terms in the order of (1.5), and ``delay`` if the body starts late.
    estimates, half_widths_95 : dict
        Unknown to its estimate, and to the half-width of its 95 % interval, for independent readings of equal variance.
    covariance : array (unknowns, unknowns)
        Covariance of the estimates.
    freedom : int
        Readings less estimates.
    scatter_mps : float
        Standard deviation of a reading about the fitted speed.
    aic : float
        Akaike's criterion; only differences matter.
    condition_scaled : float
        Condition number of the normal matrix with a diagonal of ones.
    drag_nowhere_negative : bool
        Whether M is positive and the drag not negative up to the highest measured speed.
    determined : bool
        Whether the scaled condition number is at most 900 and a delay is not at its bound, 0.
    """

    unknowns: tuple[str, ...]
    estimates: dict[str, float]
    half_widths_95: dict[str, Number]
    covariance: Array
    freedom: int
    scatter_mps: float
    aic: float
    condition_scaled: Unbounded
    drag_nowhere_negative: bool
    determined: bool

    @property
    def label(self) -> str:
        """``M, B3, delay``."""
        return ", ".join(self.unknowns)

    @property
    def usable(self) -> bool:
        """Whether the tows determine the model, and a hull can have its drag."""
        return self.drag_nowhere_negative and self.determined

    @property
    def coefficients(self) -> SurgeCoefficients:
        """Mass and drag."""
        return SurgeCoefficients.of(self.estimates)

    @property
    def mass_words(self) -> str:
        """M with the half-width of its 95 % interval, kg: ``2772 ± 226``."""
        return f"{self.estimates['M']:.0f} ± {self.half_widths_95['M']:.0f}"

    @property
    def mass_interval_kg(self) -> tuple[float, float]:
        """95 % interval of M, for independent readings of equal variance."""
        middle, half = self.estimates["M"], self.half_widths_95["M"]
        return middle - half, middle + half


def best_model(models: Sequence[FittedModel]) -> FittedModel | None:
    """The usable model of the lowest AIC; None without any."""
    return min((model for model in models if model.usable), key=lambda model: model.aic, default=None)


def compare_models(tows: Tows, force: Polynomial, models: Sequence[TowModel] = MODELS) -> tuple[FittedModel, ...]:
    """The models fitted to all readings, without those that have too few readings or do not converge.

    AIC assumes independent readings of equal variance. Readings of a tow are not quite independent: small differences
    are not significant.
    """
    fits = ((model, _fit_or_none(tows, force, model)) for model in models)
    return tuple(_fitted(model, fit, tows.top_speed_mps) for model, fit in fits if fit is not None)


def _fitted(model: TowModel, fit: OutputErrorFit, top_speed_mps: float) -> FittedModel:
    estimates = dict(zip(model.unknowns, fit.estimates.tolist(), strict=True))
    half_widths = stats.t.ppf(0.975, fit.freedom) * np.sqrt(np.diag(fit.covariance))
    condition, count = scaled_condition(fit.design) ** 2, len(fit.residuals_mps)
    mean_square = max(float(np.mean(fit.residuals_mps**2)), np.finfo(float).tiny)
    lowest = float(np.min(SurgeCoefficients.of(estimates).drag_N(np.linspace(0.0, top_speed_mps, 401))))
    late = not model.start_delay or fit.estimates[-1] > _NO_DELAY_S
    return FittedModel(
        unknowns=model.unknowns,
        estimates=estimates,
        half_widths_95=dict(zip(model.unknowns, half_widths.tolist(), strict=True)),
        covariance=fit.covariance,
        freedom=fit.freedom,
        scatter_mps=fit.scatter_mps,
        aic=count * math.log(mean_square) + 2 * len(estimates),
        condition_scaled=condition,
        drag_nowhere_negative=bool(fit.estimates[0] > 0 and lowest >= 0),
        determined=bool(late and condition <= COLLINEAR**2),
    )


def mass_range(fitted: Sequence[FittedModel]) -> tuple[float, float] | None:
    """Lowest and highest M within the 95 % intervals of the plausible models that the tows determine.

    Models with an AIC far above the best of these are excluded.
    """
    best = best_model(fitted)
    if best is None:
        return None
    intervals = [model.mass_interval_kg for model in fitted if model.usable and model.aic <= best.aic + _FAR_BEHIND]
    return min(low for low, _ in intervals), max(high for _, high in intervals)


@dataclass(frozen=True, eq=False, kw_only=True)
class TowByTow:
    """Estimates of one method, tow by tow; SI.

    Parameters
    ----------
    unknowns : tuple of str
        Names of the unknowns.
    together : array (unknowns,)
        From all tows.
    alone, left_out : arrays (tows, unknowns)
        From each tow alone, and from all tows except it; nan where impossible.
    jackknife_standard_errors : array (unknowns,)
        Jackknife standard errors over tows; nan if one of the fits failed. They are valid also for correlated readings
        within a tow.
    jackknife_half_widths_95 : array (unknowns,)
        Half-widths of the jackknife 95 % intervals, with Student's t of n - 1 degrees of freedom.
    spread_standard_errors : array (unknowns,)
        Standard errors of the mean of the single tows' estimates: their spread over root n.
    """

    unknowns: tuple[str, ...]
    together: Array
    alone: Array
    left_out: Array
    jackknife_standard_errors: Array
    jackknife_half_widths_95: Array
    spread_standard_errors: Array


def tow_by_tow(tows: Tows, force: Polynomial, terms: tuple[str, ...], degree: int = 2) -> dict[str, TowByTow]:
    """Single-tow and jackknife estimates by the paper's algorithm with `terms` and a polynomial of that `degree`, and
    by the simple models.

    Empty for fewer than three tows, whose spread is not informative. Names are the methods with their unknowns.
    """

    def by_paper(tows: Tows) -> Array | None:
        try:
            speed = fit_mean_speed(tows, degree).polynomial
        except InputError:
            return None
        problem = discretise(speed, tows.time_s, terms, force)
        return None if scaled_condition(problem.design) > SINGULAR_CONDITION else solve_by_qr(problem)

    def by_output_error(model: TowModel, tows: Tows) -> Array | None:
        fit = _fit_or_none(tows, force, model)
        return None if fit is None else fit.estimates

    ways: list[tuple[str, tuple[str, ...], Callable[[Tows], Array | None]]] = [
        ("as published", ("M", *terms), by_paper),
        *(("output error", model.unknowns, partial(by_output_error, model)) for model in (SIMPLE, SIMPLE_LATE)),
    ]
    if len(tows.names) < 3:
        return {}
    return {f"{way}: {', '.join(unknowns)}": _each(tows, unknowns, estimate) for way, unknowns, estimate in ways}


def _each(tows: Tows, unknowns: tuple[str, ...], estimate: Callable[[Tows], Array | None]) -> TowByTow:
    def row(tows: Tows) -> Array:
        found = estimate(tows) if tows.top_speed_mps > 0 else None
        return np.full(len(unknowns), np.nan) if found is None else found

    count = len(tows.names)
    alone = np.array([row(tows.only(number)) for number in range(count)])
    others = [[other for other in range(count) if other != number] for number in range(count)]
    left_out = np.array([row(tows.only(*rest)) for rest in others])
    # sqrt((n - 1)/n sum (x_i - mean x)^2): Efron 1982, The jackknife, the bootstrap and other resampling plans.
    errors = np.sqrt((count - 1) / count * np.sum((left_out - left_out.mean(axis=0)) ** 2, axis=0))
    return TowByTow(
        unknowns=unknowns,
        together=row(tows),
        alone=alone,
        left_out=left_out,
        jackknife_standard_errors=errors,
        jackknife_half_widths_95=stats.t.ppf(0.975, count - 1) * errors,
        spread_standard_errors=np.std(alone, axis=0, ddof=1) / math.sqrt(count),
    )


def _fit_or_none(tows: Tows, force: Polynomial, model: TowModel) -> OutputErrorFit | None:
    try:
        return fit_speeds(tows, force, model)
    except InputError:
        return None
