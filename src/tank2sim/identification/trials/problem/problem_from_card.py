"""The estimation problem of a card and trials: the driven model, the free parameters and their prior."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from scipy.ndimage import uniform_filter1d

from tank2sim.arrays import Array
from tank2sim.cards.card import TORQUE_COEFFICIENTS, ManoeuvringCard, MmgCard
from tank2sim.cards.covariance_reading import read_covariance
from tank2sim.cards.form import EffectEntry
from tank2sim.cards.reading import revised
from tank2sim.cards.terms import known_term
from tank2sim.dynamics.abkowitz import ACCELERATION_TERMS, ALL_TERMS, LINEAR_TERMS
from tank2sim.dynamics.card_parameters import card_parameters, joint_errors, study_model
from tank2sim.dynamics.effects import EFFECTS
from tank2sim.dynamics.effects.effect import EffectParameter
from tank2sim.dynamics.mmg.hull import MMG_TERMS
from tank2sim.dynamics.model import Model
from tank2sim.dynamics.roll import roll_terms
from tank2sim.errors import ArgumentError
from tank2sim.identification.trials.problem.estimation_problem import (
    DrivenShip,
    Estimate,
    Problem,
    driven_model,
)
from tank2sim.identification.trials.problem.prepare_trials import Measured
from tank2sim.identification.trials.problem.sampled_runs import SampledRun, in_range, ordered_rudder, prepare, seen_in
from tank2sim.notices import Notice
from tank2sim.records.trials import Trial, window
from tank2sim.units import from_si

if TYPE_CHECKING:
    from tank2sim.identification.trials.problem.captive_tests import CaptiveRuns

LOOSE = 30.0
"""Factor on the standard errors before the trials in the fit of the captive tests alone, from which their noise comes:
the tests then determine all that they show (project choice)."""

ROUNDS, STEPS = 6, 6
"""Rounds of noise, and Gauss-Newton steps in each, of the fit of the captive tests alone: the noise of the KVLCC2's
changes by less than 1 % in the last (project choice)."""

NEARLY_SINGULAR = 1e-6
"""Share of a prior variance that is added to all, so that correlations of 1 (rounded in a file) have an inverse
(project choice)."""

LEAST_PART = 2.0
"""Parts of a run inside the card's range of speeds are used if they last this many L/u0 (project choice)."""

REVOLUTIONS = "propulsion.Xnn"
REVOLUTIONS_ERROR = 0.2
"""Relative standard error before the trials of the effect of revolutions: a card states none (project choice)."""

REVOLUTIONS_VARY = 0.01
"""Revolutions that vary by less than this share of their nominal number show nothing of their effect."""

ASSUMED_EFFECT_ERROR = 0.25
"""Standard error of an effect's parameter without one, as a share of its bounds' distance (project choice)."""

SLOWEST_OF_TURNS = 0.2
"""Speed over the speed of expansion below which a trial is taken for a stop and not for a manoeuvre: a tanker at full
rudder keeps 0.3 to 0.4 of its speed (project choice)."""

SHORTEST_AHEAD = 5.0
"""L/u0 for which a trial must last above the low speeds to be used without its rest (project choice: a quarter of a
turn)."""


def polynomial_over_trials(card: ManoeuvringCard, trials: Sequence[Trial]) -> ManoeuvringCard:
    """The card with its polynomial down to the slowest speed of the trials, if it states no range of speeds itself.

    By default the forces at low speed take the place of the polynomial below half of the speed of expansion, and full
    ships are slower in hard turns: their trials would be compared with another model than the card's. Trials that fall
    below :data:`SLOWEST_OF_TURNS` of that speed are stops and do not count.
    """
    stated = card.model.valid_speed_mps is not None or card.model.low_speed_below_mps is not None
    if stated or card.model.kind != "abkowitz":
        return card
    nominal = card.model.speed_mps
    known = (slowest_speed(trial, card.ship.length_m / nominal) for trial in trials)
    ahead = [speed for speed in known if speed >= SLOWEST_OF_TURNS * nominal]
    return with_polynomial_down_to(card, float(f"{0.95 * min(ahead, default=np.inf):.3g}"))


def with_polynomial_down_to(card: ManoeuvringCard, speed_mps: float) -> ManoeuvringCard:
    """The card with its polynomial down to a speed and the covariance as before; as it is where its bound is as low."""
    if card.model.kind != "abkowitz" or speed_mps >= card.model.low_speed_bound_mps:
        return card
    lowered = revised(card, {}, {"model.low_speed_below_mps": speed_mps}, comment="slowest speed of the trials")
    return replace(lowered, covariance=card.covariance)


def lowered_bound_notice(given: ManoeuvringCard, card: ManoeuvringCard) -> tuple[Notice, ...]:
    """Notice on the change of a card by :func:`polynomial_over_trials`; empty if none.

    `given`, `card`: Before and after.
    """
    if card is given:
        return ()
    text = (
        f"{given.source} states no range of speeds; its polynomial is used down to {card.model.low_speed_bound_mps:g}"
    )
    return (Notice(f"{text} m/s, near the slowest of the trials (model.low_speed_below_mps)"),)


def above_low_speed(card: ManoeuvringCard, group: Measured) -> Measured:
    """Trials up to where the ship falls below the speed at which the polynomial of the card ends.

    The forces at low speed are estimates from the ship's particulars: what they leave would be taken for a physical
    effect that is missing. A trial that is left with less than :data:`SHORTEST_AHEAD` remains whole.

    `card`: ``abkowitz``; trials of others remain as they are.
    """
    if card.model.kind != "abkowitz":
        return group
    ship_time = card.ship.length_m / card.model.speed_mps
    trials, notices = [], []
    for trial in group.trials:
        time, speed = speed_history(trial, ship_time)
        if len(time):
            speed = uniform_filter1d(speed, 1 + 2 * int(np.searchsorted(time, time[0] + 0.25 * ship_time)))
        below = np.flatnonzero(speed < card.model.low_speed_bound_mps)
        if len(below) and time[below[0]] - trial.time_s[0] >= SHORTEST_AHEAD * ship_time:
            end = float(time[below[0]])
            notices.append(
                Notice(
                    f"{trial.name}: compared up to {end:.0f} s, when the ship falls below "
                    f"{card.model.low_speed_bound_mps:g} m/s, where the card's polynomial ends "
                    "(model.low_speed_below_mps)"
                )
            )
            trials.append(window(trial, trial.time_s[0], end))
        else:
            trials.append(trial)
    return replace(group, trials=tuple(trials), notices=(*group.notices, *notices)) if notices else group


def slowest_speed(trial: Trial, ship_time: float) -> float:
    """Lowest speed (m/s) of a trial, noise apart; infinite if :func:`speed_history` knows none.

    `ship_time`: L/u0, s.
    """
    speed = speed_history(trial, ship_time)[1]
    return float(np.quantile(speed, 0.01)) if len(speed) else np.inf


def speed_history(trial: Trial, ship_time: float) -> tuple[Array, Array]:
    """Instants (n,), s, and the ship's speed then (n,), m/s: through the water if it is known, else over the ground;
    none if neither was measured.

    `ship_time`: L/u0, s: positions are compared over a quarter of it.
    """
    signals, time = trial.signals, trial.time_s
    if "u_mps" in signals:
        speed = np.hypot(signals["u_mps"], signals.get("v_mps", 0.0))
    elif "x_m" in signals and "y_m" in signals:
        far = np.searchsorted(time, time + 0.25 * ship_time)
        begin = np.flatnonzero(far < len(time))
        end = far[begin]
        travelled = np.hypot(*(signals[name][end] - signals[name][begin] for name in ("x_m", "y_m")))
        speed, time = travelled / (time[end] - time[begin]), time[begin]
    else:
        return np.zeros(0), np.zeros(0)
    known = np.isfinite(speed)
    return time[known], speed[known]


def fit_driven_by(card: ManoeuvringCard, driven_by: str) -> str:
    """Return the signal that drives the model which is fitted to trials.

    The ``angle`` of the rudder also where only orders were recorded, which the gear of the card follows
    (:mod:`.sampled_runs`); the ``order`` where more than this gear acts between them.

    `driven_by`: ``angle`` if the rudder's angle was measured, ``order`` if only its order is known.
    """
    return "angle" if driven_by == "angle" or ordered_rudder(driven_model(card, "order")) else "order"


def free_parameters(card: ManoeuvringCard, *, inertia: bool = False) -> dict[str, tuple[float, float]]:
    """Name in the model of each free parameter, to its value and standard error before the trials.

    Every derivative that the card has (with a value or an uncertainty) except for accelerations, unless `inertia`
    requests them: motion alone does not determine a mass and a force. Every parameter of the card's effects that is
    not an input. Every coefficient of an MMG propeller or rudder whose standard error the card states, except for those
    of the torque alone.
    """
    return {name: (value, error) for name, value, error in _parameters(card, inertia) if error > 0}  # 0: certain


def _parameters(card: ManoeuvringCard, inertia: bool) -> Iterator[tuple[str, float, float]]:
    """Parameters that may be free, with value and standard error."""
    for name in {**card.derivatives, **card.uncertainty}:
        if name in _used(card) and (inertia or not known_term(name).acceleration):
            yield f"derivatives.{name}", card.derivatives.get(name, 0.0), card.standard_error(name)
    if isinstance(card, MmgCard):
        for key, error in card.interaction_errors.items():
            if key not in TORQUE_COEFFICIENTS:
                yield f"mmg.{key}", card.interaction(key), error
    for entry in card.effects:
        for parameter in _parts_present(entry):
            assumed = ASSUMED_EFFECT_ERROR * (parameter.maximum - parameter.lowest(card))
            error = entry.uncertainty.get(parameter.name, assumed)
            yield f"{entry.name}.{parameter.stem}", parameter.value(entry.parameters, card), error


def _parts_present(entry: EffectEntry) -> Iterator[EffectParameter]:
    """Parameters of an effect, without inputs and without parts of the effect that the card does not have."""
    for parameter in EFFECTS[entry.name].parameters:
        optional = parameter.optional or (parameter.default is not None and parameter.absent is not None)
        if not parameter.input_name and (not optional or parameter.name in entry.parameters):
            yield parameter


def problem_from_card(
    card: ManoeuvringCard,
    trials: Sequence[Trial],
    driven_by: str,
    *,
    inertia: bool = False,
    hold: Sequence[str] = (),
    whole: bool = False,
) -> Problem:
    """The problem of fitting a card's free parameters to trials, except for those in `hold`.

    Parts of runs at speeds outside the range of the card are omitted, unless `whole` is True.

    `trials`: At the ship's size. `driven_by`: ``angle`` or ``order`` of the rudder. `inertia`: Whether accelerations
    are free too. Raises InputError: A trial is too short or has nothing to compare, or the card leaves nothing free.
    """
    ship = DrivenShip(card.text, fit_driven_by(card, driven_by))
    model = driven_model(card, ship.driven_by)
    gear = ordered_rudder(driven_model(card, "order")) if driven_by == "order" else None
    free = free_parameters(card, inertia=inertia)
    known = card.propulsion
    if known is not None and known.Xnn and _spread_of_revolutions(trials) > REVOLUTIONS_VARY * known.nominal_radps:
        free[REVOLUTIONS] = known.Xnn, REVOLUTIONS_ERROR * abs(known.Xnn)
    for name in hold:
        del free[_estimated_name(name, free)]
    if not free:
        raise card.fault("derivatives", "nothing is left to estimate", "give derivatives with a value")
    rudders = [gear.angle(trial) if gear else None for trial in trials]
    values = np.array(list(free.values()))
    runs = _runs(card, model, trials, rudders, None if whole else card.model.valid_speed_mps)
    return Problem(model, tuple(free), values[:, 0], values[:, 1], runs, ship=ship)


def _runs(
    card: ManoeuvringCard,
    model: Model,
    trials: Sequence[Trial],
    rudders: Sequence[tuple[Array, Array] | None],
    speeds: tuple[float, float] | None,
) -> tuple[SampledRun, ...]:
    """The trials on equal steps, their parts at speeds (m/s) alone if these are given; refused if there are none."""
    seen = seen_in(model, trials)
    if not seen:
        raise trials[0].fault("header", "none of its signals can be compared", "give u_mps, r_degps, ...")
    pairs = zip(trials, rudders, strict=True)
    runs = tuple(prepare(model, trial, seen, orders_before=True, rudder=rudder) for trial, rudder in pairs)
    if speeds is not None:
        least_s = LEAST_PART * card.ship.length_m / card.model.speed_mps
        runs = tuple(part for run in runs for part in in_range(run, model, speeds, least_s))
    if not runs:
        low, high = card.model.speed_range_mps
        problem = f"never goes for long at {low:g} to {high:g} m/s, where the card holds"
        raise trials[0].fault("", problem, "change model.valid_speed_mps of the card, or leave it out")
    return runs


def _spread_of_revolutions(trials: Sequence[Trial]) -> float:
    """Standard deviation over all trials, rad/s; 0 if none has revolutions."""
    turned = [trial.signals["n_radps"] for trial in trials if "n_radps" in trial.signals]
    return float(np.nanstd(np.concatenate(turned))) if turned else 0.0


def _estimated_name(name: str, free: Mapping[str, object]) -> str:
    """Full name of a free parameter; ArgumentError if none has this name."""
    found = next((key for key in (name, f"mmg.{name}", f"derivatives.{name}") if key in free), None)
    if found is None:
        text = " ".join(parameter.removeprefix("derivatives.") for parameter in free)
        raise ArgumentError("hold", "", f"{name} is not an estimated parameter", f"estimated are {text}")
    return found


def with_captive(problem: Problem, card: ManoeuvringCard, captive: CaptiveRuns | None) -> Problem:
    """The problem with the equations of captive tests, with the noise of their best fit alone; unchanged without any.

    Fitted together with trials, the noise must not grow until tank and trials agree: it is what the tank's own scatter
    and the structure of the model leave, with standard errors before the trials :data:`LOOSE` times those in `problem`.
    Within one tank the uncertain parameters between tank and ship are none. Raises InputError: The campaign is of
    another ship than the `card`.
    """
    if captive is None:
        return problem
    from tank2sim.identification.trials.problem.captive_tests import captive_tests  # slow to import

    tests = captive_tests(card, problem.model, problem.free, captive)
    values, prior = problem.prior_mean.copy(), problem.prior_precision(LOOSE * problem.prior_error)
    for _ in range(ROUNDS):
        for _ in range(STEPS):
            residual, slopes = tests.residuals(problem.parameters(values))
            weighted = slopes / tests.noise[tests.force][:, None] ** 2
            gradient = weighted.T @ residual + prior @ (values - problem.prior_mean)
            step = np.linalg.solve(weighted.T @ slopes + prior, gradient)
            values = np.clip(values - step, *problem.bounds)
        tests = tests.with_noise_at(problem.parameters(values))
    return replace(problem, captive=tests)


def with_correlations(problem: Problem, card: ManoeuvringCard) -> Problem:
    """The problem with its free parameters correlated before the trials as in the card's covariance, if it has one."""
    if read_covariance(card) is None:
        return problem
    joint = joint_errors(card, card_parameters(card, study_model(card)))
    known = {parameter.name: place for place, parameter in enumerate(joint.parameters) if parameter.standard_error}
    rows = [place for place, name in enumerate(problem.free) if name in known]
    columns = [known[problem.free[place]] for place in rows]
    block = joint.covariance[np.ix_(columns, columns)]
    sizes = np.sqrt(np.diag(block))  # the problem's may be wider
    correlation = np.eye(len(problem.free))
    correlation[np.ix_(rows, rows)] = block / np.outer(sizes, sizes)
    inverse = np.linalg.inv(correlation + NEARLY_SINGULAR * np.eye(len(problem.free)))
    return replace(problem, prior_inverse=np.asarray(inverse, dtype=np.float64))


def card_with_estimate(
    card: ManoeuvringCard, estimate: Estimate, comment: str = "identified from trials"
) -> ManoeuvringCard:
    """The card with the estimates in place of its values, and their standard errors; `comment` is next to each."""
    pairs = zip(estimate.values, estimate.standard_errors, strict=True)
    printed = [(rounded(value, error), float(f"{error:.3g}")) for value, error in pairs]
    found = dict(zip(estimate.free, printed, strict=True))
    derivatives = {
        name.partition(".")[2]: figures for name, figures in found.items() if name.startswith("derivatives.")
    }
    changes: dict[str, object] = dict(_changed_effects(card, found))
    if isinstance(card, MmgCard):
        for key, place in card.interaction_places().items():
            if f"mmg.{key}" in found:
                changes[place], changes[f"uncertainty.{key}"] = found[f"mmg.{key}"]
    if REVOLUTIONS in found:
        changes[REVOLUTIONS] = found[REVOLUTIONS][0] * (float(card.file_scales.force) if card.file_scales else 1.0)
    return revised(card, derivatives, changes, comment=comment)


def _changed_effects(card: ManoeuvringCard, found: Mapping[str, tuple[float, float]]) -> Iterator[tuple[str, object]]:
    """Keys and values, as the file has them, of the effects' parameters in an estimate and their standard errors."""
    for number, entry in enumerate(card.effects):
        for parameter in EFFECTS[entry.name].parameters:
            figures = found.get(f"{entry.name}.{parameter.stem}", ())
            for section, figure in zip(("parameters", "uncertainty"), figures, strict=False):
                yield card.in_file(f"effects.{number}.{section}.{parameter.name}", figure)


def with_range(card: ManoeuvringCard, problem: Problem) -> ManoeuvringCard:
    """The card with its range of validity after the fit.

    The speeds of the runs, if the card states none and they are known; the largest drift, yaw rate and rudder angle
    where the runs exceed the card's. The lower speed limit of the polynomial does not change: no trial shows where it
    breaks down.
    """
    columns = {name: np.concatenate([run.column(f"motion.{name}") for run in problem.runs]) for name in "uvr"}
    changes = _speed_range(card, columns["u"][~np.isnan(columns["u"])])
    for name, largest in _reached(card, problem, columns).items():
        stated = getattr(card.model, name)
        if stated is not None and largest > stated:  # every rudder angle is in a range that states none
            key = card.spelt.get(f"model.{name}", f"model.{name.replace('_rad', '_deg')}")
            changes[key] = float(f"{from_si(key, largest):.3g}")
    return revised(card, {}, changes, comment="range of the trials") if changes else card


def _speed_range(card: ManoeuvringCard, speeds: Array) -> dict[str, object]:
    """The range of speeds (n,), m/s, for a card that states none; empty if it does, or if they are not known."""
    if card.model.valid_speed_mps is not None or not len(speeds) or speeds.min() <= 0:
        return {}
    found: dict[str, object] = {
        "model.valid_speed_mps": [float(f"{speed:.3g}") for speed in (speeds.min(), speeds.max())]
    }
    if card.model.low_speed_below_mps is None:
        found["model.low_speed_below_mps"] = card.model.low_speed_bound_mps
    return found


def _reached(card: ManoeuvringCard, problem: Problem, columns: Mapping[str, Array]) -> dict[str, float]:
    """Largest drift angle (rad), r L/U and rudder angle (rad) of the runs: the 99th percentile, because of noise."""
    known = columns["u"] > 0
    found = {
        "valid_drift_rad": np.arctan2(np.abs(columns["v"][known]), columns["u"][known]),
        "valid_yaw_rate_prime": np.abs(columns["r"][known]) * card.ship.length_m / columns["u"][known],
    }
    rudder = next(place for place, name in enumerate(problem.model.input_names) if name.startswith("rudder."))
    found["valid_rudder_rad"] = np.abs(np.concatenate([run.inputs[:, rudder] for run in problem.runs]))
    finite = {name: values[np.isfinite(values)] for name, values in found.items()}
    return {name: float(np.quantile(values, 0.99)) for name, values in finite.items() if len(values)}


def rounded(value: float, error: float) -> float:
    """Return a value rounded to a thousandth of its standard error: no significant figure is lost."""
    if not 0 < error < np.inf:
        return float(f"{value:.10g}")
    places = int(np.ceil(3 - np.log10(error)))
    return float(round(value, places))


def _used(card: ManoeuvringCard) -> set[str]:
    by_roll = roll_terms(card)
    if card.model.kind == "abkowitz":
        return {*ALL_TERMS, *by_roll}
    if card.model.kind == "mmg":
        return {*MMG_TERMS, *by_roll}
    return {*by_roll, *LINEAR_TERMS["X"], *LINEAR_TERMS["Y"], *LINEAR_TERMS["N"], *ACCELERATION_TERMS}
