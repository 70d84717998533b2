"""Rudder against the turn, rudder angle against rudder order, and the clock of the rudder angle."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray
from scipy.integrate import cumulative_trapezoid

from tank2sim.arrays import Array
from tank2sim.records.audit.finding import Finding, changed, found_in, negated, noted_in
from tank2sim.records.audit.noise import record_noise
from tank2sim.records.audit.weak import (
    FEWEST_WINDOWS,
    AuditWindows,
    fit,
    known_rms,
    on_uniform_time,
    windows_for,
    windows_of,
)
from tank2sim.records.trials import RUDDERS, Trial

SIDEWAYS = np.pi / 2
"""No rudder turns as far; beyond it an angle is not in its unit."""

FAR_OVER = np.deg2rad(8.0)
"""Rudder that leaves the spiral loop of any usual course-unstable ship: it then turns with its rudder."""
_STEADY = 0.9
"""Cosine between rudder and rate of turn from which a turn is steady. Project choice, as the one above."""


MOVES = 0.3
"""Spread of a rudder over its size from which it is moved about, not held: project choice."""


def rudder_unit_findings(trial: Trial) -> list[Finding]:
    """Unit of the rudder angle and of the order."""
    findings = []
    for name in _rudders_in(trial.signals):
        largest = float(np.nanmax(np.abs(trial.signals[name])))
        degrees, in_degrees = float(np.rad2deg(largest)), "deg" in trial.heading(name)
        if largest > SIDEWAYS:
            known = largest < np.rad2deg(SIDEWAYS)
            truth = "it is in degrees under the name of radians" if known else "it is not a rudder angle"
            repair = changed([name], np.deg2rad, f"{name}: {truth}") if known and not in_degrees else None
            what = f"the rudder angle reaches {degrees:.4g} deg"
            findings.append(found_in(trial, [name], what, truth, {"largest_deg": degrees}, repair))
        elif in_degrees and _turns_too_far(trial, largest):
            what = f"a rudder of {degrees:.3g} deg at most turns the ship far"
            truth = "it is in radians under the name of degrees"
            repair = changed([name], np.rad2deg, f"{name}: {truth}")
            if rudder_response(repair(trial), name):
                evidence = {"largest_deg": degrees}
                findings.append(found_in(trial, [name], what, truth, evidence, repair))
    return findings


def _turns_too_far(trial: Trial, largest: float) -> bool:
    """Whether the heading changes 57 times as far as a rudder that stays below 45 deg in radians."""
    if "psi_rad" in trial.signals:
        heading = trial.signals["psi_rad"]
    elif "r_radps" in trial.signals:
        rate = trial.signals["r_radps"]
        known = np.isfinite(rate)
        heading = cumulative_trapezoid(rate[known], trial.time_s[known], initial=0.0)
    else:
        return False
    turned = np.nanmax(heading) - np.nanmin(heading)
    return bool(largest <= np.deg2rad(np.pi / 4) and turned > largest * 180 / np.pi)


def rudder_findings(trial: Trial) -> list[Finding]:
    """Sign of the rudder angle and of the order, in their right unit, and where one does not follow the other."""
    responses = {name: rudder_response(trial, name) for name in _rudders_in(trial.signals)}
    findings = [_wrong_sign(trial, name, response) for name, response in responses.items() if response < 0]
    return findings or _saturation(trial)


def rudder_response(trial: Trial, name: str | None = None) -> float:
    """Positive if a rudder to starboard turns the ship to starboard, negative if to port, 0 if undetermined.

    First by b of dr/dt = a r + b delta + c, and then in its standard errors.

    The linear equation of Nomoto (1957) in the weak form, with a and c free, so that a course-unstable ship or one
    that carries rudder is judged alike: a rudder to starboard (b > 0) accelerates the turn to starboard. What happens
    with the propeller stopped or astern, or with the ship going astern, is left out: the rudder's force may reverse.
    Else, and wherever the rudder hardly moves, by a steady turn: +-1 if the rudder is far over and the ship turns, one
    proportional to the other. In a turn recorded from its execute b rests on a second or two, and its standard error
    does not know that the equation is none of a ship that loses speed.
    """
    step, signals = on_uniform_time(trial)
    present = _rudders_in(signals, (name,) if name else RUDDERS)
    if not present or not signals.keys() & {"r_radps", "psi_rad"}:
        return 0.0
    windows, r, change = _turning(signals, record_noise(trial), step)
    rudder = np.where(_ahead(signals, len(signals[present[0]])), signals[present[0]], np.nan)
    mean = windows.mean(rudder)
    steady = _steady_turn(r, mean)
    found = fit(change, [r, mean, np.ones(len(r))])
    if found is not None and found.differs(1) and not (steady and np.nanstd(mean) < MOVES * known_rms(mean)):
        return float(found.values[1] / found.errors[1])
    return steady


def _rudders_in(signals: Mapping[str, Array], among: Sequence[str] = RUDDERS) -> list[str]:
    return [name for name in among if name in signals]


def _ahead(signals: Mapping[str, Array], rows: int) -> NDArray[np.bool_]:
    """Rows (n,) in which neither the propeller nor the ship goes astern or is stopped."""
    ahead = np.ones(rows, dtype=bool)
    for name in {"n_radps", "u_mps"} & signals.keys():
        ahead &= ~(signals[name] <= 0)
    return ahead


def _turning(
    signals: Mapping[str, Array], noise: Mapping[str, float], step: float
) -> tuple[AuditWindows, Array, Array]:
    """Windows, and the rate of turn and its change in them (windows,), by the yaw rate, else by the heading."""
    if "r_radps" in signals:
        rate = signals["r_radps"]
        windows = windows_for(noise["r_radps"], known_rms(rate) / 10, step, len(rate))
        return windows, windows.mean(rate), windows.rate(rate)
    heading = signals["psi_rad"]
    windows = windows_of(heading, noise["psi_rad"], step)
    return windows, windows.rate(heading), windows.acceleration(heading)


def _steady_turn(rate: Array, rudder: Array) -> float:
    whole = np.isfinite(rate) & np.isfinite(rudder)
    rate, rudder = rate[whole], rudder[whole]
    if rate.size < FEWEST_WINDOWS or known_rms(rudder) < FAR_OVER:
        return 0.0
    likeness = float(np.sum(rate * rudder) / max(known_rms(rate) * known_rms(rudder) * rate.size, 1e-300))
    return float(np.sign(likeness)) if abs(likeness) > _STEADY else 0.0


def _wrong_sign(trial: Trial, name: str, response: float) -> Finding:
    what = "a positive rudder turns the ship to port"
    truth = "the rudder is positive to port (rudder_sign: port); or heading, rate of turn, v and y all are"
    repair = changed([name], negated, f"{name}: positive to port in the file, by the turn that it causes")
    return found_in(trial, [name], what, truth, {"standard_errors_from_zero": response}, repair)


def _saturation(trial: Trial) -> list[Finding]:
    """A rudder that stays at its largest angle while more is ordered."""
    if not set(RUDDERS) <= set(trial.signals):
        return []
    angle, order = (trial.signals[name] for name in RUDDERS)
    stop = float(np.nanmax(np.abs(angle)))
    at_stop = np.abs(angle) > 0.995 * stop
    beyond = at_stop & (np.abs(order) > 1.05 * stop)
    # half of the time at the stop: more than passing by on the way to the order
    if not at_stop.any() or np.count_nonzero(beyond) < 0.5 * np.count_nonzero(at_stop) or beyond.sum() < 10:
        return []
    share = float(np.mean(beyond))
    what = f"the rudder stays at {np.rad2deg(stop):.3g} deg while more is ordered, {100 * share:.2g} % of the time"
    truth = "the steering gear or the sensor saturates there"
    evidence = {"stop_deg": float(np.rad2deg(stop)), "share": share}
    return [noted_in(trial, ["delta_rad"], what, truth, evidence)]


_DEGREE = np.pi / 180
MOVED, STEADY = 5 * _DEGREE, 1 * _DEGREE
"""A rudder that goes so far, and noise within which it rests. Project choice: any execute, and any usual sensor."""
STEADY_ROWS, REACH_ROWS, FEWEST_MOVES = 6, 20, 3
"""Rows at rest before a movement, rows in which the yaw rate comes half-way, and movements: fewer show no clock."""
LATE = 0.17
"""Lateness, as a share of the time in which the yaw rate comes half-way, that is not due to the short-time expansion:
free-running models with right clocks (KVLCC2 of HSVA and MARIN, Esso Osaka) stay below 0.15."""
_FARTHEST = 0.6
"""Largest share that is determined: beyond, the yaw rate has come half-way without the rudder. Project choice."""
_AGREEING = 0.3
"""How far the middle half of the movements, one by one, may be from their common lateness, over it. A delay is the same
in all of them; the phase of a loop (a helm or autopilot that answers the yaw, and gusts) is not. Project choice."""
_BETTER = 2.0
"""Ratio of the sums of squares without and with the shift; wind alone gives up to 1.4. Project choice."""


@dataclass(frozen=True)
class _Move:
    """First and last row of a window, the last row before the rudder moves, and the rows to half-way of the answer."""

    begin: int
    row: int
    end: int
    reach: int


def rudder_clock_findings(trial: Trial) -> list[Finding]:
    """A rudder angle that is late. An early one, or an order, cannot be distinguished from a slow ship or steering
    gear; and nothing is found where the movements do not agree, as in feedback of a yaw that gusts drive.

    Shortly after a rudder moves, r = a + b t + c I + d J, with I the integral over time of the change of the rudder
    and J that of I: the first terms of the answer of any linear ship, none of which comes before its cause. The shift
    of the rudder that leaves least, common to all movements, is its lateness.
    """
    if not {"delta_rad", "r_radps"} <= set(trial.signals):
        return []
    step, signals = on_uniform_time(trial)
    rudder, rate = signals["delta_rad"], signals["r_radps"]
    if not np.isfinite(rudder).all():
        return []
    moves = _moves(rudder, rate)
    if len(moves) < FEWEST_MOVES:
        return []
    reach = int(np.median([move.reach for move in moves]))
    shifts = np.arange(-reach, reach + 1, max(1, reach // 40))
    each = np.array([_squares(move, rudder, rate, step, shifts) for move in moves])
    squares = each.sum(axis=0)
    best, least = int(np.argmin(squares)), LATE * reach
    late = float(shifts[best]) * step
    unshifted = float(squares[np.argmin(np.abs(shifts))])
    if not least < shifts[best] < _FARTHEST * reach or unshifted < _BETTER * squares[best]:
        return []
    quarters = np.percentile(shifts[np.argmin(each, axis=1)], [25, 75])  # of the movements one by one
    if np.abs(quarters - shifts[best]).max() > _AGREEING * shifts[best]:
        return []
    what = f"the yaw rate answers {late:.3g} s before the rudder moves, in {len(moves)} movements"
    truth = f"the rudder is late by about {late:.2g} s (its clock, or a filter in the sensor)"
    evidence = {
        "delay_s": late,
        "movements": float(len(moves)),
        "squares_ratio": unshifted / max(squares[best], 1e-300),
    }
    return [noted_in(trial, ["delta_rad"], what, truth, evidence)]


def _moves(rudder: Array, rate: Array) -> list[_Move]:
    """Movements out of a rest, each with a window as long before as after it, up to the next."""
    starts: list[tuple[int, int, int]] = []
    width = 5 * REACH_ROWS
    whole = np.median(sliding_window_view(rudder, width), axis=1) if len(rudder) >= width else rudder[:0]
    steady_row, row = 0, 1
    while row < len(rudder):
        begin = max(steady_row, row - width)
        middle = float(whole[begin] if row - begin == width else np.median(rudder[begin:row]))
        if abs(rudder[row] - middle) <= STEADY:
            row += 1
            continue
        side = np.sign(rudder[row] - middle)
        last = _end_of_move(rudder * side, row)
        if abs(rudder[last] - middle) > MOVED:
            starts.append((steady_row, row - 1, last))
        steady_row, row = last, last + 1
    ends = [*(start for _, start, _ in starts), len(rudder) - 1][1:]
    return [move for start, end in zip(starts, ends, strict=True) if (move := _move(start, end, rate)) is not None]


def _end_of_move(rising: Array, row: int) -> int:
    last = row
    while row + 1 < len(rising) and row - last < STEADY_ROWS:
        row += 1
        if rising[row] > rising[last] + 0.1 * STEADY:
            last = row
    return last


def _move(start: tuple[int, int, int], end: int, rate: Array) -> _Move | None:
    steady_row, row, last = start
    if row - steady_row < STEADY_ROWS or end - last < STEADY_ROWS:
        return None
    before = rate[max(steady_row, row - 10) : row + 1]
    answer = rate[row:end]
    if not np.isfinite(before).any() or not np.isfinite(answer).any():
        return None
    away = np.abs(answer - np.nanmedian(before))
    reach = int(np.argmax(away > 0.5 * np.nanmax(away)))
    if reach < REACH_ROWS:
        return None
    return _Move(max(steady_row, row - reach), row, min(end, row + reach), reach)


def _squares(move: _Move, rudder: Array, rate: Array, step: float, shifts: NDArray[np.int_]) -> Array:
    """Sums of squares that the answer to the rudder, taken so many rows later in the record, leaves of r: (shifts,)."""
    rows = np.arange(move.begin, move.end)
    taken = np.clip(rows + shifts[:, None], 0, len(rudder) - 1)
    change = np.where(taken <= move.row, 0.0, rudder[taken] - rudder[move.row])
    once = cumulative_trapezoid(change, dx=step, initial=0.0)
    straight = np.broadcast_to(np.column_stack([np.ones(len(rows)), rows - rows[0]]), (*taken.shape, 2))
    known = np.isfinite(rate[rows])
    twice = cumulative_trapezoid(once, dx=step, initial=0.0)
    table = np.concatenate([straight, once[..., None], twice[..., None]], axis=2)[:, known]
    wanted = rate[rows][known]
    size = np.sqrt(np.mean(table**2, axis=1, keepdims=True))
    directions, weights, _ = np.linalg.svd(table / np.where(size > 0, size, 1.0), full_matrices=False)
    # Without the directions that rounding alone makes: where the rudder has not moved yet, its columns are empty.
    independent = weights > np.finfo(float).eps * max(table.shape[1:]) * weights[:, :1]
    explained = directions @ (np.where(independent, wanted @ directions, 0.0)[..., None])
    return np.asarray(np.sum((wanted - explained[..., 0]) ** 2, axis=1))
