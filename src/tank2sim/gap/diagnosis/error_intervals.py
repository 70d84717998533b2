"""Times of model errors: in its forces, or in the kinematics of position, heading and velocity."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from tank2sim.arrays import Array
from tank2sim.dynamics.effects import EFFECTS
from tank2sim.gap.diagnosis.kinematic_consistency import (
    CONTRADICTED,
    kinematic_consistency,
    readable,
    recorded_earth_velocity,
)
from tank2sim.gap.diagnosis.misfit_location import CLEAR, STATE_BINS, by_significance, exceedance_intervals
from tank2sim.gap.result import Acting, Gap, MissingForce, MissingSignal, Passed

SPAN = 84
"""Instants over which changes of position and heading are compared with their rates: 2 L/u0 (project choice: the
noise of two readings of position is then a few hundredths of a m/s for a ship)."""

TURNING, TRACK = ("turning",), ("north", "east", "ahead", "starboard")

EARTH_BOUND = ("kinematics", "sensor")
"""Equations of a gap in the motion over the ground or in a sensor: no force is missing."""


def acting(gap: Gap) -> tuple[Acting, ...]:
    """Times at which the model is wrong, the most significant first; empty if there are none.

    Contradictions of the records come before the forces, with which the smoother follows such records; where only
    kinematics or sensors are at fault there are no forces. Of a named effect the intervals are those in which its own
    force acts, else those in which the smoother needs one.
    """
    signals = {signal.quantity: signal for signal in _lacking(gap.passed)}
    messages = [*_passages("heading", [signals[name] for name in TURNING if name in signals])]
    messages += _passages("track", [signals[name] for name in TRACK[:2] if name in signals])
    force = missing_force_intervals(gap)
    return (*by_significance(messages), *(gap.at_work or (force.passages if force is not None else ())))


def missing_force_intervals(gap: Gap) -> MissingForce | None:
    """The force that the model lacks; None where nothing but kinematics or sensors is at fault."""
    if gap.equation in EARTH_BOUND and all(EFFECTS[effect.name].acts_on in EARTH_BOUND for effect in gap.effects):
        return None
    return gap.missing_force


def contradiction(gap: Gap) -> MissingSignal | None:
    """As :func:`missing_signal`, where the gap is in the kinematics or in a sensor; else None."""
    return missing_signal(gap.passed) if gap.equation in EARTH_BOUND else None


def missing_signal(passed: Sequence[Passed]) -> MissingSignal | None:
    """The contradiction of the records, in the quantity in which it is simplest; None if they agree.

    Of velocities to north and east, ahead and to starboard the one is reported that is largest and correlates best
    with a state of the ship: a current is constant in earth axes, a fault of the log is not.
    """
    found = _lacking(passed)
    return max(found, key=_simplicity, default=None)


def _simplicity(signal: MissingSignal) -> float:
    known = {name: share for name, share in signal.explained.items() if name != "heading"}
    return max(known.values(), default=0.0) * float(np.sum((signal.values / signal.errors) ** 2))


def _lacking(passed: Sequence[Passed]) -> list[MissingSignal]:
    """Each quantity in which the records contradict each other beyond :data:`CONTRADICTED`."""
    check = kinematic_consistency(passed)
    names = [*(TURNING if check.turning > CONTRADICTED else ()), *(TRACK if check.track > CONTRADICTED else ())]
    parts = [(replay, _series(replay)) for replay in passed]
    available = {name: [(replay, by_name) for replay, by_name in parts if name in by_name] for name in names}
    return [_joined(name, found) for name, found in available.items() if found]


def _series(replay: Passed) -> dict[str, tuple[Array, float]]:
    """Each quantity to its values (n,) around each instant, nan at the ends, and their standard error."""
    seen, noise = readable(replay)
    if len(replay.time_s) <= SPAN or "psi" not in seen:
        return {}
    series: dict[str, tuple[Array, float]] = {}
    span_s = SPAN * float(np.median(np.diff(replay.time_s)))

    def rate(values: Array) -> Array:
        return (values[SPAN:] - values[:-SPAN]) / span_s

    def error(of: float, of_rate: float) -> float:
        return math.hypot(math.sqrt(2) * of / span_s, of_rate / math.sqrt(SPAN))

    psi = seen["psi"]
    if "r" in seen:
        series["turning"] = _middle(rate(psi) - _mean(seen["r"])), error(noise["psi"], noise["r"])
    if {"x", "y", "u", "v"} <= seen.keys():
        north, east = (
            rate(seen[axis]) - _mean(over)
            for axis, over in zip("xy", recorded_earth_velocity(seen["u"], seen["v"], psi), strict=True)
        )
        # Turned into the ship's axes step by step: it may turn by much over the span.
        step, between = span_s / SPAN, 0.5 * (psi[1:] + psi[:-1])
        axial = recorded_earth_velocity(np.diff(seen["x"]) / step, np.diff(seen["y"]) / step, -between)
        ahead, starboard = (_sliding(over) - _mean(seen[name]) for name, over in zip("uv", axial, strict=True))
        speed = float(np.max(np.hypot(seen["u"], seen["v"])))
        track_error = error(
            math.hypot(noise["x"], noise["y"]) / math.sqrt(2), math.hypot(noise["u"], noise["v"], speed * noise["psi"])
        )
        tracks = zip(TRACK, (north, east, ahead, starboard), strict=True)
        series |= {name: (_middle(values), track_error) for name, values in tracks}
    return series


def _mean(values: Array) -> Array:
    """Means over the span by the trapezoidal rule (n - SPAN,)."""
    return _sliding(0.5 * (values[1:] + values[:-1]))


def _sliding(between: Array) -> Array:
    """Means over the span (n - SPAN,) of values between the instants (n - 1,)."""
    sums = np.concatenate([[0.0], np.cumsum(between)])
    means: Array = (sums[SPAN:] - sums[:-SPAN]) / SPAN
    return means


def _middle(values: Array) -> Array:
    half = SPAN // 2
    return np.concatenate([np.full(half, np.nan), values, np.full(SPAN - half, np.nan)])


def _joined(name: str, parts: Sequence[tuple[Passed, Mapping[str, tuple[Array, float]]]]) -> MissingSignal:
    """All trials' rows of a quantity, and the state that explains most of it."""
    trials, times, values, errors = [], [], [], []
    states: dict[str, list[Array]] = {}
    for replay, by_name in parts:
        series, error = by_name[name]
        rows = np.flatnonzero(np.isfinite(series))
        trials += [replay.name] * len(rows)
        times.append(replay.time_s[rows])
        values.append(series[rows])
        errors.append(np.full(len(rows), error))
        for state, column in _states(replay).items():
            states.setdefault(state, []).append(column[rows])
    whole, every = np.concatenate(values), {state: np.concatenate(columns) for state, columns in states.items()}
    whole_states = {state: column for state, column in every.items() if len(column) == len(whole)}
    explained = {
        state: _share(np.mod(v, 2 * math.pi) if state == "heading" else v, whole) for state, v in whole_states.items()
    }
    return MissingSignal(
        name,
        tuple(trials),
        np.concatenate(times),
        whole,
        np.concatenate(errors),
        whole_states,
        max(explained, key=lambda state: explained[state]),
        explained,
    )


def _states(replay: Passed) -> dict[str, Array]:
    seen, _ = readable(replay)
    states = {"heading": seen["psi"]}
    if "r" in seen:
        states["yaw rate"] = seen["r"]
    if {"u", "v"} <= seen.keys():
        states["speed"] = np.hypot(seen["u"], seen["v"])
        states["drift"] = -np.arctan2(seen["v"], np.maximum(seen["u"], 1e-9))
    return states


def _share(state: Array, values: Array) -> float:
    """Share of the mean square that means over bins of equal count explain: 1 for a constant, too."""
    edges = np.unique(np.quantile(state, np.linspace(0, 1, STATE_BINS + 1)))
    places = np.clip(np.searchsorted(edges, state, side="right") - 1, 0, max(len(edges) - 2, 0))
    count, sums = np.bincount(places), np.bincount(places, values)
    means = np.divide(sums, count, out=np.zeros_like(sums), where=count > 0)
    whole = float(values @ values)
    return max(0.0, 1 - float(np.sum((values - means[places]) ** 2)) / whole) if whole > 0 else 0.0


def _passages(equation: str, signals: Sequence[MissingSignal]) -> list[Acting]:
    """Intervals in which signals of the same rows are not noise, by the mean of their squares."""
    if not signals:
        return []
    of, found = signals[0], []
    z = np.sqrt(np.mean([(signal.values / signal.errors) ** 2 for signal in signals], axis=0))
    trials = np.array(of.trials, dtype=object)
    for trial in dict.fromkeys(of.trials):
        rows = np.flatnonzero(trials == trial)
        reach = SPAN / 2 * float(np.median(np.diff(of.time_s[rows]))) if len(rows) > 1 else 0.0
        for begin, end, excess in exceedance_intervals(z[rows], limit=CLEAR):
            first, last = (float(of.time_s[rows[place]]) for place in (begin, end - 1))
            # The first and the last value are held before and after.
            first, last = round(first - reach * (begin == 0), 9) + 0.0, last + reach * (end == len(rows))
            found.append(Acting(trial, equation, first, last, math.sqrt(1 + excess / (end - begin))))
    return found
