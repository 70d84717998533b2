"""A ship with added effects, evaluated along the measured motion.

States that were not measured (the rudder behind its gear, heel, remembered flow) are integrated along the measured
motion from the recorded inputs; the rates of the measured states, and the readings of the sensors, follow from both.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import casadi as ca
import numpy as np

from tank2sim.arrays import Array
from tank2sim.cards.card import SteeredCard
from tank2sim.dynamics.effects import EFFECTS, EffectParameter
from tank2sim.dynamics.model import Model
from tank2sim.gap.inference.batch import MEASURED_STATES, MeasuredBatch
from tank2sim.identification.trials.problem.estimation_problem import driven_model
from tank2sim.records.trials import ROWS_TO_SHOW_AN_ORDER
from tank2sim.simulation.rows import ArrayFunction, Chain

CLOCK = "rudder.clock"
"""Parameter of the slopes: delay of the ship's response behind the rudder's record, s."""

SENSED = (*MEASURED_STATES, "motion.u_ground", "motion.v_ground", "motion.sog")
"""Variables that sensors may measure."""

SMALL_SHARE = 0.01
"""Change of a parameter for a difference quotient, as a share of it."""

NEWTON_STEPS = 8
"""Newton steps to the steady value of a state that was not measured, at the beginning of a run."""

STEPS_IN_A_TIME = 2.5
"""Integration steps in a time constant or period that is estimated, at least. Classical Runge-Kutta is stable up to a
step of 2.78 time constants (Hairer and Wanner 1996, IV.2), or 2.83/(2 pi) of a period."""


@dataclass(frozen=True)
class EstimatedParameter:
    """A parameter that is estimated."""

    effect: str  # Name of its effect
    parameter: EffectParameter
    variable: str  # Variable of the model that holds it
    run: int | None = None  # Place of the only trial in which it acts; None for a parameter of all trials
    axis: int = 0  # Part of one trial's wind or current, as `direction_rad` counts: 0 along north, 1 along east, m/s

    @property
    def is_amplitude(self) -> bool:
        """Whether the effect vanishes at one value of the parameter, which has no default."""
        return self.parameter.absent is not None and self.parameter.default is None


def parameter_places(
    estimated: Sequence[EstimatedParameter], effect: str | None = None, *, by_trial: bool = False
) -> list[int]:
    """Places of the parameters of an effect, or of all, that act in all trials (`by_trial`: in a single one)."""
    of_effect = [(place, each) for place, each in enumerate(estimated) if effect is None or each.effect == effect]
    return [place for place, each in of_effect if (each.run is not None) == by_trial]


@dataclass(frozen=True)
class TrialSurroundings:
    """Effects whose wind or current is a matter of each trial."""

    # Effects that differ from trial to trial: two unknowns for each trial, normal about zero with the typical speed of
    # the effect as standard deviation.
    each: tuple[str, ...] = ()
    recorded: tuple[str, ...] = ()  # Effects whose wind or current every trial recorded
    runs: int = 0  # Number of trials, for `each`


@dataclass(frozen=True, eq=False)
class _Kept:
    """Values along a motion at some parameters, kept for the next question at the same ones."""

    motion: MeasuredBatch | None = None
    theta: bytes = b""
    values: Array = field(default_factory=lambda: np.zeros(0))

    def at(self, motion: MeasuredBatch, theta: Array, compute: Callable[[MeasuredBatch, Array], Array]) -> _Kept:
        """These values, or others where the motion or the parameters differ."""
        if self.motion is motion and self.theta == theta.tobytes():
            return self
        return _Kept(motion, theta.tobytes(), compute(motion, theta))


def directed(effects: Iterable[str]) -> bool:
    """Whether one of the effects comes from a direction of the compass."""
    return any(parameter.name == "direction_rad" for effect in effects for parameter in EFFECTS[effect].parameters)


class Hypothesis:
    """The model of a card with added effects.

    Parameters
    ----------
    card : SteeredCard
        The ship as it was known.
    driven_by : str
        ``angle`` or ``order``: the recorded rudder signal.
    effects : sequence of str
        Names of effects that are added.
    ship : Model, optional
        The card's model driven by that signal, if it was built already.
    surroundings : TrialSurroundings
        What is a matter of each trial.

    Attributes
    ----------
    estimated : tuple of EstimatedParameter
        The parameters that are estimated, in the order of every `theta`.
    """

    def __init__(
        self,
        card: SteeredCard,
        driven_by: str,
        effects: Sequence[str] = (),
        ship: Model | None = None,
        surroundings: TrialSurroundings = TrialSurroundings(),
    ):
        self.card, self.driven_by, self.effects = card, driven_by, tuple(effects)
        self.each, self.recorded, runs = surroundings.each, surroundings.recorded, surroundings.runs
        model = driven_model(card, driven_by) if ship is None else ship
        estimated: list[EstimatedParameter] = []
        for name in self.effects:
            effect = EFFECTS[name]
            start = {
                parameter.name: parameter.typical_values(card)[0]
                for parameter in effect.parameters
                if parameter.typical_values(card)
            }
            model = effect.apply(model, start, card)
            places = effect.model_names()
            given = {*effect.measured_as} if name in {*self.each, *self.recorded} else set()
            if name in self.each:
                (speed,) = (parameter for parameter in effect.parameters if parameter.name == "speed_mps")
                estimated += [
                    EstimatedParameter(name, speed, places[speed.name], run, axis)
                    for run in range(runs)
                    for axis in (0, 1)
                ]
            estimated += [
                EstimatedParameter(name, parameter, places[parameter.name])
                for parameter in effect.parameters
                if parameter.name in effect.free(card) and parameter.name not in given
            ]
        self.model = model
        self.estimated = tuple(estimated)
        self.unmeasured = tuple(name for name in model.state_names if name not in MEASURED_STATES)
        self._chains: dict[float, Chain] = {}
        self._kept_inputs = self._kept_unmeasured = _Kept()
        self._functions: dict[tuple[str, ...], tuple[ArrayFunction, ...]] = {}
        self._kept_slopes: dict[tuple[str, ...], _Kept] = {}

    @property
    def directed(self) -> bool:
        """Whether one of the effects comes from a direction of the compass."""
        return directed(self.effects)

    @cached_property
    def influences(self) -> tuple[bool, bool, bool]:
        """Whether the estimated parameters change unmeasured states, rates of the measured states, and readings.

        Those that they do not change equal the values of the card without the effects.
        """
        given = [EFFECTS[name].model_names()[key] for name in self._given for key in EFFECTS[name].measured_as]
        names = dict.fromkeys([*(estimate.variable for estimate in self.estimated), *given])
        chosen = ca.vcat([self.model.symbol(name) for name in names]) if names else ca.SX(0, 1)
        delays = any(EFFECTS[name].delays for name in self.effects)
        states = delays or ca.depends_on(self._of(self.unmeasured), chosen)
        rates = states or ca.depends_on(self._known_rates, chosen)
        return states, rates, states or ca.depends_on(self._shown(SENSED), chosen)

    # -- parameters --------------------------------------------------------------------------------------------------

    @cached_property
    def bounds(self) -> tuple[Array, Array]:
        """Least and largest value of each estimated parameter (k,); times at least as long as can be integrated."""
        low = np.array(
            [
                estimate.parameter.lowest(self.card) if estimate.run is None else -estimate.parameter.maximum
                for estimate in self.estimated
            ]
        )
        timed = [estimate.parameter.name.endswith("_s") for estimate in self.estimated]
        times = np.array(timed, dtype=bool) & (low > 0)
        low[times] = np.maximum(low[times], STEPS_IN_A_TIME * self.model.step_s)
        return low, np.array([estimate.parameter.maximum for estimate in self.estimated])

    @cached_property
    def prior(self) -> tuple[Array, Array]:
        """Prior mean and precision of each estimated parameter (k,); precision 0 where nothing is known."""
        means, precisions = [], []
        for estimate in self.estimated:
            spread = estimate.parameter.spread_value(self.card)
            if estimate.run is not None:
                means.append(0.0)
                precisions.append(max(map(abs, estimate.parameter.typical_values(self.card))) ** -2)
                continue
            means.append(estimate.parameter.value({}, self.card) if spread else 0.0)
            precisions.append(1 / spread**2 if spread else 0.0)
        return np.array(means), np.array(precisions)

    @property
    def steps(self) -> Array:
        """A small change of each estimated parameter (k,), for difference quotients."""
        sizes: list[float] = []
        for estimate in self.estimated:
            typical = estimate.parameter.typical_values(self.card) or (self.prior[0][len(sizes)],)
            spread = estimate.parameter.spread_value(self.card)
            sizes.append(0.01 * (max(map(abs, typical)) or spread or estimate.parameter.maximum))
        return np.array(sizes)

    def parameters(self, theta: Array) -> Array:
        """The model's parameter vector with the estimated parameters at `theta` (k,)."""
        return self.model.parameter_values(self._chosen(theta, self.model.parameter_names))

    def _chosen(self, theta: Array, names: Sequence[str]) -> dict[str, float]:
        values = {self.estimated[place].variable: float(theta[place]) for place in parameter_places(self.estimated)}
        return {variable: value for variable, value in values.items() if variable in names}

    @property
    def _given(self) -> tuple[str, ...]:
        """Effects whose wind or current is not a parameter of all trials."""
        return (*self.each, *self.recorded)

    @cached_property
    def moved_together(self) -> tuple[tuple[int, ...], ...]:
        """Places of the estimated parameters (k,), those together that act in different trials."""
        groups: dict[tuple[str, str, int, bool], list[int]] = {}
        for place, estimate in enumerate(self.estimated):
            key = estimate.effect, estimate.parameter.name, estimate.axis, estimate.run is None
            groups.setdefault(key, []).append(place)
        return tuple(map(tuple, groups.values()))

    def of_each_trial(self, theta: Array) -> dict[str, Array]:
        """Parts along north and east (R, 2), m/s, of each wind or current that differs from trial to trial."""
        places = {name: parameter_places(self.estimated, name, by_trial=True) for name in self.each}
        return {name: np.asarray(theta)[places[name]].reshape(-1, 2) for name in self.each}

    def inputs(self, motion: MeasuredBatch, theta: Array, late_s: float = 0.0) -> Array:
        """Inputs of this model at every fine step (R, n - 1, nu), the rudder's order later by `late_s`."""
        if late_s:
            return self._inputs(motion, theta, late_s)
        self._kept_inputs = kept = self._kept_inputs.at(motion, theta, self._inputs)
        return kept.values

    def _inputs(self, motion: MeasuredBatch, theta: Array, late_s: float = 0.0) -> Array:
        known = motion.inputs
        names = self.model.input_names
        runs, steps, count = known.shape
        inputs = np.empty((runs, steps, len(names)))
        inputs[:, :, :count] = known  # effects append their inputs to the ship's
        inputs[:, :, count:] = self.model.input_values()[count:]
        for name, value in self._chosen(theta, names).items():
            inputs[:, :, names.index(name)] = value
        for effect, parts in self.of_each_trial(theta).items():
            variables = EFFECTS[effect].model_names()
            inputs[:, :, names.index(variables["speed_mps"])] = np.hypot(*parts.T)[:, None]
            inputs[:, :, names.index(variables["direction_rad"])] = np.arctan2(parts[:, 1], parts[:, 0])[:, None]
        for effect in self.recorded:
            for variable in map(EFFECTS[effect].model_names().get, EFFECTS[effect].measured_as):
                assert variable is not None
                inputs[:, :, names.index(variable)] = motion.recorded[variable]
        for name, delay in self._delays(theta, late_s).items():
            if delay and not self._states_behind(name):
                place = names.index(name)
                steps = np.full(runs, delay / motion.step_s)
                inputs[:, :, place] = _late(inputs[:, :, place], steps)
        return inputs

    def _delays(self, theta: Array, late_s: float = 0.0) -> dict[str, float]:
        """Name of each input whose record is not synchronous with the motion, to the delay of the ship, s."""
        keys = [(estimate.effect, estimate.parameter.name) for estimate in self.estimated]
        values = dict(zip(keys, map(float, theta), strict=True))
        found = {"rudder.command": late_s}
        for effect in self.effects:
            for name, parameter in EFFECTS[effect].delays.items():
                found[name] = found.get(name, 0.0) + values[effect, parameter]
        return found

    def _states_behind(self, name: str) -> tuple[int, ...]:
        """Indices of the states through which alone an input acts on the ship: these are delayed."""
        if name != "rudder.command" or "rudder.angle" not in self.unmeasured:
            return ()
        behind = {"rudder.angle"}
        behind |= {state for effect in EFFECTS.values() for state, by in effect.states_behind.items() if by == name}
        return tuple(place for place, state in enumerate(self.unmeasured) if state in behind)

    # -- states, rates and readings
    # ---------------------------------------------------------------------------------------

    def unmeasured_states(
        self, motion: MeasuredBatch, theta: Array, p: Array | None = None, late_s: float = 0.0
    ) -> Array:
        """States that were not measured, at the fine instants (R, n, no); `p` are other parameters of the model, and
        `late_s` is a delay of the rudder's order."""
        if not self.unmeasured:
            return np.zeros((*motion.states.shape[:2], 0))
        if p is not None or late_s:
            return self._unmeasured_states(motion, theta, p, late_s)
        self._kept_unmeasured = kept = self._kept_unmeasured.at(motion, theta, self._unmeasured_states)
        return kept.values

    def _unmeasured_states(
        self, motion: MeasuredBatch, theta: Array, p: Array | None = None, late_s: float = 0.0
    ) -> Array:
        inputs, p = self.inputs(motion, theta), self.parameters(theta) if p is None else p
        x, first, chain = motion.states, inputs[:, 0].copy(), self._chain(motion.step_s)
        if motion.at_execute.any():
            first[motion.at_execute, self._command] = 0.0
        starts = self._steady_states(x[:, 0], first, p)
        unmeasured = np.array(
            [chain.run(starts[run], x[run, :-1], x[run, 1:], inputs[run], p) for run in range(len(x))]
        )
        for name, delay in self._delays(theta, late_s).items():
            shown_late_s = ROWS_TO_SHOW_AN_ORDER * motion.unsure_s * (name == "rudder.command")
            delay_of_run = delay - shown_late_s
            if delay_of_run.any():
                for place in self._states_behind(name):
                    unmeasured[:, :, place] = _late(unmeasured[:, :, place], delay_of_run / motion.step_s)
        return unmeasured

    def rates(self, motion: MeasuredBatch, theta: Array, unmeasured: Array | None = None) -> Array:
        """Rates of the measured states, each from the middle of a block to the middle of the next (R, T - 1, 6).

        `unmeasured` are the states that were not measured, if they are known already (:meth:`unmeasured_states`).
        """
        return _rowwise(self._rates, *self._along(motion, theta, unmeasured), self.parameters(theta))

    def fine_rates(self, motion: MeasuredBatch, theta: Array) -> Array:
        """Rates as of :meth:`rates`, with the mean over the fine steps in place of the rate at the mean."""
        return motion.over_blocks(self.rates_between(motion, theta))

    def rates_between(self, motion: MeasuredBatch, theta: Array) -> Array:
        """Rates of the measured states halfway between the fine instants (R, n - 1, 6)."""
        unmeasured = self.unmeasured_states(motion, theta)
        x = 0.5 * (motion.states[:, 1:] + motion.states[:, :-1])
        xi = 0.5 * (unmeasured[:, 1:] + unmeasured[:, :-1])
        return _rowwise(self._rates, x, xi, self.inputs(motion, theta), self.parameters(theta))

    def readings(self, motion: MeasuredBatch, theta: Array, unmeasured: Array | None = None) -> Array:
        """Readings of noiseless sensors in the middle of each block (R, T, ny)."""
        function, _ = self._sensors(motion.seen)
        return _rowwise(function, *self._in_blocks(motion, theta, unmeasured), self.parameters(theta))

    def slopes(self, motion: MeasuredBatch, theta: Array, names: Sequence[str] = ()) -> tuple[Array, Array]:
        """Rates by states (R, T - 1, 6, 6), and readings by states (R, T, ny, 6); `names` are the parameters of the
        ship of which :meth:`coefficient_slopes` is asked next, along the same motion: one function evaluates both."""
        unmeasured, p = self.unmeasured_states(motion, theta), self.parameters(theta)
        _, reading_slopes = self._sensors(motion.seen)
        reading = _rowwise(reading_slopes, *self._in_blocks(motion, theta, unmeasured), p)
        by_state = self._rates_and_slopes(motion, theta, self._direct(names))[1]
        return by_state, _matrices(reading, len(MEASURED_STATES))

    def coefficient_slopes(self, motion: MeasuredBatch, theta: Array, names: Sequence[str]) -> Array:
        """Rates by parameters of the ship (R, T - 1, 6, len(names)); 0 for parameters that an effect has replaced."""
        direct = self._direct(names)
        along, p = self._along(motion, theta, None), self.parameters(theta)
        base, _, by_name = self._rates_and_slopes(motion, theta, direct)
        self._kept_slopes = {}  # they are large
        columns = np.zeros((*along[0].shape, len(names)))
        columns[..., [names.index(name) for name in direct]] = by_name
        for name in names:
            if name.startswith("steering.") and name in self.model:  # through the state of the rudder
                moved = p.copy()
                place = self.model.parameter_names.index(name)
                moved[place] *= 1 + SMALL_SHARE
                unmeasured = self.unmeasured_states(motion, theta, moved)
                rates = _rowwise(self._rates, *self._along(motion, theta, unmeasured), moved)
                columns[..., names.index(name)] = (rates - base) / (moved[place] - p[place])
        if CLOCK in names:
            late_s = SMALL_SHARE * motion.step_s
            late = self.unmeasured_states(motion, theta, late_s=late_s), self.inputs(motion, theta, late_s)
            middles = motion.over_blocks(0.5 * (late[0][:, 1:] + late[0][:, :-1]))
            rates = _rowwise(self._rates, along[0], middles, motion.over_blocks(late[1]), p)
            columns[..., names.index(CLOCK)] = (rates - base) / late_s
        return columns

    def _direct(self, names: Sequence[str]) -> tuple[str, ...]:
        """Parameters of the model that change rates by themselves."""
        return tuple(name for name in names if name in self.model and not name.startswith("steering."))

    def _rates_and_slopes(
        self, motion: MeasuredBatch, theta: Array, names: tuple[str, ...]
    ) -> tuple[Array, Array, Array]:
        """Rates (R, T - 1, 6), and their slopes by the measured states and by parameters of the model."""

        def compute(motion: MeasuredBatch, theta: Array) -> Array:
            function = self._function_of_slopes(names)
            return _rowwise(function, *self._along(motion, theta, None), self.parameters(theta))

        kept = self._kept_slopes.get(names, _Kept()).at(motion, theta, compute)
        self._kept_slopes = {names: kept}
        count = len(MEASURED_STATES)
        slopes = _matrices(kept.values[..., count:], count + len(names))
        return kept.values[..., :count], slopes[..., :count], slopes[..., count:]

    @property
    def moves_clock(self) -> bool:
        """Whether an effect delays the rudder's record, as an error of its clock does."""
        return any("rudder.command" in EFFECTS[name].delays for name in self.effects)

    def steered(self, inputs: Array) -> Array:
        """The input that steers, in inputs (..., nu): the rudder's order (rad), a craft's thruster direction (rad), or
        the difference in revolutions of its first and last one (rad/s)."""
        names = self.model.input_names
        for ending in ("rudder.command", ".azimuth_command"):
            if places := [place for place, name in enumerate(names) if name.endswith(ending)]:
                return np.asarray(inputs[..., places[0]])
        places = [place for place, name in enumerate(names) if name.startswith("thrusters.")]
        return np.asarray(inputs[..., places[0]] - inputs[..., places[-1]])

    @property
    def _command(self) -> int:
        return self.model.input_names.index("rudder.command")

    def _along(self, motion: MeasuredBatch, theta: Array, unmeasured: Array | None) -> tuple[Array, Array, Array]:
        if unmeasured is None:
            unmeasured = self.unmeasured_states(motion, theta)
        xi = motion.over_blocks(0.5 * (unmeasured[:, 1:] + unmeasured[:, :-1]))
        return motion.block_states, xi, motion.over_blocks(self.inputs(motion, theta))

    def _in_blocks(self, motion: MeasuredBatch, theta: Array, unmeasured: Array | None) -> tuple[Array, Array, Array]:
        if unmeasured is None:
            unmeasured = self.unmeasured_states(motion, theta)
        inputs = self.inputs(motion, theta)
        every = np.concatenate([inputs, inputs[:, -1:]], axis=1)
        return motion.states_in_blocks, motion.in_blocks(unmeasured), motion.in_blocks(every)

    # -- CasADi functions --------------------------------------------------------------------------------------------

    @cached_property
    def _symbols(self) -> tuple[ca.SX, ca.SX, ca.SX, ca.SX]:
        model = self.model
        known = ca.vcat([model.symbol(name) for name in MEASURED_STATES])
        unmeasured = ca.vcat([model.symbol(name) for name in self.unmeasured]) if self.unmeasured else ca.SX(0, 1)
        return known, unmeasured, model.u, model.p

    def _of(self, names: Sequence[str]) -> ca.SX:
        return ca.vcat([self.model.rates[self.model.state_names.index(name)] for name in names])

    @cached_property
    def _known_rates(self) -> ca.SX:
        return self._of(MEASURED_STATES)

    def _function(self, name: str, expression: ca.SX) -> ArrayFunction:
        """A matrix, column by column, as a function of measured and unmeasured states, inputs and parameters."""
        return ArrayFunction(ca.Function(name, [*self._symbols], [ca.densify(ca.vec(expression))], {"cse": True}))

    @cached_property
    def _rates(self) -> ArrayFunction:
        return self._function("rates", self._known_rates)

    def _sensors(self, seen: tuple[str, ...]) -> tuple[ArrayFunction, ...]:
        """Readings of the variables `seen`, and their slopes by measured states."""
        key = "readings", *seen
        if key not in self._functions:
            shown = self._shown(seen)
            slopes = ca.jacobian(shown, self._symbols[0])
            self._functions[key] = self._function("readings", shown), self._function("reading_slopes", slopes)
        return self._functions[key]

    def _function_of_slopes(self, names: tuple[str, ...]) -> ArrayFunction:
        """Rates, and their slopes by measured states and by parameters of the model."""
        key = "slopes", *names
        if key not in self._functions:
            by = ca.vcat([self._symbols[0], *(self.model.symbol(name) for name in names)])
            slopes = ca.vec(ca.jacobian(self._known_rates, by))
            self._functions[key] = (self._function("rates_and_slopes", ca.vertcat(self._known_rates, slopes)),)
        return self._functions[key][0]

    def _shown(self, seen: Sequence[str]) -> ca.SX:
        names = [f"sensor.{name.partition('.')[2]}" for name in seen]
        chosen = [sensor if sensor in self.model else name for sensor, name in zip(names, seen, strict=True)]
        return self.model.expand(ca.vcat([self.model.symbol(name) for name in chosen]))

    @cached_property
    def _unmeasured_rates(self) -> ca.Function:
        known, unmeasured, u, p = self._symbols
        return ca.Function("unmeasured_rates", [unmeasured, known, u, p], [self._of(self.unmeasured)], {"cse": True})

    def _chain(self, step_s: float) -> Chain:
        """Unmeasured states over one fine step, with the motion straight between its ends (classical Runge-Kutta)."""
        if step_s not in self._chains:
            known, unmeasured, u, p = self._symbols
            end = ca.SX.sym("end", 6)
            count = max(1, int(np.ceil(step_s / self.model.step_s - 1e-9)))
            h, state = step_s / count, unmeasured
            for part in range(count):
                a, b, c = (known + (end - known) * (part + share) / count for share in (0.0, 0.5, 1.0))
                k1 = self._unmeasured_rates(state, a, u, p)
                k2 = self._unmeasured_rates(state + h / 2 * k1, b, u, p)
                k3 = self._unmeasured_rates(state + h / 2 * k2, b, u, p)
                k4 = self._unmeasured_rates(state + h * k3, c, u, p)
                state = state + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
            step = ca.Function("unmeasured_step", [unmeasured, known, end, u, p], [ca.densify(state)], {"cse": True})
            self._chains[step_s] = Chain(step)
        return self._chains[step_s]

    @cached_property
    def _begin(self) -> ca.Function:
        """Trims of the unmeasured states, or else their starts."""
        known, unmeasured, u, p = self._symbols
        trims = {
            state.name: state.trim if state.trim is not None else ca.SX(state.start) for state in self.model.states
        }
        start = ca.densify(self.model.expand(ca.vcat([trims[name] for name in self.unmeasured])))
        return ca.Function("begin", [unmeasured, known, u, p], [start])

    @cached_property
    def _newton(self) -> ca.Function:
        """Rates of the unmeasured states, and their slopes by these states."""
        known, unmeasured, u, p = self._symbols
        unmeasured_rates = self._of(self.unmeasured)
        return ca.Function(
            "newton",
            [unmeasured, known, u, p],
            [unmeasured_rates, ca.jacobian(unmeasured_rates, unmeasured)],
            {"cse": True},
        )

    def _steady_states(self, x: Array, u: Array, p: Array) -> Array:
        """Steady unmeasured states (R, no) of constant motions (R, 6) and inputs: trims where these are known."""
        states = {state.name: state for state in self.model.states}

        def trimmed(xi: Array) -> Array:
            return np.array(self._begin(xi.T, x.T, u.T, p)).T

        xi = trimmed(np.zeros((len(x), len(self.unmeasured))))
        moving = np.array([states[name].trim is None and states[name].steady for name in self.unmeasured])
        for _ in range(NEWTON_STEPS if moving.any() else 0):
            rates, slopes = (np.array(value) for value in self._newton(xi.T, x.T, u.T, p))
            by_run = slopes.reshape(len(moving), len(x), len(moving)).swapaxes(0, 1)[:, moving][:, :, moving]
            before = xi.copy()
            xi[:, moving] -= (np.linalg.pinv(by_run) @ rates.T[:, moving, None])[..., 0]
            xi = np.where(moving, xi, trimmed(xi))
            if np.allclose(xi, before, rtol=1e-12, atol=0.0):
                break
        return xi


def _rowwise(function: ArrayFunction, *arguments: Array) -> Array:
    """A function over arrays (R, n, k), the last argument (k,) held: (R, n, results)."""
    shape = arguments[0].shape[:2]
    rows = [argument.reshape(shape[0] * shape[1], -1) for argument in arguments[:-1]]
    return function(*rows, arguments[-1])[0].reshape(*shape, -1)


def _matrices(values: Array, columns: int) -> Array:
    """Matrices (R, n, rows, columns) from their values (R, n, columns x rows), column by column."""
    return values.reshape(*values.shape[:2], columns, -1).swapaxes(-1, -2)


def _late(rows: Array, steps: Array) -> Array:
    """Values (R, n) delayed by `steps` (R,), real numbers; the first value is held before, the last one after."""
    places = np.arange(rows.shape[1])
    return np.array([np.interp(places - late, places, row) for row, late in zip(rows, steps, strict=True)])
