"""Location of the misfit: trial, signal and time, equation, and the state that explains the missing force."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

import casadi as ca
import numpy as np
from numpy.typing import NDArray
from scipy.integrate import cumulative_trapezoid
from scipy.ndimage import uniform_filter1d

from tank2sim.arrays import Array, true_runs
from tank2sim.cards.card import SteeredBy, SteeredCard
from tank2sim.dynamics import build
from tank2sim.dynamics.effects import EFFECTS
from tank2sim.dynamics.model import Model
from tank2sim.gap.diagnosis.kinematic_consistency import (
    CONTRADICTED,
    ENDS,
    filled,
    kinematic_consistency,
    recorded_earth_velocity,
)
from tank2sim.gap.result import Acting, MisfitPlace, MissingForce, Passed
from tank2sim.identification.trials.assessment.evaluation import FigureComparison, predicted_figures
from tank2sim.records.trials import Trial

NOISE_SURE = 1.1
"""A signal of a trial whose misfit is below this has no misfit intervals: its noise is not known better (project
choice), and slow noise has such intervals, too."""

GROWING = 8.0
"""A difference grows if the mean square of its growth is this much beyond that of white noise: three standard errors
(project choice). Neighbouring values of a growth share their readings, and the noise of positions is slow."""

USUAL = 0.5
"""A force is at work where its square is above this share of its mean square over all trials (project choice)."""

CLEAR = 8.0
"""And where the mean square of the ratio to its standard error is this much above 1: three standard errors (project
choice)."""

_SHORT = 4
"""Blocks of the smoother over which that mean is taken: half of L/u0."""

STATE_BINS = 12
"""Bins of equal count, by which a state explains a force (project choice: enough for any of the library's shapes)."""

EQUATIONS = {"X": "surge", "Y": "sway", "N": "yaw"}

TURNED = math.pi
"""A trial whose heading changes by more than this is a turn; its speed loss is a figure."""

INTEGRATED = ("motion.x", "motion.y", "motion.psi")
"""Signals that integrate earlier errors: the growth of the difference counts, not its size."""

EXCEEDANCE_WINDOW = 21
"""Instants over which the square of a residual is averaged to distinguish misfit from noise: half of L/u0."""

BEYOND = 4.0
"""A mean square belongs to an interval if it exceeds that of noise by this many of its own standard deviations (project
choice)."""


def places(passed: Sequence[Passed], limit: int = 12) -> tuple[MisfitPlace, ...]:
    """The intervals in which the given card's misfit arises, largest share of the whole excess first.

    The excess of an interval is the sum of z^2 - 1. Velocities and rates have z = (simulated - measured)/noise;
    positions and headings the growth of the difference over :data:`EXCEEDANCE_WINDOW` instants beyond the integral of
    wrong velocities, where these are measured too, in its own noise: an offset of the track remains, and only its
    growth is a place. The whole is that of all intervals of all trials. Where the motion exceeds all bounds the
    residual counts as the largest before it.
    """
    found = [
        (excess, MisfitPlace(replay.name, signal, float(replay.time_s[begin]), float(replay.time_s[end - 1]), 0.0))
        for replay in passed
        for signal in replay.noise
        if replay.misfit("before", signal) > NOISE_SURE
        for begin, end, excess in _misfit_runs(replay, signal)
    ]
    whole = sum(excess for excess, _ in found)
    found.sort(key=lambda pair: -pair[0])
    return tuple(replace(place, share_of_misfit=excess / whole) for excess, place in found[:limit])


def _misfit_runs(replay: Passed, signal: str) -> list[tuple[int, int, float]]:
    z = _in_noise(replay, signal)
    if signal not in INTEGRATED:
        return exceedance_intervals(z)
    known, half = np.isfinite(replay.measured[signal]), EXCEEDANCE_WINDOW // 2
    lost = known & np.isnan(replay.before[signal])
    residual = np.where(known & ~lost, replay.before[signal] - replay.measured[signal], np.nan)
    if np.count_nonzero(np.isfinite(residual)) <= EXCEEDANCE_WINDOW:
        return exceedance_intervals(np.where(lost, z, 0.0))
    difference = filled(residual)
    simulated, measured = _rates(replay, replay.before), _rates(replay, replay.measured)
    rate_noise = 0.0
    if signal in simulated and signal in measured:
        wrong = filled(simulated[signal] - measured[signal])
        difference = difference - cumulative_trapezoid(wrong, replay.time_s, initial=0)
        rate_noise = _rate_noise(replay, signal) * float(np.median(np.diff(replay.time_s)))
    # Means over half a window on both sides: their difference is as good as white over a window.
    sums = np.concatenate([[0.0], np.cumsum(difference)])
    means = (sums[half:] - sums[:-half]) / half
    error = math.sqrt(2 / half * replay.noise[signal] ** 2 + half * rate_noise**2)
    growth = np.full(len(z), np.nan)
    growth[half : len(means)] = (means[half:] - means[:-half]) / error
    return exceedance_intervals(np.where(lost, z, growth), limit=GROWING)


def _rates(replay: Passed, columns: Mapping[str, Array]) -> dict[str, Array]:
    """Rates of positions and heading (n,) from velocities and yaw rate, where all of these are measured."""
    rates = {"motion.psi": columns["motion.r"]} if "motion.r" in replay.seen else {}
    if {"motion.u", "motion.v", "motion.psi"} <= set(replay.seen):
        velocity = recorded_earth_velocity(columns["motion.u"], columns["motion.v"], columns["motion.psi"])
        rates |= dict(zip(("motion.x", "motion.y"), velocity, strict=True))
    return rates


def _rate_noise(replay: Passed, signal: str) -> float:
    """Standard deviation of a measured rate of :func:`_rates`."""
    if signal == "motion.psi":
        return replay.noise["motion.r"]
    speed = float(np.nanmax(np.hypot(replay.measured["motion.u"], replay.measured["motion.v"])))
    return math.hypot(replay.noise["motion.u"], replay.noise["motion.v"], speed * replay.noise["motion.psi"])


def _in_noise(replay: Passed, signal: str) -> Array:
    """Residual over noise (n,), nan where nothing was measured."""
    z: Array = (replay.before[signal] - replay.measured[signal]) / replay.noise[signal]
    lost = np.isnan(replay.before[signal]) & np.isfinite(replay.measured[signal])
    return np.where(lost, max(np.nanmax(np.abs(z), initial=0.0), 1e3), z)


def figures(
    card: SteeredCard, trials: Sequence[Trial], passed: Sequence[Passed], version: str
) -> tuple[FigureComparison, ...]:
    """The mariner's figures, measured and by a card.

    Advance, transfer, tactical diameter and overshoots of closed-loop simulations, and of the replayed trials the final
    heading, the way made good, its course, and the speed loss of turns.

    Parameters
    ----------
    card : SteeredCard
        The card of `version` in `passed`.
    trials : sequence of Trial
    passed : sequence of Passed
        Results of these trials.
    version : str
        ``before`` or ``after``.
    """
    end_figures = [figure for replay in passed for figure in _ends(replay, version)]
    steered = predicted_figures(card.manoeuvring(), trials) if card.steered_by is SteeredBy.RUDDER else ()
    order = {trial.name: place for place, trial in enumerate(trials)}
    return tuple(sorted((*steered, *end_figures), key=lambda figure: order.get(figure.trial, len(order))))


def _ends(replay: Passed, version: str) -> list[FigureComparison]:
    simulated: Mapping[str, Array] = getattr(replay, version)
    measured, predicted = _end_figures(replay.measured), _end_figures(simulated)
    for name in measured.keys() & predicted.keys():
        if name.endswith("_deg"):  # the same side of north as the measured one
            predicted[name] = measured[name] + (predicted[name] - measured[name] + 180) % 360 - 180
    return [FigureComparison(replay.name, name, value, predicted.get(name)) for name, value in measured.items()]


def _end_figures(columns: Mapping[str, Array]) -> dict[str, float]:
    """Figures of a replayed trial; those that its signals do not determine are omitted."""

    def end(name: str, side: int) -> float:
        values = columns.get(name, np.zeros(0))
        part = values[:ENDS] if side < 0 else values[::-1][:ENDS]
        known = np.flatnonzero(np.isfinite(part))
        return float(np.polyfit(known, part[known], 1)[1]) if len(known) > 2 else math.nan

    north, east = (end(f"motion.{axis}", 1) - end(f"motion.{axis}", -1) for axis in "xy")
    turned = end("motion.psi", 1) - end("motion.psi", -1)
    end_values = {
        "final_heading_deg": math.degrees(end("motion.psi", 1)),
        "made_good_m": math.hypot(north, east),
        "course_made_good_deg": math.degrees(math.atan2(east, north)) % 360,
    }
    if abs(turned) > TURNED:
        end_values["speed_loss_percent"] = 100 * (1 - end("motion.u", 1) / end("motion.u", -1))
    return {name: value for name, value in end_values.items() if math.isfinite(value)}


def missing_force_by_state(
    trials: Sequence[str], time_s: Array, force: Array, errors: Array, states: Mapping[str, Array]
) -> MissingForce | None:
    """The missing force from the smoother: the equation that lacks most, and the state that explains most of it.

    Parameters
    ----------
    trials : sequence of str
        Trial of each of the n rows.
    time_s : array (n,)
        s.
    force, errors : array (n, 3)
        X, Y (N) and N (N m) that are missing, and their standard errors.
    states : mapping
        Name to values (n,), SI, rad; ``heading`` is taken as an angle.

    Returns
    -------
    MissingForce, or None if no force exceeds its standard error (root mean square of the ratio at most 1).
    """
    whole = np.isfinite(force).all(axis=1) & (errors > 0).all(axis=1)
    sizes = np.sqrt(np.mean((force[whole] / errors[whole]) ** 2, axis=0)) if whole.any() else np.zeros(3)
    worst = int(np.argmax(sizes))
    if sizes[worst] <= 1:
        return None
    lacking, weights = force[whole, worst], errors[whole, worst] ** -2
    of_rows = np.asarray(trials, dtype=object)[whole]
    kept = {name: values[whole] for name, values in states.items()}
    folded = {name: np.mod(values, 2 * math.pi) if name == "heading" else values for name, values in kept.items()}
    explained = {name: explained_share(values, lacking, weights) for name, values in folded.items()}
    return MissingForce(
        equation="XYN"[worst],
        trials=tuple(str(name) for name in of_rows),
        time_s=time_s[whole],
        force=lacking,
        states=kept,
        explaining=max(explained, key=lambda name: explained[name]),
        explained=explained,
        passages=_at_work(np.asarray(trials, dtype=object), time_s, force, errors),
    )


def _at_work(trials: NDArray[np.object_], time_s: Array, force: Array, errors: Array) -> tuple[Acting, ...]:
    """Intervals in which each of the three forces (n, 3) acts, the most significant first."""
    found = []
    z = np.divide(force, errors, out=np.full(force.shape, np.nan), where=errors > 0)
    usual = np.nanmean(force**2, axis=0)
    for trial in dict.fromkeys(trials):
        rows = np.flatnonzero(trials == trial)
        for axis, equation in enumerate(EQUATIONS.values()):
            mean = uniform_filter1d(np.nan_to_num(force[rows, axis]) ** 2, min(_SHORT, len(rows)))
            active = np.where(mean > USUAL * usual[axis], z[rows, axis], 0.0)
            for begin, end, excess in exceedance_intervals(active, limit=CLEAR, width=_SHORT):
                size = math.sqrt(1 + excess / (end - begin))
                times = time_s[rows[[begin, end - 1]]]
                rms = float(np.sqrt(np.nanmean(force[rows[begin:end], axis] ** 2)))
                found.append(Acting(str(trial), equation, float(times[0]), float(times[1]), size, rms))
    return by_significance(found)


def effect_passages(trials: Sequence[str], time_s: Array, force: Array, errors: Array) -> tuple[Acting, ...]:
    """Intervals in which the forces of named effects act, the most significant first.

    These forces are known by their formulas far better than the smoother sees a force. Of each equation in which they
    exceed the smoother's standard error as a root mean square, or which has the largest ones, those blocks count in
    which the square exceeds :data:`USUAL` of its mean over all trials.

    Parameters
    ----------
    trials : sequence of str
        Trial of each of the n rows.
    time_s : array (n,)
        s.
    force, errors : array (n, 3)
        X, Y (N) and N (N m) of the effects, and the standard errors of the smoother's.
    """
    names = np.asarray(trials, dtype=object)
    sizes = np.sqrt(np.mean((force / errors) ** 2, axis=0))
    found = []
    for axis, equation in enumerate(EQUATIONS.values()):
        if sizes[axis] == 0 or sizes[axis] < min(1.0, float(sizes.max())):
            continue
        square, usual = force[:, axis] ** 2, float(np.mean(force[:, axis] ** 2))
        for trial in dict.fromkeys(names):
            rows = np.flatnonzero(names == trial)
            high = uniform_filter1d(square[rows], min(_SHORT, len(rows))) > USUAL * usual
            for run in true_runs(high):
                part = rows[run]
                size = float(np.sqrt(np.mean(square[part] / errors[part, axis] ** 2)))
                times, rms = time_s[part[[0, -1]]], float(np.sqrt(np.mean(square[part])))
                found.append(Acting(str(trial), equation, float(times[0]), float(times[1]), size, rms))
    return by_significance(found)


def by_significance(found: Sequence[Acting]) -> tuple[Acting, ...]:
    """Sorted by the sum of squares, the largest first."""
    return tuple(sorted(found, key=lambda interval: -(interval.size**2) * (interval.t_end_s - interval.t_start_s)))


def explained_share(state: Array, force: Array, weights: Array) -> float:
    """Share of a force's weighted variance (n,) explained by means over :data:`STATE_BINS` bins of a state, 0 to 1.

    Adjusted for the number of bins as a regression's R^2 is for its parameters.
    """
    known = np.isfinite(state)
    state, force, weights = state[known], force[known], weights[known]
    edges = np.unique(np.quantile(state, np.linspace(0, 1, STATE_BINS + 1))) if len(state) else np.zeros(0)
    if len(state) <= STATE_BINS + 1 or len(edges) < 2:
        return 0.0
    places = np.clip(np.searchsorted(edges, state, side="right") - 1, 0, len(edges) - 2)
    total, sums = (np.bincount(places, values, len(edges) - 1) for values in (weights, weights * force))
    used = total > 0
    means = np.divide(sums, total, out=np.zeros_like(sums), where=used)
    mean = float(np.average(force, weights=weights))
    unexplained = float(weights @ (force - means[places]) ** 2)
    whole = float(weights @ (force - mean) ** 2)
    if whole <= 0:
        return 0.0
    n, bins = len(force), int(used.sum())
    return max(0.0, 1 - unexplained / whole * (n - 1) / (n - bins))


OF_ACTION = {"kinematics": "kinematics", "sensor": "sensor", "actuator": "actuator", "propulsion": "surge"}


def equation_of(
    names: Sequence[str], improved: SteeredCard, force: MissingForce | None, passed: Sequence[Passed]
) -> str:
    """The equation at fault: surge, sway, yaw, actuator, kinematics or sensor; "" if unknown.

    Parameters
    ----------
    names : sequence of str
        Effects that were named, the strongest first; may be empty.
    improved : SteeredCard
        With the effects that act on the ship.
    force : MissingForce or None
    passed : sequence of Passed
        Used, with the force, where no effect was named.
    """
    if names:
        action = EFFECTS[names[0]].acts_on
        return OF_ACTION[action] if action in OF_ACTION else _most_changed(improved, names[0])
    check = kinematic_consistency(passed)
    if max(check.turning, check.track) > CONTRADICTED:
        return "sensor" if check.turning > CONTRADICTED else "kinematics"
    return EQUATIONS[force.equation] if force is not None else ""


def _most_changed(card: SteeredCard, name: str) -> str:
    """Surge, sway or yaw: the acceleration that an effect of the card changes most, relative to its size.

    Over motions as they occur in manoeuvres: u 0.6 to 1 u0, v to 0.2 u0, r to 0.5 u0/L, rudder to 25 deg, any heading.
    """
    without = replace(card, effects=tuple(entry for entry in card.effects if entry.name != name))
    changed, unchanged = _accelerations(build(card)), _accelerations(build(without))
    shares = np.sqrt(np.mean((changed - unchanged) ** 2, axis=0) / np.mean(unchanged**2, axis=0))
    return ("surge", "sway", "yaw")[int(np.argmax(shares))]


def _accelerations(model: Model, count: int = 200) -> Array:
    """du/dt, dv/dt, dr/dt (count, 3) at the same set of motions for any model."""
    p = model.defaults
    speed, length = p["ship.speed"], p["ship.length"]
    share = np.random.default_rng(0).uniform(-1, 1, (count, 5))
    values = {
        "motion.u": (0.8 + 0.2 * share[:, 0]) * speed,
        "motion.v": 0.2 * share[:, 1] * speed,
        "motion.r": 0.5 * share[:, 2] * speed / length,
        "rudder.angle": math.radians(25.0) * share[:, 3],
        "motion.psi": math.pi * share[:, 4],
    }
    extra = np.random.default_rng(1)
    columns = []
    for state in model.states:
        typical = 0.3 * state.nominal * extra.standard_normal(count)
        columns.append(values.get(state.name, np.zeros(count) if state.name in ("motion.x", "motion.y") else typical))
    wanted = ca.vcat([model.symbol(f"motion.{name}dot") for name in "uvr"])
    function = ca.Function("accelerations", [model.x, model.u, model.p], [model.expand(wanted)])
    u, par = (np.repeat(vector[:, None], count, axis=1) for vector in (model.input_values(), model.parameter_values()))
    rates: Array = np.array(function(np.array(columns), u, par)).T
    return rates


def exceedance_intervals(
    z: Array, limit: float | None = None, width: int = EXCEEDANCE_WINDOW
) -> list[tuple[int, int, float]]:
    """Begin, end (one past the last) and excess of each interval in which the mean square of z is beyond that of noise.

    Parameters
    ----------
    z : array (n,)
        In standard deviations of noise; nan where nothing is known.
    limit : float, optional
        By how much the mean of z^2 - 1 over the window must exceed 0; by default :data:`BEYOND` standard deviations of
        it for white noise.
    width : int
        Instants in the window; intervals nearer to each other are merged.

    Returns
    -------
    list of (int, int, float)
        The excess is the sum of z^2 - 1 over the interval; it is positive.
    """
    excess = np.where(np.isfinite(z), np.nan_to_num(z) ** 2 - 1, 0.0)
    width = min(width, len(z))
    if not width:
        return []
    # a squared normal has variance 2
    least = BEYOND * math.sqrt(2 / width) if limit is None else limit
    high = uniform_filter1d(excess, width) > least
    joined: list[list[int]] = []
    for run in true_runs(high):
        if joined and run.start - joined[-1][1] < width:
            joined[-1][1] = run.stop
        else:
            joined.append([run.start, run.stop])
    sums = [(begin, end, float(excess[begin:end].sum())) for begin, end in joined]
    return [run for run in sums if run[2] > 0]
