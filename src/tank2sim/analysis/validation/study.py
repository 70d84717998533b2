"""Validation of a manoeuvring simulation against trials, figure by figure, by the procedures of ITTC and ASME.

    E = S - D,   u_val^2 = u_num^2 + u_input^2 + u_D^2,   U_val = 2 u_val

with the figure S of the simulation and D of the trial. If |E| <= U_val, the error of the model cannot be distinguished
from the uncertainties, and the figure is validated at the level U_val; if not, the model errs by about E. A large U_val
is not an advantage, because uncertain data cannot refute a model: above a required level, U_reqd, the figure counts as
too uncertain. ASME V&V 20-2009 (where E is S - D); ITTC 7.5-03-01-01 (E = D - S, and likewise U_V); Stern, Wilson,
Coleman and Paterson (2001), J. Fluids Engineering 123. The factor of 2 is for 95 %.

- u_num: the simulation is repeated with half the step. U_num = 3 |S(h) - S(h/2)|, the grid convergence index of two
  grids with its factor of safety of 3 (Roache 1998), of first order, to which limits and switches of the rudder reduce
  Runge-Kutta's fourth. u_num is half of it.
- u_input: deviation of an ensemble with the errors of all numbers on the card, and their covariance if it has one.
- u_D: the trial is evaluated again with added noise of its signals, and simulated from there: the deviation of E. With
  it the errors of the measured point, of the heading's zero, and of the times of orders and reversals; times are known
  to a sample (over sqrt 12). Where a manoeuvre was run several times, the deviation between its runs. It does not
  include weather and errors common to all runs.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import StrEnum
from typing import NamedTuple

import numpy as np

from tank2sim.analysis.validation.one_sided import OneSidedError, one_sided_errors
from tank2sim.analysis.validation.standard_trials import (
    SEED,
    TrialShip,
    figure_numbers,
    member_spread,
    members,
    standard_trials,
)
from tank2sim.arguments import REQUIRED_PERCENT, VALIDATION_MEMBERS
from tank2sim.cards.card import ManoeuvringCard
from tank2sim.dynamics import build
from tank2sim.dynamics.card_parameters import card_parameters, joint_errors, study_model
from tank2sim.errors import InputError
from tank2sim.identification.trials.problem.prepare_trials import fitted_as
from tank2sim.notices import Notice
from tank2sim.records.audit.noise import record_noise
from tank2sim.records.trials import Trial, sampling_step
from tank2sim.simulation.card_range import NOTHING_READ, CardRangeReading, Numbers
from tank2sim.simulation.integrator import Integrator
from tank2sim.simulation.manoeuvres import Turn
from tank2sim.simulation.recorded import Recorded, recognise, recorded, repeat, steerable
from tank2sim.units import from_si

COVERAGE = 2.0
"""Expanded over standard uncertainty: 95 %."""

SAFETY = 3.0
"""Factor of safety of a convergence index from two grids (Roache 1998)."""

READINGS = 12
"""Number of evaluations of a trial's figures with added noise: enough to show its effect. Project choice."""

TURN_FIGURES = ("advance_m", "transfer_m", "tactical_diameter_m", "time_90_s", "time_180_s")
ZIGZAG_FIGURES = ("overshoot_1_deg", "overshoot_2_deg", "initial_turning_time_s", "reach_s")
"""Compared figures, of IMO MSC.137(76) and ITTC 7.5-04-02-01; later ones repeat their errors."""

_IDENTIFIED = r"identified by tank2sim \([^)]*\) from ([^;:]*)"
"""Text that ``identify`` writes into the source of its card."""


NOTHING_VALIDATED = "not validated, for no trial can be compared"
"""Verdict on a card without trials."""


class ComparisonOutcome(StrEnum):
    """Outcome of the comparison of a figure."""

    VALIDATED = "validated"
    UNCERTAIN = "too uncertain"
    FITTED = "only fitted"
    REFUTED = "not validated"
    OPEN = "open"


@dataclass(frozen=True)
class Validated:
    """A figure of a trial.

    Parameters
    ----------
    trial, manoeuvre, name : str
        File, kind of manoeuvre, and the figure with its unit.
    measured : float
        D.
    simulated : float or None
        S; None where the simulation did not reach it.
    numerical, data : float
        u_num and u_D, standard.
    inputs : float or None
        u_input, standard; None where the ensemble does not determine it.
    required_percent : float
        U_reqd in per cent of D.
    made_card : bool
        True if the card was identified from the trial.
    error : float or None
        E = S - D. This and the following are derived from the others, whatever is given.
    uncertainty : float or None
        U_val, expanded; None where u_input is unknown.
    level_percent : float or None
        U_val in per cent of the measured figure.
    outcome : ComparisonOutcome
        Open where U_val is unknown, not validated where the simulation does not reach the figure. A figure of a trial
        that the card was identified from is at best fitted, not validated.
    """

    trial: str
    manoeuvre: str
    name: str
    measured: float
    simulated: float | None
    numerical: float = 0.0
    inputs: float | None = 0.0
    data: float = 0.0
    required_percent: float = REQUIRED_PERCENT
    made_card: bool = False
    error: float | None = None
    uncertainty: float | None = None
    level_percent: float | None = None
    outcome: ComparisonOutcome = ComparisonOutcome.OPEN

    def __post_init__(self) -> None:
        error = None if self.simulated is None else self.simulated - self.measured
        uncertainty = level = None
        if self.inputs is not None:
            uncertainty = COVERAGE * math.sqrt(self.numerical**2 + self.inputs**2 + self.data**2)
            level = 100 * uncertainty / abs(self.measured) if self.measured else None
        derived = {"error": error, "uncertainty": uncertainty, "level_percent": level}
        for name, value in (derived | {"outcome": self._outcome(error, uncertainty)}).items():
            object.__setattr__(self, name, value)

    def _outcome(self, error: float | None, uncertainty: float | None) -> ComparisonOutcome:
        if error is None:
            return ComparisonOutcome.REFUTED
        if uncertainty is None:
            return ComparisonOutcome.OPEN
        if abs(error) > uncertainty:
            return ComparisonOutcome.REFUTED
        if self.made_card:
            return ComparisonOutcome.FITTED
        loose = uncertainty > self.required_percent / 100 * abs(self.measured)
        return ComparisonOutcome.UNCERTAIN if loose else ComparisonOutcome.VALIDATED


@dataclass(frozen=True)
class Verified:
    """A figure of a standard trial.

    Parameters
    ----------
    halving : float or None
        Change when the step is halved.
    deviation : float or None
        Standard deviation by the errors of the card.
    U_num : float or None
        Numerical uncertainty, expanded; derived from `halving`, whatever is given.
    """

    trial: str
    name: str
    value: float
    halving: float | None
    deviation: float | None
    U_num: float | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "U_num", None if self.halving is None else SAFETY * abs(self.halving))


@dataclass(frozen=True)
class Validation:
    """All figures of all trials, notices on trials that could not be compared, errors to one side, and figures of each
    member by trial."""

    figures: tuple[Validated, ...]
    members: int
    notices: tuple[Notice, ...] = ()
    one_sided: tuple[OneSidedError, ...] = ()
    runs: Mapping[str, Sequence[Numbers]] = field(default_factory=dict)

    @property
    def counts(self) -> dict[str, int]:
        """Number of figures by outcome."""
        return {
            outcome.value: sum(figure.outcome is outcome for figure in self.figures) for outcome in ComparisonOutcome
        }

    @property
    def verdict(self) -> str:
        """Summary in words."""
        if not self.figures:
            return NOTHING_VALIDATED
        counts = self.counts
        validated = f"{counts.pop(ComparisonOutcome.VALIDATED.value)} of {len(self.figures)} figures validated"
        others = ", ".join(f"{count} {outcome}" for outcome, count in counts.items() if count)
        return f"{validated}; {others}" if others else validated


def validate_card(
    card: ManoeuvringCard,
    trials: Sequence[Trial],
    count: int = VALIDATION_MEMBERS,
    required_percent: float = REQUIRED_PERCENT,
) -> Validation:
    """Simulate the turns and zigzags among trials in closed loop from their measured starts, and compare figures.

    Parameters
    ----------
    card : ManoeuvringCard
        Card of the ship.
    trials : sequence of Trial
        At the ship's size.
    count : int
        Members of the ensemble for u_input; 0 for none (u_input is then unknown, and every figure is open).
    required_percent : float
        U_reqd in per cent of each measured figure.
    """
    model = build(steerable(card))
    finer = replace(model, step_s=model.step_s / 2)
    engines = Integrator(model), Integrator(finer)
    drawn, of_errors = members(card, model, count)
    known = {trial.name: recognise(trial, model) for trial in trials}
    whats = [what for what in known.values() if isinstance(what, Recorded)]
    between = _between_repeats(whats)
    messages = [
        Notice(f"{name}: no turning circle and no zigzag, for {what}: only replayed")
        for name, what in known.items()
        if isinstance(what, str)
    ]
    messages += [*joint_errors(card, card_parameters(card, study_model(card))).in_words, *of_errors]
    figures: list[Validated] = []
    runs: dict[str, list[Numbers]] = {}
    for what in whats:
        found, trouble, runs[what.trial.name] = _validated(what, engines, drawn, between)
        fitted = _fitted(card, what.trial)
        figures += [replace(figure, required_percent=required_percent, made_card=bool(fitted)) for figure in found]
        messages += [*trouble, *fitted]
    if whats and not between:
        messages.append(
            Notice(
                "no manoeuvre was repeated: u_D holds the record's noise and the errors of its point, heading and "
                "orders, but neither weather nor helmsman, and is a lower bound"
            )
        )
    if not count:
        messages.append(Notice("no ensemble was run: u_input and U_val are not known, and no figure can be judged"))
    one_sided = one_sided_errors(figures, (TURN_FIGURES, ZIGZAG_FIGURES))
    messages = [*(error.notice for error in one_sided), *messages]
    return Validation(tuple(figures), count, tuple(dict.fromkeys(messages)), one_sided, runs)


def _fitted(card: ManoeuvringCard, trial: Trial) -> list[Notice]:
    """A notice on a trial that the card was identified from; none of another."""
    copied = fitted_as(card, trial)
    if copied is None and not made_card(card, trial.name):
        return []
    named = f" (as {copied})" if copied not in (None, trial.name) else ""
    return [Notice(f"{trial.name}: the card was identified from this trial{named}: its figures are only fitted")]


def made_card(card: ManoeuvringCard, trial: str) -> bool:
    """True if the source of a card names the file of a trial.

    The text of ``identify`` is searched for any name; the remaining source only for names with a digit or an
    underscore, which are not words.
    """
    text = f"{card.ship.source}; {card.ship.notes or ''}"
    looked = text if re.search(r"[\d_]", trial) else "; ".join(re.findall(_IDENTIFIED, text))
    return re.search(rf"(?<![\w-]){re.escape(trial)}(?![\w-])", looked) is not None


class Verification(NamedTuple):
    """Figures of standard trials, notices on failed ones, and figures of each member by trial."""

    rows: tuple[Verified, ...]
    notices: tuple[Notice, ...]
    runs: Mapping[str, Sequence[Numbers]]


def verify(ship: TrialShip, count: int = VALIDATION_MEMBERS) -> Verification:
    """The standard trials with the model's step, with half of it, and by an ensemble."""
    model = replace(ship.model, step_s=ship.model.step_s / 2)
    finer = TrialShip(ship.card, model, Integrator(model))
    drawn, _ = members(ship.card, ship.model, count)
    rows: list[Verified] = []
    messages: list[Notice] = []
    runs: dict[str, list[Numbers]] = {}
    for trial, manoeuvre in standard_trials([ship]).items():
        run, fine = ship.run(manoeuvre), finer.run(manoeuvre)
        if isinstance(run, str) or isinstance(fine, str):
            messages.append(Notice(f"{trial}: {run if isinstance(run, str) else fine}"))
            continue
        messages += [notice.of(trial) for notice in (*run.reading.notices, *run.missing)]
        runs[trial] = ship.member_figures(manoeuvre, drawn)
        deviation, halved = member_spread(runs[trial]), figure_numbers(fine.figures)
        for name, value in figure_numbers(run.figures).items():
            halving = halved[name] - value if name in halved else None
            rows.append(Verified(trial, name, value, halving, deviation.get(name)))
    return Verification(tuple(rows), tuple(messages), runs)


def _validated(
    what: Recorded,
    engines: tuple[Integrator, Integrator],
    drawn: Sequence[dict[str, float]],
    between: Mapping[tuple[str, str], float],
) -> tuple[list[Validated], list[Notice], list[Numbers]]:
    measured = compare_figures(what)
    (coarse, read), (fine, _) = (_repeated(what, engine) for engine in engines)
    by_member = [_repeated(what, engines[0], member)[0] for member in drawn]
    inputs = member_spread(by_member)
    data = _read_again(what, engines[0])
    rows = []
    for name, value in measured.items():
        halving = abs(coarse[name] - fine[name]) if name in coarse.keys() & fine.keys() else 0.0
        u_data = math.hypot(data.get(name, 0.0), between.get((kind(what), name), 0.0), *_of_reading(what, name))
        u_num = SAFETY * halving / COVERAGE
        figures = value, coarse.get(name), u_num, inputs.get(name), u_data
        rows.append(Validated(what.trial.name, what.words, name, *figures))
    shown = [name for name in measured if name in coarse]
    beyond = ", ".join(name for name in shown if read.outside(name))
    messages = [notice.of(beyond) for notice in read.notices if beyond]
    few = [name for name in shown if drawn and name not in inputs]
    messages += [Notice(f"{name}: too few members of the ensemble reach it to determine u_input") for name in few]
    return rows, [message.of(what.trial.name) for message in (*messages, *_late_execute(what))], by_member


def _late_execute(what: Recorded) -> list[Notice]:
    if what.rudder_rate_radps is not None or what.begin_s > what.trial.time_s[0]:
        return []
    return [
        Notice(
            "the record begins with the order already given, and its first row is taken as the execute: if the order "
            "was earlier, advance and times are too small by that time"
        )
    ]


def _of_reading(what: Recorded, name: str) -> tuple[float, float]:
    """Standard errors of a figure by the interval of the samples, and by the errors of what was read."""
    sampled = sampling_step(what.trial) / math.sqrt(12) if name.endswith("_s") else 0.0
    return sampled, from_si(name, what.reading_errors.get(name, 0.0))


def compare_figures(what: Recorded) -> Numbers:
    """The compared figures of a recorded manoeuvre."""
    names = TURN_FIGURES if isinstance(what.manoeuvre, Turn) else ZIGZAG_FIGURES
    measured = figure_numbers(what.figures)
    return {name: measured[name] for name in names if name in measured}


def kind(what: Recorded) -> str:
    """Key of repeats: manoeuvre and side, to whole degrees, and approach speed to 5 %."""
    speed = round(20 * math.log(max(what.start["initial.u"], 1e-9)))
    angle = round(math.degrees(what.manoeuvre.rudder))
    if isinstance(what.manoeuvre, Turn):
        return f"turn {angle} {speed}"
    return f"zigzag {angle}/{round(math.degrees(what.manoeuvre.heading))} {speed}"


def _repeated(
    what: Recorded, engine: Integrator, member: dict[str, float] | None = None
) -> tuple[Numbers, CardRangeReading]:
    """Simulated figures of a recorded manoeuvre, and the names of those outside the card's range."""
    try:
        run = repeat(what, engine, member)
    except InputError:  # the motion left all bounds: none of its figures is reached
        return {}, NOTHING_READ
    return figure_numbers(run.figures), run.reading


def _between_repeats(whats: Sequence[Recorded]) -> dict[tuple[str, str], float]:
    """Standard deviation of a single run of a manoeuvre, by (kind, figure), from two or more repeats."""
    groups: dict[str, list[Numbers]] = {}
    for what in whats:
        groups.setdefault(kind(what), []).append(compare_figures(what))
    found = {}
    for name, runs in groups.items():
        for figure in runs[0]:
            values = [run[figure] for run in runs if figure in run]
            if len(values) > 1:
                found[name, figure] = float(np.std(values, ddof=1))
    return found


def _read_again(what: Recorded, engine: Integrator) -> Numbers:
    """Standard deviation of each E with added noise of the signals and other lags of a zigzag's reversals."""
    noise = record_noise(what.trial)
    errors = []
    for number in range(READINGS):
        generator = np.random.default_rng([SEED, number])
        signals = {
            name: values + noise.get(name, 0.0) * generator.standard_normal(len(values))
            for name, values in what.trial.signals.items()
        }
        again = recorded(replace(what.trial, signals=signals), engine.model)
        if again is not None and type(again.manoeuvre) is type(what.manoeuvre):
            simulated, _ = _repeated(_with_another_lag(again, generator), engine)
            errors.append(
                {name: simulated[name] - value for name, value in compare_figures(again).items() if name in simulated}
            )
    return member_spread(errors)


def _with_another_lag(what: Recorded, generator: np.random.Generator) -> Recorded:
    """A recorded zigzag with a lag drawn within its standard error; a turn as it is."""
    if isinstance(what.manoeuvre, Turn):
        return what
    lag = max(0.0, what.manoeuvre.lag_s + what.errors.get("lag_s", 0.0) * generator.standard_normal())
    return replace(what, manoeuvre=replace(what.manoeuvre, lag_s=lag))
