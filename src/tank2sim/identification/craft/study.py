"""Studies of a craft's trials: coefficients with their verdicts, and free-running predictions.

Which manoeuvre of five minutes would determine what the trials of a craft do not.

Each candidate is simulated with the estimates, and its information added to that of the trials, at their noise levels.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from threadpoolctl import threadpool_limits

from tank2sim.arrays import Array, Number
from tank2sim.cards.card import SteeredCard
from tank2sim.cards.examination import doubts
from tank2sim.errors import InputError
from tank2sim.identification.craft.first_values import PREDICTED_S
from tank2sim.identification.craft.fit import (
    IDENTIFIED_SHARE,
    PREDICTION_LEAD_S,
    SHORTEST_PREDICTION_S,
    TRIALS_SHARE,
    CoefficientVerdict,
    CraftFit,
    FreePrediction,
    determination,
    information,
    predict_by_card,
)
from tank2sim.identification.craft.order_response import OrderResponse
from tank2sim.identification.craft.problem import COMPASS_SPREADS, craft_problem, deviates
from tank2sim.notices import Notice, caution
from tank2sim.records.trials import Trial
from tank2sim.simulation.sensitivity import Sensitivity
from tank2sim.units import from_si

TRIAL_S = 300.0
"""Length of a candidate, s: five minutes."""


@dataclass(frozen=True, eq=False)
class CandidateTrial:
    """A manoeuvre of five minutes."""

    words: str  # Orders in words, revolutions in % of the largest: port/starboard
    t_s: tuple[float, ...]
    # `order_port`, `order_starboard`: Orders of the thrusters at these times, shares of their largest revolutions
    order_port: tuple[float, ...]
    order_starboard: tuple[float, ...]
    determines: tuple[str, ...]  # Coefficients that the trials so far do not determine and that it would


def _patterns() -> dict[str, list[tuple[float, float, float]]]:
    """Candidate in words to (seconds, port, starboard) of its steps, which are repeated. Project choices."""
    return {
        "straight runs and coasting: 25 s each of 40/40, 0/0, 80/80, 0/0, 100/100, 0/0": [
            (25.0, level, level) for level in (0.4, 0.0, 0.8, 0.0, 1.0, 0.0)
        ],
        "going astern and ahead: 20 s each of -40/-40, 40/40, -80/-80, 80/80": [
            (20.0, level, level) for level in (-0.4, 0.4, -0.8, 0.8)
        ],
        "spins: 25 s each of 30/-30, -30/30, 60/-60, -60/60": [
            (25.0, level, -level) for level in (0.3, -0.3, 0.6, -0.6)
        ],
        "turns out of speed: 20 s each of 70/70, 90/50, 70/70, 40/80, 100/20, 20/100": [
            (20.0, port, starboard)
            for port, starboard in ((0.7, 0.7), (0.9, 0.5), (0.7, 0.7), (0.4, 0.8), (1.0, 0.2), (0.2, 1.0))
        ],
        "random steps: 6 s each of 80/20, -30/40, 60/60, 100/-50, 0/70, 30/90, -60/-20, 90/0": [
            (6.0, port, starboard)
            for port, starboard in (
                *((0.8, 0.2), (-0.3, 0.4), (0.6, 0.6), (1.0, -0.5)),
                *((0.0, 0.7), (0.3, 0.9), (-0.6, -0.2), (0.9, 0.0)),
            )
        ],
    }


def next_trials(card: SteeredCard, fit: CraftFit) -> list[CandidateTrial]:
    """The candidates, the one first that determines most of the coefficients that the trials do not.

    Empty for a craft whose thrusters are not two.
    """
    if len(card.thrusters) != 2:
        return []
    problem = fit.problem
    # The reported errors allow for residuals unlike the noise model: a candidate narrows both alike.
    so_far = fit.by_run.sum(axis=0) + problem.prior_precision(problem.prior_error)
    now = np.minimum(fit.estimate.standard_errors, problem.prior_error)
    found = []
    for words, steps in _patterns().items():
        orders, inputs = _orders(card, fit, steps)
        added = _added_information(fit, inputs)
        errors = now.copy()
        if added is not None:
            errors *= np.sqrt(np.diag(np.linalg.inv(so_far + added)) / np.diag(np.linalg.inv(so_far)))
        shows = (errors <= TRIALS_SHARE * problem.prior_error) | (
            errors <= IDENTIFIED_SHARE * np.abs(fit.estimate.values)
        )
        determined = [_short(name) for name in fit.undetermined if shows[problem.free.index(name)]]
        times, port, starboard = zip(*orders, strict=True)
        found.append(CandidateTrial(words, times, port, starboard, tuple(determined)))
    return sorted(found, key=lambda candidate: -len(candidate.determines))


def _orders(
    card: SteeredCard, fit: CraftFit, steps: list[tuple[float, float, float]]
) -> tuple[tuple[tuple[float, float, float], ...], Array]:
    """Orders over five minutes, and the inputs of the model (n, nu)."""
    model, step = fit.problem.model, fit.problem.runs[0].step_s
    left, right = sorted(card.thrusters, key=lambda thruster: thruster.y_m)
    places = [model.input_names.index(f"thrusters.{thruster.name}.command") for thruster in (left, right)]
    inputs = np.tile(model.input_values(), (round(TRIAL_S / step), 1))
    orders, begin, number = [], 0.0, 0
    while begin < TRIAL_S:
        length, port, starboard = steps[number % len(steps)]
        orders.append((begin, port, starboard))
        rows = slice(round(begin / step), round((begin + length) / step))
        for place, share, thruster in ((places[0], port, left), (places[1], starboard, right)):
            inputs[rows, place] = share * (thruster.max_radps if share >= 0 else -thruster.lowest_radps)
        begin, number = begin + length, number + 1
    return tuple(orders), inputs


def _added_information(fit: CraftFit, inputs: Array) -> Array | None:
    """Information of a simulated trial (k, k); None if the motion or the covariance of its filter leaves all bounds."""
    problem = fit.problem
    run = problem.runs[0]
    model = problem.model
    sensitivity = Sensitivity(model, problem.free, problem.seen)
    p = problem.parameters(fit.estimate.values)
    start = np.zeros(len(model.state_names))
    states = sensitivity.motion(start, inputs[:-1], p, run.step_s)
    if not np.isfinite(states).all() or np.abs(states).max() > 1e6:
        return None
    shown = sensitivity.shown(states, inputs, p)
    made = replace(run, name="candidate", begin_s=0.0, inputs=inputs, measured=shown)
    try:
        return np.asarray(information(problem.with_runs((made,)), fit.estimate.values, fit.estimate.levels)[0])
    except InputError:  # the filter loses the motion
        return None


NOT_ITS_OWN = (
    "a trial that the card was identified from shows how well it was fitted, and not how well the card predicts"
)
"""Notice of each validation: a card of a craft does not say what it was identified from."""


@dataclass(frozen=True, kw_only=True)
class CraftCoefficient:
    """A coefficient of a craft, SI.

    Parameters
    ----------
    value, standard_error : float
    before, prior_standard_error : float
        Value and standard error of the card.
    verdict : CoefficientVerdict
    by : str or None
        Trial without which the standard error would grow most; None where no trial determines it.
    """

    value: float
    standard_error: float
    before: float
    prior_standard_error: float
    verdict: CoefficientVerdict
    by: str | None


@dataclass(frozen=True, kw_only=True)
class ThrusterResponse:
    """Response of a thruster to its orders.

    Parameters
    ----------
    lag_s, lag_error_s : float
        Time constant and its standard error.
    dead_band_rpm, dead_band_error_rpm : float or None
        None where no order left the propeller at rest.
    rest_rpm, turning_rpm : float
        Largest order at which the propeller rested, 0 without any, and least order at which it turned.
    """

    lag_s: float
    lag_error_s: float
    dead_band_rpm: float | None
    dead_band_error_rpm: float | None
    rest_rpm: float
    turning_rpm: float


@dataclass(frozen=True, kw_only=True)
class CompassDeviation:
    """Deviation of the compass with which the trials were recorded: A + B sin(heading) + C cos(heading).

    Parameters
    ----------
    a_deg, b_deg, c_deg : float
        Heading shown less heading.
    a_error_deg, b_error_deg, c_error_deg : float
        Standard errors.
    """

    a_deg: Number
    a_error_deg: Number
    b_deg: Number
    b_error_deg: Number
    c_deg: Number
    c_error_deg: Number


@dataclass(frozen=True, eq=False, kw_only=True)
class CraftIdentificationStudy:
    """Coefficients and thrust curves of a craft with thrusters.

    Parameters
    ----------
    ship, method : str
    trials, held_out : tuple of str
        Names of the trials that were fitted, and held out (also those too short to be predicted).
    coefficients : dict
        By name without ``derivatives.`` and ``thrusters.``.
    compass : CompassDeviation or None
        None where the trials show none.
    noise : dict
        Standard deviation of the noise by signal, SI.
    determination : dict or None
        R^2 of u, v and r of all predictions of held-out trials, next to the smoothed motion; None without any.
    driven_by : str
        ``revolutions`` of the thrusters, or their ``orders``.
    order_responses : dict
        By thruster, where the trials hold orders next to revolutions.
    next_trials : tuple of CandidateTrial
        Manoeuvres of five minutes; the first determines most of the coefficients that these trials do not.
    notices : tuple of Notice
    """

    ship: str
    method: str
    trials: tuple[str, ...]
    coefficients: dict[str, CraftCoefficient]
    compass: CompassDeviation | None
    noise: dict[str, Number]
    determination: dict[str, Number] | None
    driven_by: str
    order_responses: dict[str, ThrusterResponse]
    held_out: tuple[str, ...]
    next_trials: tuple[CandidateTrial, ...]
    notices: tuple[Notice, ...]


def study_craft(
    card: SteeredCard,
    found: SteeredCard,
    fit: CraftFit,
    held: Mapping[str, FreePrediction | None],
    responses: Mapping[str, OrderResponse],
    driven_by: str,
) -> CraftIdentificationStudy:
    """Study of the fit of a craft.

    `card`, `found`: Given and found. `held`: Held-out trials by name, each with its predictions; None for one too
    short. `responses`: Response to orders by thruster. `driven_by`: ``revolutions`` or ``orders``.
    """
    predictions = [entry for entry in held.values() if entry is not None]
    r_squared = prediction_r_squared(predictions) if predictions else None
    compass = _compass(fit)
    too_short = bool(held) and not predictions
    return CraftIdentificationStudy(
        ship=card.ship.name,
        method=fit.estimate.method,
        trials=tuple(run.name for run in fit.problem.runs),
        coefficients=_coefficients(fit),
        compass=compass,
        noise=dict(fit.estimate.measurement_noise),
        determination=r_squared,
        driven_by=driven_by,
        order_responses={name: _response(response) for name, response in responses.items()},
        held_out=tuple(held),
        next_trials=tuple(next_trials(card, fit)),
        notices=(
            *worse_than_a_mean(r_squared or {}),
            *dict.fromkeys((*doubts(card), *doubts(found))),
            *_fit_notices(fit, driven_by, too_short=too_short),
            *_dead_band_notices(card, responses, driven_by),
            *_speed_notices(card, found),
            *_instrument_notices(compass if deviates(fit.estimate) else None),
        ),
    )


def _fit_notices(fit: CraftFit, driven_by: str, *, too_short: bool) -> Iterator[Notice]:
    """Notices of thrust curves, held-out trials, orders, and of a model that does not hold."""
    thrust = [name for name in fit.undetermined if name.endswith((".ahead", ".astern"))]
    if thrust:
        yield caution(f"the trials do not determine {', '.join(thrust)}: the card's value is kept")
    if too_short:
        least = PREDICTION_LEAD_S + SHORTEST_PREDICTION_S
        yield Notice(f"no held-out trial is longer than {least:g} s: none is predicted")
    if driven_by == "orders":
        words = "the trials have orders and no revolutions: a full order counts as the largest revolutions of the card"
        yield Notice(words)
    if not fit.holds:
        yield _model_does_not_hold(fit)


def _speed_notices(card: SteeredCard, found: SteeredCard) -> Iterator[Notice]:
    if found.model.speed_mps != card.model.speed_mps:
        yield caution(
            f"model.speed_mps is {found.model.speed_mps:g} in place of {card.model.speed_mps:g} m/s: with these "
            "coefficients the largest revolutions of the thrusters do not hold the card's; check them"
        )


def _instrument_notices(compass: CompassDeviation | None) -> Iterator[Notice]:
    if compass is not None:
        yield Notice(
            f"the compass of these trials deviates by A {compass.a_deg:+.1f}, B {compass.b_deg:+.1f} sin(heading), "
            f"C {compass.c_deg:+.1f} cos(heading) deg: the headings were corrected by it; swing the compass"
        )
    yield Notice(
        "the mass on the card is taken as exact: motion determines forces over masses, so that an error of the "
        "mass is one of all forces, in the same share"
    )


def _model_does_not_hold(fit: CraftFit) -> Notice:
    """That the filter explains the trials by more than gusts, and which estimate is given instead."""
    words = "the filter loses a trial with the estimate that it finds: the model does not hold closely"
    if np.isfinite(fit.gust_share):
        words = (
            f"the filter needs random accelerations of {100 * fit.gust_share:.0f} % of that by full thrust, which is "
            "more than gusts: the model does not hold closely"
        )
    if fit.estimate.method == "kalman":
        return caution(f"{words}, and the coefficients may describe its errors")
    return Notice(f"{words}; the coefficients are those that predict {PREDICTED_S:g} s of free motion best")


def worse_than_a_mean(r_squared: Mapping[str, float]) -> list[Notice]:
    """A caution where predictions of held-out trials are worse than the mean of what was measured.

    `r_squared`: R^2 of u, v and r.
    """
    bad = [f"{name} {value:.2g}" for name, value in r_squared.items() if not value > 0]
    if not bad:
        return []
    return [
        caution(
            f"PREDICTS NOTHING: predictions of held-out trials are worse than the mean of their motion (R^2 of "
            f"{', '.join(bad)}): these coefficients are not this craft's, whatever their standard errors"
        )
    ]


def _dead_band_notices(card: SteeredCard, responses: Mapping[str, OrderResponse], driven_by: str) -> Iterator[Notice]:
    if not responses:
        words = "orders, and need revolutions" if driven_by == "orders" else "revolutions, and need orders"
        yield Notice(f"dead bands are taken from the card: the trials have {words} next to them")
    for thruster in card.thrusters:
        response = responses.get(thruster.name)
        if response is None or response.dead_band is not None:
            continue
        least = from_si("n_rpm", response.turning_radps)
        text = f"the dead band of thruster {thruster.name} was taken from the card: no order left the propeller at rest"
        if thruster.dead_band_radps >= response.turning_radps:
            yield caution(f"{text}, and one of {least:.3g} rpm, within it, turned it")
        else:
            yield Notice(f"{text}; one of {least:.3g} rpm turned it")


def _compass(fit: CraftFit) -> CompassDeviation | None:
    places = {name[-1].lower(): place for place, name in enumerate(fit.problem.free) if name in COMPASS_SPREADS}
    if not places:
        return None
    values, errors = np.degrees(fit.estimate.values), np.degrees(fit.estimate.standard_errors)
    found = {f"{letter}_deg": float(values[place]) for letter, place in places.items()}
    return CompassDeviation(**found, **{f"{letter}_error_deg": float(errors[at]) for letter, at in places.items()})


def _short(name: str) -> str:
    return name.removeprefix("derivatives.").removeprefix("thrusters.")


def _coefficients(fit: CraftFit) -> dict[str, CraftCoefficient]:
    found = {}
    for place, (name, verdict) in enumerate(zip(fit.problem.free, fit.verdicts, strict=True)):
        if name in COMPASS_SPREADS:
            continue
        known = verdict is not CoefficientVerdict.PRIOR
        found[_short(name)] = CraftCoefficient(
            value=float(fit.estimate.values[place]),
            standard_error=float(fit.estimate.standard_errors[place]),
            before=float(fit.problem.prior_mean[place]),
            prior_standard_error=float(fit.problem.prior_error[place]),
            verdict=verdict,
            by=fit.problem.runs[fit.best_run(place)].name if known else None,
        )
    return found


def _response(response: OrderResponse) -> ThrusterResponse:
    band, error = response.dead_band or (None, None)
    return ThrusterResponse(
        lag_s=response.lag_s,
        lag_error_s=response.lag_error_s,
        dead_band_rpm=None if band is None else float(from_si("n_rpm", band)),
        dead_band_error_rpm=None if error is None else float(from_si("n_rpm", error)),
        rest_rpm=float(from_si("n_rpm", response.rest_radps)),
        turning_rpm=float(from_si("n_rpm", response.turning_radps)),
    )


def prediction_r_squared(predictions: Sequence[FreePrediction]) -> dict[str, float]:
    """R^2 of u, v and r of all predictions, next to the smoothed motion."""
    predicted = np.concatenate([entry.predicted for entry in predictions])
    smoothed = np.concatenate([entry.smoothed for entry in predictions])
    return dict(zip("uvr", map(float, determination(predicted, smoothed)), strict=True))


@dataclass(frozen=True, kw_only=True)
class TrialPrediction:
    """Free-running predictions of a trial.

    Parameters
    ----------
    predictions : int
        Number of predictions.
    rms_u_mps, rms_v_mps, rms_r_degps : float
        Root mean square errors of the motion.
    end_distance_m, end_heading_deg : float or None
        Root mean square errors of position and heading at the ends of predictions; None where nothing was measured.
    """

    predictions: int
    rms_u_mps: Number
    rms_v_mps: Number
    rms_r_degps: Number
    end_distance_m: float | None
    end_heading_deg: float | None


@dataclass(frozen=True, eq=False, kw_only=True)
class PredictionStudy:
    """Free-running predictions of trials by a craft's card.

    Parameters
    ----------
    determination : dict
        R^2 of u, v and r of all predictions, next to the motion smoothed with the card.
    end_distance_m, end_heading_deg : float or None
        As of :class:`TrialPrediction`, for all trials.
    trials : dict
        Predictions by trial.
    """

    determination: dict[str, Number]
    end_distance_m: float | None
    end_heading_deg: float | None
    trials: dict[str, TrialPrediction]


def predict_trials(card: SteeredCard, trials: Sequence[Trial]) -> tuple[PredictionStudy, tuple[Notice, ...]]:
    """Predict trials of a craft by its card and recorded revolutions, from the state of a filter after ten seconds.

    `trials`: Trials (:func:`.read_craft_trial`). Raises InputError: A file is at fault, none is long enough, or the
    card does not move as the trials do.
    """
    problem = craft_problem(card, trials)
    with np.errstate(all="ignore"), threadpool_limits(limits=1, user_api="blas"):
        predictions = predict_by_card(problem)
    least = PREDICTION_LEAD_S + SHORTEST_PREDICTION_S
    if not predictions:
        raise InputError("trials", "", f"none is longer than {least:g} s", "give longer ones")
    known = {entry.run.file for entry in predictions}
    short = [trial.path.name for trial in trials if str(trial.path) not in known]
    too_short = [Notice(f"not longer than {least:g} s, and not predicted: {', '.join(short)}")] if short else []
    distance, heading = _at_ends(predictions)
    study = PredictionStudy(
        determination=prediction_r_squared(predictions),
        end_distance_m=distance,
        end_heading_deg=heading,
        trials={entry.run.name: _predicted(entry) for entry in predictions},
    )
    return study, (*too_short, Notice(NOT_ITS_OWN))


def _predicted(prediction: FreePrediction) -> TrialPrediction:
    rms = np.sqrt(((prediction.predicted - prediction.smoothed) ** 2).mean(axis=0))
    distance, heading = _at_ends([prediction])
    return TrialPrediction(
        predictions=len(prediction.ends),
        rms_u_mps=float(rms[0]),
        rms_v_mps=float(rms[1]),
        rms_r_degps=math.degrees(rms[2]),
        end_distance_m=distance,
        end_heading_deg=heading,
    )


def _at_ends(predictions: Sequence[FreePrediction]) -> tuple[float | None, float | None]:
    """Rms distance (m) and heading error (deg) at the ends of predictions; None where nothing was measured there."""
    ends = np.concatenate([entry.ends for entry in predictions])
    turned = np.degrees((ends[:, 2] + np.pi) % (2 * np.pi) - np.pi)
    return _rms(np.hypot(ends[:, 0], ends[:, 1])), _rms(turned)


def _rms(values: Array) -> float | None:
    known = values[np.isfinite(values)]
    return float(np.sqrt((known**2).mean())) if len(known) else None
