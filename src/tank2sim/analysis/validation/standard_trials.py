"""The standard trials of a ship in calm water, and the deviations of their figures by the errors of its card."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import chain

import numpy as np

from tank2sim.analysis.ensemble.draws import draws_with
from tank2sim.analysis.ensemble.results import DrawnShips
from tank2sim.analysis.stability.imo import calm_trial, largest_trial_rudder
from tank2sim.arrays import Array
from tank2sim.cards.card import SteeredBy, SteeredCard
from tank2sim.cards.form import ThrusterSection
from tank2sim.cards.small_craft import cruising_revolutions, pushes_ahead
from tank2sim.dynamics import build
from tank2sim.dynamics.card_parameters import card_parameters, joint_errors, study_model
from tank2sim.dynamics.model import Model
from tank2sim.notices import Notice
from tank2sim.simulation.card_range import Numbers, entry_name, single_figures
from tank2sim.simulation.ensemble import Redrawn
from tank2sim.simulation.figures import Figures
from tank2sim.simulation.integrator import Integrator
from tank2sim.simulation.manoeuvres import Manoeuvre, Stop, Turn, Zigzag
from tank2sim.simulation.run import Run
from tank2sim.simulation.thruster_manoeuvres import DifferenceTurn, Spin, StraightRun, ThrusterManoeuvre
from tank2sim.units import from_si, to_si

SEED = 601
"""Seed of the members' random numbers; any number is valid."""

LEAST_SHARE = 0.9
"""Least share of the members that reach a figure with a spread: fewer are a biased selection."""

_OVERSHOOTS = 2
"""Number of evaluated overshoots, as in IMO MSC.137(76)."""

CRAFT_SHARE = 0.5
"""Difference and revolutions of the turns of a craft over the largest. Project choice: the middle of what it does."""

_SIGMA_QUANTILES = (0.158655, 0.841345)


@dataclass(frozen=True)
class TrialShip:
    """A card ready to run."""

    card: SteeredCard
    model: Model
    integrator: Integrator

    @property
    def has_engine(self) -> bool:
        """True if the card has propulsion."""
        return "propeller.speed" in self.model.input_names

    @property
    def largest_rudder(self) -> float:
        """Rudder of the turning circles, rad: 35 deg, or the largest of the gear."""
        return largest_trial_rudder(self.model.defaults)

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
            One of :mod:`tank2sim.simulation.manoeuvres`.
        parameters, inputs : mapping, optional
            Values in place of the model's, by name, SI.
        """
        return calm_trial(self.model, manoeuvre, self.integrator, parameters, inputs)

    def member_figures(
        self,
        manoeuvre: Manoeuvre,
        drawn: Sequence[Mapping[str, float]],
        parameters: Mapping[str, float] | None = None,
    ) -> list[Numbers]:
        """Figures of a trial by ships with drawn parameters; none of one that cannot be run.

        Parameters
        ----------
        manoeuvre : Manoeuvre
        drawn : sequence of mapping
            Values of each ship, by name, SI.
        parameters : mapping, optional
            Values that all have in place of the model's.
        """
        # Only the numbers of each member are kept: the motions of a thousand would fill gigabytes.
        runs = (self.run(manoeuvre, {**(parameters or {}), **member}) for member in drawn)
        return [{} if isinstance(run, str) else figure_numbers(run.figures) for run in runs]


def ship_of(card: SteeredCard) -> TrialShip:
    """A card ready to run."""
    model = build(card)
    return TrialShip(card, model, Integrator(model))


def standard_trials(ships: Sequence[TrialShip]) -> dict[str, Manoeuvre]:
    """Name to trial: turns at the largest rudder, zigzags 10/10 and 20/20, and the stop if all have an engine.

    For craft with thrusters see :func:`craft_trials`.
    """
    if ships[0].card.steered_by is SteeredBy.THRUSTERS:
        return dict(craft_trials([ship.card for ship in ships]))
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


def craft_trials(cards: Sequence[SteeredCard]) -> dict[str, ThrusterManoeuvre]:
    """Name to trial of craft: full ahead from rest, turns by :data:`CRAFT_SHARE` of the largest difference, a spin.

    The revolutions are those that all craft reach, in tens of rpm. A craft without thrusters at both sides has the
    straight run alone.
    """
    each = [_steering_thrusters(card) for card in cards]
    full = min(thruster.max_radps for thrusters in each for thruster in thrusters)
    astern = min(-thruster.lowest_radps for thrusters in each for thruster in thrusters)
    room = min(min(full - cruising, cruising + astern) for cruising in map(cruising_revolutions, cards))
    trials: dict[str, ThrusterManoeuvre] = {"straight": StraightRun(_tens(full))}
    if all({1.0, -1.0} <= {math.copysign(1, one.y_m) for one in thrusters if one.y_m} for thrusters in each):
        difference, spin = _tens(CRAFT_SHARE * 2 * room), _tens(CRAFT_SHARE * min(full, astern))
        trials |= {
            "difference to starboard": DifferenceTurn(difference),
            "difference to port": DifferenceTurn(-difference),
            "spin to starboard": Spin(spin),
        }
    return {f"{name} ({trial.words})": trial for name, trial in trials.items()}


def _steering_thrusters(card: SteeredCard) -> list[ThrusterSection]:
    """The thrusters that push ahead."""
    return [thruster for thruster, holds in zip(card.thrusters, pushes_ahead(card), strict=True) if holds]


def _tens(revolutions: float) -> float:
    """Revolutions (rad/s) rounded down to tens of rpm, if there are as many."""
    rpm = from_si("n_rpm", revolutions)
    return to_si("n_rpm", 10 * math.floor(rpm / 10))[1] if rpm >= 10 else revolutions


def figure_numbers(figures: Figures) -> Numbers:
    """The figures of a run that are single numbers, with the first overshoots, without missing ones."""
    overshoots = {entry_name("overshoots_deg", place) for place in range(_OVERSHOOTS)}
    excluded = {"stopped_at_mps", *(name for name in figures if name.endswith("_lengths"))}
    single = single_figures(figures).items()
    return {name: value for name, value in single if (name in figures or name in overshoots) and name not in excluded}


def members(card: SteeredCard, model: Model, count: int) -> tuple[tuple[dict[str, float], ...], tuple[Notice, ...]]:
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
    draws, known = draws_with(errors, SEED), set(model.parameter_names)
    found = draws.members(0, count)
    words = Redrawn.of(list(found.beyond.values())).in_words(count)
    members = (zip(draws.names, row, strict=True) for row in found.values.tolist())
    drawn = tuple({name: value for name, value in member if name in known} for member in members)
    if errors.together:
        return drawn, (Notice(errors.together_in_words), *words)
    alone = "no covariance is next to the card: errors are taken as independent, and deviations of figures may be too"
    return drawn, (Notice(f"{alone} large where errors go together"), *words)


def drawn_ships(card: SteeredCard, runs: Mapping[str, Sequence[Numbers]]) -> DrawnShips | None:
    """The members of a card with the figures of their runs, named ``trial: figure``; None without members.

    Parameters
    ----------
    card : SteeredCard
    runs : mapping
        Trial to the figures of each member of :func:`members`, in the units of their names.
    """
    count = max(map(len, runs.values()), default=0)
    if not count:
        return None
    figures = {
        f"{trial}: {name}": np.array([numbers.get(name, math.nan) for numbers in each])
        for trial, each in runs.items()
        for name in dict.fromkeys(chain.from_iterable(each))
    }
    usable = np.array([any(each[number] for each in runs.values()) for number in range(count)])
    return DrawnShips(
        card, draws_with(joint_errors(card, card_parameters(card, study_model(card))), SEED), figures, usable
    )


def robust_deviation(values: Array) -> float:
    """Half the distance between the quantiles of 15.87 and 84.13 % of values (n,); 0 with fewer than two.

    It equals the standard deviation of normal values, and is robust to a few diverging members.

    Parameters
    ----------
    values : array (n,)
    """
    return float(np.diff(np.quantile(values, _SIGMA_QUANTILES))[0] / 2) if len(values) > 1 else 0.0


def member_spread(runs: Sequence[Mapping[str, float]]) -> Numbers:
    """Standard deviation of each figure over the members' runs (empty where one could not be run).

    Half the distance between the quantiles of 15.87 and 84.13 %, which equals the deviation of normal figures and is
    robust to a few diverging members. Figures that fewer than :data:`LEAST_SHARE` of them reach have none.
    """
    names = dict.fromkeys(name for run in runs for name in run)
    found = {name: [run[name] for run in runs if name in run] for name in names}
    enough = max(2.0, LEAST_SHARE * len(runs))
    return {name: robust_deviation(np.array(values)) for name, values in found.items() if len(values) >= enough}
