"""The likelihood of explanations from a card and trials: errors of the card's coefficients, and prior of the noise."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from tank2sim.cards.card import SteeredBy, SteeredCard
from tank2sim.cards.terms import known_term
from tank2sim.dynamics.build import build
from tank2sim.dynamics.effects import EFFECTS
from tank2sim.dynamics.model import Model
from tank2sim.gap.inference.batch import BLOCKS_PER_SHIP_TIME, MEASURED_STATES, MeasuredBatch, batch_trials
from tank2sim.gap.inference.fit import Belief, NuisanceParameters
from tank2sim.gap.inference.hypothesis import CLOCK, Hypothesis
from tank2sim.gap.inference.kalman_filter import FORCE_STATES, NoiseLevels
from tank2sim.gap.inference.likelihood import WIDE_PRIOR, Likelihood
from tank2sim.identification.craft.problem import craft_prior
from tank2sim.identification.trials.problem.prepare_trials import Measured
from tank2sim.identification.trials.problem.problem_from_card import free_parameters
from tank2sim.records.trials import sampling_step

SLOW_SHARE = 0.3
"""Slow error of a sensor over its white noise at 10 samples in a block, prior to the trials (project choice)."""

SLOW_TIME = 3.0
"""Time constant of a sensor's slow error prior to the trials, in L/u0 (project choice): it outlasts a manoeuvre's
phases."""

FORCE_SHARE = 0.01
"""Unexplained acceleration prior to the trials, as a share of the ship's accelerations (project choice)."""

FORCE_TIME = 0.5
"""Time constant of the unexplained acceleration prior to the trials, in L/u0 (project choice): as of gusts."""

GEAR, ASSUMED_GEAR = 0.02, 0.5
"""Relative standard error of the steering gear's data in a card, equal to that of a coefficient without a stated one,
and of the time constant that is assumed where the card states none (project choice)."""

BEGINNING = 0.1
"""Standard deviation of the first state about the measured one, in u0, u0/L, rad and 3 L (project choice): more than
the errors of a log, a gyro, a compass or an antenna position."""

CLOCK_SHARE = 0.5
"""Standard error of the time of the rudder's record, in sampling steps (project choice)."""

LARGEST_SHARE = 0.1
"""A group of coefficients is wrong together by no more than this share of their values (project choice)."""

PRICE = 10.0
"""-2 log of the prior odds of an effect, and so the decrease of the score from which it is more probable than not: odds
of exp(5) = 150 to 1, "very strong" by Kass and Raftery (1995), Bayes Factors, J. Am. Stat. Assoc. 90."""

BELIEVED = {"white": 0.5, "slow": 1.5, "slow_s": 0.7, "force": 2.5, "force_s": 0.7, "width": 0.7}
"""Standard deviation of the logarithm of each, prior to the trials (project choice): wide, for any
plausible noise."""


def likelihood_from_card(card: SteeredCard, measured: Measured) -> Likelihood:
    """The likelihood of trials for a card.

    Parameters
    ----------
    card : SteeredCard
    measured : Measured

    Raises
    ------
    InputError
        A trial is too short, or records neither velocities nor positions.
    """
    none = Hypothesis(card, measured.driven_by)
    ship_time = card.ship.length_m / card.model.speed_mps
    motion = with_executes(none, batch_trials(none.model, measured.trials, ship_time))
    free = coefficients_of_card(card)
    known = {name: error for name, (_, error) in free.items() if name in none.model.parameter_names}
    count = len(known)
    shared: list[NDArray[np.float64]] = []
    if card.steered_by is SteeredBy.RUDDER:
        known |= _gear_errors(card, none.model)
        known[CLOCK] = CLOCK_SHARE * max(sampling_step(trial) for trial in measured.trials)
        shared = _shared(tuple(known), known, free)
    each = np.diag(list(known.values()))
    mixing = np.column_stack([each[:, :count], *shared, each[:, count:]])
    length, speed = card.ship.length_m, card.model.speed_mps
    wide = BEGINNING * np.array([speed, speed, speed / length, 1.0, 3 * length, 3 * length])
    known_before = replace(belief(motion, ship_time), wide=np.maximum(wide, WIDE_PRIOR * motion.errors))
    nuisance = NuisanceParameters(tuple(known), mixing, count + len(shared))
    return Likelihood(motion, none, nuisance, known_before)


def coefficients_of_card(card: SteeredCard) -> dict[str, tuple[float, float]]:
    """Coefficients that explanations are fitted with: parameter to its value on the card and its standard error.

    Parameters
    ----------
    card : SteeredCard
        Of a craft, hull and thrust curves, and not the lags of its thrusters.
    """
    if card.steered_by is SteeredBy.RUDDER:
        return free_parameters(card.manoeuvring(), inertia=True)
    model = build(card)
    prior = craft_prior(card, model).items()
    return {name: known for name, known in prior if name in model and not name.endswith(".time_constant")}


def _group(name: str) -> str:
    """Name of the group of coefficients that came from the same tests, and may have a common error."""
    term = known_term(name)
    if term.acceleration:
        return "accelerations"
    if term.d:
        return "rudder"
    linear = term.v + term.r == 1 and not term.u
    return f"{term.force}, linear" if linear else term.force


def _shared(
    names: tuple[str, ...], errors: Mapping[str, float], free: Mapping[str, tuple[float, float]]
) -> list[NDArray[np.float64]]:
    """Errors that coefficients share: a group all too large or too small, each by its standard error."""
    columns: dict[str, NDArray[np.float64]] = {}
    for place, name in enumerate(names):
        value = free.get(name, (0.0, 0.0))[0]
        if name.startswith("derivatives.") and value:
            column = columns.setdefault(_group(name.partition(".")[2]), np.zeros(len(names)))
            column[place] = np.sign(value) * min(errors[name], LARGEST_SHARE * abs(value))
    return list(columns.values())


def _gear_errors(card: SteeredCard, model: Model) -> dict[str, float]:
    """Rate and time constant of the steering gear, as uncertain as a coefficient; one that was assumed far more so."""
    start = model.defaults
    stated = card.steering_gear is not None and card.steering_gear.time_constant_s is not None
    shares = {"steering.max_rate": GEAR, "steering.time_constant": GEAR if stated else ASSUMED_GEAR}
    return {name: share * start[name] for name, share in shares.items() if start.get(name)}


def with_executes(none: Hypothesis, motion: MeasuredBatch) -> MeasuredBatch:
    """The trials with those marked that begin at the execute: their first changes of yaw rate are nearer to those of a
    rudder that leaves amidships than of one that has settled at the first order."""
    if "rudder.angle" not in none.unmeasured:
        return motion
    yaw = MEASURED_STATES.index("motion.r")
    first = BLOCKS_PER_SHIP_TIME  # one L/u0
    measured = np.diff(motion.middles[:, : first + 1, yaw], axis=1) / motion.block_s

    def misfit(at_execute: bool) -> NDArray[np.float64]:
        marked = replace(motion, at_execute=np.full(len(motion.names), at_execute))
        rates = none.fine_rates(marked, np.zeros(0))[:, :first, yaw]
        found: NDArray[np.float64] = np.sum((measured - rates[:, : measured.shape[1]]) ** 2, axis=1)
        return found

    return replace(motion, at_execute=misfit(True) < misfit(False))


def belief(motion: MeasuredBatch, ship_time: float) -> Belief:
    """Prior of the noise."""
    accelerations = np.diff(motion.states[..., :3], axis=1) / motion.step_s
    size = np.sqrt(np.mean(accelerations**2, axis=(0, 1)))
    ny = len(motion.seen)
    noise = NoiseLevels(
        white=motion.noise,
        slow=SLOW_SHARE * motion.noise * np.sqrt(10.0),
        slow_s=np.full(ny, SLOW_TIME * ship_time),
        force=FORCE_SHARE * size,
        force_s=np.full(FORCE_STATES, FORCE_TIME * ship_time),
    )
    spread = np.repeat(list(BELIEVED.values())[:-1], [ny, ny, ny, FORCE_STATES, FORCE_STATES])
    return Belief(np.append(noise.logs, 0.0), np.append(spread, BELIEVED["width"]))


def candidate_explanations(card: SteeredCard, driven_by: str) -> tuple[str, ...]:
    """Effects that can be tried: those not on the card, with values to begin a search from.

    Not one with an input that an effect of the card has already: a steady current, on a card with one that changes.
    Where the rudder's angle was measured (`driven_by` is ``angle``), the record contains the response of the gear, and
    its effects are not tried.
    """
    have = {entry.name for entry in card.effects}
    taken = frozenset[str]().union(*(EFFECTS[name].input_names for name in have))
    chosen = []
    for name, effect in EFFECTS.items():
        inside = driven_by == "angle" and effect.inside_gear
        if effect.tried(card) and name not in have and not inside and not effect.input_names & taken:
            chosen.append(name)
    return tuple(chosen)
