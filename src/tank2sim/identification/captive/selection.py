"""Which terms of (3.8) a campaign can give: every term left out is reported, with the reason.

Every term that the campaign excites and can tell from the others is in the regression, third-order terms held loosely
about zero (:mod:`tank2sim.identification.captive.prior`). Whether a term is reported depends on the design of the tests
and never on its value: to leave out a term because it does not differ from zero would claim that it is zero, with no
error, and would move every manoeuvre that needs it. Reported are the linear terms, the acceleration derivatives, X0,
and every other term on which the tests say more than the prior: at large angles with a small standard error, at small
angles with a large one. A term that is not reported keeps its part in the standard errors of the others.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import stdtrit

from tank2sim.cards.terms import Term, parse_term
from tank2sim.identification.captive.equations import CampaignEquations, campaign_equations, candidate_terms, excited
from tank2sim.identification.captive.harmonics import ReducedRun
from tank2sim.identification.captive.prior import with_prior
from tank2sim.identification.captive.regression import Solution, Spread, fitted_spread, solve
from tank2sim.identification.conditioning import COLLINEAR, scaled_condition
from tank2sim.records.campaigns import Campaign

DETERMINED = math.sqrt(0.5)
"""Largest standard error of a reported third-order term, in the standard deviations of its prior: the tests then weigh
at least as much as what known ships have in common (1/s^2 - 1 >= 1), and the value is theirs."""

_NORMAL = 1.959964
"""Standard errors of a two-sided 95 % interval of the normal distribution."""


@dataclass(frozen=True)
class Choice:
    """What became of one candidate term.

    Parameters
    ----------
    name : str
        The term.
    kept : bool
        It is reported.
    reason : str
        ``linear``, ``determined``, ``asked for``, ``not excited``, ``collinear``, ``not determined``, ``trend``.
    told : str
        The reason in a sentence, with its figures.
    inflation, ratio : float or None
        Variance inflation factor, and value over standard error, when it was decided.
    """

    name: str
    kept: bool
    reason: str
    told: str
    inflation: float | None = None
    ratio: float | None = None


@dataclass(frozen=True, eq=False)
class Selection:
    """The regression over the whole campaign: equations of all terms that it can distinguish, and each candidate's
    fate.

    Of the terms in the regression those that the tests do not determine have ``kept`` false: they are not reported.
    """

    equations: CampaignEquations
    spread: Spread
    choices: tuple[Choice, ...]

    @property
    def reported(self) -> tuple[str, ...]:
        """Terms of the result."""
        return tuple(choice.name for choice in self.choices if choice.kept)

    @property
    def solution(self) -> Solution:
        """All terms of the regression, its errors widened by Student's t over the normal quantile.

        So 1.96 standard errors are a 95 % interval, although the scatter was itself estimated, from as many degrees of
        freedom as there are runs more than free terms.
        """
        solution = solve(self.equations, self.spread)
        free = len(self.equations.names) - len(self.equations.prior)
        widened = float(stdtrit(max(1, len(self.equations.runs) - free), 0.975)) / _NORMAL
        return replace(solution, covariance=solution.covariance * widened**2)


def select(campaign: Campaign, runs: Sequence[ReducedRun], force: str, *, all_terms: bool = False) -> Selection:
    """Choose the terms of one force.

    Parameters
    ----------
    all_terms : bool
        Report terms that the tests do not determine, too.

    Raises
    ------
    InputError
        As :func:`tank2sim.identification.captive.equations.campaign_equations`.
    """
    choices: dict[str, Choice] = {}
    used = told_apart(campaign, runs, force, choices)
    spread = fitted_spread(used)
    used = with_prior(used, spread)
    selection = Selection(used, spread, ())
    solution = selection.solution
    for place, name in enumerate(used.names):
        choices[name] = _judged(solution, place, used.prior.get(name, math.inf), all_terms=all_terms)
    order = [term.name for term in candidate_terms(force)]
    return replace(selection, choices=tuple(sorted(choices.values(), key=lambda choice: order.index(choice.name))))


def told_apart(
    campaign: Campaign, runs: Sequence[ReducedRun], force: str, choices: dict[str, Choice]
) -> CampaignEquations:
    """The equations of all terms that the runs excite and can distinguish; the fate of the others goes to `choices`."""
    active = []
    for term in candidate_terms(force):
        if excited(campaign, runs, term):
            active.append(term.name)
        else:
            choices[term.name] = Choice(term.name, False, "not excited", f"no run moves so that {term.name} acts")
    full = campaign_equations(campaign, runs, force, active)
    return full.of_terms(_told_apart(full, choices))


def _judged(solution: Solution, place: int, held: float, *, all_terms: bool) -> Choice:
    """Whether a term of the regression, held within a standard deviation `held` of zero, is reported."""
    name, ratio = solution.names[place], float(solution.ratios[place])
    value, error = solution.values[place], solution.standard_errors[place]
    if _always(name):
        reason, told = "linear", f"value / standard error {ratio:.3g}"
    elif error <= DETERMINED * held:
        reason, told = "determined", f"value / standard error {ratio:.3g}"
    else:
        reason = "asked for" if all_terms else "not determined"
        told = (
            f"the tests reach too small angles to show it: {value:.3g} ± {error:.2g}, and known ships scatter by "
            f"{held:.2g}; its uncertainty is in the errors of the others"
        )
    return Choice(name, reason != "not determined", reason, told, float(solution.inflation[place]), ratio)


def _always(name: str) -> bool:
    term = parse_term(name)
    assert term is not None
    return bool(term.acceleration) or name == "X0" or _order(term) == 1


def _order(term: Term) -> int:
    return term.v + term.r + term.d + term.u


def _told_apart(full: CampaignEquations, choices: dict[str, Choice]) -> list[str]:
    """Terms that the campaign can distinguish, taken from the simplest to the most mixed: each that joins must leave
    the condition number bearable."""
    kept: list[str] = []
    conditions = _conditions(full)
    for name in sorted(full.names, key=_simplicity):
        # The zero of Y and N is an unknown, whether or not its term is in the result.
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
        column, others = weighted[:, -1], weighted[:, :-1]
        alone = column - others @ np.linalg.lstsq(others, column, rcond=None)[0]
        inflation = float(column @ column / max(float(alone @ alone), 1e-300))
        text = (
            f"the runs cannot distinguish it from simpler terms: variance inflation {inflation:.3g}, condition number "
            f"{condition:.3g} with it, and {COLLINEAR:g} can be borne"
        )
        choices[name] = Choice(name, False, "collinear", text, inflation)
    return [name for name in full.names if name in kept]


def _conditions(full: CampaignEquations) -> int:
    """How many distinct conditions there are: an oscillating run counts once for each of its coefficients."""
    steady = {
        tuple(np.round([m.v_mps[0] / m.speed_mps[0], m.delta_rad[0], m.speed_mps[0]], 2).tolist())
        for m in (run.motion for run in full.runs if not run.run.oscillates)
    }
    return len(steady) + sum(run.regressed for run in full.runs if run.run.oscillates)


def _simplicity(name: str) -> tuple[int, ...]:
    """Linear terms come first, then by order, and at one order those in one motion before mixed ones."""
    term = parse_term(name)
    assert term is not None
    mixed = sum(power > 0 for power in (term.v, term.r, term.d, term.u))
    return (not _always(name), _order(term), term.u, mixed, term.d, term.r)


def usual_zero(full: CampaignEquations) -> float:
    """A zero error that makes every mean as good as the others: what can be distinguished hangs on the tests alone."""
    return float(np.median([root[0, 0] for root in full.roots])) ** 2
