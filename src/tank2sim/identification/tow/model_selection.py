"""Model selection for tows: models of different size by AIC, fits of single tows, and the jackknife over tows."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.polynomial import Polynomial
from scipy import stats

from tank2sim.arrays import Array
from tank2sim.dynamics.surge import SurgeCoefficients, drag
from tank2sim.errors import InputError
from tank2sim.identification.conditioning import COLLINEAR, SINGULAR_CONDITION, scaled_condition
from tank2sim.identification.tow import equation_error
from tank2sim.identification.tow.fit import DELAY, TOW_PARAMETERS
from tank2sim.identification.tow.output_error import OutputErrorFit, TowOptions, fit_speeds
from tank2sim.records.tows import Tows

_NO_DELAY_S = 1e-3
_FAR_BEHIND = 20.0
"""AIC above the best from which a model is excluded: project choice. The usual 10 (Burnham & Anderson 2002) is for
independent readings, and errors within a tow may be correlated."""


class TowModel(NamedTuple):
    """Drag terms in addition to M, in the order of (1.5), and True for a start delay."""

    terms: tuple[str, ...]
    start_delay: bool = False

    @property
    def unknowns(self) -> tuple[str, ...]:
        """Names of the unknowns."""
        return ("M", *self.terms, *([DELAY] if self.start_delay else []))

    @property
    def label(self) -> str:
        """``M, B3, delay``."""
        return ", ".join(self.unknowns)


MODELS = tuple(
    TowModel(terms, late) for terms in ((), ("B3",), ("B2", "B3"), ("B1", "B2", "B3")) for late in (False, True)
)
"""From the mass alone to all of (1.5), each without and with a start delay."""

SIMPLE, SIMPLE_LATE = TowModel(("B3",)), TowModel(("B3",), start_delay=True)
"""The models that are also fitted to each tow: short tows determine their unknowns."""


@dataclass(frozen=True, eq=False)
class FittedModel:
    """A model fitted to all readings by output error.

    Parameters
    ----------
    model : TowModel
        Unknowns of the fit.
    fit : OutputErrorFit
        Estimates in the order of ``model.unknowns``.
    lowest_drag_N : float
        Lowest drag up to the highest measured speed; negative for an impossible model.
    """

    model: TowModel
    fit: OutputErrorFit
    lowest_drag_N: float

    @property
    def plausible(self) -> bool:
        """True if M is positive and the drag nowhere negative."""
        return bool(self.fit.estimates[0] > 0 and self.lowest_drag_N >= 0)

    @property
    def determined(self) -> bool:
        """True if the scaled condition number is at most 900 and a delay is not at its bound, 0."""
        late = not self.model.start_delay or self.fit.estimates[-1] > _NO_DELAY_S
        return late and self.fit.condition_scaled <= COLLINEAR**2

    @property
    def coefficients(self) -> SurgeCoefficients:
        """Mass and drag."""
        values = dict(zip(self.model.unknowns, self.fit.estimates.tolist(), strict=True))
        return SurgeCoefficients(**{TOW_PARAMETERS[name]: value for name, value in values.items() if name != DELAY})

    @property
    def delay_s(self) -> float:
        """Time from t = 0 to the start of the body, s."""
        return float(self.fit.estimates[-1]) if self.model.start_delay else 0.0

    @property
    def mass_interval_kg(self) -> tuple[float, float]:
        """95 % interval of M, for independent readings of equal variance."""
        middle, half = self.fit.estimates[0], self.fit.half_widths[0]
        return float(middle - half), float(middle + half)

    def as_json(self) -> dict[str, Any]:
        """The model as plain data; SI."""
        names = self.model.unknowns
        return {
            "unknowns": list(names),
            "estimates": dict(zip(names, self.fit.estimates.tolist(), strict=True)),
            "half_widths_95": dict(zip(names, self.fit.half_widths.tolist(), strict=True)),
            "scatter_mps": self.fit.scatter_mps,
            "aic": self.fit.aic,
            "condition_scaled": self.fit.condition_scaled,
            "drag_nowhere_negative": self.plausible,
            "determined": self.determined,
        }


def compare_models(tows: Tows, force: Polynomial, models: Sequence[TowModel] = MODELS) -> tuple[FittedModel, ...]:
    """The models fitted to all readings, without those that have too few readings or do not converge.

    AIC assumes independent readings of equal variance. Readings of a tow are not quite independent: small differences
    are not significant.
    """
    fitted = []
    for model in models:
        fit = _fit_or_none(tows, force, model)
        if fit is not None:
            fitted.append(FittedModel(model, fit, _lowest_drag(model, fit, tows.top_speed_mps)))
    return tuple(fitted)


def mass_range(fitted: Sequence[FittedModel]) -> tuple[float, float] | None:
    """Lowest and highest M within the 95 % intervals of the plausible models that the tows determine.

    Models with an AIC far above the best of these are excluded.
    """
    usable = [model for model in fitted if model.plausible and model.determined]
    if not usable:
        return None
    best = min(model.fit.aic for model in usable)
    intervals = [model.mass_interval_kg for model in usable if model.fit.aic <= best + _FAR_BEHIND]
    return min(low for low, _ in intervals), max(high for _, high in intervals)


@dataclass(frozen=True, eq=False)
class TowByTow:
    """Estimates of one method, tow by tow.

    Parameters
    ----------
    label : str
        Method and unknowns.
    unknowns : tuple of str
        Names of the unknowns.
    together : array, (unknowns,)
        From all tows, SI.
    alone, held_out : arrays, (tows, unknowns)
        From each tow alone, and from all tows except it; nan where impossible.
    """

    label: str
    unknowns: tuple[str, ...]
    together: Array
    alone: Array
    held_out: Array

    @property
    def jackknife_errors(self) -> Array:
        """Jackknife standard errors over tows, (unknowns,); nan if one of the fits failed.

        sqrt((n - 1)/n sum (x_i - mean x)^2) (Efron 1982, The jackknife, the bootstrap and other resampling plans). They
        are valid also for correlated readings within a tow.
        """
        count = len(self.held_out)
        errors: Array = np.sqrt((count - 1) / count * np.sum((self.held_out - self.held_out.mean(axis=0)) ** 2, axis=0))
        return errors

    @property
    def half_widths(self) -> Array:
        """Half-widths of the jackknife 95 % intervals, with Student's t of n - 1 degrees of freedom, (unknowns,)."""
        half: Array = stats.t.ppf(0.975, len(self.held_out) - 1) * self.jackknife_errors
        return half

    @property
    def spread_errors(self) -> Array:
        """Standard errors of the mean of the single tows' estimates, (unknowns,): their spread over root n."""
        errors: Array = np.std(self.alone, axis=0, ddof=1) / math.sqrt(len(self.alone))
        return errors

    def as_json(self) -> dict[str, Any]:
        """The estimates as plain data; SI."""
        return {
            "unknowns": list(self.unknowns),
            "together": self.together.tolist(),
            "alone": self.alone.tolist(),
            "left_out": self.held_out.tolist(),
            "jackknife_standard_errors": self.jackknife_errors.tolist(),
            "jackknife_half_widths_95": self.half_widths.tolist(),
            "spread_standard_errors": self.spread_errors.tolist(),
        }


TowEstimator = Callable[[Tows], Array | None]


def tow_by_tow(tows: Tows, force: Polynomial, terms: tuple[str, ...], speed_degree: int = 2) -> tuple[TowByTow, ...]:
    """Single-tow and jackknife estimates by the paper's algorithm with `terms`, and by the simple models.

    Empty for fewer than three tows, whose spread is not informative.
    """
    if len(tows.names) < 3:
        return ()
    ways: list[tuple[str, tuple[str, ...], TowEstimator]] = [
        (
            f"as published: {', '.join(('M', *terms))}",
            ("M", *terms),
            lambda tow: _by_paper(tow, force, terms, speed_degree),
        )
    ]
    for model in (SIMPLE, SIMPLE_LATE):
        ways.append((f"output error: {model.label}", model.unknowns, _by_output_error(force, model)))
    return tuple(_each(tows, ways))


def _each(tows: Tows, ways: Sequence[tuple[str, tuple[str, ...], TowEstimator]]) -> Iterator[TowByTow]:
    numbers = range(len(tows.names))
    for label, unknowns, estimate in ways:

        def row(tows: Tows, estimate: TowEstimator = estimate, width: int = len(unknowns)) -> Array:
            found = estimate(tows) if tows.top_speed_mps > 0 else None
            return np.full(width, np.nan) if found is None else found

        alone = np.array([row(tows.only(number)) for number in numbers])
        held_out = np.array([row(tows.without(number)) for number in numbers])
        yield TowByTow(label, unknowns, row(tows), alone, held_out)


def _by_paper(tows: Tows, force: Polynomial, terms: tuple[str, ...], degree: int) -> Array | None:
    try:
        speed = equation_error.fit_mean_speed(tows, degree).polynomial
    except InputError:
        return None
    problem = equation_error.discretise(speed, tows.time_s, terms, force)
    return None if scaled_condition(problem.design) > SINGULAR_CONDITION else equation_error.solve_by_qr(problem)


def _by_output_error(force: Polynomial, model: TowModel) -> TowEstimator:
    def estimate(tows: Tows) -> Array | None:
        fit = _fit_or_none(tows, force, model)
        return None if fit is None else fit.estimates

    return estimate


def _fit_or_none(tows: Tows, force: Polynomial, model: TowModel) -> OutputErrorFit | None:
    try:
        return fit_speeds(tows, force, model.terms, TowOptions(start_delay=model.start_delay))
    except InputError:
        return None


def _lowest_drag(model: TowModel, fit: OutputErrorFit, top_speed_mps: float) -> float:
    values = dict(zip(model.unknowns, fit.estimates, strict=True))
    speeds = np.linspace(0.0, top_speed_mps, 401)
    return float(np.min(drag(speeds, values.get("B1", 0.0), values.get("B2", 0.0), values.get("B3", 0.0))))
