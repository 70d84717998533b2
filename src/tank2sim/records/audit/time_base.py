"""The time column: rising, gaps, repeated rows, few digits, uneven steps; another unit or another clock."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import cumulative_trapezoid

from tank2sim.arrays import Array
from tank2sim.records.audit.finding import Finding, Repair, found_in, noted_in
from tank2sim.records.trials import Trial, sampling_step, select_rows, with_signals

GAP = 1.5
"""Steps between rows from which samples are missing: half-way to the first lost one."""
UNEVEN = 0.1
"""Scatter of the step, as a share of it, worth a word: beyond any rounding of a uniform time to two digits."""

STRAY = 20.0
"""Times the duration of the middle half of a record from its middle, ten times the record: no row of one manoeuvre is
as far away. Project choice; it also bounds the memory that later checks take."""
_FEW = 0.05
"""Share of rows with stray times up to which they are left out. Project choice, as for the readings of a sensor."""

_UNITS = {60.0: "minutes", 3600.0: "hours", 1e-3: "milliseconds"}  # Seconds in a unit of time, to its name

AGREEMENT = 0.03
"""How near both factors must come: 60 lies 4.7 % from the 57.3 of degrees that are radians."""

MISCALIBRATED = 0.15
"""Share by which a sensor's scale may be wrong; what differs by more is another quantity or another clock. Project
choice: three times the 5 % that IMO A.526(13) allows a rate-of-turn indicator, far above the 2 % that MSC.96(72)
allows a speed log."""

# The way is measured between this many points of a track, so that noise of the positions does not lengthen it
_POINTS = 50


def time_findings(trial: Trial) -> list[Finding]:
    """Faults of the time base, each with its correction."""
    stray = _stray(trial)
    if stray is None:
        return _of_steps(trial)
    return [stray] if stray.repair is None else [stray, *_of_steps(stray.repair(trial))]


def _stray(trial: Trial) -> Finding | None:
    """Times far from all others, such as an epoch among seconds."""
    early, middle, late = np.quantile(trial.time_s, [0.25, 0.5, 0.75])
    far = np.abs(trial.time_s - middle) > STRAY * max(late - early, 0.0)
    rows = np.flatnonzero(far)
    if rows.size == 0 or late <= early:
        return None
    first = int(rows[0])
    what = f"{rows.size} times are far from all others, first {trial.time_s[first]:.10g} in row {first + 1}"
    evidence = {"rows": float(rows.size), "first_row": float(first + 1)}
    if rows.size > max(1, _FEW * len(far)) or np.count_nonzero(~far) < 2:
        return found_in(trial, ["t_s"], what, "another clock or another recording", evidence)
    truth = "a time of another clock or a slip in these rows: they are left out"
    return found_in(trial, ["t_s"], what, truth, evidence, _of_rows(np.flatnonzero(~far), truth))


def _of_rows(rows: NDArray[np.int64], truth: str) -> Repair:
    """The repair that takes some rows, in this order."""
    return _noticed(lambda trial: select_rows(trial, rows), f"time: {truth}")


def _noticed(change: Repair, notice: str) -> Repair:
    """A change of a trial, and the notice of it."""
    return lambda trial: with_signals(change(trial), {}, notice)


def _of_steps(trial: Trial) -> list[Finding]:
    steps = np.diff(trial.time_s)
    if np.any(steps <= 0):
        return [_not_rising(trial, steps)]
    findings = []
    step = sampling_step(trial)
    scatter = 1.4826 * float(np.median(np.abs(steps - step))) / step  # of normal scatter, gaps left aside
    limit = max(GAP, 1 + 6 * scatter) * step
    wide = np.flatnonzero(steps > limit)
    if wide.size:
        longest = int(wide[np.argmax(steps[wide])])
        lost = int(np.sum(np.round(steps[wide] / step) - 1))
        what = f"{wide.size} gaps, the longest {steps[longest]:.3g} s at {trial.time_s[longest]:.6g} s"
        evidence = {"gaps": float(wide.size), "longest_s": float(steps[longest]), "samples": float(lost)}
        truth = f"about {lost} rows were not recorded"
        places = tuple((float(trial.time_s[row]), float(trial.time_s[row + 1])) for row in wide)
        findings.append(replace(noted_in(trial, ["t_s"], what, truth, evidence), places_s=places))
    if scatter > UNEVEN:
        what = f"the step between rows scatters by {100 * scatter:.0f} % about {step:.4g} s"
        truth = "the rows were recorded at uneven times, or stamped late"
        findings.append(noted_in(trial, ["t_s"], what, truth, {"scatter": scatter, "step_s": step}))
    return findings


def _not_rising(trial: Trial, steps: NDArray[np.float64]) -> Finding:
    """Which of the usual reasons explains a time that does not rise."""
    row = int(np.flatnonzero(steps <= 0)[0]) + 1
    at_fault = np.count_nonzero(steps <= 0)
    what = f"does not rise in {at_fault} rows, first in row {row + 1} ({trial.time_s[row]:.6g} s)"
    evidence = {"rows": float(at_fault), "first_row": float(row + 1)}
    repeated = np.flatnonzero(_repeats(trial)) + 1
    kept = np.delete(np.arange(len(trial.time_s)), repeated)
    sorted_rows = np.argsort(trial.time_s, kind="stable")
    rising = np.flatnonzero(trial.time_s > np.concatenate([[-np.inf], np.maximum.accumulate(trial.time_s)[:-1]]))
    if np.all(np.diff(trial.time_s[kept]) > 0):
        truth, rows = "rows are repeated to the last digit: each counts once", kept
    elif _rounded(trial, steps):
        return _uniform(trial, what, evidence)
    elif np.all(np.diff(trial.time_s[sorted_rows]) > 0):
        truth, rows = "the rows are not in the order of time: sorted", sorted_rows
    else:
        truth = "times are repeated or fall back: rows that do not come after all before them are left out"
        rows = rising
    found = found_in(trial, ["t_s"], what, truth, evidence, _of_rows(rows, truth))
    return replace(found, safe=len(rows) > 1)


def _repeats(trial: Trial) -> NDArray[np.bool_]:
    """Whether each row but the first is the one before it to the last digit, (n - 1,)."""
    alike: NDArray[np.bool_] = np.diff(trial.time_s) == 0
    for values in trial.signals.values():
        alike = alike & ((values[1:] == values[:-1]) | (np.isnan(values[1:]) & np.isnan(values[:-1])))
    return alike


def _rounded(trial: Trial, steps: NDArray[np.float64]) -> bool:
    """Whether a uniform time, rounded, gives these: it never falls, and each time is met to its rounding."""
    if np.any(steps < 0) or not np.any(steps > 0):
        return False
    even = np.linspace(trial.time_s[0], trial.time_s[-1], len(trial.time_s))
    # beyond half the rounding the end points, themselves rounded, may be out by as much again
    return bool(np.max(np.abs(even - trial.time_s)) <= np.max(steps[steps > 0]))


def _uniform(trial: Trial, what: str, evidence: dict[str, float]) -> Finding:
    count = np.arange(len(trial.time_s))
    step = float(np.polyfit(count, trial.time_s, 1)[0])
    truth = f"times are rounded: the step is uniform, {step:.5g} s"
    repair = _noticed(lambda other: replace(other, time_s=other.time_s[0] + step * count), f"time: {truth}")
    return found_in(trial, ["t_s"], what, truth, {**evidence, "step_s": step}, repair)


def time_unit_findings(trial: Trial) -> list[Finding]:
    """A finding if yaw and way agree on another rate of the clock; nothing where one of them was not measured.

    Heading and track then both change by one factor too fast for their rates. A known unit of time is repaired. Another
    rate is not: whether the clock was wrong or rows were left out or repeated, the record does not decide.
    """
    turned, gone = _turned(trial), _gone(trial)
    if turned is None or gone is None or abs(abs(turned) / gone - 1) > AGREEMENT:
        return []
    what = f"heading and track change {abs(turned):.4g} and {gone:.4g} times as fast as r and the velocities say"
    evidence = {"factor_heading": abs(turned), "factor_track": gone}
    unit = next((factor for factor in _UNITS if abs(gone / factor - 1) < AGREEMENT), None)
    if unit is not None:
        in_seconds = _noticed(
            lambda other: replace(other, time_s=unit * other.time_s),
            f"time was in {_UNITS[unit]} and is in seconds now",
        )
        return [found_in(trial, ["t_s"], what, f"time is in {_UNITS[unit]}", evidence, in_seconds)]
    if max(gone, 1 / gone) < 1 + MISCALIBRATED:
        return []
    truth = f"a second of the file is {gone:.3g} s: its clock or its sampling rate is another"
    return [found_in(trial, ["t_s"], what, truth, evidence)]


def _turned(trial: Trial) -> float | None:
    """Slope of the heading over the integral of the yaw rate."""
    if not {"psi_rad", "r_radps"} <= set(trial.signals):
        return None
    integral = _integral(trial.time_s, trial.signals["r_radps"])
    heading = trial.signals["psi_rad"]
    known = np.isfinite(heading)
    if integral is None or np.count_nonzero(known) < _POINTS or np.std(integral) == 0:
        return None
    return float(np.polyfit(integral[known], heading[known], 1)[0])


def _gone(trial: Trial) -> float | None:
    """Way of the track over the integral of the speed."""
    if not {"x_m", "y_m", "u_mps"} <= set(trial.signals):
        return None
    speed = np.hypot(trial.signals["u_mps"], trial.signals.get("v_mps", 0.0))
    way = _integral(trial.time_s, speed)
    if way is None:
        return None
    known = np.flatnonzero(np.isfinite(trial.signals["x_m"] + trial.signals["y_m"]))
    if len(known) < _POINTS:
        return None
    places = known[np.linspace(0, len(known) - 1, _POINTS).astype(int)]
    steps = np.hypot(np.diff(trial.signals["x_m"][places]), np.diff(trial.signals["y_m"][places]))
    through = float(way[places[-1]] - way[places[0]])
    return float(steps.sum()) / through if through > 0 and steps.sum() > 0 else None


def _integral(time: Array, values: Array) -> Array | None:
    """Integral of a signal (n,), taken as straight between its readings; None where it has fewer than two."""
    known = np.isfinite(values)
    if np.count_nonzero(known) < 2:
        return None
    return np.asarray(cumulative_trapezoid(np.interp(time, time[known], values[known]), time, initial=0.0))
