"""Poster, pilot card and steering page as a user of the API has them: against the simulated ship."""

from __future__ import annotations

from pathlib import Path

import pytest

import tank2sim as t2s


@pytest.fixture(scope="module")
def poster() -> t2s.PosterResult:
    return t2s.load("mariner").poster()


def test_the_circles_of_a_poster_are_those_of_a_simulated_turn(poster: t2s.PosterResult) -> None:
    found = poster.to_dict()
    circle = found["turning_circles_deep"][0]  # type: ignore[index]
    run = t2s.load("mariner").turn(found["rudder_deg"])  # type: ignore[arg-type]
    assert found["schema"] == "tank2sim/poster/1" and found["rudder_deg"] == pytest.approx(
        40
    )  # the largest of its gear
    assert max(circle["ahead_m"]) == pytest.approx(run.df["x_m"].max(), rel=0.01)
    assert max(map(abs, circle["starboard_m"])) == pytest.approx(run.df["y_m"].abs().max(), rel=0.01)


def test_the_blanks_of_a_sheet_are_counted(poster: t2s.PosterResult, tmp_path: Path) -> None:
    poster.to_html(tmp_path / "poster.html")
    page = (tmp_path / "poster.html").read_text(encoding="utf-8")
    assert poster.blanks == page.count('title="not known') + page.count('title="outside') > 10
    assert any("[propulsion]" in notice for notice in poster.notices)


@pytest.mark.slow
def test_a_pilot_card_is_written_with_the_speeds_of_its_orders(tmp_path: Path) -> None:
    ship = t2s.load("esso-osaka-estimated")
    nominal = ship.card.propulsion.nominal_radps * 30 / 3.141592653589793  # type: ignore[attr-defined]
    card = ship.pilot_card(order={"Full sea speed": nominal, "Half ahead": nominal / 2})
    card.to_html(tmp_path / "pilot.html")
    assert "Half ahead" in (tmp_path / "pilot.html").read_text(encoding="utf-8")
    # A ship that is left alone with these revolutions comes to that speed.
    run = ship.steer({"t_s": [0], "delta_order_deg": [0], "n_rpm": [nominal / 2]}, duration_s=3000)
    speed = card.telegraph.set_index("order").loc["Half ahead", "speed_mps"]
    assert run.df["u_mps"].iloc[-1] == pytest.approx(speed, rel=0.01)
    assert card.schema == "tank2sim/pilotcard/1"


@pytest.mark.parametrize(
    ("options", "source", "place"),
    [
        ({"order": {"Half ahead": -3.0}}, "order", "Half ahead=-3"),
        ({"order": {"Full astern": 60.0}}, "order", "Full astern=60"),
        ({"order": {"a": 60.0, "A": 50.0}}, "order", "A=50"),
        ({"order": {f"order {number}": 50.0 for number in range(4)}}, "order", "order 3=50"),
        ({"ballast": "kvlcc2-captive"}, "kvlcc2-captive", "ship"),
        ({"ballast": "mariner"}, "mariner", "ship.draught_m"),
    ],
)
def test_what_a_sheet_cannot_show_is_refused_at_its_place(options, source: str, place: str) -> None:
    with pytest.raises(t2s.InputError) as refusal:
        t2s.load("mariner").poster(**options)
    assert source in str(refusal.value.source) and refusal.value.place == place
    assert refusal.value.remedy


def test_a_card_is_never_overwritten_by_its_own_sheet(tmp_path: Path) -> None:
    path = tmp_path / "ship.toml"
    t2s.load("mariner").save(path)
    with pytest.raises(t2s.InputError):
        t2s.load(path).poster().to_html(path)
    assert t2s.load(path).name == "Mariner class"


def test_a_steering_page_is_that_of_its_result(tmp_path: Path) -> None:
    found = t2s.load("mariner").steering_page()
    found.to_html(tmp_path / "steer.html")
    page = (tmp_path / "steer.html").read_text(encoding="utf-8")
    assert found.to_dict()["steerable"] is True and page == found.page()
    assert found.to_dict()["page_kB"] == pytest.approx((tmp_path / "steer.html").stat().st_size / 1000)


@pytest.mark.parametrize("name", ["wilinski-zellman", "kulikovsky-velikanov"])
def test_only_a_ship_can_be_steered(name: str) -> None:
    with pytest.raises(t2s.InputError) as refusal:
        t2s.load(name).steering_page()
    assert refusal.value.source.endswith("ship.toml") and refusal.value.remedy  # type: ignore[union-attr]


def test_a_steering_card_is_not_a_ship() -> None:
    with pytest.raises(t2s.InputError) as refusal:
        t2s.load("poznyakov-yudin")
    assert refusal.value.source == "poznyakov-yudin" and "steering.toml" in refusal.value.problem
