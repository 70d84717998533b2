"""Stability and manoeuvrability of a ship in one result, of ``tank2sim stability``."""

from __future__ import annotations

import math
from dataclasses import dataclass

import casadi as ca
import numpy as np

from tank2sim.analysis.ensemble.results import StabilityBands
from tank2sim.analysis.linearisation import straight_course
from tank2sim.analysis.stability.imo import ImoCriterion, imo_criteria
from tank2sim.analysis.stability.margin import Margin, TrimEffect, stability_margin, trim_effect
from tank2sim.analysis.stability.response import SteeringResponse, steering_responses
from tank2sim.analysis.stability.straight_line import Stability, stability
from tank2sim.analysis.turning.characteristic import SteeringCharacteristic, steering_characteristic
from tank2sim.analysis.turning.diagram import SteadyTurning, TurningDiagram, steady_turning
from tank2sim.analysis.turning.spirals import SpiralPoints, direct_spiral, reverse_spiral
from tank2sim.dynamics.effects import EFFECTS, undisturbed_inputs
from tank2sim.dynamics.model import Model
from tank2sim.errors import InputError
from tank2sim.notices import Notice, caution

_FAR = 0.05
"""Distance from the diagram, as a share of the largest yaw rate, from which a steady point of a spiral is reported."""

_SAME_SPEED = 0.01
"""Speeds that differ by less than this share count as equal (project choice)."""

SLOWEST, FASTEST, SPEEDS = 0.01, 2.0, 400
"""Speeds at which a search looks, over the speed of expansion, and how many: two steady speeds that differ by less than
0.5 % of it are taken for none. Ships do not go at twice the speed about which they were tested. Project choice."""


@dataclass(frozen=True, eq=False)
class Spirals:
    """Simulated spirals; None if not requested or not possible."""

    direct: SpiralPoints | None = None
    reverse: SpiralPoints | None = None


@dataclass(frozen=True)
class SteadySpeed:
    """A surge speed (m/s) that the engine holds, and whether the ship returns to it after a small change of speed."""

    speed_mps: float
    stable: bool


@dataclass(frozen=True, eq=False, kw_only=True)
class StabilityStudy(Stability):
    """Stability and manoeuvrability of a ship: the straight course at the requested speed, and

    Parameters
    ----------
    margins, trim, responses
        Results of the straight course.
    steady_turning, characteristic : optional
        At the speed of expansion; None without a steady motion, which `notices` state.
    imo : tuple of ImoCriterion
        At the speed of expansion.
    steady_speeds : tuple of SteadySpeed
        Speeds straight ahead that the engine holds at the revolutions of the start.
    notices : tuple of Notice
        Messages for the user.
    """

    margins: Margin
    trim: TrimEffect
    responses: tuple[SteeringResponse, ...]
    steady_turning: TurningDiagram | None
    characteristic: SteeringCharacteristic | None
    spirals: Spirals
    imo: tuple[ImoCriterion, ...]
    steady_speeds: tuple[SteadySpeed, ...]
    notices: tuple[Notice, ...]
    ensemble: StabilityBands | None = None


def stability_study(model: Model, speed_mps: float | None = None, *, spirals: bool = True) -> StabilityStudy:
    """Stability and manoeuvrability of a ship, the straight course by default at its speed of expansion.

    Missing results (a steady turn, a trial that does not end) are reported in notices; only a straight course is
    necessary.

    Raises
    ------
    InputError
        The model is not a ship, or has no straight course.
    """
    found = stability(model, speed_mps)
    margin = stability_margin(model, speed_mps)
    notices = [
        *_about_speed(model, found, by_speed=margin.speed is not None),
        *_about_effects(found),
        *_about_weather(model),
    ]
    held = steady_speeds(model)
    notices += _about_steady_speeds(held)
    turning, spiralled = None, Spirals()
    try:
        turning = steady_turning(model)
        notices += turning.notices
    except InputError as error:
        notices.append(Notice(f"no steady-turning diagram: {error.reason}"))
    if turning is not None and spirals:
        spiralled, spiral_notes = _spirals(model, turning)
        notices += spiral_notes
    return StabilityStudy(
        **vars(found),
        margins=margin,
        trim=trim_effect(model, margin),
        responses=steering_responses(model, straight_course(model, speed_mps), found.nomoto.dimensional),
        steady_turning=turning.reported() if turning else None,
        characteristic=steering_characteristic(turning) if turning else None,
        spirals=spiralled,
        imo=imo_criteria(model),
        steady_speeds=held,
        notices=tuple(notices),
    )


def _about_speed(model: Model, found: Stability, *, by_speed: bool) -> list[Notice]:
    values = model.defaults
    slowest, fastest, card_speed = values["ship.slowest"], values["ship.fastest"], values["ship.speed"]
    messages, speed = [], found.operating_point.speed_mps
    if not slowest <= speed <= fastest:
        messages.append(caution(f"{speed:.4g} m/s is outside the card's range of {slowest:g} to {fastest:g} m/s"))
    if not by_speed:
        text = (
            f"the forces of this card do not change with speed: a linear card holds at {card_speed:.4g} m/s alone, "
            "C' and the prime numbers are made with that speed, and there is no curve over speed"
        )
        messages.append(Notice(text))
    if abs(speed / card_speed - 1) > _SAME_SPEED:
        text = f"steady turns, spirals and the IMO criteria are those at the card's speed, {card_speed:.4g} m/s"
        messages.append(Notice(text))
    return messages


def _about_steady_speeds(held: tuple[SteadySpeed, ...]) -> list[Notice]:
    stable = [f"{speed.speed_mps:.4g}" for speed in held if speed.stable]
    if not held:
        return [
            Notice(
                "no steady speed straight ahead: the surge force at the revolutions of the start does not vanish below "
                f"{FASTEST:g} times the speed of expansion, and such a run leaves the card's range"
            )
        ]
    if len(stable) < 2:
        return []
    return [
        caution(
            f"{len(stable)} stable speeds straight ahead at the same revolutions ({', '.join(stable)} m/s): the ship "
            "keeps one or the other, depending on the speed before, which no ship does; check the terms of X in u and "
            "low_speed_below_mps"
        )
    ]


def _about_effects(found: Stability) -> list[Notice]:
    """Notices on effects that C' and Nomoto's models neglect, and on modes that contradict them."""
    messages, judged = [], found.stability_criterion
    if judged.settled_states:
        messages.append(
            f"C', its margin and Nomoto's K and T describe slow motions, which {', '.join(judged.settled_states)} "
            "follow at once; T1 and T2 are then no time constants of the whole ship: its eigenvalues, the word stable "
            "or unstable, and the response to the rudder are with these states"
        )
    if not judged.C_prime_decides and judged.C_prime > 0:
        messages.append(
            f"C' > 0, and yet a mode grows at {judged.growth_per_s:.3g} 1/s: it is unstable, and the margin of C' says "
            "nothing of that"
        )
    return [Notice(text) for text in messages]


def _about_weather(model: Model) -> list[Notice]:
    values = dict(zip(model.input_names, model.input_values().tolist(), strict=True))
    blowing = [name.partition(".")[0] for name, absent in undisturbed_inputs(model).items() if values[name] != absent]
    if not blowing:
        return []
    return [
        Notice(
            f"the straight course is that in the card's {' and '.join(blowing)}, and so are its eigenvalues, C' and "
            "Nomoto's numbers; steady turns, spirals and the IMO criteria hold in calm water"
        )
    ]


def _spirals(model: Model, turning: SteadyTurning) -> tuple[Spirals, list[Notice]]:
    """The two spirals, with notices."""
    messages: list[str] = []
    direct = reverse = None
    try:
        if turning.stable.any():
            direct = direct_spiral(model, turning)
        else:
            messages.append("no spiral: no steady turn is stable with the rudder held")
    except InputError as error:
        messages.append(f"no spiral: {error.reason}")
    try:
        reverse = reverse_spiral(model, turning, stability(model).nomoto.dimensional)
        if reverse is None:
            messages.append("no reverse spiral: the rudder turns the ship the wrong way, or not at all")
    except InputError as error:
        messages.append(f"no reverse spiral: {error.reason}")
    most = math.degrees(np.max(np.abs(turning.yaw_rate_radps)))
    for name, points in (("spiral", direct), ("reverse spiral", reverse)):
        if points is None:
            continue
        off = int(np.sum(np.array(points.steady) & ~(points.distance_to_diagram_degps < _FAR * most)))
        if off:
            messages.append(
                f"{off} steady points of the {name} lie on no branch of the diagram: the ship has turns that are not "
                "joined to its straight course, or the diagram ends before them"
            )
    return Spirals(direct, reverse), [Notice(text) for text in messages]


def steady_speeds(model: Model) -> tuple[SteadySpeed, ...]:
    """All speeds straight ahead at which the surge force vanishes, slowest first.

    v = r = 0, rudder midships, calm water, the revolutions at which the model starts; states of effects at rest, those
    behind an order at the order. A speed is stable where the surge force falls as the speed rises. A ship
    with two stable ones goes at one or the other as it comes from below or above: no ship with a fixed propeller does,
    but a polynomial may, beyond the speeds at which it was measured.

    Parameters
    ----------
    model : Model
        A ship.

    Returns
    -------
    tuple of SteadySpeed
        Empty if the surge force does not vanish between 0.01 and 2 times the speed of expansion.

    Examples
    --------
    >>> import tank2sim as t2s
    >>> [found.stable for found in steady_speeds(t2s.load("mariner").model)]
    [True]
    """
    from scipy.optimize import brentq  # slow to import

    inputs, parameters = model.input_values(undisturbed_inputs(model)), model.parameter_values()
    start = np.array(model.initial(parameters)).ravel()
    start[np.array([state.steady for state in model.states])] = 0.0
    behind = {name: order for effect in EFFECTS.values() for name, order in effect.states_behind.items()}
    for name in behind.keys() & set(model.state_names):
        if behind[name] in model.input_names:
            start[model.state_names.index(name)] = inputs[model.input_names.index(behind[name])]
    place, rate = model.state_names.index("motion.u"), model.expand(model.symbol("motion.udot"))
    acceleration = ca.Function("acceleration", [model.x, model.u, model.p], [rate], {"cse": True})

    def surge(speed: float) -> float:
        state = start.copy()
        state[place] = speed
        return float(acceleration(state, inputs, parameters))

    speeds = np.linspace(SLOWEST, FASTEST, SPEEDS) * model.defaults["ship.speed"]
    signs = np.sign([surge(speed) for speed in speeds.tolist()])
    rows = np.flatnonzero((signs[1:] != signs[:-1]) & (signs[:-1] != 0))
    held = [float(brentq(surge, *speeds[row : row + 2].tolist())) for row in rows]
    return tuple(SteadySpeed(speed, bool(signs[row] > 0)) for speed, row in zip(held, rows, strict=True))
