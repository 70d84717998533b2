"""What tows can tell and what not: models of different size by AIC, each tow by itself, one tow left out in turn."""

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
"""AIC above the best at which a model is out: project choice. The usual 10 (Burnham & Anderson 2002) is for readings
that err independently, and those of one tow may err together."""


class TowModel(NamedTuple):
    """Drag terms next to M, in the order of (1.5), and whether the body starts late."""

    terms: tuple[str, ...]
    start_delay: bool = False

    @property
    def unknowns(self) -> tuple[str, ...]:
        """Names of what is estimated."""
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
"""The models that are also fitted to each tow: those that short tows can bear."""


@dataclass(frozen=True, eq=False)
class FittedModel:
    """A model fitted to all readings by output error.

    Parameters
    ----------
    model : TowModel
        What was estimated.
    fit : OutputErrorFit
        Estimates in the order of ``model.unknowns``.
    lowest_drag_N : float
        Of the speeds up to the highest reading; negative where the model is no hull's.
    """

    model: TowModel
    fit: OutputErrorFit
    lowest_drag_N: float

    @property
    def plausible(self) -> bool:
        """M is positive and the drag nowhere negative."""
        return bool(self.fit.estimates[0] > 0 and self.lowest_drag_N >= 0)

    @property
    def determined(self) -> bool:
        """The estimates can be distinguished (scaled condition number at most 900), and a delay is not at its bound,
        0."""
        late = not self.model.start_delay or self.fit.estimates[-1] > _NO_DELAY_S
        return late and self.fit.condition_scaled <= COLLINEAR**2

    @property
    def coefficients(self) -> SurgeCoefficients:
        """Mass and drag."""
        values = dict(zip(self.model.unknowns, self.fit.estimates.tolist(), strict=True))
        return SurgeCoefficients(**{TOW_PARAMETERS[name]: value for name, value in values.items() if name != DELAY})

    @property
    def delay_s(self) -> float:
        """How much later than t = 0 the body starts."""
        return float(self.fit.estimates[-1]) if self.model.start_delay else 0.0

    @property
    def mass_interval_kg(self) -> tuple[float, float]:
        """95 % interval of M, for readings that err independently and alike."""
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
    """The models fitted to all readings; those with too few readings, or that do not converge, are left out.

    AIC compares them only as readings that err independently and alike. Readings of one tow do not quite: small
    differences mean nothing.
    """
    fitted = []
    for model in models:
        fit = _fit_or_none(tows, force, model)
        if fit is not None:
            fitted.append(FittedModel(model, fit, _lowest_drag(model, fit, tows.top_speed_mps)))
    return tuple(fitted)


def mass_range(fitted: Sequence[FittedModel]) -> tuple[float, float] | None:
    """Lowest and highest M within the 95 % intervals of the models that a hull could have and the tows determine.

    Models that AIC leaves far behind the best of these are not asked.
    """
    usable = [model for model in fitted if model.plausible and model.determined]
    if not usable:
        return None
    best = min(model.fit.aic for model in usable)
    intervals = [model.mass_interval_kg for model in usable if model.fit.aic <= best + _FAR_BEHIND]
    return min(low for low, _ in intervals), max(high for _, high in intervals)


@dataclass(frozen=True, eq=False)
class TowByTow:
    """One way of estimating, tow by tow.

    Parameters
    ----------
    label : str
        Method and unknowns.
    unknowns : tuple of str
        What is estimated.
    together : array, (unknowns,)
        From all tows, SI.
    alone, left_out : arrays, (tows, unknowns)
        From each tow by itself, and from all without it; nan where that is not possible.
    """

    label: str
    unknowns: tuple[str, ...]
    together: Array
    alone: Array
    left_out: Array

    @property
    def jackknife_errors(self) -> Array:
        """Standard errors by leaving out one tow in turn, (unknowns,); nan if one of these fits failed.

        sqrt((n - 1)/n sum (x_i - mean x)^2) (Efron 1982, The jackknife, the bootstrap and other resampling plans). They
        hold also where the readings of one tow err together.
        """
        count = len(self.left_out)
        errors: Array = np.sqrt((count - 1) / count * np.sum((self.left_out - self.left_out.mean(axis=0)) ** 2, axis=0))
        return errors

    @property
    def half_widths(self) -> Array:
        """Half-widths of the 95 % intervals by leaving out one tow in turn, with Student's t of n - 1, (unknowns,)."""
        half: Array = stats.t.ppf(0.975, len(self.left_out) - 1) * self.jackknife_errors
        return half

    @property
    def spread_errors(self) -> Array:
        """Standard errors of the mean of the tows taken each by itself, (unknowns,): their spread by root n."""
        errors: Array = np.std(self.alone, axis=0, ddof=1) / math.sqrt(len(self.alone))
        return errors

    def as_json(self) -> dict[str, Any]:
        """The estimates as plain data; SI."""
        return {
            "unknowns": list(self.unknowns),
            "together": self.together.tolist(),
            "alone": self.alone.tolist(),
            "left_out": self.left_out.tolist(),
            "jackknife_standard_errors": self.jackknife_errors.tolist(),
            "jackknife_half_widths_95": self.half_widths.tolist(),
            "spread_standard_errors": self.spread_errors.tolist(),
        }


TowEstimator = Callable[[Tows], Array | None]


def tow_by_tow(tows: Tows, force: Polynomial, terms: tuple[str, ...], speed_degree: int = 2) -> tuple[TowByTow, ...]:
    """Each tow by itself and one left out in turn: by the paper's algorithm with `terms`, and by the simple models.

    Empty for less than three tows, whose spread says nothing.
    """
    if len(tows.names) < 3:
        return ()
    ways: list[tuple[str, tuple[str, ...], TowEstimator]] = [
        (f"paper: {', '.join(('M', *terms))}", ("M", *terms), lambda own: _by_paper(own, force, terms, speed_degree))
    ]
    for model in (SIMPLE, SIMPLE_LATE):
        ways.append((f"output error: {model.label}", model.unknowns, _by_output_error(force, model)))
    return tuple(_each(tows, ways))


def _each(tows: Tows, ways: Sequence[tuple[str, tuple[str, ...], TowEstimator]]) -> Iterator[TowByTow]:
    numbers = range(len(tows.names))
    for label, unknowns, estimate in ways:

        def row(own: Tows, estimate: TowEstimator = estimate, width: int = len(unknowns)) -> Array:
            found = estimate(own) if own.top_speed_mps > 0 else None
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
