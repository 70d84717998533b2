"""The clock of the rudder angle: a yaw rate that answers before the rudder moves."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray
from scipy.integrate import cumulative_trapezoid

from tank2sim.arrays import Array
from tank2sim.records.audit.finding import Finding
from tank2sim.records.audit.weak import on_uniform_time
from tank2sim.records.trials import Trial

_DEGREE = np.pi / 180
MOVED, STEADY = 5 * _DEGREE, 1 * _DEGREE
"""A rudder that goes so far, and noise within which it rests. Project choice: any execute, and any usual sensor."""
STEADY_ROWS, REACH_ROWS, MOVES = 6, 20, 3
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
    if len(moves) < MOVES:
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
    return [Finding(trial.path, (trial.heading("delta_rad"),), what, truth, "note", evidence)]


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
    once = _integral(change, step)
    straight = np.broadcast_to(np.column_stack([np.ones(len(rows)), rows - rows[0]]), (*taken.shape, 2))
    known = np.isfinite(rate[rows])
    table = np.concatenate([straight, once[..., None], _integral(once, step)[..., None]], axis=2)[:, known]
    wanted = rate[rows][known]
    size = np.sqrt(np.mean(table**2, axis=1, keepdims=True))
    directions, weights, _ = np.linalg.svd(table / np.where(size > 0, size, 1.0), full_matrices=False)
    # Without the directions that rounding alone makes: where the rudder has not moved yet, its columns are empty.
    independent = weights > np.finfo(float).eps * max(table.shape[1:]) * weights[:, :1]
    explained = directions @ (np.where(independent, wanted @ directions, 0.0)[..., None])
    squares: Array = np.sum((wanted - explained[..., 0]) ** 2, axis=1)
    return squares


def _integral(values: Array, step: float) -> Array:
    integral: Array = cumulative_trapezoid(values, dx=step, initial=0.0)
    return integral
