"""All lanes of a ship in one batch: Heun's method at 0.05 s or less, sampled and steered at 10 Hz."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from gap_truth.disturbances import FORCE_STEP_S, forces
from gap_truth.forces import FORCES
from gap_truth.gear import Gear
from gap_truth.lane import Lane
from gap_truth.manoeuvres import Helm
from gap_truth.memory import FlowMemory, Roll
from gap_truth.motion import Index, Motion, Parameters
from gap_truth.ship import Array, Polynomial

TICK_S = 0.1
SPARE_S = 10.0
"""Every lane runs on after its end at least so long, for records whose clock stood still or whose rudder column is
early."""

U, V, R, PSI, X, Y = range(6)
RECORDED = ("u", "v", "r", "psi", "x", "y", "order", "rpm")


def gathered(lanes: Sequence[Lane], effect: str) -> tuple[Index, Parameters]:
    """The lanes in which an effect is at work and its parameters there, degrees turned into radians."""
    index = np.array([i for i, lane in enumerate(lanes) if effect in lane.effects], int)
    if not index.size:
        return index, {}
    names = [name for name in lanes[index[0]].effects[effect] if not name.startswith("in_")]
    table: Parameters = {}
    for name in names:
        values = np.array([lanes[i].effects[effect][name] for i in index])
        table[name.replace("_deg", "_rad")] = np.radians(values) if "_deg" in name else values
    return index, table


class Batch:
    """The equations of all lanes: states (6, n) of the ship, then those of gear, roll and flow memory."""

    def __init__(self, lanes: Sequence[Lane]) -> None:
        n = len(lanes)
        self.n = n
        self.hull = hull = lanes[0].setting.hull
        if any(lane.setting.hull is not hull for lane in lanes):
            raise ValueError("lanes of one ship expected")
        late = [("out_clock_freeze", "freeze_s"), ("rudder_time_offset", "delay_s")]
        spare_s = max(SPARE_S, *(lane.value(*name, 0.0) for lane in lanes for name in late))
        self.duration_s = max(lane.manoeuvre.duration_s for lane in lanes) + spare_s
        self.coefficients = {name: np.array([lane.coefficients[name] for lane in lanes]) for name in hull.coefficients}
        self.polynomial = Polynomial(self.coefficients)
        self.effects = [(force, *gathered(lanes, name)) for name, force in FORCES.items()]
        self.effects = [effect for effect in self.effects if effect[1].size]
        self.memories = [memory for memory in (Roll(lanes), FlowMemory(lanes)) if memory.lanes.size]
        self.gear = Gear(lanes)
        self.process: Array | None = None
        if any(lane.setting.process != "none" for lane in lanes):
            self.process = np.ascontiguousarray(np.stack([forces(lane, self.duration_s) for lane in lanes], axis=-1))
        speed = np.array([lane.value("current", "speed_mps", 0.0) for lane in lanes])
        towards = np.radians([lane.value("current", "direction_deg", 0.0) for lane in lanes])
        self.drift = np.stack([speed * np.cos(towards), speed * np.sin(towards)])
        c = self.coefficients
        self.m11, self.m22 = hull.mass - c["Xudot"], hull.mass - c["Yvdot"]
        self.m33 = hull.yaw_inertia - c["Nrdot"]
        self.m23, self.m32 = hull.mass * hull.x_g - c["Yrdot"], hull.mass * hull.x_g - c["Nvdot"]

    def rates(self, t: float, states: list[Array], rpm_ratio: Array, rudder: Array) -> list[Array]:
        """Time derivatives of the ship's states and of the memories' states."""
        hull = self.hull
        u, v, r, psi = states[0][:4]
        speed = np.sqrt(u * u + v * v)
        v_prime, r_prime = v / speed, r * hull.length_m / speed
        bare, steering = self.polynomial((u - hull.speed_mps) / speed, v_prime, r_prime, rudder)
        total = bare + steering
        nominal = (hull.speed_mps / speed) ** 2
        total[0] += hull.xnn * (rpm_ratio * np.abs(rpm_ratio) - 1.0) * nominal
        motion = Motion(hull, t, u, v, r, psi, speed, v_prime, r_prime, rudder, rpm_ratio, steering)
        for force, lanes, parameters in self.effects:
            for row, part in zip(total, force(motion.of(lanes), parameters), strict=True):
                row[lanes] += part
        rates = []
        for memory, state in zip(self.memories, states[1:], strict=True):
            parts, rate = memory.forces(motion.of(memory.lanes), state, self.coefficients)
            rates.append(rate)
            for row, part in zip(total[1:], parts, strict=True):
                row[memory.lanes] += part
        if self.process is not None:
            place = t / (FORCE_STEP_S * hull.time)
            low = int(place)
            share = place - low
            total += ((1.0 - share) * self.process[low] + share * self.process[low + 1]) * nominal
        scale = speed * speed / hull.length_m
        determinant = self.m22 * self.m33 - self.m23 * self.m32
        new = np.empty_like(states[0])
        new[U] = scale * total[0] / self.m11
        new[V] = scale * (self.m33 * total[1] - self.m23 * total[2]) / determinant
        new[R] = scale / hull.length_m * (self.m22 * total[2] - self.m32 * total[1]) / determinant
        new[PSI] = r
        cos, sin = np.cos(psi), np.sin(psi)
        new[X] = u * cos - v * sin + self.drift[0]
        new[Y] = u * sin + v * cos + self.drift[1]
        return [new, *rates]


@dataclass(frozen=True)
class Tick:
    """The begin of a tick: time (s), number of steps in it, states, order and rudder (rad), n/n_0."""

    t: float
    steps: int
    states: list[Array]
    order: Array
    rudder: Array
    rpm_ratio: Array


def integrate(lanes: Sequence[Lane], watch: Callable[[Batch, Tick], None] | None = None) -> dict[str, Array]:
    """Histories (ticks, n) at 10 Hz of `RECORDED`: SI and radians, order in degrees to starboard, n in rpm."""
    batch = Batch(lanes)
    helm = Helm([lane.manoeuvre for lane in lanes])
    ship = np.zeros((6, batch.n))
    ship[U] = [lane.manoeuvre.start_speed_mps for lane in lanes]
    ship[PSI] = np.radians([lane.manoeuvre.heading_deg for lane in lanes])
    states = [ship, *(memory.start() for memory in batch.memories)]
    ticks = round(batch.duration_s / TICK_S) + 1
    history = {name: np.empty((ticks, batch.n)) for name in RECORDED}
    step_s = min(TICK_S / 2.0, batch.hull.gear_time_s / 20.0)
    steps = round(TICK_S / step_s)
    step_s = TICK_S / steps
    for tick in range(ticks):
        ship = states[0]
        helm.give(tick, np.degrees(ship[PSI]), np.degrees(ship[R]))
        for name, values in zip(RECORDED, (*ship, helm.order_deg, helm.rpm), strict=True):
            history[name][tick] = values
        order, rpm_ratio = np.radians(helm.order_deg), helm.rpm / batch.hull.rpm
        for step in range(steps if tick < ticks - 1 else 0):
            t = tick * TICK_S + step * step_s
            rudder, rudder_next = batch.gear.advance(order, t, step_s)
            if watch and not step:
                watch(batch, Tick(t, steps, states, order, rudder, rpm_ratio))
            first = batch.rates(t, states, rpm_ratio, rudder)
            guess = [state + step_s * rate for state, rate in zip(states, first, strict=True)]
            second = batch.rates(t + step_s, guess, rpm_ratio, rudder_next)
            states = [s + 0.5 * step_s * (a + b) for s, a, b in zip(states, first, second, strict=True)]
    return history
