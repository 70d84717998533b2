"""The current of trials at sea: its velocity to north and east is estimated with the coefficients.

A uniform steady current adds its velocity to that over the ground and changes no force. It is a parameter of the fit
and none of the ship: after the fit it is taken out of the estimate, and the card has it as its effect ``current``.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from tank2sim.arrays import Array
from tank2sim.cards.card import ManoeuvringCard
from tank2sim.cards.reading import revised
from tank2sim.dynamics.effects.surroundings import CURRENT
from tank2sim.dynamics.model import Parameter
from tank2sim.identification.trials.problem.estimation_problem import Estimate, Problem
from tank2sim.identification.trials.problem.structures import with_effect
from tank2sim.records.trials import Trial

CURRENT_PARAMETERS = ("current.north", "current.east")
"""Parameters of a problem with a free current, m/s: what is added to the current of its model."""

CURRENT_ERROR = 0.5
"""Standard error of each component before the trials, m/s (project choice: a knot; tides and ocean currents outside
of straits stay below two)."""

KNOWN_TO = 0.01
"""Largest standard error of a component, over the ship's speed, of a current that the trials determine (project choice:
a current of 5 % of the speed that was left out changed the tactical diameter of a turn by 30 %, 1 % by about 6 %)."""

_STRONGEST = next(each.maximum for each in CURRENT.parameters if each.name == "speed_mps")


@dataclass(frozen=True, eq=False)
class WaterCurrent:
    """A current."""

    velocity: Array  # (2,): To north and east, m/s
    covariance: Array  # (2, 2): Covariance of both
    ship_speed_mps: float  # Speed of the card

    @property
    def speed_mps(self) -> float:
        """Its speed, m/s."""
        return float(np.hypot(*self.velocity))

    @property
    def direction_rad(self) -> float:
        """Direction towards which it sets, rad from north, clockwise, 0 to 2 pi."""
        return math.atan2(self.velocity[1], self.velocity[0]) % (2 * math.pi)

    @property
    def standard_error_mps(self) -> float:
        """Standard error in the direction in which it is known worst, m/s."""
        return float(np.sqrt(np.linalg.eigvalsh(self.covariance)[-1]))

    @property
    def determined(self) -> bool:
        """Whether the trials determine it to :data:`KNOWN_TO` of the ship's speed."""
        return self.standard_error_mps < KNOWN_TO * self.ship_speed_mps

    @property
    def errors(self) -> tuple[float, float]:
        """Standard errors of speed (m/s) and direction (rad, at most pi), to first order."""
        along = self.velocity / max(self.speed_mps, 1e-9)
        across = np.array([-along[1], along[0]])
        speed, side = (math.sqrt(float(unit @ self.covariance @ unit)) for unit in (along, across))
        return speed, min(side / max(self.speed_mps, 1e-9), math.pi)


def at_sea(trials: Sequence[Trial]) -> bool:
    """Whether a trial has a geographic position (``# origin:``) or a velocity over the ground: of a ship at sea."""
    ground = ("u_ground_mps", "v_ground_mps", "sog_mps", "cog_rad")
    return any(
        (trial.origin_deg is not None and "x_m" in trial.signals) or any(name in trial.signals for name in ground)
        for trial in trials
    )


def of_unknown_current(card: ManoeuvringCard, trials: Sequence[Trial]) -> bool:
    """Whether trials at sea are in a current that neither the card nor a sensor states; a basin has none."""
    stated = any(entry.name == CURRENT.name for entry in card.effects) or any(
        "current_speed_mps" in trial.signals for trial in trials
    )
    return at_sea(trials) and not stated


def with_current(problem: Problem) -> Problem:
    """The problem with :data:`CURRENT_PARAMETERS` free, 0 ± :data:`CURRENT_ERROR`, added to its current."""
    parameters = [
        Parameter(
            name=name,
            unit="m/s",
            description=f"Velocity of the water to {name.rpartition('.')[2]}, added to the current of the card",
            minimum=-_STRONGEST,
            maximum=_STRONGEST,
            start=0.0,
        )
        for name in CURRENT_PARAMETERS
    ]
    model = problem.model.extend(*parameters)
    for rate, parameter in zip(("motion.xdot", "motion.ydot"), parameters, strict=True):
        model = model.redefine(rate, lambda old, added=parameter: old + added.symbol)  # type: ignore[misc]
    inverse = problem.prior_inverse
    if inverse is not None:
        inverse = np.block([[inverse, np.zeros((len(inverse), 2))], [np.zeros((2, len(inverse))), np.eye(2)]])
    return replace(
        problem,
        model=model,
        free=(*problem.free, *CURRENT_PARAMETERS),
        prior_mean=np.append(problem.prior_mean, [0.0, 0.0]),
        prior_error=np.append(problem.prior_error, [CURRENT_ERROR, CURRENT_ERROR]),
        prior_inverse=inverse,
        ship=None,
    )


def current_alone(problem: Problem) -> Problem:
    """The problem with a free current and all else held at its prior mean."""
    return with_current(problem).without(problem.free)


def without_current(estimate: Estimate, card: ManoeuvringCard) -> tuple[Estimate, WaterCurrent]:
    """An estimate with a free current, split into the other parameters (current eliminated) and the current.

    `card`: Card of the problem; its current is added.
    """
    part = [estimate.free.index(name) for name in CURRENT_PARAMETERS]
    kept = [place for place in range(len(estimate.free)) if place not in part]
    information = estimate.information
    own = information[np.ix_(part, part)] + np.eye(2) / CURRENT_ERROR**2
    cross = information[np.ix_(kept, part)]
    eliminated = information[np.ix_(kept, kept)] - cross @ np.linalg.solve(own, cross.T)
    current = WaterCurrent(
        current_of(card) + estimate.values[part], estimate.covariance[np.ix_(part, part)], card.model.speed_mps
    )
    remaining = replace(
        estimate,
        free=tuple(estimate.free[place] for place in kept),
        values=estimate.values[kept],
        covariance=estimate.covariance[np.ix_(kept, kept)],
        information=eliminated,
    )
    return remaining, current


def current_of(card: ManoeuvringCard) -> Array:
    """Velocity of the current of a card to north and east (2,), m/s; 0 without one."""
    still = {"speed_mps": 0.0, "direction_rad": 0.0}
    given = next((entry.parameters for entry in card.effects if entry.name == CURRENT.name), still)
    direction = given["direction_rad"]
    return given["speed_mps"] * np.array([math.cos(direction), math.sin(direction)])


def card_in(card: ManoeuvringCard, current: WaterCurrent) -> ManoeuvringCard:
    """The card with a current and its standard errors as its effect ``current``, in place of the one it may have."""
    speed_error, direction_error = current.errors
    found = {
        "speed_mps": (float(f"{current.speed_mps:.4f}"), float(f"{speed_error:.3g}")),
        "direction_deg": (
            float(f"{math.degrees(current.direction_rad):.2f}"),
            float(f"{math.degrees(direction_error):.3g}"),
        ),
    }
    for number, entry in enumerate(card.effects):
        if entry.name == CURRENT.name:
            changes: dict[str, object] = {}
            for key, pair in found.items():
                for section, value in zip(("parameters", "uncertainty"), pair, strict=True):
                    changes[f"effects.{number}.{section}.{key}"] = value
            return revised(card, {}, changes, comment="estimated with the coefficients")
    return with_effect(card, CURRENT.name, found)
