"""Unmodelled accelerations by waves: against matrix exponentials, the whole Gaussian, and made-up seas."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from gap_truth import Made, Setting, make, sampled, write
from gap_truth.disturbances import WAVE_BAND_RADPS

from tank2sim.cards import read_card
from tank2sim.gap.inference.fit import ExplanationFit
from tank2sim.gap.inference.fit_waves import fit_waves
from tank2sim.gap.inference.kalman_filter import NoiseLevels, observer, slopes
from tank2sim.gap.inference.likelihood import Likelihood
from tank2sim.gap.inference.prior import likelihood_from_card
from tank2sim.gap.inference.wave_band import WaveBand
from tank2sim.gap.result import NO_EFFECT_MISSING
from tank2sim.gap.search.decision import decide
from tank2sim.gap.search.explanations import search
from tank2sim.identification.trials.problem.prepare_trials import measured
from tests.gap.dense import Dense, pushed, rocked
from tests.gap.random_filter import RUNS, columns, problem

WAVES = WaveBand(np.array([0.4, 1.1, 0.7]), frequency=0.9, time=7.0)


@pytest.mark.parametrize("block_s", [0.3, 2.0, 6.0])
@pytest.mark.parametrize("frequency", [0.0, 0.9, -0.9])
def test_a_block_of_waves_is_that_of_the_exponential_of_its_matrix(frequency: float, block_s: float) -> None:
    waves = replace(WAVES, frequency=frequency)
    block = waves.over(block_s)
    for axis in range(3):
        transition, covariance = rocked(waves, axis, block_s)
        found = [[block.gain.real, -block.gain.imag], [block.fading.real, -block.fading.imag]]
        assert np.array(found) == pytest.approx(transition[:2, 1:], rel=1e-9, abs=1e-12)
        tied = [block.way[axis], block.with_value[axis], block.with_quadrature[axis]]
        assert tied == pytest.approx(covariance[0], rel=1e-6, abs=1e-9)
        assert block.end[axis] == pytest.approx(covariance[1, 1])
    if frequency == 0:  # the first-order process of gusts
        _, of_gust = pushed(waves.time, waves.level[1], block_s)
        assert [block.way[1], block.with_value[1], block.end[1]] == pytest.approx(of_gust[[0, 0, 1], [0, 1, 1]])


@pytest.mark.parametrize("seed", range(3))
def test_with_waves_innovations_tell_the_density_of_the_whole_gaussian_and_states_its_mean(seed: int) -> None:
    what, noise, rng = problem(seed, gaps=seed > 0)
    driving, shown = columns(what, rng)
    seen = observer(what, noise, WAVES)
    whole = [Dense(what, noise, run, WAVES) for run in range(RUNS)]
    cost = seen.log_det + np.sum(seen.whiten(driving, shown) ** 2) + what.known.sum() * np.log(2 * np.pi)
    assert cost == pytest.approx(
        sum(dense.cost(driving[run, ..., 0], shown[run, ..., 0]) for run, dense in enumerate(whole)), rel=1e-10
    )
    states = seen.smooth(driving[..., 0], shown[..., 0])
    for run, dense in enumerate(whole):
        assert states[run] == pytest.approx(dense.states(driving[run, ..., 0], shown[run, ..., 0]))


def test_with_waves_slopes_are_difference_quotients_in_every_other_noise() -> None:
    what, noise, rng = problem(2)
    driving, shown = columns(what, rng, 2)

    def cost(logs: np.ndarray) -> float:
        seen = observer(what, NoiseLevels.of(logs), WAVES)
        return seen.log_det + float(np.sum(seen.whiten(driving, shown) ** 2))

    seen = observer(what, noise, WAVES)
    steps = 1e-4 * np.eye(len(noise.logs))
    quotients = [(cost(noise.logs + h) - cost(noise.logs - h)) / 2e-4 for h in steps]
    found = slopes(seen, driving, shown)
    assert found == pytest.approx(np.array(quotients), abs=1e-5, rel=1e-5)


TRIALS, MINUTES = ("zigzag20_20", "turn35_stbd", "straight"), 20
SETTINGS = (
    Setting((), 31, process="waves", manoeuvres=TRIALS),
    Setting(("wind",), 32, process="waves", manoeuvres=TRIALS),
    Setting((), 33, process="gusts", manoeuvres=TRIALS),
    Setting((), 34, process="waves", manoeuvres=TRIALS),
)


@cache
def sets() -> dict[Setting, Made]:
    return dict(zip(SETTINGS, make(SETTINGS), strict=True))


def likelihood_of(setting: Setting, hertz: int, folder) -> tuple[Likelihood, ExplanationFit]:
    """Likelihood of made-up trials, and the card as it is, at the noise believed beforehand."""
    write(sampled(sets()[setting], hertz), folder)
    card = read_card(folder / "ship.toml")
    likelihood = likelihood_from_card(card, measured([folder / f"{name}.csv" for name in TRIALS], card))
    nothing = np.zeros(0)
    fit = likelihood.at_best(likelihood.none, nothing, [likelihood.belief.logs], (5,))
    return likelihood, fit


@pytest.mark.slow
@pytest.mark.parametrize("setting", SETTINGS[:2], ids=["no effect", "wind"])
def test_the_frequency_of_a_made_up_sea_is_found(setting: Setting, tmp_path) -> None:
    truth = setting.generator("sea").uniform(*WAVE_BAND_RADPS)
    likelihood, fit = likelihood_of(setting, 1, tmp_path)
    waves = fit_waves(likelihood, fit)
    assert waves is not None
    assert waves.frequency == pytest.approx(truth, abs=0.05)
    explained = likelihood.with_waves(waves).at_best(fit.hypothesis, fit.theta, [fit.logs], (0,))
    assert explained.score < fit.score - 2 * MINUTES  # what a score tells grows with the length of the trials
    cost = likelihood.cost_of_waves(fit)  # without combinations of coefficients that the trials hardly determine
    assert cost(waves) - cost(None) == pytest.approx(explained.score - fit.score, rel=1e-3, abs=1.0)


@pytest.mark.slow
def test_no_waves_are_found_in_gusts(tmp_path) -> None:
    assert fit_waves(*likelihood_of(SETTINGS[2], 1, tmp_path)) is None


@pytest.mark.slow
def test_an_effect_that_swings_as_waves_do_is_not_sought_in_them(tmp_path) -> None:
    likelihood, _ = likelihood_of(SETTINGS[3], 1, tmp_path)
    found = search(likelihood, names=("rudder_bias", "roll_coupling"), most=1)
    assert found.likelihood.belief.waves is not None
    assert {name for fit in found.fits for name in fit.hypothesis.effects} == {"rudder_bias"}
    assert decide(found).verdict == NO_EFFECT_MISSING
