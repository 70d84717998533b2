"""Selection of the terms of (3.8) that a campaign determines, with the reason for every omitted term.

Every term that the campaign excites and can distinguish is in the regression, third-order terms with a prior about zero
(:func:`with_prior`). The report of a term depends on the design of the tests and never on its value: omission of a term
because it does not differ from zero would state that it is exactly zero, and would change every manoeuvre that needs
it. Reported are the linear terms, the acceleration derivatives, X0, and every other term on which the tests have more
information than the prior: at large angles with a small standard error, at small angles with a large one. A term that
is not reported still contributes to the standard errors of the other terms.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import stdtrit

from tank2sim.cards.terms import known_term
from tank2sim.identification.captive.equations import CampaignEquations, campaign_equations, candidate_terms, excited
from tank2sim.identification.captive.harmonics import ReducedRun
from tank2sim.identification.captive.oscillation import distinct
from tank2sim.identification.captive.regression import Solution, Spread, fitted_spread, solve
from tank2sim.identification.conditioning import COLLINEAR, scaled_condition
from tank2sim.records.campaigns import Campaign

DETERMINED = math.sqrt(0.5)
"""Largest standard error of a reported third-order term, in the standard deviations of its prior: the tests then weigh
at least as much as the prior of known ships (1/s^2 - 1 >= 1) and determine the value."""

_NORMAL = 1.959964
"""Standard errors of a two-sided 95 % interval of the normal distribution."""

_SHOWN_SLOPE = 3.5
"""Standard errors of a significant slope: with eight slopes in a campaign chance reaches it once in 250."""
_FEWEST_FREQUENCIES = 3

RATIOS: Mapping[str, tuple[str, float]] = {
    "vvv": ("v", 10.0),
    "vvr": ("v", 25.0),
    "vrr": ("v", 10.0),
    "rrr": ("v", 1.0),
    "ddd": ("d", 1.0),
    "vvd": ("d", 6.0),
    "vdd": ("d", 2.0),
    "rdd": ("d", 2.0),
    "rrd": ("d", 2.0),
    "vrd": ("d", 6.0),
}
"""Powers of a term of Y or N to the linear term of the ratio, and the standard deviation of the ratio (prime).

Round figures, above the largest of the Mariner (Chislett & Strom-Tejsen 1965: Yvvv/Yv 7.0, Yvvr/Yv 13, Nvvr/Nv 21,
Nvvv/Nv 6.2, Nvvd/Nd 3.5, Yvvd/Yd 4.3, Yddd/Yd 0.32). Other terms are free."""


@dataclass(frozen=True)
class Choice:
    """Decision on a candidate term."""

    name: str  # The term
    kept: bool  # True for a reported term
    # ``linear``, ``determined``, ``asked for``, ``not excited``, ``collinear``, ``not determined``, ``trend``
    reason: str
    explanation: str  # The reason in a sentence, with its figures
    # `inflation`, `ratio`: Variance inflation factor, and value over standard error, at the decision
    inflation: float | None = None
    ratio: float | None = None


@dataclass(frozen=True, eq=False)
class Selection:
    """The regression over the whole campaign: equations of all terms that it can distinguish, and the decision on each
    candidate.

    Terms of the regression that the tests do not determine have ``kept`` false: they are not reported.
    """

    equations: CampaignEquations
    spread: Spread
    choices: tuple[Choice, ...]

    @property
    def reported(self) -> tuple[str, ...]:
        """Terms of the result."""
        return tuple(choice.name for choice in self.choices if choice.kept)

    @property
    def widening(self) -> float:
        """Student's t over the normal quantile, by which the errors are widened."""
        free = len(self.equations.names) - len(self.equations.prior)
        return float(stdtrit(max(1, len(self.equations.runs) - free), 0.975)) / _NORMAL

    @property
    def solution(self) -> Solution:
        """All terms of the regression, its errors widened by Student's t over the normal quantile.

        Thus 1.96 standard errors are a 95 % interval, although the scatter is an estimate with runs less free terms as
        degrees of freedom.
        """
        solution = solve(self.equations, self.spread)
        return replace(solution, covariance=solution.covariance * self.widening**2)


def select(campaign: Campaign, runs: Sequence[ReducedRun], force: str, *, all_terms: bool = False) -> Selection:
    """Choose the terms of one force.

    Raises InputError: As :func:`tank2sim.identification.captive.equations.campaign_equations`.
    """
    choices: dict[str, Choice] = {}
    used = distinguishable_equations(campaign, runs, force, choices)
    spread = fitted_spread(used)
    used = with_prior(used, spread)
    selection = Selection(used, spread, ())
    solution = selection.solution
    for place, name in enumerate(used.names):
        choices[name] = _judged(solution, place, used.prior.get(name, math.inf), all_terms=all_terms)
    order = [term.name for term in candidate_terms(force, heeled=True)]
    return replace(selection, choices=tuple(sorted(choices.values(), key=lambda choice: order.index(choice.name))))


def distinguishable_equations(
    campaign: Campaign, runs: Sequence[ReducedRun], force: str, choices: dict[str, Choice]
) -> CampaignEquations:
    """The equations of all distinguishable excited terms; decisions on other terms are added to `choices`."""
    active = []
    for term in candidate_terms(force, heeled=any(run.motion.heel_rad for run in runs)):
        if excited(campaign, runs, term):
            active.append(term.name)
        else:
            choices[term.name] = Choice(term.name, False, "not excited", f"no run excites {term.name}")
    full = campaign_equations(campaign, runs, force, active)
    return full.of_terms(_keep_distinguishable(full, choices))


def _judged(solution: Solution, place: int, held: float, *, all_terms: bool) -> Choice:
    """Decision on a term of the regression with prior standard deviation `held`."""
    name, ratio = solution.names[place], float(solution.ratios[place])
    value, error = solution.values[place], solution.standard_errors[place]
    if _always(name):
        reason, explanation = "linear", f"value / standard error {ratio:.3g}"
    elif error <= DETERMINED * held:
        reason, explanation = "determined", f"value / standard error {ratio:.3g}"
    else:
        reason = "asked for" if all_terms else "not determined"
        explanation = (
            f"the tests reach too small angles to show it: {value:.3g} ± {error:.2g}, and known ships scatter by "
            f"{held:.2g}; its uncertainty is in the errors of the others"
        )
    return Choice(name, reason != "not determined", reason, explanation, float(solution.inflation[place]), ratio)


def _always(name: str) -> bool:
    term = known_term(name)
    return bool(term.acceleration) or name == "X0" or sum(term.powers.values()) == 1


def _keep_distinguishable(full: CampaignEquations, choices: dict[str, Choice]) -> list[str]:
    """Distinguishable terms, the simplest first: each must keep the condition number within its limit."""
    kept: list[str] = []
    conditions = _conditions(full)
    for name in sorted(full.names, key=_simplicity):
        # The zero of Y and N is always unknown, also if its term is not in the result.
        spare = 0 if full.force == "X" or {"Y0", "N0"} & {name, *kept} else 1
        if len(kept) + spare >= conditions or (conditions < 2 and name != "X0"):
            text = f"{conditions} distinct condition{'s' * (conditions > 1)} cannot show it next to the zero"
            choices[name] = Choice(name, False, "not excited", f"{' and '.join([text, *kept])}")
            continue
        part = full.of_terms([*kept, name])
        weighted = Spread(1.0, usual_zero(full)).weighted(part, part.design)
        condition = scaled_condition(weighted)
        if condition <= COLLINEAR or _always(name):
            kept.append(name)
            continue
        column, simpler = weighted[:, -1], weighted[:, :-1]
        remainder = column - simpler @ np.linalg.lstsq(simpler, column, rcond=None)[0]
        inflation = float(column @ column / max(float(remainder @ remainder), 1e-300))
        text = (
            f"the runs cannot distinguish it from simpler terms: variance inflation {inflation:.3g}, condition number "
            f"{condition:.3g} with it, above the limit of {COLLINEAR:g}"
        )
        choices[name] = Choice(name, False, "collinear", text, inflation)
    return sorted(kept, key=full.names.index)


def _conditions(full: CampaignEquations) -> int:
    """Number of distinct conditions: an oscillating run counts once for each of its coefficients."""
    steady = {
        (
            *np.round([m.v_mps[0] / m.speed_mps[0], m.delta_rad[0], m.speed_mps[0]], 2).tolist(),
            round(float(m.r_radps[0] / m.speed_mps[0]), 4),
            round(m.heel_rad, 2),
        )
        for m in (run.motion for run in full.runs if not run.run.oscillates)
    }
    return len(steady) + sum(run.regressed for run in full.runs if run.run.oscillates)


def _simplicity(name: str) -> tuple[int, ...]:
    """Sort key: linear terms first, then by order, and within an order terms in one motion before mixed terms."""
    term = known_term(name)
    mixed = len(term.powers)
    return (not _always(name), sum(term.powers.values()), term.u, term.phi, mixed, term.d, term.r)


def usual_zero(full: CampaignEquations) -> float:
    """Zero error that gives all means similar weights, so that only the tests determine the distinguishable terms."""
    return float(np.median([root[0, 0] for root in full.roots])) ** 2


@dataclass(frozen=True, kw_only=True)
class Trend:
    """Trend of one term with frequency."""

    name: str  # The term
    # `slope`, `standard_error`: Change of its prime value by (omega L/U)^2
    slope: float
    standard_error: float
    # `at_zero`, `error_at_zero`: Its value extrapolated to zero frequency, with this slope in the regression
    at_zero: float
    error_at_zero: float
    used: bool  # True for a significant slope: the result's value is that at zero frequency


def trends(campaign: Campaign, selection: Selection) -> tuple[Selection, tuple[Trend, ...]]:
    """The selection with the significant trends with frequency among its terms, and all trends that can be estimated.

    For slow motions damping and added mass are even functions of the frequency: value at zero plus a slope times
    (omega L/U)^2. A significant trend stays in the regression, so that the value of its term is the one at zero
    frequency; static tests, which are at zero frequency, take part.
    """
    used = selection.equations
    candidates = [*_terms_at_frequencies(used, "v", "pure_sway"), *_terms_at_frequencies(used, "r", "pure_yaw")]
    if not candidates:
        return selection, ()
    full = campaign_equations(campaign, used.runs, used.force, [*used.names, *map(_slope, candidates)]).held(used.prior)
    shown, others = _significant_trends(full, used.names, candidates, selection)
    if not shown:
        return selection, others
    names = [*used.names, *map(_slope, shown)]
    chosen = [
        Choice(_slope(name), True, "trend", f"{name} changes with the frequency; its value is that at zero frequency")
        for name in shown
    ]
    widened = full.of_terms(names)
    result = replace(selection, equations=widened, spread=fitted_spread(widened), choices=(*selection.choices, *chosen))
    kept = [_trend(full, [term for term in names if term != _slope(name)], name, result) for name in shown]
    return result, (*(replace(trend, used=True) for trend in kept if trend is not None), *others)


def _terms_at_frequencies(used: CampaignEquations, motion: str, kind: str) -> list[str]:
    """Damping and added mass of a motion, if runs of a kind were made at enough frequencies."""
    frequencies = [run.motion.frequency_radps for run in used.runs if run.run.type == kind]
    if distinct(frequencies) < _FEWEST_FREQUENCIES:
        return []
    return [name for name in (f"{used.force}{motion}", f"{used.force}{motion}dot") if name in used.names]


def _significant_trends(
    full: CampaignEquations, names: Sequence[str], candidates: Sequence[str], selection: Selection
) -> tuple[list[str], tuple[Trend, ...]]:
    """Terms with a significant trend, taken into the regression one by one, and the trends of the other candidates."""
    shown: list[str] = []
    while True:
        terms, left = [*names, *map(_slope, shown)], [name for name in candidates if name not in shown]
        others = tuple(trend for name in left if (trend := _trend(full, terms, name, selection)) is not None)
        best = max(others, key=_ratio, default=None)
        if best is None or _ratio(best) < _SHOWN_SLOPE:
            return shown, others
        shown.append(best.name)


def _slope(name: str) -> str:
    return f"{name} w2"


def _trend(full: CampaignEquations, names: Sequence[str], name: str, selection: Selection) -> Trend | None:
    """The trend of one term next to the named terms; None if the runs cannot distinguish it from them."""
    part = full.of_terms([*names, _slope(name)])
    solution = solve(part, selection.spread)
    if solution.condition > COLLINEAR:
        return None
    return Trend(
        name=name,
        slope=float(solution.values[-1]),
        standard_error=float(solution.standard_errors[-1]),
        at_zero=solution.value(name),
        error_at_zero=solution.error(name),
        used=False,
    )


def _ratio(trend: Trend) -> float:
    return abs(trend.slope) / max(trend.standard_error, 1e-300)


def with_prior(equations: CampaignEquations, spread: Spread) -> CampaignEquations:
    """The equations with the prior of third-order terms of Y and N, scaled by the estimated linear terms.

    Small angles do not show the third order. Dropping a term that does not differ from zero would state that it is
    zero, and would make its linear term look more accurate than it is (post-selection inference; Leeb & Pötscher 2005,
    Econometric Theory 21). A free term would extrapolate noise at 10 degrees of rudder to 35. Therefore every term that
    the campaign can distinguish stays in the regression with a wide prior about zero: its ratio to the linear term of
    the same force has the standard deviation of the ratios of known ships. The prior does not move terms that the tests
    determine; the card has no others.
    """
    found = solve(equations, spread)
    held = {}
    for name in equations.names:
        reference, ratio = RATIOS.get(name[1:], ("", math.inf))
        linear = name[0] + reference
        if name[0] in "YN" and linear in equations.names:
            size = max(abs(found.value(linear)), found.error(linear))
            held[name] = ratio * size
    return equations.held(held)
