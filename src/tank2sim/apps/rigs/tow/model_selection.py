"""Model selection for tows: models of different size by AIC, fits of single tows, and the jackknife over tows."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.polynomial import Polynomial
from scipy import stats

from tank2sim.apps.rigs.tow import equation_error
from tank2sim.apps.rigs.tow.findings import DELAY, surge_coefficients
from tank2sim.apps.rigs.tow.output_error import OutputErrorFit, TowOptions, fit_speeds
from tank2sim.apps.rigs.tow.records import Tows
from tank2sim.apps.rigs.tow.surge import SurgeCoefficients
from tank2sim.arrays import Array, Number, Unbounded
from tank2sim.errors import InputError
from tank2sim.identification.conditioning import COLLINEAR, SINGULAR_CONDITION, scaled_condition

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
        return surge_coefficients(self.estimates)

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
    lowest = float(np.min(surge_coefficients(estimates).drag_N(np.linspace(0.0, top_speed_mps, 401))))
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


def tow_by_tow(tows: Tows, force: Polynomial, terms: tuple[str, ...], speed_degree: int = 2) -> dict[str, TowByTow]:
    """Single-tow and jackknife estimates by the paper's algorithm with `terms`, and by the simple models.

    Empty for fewer than three tows, whose spread is not informative. Names are the methods with their unknowns.
    """
    if len(tows.names) < 3:
        return {}
    found = {
        f"as published: {', '.join(('M', *terms))}": _each(
            tows, ("M", *terms), lambda tow: _by_paper(tow, force, terms, speed_degree)
        )
    }
    for model in (SIMPLE, SIMPLE_LATE):
        found[f"output error: {model.label}"] = _each(tows, model.unknowns, partial(_by_output_error, force, model))
    return found


def _each(tows: Tows, unknowns: tuple[str, ...], estimate: Callable[[Tows], Array | None]) -> TowByTow:
    def row(tows: Tows) -> Array:
        found = estimate(tows) if tows.top_speed_mps > 0 else None
        return np.full(len(unknowns), np.nan) if found is None else found

    count = len(tows.names)
    alone = np.array([row(tows.only(number)) for number in range(count)])
    left_out = np.array([row(tows.without(number)) for number in range(count)])
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


def _by_paper(tows: Tows, force: Polynomial, terms: tuple[str, ...], degree: int) -> Array | None:
    try:
        speed = equation_error.fit_mean_speed(tows, degree).polynomial
    except InputError:
        return None
    problem = equation_error.discretise(speed, tows.time_s, terms, force)
    return None if scaled_condition(problem.design) > SINGULAR_CONDITION else equation_error.solve_by_qr(problem)


def _by_output_error(force: Polynomial, model: TowModel, tows: Tows) -> Array | None:
    fit = _fit_or_none(tows, force, model)
    return None if fit is None else fit.estimates


def _fit_or_none(tows: Tows, force: Polynomial, model: TowModel) -> OutputErrorFit | None:
    try:
        return fit_speeds(tows, force, model.terms, TowOptions(start_delay=model.start_delay))
    except InputError:
        return None
