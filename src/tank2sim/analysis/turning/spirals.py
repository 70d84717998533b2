"""Simulated spirals on the steady-turning diagram: the direct spiral on its stable branches, the reverse spiral on all.

Direct (Dieudonne): a series of rudder angles, each held until the turn is steady. Reverse (Bech): a series of yaw
rates, each held by a controller of the rudder until the rudder is steady; it also reaches the turns that are unstable
with the rudder held (ITTC 7.5-04-02-01). Both run on the nonlinear model with its steering gear, in calm water.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from tank2sim.analysis.stability.straight_line import Nomoto
from tank2sim.analysis.turning.diagram import SteadyTurning, largest_rudder
from tank2sim.arrays import Array
from tank2sim.dynamics.effects import undisturbed_inputs
from tank2sim.dynamics.model import Input, Model, Quantity, State
from tank2sim.simulation.integrator import Integrator
from tank2sim.simulation.manoeuvres import SPIRAL_RUDDERS_DEG, SpiralManoeuvre
from tank2sim.simulation.run import simulate
from tank2sim.simulation.running import Running

RATES = 21
"""Yaw rates of a reverse spiral, evenly between the turns at the largest rudders of the direct one."""

_BANDWIDTH = 1.0
"""Natural frequency of the yaw-rate loop, in u0/L, with damping 1: slow against the gear, fast against the hull's own
growth. Project choice."""

STEADY_RUDDER = math.radians(0.002)
"""Largest rudder motion over two ship lengths of a steady point, whose yaw rate is within :data:`_HELD` of its order.
Project choice: far less than the resolution of a dial."""

_HELD = 1e-3
"""Largest error of a held yaw rate, as a share of the largest yaw rate."""

_LONGEST = 60.0
"""Longest time at a yaw rate, L/u0."""


@dataclass(frozen=True, eq=False)
class SpiralPoints:
    """Points of a simulated spiral in the order of the run.

    `rudder_deg`, `yaw_rate_degps` (n,): positive to starboard; `steady`: false where the turn (or the rudder) was still
    changing at the end; `distance_to_diagram_degps` (n,): to the nearest turn of the diagram at that rudder, yaw rate,
    nan where the diagram has none: for a direct spiral only stable turns count.
    """

    rudder_deg: Array
    yaw_rate_degps: Array
    steady: tuple[bool, ...]
    distance_to_diagram_degps: Array


def direct_spiral(model: Model, turning: SteadyTurning) -> SpiralPoints:
    """The direct spiral of a ship, within the rudder angles of the diagram.

    Raises InputError: the motion leaves all bounds.
    """
    largest = float(np.min(np.abs(turning.rudder_rad[[0, -1]])))
    orders = [math.radians(angle) for angle in SPIRAL_RUDDERS_DEG if abs(math.radians(angle)) <= largest * (1 + 1e-9)]
    rudders = (*orders, *orders[-2::-1])
    calm = undisturbed_inputs(model)
    trajectory = simulate(model, SpiralManoeuvre(rudders), inputs=calm).trajectory
    changes = np.flatnonzero(np.diff(trajectory["rudder.command"]) != 0)
    ends = np.append(changes[len(changes) - len(rudders) + 1 :] + 1, len(trajectory.t) - 1)
    rates = trajectory["motion.r"][ends]
    angles = trajectory["rudder.angle"][ends]  # not the orders: a gear may have play
    acceleration = np.abs(trajectory["motion.rdot"][ends]) * _ship_time(model)
    steady = acceleration < 2e-3 * np.maximum(np.abs(rates), 0.01 / _ship_time(model))
    return _points(turning, angles, rates, steady, only_stable=True)


def reverse_spiral(model: Model, turning: SteadyTurning, nomoto: Nomoto) -> SpiralPoints | None:
    """The reverse spiral of a ship over the yaw rates of the diagram; None if its rudder has no linear effect.

    Raises InputError: the motion leaves all bounds.
    """
    if not nomoto.T_s / nomoto.K_per_s > 0:
        return None
    held = with_rate_controller(model, nomoto)
    largest = math.radians(SPIRAL_RUDDERS_DEG[0])
    inside = np.abs(turning.rudder_rad) <= largest
    rates = np.linspace(turning.yaw_rate_radps[inside].max(), turning.yaw_rate_radps[inside].min(), RATES)
    calm = undisturbed_inputs(held)
    running = Running(Integrator(held), calm)
    rudders, steady = _held(running, rates, _ship_time(model))
    if not np.isfinite(rudders).all():
        raise model.fault("reverse spiral", "the motion leaves all bounds", "check the card's derivatives")
    return _points(turning, rudders, rates, steady, only_stable=False)


def with_rate_controller(model: Model, nomoto: Nomoto) -> Model:
    """The ship with its rudder ordered by a PI controller of the yaw rate, input ``yaw_rate.order`` (rad/s).

    On T r' + r = K delta both poles lie at :data:`_BANDWIDTH` u0/L: Kp = (2 w T - 1)/K, Ki = w^2 T/K.
    """
    w = _BANDWIDTH / _ship_time(model)
    proportional = (2 * w * nomoto.T_s - 1) / nomoto.K_per_s
    integral = w**2 * nomoto.T_s / nomoto.K_per_s
    order = Input(name="yaw_rate.order", unit="rad/s", description="Yaw rate to hold, positive to starboard")
    part = State(
        name="yaw_rate.integral",
        unit="rad",
        description="Integral of the controller",
        derivative="yaw_rate.integral_rate",
        start=0.0,
    )
    error = order.symbol - model.symbol("motion.r")
    wanted = part.symbol + proportional * error
    command = ca.fmax(-largest_rudder(model), ca.fmin(largest_rudder(model), wanted))
    rate = Quantity(
        name="yaw_rate.integral_rate",
        unit="rad/s",
        description="Rate of the integral of the controller",
        value=integral * error + w * (command - wanted),  # emptied while the rudder is at its limit
    )
    return replace(model, notices=()).extend(order, rate, part).substitute("rudder.command", command)


def _held(running: Running, rates: Sequence[float] | Array, ship_time: float) -> tuple[Array, NDArray[np.bool_]]:
    """Rudder angle (n,) at which each yaw rate (n,) is held, and True where the rudder was steady."""
    rudders, steady = [], []
    nearly = _HELD * float(np.max(np.abs(rates)))
    for rate in rates:
        running.order({"yaw_rate.order": float(rate)})
        end, before, calm = running.time + _LONGEST * ship_time, math.inf, False
        while end - running.time > ship_time and not calm:
            running.run(2 * ship_time)
            angle = running.state("rudder.angle")
            calm = abs(angle - before) < STEADY_RUDDER and abs(running.state("motion.r") - rate) < nearly
            before = angle
        rudders.append(before)
        steady.append(calm)
    return np.array(rudders), np.array(steady)


def _points(
    turning: SteadyTurning, rudders: Array, rates: Array, steady: NDArray[np.bool_], *, only_stable: bool
) -> SpiralPoints:
    """Points of rudders (rad) and yaw rates (rad/s), all (n,)."""
    apart = [_distance(turning, d, r, only_stable=only_stable) for d, r in zip(rudders, rates, strict=True)]
    return SpiralPoints(np.degrees(rudders), np.degrees(rates), tuple(steady.tolist()), np.degrees(apart))


def _distance(turning: SteadyTurning, rudder: float, rate: float, *, only_stable: bool) -> float:
    turns = [found for found, stable in turning.turns_at(rudder) if stable or not only_stable]
    return min((abs(found - rate) for found in turns), default=math.nan)


def _ship_time(model: Model) -> float:
    return model.defaults["ship.length"] / model.defaults["ship.speed"]
