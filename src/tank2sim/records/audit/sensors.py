"""Each signal by itself: missing values, a sensor that does not change, spikes, values held between slower readings."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import median_filter
from scipy.special import ndtri

from tank2sim.arrays import Array, true_runs
from tank2sim.records.audit.finding import Finding, Repair, SeenPlaces, changed, found_in, noted_in
from tank2sim.records.audit.noise import DEGREE, WINDOW, record_noise, white_noise
from tank2sim.records.audit.weak import FALSE_ALARM
from tank2sim.records.trials import MEASURED_COLUMNS, Trial, sampling_step, with_signals

MOTIONS = tuple(name for name in MEASURED_COLUMNS if not name.startswith(("wind_", "current_")))
"""Signals that inertia makes smooth; wind may jump."""
SPIKE_SAMPLES = 3
"""A spike is this many samples long at most; what lasts longer is a step."""
SPIKE = 10.0
"""Standard deviations of a spike from its neighbours, for the noise of real sensors has longer tails than normal."""

PULSE = np.deg2rad(5.0)
"""Least spike of a rudder angle, whose noise is often none; a steering gear does not go and come back in three rows.
Project choice."""

# Share of a signal below which its noise is rounding of the arithmetic: the signal was calculated, not measured
_ROUNDING = 1e-9

_SHORT = 0.05
"""Share of a record up to which failed readings of one sensor are noted rather than called its fault: they are left
out, and nothing is lost. Project choice."""


def sensor_findings(trial: Trial) -> list[Finding]:
    """Faults of single sensors; failed values are repaired by leaving them out (nan)."""
    findings = []
    noise = record_noise(trial)
    for name, values in trial.signals.items():
        findings += _missing(trial, name, values)
        if name in MOTIONS and np.nanmax(values) == np.nanmin(values):
            findings += _frozen(trial, name, noise)
        elif name in MOTIONS:
            findings += _stuck(trial, name, values)
            findings += _spikes(trial, name, values, noise[name])
        elif name == "delta_rad":
            findings += _spikes(trial, name, values, 0.0, PULSE)
    return findings


def _missing(trial: Trial, name: str, values: Array) -> list[Finding]:
    missing = np.isnan(values)
    if not missing.any():
        return []
    runs = true_runs(missing)
    longest = max(runs, key=lambda run: run.stop - run.start)
    seconds, begin = (longest.stop - longest.start) * sampling_step(trial), trial.time_s[longest.start]
    what = f"{missing.sum()} values are missing, the longest time {seconds:.3g} s from {begin:.6g} s"
    evidence = {"values": float(missing.sum()), "runs": float(len(runs)), "longest_s": seconds}
    found = noted_in(trial, [name], what, "not recorded there", evidence)
    return [replace(found, places_s=_places(trial, runs))]


def _places(trial: Trial, rows: Sequence[slice]) -> SeenPlaces:
    """When runs of rows begin and end, s."""
    return tuple((float(trial.time_s[run.start]), float(trial.time_s[run.stop - 1])) for run in rows)


def _stuck(trial: Trial, name: str, values: Array) -> list[Finding]:
    """Runs of one value that chance (n p^k, p the share of others alike) or a smooth rest does not explain."""
    alike = np.append(np.diff(values) == 0, False)
    runs = true_runs(alike)
    if not runs:
        return []
    steps = np.abs(np.diff(values))
    moving = steps[steps > 0]
    if moving.size == 0:
        return []
    longest = max(run.stop - run.start for run in runs)
    others = alike.sum() - longest
    chance = max(float(others / max(len(values) - longest, 1)), 1 / len(values))
    if chance > 0.5:  # rests more often than not: no sensor of a motion, or one far too coarse to judge
        return []
    least = np.log(len(values) / FALSE_ALARM) / -np.log(chance)
    noisy, usual = _noisy(values, moving), float(np.quantile(moving, 0.9))
    least = max(least, 9)
    stuck = [run for run in runs if run.stop - run.start > least and (noisy or _jumps(values, run, usual))]
    return [_stuck_finding(trial, name, stuck, longest)] if stuck else []


def _noisy(values: Array, moving: Array) -> bool:
    """Whether a signal is noise that is more than rounding, by its steps that are not zero."""
    bends = np.abs(np.diff(values, n=2))  # of white noise 1.7 times the steps, of a curve less
    above_rounding = white_noise(values) > _ROUNDING * np.nanmax(abs(values))
    return bool(np.median(bends[bends > 0]) > np.median(moving) and above_rounding)


def _stuck_finding(trial: Trial, name: str, stuck: Sequence[slice], longest: int) -> Finding:
    """A sensor that was stuck in some runs of rows, `longest` rows at most."""
    seconds = sum(run.stop - run.start for run in stuck) * sampling_step(trial)
    first = stuck[0]
    what = f"does not change for {seconds:.3g} s in all, first at {trial.time_s[first.start]:.6g} s"
    evidence = {"runs": float(len(stuck)), "seconds": seconds, "longest_samples": float(longest + 1)}
    rows = np.concatenate([np.arange(run.start + 1, run.stop + 1) for run in stuck])
    repair = _omitted(name, rows, "where the sensor did not change")
    found = found_in(trial, [name], what, "the sensor was stuck", evidence, repair)
    return _of_readings(trial, found, len(rows), stuck)


def _jumps(values: Array, run: slice, usual: float) -> bool:
    """Whether the signal is elsewhere when a run of repeats ends."""
    after = values[run.stop + 1 : run.stop + 12]
    if after.size < 2:
        return False
    # what rests and then sets out goes on in steps like its first
    return bool(abs(after[0] - values[run.stop]) > 3 * max(usual, float(np.median(np.abs(np.diff(after))))))


def _frozen(trial: Trial, name: str, noise: dict[str, float]) -> list[Finding]:
    """A signal of one value: in a measured record, where the others have noise, the sensor was not read."""
    others = [other for other in MOTIONS if other in trial.signals and other != name]
    measured = [noise[other] > _ROUNDING * float(np.nanmax(np.abs(trial.signals[other]))) for other in others]
    if not any(measured):
        return []
    what, truth = "has one value from beginning to end", "the sensor was not read"
    notice = f"{name} left out: {truth}"
    return [found_in(trial, [name], what, truth, repair=lambda other: with_signals(other, {name: None}, notice))]


def _spikes(trial: Trial, name: str, values: Array, noise: float, least: float = 0.0) -> list[Finding]:
    """Values far from the median of their neighbours (Hampel 1974), on both sides."""
    from scipy.signal import savgol_coeffs  # slow to import

    known = np.flatnonzero(np.isfinite(values))
    if known.size < 4 * WINDOW:
        return []
    away = values[known] - median_filter(values[known], size=2 * SPIKE_SAMPLES + 1, mode="nearest")
    noise_share = 1.0 - float(savgol_coeffs(WINDOW, DEGREE)[WINDOW // 2])
    usual = max(1.4826 * float(np.median(np.abs(away))), noise * float(np.sqrt(noise_share)))
    limit = max(least, max(SPIKE, -float(ndtri(FALSE_ALARM / known.size / 2))) * usual)
    runs = _isolated(values[known], np.abs(away) > limit)
    # a signal that often moves as far between neighbours, the spikes left out, has none
    still = np.ones(known.size - 1, dtype=bool)
    for run in runs:
        still[max(0, run.start - 1) : run.stop] = False
    if still.any():
        limit = max(limit, 3 * float(np.quantile(np.abs(np.diff(values[known]))[still], 0.99)))
        runs = _isolated(values[known], np.abs(away) > limit)
    if not runs or limit == 0:
        return []
    rows = np.concatenate([known[run] for run in runs])
    what = f"{len(runs)} spikes, the first at {trial.time_s[rows[0]]:.6g} s"
    evidence = {"spikes": float(len(runs)), "largest_in_noise": float(np.max(np.abs(away)) / usual) if usual else 0.0}
    found = found_in(trial, [name], what, "disturbed readings", evidence, _omitted(name, rows, "spikes"))
    return [_of_readings(trial, found, len(rows), [slice(known[run.start], known[run.stop - 1] + 1) for run in runs])]


def _isolated(values: Array, far: NDArray[np.bool_]) -> list[slice]:
    """The runs of values far away that are as short as a spike, and exceptional."""
    return [run for run in true_runs(far) if run.stop - run.start <= SPIKE_SAMPLES and _exceptional(values, run, far)]


def _exceptional(values: Array, run: slice, far: NDArray[np.bool_]) -> bool:
    """Whether the steps into and out of a run are twice any step near it, spikes nearby left out."""
    near = slice(max(0, run.start - 2 * SPIKE_SAMPLES), run.stop + 2 * SPIKE_SAMPLES)
    steps = np.abs(np.diff(values[near]))
    touched = far[near][1:] | far[near][:-1]
    if touched.all():
        return False
    first, last = run.start - near.start - 1, run.stop - near.start - 1
    edges = [steps[place] for place in (first, last) if 0 <= place < len(steps)]
    return bool(min(edges) > 2 * steps[~touched].max())


def _of_readings(trial: Trial, found: Finding, rows: int, runs: Sequence[slice]) -> Finding:
    """A finding of failed readings in runs of rows; a few of them are a note."""
    few = rows <= _SHORT * len(trial.time_s)
    return replace(found, kind="note" if few else "fault", places_s=_places(trial, runs))


def _omitted(name: str, rows: NDArray[np.int64], why: str) -> Repair:
    def without(values: Array) -> Array:
        return np.where(np.isin(np.arange(len(values)), rows), np.nan, values)

    return changed([name], without, f"{name}: {len(rows)} values left out, {why}")
