"""A card's model run freely under recorded inputs, from the initial state that suits the record best."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import casadi as ca
import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from tank2sim.arrays import Array
from tank2sim.cards.card import SteeredCard
from tank2sim.dynamics.effects import EFFECTS
from tank2sim.dynamics.model import Model
from tank2sim.identification.trials.methods.gauss_newton import least_squares_steps
from tank2sim.identification.trials.problem.estimation_problem import driven_model
from tank2sim.records.trials import ROWS_TO_SHOW_AN_ORDER, Trial, order_instants, rows_in
from tank2sim.simulation.motion_record import OBSERVED_SIGNALS, motion_record, refuse_without_motion
from tank2sim.simulation.rows import Chain, RowFunction
from tank2sim.simulation.scheme import step_and_constants
from tank2sim.simulation.sensitivity import Sensitivity

INSTANTS = 40
"""Instants in L/u0 at which simulated and measured are compared (project choice: the fastest motion lasts a tenth of
L/u0)."""

COARSEST = 2.5
"""Integration steps of up to this many of the model's own: RK4 then errs by less than 1e-3 of a gear's motion in one
step, (1/2)^5/120, far below any noise."""

_FAR = 1e6
"""A motion with a state beyond this many of its nominal sizes is out of bounds."""

FIRST = 0.25
"""The initial state is read off the first quarter of L/u0 (project choice: a ship's motion hardly changes in it)."""

TRUST = 2.0
"""That reading is trusted to this many of its standard errors, as the motion is not quite straight (project choice)."""

ASTERN = 0.2
"""Standard deviation of an initial speed that was not measured, as a share of the nominal one (project choice)."""


@dataclass(frozen=True, eq=False)
class InputRecord:
    """A trial on its own rows, thinned to :data:`COARSEST` steps of the model."""

    name: str  # Name of the trial
    time_s: Array  # (n,): Times of the rows, s, in the trial's own time, however uneven
    # (n, nu): Inputs from each row to the next: means of measured inputs, and the order that the row shows. The mean
    # of two orders was never ordered, and a gear at its largest rate responds differently to it.
    inputs: Array
    compared: NDArray[np.intp]  # (m,): Rows at which simulated and measured are compared
    readings: Array  # (m, ny): Single readings at those rows; nan where there is none
    late_s: float = 0.0  # Delay of the order by the card, s
    # (n,): Share of the interval before each row at which the order of the row was given; without it, half.
    instants: Array | None = None

    @property
    def times(self) -> Array:
        """Compared times (m,), s."""
        return self.time_s[self.compared]

    @property
    def known(self) -> NDArray[np.bool_]:
        """Mask of the readings (m, ny) that were measured."""
        return ~np.isnan(self.readings)

    @property
    def given_s(self) -> Array:
        """Time (n,), s, from which the order of each row holds; the first order holds from the beginning."""
        shares = ROWS_TO_SHOW_AN_ORDER if self.instants is None else self.instants[1:]
        given = order_instants(self.time_s, shares) + self.late_s
        given[0] = -np.inf
        return np.maximum.accumulate(given)


_FEWEST_ROWS = 10
"""Rows of a record at least (project choice: a state of six and a noise are found from them)."""

_LEAST_RUDDER = math.radians(1.0)
"""A first order below this is not an execute (project choice)."""

_ROUNDS = 15
"""Gauss-Newton steps, and updates of the weights of signals, at most; both converge in two to four, of an unstable ship
that begins far away in ten."""

_NEAR = 2.0
"""A model that follows a record to within this many times the noise is taken as right when its initial state is sought
(project choice): the remaining misfit is too small to bias it much."""

_ORDER = "rudder.command"

_UNSURE_FROM = 0.004
"""Interval between two readings of the order, in L/u0, from which the instants of its steps are estimated (project
choice: of zigzags read to 0.05 deg of heading, 0.005 is seen)."""

_STEP_OF_ORDER = math.radians(1.0)
"""Smallest step of an order whose instant is estimated (project choice: the smallest of a helmsman)."""

_ALONE = 0.1
"""Changes of the order right before and after a step, as a share of it, up to which it is a step and not part of a
course keeper's changing order (project choice)."""

_MOST_STEPS = 40
"""Steps of the order in a trial, at most, whose instants are estimated: more are a course keeper's."""

_EXPLAINED = 0.5
"""Share of the misfit below which instants of orders explain it although the rest is not near the noise (project
choice)."""

_FOLLOWED = 50 * _NEAR
"""Misfit in noise units beyond which a model is wrong, and instants of orders do not explain what it misses, unless it
is near the noise with them (project choice)."""

_BEGUN = 5 * _NEAR
"""Misfit in noise units of the beginning of a record beyond which its instants do not bring such a model near the noise
(project choice)."""

_SETTLED = 0.02
"""A step below this share of the trust in the first reading ends the search."""


class Replayer:
    """A card's model ready to be run under recorded inputs, in machine code.

    Readings of sensors are compared: ``sensor.psi`` where the model has it (a sensor at fault), else
    ``motion.psi``, under the name ``motion.psi``.

    Parameters
    ----------
    card : SteeredCard
        Its effects' inputs (a current's speed) keep the values of the card unless the trial measured them.
    driven_by : str
        ``angle`` or ``order``.
    noise : mapping
        Variable (``motion.*``) to the standard deviation of one reading, SI. The ny variables among them that the model
        has are compared: `seen`, with the noise `sigma` (ny,).
    model : Model, optional
        In place of the card's: with more states whose initial values are to be found.
    """

    def __init__(self, card: SteeredCard, driven_by: str, noise: Mapping[str, float], model: Model | None = None):
        self.card = card
        self.model = driven_model(card, driven_by) if model is None else model
        self.seen = tuple(name for name in OBSERVED_SIGNALS.values() if name in noise and name in self.model)
        self.sigma = np.array([noise[name] for name in self.seen])
        step, constants = step_and_constants(self.model)
        self._steps, self._constants = Chain(step), constants
        self._shown = shown_by(self.model, self.seen)
        self._prepared: tuple[InputRecord, tuple[Array, Array, NDArray[np.intp]]] | None = None
        ordered = driven_by == "order" and _ORDER in self.model.input_names
        self._order = self.model.input_names.index(_ORDER) if ordered else None
        self.passage_s = card.ship.length_m / card.model.speed_mps
        self.nominal = np.array([state.nominal for state in self.model.states])

    def states(self, record: InputRecord, start: Array, p: Array) -> Array:
        """States (n, nx) at the rows of a record, from the state `start` at the first; nan once out of bounds."""
        lengths, inputs, places = self._integration_steps(record)
        with np.errstate(all="ignore"):
            states: Array = self._between(start, lengths, inputs, p)[places]
            lost = ~(np.abs(states) < _FAR * self.nominal).all(axis=1)
        if lost.any():
            states[int(np.argmax(lost)) :] = np.nan
        return states

    def _between(self, start: Array, lengths: Array, inputs: Array, p: Array) -> Array:
        """States (k + 1, nx) at the ends of integration steps."""
        return self._steps.run(start, inputs, p, np.array(self._constants(p)).ravel(), lengths[:, None])

    def _sensitivity(self, free: tuple[str, ...]) -> Sensitivity:
        return Sensitivity(self.model, free, _sensors(self.model, self.seen))

    def _integration_steps(self, record: InputRecord) -> tuple[Array, Array, NDArray[np.intp]]:
        """The integration steps of a record, kept for its next motion."""
        if self._prepared is None or self._prepared[0] is not record:
            self._prepared = record, self._steps_between(record)
        return self._prepared[1]

    def _steps_between(self, record: InputRecord) -> tuple[Array, Array, NDArray[np.intp]]:
        """Lengths (k,), s, and inputs (k, nu) of the integration steps, and the places (n,) of the record's rows.

        A step ends where an order is given, on average half an interval before the first row that shows it: a gear at
        its largest rate takes no notice of the mean of two orders.
        """
        time, spans = record.time_s, np.diff(record.time_s)
        parts = np.maximum(1, np.ceil(spans / (COARSEST * self.model.step_s) - 1e-9)).astype(np.intp)
        first = np.cumsum(parts) - parts
        share = (np.arange(parts.sum()) - np.repeat(first, parts)) / np.repeat(parts, parts)
        edges = np.append(np.repeat(time[:-1], parts) + share * np.repeat(spans, parts), time[-1])
        if self._order is None:
            return np.diff(edges), np.repeat(record.inputs[:-1], parts, axis=0), np.append(first, parts.sum())
        given, order = record.given_s, record.inputs[:, self._order]
        moves = given[1:][np.diff(order) != 0]
        edges = np.union1d(edges, moves[(moves > time[0]) & (moves < time[-1])])
        inputs = record.inputs[np.searchsorted(time, edges[:-1], side="right") - 1]
        inputs[:, self._order] = order[np.searchsorted(given, edges[:-1], side="right") - 1]
        return np.diff(edges), inputs, np.searchsorted(edges, time)

    def motion(self, record: InputRecord, start: Array, p: Array) -> Array:
        """Readings of the sensors (m, ny) at the compared rows of a record."""
        return self._readings(record, self.states(record, start, p), p)

    def _readings(self, record: InputRecord, states: Array, p: Array) -> Array:
        return self._shown(states[record.compared], record.inputs[record.compared], p)[0]

    def away(self, record: InputRecord, start: Array, p: Array) -> Array:
        """Simulated less measured (count,) in noise units, where something was measured; nan once out of bounds."""
        away: Array = ((self.motion(record, start, p) - record.readings) / self.sigma)[record.known]
        return away

    def fit_record(self, record: InputRecord, p: Array, near: Array | None = None) -> tuple[InputRecord, Array]:
        """The record with the instants at which its orders were given, and its initial state, that fit it best.

        An order that was sampled once or twice a second was given at an unknown instant between two readings. These
        instants are estimated together with the initial state, each beforehand uniform over its interval (with the
        variance of that, 1/12). The same search, without instants, finds an initial state from which an unstable ship
        follows a record that the first guess loses. With a model that is further off than they explain, as
        :meth:`fit_initial_state`.
        """
        start, misfit = self._least_squares_start(record, p, near, wrong=False)
        rows = self._unsure_steps(record)
        if len(rows) or misfit >= _NEAR:
            most, explained = (np.inf, _EXPLAINED) if misfit < _FOLLOWED else (_BEGUN, 0.0)
            found = self._least_squares_instants(record, rows, p, near, most)
            if found is not None and found[2] < max(min(_NEAR, misfit), explained * misfit):
                return found[:2]
        return record, start if misfit < _NEAR else self._least_squares_start(record, p, near, wrong=True)[0]

    def _unsure_steps(self, record: InputRecord) -> NDArray[np.intp]:
        """Rows (m,) at which a step of the order is seen first that was given at an unknown instant before."""
        none: NDArray[np.intp] = np.zeros(0, dtype=np.intp)
        if self._order is None:
            return none
        change = np.abs(np.diff(record.inputs[:, self._order]))
        others = np.maximum(np.append(change[1:], 0.0), np.append(0.0, change[:-1]))
        unsure = np.diff(record.time_s) > _UNSURE_FROM * self.passage_s
        rows = np.flatnonzero(unsure & (change > _STEP_OF_ORDER) & (others < _ALONE * change)) + 1
        return rows if len(rows) <= _MOST_STEPS else none

    def _least_squares_instants(
        self, record: InputRecord, rows: NDArray[np.intp], p: Array, near: Array | None, most: float
    ) -> tuple[InputRecord, Array, float] | None:
        """The record with the instants of the steps at `rows`, the initial state, and their misfit.

        By least squares on the beginning of the record, then on twice as many steps, and so on: a small error at an
        early step of an unstable ship is a large one later, where the motion is not nearly linear in it. None where a
        beginning is missed by more than `most`, or a motion exceeds all bounds.
        """
        first = first_state(self, record, p)
        size, remaining = len(first[0]), math.inf
        unknown = np.append(first[0] if near is None else near, np.full(len(rows), 0.5))
        steps = [2**power for power in range(len(rows).bit_length()) if 2**power < len(rows)]
        for count in [*steps, len(rows)]:
            part = _beginning_of(record, int(rows[count]) if count < len(rows) else len(record.time_s))
            found = self._fit_instants(part, rows[:count], unknown[: size + count], first, p)
            if found is None or not found[1] < most:
                return None
            unknown[: size + count], remaining = found
        return self._given_at(record, rows, unknown[size:]), unknown[:size], remaining

    def _fit_instants(
        self, record: InputRecord, rows: NDArray[np.intp], begin: Array, first: tuple[Array, Array], p: Array
    ) -> tuple[Array, float] | None:
        """Initial state and instants of the steps at `rows` (nx + m,), from `begin`, and their misfit.

        `first` is the state of the first seconds with its spread. None where the first motion exceeds all bounds.
        """
        (guess, spread), size, count = first, len(first[0]), len(rows)

        def misfit(values: Array) -> Array:
            begun, shares = values[:size], values[size:]
            away = self.away(self._given_at(record, rows, shares), begun, p)
            return np.concatenate([away, (begun - guess) / spread, (shares - 0.5) * math.sqrt(12.0)])

        def slopes(values: Array) -> Array:
            begun, shares = values[:size], values[size:]
            by_value = self.slopes_of_motion(self._given_at(record, rows, shares), begun, p, rows)
            of_prior = np.diag(np.append(1 / spread, np.full(count, math.sqrt(12.0))))
            return np.concatenate([(by_value / self.sigma[:, None])[record.known], of_prior])

        if not np.isfinite(misfit(begin)).all():
            return None
        low, high = np.full(size + count, -np.inf), np.full(size + count, np.inf)
        low[size:], high[size:] = 0.0, 1.0
        scale = np.append(spread, np.full(count, 0.3))
        found = least_squares(misfit, begin, slopes, bounds=(low, high), x_scale=scale, ftol=1e-2, max_nfev=_ROUNDS)
        return found.x, float(np.sqrt(np.mean(found.fun[: int(record.known.sum())] ** 2)))

    def slopes_of_motion(
        self,
        record: InputRecord,
        start: Array,
        p: Array,
        rows: NDArray[np.intp] | None = None,
        free: tuple[str, ...] = (),
    ) -> Array:
        """Derivatives (m, ny, nx + len(rows) + len(free)) of the compared readings in the initial state, in the
        instants of the steps of the order at `rows`, and in parameters of the model that no sensor shows by itself; a
        motion that exceeds all bounds counts as one without change.

        An order that is given later by dt keeps the rates before it for so long: the state behind changes by the
        difference of the rates, times dt.
        """
        rows = np.zeros(0, dtype=np.intp) if rows is None else rows
        lengths, inputs, places = self._integration_steps(record)
        sensitivity, nx, steps = self._sensitivity(free), len(start), len(start) + len(rows)
        with np.errstate(all="ignore"):
            states = self._between(start, lengths, inputs, p)
            tangents = sensitivity.tangents(states[:-1], inputs, p, lengths)
            by = np.zeros((len(states), nx, steps + len(free)))
            by[0, :, :nx] = np.eye(nx)
            by[1:, :, steps:] = tangents[:, :, nx:]
            instants = record.time_s[0] + np.append(0.0, np.cumsum(lengths))
            given, spans = record.given_s[rows], np.diff(record.time_s)[rows - 1]
            at = np.clip(np.searchsorted(instants, given - 1e-9 * spans), 1, len(inputs) - 1)
            before, after = (sensitivity.rates(states[at], inputs[then], p) for then in (at - 1, at))
            by[at, :, np.arange(nx, steps)] = (before - after) * spans[:, None]
            sensitivity.propagate(by, tangents)
            compared = places[record.compared]
            seen = sensitivity.shown_by_states(states[compared], record.inputs[record.compared], p)
            slopes: Array = seen @ by[compared]
        return np.nan_to_num(slopes, posinf=0.0, neginf=0.0)

    @staticmethod
    def _given_at(record: InputRecord, rows: NDArray[np.intp], shares: Array) -> InputRecord:
        if not len(rows):
            return record
        instants = np.full(len(record.time_s), 0.5)
        instants[rows] = shares
        return replace(record, instants=instants)

    def fit_initial_state(self, record: InputRecord, p: Array, near: Array | None = None) -> Array:
        """Initial state (nx,) that fits a record best, kept near the state of its first seconds.

        The search begins at `near` (nx,), if given. If with the least squares in noise units the model follows the
        record to within :data:`_NEAR`, the least squares hold. Else the model is wrong, and its heading and speed would
        be biased to correct its track: then a signal weighs less by the size of its own residual beyond the noise (the
        likelihood of a deviation that is not known), of which only one value in L/u0 counts as independent.
        """
        start, misfit = self._least_squares_start(record, p, near, wrong=False)
        return start if misfit < _NEAR else self._least_squares_start(record, p, near, wrong=True)[0]

    def guess_initial_state(self, record: InputRecord, p: Array) -> Array:
        """Initial state (nx,) from the first seconds, with the rudder that fits the record better."""
        guess, _ = first_state(self, record, p)
        return min(self._guesses(guess), key=lambda start: float(np.sum(self.away(record, start, p) ** 2)))

    def _guesses(self, guess: Array) -> list[Array]:
        """The first state, and with the rudder amidships: a record may begin at the execute."""
        if "rudder.angle" not in self.model.state_names:
            return [guess]
        place = self.model.state_names.index("rudder.angle")
        if abs(guess[place]) < _LEAST_RUDDER:
            return [guess]
        amidships = guess.copy()
        amidships[place] = 0.0
        return [guess, amidships]

    def _least_squares_start(
        self, record: InputRecord, p: Array, near: Array | None = None, *, wrong: bool
    ) -> tuple[Array, float]:
        """Initial state by Gauss-Newton, and its misfit: inf where the motion exceeds all bounds."""
        guess, spread = self.guess_initial_state(record, p), first_state(self, record, p)[1]
        known, sigma = record.known, self.sigma
        column = np.broadcast_to(np.arange(len(sigma)), known.shape)[known]
        number = np.maximum(np.bincount(column, minlength=len(sigma)), 1)

        def residuals(start: Array) -> Array:
            return (self.motion(record, start, p) - record.readings)[known]

        start = guess if near is None else near
        residual, before = residuals(start), np.zeros(0)
        for turn in range(_ROUNDS):
            size = np.sqrt(np.bincount(column, residual**2, len(sigma)) / number)
            beyond = INSTANTS * np.maximum(size**2 - sigma**2, 0) if wrong else 0.0
            weights = np.sqrt(sigma**2 + beyond)
            slopes = self.slopes_of_motion(record, start, p)[known]
            if not (np.isfinite(weights).all() and np.isfinite(slopes).all()):
                break
            if wrong and turn and np.allclose(weights, before, rtol=0.02):
                break
            before, each = weights, weights[column]
            J = np.concatenate([slopes / each[:, None], np.diag(1 / spread)])

            def misfit(start: Array, each: Array = each) -> Array:
                return np.append(residuals(start) / each, (start - guess) / spread)

            begin = start, np.append(residual / each, (start - guess) / spread)
            then, all_residuals = least_squares_steps(misfit, begin, lambda *_, J=J: J)
            settled = float(np.max(np.abs(then - start) / spread)) < _SETTLED
            start, residual = then, all_residuals[: len(column)] * each
            if settled:
                break
        whole = float(np.sqrt(np.mean((residual / sigma[column]) ** 2)))
        return start, whole if np.isfinite(whole) else np.inf


def _beginning_of(record: InputRecord, rows: int) -> InputRecord:
    """The first `rows` rows of a record."""
    kept = record.compared < rows
    return replace(
        record,
        time_s=record.time_s[:rows],
        inputs=record.inputs[:rows],
        compared=record.compared[kept],
        readings=record.readings[kept],
        instants=None if record.instants is None else record.instants[:rows],
    )


def shown_by(model: Model, seen: Sequence[str]) -> RowFunction:
    """Readings of the variables `seen` (``sensor.psi`` where the model has it) as a function of x, u, p."""
    shown = ca.vcat([model.symbol(name) for name in _sensors(model, seen)])
    arguments = [model.x, model.u, model.p]
    return RowFunction(ca.Function("shown", arguments, [ca.densify(model.expand(shown))], {"cse": True}))


def _sensors(model: Model, seen: Sequence[str]) -> tuple[str, ...]:
    """The variables that sensors of `seen` show."""
    pairs = [(name.replace("motion.", "sensor."), name) for name in seen]
    return tuple(sensor if sensor in model else name for sensor, name in pairs)


def difference_slopes(function: Callable[[Array], Array], at: Array, value: Array, reach: Array) -> Array:
    """Derivatives (n, k) of ``function(at) = value`` (n,) by forward differences of `reach` (k,)."""
    columns = []
    for place, step in enumerate(reach):
        moved = at.copy()
        moved[place] += step
        columns.append((function(moved) - value) / step)
    return np.stack(columns, axis=1)


def input_record(replayer: Replayer, trial: Trial) -> InputRecord:
    """A trial on its own rows, thinned to :data:`COARSEST` steps of the model; each order keeps its row.

    Raises
    ------
    InputError
        The trial is too short, or has none of the compared signals.
    """
    model, record = replayer.model, motion_record(replayer.model, trial, replayer.seen)
    if len(record.time_s) < _FEWEST_ROWS:
        raise trial.fault("", f"has only {len(record.time_s)} rows", "leave it out")
    refuse_without_motion(record.file, record.measured)
    time, sampling = record.time_s, record.sampling_s
    known = model.defaults
    step = rows_in(model.step_s, sampling) * sampling
    every = max(1, round(known["ship.length"] / known["ship.speed"] / INSTANTS / step)) * step
    wanted = np.arange(time[0], time[-1] + 1e-6 * sampling, every)
    nearest = np.clip(np.searchsorted(time, wanted - 0.5 * sampling), 0, len(time) - 1)
    seen = np.abs(time[nearest] - wanted) <= 0.5 * sampling
    moved = np.flatnonzero((np.diff(record.inputs[:, record.orders], axis=0) != 0).any(axis=1)) + 1
    longest = rows_in(COARSEST * model.step_s, sampling) * sampling
    bins = np.floor((time - time[0]) / longest + 1e-6)
    kept = np.flatnonzero(np.diff(bins, prepend=-1.0) > 0)
    kept = np.union1d(np.concatenate([kept, moved, moved - 1, nearest[seen]]), len(time) - 1)
    instants = np.union1d(time[kept], wanted[~seen])  # times without a row stay gaps
    late = delays_of(replayer.card, model)
    edges = np.append(instants, 2 * instants[-1] - instants[-2])
    inputs = np.tile(model.input_values(), (len(instants), 1))
    row = np.searchsorted(time, instants, side="right") - 1
    for column, name in enumerate(record.input_names):
        if name == _ORDER and record.orders[column]:
            inputs[:, column] = record.inputs[row, column]
        else:
            inputs[:, column] = record.means(column, edges - late.get(name, 0.0))
    compared = np.searchsorted(instants, np.where(seen, time[nearest], wanted))
    readings = np.where(seen[:, None], record.measured[nearest], np.nan)
    ordered = _ORDER in record.input_names and record.orders[record.input_names.index(_ORDER)]
    delay = late.get(_ORDER, 0.0) if ordered else 0.0
    return InputRecord(trial.name, instants, inputs, compared, readings, delay)


def delays_of(card: SteeredCard, model: Model, p: Array | None = None) -> dict[str, float]:
    """Delay of each input by the effects of the card at parameters `p`, s."""
    known = model.defaults if p is None else model.parameters_by_name(p)
    delays: dict[str, float] = {}
    for effect in (EFFECTS[entry.name] for entry in card.effects):
        for name, key in effect.delays.items():
            delays[name] = delays.get(name, 0.0) + known[effect.model_names()[key]]
    return delays


def first_state(replayer: Replayer, record: InputRecord, p: Array) -> tuple[Array, Array]:
    """State read off the first :data:`FIRST` L/u0 of a record by straight lines, and how far to trust it (nx,) each.

    Parameters
    ----------
    replayer : Replayer
    record : InputRecord
    p : array (np,)
        Parameters of the model.
    """
    model, times = replayer.model, record.times - record.times[0]
    early = times < FIRST * replayer.passage_s
    early[:3] = True
    span = float(times[early][-1]) * early.sum() / (early.sum() - 1)
    readings = zip(replayer.seen, record.readings[early].T, replayer.sigma, strict=True)
    values = {name: _straight(times[early], column, error) for name, column, error in readings}
    read = {name: value[:2] for name, value in values.items() if value is not None}
    track = [values.get(f"motion.{axis}") for axis in "xy"]
    if track[0] is not None and track[1] is not None:
        north, east = track[0][2], track[1][2]
        rate = sum(line[1] for line in track if line is not None) / span
        way = float(np.hypot(north, east))
        if way > rate:
            read.setdefault("motion.u", (way, rate + ASTERN * way))
            read.setdefault("motion.psi", (float(np.arctan2(east, north)), rate / way + 0.1))
    for name in ("motion.u", "motion.v"):
        if (over_ground := read.get(f"{name}_ground")) is not None:
            read.setdefault(name, (over_ground[0], over_ground[1] + ASTERN * abs(over_ground[0])))
    start = np.array(model.initial(p)).ravel()
    spread = np.array([state.nominal for state in model.states])
    for place, state in enumerate(model.states):
        if state.name == "motion.u":
            spread[place] *= ASTERN
        if state.name == "rudder.angle":
            start[place] = record.inputs[0, model.input_names.index("rudder.command")]
        if state.name in read:
            start[place], error = read[state.name]
            spread[place] = TRUST * error
    return start, spread


def _straight(times: Array, values: Array, sigma: float) -> tuple[float, float, float] | None:
    """First value, its standard error and the change per second of a straight line; None of fewer than three."""
    places = np.flatnonzero(~np.isnan(values))
    if len(places) < 3:
        return None
    slope, first = np.polyfit(times[places], values[places], 1)
    return float(first), 2 * sigma / float(np.sqrt(len(places))), float(slope)  # 2: of the end of a line
