"""A ship guessed from dimensions and figures: its card, what the figures settle, and what is predicted.

Members of a prior are moved to manoeuvring figures by an ensemble smoother with multiple data assimilation, Emerick and
Reynolds (2013), Computers & Geosciences 55, 3-15: the members go to the figures in a few steps, each with the errors of
the figures enlarged so that all steps together take each figure once. In each step

    p <- p + C_py (C_yy + a R)^-1 (y + sqrt(a) e - f(p)),   e ~ N(0, R),

with the covariances of the members themselves. Figures are positive, and y and f are their logarithms. For a linear f
and a normal prior the members are then drawn from the posterior.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import tomlkit

from tank2sim.analysis.ensemble.draws import by_file_name, draws_of
from tank2sim.apps.guess.prior import SHIP_OF_MODEL_M, ShipDimensions, prior_card
from tank2sim.arrays import Array
from tank2sim.cards import ManoeuvringCard, parse_card
from tank2sim.dynamics.card_parameters import CardParameter, card_parameters, study_model
from tank2sim.dynamics.ship import mass_faults
from tank2sim.errors import ArgumentError, close_name
from tank2sim.native.compiler import require_compiler
from tank2sim.notices import Notice, caution
from tank2sim.simulation.bands import Band, band_of
from tank2sim.simulation.ensemble import Draws
from tank2sim.simulation.lane_figures import LaneManoeuvres
from tank2sim.simulation.manoeuvres import Turn, Zigzag

TRIAL_ERROR, OVERSHOOT_ERROR_DEG = 0.05, 1.0
"""Standard errors of figures that come without: of a turn's distances relative to themselves, and of an overshoot, deg.
Project choice: what repeated sea trials differ by."""

KEPT_SAMPLES = 500
"""Members that the covariance next to the card keeps as samples. Project choice: a file of half a megabyte."""

_OTHER_UNITS = {
    "m": {"yards": 0.9144, "feet": 0.3048, "cables": 185.2, "nautical miles": 1852.0},
    "deg": {"rad": math.degrees(1.0)},
}
"""Other units of figures, in that of the guess."""

SETTLED = 0.7
"""Ratio of the standard errors of a number with and without the figures below which they settle it. Project choice:
half of its variance is gone."""


@dataclass(frozen=True, kw_only=True)
class GuessedFigure:
    """A manoeuvring figure in its `unit`: as given, with its standard error, and its bands over the ships of these
    dimensions (`by_dimensions`) and over the ships found."""

    unit: str
    given: float | None
    standard_error: float | None
    by_dimensions: Band
    found: Band


@dataclass(frozen=True, kw_only=True)
class GuessedNumber:
    """A number of the card: mean and standard error over the ships of these dimensions, and over the ships found.

    It is `settled` where the standard error falls below :data:`SETTLED` of the former one.
    """

    by_dimensions: float
    by_dimensions_standard_error: float
    value: float
    standard_error: float
    settled: bool


@dataclass(frozen=True, eq=False, kw_only=True)
class GuessStudy:
    """A guessed ship.

    Parameters
    ----------
    ship : str
        Its name.
    dimensions : dict
        Fields of :class:`.ShipDimensions`.
    members, seed : int
        Ships drawn, and the seed of the draws.
    figures : dict
        Key of :data:`.FIGURE_KEYS` to what is known of the figure.
    parameters : dict
        Name on the card to what is known of the number, prime.
    next_figures : dict
        Figures not given, to the mean share of the variance of all figures not given that each would take away; the
        most helpful first.
    """

    ship: str
    dimensions: dict[str, float]
    members: int
    seed: int
    figures: dict[str, GuessedFigure]
    parameters: dict[str, GuessedNumber]
    next_figures: dict[str, float]
    notices: tuple[Notice, ...]


def default_error(name: str, value: float) -> float:
    """Standard error of a figure (``advance_m``) that comes without."""
    return OVERSHOOT_ERROR_DEG if name.startswith("overshoot") else TRIAL_ERROR * value


def parse_figures(manoeuvre: str, text: str) -> list[GivenFigure]:
    """Figures of an option: ``advance_m=970 tactical_diameter_m=980+-30``, the standard error after ``+-``.

    InputError if the manoeuvre has no figure of a name, a name is given twice, or a number is not positive.
    """
    names, found = FIGURES[manoeuvre], {}
    for part in text.split():
        name, _, number = part.partition("=")
        matched = re.fullmatch(r"(\d+(?:\.\d*)?|\.\d+)(?:(?:\+-|±)(\d+(?:\.\d*)?|\.\d+))?", number)
        if name not in names:
            raise ArgumentError(manoeuvre, part, "is not a figure of this manoeuvre", close_name(name, names))
        if matched is None:
            raise ArgumentError(manoeuvre, part, "cannot be read", f"give {name}=..., with +-ERROR if known")
        if name in found:
            raise ArgumentError(manoeuvre, part, "is given twice", "give each figure once")
        value = float(matched[1])
        error = default_error(name, value) if matched[2] is None else float(matched[2])
        if value <= 0 or error <= 0:
            raise ArgumentError(manoeuvre, part, "is not positive", "figures and their standard errors are above zero")
        found[name] = GivenFigure(manoeuvre, name, value, error)
    return list(found.values())


def guess_ship(
    ship: ShipDimensions, given: Sequence[GivenFigure], name: str, members: int, seed: int
) -> tuple[GuessStudy, ManoeuvringCard]:
    """A ship from its dimensions and figures: the study, and the card `name`, which has a covariance with samples.

    Raises as :func:`conditioned`, whose `members` and `seed` these are.
    """
    prior = prior_card(ship, name)
    found = conditioned(prior, given, members, seed)
    return study_members(ship, name, given, found, members, seed), _card_of(prior, found)


def study_members(
    ship: ShipDimensions, name: str, given: Sequence[GivenFigure], found: GuessMembers, members: int, seed: int
) -> GuessStudy:
    """The study of members that were found; `members` were drawn. Other arguments as of :func:`guess_ship`."""
    by_key = {figure.key: figure for figure in given}
    figures = {
        key: GuessedFigure(
            unit=FIGURE_KEYS[key][1].rpartition("_")[2],
            given=by_key[key].value if key in by_key else None,
            standard_error=by_key[key].standard_error if key in by_key else None,
            by_dimensions=band_of(before),
            found=band_of(found.after[key]),
        )
        for key, before in found.before.items()
    }
    return GuessStudy(
        ship=name,
        dimensions=vars(ship),
        members=members,
        seed=seed,
        figures=figures,
        parameters=_parameters(found),
        next_figures=_next_figures(found, by_key),
        notices=(*_of_model(ship), *_outside(figures), *_notices(given, members, members - len(found.prior))),
    )


def _parameters(found: GuessMembers) -> dict[str, GuessedNumber]:
    numbers = {}
    for name, before, after in zip(found.draws.names, found.prior.T, found.posterior.T, strict=True):
        prior_error, error = float(before.std()), float(after.std())
        numbers[name.removeprefix("derivatives.")] = GuessedNumber(
            by_dimensions=float(before.mean()),
            by_dimensions_standard_error=prior_error,
            value=float(after.mean()),
            standard_error=error,
            settled=error < SETTLED * prior_error,
        )
    return numbers


def _next_figures(found: GuessMembers, given: Mapping[str, GivenFigure]) -> dict[str, float]:
    """:attr:`GuessStudy.next_figures`: by the covariance of the logarithms, each figure with its usual error."""
    logs = {key: np.log(values) for key, values in found.after.items() if key not in given}
    gains = {}
    for key, values in logs.items():
        median = float(np.median(found.after[key]))
        error = default_error(FIGURE_KEYS[key][1], median) / median
        variance = float(values.var()) + error**2
        shares = [float(np.cov(values, other)[0, 1] ** 2 / variance / other.var()) for other in logs.values()]
        gains[key] = float(np.mean(shares))
    return dict(sorted(gains.items(), key=lambda item: -item[1]))


def _outside(figures: Mapping[str, GuessedFigure]) -> Iterator[Notice]:
    """Figures outside what nine of ten ships of these dimensions show, or the guess, by more than their errors."""
    for key, figure in figures.items():
        if figure.given is None or figure.standard_error is None:
            continue
        value, error, unit = figure.given, figure.standard_error, figure.unit
        before, after = figure.by_dimensions, figure.found
        if all(band.p5 - error <= value <= band.p95 + error for band in (before, after)):
            continue
        units = [
            f"if that is in {name}: {value * factor:.4g} {unit}"
            for name, factor in _OTHER_UNITS[unit].items()
            if before.p5 <= value * factor <= before.p95
        ]
        yield (
            caution(
                f"{key} is {value:g} {unit}, and nine of ten ships of these dimensions and speed "
                f"have {before.p5:.4g} to {before.p95:.4g} (the guess {after.p5:.4g} to {after.p95:.4g})"
                f"{'; ' + ', '.join(units) if units else '; check it, the dimensions and the speed'}."
            )
        )


def _of_model(ship: ShipDimensions) -> Iterator[Notice]:
    """The scale effects and the gear that are assumed of a model."""
    if ship.scale == 1.0:
        return
    yield caution(
        f"{ship.length_m:g} m is the length of a model: the formulas were made for ships, whose friction, wake and "
        "loading of the propeller a model does not have; the rudder turns as fast as the gear of a ship of "
        f"{SHIP_OF_MODEL_M:g} m does by Froude's law, in fresh water. State the gear on the card if it is another"
    )


def _notices(given: Sequence[GivenFigure], members: int, lost: int) -> Iterator[Notice]:
    """Limits of every guess, ships that were left out, and standard errors that were assumed."""
    yield Notice(
        "a guess: the model (third order, cross-flow drag, rudder in the slipstream), deep and calm water, and "
        "figures of one loading are taken for granted"
    )
    yield Notice(
        "rudder, surge and third-order terms have no published regression here: their prior is about what three "
        "ships have"
    )
    if lost:
        yield Notice(f"{lost} of {members} ships of these dimensions do not come round and were left out")
    if any(figure.standard_error == default_error(figure.name, figure.value) for figure in given):
        yield Notice(
            f"standard errors of figures given without: {100 * TRIAL_ERROR:g} % of distances, "
            f"{OVERSHOOT_ERROR_DEG:g} deg of overshoots"
        )


def _card_of(prior: ManoeuvringCard, found: GuessMembers) -> ManoeuvringCard:
    """The prior card with means, standard errors and covariance of the members."""
    document = tomlkit.parse(prior.text)
    keys = {parameter.name: parameter for parameter in card_parameters(prior, study_model(prior))}
    chosen: list[CardParameter] = [keys[name] for name in found.draws.names]
    matrix: Array = np.cov(found.posterior.T)
    for parameter, mean, variance in zip(chosen, found.posterior.mean(axis=0), np.diag(matrix), strict=True):
        section, *rest = parameter.key.split(".")
        at: Any = document[section]
        errors: Any = document["uncertainty"]
        if section == "effects":
            effect = at[int(rest[0])]
            at, errors, rest = effect["parameters"], effect["uncertainty"], rest[2:]
        comment = at[rest[0]].trivia.comment
        at[rest[0]] = float(f"{mean * parameter.factor:.6g}")
        errors[rest[0]] = float(f"{math.sqrt(variance) * abs(parameter.factor):.5g}")
        if comment:
            at[rest[0]].comment(comment.removeprefix("#").strip())
    card = parse_card(tomlkit.dumps(document), prior.source)
    assert isinstance(card, ManoeuvringCard)
    samples = found.posterior[:KEPT_SAMPLES]
    return replace(card, covariance=by_file_name(card, found.draws.names, matrix, samples))


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
    """Members (n, k) of the parameters of the prior `draws`, before and after, and their figures (n,) by key."""

    draws: Draws
    prior: Array
    posterior: Array
    before: Mapping[str, Array]
    after: Mapping[str, Array]


class PosterFigures:
    """Figures of the ships of a card by their parameters, in lanes; InputError if there is no C compiler."""

    def __init__(self, card: ManoeuvringCard, names: Sequence[str]):
        require_compiler("guessing a ship by thousands of simulations")
        self._model = study_model(card)
        self._lanes = LaneManoeuvres(self._model, longest=_LONGEST)
        self._places = [self._model.parameter_names.index(name) for name in names]

    def at(self, values: Array) -> dict[str, Array]:
        """Figures (n,) by key of ships with parameters `values` (n, k); nan where a ship does not show one."""
        p = np.tile(self._model.parameter_values(), (len(values), 1))
        p[:, self._places] = values
        faults = mass_faults(self._model, p)
        bad = np.array([bool(fault) for fault in faults])
        found = {}
        for name, manoeuvre in POSTER_MANOEUVRES.items():
            runs = self._lanes.run(manoeuvre, p).figures
            for figure in FIGURES[name]:
                shown = runs.get(figure, np.full(len(values), np.nan))
                found[_KEYS[name, figure]] = np.where(bad, np.nan, shown)
        return found


def conditioned(card: ManoeuvringCard, given: Sequence[GivenFigure], members: int, seed: int) -> GuessMembers:
    """Ships of a prior card (`members` drawn with `seed`), moved to the given figures.

    Raises
    ------
    InputError
        A figure is one that no ship of these dimensions shows, or contradicts the others; there is no C compiler; or
        hardly a ship of the prior shows the figures at all.
    """
    draws, _ = draws_of(card, seed)
    run = PosterFigures(card, draws.names)
    first = np.array([list(draws.member(number).values()) for number in range(members)])

    def showing(values: Array) -> tuple[Array, dict[str, Array]]:
        """Members that show every figure, all positive, and their figures."""
        figures = run.at(values)
        with np.errstate(invalid="ignore"):
            keep = np.all([each > 0 for each in figures.values()], axis=0)
        return values[keep], {key: each[keep] for key, each in figures.items()}

    prior, before = showing(first)
    if len(prior) < LEAST_MEMBERS:
        problem = f"only {len(prior)} of {members} ships of these dimensions come round in all manoeuvres"
        raise ArgumentError("length_m", "", problem, "check the dimensions and the speed, or take more members")
    for figure in given:
        _refuse_impossible(figure, before[figure.key])
    _refuse_contradiction(given, before, only_beyond=SURPRISE)
    wanted = np.log([figure.value for figure in given])
    errors = np.array([figure.standard_error / figure.value for figure in given])
    stream = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(members, STEPS)))
    values, figures = prior, before
    for _ in range(STEPS if given else 0):
        shown = np.log(np.column_stack([figures[figure.key] for figure in given]))
        values = _moved(values, shown, (wanted, errors), stream)
        values, figures = showing(np.clip(values, draws.lowest, draws.highest))
        if len(values) < LEAST_MEMBERS:
            _refuse_contradiction(given, before)
    for figure in given:
        after = np.log(figures[figure.key])
        off = abs(float(np.median(after)) - math.log(figure.value)) / (figure.standard_error / figure.value)
        if off > SURPRISE:
            _refuse_contradiction(given, before)
    return GuessMembers(draws, prior, values, before, figures)


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
