"""Trials are brought to the size of the card's ship, whichever of the two is the model."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import tank2sim as t2s
from tank2sim.cards import ManoeuvringCard, parse_card, read_card
from tank2sim.errors import InputError
from tank2sim.identification.trials.problem.prepare_trials import at_size_of, coarse_rows, measured
from tank2sim.notices import Level
from tank2sim.records.reading import read_trial_file
from tank2sim.records.trials import Trial, froude_scaled


@pytest.fixture(scope="module")
def card() -> ManoeuvringCard:
    known = read_card("mariner")
    assert isinstance(known, ManoeuvringCard)
    return known


def straight(speed: float, scale: float | None = None) -> Trial:
    time = np.arange(0.0, 100.0, 0.5)
    signals = {"delta_rad": 0.1 * np.sin(time / 20), "u_mps": np.full(200, speed), "r_radps": 0.01 * np.sin(time / 20)}
    return Trial(Path("made.csv"), time, signals, scale=scale)


@pytest.mark.parametrize(("is_model", "factor"), [(True, 40.0), (False, 1.0)])
def test_a_trial_that_tells_its_scale_comes_to_the_ships_size(
    is_model: bool, factor: float, card: ManoeuvringCard
) -> None:
    full = straight(card.model.speed_mps, scale=40.0)
    given = froude_scaled(full, 1 / 40.0) if is_model else full
    found, by = at_size_of(given, card)
    assert by == factor
    np.testing.assert_allclose(found.time_s, full.time_s)
    for name, values in full.signals.items():
        np.testing.assert_allclose(found.signals[name], values, rtol=1e-12, err_msg=name)


def test_a_full_scale_trial_comes_to_the_size_of_a_model_card(card: ManoeuvringCard) -> None:
    small = replace(card, model=card.model.model_copy(update={"speed_mps": card.model.speed_mps / 40**0.5}))
    found, by = at_size_of(straight(card.model.speed_mps, scale=40.0), small)
    assert by == pytest.approx(1 / 40)
    assert found.signals["u_mps"][0] == pytest.approx(small.model.speed_mps)


def test_a_model_trial_without_a_scale_is_refused_with_what_to_do(card: ManoeuvringCard) -> None:
    with pytest.raises(InputError, match="# scale"):
        at_size_of(straight(card.model.speed_mps / 7), card)


def write(path: Path, columns: str, rows: str) -> Path:
    path.write_text(f"{columns}\n{rows}", encoding="utf-8")
    return path


def test_orders_and_angles_do_not_mix(tmp_path: Path, card: ManoeuvringCard) -> None:
    rows = "".join(f"{t},{np.sin(t / 9):.3f},7.7\n" for t in range(60))
    one = write(tmp_path / "a.csv", "t_s,delta_deg,u_mps", rows)
    two = write(tmp_path / "b.csv", "t_s,delta_order_deg,u_mps", rows)
    assert measured([one], card).driven_by == "angle"
    assert measured([two], card).driven_by == "order"
    with pytest.raises(InputError, match=r"b\.csv.*delta_deg"):
        measured([one, two], card)


def test_a_trial_given_twice_is_refused(tmp_path: Path, card: ManoeuvringCard) -> None:
    rows = "".join(f"{t},{np.sin(t / 9):.3f},7.7\n" for t in range(60))
    one = write(tmp_path / "a.csv", "t_s,delta_deg,u_mps", rows)
    with pytest.raises(InputError, match="once"):
        measured([one, one], card)


def test_hsva_and_marin_come_to_the_same_ship(data: Path) -> None:
    card = read_card("kvlcc2-captive")
    assert isinstance(card, ManoeuvringCard)
    hsva = measured([data / "data/kvlcc2_hsva/HSVA_CPMC_KVLCC2_Z_10_10_P.dat"], card).trials[0]
    marin = measured([data / "data/kvlcc2_marin/MARIN_FREE_KVLCC2_zz_10_m.dat"], card).trials[0]
    for trial in (hsva, marin):
        assert trial.signals["u_mps"][:50].mean() == pytest.approx(card.model.speed_mps, rel=0.02)
        assert np.abs(trial.signals["v_mps"]).max() < 2.0, "body velocities after the audit"
    assert hsva.signals["r_radps"].max() == pytest.approx(marin.signals["r_radps"].max(), rel=0.1)


def test_a_tanker_is_no_mariner(data: Path, card: ManoeuvringCard) -> None:
    with pytest.raises(InputError, match=r"7 m.*160\.93 m"):
        measured([data / "data/kvlcc2_hsva/HSVA_CPMC_KVLCC2_Z_10_10_P.dat"], card)


def test_wind_that_the_card_cannot_take_is_reported(tmp_path: Path, card: ManoeuvringCard) -> None:
    rows = "".join(f"{t},{np.sin(t / 9):.3f},7.7,5,200\n" for t in range(60))
    one = write(tmp_path / "a.csv", "t_s,delta_deg,u_mps,wind_speed_mps,wind_direction_deg", rows)
    assert any("wind was measured" in notice for notice in measured([one], card).notices)
    assert not measured([one], card, report_unused=False).notices


@pytest.mark.parametrize(
    ("rpm", "speed", "refused"), [(84.0, 7.7, False), (1.4, 7.7, True), (5040.0, 7.7, True), (3.0, 3.6, False)]
)
def test_revolutions_of_another_unit_than_the_cards_are_refused(
    tmp_path: Path, card: ManoeuvringCard, rpm: float, speed: float, refused: bool
) -> None:
    rows = "".join(f"{t},{np.sin(t / 9):.3f},{speed + 0.001 * t},{rpm + 0.001 * t}\n" for t in range(60))
    one = write(tmp_path / "a.csv", "t_s,delta_deg,u_mps,n_rpm", rows)
    text = (
        card.text if "[propulsion]" in card.text else card.text + "\n[propulsion]\nnominal_rpm = 84.0\nXnn = 0.0005\n"
    )
    driven = parse_card(text, "ship.toml")
    assert isinstance(driven, ManoeuvringCard)
    if refused:
        with pytest.raises(InputError, match=r"rpm") as raised:
            measured([one], driven)
        assert raised.value.place == "column of the revolutions"
    else:
        assert len(measured([one], driven).trials) == 1


def test_wind_is_reported_to_be_unused_by_the_effects_that_a_card_has_and_not_by_how_many(
    tmp_path: Path, card: ManoeuvringCard
) -> None:
    rows = "".join(f"{t},{np.sin(t / 9):.3f},7.7,5,200\n" for t in range(60))
    one = write(tmp_path / "a.csv", "t_s,delta_deg,u_mps,wind_speed_mps,wind_direction_deg", rows)
    wind = '\n[[effects]]\nname = "wind"\nparameters = {speed_mps = 5.0, direction_deg = 200.0}\n'
    current = '\n[[effects]]\nname = "current"\nparameters = {speed_mps = 0.5, direction_deg = 120.0}\n'
    for effects, unused in ((wind, False), (current, True), (wind + current, False)):
        own = parse_card(card.text + effects, "ship.toml")
        assert isinstance(own, ManoeuvringCard)
        assert any("wind was measured" in notice for notice in measured([one], own).notices) == unused, effects


def test_the_same_fault_of_several_trials_is_reported_once(tmp_path: Path, card: ManoeuvringCard) -> None:
    """Straight and then turning, in a current of 1 m/s, with velocities through the water."""
    time = np.arange(0.0, 300.0, 1.0)
    paths = []
    for number, current in enumerate((1.0, 1.1)):
        rate = np.where(time > 60.0, 0.01, 0.0)
        psi = np.cumsum(rate)
        u, v = 7.0 + 0.3 * np.sin(time / 30), 0.2 * np.sin(time / 20)
        x = np.cumsum(u * np.cos(psi) - v * np.sin(psi) + current)
        y = np.cumsum(u * np.sin(psi) + v * np.cos(psi))
        columns = np.column_stack([time, 500 * rate, u, v, np.rad2deg(rate), np.rad2deg(psi), x, y])
        rows = "\n".join(",".join(f"{value:.6g}" for value in row) for row in columns)
        names = "t_s,delta_deg,u_mps,v_mps,r_degps,psi_deg,x_m,y_m"
        paths.append(write(tmp_path / f"trial_{number}.csv", names, rows))
    each = [measured([path], card).notices for path in paths]
    assert all(any("a current of" in notice for notice in notices) for notices in each)
    (together,) = [notice for notice in measured(paths, card).notices if "a current of" in notice]
    assert "trial_0" in together and "trial_1" in together


def test_columns_that_are_left_out_are_named_with_their_files(card: ManoeuvringCard, tmp_path: Path) -> None:
    time = np.arange(0.0, 100.0, 0.5)
    for name, speed in (("one", 7.7), ("two", 7.2)):
        rows = [f"{t},{5 * np.sin(t / 20):.4f},{speed},{0.05 * speed * np.sin(t / 20 - 0.3):.4f},1" for t in time]
        (tmp_path / f"{name}.csv").write_text("\n".join(["t_s,delta_deg,u_mps,r_degps,rudder", *rows]) + "\n")
    given = [read_trial_file(tmp_path / f"{name}.csv") for name in ("one", "two")]
    (notice,) = [notice for notice in measured(given, card).notices if "left out" in notice]
    assert notice.startswith("one.csv, two.csv: ") and notice.endswith(": rudder")


@pytest.fixture(scope="module")
def zigzags(tmp_path_factory: pytest.TempPathFactory) -> dict[str, pd.DataFrame]:
    """Trials of the Mariner with ten rows a second; L/u0 is 20.9 s, and a movement by 20 deg takes 5 s."""
    ship, tables = t2s.load("mariner"), {}
    for name, angle in (("a", 20), ("b", 10)):
        path = tmp_path_factory.mktemp("zigzag") / f"{name}.csv"
        ship.zigzag(angle, angle).to_csv(path)
        tables[name] = pd.read_csv(path, comment="#")
    return tables


@pytest.mark.parametrize(("rows", "warned"), [(10, False), (16, False), (17, True), (50, True)])
def test_rows_too_far_apart_are_a_caution_with_step_and_remedy(card, zigzags, tmp_path, rows, warned) -> None:
    trials = []
    for name, table in zigzags.items():
        table.iloc[::rows].to_csv(tmp_path / f"{name}.csv", index=False)
        trials.append(read_trial_file(tmp_path / f"{name}.csv"))
    found = list(coarse_rows(trials, card))
    assert bool(found) == warned
    if warned:
        (notice,) = found
        assert notice.level is Level.CAUTION and notice.startswith(f"a.csv, b.csv: rows are {rows / 10:g} s apart")
        assert "give rows at most 1.7 s apart" in notice


def test_a_rudder_that_moves_within_a_step_asks_for_closer_rows(card, zigzags, tmp_path) -> None:
    fast = replace(
        card, steering_gear=card.steering_gear.model_copy(update={"max_rate_radps": 1.0, "time_constant_s": 0.1})
    )
    zigzags["a"].iloc[::10].to_csv(tmp_path / "a.csv", index=False)
    trial = read_trial_file(tmp_path / "a.csv")
    assert list(coarse_rows([trial], fast)) and not list(coarse_rows([trial], card))


def test_an_estimate_from_coarse_rows_is_off_and_says_so(zigzags) -> None:
    ship = t2s.load("mariner")
    errors = {}
    for rows in (10, 50):
        found = t2s.identify(ship, [table.iloc[::rows].reset_index(drop=True) for table in zigzags.values()])
        value = found.estimates.loc["derivatives.Nr", "value"]
        errors[rows] = abs(value / ship.card.derivatives["Nr"] - 1)
        assert any("rows are 5 s apart" in notice for notice in found.cautions) == (rows == 50)
    assert errors[10] < 0.02 and errors[50] > 0.05
