"""Verdicts on the criteria of MSC.137(76), with probabilities: the trial as run, and the ship at full load."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from tank2sim.analysis.stability.imo import TRIAL_RUDDER, largest_allowed, manoeuvring_trials
from tank2sim.analysis.validation.standard_trials import SEED, robust_deviation
from tank2sim.apps.trial_office.full_load import Prediction
from tank2sim.apps.trial_office.tried import Tried
from tank2sim.cards.card import ManoeuvringCard
from tank2sim.simulation.manoeuvres import Stop, Turn, Zigzag

DECIDED = 0.95
"""Probability from which a criterion is passed, and one less which it is failed; undecided between. Project choice:
as wide as the other intervals."""

LOADING_HOLDS = 0.5
"""``validity`` of the loading below which its formulas do not carry the verdict. Project choice: halfway between where
they hold and where they do not, before the ballast of a tanker."""

EXTRAPOLATED = "EXTRAPOLATED"
"""Last word of a verdict that the formulas for the loading do not carry."""

_NEARLY_OVER = math.radians(30.0)
"""Least rudder of a turning circle of the criteria: 35 deg, or the largest of the gear. Project choice."""

_LENGTHS = {
    "advance_lengths": "advance_m",
    "tactical_diameter_lengths": "tactical_diameter_m",
    "initial_turning_lengths": "initial_turning_distance_m",
    "track_reach_lengths": "track_reach_m",
}


@dataclass(frozen=True, kw_only=True)
class CriterionSide:
    """Values of a criterion by one record, in the criterion's unit: as run, and at full load."""

    trial: str
    side: str
    as_run: float
    full_load: float | None


@dataclass(frozen=True, kw_only=True)
class CriterionVerdict:
    """A criterion of MSC.137(76), as run and at full load; values are of the worse side.

    `allowed`: limit for the ship at full load; `probability_as_run`, `probability`: chance of meeting it;
    `verdict_as_run`, `verdict`: ``pass``, ``fail``, ``undecided`` or ``not tried``; ``undecided, EXTRAPOLATED`` where
    the formulas for the loading do not hold.
    """

    name: str
    unit: str
    allowed: float
    sides: tuple[CriterionSide, ...] = ()
    as_run: float | None = None
    full_load: float | None = None
    probability_as_run: float | None = None
    probability: float | None = None
    verdict_as_run: str = "not tried"
    verdict: str = "not tried"


def judge_criteria(
    card: ManoeuvringCard,
    raw: Sequence[Tried],
    still: Sequence[Tried],
    found: Sequence[Prediction],
    validity: float,
    *,
    overshoots_hold: bool = True,
) -> tuple[CriterionVerdict, ...]:
    """Verdicts on all criteria of MSC.137(76) by manoeuvres as run, without the current, and simulated.

    `validity`: Validity of the formulas for the loading; `overshoots_hold`: False for a ship that is stable in one
    condition and unstable in the other: overshoots are then extrapolated.
    """
    length = card.ship.length_m
    asked = {key: (trial, name) for trial in manoeuvring_trials(TRIAL_RUDDER) for key, name in trial.criteria.items()}
    verdicts = []
    for name, allowed in largest_allowed(length / card.model.speed_mps).items():
        trial, figure = asked[name]
        unit, scale = ("L", length) if figure in _LENGTHS else ("deg", 1.0)
        figure = _LENGTHS.get(figure, figure)
        chosen = [
            group
            for group in zip(raw, still, found, strict=True)
            if _shows(figure, *group[:2]) and _is_trial(trial.manoeuvres[0], group[0].manoeuvre)
        ]
        verdict = CriterionVerdict(name=name, unit=unit, allowed=allowed)
        holds = validity * (overshoots_hold or unit == "L")
        verdicts.append(_judged(verdict, figure, scale, chosen, holds) if chosen else verdict)
    return tuple(verdicts)


def _judged(
    criterion: CriterionVerdict,
    figure: str,
    scale: float,
    chosen: Sequence[tuple[Tried, Tried, Prediction]],
    validity: float,
) -> CriterionVerdict:
    """The verdict by the trials of a criterion; the worse side counts, within each member."""
    value, error = max((raw.figures[figure], raw.errors.get(figure, 0.0)) for raw, _, _ in chosen)
    limit = criterion.allowed * scale
    as_run = _probability(math.log(limit / value), error / value) if value > 0 else 1.0
    loads = [prediction.at_full_load(still, figure) for _, still, prediction in chosen]
    sides = [
        CriterionSide(
            trial=raw.name, side=raw.side, as_run=raw.figures[figure] / scale, full_load=load and load[0] / scale
        )
        for (raw, _, _), load in zip(chosen, loads, strict=True)
    ]
    judged = replace(
        criterion,
        sides=tuple(sides),
        as_run=value / scale,
        probability_as_run=as_run,
        verdict_as_run=_verdict(as_run),
        verdict="undecided",
    )
    known = [load for load in loads if load is not None]
    if len(known) < len(loads):
        return judged
    middle, spread = _worse_side(chosen, known, figure)
    probability = _probability(math.log(limit) - middle, spread)
    words = _verdict(probability)
    if validity < LOADING_HOLDS:
        words = f"{words.replace('pass', 'undecided')}, {EXTRAPOLATED}"
    return replace(judged, full_load=max(known)[0] / scale, probability=probability, verdict=words)


def _worse_side(
    chosen: Sequence[tuple[Tried, Tried, Prediction]], known: Sequence[tuple[float, float]], figure: str
) -> tuple[float, float]:
    """Logarithm of the worse side at full load and its standard deviation; errors that both sides share do not add up.

    `known` is each side with the standard error of its logarithm.
    """
    draws = []
    for place, ((_, still, prediction), (centre, _)) in enumerate(zip(chosen, known, strict=True)):
        ratios = prediction.ratios.get(figure, np.zeros(0))
        noise = np.random.default_rng([SEED, place]).standard_normal(len(ratios))
        share = still.errors.get(figure, 0.0) / still.figures[figure]
        draws.append(math.log(centre) + ratios - np.median(ratios) + share * noise if len(ratios) else np.zeros(0))
    shortest = min(len(draw) for draw in draws)
    if shortest > 1:
        worst = np.max([draw[:shortest] for draw in draws], axis=0)
        return float(np.median(worst)), robust_deviation(worst)
    return max((math.log(centre), error) for centre, error in known)


def _shows(figure: str, *manoeuvres: Tried) -> bool:
    return all(figure in one.figures for one in manoeuvres)


def _is_trial(asked: Turn | Zigzag | Stop, manoeuvre: Turn | Zigzag | Stop) -> bool:
    """Whether a manoeuvre is the one that a criterion asks for, to a degree."""
    if type(manoeuvre) is not type(asked):
        return False
    if isinstance(manoeuvre, Turn):
        return abs(manoeuvre.rudder) >= _NEARLY_OVER
    if isinstance(manoeuvre, Stop):
        return manoeuvre.revolutions != 0
    assert isinstance(asked, Zigzag)
    apart = abs(manoeuvre.rudder) - asked.rudder, manoeuvre.heading - asked.heading
    return max(map(abs, apart)) < math.radians(1.5)


def _probability(distance: float, spread: float) -> float:
    """Probability that a logarithm is below its limit, `distance` above its middle."""
    if not spread:
        return 1.0 if distance >= 0 else 0.0
    return 0.5 * math.erfc(-distance / spread / math.sqrt(2))


def _verdict(probability: float) -> str:
    if probability >= DECIDED:
        return "pass"
    return "fail" if probability <= 1 - DECIDED else "undecided"
