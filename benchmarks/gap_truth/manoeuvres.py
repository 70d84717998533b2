"""The thirteen trials of a set: headings, lengths, orders, and the helmsman who gives them ten times a second."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from gap_truth.ship import MARINER, Array, Hull

EXECUTE_S = 20.0
"""All rudder orders begin here (the Mariner's), after a straight stretch at rudder amidships."""

HELM_HEADING = 0.8
HELM_RATE_S = 10.0
"""Course keeping: order = -0.8 (psi - psi_0) - 10 s r; a choice of ours, well damped for the Mariner; the rate's
time goes with L/U."""


@dataclass(frozen=True)
class Manoeuvre:
    """One trial. `orders` and `revolutions` are (time s, value) steps, degrees to starboard and rpm."""

    heading_deg: float
    duration_s: float
    orders: tuple[tuple[float, float], ...] = ()
    revolutions: tuple[tuple[float, float], ...] = ()
    zigzag_deg: float = 0.0  # rudder and heading angle, negative: first to port; 0: no zigzag
    keeps_course: bool = False
    start_speed_mps: float = MARINER.speed_mps
    start_rpm: float = MARINER.rpm
    time: float = 1.0  # of the ship, over the Mariner's


_LOW_RPM = 0.6 * MARINER.rpm
_DIP_RPM = 0.8 * MARINER.rpm
_STEPS = (
    *((20.0, 12.4), (51.3, -6.1), (74.2, -15.8), (103.0, 3.7), (126.6, 18.9), (158.1, 9.2), (180.4, -11.3)),
    *((205.9, -22.6), (238.7, 5.0), (262.2, 16.1), (288.8, -2.9), (311.5, -17.4), (339.0, 21.7), (367.3, -8.4)),
    *((392.6, 13.5), (420.1, -19.8), (452.4, 7.6)),
)
_DIPS = ((51.3, _DIP_RPM), (74.2, MARINER.rpm), (205.9, _DIP_RPM), (238.7, MARINER.rpm), (339.0, _DIP_RPM))


def _turn(heading_deg: float, duration_s: float, angle_deg: float) -> Manoeuvre:
    return Manoeuvre(heading_deg, duration_s, orders=((EXECUTE_S, angle_deg),))


def _pull_out(heading_deg: float, angle_deg: float) -> Manoeuvre:
    return Manoeuvre(heading_deg, 480.0, orders=((EXECUTE_S, angle_deg), (EXECUTE_S + 200.0, 0.0)))


MANOEUVRES: dict[str, Manoeuvre] = {
    "zigzag20_20": Manoeuvre(0.0, 420.0, zigzag_deg=20.0),
    "zigzag10_10": Manoeuvre(90.0, 420.0, zigzag_deg=10.0),
    "turn35_stbd": _turn(0.0, 480.0, 35.0),
    "turn20_port": _turn(200.0, 540.0, -20.0),
    "pullout_stbd": _pull_out(120.0, 20.0),
    "straight": Manoeuvre(45.0, 300.0, keeps_course=True),
    "accel": Manoeuvre(
        270.0,
        420.0,
        revolutions=((30.0, MARINER.rpm),),
        keeps_course=True,
        start_speed_mps=0.6 * MARINER.speed_mps,
        start_rpm=_LOW_RPM,
    ),
    "turn35_port": _turn(150.0, 480.0, -35.0),
    "turn10_stbd": _turn(300.0, 540.0, 10.0),
    "zigzag15_15_port": Manoeuvre(240.0, 420.0, zigzag_deg=-15.0),
    "pullout_port": _pull_out(60.0, -20.0),
    "slowdown": Manoeuvre(180.0, 420.0, revolutions=((30.0, _LOW_RPM),), keeps_course=True),
    "random_steps": Manoeuvre(330.0, 480.0, orders=_STEPS, revolutions=(*_DIPS, (367.3, MARINER.rpm))),
}

FIT = ("zigzag20_20", "zigzag10_10", "turn35_stbd", "turn20_port", "pullout_stbd", "straight", "accel")
HOLDOUT = ("turn35_port", "turn10_stbd", "zigzag15_15_port", "pullout_port", "slowdown", "random_steps")


def at_size_of(hull: Hull, manoeuvre: Manoeuvre) -> Manoeuvre:
    """The same manoeuvre of another ship: times with L/U, revolutions and speeds with its own."""
    if hull is MARINER:
        return manoeuvre
    rpm = hull.rpm / MARINER.rpm
    return replace(
        manoeuvre,
        duration_s=round(manoeuvre.duration_s * hull.time, 1),
        orders=tuple((time * hull.time, angle) for time, angle in manoeuvre.orders),
        revolutions=tuple((time * hull.time, value * rpm) for time, value in manoeuvre.revolutions),
        start_speed_mps=manoeuvre.start_speed_mps * hull.speed_mps / MARINER.speed_mps,
        start_rpm=manoeuvre.start_rpm * rpm,
        time=hull.time,
    )


class Helm:
    """Rudder and revolution orders of all lanes, renewed every 0.1 s from the heading the helmsman sees."""

    def __init__(self, lanes: list[Manoeuvre]) -> None:
        self.order_deg: Array = np.zeros(len(lanes))
        self.rpm: Array = np.array([lane.start_rpm for lane in lanes])
        self._heading_deg: Array = np.array([lane.heading_deg for lane in lanes])
        self._course: NDArray[np.intp] = np.array([i for i, lane in enumerate(lanes) if lane.keeps_course], int)
        self._zigzag: NDArray[np.intp] = np.array([i for i, lane in enumerate(lanes) if lane.zigzag_deg], int)
        self._angle_deg: Array = np.array([lanes[i].zigzag_deg for i in self._zigzag])
        self._time = lanes[0].time
        self._events: dict[int, list[tuple[Array, int, float]]] = {}
        for i, lane in enumerate(lanes):
            for target, steps in ((self.order_deg, lane.orders), (self.rpm, lane.revolutions)):
                for time, value in steps:
                    self._events.setdefault(round(10.0 * time), []).append((target, i, value))

    def give(self, tick: int, psi_deg: Array, r_degps: Array) -> None:
        """Orders that hold from `tick` (0.1 s) until the next; heading and rate as the helmsman sees them."""
        for target, lane, value in self._events.get(tick, ()):
            target[lane] = value
        course, zigzag = self._course, self._zigzag
        off = psi_deg - self._heading_deg
        self.order_deg[course] = -HELM_HEADING * off[course] - HELM_RATE_S * self._time * r_degps[course]
        execute = round(10.0 * EXECUTE_S * self._time)
        if tick == execute:
            self.order_deg[zigzag] = self._angle_deg
        elif tick > execute:
            order, limit = self.order_deg[zigzag], np.abs(self._angle_deg)
            passed = np.where(order > 0.0, off[zigzag] >= limit, off[zigzag] <= -limit)
            self.order_deg[zigzag] = np.where(passed, -order, order)
