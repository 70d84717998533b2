"""Influence, tuning and steering models as a user of the API has them: against the simulated ship."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

import tank2sim as t2s


@pytest.fixture(scope="module")
def mariner() -> t2s.Ship:
    return t2s.load("mariner")


@pytest.fixture(scope="module")
def found(mariner: t2s.Ship) -> t2s.InfluenceResult:
    return mariner.influence(["advance_m@35", "overshoot_1_deg@20/20"], joint_variation={"Nd": 0.1, "Nr": -0.1})


def test_a_coefficient_is_the_change_of_the_simulated_figure(mariner: t2s.Ship, found: t2s.InfluenceResult) -> None:
    value = float(found.parameters.loc["derivatives.Nd", "value"])
    more, less = (mariner.replace({"derivatives.Nd": share * value}) for share in (1.005, 0.995))
    pairs = {
        "advance_m@35": [ship.turn(35).figures["advance_m"] for ship in (less, more)],
        "overshoot_1_deg@20/20": [ship.zigzag(20, 20).figures["overshoot_1_deg"] for ship in (less, more)],
    }
    for figure, (low, high) in pairs.items():
        change = 10 * 100 * (high - low) / found.figures.loc[figure, "value"]
        assert found.coefficients.loc["derivatives.Nd", figure] == pytest.approx(change, rel=0.01)


def test_figures_of_the_api_are_those_of_a_simulation(mariner: t2s.Ship, found: t2s.InfluenceResult) -> None:
    assert found.figures.loc["advance_m@35", "value"] == pytest.approx(mariner.turn(35).figures["advance_m"], rel=1e-4)
    first = mariner.zigzag(20, 20).figures["overshoot_1_deg"]
    assert found.figures.loc["overshoot_1_deg@20/20", "value"] == pytest.approx(first, rel=1e-3)


def test_shares_of_independent_errors_make_up_the_variance(found: t2s.InfluenceResult) -> None:
    np.testing.assert_allclose(found.variance_shares.sum(), 1.0, rtol=1e-9)


@pytest.mark.slow
def test_the_tuned_ship_makes_the_turn_that_was_the_target(mariner: t2s.Ship) -> None:
    tuning = mariner.tune("tactical_diameter_m@35=1000", by="fewest")
    assert tuning.reached and len(tuning.moves) == 1
    assert tuning.tuned_ship.turn(35).figures["tactical_diameter_m"] == pytest.approx(1000, rel=1e-4)
    (name,) = tuning.moves.index
    assert tuning.tuned_ship.derivatives.loc[name.removeprefix("derivatives."), "value"] != pytest.approx(
        mariner.derivatives.loc[name.removeprefix("derivatives."), "value"], rel=1e-3
    )


def test_targets_that_contradict_each_other_have_no_card(mariner: t2s.Ship) -> None:
    tuning = mariner.tune(["steady_radius_m@20=640", "steady_diameter_m@20=1200"])
    with pytest.raises(t2s.InputError) as refused:
        _ = tuning.card
    assert not tuning.reached and refused.value.source == "targets" and "within" in refused.value.remedy


def test_the_scaled_ship_turns_through_both_points(mariner: t2s.Ship) -> None:
    tuning = mariner.tune_through(["35@35", "1400m@3"])
    assert tuning.turns["rate_after_degpmin"].iloc[0] == pytest.approx(35)
    run = tuning.tuned_ship.turn(35)
    assert 60 * run.figures["steady_rate_degps"] == pytest.approx(35, rel=2e-3)
    shallow = tuning.tuned_ship.turn(3, duration_s=3000)
    u, v, r = (shallow.df[name].iloc[-1] for name in ("u_mps", "v_mps", "r_degps"))
    assert math.hypot(u, v) / abs(math.radians(r)) == pytest.approx(1400, rel=2e-3)


@pytest.mark.slow
def test_models_of_a_steering_card_turn_as_the_paper_prints() -> None:
    """Poznyakov & Yudin (2007), radius at 20 deg of rudder of the Japanese model, and K of C_m^omega."""
    models = t2s.steering_models("poznyakov-yudin")
    turns = models.turns.set_index(["model", "rudder_deg"])
    assert turns.loc[("inoue-hirano", 20.0), "radius_m"] == pytest.approx(399.6, abs=0.25)
    assert models.coefficients.loc["C_m_w", "inoue-hirano"] == pytest.approx(7.1, abs=0.05)


@pytest.mark.parametrize(
    ("call", "source", "place"),
    [
        (lambda ship: ship.influence("steady_radius"), "figures", "steady_radius"),
        (lambda ship: ship.influence("criterion_C", joint_variation={"Yq": 1.0}), "joint_variation", "Yq"),
        (lambda ship: ship.influence("criterion_C", members=1), "members", ""),
        (lambda ship: ship.tune("steady_radius_m@20"), "targets", "steady_radius_m@20"),
        (lambda ship: ship.tune([]), "targets", ""),
        (lambda ship: ship.tune("criterion_C=5e-6", by="luck"), "by", ""),
        (lambda ship: ship.tune("criterion_C=5e-6", within=0.0), "within", ""),
        (lambda ship: ship.tune_through(["35@35", "much@3"]), "points", "much@3"),
    ],
)
def test_what_cannot_be_asked_is_refused_at_its_place(mariner: t2s.Ship, call, source: str, place: str) -> None:
    with pytest.raises(t2s.InputError) as refused:
        call(mariner)
    assert (str(refused.value.source), refused.value.place) == (source, place)
    assert refused.value.remedy


def test_a_ship_card_is_not_a_steering_card() -> None:
    with pytest.raises(t2s.InputError) as refused:
        t2s.steering_models("mariner")
    assert refused.value.remedy


def test_no_name_of_a_parameter_is_cut_in_the_charts_of_a_craft() -> None:
    """Vega cuts labels at 180 px where an axis states no limit."""
    cut = []
    for name, chart in t2s.load("otter").influence()._charts().items():
        for part in _parts(chart):
            for axis, field in ((part.get("y"), "name"), (part.get("y"), "figure"), (part.get("x"), "name")):
                if isinstance(axis, dict) and axis.get("field") == field:
                    labels = {row[field] for row in _rows(chart) if field in row}
                    widest = 7 * max(map(len, labels), default=0)  # px; Arial takes 6 a letter, the widest fonts 7
                    if widest > (axis.get("axis") or {}).get("labelLimit", 180):
                        cut.append((name, field))
    assert not cut


def _parts(chart: object) -> Iterator[dict[str, Any]]:
    """All mappings in a chart."""
    if isinstance(chart, dict):
        yield chart
    for part in chart.values() if isinstance(chart, dict) else chart if isinstance(chart, list) else ():
        yield from _parts(part)


def _rows(chart: object) -> list[dict[str, Any]]:
    """All rows of the data of a chart."""
    return [row for part in _parts(chart) if isinstance(part.get("values"), list) for row in part["values"]]
