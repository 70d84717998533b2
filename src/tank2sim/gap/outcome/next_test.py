"""The manoeuvre that would best decide between explanations, from simulations of each and their uncertainty."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from tank2sim.arrays import Array
from tank2sim.cards.card import MmgCard, SteeredCard
from tank2sim.dynamics.build import build
from tank2sim.dynamics.effects import EFFECTS
from tank2sim.dynamics.effects.effect import MEASURED_BEFOREHAND
from tank2sim.dynamics.mmg.equivalent import linear_equivalent
from tank2sim.dynamics.model import Input, Model, Parameter
from tank2sim.gap.inference.prior import CLOCK_SHARE, PRICE
from tank2sim.gap.outcome.next_test_candidates import (
    REVOLUTIONS,
    RUDDER,
    Candidate,
    after_approach,
    candidate_manoeuvres,
    on_heading,
    orders_csv,
)
from tank2sim.gap.proof.open_loop import COARSEST, INSTANTS, delays_of, shown_by
from tank2sim.gap.result import NextTest
from tank2sim.identification.trials.problem.estimation_problem import driven_model
from tank2sim.simulation.motion_record import OBSERVED_SIGNALS, means_of_held
from tank2sim.simulation.rows import RowFunction
from tank2sim.simulation.scheme import runge_kutta_step

LENGTH = 24.0
"""Length of a test, L/u0: a turn with 35 deg goes round once and a half, a zigzag reverses four times (project
choice)."""

AS_GOOD = 0.9
"""The first listed manoeuvre with this share of the best score is chosen: standard ones are listed first (project
choice)."""

READ_S = 1.0
"""Readings are compared this far apart, s; the errors of nearer ones are taken as equal (project choice)."""

_WINDOW = 3.0
"""Length of a window, L/u0 (project choice): the slowest transients of a hull are in it, and a gust that lasts is as
good as constant."""

GUSTS = math.radians(0.25)
"""Unmodelled disturbances (wind, waves) are as strong as this rudder angle, rad (project choice)."""

FREE = 0.1
"""The first motion of a window is known to this share of nominal values beforehand: practically unknown (project
choice)."""

TO_FEEL = 0.1
"""Differences by a parameter are taken over this share of its standard deviation."""

_LATE = "late"
"""Among changes of variables: the rudder's orders act a step later."""

_ROUNDED = 1
"""Decimals of an order in degrees: as fine as a helmsman can give it."""


@dataclass(frozen=True, eq=False)
class Explanation:
    """A possible explanation."""

    name: str  # For people: the effect, or ``none``
    card: SteeredCard  # With the effect at its most probable parameters; for ``none`` the card as it is
    # The k names of the model's parameters and inputs that are not known exactly: the effect's, and derivatives.
    free: tuple[str, ...]
    covariance: Array  # (k, k): Their covariance, SI (derivatives prime); may be singular


@dataclass(frozen=True, eq=False)
class WindowPrediction:
    """Prediction of one explanation for c manoeuvres in w windows each, in noise units."""

    readings: Array  # (c, w, m): The m readings of each window
    # (c, w, m, k): By the unknowns of the explanation, each column per standard deviation; the last is the clock of the
    # orders, where that is unknown.
    slopes: Array
    # (c, w, m, j): By the unknowns of the window: the instants of its orders, where these are unknown; its first state,
    # and disturbances.
    passing: Array

    def with_known_instants(self) -> WindowPrediction:
        """The same without the clock of the orders and their instants, which are among the unknowns here."""
        return replace(self, slopes=self.slopes[..., :-1], passing=self.passing[..., 1:])


def next_test(
    explanations: Sequence[Explanation],
    noise: Mapping[str, float],
    duration_s: float | None = None,
    correlation_s: float = 0.0,
    unsure_s: float = 0.0,
) -> NextTest | None:
    """The manoeuvre by which the first explanation is distinguished best from all the others.

    A manoeuvre's score is the loss of the wrong explanation that is to be expected, the mean over which of the two is
    true, against the rival that it distinguishes worst: ``d' (I - J (J'J + P^-1)^-1 J') d``, d the difference of both
    predictions in noise units, J its derivatives by all that the wrong one could still be: its parameters and its
    card's coefficients within their covariance P. Both predict windows of :data:`_WINDOW` L/u0 from the motion of the
    first explanation, each with a first state and constant disturbances, which absorb a part of the difference: at
    sea, too, it shows in the next motion and not in the accumulated one.

    Parameters
    ----------
    explanations : sequence of Explanation
        Two or more; zigzags are steered with the first.
    noise : mapping
        Variable (``motion.*``) to the standard deviation of one reading, SI: the signals of the test's sensors.
    duration_s : float, optional
        Duration of the test; by default :data:`LENGTH` L/u0.
    correlation_s : float
        Time constant of the readings' errors: one independent reading every 2 of it (or :data:`READ_S`, if longer).
    unsure_s : float
        Time from one reading of the rudder's order to the next, s: an order acts at an unknown instant between them. 0
        where its instants are known.

    Returns
    -------
    NextTest, or None if there is only one explanation, or the ship exceeds all bounds in every manoeuvre.
    """
    if len(explanations) < 2:
        return None
    ships = _ships(explanations, noise, correlation_s, unsure_s)
    length = LENGTH if duration_s is None else duration_s / ships[0].ship_time
    of = [after_approach(candidate) for candidate in candidate_manoeuvres(explanations[0].card, length)]
    of = _with_headings(of, explanations)
    orders, motion = ships[0].sail(of, length)
    predictions = [ship.predict(of, orders, motion) for ship in ships]
    each = _from_rivals(predictions)
    needs_instants = False
    if unsure_s and not _decides(each):
        known = _from_rivals([prediction.with_known_instants() for prediction in predictions])
        needs_instants, each = _decides(known), known if _decides(known) else each
    if not np.isfinite(scores := each.min(axis=0)).any():
        return None
    best, least = _best_and_least(scores)
    names = [explanation.name for explanation in explanations]
    why = _why(of[best], names, each[:, best], (float(scores[least]), of[least]))
    if needs_instants:
        why += (
            f" This holds for known instants of the orders; read every {unsure_s:.2g} s, they decide in no manoeuvre: "
            "record the order ten times as often, or the rudder's angle."
        )
    named = zip((candidate.name for candidate in of), map(float, scores), strict=True)
    return NextTest(
        manoeuvre=of[best].manoeuvre or "file:next_test.csv",
        orders=orders_csv(ships[0].step_s, {name: values[best] for name, values in orders.items()}, why),
        heading_rad=of[best].heading,
        needs_instants=needs_instants,
        why=why,
        expected={name: score for name, score in named if math.isfinite(score)},
        sizes=_sizes(explanations),
    )


def _ships(
    explanations: Sequence[Explanation], noise: Mapping[str, float], correlation_s: float, unsure_s: float
) -> list[SailedShip]:
    """The ship of each explanation, with the available sensors that all models have."""
    models = [driven_model(explanation.card, "order") for explanation in explanations]
    seen = {
        name: noise[name]
        for name in OBSERVED_SIGNALS.values()
        if name in noise and all(name in model for model in models)
    }
    return [SailedShip(explanation, seen, correlation_s, unsure_s) for explanation in explanations]


def _from_rivals(predictions: Sequence[WindowPrediction]) -> Array:
    """Expected loss (rivals, c) between the first prediction and each of the others."""
    first, *rivals = predictions
    return np.stack([_expected_loss(first, rival) for rival in rivals])


def _decides(each: Array) -> bool:
    """True if a manoeuvre distinguishes the first explanation from every other (rivals, c)."""
    return bool((each.min(axis=0) >= PRICE).any())


def _best_and_least(scores: Array) -> tuple[int, int]:
    """Indices of the first manoeuvre that is as good as the best, and of the least informative."""
    good = np.nan_to_num(scores) >= AS_GOOD * np.nanmax(scores)
    return int(np.argmax(good)), int(np.nanargmin(scores))


def _sizes(explanations: Sequence[Explanation]) -> dict[str, tuple[Mapping[str, float], Mapping[str, float]]]:
    """Each effect to its parameters and standard errors; effects of all explanations were on the card before."""
    had = [
        entry
        for entry in explanations[0].card.effects
        if all(entry in explanation.card.effects for explanation in explanations)
    ]
    entries = [entry for explanation in explanations for entry in explanation.card.effects if entry not in had]
    return {entry.name: (entry.parameters, entry.uncertainty) for entry in reversed(entries)}


def _expected_loss(first: WindowPrediction, second: WindowPrediction) -> Array:
    """Expected loss of the wrong one of two explanations in each manoeuvre (c,); nan where a motion left all bounds."""
    difference = first.readings - second.readings
    return 0.5 * (_unabsorbed(difference, second) + _unabsorbed(difference, first))


def _unabsorbed(difference: Array, wrong: WindowPrediction) -> Array:
    """Loss by a difference (c, w, m) that the wrong explanation cannot absorb; unknowns have unit prior variance."""
    known = np.isfinite(difference).all(axis=(1, 2)) & np.isfinite(wrong.slopes).all(axis=(1, 2, 3))
    losses = np.full(len(difference), np.nan)
    columns = np.concatenate([wrong.slopes, difference[..., None]], axis=3)
    G = _without_passing(wrong.passing[known], columns[known])
    J, mixed = G[:, :-1, :-1] + np.eye(G.shape[1] - 1), G[:, :-1, -1:]
    losses[known] = G[:, -1, -1] - (mixed.swapaxes(1, 2) @ np.linalg.solve(J, mixed))[:, 0, 0]
    positive: Array = np.maximum(losses, 0.0)
    return positive


def _without_passing(passing: Array, columns: Array) -> Array:
    """Products (c, k, k) of columns (c, w, m, k) without the unknowns of each window, summed over the windows."""
    pull = passing.swapaxes(2, 3) @ columns
    inner = passing.swapaxes(2, 3) @ passing + np.eye(passing.shape[3])
    found: Array = (columns.swapaxes(2, 3) @ columns - pull.swapaxes(2, 3) @ np.linalg.solve(inner, pull)).sum(axis=1)
    return found


def _with_headings(of: Sequence[Candidate], explanations: Sequence[Explanation]) -> list[Candidate]:
    """Add manoeuvres on a constant heading for another heading, where an explanation has a direction."""
    entries = [entry for explanation in explanations for entry in explanation.card.effects]
    directed = any(key.startswith("direction") for entry in entries for key in entry.parameters)
    return [*of, *(on_heading(candidate, math.pi / 2) for candidate in of if directed and candidate.on_course)]


def _why(best: Candidate, names: Sequence[str], each: Array, least: tuple[float, Candidate]) -> str:
    """Reason for a manoeuvre: the root of a score is a difference in standard deviations of the noise."""
    first, *rivals = ("the card alone" if name == "none" else name.replace("_", " ") for name in names)
    apart = " and ".join(f"{math.sqrt(score):.2g} from {name}" for score, name in zip(each, rivals, strict=True))
    if min(each) < PRICE:
        text = f"No manoeuvre considered would distinguish {first} for sure; nearest is {best.name}."
    else:
        text = f"The explanations are distinguished best by {best.name}."
    little = math.sqrt(max(least[0], 0.0))
    text += (
        f" There the prediction by {first} differs by {apart}; {math.sqrt(PRICE):.2g} would decide. The unit is the "
        "standard deviation of the noise of all readings together, beyond the uncertainty of the parameters. The least "
        f"informative manoeuvre, {least[1].name}, would give {f'{little:.2g}' if little > 0.01 else 'less than 0.01'}."
    )
    if best.heading:
        text += f" Begin on heading {math.degrees(best.heading):.0f} deg (initial.psi), which orders cannot state."
    return text


class SailedShip:
    """An explanation ready to be sailed, many motions side by side.

    Parameters
    ----------
    explanation : Explanation
    seen : mapping
        Variable (``motion.*``) to the standard deviation of one reading, SI.
    correlation_s : float
        Time constant of the readings' errors.
    unsure_s : float
        Time from one reading of the rudder's order to the next, s; 0 where the instants of orders are known.
    """

    def __init__(
        self, explanation: Explanation, seen: Mapping[str, float], correlation_s: float, unsure_s: float = 0.0
    ):
        self.card, self.free = explanation.card, explanation.free
        self.model = driven_model(explanation.card, "order")
        self.names = self.model.parameter_names
        self._step = RowFunction(runge_kutta_step(self.model))
        self._shown = shown_by(self.model, tuple(seen))
        self.p = self.model.parameter_values()
        known = dict(zip(self.names, self.p, strict=True))
        self.ship_time = known["ship.length"] / known["ship.speed"]
        self.step_s = float(f"{self.ship_time / INSTANTS:.1g}")  # a round number of seconds in the file of orders
        self.every = max(1, round(READ_S / self.step_s))
        self.sigma = np.array(list(seen.values()))
        self.sigma *= math.sqrt(max(1.0, 2 * correlation_s / (self.every * self.step_s)))
        self._motion = [self.model.state_names.index(name) for name in MEASURED_BEFOREHAND]
        self.axes = _independent(explanation.covariance) if self.free else np.zeros((0, 0))
        self.unsure_s = unsure_s

    def sail(self, of: Sequence[Candidate], length: float) -> tuple[dict[str, Array], Array]:
        """The helmsmen's orders by input (c, n) each, and the resulting motion (c, n, 6), as MEASURED_BEFOREHAND."""
        window = round(_WINDOW * self.ship_time / self.step_s)
        n = window * max(1, round(length / _WINDOW))
        time = np.arange(n) * self.step_s / self.ship_time
        inputs = np.tile(self.model.input_values(), (len(of), n, 1))
        names, (psi, r) = self.model.input_names, (self.model.state_names.index(name) for name in _STEERED)
        ordered = [RUDDER]
        if self.card.propulsion is not None:
            ordered.append(REVOLUTIONS)
            shares = np.array([[candidate.revolutions(t) for t in time] for candidate in of])
            inputs[:, :, names.index(REVOLUTIONS)] *= shares
        headings, helmsmen = np.array([candidate.heading for candidate in of]), [each.helmsman() for each in of]
        motion = np.empty((len(of), n, len(self._motion)))
        x = self._starts(headings)
        for row in range(n):
            seen = zip(helmsmen, x[:, psi] - headings, x[:, r] * self.ship_time, strict=True)
            orders = [steer(time[row], heading, rate) for steer, heading, rate in seen]
            inputs[:, row, names.index(RUDDER)] = np.radians(np.round(np.degrees(orders), _ROUNDED))
            motion[:, row] = x[:, self._motion]
            x = self._after(x, inputs[:, row], self.p)
        return {name: inputs[:, :, names.index(name)] for name in ordered}, motion

    def predict(self, of: Sequence[Candidate], orders: Mapping[str, Array], motion: Array) -> WindowPrediction:
        """Readings in windows that begin with the motion (c, n, 6) of another explanation, under its orders."""
        c, n, _ = motion.shape
        inputs = np.tile(self.model.input_values(), (c, n, 1))
        for name, values in orders.items():
            inputs[:, :, self.model.input_names.index(name)] = values
        window = round(_WINDOW * self.ship_time / self.step_s)
        begins = self._begins(of, inputs, motion)[:, ::window]
        changes, shares, first = self._variations()
        rows, w = len(changes), n // window
        acting = np.stack([self._acting(inputs, change) for change in changes]).reshape(rows * c * w, window, -1)
        p = np.repeat(self.p + np.stack([self._of_parameters(change) for change in changes]), c * w, axis=0)
        x = (begins[None] + first[:, None, None]).reshape(rows * c * w, -1)
        readings = []
        for row in range(window):
            if row % self.every == 0:
                readings.append(self._shown(x, acting[:, row], p)[0] / self.sigma)
            x = self._after(x, acting[:, row], p)
        seen = np.stack(readings, axis=1).reshape(rows, c, w, -1)
        slopes = np.moveaxis((seen[1:] - seen[0]) / shares[1:, None, None, None], 0, -1)
        unknown = self.axes.shape[1] + (self.unsure_s > 0)
        return WindowPrediction(seen[0], slopes[..., :unknown], slopes[..., unknown:])

    def information(self, of: Sequence[Candidate], length: float) -> tuple[dict[str, Array], Array]:
        """The helmsmen's orders, and what each manoeuvre of a length (L/u0) shows of the unknowns.

        Returns
        -------
        orders : mapping
            Input to its orders (c, n), each held :attr:`step_s`.
        information : array (c, k, k)
            Fisher information about the columns of :attr:`axes`, the unknowns in units of their spread beforehand,
            with the first state and constant disturbances of every window unknown; nan for a motion that left all
            bounds.
        """
        orders, motion = self.sail(of, length)
        found = self.predict(of, orders, motion)
        information = np.full((len(of), *2 * found.slopes.shape[-1:]), np.nan)
        known = np.isfinite(found.slopes).all(axis=(1, 2, 3))
        information[known] = _without_passing(found.passing[known], found.slopes[known])
        return orders, information

    def _after(self, x: Array, inputs: Array, p: Array) -> Array:
        """States (rows, nx) a step later."""
        parts = max(1, math.ceil(self.step_s / (COARSEST * self.model.step_s) - 1e-9))
        for _ in range(parts):
            x = self._step(x, inputs, p, np.array([self.step_s / parts]))[0]
        return x

    def _starts(self, headings: Array) -> Array:
        place = self.names.index("initial.psi")
        p = np.tile(self.p, (len(headings), 1))
        p[:, place] = headings
        return np.stack([np.array(self.model.initial(row)).ravel() for row in p])

    def _begins(self, of: Sequence[Candidate], inputs: Array, motion: Array) -> Array:
        """States (c, n, nx): the given motion, and the rudder, heel and further states of this explanation."""
        x = self._starts(np.array([candidate.heading for candidate in of]))
        acting = self._acting(inputs, {})
        states = np.empty((*motion.shape[:2], len(self.model.states)))
        for row in range(motion.shape[1]):
            x[:, self._motion] = motion[:, row]
            states[:, row] = x
            x = self._after(x, acting[:, row], self.p)
        return states

    def _variations(self) -> tuple[list[dict[str, float]], Array, Array]:
        """Changes of variables (in standard deviations) and of the first state (rows, nx); none in the first row."""
        changes: list[dict[str, float]] = [{}]
        shares, first = [1.0], [np.zeros(len(self.model.states))]
        for axis in self.axes.T:
            change = dict(zip(self.free, TO_FEEL * axis, strict=True))
            side = 1.0 if self._inside(change, 1.0) or not self._inside(change, -1.0) else -1.0
            changes.append({name: side * value for name, value in change.items()})
            shares.append(side * TO_FEEL)
            first.append(first[0])
        clock, one = CLOCK_SHARE * self.unsure_s, self.unsure_s / math.sqrt(12.0)  # of all orders, of a window's
        for spread in (clock, one) if self.unsure_s else ():
            changes.append({_LATE: self.step_s})
            shares.append(self.step_s / spread)
            first.append(first[0])
        for place in self._motion:
            changes.append({})
            shares.append(TO_FEEL)
            first.append(np.zeros(len(self.model.states)))
            first[-1][place] = TO_FEEL * FREE * self.model.states[place].nominal
        for name, size in _disturbances(self.card).items():
            if name in self.model:
                changes.append({name: TO_FEEL * size})
                shares.append(TO_FEEL)
                first.append(first[0])
        return changes, np.array(shares), np.stack(first)

    def _acting(self, inputs: Array, change: Mapping[str, float]) -> Array:
        """Inputs (c, n, nu) as they act on the ship: with the changes, and late where an effect delays."""
        acting = inputs.copy()
        for name, value in change.items():
            if name in self.model.input_names:
                acting[:, :, self.model.input_names.index(name)] += value
        if _LATE in change:
            place = self.model.input_names.index(RUDDER)
            acting[:, :, place] = np.concatenate([acting[:, :1, place], acting[:, :-1, place]], axis=1)
        p = self.p + self._of_parameters(change)
        if not any(EFFECTS[entry.name].delays for entry in self.card.effects):
            return acting
        return np.stack([_delayed(self.card, self.model, rows, self.step_s, p) for rows in acting])

    def _of_parameters(self, change: Mapping[str, float]) -> Array:
        return np.array([change.get(name, 0.0) for name in self.names])

    def _inside(self, change: Mapping[str, float], side: float) -> bool:
        """Whether all variables stay within their bounds."""
        for name, size in change.items():
            variable = self.model[name]
            assert isinstance(variable, Parameter | Input)
            low, high = variable.minimum, variable.maximum
            value = variable.start + side * size
            if (low is not None and value < low) or (high is not None and value > high):
                return False
        return True


_STEERED = ("motion.psi", "motion.r")


def _disturbances(card: SteeredCard) -> dict[str, float]:
    """Standard deviations (prime) of constant forces in a window: the forces of :data:`GUSTS` of rudder."""
    known = linear_equivalent(card, build(card), "plus") if isinstance(card, MmgCard) else card.derivatives
    sway, yaw = (GUSTS * abs(known.get(name, 0.0)) for name in ("Yd", "Nd"))
    sizes = {"derivatives.X0": sway, "derivatives.Y0": sway, "derivatives.N0": yaw}
    return {name: size for name, size in sizes.items() if size > 0}


def _independent(covariance: Array) -> Array:
    """Columns (k, m) whose sum of squares is the covariance: its independent unknowns with a spread above zero."""
    deviations = np.sqrt(np.diag(covariance))
    scale = np.where(deviations > 0, deviations, 1.0)
    spread, axes = np.linalg.eigh(covariance / np.outer(scale, scale))
    kept = spread > 1e-9
    columns: Array = scale[:, None] * axes[:, kept] * np.sqrt(spread[kept])
    return columns


def _delayed(card: SteeredCard, model: Model, inputs: Array, step_s: float, p: Array) -> Array:
    """Inputs (n, nu), each row held for `step_s`, with the delays of the card's effects at parameters `p`."""
    late = inputs.copy()
    edges = step_s * np.arange(len(inputs) + 1, dtype=float)
    for name, delay in delays_of(card, model, p).items():
        column = model.input_names.index(name)
        late[:, column] = means_of_held(edges[:-1], inputs[:, column], edges - delay)
    return late
