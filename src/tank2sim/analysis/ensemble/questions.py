"""Evaluations of the members of an ensemble: a manoeuvre at the fastest pace, named figures, the IMO criteria."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from tank2sim.analysis.influence.figures import TURN, ZIGZAG, InfluenceFigure, parse_figure
from tank2sim.analysis.stability.imo import (
    imo_criteria,
    largest_trial_rudder,
    manoeuvring_trials,
)
from tank2sim.arrays import Array
from tank2sim.cards.card import SteeredCard
from tank2sim.cards.reading import parse_card
from tank2sim.dynamics import build
from tank2sim.dynamics.card_parameters import study_model
from tank2sim.dynamics.effects import undisturbed_inputs
from tank2sim.dynamics.model import Model
from tank2sim.dynamics.ship import mass_fault, mass_faults
from tank2sim.errors import InputError
from tank2sim.native.lanes import NoLanesError
from tank2sim.simulation.card_range import Numbers, single_figures
from tank2sim.simulation.ensemble import BATCH, Ask, BatchResult, Draws, MemberResult, each_alone
from tank2sim.simulation.integrator import Integrator
from tank2sim.simulation.lane_figures import USUAL_PACE, LaneFigures, LaneManoeuvre, LaneManoeuvres, Pace, runs_in_lanes
from tank2sim.simulation.manoeuvres import Manoeuvre, SpiralManoeuvre, Stop, Turn, Zigzag
from tank2sim.simulation.run import simulate
from tank2sim.simulation.running import RUNAWAY
from tank2sim.simulation.thruster_manoeuvres import DifferenceTurn, StraightRun
from tank2sim.units import from_si

if TYPE_CHECKING:
    from tank2sim.analysis.influence.study import Study

ENSEMBLE_SIGNALS: Mapping[str, tuple[str, float]] = {
    "x_m": ("motion.x", 1.0),
    "y_m": ("motion.y", 1.0),
    "psi_deg": ("motion.psi", math.degrees(1.0)),
    "r_degps": ("motion.r", math.degrees(1.0)),
    "u_mps": ("motion.u", 1.0),
    "v_mps": ("motion.v", 1.0),
    "delta_deg": ("rudder.angle", math.degrees(1.0)),
}
"""Signals with bands over time, to their variable and the factor to their unit."""


def signals_with_bands(model: Model) -> Mapping[str, tuple[str, float]]:
    """The :data:`ENSEMBLE_SIGNALS` of a model, ``phi_deg`` if it heels, and ``n_<name>_rpm`` of its thrusters."""
    heel = {"phi_deg": ("motion.phi", math.degrees(1.0))} if "motion.phi" in model else {}
    revolutions = {
        f"n_{name.split('.')[1]}_rpm": (name, from_si("n_rpm", 1.0))
        for name in model.outputs
        if name.startswith("thrusters.") and name.endswith(".speed")
    }
    usual = {signal: known for signal, known in ENSEMBLE_SIGNALS.items() if known[0] in model}
    return {**usual, **heel, **revolutions}


LANE_BATCH = 256
"""Members of a batch that is run in lanes: with its crossings and histories it takes 10 MB (project choice)."""

# Only the outputs that the figures need: the others would take longer than the motion itself.
_READ_OFF: Mapping[type, tuple[str, ...]] = {
    Turn: ("motion.beta",),
    DifferenceTurn: ("motion.beta",),
    Zigzag: ("motion.rdot",),
    Stop: ("motion.udot",),
    StraightRun: ("motion.udot",),
}


@dataclass(frozen=True)
class ShipText:
    """A card in the form that is sent to other processes."""

    text: str
    source: str

    @classmethod
    def of(cls, card: SteeredCard) -> ShipText:
        """The form of a card."""
        return cls(card.text, card.source)

    def card(self) -> SteeredCard:
        """The card."""
        return parse_card(self.text, self.source).steered()


@dataclass(frozen=True, eq=False)
class OfManoeuvre:
    """Figures of a manoeuvre, and :func:`signals_with_bands` at `times` (n,), s.

    Members whose histories are not kept are integrated, in lanes, at a `pace` of their own
    (:func:`tank2sim.analysis.ensemble.questions.fastest_pace`).
    """

    ship: ShipText
    manoeuvre: Manoeuvre
    duration_s: float | None
    times: Array
    pace: Pace = USUAL_PACE

    @property
    def batch(self) -> int:
        """Members of a batch."""
        return LANE_BATCH if runs_in_lanes(self.manoeuvre, self.duration_s) else BATCH

    def prepared(self) -> Ask:
        """See :class:`tank2sim.simulation.ensemble.Question`."""
        model = study_model(self.ship.card())
        signals = {name for name, _ in signals_with_bands(model).values()}
        shown = signals <= set(model.state_names)
        if shown and runs_in_lanes(self.manoeuvre, self.duration_s) and (lanes := lanes_of(model)) is not None:
            return self._in_lanes(self.manoeuvre, model, lanes)
        return self._driven(_reading_off(model, *_READ_OFF.get(type(self.manoeuvre), ())))

    def _driven(self, model: Model) -> Ask:
        """Single runs of the members, for a manoeuvre or a model without lanes."""
        integrator, signals = Integrator(model), signals_with_bands(model).values()

        def run(values: Mapping[str, float]) -> MemberResult:
            duration = self.duration_s
            run = simulate(model, self.manoeuvre, duration_s=duration, parameters=values, integrator=integrator)
            figures = {name: math.nan for name, value in run.figures.items() if value is None}
            path = run.trajectory
            sampled = [factor * np.interp(self.times, path.t, path[name], right=np.nan) for name, factor in signals]
            return MemberResult(figures | single_figures(run.figures), np.array(sampled, dtype=np.float32))

        return each_ship(model, run)

    def _in_lanes(self, manoeuvre: LaneManoeuvre, model: Model, lanes: LaneManoeuvres) -> Ask:
        """Joint runs of the members of a batch."""
        signals = signals_with_bands(model).values()
        rows = [model.state_names.index(name) for name, _ in signals]
        factors = np.array([factor for _, factor in signals])

        def ask(count: int, values: Mapping[str, Array], kept: int) -> BatchResult:
            p, troubles = ships_of(model, count, values)
            runs = [lanes.run(manoeuvre, p[:kept], self.duration_s, self.times)] if kept else []
            if kept < count:
                runs.append(lanes.run(manoeuvre, p[kept:], self.duration_s, pace=self.pace))
            troubles = _with_runaways(troubles, np.concatenate([part.fine for part in runs]))
            answer = _usable(_joined([(part.figures, len(part.fine)) for part in runs]), troubles)
            if not kept:
                return answer
            histories = (runs[0].states[:, :, rows] * factors).transpose(0, 2, 1).astype(np.float32)
            histories[[bool(trouble) for trouble in troubles[:kept]]] = np.nan
            return answer._replace(histories=histories)

        return ask


@dataclass(frozen=True)
class OfFigures:
    """Figures by name (:mod:`tank2sim.analysis.influence.figures`)."""

    ship: ShipText
    figures: tuple[str, ...]

    batch = LANE_BATCH

    def prepared(self) -> Ask:
        """See :class:`tank2sim.simulation.ensemble.Question`."""
        # It takes python-control with it, slow to load: processes that run manoeuvres do without.
        from tank2sim.analysis.influence.study import Study

        card, asked = self.ship.card(), [parse_figure(text) for text in self.figures]
        study = Study(card, asked)
        lanes = lanes_of(study.model) if any(map(_lane_figure, asked)) else None
        joint = [figure for figure in asked if lanes and _lane_figure(figure)]
        single = [figure for figure in asked if figure not in joint]
        ask_single = _one_by_one(Study(card, single) if joint else study) if single else None

        def ask(count: int, values: Mapping[str, Array], kept: int) -> BatchResult:
            p, troubles = ships_of(study.model, count, values)
            found: dict[str, Array] = {}
            for manoeuvre in dict.fromkeys(figure.manoeuvre for figure in joint):
                assert lanes is not None and isinstance(manoeuvre, Turn | Zigzag)
                runs = lanes.run(manoeuvre, p)
                troubles = _with_runaways(troubles, runs.fine)
                named = {figure.text: _lane_figure(figure) for figure in joint if figure.manoeuvre == manoeuvre}
                found |= {text: runs.figures.get(name, np.full(count, np.nan)) for text, name in named.items()}
            if ask_single:
                answer = ask_single(count, values, 0)
                found |= answer.figures
                troubles = [first or other for first, other in zip(troubles, answer.troubles, strict=True)]
            return _usable({text: found[text] for text in self.figures if text in found}, troubles)

        return ask


def _one_by_one(study: Study) -> Ask:
    """Figures of a study by their texts, of one ship after the other."""
    defaults = {parameter.name: parameter.value for parameter in study.parameters}

    def figures_of(values: Mapping[str, float]) -> MemberResult:
        given = {**defaults, **values}
        found = study.figures_at(np.array([given[name] for name in defaults]))
        return MemberResult(dict(zip([figure.text for figure in study.figures], found.tolist(), strict=True)))

    return each_ship(study.model, figures_of)


BEYOND_CARD_MARK = ": beyond the card"
"""Ending of the name of a criterion's other entry in :class:`OfCriteria`."""


@dataclass(frozen=True)
class OfCriteria:
    """Value of each IMO criterion by its name; nan where a trial does not show it.

    With :data:`BEYOND_CARD_MARK` after its name: 1 where a trial left the card's range before it was known, else 0.
    """

    ship: ShipText

    batch = LANE_BATCH

    def prepared(self) -> Ask:
        """See :class:`tank2sim.simulation.ensemble.Question`."""
        whole = build(self.ship.card())
        model = _reading_off(whole, *(name for names in _READ_OFF.values() for name in names))
        each_step, parameters = Integrator(model), model.defaults

        def criteria_of(values: Mapping[str, float]) -> MemberResult:
            figures: Numbers = {}
            # What is an input (a current) is calm in these trials.
            for criterion in imo_criteria(
                model, {name: values[name] for name in values.keys() & parameters}, each_step
            ):
                figures[criterion.name] = math.nan if criterion.found is None else criterion.found
                figures[criterion.name + BEYOND_CARD_MARK] = float(criterion.beyond_card)
            return MemberResult(figures)

        ask_each, lanes = each_ship(model, criteria_of), lanes_of(whole)
        if lanes is None:
            return ask_each
        can_stop = "propeller.speed" in model.input_names
        trials = manoeuvring_trials(largest_trial_rudder(parameters))[: None if can_stop else -1]

        def ask(count: int, values: Mapping[str, Array], kept: int) -> BatchResult:
            p, troubles = ships_of(model, count, values)
            stops = values.get("steering.max_angle", np.zeros(0))
            rudders = {largest_trial_rudder({"steering.max_angle": stop}) for stop in stops.tolist()}
            if rudders - {largest_trial_rudder(parameters)}:  # the gear's stops are uncertain
                return ask_each(count, values, kept)
            figures: dict[str, Array] = {}
            for trial in trials:
                sides = [lanes.run(manoeuvre, p, inputs=undisturbed_inputs(model)) for manoeuvre in trial.manoeuvres]
                for name, figure in trial.criteria.items():
                    shown = [side.figures.get(figure, np.full(count, np.nan)) for side in sides]
                    figures[name] = np.max(shown, axis=0)
                    beyond = np.any([side.outside(figure) for side in sides], axis=0)
                    figures[name + BEYOND_CARD_MARK] = beyond.astype(float)
            return _usable(figures, troubles)

        return ask


def lanes_of(model: Model) -> LaneManoeuvres | None:
    """Runs of a model in lanes; None if it has none."""
    try:
        return LaneManoeuvres(model)
    except NoLanesError:
        return None


def _lane_figure(figure: InfluenceFigure) -> str:
    """A run's name of a figure of a turning circle or zigzag; empty for others."""
    return figure.kind.name if figure.kind.family in (TURN, ZIGZAG) else ""


def _joined(parts: Sequence[tuple[Mapping[str, Array], int]]) -> dict[str, Array]:
    """Figures of all ships, joined from parts with their numbers of ships."""
    names = dict.fromkeys(name for figures, _ in parts for name in figures)
    return {
        name: np.concatenate([figures.get(name, np.full(count, np.nan)) for figures, count in parts]) for name in names
    }


def _usable(figures: dict[str, Array], troubles: Sequence[str]) -> BatchResult:
    """The figures of a batch, nan for unusable members."""
    bad = [number for number, trouble in enumerate(troubles) if trouble]
    for figure in figures.values():
        figure[bad] = np.nan
    return BatchResult(figures, None, troubles)


def ships_of(model: Model, count: int, values: Mapping[str, Array]) -> tuple[Array, list[str]]:
    """Parameters (n, np) of n members with `values` (n,) by name, without those that the model lacks; and the fault of
    the mass matrix of each, empty without one."""
    p = np.tile(model.parameter_values(), (count, 1))
    places = {name: place for place, name in enumerate(model.parameter_names)}
    for name, value in values.items():
        if name in places:
            p[:, places[name]] = value
    return p, mass_faults(model, p)


def _with_runaways(troubles: Sequence[str], fine: Sequence[bool] | NDArray[np.bool_]) -> list[str]:
    return [trouble or ("" if well else RUNAWAY) for trouble, well in zip(troubles, fine, strict=True)]


def each_ship(model: Model, answer: Callable[[Mapping[str, float]], MemberResult]) -> Ask:
    """The members one after the other: the `answer` to values in place of the model's, or the reason without one."""
    defaults = model.defaults

    def ask(values: Mapping[str, float]) -> MemberResult:
        if fault := mass_fault(model, {**defaults, **values}):
            return MemberResult({}, trouble=fault)
        try:
            return answer(values)
        except InputError as error:
            return MemberResult({}, trouble=error.problem)

    return each_alone(ask)


def _reading_off(model: Model, *names: str) -> Model:
    states = set(model.state_names)
    wanted = [*names, "motion.speed", *(name for name, _ in signals_with_bands(model).values())]
    return replace(model, outputs=tuple(dict.fromkeys(name for name in wanted if name not in states)))


STEP_FACTORS = (6, 4, 3, 2)
"""Lengths of steps of turns and stops over the model's that are tried, the longest first (project choice)."""

STEP_TOLERANCE = 1e-5
"""Largest relative change of a figure by another pace: at most a unit of its fifth digit, and the sampling error of a
5 % quantile (2.1 standard deviations over the root of the number of members) among a million ships with a standard
deviation of 0.5 % (project choice)."""

EDGE_TOLERANCE = 1e-4
"""The same for a step that is longer by one step of the model: beyond the stable steps of the steering gear figures
change by 1e-3 and more, and a step next to that edge is not taken (project choice)."""

TRIED_MEMBERS = 64
"""Members, the first, that are run at each pace: eight registers of the widest lanes (project choice)."""


def fastest_pace(question: OfManoeuvre, draws: Draws) -> Pace:
    """The fastest pace with which figures of a turn, zigzag or stop are the same.

    The first :data:`TRIED_MEMBERS` members of the ensemble are run with the model's step in double precision, and at
    other paces: in single precision with each of :data:`STEP_FACTORS`, longest first, and with the model's step, then
    in double precision with each of them; zigzags, whose overshoots need it, keep the model's step. A pace is taken if
    each of their figures agrees within :data:`STEP_TOLERANCE` or is none at both, if fewer than half of them are
    doubtful, which are run twice, and if with the next longer step figures still agree within :data:`EDGE_TOLERANCE`.
    The result depends on the card, the manoeuvre and the seed alone. It is the usual pace for other manoeuvres and for
    ships without lanes.

    `question`: The manoeuvre. `draws`: Draws of the members.
    """
    manoeuvre = question.manoeuvre
    if isinstance(manoeuvre, SpiralManoeuvre) or not runs_in_lanes(manoeuvre, question.duration_s):
        return USUAL_PACE
    model = study_model(question.ship.card())
    lanes = lanes_of(model)
    if lanes is None:
        return USUAL_PACE
    p, troubles = ships_of(
        model, TRIED_MEMBERS, dict(zip(draws.names, draws.members(0, TRIED_MEMBERS).values.T, strict=True))
    )
    p = p[[not trouble for trouble in troubles]]
    usual = lanes.run(manoeuvre, p, question.duration_s)
    if 2 * int(usual.doubtful.sum()) >= len(p):
        return USUAL_PACE

    def same(pace: Pace, tolerance: float) -> bool:
        runs = lanes.run(manoeuvre, p, question.duration_s, pace=pace)
        return 2 * int(runs.doubtful.sum()) < len(p) and same_figures(usual, runs, tolerance)

    def holds(pace: Pace) -> bool:
        edge = Pace(pace.step_factor + 1, pace.single)
        return same(pace, STEP_TOLERANCE) and (pace.step_factor == 1 or same(edge, EDGE_TOLERANCE))

    factors = () if isinstance(manoeuvre, Zigzag) else STEP_FACTORS
    paces = (*(Pace(factor, single=True) for factor in (*factors, 1)), *map(Pace, factors))
    return next(filter(holds, paces), USUAL_PACE)


def same_figures(usual: LaneFigures, others: LaneFigures, tolerance: float) -> bool:
    """Whether all figures agree within `tolerance` of themselves, and are none for the same ships."""

    def agree(name: str, values: Array) -> bool:
        return np.allclose(others.figures[name], values, rtol=tolerance, atol=0.0, equal_nan=True)

    return set(usual.figures) == set(others.figures) and all(agree(name, usual.figures[name]) for name in usual.figures)
