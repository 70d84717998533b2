"""Tuning a card to a trial or a standard: change of the fewest or of the most uncertain numbers until figures reach
their targets.

Unknowns are the moves z of the card's parameters in standard errors, and the multiple of an agreed variation (Kc).
Figures F are nonlinear in them with exact slopes (:mod:`tank2sim.analysis.influence.study`).

- ``uncertain``: min sum z^2 with F(z) on target and |z| within bounds (sequential quadratic programming, SLSQP).
- ``fewest``: the smallest set of unknowns that reaches the targets to first order, by mixed-integer programming
  (HiGHS), with least sum |z| among equals; then the nonlinear problem in that set, again from there if it fails.

For targets that cannot all be reached: the smallest contradictory set, by a deletion filter (Chinneck and Dravnieks
1991), and the nearest figures in least squares, by the smallest moves.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import qr
from scipy.optimize import Bounds, LinearConstraint, least_squares, milp, minimize

from tank2sim.analysis.influence.study import Study
from tank2sim.analysis.tuning.result import FEWEST, Means, TunedNumber, TunedStudy, TunedTarget
from tank2sim.analysis.tuning.targets import AT_LEAST, AT_MOST, EQUAL, Target
from tank2sim.arrays import Array
from tank2sim.dynamics.card_parameters import CardParameter, agreed_by_name, find_parameter
from tank2sim.errors import ArgumentError, InputError

Slice = NDArray[np.int64]

_REACHED = 1e-5
"""Relative tolerance of a target: far below the accuracy of a trial."""

_MOVED = 1e-6  # standard errors below which a parameter has not moved
_NOT_SHOWN = 10.0  # what is missing, in shares of the target, where the ship does not show the figure any more
_ROUNDING = 1e-9  # of the largest slope
_DEPENDENT = 1e-6  # of the largest slope: what is left of a row after the others, and is none of its own
_ROUNDS = 8  # sets of parameters that are tried
_LONGEST_SEARCH_S = 20.0  # of one set; the best so far is taken then


def tune(study: Study, targets: Sequence[Target], means: Means) -> TunedStudy:
    """Change a card until its figures reach their targets.

    Parameters
    ----------
    study : Study
        Study with at least the figures of the targets.

    Raises
    ------
    InputError
        `means` has an unknown parameter, or leaves no parameter free.
    """
    problem = _Problem(study, targets, means)
    z, contradiction = problem.start(), tuple[Target, ...]()
    if problem.largest(z) > _REACHED:
        free = problem.influential(z)
        nearest = problem.nearest(z, free)
        if problem.largest(nearest) > _REACHED:
            z, contradiction = problem.least_as_near(nearest, free), problem.contradiction()
        else:
            z = problem.fewest(nearest) if means.by == FEWEST else problem.least_as_near(nearest, free)
    return problem.result(z, contradiction)


class _Problem:
    """The targets as functions of the moves z (m,)."""

    def __init__(self, study: Study, targets: Sequence[Target], means: Means):
        self.study, self.targets, self.means = study, tuple(targets), means
        self._rows = [study.figures.index(target.figure) for target in targets]
        self._wanted = np.array([target.value for target in targets])
        base = study.base[self._rows]
        # A target of zero is measured by the value before.
        self._scale = np.where(self._wanted != 0, np.abs(self._wanted), np.maximum(np.abs(base), 1e-12))
        self._agreed = agreed_by_name(means.agreed, study.parameters)
        self._matrix, self._lowest, self._highest = self._unknowns()
        # Searches ask for the same moves again: by target, by constraint.
        self._figures = lru_cache(maxsize=16)(self._computed_figures)
        self._slopes_known = lru_cache(maxsize=16)(self._computed_slopes)

    def _unknowns(self) -> tuple[Array, Array, Array]:
        """Change of the parameters by the unknowns (k, m), and the bounds of these (m,)."""
        parameters, means = self.study.parameters, self.means
        held = {find_parameter(parameters, name, "hold").name for name in means.hold} | self._agreed.keys()
        stated = {find_parameter(parameters, name, "bounds").name: pair for name, pair in means.bounds.items()}
        if both := [parameter for parameter in parameters if parameter.name in stated.keys() & self._agreed.keys()]:
            remedy = "leave out the bound, or take the parameter out of joint_variation"
            raise ArgumentError("bounds", both[0].short, "moves with the agreed variation alone", remedy)
        columns, ends = [], []
        for place, parameter in enumerate(parameters):
            size = _size(parameter, means.within, stated.get(parameter.name))
            if parameter.name not in held and size:
                columns.append(size * np.eye(len(parameters))[place])
                ends.append(_ends(parameter, size, means.within, stated.get(parameter.name)))
        if self._agreed:
            shares = np.array([self._agreed.get(parameter.name, 0.0) / 100 for parameter in parameters])
            columns.append(self.study.values * shares)
            ends.append((-means.within, means.within))
        if not columns:
            raise ArgumentError("targets", "", "nothing is left to change", "hold fewer parameters, or state bounds")
        lowest, highest = np.array(ends).T
        return np.array(columns).T, lowest, highest

    def start(self) -> Array:
        """No move, or the nearest within the bounds."""
        return np.clip(np.zeros(len(self._lowest)), self._lowest, self._highest)

    def influential(self, z: Array) -> Slice:
        """Unknowns that move a figure of the targets; all unknowns if the ship does not show a figure at `z`."""
        if not np.all(np.isfinite(self.figures(z))):
            return np.arange(len(z))
        return np.flatnonzero(np.any(self._slopes(z) != 0, axis=0))

    def values(self, z: Array) -> Array:
        """Parameters (k,) after the moves."""
        return self.study.values + self._matrix @ z

    def figures(self, z: Array) -> Array:
        """Figures (n,) of the targets after moves z; nan for figures that the ship does not show."""
        return self._figures(z.tobytes())

    def _computed_figures(self, z: bytes) -> Array:
        try:
            return self.study.figures_at(self.values(np.frombuffer(z)))[self._rows]
        except InputError:  # the motion leaves all bounds
            return np.full(len(self._rows), np.nan)

    def _off(self, z: Array) -> Array:
        """Figures less their targets (n,), relative to the targets."""
        off = (self.figures(z) - self._wanted) / self._scale
        return np.where(np.isfinite(off), off, _NOT_SHOWN)

    def _slopes(self, z: Array) -> Array:
        """Slopes (n, m) of :meth:`errors` by the moves."""
        return self._slopes_known(z.tobytes())

    def _computed_slopes(self, z: bytes) -> Array:
        try:
            _, slopes = self.study.slopes_at(self.values(np.frombuffer(z)))
        except InputError:  # the motion leaves all bounds
            return np.zeros((len(self._rows), len(self._lowest)))
        found: Array = np.nan_to_num(slopes[self._rows] @ self._matrix / self._scale[:, None])
        # What has no influence but by rounding shall not move.
        return np.where(np.abs(found) > _ROUNDING * np.max(np.abs(found), axis=1, keepdims=True), found, 0.0)

    def missing(self, z: Array) -> Array:
        """Relative violation (n,) of each target."""
        off = self._off(z)
        least = [0.0 if target.relation == AT_MOST else -np.inf for target in self.targets]
        most = [0.0 if target.relation == AT_LEAST else np.inf for target in self.targets]
        return np.clip(off, least, most)

    def largest(self, z: Array) -> float:
        """The largest relative violation of a target."""
        return float(np.max(np.abs(self.missing(z))))

    def nearest(self, z: Array, free: Slice, rows: Sequence[int] | None = None) -> Array:
        """Moves with the least violation of the targets `rows`, in least squares; only those of `free` change."""
        kept = list(range(len(self.targets))) if rows is None else list(rows)

        def slopes(part: Array) -> Array:
            moved = _with(z, free, part)
            unmet = (self.missing(moved) != 0)[kept]
            found: Array = self._slopes(moved)[kept][:, free] * unmet[:, None]
            return found

        inner = 1e-9 * (self._highest - self._lowest)
        begin = np.clip(z, self._lowest + inner, self._highest - inner)[free]
        solved = least_squares(
            lambda part: self.missing(_with(z, free, part))[kept],
            begin,
            jac=slopes,
            bounds=(self._lowest[free], self._highest[free]),
            xtol=1e-10,
            ftol=1e-6,  # of the squares: they go to zero, or converge for unreachable targets
            gtol=1e-14,
            max_nfev=40,
        )
        return _with(z, free, solved.x)

    def least(self, z: Array, free: Slice) -> Array:
        """The smallest moves (sum of squares) of `free` that reach the targets, from moves `z` that reach them."""
        constraints = []
        for row, target in enumerate(self.targets):
            sign = -1.0 if target.relation == AT_MOST else 1.0

            def value(part: Array, row: int = row, sign: float = sign) -> float:
                return sign * float(self._off(_with(z, free, part))[row])

            def slope(part: Array, row: int = row, sign: float = sign) -> Array:
                return np.asarray(sign * self._slopes(_with(z, free, part))[row, free])

            kind = "eq" if target.relation == EQUAL else "ineq"
            constraints.append({"type": kind, "fun": value, "jac": slope})
        solved = minimize(
            lambda part: 0.5 * float(part @ part),
            z[free],
            jac=lambda part: part,
            method="SLSQP",
            bounds=list(zip(self._lowest[free], self._highest[free], strict=True)),
            constraints=constraints,
            options={"ftol": 1e-9, "maxiter": 30},
        )
        found = _with(z, free, np.clip(solved.x, self._lowest[free], self._highest[free]))
        # What the search leaves (it stops by its own measure) one more refinement takes away.
        return found if self.largest(found) <= _REACHED else self._refined(found, z, free)

    def least_as_near(self, z: Array, free: Slice) -> Array:
        """The smallest moves of `free` that come as near to the targets as moves `z` do.

        Figures that miss their targets are held at their values; of dependent figures (a radius and its diameter, a
        repeated target) only one is held, because more would make the search infeasible.
        """
        figures, missed = self.figures(z), np.abs(self.missing(z)) > _REACHED
        if not np.all(np.isfinite(figures)):
            return z
        tight = [row for row, target in enumerate(self.targets) if target.relation == EQUAL or missed[row]]
        kept = [tight[index] for index in _independent(self._slopes(z)[tight][:, free])] if tight else []
        values = np.where(missed, figures, self._wanted)
        targets = [Target(self.targets[row].figure, EQUAL, float(values[row])) for row in kept]
        targets += [target for row, target in enumerate(self.targets) if row not in tight]
        return _Problem(self.study, targets, self.means).least(z, free)

    def _refined(self, found: Array, fallback: Array, free: Slice) -> Array:
        refined = self.nearest(found, free)
        return refined if self.largest(refined) <= _REACHED else fallback

    def fewest(self, whole: Array) -> Array:
        """Moves of the fewest unknowns that reach the targets; `whole`, with all unknowns, if no smaller set does."""
        at, tried = self.start(), list[Slice]()
        for _ in range(_ROUNDS):
            free = self._smallest_set(at, tried)
            if free is None:
                break
            at = self.nearest(self.start(), free)
            if self.largest(at) <= _REACHED:
                return self.least(at, free)
            tried.append(free)  # to first order it was enough: next time from where it came to
        return whole

    def _smallest_set(self, at: Array, tried: Sequence[Slice]) -> Slice | None:
        """The fewest unknowns, except the sets `tried`, that reach the targets to first order about `at`."""
        off, slopes = self._off(at), self._slopes(at)
        m = len(at)
        aim = slopes @ at - off
        lower, upper = aim - _REACHED, aim + _REACHED
        lower[[target.relation == AT_MOST for target in self.targets]] = -np.inf
        upper[[target.relation == AT_LEAST for target in self.targets]] = np.inf
        unit, zero = np.eye(m), np.zeros((m, m))
        # unknowns: moves z, whether each is used b, and its size t >= |z|
        constraints = [
            LinearConstraint(np.hstack([slopes, np.zeros((len(off), 2 * m))]), lower, upper),
            LinearConstraint(np.hstack([unit, -np.diag(self._highest), zero]), -np.inf, 0.0),
            LinearConstraint(np.hstack([unit, -np.diag(self._lowest), zero]), 0.0, np.inf),
            LinearConstraint(np.hstack([unit, zero, -unit]), -np.inf, 0.0),
            LinearConstraint(np.hstack([unit, zero, unit]), 0.0, np.inf),
        ]
        for free in tried:
            row = -np.ones(m)
            row[free] = 1.0
            cut = np.concatenate([np.zeros(m), row, np.zeros(m)])
            constraints.append(LinearConstraint(cut[None], -np.inf, len(free) - 1.0))
        widest = float(np.sum(np.maximum(np.abs(self._lowest), np.abs(self._highest))))
        solved = milp(
            np.concatenate([np.zeros(m), np.ones(m), np.full(m, 0.5 / widest)]),
            integrality=np.concatenate([np.zeros(m), np.ones(m), np.zeros(m)]),
            bounds=Bounds(
                np.concatenate([np.minimum(self._lowest, 0), np.zeros(2 * m)]),
                np.concatenate([np.maximum(self._highest, 0), np.ones(m), np.full(m, np.inf)]),
            ),
            constraints=constraints,
            options={"time_limit": _LONGEST_SEARCH_S},
        )
        return None if solved.x is None else np.flatnonzero(solved.x[m : 2 * m] > 0.5)

    def contradiction(self) -> tuple[Target, ...]:
        """A minimal set of targets that cannot be reached together."""
        kept = list(range(len(self.targets)))
        everything = np.arange(len(self._lowest))
        for row in list(kept):
            fewer = [kept_row for kept_row in kept if kept_row != row]
            if not fewer:
                break
            z = self.nearest(self.start(), everything, fewer)
            if np.max(np.abs(self.missing(z)[fewer])) > _REACHED:
                kept = fewer
        return tuple(self.targets[row] for row in kept)

    def result(self, z: Array, contradiction: tuple[Target, ...]) -> TunedStudy:
        """Result of moves `z`."""
        z = np.where(np.abs(z) < _MOVED, 0.0, z)
        study, values = self.study, self.values(z)
        before_after = zip(self.targets, study.base[self._rows].tolist(), self.figures(z).tolist(), strict=True)
        moved = {
            parameter.key: _changed(parameter, float(after))
            for parameter, after in zip(study.parameters, values, strict=True)
            if after != parameter.value
        }
        names = [figure.text for figure in study.figures]
        return TunedStudy(
            reached=not contradiction,
            by=self.means.by,
            within_standard_errors=self.means.within,
            targets={
                one.text: TunedTarget(
                    figure=one.figure.text, wanted=one.value, relation=one.relation, before=old, after=new
                )
                for one, old, new in before_after
            },
            parameters=dict(sorted(moved.items(), key=lambda item: -abs(item[1].standard_errors or np.inf))),
            agreed_times=float(z[-1]) if self._agreed else None,
            contradiction=tuple(target.text for target in contradiction),
            figures=dict(zip(names, study.figures_at(values).tolist(), strict=True)),
            values=values,
        )


def _changed(parameter: CardParameter, after: float) -> TunedNumber:
    """A parameter with another value, as the card's file has it."""
    error, factor = parameter.standard_error, parameter.factor
    moved = math.copysign(1.0, factor) * (after - parameter.value) / error if error > 0 else None
    return TunedNumber(
        name=parameter.short, before=parameter.value * factor, after=after * factor, standard_errors=moved
    )


def _independent(slopes: Array) -> list[int]:
    """Linearly independent rows of slopes (n, m)."""
    _, R, order = qr(slopes.T, mode="economic", pivoting=True)
    sizes = np.abs(np.diag(R))
    return sorted(int(row) for row in order[: len(sizes)][sizes > _DEPENDENT * sizes.max(initial=0.0)])


def _with(z: Array, free: Slice, part: Array) -> Array:
    whole = z.copy()
    whole[free] = part
    return whole


def _size(parameter: CardParameter, within: float, stated: tuple[float, float] | None) -> float:
    """Unit of the moves of a parameter: its standard error, or what makes its stated bounds; an exact number moves only
    where it is allowed to."""
    if stated is None or parameter.standard_error:
        return parameter.standard_error
    return abs(stated[1] - stated[0]) / abs(parameter.factor) / (2 * within)


def _ends(
    parameter: CardParameter, size: float, within: float, stated: tuple[float, float] | None
) -> tuple[float, float]:
    """Lowest and highest move of a parameter: as stated, or `within` standard errors; always within its bounds."""
    low, high = parameter.value - within * size, parameter.value + within * size
    if stated is not None:
        low, high = sorted(end / parameter.factor for end in stated)
    least, most = parameter.bounds
    low, high = max(low, -np.inf if least is None else least), min(high, np.inf if most is None else most)
    if not low < high:
        raise ArgumentError("bounds", parameter.short, "leaves no room", "give LOW..HIGH with LOW below HIGH")
    return (low - parameter.value) / size, (high - parameter.value) / size
