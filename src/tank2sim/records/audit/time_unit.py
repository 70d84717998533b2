"""Time in another unit or by another clock: heading and track, both, change by one factor too fast for their rates."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np
from scipy.integrate import cumulative_trapezoid

from tank2sim.arrays import Array
from tank2sim.records.audit.finding import Finding
from tank2sim.records.trials import Trial

_UNITS = {60.0: "minutes", 3600.0: "hours", 1e-3: "milliseconds"}
"""Seconds in a unit of time, to its name."""

AGREEMENT = 0.03
"""How near both factors must come: 60 lies 4.7 % from the 57.3 of degrees that are radians."""

MISCALIBRATED = 0.15
"""Share by which a sensor's scale may be wrong; what differs by more is another quantity or another clock. Project
choice: three times the 5 % that IMO A.526(13) allows a rate-of-turn indicator, far above the 2 % that MSC.96(72)
allows a speed log."""

_POINTS = 50
"""The way is measured between this many points of a track, so that noise of the positions does not lengthen it."""


def time_unit_findings(trial: Trial) -> list[Finding]:
    """A finding if yaw and way agree on the rate of the clock; nothing where one of them was not measured.

    A known unit of time is repaired. Another rate is not: whether the clock was wrong or rows were left out or
    repeated, the record does not decide.
    """
    turned, gone = _turned(trial), _gone(trial)
    if turned is None or gone is None or abs(abs(turned) / gone - 1) > AGREEMENT:
        return []
    what = f"heading and track change {abs(turned):.4g} and {gone:.4g} times as fast as r and the velocities say"
    evidence = {"factor_heading": abs(turned), "factor_track": gone}
    found = Finding(trial.path, (trial.heading("t_s"),), what, "", evidence=evidence)
    for factor, name in _UNITS.items():
        if abs(gone / factor - 1) < AGREEMENT:
            repair = partial(_in_seconds, factor=factor, name=name)
            return [replace(found, likely_truth=f"time is in {name}", repair=repair, safe=True)]
    if max(gone, 1 / gone) < 1 + MISCALIBRATED:
        return []
    truth = f"a second of the file is {gone:.3g} s: its clock or its sampling rate is another"
    return [replace(found, likely_truth=truth)]


def _in_seconds(trial: Trial, factor: float, name: str) -> Trial:
    text = f"time was in {name} and is in seconds now"
    return replace(trial, time_s=factor * trial.time_s, notices=(*trial.notices, text))


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
    integral: Array = cumulative_trapezoid(np.interp(time, time[known], values[known]), time, initial=0.0)
    return integral
