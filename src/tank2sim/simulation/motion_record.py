"""A trial as it was recorded, for a model that its rudder drives: on its own rows, however uneven."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tank2sim.arrays import Array
from tank2sim.dynamics.model import Model
from tank2sim.errors import InputError
from tank2sim.records.trials import (
    Trial,
    held_over_gaps,
    order_instants,
    sampling_step,
    straight_over_gaps,
    unwrapped,
    usual_step,
)
from tank2sim.simulation.rudder_record import rudder_of

STATES = {
    "u_mps": "motion.u",
    "v_mps": "motion.v",
    "r_radps": "motion.r",
    "psi_rad": "motion.psi",
    "x_m": "motion.x",
    "y_m": "motion.y",
}
"""Signal of a trial to the state of a model that it measures."""

OBSERVED_SIGNALS = {
    **STATES,
    "u_ground_mps": "motion.u_ground",
    "v_ground_mps": "motion.v_ground",
    "sog_mps": "motion.sog",
    "phi_rad": "motion.phi",
}
"""Signal of a trial to the variable of a model that it measures."""

FED = {
    "n_radps": "propeller.speed",
    "wind_speed_mps": "wind.speed",
    "wind_direction_rad": "wind.direction",
    "current_speed_mps": "current.speed",
    "current_direction_rad": "current.direction",
}
"""Signal of a trial to the input of a model, in addition to the rudder."""

_THRUSTERS = {
    ".azimuth_command": ("azimuth_{}_rad", "azimuth_order_{}_rad"),
    ".command": ("n_{}_radps", "order_{}_radps"),
}
"""End of the name of a thruster's input to the signals of a trial that show it: as measured, else as ordered."""

MOST_INSTANTS_A_ROW = 100
"""Instants of an even time a row of the file: beyond, 99 % of the record is missing, and one bad time (an epoch among
seconds) would ask for gigabytes. Project choice: records of what a ship does have gaps of a few per cent."""


@dataclass(frozen=True, eq=False)
class MotionRecord:
    """The rows of a trial.

    `name`, `file`: Name of the trial, and its file for messages. `time_s` (n,): s, rising. `input_names` (nu) and
    `inputs` (n, nu): The model's inputs at the rows: an order as the row shows it, other inputs straight between their
    readings. `orders` (nu,): True for inputs that are orders: each holds until the next. `measured` (n, ny): In the
    order of `seen`; nan where not measured. `seen`: Names of the model's variables that are measured.
    """

    name: str
    file: str
    time_s: Array
    input_names: tuple[str, ...]
    inputs: Array
    orders: NDArray[np.bool_]
    measured: Array
    seen: tuple[str, ...]

    @property
    def sampling_s(self) -> float:
        """Median of the time between rows, s."""
        return usual_step(self.time_s)

    @property
    def given_s(self) -> Array:
        """Time (n,), s, at which the order that a row shows was given on average: halfway from the row before."""
        return order_instants(self.time_s)

    def means(self, column: int, edges: Array, *, given_before: bool = False) -> Array:
        """Means of an input between times, (k - 1,).

        Before the first row and after the last one an input keeps its value.

        `column`: Place of the input among the model's. `edges` (k,): Times, s, rising. `given_before`: Whether an order
        begins at :attr:`given_s`; otherwise it begins at the row that shows it.
        """
        time, values = self.time_s, self.inputs[:, column]
        if self.orders[column]:
            if given_before:
                time = self.given_s
            return means_of_held(time, values, edges)
        return means_of_lines(time, values, edges)


def refuse_without_motion(file: str, measured: Array) -> None:
    """Refuse a trial whose signals to be compared, `measured` (n, ny), are all nan.

    Raises InputError: They are; it names the `file`.
    """
    if np.isnan(measured).all():
        problem = "has none of the signals to be compared"
        raise InputError(file, "header", problem, "give u_mps, r_degps, ...")


def motion_record(model: Model, trial: Trial, seen: Sequence[str]) -> MotionRecord:
    """Return the rows of a trial for a model that the trial's rudder drives, by angle or by order.

    `trial`: With ``delta_rad``, or ``delta_order_rad``, if the model has a rudder. `seen`: Variables of the model to be
    compared, those of :data:`OBSERVED_SIGNALS`.

    Raises InputError: The trial lasts much longer than its rows can show, as with one bad time.
    """
    lasts, sampling = float(trial.time_s[-1] - trial.time_s[0]), sampling_step(trial)
    if lasts > MOST_INSTANTS_A_ROW * len(trial.time_s) * sampling:
        problem = f"lasts {lasts:g} s, and has {len(trial.time_s)} rows, most of them {sampling:g} s apart"
        raise trial.fault(f"column {trial.heading('t_s')}", problem, "correct the time, or cut the record")
    inputs = np.tile(model.input_values(), (len(trial.time_s), 1))
    orders = np.zeros(inputs.shape[1], dtype=bool)
    for column, name in enumerate(model.input_names):
        if (recorded := _recorded_input(name, trial)) is not None:
            values, orders[column] = recorded
            inputs[:, column] = held_over_gaps(values) if orders[column] else straight_over_gaps(trial.time_s, values)
    signals = {variable: signal for signal, variable in OBSERVED_SIGNALS.items()}
    measured = np.full((len(trial.time_s), len(seen)), np.nan)
    for place, name in enumerate(seen):
        if (readings := trial.signals.get(signals[name])) is not None:
            measured[:, place] = readings
    names = tuple(model.input_names)
    return MotionRecord(trial.name, str(trial.path), trial.time_s, names, inputs, orders, measured, tuple(seen))


def means_of_held(time_s: Array, values: Array, edges: Array) -> Array:
    """Means (k - 1,) between the times `edges` (k,) of values (n,), each held from its time (n,) to the next."""
    areas = np.concatenate([[0.0], np.cumsum(values[:-1] * np.diff(time_s))])
    return _means(time_s, values, areas, edges)


def means_of_lines(time_s: Array, values: Array, edges: Array) -> Array:
    """Means (k - 1,) between the times `edges` (k,) of values (n,) at times (n,), with straight lines between them."""
    fine = np.union1d(time_s, edges)
    at = np.interp(fine, time_s, values)
    areas = np.concatenate([[0.0], np.cumsum(0.5 * (at[:-1] + at[1:]) * np.diff(fine))])
    return _means(fine, at, areas, edges)


def _means(time: Array, values: Array, areas: Array, edges: Array) -> Array:
    """Means between edges from the integral (n,) at times (n,); the first and the last value hold outside."""
    at = np.interp(edges, time, areas)
    at += values[0] * np.minimum(edges - time[0], 0.0) + values[-1] * np.maximum(edges - time[-1], 0.0)
    means: Array = np.diff(at) / np.diff(edges)
    return means


def _recorded_input(name: str, trial: Trial) -> tuple[Array, bool] | None:
    """Values (n,) of an input of a model in a trial, nan in gaps, and whether they are orders; None if not recorded."""
    if name == "rudder.command":
        return rudder_of(trial), "delta_rad" not in trial.signals
    measured, ordered = _signals_of(name)
    values = trial.signals.get(measured, trial.signals.get(ordered))
    if values is None:
        return None
    return (unwrapped(values) if name.endswith("direction") else values), ordered in trial.signals


def _signals_of(name: str) -> tuple[str, str]:
    """Signals of a trial that show an input of a model, as measured and as ordered; empty where there is none."""
    for end, (measured, ordered) in _THRUSTERS.items():
        if name.startswith("thrusters.") and name.endswith(end):
            thruster = name.removeprefix("thrusters.").removesuffix(end)
            return measured.format(thruster), ordered.format(thruster)
    return next((signal for signal, variable in FED.items() if variable == name), ""), ""
