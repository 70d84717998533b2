"""Trials on equal steps for the estimators: inputs held over each step, measured signals at each instant.

The angle of a rudder whose orders alone were recorded follows from the steering gear of the card. A gear with a largest
rate does not average: fed with the mean of an order over a step, it starts up to one step early.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import casadi as ca
import numpy as np
from scipy.ndimage import uniform_filter1d

from tank2sim.arrays import Array, true_runs
from tank2sim.dynamics.build import KEPT_MODELS
from tank2sim.dynamics.model import Model
from tank2sim.errors import InputError
from tank2sim.records.trials import Trial, order_instants, rows_in, sampling_step, straight_over_gaps, usual_step
from tank2sim.simulation.motion_record import (
    OBSERVED_SIGNALS,
    MotionRecord,
    means_of_lines,
    motion_record,
    refuse_without_motion,
)
from tank2sim.simulation.rows import Chain
from tank2sim.simulation.rudder_record import first_rudder, rudder_of
from tank2sim.simulation.scheme import runge_kutta_step

_SLOWER = 1.5
"""Step of a signal over the grid's step, from which it counts as slower than the grid (project choice: below, most
instants have a sample of their own)."""

LONGEST_GAP = 3
"""Gaps of up to this many samples are bridged; longer ones count as unmeasured (project choice)."""


@dataclass(frozen=True, eq=False)
class SampledRun:
    """One trial on equal steps."""

    name: str  # Name of the trial
    # `begin_s`, `step_s`: Time of the first instant in the trial's own time, and the step, s
    begin_s: float
    step_s: float
    # (n, nu): Mean of each of the model's inputs from an instant to the next; the last row repeats the previous row
    inputs: Array
    measured: Array  # (n, ny): In the order of `seen`; nan where not measured
    seen: tuple[str, ...]  # Names of the model's variables that are measured
    file: str = ""  # The trial's file, for messages; empty if it has none

    @property
    def origin(self) -> str:
        """The file, as messages begin; the name if there is none."""
        return self.file or self.name

    @property
    def times(self) -> Array:
        """Instants in the trial's own time (n,), s."""
        return self.begin_s + self.step_s * np.arange(len(self.measured), dtype=float)

    def column(self, name: str) -> Array:
        """Measured values of a variable (n,), nan where it was not measured."""
        if name not in self.seen:
            return np.full(len(self.measured), np.nan)
        return self.measured[:, self.seen.index(name)]

    def part(self, begin: int, end: int) -> SampledRun:
        """The instants `begin` to `end` - 1."""
        inputs, measured = self.inputs[begin:end], self.measured[begin:end]
        return replace(self, begin_s=self.begin_s + begin * self.step_s, inputs=inputs, measured=measured)


def prepare(
    model: Model,
    trial: Trial,
    seen: Sequence[str],
    *,
    step_s: float | None = None,
    orders_before: bool = False,
    rudder: tuple[Array, Array] | None = None,
) -> SampledRun:
    """A trial on equal steps, for a model driven by the trial's rudder signal
    (:func:`.estimation_problem.driven_model`).

    The step is a whole number of sampling steps near `step_s` (by default 1.5 times the model's own), or a whole part
    of one where `step_s` is shorter. `seen`: Variables to be compared; `orders_before`, `rudder`: As for
    :func:`on_steps`, which raises.
    """
    sampling = sampling_step(trial)
    step = rows_in(step_s or 1.5 * model.step_s, sampling) * sampling
    if step_s is not None:
        step /= rows_in(sampling, step_s)
    return on_steps(motion_record(model, trial, seen), step, orders_before=orders_before, rudder=rudder)


def on_steps(
    record: MotionRecord, step: float, *, orders_before: bool = False, rudder: tuple[Array, Array] | None = None
) -> SampledRun:
    """A record on equal steps of `step` s, which need not be a whole number of its rows.

    Signals are averaged over a step, so that no measurement is lost. A rudder order holds until the next and enters
    with its mean over the step; a measured angle is taken as straight between samples. With `orders_before` an order
    was given before the first row that shows it (:attr:`.MotionRecord.given_s`). `rudder` are times and angles of the
    rudder that take the place of the trial's (:class:`.sampled_runs`).

    Raises InputError: The record has fewer than ten steps, or none of its signals.
    """
    time, sampling = record.time_s, record.sampling_s
    stride, lasts = rows_in(step, sampling), float(time[-1] - time[0])
    count, begin = int(lasts / step + 1e-6), float(time[0]) + 0.5 * (stride - 1) * sampling
    grid: Array = begin + step * np.arange(count, dtype=float)
    if count < 10:
        raise InputError(record.file, "", f"is only {lasts:g} s long", "leave it out")
    edges = np.append(grid, grid[-1] + step)
    inputs = np.zeros((count, len(record.input_names)))
    for column, name in enumerate(record.input_names):
        if name == "rudder.command" and rudder is not None:
            inputs[:, column] = means_of_lines(*rudder, edges)
        else:
            inputs[:, column] = record.means(column, edges, given_before=orders_before)
    inputs[-1] = inputs[-2]
    measured = np.column_stack([_averaged(time, signal, grid, step, stride) for signal in record.measured.T])
    refuse_without_motion(record.file, measured)
    return SampledRun(record.name, begin, step, inputs, measured, record.seen, record.file)


def rudder_at_start(run: SampledRun, order: Array, ship_time: float) -> float:
    """Angle of the rudder, rad, at the first instant of a run with its order (n,) alone: :func:`.first_rudder`."""
    return first_rudder(run.times, order, run.column("motion.r"), run.column("motion.psi"), ship_time)


def in_range(run: SampledRun, model: Model, speeds: tuple[float, float], least_s: float) -> tuple[SampledRun, ...]:
    """The parts of a run at speeds (m/s) at which the model holds, each of `least_s` s or more.

    Speed is its mean over half of L/u0, because single readings jump. Without a measured speed the run is kept.
    """
    columns = [run.column(name) for name in ("motion.u", "motion.u_ground", "motion.sog")]
    speed = next((column for column in columns if np.count_nonzero(~np.isnan(column)) > 1), None)
    if speed is None:
        return (run,)
    p = model.defaults
    width = max(1, round(0.5 * p["ship.length"] / p["ship.speed"] / run.step_s))
    smooth = uniform_filter1d(straight_over_gaps(run.times, speed), width)
    inside, least_s = true_runs((smooth >= speeds[0]) & (smooth <= speeds[1])), max(least_s, run.step_s)
    parts = [run.part(rows.start, rows.stop) for rows in inside if (rows.stop - rows.start - 1) * run.step_s >= least_s]
    if len(parts) == 1 and len(parts[0].measured) == len(run.measured):
        return (run,)
    return tuple(replace(part, name=f"{run.name} at {part.begin_s:.0f} s") for part in parts)


def seen_in(model: Model, trials: Sequence[Trial]) -> tuple[str, ...]:
    """Variables of the model that at least one trial measured."""
    measured = {signal for trial in trials for signal in trial.signals}
    return tuple(variable for signal, variable in OBSERVED_SIGNALS.items() if signal in measured and variable in model)


def _averaged(time: Array, values: Array, grid: Array, step: float, stride: int) -> Array:
    """Signal on the grid: mean of `stride` samples around, nan in long gaps and away from sparse samples."""
    known = np.flatnonzero(~np.isnan(values))
    if len(known) < 2:
        return np.full(len(grid), np.nan)
    sampling = usual_step(time)
    signal_step = max(sampling, usual_step(time[known]))
    places = (np.arange(stride) - 0.5 * (stride - 1)) * sampling
    fine = (grid[:, None] + places).ravel()
    interpolated = np.interp(fine, time[known], values[known], left=np.nan, right=np.nan)
    after = np.clip(np.searchsorted(time[known], fine), 1, len(known) - 1)
    gap = time[known[after]] - time[known[after - 1]]
    interpolated[gap > (LONGEST_GAP + 1.5) * signal_step] = np.nan  # three missing: four steps from known to known
    mean: Array = interpolated.reshape(len(grid), stride).mean(axis=1)
    if signal_step > _SLOWER * step:
        nearest = np.rint((time[known] - grid[0]) / step).astype(int)
        mean[~np.isin(np.arange(len(grid)), nearest)] = np.nan
    return mean


_PARTS_OF_LAG = 4.0
"""Steps in a time constant of the gear: Runge and Kutta's error is then below 1e-4 of a movement (project choice)."""

_LONGEST_GAP = 20.0
"""Rows that may be missing between two, over which the gear is still followed in such steps (project choice)."""


@dataclass(frozen=True, eq=False)
class OrderedRudder:
    """A steering gear alone."""

    chain: Chain  # Angle (rad) after a step, from the angle before, and the order (rad) and length of the step (s)
    lag_s: float  # Time constant of the gear
    ship_time: float  # L/u0, s

    def angle(self, trial: Trial) -> tuple[Array, Array]:
        """Times (m,), s, and angle (m,), rad, of a trial's rudder by its orders.

        An order holds from before the first row that shows it (:func:`.order_instants`).
        """
        time, order, spans = trial.time_s, rudder_of(trial), np.diff(trial.time_s)
        longest = min(float(np.max(spans)), _LONGEST_GAP * sampling_step(trial))
        parts = math.ceil(0.5 * longest * _PARTS_OF_LAG / self.lag_s)  # before an order, and as many after it
        before = order_instants(time)[1:] - time[:-1]
        lengths = np.repeat(np.column_stack([before, spans - before]).ravel() / parts, parts)
        orders = np.repeat(order, 2 * parts)[parts:-parts]
        unknown = np.full(len(time), np.nan)
        rates, headings = (trial.signals.get(name, unknown) for name in ("r_radps", "psi_rad"))
        first = first_rudder(time, order, rates, headings, self.ship_time)
        chain = self.chain.run(np.array([first]), np.column_stack([orders, lengths]))
        return np.concatenate([time[:1], time[0] + np.cumsum(lengths)]), chain[:, 0]


@lru_cache(maxsize=KEPT_MODELS)
def ordered_rudder(model: Model) -> OrderedRudder | None:
    """The steering gear of a model alone; None where the rudder's rate depends on other states, as with a fault of the
    gear on the card."""
    if "rudder.angle" not in model.state_names:
        return None
    rate = model.expand(model.symbol("rudder.rate"))
    place, command = model.state_names.index("rudder.angle"), model.input_names.index("rudder.command")
    by_state = np.flatnonzero(ca.which_depends(rate, model.x))
    by_input = {model.input_names[index] for index in np.flatnonzero(ca.which_depends(rate, model.u))}
    if {*by_state} != {place} or not by_input <= {"rudder.command", "steering.failed"}:
        return None
    angle, driving = ca.SX.sym("angle"), ca.SX.sym("driving", 2)
    x, u = ca.SX.zeros(model.x.shape), ca.SX.zeros(model.u.shape)
    x[place], u[command] = angle, driving[0]
    after = runge_kutta_step(model)(x, u, model.parameter_values(), driving[1])[place]
    step = ca.Function("gear", [angle, driving], [ca.densify(after)])
    values = model.defaults
    return OrderedRudder(Chain(step), values["steering.time_constant"], values["ship.length"] / values["ship.speed"])
