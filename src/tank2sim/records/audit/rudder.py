"""Rudder against the turn, and rudder angle against rudder order."""

from __future__ import annotations

import numpy as np
from scipy.integrate import cumulative_trapezoid

from tank2sim.arrays import Array
from tank2sim.records.audit.finding import Finding
from tank2sim.records.audit.noise import record_noise
from tank2sim.records.audit.weak import FEWEST_WINDOWS, fit, on_uniform_time, windows_for, windows_of
from tank2sim.records.trials import RUDDERS, Trial, with_signals

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
    for name in RUDDERS:
        if name not in trial.signals:
            continue
        largest = float(np.nanmax(np.abs(trial.signals[name])))
        if largest > SIDEWAYS:
            findings.append(_too_large(trial, name, largest))
        elif _too_small(trial, name, largest):
            found = _in_radians(trial, name, largest)
            assert found.repair is not None
            if rudder_response(found.repair(trial), name):
                findings.append(found)
    return findings


def rudder_findings(trial: Trial) -> list[Finding]:
    """Sign of the rudder angle and of the order, in their right unit, and where one does not follow the other."""
    present = [name for name in RUDDERS if name in trial.signals]
    responses = {name: rudder_response(trial, name) for name in present}
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
    present = [rudder for rudder in ((name,) if name else RUDDERS) if rudder in signals]
    if not present or not {"r_radps", "psi_rad"} & set(signals):
        return 0.0
    ahead = np.ones(len(signals[present[0]]), dtype=bool)
    for sign in ("n_radps", "u_mps"):
        if sign in signals:
            ahead &= ~(signals[sign] <= 0)
    rudder = np.where(ahead, signals[present[0]], np.nan)
    yaw = signals.get("r_radps", signals.get("psi_rad"))
    assert yaw is not None
    noise = record_noise(trial)
    if "r_radps" in signals:
        windows = windows_for(noise["r_radps"], _rms(yaw) / 10, step, len(yaw))
        r, change = windows.mean(yaw), windows.rate(yaw)
    else:
        windows = windows_of(yaw, noise["psi_rad"], step)
        r, change = windows.rate(yaw), windows.acceleration(yaw)
    mean = windows.mean(rudder)
    steady = _steady_turn(r, mean)
    found = fit(change, [r, mean, np.ones(len(r))])
    if found is not None and found.differs(1) and not (steady and np.nanstd(mean) < MOVES * _rms(mean)):
        return float(found.values[1] / found.errors[1])
    return steady


def _steady_turn(rate: Array, rudder: Array) -> float:
    whole = np.isfinite(rate) & np.isfinite(rudder)
    rate, rudder = rate[whole], rudder[whole]
    if rate.size < FEWEST_WINDOWS or _rms(rudder) < FAR_OVER:
        return 0.0
    likeness = float(np.sum(rate * rudder) / max(_rms(rate) * _rms(rudder) * rate.size, 1e-300))
    return float(np.sign(likeness)) if abs(likeness) > _STEADY else 0.0


def _rms(values: Array) -> float:
    known = values[np.isfinite(values)]
    return float(np.sqrt(np.mean(np.square(known)))) if known.size else 0.0


def _too_large(trial: Trial, name: str, largest: float) -> Finding:
    what = f"the rudder angle reaches {np.rad2deg(largest):.4g} deg"
    truth = (
        "it is in degrees under the name of radians" if largest < np.rad2deg(SIDEWAYS) else "it is not a rudder angle"
    )

    def in_degrees(other: Trial) -> Trial:
        return with_signals(other, {name: np.deg2rad(other.signals[name])}, f"{name}: {truth}")

    repair = in_degrees if "deg" not in trial.heading(name) and largest < np.rad2deg(SIDEWAYS) else None
    evidence = {"largest_deg": float(np.rad2deg(largest))}
    return Finding(trial.path, (trial.heading(name),), what, truth, "fault", evidence, repair, safe=repair is not None)


def _too_small(trial: Trial, name: str, largest: float) -> bool:
    """Whether a rudder in degrees stays below 45 deg in radians while the heading changes 57 times as far."""
    if "deg" not in trial.heading(name) or largest > np.deg2rad(np.pi / 4):
        return False
    if "psi_rad" in trial.signals:
        heading = trial.signals["psi_rad"]
    elif "r_radps" in trial.signals:
        rate = trial.signals["r_radps"]
        known = np.isfinite(rate)
        heading = cumulative_trapezoid(rate[known], trial.time_s[known], initial=0.0)
    else:
        return False
    return bool(np.nanmax(heading) - np.nanmin(heading) > largest * 180 / np.pi)


def _in_radians(trial: Trial, name: str, largest: float) -> Finding:
    degrees = float(np.rad2deg(largest))
    what = f"a rudder of {degrees:.3g} deg at most turns the ship far"
    truth = "it is in radians under the name of degrees"

    def in_radians(other: Trial) -> Trial:
        return with_signals(other, {name: np.rad2deg(other.signals[name])}, f"{name}: {truth}")

    columns = (trial.heading(name),)
    return Finding(trial.path, columns, what, truth, "fault", {"largest_deg": degrees}, in_radians, safe=True)


def _wrong_sign(trial: Trial, name: str, response: float) -> Finding:
    what = "a positive rudder turns the ship to port"
    truth = "the rudder is positive to port (rudder_sign: port); or heading, rate of turn, v and y all are"

    def turned(other: Trial) -> Trial:
        text = f"{name}: positive to port in the file, by the turn that it causes"
        return with_signals(other, {name: 0.0 - other.signals[name]}, text)

    evidence = {"standard_errors_from_zero": response}
    return Finding(trial.path, (trial.heading(name),), what, truth, "fault", evidence, turned, safe=True)


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
    return [Finding(trial.path, (trial.heading("delta_rad"),), what, truth, "note", evidence)]
