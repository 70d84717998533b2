"""Design of a sea trial: the manoeuvres, with repeats, that make figures most certain, against the usual set.

What a manoeuvre shows of the coefficients is the information by which the next test after a search for missing effects
is chosen (:mod:`tank2sim.gap.outcome.next_test`): readings in windows with an unknown first state and unknown constant
disturbances. The errors of the card are the prior, as of ``identify``.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from tank2sim.analysis.influence.figures import InfluenceFigure, parse_figure
from tank2sim.analysis.influence.study import Study
from tank2sim.apps.design.allocation import Allocation, InformationBlock, certainty, least_time, target_matrices
from tank2sim.apps.design.figure_slopes import FigureSlopes, assumed_errors, figure_slopes
from tank2sim.apps.design.study import Certainty, PlannedCoefficient
from tank2sim.arrays import Array
from tank2sim.cards.card import ManoeuvringCard
from tank2sim.dynamics.card_parameters import CardParameter, JointErrors, card_parameters, joint_errors, study_model
from tank2sim.errors import ArgumentError
from tank2sim.gap.outcome.next_test import Explanation, SailedShip
from tank2sim.gap.outcome.next_test_candidates import Candidate, candidate_manoeuvres, orders_csv
from tank2sim.identification.trials.problem.problem_from_card import free_parameters

SENSORS: Mapping[str, float] = {
    "motion.u": 0.05,
    "motion.v": 0.05,
    "motion.r": np.radians(0.02),
    "motion.psi": np.radians(0.2),
    "motion.x": 1.0,
    "motion.y": 1.0,
}
"""Standard deviation of a reading a second where none is stated, SI. Project choice: a satellite receiver with its
Doppler velocities, and a gyro compass."""

TRIAL_LENGTHS = (9.0, 12.0, 18.0, 24.0)
"""Lengths of candidates, L/u0: from half a turning circle and an execute or two of a zigzag to one and a half turns and
four executes (:data:`tank2sim.gap.outcome.next_test.LENGTH`). Project choice."""

TRIAL_APPROACH = 6.0
"""Time before each manoeuvre until the ship is steady on course and speed, L/u0. Project choice: a fast ship has its
speed again after some six lengths; a tanker needs more."""

_SHARES = (0.25, 0.4, 0.6, 0.8, 1.0)
"""Shares of the time at which certainty is drawn."""

_USUAL = ("turn:35", "turn:-35", "zigzag:10/10", "zigzag:20/20")


@dataclass(frozen=True, kw_only=True)
class TrialManoeuvre:
    """A manoeuvre of a trial.

    `manoeuvre`: as ``simulate --manoeuvre`` takes it; empty for one that only its orders state; `duration_s`,
    `total_s`: duration of the manoeuvre, and with its approach; `orders`: CSV of its orders by the card, for ``simulate
    --manoeuvre file:``.
    """

    name: str
    manoeuvre: str
    duration_s: float
    total_s: float
    orders: str


@dataclass(frozen=True, eq=False, kw_only=True)
class TrialDesign:
    """A designed trial.

    `minutes`: at most; `manoeuvres`: with repeats; `usual`: the usual set, once; `prior_errors`,
    `standard_errors`, `usual_standard_errors` (m,): errors of each figure before the trial, after it, and after the
    usual set in the same time; `unstable`: the card's ship is unstable on a straight course: its figures are not linear
    in the coefficients; `minutes_needed`: least time of a plan with every figure as certain as by the usual set in
    `minutes`; `coefficients`: parameter to its standard error before, by the plan and by the usual set, relative to
    that before; `sensors`: variable to the standard deviation of a reading, SI.
    """

    card: ManoeuvringCard
    slopes: FigureSlopes
    minutes: float
    manoeuvres: tuple[tuple[TrialManoeuvre, int], ...]
    usual: tuple[TrialManoeuvre, ...]
    prior_errors: Array
    standard_errors: Array
    usual_standard_errors: Array
    curve: Certainty
    unstable: bool
    minutes_needed: float | None
    coefficients: dict[str, PlannedCoefficient]
    sensors: Mapping[str, float]

    @property
    def minutes_used(self) -> float:
        """Time of the plan, min."""
        return float(sum(each.total_s * repeats for each, repeats in self.manoeuvres)) / 60

    @property
    def usual_minutes(self) -> float:
        """Time of the usual set once, min."""
        return float(sum(each.total_s for each in self.usual)) / 60


def design_of_trial(
    card: ManoeuvringCard,
    figures: Sequence[InfluenceFigure],
    *,
    minutes: float | None,
    sensors: Mapping[str, float],
    one_side: bool,
) -> TrialDesign:
    """The trial that makes the worst figure most certain in a time.

    `card`: its errors are the prior; a derivative without a stated one has :data:`.RELATIVE_ERROR`; `minutes`: by
    default the time of the usual set; `sensors`: variable (``motion.*``) to the standard deviation of a reading a
    second, SI; `one_side`: figures to the side of the given rudder, in place of the mean over both sides. Raises
    InputError: the ship does not show a figure, leaves all bounds in every manoeuvre, or the time is too short.
    """
    slopes = figure_slopes(card, figures, (), draws=0, seed=0, one_side=one_side)
    parameters, errors = _prior(card)
    free = tuple(parameter.name for parameter in parameters)
    model = study_model(card)
    seen = {name: size for name, size in sensors.items() if name in model}
    ship = SailedShip(Explanation("card", card, free, errors.covariance), seen, 0.0)
    of, information = _candidates(card, ship)
    target = slopes.of([parameter.short for parameter in parameters], slopes.at_card) @ ship.axes
    _refuse_independent(figures, target)
    cost = np.array([each.total_s for each in of])
    block = InformationBlock(np.eye(ship.axes.shape[1]), information, target_matrices([row[None] for row in target]))
    every = Allocation((block,), cost)
    usual = np.array([each.manoeuvre in _USUAL and each.duration_s == of[-1].duration_s for each in of], dtype=float)
    usual_s = float(usual @ cost)
    budget = usual_s if minutes is None else 60 * minutes
    if budget < cost.min():
        problem = f"has no room for a manoeuvre of {cost.min() / 60:.3g} min"
        raise ArgumentError("minutes", f"{budget / 60:.3g}", problem, "give more minutes")
    by_usual = every.variances(usual * budget / usual_s)
    targets = every.scaled(by_usual)

    def plan(share: float) -> Array:
        return targets.whole(share * budget, targets.relaxed(share * budget)[0]).astype(float)

    plans = {share: plan(share) for share in _SHARES if share * budget >= cost.min()}
    counts, needed = plans[1.0], least_time(targets, plans, plan, float(cost.min()) / budget)
    return TrialDesign(
        card=card,
        slopes=slopes,
        minutes=budget / 60,
        manoeuvres=tuple((of[place], int(counts[place])) for place in np.flatnonzero(counts)),
        usual=tuple(each for each, count in zip(of, usual, strict=True) if count),
        prior_errors=np.sqrt(every.variances(np.zeros(len(of)))),
        standard_errors=np.sqrt(every.variances(counts)),
        usual_standard_errors=np.sqrt(by_usual),
        curve=certainty(slopes.texts, every, plans, usual, [share * budget for share in sorted(plans)]),
        unstable=bool(Study(card, [parse_figure("criterion_C")]).base[0] <= 0),
        minutes_needed=None if needed is None else needed / 60,
        coefficients=_coefficients(ship.axes, block, counts, usual * budget / usual_s, free, errors.covariance),
        sensors=dict(sensors),
    )


def _prior(card: ManoeuvringCard) -> tuple[list[CardParameter], JointErrors]:
    """Parameters that :func:`.identify` estimates (no accelerations), and their errors before the trial."""
    known = replace(card, uncertainty=assumed_errors(card))
    estimated = free_parameters(known)
    parameters = [each for each in card_parameters(known, study_model(known)) if each.name in estimated]
    return parameters, joint_errors(known, parameters)


def _refuse_independent(figures: Sequence[InfluenceFigure], target: Array) -> None:
    """Refuse a figure whose slopes, a row of `target`, are all zero."""
    largest = np.abs(target).max(axis=1)
    if not largest.all():
        figure = figures[int(np.argmin(largest))].text
        problem = "does not depend on any coefficient of the card with an error"
        raise ArgumentError("figures", figure, problem, "state errors in [uncertainty] of the card")


def _candidates(card: ManoeuvringCard, ship: SailedShip) -> tuple[list[TrialManoeuvre], Array]:
    """Candidates of all lengths, the longest last, with their information; without those out of bounds."""
    found: list[TrialManoeuvre] = []
    information = []
    for length in TRIAL_LENGTHS:
        of: Sequence[Candidate] = candidate_manoeuvres(card, length)
        orders, each = ship.information(of, length)
        duration = next(iter(orders.values())).shape[1] * ship.step_s
        for place, candidate in enumerate(of):
            if not np.isfinite(each[place]).all():
                continue
            own = {name: values[place] for name, values in orders.items()}
            manoeuvre = TrialManoeuvre(
                name=candidate.name,
                manoeuvre=candidate.manoeuvre,
                duration_s=duration,
                total_s=duration + TRIAL_APPROACH * ship.ship_time,
                orders=orders_csv(ship.step_s, own, f"{candidate.name} of {card.ship.name}, by its card"),
            )
            found.append(manoeuvre)
            information.append(each[place])
    if not any(each.manoeuvre in _USUAL for each in found):
        problem = "leaves all bounds in every manoeuvre of the usual set"
        raise card.fault("", problem, "check the card with tank2sim simulate")
    return found, np.stack(information)


def _coefficients(
    axes: Array, block: InformationBlock, counts: Array, usual: Array, free: Sequence[str], covariance: Array
) -> dict[str, PlannedCoefficient]:
    before = np.sqrt(np.diag(covariance))
    design, by_usual = (
        np.sqrt(np.einsum("ij,jk,ik->i", axes, block.covariance(each), axes)) / before for each in (counts, usual)
    )
    return {
        name.removeprefix("derivatives."): PlannedCoefficient(
            before=float(before[place]), design=float(design[place]), usual=float(by_usual[place])
        )
        for place, name in enumerate(free)
    }
