"""A made-up ship of known truth: every coefficient of the card off by 20 %, fitted to seven manoeuvres at 10 Hz.

Prints how long output error takes with 20 free coefficients (seven runs of 420 to 540 s, aim 30 s on two cores), and
then, with all coefficients free, the error of position in manoeuvres that were held out, over the noise of the
positions (aim: below 2). The trials are those of case_6 in the data folder (TANK2SIM_DATA, else ../shared).
"""

from __future__ import annotations

import json
import os
import time
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from tank2sim.cards import ManoeuvringCard, read_card
from tank2sim.cards.reading import revised
from tank2sim.identification.trials.assessment.evaluation import Following
from tank2sim.identification.trials.identify import estimate_parameters, identify_trials
from tank2sim.identification.trials.options import IdentificationOptions
from tank2sim.identification.trials.problem.prepare_trials import measured
from tank2sim.identification.trials.problem.problem_from_card import problem_from_card

DATA = Path(os.environ.get("TANK2SIM_DATA", Path(__file__).resolve().parents[2] / "shared")) / "data" / "gap_cases"
OFF, SEEDS, FREE = 0.2, (1, 2, 3), 20


def main() -> None:
    truth = json.loads((DATA / "case_6-truth.json").read_text(encoding="utf-8"))
    card = read_card(str(DATA / "case_6" / "ship.toml"))
    assert isinstance(card, ManoeuvringCard)
    files = {part: [DATA / "case_6" / f"{name}.csv" for name in truth[part]] for part in ("fit", "holdout")}
    _speed(_off(card, SEEDS[0]), files["fit"])
    for seed in SEEDS:
        off = _off(card, seed)
        result = identify_trials(
            off, measured(files["fit"], off), measured(files["holdout"], off), IdentificationOptions(members=0)
        )
        assert result.holdout is not None and result.before_holdout is not None
        print(f"card off by {OFF:.0%}, seed {seed}: position error over its noise, held out")
        for before, now in zip(result.before_holdout.following, result.holdout.following, strict=True):
            print(
                f"   {now.name:20s} before {_position(before, result.noise):8.1f}",
                f"  now {_position(now, result.noise):6.2f}",
            )


def _off(card: ManoeuvringCard, seed: int) -> ManoeuvringCard:
    """The card with each derivative a fifth too large or too small, and no word of its uncertainty."""
    sides = np.random.default_rng(seed).choice([-1.0, 1.0], len(card.derivatives))
    changed = {
        name: value * (1 + OFF * side) for (name, value), side in zip(card.derivatives.items(), sides, strict=True)
    }
    new = revised(card, {name: (value, 0.02 * abs(value)) for name, value in changed.items()})
    return replace(new, uncertainty={})


def _speed(card: ManoeuvringCard, files: list[Path]) -> None:
    trials = measured(files, card)
    problem = problem_from_card(card, trials.trials, trials.driven_by)
    # the twenty of largest effect: linear terms and what goes with v, r, rudder in second and third order
    places = np.argsort(-np.abs(problem.prior_mean))[:FREE]
    names = tuple(problem.free[place] for place in places)
    fewer = replace(problem, free=names, prior_mean=problem.prior_mean[places], prior_error=problem.prior_error[places])
    begin = time.perf_counter()
    found = estimate_parameters(fewer, IdentificationOptions())[0]
    samples = sum(len(run.measured) for run in problem.runs)
    print(
        f"output error, {len(problem.runs)} runs, {samples} samples, {FREE} coefficients: "
        f"{time.perf_counter() - begin:.1f} s, {len(found.cost)} steps (aim 30)"
    )


def _position(following: Following, noise: Mapping[str, float]) -> float:
    whole = following.whole
    return float(np.hypot(whole["motion.x"], whole["motion.y"]) / np.hypot(noise["motion.x"], noise["motion.y"]))


if __name__ == "__main__":
    main()
