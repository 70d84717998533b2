"""The standard trials of a ship in calm water, and the deviations of their figures by the errors of its card."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from tank2sim.analysis.ensemble.draws import draws_with
from tank2sim.analysis.stability.imo import TRIAL_RUDDER
from tank2sim.cards.card import ManoeuvringCard
from tank2sim.dynamics import build
from tank2sim.dynamics.card_parameters import card_parameters, joint_errors, study_model
from tank2sim.dynamics.effects import undisturbed_inputs
from tank2sim.dynamics.model import Model
from tank2sim.errors import InputError
from tank2sim.simulation.card_range import Numbers, entry_name, single_figures
from tank2sim.simulation.ensemble import Redrawn
from tank2sim.simulation.figures import Figures
from tank2sim.simulation.integrator import Integrator
from tank2sim.simulation.manoeuvres import Manoeuvre, Stop, Turn, Zigzag
from tank2sim.simulation.run import Run, simulate

MEMBERS = 40
"""Members of an ensemble: their deviation has an uncertainty of about 15 %. Project choice."""

SEED = 601
"""Seed of the members' random numbers; any number is valid."""

LEAST_SHARE = 0.9
"""Least share of the members that reach a figure with a spread: fewer are a biased selection."""

_OVERSHOOTS = 2
"""Number of evaluated overshoots: those of IMO MSC.137(76)."""

_SIGMA_QUANTILES = (0.158655, 0.841345)


@dataclass(frozen=True)
class TrialShip:
    """A card ready to run.

    Parameters
    ----------
    card : ManoeuvringCard
    model : Model
    integrator : Integrator
    """

    card: ManoeuvringCard
    model: Model
    integrator: Integrator

    @property
    def has_engine(self) -> bool:
        """True if the card has propulsion."""
        return "propeller.speed" in self.model.input_names

    @property
    def largest_rudder(self) -> float:
        """Rudder of the turning circles, rad: 35 deg, or the largest of the gear."""
        gear = self.card.steering_gear
        return min(TRIAL_RUDDER, gear.max_angle_rad if gear and gear.max_angle_rad else TRIAL_RUDDER)

    def run(
        self,
        manoeuvre: Manoeuvre,
        parameters: Mapping[str, float] | None = None,
        inputs: Mapping[str, float] | None = None,
    ) -> Run | str:
        """The trial in calm water, or the reason that it cannot be run.

        Parameters
        ----------
        manoeuvre : Manoeuvre
            Of :mod:`tank2sim.simulation.manoeuvres`.
        parameters, inputs : mapping, optional
            Values in place of the model's, by name, SI.
        """
        calm = undisturbed_inputs(self.model)
        try:
            return simulate(
                self.model,
                manoeuvre,
                inputs={**calm, **(inputs or {})},
                parameters=parameters,
                integrator=self.integrator,
            )
        except InputError as error:
            return f"{error.place}: {error.problem}" if error.place else error.problem


def ship_of(card: ManoeuvringCard) -> TrialShip:
    """A card ready to run."""
    model = build(card)
    return TrialShip(card, model, Integrator(model))


def standard_trials(ships: Sequence[TrialShip]) -> dict[str, Manoeuvre]:
    """Name to trial: turns at the largest rudder, zigzags 10/10 and 20/20, and the stop if all have an engine."""
    rudder = min(ship.largest_rudder for ship in ships)
    shown = f"{math.degrees(rudder):.3g}"
    ten, twenty = math.radians(10.0), math.radians(20.0)
    trials: dict[str, Manoeuvre] = {
        f"turn {shown} deg to starboard": Turn(rudder),
        f"turn {shown} deg to port": Turn(-rudder),
        "zigzag 10/10": Zigzag(ten, ten),
        "zigzag 20/20": Zigzag(twenty, twenty),
    }
    if all(ship.has_engine for ship in ships):
        trials["full astern stop"] = Stop()
    return trials


def figure_numbers(figures: Figures) -> Numbers:
    """The figures of a run that are single numbers, with the first overshoots, without missing ones."""
    overshoots = {entry_name("overshoots_deg", place) for place in range(_OVERSHOOTS)}
    excluded = {"stopped_at_mps", *(name for name in figures if name.endswith("_lengths"))}
    single = single_figures(figures).items()
    return {name: value for name, value in single if (name in figures or name in overshoots) and name not in excluded}


def members(
    card: ManoeuvringCard, model: Model, count: int, seed: int = SEED
) -> tuple[tuple[dict[str, float], ...], tuple[str, ...]]:
    """Parameters of `count` ships drawn within the errors of the card, with notices.

    Errors of all numbers are normal, correlated by the card's covariance, or independent without one. Each member has
    its own random number generator, so that it does not depend on their number. Inputs of the `model` (a current) are
    zero in the trials, and not drawn.

    Raises
    ------
    InputError
        The covariance to which the card refers has an error.
    """
    if not count:
        return (), ()
    errors = joint_errors(card, card_parameters(card, study_model(card)))
    draws, known = draws_with(errors, seed), set(model.parameter_names)
    found = [draws.drawn(number) for number in range(count)]
    words = Redrawn.of([draw.beyond for draw in found]).in_words(count)
    drawn = tuple({name: value for name, value in draw.values.items() if name in known} for draw in found)
    if errors.together:
        return drawn, (errors.together_in_words, *words)
    alone = "no covariance is next to the card: errors are taken as independent, and deviations of figures may be too"
    return drawn, (f"{alone} large where errors go together", *words)


def member_spread(runs: Sequence[Mapping[str, float]]) -> Numbers:
    """Standard deviation of each figure over the members' runs (empty where one could not be run).

    Half the distance between the quantiles of 15.87 and 84.13 %, which equals that of normal figures and is robust to a
    few diverging members. Figures that fewer than :data:`LEAST_SHARE` of them reach have none.
    """
    names = dict.fromkeys(name for run in runs for name in run)
    found = {name: [run[name] for run in runs if name in run] for name in names}
    enough = max(2.0, LEAST_SHARE * len(runs))
    return {
        name: float(np.diff(np.quantile(values, _SIGMA_QUANTILES))[0] / 2)
        for name, values in found.items()
        if len(values) >= enough
    }
