"""Influence coefficients of a ship's card: K % of every number on the card on any manoeuvring figure.

By exact slopes, K = 10 c/F dF/dc, and by the 10 % difference of the paper (:mod:`tank2sim.analysis.influence.percent`),
side by side; and the standard error of each figure from the card's, with their covariance if the card has one.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from tank2sim.analysis.ensemble.results import FigureBands
from tank2sim.analysis.influence.percent import STEP_PERCENT, change_percent, changed_together, combined_percent
from tank2sim.analysis.influence.study import Study
from tank2sim.analysis.tuning.result import TunedStudy
from tank2sim.arrays import Array, Number
from tank2sim.dynamics.card_parameters import JointErrors, agreed_by_name, joint_errors
from tank2sim.errors import InputError
from tank2sim.notices import Notice

CURVED = 1.5
"""Reported factor between slope and 10 % difference. Project choice: the figure bends or jumps there."""

REPORTED_FROM = 0.5
"""... where either is at least this percentage of the figure. Project choice: less does not change a decision."""


@dataclass(frozen=True)
class FigureErrors:
    """A figure in the unit of its name, its standard error, and the share of its variance that would go if a number
    of the card (by its key) were known exactly."""

    value: float
    standard_error: float
    share_of_variance: dict[str, float]


@dataclass(frozen=True, kw_only=True)
class CardNumber:
    """A number as the card's file has it, with its standard error (`assumed` if not stated) and its short name."""

    value: float
    standard_error: float
    assumed: bool
    name: str


@dataclass(frozen=True)
class InfluenceCoefficient:
    """K %: change of a figure for 10 % more of a number, by exact slopes and by the 10 % difference; nan if not
    known."""

    exact: Number
    difference: Number


@dataclass(frozen=True)
class AgreedChange:
    """Change of a figure in % by an agreed variation: by the sums of Kc K / 10, and of the changed ship (`direct`)."""

    foretold_exact: Number
    foretold_difference: Number
    direct: Number


@dataclass(frozen=True)
class AgreedVariation:
    """Numbers that change together: Kc % by key, and the change of each figure."""

    percent: dict[str, float]
    figures: dict[str, AgreedChange]


@dataclass(frozen=True, eq=False, kw_only=True)
class InfluenceStudy:
    """Influence of each number of a card on figures of the ship.

    Parameters
    ----------
    standard_errors : str
        Origin of the standard errors of the figures.
    figures : dict
        By their text: ``steady_radius_m@20``.
    parameters : dict
        By their keys on the card.
    influence_percent : dict
        Figure to parameter to its coefficient.
    tuned : TunedStudy, optional
        The card tuned to targets.
    assumed_errors : bool
        Whether all standard errors are assumed.
    """

    ship: str
    standard_errors: str
    figures: dict[str, FigureErrors]
    parameters: dict[str, CardNumber]
    influence_percent: dict[str, dict[str, InfluenceCoefficient]]
    notices: tuple[Notice, ...]
    agreed: AgreedVariation | None = None
    tuned: TunedStudy | None = None
    ensemble: FigureBands | None = None
    assumed_errors: bool = False

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Short names of the parameters (k,)."""
        return tuple(number.name for number in self.parameters.values())

    @cached_property
    def exact(self) -> Array:
        """K % (nf, k) by exact slopes; nan where there is none."""
        return np.array([[row[key].exact for key in self.parameters] for row in self.influence_percent.values()])

    @cached_property
    def difference(self) -> Array:
        """K % (nf, k) by the 10 % difference; nan where there is none."""
        return np.array([[row[key].difference for key in self.parameters] for row in self.influence_percent.values()])

    @cached_property
    def shares(self) -> Array:
        """Shares of the variances (nf, k)."""
        return np.array([[one.share_of_variance[key] for key in self.parameters] for one in self.figures.values()])


def influence(study: Study, agreed: Mapping[str, float] | None = None) -> InfluenceStudy:
    """Influence coefficients of every parameter of a card on the figures of a study.

    Parameters are reported by their dotted keys and with their values in the card's file.

    Parameters
    ----------
    agreed : mapping, optional
        An agreed variation: Kc %, by names as a user writes them.

    Raises
    ------
    InputError
        `agreed` has a name that is not a parameter of the card.
    """
    values, slopes = study.slopes_at(study.values)
    difference, errors = _differences(study), joint_errors(study.card, study.parameters)
    deviations, shares = figure_errors(slopes, errors.covariance)
    with np.errstate(divide="ignore", invalid="ignore"):
        exact = STEP_PERCENT * study.values * slopes / study.base[:, None]
    exact = np.where(np.isfinite(exact), exact, np.nan)
    keys = [parameter.key for parameter in study.parameters]
    each = zip(study.base.tolist(), deviations.tolist(), shares.tolist(), strict=True)
    figures = [FigureErrors(value, error, dict(zip(keys, share, strict=True))) for value, error, share in each]
    coefficients = [
        dict(zip(keys, map(InfluenceCoefficient, *both), strict=True))
        for both in zip(exact.tolist(), difference.tolist(), strict=True)
    ]
    texts = [figure.text for figure in study.figures]
    notices = [*study.notices, *errors.in_words, *_not_smooth(study, exact, difference), *_differing(study, values)]
    return InfluenceStudy(
        ship=study.card.ship.name,
        standard_errors=origin_of_errors(errors),
        assumed_errors=errors.assumed,
        figures=dict(zip(texts, figures, strict=True)),
        parameters={
            parameter.key: CardNumber(
                value=parameter.value * parameter.factor,
                standard_error=parameter.standard_error * abs(parameter.factor),
                assumed=parameter.assumed,
                name=parameter.short,
            )
            for parameter in study.parameters
        },
        influence_percent=dict(zip(texts, coefficients, strict=True)),
        agreed=_agreed(study, exact, difference, agreed_by_name(agreed, study.parameters)) if agreed else None,
        notices=tuple(notices),
    )


def figure_errors(slopes: Array, covariance: Array) -> tuple[Array, Array]:
    """Standard error of each figure (nf,), by the delta method, and the share (nf, k) of its variance that an exact
    parameter would remove; 0 without variance.

    The variance is J C J^T. The share (J C e_k)^2 / (C_kk J C J^T) is the squared correlation of figure and parameter:
    the first-order index of Sobol (1993) of normal errors. For independent parameters it is (J_k s_k)^2 over their sum,
    and the shares add to one; the share of a correlated parameter includes its common part.

    Parameters
    ----------
    slopes : array (nf, k)
        J: dF/dc.
    covariance : array (k, k)
        C, of the parameters.
    """
    # Numbers that go together may leave less than rounding of what each would make of the figure alone.
    variances = np.maximum(np.einsum("ij,jk,ik->i", slopes, covariance, slopes), 0.0)
    size = variances[:, None] * np.diag(covariance)
    return np.sqrt(variances), np.divide((slopes @ covariance) ** 2, size, out=np.zeros_like(size), where=size > 0)


def origin_of_errors(errors: JointErrors) -> str:
    """Text on the origin of the figures' standard errors, from the `errors` of the card."""
    if not errors.together:
        return "standard errors of figures follow from the card's numbers, as if these were independent"
    remainder = "" if len(errors.together) == len(errors.parameters) else ", others as if independent"
    count = len(errors.together)
    return f"standard errors of figures are from the covariance next to the card ({count} numbers{remainder})"


def _differences(study: Study) -> Array:
    found = np.full((len(study.figures), len(study.values)), np.nan)
    for place, value in enumerate(study.values):
        if value == 0:
            continue
        changed = study.values.copy()
        changed[place] *= 1 + STEP_PERCENT / 100
        found[:, place] = _change(study, changed)
    return found


def _change(study: Study, values: Array) -> list[float]:
    """Change of each figure in per cent; nan where the changed ship does not show it."""
    try:
        figures = study.figures_at(values)
    except InputError:  # the changed ship leaves all bounds
        return [math.nan] * len(study.figures)
    return [change_percent(float(new), float(old)) for new, old in zip(figures, study.base, strict=True)]


def _agreed(study: Study, exact: Array, difference: Array, percent: Mapping[str, float]) -> AgreedVariation:
    names = [parameter.name for parameter in study.parameters]
    values = dict(zip(names, study.values.tolist(), strict=True))
    changed = changed_together(values, percent)
    direct = _change(study, np.array([changed[name] for name in names]))

    def predicted(K: Array) -> list[float]:
        return [combined_percent(dict(zip(names, row.tolist(), strict=True)), percent) for row in K]

    changes = map(AgreedChange, predicted(exact), predicted(difference), direct)
    keys = {parameter.name: parameter.key for parameter in study.parameters}
    return AgreedVariation(
        percent={keys[name]: value for name, value in percent.items()},
        figures=dict(zip([figure.text for figure in study.figures], changes, strict=True)),
    )


def _differing(study: Study, sloped: Array) -> Iterable[Notice]:
    """Notices on figures whose slopes belong to a different event, with another value than the figure's."""
    for figure, value, sloped_value in zip(study.figures, study.base, sloped, strict=True):
        if not abs(value - sloped_value) <= 1e-4 * max(abs(value), 1e-3):
            yield Notice(f"{figure.text}: its slopes are not to be trusted, the manoeuvre has no clean event there")


def _not_smooth(study: Study, slopes: Array, steps: Array) -> list[Notice]:
    given = study.values != 0
    with np.errstate(divide="ignore", invalid="ignore"):
        felt = given & ~(np.fmax(np.abs(slopes), np.where(np.isfinite(steps), np.abs(steps), np.inf)) < REPORTED_FROM)
        ratio = np.abs(steps / slopes)
    gone = felt & ~np.isfinite(steps)
    bent = felt & np.isfinite(steps) & ~((slopes * steps > 0) & (ratio > 1 / CURVED) & (ratio < CURVED))
    texts = []
    for figure, lost, curved in zip(study.figures, gone, bent, strict=True):
        lost_names, curved_names = (
            ", ".join(study.parameters[place].short for place in np.flatnonzero(row)) for row in (lost, curved)
        )
        if lost_names:
            texts.append(f"{figure.text}: 10 % more of {lost_names} and the ship does not show it any more")
        if curved_names:
            texts.append(f"{figure.text} is not smooth or strongly curved in {curved_names}: slope and 10 % disagree")
    return [Notice(text) for text in texts]
