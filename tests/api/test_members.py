"""Ships of an ensemble as a data frame: its quantiles are the bands, and each row is a ship that can be simulated."""

from __future__ import annotations

import json
import math

import numpy as np
import pandas as pd
import pytest

import tank2sim as t2s
from tank2sim.api.results import read_result

CURRENT = """
[[effects]]
name = "current"
[effects.parameters]
speed_mps = 0.5
direction_deg = 90.0
[effects.uncertainty]
direction_deg = 5.73
"""


@pytest.fixture(scope="module")
def in_current(tmp_path_factory) -> str:
    """A card with the rudder positive to port and an effect whose angle is in deg."""
    path = tmp_path_factory.mktemp("cards") / "ship.toml"
    t2s.load("mariner").card.save(path)
    text = path.read_text()
    assert 'rudder_sign = "port"' in text
    path.write_text(text + CURRENT)
    return str(path)


@pytest.fixture(scope="module")
def turned(in_current) -> t2s.ManoeuvreResult:
    return t2s.load(in_current).turn(20, members=40, seed=3)


def assert_bands(bands, frame: pd.DataFrame) -> None:
    assert bands
    for name, band in bands.items():
        quantiles = np.quantile(frame[name].dropna(), [0.05, 0.5, 0.95])
        assert [band.p5, band.p50, band.p95] == pytest.approx(quantiles, rel=1e-12), name
        assert band.shown_by == frame[name].notna().sum()


def test_the_bands_are_quantiles_of_the_members(turned) -> None:
    members = turned.members
    assert len(members) == 40 and members.usable.all() and members.index.name == "member"
    assert_bands(turned.study.ensemble.figures, members)
    direction = members["effects.0.parameters.direction_deg"]
    assert abs(direction.mean() - 90) < 3 * 5.73 / math.sqrt(40) and 3 < direction.std() < 9


def test_a_row_on_the_card_gives_its_figures(turned, in_current) -> None:
    numbers = [name for name in turned.members if "." in name]
    for member in (0, 17, 39):
        row = turned.members.loc[member]
        alone = t2s.load(in_current, row[numbers].astype(float).to_dict()).turn(20)
        for name, value in alone.figures.items():
            assert row[name] == pytest.approx(value, rel=5e-4), name


def test_members_of_influence_are_those_of_their_figures(in_current) -> None:
    ship = t2s.load("mariner")
    found = ship.influence(["steady_radius_m@20", "advance_m@35"], members=12, seed=5)
    assert_bands(found.study.ensemble.figures, found.members)
    row = found.members.loc[7]
    alone = t2s.load("mariner", {name: float(row[name]) for name in row.index if name.startswith("derivatives.")})
    assert row["advance_m@35"] == pytest.approx(alone.turn(35).figures["advance_m"], rel=5e-4)


@pytest.mark.slow
def test_members_of_stability_give_the_probabilities() -> None:
    found = t2s.load("mariner").stability(spirals=False, members=8, seed=2)
    members, ensemble = found.members, found.study.ensemble
    assert_bands(ensemble.figures, members)
    judged = [chance for chance in ensemble.imo if chance.probability_met is not None]
    assert len(judged) > 4
    for chance in judged:
        assert chance.probability_met == (members[chance.name] <= chance.allowed).mean()
    row = members.loc[3]
    alone = t2s.load("mariner", {name: float(row[name]) for name in row.index if name.startswith("derivatives.")})
    single = alone.stability(spirals=False)
    assert row["criterion_C"] == pytest.approx(single.criterion, rel=1e-6)
    assert row["tactical diameter"] == pytest.approx(single.imo.loc["tactical diameter", "found"], rel=5e-4)


def test_without_an_ensemble_members_are_asked_for() -> None:
    run = t2s.load("mariner").turn(20, duration_s=60.0)
    with pytest.raises(t2s.InputError, match="give members=100"):
        _ = run.members


def test_the_json_has_the_bands_alone(turned, tmp_path) -> None:
    path = tmp_path / "turn.json"
    turned.to_json(path)
    assert "drawn" not in json.loads(path.read_text())["ensemble"]
    with pytest.raises(t2s.InputError, match="compute the result again"):
        _ = read_result(json.loads(path.read_text()), str(path)).members


def assert_deviations(deviations, frame: pd.DataFrame) -> None:
    """Deviations of figures, by ``trial: figure``, are half the distances between quantiles of the members."""
    assert len(deviations) > 4
    for name, deviation in deviations.items():
        low, high = np.quantile(frame[name].dropna(), [0.158655, 0.841345])
        assert deviation == pytest.approx((high - low) / 2, rel=1e-9), name


def test_members_of_a_comparison_have_their_card() -> None:
    mariner = t2s.load("mariner")
    other = mariner.replace({"derivatives.Yv": -0.012})
    found = t2s.compare([mariner, other], members=6)
    frame = found.members
    assert list(frame["card"]) == [label for label in found.labels for _ in range(6)] and frame.usable.all()
    figures = found.figures
    for label in found.labels:
        rows = figures[(figures["card"] == label) & figures["standard_deviation"].notna()]
        names = rows["trial"] + ": " + rows["figure"]
        assert_deviations(dict(zip(names, rows["standard_deviation"], strict=True)), frame[frame["card"] == label])
    assert (frame["derivatives.Yv"] < 0).all()


def test_members_of_a_validation_give_its_deviations(tmp_path) -> None:
    ship = t2s.load("mariner")
    ship.turn(20).to_csv(tmp_path / "turn.csv")
    found = t2s.validate(ship, [tmp_path / "turn.csv"], members=6)
    frame = found.members
    assert len(frame) == 6 and frame.usable.all() and "derivatives.Nr" in frame
    rows = found.verification.dropna(subset="deviation")
    assert_deviations(dict(zip(rows["trial"] + ": " + rows["figure"], rows["deviation"], strict=True)), frame)
    assert frame["turn: advance_m"].std() > 0
    assert "drawn" not in found.to_dict()
    with pytest.raises(t2s.InputError, match="compute the result again"):
        _ = read_result(found.to_dict(), "validation.json").members
    with pytest.raises(t2s.InputError, match="give members=100"):
        _ = t2s.validate(ship, members=0).members


def test_members_of_a_sea_trial_have_figures_in_both_conditions(tmp_path) -> None:
    ship = t2s.load("mariner")
    ship.turn(20).to_csv(tmp_path / "turn.csv")
    found = t2s.trial_office(tmp_path / "turn.csv", ship=ship, members=5)
    frame = found.members
    assert len(frame) == 5 and frame.usable.all() and frame["derivatives.Nr"].std() > 0
    assert frame["turn, as tried: advance_m"].std() > 0 and frame["turn, at full load: advance_m"].std() > 0


def test_members_of_predictions_give_their_intervals(tmp_path) -> None:
    ship = t2s.load("mariner")
    for name, run in (("zigzag", ship.zigzag(20, 20)), ("turn", ship.turn(20))):
        run.to_csv(tmp_path / f"{name}.csv")
    found = t2s.identify("mariner", tmp_path / "zigzag.csv", holdout=tmp_path / "turn.csv", members=8)
    frame = found.members
    assert len(frame) == 8 and frame["derivatives.Nr"].std() > 0
    intervals = found.figures[found.figures["set"] == "held out"].dropna(subset="low_95")
    assert len(intervals) > 1
    for row in intervals.itertuples():
        low, high = np.quantile(frame[f"turn: {row.figure}"].dropna(), [0.025, 0.975])
        assert row.low_95 <= low + 1e-9 and row.high_95 >= high - 1e-9, row.figure  # reading errors make them wider
    with pytest.raises(t2s.InputError, match="hold out a turn"):
        _ = t2s.identify("mariner", tmp_path / "zigzag.csv").members


@pytest.mark.parametrize("members", [3, 20])
def test_a_band_of_a_few_ships_is_doubted(members: int) -> None:
    found = t2s.load("mariner").turn(20, members=members)
    assert any(f"a band of {members} ships" in notice for notice in found.cautions) == (members == 3)
