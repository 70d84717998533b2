"""Winds and currents of single trials: added to their records, and found from the replay of a trial held out."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import casadi as ca
import numpy as np

from tank2sim.arrays import Array
from tank2sim.cards.card import SteeredCard
from tank2sim.dynamics.effects import EFFECTS
from tank2sim.dynamics.model import Model, Quantity, State
from tank2sim.gap.proof.open_loop import Replayer, difference_slopes
from tank2sim.gap.proof.surrounded_trial import STEP_SHARE, ByTrial, SurroundedTrial, with_columns
from tank2sim.gap.result import Surroundings
from tank2sim.identification.trials.problem.prepare_trials import Measured


def with_surroundings(measured: Measured, found: ByTrial) -> Measured:
    """Trials with their winds and currents as if they had been recorded, constant over each trial."""
    return replace(measured, trials=tuple(with_columns(trial, found) for trial in measured.trials))


def fit_surroundings(
    card: SteeredCard, measured: Measured, effects: Sequence[str], noise: Mapping[str, float]
) -> dict[str, dict[str, Surroundings]]:
    """The winds and currents with which a card follows each trial best, free running with its recorded orders.

    Two numbers are taken from a trial for each effect. They are normal beforehand, about zero with the typical speed
    of the effect as standard deviation.

    Parameters
    ----------
    card : SteeredCard
        With the effects, whose wind or current is an input of its model.
    measured : Measured
        The trials.
    effects : sequence of str
        Names of the effects.
    noise : mapping
        Variable to the standard deviation of one reading, SI; others are not compared.
    """
    found: dict[str, dict[str, Surroundings]] = {name: {} for name in effects}
    trials = [SurroundedTrial(card, measured.driven_by, trial, effects, noise) for trial in measured.trials]
    if not trials:
        return found
    model = _with_parts_as_states(trials[0].replayer.model, effects, trials[0].typical)
    replayer = Replayer(card, measured.driven_by, noise, model)
    for trial in trials:
        for name, surroundings in _of_trial(card, trial, replayer, effects).items():
            found[name][trial.name] = surroundings
    return found


def _of_trial(
    card: SteeredCard, trial: SurroundedTrial, replayer: Replayer, effects: Sequence[str]
) -> dict[str, Surroundings]:
    """Together with the initial state and the instants of the orders: a heading that is a little off moves the track
    as a current across it does.

    Their errors are those of readings that are independent once in a passage of L/u0, and of the coefficients of the
    forces, which are taken as independent: a force that is too small asks for more wind.
    """
    model = replayer.model
    p, record = model.parameter_values(), trial.still
    near = replayer.guess_initial_state(record, p)
    near[-len(trial.typical) :] = trial.parts(trial.replayer.model.parameter_values())
    record, start = replayer.fit_record(record, p, near)
    parts = start[-len(trial.typical) :]

    def away(start: Array, p: Array = p) -> Array:
        return replayer.away(record, start, p)

    nominal = np.array([state.nominal for state in model.states])
    slopes = difference_slopes(away, start, away(start), STEP_SHARE * nominal) * nominal
    covariance = np.linalg.inv(slopes.T @ slopes + np.eye(len(start)))  # in nominal sizes, their spread beforehand
    size = max(float(np.mean(away(start) ** 2)), 1.0) * max(trial.passage, 1.0)
    by_errors = -covariance @ slopes.T @ _slopes_in_errors(card, effects, model, away, start)
    variances = size * np.diag(covariance) + np.sum(by_errors**2, axis=1)
    errors = (np.sqrt(variances) * nominal)[-len(parts) :]
    pairs = zip(effects, parts.reshape(-1, 2), errors.reshape(-1, 2), strict=True)
    return {name: Surroundings.of_parts(part, error) for name, part, error in pairs}


def _slopes_in_errors(
    card: SteeredCard,
    effects: Sequence[str],
    model: Model,
    away: Callable[[Array, Array], Array],
    start: Array,
) -> Array:
    """Change of `away` (count, k) by one standard error of each of the k coefficients of the effects' forces."""
    p = model.parameter_values()
    now, values = away(start, p), model.defaults
    columns = [np.zeros((len(now), 0))]
    for entry in (entry for entry in card.effects if entry.name in effects):
        names = EFFECTS[entry.name].model_names()
        for key, error in entry.uncertainty.items():
            if names.get(key) in values:
                moved = model.parameter_values({names[key]: values[names[key]] + error})
                columns.append(np.nan_to_num(away(start, moved) - now)[:, None])
    return np.concatenate(columns, axis=1)


def _with_parts_as_states(model: Model, effects: Sequence[str], typical: Array) -> Model:
    """The model with the parts (2 m,) north and east of m winds or currents as its last, constant states."""
    values: dict[str, ca.SX] = {}
    for effect, speed in zip(effects, typical[::2], strict=True):
        names = EFFECTS[effect].model_names()
        key, speed_name = names["speed_mps"].rpartition(".")[0], names["speed_mps"]
        rates = [
            Quantity(name=f"{key}.{axis}_rate", unit="m/s2", description=f"Rate of {key}.{axis}", value=ca.SX(0))
            for axis in ("north", "east")
        ]
        parts = [
            State(
                name=f"{key}.{axis}",
                unit=model[speed_name].unit,
                description=f"Part along {axis}",
                nominal=float(speed),
                derivative=rate.name,
                start=0.0,
            )
            for axis, rate in zip(("north", "east"), rates, strict=True)
        ]
        north, east = (part.symbol for part in parts)
        model = model.extend(*rates, *parts)
        values |= {speed_name: ca.hypot(north, east), names["direction_rad"]: ca.atan2(east, north)}
    return model.substitute_all(values)
