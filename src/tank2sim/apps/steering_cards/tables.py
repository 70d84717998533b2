"""The tables of paper 4 (Poznyakov and Yudin 2007) from a steering card: turns, influence, agreed variation.

K of a coefficient is the change of the steady radius in per cent when it grows by 10 %; Kc is the change of a
coefficient in per cent when the draught grows by 1 %. Both are defined in :mod:`tank2sim.analysis.influence.percent`
and applied to the models of the catalogue.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from tank2sim.analysis.influence.percent import change_percent, combined_percent, difference_percent
from tank2sim.analysis.turning.points import SteadyTurn, TurningPoints
from tank2sim.apps.steering_cards.card import PrintedInfluence, SteeringCard
from tank2sim.arrays import Number
from tank2sim.dynamics.model import Model
from tank2sim.dynamics.steering_models import STEERING_FORMS, SteeringForm, steering_model
from tank2sim.errors import InputError

RUDDERS_DEG = (5.0, 10.0, 15.0, 20.0, 25.0, 30.0, 35.0)
"""Rudder angles of Table 1."""


def form_of(card: SteeringCard, name: str) -> SteeringForm:
    """The form of a model of the card.

    Raises InputError: the model is not on the card, or its form is not in the catalogue.
    """
    if name not in card.models:
        raise InputError(card.source, "models", f"none is called {name!r}", f"one of {', '.join(card.models)}")
    form = STEERING_FORMS.get(card.models[name].form)
    if form is None:
        known = f"one of {', '.join(STEERING_FORMS)} was expected"
        raise InputError(card.source, f"{card.place(name)}.form", f"is {card.models[name].form!r}", known)
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
            raise InputError(card.source, f"{place}.{key}", f"is not a coefficient of {form.name}", ", ".join(known))
    if missing := not_given(card, name):
        problem = f"{form.title}: {', '.join(missing)} not given"
        raise InputError(card.source, place, problem, "; ".join(form.missing) or "add them")
    model = steering_model(card.ship.name, form, given, card.ship.length_m, card.ship.speed_mps)
    return replace(model, source=card.source)


@dataclass(frozen=True)
class ModelTurns:
    """Steady turns of a model over the rudder angle: a part of Table 1."""

    model: str
    title: str
    turns: tuple[SteadyTurn, ...]


def turns_of(card: SteeringCard, name: str, rudders_deg: Sequence[float] = RUDDERS_DEG) -> ModelTurns:
    """Steady turns of a model at rudder angles (deg). Raises InputError as :func:`model_of`, or where none exists."""
    points = TurningPoints(model_of(card, name))
    turns = tuple(points.turn_at(math.radians(rudder))[0] for rudder in rudders_deg)
    return ModelTurns(name, card.models[name].title, turns)


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
    """K of every coefficient of a model on its steady radius, by the paper's difference. Raises as :func:`turns_of`.

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
    """Kc: change of each coefficient from one model to another in per cent; Table 4. Unchanged ones are absent."""
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
    """Table 5: prediction by K for another model of the card (another draught), and the result of that model.

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
    direct = turns_of(card, changed, [rudder]).turns[0].radius_m
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
        return turns_of(card, target, [math.degrees(printed.rudder_rad)]).turns[0].radius_m
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
        raise InputError(card.source, "influence", "this section is missing", "add it, or ask for the turns alone")
    return card.influence


def _draught(card: SteeringCard, name: str) -> float:
    draught = card.models[name].draught_m
    printed = _influence(card)
    if draught is None or draught not in printed.draughts_m:
        place = f"{card.place(name)}.draught_m"
        raise InputError(card.source, place, f"is {draught}", "it must be one of influence.draughts_m")
    return draught
