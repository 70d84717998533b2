"""Choices by the trials: the card's own terms of the hull or cross-flow drag, output error or the Kalman filter.

Beyond the trials a polynomial may be anything; cross-flow drag is bounded by the physics of separated flow. Where the
trials hardly distinguish the two, the turns with hard rudder may still differ, and the choice says so.

Output error takes the model's motion as exact: its residuals are noise of the sensors. Gusts and waves push the ship
off that motion, and leave residuals far above the noise that hang together over many samples; output error would take
them for coefficients, and the filter-error method is the right one (Maine and Iliff 1981, SIAM J. Appl. Math. 41; Klein
and Morelli 2006, Aircraft System Identification, chapter 6; Jategaonkar 2015, Flight Vehicle System Identification,
chapter 5). Errors of the model leave such residuals as well. The place of the trials distinguishes the two: a basin has
no weather.
"""

from __future__ import annotations

import math
import os
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np

from tank2sim.cards.card import ManoeuvringCard
from tank2sim.dynamics import build
from tank2sim.dynamics.effects import undisturbed_inputs
from tank2sim.errors import InputError
from tank2sim.identification.trials.assessment.evaluation import replay_error
from tank2sim.identification.trials.assessment.identifiability import refuse_unseen
from tank2sim.identification.trials.assessment.model_selection import (
    Criteria,
    criteria,
    cross_validate,
    simplest,
    yaw_rate_error,
)
from tank2sim.identification.trials.methods.coloured_noise import ColouredNoise
from tank2sim.identification.trials.methods.equation_error import equation_error
from tank2sim.identification.trials.options import IdentificationOptions
from tank2sim.identification.trials.problem.estimation_problem import Estimate, Problem
from tank2sim.identification.trials.problem.measured_motion import sensor_noise
from tank2sim.identification.trials.problem.prepare_trials import Measured
from tank2sim.identification.trials.problem.problem_from_card import (
    card_with_estimate,
    problem_from_card,
    with_captive,
    with_correlations,
)
from tank2sim.identification.trials.problem.structures import STRUCTURES
from tank2sim.notices import Notice, caution
from tank2sim.records.signals.columns import SignalName
from tank2sim.records.trials import RUDDERS, Trial
from tank2sim.simulation.manoeuvres import Turn
from tank2sim.simulation.motion_record import OBSERVED_SIGNALS
from tank2sim.simulation.run import simulate

STRONGLY = 1.0
"""Difference of the Bayesian information criterion for each independent sample by which the card's own terms must be
better: residuals that are smaller by a factor e in generalised variance. On measured trials model error, which the
criterion takes for noise, shifts it by up to 0.2; on trials of a ship that has the card's terms it is 59 (project
choice: between the two)."""

HARD_RUDDER = math.radians(35.0)
"""Rudder of the turns that two structures are compared by: that of the turning test of IMO resolution MSC.137(76)."""

NEARLY_HARD = 0.9
"""Share of that rudder from which a trial shows what a hard turn does (project choice)."""

DIFFERENT_TURN = 0.1
"""Share by which the tactical diameters of two structures may differ (project choice: twice what is asked of a
prediction)."""


def structure_by_evidence(
    card: ManoeuvringCard, trials: Measured, options: IdentificationOptions, holdout: Measured | None = None
) -> tuple[str, tuple[Notice, ...]]:
    """Name of the structure, and a notice: cross-flow drag, or the card's own terms if the trials prefer them strongly.

    Both are fitted by equation error. Terms of the card are preferred if their Bayesian information criterion is less
    by more than :data:`STRONGLY` for each independent sample. Where that hardly distinguishes the two, each is fitted
    without one trial at a time, and the card's terms are taken if they predict the trials left out better, by more than
    one standard error of the difference (:func:`.simplest`). Else cross-flow drag is the better guess beyond the
    trials: it is bounded by the physics of separated flow where a polynomial is not. If the hard turns of the two
    differ, and none was held out to judge by, a notice is marked.
    """
    if card.model.kind != "abkowitz":
        return "card", ()
    found: list[Criteria] = []
    cards: list[ManoeuvringCard] = []
    problems: list[Problem] = []
    try:
        for name in ("card", "cross_flow"):
            started = STRUCTURES[name].start(card)
            posed = posed_in(card, started, trials, options)
            posed = posed.without(refuse_unseen(posed))
            estimate = equation_error(posed)
            found.append(criteria(posed, estimate, found[0].samples if found else None))
            cards.append(card_with_estimate(started, estimate))
            problems.append(posed)
    except (InputError, np.linalg.LinAlgError):  # no velocities to compare by, or a card that cannot have the structure
        return "card", ()
    of_card, drag = found
    difference = (of_card.bic - drag.bic) / of_card.samples
    if difference < -STRONGLY:
        return "card", ()
    undecided = abs(difference) < STRONGLY
    taken = "card" if undecided and _predicts_better(*problems) else "cross_flow"
    criterion = f"(BIC {difference:+.2g} for each independent sample, strong below -{STRONGLY:g})"
    chosen = (
        "structure: the card's own third-order terms, which predict trials that were left out better than cross-flow "
        f"drag {criterion}; structure cross_flow takes that"
        if taken == "card"
        else "structure: cross-flow drag in place of the card's own third-order terms, which the trials do not prefer "
        f"strongly {criterion}; structure card keeps them"
    )
    hardest = max((_largest_rudder(trial) for trial in holdout.trials), default=0.0) if holdout else 0.0
    in_doubt = undecided and hardest < NEARLY_HARD * HARD_RUDDER
    return taken, (Notice(chosen), *(_turns_in_doubt(cards[0], cards[1], taken) if in_doubt else ()))


def _predicts_better(of_card: Problem, drag: Problem) -> bool:
    """Whether the card's own terms predict trials that were left out of the fit better than cross-flow drag does."""
    if len(of_card.runs) < 2:
        return False
    problems = {"cross_flow": drag, "card": of_card}
    with ThreadPoolExecutor(os.cpu_count()) as threads:  # most of the work is machine code: threads run in parallel
        found = {
            name: cross_validate(posed, equation_error, yaw_rate_error, threads) for name, posed in problems.items()
        }
    return simplest(found) == "card"


def _largest_rudder(trial: Trial) -> float:
    """Largest angle of the rudder, or order, in a trial, rad."""
    known = (trial.signals[name] for name in RUDDERS if name in trial.signals)
    return max((float(np.nanmax(np.abs(values))) for values in known), default=0.0)


def _turns_in_doubt(of_card: ManoeuvringCard, drag: ManoeuvringCard, taken: str) -> Sequence[Notice]:
    """A caution if the turns of two structures that the trials do not distinguish are different ones."""
    rudder = hard_rudder(drag)
    sizes = [_tactical_diameter(each, rudder) for each in (of_card, drag)]
    if not any(np.isfinite(sizes)) or abs(sizes[0] / sizes[1] - 1) < DIFFERENT_TURN:
        return ()
    texts = [f"{size:.2f} L" if np.isfinite(size) else "none" for size in sizes]
    mine, other = (", taken", "") if taken == "card" else ("", ", taken")
    return (
        caution(
            "the trials hardly distinguish two structures of the hull, whose tactical diameters with "
            f"{math.degrees(rudder):.0f} deg of rudder are {texts[1]} (cross-flow drag{other}) and {texts[0]} (the "
            f"card's own terms{mine}): fit or hold out a turn with as much rudder"
        ),
    )


def hard_rudder(card: ManoeuvringCard) -> float:
    """:data:`HARD_RUDDER`, or the largest angle of the card's gear if that is less, rad."""
    gear = card.steering_gear
    return min(HARD_RUDDER, gear.max_angle_rad if gear is not None and gear.max_angle_rad else HARD_RUDDER)


def _tactical_diameter(card: ManoeuvringCard, rudder: float) -> float:
    """In lengths, in still water; nan if the ship does not turn round."""
    model = build(card)
    try:
        run = simulate(model, Turn(rudder), inputs=undisturbed_inputs(model))
    except InputError:  # a polynomial that drives itself out of all bounds
        return math.nan
    size = run.figures["tactical_diameter_lengths"]
    return float(size) if isinstance(size, float) else math.nan


def posed_in(
    card: ManoeuvringCard, started: ManoeuvringCard, trials: Measured, options: IdentificationOptions
) -> Problem:
    """The problem of a card that was started in a structure, with the correlations of the card's own coefficients."""
    problem = problem_from_card(started, trials.trials, trials.driven_by, inertia=options.inertia, hold=options.hold)
    return with_captive(with_correlations(problem, card), started, trials.captive)


ABOVE_NOISE = 2.0
"""Residuals of whole runs of this many times the sensor's white noise are not that noise (project choice: on made-up
voyages those of the heading are 1.1 times without wind or drift of the sensors, 1.9 times with their drift, 2.3 to 8
times in wind; the filter nests output error, so that it is the smaller mistake)."""

MANY_SAMPLES = 3.0
"""Samples over which residuals of pieces hang together, if they are not white (project choice)."""

_SIGNALS = {variable: signal for signal, variable in OBSERVED_SIGNALS.items()}


@dataclass(frozen=True)
class MethodChoice:
    """A chosen method: ``output_error`` or ``kalman``, and why, in a sentence."""

    method: str
    reason: str


@dataclass(frozen=True)
class SignalResidual:
    """Residuals of output error in one signal."""

    name: str  # Variable of the model
    above_noise: float  # Root mean square over whole runs, over the standard deviation of the sensor's white noise
    # Samples after which the autocorrelation in pieces of the runs has fallen to 1/e; 0 for white residuals
    samples: float

    @property
    def of_process(self) -> bool:
        """Whether they are above the sensor's noise and hang together."""
        return self.above_noise > ABOVE_NOISE and self.samples > MANY_SAMPLES


def signal_residuals(problem: Problem, estimate: Estimate) -> tuple[SignalResidual, ...]:
    """Residuals of output error in each seen signal, of runs simulated from their first state.

    `estimate`: By output error, with its `motion`.
    """
    assert estimate.motion is not None
    white = np.sqrt(np.mean([sensor_noise(problem, run) ** 2 for run in problem.runs], axis=0))
    runs = replay_error(problem, estimate.values, estimate.noise)
    found = []
    for name, sensor, noise in zip(problem.seen, white, estimate.motion.noise, strict=True):
        errors = [run.whole[name] for run in runs if name in run.whole]
        error = float(np.sqrt(np.mean(np.square(errors)))) if errors else 0.0
        above = error / sensor if sensor > 0 else (np.inf if error else 0.0)
        found.append(SignalResidual(name, float(above), correlated_samples(noise)))
    return tuple(found)


def correlated_samples(noise: ColouredNoise) -> float:
    """Samples after which the autocorrelation of a coloured residual has fallen to 1/e of that at a lag of one."""
    return float(-1 / np.log(noise.phi)) if noise.phi > 0 else 0.0


def choose_method(residuals: Sequence[SignalResidual]) -> MethodChoice:
    """The Kalman filter where residuals of output error at sea are of the process, else output error.

    Examples
    --------
    >>> choose_method([SignalResidual("motion.r", 1.1, 40.0), SignalResidual("motion.psi", 6.0, 40.0)]).method
    'kalman'
    >>> choose_method([SignalResidual("motion.psi", 6.0, 0.0)]).method
    'output_error'
    """
    process = [residual for residual in residuals if residual.of_process]
    if not process:
        return MethodChoice("output_error", "its residuals are the noise of the sensors")
    worst = max(process, key=lambda residual: residual.above_noise)
    size, name = f"{worst.above_noise:.2g}", SignalName(_SIGNALS[worst.name]).words
    return MethodChoice(
        "kalman",
        f"what output error leaves in the {name} is {size} times the sensor's noise and hangs together over "
        f"{worst.samples:.0f} samples, as gusts and waves leave it",
    )
