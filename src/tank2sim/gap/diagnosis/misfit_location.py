"""Where the gap is: in which trial, signal and time, in which equation, and what the missing force follows."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

import casadi as ca
import numpy as np
from numpy.typing import NDArray
from scipy.integrate import cumulative_trapezoid
from scipy.ndimage import uniform_filter1d

from tank2sim.arrays import Array
from tank2sim.cards.card import ManoeuvringCard
from tank2sim.dynamics import build
from tank2sim.dynamics.effects import EFFECTS
from tank2sim.dynamics.model import Model
from tank2sim.gap.diagnosis.exceedance_runs import EXCEEDANCE_WINDOW, stretches
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
"""A signal of a trial whose misfit is below this has no stretches: its noise is not known better (project choice),
and slow noise has stretches of its own."""

GROWING = 8.0
"""A difference grows if the mean square of its growth is this much beyond that of white noise: three standard errors
(project choice). Neighbouring values of a growth share their readings, and the noise of positions is slow besides."""

USUAL = 0.5
"""A force is at work where its square is above this share of its mean square over all trials (project choice)."""

CLEAR = 8.0
"""And where the mean square of the ratio to its standard error is this much above 1: three standard errors (project
choice)."""

_SHORT = 4
"""Blocks of the smoother over which that mean is taken: half of L/u0."""

STATE_BINS = 12
"""Bins of equal count, by which a state explains a force (ours: enough for any of the library's shapes)."""

EQUATIONS = {"X": "surge", "Y": "sway", "N": "yaw"}

TURNED = math.pi
"""A trial whose heading changes by more than this is a turn, of which the speed loss is a figure."""

INTEGRATED = ("motion.x", "motion.y", "motion.psi")
"""Signals that sum up what was wrong before: what counts is when the difference grows, not that it is there."""


def places(passed: Sequence[Passed], limit: int = 12) -> tuple[MisfitPlace, ...]:
    """The stretches in which the given card's misfit arises, largest share of the whole excess first.

    The excess of a stretch is the sum of z^2 - 1. Velocities and rates have z = (simulated - measured)/noise; positions
    and headings the growth of the difference over :data:`EXCEEDANCE_WINDOW` instants beyond what wrong velocities make
    of it, where these are measured too, in its own noise: a track that was left once stays left, and only what leaves
    it is a place. The whole is that of all stretches of all trials. Where the motion had left all bounds the residual
    counts as the largest before it.
    """
    found = [
        (excess, MisfitPlace(replay.name, signal, float(replay.time_s[begin]), float(replay.time_s[end - 1]), 0.0))
        for replay in passed
        for signal in replay.noise
        if replay.misfit("before", signal) > NOISE_SURE
        for begin, end, excess in _where_it_arises(replay, signal)
    ]
    whole = sum(excess for excess, _ in found)
    found.sort(key=lambda pair: -pair[0])
    return tuple(replace(place, share=excess / whole) for excess, place in found[:limit])


def _where_it_arises(one: Passed, signal: str) -> list[tuple[int, int, float]]:
    z = _in_noise(one, signal)
    if signal not in INTEGRATED:
        return stretches(z)
    known, half = np.isfinite(one.measured[signal]), EXCEEDANCE_WINDOW // 2
    lost = known & np.isnan(one.before[signal])
    left = np.where(known & ~lost, one.before[signal] - one.measured[signal], np.nan)
    if np.count_nonzero(np.isfinite(left)) <= EXCEEDANCE_WINDOW:
        return stretches(np.where(lost, z, 0.0))
    own = filled(left)
    simulated, measured = _rates(one, one.before), _rates(one, one.measured)
    rate_noise = 0.0
    if signal in simulated and signal in measured:
        wrong = filled(simulated[signal] - measured[signal])
        own = own - cumulative_trapezoid(wrong, one.time_s, initial=0)
        rate_noise = _rate_noise(one, signal) * float(np.median(np.diff(one.time_s)))
    # Means over half a window on both sides: their difference is as good as white over a window.
    sums = np.concatenate([[0.0], np.cumsum(own)])
    means = (sums[half:] - sums[:-half]) / half
    error = math.sqrt(2 / half * one.noise[signal] ** 2 + half * rate_noise**2)
    growth = np.full(len(z), np.nan)
    growth[half : len(means)] = (means[half:] - means[:-half]) / error
    return stretches(np.where(lost, z, growth), limit=GROWING)


def _rates(one: Passed, columns: Mapping[str, Array]) -> dict[str, Array]:
    """The rates of positions and heading (n,) that follow from velocities and yaw rate, where all of them are there."""
    there = {name for name in one.noise if np.isfinite(one.measured[name]).any()}
    told = {"motion.psi": columns["motion.r"]} if "motion.r" in there else {}
    if {"motion.u", "motion.v", "motion.psi"} <= there:
        velocity = recorded_earth_velocity(columns["motion.u"], columns["motion.v"], columns["motion.psi"])
        told |= dict(zip(("motion.x", "motion.y"), velocity, strict=True))
    return told


def _rate_noise(one: Passed, signal: str) -> float:
    """Standard deviation of a measured rate of :func:`_rates`."""
    if signal == "motion.psi":
        return one.noise["motion.r"]
    speed = float(np.nanmax(np.hypot(one.measured["motion.u"], one.measured["motion.v"])))
    return math.hypot(one.noise["motion.u"], one.noise["motion.v"], speed * one.noise["motion.psi"])


def _in_noise(one: Passed, signal: str) -> Array:
    """Residual over noise (n,), nan where nothing was measured."""
    z: Array = (one.before[signal] - one.measured[signal]) / one.noise[signal]
    lost = np.isnan(one.before[signal]) & np.isfinite(one.measured[signal])
    return np.where(lost, max(np.nanmax(np.abs(z), initial=0.0), 1e3), z)


def figures(
    card: ManoeuvringCard, trials: Sequence[Trial], passed: Sequence[Passed], which: str
) -> tuple[FigureComparison, ...]:
    """The mariner's figures, measured and by a card.

    Advance, transfer, tactical diameter and overshoots of closed-loop simulations, and of the replayed trials the final
    heading, the way made good, its course, and the speed loss of turns.

    Parameters
    ----------
    card : ManoeuvringCard
        The one that `which` of `passed` shows.
    trials : sequence of Trial
    passed : sequence of Passed
        Of these trials.
    which : str
        ``before`` or ``after``.
    """
    own = [figure for replay in passed for figure in _ends(replay, which)]
    steered = predicted_figures(card, trials)
    order = {trial.name: place for place, trial in enumerate(trials)}
    return tuple(sorted((*steered, *own), key=lambda figure: order.get(figure.trial, len(order))))


def _ends(one: Passed, which: str) -> list[FigureComparison]:
    simulated: Mapping[str, Array] = getattr(one, which)
    measured, predicted = _end_figures(one.measured), _end_figures(simulated)
    for name in measured.keys() & predicted.keys():
        if name.endswith("_deg"):  # the same side of north as the measured one
            predicted[name] = measured[name] + (predicted[name] - measured[name] + 180) % 360 - 180
    return [FigureComparison(one.name, name, value, predicted.get(name)) for name, value in measured.items()]


def _end_figures(columns: Mapping[str, Array]) -> dict[str, float]:
    """Figures of a replayed trial; those that its signals cannot tell are left out."""

    def end(name: str, side: int) -> float:
        values = columns.get(name, np.zeros(0))
        part = values[:ENDS] if side < 0 else values[::-1][:ENDS]
        known = np.flatnonzero(np.isfinite(part))
        return float(np.polyfit(known, part[known], 1)[1]) if len(known) > 2 else math.nan

    north, east = (end(f"motion.{axis}", 1) - end(f"motion.{axis}", -1) for axis in "xy")
    turned = end("motion.psi", 1) - end("motion.psi", -1)
    told = {
        "final_heading_deg": math.degrees(end("motion.psi", 1)),
        "made_good_m": math.hypot(north, east),
        "course_made_good_deg": math.degrees(math.atan2(east, north)) % 360,
    }
    if abs(turned) > TURNED:
        told["speed_loss_percent"] = 100 * (1 - end("motion.u", 1) / end("motion.u", -1))
    return {name: value for name, value in told.items() if math.isfinite(value)}


def missing_force_by_state(
    trials: Sequence[str], time_s: Array, force: Array, errors: Array, states: Mapping[str, Array]
) -> MissingForce | None:
    """What the smoother's force says: the equation that lacks most, and the state that explains most of it.

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
    """When each of the three forces (n, 3) is at work, the most telling first."""
    found = []
    z = np.divide(force, errors, out=np.full(force.shape, np.nan), where=errors > 0)
    usual = np.nanmean(force**2, axis=0)
    for trial in dict.fromkeys(trials):
        rows = np.flatnonzero(trials == trial)
        for axis, equation in enumerate(EQUATIONS.values()):
            mean = uniform_filter1d(np.nan_to_num(force[rows, axis]) ** 2, min(_SHORT, len(rows)))
            own = np.where(mean > USUAL * usual[axis], z[rows, axis], 0.0)
            for begin, end, excess in stretches(own, limit=CLEAR, width=_SHORT):
                size = math.sqrt(1 + excess / (end - begin))
                times = time_s[rows[[begin, end - 1]]]
                found.append(Acting(str(trial), equation, float(times[0]), float(times[1]), size))
    return most_telling(found)


def most_telling(found: Sequence[Acting]) -> tuple[Acting, ...]:
    """Sorted by the sum of squares, the largest first."""
    return tuple(sorted(found, key=lambda one: -(one.size**2) * (one.t_end_s - one.t_start_s)))


def explained_share(state: Array, force: Array, weights: Array) -> float:
    """Share of a force's weighted variance (n,) that means over :data:`STATE_BINS` bins of a state explain, 0 to 1.

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
    left = float(weights @ (force - means[places]) ** 2)
    whole = float(weights @ (force - mean) ** 2)
    if whole <= 0:
        return 0.0
    n, bins = len(force), int(used.sum())
    return max(0.0, 1 - left / whole * (n - 1) / (n - bins))


def parity(state: Array, force: Array) -> float:
    """How odd a force (n,) is in a state (n,): 1 for odd, -1 for even, near 0 for neither or too little on one side.

    Means over bins of the state's magnitude, on either side of zero: (difference^2 - sum^2)/(difference^2 + sum^2).
    """
    size = np.abs(state)
    edges = np.unique(np.quantile(size, np.linspace(0, 1, STATE_BINS // 2 + 1)))
    if len(edges) < 2:
        return 0.0
    places = np.clip(np.searchsorted(edges, size, side="right") - 1, 0, len(edges) - 2)
    odd = even = 0.0
    for place in range(len(edges) - 1):
        there = [force[(places == place) & (np.sign(state) == side)] for side in (1, -1)]
        if min(map(len, there)) < 3:
            continue
        plus, minus = (float(values.mean()) for values in there)
        share = min(map(len, there)) / len(force)
        odd, even = odd + share * (plus - minus) ** 2, even + share * (plus + minus) ** 2
    return (odd - even) / (odd + even) if odd + even > 0 else 0.0


OF_ACTION = {"kinematics": "kinematics", "sensor": "sensor", "actuator": "actuator", "propulsion": "surge"}


def equation_of(
    names: Sequence[str], improved: ManoeuvringCard, force: MissingForce | None, passed: Sequence[Passed]
) -> str:
    """The equation at fault: surge, sway, yaw, actuator, kinematics or sensor; "" where nothing points to any.

    Parameters
    ----------
    names : sequence of str
        Effects that were named, the strongest first; may be empty.
    improved : ManoeuvringCard
        With those of them that act on the ship.
    force : MissingForce or None
    passed : sequence of Passed
        Asked, with the force, where no effect was named.
    """
    if names:
        action = EFFECTS[names[0]].acts_on
        return OF_ACTION[action] if action in OF_ACTION else _most_changed(improved, names[0])
    check = kinematic_consistency(passed)
    if max(check.turning, check.track) > CONTRADICTED:
        return "sensor" if check.turning > CONTRADICTED else "kinematics"
    return EQUATIONS[force.equation] if force is not None else ""


def _most_changed(card: ManoeuvringCard, name: str) -> str:
    """Surge, sway or yaw: which acceleration an effect of the card changes most, as a share of its own size.

    Over motions as they occur in manoeuvres: u 0.6 to 1 u0, v to 0.2 u0, r to 0.5 u0/L, rudder to 25 deg, any heading.
    """
    without = replace(card, effects=tuple(entry for entry in card.effects if entry.name != name))
    there, here = _accelerations(build(card)), _accelerations(build(without))
    shares = np.sqrt(np.mean((there - here) ** 2, axis=0) / np.mean(here**2, axis=0))
    return ("surge", "sway", "yaw")[int(np.argmax(shares))]


def _accelerations(model: Model, count: int = 200) -> Array:
    """du/dt, dv/dt, dr/dt (count, 3) at one and the same set of motions for any model."""
    p = dict(zip(model.parameter_names, model.parameter_values(), strict=True))
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
        own = 0.3 * state.nominal * extra.standard_normal(count)
        columns.append(values.get(state.name, np.zeros(count) if state.name in ("motion.x", "motion.y") else own))
    wanted = ca.vcat([model.symbol(f"motion.{name}dot") for name in "uvr"])
    function = ca.Function("accelerations", [model.x, model.u, model.p], [model.expand(wanted)])
    u, par = (np.repeat(one[:, None], count, axis=1) for one in (model.input_values(), model.parameter_values()))
    rates: Array = np.array(function(np.array(columns), u, par)).T
    return rates
