"""The problem of a craft with thrusters: what is estimated, what is known before, and the model that is fitted.

The model is the card's, driven by the revolutions that were measured, with five states that do not
change within a trial: the velocity of the current to north and to east, an earth-fixed force to north and to east,
which is the mean wind's, and the bias of the gyro. So they may differ from trial to trial.

Motion alone determines forces over masses; their scale comes from the mass, which is taken as known, through the
added masses.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import casadi as ca
import numpy as np

from tank2sim.arrays import Array
from tank2sim.cards.card import SteeredCard
from tank2sim.cards.craft_terms import CRAFT_ADDED_MASSES, VELOCITY_TERMS
from tank2sim.cards.form import ThrusterSection
from tank2sim.dynamics.build import build
from tank2sim.dynamics.kinematics import earth_velocity
from tank2sim.dynamics.model import Model, Parameter, Quantity, State, same_symbol
from tank2sim.identification.trials.problem.estimation_problem import (
    AND_DIRECTIONS,
    Estimate,
    Problem,
    without_order_response,
    without_turning_lag,
)
from tank2sim.identification.trials.problem.prepare_trials import Measured
from tank2sim.identification.trials.problem.sampled_runs import prepare
from tank2sim.records.same_record import refuse_copies
from tank2sim.records.trials import Trial

CURRENT_SPREAD = 0.3
"""Standard deviation of a component of the current before the trials, m/s: sheltered waters (project choice)."""

FORCE_SPREAD = 0.05
"""Standard deviation of a component of the wind's force before the trials, over the largest thrust: a fresh breeze on a
small craft (project choice)."""

RATE_BIAS_SPREAD = 0.01
"""Standard deviation of the bias of a rate gyro before the trials, rad/s: 0.6 deg/s, a cheap one (project choice)."""

MASS_SPREAD = 0.5
"""Standard error of an added mass on the card, over its value, where the card states none: strip theory and empirical
formulas of slender hulls differ by as much on catamarans (project choice)."""

COUPLED_SPREAD = 0.02
"""Standard error of an added mass that the card leaves out, Yrdot or Nvdot, over (m - Yvdot) L (project choice)."""

DAMPING_SPREAD = 1.0
"""Standard error of a damping coefficient on the card, over its value, where the card states none (project choice)."""

CROSS_FLOW_SPREAD = 0.5
"""Standard error of a damping coefficient that the card leaves out, over cross-flow drag with C_D = 1 at half
the length and half the cruising speed (project choice)."""

THRUST_SPREAD = 1.0
"""Standard error of a thrust curve on the card, over its value, where the card states none (project choice)."""

LAG_SPREAD = 0.5
"""Standard error of the lag of a thruster on the card, over its value, where the card states none (project choice)."""

EXPONENT_SPREAD = 0.3
"""Standard error of the exponent of the orders of a thruster, where the card states none: from revolutions that follow
the order to thrust that nearly does (project choice)."""

_EXPONENTS = (0.2, 3.0)
"""Bounds of the exponent of the orders (project choice)."""

LOSS_SPREAD = 0.5
"""Standard error of the loss of thrust by speed, over half of the thrust at the cruising revolutions over the cruising
speed (project choice)."""

DRAUGHT_OF_CRAFT = 0.06
"""Draught over length where the card states none: between a planing hull and a displacement hull (project
choice)."""

NEVER_POSITIVE = ("Xudot", "Yvdot", "Nrdot", "Xu", "Xuabsu", "Yv", "Yvabsv", "Nr", "Nrabsr")
"""Coefficients that are not positive: an added mass and a damping of each motion by itself."""

COMPASS_SPREADS = {"compass.A": math.radians(2.0), "compass.B": math.radians(5.0), "compass.C": math.radians(5.0)}
"""Standard error of each coefficient of the deviation before the trials, rad: a compass next to the motors of a small
craft that nobody has swung (project choice)."""

DISTURBANCES = ("current.north", "current.east", "disturbance.north", "disturbance.east", "gyro.bias")
"""States of the model that do not change in a trial: m/s, m/s, N, N, rad/s."""

OBSERVED_STEP_S = 0.2
"""Step of the fit, s: five in the shortest time constant of a craft of 2 m (project choice). Of rows that are further
apart it is a whole part, and the motion is measured at the rows alone."""


def craft_fit_model(card: SteeredCard, driven_by: str = "revolutions", *, turned: bool = False) -> Model:
    """The model of a card driven by measured or ordered revolutions, with disturbances as constant states.

    `driven_by`: ``revolutions``: lag, dead band and exponent of the card are left out, for they lie before the
    revolutions; ``orders``: they are in, except a lag shorter than a step. `turned`: The directions of thrusters that
    turn were measured: their lag is left out.
    """
    driven = without_order_response(card) if driven_by == "revolutions" else _with_felt_response(card)
    model = build(without_turning_lag(driven) if turned else driven)
    # Added masses are symmetric in theory (Fossen 2021, 6.3).
    if card.derivatives.get("Yrdot", 0.0) == card.derivatives.get("Nvdot", 0.0):
        model = model.substitute("derivatives.Nvdot", model.symbol("derivatives.Yrdot"))
    for name, keys in twins(card).items():
        for key in keys:
            first = f"thrusters.{card.thrusters[0].name}.{key}"
            if first not in model:  # a lag that is left out
                continue
            model = model.substitute(f"thrusters.{name}.{key}", model.symbol(first))
    thrust = sum(thruster.largest_thrust_N for thruster in card.thrusters)
    described = (
        ("current.north", "m/s", "m/s2", CURRENT_SPREAD, "Velocity of the water to north"),
        ("current.east", "m/s", "m/s2", CURRENT_SPREAD, "Velocity of the water to east"),
        ("disturbance.north", "N", "N", FORCE_SPREAD * thrust, "Force of the wind to north"),
        ("disturbance.east", "N", "N", FORCE_SPREAD * thrust, "Force of the wind to east"),
        ("gyro.bias", "rad/s", "rad/s2", RATE_BIAS_SPREAD, "Bias of the rate gyro, positive to starboard"),
    )
    states, rates = [], []
    for name, unit, rate_unit, nominal, description in described:
        states.append(
            State(name=name, unit=unit, description=description, nominal=nominal, derivative=f"{name}_rate", start=0.0)
        )
        rates.append(Quantity(name=f"{name}_rate", unit=rate_unit, description=f"Rate: {description}", value=ca.SX(0)))
    north, east, force_north, force_east, bias = (state.symbol for state in states)
    forward, starboard = earth_velocity(force_north, force_east, -model.symbol("motion.psi"))
    shown = Quantity(
        name="gyro.rate",
        unit="rad/s",
        description="Yaw rate that the gyro shows, positive to starboard",
        value=model.symbol("motion.r") + bias,
    )
    return (
        model.extend(*states, *rates, shown, *_compass(model))
        .redefine("motion.xdot", lambda speed: speed + north)
        .redefine("motion.ydot", lambda speed: speed + east)
        .redefine("force.X", lambda force: force + forward)
        .redefine("force.Y", lambda force: force + starboard)
    )


def _compass(model: Model) -> list[Parameter | Quantity]:
    """A compass with a deviation, and the velocity over the ground in axes of its heading.

    Heading shown - heading = A + B sin(heading) + C cos(heading): the lubber's line and the permanent magnetism of the
    craft (Smith and Evans 1863, Admiralty manual for ascertaining and applying the deviations of the compass).
    """
    words = {"compass.A": "constant", "compass.B": "by the sine", "compass.C": "by the cosine of the heading"}
    parts = [
        Parameter(name=name, unit="rad", description=f"Deviation of the compass, {words[name]}", start=0.0)
        for name in COMPASS_SPREADS
    ]
    constant, sine, cosine = (part.symbol for part in parts)
    psi, u, v = (model.symbol(f"motion.{key}") for key in ("psi", "u", "v"))
    deviation = constant + sine * ca.sin(psi) + cosine * ca.cos(psi)
    ahead, across = earth_velocity(u, v, -deviation)
    heading = "Heading that the compass shows"
    return [
        *parts,
        Quantity(name="compass.heading", unit="rad", description=heading, value=psi + deviation),
        Quantity(name="compass.u", unit="m/s", description=f"Velocity along the {heading.lower()}", value=ahead),
        Quantity(name="compass.v", unit="m/s", description=f"Velocity across the {heading.lower()}", value=across),
    ]


def _with_felt_response(card: SteeredCard) -> SteeredCard:
    """The card with the response to orders that the steps of the fit show; its exponent is one of the unknowns."""
    responses = [
        {"time_constant_s": _felt(thruster.time_constant_s), "order_exponent": thruster.order_exponent or 1.0}
        for thruster in card.thrusters
    ]
    thrusters = zip(card.thrusters, responses, strict=True)
    return replace(card, thrusters=tuple(thruster.model_copy(update=changes) for thruster, changes in thrusters))


def _felt(lag_s: float | None) -> float | None:
    """A lag that the steps of the fit show, s; None for a shorter one."""
    return lag_s if lag_s is not None and lag_s >= OBSERVED_STEP_S else None


def twins(card: SteeredCard) -> dict[str, tuple[str, ...]]:
    """Thruster to the parameters that it shares with the first one, because the card states the same numbers.

    Each has a thrust of its own: two of a make differ, and one of a pair may turn against the hand of its propeller.
    """
    shared = {"speed_loss_kg": "speed_loss", "order_exponent": "order_exponent", "time_constant_s": "time_constant"}
    first, *others = card.thrusters
    return {
        other.name: tuple(shared.values())
        for other in others
        if all(getattr(other, key) == getattr(first, key) for key in ("ahead_Ns2", "astern_Ns2", *shared))
    }


def craft_prior(card: SteeredCard, model: Model) -> dict[str, tuple[float, float]]:
    """Free parameter to its value and standard error before the trials, SI.

    All terms of the hull are free but the mass, the yaw inertia and its centre; thrust curves and the loss of thrust by
    speed of each thruster, where they are not shared.
    """
    found: dict[str, tuple[float, float]] = {}
    length, mass, speed = card.ship.length_m, card.rigid_body.mass, card.model.speed_mps
    known = card.derivatives
    sway = mass - known.get("Yvdot", 0.0)
    for name in CRAFT_ADDED_MASSES:
        if f"derivatives.{name}" not in model:
            continue
        value = known.get(name, 0.0)
        spread = MASS_SPREAD * abs(value) or COUPLED_SPREAD * sway * length
        found[f"derivatives.{name}"] = value, card.uncertainty.get(name, spread)
    draught = card.ship.draught_m or DRAUGHT_OF_CRAFT * length
    drag = 0.5 * card.environment.water_density_kgpm3 * length * draught
    for term in VELOCITY_TERMS:
        value = known.get(term.name, 0.0)
        arms = term.lengths
        usual = drag * (length / 2) ** arms / (1 + arms) * (1.0 if term.size else speed / 2)
        spread = max(DAMPING_SPREAD * abs(value), CROSS_FLOW_SPREAD * usual)
        found[f"derivatives.{term.name}"] = value, card.uncertainty.get(term.name, spread)
    for thruster in card.thrusters:
        found |= _thruster_prior(thruster, speed, model)
    return found | {name: (0.0, spread) for name, spread in COMPASS_SPREADS.items()}


def _thruster_prior(thruster: ThrusterSection, speed: float, model: Model) -> dict[str, tuple[float, float]]:
    """Parameter of a thruster that a model has to its value and standard error before the trials, SI."""
    spreads = {
        "ahead": ("ahead_Ns2", THRUST_SPREAD * thruster.ahead_Ns2),
        "astern": ("astern_Ns2", THRUST_SPREAD * max(thruster.astern_Ns2, 0.5 * thruster.ahead_Ns2)),
        "speed_loss": ("speed_loss_kg", LOSS_SPREAD * 0.5 * thruster.ahead_Ns2 * thruster.max_radps / speed),
        "order_exponent": ("order_exponent", EXPONENT_SPREAD),
    }
    if lag := _felt(thruster.time_constant_s):
        spreads["time_constant"] = "time_constant_s", LAG_SPREAD * lag
    found = {}
    for part, (key, spread) in spreads.items():
        if (name := f"thrusters.{thruster.name}.{part}") in model:
            stated = getattr(thruster, key)
            found[name] = 1.0 if stated is None else stated, thruster.uncertainty.get(key, spread)
    return found


_SEEN = {"psi_rad": "motion.psi", "x_m": "motion.x", "y_m": "motion.y", "u_mps": "motion.u", "v_mps": "motion.v"}
_SEEN |= {"r_radps": "motion.r"}
"""Signal of a trial to the state that it measures."""

_SENSORS = {"motion.psi": "compass.heading", "motion.r": "gyro.rate"}
"""State to what a sensor with errors of its own shows of it."""


def craft_problem(card: SteeredCard, trials: Sequence[Trial]) -> Problem:
    """The problem of a card and trials.

    `trials`: By :func:`tank2sim.records.craft_trials.read_craft_trial`. Raises InputError: A trial is too short, or
    some trials have revolutions and others orders alone.
    """
    by = craft_driven_by(card, trials)
    model = craft_fit_model(card, by, turned=_directions_measured(trials))
    model = within_physics(model)
    trials = [_driven(trial, by) for trial in trials]
    prior = craft_prior(card, model)
    signals = {signal for trial in trials for signal in trial.signals}
    seen = [variable for signal, variable in _SEEN.items() if signal in signals]
    shown = tuple(_SENSORS.get(name, name) for name in seen)
    runs = [replace(prepare(model, trial, seen, step_s=OBSERVED_STEP_S), seen=shown) for trial in trials]
    means, errors = (np.array(column) for column in zip(*prior.values(), strict=True))
    return Problem(model, tuple(prior), means, errors, tuple(runs))


CERTAIN_ERRORS = 3.0
"""Standard errors beyond which a part of the deviation by the heading is taken for real (project choice: by chance in
one craft of 200)."""


def deviates(estimate: Estimate) -> bool:
    """Whether a part of the compass's deviation that goes with the heading is beyond :data:`CERTAIN_ERRORS`."""
    found = zip(estimate.free, estimate.values, estimate.standard_errors, strict=True)
    return any(
        abs(value) > CERTAIN_ERRORS * error for name, value, error in found if name in ("compass.B", "compass.C")
    )


def craft_driven_by(card: SteeredCard, trials: Sequence[Trial]) -> str:
    """Inputs of the model in all trials: ``revolutions``, which were measured, or else ``orders``.

    Raises InputError: Some trials have revolutions and no orders, others orders alone.
    """
    if all(f"n_{thruster.name}_radps" in trial.signals for trial in trials for thruster in card.thrusters):
        return "revolutions"
    for trial in trials:
        if any(f"order_{thruster.name}_radps" not in trial.signals for thruster in card.thrusters):
            problem = "has revolutions and no orders, and another trial has orders alone"
            raise trial.fault("header", problem, "give trials of one kind")
    return "orders"


def measured_of_craft(card: SteeredCard, *groups: Sequence[Trial]) -> tuple[Measured, ...]:
    """Groups of trials of a craft, with the inputs alone that drive its model in all of them.

    `groups`: By :func:`tank2sim.records.craft_trials.read_craft_trial`. Raises InputError: Some trials have revolutions
    and others orders alone, or some directions are measured and others ordered, or two of a group are one record.
    """
    trials = [trial for group in groups for trial in group]
    by = craft_driven_by(card, trials)
    turned = any(thruster.max_azimuth_rad is not None for thruster in card.thrusters) and _directions_measured(trials)
    drive = by + AND_DIRECTIONS if turned else by
    return tuple(
        Measured(tuple(_driven(trial, by) for trial in group), drive, tuple(refuse_copies(group))) for group in groups
    )


def _directions_measured(trials: Sequence[Trial]) -> bool:
    """Whether no trial has the ordered direction of a thruster.

    Raises InputError: Some trials have the direction as measured, others as ordered.
    """
    ordered = [any(name.startswith("azimuth_order_") for name in trial.signals) for trial in trials]
    for trial, by_order in zip(trials, ordered, strict=True):
        if by_order and not all(ordered):
            problem = "has the ordered direction of a thruster, and another trial the measured one"
            raise trial.fault("header", problem, "give trials of one kind")
    return not any(ordered)


def _driven(trial: Trial, driven_by: str) -> Trial:
    """A trial without the orders where revolutions drive the model, and the reverse."""
    unused = "order_" if driven_by == "revolutions" else "n_"
    return replace(trial, signals={key: value for key, value in trial.signals.items() if not key.startswith(unused)})


def with_disturbances(problem: Problem, means: Array, spreads: Array) -> Problem:
    """The problem in which the disturbances of a trial are `means` within `spreads` (5,) before it is looked at.

    `problem`: By :func:`craft_problem`. `means`, `spreads` (5,): Means and spreads of the :data:`DISTURBANCES`.
    """
    known = dict(zip(DISTURBANCES, zip(means.tolist(), spreads.tolist(), strict=True), strict=True))

    def with_prior(state: State) -> State:
        if state.name not in known:
            return state
        mean, spread = known[state.name]
        return same_symbol(state, replace(state, start=mean, nominal=spread))

    return replace(problem, model=replace(problem.model, states=tuple(map(with_prior, problem.model.states))))


_BOUNDS: dict[str, dict[str, Any]] = {
    ".speed_loss": {"minimum": None},  # its error may have either sign
    ".time_constant": {"minimum": OBSERVED_STEP_S / 2},  # less does not show
    ".order_exponent": {"minimum": _EXPONENTS[0], "maximum": _EXPONENTS[1]},
    **{f"derivatives.{name}": {"maximum": 0.0} for name in NEVER_POSITIVE},
}
"""End of a parameter's name to its bounds."""


def within_physics(model: Model) -> Model:
    """The model with bounds on the coefficients of the hull and the thrusters that no craft exceeds."""
    return replace(model, parameters=tuple(map(_bounded, model.parameters)))


def _bounded(parameter: Parameter) -> Parameter:
    """A parameter with the bounds of physics."""
    bounds = next((bounds for end, bounds in _BOUNDS.items() if parameter.name.endswith(end)), None)
    return parameter if bounds is None else same_symbol(parameter, replace(parameter, **bounds))
