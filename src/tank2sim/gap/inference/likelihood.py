"""The score of an explanation: the likelihood of the measurements if it holds, whatever the noise and the coefficients.

    T = sum(log det S) + |e|^2 + c'c + log det(I + Jc'Jc) + k log(n/20) + prior of noise and shapes

e are the innovations of :mod:`.kalman_filter` in units of their standard deviation, linear in the k parameters of the
effects and in the coefficients of the card, c in units of their standard error beforehand; Jc are their columns. The
coefficients are integrated out, the noise is estimated again for each explanation, "none" as well: else a rival that
adapts the noise would win without an effect. T is -2 log of the likelihood; of two explanations the one with the
smaller T holds, by more than chance if T differs by some 10.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from copy import copy
from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import cho_factor, cho_solve
from scipy.optimize import lsq_linear, minimize

from tank2sim.arrays import Array
from tank2sim.gap.inference.batch import MEASURED_STATES, MeasuredBatch
from tank2sim.gap.inference.fit import (
    Belief,
    CoefficientEstimates,
    ExplanationFit,
    FilterColumns,
    NuisanceParameters,
)
from tank2sim.gap.inference.form_error import Forms
from tank2sim.gap.inference.hypothesis import CLOCK, Hypothesis
from tank2sim.gap.inference.kalman_filter import FORCE_STATES, Linear, Observer, linear_filter, observer, slopes
from tank2sim.gap.inference.wave_band import WaveBand

COUNTED = 20.0
"""Measurements that count as one independent measurement in the penalty k log(n/20) of a parameter: noise is
coloured."""

WIDE_PRIOR = 10.0
"""Error of the smoothed motion at the beginning of a run, in its noise: wide, so that no initial state is assumed."""

SHORTEST_UNSURE = 0.05
"""Sampling interval of the rudder's order, in blocks, beyond which the instant of each change is estimated (project
choice): below, it moves the ship by less than any sensor shows."""

LARGEST_FORM, IMPOSSIBLE = 3.5, 1000.0
"""Standard deviations by which a form may differ, and the cost of each beyond (project choice): a force that its
form almost cancels is not a force, and its slope then belongs to another one."""

BY_FORMULA = (6, 4)
"""Iterations on the noise, for parameters by the formula alone: the noise must first cover the error of the formula."""

REMEMBERED = 100
"""Residuals in the cache: a search needs the same ones repeatedly."""

LEAST_INFORMATION = 0.02
"""A combination of coefficients whose variance the trials reduce by less than this share is omitted while the noise
is estimated (project choice); the score includes all."""

LEAST_GAIN = 0.1
"""The search for the parameters stops where the predicted decrease of the score is less than this."""

LEAST_DECREASE = 0.02
"""The search for the noise stops where a step lowers the score by less than this (project choice): explanations are
compared by differences of some units."""

QUOTIENT = 1e-3
"""Step of the logarithms of the noise in a difference quotient of slopes (project choice: a thousandth of a level)."""

WIDTHS = (0.1, 2.5)
"""Factor on the standard errors of the card's coefficients where explanations are compared: where a card states none,
0.2 % to 5 % (project choice)."""

WIDEST = 20.0
"""The same at most where the coefficients are fitted together with the explanation chosen: a card that is wrong by
10 to 20 % often says 1 or 2 % (project choice)."""


class Likelihood:
    """Scores explanations of one set of trials.

    Parameters
    ----------
    motion : MeasuredBatch
        Motion of the trials, side by side.
    none : Hypothesis
        The card without an effect.
    coefficients : NuisanceParameters
    belief : Belief
        Belief about the noise and the coefficients' width.
    scale : array, optional
        Of each logarithm of the noise and of the width, in which the search for the noise takes its steps
        (:meth:`noise_scale`); by default 1.
    """

    def __init__(
        self,
        motion: MeasuredBatch,
        none: Hypothesis,
        coefficients: NuisanceParameters,
        belief: Belief,
        scale: Array | None = None,
    ):
        self.motion, self.none, self.coefficients, self.belief = motion, none, coefficients, belief
        self.scale = np.ones(len(belief.logs)) if scale is None else scale
        self._observers: tuple[tuple[Linear, WaveBand | None, bytes, Observer], ...] = ()
        self._residuals: dict[tuple[tuple[str, ...], tuple[str, ...], bytes], tuple[Array, Array]] = {}
        nothing = np.zeros(0)
        self._unmeasured = none.unmeasured_states(motion, nothing)
        self._block_rates = none.rates(motion, nothing, self._unmeasured)
        self._inside = motion.inside[:, 1:, None].astype(float)
        changes = np.diff(motion.middles, axis=1)
        self._lack = (motion.block_s * none.fine_rates(motion, nothing) - changes) * self._inside
        self._shown = motion.measured - none.readings(motion, nothing, self._unmeasured)
        self._forms: Forms | None = Forms(motion, none.steered(motion.block_inputs))
        self._widest = WIDTHS[1]
        self.known = ~np.isnan(motion.measured) & motion.inside[..., None]
        self.count = int(self.known.sum())
        self._moves = self._unsure_moves() if CLOCK in coefficients.names else np.zeros((*self._lack.shape[:2], 0))
        self.wide = WIDE_PRIOR * motion.errors if belief.wide is None else belief.wide
        self.base = self.linear(none, nothing)
        self.coefficient_columns = self.of_coefficients(none, nothing)

    def _unsure_moves(self) -> Array:
        """Moves of the rudder's order at unknown instants (R, T - 1, m), each for one standard deviation, s."""
        motion = self.motion
        unsure = motion.unsure_s > SHORTEST_UNSURE * motion.block_s
        moves = motion.order_moves(self.none.model.input_names.index("rudder.command")) * unsure[:, None, None]
        moved: Array = moves[..., moves.any(axis=(0, 1))] * motion.unsure_s[:, None, None]
        moved /= np.sqrt(12.0)  # of a uniform distribution
        return moved

    def linear(self, hypothesis: Hypothesis, theta: Array) -> Linear:
        """The linearised motion of an explanation, with the slopes of the same model as its forces.

        The measured motion contains noise. A force evaluated on it is not a known input: only with the matching slope
        is the likelihood that of the measurements, whatever motion it is linear about.
        """
        by_state, reading = hypothesis.slopes(self.motion, theta, self.coefficients.names)
        by_state = by_state * self._inside[..., None]  # zero outside the runs
        return linear_filter(by_state, reading, self.known, self.motion.block_s, self.wide, self.motion.noise_shares)

    def of_coefficients(self, hypothesis: Hypothesis, theta: Array) -> Array:
        """Driving of each cause of errors of coefficients, gear and clock, and of the unknown instant of each change of
        the rudder's order, per standard deviation (R, T - 1, 6, nc + moves)."""
        names = self.coefficients.names
        if not names:
            return np.zeros((*self._lack.shape, 0))
        by_name = hypothesis.coefficient_slopes(self.motion, theta, names)
        by_name *= self.motion.block_s * self._inside[..., None]
        mixing = self.coefficients.mixing
        if hypothesis.moves_clock:  # its delay takes the place of the record's
            mixing = np.where(np.array(names)[:, None] == CLOCK, 0.0, mixing)
        columns = (by_name.reshape(-1, len(names)) @ mixing).reshape(*by_name.shape[:-1], -1)
        if not self._moves.shape[-1]:
            return columns
        return np.concatenate([columns, by_name[..., [names.index(CLOCK)]] * self._moves[:, :, None, :]], axis=-1)

    def residual(self, hypothesis: Hypothesis, theta: Array) -> tuple[Array, Array]:
        """Driving (R, T - 1, 6) and shown (R, T, ny) of the residual at some parameters."""
        key = hypothesis.effects, hypothesis.each, theta.tobytes()
        found = self._residuals.get(key)
        if found is None:
            if len(self._residuals) >= REMEMBERED:
                self._residuals.clear()
            found = self._residuals[key] = self._residual(hypothesis, theta)
        return found

    def _residual(self, hypothesis: Hypothesis, theta: Array) -> tuple[Array, Array]:
        motion, driving, shown = self.motion, self._lack, self._shown
        states, rates, readings = hypothesis.influences
        extra_states = len(hypothesis.unmeasured) > self._unmeasured.shape[-1]
        unmeasured = hypothesis.unmeasured_states(motion, theta) if states or extra_states else self._unmeasured
        if rates:
            change = hypothesis.rates(motion, theta, unmeasured) - self._block_rates
            driving = driving + motion.block_s * change * self._inside
        if readings:
            shown = motion.measured - hypothesis.readings(motion, theta, unmeasured)
        return driving, shown

    def added(self, hypothesis: Hypothesis, theta: Array) -> tuple[Array, Array]:
        """Contribution of the effects to the driving (R, T - 1, 6) and to the readings (R, T, ny)."""
        driving, shown = self.residual(hypothesis, theta)
        return driving - self._lack, self._shown - shown

    def columns(self, hypothesis: Hypothesis, theta: Array, of_coefficients: Array) -> FilterColumns:
        """Residual, its slopes in the parameters (difference quotients), and the coefficients."""
        driving, shown = self.residual(hypothesis, theta)
        _, high = hypothesis.bounds
        driven = np.zeros((*driving.shape, 1 + len(theta)))
        seen = np.zeros((*shown.shape, 1 + len(theta)))
        driven[..., 0], seen[..., 0] = driving, shown
        steps = hypothesis.steps
        for group in hypothesis.moved_together:
            places = list(group)
            moved = theta.copy()
            moved[places] += np.where(theta[places] + steps[places] <= high[places], steps[places], -steps[places])
            moved_residual = self.residual(hypothesis, moved)
            for place in places:
                run = hypothesis.estimated[place].run
                rows = slice(None) if run is None else slice(run, run + 1)
                change = moved[place] - theta[place]
                driven[rows, ..., 1 + place] = ((moved_residual[0] - driving) / change)[rows]
                seen[rows, ..., 1 + place] = ((moved_residual[1] - shown) / change)[rows]
        forms = []
        if len(theta) and self._forms is not None:
            forms.append(self._forms.columns(driving - self._lack, directed=hypothesis.directed))
        pairs = np.concatenate([driven, of_coefficients, *forms], axis=-1)
        return FilterColumns(pairs, seen, len(theta), self.coefficients.scaled)

    def whiten(self, fit: ExplanationFit) -> tuple[Array, Array]:
        """Columns of an explanation in units of the innovations (R, T, ny, C), and its innovations (R, T, ny)."""
        seen, columns = self._seen(fit)
        whitened = seen.whiten(columns.driving, columns.shown)
        return whitened, whitened[..., 0] + whitened[..., 1 + columns.parameter_count :] @ fit.change

    def smooth(self, fit: ExplanationFit) -> tuple[Array, Array]:
        """States of the filter given all measurements (R, T, nz), and the covariance of the unmodelled
        accelerations, given the measurements until then (R, T, 3, 3): an upper bound of that given all."""
        seen, states, _ = self._smoothed(fit)
        return states, seen.filtered[..., 6 : 6 + FORCE_STATES, 6 : 6 + FORCE_STATES]

    def _smoothed(self, fit: ExplanationFit) -> tuple[Observer, Array, Array]:
        """The filter, its states given all measurements (R, T, nz), and what drives by the change of the coefficients
        (R, T - 1, 6)."""
        seen, columns = self._seen(fit)
        added = columns.driving[..., 1 + columns.parameter_count :] @ fit.change
        return seen, seen.smooth(columns.driving[..., 0] + added, columns.shown[..., 0]), added

    def about(self, fit: ExplanationFit) -> Likelihood:
        """The same likelihood, linearised about the smoothed motion of an explanation.

        The smoothed measurements are rounded where the rudder kicks; the smoother's motion follows the model there. It
        is that without the waves: what they add within a block is not resolved, and small enough to be linear.
        """
        motion, hypothesis, theta = self.motion, fit.hypothesis, fit.theta
        seen, states, added = self._smoothed(fit)
        slow, waves, band = states[..., :6], self.belief.waves, states[..., -2 * FORCE_STATES :]
        if waves is not None:
            slow = slow - waves.moved(band, motion.middles[..., MEASURED_STATES.index("motion.psi")])
        added[..., :FORCE_STATES] += motion.block_s * states[:, :-1, 6 : 6 + FORCE_STATES]
        added *= self._inside / motion.block_s
        between = hypothesis.rates_between(motion, theta) - np.diff(motion.states, axis=1) / motion.step_s
        moved = motion.shift(slow, seen.linear.transition, between, added)
        return Likelihood(moved, self.none, self.coefficients, self.belief, self.scale)

    def by_formula(self, fit: ExplanationFit) -> ExplanationFit:
        """An explanation at its best without form errors, as a simulation uses its formulas.

        The covariance of its parameters remains that with form errors.
        """
        return replace(
            self._strict().at_best(fit.hypothesis, fit.theta, [fit.logs], BY_FORMULA), covariance=fit.covariance
        )

    def _strict(self) -> Likelihood:
        """The likelihood without form errors."""
        strict = copy(self)
        strict._forms, strict._widest = None, WIDEST
        return strict

    def coefficients_with(self, found: ExplanationFit) -> CoefficientEstimates:
        """The card's coefficients that fit the measurements best together with an explanation of :meth:`by_formula`."""
        seen, columns = self._strict()._seen(found)
        flat = seen.whiten(columns.driving, columns.shown).reshape(-1, columns.driving.shape[-1])
        k, causes = columns.parameter_count, len(self.coefficients.mixing.T)
        weight = np.concatenate([found.hypothesis.prior[1], np.ones(flat.shape[1] - 1 - k)])
        normal = flat[:, 1:].T @ flat[:, 1:] + np.diag(weight)
        size = np.sqrt(np.where(np.diag(normal) > 0, np.diag(normal), 1.0))
        covariance = np.linalg.inv(normal / np.outer(size, size) + 1e-12 * np.eye(len(size))) / np.outer(size, size)
        spread = self.coefficients.spread(found.width)
        kept = slice(k, k + causes)
        return CoefficientEstimates(
            self.coefficients.names, spread @ found.change[:causes], spread @ covariance[kept, kept] @ spread.T
        )

    def innovations(self, fit: ExplanationFit) -> Array:
        """Innovations of an explanation, each over its standard deviation (R, T, ny), 0 where nothing was measured."""
        return self.whiten(fit)[1]

    def _observer(self, linear: Linear, fit: ExplanationFit) -> Observer:
        """The filter at the noise of a fit; the last ones are kept for the next question at the same noise."""
        noise, waves = fit.logs[:-1].tobytes(), self.belief.waves
        for motion, band, logs, known in self._observers:
            if motion is linear and band is waves and logs == noise:
                return known
        found = observer(linear, fit.noise, waves)
        self._observers = (linear, waves, noise, found), *self._observers[:3]
        return found

    def _seen(self, fit: ExplanationFit) -> tuple[Observer, FilterColumns]:
        hypothesis, theta = fit.hypothesis, fit.theta
        columns = self.columns(hypothesis, theta, self.of_coefficients(hypothesis, theta)).scaled(fit.width)
        return self._observer(self.linear(hypothesis, theta), fit), columns

    # -- the best parameters and the best noise ----------------------------------------------------------------------

    def at_best(
        self,
        hypothesis: Hypothesis,
        theta: Array,
        starts: Sequence[Array],
        rounds: Sequence[int],
        limit: float = np.inf,
    ) -> ExplanationFit:
        """Parameters, coefficients and noise that explain the measurements best.

        Parameters
        ----------
        hypothesis : Hypothesis
        theta : array (k,)
            Parameters to begin with.
        starts : sequence of arrays
            Noises to choose from to begin with, and width (:attr:`ExplanationFit.logs`).
        rounds : sequence of int
            Number of iterations on the noise (L-BFGS) after each solution for the parameters.
        limit : float
            With a score above this at the best of the given noises, the noise is not estimated.

        Raises
        ------
        FloatingPointError
            The model's forces along the measured motion are not finite at `theta`.
        """
        fit = ExplanationFit(hypothesis, theta, np.zeros((len(theta), len(theta))), starts[0], np.inf, np.zeros(0))
        for turn, count in enumerate(rounds):
            linear = self.linear(hypothesis, fit.theta) if len(theta) else self.base
            coefficients = self.of_coefficients(hypothesis, fit.theta) if len(theta) else self.coefficient_columns
            if turn == 0 and len(starts) > 1:
                fit = self._nearest(fit, linear, coefficients, starts)
            fit = self._parameters(fit, linear, coefficients)
            if fit.score > limit:
                break
            if count:
                fit = self._noise(fit, linear, coefficients, count)
        return fit

    def _nearest(
        self, fit: ExplanationFit, linear: Linear, coefficients: Array, starts: Sequence[Array]
    ) -> ExplanationFit:
        """The noise of several at which the explanation, free in its parameters, scores best."""
        columns = self.columns(fit.hypothesis, fit.theta, coefficients)

        def score(noisy: ExplanationFit) -> float:
            seen = self._observer(linear, noisy)
            solved = self._solved(noisy, seen, columns, free=True)
            return self._score(noisy, seen, solved)

        return min((replace(fit, logs=logs) for logs in starts), key=score)

    def _parameters(self, fit: ExplanationFit, linear: Linear, coefficients: Array, steps: int = 6) -> ExplanationFit:
        """The parameters at one noise by steps of Gauss and Newton, damped (Marquardt 1963) once a step has failed."""
        hypothesis, theta = fit.hypothesis, fit.theta
        low, high = hypothesis.bounds
        seen = self._observer(linear, fit)
        best: tuple[ExplanationFit, _Step] | None = None
        damping = 0.0
        for _ in range(steps if len(theta) else 1):
            found, gain = replace(fit, theta=theta, score=np.inf), np.inf
            try:
                solved = self._solved(found, seen, self.columns(hypothesis, theta, coefficients))
            except FloatingPointError:
                if best is None:
                    raise
            else:
                score = self._score(fit, seen, solved)
                found = replace(found, covariance=solved.covariance, score=score, change=solved.change)
                gain = solved.gain
            if best is None or found.score < best[0].score:
                best, damping = (found, solved.step), damping / 10 if damping >= 1.0 else 0.0
                if len(theta) == 0 or gain < LEAST_GAIN:
                    break
            else:
                damping = max(10 * damping, 1.0)
            theta = np.clip(best[0].theta + best[1].move(damping), low, high)
        assert best is not None
        return best[0]

    def _noise(self, fit: ExplanationFit, linear: Linear, coefficients: Array, count: int) -> ExplanationFit:
        """Noise and width for the columns as they are; the parameters follow linearly, within their bounds."""
        cost, scale = self._cost_of_noise(fit, linear, coefficients), self.scale

        def scaled(steps: Array) -> tuple[float, Array]:
            value, slope = cost(steps * scale)
            return value, slope * scale

        low, high = self.belief.bounds
        low[-1], high[-1] = np.log(WIDTHS[0]), np.log(self._widest)
        found = minimize(
            scaled,
            fit.logs / scale,
            jac=True,
            method="L-BFGS-B",
            bounds=list(zip(low / scale, high / scale, strict=True)),
            options={"maxiter": count, "maxfun": count + 3, "ftol": LEAST_DECREASE / max(abs(fit.score), 1.0)},
        )
        best = self._parameters(replace(fit, logs=np.clip(found.x * scale, low, high)), linear, coefficients, 3)
        return best if best.score < fit.score else fit  # the parameters may be nonlinear over so large a change

    def noise_scale(self, fit: ExplanationFit) -> Array:
        """Change of each logarithm of the noise, and of the width, that raises the cost by a half: one over the root of
        its curvature at a fit (a difference quotient of the slopes), at most what its prior allows.

        The cost is many times more curved along the white noise of a sensor than along the time constant of a force.
        In these units all directions are about equally curved, and some ten steps of the search suffice.
        """
        cost = self._cost_of_noise(
            fit, self.linear(fit.hypothesis, fit.theta), self.of_coefficients(fit.hypothesis, fit.theta)
        )
        slope = cost(fit.logs)[1]
        steps = QUOTIENT * np.eye(len(slope))
        curvature = np.array([(cost(fit.logs + step)[1] - slope)[place] / QUOTIENT for place, step in enumerate(steps)])
        scale: Array = 1 / np.sqrt(np.maximum(curvature, 2 / self.belief.spread**2))
        return scale

    def with_scale(self, scale: Array) -> Likelihood:
        """The same likelihood, with other steps of the search for the noise."""
        other = copy(self)
        other.scale = scale
        return other

    def with_waves(self, waves: WaveBand | None) -> Likelihood:
        """The same likelihood, with other unmodelled accelerations by waves."""
        other = copy(self)
        other.belief = replace(self.belief, waves=waves)
        return other

    def _cost_of_noise(
        self, fit: ExplanationFit, linear: Linear, coefficients: Array
    ) -> Callable[[Array], tuple[float, Array]]:
        """Cost of the logarithms of noise and width and its slope, for the columns of a fit as they are."""
        columns = self._informative(fit, linear, self.columns(fit.hypothesis, fit.theta, coefficients))

        def cost(logs: Array) -> tuple[float, Array]:
            noisy = replace(fit, logs=logs)
            seen = self._observer(linear, noisy)
            solved = self._solved(noisy, seen, columns, free=True)
            by_noise = slopes(seen, *_mixed(columns, solved.weights))
            coefficients_change = solved.change[: columns.coefficient_count]
            by_width = 2 * (
                len(coefficients_change) - solved.coefficient_variance - coefficients_change @ coefficients_change
            )
            belief, by_belief = self.belief.cost(logs)
            # Without the penalty of the parameters: its dependence on the noise is negligible, and not in the slopes.
            return seen.log_det + solved.reduced_cost + belief, np.append(by_noise, by_width) + by_belief

        return cost

    def cost_of_waves(self, fit: ExplanationFit) -> Callable[[WaveBand | None], float]:
        """Cost of accelerations by waves, for the columns of a fit as they are and at its noise; parameters and
        coefficients follow linearly, the parameters within their bounds."""
        hypothesis, theta = fit.hypothesis, fit.theta
        linear = self.linear(hypothesis, theta)
        columns = self.columns(hypothesis, theta, self.of_coefficients(hypothesis, theta))
        columns = self._informative(fit, linear, columns)

        def cost(waves: WaveBand | None) -> float:
            seen = observer(linear, fit.noise, waves)
            return seen.log_det + self._solved(fit, seen, columns, free=True).reduced_cost

        return cost

    def _informative(self, fit: ExplanationFit, linear: Linear, columns: FilterColumns) -> FilterColumns:
        """The columns with only the combinations of coefficients that the trials determine better than the prior."""
        seen, k = self._observer(linear, fit), columns.parameter_count
        flat = seen.whiten(columns.driving, columns.shown).reshape(-1, columns.driving.shape[-1])[:, 1 + k :]
        gram, count = flat.T @ flat, columns.coefficient_count
        information, directions = np.linalg.eigh(gram[:count, :count] * fit.width**2)
        directions = directions[:, information > LEAST_INFORMATION]
        kept = 1 + k + count + np.flatnonzero(np.diag(gram)[count:] > LEAST_INFORMATION)
        parts = columns.driving[..., : 1 + k], columns.driving[..., 1 + k : 1 + k + count] @ directions
        driving = np.concatenate([*parts, columns.driving[..., kept]], axis=-1)
        return FilterColumns(driving, columns.shown, k, directions.shape[1])

    def _score(self, fit: ExplanationFit, seen: Observer, solved: _Solved) -> float:
        forms = np.abs(solved.change[self.coefficient_columns.shape[-1] :])
        twisted = IMPOSSIBLE * float(np.sum(np.maximum(forms - LARGEST_FORM, 0.0)))
        return (
            twisted
            + seen.log_det
            + solved.reduced_cost
            + self.price(fit.hypothesis, solved.covariance)
            + self.belief.cost(fit.logs)[0]
        )

    def price(self, hypothesis: Hypothesis, covariance: Array) -> float:
        """Penalty of the effects' parameters: k log(n/20), or the reduction of their prior variance by the trials."""
        precision = hypothesis.prior[1]
        known = precision > 0
        cost = float(np.count_nonzero(~known) * np.log(self.count / COUNTED))
        if known.any():
            narrowed = covariance[np.ix_(known, known)] * np.sqrt(np.outer(precision[known], precision[known]))
            cost -= float(np.linalg.slogdet(narrowed)[1])
        return cost

    def _solved(self, fit: ExplanationFit, seen: Observer, columns: FilterColumns, *, free: bool = False) -> _Solved:
        """Least squares over the parameters' and coefficients' columns, the parameters within their bounds; the cost of
        the residual is at the parameters of `fit`, or at the solution if `free`. The columns are without its width.

        Raises FloatingPointError where the model's forces along the measured motion are not finite.
        """
        hypothesis, theta = fit.hypothesis, fit.theta
        whitened = seen.whiten(columns.driving, columns.shown)
        flat = whitened.reshape(-1, whitened.shape[-1])
        factors = columns.factors(fit.width)
        gram = flat.T @ flat * np.outer(factors, factors)
        k, count = columns.parameter_count, columns.coefficient_count
        mean, precision = hypothesis.prior
        weight = np.diag(np.concatenate([precision, np.ones(gram.shape[0] - 1 - k)]))
        normal = gram[1:, 1:] + weight
        if not np.isfinite(gram).all():
            raise FloatingPointError(f"{', '.join(hypothesis.effects) or 'the card'}: forces are not finite")
        pull = -gram[1:, 0] - np.concatenate([precision * (theta - mean), np.zeros(gram.shape[0] - 1 - k)])
        size = np.sqrt(np.diag(normal))
        size[size == 0] = 1.0  # the shape of an absent effect has no column
        identity = np.eye(len(normal))
        factor = cho_factor(normal / np.outer(size, size) + 1e-12 * identity)
        whole = cho_solve(factor, pull / size) / size
        inner, cross = normal[k:, k:], normal[k:, :k]
        held = cho_factor(inner)
        alone = cho_solve(held, pull[k:])
        low, high = (bound - theta for bound in hypothesis.bounds)
        follow = cho_solve(held, cross)
        step = _Step(normal[:k, :k] - cross.T @ follow, pull[:k] - cross.T @ alone, low, high, whole[:k])
        if np.any((whole[:k] < low) | (whole[:k] > high)):
            move = step.move(0.0)
            whole = np.concatenate([move, alone - follow @ move])
        decrease = float(2 * pull @ whole - whole @ (normal @ whole))
        without = float(2 * pull[k:] @ alone - alone @ (inner @ alone))
        gain = decrease - without
        change = whole[k:] if free else alone
        base = gram[0, 0] + float(precision @ (theta - mean) ** 2)
        reduced_cost = base - (decrease if free else without)
        reduced_cost += 2 * float(np.sum(np.log(np.diag(held[0]))))
        covariance = cho_solve(factor, identity) / np.outer(size, size)
        spread = np.linalg.inv(inner)
        root = np.linalg.cholesky(0.5 * (spread + spread.T)) if len(inner) else np.zeros((0, 0))
        weights = np.zeros((gram.shape[0], 1 + len(inner)))
        weights[0, 0] = 1.0
        weights[1:, 0] = whole if free else np.concatenate([np.zeros(k), alone])
        weights[1 + k :, 1:] = root
        weights *= factors[:, None]
        return _Solved(
            reduced_cost,
            step,
            covariance[:k, :k],
            change,
            gain,
            float(np.trace(spread[:count, :count])),
            weights,
        )


def least_in_box(normal: Array, pull: Array, low: Array, high: Array) -> Array:
    """Return the x (k,) between bounds with the least x'Nx/2 - x'p.

    Bounded least squares of Stark and Parker (1995), Computational Statistics 10.

    Parameters
    ----------
    normal : array (k, k)
        N, positive semidefinite up to rounding.
    pull, low, high : array (k,)
        p and the bounds, which may be infinite.
    """
    size = np.sqrt(np.where(np.diag(normal) > 0, np.diag(normal), 1.0))
    values, vectors = np.linalg.eigh(normal / np.outer(size, size))
    roots = np.sqrt(np.maximum(values, 1e-12))
    target = vectors.T @ (pull / size) / roots
    found = lsq_linear(roots[:, None] * vectors.T, target, (low * size, high * size), method="bvls")
    x: Array = found.x / size
    return x


def _mixed(columns: FilterColumns, weights: Array) -> tuple[Array, Array]:
    """Combinations of columns, of which the first alone is shown by sensors: one product of matrices each."""
    driving, shown = columns.driving, columns.shown
    mixed = driving.reshape(-1, driving.shape[-1]) @ weights
    return mixed.reshape(*driving.shape[:-1], -1), shown @ weights[: shown.shape[-1], :1]


@dataclass(frozen=True, eq=False)
class _Step:
    """The next step of the parameters: normal matrix (k, k) and pull (k,) with the coefficients solved for, bounds of
    the step, and the step without bounds."""

    normal: Array
    pull: Array
    low: Array
    high: Array
    free: Array

    def move(self, damping: float) -> Array:
        """The step between its bounds, the diagonal of the normal matrix enlarged by a share `damping` of itself."""
        if not damping and np.all((self.free >= self.low) & (self.free <= self.high)):
            return self.free
        damped = self.normal + damping * np.diag(np.diag(self.normal))
        return least_in_box(damped, self.pull, self.low, self.high)


@dataclass(frozen=True, eq=False)
class _Solved:
    """Result of the least squares: cost with the log determinant of the coefficients, step of the parameters and its
    gain, their covariance, change of the coefficients, trace of their covariance afterwards, and the columns that count
    for the noise: the residual, and the root of that covariance."""

    reduced_cost: float
    step: _Step
    covariance: Array
    change: Array
    gain: float
    coefficient_variance: float
    weights: Array
