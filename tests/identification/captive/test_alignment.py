"""The zero of the drift angle: a turned model shows it in Y0 and N0 alike, a single screw does not."""

import math
from dataclasses import replace

import numpy as np
import pytest

from tank2sim.identification.captive.findings import reduction_findings
from tank2sim.identification.captive.reduction import reduce_campaign
from tank2sim.identification.captive.uncertainty_budget import uncertainty_budget
from tank2sim.records.campaigns import read_campaign
from tests.identification.captive.generator import Campaign, write
from tests.marks import first_fast


def turned(folder, angle_deg, seed=7, stated="", **changes):
    """A campaign whose recorded drift is less than the true one by an angle, and the truth behind it."""
    written = write(Campaign(seed=seed, rate_hz=5.0, **changes), folder)
    written.path.write_text(written.path.read_text().replace("[test]", f"{stated}[test]", 1))
    campaign = read_campaign(written.path)
    shift = math.sin(math.radians(angle_deg))
    runs = tuple(replace(run, v_mps=run.v_mps + shift * run.speed_mps) for run in campaign.runs)
    return reduce_campaign(replace(campaign, runs=runs)), written


@first_fast("angle_deg", [0.4, -0.4])
def test_a_model_that_is_turned_shows_its_angle_in_both_forces(tmp_path, angle_deg):
    found, _ = turned(tmp_path, angle_deg)
    estimate = found.alignment
    assert estimate.shown
    assert abs(estimate.angle_rad - math.radians(angle_deg)) < 4 * estimate.standard_error_rad
    assert any("turned by" in sentence for sentence in reduction_findings(found))
    for name in ("Y0", "N0"):  # both are zero in truth
        derivative = found.derivatives[name]
        assert abs(derivative.value) < 1.96 * derivative.standard_error
        assert abs(derivative.value) > 4 * derivative.type_a
    rows = uncertainty_budget(found).derivatives
    assert rows["Y0"].shares["alignment"] > 0.8
    assert rows["Y0"].combined == pytest.approx(found.derivatives["Y0"].standard_error)


@pytest.mark.slow
def test_a_stated_alignment_takes_the_place_of_the_one_shown(tmp_path):
    found, _ = turned(tmp_path, 0.4, stated="[uncertainty]\nalignment_deg = 0.5\n")
    assert "alignment" not in found.derivatives["Y0"].type_b
    shifts = found.derivatives["Y0"].value / found.derivatives["Y0"].type_b["alignment_rad"]
    assert abs(shifts) == pytest.approx(0.4 / 0.5, rel=0.15)  # Y0 is all of 0.4 deg
    assert not any("turned by" in sentence for sentence in reduction_findings(found))


@pytest.mark.slow
def test_an_aligned_model_shows_none_and_its_error_is_honest(tmp_path):
    ratios = []
    for seed in range(20, 24):
        found, _ = turned(tmp_path / str(seed), 0.0, seed, size="linear")
        assert not found.alignment.shown
        assert "alignment" not in found.derivatives["Y0"].type_b
        ratios.append(found.alignment.angle_rad / found.alignment.standard_error_rad)
    assert 0.17 < np.std(ratios) < 1.7  # as 98 % of the spreads of 4 normal errors of size 1


@pytest.mark.slow
@pytest.mark.parametrize("seed", [7, 8, 9])
def test_a_single_screw_is_not_taken_for_a_turned_model(tmp_path, seed):
    found, _ = turned(tmp_path, 0.0, seed, asymmetry=True)
    assert not found.alignment.shown
    assert "alignment" not in found.derivatives["Y0"].type_b
