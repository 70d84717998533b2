"""Members of a prior moved to manoeuvring figures, by an ensemble smoother with multiple data assimilation.

Emerick and Reynolds (2013), Computers & Geosciences 55, 3-15: the members go to the figures in a few steps, each with
the errors of the figures enlarged so that all steps together take each figure once. In each step

    p <- p + C_py (C_yy + a R)^-1 (y + sqrt(a) e - f(p)),   e ~ N(0, R),

with the covariances of the members themselves. Figures are positive, and y and f are their logarithms. For a linear f
and a normal prior the members are then those of the posterior.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tank2sim.analysis.ensemble.draws import draws_of
from tank2sim.arrays import Array
from tank2sim.cards import ManoeuvringCard
from tank2sim.dynamics.card_parameters import study_model
from tank2sim.dynamics.ship import mass_faults
from tank2sim.errors import ArgumentError
from tank2sim.native.compiler import require_compiler
from tank2sim.simulation.ensemble import Draws
from tank2sim.simulation.lane_figures import LaneManoeuvres
from tank2sim.simulation.manoeuvres import Turn, Zigzag

STEPS = 4
"""Steps in which the members go to the figures. Project choice: the number that Emerick and Reynolds (2013) use."""

LEAST_MEMBERS = 100
"""Members below which nothing is said. Project choice: four for each number that moves."""

SURPRISE = 3.5
"""Standard deviations by which a figure lies outside what ships of these dimensions show, alone or with the other
figures, or by which the ships found miss it, from which it is refused. Project choice: by chance it happens to one in
2000."""

_LONGEST = 40.0
"""Longest run, L/u0: posters are of ships that have turned half round, and swung twice, long before. Project choice."""

_TEN, _TWENTY, _HARD = (math.radians(angle) for angle in (10.0, 20.0, 35.0))

POSTER_MANOEUVRES: Mapping[str, Turn | Zigzag] = {
    "turn35": Turn(_HARD),
    "zigzag10": Zigzag(_TEN, _TEN),
    "zigzag20": Zigzag(_TWENTY, _TWENTY),
}
"""Manoeuvres of a poster, by the name of their option; to starboard, for a guessed ship has no asymmetry."""

FIGURES: Mapping[str, tuple[str, ...]] = {
    "turn35": ("advance_m", "transfer_m", "tactical_diameter_m"),
    "zigzag10": ("overshoot_1_deg", "overshoot_2_deg"),
    "zigzag20": ("overshoot_1_deg", "overshoot_2_deg"),
}
"""Names of the figures of each."""

FIGURE_KEYS: Mapping[str, tuple[str, str]] = {
    f"{name}@{POSTER_MANOEUVRES[manoeuvre].words.partition(':')[2]}": (manoeuvre, name)
    for manoeuvre, names in FIGURES.items()
    for name in names
}
"""Every figure as in :mod:`tank2sim.analysis.influence.figures`, ``advance_m@35``, to its manoeuvre and name."""

_KEYS = {figure: key for key, figure in FIGURE_KEYS.items()}


@dataclass(frozen=True)
class GivenFigure:
    """A figure of a poster, in m or deg, with its standard error."""

    manoeuvre: str
    name: str
    value: float
    standard_error: float

    @property
    def key(self) -> str:
        """Key among :data:`FIGURE_KEYS`."""
        return _KEYS[self.manoeuvre, self.name]

    @property
    def text(self) -> str:
        """As written on the command line."""
        return f"{self.name}={self.value:g}"


@dataclass(frozen=True, eq=False)
class GuessMembers:
    """Members (n, k) of the parameters of `draws`, and their figures (n,) by key; before and after.

    Parameters
    ----------
    draws : Draws
        The prior.
    prior, posterior : arrays (n, k)
    before, after : mapping
        Key of :data:`FIGURE_KEYS` to figures.
    """

    draws: Draws
    prior: Array
    posterior: Array
    before: Mapping[str, Array]
    after: Mapping[str, Array]


class PosterFigures:
    """Figures of the ships of a card by their parameters, in lanes.

    Raises
    ------
    InputError
        There is no C compiler.
    """

    def __init__(self, card: ManoeuvringCard, names: Sequence[str]):
        require_compiler("guessing a ship by thousands of simulations")
        self._model = study_model(card)
        self._lanes = LaneManoeuvres(self._model, longest=_LONGEST)
        self._places = [self._model.parameter_names.index(name) for name in names]

    def at(self, values: Array) -> dict[str, Array]:
        """Figures (n,) by key of ships with parameters `values` (n, k); nan where a ship does not show one."""
        p = np.tile(self._model.parameter_values(), (len(values), 1))
        p[:, self._places] = values
        faults = mass_faults(self._model, dict(zip(self._model.parameter_names, p.T, strict=True)))
        bad = np.array([bool(fault) for fault in faults])
        found = {}
        for name, manoeuvre in POSTER_MANOEUVRES.items():
            runs = self._lanes.run(manoeuvre, p).figures
            for figure in FIGURES[name]:
                shown = runs.get(figure, np.full(len(values), np.nan))
                found[_KEYS[name, figure]] = np.where(bad, np.nan, shown)
        return found


def conditioned(card: ManoeuvringCard, given: Sequence[GivenFigure], members: int, seed: int) -> GuessMembers:
    """Ships of a prior card, moved to the figures that are given.

    Parameters
    ----------
    card : ManoeuvringCard
        The prior.
    given : sequence of GivenFigure
    members : int
        Number of ships that are drawn from it.
    seed : int

    Raises
    ------
    InputError
        A figure is one that no ship of these dimensions shows, or contradicts the others; there is no C compiler; or
        hardly a ship of the prior shows the figures at all.
    """
    draws, _ = draws_of(card, seed)
    run = PosterFigures(card, draws.names)
    first = np.array([list(draws.member(number).values()) for number in range(members)])
    figures = run.at(first)
    keep = _showing(figures)
    prior, figures = first[keep], _rows(figures, keep)
    if len(prior) < LEAST_MEMBERS:
        problem = f"only {len(prior)} of {members} ships of these dimensions come round in all manoeuvres"
        raise ArgumentError("length_m", "", problem, "check the dimensions and the speed, or take more members")
    before = figures
    for figure in given:
        _refuse_impossible(figure, before[figure.key])
    _refuse_contradiction(given, before, only_beyond=SURPRISE)
    wanted = np.log([figure.value for figure in given])
    errors = np.array([figure.standard_error / figure.value for figure in given])
    stream = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(members, STEPS)))
    values = prior
    for _ in range(STEPS if given else 0):
        shown = np.log(np.column_stack([figures[figure.key] for figure in given]))
        values = _moved(values, shown, (wanted, errors), stream)
        values = np.clip(values, draws.lowest, draws.highest)
        figures = run.at(values)
        keep = _showing(figures)
        values, figures = values[keep], _rows(figures, keep)
        if len(values) < LEAST_MEMBERS:
            _refuse_contradiction(given, before)
    for figure in given:
        after = np.log(figures[figure.key])
        off = abs(float(np.median(after)) - math.log(figure.value)) / (figure.standard_error / figure.value)
        if off > SURPRISE:
            _refuse_contradiction(given, before)
    return GuessMembers(draws, prior, values, before, figures)


def _showing(figures: Mapping[str, Array]) -> NDArray[np.bool_]:
    """Members that show every figure, all positive."""
    with np.errstate(invalid="ignore"):
        shown: NDArray[np.bool_] = np.all([values > 0 for values in figures.values()], axis=0)
    return shown


def _rows(figures: Mapping[str, Array], keep: NDArray[np.bool_]) -> dict[str, Array]:
    return {key: values[keep] for key, values in figures.items()}


def _moved(values: Array, shown: Array, wanted: tuple[Array, Array], stream: np.random.Generator) -> Array:
    """The members after a step."""
    target, errors = wanted
    enlarged = STEPS * np.diag(errors**2)
    noise = stream.standard_normal(shown.shape) * math.sqrt(STEPS) * errors
    p, y = values - values.mean(axis=0), shown - shown.mean(axis=0)
    gain = (p.T @ y) @ np.linalg.inv(y.T @ y + (len(values) - 1) * enlarged)
    moved: Array = values + (target + noise - shown) @ gain.T
    return moved


def _refuse_impossible(figure: GivenFigure, prior: Array) -> None:
    logs = np.log(prior)
    spread = math.hypot(float(logs.std()), figure.standard_error / figure.value)
    if abs(math.log(figure.value) - float(logs.mean())) <= SURPRISE * spread:
        return
    low, high = np.quantile(prior, [0.01, 0.99])
    remedy = f"98 % of ships of these dimensions lie between {low:.3g} and {high:.3g}: check the figure and its unit"
    raise ArgumentError(figure.manoeuvre, figure.text, "is not a figure of a ship of these dimensions", remedy)


def _refuse_contradiction(
    given: Sequence[GivenFigure], before: Mapping[str, Array], *, only_beyond: float = 0.0
) -> None:
    """Refuse the figure that the others expect least, by the prior's joint distribution, if it is too far off."""
    if len(given) < 2 and only_beyond:
        return
    logs = np.log(np.column_stack([before[figure.key] for figure in given]))
    errors = np.array([figure.standard_error / figure.value for figure in given])
    wanted = np.log([figure.value for figure in given]) - logs.mean(axis=0)
    covariance = np.atleast_2d(np.cov(logs.T)) + np.diag(errors**2)
    precision = np.linalg.inv(covariance)
    # Conditional on the others: residual (precision @ wanted)_i / precision_ii, variance 1 / precision_ii.
    off = (precision @ wanted) / np.sqrt(np.diag(precision))
    worst = int(np.argmax(np.abs(off)))
    if abs(off[worst]) <= only_beyond:
        return
    centre = float(logs.mean(axis=0)[worst] + wanted[worst] - (precision @ wanted)[worst] / precision[worst, worst])
    half = 2 / math.sqrt(precision[worst, worst])
    figure = given[worst]
    others = " ".join(other.text for other in given if other is not figure)
    remedy = f"with these it lies about between {math.exp(centre - half):.3g} and {math.exp(centre + half):.3g}"
    raise ArgumentError(figure.manoeuvre, figure.text, f"contradicts {others or 'the dimensions'}", remedy)
