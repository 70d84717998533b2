"""Runs that a tank can make: candidates within its limits, and the usual matrix."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import chain, product

import numpy as np

from tank2sim.apps.design.tank_form import TankFile
from tank2sim.cards.writing import TestedRange
from tank2sim.errors import ArgumentError, InputError
from tank2sim.identification.captive.tank_conditions import (
    LARGEST_FREQUENCY_PARAMETER,
    LARGEST_REDUCED_FREQUENCY,
    OscillationMotion,
    tank_resonance,
)
from tank2sim.records.campaign_form import OSCILLATING, RunType

BELOW_LIMIT = 0.95
"""Share of the limit of omega U/g that candidates reach: `reduce` leaves out runs at it. Project choice: frequency and
speed err by some percent."""

_FREQUENCIES, _FREQUENCY_RATIO = 5, 4.0
"""Frequencies of candidates, and the ratio of the highest to the lowest. Project choice: finer steps change the
certainty by less than a percent, and lower frequencies show accelerations less and less."""
_DRIFTS, _RUDDERS, _AMPLITUDES, _MIXED = 6, 7, 4, 4
"""Levels of candidates in one direction: of drift, of rudder, of an oscillation, and of each motion in runs of two
motions. Project choice: the optimum of a polynomial of third order has at most four levels, near these."""
_STEADY_RECORDS, _OSCILLATING_RECORDS = (0.5, 0.1), (1.0, 0.5, 0.25)
"""Lengths of a candidate's record over the longest that the carriage has room for. Project choice: a steady record soon
shows no more than the zero error of its run, and what a shorter one saves is less than the waiting time."""


@dataclass(frozen=True, kw_only=True)
class PlannedRun:
    """One run of a plan; SI, rudder positive to starboard.

    `type`: as in ``[[runs]]`` of a campaign; `frequency_radps`: 0 in a steady run; `velocity`: amplitude of v (m/s) in
    pure sway, of r (rad/s) in yaw; `speed_mps`: U; `record_s`, `tank_s`: length of the record, and time in the tank
    until the next run can start.
    """

    type: RunType
    drift_rad: float = 0.0
    rudder_rad: float = 0.0
    frequency_radps: float = 0.0
    velocity: float = 0.0
    speed_mps: float
    record_s: float
    tank_s: float

    @property
    def motion(self) -> str:
        """``sway`` or ``yaw``; empty in a steady run."""
        return oscillation_of(self.type)

    @property
    def oscillates(self) -> bool:
        """The model oscillates in it."""
        return bool(self.motion)

    @property
    def cycles(self) -> int:
        """Whole cycles of the record."""
        return round(self.record_s * self.frequency_radps / (2 * math.pi))

    @property
    def sway_amplitude_m(self) -> float:
        """Sideways amplitude of the mechanism, m: of the sway, or of the path of the yaw, U r_a/omega^2."""
        if self.motion == "sway":
            return self.velocity / self.frequency_radps
        return self.speed_mps * self.heading_amplitude_rad / self.frequency_radps if self.motion else 0.0

    @property
    def heading_amplitude_rad(self) -> float:
        """Amplitude of the heading, rad."""
        return self.velocity / self.frequency_radps if self.motion == "yaw" else 0.0

    @property
    def to_both_sides(self) -> RunGroup:
        """The run, and its mirror image if that is another run."""
        if not (self.drift_rad or self.rudder_rad):
            return (self,)
        return self, replace(self, drift_rad=-self.drift_rad + 0.0, rudder_rad=-self.rudder_rad + 0.0)


def oscillation_of(kind: RunType) -> str:
    """``sway`` or ``yaw``, in which the model oscillates in runs of a type; empty for steady ones."""
    return ("sway" if kind == "pure_sway" else "yaw") if kind in OSCILLATING else ""


RunGroup = tuple[PlannedRun, ...]
"""Runs that are made together: a steady run to both sides, or one run that is its own mirror image."""


@dataclass(frozen=True, kw_only=True)
class TankRuns:
    """Runs of a model in a tank.

    `length_m`, `speed_mps`: length and speed of the model, and of the test; `largest`: to which the tests go, before
    the limits of the mechanism.
    """

    tank: TankFile
    length_m: float
    speed_mps: float
    largest: TestedRange

    def __post_init__(self) -> None:
        fastest = self.tank.carriage.speed_mps
        if fastest is not None and self.speed_mps > fastest:
            problem = f"is {fastest:g} m/s, and the test speed {self.speed_mps:.3g}"
            raise InputError("tank", "carriage.speed_mps", problem, "take a shorter model, or a lower test speed")
        if self.longest_s <= 0:
            way = self.speed_mps**2 / self.tank.carriage.acceleration_mps2
            problem = (
                f"is {self.tank.carriage.length_m:g} m, and start and stop at {self.speed_mps:.3g} m/s take {way:.3g} m"
            )
            raise ArgumentError("carriage_length_m", "", problem, "take a longer one, or a shorter model")

    @property
    def longest_s(self) -> float:
        """Longest record, s: what is left of the carriage's way after start, settling and stop."""
        carriage = self.tank.carriage
        way = self.speed_mps**2 / carriage.acceleration_mps2 + carriage.settling_lengths * self.length_m
        return (carriage.length_m - way) / self.speed_mps

    @property
    def drift_rad(self) -> float:
        """Largest drift angle."""
        return min(self.largest.drift_rad, self.tank.mechanism.drift_rad or math.inf)

    @property
    def rudder_rad(self) -> float:
        """Largest rudder angle."""
        return min(self.largest.rudder_rad, self.tank.mechanism.rudder_rad or math.inf)

    @property
    def yaw_rate_radps(self) -> float:
        """Largest yaw rate."""
        return self.largest.yaw_rate_prime * self.speed_mps / self.length_m

    def largest_velocity(self, motion: str) -> float:
        """Largest amplitude of v (m/s) in ``sway``, of r (rad/s) in ``yaw``."""
        return self.speed_mps * math.sin(self.drift_rad) if motion == "sway" else self.yaw_rate_radps

    def highest_frequency(self, motion: str) -> float:
        """Highest frequency of ``sway`` or ``yaw``, rad/s."""
        mechanism, model = self.tank.mechanism, self.tank.model
        return min(
            BELOW_LIMIT * LARGEST_FREQUENCY_PARAMETER * model.gravity_mps2 / self.speed_mps,
            LARGEST_REDUCED_FREQUENCY[motion] * self.speed_mps / self.length_m,
            mechanism.highest_frequency_radps or math.inf,
        )

    def lowest_frequency(self) -> float:
        """Lowest frequency with the fewest cycles in the longest record, rad/s."""
        mechanism = self.tank.mechanism
        return max(mechanism.cycles * 2 * math.pi / self.longest_s, mechanism.lowest_frequency_radps or 0.0)

    def frequencies(self, motion: str, count: int, ratio: float) -> list[float]:
        """Frequencies of a motion, rising, off the standing waves of the tank.

        Raises InputError: the carriage is too short for the fewest cycles at any allowed frequency.
        """
        highest, lowest = self.highest_frequency(motion), self.lowest_frequency()
        if lowest > highest:
            problem = (
                f"leaves {self.longest_s:.3g} s of record, and {self.tank.mechanism.cycles} cycles of {motion} at the "
                f"highest frequency ({highest:.3g} rad/s) need {self.tank.mechanism.cycles * 2 * math.pi / highest:.3g}"
            )
            raise ArgumentError("carriage_length_m", f"{self.tank.carriage.length_m:g}", problem, "take a longer one")
        found = np.geomspace(max(lowest, highest / ratio), highest, count) if lowest < highest else np.array([highest])
        return [frequency for frequency in found.tolist() if not self._resonant(motion, frequency)]

    def _resonant(self, motion: str, frequency: float) -> bool:
        run = OscillationMotion("", motion, frequency)
        return any(caution.runs for caution in tank_resonance((run,), self.tank.tank, self.tank.model.gravity_mps2))

    def steady(self, kind: RunType, drift: float = 0.0, rudder: float = 0.0, share: float = 1.0) -> RunGroup:
        """A steady run and its mirror image."""
        return self.run(kind, share * self.longest_s, drift=drift, rudder=rudder).to_both_sides

    def oscillating(
        self,
        kind: RunType,
        frequency: float,
        velocity: float,
        drift: float = 0.0,
        share: float = 1.0,
        *,
        rudder: float = 0.0,
    ) -> RunGroup:
        """An oscillating run of whole cycles, with drift or rudder also to the other side; () if the tank cannot make
        it."""
        mechanism, period = self.tank.mechanism, 2 * math.pi / frequency
        cycles = math.floor(share * self.longest_s / period + 1e-9)
        run = self.run(kind, cycles * period, drift=drift, rudder=rudder, frequency=frequency, velocity=velocity)
        possible = (
            run.sway_amplitude_m <= (mechanism.sway_amplitude_m or math.inf)
            and run.heading_amplitude_rad <= (mechanism.heading_amplitude_rad or math.inf)
            and cycles >= mechanism.cycles
        )
        return run.to_both_sides if possible else ()

    def longest_run(
        self, kind: RunType, *, drift: float, rudder: float, frequency: float = 0.0, velocity: float = 0.0
    ) -> PlannedRun:
        """A run with the longest record; of whole cycles, at least one, if it oscillates."""
        record = self.longest_s
        if frequency:
            period = 2 * math.pi / frequency
            record = max(math.floor(record / period + 1e-9), 1) * period
        return self.run(kind, record, drift=drift, rudder=rudder, frequency=frequency, velocity=velocity)

    def run(
        self,
        kind: RunType,
        record_s: float,
        *,
        drift: float = 0.0,
        rudder: float = 0.0,
        frequency: float = 0.0,
        velocity: float = 0.0,
    ) -> PlannedRun:
        """A run with its time in the tank: start, settling, record, stop, and waiting or the way back."""
        carriage = self.tank.carriage
        speed = self.speed_mps
        sailing = 2 * speed / carriage.acceleration_mps2 + carriage.settling_lengths * self.length_m / speed + record_s
        way = speed**2 / carriage.acceleration_mps2 + carriage.settling_lengths * self.length_m + record_s * speed
        return PlannedRun(
            type=kind,
            drift_rad=drift,
            rudder_rad=rudder,
            frequency_radps=frequency,
            velocity=velocity,
            speed_mps=speed,
            record_s=record_s,
            tank_s=sailing + max(carriage.waiting_s, way / carriage.return_speed_mps),
        )

    def candidates(self, own: Sequence[RunGroup] = ()) -> tuple[RunGroup, ...]:
        """All candidate runs: also the `own` ones of a tank, and yaw with a rudder angle if any of these has one."""
        with_rudder = any(run.oscillates and run.rudder_rad for group in own for run in group)
        more = self._yaw_with_rudder() if with_rudder else ()
        return tuple(group for group in (*self._candidates(), *more, *own) if group)

    def _steady_runs(self, mixed_drifts: int, mixed_rudders: int, share: float = 1.0) -> Iterator[RunGroup]:
        """A straight run, runs with drift, with rudder, and with so many levels of both."""
        yield self.steady("static_drift", share=share)
        yield from (self.steady("static_drift", drift, share=share) for drift in _levels(self.drift_rad, _DRIFTS))
        yield from (self.steady("static_rudder", 0.0, rudder, share) for rudder in _levels(self.rudder_rad, _RUDDERS))
        drifts, rudders = _levels(self.drift_rad, mixed_drifts), _levels(self.rudder_rad, mixed_rudders)
        for drift, rudder, side in product(drifts, rudders, (1, -1)):
            yield self.steady("drift_and_rudder", drift, side * rudder, share)

    def _swaying(self, frequencies: Sequence[float], share: float = 1.0) -> Iterator[RunGroup]:
        for frequency, v in product(frequencies, _levels(self.largest_velocity("sway"), _AMPLITUDES)):
            yield self.oscillating("pure_sway", frequency, v, share=share)

    def _candidates(self) -> Iterator[RunGroup]:
        sways, yaws = (self.frequencies(motion, _FREQUENCIES, _FREQUENCY_RATIO) for motion in ("sway", "yaw"))
        for share in _STEADY_RECORDS:
            yield from self._steady_runs(_MIXED, _MIXED, share)
        for share in _OSCILLATING_RECORDS:
            yield from self._swaying(sways, share)
            for frequency, rate in product(yaws, _levels(self.yaw_rate_radps, _AMPLITUDES)):
                yield self.oscillating("pure_yaw", frequency, rate, share=share)
                for drift in _levels(self.drift_rad, _MIXED):
                    yield self.oscillating("yaw_with_drift", frequency, rate, drift, share)

    def _yaw_with_rudder(self) -> Iterator[RunGroup]:
        yaws = self.frequencies("yaw", _FREQUENCIES, _FREQUENCY_RATIO)
        rates, rudders = _levels(self.yaw_rate_radps, _AMPLITUDES), _levels(self.rudder_rad, _MIXED)
        for share, frequency, rate, rudder in product(_OSCILLATING_RECORDS, yaws, rates, rudders):
            yield self.oscillating("pure_yaw", frequency, rate, share=share, rudder=rudder)

    def usual_matrix(self) -> tuple[RunGroup, ...]:
        """The usual matrix: all types of test of ITTC 7.5-02-06-02, in even steps to the same limits.

        Project choice, as the procedure leaves numbers to the tank: a straight run; six drift angles and seven rudder
        angles to either side; three drift angles with two rudder angles to either side; sway and yaw with four
        amplitudes at three frequencies; yaw with three drift angles to either side and three amplitudes.
        """
        sways, yaws = self.usual_frequencies("sway"), self.usual_frequencies("yaw")
        groups = [*self._steady_runs(3, 2), *self._swaying(sways)]
        rates = _levels(self.yaw_rate_radps, _AMPLITUDES)
        groups += [self.oscillating("pure_yaw", frequency, rate) for frequency, rate in product(yaws, rates)]
        middle = yaws[len(yaws) // 2 :][:1]
        with_drift = product(middle, _levels(self.drift_rad, 3), _levels(self.yaw_rate_radps, 3))
        groups += [self.oscillating("yaw_with_drift", frequency, rate, drift) for frequency, drift, rate in with_drift]
        return tuple(group for group in groups if group)

    def usual_frequencies(self, motion: str) -> list[float]:
        """Frequencies of a motion in the usual matrix, rising."""
        return self.frequencies(motion, 3, 2.0)

    def check_runs(self, planned: Sequence[RunGroup]) -> tuple[RunGroup, ...]:
        """Runs that the planned ones lack to show whether the polynomial holds, and whether the forces are delayed.

        An optimal design for a polynomial may have no run that could contradict it. Project choice: a straight run;
        each motion between a fifth and four fifths of its range; and two frequencies of sway and of yaw, by which
        `reduce` distinguishes a delay of the forces from added mass.
        """
        runs = list(chain.from_iterable(planned))
        steady, share = [run for run in runs if not run.oscillates], _STEADY_RECORDS[-1]
        groups: list[RunGroup] = []
        if all(run.drift_rad or run.rudder_rad for run in steady):
            groups.append(self.steady("static_drift", share=share))
        if not _any_between((run.drift_rad for run in steady), self.drift_rad):
            groups.append(self.steady("static_drift", self.drift_rad / 2, share=share))
        if not _any_between((run.rudder_rad for run in runs), self.rudder_rad):
            groups.append(self.steady("static_rudder", 0.0, self.rudder_rad / 2, share))
        return (*groups, *self._oscillating_checks("pure_sway", runs), *self._oscillating_checks("pure_yaw", runs))

    def _oscillating_checks(self, kind: RunType, planned: Sequence[PlannedRun]) -> Sequence[RunGroup]:
        """Runs at half the largest velocity, highest and lowest frequency, unless there are such ones."""
        motion = oscillation_of(kind)
        largest, runs = self.largest_velocity(motion), [run for run in planned if run.motion == motion]
        used = {run.frequency_radps for run in runs}
        every = (
            self.oscillating(kind, frequency, largest / 2, share=_OSCILLATING_RECORDS[1])
            for frequency in self.usual_frequencies(motion)
        )
        fitting = [group for group in every if group]
        if _any_between((run.velocity for run in runs), largest) and len(used) > 1:
            return []
        extremes = fitting[:: max(len(fitting) - 1, 1)]
        if not used or not fitting:
            return extremes
        return [max(extremes, key=lambda group: min(abs(group[0].frequency_radps - other) for other in used))]


def _any_between(values: Iterable[float], largest: float) -> bool:
    return any(0.2 * largest <= abs(value) <= 0.8 * largest for value in values)


def _levels(largest: float, count: int) -> list[float]:
    """Even steps up to the largest."""
    return [largest * step / count for step in range(1, count + 1)]


def time_of(groups: Sequence[RunGroup]) -> float:
    """Time in the tank of all runs, s."""
    return sum(run.tank_s for group in groups for run in group)
