"""Probabilities too small for the members of an ensemble: importance sampling about the ships that fail.

With z the standard normal values of a ship's uncertain numbers and f(z) = 1 where it does not meet a criterion, members
are drawn from another density q, and each counts with its weight w = phi(z) / q(z):

    P = sum(w_i f_i) / n,   variance of P = variance of (w f) / n,   effective size = (sum w f)^2 / sum (w f)^2.

q is a mixture of normals with unit covariance, one for each criterion about the mean of the ships that fail it, and a
share of the card's own distribution, which bounds all weights (Owen and Zhou 2000, J. Amer. Stat. Assoc. 95). The
centres begin where the figure, linear in z, reaches its limit (the design point of the first-order reliability method:
Hasofer and Lind 1974, J. Eng. Mech. Div. 100), and follow the failing ships by the cross-entropy method (Rubinstein and
Kroese 2004, The Cross-Entropy Method). No estimate depends on the figure being linear.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, field, fields, replace
from typing import Any

import numpy as np

from tank2sim.analysis.ensemble.questions import BEYOND_CARD_MARK
from tank2sim.arrays import Array, Mask
from tank2sim.notices import Notice
from tank2sim.simulation.ensemble import OUT_OF_BOUNDS, Draws, Ensemble, MixtureDraws, Question, ensemble

FEW_FAILING = 10
"""Failing members of an ensemble below which their share is too uncertain (a third of itself and more), and the tail is
sampled. Project choice."""

EFFECTIVE = 100.0
"""Effective number of failing members below which no probability is reported: its standard error is then a tenth of
it. Project choice."""

OWN_SHARE = 0.1
"""Share of the card's own distribution in the mixture: no weight is larger than its inverse. Project choice."""

ROUNDS = 5
"""Most samples for the search of the failing ships. Project choice."""

FOUND = 50
"""Failing members of a sample that are enough for their mean. Project choice."""

LEVEL = 0.1
"""Share of a sample, of the largest figures, that is followed until enough members fail. Project choice."""

FARTHEST_LIMIT = 6.0
"""Farthest limit that is searched, in standard deviations: of a linear figure 1e-9 lie beyond it, and no card's errors
are known to be normal so far out. Project choice."""

LEAST = 200
"""Members without which no tail is sampled. Project choice."""

NAMED = 5
"""Numbers of the card that are named as typical of failing ships. Project choice."""


@dataclass(frozen=True)
class Tail:
    """A small probability that a criterion is not met.

    `probability`, `standard_error`: By importance sampling; None where the effective size does not carry it.
    `effective_size`: Effective number of failing members. `members`, `failing`, `not_shown`, `unusable`, `beyond_card`:
    Members drawn about the failing ships; those that do not meet the criterion, of these the ones whose trial does not
    show the figure; those that cannot be used; failing ones whose trial left the card's range. `unusable_probability`:
    Probability of ships that cannot be used: they count neither as failing nor as meeting. `distance`: From the card to
    the limit along the steepest change of the figure, in standard deviations, if it were linear. `linear_probability`:
    Probability of the figure beyond the limit, if it were linear. `linear_figure`, `figure`: The figure of the ship at
    that distance (at most :data:`FARTHEST_LIMIT`), if it were linear, and as it is. `failing_ships`: Number of the card
    (name in the model) to the mean of failing ships less the card, in standard errors: the largest. `remark`: Why the
    probability is missing; empty where it is known.
    """

    distance: float
    linear_probability: float
    linear_figure: float
    figure: float | None
    effective_size: float
    remark: str
    probability: float | None = None
    standard_error: float | None = None
    members: int = 0
    failing: int = 0
    not_shown: int = 0
    unusable: int = 0
    beyond_card: int = 0
    unusable_probability: float = 0.0
    failing_ships: dict[str, float] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class _Linear:
    """A figure linear in z: the direction (k,) of its increase, its slope there, its value at the card, the limit, and
    the figure itself on the way there, at most :data:`FARTHEST_LIMIT` away."""

    direction: Array
    slope: float
    value: float
    allowed: float
    figure: float | None = None

    @property
    def distance(self) -> float:
        """To the limit."""
        return (self.allowed - self.value) / self.slope

    @property
    def point(self) -> float:
        """Distance of the ship of `figure`."""
        return min(self.distance, FARTHEST_LIMIT)

    @property
    def searched(self) -> bool:
        """Whether the limit is near enough, or the figure passes it sooner than a linear one."""
        return self.distance <= FARTHEST_LIMIT or self.figure is None or self.figure > self.allowed


@dataclass(frozen=True, eq=False)
class _Sample:
    """Members of a mixture: z (n, k), weights (n,), and the ensemble."""

    standard: Array
    weights: Array
    found: Ensemble

    def failing(self, name: str, allowed: float) -> Mask:
        """Usable members that do not meet a criterion, or do not show it."""
        with np.errstate(invalid="ignore"):
            return ~self.found.bad & ~(self.found.figures[name] <= allowed)


def rare_names(found: Ensemble, limits: Mapping[str, float]) -> list[str]:
    """Names of the criteria in `limits` that members show and fewer than :data:`FEW_FAILING` of them fail."""
    names = []
    for name, allowed in limits.items():
        values = found.figures.get(name, np.full(found.members, np.nan))
        with np.errstate(invalid="ignore"):
            failing = int(np.sum(~found.bad & ~(values <= allowed)))
        if np.isfinite(values).any() and failing < FEW_FAILING:
            names.append(name)
    return names


def tails(
    question: Question,
    draws: Draws,
    found: Ensemble,
    limits: Mapping[str, float],
    executor: Executor | None = None,
) -> tuple[dict[str, Tail], Tail | None, list[Notice]]:
    """Probabilities of failing the criteria of :func:`rare_names`, by importance sampling.

    `question`: Figures by the names of `limits`. `draws`: Draws of the ensemble `found`. `found`: Ensemble of this
    question. `limits`: Name to the largest allowed value of each criterion that counts.

    Returns tails: By criterion; any: Tail of ships that fail at least one of `limits`; None if that is not rare;
    notices: Why there are none.
    """
    names = rare_names(found, limits)
    if not names:
        return {}, None, []
    if draws.samples is not None:
        return {}, None, [_none("they are rows of samples, without a density")]
    if found.members < LEAST:
        return {}, None, [_none(f"{LEAST} members are needed for its search")]
    lines = _lines(question, draws, found, {name: limits[name] for name in names})
    searched = {name: line for name, line in lines.items() if line.searched}
    one = {name: _too_far(line) for name, line in lines.items() if not line.searched}
    unknown = ", ".join(name for name in names if name not in lines)
    about = [_none(f"{unknown} by too few members")] if unknown else []
    if not searched:
        return one, None, about
    mixture = _search(question, draws, searched, found.members, executor)
    sample = _sampled(question, mixture, found.members, executor)
    kept = (found.usable / found.members) * (1 - found.redrawn.members / found.members)
    masks = {name: sample.failing(name, limits[name]) for name in names}
    one |= {name: _tail(sample, masks[name], (line, name), draws, kept) for name, line in searched.items()}
    if set(names) != set(limits):
        return one, None, about
    nearest = min(searched, key=lambda name: searched[name].distance)
    of_any = np.any(list(masks.values()), axis=0)
    return one, _tail(sample, of_any, (searched[nearest], nearest), draws, kept), about


def _none(why: str) -> Notice:
    return Notice(f"no probability below what the members show: {why}")


def _lines(question: Question, draws: Draws, found: Ensemble, limits: Mapping[str, float]) -> dict[str, _Linear]:
    """Figures linear in z by name, where enough members show them."""
    standard = draws.members(0, found.members).standard
    lines = {name: _linear(standard, found.figures[name], allowed) for name, allowed in limits.items()}
    return {name: replace(line, figure=_figure_at(question, draws, line, name)) for name, line in lines.items() if line}


def _linear(standard: Array, values: Array, allowed: float) -> _Linear | None:
    """The plane through the figures (n,) of members at z (n, k); None where too few show it or it does not change."""
    shown = np.isfinite(values)
    if shown.sum() < 2 * (standard.shape[1] + 1):
        return None
    plane = np.linalg.lstsq(np.column_stack([np.ones(shown.sum()), standard[shown]]), values[shown], rcond=None)[0]
    slope = float(np.linalg.norm(plane[1:]))
    return _Linear(plane[1:] / slope, slope, float(plane[0]), allowed) if slope > 0 else None


def _search(
    question: Question,
    draws: Draws,
    lines: Mapping[str, _Linear],
    members: int,
    executor: Executor | None,
) -> MixtureDraws:
    """The mixture about the ships that fail each criterion."""
    centres = {name: max(line.point, 1.0) * line.direction for name, line in lines.items()}
    for number in range(ROUNDS):
        sample = _sampled(question, _mixture(draws, list(centres.values()), number), max(LEAST, members // 2), executor)
        done = True
        for name, line in lines.items():
            failing = sample.failing(name, line.allowed)
            if failing.sum() < FOUND:
                figures = np.where(np.isnan(sample.found.figures[name]), np.inf, sample.found.figures[name])
                usable = figures[~sample.found.bad]
                if not len(usable):
                    continue
                failing = ~sample.found.bad & (figures >= np.quantile(usable, 1 - LEVEL, method="higher"))
                done = False
            weights = sample.weights[failing]
            centres[name] = weights @ sample.standard[failing] / weights.sum()
        if done and number > 0:
            break
    return _mixture(draws, list(centres.values()), ROUNDS)


def _mixture(draws: Draws, centres: Sequence[Array], number: int) -> MixtureDraws:
    own = {each.name: getattr(draws, each.name) for each in fields(Draws)}
    shares = np.concatenate([[OWN_SHARE], np.full(len(centres), (1 - OWN_SHARE) / len(centres))])
    return MixtureDraws(
        **own, centres=np.vstack([np.zeros(len(draws.names)), *centres]), shares=shares, round=number + 1
    )


def _sampled(question: Question, mixture: MixtureDraws, members: int, executor: Executor | None) -> _Sample:
    found = ensemble(question, mixture, members, executor)
    standard = mixture.members(0, members).standard
    return _Sample(standard, mixture.weights(standard), found)


def _figure_at(question: Question, draws: Draws, line: _Linear, name: str) -> float | None:
    """The figure of the ship on the way to the limit."""
    values = np.clip(draws.at(line.point * line.direction[None])[0], draws.lowest, draws.highest)
    at = Draws(draws.names, values, np.zeros_like(draws.root), draws.lowest, draws.highest, draws.seed)
    value = float(ensemble(question, at, 1).figures.get(name, np.array([math.nan]))[0])
    return value if math.isfinite(value) else None


def _too_far(line: _Linear) -> Tail:
    """A limit that is not searched."""
    remark = (
        f"no probability: if the figure is linear the limit is farther than {FARTHEST_LIMIT:g} standard deviations "
        "from the card, where one in 1e9 ships lies, and none is searched there"
    )
    return Tail(**_of_line(line), effective_size=0.0, remark=remark)


def _of_line(line: _Linear) -> dict[str, Any]:
    from scipy.stats import norm  # slow to load

    return {
        "distance": line.distance,
        "linear_probability": float(norm.sf(line.distance)),
        "linear_figure": line.value + line.slope * line.point,
        "figure": line.figure,
    }


def _tail(sample: _Sample, failing: Mask, of: tuple[_Linear, str], draws: Draws, kept: float) -> Tail:
    """The probability of a mask; `kept` is the share of the card's distribution that is usable and within bounds."""
    line, name = of
    found, n = sample.found, len(failing)
    parts = np.where(failing, sample.weights, 0.0) / kept
    total, squares = float(parts.sum()), float(np.sum(parts**2))
    effective = total**2 / squares if squares > 0 else 0.0
    out = found.unusable.get(OUT_OF_BOUNDS, 0)
    beyond = found.figures.get(name + BEYOND_CARD_MARK, np.zeros(n)) > 0
    shift: dict[str, float] = {}
    if total > 0:
        mean = parts @ sample.standard / total
        errors = np.sqrt(np.sum(draws.root**2, axis=1))
        moved = (draws.root @ mean) / np.where(errors > 0, errors, 1.0)
        largest = np.argsort(-np.abs(moved))[:NAMED]
        shift = {draws.names[place]: float(moved[place]) for place in largest}
    enough = effective >= EFFECTIVE
    remark = (
        f"no probability: of {n} members drawn about the failing ships, {int(failing.sum())} fail, as if "
        f"{effective:.3g} had been drawn from the card's own errors; {EFFECTIVE:g} are needed"
    )
    bad = found.bad & ~_out(sample, draws)
    return Tail(
        probability=total / n if enough else None,
        standard_error=float(np.std(parts, ddof=1)) / math.sqrt(n) if enough else None,
        effective_size=effective,
        members=n,
        failing=int(failing.sum()),
        not_shown=int(np.sum(failing & ~np.isfinite(found.figures[name]))),
        unusable=int(found.bad.sum()) - out,
        beyond_card=int(np.sum(failing & beyond)),
        unusable_probability=float(np.sum(sample.weights[bad])) / n,
        failing_ships=shift,
        remark="" if enough else remark,
        **_of_line(line),
    )


def _out(sample: _Sample, draws: Draws) -> Mask:
    """Members beyond bounds, which are no ships."""
    values = draws.mean + sample.standard @ draws.root.T
    return np.asarray(((values < draws.lowest) | (values > draws.highest)).any(axis=1))
