"""Evaluations of the members of an ensemble: a manoeuvre, named figures, the IMO criteria."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from tank2sim.analysis.influence.figures import parse_figure
from tank2sim.analysis.stability.imo import imo_criteria
from tank2sim.arrays import Array
from tank2sim.cards.card import ManoeuvringCard
from tank2sim.cards.reading import parse_card
from tank2sim.dynamics import build
from tank2sim.dynamics.card_parameters import study_model
from tank2sim.dynamics.model import Model
from tank2sim.dynamics.ship import mass_fault
from tank2sim.errors import InputError
from tank2sim.simulation.card_range import Numbers, single_figures
from tank2sim.simulation.ensemble import Ask, MemberResult
from tank2sim.simulation.figures import Figures, figures_of
from tank2sim.simulation.integrator import Integrator
from tank2sim.simulation.manoeuvres import Manoeuvre, Stop, Turn, Zigzag
from tank2sim.simulation.run import simulate
from tank2sim.simulation.running import RUNAWAY
from tank2sim.simulation.trajectory import Trajectory

AskOne = Callable[[Mapping[str, float]], MemberResult]

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

EVERY = 10
"""Steps between two kept samples: a twentieth of a ship length (:class:`tank2sim.simulation.integrator.Integrator`)."""

_LONGEST = 200_000
"""Most steps of a run in a joint batch: the batch then takes some 40 MB (project choice)."""

# Only the outputs that the figures need: the others would take longer than the motion itself.
_READ_OFF: Mapping[type, tuple[str, ...]] = {
    Turn: ("motion.beta",),
    Zigzag: ("motion.rdot",),
    Stop: ("motion.udot",),
}


@dataclass(frozen=True)
class ShipText:
    """A card in the form that is sent to other processes."""

    text: str
    source: str

    @classmethod
    def of(cls, card: ManoeuvringCard) -> ShipText:
        """The form of a card."""
        return cls(card.text, card.source)

    def card(self) -> ManoeuvringCard:
        """The card."""
        card = parse_card(self.text, self.source)
        assert isinstance(card, ManoeuvringCard)
        return card


@dataclass(frozen=True, eq=False)
class OfManoeuvre:
    """Figures of a manoeuvre, and :data:`ENSEMBLE_SIGNALS` at `times` (n,), s."""

    ship: ShipText
    manoeuvre: Manoeuvre
    duration_s: float | None
    times: Array

    def prepared(self) -> Ask:
        """See :class:`tank2sim.simulation.ensemble.Question`."""
        model = _reading_off(study_model(self.ship.card()), *_READ_OFF.get(type(self.manoeuvre), ()))
        integrator = Integrator(model, every=EVERY)
        steps = (self.duration_s or math.inf) / model.step_s
        whole = steps <= _LONGEST and abs(steps - round(steps)) < 1e-9 * steps
        if isinstance(self.manoeuvre, Turn) and whole:
            return self._held(integrator, self.manoeuvre, round(steps))
        return _each(self._driven(integrator))

    def _driven(self, integrator: Integrator) -> AskOne:
        """Single runs of the members, for a manoeuvre with events."""
        model = integrator.model
        defaults = _parameters(model)

        def ask(values: Mapping[str, float]) -> MemberResult:
            if fault := mass_fault(defaults | dict(values)):
                return MemberResult({}, trouble=fault)
            duration = self.duration_s
            try:
                run = simulate(model, self.manoeuvre, duration_s=duration, parameters=values, integrator=integrator)
            except InputError as error:
                return MemberResult({}, trouble=error.problem)
            return MemberResult(_numbers(run.figures), _sampled(run.trajectory, self.times))

        return ask

    def _held(self, integrator: Integrator, turn: Turn, steps: int) -> Ask:
        """Joint runs of members with a constant rudder, in a single call of the compiled loop."""
        model, h = integrator.model, integrator.model.step_s
        defaults, u = _parameters(model), model.input_values({"rudder.command": turn.rudder})
        t = np.append(np.arange(0, steps, EVERY), steps) * h
        inputs = np.tile(u, (len(t), 1))

        def ask(members: Sequence[Mapping[str, float]]) -> list[MemberResult]:
            whole = [defaults | dict(values) for values in members]
            p = np.array([list(values.values()) for values in whole])
            states = integrator.rollouts(np.array(model.initial(p.T)).T, u, p, (h, steps))
            found = []
            for values, parameters, x in zip(whole, p, states, strict=True):
                run = Trajectory(model, t, x, inputs, integrator.outputs(x, inputs, parameters))
                fault = mass_fault(values) or ("" if run.is_finite() else RUNAWAY)
                if fault:
                    found.append(MemberResult({}, trouble=fault))
                    continue
                figures = figures_of(turn, run, defaults["ship.length"])
                found.append(MemberResult(_numbers(figures), _sampled(run, self.times)))
            return found

        return ask


@dataclass(frozen=True)
class OfFigures:
    """Figures by name (:mod:`tank2sim.analysis.influence.figures`)."""

    ship: ShipText
    figures: tuple[str, ...]

    def prepared(self) -> Ask:
        """See :class:`tank2sim.simulation.ensemble.Question`."""
        # It takes python-control with it, slow to load: processes that run manoeuvres do without.
        from tank2sim.analysis.influence.study import Study

        study = Study(self.ship.card(), [parse_figure(text) for text in self.figures])
        names, defaults = [parameter.name for parameter in study.parameters], _parameters(study.model)

        def ask(values: Mapping[str, float]) -> MemberResult:
            if fault := mass_fault(defaults | dict(values)):
                return MemberResult({}, trouble=fault)
            given = dict(zip(names, study.values.tolist(), strict=True)) | dict(values)
            try:
                found = study.figures_at(np.array([given[name] for name in names]))
            except InputError as error:
                return MemberResult({}, trouble=error.problem)
            return MemberResult(dict(zip(self.figures, found.tolist(), strict=True)))

        return _each(ask)


@dataclass(frozen=True)
class OfCriteria:
    """Value of each IMO criterion by its name; nan where a trial does not show it."""

    ship: ShipText

    def prepared(self) -> Ask:
        """See :class:`tank2sim.simulation.ensemble.Question`."""
        whole = build(self.ship.card())
        model = _reading_off(whole, *(name for names in _READ_OFF.values() for name in names))
        integrator, parameters = Integrator(model, every=EVERY), _parameters(model)

        def ask(values: Mapping[str, float]) -> MemberResult:
            # What is an input (a current) is calm in these trials.
            given = {name: value for name, value in values.items() if name in parameters}
            if fault := mass_fault(parameters | given):
                return MemberResult({}, trouble=fault)
            criteria = imo_criteria(model, given, integrator)
            return MemberResult(
                {criterion.name: math.nan if criterion.found is None else criterion.found for criterion in criteria}
            )

        return _each(ask)


def _each(ask: AskOne) -> Ask:
    return lambda members: [ask(values) for values in members]


def _numbers(figures: Figures) -> Numbers:
    """Figures as single numbers, nan where the run does not show them."""
    return {name: math.nan for name, value in figures.items() if value is None} | single_figures(figures)


def _parameters(model: Model) -> dict[str, float]:
    return dict(zip(model.parameter_names, model.parameter_values().tolist(), strict=True))


def _reading_off(model: Model, *names: str) -> Model:
    states = set(model.state_names)
    wanted = [*names, "motion.speed", *(name for name, _ in ENSEMBLE_SIGNALS.values())]
    return replace(model, outputs=tuple(dict.fromkeys(name for name in wanted if name not in states)))


def _sampled(run: Trajectory, times: Array) -> np.ndarray[tuple[int, int], np.dtype[np.float32]]:
    rows = [factor * np.interp(times, run.t, run[name], right=np.nan) for name, factor in ENSEMBLE_SIGNALS.values()]
    return np.array(rows, dtype=np.float32)
