"""Faults of single runs: records that contradict their description.

Every check names the run, the problem and the remedy. The limits are generous, so that they find faults of the record
and accept an unusual ship.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from tank2sim.arrays import Array
from tank2sim.cards.scaling import Scales
from tank2sim.errors import InputError
from tank2sim.identification.captive.harmonics import ReducedRun
from tank2sim.identification.captive.motion import leading
from tank2sim.records.campaigns import Campaign
from tank2sim.records.captive_record import FORCE_COLUMNS, FORCE_UNITS_SI, CaptiveRun

_FASTEST_SWAY = 0.95
"""Largest sideways velocity as a share of the speed: a drift angle of 70 deg."""
_LONGEST_WAY_M = 10e3
"""Longest way of a run. Project choice: the longest tanks have 1.3 km, a water channel runs two hours."""
_FOREIGN_MOTION = 0.1
"""Largest amplitude of a motion foreign to the type of a run, as a share of the expected motion."""
_DRIFT_TOLERANCE_RAD = math.radians(1.0)
_SAME_RATE = 0.1
"""Relative difference by which v may differ from dy/dt, and r from dpsi/dt."""
_STEP_RATIO, _STEP_WITH_DRIFT = 9.0, 5.5
"""Standard errors that a step in the zero must reach, alone and next to a linear drift of the zero; chance, which
reaches 5 among the hundreds of records of a campaign, does not reach both."""
_LARGEST_PRIME = {"X": 0.5, "Y": 0.5, "N": 0.25}
"""Far above the coefficients of any hull: a flat plate broadside has Y' of about T/L."""
_OF_AVERAGES = {
    "r_radps": ("averages.columns.yaw_rate", "name its column by its unit: yaw_rate_prime, _radps or _degps"),
    "delta_rad": ("averages.columns.rudder", "name its column by its unit: rudder_rad or _deg"),
    "speed_mps": ("averages.columns.speed_mps", "give it in m/s"),
    "v_mps": ("averages.columns.drift", "name its column by its unit: drift_rad or _deg; drift stays below 70 deg"),
    "X_N": ("averages.columns.X", "correct averages.scaling"),
    "Y_N": ("averages.columns.Y", "correct averages.scaling"),
    "N_Nm": ("averages.columns.N", "correct averages.scaling"),
}
"""Column of a run's file to its key in a table of averages, and what to do about its unit there."""
_GAP = 5.0
_NO_SMALL_ANGLE = 0.05
_FEWEST_LEVELS = 8
_PLATEAU = 5.0
"""Length of a saturated gauge's plateau over the length of the next level. A sinusoid read coarsely and without noise
stays at its outermost level up to 1/(sqrt(2) - 1) = 2.4 times as long in all as at the next, and 4.8 times at a
stretch."""


def motion_faults(run: CaptiveRun) -> Iterator[InputError]:
    """A motion that no carriage makes: sideways as fast as ahead, or longer than any tank."""
    speed = float(np.mean(run.speed_mps))
    sway, way = float(np.max(np.abs(run.v_mps))), speed * run.duration_s
    if sway > _FASTEST_SWAY * speed > 0:
        problem = f"the model moves sideways at {sway:.4g} m/s, and at {speed:.4g} m/s along the tank"
        yield InputError(run.name, "column v_mps or y_m", problem, "give them in m/s and m")
    elif way > _LONGEST_WAY_M:
        problem = f"the model runs {way / 1000:.3g} km in {run.duration_s:.4g} s, farther than any tank is long"
        yield InputError(run.name, "column t_s or speed_mps", problem, "give the time in s and the speed in m/s")


def record_faults(campaign: Campaign, run: CaptiveRun) -> Iterator[InputError]:
    """Faults of a record before its reduction: the first of each kind."""
    if run.is_average:
        for fault in _impossible_values(campaign, run):
            column = fault.place.removeprefix("column ")
            place, remedy = _OF_AVERAGES.get(column, (fault.place, fault.remedy))
            yield InputError(fault.source, place, fault.problem, remedy)
        return
    yield from _clock(run)
    yield from (fault for fault in motion_faults(run) if fault.place.startswith("column t_s"))
    yield from _impossible_values(campaign, run)
    yield from _foreign_motion(campaign, run)
    for force in FORCE_COLUMNS:
        yield from _dead(campaign, run, force)
        yield from _clipped(run, force)


def reduced_faults(run: ReducedRun) -> Iterator[InputError]:
    """Faults that only a reduced run shows: wrong angles, rates inconsistent with positions, a step in a zero."""
    if run.run.is_average:
        return
    yield from _angles(run)
    yield from _rates(run)
    basis = run.basis
    for force in FORCE_COLUMNS:
        found = _step(run, force, basis)
        if found is not None:
            when, size, ratio = found
            problem = (
                f"its zero steps by {size:.3g} {FORCE_UNITS_SI[force]} at {when:.4g} s ({ratio:.1f} standard errors)"
            )
            yield InputError(run.run.name, f"gauge {force}", problem, "repeat the run, or cut the record there")


def _clock(run: CaptiveRun) -> Iterator[InputError]:
    steps = np.diff(run.time_s)
    usual = float(np.median(steps))
    longest = int(np.argmax(steps))
    if steps[longest] > _GAP * usual:
        problem = f"has a gap of {steps[longest]:.3g} s after {run.time_s[longest]:.4g} s"
        yield InputError(
            run.name, "column t_s", problem, f"readings come every {usual:.3g} s; fill it or cut the record"
        )


def _impossible_values(campaign: Campaign, run: CaptiveRun) -> Iterator[InputError]:
    speed = float(np.mean(run.speed_mps))
    ratio = speed / campaign.test.speed_mps
    if not 0.02 < ratio < 5.0:
        problem = f"has a mean of {speed:.4g}, and the test speed is {campaign.test.speed_mps:.4g} m/s"
        yield InputError(run.name, "column speed_mps", problem, "give it in m/s")
        return
    length = campaign.model.length_m
    limits = (
        ("v_mps", run.v_mps, _FASTEST_SWAY * speed, "m/s, below the speed of the model"),
        ("r_radps", run.r_radps, 3.0 * speed / length, "rad/s (r_degps for degrees)"),
        ("delta_rad", run.delta_rad, math.radians(80.0), "rad (delta_deg for degrees)"),
        ("psi_rad", run.psi_rad, math.pi, "rad (psi_deg for degrees)"),
    )
    for column, values, limit, remedy in limits:
        if values is not None and np.max(np.abs(values)) > limit:
            problem = f"reaches {np.max(np.abs(values)):.4g}, which cannot be"
            yield InputError(run.name, f"column {column}", problem, f"give it in {remedy}")
    scales = Scales(campaign.test.water_density_kgpm3, length, speed)
    for force in FORCE_COLUMNS:
        unit = scales.unit(force)
        largest = float(np.max(np.abs(run.force(force)))) / unit
        if largest > _LARGEST_PRIME[force]:
            problem = f"reaches {largest * unit:.4g}, {force}' = {largest:.3g}, which no hull has"
            yield InputError(run.name, f"column {FORCE_COLUMNS[force]}", problem, f"give it in {FORCE_UNITS_SI[force]}")


def _foreign_motion(campaign: Campaign, run: CaptiveRun) -> Iterator[InputError]:
    """A motion that contradicts the type of the run."""
    speed, length = float(np.mean(run.speed_mps)), campaign.model.length_m
    if speed <= 0:
        return  # a fault of the speed, which has its own report
    sway, yaw = _swing(run.v_mps) / speed, _swing(run.r_radps) * length / speed
    turning = abs(float(np.mean(run.r_radps))) * length / speed
    remedy = "correct its type in the campaign, or the record"
    expected = {"pure_sway": sway, "pure_yaw": yaw, "yaw_with_drift": yaw}.get(run.type)
    foreign = {"pure_sway": ("yaw rate", yaw), "pure_yaw": ("sway", sway), "yaw_with_drift": ("sway", sway)}
    if expected is not None:
        name, amplitude = foreign[run.type]
        if amplitude > _FOREIGN_MOTION * expected or expected == 0.0:
            problem = f"has type {run.type}, but its {name} swings by {amplitude:.3g} next to {expected:.3g} (prime)"
            yield InputError(run.name, "", problem, remedy)
    elif max(sway, yaw) > 0.02 or (turning > 0.02 and run.type != "steady_turn"):
        problem = f"has type {run.type}, but the model moves: v' by {sway:.3g}, r' by {yaw:.3g} about {turning:.3g}"
        yield InputError(run.name, "", problem, remedy)


def _angles(reduced: ReducedRun) -> Iterator[InputError]:
    """Drift and rudder (means over whole periods) that differ from the type or the sheet."""
    run, motion = reduced.run, reduced.motion
    sine = -float(np.mean(motion.v_mps)) / motion.mean_speed_mps
    drift = math.asin(float(np.clip(sine, -1.0, 1.0)))
    remedy = "correct its type in the campaign, or the record"
    expected = {"pure_sway": 0.0, "pure_yaw": 0.0, "static_rudder": 0.0}.get(run.type, run.sheet.drift_rad)
    if expected is not None and abs(drift - expected) > _DRIFT_TOLERANCE_RAD:
        problem = (
            f"has a drift angle of {math.degrees(drift):.3g} deg by its v, and {math.degrees(expected):.3g} deg by "
            "its type or sheet"
        )
        yield InputError(run.name, "column v_mps", problem, "drift is -asin(v/U); " + remedy)
    rudder = float(np.mean(motion.delta_rad))
    if run.sheet.rudder_rad is not None and abs(rudder - run.sheet.rudder_rad) > _DRIFT_TOLERANCE_RAD:
        text = f"is {math.degrees(rudder):.3g} deg, and {math.degrees(run.sheet.rudder_rad):.3g} deg by the sheet"
        yield InputError(run.name, "column delta_rad", text, "correct the sheet or the record")


def _swing(values: Array) -> float:
    """Amplitude of a signal, robust against noise of the sensor."""
    return math.sqrt(2.0) * float(np.std(values))


def _rates(reduced: ReducedRun) -> Iterator[InputError]:
    """v against dy/dt in pure sway, and r against dpsi/dt."""
    run, frequency = reduced.run, reduced.motion.frequency_radps
    if not run.oscillates:
        return
    path, name, column = (run.y_m, "y_m", "v_mps") if run.type == "pure_sway" else (run.psi_rad, "psi_rad", "r_radps")
    if path is None or np.ptp(path) == 0.0:
        return
    wave = np.exp(-1j * frequency * run.time_s) * np.hanning(len(run.time_s))
    position, rate = (
        np.sum(wave * (path - path.mean())),
        np.sum(wave * (leading(run) - leading(run).mean())),
    )
    factor = complex(rate / (1j * frequency * position))
    if abs(factor - 1.0) <= _SAME_RATE:
        return
    relation = "has the opposite sign of" if abs(factor + 1.0) <= _SAME_RATE else f"is {abs(factor):.3g} times"
    if 0.9 < abs(factor) < 1.1 and abs(factor + 1.0) > _SAME_RATE:
        relation = f"is {math.degrees(np.angle(factor)):.3g} deg out of phase with"
    problem = f"{relation} the rate of change of {name}"
    yield InputError(run.name, f"column {column}", problem, "correct the unit, sign or clock of one of them")


def _dead(campaign: Campaign, run: CaptiveRun, force: str) -> Iterator[InputError]:
    """A gauge with a constant reading, which the model's motion or the gauge's usual noise excludes."""
    values = run.force(force)
    if np.ptp(values) > 0.0 or np.min(run.speed_mps) <= 0:
        return  # without speed the drift angle is undefined; that fault has its own report
    angles = (float(np.mean(run.v_mps / run.speed_mps)), float(np.mean(run.delta_rad)))
    # Drift and rudder together may cancel, and a coarse gauge reads nothing at a small angle.
    nothing = float(values[0]) == 0.0 and max(map(abs, angles)) > _NO_SMALL_ANGLE and 0.0 in angles
    if ((run.oscillates or nothing) and force != "X") or _usually_noisy(campaign, force):
        when = "while the model oscillates" if run.oscillates else "from end to end"
        problem = f"reads {values[0] + 0.0:.4g} {when} and never varies: the gauge is dead"
        yield InputError(run.name, f"gauge {force}", problem, "repeat the run, or give it its readings")


def _usually_noisy(campaign: Campaign, force: str) -> bool:
    """True if steady runs usually have many levels: neither a computed campaign nor a coarse gauge."""
    records = [run for run in campaign.runs if not run.is_average]
    steady = [run for run in records if not run.oscillates] or records
    return float(np.median([len(np.unique(run.force(force))) for run in steady])) >= _FEWEST_LEVELS


def _clipped(run: CaptiveRun, force: str) -> Iterator[InputError]:
    """A plateau at the top or bottom of a record: many equal readings and none beyond; no coarse gauge."""
    values = run.force(force)
    fewest = max(6, 0.01 * len(values))
    if all(np.count_nonzero(values == extreme) < fewest for extreme in (values.max(), values.min())):
        return
    unique_levels, counts = np.unique(values, return_counts=True)
    if len(unique_levels) < _FEWEST_LEVELS:
        return
    inner = int(counts[1:-1].max())
    equal = np.flatnonzero(np.diff(values) != 0.0)
    lengths = np.diff(np.concatenate([[-1], equal, [len(values) - 1]]))
    usual = float(np.median(lengths))
    for extreme, end in ((float(values.max()), "top"), (float(values.min()), "bottom")):
        levels = values[np.concatenate([equal, [len(values) - 1]])]
        inner_levels = levels[levels != extreme]
        next_level = inner_levels.max() if end == "top" else inner_levels.min()
        # A coarse gauge is constant for a while at every level, a saturated gauge only at its last.
        natural = max(usual, float(lengths[levels == next_level].max()))
        longest, count = int(lengths[levels == extreme].max()), int(np.count_nonzero(values == extreme))
        plateau = longest >= _PLATEAU * natural and count >= _PLATEAU * inner
        if plateau and count >= fewest:
            problem = f"is constant at its {end}, {extreme:.4g}, for {longest} readings: the gauge is saturated"
            yield InputError(run.name, f"gauge {force}", problem, "repeat the run with a larger range")
            return


def _step(run: ReducedRun, force: str, basis: Array) -> tuple[float, float, float] | None:
    """Time, size, ratio to its error of a step in a residual's mean, significant with and without drift; else None."""
    if len(basis) < 40:
        return None
    steady = [place for place, label in enumerate(run.labels) if label != "trend"]
    record = run.run.force(force)[run.motion.kept]
    place, size, ratio = _largest_step(record, basis)
    if ratio < _STEP_WITH_DRIFT or _largest_step(record, basis[:, steady])[2] < _STEP_RATIO:
        return None
    return float(run.run.time_s[run.motion.kept][place]), size, ratio


def _largest_step(record: Array, basis: Array) -> tuple[int, float, float]:
    """Row, size and ratio of the likeliest step, fitted with the columns of a basis at the largest cumulative sum."""
    count = len(record)
    gram = basis.T @ basis
    residual = record - basis @ np.linalg.solve(gram, basis.T @ record)
    sums = np.abs(np.cumsum(residual))
    edge = max(5, count // 20)
    place = edge + int(np.argmax(sums[edge : count - edge]))
    column = (np.arange(count) > place).astype(float)
    column = column - basis @ np.linalg.solve(gram, basis.T @ column)
    length = float(column @ column)
    size = float(column @ residual) / length
    # Density of what remains at low frequencies, where a step has its power: of a few lines for slow noise, of many
    # lines for a stable estimate.
    power = np.abs(np.fft.rfft(residual - size * column)) ** 2 / count
    least = 1e-20 * float(np.max(record**2)) + 1e-300
    density = max(*(float(np.mean(power[1:lines])) for lines in (3, 5, 13, 61)), least)
    return place, size, abs(size) / math.sqrt(density / length)
