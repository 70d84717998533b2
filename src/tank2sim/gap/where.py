"""Where the gap is: in which trial, signal and time, in which equation, and what the missing force follows."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import casadi as ca
import numpy as np
from numpy.typing import NDArray
from scipy.integrate import cumulative_trapezoid
from scipy.ndimage import uniform_filter1d

from tank2sim.cards.card import ManoeuvringCard
from tank2sim.dynamics import build
from tank2sim.dynamics.effects import EFFECTS
from tank2sim.dynamics.model import Model, Vector
from tank2sim.gap.result import MissingForce, Passed, Place
from tank2sim.identification.trials.evaluation import Figure, predicted_figures
from tank2sim.records.trials import Trial

Array = NDArray[np.float64]

WINDOW = 21
"""Instants over which the square of a residual is averaged to tell a stretch of misfit from noise: half of L/u0."""

BEYOND = 4.0
"""A mean square belongs to a stretch if it exceeds that of noise by this many of its own standard deviations (ours)."""

NOISE_SURE = 1.1
"""A signal of a trial whose misfit is below this has no stretches: its noise is not known better (ours), and slow noise
has stretches of its own."""

BINS = 12
"""Bins of equal count, by which a state explains a force (ours: enough for any of the library's shapes)."""

EQUATIONS = {"X": "surge", "Y": "sway", "N": "yaw"}

TURNED = math.pi
"""A trial whose heading changes by more than this is a turn, of which the speed loss is a figure."""

ENDS = 20
"""The motion at an end of a trial is read off a straight line through this many instants (half of L/u0)."""


def places(passed: Sequence[Passed], limit: int = 12) -> tuple[Place, ...]:
    """The stretches in which the given card's misfit exceeds noise, largest share of the whole excess first.

    The excess of a stretch is the sum of ((simulated - measured)/noise)^2 - 1; the whole is that of all stretches of
    all trials. Where the motion had left all bounds the residual counts as the largest before it.
    """
    found = [
        (excess, Place(one.name, signal, float(one.time_s[begin]), float(one.time_s[end - 1]), 0.0))
        for one in passed
        for signal in one.noise
        if one.misfit("before", signal) > NOISE_SURE
        for begin, end, excess in _stretches(_in_noise(one, signal))
    ]
    whole = sum(excess for excess, _ in found)
    found.sort(key=lambda pair: -pair[0])
    return tuple(replace(place, share=excess / whole) for excess, place in found[:limit])


def _in_noise(one: Passed, signal: str) -> Vector:
    """Residual over noise (n,), nan where nothing was measured."""
    z: Vector = (one.before[signal] - one.measured[signal]) / one.noise[signal]
    lost = np.isnan(one.before[signal]) & np.isfinite(one.measured[signal])
    return np.where(lost, max(np.nanmax(np.abs(z), initial=0.0), 1e3), z)


def _stretches(z: Vector) -> list[tuple[int, int, float]]:
    """Begin, end and excess of each stretch in which the mean square of z is beyond that of noise."""
    known = np.isfinite(z)
    excess = np.where(known, np.nan_to_num(z) ** 2 - 1, 0.0)
    width = min(WINDOW, len(z))
    high = uniform_filter1d(excess, width) > BEYOND * math.sqrt(2 / width)  # a squared normal has variance 2
    edges = np.flatnonzero(np.diff(np.concatenate([[0], high.astype(int), [0]])))
    pairs = [[int(begin), int(end)] for begin, end in zip(edges[::2], edges[1::2], strict=True)]
    joined: list[list[int]] = []
    for pair in pairs:
        if joined and pair[0] - joined[-1][1] < width:
            joined[-1][1] = pair[1]
        else:
            joined.append(pair)
    sums = [(begin, end, float(excess[begin:end].sum())) for begin, end in joined]
    return [one for one in sums if one[2] > 0]


def figures(card: ManoeuvringCard, trials: Sequence[Trial], passed: Sequence[Passed], which: str) -> tuple[Figure, ...]:
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
    own = [figure for one in passed for figure in _ends(one, which)]
    steered = predicted_figures(card, trials)
    order = {trial.name: place for place, trial in enumerate(trials)}
    return tuple(sorted((*steered, *own), key=lambda figure: order.get(figure.trial, len(order))))


def _ends(one: Passed, which: str) -> list[Figure]:
    simulated: Mapping[str, Vector] = getattr(one, which)
    measured, predicted = _end_figures(one.measured), _end_figures(simulated)
    for name in measured.keys() & predicted.keys():
        if name.endswith("_deg"):  # the same side of north as the measured one
            predicted[name] = measured[name] + (predicted[name] - measured[name] + 180) % 360 - 180
    return [Figure(one.name, name, value, predicted.get(name)) for name, value in measured.items()]


def _end_figures(columns: Mapping[str, Vector]) -> dict[str, float]:
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


def missing_force(
    trials: Sequence[str], time_s: Vector, force: Array, errors: Array, states: Mapping[str, Vector]
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
    )


def explained_share(state: Vector, force: Vector, weights: Vector) -> float:
    """Share of a force's weighted variance (n,) that means over :data:`BINS` bins of a state explain, 0 to 1.

    Adjusted for the number of bins as a regression's R^2 is for its parameters.
    """
    known = np.isfinite(state)
    state, force, weights = state[known], force[known], weights[known]
    edges = np.unique(np.quantile(state, np.linspace(0, 1, BINS + 1))) if len(state) else np.zeros(0)
    if len(state) <= BINS + 1 or len(edges) < 2:
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


def parity(state: Vector, force: Vector) -> float:
    """How odd a force (n,) is in a state (n,): 1 for odd, -1 for even, near 0 for neither or too little on one side.

    Means over bins of the state's magnitude, on either side of zero: (difference^2 - sum^2)/(difference^2 + sum^2).
    """
    size = np.abs(state)
    edges = np.unique(np.quantile(size, np.linspace(0, 1, BINS // 2 + 1)))
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


@dataclass(frozen=True)
class Kinematics:
    """How far records contradict themselves, in standard errors: root mean square over trials, about 1 is none.

    Parameters
    ----------
    turning : float
        Integrated yaw rate against the change of heading.
    track : float
        Integrated velocities through the water against the change of position.
    """

    turning: float
    track: float


def kinematics(passed: Sequence[Passed]) -> Kinematics:
    """Whether dpsi/dt is r, and whether positions follow from u, v and psi: nothing of the hull is asked.

    Both sides are compared over the whole of each trial; the standard error is that of white noise of the sensors,
    integrated.
    """
    turning, track = [], []
    for one in passed:
        seen = {name: _filled(values) for name, values in one.measured.items()}
        noise = {name.removeprefix("motion."): error for name, error in one.noise.items()}
        if {"motion.psi", "motion.r"} <= seen.keys():
            turning.append(_contradiction(one.time_s, seen["motion.psi"], noise["psi"], seen["motion.r"], noise["r"]))
        if {f"motion.{name}" for name in ("psi", "u", "v", "x", "y")} <= seen.keys():
            u, v, psi = (seen[f"motion.{name}"] for name in ("u", "v", "psi"))
            over = math.hypot(noise["u"], noise["v"], float(np.max(np.hypot(u, v))) * noise["psi"])
            for axis, rate in zip("xy", earth_velocity(u, v, psi), strict=True):
                track.append(_contradiction(one.time_s, seen[f"motion.{axis}"], noise[axis], rate, over))
    return Kinematics(*(float(np.sqrt(np.mean(np.square(z)))) if z else 0.0 for z in (turning, track)))


def earth_velocity(u: Vector, v: Vector, psi: Vector) -> tuple[Vector, Vector]:
    """Velocity to north and east (n,) each, m/s."""
    cos, sin = np.cos(psi), np.sin(psi)
    return u * cos - v * sin, u * sin + v * cos


def _contradiction(time: Vector, signal: Vector, noise: float, rate: Vector, rate_noise: float) -> float:
    """Change of a signal over a trial less the integral of its measured rate, in standard errors."""
    ends = min(ENDS, len(time) // 2)
    left = signal - np.concatenate([[0.0], cumulative_trapezoid(rate, time)])
    change = float(left[-ends:].mean()) - float(left[:ends].mean())
    step = float(np.median(np.diff(time)))
    return change / math.hypot(noise * math.sqrt(2 / ends), rate_noise * step * math.sqrt(len(time)))


def _filled(values: Vector) -> Vector:
    known = np.isfinite(values)
    places = np.arange(len(values), dtype=float)
    filled: Vector = np.interp(places, places[known], values[known])
    return filled


CONTRADICTED = 4.0
"""Records that contradict themselves by more standard errors than this are at fault, not the hull (ours)."""

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
    check = kinematics(passed)
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
