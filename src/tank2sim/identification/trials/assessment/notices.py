"""Notices of an identification: recognised manoeuvres, choices, errors that grew, and the limits of its card."""

from __future__ import annotations

import math

from tank2sim.cards.card import ManoeuvringCard
from tank2sim.dynamics import build
from tank2sim.errors import InputError
from tank2sim.identification.trials.assessment.evaluation import pooled
from tank2sim.identification.trials.assessment.structure_choice import hard_rudder
from tank2sim.identification.trials.identify import Identification
from tank2sim.notices import Level, Notice, caution
from tank2sim.simulation.manoeuvres import Turn
from tank2sim.simulation.run import simulate

STOPPED = 0.15
"""Share of its speed below which a ship in a turn has stopped: full hulls keep a third (project choice)."""

WORSE = 1.05
"""An error that grew by less than this factor counts as unchanged (project choice)."""


LACKING = 3.0
"""Factor on the card's standard errors from which a missing effect is the likelier reason (project choice: three
standard errors are rare by chance)."""


def remarks(result: Identification) -> tuple[Notice, ...]:
    """All notices, as sentences."""
    return (
        *_recognised(result),
        *_chosen(result),
        *_widened(result),
        *_worse(result),
        *_outside(result),
        *_stops(result.card),
    )


def _recognised(result: Identification) -> list[Notice]:
    text = "; ".join(f"{name}: {words}" for name, words in result.manoeuvres.items())
    return [Notice(f"recognised, to starboard positive: {text}")] if text else []


def _chosen(result: Identification) -> list[Notice]:
    if result.card.model.kind == "mmg":
        return []  # it has one structure
    if not result.structures and result.structure == "card":
        return [
            Notice(
                "other structures were not tried: structure auto cross-validates them, cross_flow extrapolates to turns"
            )
        ]
    if not result.structures:
        return []
    return [
        Notice(
            f"cross-validation chose the structure {result.structure}: the simplest of those within one standard error "
            "of the best"
        )
    ]


def _widened(result: Identification) -> list[Notice]:
    scale = result.estimate.prior_scale
    wide = [f"{group} {factor:.3g} times" for group, factor in sorted(scale.items()) if factor > 1.05]
    if not wide:
        return []
    far = max(scale.values()) > LACKING
    doubtful = far and result.started.uncertainty  # assumed errors may be too small
    text = f"the card's standard errors were widened as the trials demand: {', '.join(wide)}; trust_card keeps them"
    found = [Notice(text, Level.CAUTION if doubtful else Level.INFO)]
    if far:
        found.append(
            Notice(
                "coefficients so far from the card may be due to an effect that it lacks: tank2sim gap, with these "
                "trials and the given card, finds which"
            )
        )
    return found


def _worse(result: Identification) -> list[Notice]:
    messages = []
    for words, before, after in result.comparisons:
        old, new = pooled(before.following, "motion.r"), pooled(after.following, "motion.r")
        if new > WORSE * old:
            messages.append(
                caution(
                    f"WORSE than the card before on the trials {words}: "
                    f"yaw-rate error {100 * old:.3g} % before, {100 * new:.3g} %"
                )
            )
    return messages


def _outside(result: Identification) -> list[Notice]:
    if result.holdout is None:
        return []
    missed = [
        f"{figure.trial} {figure.name}"
        for figure in result.holdout.figures
        if figure.interval and not figure.interval[0] <= figure.measured <= figure.interval[1]
    ]
    return [Notice(f"measured outside the 95 % interval: {', '.join(missed)}")] if missed else []


def _stops(card: ManoeuvringCard) -> list[Notice]:
    """Trials seldom hold a full turn: simulate a turn to each side with the card."""
    largest, messages = hard_rudder(card), []
    for side, word in ((1, "starboard"), (-1, "port")):
        words = caution(f"in a {math.degrees(largest):.0f} deg turn to {word} the model found")
        try:
            speed = simulate(build(card), Turn(side * largest)).trajectory["motion.speed"]
        except InputError:
            messages.append(f"{words} leaves all bounds: it holds only near the trials")
            continue
        if speed[-1] < STOPPED * speed[0]:
            messages.append(
                f"{words} loses {100 * (1 - speed[-1] / speed[0]):.0f} % of its speed: it holds only near the trials"
            )
    return [Notice(text) for text in messages]
