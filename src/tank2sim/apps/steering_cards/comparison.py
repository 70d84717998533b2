"""Comparison of the models of a steering card: steady turns, manoeuvres, influence, and missing data."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tank2sim.analysis.turning.points import TurnInDegrees, TurningPoints
from tank2sim.apps.steering_cards.card import PrintedInfluence, SteeringCard
from tank2sim.apps.steering_cards.tables import (
    RUDDERS_DEG,
    CombinedPrediction,
    InfluenceTable,
    combined_prediction,
    complete,
    draught_polynomials,
    form_of,
    influence_of,
    model_of,
    not_given,
    turns_of,
)
from tank2sim.apps.steering_cards.two_point_tuning import TwoPointTuning, WantedTurn, levers_of_form, tune_to_two_points
from tank2sim.arrays import Array, Columns
from tank2sim.errors import InputError
from tank2sim.records.thinning import drawn_columns
from tank2sim.simulation.figures import Figures
from tank2sim.simulation.integrator import Integrator
from tank2sim.simulation.manoeuvres import Turn, Zigzag
from tank2sim.simulation.run import Run, simulate
from tank2sim.simulation.trajectory import Trajectory

_TUNED = "through the two trial points"

_CIRCLE_SAMPLES = 300

ZIGZAG_DEG = 10.0
"""Rudder and heading of the zigzag of the comparison (MSC.137(76))."""


@dataclass(frozen=True)
class ModelFigures:
    """Figures of the manoeuvres of a model: a turning circle and the 10/10 zigzag."""

    turn: Figures
    zigzag: Figures


@dataclass(frozen=True, kw_only=True)
class PrintedCoefficients:
    """Influence coefficients (%) that the source prints at its last draught, and those that it confuses."""

    draught_m: float
    K_percent: dict[str, float]
    misread_as: dict[str, str]


@dataclass(frozen=True, eq=False)
class DiagramLine:
    """Steering diagram of a model: yaw rate over the rudder (n,), positive to starboard."""

    rudder_deg: Array
    yaw_rate_degpmin: Array


@dataclass(frozen=True, kw_only=True)
class KnownPoint:
    """A known turn, with its source; `radius_measured` if its yaw rate is from a measured radius."""

    label: str
    source: str
    rudder_deg: float
    yaw_rate_degpmin: float
    radius_measured: bool


@dataclass(frozen=True, eq=False)
class SteeringDiagrams:
    """Diagrams of the models by their words, the tuned one too, and known turns."""

    models: dict[str, DiagramLine]
    points: tuple[KnownPoint, ...]


@dataclass(frozen=True, eq=False, kw_only=True)
class SteeringComparison:
    """Comparison of the models of a card on its ship.

    Parameters
    ----------
    ship : str
        Name of the ship.
    main_model : str
        The model of the printed influence and of the tuning.
    rudder_deg : float
        Rudder of the influence and of the turning circle.
    steady_turns : dict
        Complete models to their steady turns at the rudders of Table 1.
    influence : dict
        Complete models at the main model's draught to their influence coefficients.
    manoeuvres : dict
        The same models to their figures.
    combined_predictions : dict
        Table 5 for the other draughts, by model.
    printed_influence : PrintedCoefficients or None
    influence_over_draught : dict
        K over the draught, (4): coefficients of 1, T, T^2.
    two_point_tuning : TwoPointTuning, str or None
        The main model through the first two measured points; a text with the reason without one.
    missing : dict
        Model to its missing data.
    titles : dict
        Model to its words.
    diagrams : SteeringDiagrams
    histories : dict
        Words of the models of `manoeuvres` to their turning circles, thinned for a chart.
    """

    ship: str
    main_model: str
    rudder_deg: float
    steady_turns: dict[str, tuple[TurnInDegrees, ...]]
    influence: dict[str, InfluenceTable]
    manoeuvres: dict[str, ModelFigures]
    combined_predictions: dict[str, CombinedPrediction]
    printed_influence: PrintedCoefficients | None
    influence_over_draught: dict[str, tuple[float, ...]]
    two_point_tuning: TwoPointTuning | str | None
    missing: dict[str, tuple[str, ...]]
    titles: dict[str, str]
    diagrams: SteeringDiagrams
    histories: dict[str, Columns]


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
    turns = {name: turns_of(card, name, RUDDERS_DEG).turns for name in names}
    runs = {name: _runs(card, name, rudder) for name in same}
    tuning = tuned(card, main)
    largest = max(turn.rudder_rad for row in turns.values() for turn in row)
    return SteeringComparison(
        ship=card.ship.name,
        main_model=main,
        rudder_deg=rudder,
        steady_turns={name: tuple(turn.in_degrees() for turn in row) for name, row in turns.items()},
        influence={name: influence_of(card, name, rudder) for name in same},
        manoeuvres={name: ModelFigures(turn.figures, zigzag.figures) for name, (turn, zigzag) in runs.items()},
        combined_predictions={name: combined_prediction(card, name) for name in candidates} if printed else {},
        printed_influence=_printed(printed) if printed else None,
        influence_over_draught=draught_polynomials(card) if printed else {},
        two_point_tuning=tuning,
        missing=missing_of(card),
        titles={name: entry.title for name, entry in card.models.items()},
        diagrams=SteeringDiagrams(_diagrams(card, largest, same, (main, tuning)), _known_points(card)),
        histories={card.models[name].title: _circle(turn.trajectory) for name, (turn, _) in runs.items()},
    )


def _printed(printed: PrintedInfluence) -> PrintedCoefficients:
    return PrintedCoefficients(
        draught_m=printed.draughts_m[-1],
        K_percent={name: values[-1] for name, values in printed.K_percent.items() if values},
        misread_as=dict(printed.misread_as),
    )


def _known_points(card: SteeringCard) -> tuple[KnownPoint, ...]:
    """Known turns of the ship; a radius becomes a yaw rate by the approach speed."""
    found = []
    for point in card.points:
        rate = point.yaw_rate_radps or math.copysign(
            card.ship.speed_mps / (point.radius_m or math.inf), point.rudder_rad
        )
        found.append(
            KnownPoint(
                label=point.label,
                source=point.source,
                rudder_deg=math.degrees(point.rudder_rad),
                yaw_rate_degpmin=60 * math.degrees(rate),
                radius_measured=bool(point.measured and point.radius_m),
            )
        )
    return tuple(found)


def _diagrams(
    card: SteeringCard, largest: float, names: Sequence[str], tuned: tuple[str, TwoPointTuning | str | None]
) -> dict[str, DiagramLine]:
    """Diagrams of the models by their titles, to the largest rudder, and of the tuned one."""
    found = {card.models[name].title: TurningPoints(model_of(card, name)).diagram(largest) for name in names}
    main, tuning = tuned
    if isinstance(tuning, TwoPointTuning):
        found[_TUNED] = TurningPoints(model_of(card, main)).diagram(largest, tuning.parameters)
    lines = {}
    for label, turns in found.items():
        rudder, rate = np.degrees([[turn.rudder_rad, 60 * turn.yaw_rate_radps] for turn in turns]).T
        lines[label] = DiagramLine(rudder, rate)
    return lines


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


def _runs(card: SteeringCard, name: str, rudder_deg: float) -> tuple[Run, Run]:
    """The turning circle and the zigzag of a model."""
    model = model_of(card, name)
    angle = math.radians(ZIGZAG_DEG)
    integrator = Integrator(model)
    turn = simulate(model, Turn(math.radians(rudder_deg)), integrator=integrator)
    return turn, simulate(model, Zigzag(angle, angle), integrator=integrator)
