"""Winds and currents of single trials: added to their records, and found from the replay of a trial held out."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from scipy.optimize import least_squares

from tank2sim.arrays import Array
from tank2sim.cards.card import ManoeuvringCard
from tank2sim.dynamics.effects import EFFECTS
from tank2sim.gap.proof.open_loop import InputRecord, Replayer, difference_slopes, input_record
from tank2sim.gap.result import Surroundings
from tank2sim.identification.trials.problem.prepare_trials import Measured
from tank2sim.identification.trials.problem.sampled_runs import OBSERVED_SIGNALS
from tank2sim.records.trials import Trial

ByTrial = Mapping[str, Mapping[str, Surroundings]]
"""Effect to the name of a trial to its wind or current."""

_TURNS = 15
"""Turns of initial state and surroundings, each at the last of the other, at most (project choice)."""

_SETTLED = 3e-3
"""A turn that moves the surroundings by less than this share of the typical speed is the last (project choice)."""

_DIRECTIONS, _SHARES = 8, (0.5, 1.0, 1.5)
"""Directions, and shares of the typical speed, at which a search for the surroundings of a trial begins, in addition to
none at all (project choice)."""

_FIRST_PART = 1 / 3
"""Share of a record that the surroundings are fitted to first (project choice): over its whole length a motion in the
wrong wind may turn the other way, and a search is then lost."""

_STEP = 1e-3
"""Differences are taken over this share of the typical speed (project choice: rounding and curvature are both far below
the noise)."""

_FAR = 1e4
"""Noise units in place of a motion out of bounds: further than any that is within."""


def with_surroundings(measured: Measured, found: ByTrial) -> Measured:
    """Trials with their winds and currents as if they had been recorded, constant over each trial."""
    return replace(measured, trials=tuple(_with(trial, found) for trial in measured.trials))


def _with(trial: Trial, found: ByTrial) -> Trial:
    signals = dict(trial.signals)
    for effect, by_trial in found.items():
        if trial.name in by_trial:
            names = EFFECTS[effect].measured_as
            signals[names["speed_mps"]] = np.full(len(trial.time_s), by_trial[trial.name].speed_mps)
            signals[names["direction_rad"]] = np.full(len(trial.time_s), by_trial[trial.name].direction_rad)
    return replace(trial, signals=signals)


def fit_surroundings(
    card: ManoeuvringCard, measured: Measured, effects: Sequence[str], noise: Mapping[str, float]
) -> dict[str, dict[str, Surroundings]]:
    """The winds and currents with which a card follows each trial best, free running with its recorded orders.

    Two numbers are taken from a trial for each effect. They are normal beforehand, about zero with the typical speed
    of the effect as standard deviation.

    Parameters
    ----------
    card : ManoeuvringCard
        With the effects, whose wind or current is an input of its model.
    measured : Measured
        The trials.
    effects : sequence of str
        Names of the effects.
    noise : mapping
        Variable to the standard deviation of one reading, SI; others are not compared.
    """
    found: dict[str, dict[str, Surroundings]] = {name: {} for name in effects}
    for trial in measured.trials:
        for name, surroundings in _of_trial(card, measured.driven_by, trial, effects, noise).items():
            found[name][trial.name] = surroundings
    return found


def _of_trial(
    card: ManoeuvringCard, driven_by: str, trial: Trial, effects: Sequence[str], noise: Mapping[str, float]
) -> dict[str, Surroundings]:
    replayer = Replayer(card, driven_by, [name for name in OBSERVED_SIGNALS.values() if name in noise])
    p, sigma = replayer.model.parameter_values(), np.array([noise[name] for name in replayer.seen])
    typical = np.repeat([_typical_speed(card, name) for name in effects], 2)

    def of(parts: Array) -> dict[str, Surroundings]:
        pairs = zip(effects, np.reshape(parts, (-1, 2)), strict=True)
        return {name: Surroundings.of_parts(pair, np.zeros(2)) for name, pair in pairs}

    def record_with(parts: Array) -> InputRecord:
        return input_record(replayer, _with(trial, {name: {trial.name: at} for name, at in of(parts).items()}))

    known = ~np.isnan(record_with(np.zeros(len(typical))).readings)
    state = replayer.guess_initial_state(record_with(np.zeros(len(typical))), sigma, p)

    def residuals(parts: Array) -> Array:
        record = record_with(parts)
        away = ((replayer.motion(record, state, p) - record.readings) / sigma)[compared]
        return np.concatenate([np.nan_to_num(away, nan=_FAR), parts / typical])

    def slopes(parts: Array) -> Array:
        return difference_slopes(residuals, parts, residuals(parts), _STEP * typical)

    angles = 2 * np.pi * np.arange(_DIRECTIONS) / _DIRECTIONS
    around = [
        share * np.tile([np.cos(angle), np.sin(angle)], len(effects)) * typical for angle in angles for share in _SHARES
    ]
    compared = known & (np.arange(len(known)) < max(_FIRST_PART * len(known), 1))[:, None]
    at = min([np.zeros(len(typical)), *around], key=lambda parts: float(np.sum(residuals(parts) ** 2)))
    at = least_squares(residuals, at, slopes, x_scale=typical).x
    compared = known
    for _ in range(_TURNS):
        solved = least_squares(residuals, at, slopes, x_scale=typical)
        moved, at = float(np.max(np.abs(solved.x - at) / typical)), solved.x
        state = replayer.fit_initial_state(record_with(at), sigma, p)
        if moved < _SETTLED:
            break
    size = max(float(np.mean(residuals(at) ** 2)), 1.0)
    errors = np.sqrt(np.diag(np.linalg.inv(solved.jac.T @ solved.jac)) * size)
    pairs = zip(effects, at.reshape(-1, 2), errors.reshape(-1, 2), strict=True)
    return {name: Surroundings.of_parts(part, error) for name, part, error in pairs}


def _typical_speed(card: ManoeuvringCard, name: str) -> float:
    (speed,) = (parameter for parameter in EFFECTS[name].parameters if parameter.name == "speed_mps")
    return max(map(abs, speed.typical_values(card)))
