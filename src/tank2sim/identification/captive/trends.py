"""Trends of damping and added mass with frequency, and their values at zero frequency.

For slow motions both are even functions of the frequency: value at zero plus a slope times (omega L/U)^2. A significant
trend stays in the regression, so that the value of its term is that at zero frequency; static tests, which are at zero
frequency, take part.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from tank2sim.identification.captive.equations import CampaignEquations, campaign_equations
from tank2sim.identification.captive.oscillation import distinct
from tank2sim.identification.captive.regression import fitted_spread, solve
from tank2sim.identification.captive.selection import Choice, Selection
from tank2sim.identification.conditioning import COLLINEAR
from tank2sim.records.campaigns import Campaign

_SHOWN = 3.5
"""Standard errors of a significant slope: with eight slopes in a campaign chance reaches it once in 250."""
_FEWEST_FREQUENCIES = 3


@dataclass(frozen=True, kw_only=True)
class Trend:
    """Trend of one term with frequency.

    Parameters
    ----------
    name : str
        The term.
    slope, standard_error : float
        Change of its prime value by (omega L/U)^2.
    at_zero, error_at_zero : float
        Its value extrapolated to zero frequency, with this slope in the regression.
    used : bool
        True for a significant slope: the result's value is that at zero frequency.
    """

    name: str
    slope: float
    standard_error: float
    at_zero: float
    error_at_zero: float
    used: bool


def trends(campaign: Campaign, selection: Selection) -> tuple[Selection, tuple[Trend, ...]]:
    """The selection with the significant trends among its terms, and all trends that can be estimated."""
    used = selection.equations
    candidates = [
        name
        for motion, kind in (("v", "pure_sway"), ("r", "pure_yaw"))
        if distinct([run.motion.frequency_radps for run in used.runs if run.run.type == kind]) >= _FEWEST_FREQUENCIES
        for name in (f"{used.force}{motion}", f"{used.force}{motion}dot")
        if name in used.names
    ]
    if not candidates:
        return selection, ()
    full = campaign_equations(campaign, used.runs, used.force, [*used.names, *map(_slope, candidates)]).held(used.prior)
    names = list(used.names)
    shown: list[str] = []
    while True:
        found = [_trend(full, names, name, selection) for name in candidates if name not in shown]
        messages = [trend for trend in found if trend is not None]
        best = max(messages, key=_ratio, default=None)
        if best is None or _ratio(best) < _SHOWN:
            break
        shown.append(best.name)
        names.append(_slope(best.name))
    if not shown:
        return selection, tuple(messages)
    chosen = [
        Choice(_slope(name), True, "trend", f"{name} changes with the frequency; its value is that at zero frequency")
        for name in shown
    ]
    widened = full.of_terms(names)
    result = replace(selection, equations=widened, spread=fitted_spread(widened), choices=(*selection.choices, *chosen))
    kept = [_trend(full, [term for term in names if term != _slope(name)], name, result) for name in shown]
    return result, (*(replace(trend, used=True) for trend in kept if trend is not None), *messages)


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
