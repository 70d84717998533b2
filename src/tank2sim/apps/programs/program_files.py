"""A card in another language: its text or files, what is lost on the way, and figures before and after."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import product

import casadi as ca
import numpy as np

from tank2sim.arrays import Array
from tank2sim.cards.card import SteeredBy, SteeredCard
from tank2sim.cards.small_craft import cruising_revolutions
from tank2sim.dynamics.model import Model
from tank2sim.errors import InputError
from tank2sim.simulation.card_range import single_figures
from tank2sim.simulation.integrator import Integrator
from tank2sim.simulation.manoeuvres import Turn, Zigzag
from tank2sim.simulation.run import simulate
from tank2sim.simulation.thruster_manoeuvres import DifferenceTurn, Spin, StraightRun

TURNS_DEG, ZIGZAGS_DEG = (10.0, 20.0, 35.0), (10.0, 20.0)
"""Rudders of the turning circles and of the zigzags, to both sides, by which forms of a ship are compared."""

_DIFFERENCE, _SPIN = 0.3, 0.7
"""Difference of a turn and revolutions of a spin, over the cruising revolutions, with which forms are compared: a wide
turn and a spin within the reach of any craft (project choice)."""
# Figures that are compared, by manoeuvre; for all others the figures that are not relative
_COMPARED: Mapping[type, Sequence[str]] = {
    Turn: ("advance_m", "transfer_m", "tactical_diameter_m", "steady_diameter_m"),
    Zigzag: ("overshoot_1_deg", "overshoot_2_deg"),
}
_RELATIVE = ("_lengths", "_percent")


@dataclass(frozen=True)
class FigureChange:
    """A figure of a manoeuvre (``turn:35``, ``advance_m``) by two models; None where the run was too short for it."""

    manoeuvre: str
    figure: str
    before: float | None
    after: float | None

    @property
    def error_percent(self) -> float | None:
        """Difference over the figure before; None where either is unknown, or it is 0."""
        return 100 * (self.after / self.before - 1) if self.before and self.after is not None else None


@dataclass(frozen=True)
class PolynomialFit:
    """A third-order polynomial in place of an MMG ship."""

    derivatives: Mapping[str, float]  # Name to prime value, rudder positive to starboard
    Xnn: float  # Effect of revolutions, prime
    residuals: Mapping[str, float]  # Force to the root mean square of the residual over the force's
    # ``u`` (over u0), ``drift_deg``, ``yaw_rate_prime``, ``rudder_deg`` to lowest and highest value that was fitted
    ranges: Mapping[str, tuple[float, float]]
    # (k, k): Covariance of `derivatives`, in their order, by the errors of the MMG card; None if it states none
    covariance: Array | None = None


@dataclass(frozen=True, kw_only=True)
class ProgramFiles:
    """A card in another language."""

    text: str = ""  # For a form of one file
    files: Mapping[str, str | bytes] = field(default_factory=dict)  # Path within the folder of any other to content
    use: str = ""  # How the program takes the files, in Markdown, for the README next to them
    losses: tuple[str, ...] = ()  # What the program does not have of the card, a sentence each
    changes: tuple[FigureChange, ...] = ()  # Figures of standard manoeuvres by the card and in the other language
    card: SteeredCard | None = None  # If it is a card
    fit: PolynomialFit | None = None  # Where a polynomial replaces an MMG ship


def to_digits(values: Mapping[str, float], digits: int) -> dict[str, float]:
    """The values, rounded to significant digits."""
    return {name: float(f"{value:.{digits}g}") for name, value in values.items()}


def value_at(model: Model, name: str, states: Mapping[str, float], orders: Mapping[str, float] | None = None) -> float:
    """A variable of a model at its start with other `states` and `orders` (inputs), SI."""
    x = np.array(model.initial(model.parameter_values())).ravel()
    for state, value in states.items():
        x[model.state_names.index(state)] = value
    function = ca.Function("value", [model.x, model.u, model.p], [model.expand(model.symbol(name))])
    return float(function(x, model.input_values(orders), model.parameter_values()))


def standard_manoeuvres(model: Model) -> Iterator[Turn | Zigzag]:
    """Turns and zigzags of a ship to both sides, within the limits of its rudder."""
    largest = model.defaults.get("steering.max_angle", math.pi / 2)
    for angle, side in product(TURNS_DEG, (1, -1)):
        yield Turn(side * min(math.radians(angle), largest))
    for angle, side in product(ZIGZAGS_DEG, (1, -1)):
        yield Zigzag(side * math.radians(angle), math.radians(angle))


def figure_changes(
    card: SteeredCard, before: Model, after: Model, integrator: Integrator | None = None
) -> tuple[FigureChange, ...]:
    """Figures of the standard manoeuvres of a card by two models, the second by its integrator if it is given.

    A craft makes a straight run, a turn and a spin, as far as its thrusters can.
    """
    manoeuvres: Sequence[Turn | Zigzag | StraightRun | DifferenceTurn | Spin] = [*standard_manoeuvres(before)]
    if craft := card.steered_by is SteeredBy.THRUSTERS:
        n = cruising_revolutions(card)
        manoeuvres = StraightRun(n), DifferenceTurn(_DIFFERENCE * n), Spin(_SPIN * n)
    found = []
    for manoeuvre in manoeuvres:
        try:
            first, second = (
                single_figures(simulate(model, manoeuvre, integrator=by).figures)
                for model, by in ((before, None), (after, integrator))
            )
        except InputError:
            if craft:
                continue  # thrusters that are not on both sides, or do not reverse as far
            raise
        names = _COMPARED.get(type(manoeuvre)) or [name for name in first if not name.endswith(_RELATIVE)]
        found += [FigureChange(manoeuvre.words, name, first.get(name), second.get(name)) for name in names]
    return tuple(found)
