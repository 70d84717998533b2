"""Time in another unit than seconds: heading and track, both, change by that factor too fast for their rates."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np
from scipy.integrate import cumulative_trapezoid

from tank2sim.records.audit.finding import Finding
from tank2sim.records.csv_table import Vector
from tank2sim.records.trials import Trial

UNITS = {60.0: "minutes", 3600.0: "hours", 1e-3: "milliseconds"}
"""Seconds in a unit of time, to its name."""

AGREEMENT = 0.03
"""How near both factors must come: 60 lies 4.7 % from the 57.3 of degrees that are radians."""

POINTS = 50
"""The way is measured between this many points of a track, so that noise of the positions does not lengthen it."""


def time_unit_findings(trial: Trial) -> list[Finding]:
    """A finding if yaw and way agree that time is in another unit; nothing where one of them was not measured."""
    turned, gone = _turned(trial), _gone(trial)
    if turned is None or gone is None:
        return []
    for factor, name in UNITS.items():
        if abs(turned / factor - 1) < AGREEMENT and abs(gone / factor - 1) < AGREEMENT:
            what = f"heading and track change {turned:.4g} and {gone:.4g} times as fast as r and the velocities say"
            return [
                Finding(
                    trial.path,
                    (trial.heading("t_s"),),
                    what,
                    f"time is in {name}",
                    evidence={"factor_heading": turned, "factor_track": gone},
                    mend=partial(_in_seconds, factor=factor, name=name),
                    safe=True,
                )
            ]
    return []


def _in_seconds(trial: Trial, factor: float, name: str) -> Trial:
    told = f"time was in {name} and is in seconds now"
    return replace(trial, time_s=factor * trial.time_s, notices=(*trial.notices, told))


def _turned(trial: Trial) -> float | None:
    """Slope of the heading over the integral of the yaw rate."""
    if not {"psi_rad", "r_radps"} <= set(trial.signals):
        return None
    integral = _integral(trial.time_s, trial.signals["r_radps"])
    heading = trial.signals["psi_rad"]
    known = np.isfinite(heading)
    if np.count_nonzero(known) < POINTS or np.std(integral) == 0:
        return None
    return float(np.polyfit(integral[known], heading[known], 1)[0])


def _gone(trial: Trial) -> float | None:
    """Way of the track over the integral of the speed."""
    if not {"x_m", "y_m", "u_mps"} <= set(trial.signals):
        return None
    speed = np.hypot(trial.signals["u_mps"], trial.signals.get("v_mps", 0.0))
    way = _integral(trial.time_s, speed)
    known = np.flatnonzero(np.isfinite(trial.signals["x_m"] + trial.signals["y_m"]))
    if len(known) < POINTS:
        return None
    places = known[np.linspace(0, len(known) - 1, POINTS).astype(int)]
    steps = np.hypot(np.diff(trial.signals["x_m"][places]), np.diff(trial.signals["y_m"][places]))
    through = float(way[places[-1]] - way[places[0]])
    return float(steps.sum()) / through if through > 0 else None


def _integral(time: Vector, values: Vector) -> Vector:
    integral: Vector = cumulative_trapezoid(np.nan_to_num(values), time, initial=0.0)
    return integral
