"""The ship as tried and at full load: cards, members of the ensemble, and R = T F/B (MSC/Circ.1053, 3.4.1)."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from tank2sim.analysis.validation.standard_trials import SEED, members, robust_deviation
from tank2sim.apps.trial_office.conditions import TrialState
from tank2sim.apps.trial_office.tried import Tried, calm_run, simulated
from tank2sim.arrays import Array
from tank2sim.cards.card import ManoeuvringCard
from tank2sim.dynamics import build
from tank2sim.dynamics.card_parameters import card_parameters, joint_errors, study_model
from tank2sim.dynamics.effects.loading import BY_REGRESSION, LOADING
from tank2sim.dynamics.effects.particulars import model_particular
from tank2sim.dynamics.effects.surroundings import WIND
from tank2sim.dynamics.model import Model
from tank2sim.errors import InputError
from tank2sim.gap.improve_card import Found, add_effects_to_card
from tank2sim.notices import Notice
from tank2sim.simulation.card_range import Numbers, single_figures
from tank2sim.simulation.integrator import Integrator
from tank2sim.simulation.recorded import steerable

FORMULA_ERROR = 0.15
"""Standard error of the change of a derivative with draught and trim, over that change. Project choice: half the
scatter of Clarke's regressions between ships (30 %), for a ship keeps most of its own deviation at another draught."""

SMALLEST = 1e-3
"""Figure or ratio below which it says nothing. Project choice."""


@dataclass(frozen=True, eq=False)
class TriedShips:
    """The ship as tried and at full load, ready to run, with the parameters of the members of the ensemble."""

    as_tried: ManoeuvringCard
    full_load: ManoeuvringCard
    tried: Integrator
    full: Integrator
    drawn: tuple[tuple[dict[str, float], dict[str, float]], ...]


def tried_ships(card: ManoeuvringCard, state: TrialState, count: int) -> tuple[TriedShips, list[Notice]]:
    """The ship in both conditions, and members with the errors of the card and of the formulas for the loading."""
    own = model_particular(card, "draught_m")
    full = state.full_load_draught_m, 0.0
    loadings = {"tried": full if state.at_full_load else (state.draught_m, state.trim_m), "full": full}
    windy = state.wind is not None and state.wind[0] > 0
    cards = {
        name: _loaded(card, draught, trim, own, wind=windy and name == "tried")
        for name, (draught, trim) in loadings.items()
    }
    models = {name: build(steerable(one)) for name, one in cards.items()}
    drawn, messages = members(cards["tried"], models["tried"], count)
    changes = {name: math.hypot(draught / own - 1, trim / own) for name, (draught, trim) in loadings.items()}

    def both(number: int, values: Mapping[str, float]) -> tuple[dict[str, float], dict[str, float]]:
        errors = np.random.default_rng([SEED, number]).standard_normal(len(BY_REGRESSION))
        first, second = (_with_formula_errors(values, models[name], errors, changes[name]) for name in loadings)
        return first, second

    ships = TriedShips(
        cards["tried"],
        cards["full"],
        Integrator(models["tried"]),
        Integrator(models["full"]),
        tuple(both(*numbered) for numbered in enumerate(drawn)),
    )
    assumed = joint_errors(card, card_parameters(card, study_model(card))).in_words if count else []
    return ships, [*messages, *assumed]


def _loaded(card: ManoeuvringCard, draught: float, trim: float, own_draught: float, *, wind: bool) -> ManoeuvringCard:
    """The card at a draught and a trim (m), where they differ from its own, and in the wind."""
    listed = {entry.name for entry in card.effects}
    entries: list[Found] = []
    if not math.isclose(draught, own_draught, rel_tol=1e-6) or abs(trim) > 1e-6:
        if LOADING.name in listed:
            raise card.fault("effects", "has the effect loading already", "give the card of one loading condition")
        entries.append((LOADING.name, {"mean_draught_m": draught, "trim_m": trim}, {}))
    if wind and WIND.name not in listed:
        entries.append((WIND.name, {}, {}))
    return add_effects_to_card(card, entries).manoeuvring() if entries else card


def _with_formula_errors(values: Mapping[str, float], model: Model, errors: Array, change: float) -> dict[str, float]:
    """Parameters of a member with other linear derivatives, by the error of the formulas for the loading."""
    own = model.defaults
    found = {name: value for name, value in values.items() if name in own}
    for name, error in zip(BY_REGRESSION, errors, strict=True):
        full_name = f"derivatives.{name}"
        if change and full_name in own:
            found[full_name] = found.get(full_name, own[full_name]) * (1 + FORMULA_ERROR * change * error)
    return found


@dataclass(frozen=True, eq=False)
class Prediction:
    """Simulated figures of a manoeuvre: as tried with the wind (B), as tried in calm water, and at full load (F)."""

    tried: Numbers  # `tried`, `calm`, `full`: By the card itself
    calm: Numbers
    full: Numbers
    ratios: Mapping[str, Array]  # Logarithm of F/B of each member (n,), where it has both
    spreads: Mapping[str, float]  # Standard deviation of the logarithm of B over the members
    # Whether the trial itself shows full load in calm water: R is T, whatever the model does
    is_full_load: bool = False
    runs: Sequence[tuple[Numbers, Numbers]] = ()  # Figures of each member as tried and at full load

    def at_full_load(self, one: Tried, name: str) -> tuple[float, float] | None:
        """R = T F/B of a manoeuvre without the current and the standard error of its logarithm; None where unknown."""
        measured, before, after = one.figures.get(name), self.tried.get(name), self.full.get(name)
        if self.is_full_load and measured is not None and measured > SMALLEST:
            return measured, one.errors.get(name, 0.0) / measured
        if measured is None or before is None or after is None or min(before, after, measured) <= SMALLEST:
            return None
        ratios = self.ratios.get(name, np.zeros(0))
        spread = robust_deviation(ratios)
        return measured * after / before, math.hypot(spread, one.errors.get(name, 0.0) / measured)

    def model_agrees(self, one: Tried, name: str) -> bool | None:
        """Whether a figure without the current is within the 95 % interval of the model's as tried; None where unknown.

        MSC/Circ.1053, 3.4.1, option 2: a model that agrees well in the condition of the trial may predict full load
        itself.
        """
        measured, by_model = one.figures.get(name), self.tried.get(name)
        if name not in self.spreads or measured is None or by_model is None or measured <= SMALLEST:
            return None
        error = math.hypot(self.spreads[name], one.errors.get(name, 0.0) / measured)
        return abs(math.log(measured / by_model)) <= 1.96 * error


def prediction(one: Tried, ships: TriedShips, wind: Mapping[str, float], *, at_full_load: bool) -> Prediction:
    """A manoeuvre without the current, simulated in both conditions and the inputs of the `wind`, also by the members.

    `at_full_load`: The trial itself counts as at full load: F then differs from B by the wind alone.
    """
    calm_full_load = at_full_load and not wind
    speed = one.speed_mps if at_full_load else ships.full_load.model.speed_mps

    def both(values: tuple[Mapping[str, float], Mapping[str, float]]) -> tuple[Numbers, Numbers]:
        before = _run(lambda: simulated(one, ships.tried, wind, values[0]))
        if calm_full_load:
            return before, before
        return before, _run(lambda: single_figures(calm_run(one, ships.full, speed, values[1]).figures))

    before, after = both(({}, {}))
    calm = _run(lambda: simulated(one, ships.tried, {}, {})) if wind else before
    logarithms: dict[str, list[tuple[float, float]]] = {}
    runs = [both(values) for values in ships.drawn]
    for first, second in runs:
        for name in first.keys() & second.keys():
            if min(first[name], second[name]) > SMALLEST:
                pair = math.log(second[name] / first[name]), math.log(first[name])
                logarithms.setdefault(name, []).append(pair)
    drawn = {name: np.array(pairs) for name, pairs in logarithms.items()}
    ratios = {name: pairs[:, 0] for name, pairs in drawn.items()}
    spreads = {name: robust_deviation(pairs[:, 1]) for name, pairs in drawn.items()}
    return Prediction(before, calm, after, ratios, spreads, is_full_load=calm_full_load, runs=runs)


def _run(simulation: Callable[[], Numbers]) -> Numbers:
    """Figures of a simulation; none of one that leaves all bounds."""
    try:
        return simulation()
    except InputError:
        return {}


def loading_validity(ships: TriedShips) -> float:
    """Validity of the formulas for the loading in both conditions, the lower one."""
    found = [1.0]
    for integrator in (ships.tried, ships.full):
        model = integrator.model
        name = "validity_by.loading"
        if name in model.outputs:
            p = model.parameter_values()
            y = np.array(model.output(model.initial(p), model.input_values(), p)).ravel()
            found.append(float(y[model.outputs.index(name)]))
    return min(found)
