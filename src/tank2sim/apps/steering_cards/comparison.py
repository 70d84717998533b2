"""Comparison of the models of a steering card: steady turns, manoeuvres, influence, and missing data.

The tables follow paper 4 (Poznyakov and Yudin 2007). K of a coefficient is the change of the steady radius in per
cent when it grows by 10 %; Kc is the change of a coefficient in per cent when the draught grows by 1 %
(:mod:`tank2sim.analysis.influence.percent`).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from tank2sim.analysis.influence.percent import change_percent, combined_percent, difference_percent
from tank2sim.apps.steering_cards.card import PrintedInfluence, SteeringCard
from tank2sim.apps.steering_cards.steady_points import SteadyTurn, TurnInDegrees, TurningPoints
from tank2sim.apps.steering_cards.two_point_tuning import TwoPointTuning, WantedTurn, levers_of_form, tune_to_two_points
from tank2sim.arrays import Array, Columns, Number
from tank2sim.dynamics.model import Model
from tank2sim.dynamics.steering_models import STEERING_FORMS, SteeringForm, steering_model
from tank2sim.errors import InputError
from tank2sim.records.thinning import drawn_columns
from tank2sim.simulation.figures import Figures
from tank2sim.simulation.integrator import Integrator
from tank2sim.simulation.manoeuvres import Turn, Zigzag
from tank2sim.simulation.run import Run, simulate
from tank2sim.simulation.trajectory import Trajectory

RUDDERS_DEG = (5.0, 10.0, 15.0, 20.0, 25.0, 30.0, 35.0)
"""Rudder angles of Table 1."""


def form_of(card: SteeringCard, name: str) -> SteeringForm:
    """The form of a model of the card.

    Raises InputError: the model is not on the card, or its form is not in the catalogue.
    """
    if name not in card.models:
        raise card.fault("models", f"none is called {name!r}", f"one of {', '.join(card.models)}")
    form = STEERING_FORMS.get(card.models[name].form)
    if form is None:
        known = f"one of {', '.join(STEERING_FORMS)} was expected"
        raise card.fault(f"{card.place(name)}.form", f"is {card.models[name].form!r}", known)
    return form


def not_given(card: SteeringCard, name: str) -> tuple[str, ...]:
    """Missing coefficients of a model of the card."""
    given = card.models[name].coefficients
    return tuple(
        coefficient.name
        for coefficient in form_of(card, name).coefficients
        if coefficient.default is None and coefficient.name not in given
    )


def complete(card: SteeringCard) -> tuple[str, ...]:
    """Names of the card's models that have all their coefficients."""
    return tuple(name for name in card.models if not not_given(card, name))


def model_of(card: SteeringCard, name: str) -> Model:
    """The model of an entry of the card, with parameters ``coefficients.*``; its messages name the card's file.

    Raises InputError: the model does not exist, a coefficient is missing (the message names those that the source does
    not print), or one is not part of the form.
    """
    form = form_of(card, name)
    place = f"{card.place(name)}.coefficients"
    given = card.models[name].coefficients
    known = [coefficient.name for coefficient in form.coefficients]
    for key in given:
        if key not in known:
            raise card.fault(f"{place}.{key}", f"is not a coefficient of {form.name}", ", ".join(known))
    if missing := not_given(card, name):
        problem = f"{form.title}: {', '.join(missing)} not given"
        raise card.fault(place, problem, "; ".join(form.missing) or "add them")
    model = steering_model(card.ship.name, form, given, card.ship.length_m, card.ship.speed_mps)
    return replace(model, source=card.source)


def turns_of(card: SteeringCard, name: str, rudders_deg: Sequence[float] = RUDDERS_DEG) -> tuple[SteadyTurn, ...]:
    """Steady turns of a model at rudder angles (deg), as in Table 1. Raises as :func:`model_of`, or without one."""
    points = TurningPoints(model_of(card, name))
    return tuple(points.turn_at(math.radians(rudder))[0] for rudder in rudders_deg)


@dataclass(frozen=True)
class InfluenceTable:
    """Influence of coefficients on the steady radius: Tables 2 and 3.

    `model`: name in the card; `rudder_rad`, `radius_m`: the turn; `change_percent`: change of each coefficient;
    `K_percent`, `radii_m`: by coefficient: change of the radius, and the radius after it.
    """

    model: str
    rudder_rad: float
    radius_m: float
    change_percent: float
    K_percent: dict[str, Number]
    radii_m: dict[str, Number]


def influence_of(card: SteeringCard, name: str, rudder_deg: float = 20.0, percent: float = 10.0) -> InfluenceTable:
    """K of every coefficient of a model on its steady radius, by a difference of `percent`. Raises as :func:`turns_of`.

    Only the coefficients of Table 4 are varied: fitted ones (inflow, lever, share) do not change.
    """
    model = model_of(card, name)
    points = TurningPoints(model)
    turn, y = points.turn_at(math.radians(rudder_deg))

    def radius(values: Mapping[str, float]) -> float:
        found = points.near(y, {f"coefficients.{key}": value for key, value in values.items()})
        return found.radius_m if found else math.nan

    given = {key: value for key, value in card.models[name].coefficients.items() if key.startswith("C_")}
    values = {key: value for key, value in given.items() if not key.startswith("C_y_p")}
    influence = difference_percent(radius, values, percent)
    radii = {key: turn.radius_m * (1 + value / 100) for key, value in influence.items()}
    return InfluenceTable(name, turn.rudder_rad, turn.radius_m, percent, influence, radii)


def agreed_variation(card: SteeringCard, base: str, target: str) -> dict[str, float]:
    """Kc: change of each coefficient from model `base` to `target`, per cent; Table 4. Unchanged ones are absent."""
    values, changed = card.models[base].coefficients, card.models[target].coefficients
    return {
        name: change_percent(changed[name], value)
        for name, value in values.items()
        if name in changed and changed[name] != value
    }


@dataclass(frozen=True)
class CombinedPrediction:
    """The radius after an agreed variation: Table 5, with its error and without.

    `agreed_percent`: Kc by coefficient; `radius_m`: before the variation, computed; `percent`, `predicted_m`: sum of Kc
    K / 10 with the printed K of each coefficient, and the printed radius changed by it; `misread_percent`, `misread_m`:
    with the K of other coefficients where the source confused them; `own_percent`, `own_m`: with the K computed here;
    `direct_m`: by the model of the other draught; `direct_misread_m`: by that model with the variations applied to the
    confused coefficients.
    """

    agreed_percent: dict[str, float]
    radius_m: float
    percent: float
    predicted_m: float
    misread_percent: float
    misread_m: float
    own_percent: float
    own_m: float
    direct_m: float
    direct_misread_m: float


def combined_prediction(card: SteeringCard, changed: str) -> CombinedPrediction:
    """Table 5: prediction by K for `changed`, a model of another draught, and the result of that model.

    Raises InputError: the card has no ``[influence]``, or as :func:`turns_of`.
    """
    printed = _influence(card)
    base, rudder = printed.model, math.degrees(printed.rudder_rad)
    agreed = agreed_variation(card, base, changed)
    table = influence_of(card, base, rudder, printed.change_percent)
    at = printed.draughts_m.index(_draught(card, base))
    K = {name: values[at] for name, values in printed.K_percent.items()}
    swapped = {name: K[printed.misread_as.get(name, name)] for name in K}
    percents = [combined_percent(percents_of, agreed) for percents_of in (K, swapped, table.K_percent)]
    radii = (printed.radius_m, printed.radius_m, table.radius_m)
    predicted = [radius * (1 + percent / 100) for radius, percent in zip(radii, percents, strict=True)]
    direct = turns_of(card, changed, [rudder])[0].radius_m
    return CombinedPrediction(
        agreed_percent=agreed,
        radius_m=table.radius_m,
        percent=percents[0],
        predicted_m=predicted[0],
        misread_percent=percents[1],
        misread_m=predicted[1],
        own_percent=percents[2],
        own_m=predicted[2],
        direct_m=direct,
        direct_misread_m=_direct_misread(card, printed, changed, agreed),
    )


def _direct_misread(card: SteeringCard, printed: PrintedInfluence, target: str, agreed: Mapping[str, float]) -> float:
    """Radius of the target model with the larger of two confused variations also on the wrong coefficient."""
    values = card.models[printed.model].coefficients
    largest = max(printed.misread_as, key=lambda name: abs(agreed.get(name, 0.0)), default=None)
    if largest is None:
        return turns_of(card, target, [math.degrees(printed.rudder_rad)])[0].radius_m
    wrong = printed.misread_as[largest]
    points = TurningPoints(model_of(card, target))
    changed = {f"coefficients.{wrong}": values[wrong] * (1 + agreed[largest] / 100)}
    return points.turn_at(printed.rudder_rad, changed)[0].radius_m


def draught_polynomials(card: SteeringCard) -> dict[str, tuple[float, ...]]:
    """K over the draught T in m, through its printed values: (4). Coefficients of 1, T, T^2 by name.

    Raises InputError: the card has no ``[influence]``.
    """
    printed = _influence(card)
    powers = np.vander(printed.draughts_m, increasing=True)
    return {name: tuple(np.linalg.solve(powers, values).tolist()) for name, values in printed.K_percent.items()}


def _influence(card: SteeringCard) -> PrintedInfluence:
    if card.influence is None:
        raise card.fault("influence", "this section is missing", "add it, or ask for the turns alone")
    return card.influence


def _draught(card: SteeringCard, name: str) -> float:
    draught = card.models[name].draught_m
    printed = _influence(card)
    if draught is None or draught not in printed.draughts_m:
        place = f"{card.place(name)}.draught_m"
        raise card.fault(place, f"is {draught}", "it must be one of influence.draughts_m")
    return draught


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
    """Compare the models of a card at a rudder angle, by default from its ``[influence]``, else 20 deg.

    Raises
    ------
    InputError
        No model of the card is complete, or a complete one has no steady turn at a rudder of Table 1.
    """
    names = complete(card)
    if not names:
        raise card.fault("models", "none has all its coefficients", "; ".join(missing_of(card).popitem()[1]))
    printed = card.influence
    main, usual_deg = (printed.model, math.degrees(printed.rudder_rad)) if printed else (names[0], 20.0)
    rudder = rudder_deg or usual_deg
    same = [name for name in names if card.models[name].draught_m == card.models[main].draught_m]
    turns = {name: turns_of(card, name) for name in names}
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
        combined_predictions=_combined_predictions(card, main, names),
        printed_influence=_at_last_draught(printed) if printed else None,
        influence_over_draught=draught_polynomials(card) if printed else {},
        two_point_tuning=tuning,
        missing=missing_of(card),
        titles={name: entry.title for name, entry in card.models.items()},
        diagrams=SteeringDiagrams(_diagrams(card, largest, same, (main, tuning)), _known_points(card)),
        histories={card.models[name].title: _circle(turn.trajectory) for name, (turn, _) in runs.items()},
    )


def _combined_predictions(card: SteeringCard, main: str, names: Sequence[str]) -> dict[str, CombinedPrediction]:
    """Table 5 for the models of the main model's form at other draughts; empty without printed influence."""
    if card.influence is None:
        return {}
    form, draught = card.models[main].form, card.models[main].draught_m
    others = [name for name in names if card.models[name].form == form and card.models[name].draught_m != draught]
    return {name: combined_prediction(card, name) for name in others}


def _at_last_draught(printed: PrintedInfluence) -> PrintedCoefficients:
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
