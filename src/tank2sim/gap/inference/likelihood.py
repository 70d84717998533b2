"""The score of an explanation: how likely the measurements are if it holds, whatever the noise and the coefficients.

    T = sum(log det S) + |e|^2 + c'c + log det(I + Jc'Jc) + k log(n/20) + what is known of noise and shapes

e are the innovations of :mod:`.observer` in units of their standard deviation, linear in the k parameters of the
effects and in the coefficients of the card, c in units of their standard error beforehand; Jc are their columns. The
coefficients are integrated out, the noise is estimated again for each explanation, "none" as well: else a rival that
adapts the noise would win without an effect. T is -2 log of the likelihood; of two explanations the one with the
smaller T holds, by more than chance if T differs by some 10.
"""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import cho_factor, cho_solve
from scipy.optimize import minimize

from tank2sim.arrays import Array
from tank2sim.gap.inference.batch import MeasuredBatch
from tank2sim.gap.inference.fit import Belief, ExplanationFit, FilterColumns, NuisanceParameters
from tank2sim.gap.inference.form_error import Forms
from tank2sim.gap.inference.hypothesis import Hypothesis
from tank2sim.gap.inference.kalman_filter import FORCE_STATES, Linear, Observer, linear_filter, observer, slopes

COUNTED = 20.0
"""Measurements that are worth one independent one in the price of a parameter, k log(n/20): noise has colour."""

WIDE_PRIOR = 10.0
"""Error of the smoothed motion at the beginning of a run, in its noise: wide, so that no initial state is assumed."""

LARGEST_FORM, IMPOSSIBLE = 3.5, 1000.0
"""Standard deviations by which a form may differ, and what each beyond costs (project choice): a force that is all
but taken back by its form is none, and its slope is then that of another force."""

BY_FORMULA = (6, 4)
"""Iterations on the noise, for parameters by the formula alone: the noise must first cover what the formula lacks."""

REMEMBERED = 100
"""Residuals that are kept: a search asks for the same ones again and again."""

LEAST_TOLD = 0.02
"""A combination of coefficients whose variance the trials would lessen by less than this share is left out while the
noise is sought (project choice); the score is of all."""

LEAST_GAIN = 0.1
"""Gauss-Newton stops where the next step promises less of the score than this."""

WIDTHS = (0.02, 2.5)
"""Factor on the standard errors of the card's coefficients: 2 % where a card states none, and hardly above 5 %."""


class Likelihood:
    """Scores explanations of one set of trials.

    Parameters
    ----------
    motion : MeasuredBatch
        Of the trials, side by side.
    none : Hypothesis
        The card without an effect.
    coefficients : NuisanceParameters
    belief : Belief
        Of the noise and of the coefficients' width.
    """

    def __init__(self, motion: MeasuredBatch, none: Hypothesis, coefficients: NuisanceParameters, belief: Belief):
        self.motion, self.none, self.coefficients, self.belief = motion, none, coefficients, belief
        self._residuals: dict[tuple[tuple[str, ...], bytes], tuple[Array, Array]] = {}
        nothing = np.zeros(0)
        self._own = none.own_states(motion, nothing)
        self._block_rates = none.rates(motion, nothing, self._own)
        self._inside = motion.inside[:, 1:, None].astype(float)
        changes = np.diff(motion.middles, axis=1)
        self._lack = (motion.block_s * none.fine_rates(motion, nothing) - changes) * self._inside
        self._shown = motion.measured - none.readings(motion, nothing, self._own)
        self._forms: Forms | None = Forms(motion, none.model.input_names.index("rudder.command"))
        self.known = ~np.isnan(motion.measured) & motion.inside[..., None]
        self.count = int(self.known.sum())
        self.wide = WIDE_PRIOR * motion.errors if belief.wide is None else belief.wide
        self.base = self.linear(none, nothing)
        self.coefficient_columns = self.of_coefficients(none, nothing)

    def linear(self, explained: Hypothesis, theta: Array) -> Linear:
        """The filter's motion for an explanation: its own slopes, for forces and slopes must be of one model.

        The measured motion holds the noise itself. A force of it is no known input: only with the slope that belongs to
        it is the likelihood that of the measurements, whatever motion it is linear about.
        """
        by_state, reading = explained.slopes(self.motion, theta)
        by_state = by_state * self._inside[..., None]  # nothing moves where there is no run
        return linear_filter(by_state, reading, self.known, self.motion.block_s, self.wide)

    def of_coefficients(self, explained: Hypothesis, theta: Array) -> Array:
        """Driving of each cause of errors in the coefficients, by its standard deviation (R, T - 1, 6, nc)."""
        if not self.coefficients.names:
            return np.zeros((*self._lack.shape, 0))
        columns = explained.coefficient_slopes(self.motion, theta, self.coefficients.names) @ self.coefficients.mixing
        scaled: Array = self.motion.block_s * columns * self._inside[..., None]
        return scaled

    def residual(self, explained: Hypothesis, theta: Array) -> tuple[Array, Array]:
        """Driving (R, T - 1, 6) and shown (R, T, ny) of the residual at some parameters."""
        key = explained.effects, theta.tobytes()
        found = self._residuals.get(key)
        if found is None:
            if len(self._residuals) >= REMEMBERED:
                self._residuals.clear()
            found = self._residuals[key] = self._residual(explained, theta)
        return found

    def _residual(self, explained: Hypothesis, theta: Array) -> tuple[Array, Array]:
        motion, driving, shown = self.motion, self._lack, self._shown
        states, rates, readings = explained.touches
        more_states = len(explained.own) > self._own.shape[-1]
        own = explained.own_states(motion, theta) if states or more_states else self._own
        if rates:
            more = explained.rates(motion, theta, own) - self._block_rates
            driving = driving + motion.block_s * more * self._inside
        if readings:
            shown = motion.measured - explained.readings(motion, theta, own)
        return driving, shown

    def added(self, explained: Hypothesis, theta: Array) -> tuple[Array, Array]:
        """What the effects add to driving (R, T - 1, 6) and to what the sensors show (R, T, ny)."""
        driving, shown = self.residual(explained, theta)
        return driving - self._lack, self._shown - shown

    def columns(self, explained: Hypothesis, theta: Array, of_coefficients: Array) -> FilterColumns:
        """Residual, its slopes in the parameters (difference quotients), and the coefficients."""
        driving, shown = self.residual(explained, theta)
        _, high = explained.bounds
        driven, seen = [driving], [shown]
        for place, step in enumerate(explained.steps):
            moved = theta.copy()
            moved[place] += step if theta[place] + step <= high[place] else -step
            more = self.residual(explained, moved)
            change = moved[place] - theta[place]
            driven.append((more[0] - driving) / change)
            seen.append((more[1] - shown) / change)
        forms = np.zeros((*driving.shape, 0))
        if len(theta) and self._forms is not None:
            forms = self._forms.columns(driving - self._lack, directed=explained.directed)
        pairs = np.concatenate([np.stack(driven, axis=-1), of_coefficients, forms], axis=-1)
        readings = np.zeros((*shown.shape, pairs.shape[-1]))
        readings[..., : 1 + len(theta)] = np.stack(seen, axis=-1)
        return FilterColumns(pairs, readings, len(theta), of_coefficients.shape[-1])

    def whitened(self, fit: ExplanationFit) -> tuple[Array, Array]:
        """Columns of an explanation in units of the innovations (R, T, ny, C), and its innovations (R, T, ny)."""
        seen, columns = self._seen(fit)
        whitened = seen.whitened(columns.driving, columns.shown)
        return whitened, whitened[..., 0] + whitened[..., 1 + columns.asked :] @ fit.change

    def smoothed(self, fit: ExplanationFit) -> tuple[Array, Array]:
        """States of the filter given all measurements (R, T, nz), and the covariance of the accelerations that nobody
        modelled, given those until then (R, T, 3, 3): an upper bound of that given all."""
        seen, columns = self._seen(fit)
        by_coefficients = columns.driving[..., 1 + columns.asked :] @ fit.change
        states = seen.smoothed(columns.driving[..., 0] + by_coefficients, columns.shown[..., 0])
        return states, seen.filtered[..., 6 : 6 + FORCE_STATES, 6 : 6 + FORCE_STATES]

    def about(self, fit: ExplanationFit) -> Likelihood:
        """The same likelihood, linearised about the motion that an explanation makes of the measurements.

        The smoothed measurements are rounded where the rudder kicks; the smoother's motion follows the model there.
        """
        motion, explained, theta = self.motion, fit.explained, fit.theta
        seen, columns = self._seen(fit)
        by_coefficients = columns.driving[..., 1 + columns.asked :] @ fit.change
        states = seen.smoothed(columns.driving[..., 0] + by_coefficients, columns.shown[..., 0])
        more = by_coefficients + np.pad(motion.block_s * states[:, :-1, 6 : 6 + FORCE_STATES], ((0, 0), (0, 0), (0, 3)))
        between = explained.rates_between(motion, theta) - np.diff(motion.states, axis=1) / motion.step_s
        moved = motion.moved(states[..., :6], seen.what.transition, between, more * self._inside / motion.block_s)
        return Likelihood(moved, self.none, self.coefficients, self.belief)

    def by_formula(self, fit: ExplanationFit) -> ExplanationFit:
        """An explanation with the parameters that suit the measurements best if its formula is to be taken as it is.

        So a simulation takes it. The standard errors stay those of a formula that may be a little wrong.
        """
        strict = copy(self)
        strict._forms = None
        found = strict.at_best(fit.explained, fit.theta, [fit.logs], BY_FORMULA)
        return replace(fit, theta=found.theta)

    def innovations(self, fit: ExplanationFit) -> Array:
        """Innovations of an explanation, each over its standard deviation (R, T, ny), 0 where nothing was measured."""
        return self.whitened(fit)[1]

    def _seen(self, fit: ExplanationFit) -> tuple[Observer, FilterColumns]:
        explained, theta = fit.explained, fit.theta
        columns = self.columns(explained, theta, self.of_coefficients(explained, theta)).scaled(fit.width)
        return observer(self.linear(explained, theta), fit.noise), columns

    # -- the best parameters and the best noise ----------------------------------------------------------------------

    def at_best(
        self,
        explained: Hypothesis,
        theta: Array,
        starts: Sequence[Array],
        rounds: Sequence[int],
        limit: float = np.inf,
    ) -> ExplanationFit:
        """Parameters, coefficients and noise that explain the measurements best.

        Parameters
        ----------
        explained : Hypothesis
        theta : array (k,)
            Parameters to begin with.
        starts : sequence of arrays
            Noises to choose from to begin with, and width (:attr:`ExplanationFit.logs`).
        rounds : sequence of int
            How many iterations on the noise (L-BFGS) follow each solution for the parameters.
        limit : float
            With a score above this at the best of the noises given, its own noise is not sought.
        """
        fit = ExplanationFit(explained, theta, np.zeros((len(theta), len(theta))), starts[0], np.inf, np.zeros(0))
        for turn, count in enumerate(rounds):
            what = self.linear(explained, fit.theta) if len(theta) else self.base
            coefficients = self.of_coefficients(explained, fit.theta) if len(theta) else self.coefficient_columns
            if turn == 0 and len(starts) > 1:
                fit = self._nearest(fit, what, coefficients, starts)
            fit = self._parameters(fit, what, coefficients)
            if fit.score > limit:
                break
            if count:
                fit = self._noise(fit, what, coefficients, count)
        return fit

    def _nearest(
        self, fit: ExplanationFit, what: Linear, coefficients: Array, starts: Sequence[Array]
    ) -> ExplanationFit:
        """The noise of several at which the explanation, free in its parameters, scores best."""
        columns = self.columns(fit.explained, fit.theta, coefficients)
        scored: list[tuple[float, int]] = []
        for logs in starts:
            here = replace(fit, logs=logs)
            seen = observer(what, here.noise)
            solved = self._solved(fit.explained, fit.theta, seen, columns.scaled(here.width), free=True)
            scored.append((self._score(here, seen, solved), len(scored)))
        return replace(fit, logs=starts[min(scored)[1]])

    def _parameters(self, fit: ExplanationFit, what: Linear, coefficients: Array, steps: int = 4) -> ExplanationFit:
        """Gauss-Newton in the parameters at one noise."""
        explained, theta = fit.explained, fit.theta
        low, high = explained.bounds
        seen = observer(what, fit.noise)
        best: ExplanationFit | None = None
        for _ in range(steps if len(theta) else 1):
            columns = self.columns(explained, theta, coefficients).scaled(fit.width)
            solved = self._solved(explained, theta, seen, columns)
            found = replace(
                fit,
                theta=theta,
                covariance=solved.covariance,
                score=self._score(fit, seen, solved),
                change=solved.change,
            )
            if best is None or found.score < best.score:
                best, move = found, solved.move
                if len(theta) == 0 or solved.gain < LEAST_GAIN:
                    break
            else:
                move = 0.3 * move
            theta = np.clip(best.theta + move, low, high)
        assert best is not None
        return best

    def _noise(self, fit: ExplanationFit, what: Linear, coefficients: Array, count: int) -> ExplanationFit:
        """Noise and width for the columns as they are; the parameters follow linearly unless one is at a bound."""
        least, largest = fit.explained.bounds
        free = bool(np.all((fit.theta > least) & (fit.theta < largest)))
        columns = self._told(fit, what, self.columns(fit.explained, fit.theta, coefficients))

        def cost(logs: Array) -> tuple[float, Array]:
            here = replace(fit, logs=logs)
            seen = observer(what, here.noise)
            wide = columns.scaled(here.width)
            solved = self._solved(fit.explained, fit.theta, seen, wide, free=free)
            weights = solved.weights
            by_noise = slopes(seen, wide.driving @ weights, wide.shown @ weights, solved.whitened @ weights)
            own = solved.change[: columns.uncertain]
            by_width = 2 * (len(own) - solved.left - own @ own)
            belief, by_belief = self.belief.cost(logs)
            # Without the price: what it has of the noise is next to nothing, and not in the slopes.
            return seen.log_det + solved.rest + belief, np.append(by_noise, by_width) + by_belief

        low, high = self.belief.bounds
        low[-1], high[-1] = np.log(WIDTHS[0]), np.log(WIDTHS[1])
        found = minimize(
            cost,
            fit.logs,
            jac=True,
            method="L-BFGS-B",
            bounds=list(zip(low, high, strict=True)),
            options={"maxiter": count, "maxfun": count + 3},
        )
        best = self._parameters(replace(fit, logs=found.x), what, coefficients, 3)
        return best if best.score < fit.score else fit  # the parameters may not follow so far

    def _told(self, fit: ExplanationFit, what: Linear, columns: FilterColumns) -> FilterColumns:
        """The columns with only those combinations of the coefficients of which the trials tell anything.

        Combinations turned among themselves are as independent beforehand as the coefficients were.
        """
        seen, k = observer(what, fit.noise), columns.asked
        flat = seen.whitened(columns.driving, columns.shown).reshape(-1, columns.driving.shape[-1])[:, 1 + k :]
        gram, count = flat.T @ flat, columns.uncertain
        told, turned = np.linalg.eigh(gram[:count, :count] * fit.width**2)
        turned = turned[:, told > LEAST_TOLD]
        kept = 1 + k + count + np.flatnonzero(np.diag(gram)[count:] > LEAST_TOLD)
        parts = columns.driving[..., : 1 + k], columns.driving[..., 1 + k : 1 + k + count] @ turned
        driving = np.concatenate([*parts, columns.driving[..., kept]], axis=-1)
        return FilterColumns(driving, columns.shown[..., : driving.shape[-1]], k, turned.shape[1])

    def _score(self, fit: ExplanationFit, seen: Observer, solved: _Solved) -> float:
        forms = np.abs(solved.change[len(self.coefficients.mixing.T) :])
        twisted = IMPOSSIBLE * float(np.sum(np.maximum(forms - LARGEST_FORM, 0.0)))
        return (
            twisted
            + seen.log_det
            + solved.rest
            + self.price(fit.explained, solved.covariance)
            + self.belief.cost(fit.logs)[0]
        )

    def price(self, explained: Hypothesis, covariance: Array) -> float:
        """What the parameters of the effects cost: k log(n/20), or by how much the trials narrow what was known."""
        precision = explained.prior[1]
        known = precision > 0
        cost = float(np.count_nonzero(~known) * np.log(self.count / COUNTED))
        if known.any():
            narrowed = covariance[np.ix_(known, known)] * np.sqrt(np.outer(precision[known], precision[known]))
            cost -= float(np.linalg.slogdet(narrowed)[1])
        return cost

    def _solved(
        self, explained: Hypothesis, theta: Array, seen: Observer, columns: FilterColumns, *, free: bool = False
    ) -> _Solved:
        """Least squares over the parameters' and coefficients' columns; the residual's own cost is where they stand,
        or where the parameters are free to move if `free`."""
        whitened = seen.whitened(columns.driving, columns.shown)
        flat = whitened.reshape(-1, whitened.shape[-1])
        gram = flat.T @ flat
        k, count = columns.asked, columns.uncertain
        mean, precision = explained.prior
        own = np.diag(np.concatenate([precision, np.ones(gram.shape[0] - 1 - k)]))
        normal = gram[1:, 1:] + own
        pull = -gram[1:, 0] - np.concatenate([precision * (theta - mean), np.zeros(gram.shape[0] - 1 - k)])
        size = np.sqrt(np.diag(normal))
        size[size == 0] = 1.0  # a shape of something that is absent shows nothing
        factor = cho_factor(normal / np.outer(size, size) + 1e-12 * np.eye(len(normal)))
        whole = cho_solve(factor, pull / size) / size
        inner = normal[k:, k:]
        held = cho_factor(inner)
        alone = cho_solve(held, -gram[1 + k :, 0])
        gain = float(pull @ whole - alone @ (inner @ alone))
        change = whole[k:] if free else alone
        base = gram[0, 0] + float(precision @ (theta - mean) ** 2)
        rest = base - (float(pull @ whole) if free else float(alone @ (inner @ alone)))
        rest += 2 * float(np.sum(np.log(np.diag(held[0]))))
        covariance = np.linalg.inv(normal / np.outer(size, size) + 1e-12 * np.eye(len(normal))) / np.outer(size, size)
        spread = np.linalg.inv(inner)
        root = np.linalg.cholesky(0.5 * (spread + spread.T)) if len(inner) else np.zeros((0, 0))
        weights = np.zeros((gram.shape[0], 1 + len(inner)))
        weights[0, 0] = 1.0
        weights[1:, 0] = whole if free else np.concatenate([np.zeros(k), alone])
        weights[1 + k :, 1:] = root
        return _Solved(
            rest,
            whole[:k],
            covariance[:k, :k],
            change,
            gain,
            float(np.trace(spread[:count, :count])),
            weights,
            whitened,
        )


@dataclass(frozen=True, eq=False)
class _Solved:
    """Result of the least squares: cost with the log determinant of the coefficients, step of the parameters and its
    gain, their covariance, change of the coefficients, trace of their covariance afterwards, and the columns that count
    for the noise: the residual, and the root of that covariance."""

    rest: float
    move: Array
    covariance: Array
    change: Array
    gain: float
    left: float
    weights: Array
    whitened: Array
