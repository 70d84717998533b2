"""Stated uncertainties are honest: over many made-up campaigns 95 % intervals cover the truth 90 to 98 % of times."""

from collections import defaultdict
from dataclasses import replace

import numpy as np
import pytest

from tank2sim.identification.captive.reduction import Options, reduce_campaign
from tank2sim.records.campaigns import read_campaign
from tests.identification.captive.generator import Campaign, write

TWO_SIDED_95 = 1.96
SEEDS = range(100, 130)

SETTINGS = {
    "third order": Campaign(seed=0, size="small", rate_hz=10.0),
    "linear, forces on the gauge": Campaign(seed=0, size="linear", rate_hz=10.0, force_convention="on_gauge"),
    "coloured noise, drifting zeros, uneven speed, wrong sheet, one screw": Campaign(
        seed=0,
        size="small",
        rate_hz=10.0,
        correlation_time_s=0.7,
        zero_drift=1.0,
        speed_fluctuation=0.003,
        sheet_error=0.01,
        part_periods=True,
        asymmetry=True,
    ),
}


def errors_over_standard_errors(campaign, folder):
    """Name of each derivative that the reduction gives and the ship has, to its error over its standard error."""
    written = write(campaign, folder)
    found = reduce_campaign(read_campaign(written.path), Options(keep_going=True)).derivatives
    true = {name: value for name, value in written.derivatives.items() if value and name in found}
    return {name: (found[name].value - value) / found[name].standard_error for name, value in true.items()}


@pytest.mark.slow
@pytest.mark.parametrize("setting", SETTINGS.values(), ids=SETTINGS)
def test_intervals_cover_the_truth_as_often_as_they_say(setting, tmp_path):
    ratios = defaultdict(list)
    for seed in SEEDS:
        for name, ratio in errors_over_standard_errors(replace(setting, seed=seed), tmp_path / str(seed)).items():
            ratios[name].append(ratio)
    table = {name: np.abs(values) for name, values in ratios.items()}
    told = {name: f"{np.mean(values < TWO_SIDED_95):.2f} of {len(values)}" for name, values in table.items()}
    covered = np.mean(np.concatenate(list(table.values())) < TWO_SIDED_95)
    assert 0.90 <= covered <= 0.98, told
    for name in ("Yv", "Nv", "Yr", "Nr", "Yvdot", "Nrdot", "Yd", "Nd"):
        assert len(table[name]) == len(SEEDS), name
        # That 23 or fewer of 30 intervals cover, if each does in 95 of 100 cases, happens once in 1700 times.
        assert np.count_nonzero(table[name] < TWO_SIDED_95) >= 0.8 * len(SEEDS), (name, told)
    for name, values in ratios.items():
        if len(values) >= len(SEEDS) // 2:
            assert abs(np.mean(values)) < 4.0 / np.sqrt(len(values)), (name, "is biased", np.mean(values))


@pytest.mark.slow
def test_readings_that_are_not_independent_are_not_counted_as_if_they_were(tmp_path):
    """Twice the readings of slow noise do not halve the variance: standard errors stay nearly the same."""
    errors = {10.0: [], 20.0: []}
    for seed in range(3, 8):
        slow = Campaign(seed=seed, size="linear", correlation_time_s=1.0, vibration=False)
        for rate, found in errors.items():
            written = write(replace(slow, rate_hz=rate), tmp_path / f"{seed} {rate:g}")
            derivatives = reduce_campaign(read_campaign(written.path), Options(keep_going=True)).derivatives
            found += [derivatives[name].standard_error for name in ("Yv", "Nv", "Yr", "Nr", "Yvdot", "Nrdot")]
    ratio = np.exp(np.mean(np.log(errors[20.0]) - np.log(errors[10.0])))
    assert ratio > 0.85  # independent readings would give 0.71


def test_derivatives_of_one_campaign_lie_within_four_standard_errors(tmp_path):
    ratios = errors_over_standard_errors(Campaign(seed=11, size="linear", rate_hz=10.0), tmp_path)
    assert {"Yv", "Nv", "Yr", "Nr", "Yvdot", "Nvdot", "Yrdot", "Nrdot", "Yd", "Nd"} <= set(ratios)
    assert max(map(abs, ratios.values())) < 4.0, ratios
