"""Comparison of the models of a steering card: steady turns, manoeuvres, influence, and missing data."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from tank2sim.analysis.catalogue.tables import (
    RUDDERS_DEG,
    CombinedPrediction,
    InfluenceTable,
    ModelTurns,
    combined_prediction,
    complete,
    draught_polynomials,
    form_of,
    influence_of,
    model_of,
    not_given,
    turns_of,
)
from tank2sim.analysis.turning.points import SteadyTurn, TurningPoints
from tank2sim.analysis.turning.two_point_tuning import TwoPointTuning, WantedTurn, levers_of_form, tune_to_two_points
from tank2sim.arrays import Columns
from tank2sim.cards.steering_card import PrintedInfluence, SteeringCard, SteeringPoint
from tank2sim.errors import InputError
from tank2sim.records.thinning import drawn_columns
from tank2sim.simulation.figures import Figures
from tank2sim.simulation.integrator import Integrator
from tank2sim.simulation.manoeuvres import Turn, Zigzag
from tank2sim.simulation.run import simulate
from tank2sim.simulation.trajectory import Trajectory

_TUNED = "through the two trial points"

_CIRCLE_SAMPLES = 300

ZIGZAG_DEG = 10.0
"""Rudder and heading of the zigzag of the comparison (MSC.137(76))."""


@dataclass(frozen=True)
class ModelRuns:
    """Manoeuvres of a model: a turning circle, its figures, and those of the 10/10 zigzag."""

    turn: Trajectory
    turn_figures: Figures
    zigzag_figures: Figures


@dataclass(frozen=True)
class SteeringComparison:
    """Comparison of the models of a card on its ship.

    Parameters
    ----------
    ship : str
        Name of the ship.
    main : str
        The model of the printed influence and of the tuning.
    rudder_deg : float
        Rudder of the influence and of the turning circle.
    turns : tuple of ModelTurns
        Steady turns of every complete model at the rudders of Table 1.
    influence : tuple of InfluenceTable
        Influence coefficients of every complete model at the main model's draught.
    runs : mapping
        Manoeuvres of the same models, by name.
    predictions : mapping
        Table 5 for the other draughts, by model.
    polynomials : mapping
        K over the draught, (4): coefficients of 1, T, T^2.
    tuning : TwoPointTuning, str or None
        The main model through the first two measured points; a text with the reason without one.
    missing : mapping
        Model to its missing data.
    titles : mapping
        Model to its words.
    diagrams : mapping
        Words to the steering diagram of each model of `runs`, and of the tuned one.
    points : tuple of SteeringPoint
        Known points of the diagram.
    speed_mps : float
        Approach speed, which converts a radius into a yaw rate.
    printed : PrintedInfluence or None
        Influence coefficients that the source prints.
    """

    ship: str
    main: str
    rudder_deg: float
    turns: tuple[ModelTurns, ...]
    influence: tuple[InfluenceTable, ...]
    runs: Mapping[str, ModelRuns]
    predictions: Mapping[str, CombinedPrediction]
    polynomials: Mapping[str, tuple[float, ...]]
    tuning: TwoPointTuning | str | None
    missing: Mapping[str, tuple[str, ...]]
    titles: Mapping[str, str]
    diagrams: Mapping[str, tuple[SteadyTurn, ...]]
    points: tuple[SteeringPoint, ...]
    speed_mps: float
    printed: PrintedInfluence | None

    def as_json(self) -> dict[str, object]:
        """All values, in m, deg and deg/min; turning circles thinned for a chart."""
        tuning = self.tuning.as_json() if isinstance(self.tuning, TwoPointTuning) else self.tuning
        return {
            "ship": self.ship,
            "main_model": self.main,
            "rudder_deg": self.rudder_deg,
            "steady_turns": {row.model: [turn.as_json() for turn in row.turns] for row in self.turns},
            "influence": {row.model: vars(row) for row in self.influence},
            "manoeuvres": {
                name: {"turn": dict(run.turn_figures), "zigzag": dict(run.zigzag_figures)}
                for name, run in self.runs.items()
            },
            "combined_predictions": {name: vars(prediction) for name, prediction in self.predictions.items()},
            "printed_influence": self.printed
            and {
                "draught_m": self.printed.draughts_m[-1],
                "K_percent": {name: values[-1] for name, values in self.printed.K_percent.items() if values},
                "misread_as": dict(self.printed.misread_as),
            },
            "influence_over_draught": {name: list(values) for name, values in self.polynomials.items()},
            "two_point_tuning": tuning,
            "missing": {name: list(words) for name, words in self.missing.items()},
            "titles": dict(self.titles),
            "diagrams": self._diagrams(),
            "histories": {self.titles[name]: _circle(run.turn) for name, run in self.runs.items()},
        }

    def _diagrams(self) -> dict[str, object]:
        names = ("rudder_deg", "yaw_rate_degpmin")
        points = []
        for point in self.points:
            rate = point.yaw_rate_radps or math.copysign(
                self.speed_mps / (point.radius_m or math.inf), point.rudder_rad
            )
            row = {"rudder_deg": math.degrees(point.rudder_rad), "yaw_rate_degpmin": 60 * math.degrees(rate)}
            known = {"radius_measured": bool(point.measured and point.radius_m)}
            points.append({"label": point.label, "source": point.source, **row, **known})
        models = {
            label: {name: [turn.as_json()[name] for turn in turns] for name in names}
            for label, turns in self.diagrams.items()
        }
        return {"models": models, "points": points}


def compare_steering_models(card: SteeringCard, rudder_deg: float | None = None) -> SteeringComparison:
    """Compare the models of a card at a rudder angle, by default that of its ``[influence]``, else 20 deg.

    Raises
    ------
    InputError
        No model of the card is complete, or a complete one has no steady turn at a rudder of Table 1.
    """
    names = complete(card)
    if not names:
        raise InputError(
            card.source, "models", "none has all its coefficients", "; ".join(missing_of(card).popitem()[1])
        )
    printed = card.influence
    rudder = rudder_deg or (math.degrees(printed.rudder_rad) if printed else 20.0)
    main = printed.model if printed else names[0]
    same = [name for name in names if card.models[name].draught_m == card.models[main].draught_m]
    candidates = [name for name in names if name not in same and card.models[name].form == card.models[main].form]
    turns, runs = tuple(turns_of(card, name, RUDDERS_DEG) for name in names), {n: _runs(card, n, rudder) for n in same}
    tuning = tuned(card, main)
    return SteeringComparison(
        ship=card.ship.name,
        main=main,
        rudder_deg=rudder,
        turns=turns,
        influence=tuple(influence_of(card, name, rudder) for name in same),
        runs=runs,
        predictions={name: combined_prediction(card, name) for name in candidates} if printed else {},
        polynomials=draught_polynomials(card) if printed else {},
        tuning=tuning,
        missing=missing_of(card),
        titles={name: entry.title for name, entry in card.models.items()},
        diagrams=_diagrams(card, max(turn.rudder_rad for row in turns for turn in row.turns), same, (main, tuning)),
        points=card.points,
        speed_mps=card.ship.speed_mps,
        printed=printed,
    )


def _diagrams(
    card: SteeringCard, largest: float, names: Sequence[str], tuned: tuple[str, TwoPointTuning | str | None]
) -> dict[str, tuple[SteadyTurn, ...]]:
    """Diagrams of the models by their titles, to the largest rudder, and of the tuned one."""
    found = {card.models[name].title: TurningPoints(model_of(card, name)).diagram(largest) for name in names}
    main, tuning = tuned
    if isinstance(tuning, TwoPointTuning):
        found[_TUNED] = TurningPoints(model_of(card, main)).diagram(largest, tuning.parameters)
    return {label: tuple(turns) for label, turns in found.items()}


def _circle(turn: Trajectory) -> Columns:
    return drawn_columns({"t_s": turn.t, "x_m": turn["motion.x"], "y_m": turn["motion.y"]}, _CIRCLE_SAMPLES)


def missing_of(card: SteeringCard) -> dict[str, tuple[str, ...]]:
    """Missing data of the card's models, by name: coefficients not given, omissions of the source, notes."""
    unknown: dict[str, tuple[str, ...]] = {}
    forms: set[str] = set()
    for name, entry in card.models.items():
        form = form_of(card, name)
        lacking = not_given(card, name)
        words: tuple[str, ...] = (f"not given: {', '.join(lacking)}",) if lacking else ()
        words += () if form.name in forms else form.missing
        words += (entry.notes,) if entry.notes else ()
        forms.add(form.name)
        if words:
            unknown[name] = words
    return unknown


def tuned(card: SteeringCard, name: str) -> TwoPointTuning | str | None:
    """A model of the card tuned to its first two measured points; the reason of a failure, or None without points."""
    measured = [point for point in card.points if point.measured][:2]
    if len(measured) < 2:
        return None
    first, second = (WantedTurn(turn.rudder_rad, turn.yaw_rate_radps, turn.radius_m) for turn in measured)
    try:
        return tune_to_two_points(model_of(card, name), levers_of_form(form_of(card, name)), first, second)
    except InputError as error:
        return error.problem


def _runs(card: SteeringCard, name: str, rudder_deg: float) -> ModelRuns:
    model = model_of(card, name)
    angle = math.radians(ZIGZAG_DEG)
    integrator = Integrator(model)
    turn = simulate(model, Turn(math.radians(rudder_deg)), integrator=integrator)
    zigzag = simulate(model, Zigzag(angle, angle), integrator=integrator)
    return ModelRuns(turn.trajectory, turn.figures, zigzag.figures)
