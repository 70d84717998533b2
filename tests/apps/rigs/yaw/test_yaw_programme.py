"""The programmed motion against the printed segments, papers.md 3.2 and what mirror images are."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tank2sim.apps.rigs.yaw.programme import PAPER_PROGRAMME, Similarity, YawProgramme, full_turns
from tests.yaw_truth import Truth

PROGRAMMES = st.builds(
    YawProgramme,
    max_rate_radps=st.floats(0.05, 1.0) | st.floats(-1.0, -0.05),
    rise_s=st.floats(2.0, 20.0),
    kind=st.sampled_from(["unidirectional", "reversing"]),
    humps=st.sampled_from([2, 4]),
)


def test_numbers_of_the_paper():
    assert PAPER_PROGRAMME.steepness == pytest.approx(0.0477129, abs=5e-8)
    assert PAPER_PROGRAMME.max_acceleration_radps2 == pytest.approx(9 * math.pi / 400, rel=1e-12)
    assert PAPER_PROGRAMME.period_s == pytest.approx(17.78, abs=0.005)
    (begin, end), _ = PAPER_PROGRAMME.pairs()[0]
    np.testing.assert_allclose(PAPER_PROGRAMME.at(np.array([begin, end])).rate_radps, [0.06152, 0.20028], atol=5e-6)


@pytest.mark.parametrize("reversing", [False, True])
def test_rate_is_the_printed_one(reversing):
    programme = replace(PAPER_PROGRAMME, kind="reversing" if reversing else "unidirectional", humps=2)
    times = np.linspace(0, programme.end_s, 2001)[:-1]
    truth = Truth(reversing=reversing)
    np.testing.assert_allclose(programme.at(times).rate_radps, [truth.rate(t) for t in times], atol=1e-12)


@settings(max_examples=20, deadline=None)
@given(PROGRAMMES)
def test_angle_rate_and_acceleration_belong_together(programme):
    times = np.linspace(programme.start_s, programme.end_s, 4001)
    angle, rate, acceleration = programme.at(times)
    step = times[1] - times[0]
    top = programme.max_acceleration_radps2
    assert np.abs(np.gradient(angle, times)[1:-1] - rate[1:-1]).max() < top * step
    assert np.abs(np.diff(rate)).max() <= top * step * (1 + 1e-9)
    assert np.abs(acceleration).max() == pytest.approx(top, rel=1e-9)
    assert np.abs(rate).max() == pytest.approx(abs(programme.max_rate_radps), rel=1e-9)


@settings(max_examples=20, deadline=None)
@given(PROGRAMMES)
def test_pairs_are_mirror_images(programme):
    share = np.linspace(0, 1, 21)
    for pair in programme.pairs():
        forth, back = (begin + share * (end - begin) for begin, end in pair)
        one, other = programme.at(forth), programme.at(back[::-1])
        sign = -1 if programme.kind == "reversing" else 1
        np.testing.assert_allclose(other.rate_radps, sign * one.rate_radps, atol=1e-12)
        np.testing.assert_allclose(np.abs(other.acceleration_radps2), np.abs(one.acceleration_radps2), atol=1e-12)
        if programme.kind == "reversing":  # through the very same angles
            np.testing.assert_allclose(other.angle_rad, one.angle_rad, atol=1e-9)
        swept = abs(one.angle_rad[-1] - one.angle_rad[0])
        assert swept == pytest.approx(programme.turn_per_interval_rad, rel=1e-9)


def test_full_turns_sweep_one_turn():
    assert full_turns(PAPER_PROGRAMME).turn_per_interval_rad == pytest.approx(2 * math.pi, rel=1e-12)


def test_similarity_is_that_of_the_paper():
    similarity = Similarity(ship_length_m=38, ship_beam_m=8, length_m=0.67, beam_m=0.2)
    assert similarity.rate_ratio == pytest.approx(8.968, abs=5e-4)
    programme = similarity.programme(math.radians(100 / 60), 120.0)
    assert programme.max_rate_radps == pytest.approx(PAPER_PROGRAMME.max_rate_radps, rel=0.01)
    assert programme.rise_s == pytest.approx(PAPER_PROGRAMME.rise_s, rel=0.01)


@pytest.mark.parametrize("changes", [{"settle_s": 2.0}, {"rise_s": 0.0}, {"kind": "reversing", "humps": 3}])
def test_a_programme_that_is_none_is_refused(changes):
    with pytest.raises(ValueError):
        replace(PAPER_PROGRAMME, **changes)
