"""Why KVLCC2's zigzags reach their first heading too early: the bias of the initial turning time by experiment.

Each of HSVA's seven zigzags is predicted by a card fitted to the other six, and MARIN's two by a card fitted to all
seven. An experiment changes one thing: what is fitted, or from where and by which rudder the motion is simulated. The
last table is of HMRI's captive model on a straight course: force and moment of the rudder for each degree, over those
at 20 deg.
"""

from __future__ import annotations

import csv
import os
import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from threadpoolctl import threadpool_limits

from tank2sim.api.identification import captive_runs
from tank2sim.cards import ManoeuvringCard, read_card
from tank2sim.dynamics import build
from tank2sim.identification.trials.assessment.identifiability import refuse_unseen
from tank2sim.identification.trials.assessment.model_selection import posed_in
from tank2sim.identification.trials.methods.equation_error import equation_error
from tank2sim.identification.trials.methods.output_error import OutputErrorSettings, output_error
from tank2sim.identification.trials.options import PIECE, IdentificationOptions
from tank2sim.identification.trials.problem.captive_tests import CaptiveRuns
from tank2sim.identification.trials.problem.estimation_problem import driven_model
from tank2sim.identification.trials.problem.prepare_trials import Measured, measured
from tank2sim.identification.trials.problem.problem_from_card import (
    card_with_estimate,
    polynomial_over_trials,
    with_range,
)
from tank2sim.identification.trials.problem.structures import STRUCTURES
from tank2sim.records.trials import Trial
from tank2sim.simulation.integrator import Integrator
from tank2sim.simulation.manoeuvres import Zigzag
from tank2sim.simulation.recorded import Recorded, recorded, repeat, steerable

DATA = Path(os.environ.get("TANK2SIM_DATA", Path(__file__).resolve().parents[2] / "shared")) / "data"
STEP_S, LONGEST_S = 0.1, 150.0
STATES = {"u": "u_mps", "v": "v_mps", "r": "r_radps", "psi": "psi_rad"}
ANGLES_DEG = (5, 10, 15, 20, 25)
FIRST_ROWS = 10
"""Rows whose mean is the state at the record's start."""


@dataclass(frozen=True)
class Case:
    """A trial, its manoeuvre, and the card that has not seen it."""

    trial: Trial
    record: Recorded
    card: ManoeuvringCard

    @property
    def side(self) -> float:
        return float(np.sign(self.record.manoeuvre.rudder))

    def bias(self, time_s: float | None) -> float:
        """Initial turning time less the measured one, % of that."""
        real = self.record.figures["initial_turning_time_s"]
        assert isinstance(real, float)
        return np.nan if time_s is None else 100 * (time_s / real - 1)


def main() -> None:
    warnings.filterwarnings("ignore", category=RuntimeWarning)
    card = read_card("kvlcc2-captive")
    assert isinstance(card, ManoeuvringCard)
    hsva = measured(sorted((DATA / "kvlcc2_hsva").glob("*.dat")), card).trials
    marin = measured(sorted((DATA / "kvlcc2_marin").glob("*zz*.dat")), card).trials
    print(f"{'initial turning time, % too long':34s}{'mean':>7s}{'rms':>7s}{'port':>7s}{'starb.':>7s}  each")
    tank = captive_runs(DATA / "kvlcc2_captive_hmri" / "campaign.toml")
    plain = cases(card, hsva, marin)
    row("as predicted", plain, [as_repeated(case) for case in plain])
    row("by the measured rudder", plain, [by_measured_rudder(case) for case in plain])
    row("and without drift and turn", plain, [by_measured_rudder(case, {"v": 0.0, "r": 0.0}) for case in plain])
    row("and from the record's start", plain, [by_measured_rudder(case, first=True) for case in plain])
    for name, options, runs in (
        ("inertias free", IdentificationOptions(structure="cross_flow", inertia=True), None),
        ("with the card's errors as stated", IdentificationOptions(structure="cross_flow", scale_prior=False), None),
        ("with captive tests", IdentificationOptions(structure="cross_flow"), tank),
    ):
        other = cases(card, hsva, marin, options, runs)
        row(name, other, [as_repeated(case) for case in other])
    straight_rudder()


def cases(
    card: ManoeuvringCard,
    hsva: tuple[Trial, ...],
    marin: tuple[Trial, ...],
    options: IdentificationOptions | None = None,
    tank: CaptiveRuns | None = None,
) -> list[Case]:
    """Each zigzag with a card that was not fitted to it."""
    found = []
    for left in (*hsva, None):
        fitted = Measured(tuple(trial for trial in hsva if trial is not left), "angle", (), tank)
        options = options or IdentificationOptions(structure="cross_flow")
        improved = identified(card, fitted, options)
        for trial in marin if left is None else (left,):
            record = recorded(trial, build(steerable(improved)))
            assert record is not None and isinstance(record.manoeuvre, Zigzag)
            found.append(Case(trial, record, improved))
    return found


def identified(card: ManoeuvringCard, fitted: Measured, options: IdentificationOptions) -> ManoeuvringCard:
    """The card by output error in pieces, as ``identify`` fits it."""
    started = STRUCTURES[options.structure].start(polynomial_over_trials(card, fitted.trials))
    problem = posed_in(card, started, fitted, options)
    problem = problem.without(refuse_unseen(problem) if fitted.captive is None else ())
    settings = OutputErrorSettings(piece_s=PIECE * problem.ship_time, scale_prior=options.scale_prior)
    with threadpool_limits(limits=1, user_api="blas"):
        estimate = output_error(problem, equation_error(problem).values, settings)
    return with_range(card_with_estimate(started, estimate), problem)


def as_repeated(case: Case) -> float | None:
    """Initial turning time of the closed-loop simulation, s."""
    time_s = repeat(case.record, Integrator(build(steerable(case.card)))).figures["initial_turning_time_s"]
    return time_s if isinstance(time_s, float) else None


def by_measured_rudder(case: Case, state: Mapping[str, float] | None = None, *, first: bool = False) -> float | None:
    """Initial turning time, s, of a simulation by the recorded rudder from the execute's state, in part replaced by
    `state`; with `first` from the first rows of the record."""
    model, record, trial = driven_model(case.card, "angle"), case.record, case.trial
    begin_s = float(trial.time_s[0]) if first else record.begin_s
    at = {name: record.start[f"initial.{name}"] for name in (*STATES, "x", "y")}
    if first:
        at |= {name: float(np.mean(trial.signals[signal][:FIRST_ROWS])) for name, signal in STATES.items()}
    at |= state or {}
    integrator, p, inputs = Integrator(model), model.parameter_values(), model.input_values()
    x = np.array(model.initial(p)).ravel()
    for name, value in at.items():
        x[model.state_names.index(f"motion.{name}")] = value
    rudder, heading = model.input_names.index("rudder.command"), model.state_names.index("motion.psi")
    course = at["psi"] if record.manoeuvre.course is None else record.manoeuvre.course
    before = -np.inf
    for time_s in np.arange(begin_s, begin_s + LONGEST_S, STEP_S):
        beyond = case.side * (x[heading] - course) - record.manoeuvre.heading
        if beyond >= 0:
            return float(time_s - STEP_S * beyond / (beyond - before) - record.begin_s)
        inputs[rudder] = np.interp(time_s, trial.time_s, trial.signals["delta_rad"])
        x, before = integrator.step(x, inputs, p, STEP_S), beyond
    return None


def row(name: str, every: list[Case], times: list[float | None]) -> None:
    biases = np.array([case.bias(time_s) for case, time_s in zip(every, times, strict=True)])
    port = np.array([case.side < 0 for case in every])
    figures = (biases.mean(), np.sqrt(np.mean(biases**2)), biases[port].mean(), biases[~port].mean())
    each = " ".join(f"{bias:6.1f}" for bias in biases)
    print(f"{name:34s}" + "".join(f"{figure:7.1f}" for figure in figures) + f"  {each}", flush=True)


def straight_rudder() -> None:
    """Print forces of the captive model's rudder for each degree, over those at 20 deg."""
    with (DATA / "kvlcc2_captive_hmri" / "captive.csv").open(encoding="utf-8") as file:
        runs = [run for run in csv.DictReader(file) if run["test type"] == "rudder angle"]
    at_speed = max(float(run["Speed(m/s)"]) for run in runs)
    by_angle = {int(run["delta(deg)"]): run for run in runs if float(run["Speed(m/s)"]) == at_speed}
    print(
        f"\n{'captive, straight: each degree':34s}"
        + "".join(f"{angle:7d}" for angle in ANGLES_DEG)
        + "  deg; both sides to 15 deg"
    )
    for name, column in (("normal force of the rudder", "RY'"), ("side force", "Y'"), ("yaw moment", "N'")):
        values = {angle: float(run[column]) for angle, run in by_angle.items()}
        slopes = []
        for angle in ANGLES_DEG:
            other = -angle if -angle in values else 0  # amidships where only one side was tested
            slopes.append((values[angle] - values[other]) / (angle - other))
        print(f"{name:34s}" + "".join(f"{slope / slopes[ANGLES_DEG.index(20)]:7.2f}" for slope in slopes))


if __name__ == "__main__":
    main()
