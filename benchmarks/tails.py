"""Small probabilities of failing an IMO criterion: importance sampling against brute force.

The Mariner with the same relative standard error on each of her derivatives, so large that her advance fails the limit
of 4.5 L of MSC.137(76) now and then. The probability of that, the worse of a turn to either side counting, is found
twice: by ``tank2sim stability --members`` (its importance sampling, with all six criteria) and by turns of a million
ships, run in lanes only until the advance is known. Both have a standard error, and their difference must be within
three of both together. The limits of the two initial turning and overshoot criteria are further off than any member
comes. A million ships take ten minutes of a core.

    python benchmarks/tails.py [--members N] [--brute N] [--error PERCENT]
"""

from __future__ import annotations

import argparse
import math
import resource
import sys
import time

import numpy as np

from tank2sim.analysis.ensemble.draws import draws_of
from tank2sim.analysis.ensemble.questions import OfManoeuvre, ShipText
from tank2sim.analysis.ensemble.results import EnsembleRequest, stability_bands
from tank2sim.analysis.stability.imo import ADVANCE, imo_criteria
from tank2sim.cards import ManoeuvringCard, parse_card, read_card
from tank2sim.dynamics import build
from tank2sim.executors import executing
from tank2sim.simulation.ensemble import ensemble
from tank2sim.simulation.manoeuvres import Turn

RUDDER, LONGEST_S, APART = math.radians(35.0), 240.0, 3.0


def uncertain(percent: float) -> ManoeuvringCard:
    """The Mariner with a relative standard error on each derivative."""
    card = read_card("mariner")
    assert isinstance(card, ManoeuvringCard)
    lines = "\n".join(f"{name} = {abs(value) * percent / 100!r}" for name, value in card.derivatives.items())
    found = parse_card(f"{card.text}\n[uncertainty]\n{lines}\n", card.source)
    assert isinstance(found, ManoeuvringCard)
    return found


def seconds_of_processors() -> float:
    used = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(one.ru_utime + one.ru_stime for one in used)


def main() -> int:
    parser = argparse.ArgumentParser()
    parser.add_argument("--members", type=int, default=2000)
    parser.add_argument("--brute", type=int, default=1_000_000)
    parser.add_argument("--error", type=float, default=5.0)
    asked = parser.parse_args()
    card = uncertain(asked.error)
    criteria = imo_criteria(build(card))
    limit = next(one.allowed for one in criteria if one.name == ADVANCE)
    print(f"Mariner, {asked.error:g} % on each derivative: advance beyond {limit:g} L, the worse side", flush=True)

    begun = seconds_of_processors()
    bands = stability_bands(card, criteria, EnsembleRequest(asked.members, 1))
    worked = seconds_of_processors() - begun
    chance = next(one for one in bands.imo if one.name == ADVANCE)
    tail = chance.tail
    assert chance.probability_met is not None and chance.interval_95 is not None and tail is not None
    print(
        f"  {asked.members} members: {1 - chance.probability_met:.2e} fail (95 %: "
        f"{1 - chance.interval_95[1]:.1e} to {1 - chance.interval_95[0]:.1e})"
    )
    if tail.probability is None or tail.standard_error is None:
        print(f"  importance sampling: {tail.remark}")
        return 1
    print(
        f"  importance sampling: {tail.probability:.3e}, standard error {tail.standard_error:.1e}, effective size "
        f"{tail.effective_size:.0f} of {tail.members}; {worked:.0f} s of a core with all else",
        flush=True,
    )
    print(
        f"  if the advance were linear: {tail.linear_probability:.2e} at {tail.distance:.2f} sd; there it is "
        f"{tail.figure:.3f} L, not {tail.linear_figure:.3f}"
    )
    for one in bands.imo:
        if one.tail and one.tail.remark:
            print(f"  {one.name}: {one.tail.remark}")

    draws, _ = draws_of(card, 2)
    begun, wall = seconds_of_processors(), time.perf_counter()
    worse = np.full(asked.brute, -np.inf)
    lost = 0
    with executing() as executor:
        for rudder in (RUDDER, -RUDDER):
            question = OfManoeuvre(ShipText.of(card), Turn(rudder), LONGEST_S, np.zeros(0))
            found = ensemble(question, draws, asked.brute, executor)
            worse = np.maximum(worse, found.figures["advance_lengths"])  # nan where a side does not show it
            lost = max(lost, sum(found.unusable.values()))
    worked, wall = seconds_of_processors() - begun, time.perf_counter() - wall
    usable = asked.brute - lost
    failing = int(np.sum(~(worse <= limit))) - lost
    share = failing / usable
    error = math.sqrt(share * (1 - share) / usable)
    print(
        f"  {usable} ships by brute force: {failing} fail, {share:.3e}, standard error {error:.1e}; "
        f"{int(np.isnan(worse).sum()) - lost} do not show it, {lost} cannot be used"
    )
    largest = max(resource.getrusage(who).ru_maxrss for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    print(
        f"  {worked:.0f} s of a core, {wall:.0f} s, {1e6 * worked / asked.brute / 2:.0f} us a turn of {LONGEST_S:g} s; "
        f"largest process {largest / 1024:.0f} MB"
    )
    apart = abs(tail.probability - share) / math.hypot(tail.standard_error, error)
    print(f"  they differ by {apart:.2f} standard errors   (must be below {APART:g})")
    return 0 if apart < APART else 1


if __name__ == "__main__":
    sys.exit(main())
