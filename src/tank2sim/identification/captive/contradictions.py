"""Runs that all the others contradict: a dead gauge with noise on it, a wrong unit or sign in one run.

One such run turns the least squares of a whole campaign, and its own small scatter may even give it the greatest
weight. So each run is held against the others with equal weights, and the worst goes out before the next is judged.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from tank2sim.errors import InputError
from tank2sim.identification.captive.cross_validation import LeftOut, leave_one_out
from tank2sim.identification.captive.harmonics import ReducedRun
from tank2sim.identification.captive.prior import with_prior
from tank2sim.identification.captive.regression import Spread
from tank2sim.identification.captive.selection import told_apart, usual_zero
from tank2sim.records.campaign_form import OSCILLATING
from tank2sim.records.campaigns import FORCE_COLUMNS, Campaign

_TIMES_USUAL = 8.0
"""Least misfit of a contradicted run, in those usual in the campaign. Sound runs of made-up campaigns reach 6 next to
noise; a gauge in kN or of the wrong sign gives 20 and more."""
_SHARE = 0.5
"""Least misfit of a contradicted run as a share of its force. Noise-free campaigns, in which 8 times the usual
misfit is still nothing, stay far below, and gauges coarse by 8 times the noise below 0.4; a wrong sign gives 2 (0.8
next to the body's own inertia), a dead gauge or kN 1 (0.6)."""
_SMALL = 0.05
"""Share of the largest force in runs of its type below which a run's own force is no measure."""
_FEWEST = 8
"""Runs that it takes to say what misfit is usual."""


def contradicted(campaign: Campaign, runs: Sequence[ReducedRun]) -> dict[str, InputError]:
    """Name to fault of the runs that the others contradict grossly in some force.

    Parameters
    ----------
    runs : sequence of ReducedRun
        Those that the derivatives are to rest on.
    """
    found: dict[str, InputError] = {}
    for force in FORCE_COLUMNS:
        rest = list(runs)
        while (worst := _worst(campaign, rest, force)) is not None:
            row, times, share = worst
            rest = [run for run in rest if run.run.name != row.run]
            what = "harmonics differ" if row.type in OSCILLATING else "mean differs"
            problem = (
                f"contradicts the other runs: its {what} from what they predict by {100 * share:.0f} % of the force, "
                f"{times:.0f} times as much as usual here"
            )
            remedy = "look for a dead gauge, and for another unit or sign than in the other runs"
            found.setdefault(row.run, InputError(row.run, f"gauge {force}", problem, remedy))
    return found


def _worst(campaign: Campaign, runs: Sequence[ReducedRun], force: str) -> tuple[LeftOut, float, float] | None:
    """The run that the others contradict most; its misfit in usual ones, and as a share of its force."""
    if len(runs) < _FEWEST:
        return None
    full = told_apart(campaign, _levelled(runs, force), force, {})
    spread = Spread(1.0, usual_zero(full))
    rows = leave_one_out(with_prior(full, spread), spread)
    if len(rows) < _FEWEST:
        return None
    usual = max(float(np.median([row.misfit for row in rows])), 1e-300)
    largest = {kind: max(row.size for row in rows if row.type == kind) for kind in {row.type for row in rows}}
    judged = [(row, row.misfit / usual, row.gap / max(row.size, _SMALL * largest[row.type], 1e-300)) for row in rows]
    gross = [found for found in judged if found[1] > _TIMES_USUAL and found[2] > _SHARE]
    return max(gross, key=lambda found: found[1], default=None)


def _levelled(runs: Sequence[ReducedRun], force: str) -> list[ReducedRun]:
    """The runs with the campaign's median noise: a run's own small scatter is no reason to trust it."""
    usual = float(np.median(np.concatenate([run.fits[force].density for run in runs])))
    levelled = []
    for run in runs:
        fit = run.fits[force]
        ratio = np.sqrt(usual / fit.density)
        same = replace(
            fit, density=np.full_like(fit.density, usual), covariance=fit.covariance * np.outer(ratio, ratio)
        )
        levelled.append(replace(run, fits={**run.fits, force: same}))
    return levelled
