"""The angle of a rudder of which only the orders were recorded, by the steering gear of the card.

Trials are then compared with a model that the angle drives. A gear with a largest rate does not average: it leaves for
the mean of two orders at once, and an order that enters with its mean over a step is followed up to a step too early.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise

import casadi as ca
import numpy as np

from tank2sim.arrays import Array
from tank2sim.dynamics.build import KEPT_MODELS
from tank2sim.dynamics.model import Model
from tank2sim.identification.trials.problem.sampled_runs import SampledRun, rudder_at_start
from tank2sim.records.trials import Trial, sampling_step
from tank2sim.simulation.rows import Chain
from tank2sim.simulation.rudder_record import rudder_of
from tank2sim.simulation.scheme import runge_kutta_step

_PARTS_OF_LAG = 4.0
"""Steps in a time constant of the gear: Runge and Kutta's error is then below 1e-4 of a movement (project choice)."""


_LONGEST_GAP = 20.0
"""Rows that may be missing between two, over which the gear is still followed in such steps (project choice)."""


@dataclass(frozen=True, eq=False)
class OrderedRudder:
    """A steering gear alone.

    Parameters
    ----------
    chain : Chain
        Angle (rad) after a step, from the angle before, and the order (rad) and length of the step (s).
    lag_s : float
        Time constant of the gear.
    ship_time : float
        L/u0, s.
    """

    chain: Chain
    lag_s: float
    ship_time: float

    def angle(self, trial: Trial) -> tuple[Array, Array]:
        """Times (m,), s, and angle (m,), rad, of a trial's rudder by its orders.

        An order holds from half a row before the first one that shows it (:data:`.ROWS_TO_SHOW_AN_ORDER`).
        """
        time, order = trial.time_s, rudder_of(trial)
        longest = min(float(np.max(np.diff(time))), _LONGEST_GAP * sampling_step(trial))
        half = math.ceil(0.5 * longest * _PARTS_OF_LAG / self.lag_s)
        lengths = np.repeat(np.diff(time) / (2 * half), 2 * half)
        orders = np.concatenate([np.repeat(pair, half) for pair in pairwise(order)])
        chain = self.chain.run(np.array([self._first(trial, order)]), np.column_stack([orders, lengths]))
        return np.concatenate([time[:1], time[0] + np.cumsum(lengths)]), chain[:, 0]

    def _first(self, trial: Trial, order: Array) -> float:
        signals = {"motion.r": trial.signals.get("r_radps"), "motion.psi": trial.signals.get("psi_rad")}
        known = {name: values for name, values in signals.items() if values is not None}
        if not known:
            return float(order[0])
        measured = np.column_stack(list(known.values()))
        run = SampledRun(trial.name, trial.time_s[0], sampling_step(trial), order[:, None], measured, tuple(known))
        return rudder_at_start(run, order, self.ship_time)


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
    values = dict(zip(model.parameter_names, model.parameter_values(), strict=True))
    return OrderedRudder(
        Chain(step), float(values["steering.time_constant"]), float(values["ship.length"] / values["ship.speed"])
    )
