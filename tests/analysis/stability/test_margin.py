"""C' and what moves it, against the papers' formula, finite differences and the ship made neutral."""

from __future__ import annotations

import pytest

from tank2sim.analysis.stability.margin import Margin, stability_margin, trim_effect
from tank2sim.analysis.stability.straight_line import stability
from tank2sim.cards import read_card
from tank2sim.dynamics import build
from tests.marks import first_fast

SYMMETRIC = {f"derivatives.{name}": 0.0 for name in ("Y0", "Y0u", "Y0uu", "N0", "N0u", "N0uu")}
YV, YR, NV, NR = -1160e-5, -499e-5, -264e-5, -166e-5
MASS, X_G = 798e-5, -0.023


@pytest.fixture(scope="module")
def symmetric() -> Margin:
    return stability_margin(build(read_card("mariner", SYMMETRIC)))


def influence(margin: Margin, name: str):
    return next(one for one in margin.derivatives if one.short_name == name)


def test_the_criterion_and_its_margin_are_those_of_the_printed_numbers(symmetric) -> None:
    assert symmetric.C_prime == pytest.approx(YV * NR - NV * YR, rel=1e-9)
    assert symmetric.margin_percent == pytest.approx(100 * (1 - NV * YR / (YV * NR)), rel=1e-9)
    assert symmetric.lever_margin_lengths == pytest.approx(NR / YR - NV / YV, rel=1e-9)


def test_influences_and_neutral_values_of_a_symmetric_ship_are_in_closed_form(symmetric) -> None:
    criterion = YV * NR - NV * YR
    expected = {"Yv": YV * NR, "Nr": YV * NR, "Nv": -NV * YR, "Yr": -NV * YR}
    for name, product in expected.items():
        assert influence(symmetric, name).percent == pytest.approx(10 * product / criterion, rel=1e-9)
    assert influence(symmetric, "Nr").neutral_value == pytest.approx(NV * YR / YV, rel=1e-9)
    assert influence(symmetric, "Yr").neutral_percent == pytest.approx(100 * (YV * NR / NV / YR - 1), rel=1e-9)


@first_fast("name", ["Yv", "Nr", "Yvu", "N0"])
def test_sensitivities_are_those_of_finite_differences_of_the_whole_analysis(name: str) -> None:
    """Of an asymmetric ship off her speed, so that the straight course moves too."""
    card = read_card("mariner")
    found = stability_margin(build(card), 6.0)
    value = card.derivatives[name]
    step = 1e-4 * abs(value)
    ends = [
        stability(
            build(read_card("mariner", {f"derivatives.{name}": value + side * step})), 6.0
        ).stability_criterion.C_prime
        for side in (1, -1)
    ]
    slope = next((one.slope for one in found.derivatives if one.short_name == name), None)
    difference = (ends[0] - ends[1]) / (2 * step)
    if slope is None:  # too weak to be reported
        assert abs(0.1 * difference * value) < 1e-3 * abs(found.C_prime)
    else:
        assert slope == pytest.approx(difference, rel=1e-6)


@pytest.mark.slow
def test_a_ship_with_the_neutral_value_is_neutral() -> None:
    found = stability_margin(build(read_card("kvlcc2-captive")))
    assert found.C_prime < 0
    for name in ("Nr", "Nv", "Yr"):
        neutral = influence(found, name).neutral_value
        there = stability(build(read_card("kvlcc2-captive", {f"derivatives.{name}": neutral})))
        assert abs(there.stability_criterion.C_prime) < 1e-7 * abs(found.C_prime)


def test_the_curve_over_speed_is_the_analysis_at_each_speed(mariner) -> None:
    found = stability_margin(mariner).speed
    assert found is not None
    for row in (6, 12, 24):
        there = stability(mariner, float(found.speed_mps[row]))
        assert found.C_prime[row] == pytest.approx(there.stability_criterion.C_prime, rel=1e-3)  # U there, u here
    slope = (found.C_prime[13] - found.C_prime[11]) / (found.speed_mps[13] - found.speed_mps[11])
    assert found.slope_s_per_m[12] == pytest.approx(slope, rel=0.02)


def test_both_readings_of_the_papers_trim_act_on_the_derivative_without_inertia(symmetric) -> None:
    found = trim_effect(build(read_card("mariner", SYMMETRIC)), symmetric)
    bare_r = NR + MASS * X_G
    more = YV * (NR + 0.075 * bare_r) - NV * YR
    assert found.paper_7_5_percent["Nr"].more == pytest.approx(more, rel=1e-9)
    sway = YV * NR - NV * (YR + 0.075 * (YR + MASS))
    assert found.paper_7_5_percent["Yr"].more == pytest.approx(sway, rel=1e-9)


def test_trim_by_the_stern_steadies_the_ship_and_by_the_bow_unsettles_her(symmetric) -> None:
    """After Inoue et al. (1981): at 1 % of L by the stern tau/d = 1.6093/7.468."""
    criteria = trim_effect(build(read_card("mariner", SYMMETRIC)), symmetric).inoue_1981.C_prime
    ratio = 1.6093 / 7.468
    yv, nv = YV * (1 + 2 / 3 * ratio), NV * (1 - 0.27 / (NV / YV) * ratio)
    yr, nr = (YR + MASS) * (1 + 0.8 * ratio) - MASS, (NR + MASS * X_G) * (1 + 0.3 * ratio) - MASS * X_G
    assert criteria[-1] == pytest.approx(yv * nr - nv * yr, rel=1e-6)
    assert criteria[0] < criteria[10] < criteria[-1]
    assert criteria[10] == pytest.approx(symmetric.C_prime, rel=1e-9)
