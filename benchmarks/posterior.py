"""Samples of posteriors: are they calibrated, and what does each sampler cost?

    python benchmarks/posterior.py            # simulation-based calibration (Talts et al. 2018, arXiv:1804.06788)
    python benchmarks/posterior.py --samplers # cost on the seven HSVA zigzags of the KVLCC2 (TANK2SIM_DATA)

Calibration: coefficients of a made-up ship are drawn from the prior, a zigzag and a turn are simulated by scipy with
noise of the sensors, output error finds the estimate and the sampler the posterior. The rank of each true coefficient
among the draws is uniform if the posterior is right. Printed are, for each coefficient, the probability of ranks at
least as uneven (chi-squared, ten bins), and how many intervals of 50 and 95 % hold the truth.
"""

from __future__ import annotations

import os
import sys
import time
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from pathlib import Path
from typing import get_args

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # small matrices: threads would only wait for each other
sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import numpy as np
from scipy.stats import chisquare, kstest

from tank2sim.identification.trials.identify import estimate_parameters
from tank2sim.identification.trials.methods.output_error import OutputErrorSettings, output_error
from tank2sim.identification.trials.methods.posterior_sampling import sample_posterior
from tank2sim.identification.trials.options import IdentificationOptions, Sampler
from tank2sim.identification.trials.problem.prepare_trials import measured
from tank2sim.identification.trials.problem.problem_from_card import problem_from_card
from tank2sim.identification.trials.problem.structures import STRUCTURES
from tank2sim.ship import load
from tests.identification.trials.made_up_ship import TRUTH, problem, trial, turn, zigzag

DATA = Path(os.environ.get("TANK2SIM_DATA", Path(__file__).resolve().parents[2] / "shared")) / "data"
SHIPS, DRAWS, RANKS, BINS = 100, 60, 99, 10
FREE = tuple(name for name in TRUTH if not name.endswith("dot"))
ERRORS = np.array([0.15 * abs(TRUTH[name]) or 2e-5 for name in FREE])


def ranks_of_ship(seed: int) -> list[int]:
    """Rank of each true coefficient of a made-up ship among :data:`RANKS` draws."""
    mean = np.array([TRUTH[name] for name in FREE])
    values = mean + ERRORS * np.random.default_rng([seed, 1]).standard_normal(len(FREE))
    truth = TRUTH | dict(zip(FREE, values.tolist(), strict=True))
    rudders = {"zigzag": zigzag(20), "turn": turn(-30)}
    trials = [
        trial(rudder, name=name, truth=truth, duration=150.0, step=0.5, seed=10 * seed + place)
        for place, (name, rudder) in enumerate(rudders.items())
    ]
    posed = replace(problem(trials, free=FREE), prior_mean=mean, prior_error=ERRORS)
    estimate = output_error(posed, settings=OutputErrorSettings(piece_s=75.0, coloured=False, scale_prior=False))
    samples = sample_posterior(posed, estimate, draws=DRAWS, seed=seed, robust=False).flat
    chosen = samples[np.linspace(0, len(samples) - 1, RANKS).round().astype(int)]
    return [int(np.sum(chosen[:, place] < value)) for place, value in enumerate(values)]


def calibration() -> None:
    """Print how evenly the ranks are distributed."""
    with ProcessPoolExecutor() as pool:
        ranks = np.array(list(pool.map(ranks_of_ship, range(1, SHIPS + 1))))
    print(f"{SHIPS} made-up ships, {len(FREE)} coefficients, ranks among {RANKS} draws")
    print("coefficient   chi-squared p   in 50 %   in 95 %")
    for place, name in enumerate(FREE):
        p = chisquare(np.histogram(ranks[:, place], BINS, (0, RANKS + 1))[0]).pvalue
        half, most = (np.mean(np.abs(ranks[:, place] - RANKS / 2) < share * (RANKS + 1) / 2) for share in (0.5, 0.95))
        print(f"{name:<12} {p:>12.3f} {100 * half:>10.0f} % {100 * most:>7.0f} %")
    mean = (ranks.mean(axis=0) - RANKS / 2) / np.sqrt(((RANKS + 1) ** 2 - 1) / 12 / SHIPS)
    print(f"mean rank of each coefficient, in its standard errors: rms {np.sqrt(np.mean(mean**2)):.2f} (1 is expected)")
    every = (ranks.ravel() + 0.5) / (RANKS + 1)
    print(f"all ranks against the uniform distribution: p {kstest(every[:: len(FREE) + 1], 'uniform').pvalue:.3f}")
    print(f"intervals of 50 %: {100 * np.mean(np.abs(every - 0.5) < 0.25):.1f} %", end=", ")
    print(f"of 95 %: {100 * np.mean(np.abs(every - 0.5) < 0.475):.1f} %")


def samplers() -> None:
    """Print what each sampler costs on the HSVA zigzags."""
    card = load("kvlcc2-captive").manoeuvring()
    trials = measured(sorted((DATA / "kvlcc2_hsva").glob("*.dat")), card)
    posed = problem_from_card(STRUCTURES["cross_flow"].start(card), trials.trials, trials.driven_by)
    estimate = estimate_parameters(posed, IdentificationOptions())[0]
    print(f"{len(posed.free)} coefficients, {sum(len(run.measured) for run in posed.runs)} samples of 6 signals")
    for name in get_args(Sampler):
        begin = time.perf_counter()
        found = sample_posterior(posed, estimate, name)
        seconds = time.perf_counter() - begin
        least, worst = found.effective.min(), found.r_hat.max()
        print(
            f"{name}: {seconds:.0f} s, {found.simulations} simulations, R-hat at most {worst:.4f}, "
            f"effective size at least {least:.0f}: {least / seconds:.2f} for each second"
        )


if __name__ == "__main__":
    samplers() if "--samplers" in sys.argv else calibration()
