"""Winds and currents of single trials: added to their records, and found from the replay of a trial held out."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import casadi as ca
import numpy as np
from scipy.optimize import OptimizeResult, least_squares

from tank2sim.arrays import Array
from tank2sim.cards.card import ManoeuvringCard
from tank2sim.dynamics.effects import EFFECTS
from tank2sim.dynamics.model import Model, Quantity, State
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

_CONVERGED = 1e-3
"""Share by which a step lowers the sum of squares of all trials together when it is the last (project choice: initial
states are found again after it)."""

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
    trials = [_Trial(card, measured.driven_by, trial, effects, noise) for trial in measured.trials]
    if not trials:
        return found
    known = trials[0].replayer
    model = _with_parts_as_states(known.model, effects, trials[0].typical)
    replayer = Replayer(card, measured.driven_by, known.seen, model)
    for trial in trials:
        for name, surroundings in _of_trial(card, trial, replayer, effects).items():
            found[name][trial.name] = surroundings
    return found


@dataclass(frozen=True, eq=False)
class CommonSurroundings:
    """A wind or current that acts in all trials, in each with a speed and direction of its own, found by simulation.

    Parameters
    ----------
    effect : str
        Its name.
    values, errors : mapping
        Coefficients of its forces, which hold in all trials, by the names of the parameters, SI, with standard errors.
    by_trial : mapping
        Name of each trial to its wind or current.
    predicted : array (trials,)
        Root mean square of simulated less measured over the second half of each trial, with the wind or current fitted
        to the first half, over that without any.
    """

    effect: str
    values: Mapping[str, float]
    errors: Mapping[str, float]
    by_trial: Mapping[str, Surroundings]
    predicted: Array


def fit_common_surroundings(
    card: ManoeuvringCard, measured: Measured, effect: str, noise: Mapping[str, float]
) -> CommonSurroundings | None:
    """One effect of the surroundings with the coefficients of its forces, which are the same in all trials.

    None where, with the usual coefficients, what is fitted to the first half of a trial makes the second half worse in
    most of them: that would not be a wind or current.

    By least squares of the free-running simulations of all trials together. A trial weighs as many independent
    readings as its errors hold, in units of their own size; the coefficients are normal beforehand with the spreads of
    the effect.

    Parameters
    ----------
    card : ManoeuvringCard
        With the effect, whose wind or current is an input of its model.
    measured : Measured
        The trials.
    effect : str
        Its name.
    noise : mapping
        Variable to the standard deviation of one reading, SI; others are not compared.
    """
    shared = [one for one in EFFECTS[effect].parameters if one.spread_value(card)]
    names = [one.name for one in shared]
    keys = [EFFECTS[effect].model_names()[name] for name in names]
    centre = np.array([one.value({}, card) for one in shared])
    spread = np.array([one.spread_value(card) for one in shared])
    trials = [_Trial(card, measured.driven_by, trial, (effect,), noise) for trial in measured.trials]
    model, typical = trials[0].replayer.model, _typical_speed(card, effect)
    scale = np.concatenate([spread, np.full(2 * len(trials), typical)])
    anywhere = np.full(2 * len(trials), np.inf)
    low = np.concatenate([[one.lowest(card) for one in shared], -anywhere])
    high = np.concatenate([[one.maximum for one in shared], anywhere])

    def parameters(at: Array) -> Array:
        return model.parameter_values(dict(zip(keys, map(float, at[: len(names)]), strict=True)))

    def parts(at: Array, place: int) -> Array:
        return at[len(names) + 2 * place :][:2]

    def predicted(at: Array) -> Array:
        p, absent = parameters(at), parameters(np.array(gone))
        return np.array([trial.predicted(parts(at, place), p, absent) for place, trial in enumerate(trials)])

    gone = [value if one.absent is None else one.absent for one, value in zip(shared, centre, strict=True)]
    at = np.concatenate([centre, *(trial.parts(parameters(centre)) for trial in trials)])
    if np.median(predicted(at)) >= 1:
        return None
    weights = np.ones(len(trials))

    def residuals(at: Array) -> Array:
        p = parameters(at)
        away = [
            w * trial.away(parts(at, place), p) for place, (trial, w) in enumerate(zip(trials, weights, strict=True))
        ]
        return np.concatenate([*away, (at[: len(names)] - centre) / spread])

    def slopes(at: Array) -> Array:
        p, begin = parameters(at), len(names)
        blocks = np.zeros((sum(trial.count for trial in trials) + begin, len(at)))
        row = 0
        for place, (trial, weight) in enumerate(zip(trials, weights, strict=True)):
            rows = slice(row, row + trial.count)
            now, own = trial.away(parts(at, place), p), slice(begin + 2 * place, begin + 2 * place + 2)
            blocks[rows, own] = weight * trial.slopes(parts(at, place), p, now)
            for column in range(begin):
                moved = at.copy()
                moved[column] += _STEP * spread[column]
                change = trial.away(parts(at, place), parameters(moved)) - now
                blocks[rows, column] = weight * change / (_STEP * spread[column])
            row += trial.count
        blocks[row:, :begin] = np.diag(1 / spread)
        return blocks

    for _ in range(_TURNS):
        p = parameters(at)
        weights = np.array([trial.weight(parts(at, place), p) for place, trial in enumerate(trials)])
        solved = least_squares(residuals, at, slopes, bounds=(low, high), x_scale=scale, ftol=_CONVERGED)
        moved, at = float(np.max(np.abs(solved.x - at) / scale)), solved.x
        for place, trial in enumerate(trials):
            trial.begin(parts(at, place), parameters(at))
        if moved < _SETTLED:
            break
    errors = np.sqrt(np.diag(np.linalg.pinv(solved.jac.T @ solved.jac)))
    return CommonSurroundings(
        effect,
        dict(zip(names, map(float, at), strict=False)),
        dict(zip(names, map(float, errors), strict=False)),
        {
            trial.name: Surroundings.of_parts(parts(at, place), parts(errors, place))
            for place, trial in enumerate(trials)
        },
        predicted(at),
    )


class _Trial:
    """One trial, replayed in winds and currents: parts (2 m,) along north and east, m/s, of m effects."""

    def __init__(
        self,
        card: ManoeuvringCard,
        driven_by: str,
        trial: Trial,
        effects: Sequence[str],
        noise: Mapping[str, float],
    ):
        self.name, self._effects = trial.name, effects
        self.replayer = Replayer(card, driven_by, [name for name in OBSERVED_SIGNALS.values() if name in noise])
        self.sigma = np.array([noise[name] for name in self.replayer.seen])
        self.typical = np.repeat([_typical_speed(card, name) for name in effects], 2)
        names = self.replayer.model.input_names
        self._places = [
            tuple(names.index(EFFECTS[name].model_names()[key]) for key in ("speed_mps", "direction_rad"))
            for name in effects
        ]
        still = self.still = input_record(self.replayer, _with(trial, self._in_trial(np.zeros(len(self.typical)))))
        self._known = ~np.isnan(still.readings)
        self.passage = card.ship.length_m / card.model.speed_mps / (still.step_s * still.every)
        self._state = self.replayer.guess_initial_state(still, self.sigma, self.replayer.model.parameter_values())
        self.compare(1.0)

    def compare(self, begin: float, end: float | None = None) -> None:
        """Compare readings up to a share `begin` of the record, or from there to `end`."""
        share = np.arange(len(self._known)) / len(self._known)
        inside = share < begin if end is None else (share >= begin) & (share < end)
        inside[0] |= not inside.any()
        self._compared = self._known & inside[:, None]
        self.count = int(self._compared.sum())

    def surroundings(self, parts: Array) -> dict[str, Surroundings]:
        """Each effect's wind or current."""
        pairs = zip(self._effects, np.reshape(parts, (-1, 2)), strict=True)
        return {name: Surroundings.of_parts(pair, np.zeros(2)) for name, pair in pairs}

    def _in_trial(self, parts: Array) -> ByTrial:
        return {name: {self.name: at} for name, at in self.surroundings(parts).items()}

    def _record(self, parts: Array) -> InputRecord:
        inputs = self.still.inputs.copy()
        for places, pair in zip(self._places, np.reshape(parts, (-1, 2)), strict=True):
            inputs[:, places] = np.hypot(*pair), np.arctan2(pair[1], pair[0])
        return replace(self.still, inputs=inputs)

    def away(self, parts: Array, p: Array) -> Array:
        """Simulated less measured (count,), noise units."""
        record = self._record(parts)
        away = ((self.replayer.motion(record, self._state, p) - record.readings) / self.sigma)[self._compared]
        bounded: Array = np.nan_to_num(away, nan=_FAR)
        return bounded

    def slopes(self, parts: Array, p: Array, now: Array) -> Array:
        """Derivatives (count, 2 m) of ``away(parts, p) = now`` in the parts."""
        return difference_slopes(lambda moved: self.away(moved, p), parts, now, _STEP * self.typical)

    def begin(self, parts: Array, p: Array) -> None:
        """Find the initial state again, in these surroundings."""
        self._state = self.replayer.fit_initial_state(self._record(parts), self.sigma, p, self._state)

    def parts(self, p: Array) -> Array:
        """The parts that fit the compared readings best, from a search over directions and speeds: first over the
        beginning of the record."""
        self.compare(_FIRST_PART)
        angles = 2 * np.pi * np.arange(_DIRECTIONS) / _DIRECTIONS
        ring = [
            share * np.tile([np.cos(angle), np.sin(angle)], len(self._effects)) * self.typical
            for angle in angles
            for share in _SHARES
        ]
        at = min([np.zeros(len(self.typical)), *ring], key=lambda parts: float(np.sum(self._pulled(parts, p) ** 2)))
        nearest: Array = self.nearest(at, p).x
        self.compare(1.0)
        return nearest

    def nearest(self, at: Array, p: Array) -> OptimizeResult:
        """Least squares from `at`, the parts normal beforehand about zero."""

        def slopes(parts: Array) -> Array:
            return np.concatenate([self.slopes(parts, p, self.away(parts, p)), np.diag(1 / self.typical)])

        return least_squares(lambda parts: self._pulled(parts, p), at, slopes, x_scale=self.typical)

    def _pulled(self, parts: Array, p: Array) -> Array:
        return np.concatenate([self.away(parts, p), parts / self.typical])

    def weight(self, parts: Array, p: Array) -> float:
        """Weight of a reading: the errors of its trial are of one size, and independent once in a passage of L/u0."""
        size = max(float(np.sqrt(np.mean(self.away(parts, p) ** 2))), 1.0)
        independent = max(len(self._known) / self.passage, 1.0)
        return math.sqrt(min(independent / self.count, 1.0)) / size

    def predicted(self, parts: Array, p: Array, absent: Array) -> float:
        """Root mean square of :meth:`away` over the second half of the record with the surroundings of the first half,
        over that in none, where the model has the parameters `absent`."""
        self.compare(0.5)
        first = self.nearest(parts, p).x
        self.compare(0.5, 1.0)
        left = float(np.sum(self.away(first, p) ** 2))
        none, kept = np.zeros(len(self.typical)), self._state
        self.begin(none, absent)
        without = float(np.sum(self.away(none, absent) ** 2))
        self._state = kept
        self.compare(1.0)
        return math.sqrt(left / without) if without > 0 else 1.0


def _of_trial(
    card: ManoeuvringCard, trial: _Trial, replayer: Replayer, effects: Sequence[str]
) -> dict[str, Surroundings]:
    """Together with the initial state and the instants of the orders: a heading that is a little off moves the track
    as a current across it does.

    Their errors are those of readings that are independent once in a passage of L/u0, and of the coefficients of the
    forces, which are taken as independent: a force that is too small asks for more wind.
    """
    model = replayer.model
    p, record, sigma = model.parameter_values(), trial.still, trial.sigma
    near = replayer.guess_initial_state(record, sigma, p)
    near[-len(trial.typical) :] = trial.parts(trial.replayer.model.parameter_values())
    record, start = replayer.fit_record(record, sigma, p, near)
    parts, known = start[-len(trial.typical) :], ~np.isnan(record.readings)

    def away(start: Array, p: Array = p) -> Array:
        residual: Array = ((replayer.motion(record, start, p) - record.readings) / sigma)[known]
        return residual

    nominal = np.array([state.nominal for state in model.states])
    slopes = difference_slopes(away, start, away(start), _STEP * nominal) * nominal
    covariance = np.linalg.inv(slopes.T @ slopes + np.eye(len(start)))  # in nominal sizes, their spread beforehand
    size = max(float(np.mean(away(start) ** 2)), 1.0) * max(trial.passage, 1.0)
    by_errors = -covariance @ slopes.T @ _slopes_in_errors(card, effects, model, away, start)
    variances = size * np.diag(covariance) + np.sum(by_errors**2, axis=1)
    errors = (np.sqrt(variances) * nominal)[-len(parts) :]
    pairs = zip(effects, parts.reshape(-1, 2), errors.reshape(-1, 2), strict=True)
    return {name: Surroundings.of_parts(part, error) for name, part, error in pairs}


def _slopes_in_errors(
    card: ManoeuvringCard,
    effects: Sequence[str],
    model: Model,
    away: Callable[[Array, Array], Array],
    start: Array,
) -> Array:
    """Change of `away` (count, k) by one standard error of each of the k coefficients of the effects' forces."""
    p = model.parameter_values()
    now, values = away(start, p), dict(zip(model.parameter_names, p, strict=True))
    columns = [np.zeros((len(now), 0))]
    for entry in (entry for entry in card.effects if entry.name in effects):
        names = EFFECTS[entry.name].model_names()
        for key, error in entry.uncertainty.items():
            if names.get(key) in values:
                moved = model.parameter_values({names[key]: values[names[key]] + error})
                columns.append(np.nan_to_num(away(start, moved) - now)[:, None])
    return np.concatenate(columns, axis=1)


def _with_parts_as_states(model: Model, effects: Sequence[str], typical: Array) -> Model:
    """The model with the parts (2 m,) along north and east of each of m winds or currents as its last states, which
    never change and begin at 0, with their `typical` sizes; its inputs of them act on nothing."""
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


def _typical_speed(card: ManoeuvringCard, name: str) -> float:
    (speed,) = (parameter for parameter in EFFECTS[name].parameters if parameter.name == "speed_mps")
    return max(map(abs, speed.typical_values(card)))
