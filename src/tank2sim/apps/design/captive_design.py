"""Design of a captive campaign: the runs, with repeats, that make figures most certain, against the usual matrix."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from tank2sim.analysis.influence.figures import InfluenceFigure
from tank2sim.apps.design.allocation import Allocation, InformationBlock, certainty, least_time, target_matrices
from tank2sim.apps.design.captive_information import PlannedCampaign
from tank2sim.apps.design.captive_runs import PlannedRun, RunGroup, TankRuns, time_of
from tank2sim.apps.design.figure_slopes import FigureSlopes, figure_slopes, hydrodynamic_derivatives, range_of_figures
from tank2sim.apps.design.study import Certainty, GaugeStudy, PlannedCoefficient
from tank2sim.apps.design.tank_form import GAUGE_UNITS, TankFile, refuse_contradictions
from tank2sim.arrays import Array
from tank2sim.cards.card import ManoeuvringCard
from tank2sim.cards.writing import TestedRange
from tank2sim.errors import ArgumentError, InputError
from tank2sim.identification.captive.equations import candidate_terms
from tank2sim.identification.captive.tank_conditions import SHORTEST_MODEL_M
from tank2sim.records.campaign_form import ModelSection
from tank2sim.records.captive_record import FORCE_COLUMNS

DRAWN_SHIPS = 12
"""Ships drawn from the errors of the card. Project choice: the plan is then as good for them on average; with 50 it is
the same within its rounding."""

_BEYOND = 1.25
"""Range of a gauge over the largest force of the usual matrix, where the tank does not state it. Project choice."""

_LEAST_ERROR = 1e-4
"""Least noise and zero error of a gauge together, over its range. Project choice: the best gauges have as much; with a
tenth of it runs without force have so much more information than others that the sums lose their digits."""

_HOURS = (0.4, 0.6, 0.8)
"""Shares of the hours at which certainty is drawn, next to all of them."""

_TERMS = [term.name for force in FORCE_COLUMNS for term in candidate_terms(force) if not term.u]
"""Terms that may become known."""

_NOT_IN_CARD = ("X0",)
"""Terms that the tank measures and that a card does not take: the resistance of a towed model."""


@dataclass(frozen=True, kw_only=True)
class PlannedTest:
    """A group of runs of the plan: a run, or one to either side.

    `check`: it is there to show whether the polynomial holds.
    """

    runs: RunGroup
    repeats: int
    check: bool


@dataclass(frozen=True, eq=False, kw_only=True)
class CaptiveDesign:
    """A designed campaign.

    `hours`: in the tank at most; `tests`: the plan; `usual`: the usual matrix, once; `standard_errors`,
    `usual_standard_errors` (m,): errors of each figure, by the plan and by the usual matrix in the same hours, but at
    least once; `gauge_shares`: gauge (X, Y, N) to the share (m,) of each figure's variance by the plan that is in its
    coefficients; `beyond_use`: gauge to its stated range over the largest force of the usual matrix; `ratios` (m,):
    variance of each figure by the plan over its variance by the usual matrix, mean over the ships that the card may be;
    `hours_needed`: least hours in which a plan has every figure as certain as the usual matrix in `hours`;
    `not_excited`: coefficients that move a figure and that no run of this tank excites; `too_strong`: candidates left
    out because a force exceeds the range of its gauge.
    """

    card: ManoeuvringCard
    tank_runs: TankRuns
    planned: PlannedCampaign
    slopes: FigureSlopes
    hours: float
    tests: tuple[PlannedTest, ...]
    usual: tuple[RunGroup, ...]
    standard_errors: Array
    usual_standard_errors: Array
    gauge_shares: Mapping[str, Array]
    beyond_use: Mapping[str, float]
    ratios: Array
    curve: Certainty
    hours_needed: float | None
    coefficients: dict[str, PlannedCoefficient]
    not_excited: tuple[str, ...]
    too_strong: int

    @property
    def runs(self) -> tuple[PlannedRun, ...]:
        """All runs of the plan in their order: round by round, so that repeats are apart."""
        rounds = max((test.repeats for test in self.tests), default=0)
        return tuple(run for n in range(rounds) for test in self.tests if test.repeats > n for run in test.runs)

    @property
    def hours_used(self) -> float:
        """Time in the tank, h."""
        return sum(run.tank_s for run in self.runs) / 3600

    @property
    def compared_hours(self) -> float:
        """Hours of the usual matrix with which the plan is compared: the same, or its own where those are fewer."""
        return max(self.hours, self.usual_hours)

    @property
    def usual_hours(self) -> float:
        """Time of the usual matrix once, h."""
        return time_of(self.usual) / 3600


@dataclass(frozen=True, kw_only=True)
class CaptiveDesignSettings:
    """Requirements of a design.

    `hours`: in the tank, by default the time of the usual matrix; `usual`: in place of the usual matrix; `largest`: to
    which the tests go, by default as far as the manoeuvres of the figures; `check_runs`: whether the plan has runs that
    check the polynomial; `one_side`: figures to the side of the given rudder, in place of the mean over both sides;
    `draws`, `seed`: ships drawn from the errors of the card; `source`: file of the tank, which messages name.
    """

    hours: float | None = None
    usual: tuple[RunGroup, ...] | None = None
    largest: TestedRange | None = None
    check_runs: bool = True
    one_side: bool = False
    draws: int = DRAWN_SHIPS
    seed: int = 0
    source: str = "tank"


class CaptiveDesigner:
    """Plans for a ship in a tank; the ship does not show a figure, or the tank cannot make the runs: InputError.

    `card`: polynomial; its values are the prior mean, its errors the spread of ships for which the plan is to be good.
    """

    def __init__(
        self,
        card: ManoeuvringCard,
        tank: TankFile,
        figures: Sequence[InfluenceFigure],
        settings: CaptiveDesignSettings,
    ) -> None:
        self.card, self.settings = card, settings
        self.slopes = figure_slopes(
            card, figures, _TERMS, draws=settings.draws, seed=settings.seed, one_side=settings.one_side
        )
        reach = settings.largest or range_of_figures(card, figures)
        self.tank_runs = tank_runs(card, tank, reach, settings.source)
        usual = settings.usual
        if usual is None:
            usual = self.tank_runs.usual_matrix()
            if not any(group[0].oscillates for group in usual):
                remedy = "widen its limits of amplitude or frequency"
                raise InputError(settings.source, "mechanism", "allows no oscillation", remedy)
        self.planned = self._with_gauges(usual)
        self.usual = self._within_gauges(usual)
        every = self.tank_runs.candidates(settings.usual or ())
        candidates = self._within_gauges(every)
        self.too_strong = len(every) - len(candidates)
        # Every check that a plan may need, as without any plan.
        checks = self._within_gauges(self.tank_runs.check_runs(())) if settings.check_runs else ()
        self.groups = (*candidates, *checks, *self.usual)
        ends = len(candidates), len(candidates) + len(checks)
        parts = np.split(np.arange(len(self.groups)), ends)
        self.places = dict(zip(("candidates", "checks", "usual"), parts, strict=True))
        if not candidates or not self.usual:
            remedy = "state wider ranges"
            raise InputError(settings.source, "gauges", "allow no run: every force exceeds their ranges", remedy)
        self.information = self.planned.information(self.groups)

    def _with_gauges(self, usual: Sequence[RunGroup]) -> PlannedCampaign:
        """The campaign with errors of the gauges, whose ranges follow from the usual matrix where none is stated."""
        tank, runs = self.tank_runs.tank, self.tank_runs
        density, body = tank.model.water_density_kgpm3, self.card.rigid_body
        mass = 0.5 * density * runs.length_m**3
        bare = PlannedCampaign(
            model=ModelSection(
                name=self.card.ship.name,
                length_m=runs.length_m,
                mass_kg=body.mass * mass,
                yaw_inertia_kgm2=body.yaw_inertia * mass * runs.length_m**2,
                x_G_m=body.x_G * runs.length_m,
            ),
            speed_mps=runs.speed_mps,
            water_density_kgpm3=density,
            gravity_mps2=tank.model.gravity_mps2,
            derivatives=hydrodynamic_derivatives(self.card),
            gauges={},
            gain_relative=tank.gauges.gain_relative,
            rate_hz=tank.gauges.rate_hz,
        )
        largest = [bare.largest_forces(run) for group in usual for run in group]
        self.beyond_use: dict[str, float] = {}
        used = {force: max(forces[force] for forces in largest) for force in GAUGE_UNITS}
        return replace(bare, gauges={force: self._gauge(force, most) for force, most in used.items()})

    def _gauge(self, force: str, used: float) -> GaugeStudy:
        """A gauge with its errors; `used` is the largest force of the usual matrix."""
        gauges, unit = self.tank_runs.tank.gauges, GAUGE_UNITS[force]
        stated, noise, zero = (gauges.stated(what, force) for what in ("range", "noise", "zero"))
        span = stated or _BEYOND * used
        self.beyond_use[force] = span / used if stated and used > 0 else 1.0
        noise, zero = noise or gauges.noise_share * span, zero or gauges.zero_share * span
        if math.hypot(noise, zero) < _LEAST_ERROR * span:
            problem = f"states no error of {force}: noise {noise:.2g} and zero {zero:.2g} {unit} of {span:.3g} {unit}"
            remedy = f"give noise or zero of at least {_LEAST_ERROR:g} of the range"
            raise InputError(self.settings.source, "gauges", problem, remedy)
        return GaugeStudy(noise=max(noise, 1e-9 * span), zero=zero, range=span if stated else math.inf)

    def _within_gauges(self, groups: Sequence[RunGroup]) -> tuple[RunGroup, ...]:
        limits = {force: gauge.range for force, gauge in self.planned.gauges.items() if math.isfinite(gauge.range)}

        def fits(run: PlannedRun) -> bool:
            forces = self.planned.largest_forces(run) if limits else {}
            return all(forces[force] <= limit for force, limit in limits.items())

        return tuple(group for group in groups if all(map(fits, group)))

    @cached_property
    def usual_counts(self) -> Array:
        """Counts of the usual matrix once, over all groups."""
        counts = np.zeros(len(self.groups))
        counts[self.places["usual"]] = 1.0
        return counts

    @cached_property
    def usual_s(self) -> float:
        """Time of the usual matrix once, s."""
        return time_of(self.usual)

    @cached_property
    def _at_card(self) -> Allocation:
        """Figures of the card's ship as targets."""
        return self._allocation([self.slopes.at_card[None, row] for row in range(len(self.slopes.figures))])

    def _allocation(self, slopes: Sequence[Array]) -> Allocation:
        blocks = []
        for names, information in self.information.values():
            kept = [0.0 if name in _NOT_IN_CARD else 1.0 for name in names]
            targets = target_matrices([self.slopes.of(names, each) * kept for each in slopes])
            blocks.append(InformationBlock(self.planned.prior(names), information, targets))
        return Allocation(tuple(blocks), np.array([time_of([group]) for group in self.groups]))

    def _over_usual(self, counts: Array) -> Allocation:
        """Variance by the usual matrix over that with these counts: card's ship, and mean of drawn ships."""
        by_card = self._at_card.variances(counts)
        drawn = self.slopes.drawn
        relative = []
        for row in range(len(self.slopes.figures)):
            each = self._allocation([drawn[None, number, row] for number in range(len(drawn))]).variances(counts)
            relative.append(drawn[:, row] / np.sqrt(each)[:, None])
        means = self._allocation(relative)
        first = self._at_card.scaled(by_card)
        blocks = [
            InformationBlock(one.prior, one.tests, np.concatenate([one.targets, mean.targets]))
            for one, mean in zip(first.blocks, means.blocks, strict=True)
        ]
        return Allocation(tuple(blocks), first.cost)

    def plan(self, budget: float, start: Array | None = None) -> tuple[Array, Array]:
        """Whole counts over all groups within the budget (s), and the relaxed counts of the candidates."""
        counts, relaxed = self._filled_plan(np.zeros(len(self.groups)), budget, start)
        if not self.settings.check_runs:
            return counts, relaxed
        planned = [self.groups[place] for place in np.flatnonzero(counts)]
        lacking = self.tank_runs.check_runs(planned)
        fixed = np.zeros(len(self.groups))
        for place in self.places["checks"]:
            fixed[place] = float(self.groups[place] in lacking)
        if not fixed.any() or fixed @ self._targets.cost >= budget / 2:
            return counts, relaxed
        return self._filled_plan(fixed, budget, relaxed)

    def _filled_plan(self, fixed: Array, budget: float, start: Array | None) -> tuple[Array, Array]:
        """The best whole counts that have the `fixed` ones, and the relaxed counts of the candidates."""
        counts, left = fixed.copy(), budget - float(fixed @ self._targets.cost)
        chosen = self.places["candidates"]
        rest = self._targets.with_fixed(fixed)
        allocation = Allocation(
            tuple(InformationBlock(block.prior, block.tests[chosen], block.targets) for block in rest.blocks),
            rest.cost[chosen],
        )
        if left < allocation.cost.min():
            raise ArgumentError("hours", f"{budget / 3600:.3g}", "has no room for a run", "give more hours")
        relaxed, _ = allocation.relaxed(left, start)
        counts[chosen] += allocation.whole(left, relaxed)
        return counts, relaxed

    @cached_property
    def _budget(self) -> float:
        return self.usual_s if self.settings.hours is None else 3600 * self.settings.hours

    @cached_property
    def _usual(self) -> Array:
        """Counts of the usual matrix repeated to fill the hours of the plan, at least once as a whole."""
        return self.usual_counts * max(self._budget / self.usual_s, 1.0)

    @cached_property
    def _targets(self) -> Allocation:
        return self._over_usual(self._usual)

    def design(self) -> CaptiveDesign:
        """The plan and what it is worth."""
        usual = self._usual
        counts, relaxed = self.plan(self._budget)

        def plan(share: float) -> Array | None:
            nonlocal relaxed
            try:
                made, relaxed = self.plan(share * self._budget, relaxed)
            except InputError:
                return None
            return made

        plans = {1.0: counts} | {share: made for share in _HOURS if (made := plan(share)) is not None}
        needed = least_time(self._targets, plans, plan, None)
        figures = self.slopes.texts
        usual_s = sorted({max(share * self._budget, self.usual_s) for share in plans})
        checks = set(self.places["checks"].tolist())
        return CaptiveDesign(
            card=self.card,
            tank_runs=self.tank_runs,
            planned=self.planned,
            slopes=self.slopes,
            hours=self._budget / 3600,
            tests=tuple(
                PlannedTest(runs=self.groups[place], repeats=round(counts[place]), check=place in checks)
                for place in np.flatnonzero(counts)
            ),
            usual=self.usual,
            standard_errors=np.sqrt(self._at_card.variances(counts)),
            usual_standard_errors=np.sqrt(self._at_card.variances(usual)),
            gauge_shares=self._gauge_shares(counts),
            beyond_use=self.beyond_use,
            ratios=self._targets.variances(counts)[len(figures) :],
            curve=certainty(figures, self._at_card, plans, self.usual_counts, usual_s),
            hours_needed=None if needed is None else needed / 3600,
            coefficients=self._coefficients(counts, usual),
            not_excited=self._not_excited(),
            too_strong=self.too_strong,
        )

    def _gauge_shares(self, counts: Array) -> dict[str, Array]:
        """Share of each figure's variance in the coefficients of each force."""
        total = self._at_card.variances(counts)
        blocks = zip(self.information, self._at_card.blocks, strict=True)
        return {force: Allocation((block,), self._at_card.cost).variances(counts) / total for force, block in blocks}

    def _coefficients(self, counts: Array, usual: Array) -> dict[str, PlannedCoefficient]:
        """Standard errors of the coefficients, and the share of each figure's variance that each would take along."""
        found: dict[str, PlannedCoefficient] = {}
        totals = self._at_card.variances(counts)
        for (names, _), block in zip(self.information.values(), self._at_card.blocks, strict=True):
            by_plan, by_usual = block.covariance(counts), block.covariance(usual)
            together = by_plan @ self.slopes.of(names, self.slopes.at_card).T
            shares = together**2 / np.outer(np.diag(by_plan), totals)
            for place, name in enumerate(names):
                of_figures = zip(self.slopes.texts, shares[place].tolist(), strict=True)
                found[name] = PlannedCoefficient(
                    value=self.planned.derivatives.get(name, 0.0),
                    design=math.sqrt(by_plan[place, place]),
                    usual=math.sqrt(by_usual[place, place]),
                    share_of_variance={} if name in _NOT_IN_CARD else dict(of_figures),
                )
        return found

    def _not_excited(self) -> tuple[str, ...]:
        """Derivatives of the card that move a figure and are in no regression."""
        measured = {name for names, _ in self.information.values() for name in names}
        moving = np.abs(self.slopes.at_card).max(axis=0) > 0
        shown = [one for one, moves in zip(self.slopes.parameters, moving, strict=True) if moves]
        names = [one.short for one in shown if one.name.startswith("derivatives.") and one.short not in measured]
        return tuple(name for name in names if self.card.derivatives.get(name))


def tank_runs(card: ManoeuvringCard, tank: TankFile, largest: TestedRange, source: str = "tank") -> TankRuns:
    """The runs of a ship's model in a tank, at the stated length and speed, or at the card's Froude number.

    Raises InputError: the carriage is too slow or too short, or the tank contradicts itself (then `source` is named).
    """
    model = tank.model
    length = model.length_m or min(SHORTEST_MODEL_M, card.ship.length_m)
    ratio = length / card.ship.length_m * model.gravity_mps2 / card.environment.gravity_mps2
    speed = model.speed_mps or card.model.speed_mps * math.sqrt(ratio)
    scale = length / card.ship.length_m
    beam, draught = (None if size is None else size * scale for size in (card.ship.beam_m, card.ship.draught_m))
    refuse_contradictions(tank, source, length, beam, draught)
    return TankRuns(tank=tank, length_m=length, speed_mps=speed, largest=largest)
