"""Slopes of the figures by the coefficients, of the ship of a card and of ships drawn from its errors."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import casadi as ca
import numpy as np

from tank2sim.analysis.influence.figures import InfluenceFigure
from tank2sim.analysis.influence.study import Study
from tank2sim.arrays import Array
from tank2sim.cards.card import ManoeuvringCard
from tank2sim.cards.estimates import RELATIVE_ERROR
from tank2sim.cards.writing import TestedRange
from tank2sim.dynamics.build import build
from tank2sim.dynamics.card_parameters import CardParameter, JointErrors, joint_errors
from tank2sim.dynamics.effects.derivatives import hydrodynamic
from tank2sim.errors import ArgumentError, InputError
from tank2sim.notices import Notice
from tank2sim.simulation.manoeuvres import Turn, Zigzag
from tank2sim.simulation.run import simulate

_LEAST_RANGE = TestedRange(np.radians(4.0), np.radians(10.0), 0.2)
"""Range of the tests where the figures describe a straight course. Project choice: the smallest angles that gauges
measure well."""

_UNLISTED = 1e-12
"""Standard error by which a coefficient that the card lacks is among the parameters of a study; it is not used."""


@dataclass(frozen=True, eq=False)
class FigureSlopes:
    """Figures and their slopes by named coefficients.

    `values` (m,): values of the card's ship; `parameters`: k coefficients; `at_card` (m, k): slopes of the card's ship;
    `drawn` (draws, m, k): slopes of ships drawn from the errors, the card's first.
    """

    figures: tuple[InfluenceFigure, ...]
    values: Array
    parameters: tuple[CardParameter, ...]
    at_card: Array
    drawn: Array
    errors: JointErrors
    notices: tuple[Notice, ...]

    @property
    def texts(self) -> tuple[str, ...]:
        """The figures as they are asked for, (m,)."""
        return tuple(figure.text for figure in self.figures)

    def of(self, names: Sequence[str], slopes: Array) -> Array:
        """Columns (..., len(names)) of slopes (..., k): 0 for a coefficient that does not move the figures."""
        short = np.array([parameter.short for parameter in self.parameters])
        found: Array = slopes @ (short[:, None] == np.array(names)).astype(float)
        return found


def both_sides(figure: InfluenceFigure) -> tuple[InfluenceFigure, ...]:
    """The figure, and the same to the other side; itself alone on a straight course."""
    if not figure.angles:
        return (figure,)
    return figure, replace(figure, angles=(-figure.angles[0], *figure.angles[1:]))


def assumed_errors(card: ManoeuvringCard) -> dict[str, float]:
    """Standard errors of the derivatives of a card; :data:`.RELATIVE_ERROR` of the value where it states none."""
    assumed = {name: RELATIVE_ERROR * abs(value) for name, value in card.derivatives.items() if value}
    return assumed | dict(card.uncertainty)


def figure_slopes(
    card: ManoeuvringCard,
    figures: Sequence[InfluenceFigure],
    terms: Sequence[str],
    *,
    draws: int,
    seed: int,
    one_side: bool,
) -> FigureSlopes:
    """Slopes of figures by the derivatives of a card and by `terms` that it lacks.

    `terms`: derivatives that may become known though the card has none; `draws`: ships drawn from the card's errors; a
    derivative without a stated one has :data:`.RELATIVE_ERROR`. Ships that do not show all figures are left out.
    `one_side`: figures to the side of the given rudder, in place of the mean over both sides.
    """
    stated = assumed_errors(card)
    absent = dict.fromkeys((name for name in terms if name not in {*card.derivatives, *stated}), _UNLISTED)
    sides = [(figure,) if one_side else both_sides(figure) for figure in figures]
    every = [figure for each in sides for figure in each]
    mean = np.array([[(figure in each) / len(each) for figure in every] for each in sides])
    study = Study(replace(card, uncertainty=stated | absent), every)
    errors = joint_errors(study.card, study.parameters)
    at_card = mean @ study.slopes_at(study.values)[1]
    if not np.isfinite(at_card).all():
        bad = figures[int(np.flatnonzero(~np.isfinite(at_card).all(axis=1))[0])]
        problem = f"{card.ship.name} shows it without a clean event: it has no slopes"
        raise ArgumentError("figures", bad.text, problem, "ask for another figure, or for another rudder")
    free = np.isin([parameter.name for parameter in study.parameters], [f"derivatives.{name}" for name in stated])
    covariance = np.where(np.outer(free, free), errors.covariance, 0.0)
    ships = np.random.default_rng(seed).multivariate_normal(study.values, covariance, size=draws, method="eigh")
    found = np.stack([at_card, *_slopes_of_ships(study, ships, mean)])
    return FigureSlopes(tuple(figures), mean @ study.base, study.parameters, at_card, found, errors, study.notices)


def _slopes_of_ships(study: Study, ships: Array, mean: Array) -> Iterator[Array]:
    """Slopes of the `mean` figures at each of the ships (draws, parameters) that shows all of them."""
    for values in ships:
        try:
            slopes = mean @ study.slopes_at(values)[1]
        except InputError:
            continue
        if np.isfinite(slopes).all():
            yield slopes


def hydrodynamic_derivatives(card: ManoeuvringCard) -> dict[str, float]:
    """Derivatives (prime) without the inertia of the ship that a card may have in its terms of yaw."""
    model = build(card)
    names = [name.removeprefix("derivatives.") for name in model.parameter_names if name.startswith("derivatives.")]
    values = ca.Function("values", [model.p], [ca.vcat([hydrodynamic(model, name, card) for name in names])])
    return dict(zip(names, np.array(values(model.parameter_values())).ravel().tolist(), strict=True))


def range_of_figures(card: ManoeuvringCard, figures: Sequence[InfluenceFigure]) -> TestedRange:
    """Largest drift, rudder and r' of the manoeuvres of the figures, rounded up to 1 deg, 1 deg and 0.05."""
    model = build(card)
    length = card.ship.length_m
    reached = np.array(_LEAST_RANGE)
    for manoeuvre in dict.fromkeys(figure.manoeuvre for figure in figures):
        if not isinstance(manoeuvre, Turn | Zigzag):
            continue
        run = simulate(model, manoeuvre).trajectory
        rate = np.abs(run["motion.r"]) * length / np.maximum(run["motion.speed"], 1e-6)
        visited = np.abs(run["motion.beta"]).max(), abs(manoeuvre.rudder), rate.max()
        reached = np.maximum(reached, visited)
    steps = np.array([np.radians(1.0), np.radians(1.0), 0.05])
    return TestedRange(*(np.ceil(reached / steps - 1e-9) * steps).tolist())
