"""KVLCC2 at two basins: fitted to some zigzags, held against others and against runs of the other basin."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tank2sim.cards import ManoeuvringCard, read_card
from tank2sim.identification.trials.assessment.evaluation import pooled
from tank2sim.identification.trials.identify import Identification, identify_trials
from tank2sim.identification.trials.options import IdentificationOptions
from tank2sim.identification.trials.problem.prepare_trials import measured

pytestmark = pytest.mark.slow

FITTED, HELD_OUT = ("05_01", "10_05", "10_10_P", "20_10_S", "35_05"), ("10_10_S", "25_05")


@pytest.fixture(scope="module")
def result(data: Path) -> Identification:
    card = read_card("kvlcc2-captive")
    assert isinstance(card, ManoeuvringCard)
    hsva = [
        [data / f"data/kvlcc2_hsva/HSVA_CPMC_KVLCC2_Z_{name}.dat" for name in names] for names in (FITTED, HELD_OUT)
    ]
    marin = sorted((data / "data/kvlcc2_marin").glob("*.dat"))
    return identify_trials(
        card, measured(hsva[0], card), measured([*hsva[1], *marin], card), IdentificationOptions(structure="cross_flow")
    )


def errors(result: Identification, basin: str, figure: str) -> np.ndarray:
    assert result.holdout is not None
    return np.array([one.error for one in result.holdout.figures if basin in one.trial and one.name == figure])


def test_yaw_rate_is_followed_in_both_basins(result: Identification) -> None:
    assert result.holdout is not None and result.before_holdout is not None
    for basin, most in (("HSVA", 0.07), ("MARIN", 0.12)):
        assert pooled([run for run in result.holdout.following if basin in run.name], "motion.r") < most
    assert pooled(result.before_holdout.following, "motion.r") > 0.25, "the captive card cannot"


def test_first_overshoots_come_within_a_degree(result: Identification) -> None:
    for basin in ("HSVA", "MARIN"):
        assert np.abs(errors(result, basin, "overshoot_1_deg")).max() < 1.0


def test_a_turn_never_fitted_is_foredistinguished_from_zigzags(result: Identification) -> None:
    assert np.abs(errors(result, "MARIN", "advance_m")).max() < 0.06
    assert np.abs(errors(result, "MARIN", "tactical_diameter_m")).max() < 0.10


def test_intervals_hold_most_of_what_was_measured(result: Identification) -> None:
    assert result.holdout is not None
    inside = [one.interval[0] < one.measured < one.interval[1] for one in result.holdout.figures if one.interval]
    assert len(inside) >= 10 and np.mean(inside) >= 0.8


def test_the_frame_of_the_velocities_was_found_and_reported(result: Identification) -> None:
    for name in (*FITTED, *HELD_OUT):
        assert any(name in notice and "earth-fixed" in notice for notice in result.notices)
