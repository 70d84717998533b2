"""What a bridge is given: circles, stops and speeds that agree with the simulation, nothing guessed, and refusals."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

import tank2sim as t2s
from tank2sim.analysis.validation.standard_trials import ship_of
from tank2sim.apps.bridge.ship_track import quarter
from tank2sim.apps.bridge.study import SHALLOW, bridge_of, steady_speed
from tank2sim.cards import ManoeuvringCard, parse_card, read_card, revised
from tank2sim.dynamics.effects.depth import icorels_squat
from tank2sim.errors import InputError
from tank2sim.simulation.manoeuvres import Orders, Turn
from tank2sim.simulation.run import simulate

RPM = 2 * math.pi / 60
DEPTH = '\n[[effects]]\nname = "water_depth"\n[effects.parameters]\ndepth_m = 150.0\n'


@pytest.fixture(scope="module")
def card(mariner_card) -> ManoeuvringCard:
    """The Mariner with an engine and an effect of water depth."""
    engine = {"propulsion.nominal_rpm": 84.0, "propulsion.Xnn": 77e-5, "ship.block_coefficient": 0.6}
    found = parse_card(revised(mariner_card, {}, engine).text + DEPTH, "mariner_at_sea.toml")
    assert isinstance(found, ManoeuvringCard)
    return found


@pytest.fixture(scope="module")
def bridge(card):
    return bridge_of(card, {"Full sea speed": 84.0, "Half ahead": 75.0})


@pytest.mark.slow
def test_circles_lie_on_their_sides_and_show_the_figures(bridge) -> None:
    starboard, port = bridge.deep
    assert starboard.starboard_m.max() > 900 and port.starboard_m.min() < -900
    mark = quarter(starboard, 90)
    assert mark.ahead_m == pytest.approx(starboard.figures["advance_m"], abs=1.0)
    assert mark.starboard_m == pytest.approx(starboard.figures["transfer_m"], abs=1.0)
    half = quarter(port, 180)
    assert half.starboard_m == pytest.approx(-port.figures["tactical_diameter_m"], abs=1.0)
    assert 180 <= port.study.marks[1].heading_change_deg < 181  # to her side: it is no heading
    assert half.time_s == pytest.approx(port.figures["time_180_s"], abs=0.2)
    assert quarter(starboard, 360).speed_mps == pytest.approx(starboard.figures["steady_speed_mps"], rel=1e-3)


def test_shallow_water_widens_the_circles(bridge, mariner_card) -> None:
    deep, shallow = bridge.deep[0].figures, bridge.shallow[0].figures
    assert shallow["tactical_diameter_m"] > 1.5 * deep["tactical_diameter_m"]
    assert SHALLOW == 1.2
    assert bridge_of(mariner_card).shallow == ()


def test_steady_speeds_are_those_that_the_ship_settles_at(card) -> None:
    ship = ship_of(read_card("esso-osaka-estimated"))
    speed = steady_speed(ship, 480 * RPM)
    orders = Orders(
        np.array([0.0, 1500.0]),
        {k: np.full(2, v) for k, v in (("rudder.command", 0.0), ("propeller.speed", 480 * RPM), ("wind.speed", 0.0))},
        "test",
    )
    run = simulate(ship.model, orders, integrator=ship.integrator).trajectory
    assert speed == pytest.approx(run["motion.u"][-1], rel=1e-4)
    assert steady_speed(ship_of(card), 84 * RPM) == pytest.approx(7.7175, rel=1e-6)


def test_stops_begin_at_the_speed_of_their_order(bridge, card) -> None:
    full, half = bridge.study.telegraph
    assert full.order == "Full sea speed" and half.speed_mps < full.speed_mps
    assert bridge.study.full_astern_from[0].track_reach_m == pytest.approx(
        bridge.stops[0].figures["track_reach_m"], rel=1e-6
    )
    assert bridge.study.full_astern_from[1].track_reach_m < bridge.study.full_astern_from[0].track_reach_m
    assert bridge.stops[0].marks[-1].time_s == pytest.approx(bridge.stops[0].figures["time_to_stop_s"])


def test_the_gear_tells_hard_over_to_hard_over_and_asymmetry_the_neutral_rudder(bridge) -> None:
    assert bridge.study.hard_over_to_hard_over_s == pytest.approx(2 * 40 / 5)
    assert bridge.study.rudder_neutral_deg == pytest.approx(-1.1, abs=0.1)  # to port


@pytest.mark.slow
def test_what_a_card_does_not_tell_is_none(mariner_card) -> None:
    bare = bridge_of(mariner_card)
    assert bare.study.telegraph == () and bare.stops == () and bare.study.full_astern_from == ()
    tanker = bridge_of(read_card("esso-osaka-estimated"))
    assert tanker.study.hard_over_to_hard_over_s is None and tanker.study.rudder_neutral_deg is None
    assert [one.order for one in tanker.study.telegraph] == [""] * 5
    assert [one.within for one in tanker.study.telegraph] == [True, True, True, False, False]


def test_a_speed_that_does_not_follow_the_revolutions_is_outside_the_card() -> None:
    """The KVLCC2 at 40 % of its revolutions: 8.6 knots by the polynomial, 6.2 in proportion."""
    shown = {round(one.rpm, 1): (one.speed_mps, one.within) for one in bridge_of(read_card("kvlcc2")).study.telegraph}
    assert shown[55.0][1] is True
    assert shown[36.7][0] > 1.3 * 0.4 * 7.97 and shown[36.7][1] is False


def test_what_is_read_off_before_the_range_ends_is_kept() -> None:
    changed = {"model.valid_speed_mps": [5.8, 9.5], "model.valid_yaw_rate_prime": 1.0}
    ship = ship_of(read_card("kvlcc2-captive", changed))
    run = ship.run(Turn(math.radians(10)))
    read, path = run.reading, run.trajectory
    row = int(np.argmax(path["motion.speed"] < 5.8))
    assert read.exit_s == pytest.approx(path.t[row], abs=1.0)
    assert read.figures["time_90_s"] < read.exit_s
    assert not read.outside("advance_m") and not read.outside("time_90_s")
    assert read.outside("steady_diameter_m")
    assert read.outside("tactical_diameter_m") == (read.figures["time_180_s"] >= read.exit_s)


def test_a_card_that_holds_throughout_has_all_its_figures(mariner_card) -> None:
    found = bridge_of(mariner_card)
    assert all(one.range_exit is None and one.inside == len(one.ahead_m) for one in found.deep)
    assert found.study.turning_circles_deep[0].outside_card_range == ()
    tanker = bridge_of(read_card("kvlcc2-captive", {"model.valid_yaw_rate_prime": 1.0, "model.valid_rudder_deg": 40.0}))
    assert tanker.study.turning_circles_deep[0].left_card_range_s == pytest.approx(91.6, abs=1)
    assert any("60° of heading" in one for one in tanker.study.notices)


def test_absurd_revolutions_are_refused() -> None:
    with pytest.raises(InputError, match="beyond 1,200 revolutions"):
        bridge_of(read_card("esso-osaka-estimated"), {"Full": 7e6})
    with pytest.raises(InputError, match="beyond 10,000 revolutions"):
        bridge_of(read_card("mariner"), {"Full": 7e6})
    given = bridge_of(read_card("mariner"), {"Full ahead": 84.0}).study.telegraph
    assert [(one.order, one.rpm, one.speed_mps) for one in given] == [("Full ahead", 84.0, None)]


def test_squat_is_the_larger_of_two_formulas_worked_by_hand(card) -> None:
    """Mariner, C_B 0.6, 160.93 x 23.17 x 7.468 m: at 75 % of 7.7175 m/s, 20 % of the draught under the keel."""
    first = bridge_of(card).study.squat[0]
    speed, depth = 0.75 * 7.7175, 1.2 * 7.468
    barrass = 0.6 * (speed / 0.514444) ** 2 / 100
    froude = speed / math.sqrt(9.80665 * depth)
    icorels = 2.4 * 0.6 * 160.93 * 23.17 * 7.468 / 160.93**2 * froude**2 / math.sqrt(1 - froude**2)
    assert (first.clearance_m, first.speed_mps) == pytest.approx((0.2 * 7.468, speed), rel=1e-3)
    assert first.squat_m == pytest.approx(max(barrass, icorels), rel=1e-3)


def test_squat_by_icorels_is_that_worked_by_hand() -> None:
    """30 000 m3, 200 m, depth Froude number 0.5: 2.4 * 0.75 * 0.25 / sqrt(0.75)."""
    assert icorels_squat(30_000.0, 200.0, 0.25) == pytest.approx(0.5196, rel=1e-4)


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


def test_a_poster_read_back_shows_the_figures_of_its_tracks(poster: t2s.PosterResult) -> None:
    again = t2s.make_report(poster.to_dict())
    assert "tank2sim poster CARD --page FILE.html" in again.headline[1] and again.headline[1] in again.page()
    figures = {one.caption: one.df for section in again.sections for one in section.tables}
    run = t2s.load("mariner").turn(40).figures
    circles = figures["Turning circles, deep water"].set_index("figure")
    assert circles.loc["advance (m)", "starboard"] == pytest.approx(run["advance_m"], rel=1e-3)
    zigzags = figures["Zigzags"].set_index("figure")
    wanted = t2s.load("mariner").zigzag(10, 10).figures["overshoot_1_deg"]
    assert zigzags.loc["overshoot 1 (deg)", "10/10 first to starboard"] == pytest.approx(wanted, rel=1e-3)


def test_figures_outside_the_range_of_a_card_are_not_shown_as_figures() -> None:
    found = t2s.load("kvlcc2").poster()
    tables = {one.caption: one for section in found.sections for one in section.tables}
    assert {cell for row in tables["Stops"].rows for cell in row[1:]} == {"beyond the card"}


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
