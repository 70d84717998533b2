"""The page one steers on: what stands in it, and, in a browser, that its ship sails as the simulation does."""

import re

import numpy as np
import pytest

from tank2sim.apps.steering.ghost import ghost_of
from tank2sim.apps.steering.page import PageShip, steering_page
from tank2sim.apps.steering.ship import controls, ship_following_angle
from tank2sim.bundled import bundled
from tank2sim.cards import read_card
from tank2sim.dynamics import build
from tank2sim.errors import InputError
from tank2sim.records.reading import read_trial_file
from tank2sim.simulation.manoeuvres import parse_manoeuvre
from tank2sim.simulation.run import simulate
from tests.apps.steering.sailing import data_of, in_browser, sailed

TRIAL = """t_s,delta_deg,u_mps,psi_deg,x_m,y_m
10,0,7.5,90,100,200
11,5,7.5,90,100,207.5
12.05,5,7.4,91,99.9,215
13,-3,7.4,92,,
14,-3,7.4,92,99.5,230
"""

COLUMNS = {
    "delta_order_deg": "rudder.command",
    "delta_deg": "rudder.angle",
    "u_mps": "motion.u",
    "v_mps": "motion.v",
    "r_degps": "motion.r",
    "psi_deg": "motion.psi",
    "x_m": "motion.x",
    "y_m": "motion.y",
}


@pytest.fixture(scope="module")
def mariner():
    return build(read_card("mariner"))


@pytest.fixture(scope="module")
def page(mariner):
    return steering_page(PageShip(model=mariner))


@pytest.fixture(scope="module")
def pond(tmp_path_factory):
    """A ship with an engine that is late, and wind."""
    text = bundled("models", "esso-osaka-estimated", "ship.toml").read_text(encoding="utf-8")
    card = tmp_path_factory.mktemp("pond") / "ship.toml"
    late = '\n[[effects]]\nname = "engine_lag"\n[effects.parameters]\ntime_constant_s = 20.0\n'
    card.write_text(text + late, encoding="utf-8")
    return build(read_card(card))


@pytest.fixture
def ghost(mariner, tmp_path):
    file = tmp_path / "trial.csv"
    file.write_text(TRIAL, encoding="utf-8")
    return ghost_of(read_trial_file(file), mariner)


def worst(voyage, trajectory):
    """Largest difference between a voyage and a simulation, relative to the size of each signal."""
    np.testing.assert_allclose(voyage["t_s"], trajectory.t, rtol=0, atol=1e-9)
    found = {}
    for name, signal in COLUMNS.items():
        expected = trajectory[signal]
        own = voyage[name] * (np.pi / 180 if "_deg" in name else 1.0)
        found[name] = np.max(np.abs(own - expected)) / np.max(np.abs(expected))
    return max(found.values())


def test_notices_are_counted_at_the_top_and_listed(mariner):
    html = steering_page(PageShip(model=mariner), None, ["a notice <b>"])
    assert "1 notice<" in html and "a notice &lt;b&gt;" in html


def test_a_model_without_a_rudder_is_refused():
    with pytest.raises(InputError, match="has no rudder"):
        steering_page(PageShip(model=build(read_card("wilinski-zellman"))))


def test_the_rudder_slider_ends_where_the_gear_does_and_shows_degrees(mariner):
    rudder = controls(mariner)[0]
    assert (rudder.name, rudder.unit, rudder.minimum, rudder.maximum) == ("rudder.command", "deg", -40, 40)


def test_a_ghost_starts_the_ship_where_the_trial_starts(mariner, ghost):
    assert ghost.start == pytest.approx(
        {
            "initial.x": 100,
            "initial.y": 200,
            "initial.u": 7.5,
            "initial.psi": np.pi / 2,
            "initial.rudder_angle": 0,
        }
    )
    data = data_of(steering_page(PageShip(model=mariner), ghost))
    assert data["start"]["initial.u"] == 7.5
    assert data["ghost"]["t"] == pytest.approx([0, 1, 2.05, 3, 4])
    assert data["ghost"]["x"][3] is None
    assert data["ghost"]["rudder"] == pytest.approx(np.radians([0, 5, 5, -3, -3]))


def test_a_ghost_without_positions_is_refused(mariner, tmp_path):
    file = tmp_path / "trial.csv"
    file.write_text("t_s,delta_deg,u_mps\n0,0,7\n1,0,7\n2,0,7\n", encoding="utf-8")
    with pytest.raises(InputError, match="hold no track"):
        ghost_of(read_trial_file(file), mariner)


def test_a_ghost_without_speed_through_the_water_starts_at_what_was_measured(mariner, tmp_path):
    file = tmp_path / "trial.csv"
    file.write_text("t_s,delta_deg,sog_mps,x_m,y_m\n0,0,5,0,0\n1,0,5,0,6\n2,0,5,0,12\n", encoding="utf-8")
    ghost = ghost_of(read_trial_file(file), mariner)
    assert ghost.start["initial.u"] == 5
    assert ghost.start["initial.psi"] == pytest.approx(np.pi / 2)
    assert any("over the ground, 9.72 knots" in one for one in ghost.notices)
    file.write_text("t_s,delta_deg,x_m,y_m\n0,0,0,0\n1,0,0,6\n2,0,0,12\n", encoding="utf-8")
    ghost = ghost_of(read_trial_file(file), mariner)
    assert ghost.start["initial.u"] == pytest.approx(6)
    assert any("first positions, 11.66 knots" in one for one in ghost.notices)


def test_the_mean_wind_of_a_trial_is_that_at_the_start(mariner, pond, tmp_path):
    file = tmp_path / "trial.csv"
    rows = "t_s,delta_deg,u_mps,x_m,y_m,wind_speed_mps,wind_direction_deg\n0,0,.3,0,0,3,90\n1,0,.3,.3,0,4,0\n"
    file.write_text(rows, encoding="utf-8")
    ghost = ghost_of(read_trial_file(file), pond)
    mean = {"wind.speed": 2.5, "wind.direction": np.arctan2(3, 4)}
    assert ghost.held == pytest.approx(mean)
    assert any("2.5 m/s from 37 deg" in one for one in ghost.notices)
    data = data_of(steering_page(PageShip(model=pond), ghost))
    assert {one["name"]: one["start"] for one in data["controls"] if one["name"] in mean} == pytest.approx(mean)
    assert ghost_of(read_trial_file(file), mariner).held == {}


def test_what_surrounds_the_ship_has_the_bounds_of_a_card(pond):
    found = {one.name: one for one in controls(ship_following_angle(pond))}
    assert set(found) == {"rudder.command", "propeller.speed", "wind.speed", "wind.direction"}
    assert found["wind.speed"].maximum == pytest.approx(60 * 3600 / 1852)
    assert found["wind.direction"].label == "Wind from"


def test_the_page_fetches_nothing(mariner):
    html = steering_page(PageShip(model=mariner))
    assert not re.search(r"""(src|href)=["'](?!#)""", html)
    assert "default-src 'none'" in html


class TestInABrowser:
    pytestmark = in_browser

    def test_zigzags_are_those_of_the_simulation(self, mariner, page, tmp_path):
        manoeuvres = {"zigzag:20/20": (20, 20), "zigzag:-10/15": (-10, 15)}
        steps = "".join(
            f"""click('reset'); at('zigzag-rudder').value = {rudder}; at('zigzag-heading').value = {heading};
            click('zigzag'); click('finish'); click('save');"""
            for rudder, heading in manoeuvres.values()
        )
        reported, voyages = sailed(page, tmp_path, steps)
        for manoeuvre, voyage in zip(manoeuvres, voyages, strict=True):
            run = simulate(mariner, parse_manoeuvre(manoeuvre))
            assert worst(voyage, run.trajectory) < 1e-9
        shown = re.search(r"overshoots (.*) deg", reported["said"])[1].split(", ")
        assert [float(one) for one in shown] == pytest.approx(run.figures["overshoots_deg"], abs=0.06)
        assert len(page.encode()) < 1e6

    def test_keys_steer_and_readouts_bear_units(self, page, tmp_path):
        steps = """
        press("ArrowRight", { shiftKey: true }); press("ArrowRight"); press("ArrowLeft"); press("]");
        seen.factor = at("factor").value;
        seen.tops = [...document.querySelectorAll(".instruments figure")].map((one) => one.getBoundingClientRect().top);
        press("z"); press("ArrowRight", { shiftKey: true });  // a hand on the rudder ends the zigzag
        seen.finish = at("finish").disabled;
        const wait = (ms) => new Promise((done) => setTimeout(done, ms));
        press("m"); press("ArrowLeft"); press("ArrowLeft"); await wait(1500); press(" "); click("save");
        const signals = ["motion.u", "motion.r", "rudder.angle", "motion.psi"];
        seen.read = Object.fromEntries(signals.map((name) => [name, at(`read-${name}`).textContent]));
        click("reset"); put("factor", "50", "change"); click("run"); await wait(2000); click("run"); click("save");
        click("reset"); press("ArrowRight"); press("ArrowLeft"); press("ArrowLeft"); press("ArrowLeft");"""
        reported, (voyage, fast) = sailed(page, tmp_path, steps)
        assert 60 < fast["t_s"][-1] < 101
        assert reported["factor"] == "10"
        assert len(reported["tops"]) == 3 and len({*reported["tops"]}) == 1  # side by side
        assert reported["finish"] is True
        assert reported["now-rudder.command"] == "2 deg port"
        assert voyage["psi_deg"][-1] < 0
        read = {name: float(text.replace("\u2212", "-")) for name, text in reported["read"].items()}
        assert read["motion.u"] == pytest.approx(voyage["u_mps"][-1] * 3600 / 1852, abs=0.02)
        assert read["motion.r"] == pytest.approx(60 * voyage["r_degps"][-1], abs=0.06)
        assert read["rudder.angle"] == pytest.approx(voyage["delta_deg"][-1], abs=0.06)
        assert read["motion.psi"] == pytest.approx(360 + voyage["psi_deg"][-1], abs=0.06)

    def test_sliders_with_the_focus_keep_their_keys_and_orders_are_reported_with_their_side(self, pond, tmp_path):
        steps = """
        const engine = at("set-propeller.speed"), rudder = at("set-rudder.command");
        const on = (place, key, rest) => {
          const event = new KeyboardEvent("keydown", { key, bubbles: true, cancelable: true, ...rest });
          place.dispatchEvent(event);
          return event.defaultPrevented;
        };
        seen.wheel = on(document.body, "ArrowUp");
        seen.taken = on(engine, "ArrowLeft"); seen.rudder = rudder.getAttribute("aria-valuetext");
        seen.down = on(rudder, "ArrowDown"); seen.engine = engine.getAttribute("aria-valuetext");
        on(engine, " "); seen.sailing = at("run").textContent; seen.under = at("said").textContent; on(engine, " ");
        engine.focus(); document.dispatchEvent(new Event("pointerdown"));
        put("set-propeller.speed", "-600", "input"); put("set-propeller.speed", "-600", "change");
        seen.focus = document.activeElement === engine;
        seen.astern = engine.getAttribute("aria-valuetext");
        seen.turning = at("read-propeller.speed_actual").textContent;
        on(document.body, "w", { shiftKey: true }); seen.ahead = at("now-propeller.speed").textContent;
        const wind = at("set-wind.speed");
        put("set-wind.speed", "1e6", "change"); seen.wind = wind.value; seen.limit = at("said").textContent;
        put("set-wind.speed", "", "change"); seen.kept = wind.value; seen.empty = at("said").textContent;
        click("reset"); click("save");"""
        reported, (voyage,) = sailed(steering_page(PageShip(model=pond)), tmp_path, steps)
        assert (reported["wheel"], reported["taken"], reported["down"], reported["focus"]) == (False,) * 4
        assert (reported["rudder"], reported["engine"]) == ("midships", "600.0 rpm ahead")
        assert (reported["sailing"], reported["under"]) == ("Stop", "Under way.")
        assert (reported["astern"], reported["turning"]) == ("600.0 rpm astern", "600.0")
        assert reported["ahead"] == "599.0 rpm astern"
        assert float(reported["wind"]) == pytest.approx(60 * 3600 / 1852, rel=1e-5)
        assert "lies between 0 and 116.63 knots" in reported["limit"]
        assert reported["kept"] == "116.631" and "a number was expected" in reported["empty"]
        assert voyage["wind_speed_mps"] == pytest.approx(60, rel=1e-6)

    def test_the_page_warns_outside_the_range_and_tells_what_it_cannot_take(self, page, tmp_path):
        steps = """
        const outside = () => at("read-validity").closest("div").classList.contains("outside");
        seen.before = outside();
        put("approach", "2", "change"); seen.outside = outside();
        seen.after = getComputedStyle(document.querySelector(".outside dt"), "::after").content;
        put("approach", "", "change"); seen.empty = [at("approach").value, at("said").textContent];
        put("approach", "-5", "change"); seen.low = [at("approach").value, at("said").textContent];
        put("approach", "1e9", "change"); seen.high = [at("approach").value, at("said").textContent];
        put("approach", "15", "change");
        at("zigzag-rudder").value = -20.5; at("zigzag-heading").value = 7.3;
        click("zigzag"); seen.zigzag = at("said").textContent;
        click("midships"); seen.ended = at("said").textContent; click("run"); seen.stopped = at("said").textContent;
        at("zigzag-rudder").value = 60; click("zigzag"); seen.gear = at("said").textContent; click("run");"""
        reported, _ = sailed(page, tmp_path, steps)
        assert (reported["before"], reported["outside"]) == (False, True)
        assert "outside" in reported["after"]
        assert reported["empty"][0] == "2" and "a number was expected" in reported["empty"][1]
        assert reported["low"][0] == "0" and "lies between 0 and" in reported["low"][1]
        assert float(reported["high"][0]) < 60 and "is taken" in reported["high"][1]
        assert reported["zigzag"] == "Zigzag \u221220.5/7.3 is executed."
        assert "the zigzag is over" in reported["ended"]
        assert "Stopped at" in reported["stopped"]
        assert "its gear stops at 40 deg" in reported["gear"]

    def test_a_long_voyage_is_thinned_and_goes_on(self, page, tmp_path):
        steps = """
        Record.MOST = 300; click("reset"); put("set-rudder.command", "10", "input");
        click("zigzag"); click("finish"); seen.long = at("said").textContent; click("save");
        Record.MOST = 100000; click("reset"); click("zigzag"); click("finish"); click("save");"""
        reported, (thin, whole) = sailed(page, tmp_path, steps)
        assert reported["long"] == reported["said"]  # the overshoots are those of every step
        assert 150 <= len(thin["t_s"]) <= 301 < len(whole["t_s"])
        assert thin["t_s"][-1] == whole["t_s"][-1]
        assert np.all(np.diff(thin["t_s"]) > 0) and np.max(np.diff(thin["t_s"])) < 10
        rows = np.searchsorted(whole["t_s"], thin["t_s"])
        assert thin["psi_deg"] == pytest.approx(whole["psi_deg"][rows], abs=1e-12)

    def test_current_is_set_in_knots_and_deg_and_outlasts_a_reset(self, tmp_path):
        text = bundled("models", "mariner", "ship.toml").read_text(encoding="utf-8")
        card = tmp_path / "ship.toml"
        current = '[[effects]]\nname = "current"\n[effects.parameters]\nspeed_mps = 0.4\ndirection_deg = 10.0\n'
        card.write_text(text + current, encoding="utf-8")
        model = build(read_card(card))
        steps = """
        click("zigzag"); click("finish"); click("save");
        put("set-current.speed", "2", "change"); put("set-current.direction", "90", "change");
        click("reset"); click("zigzag"); click("finish"); click("save");"""
        _, (first, second) = sailed(steering_page(PageShip(model=model)), tmp_path, steps)
        zigzag = parse_manoeuvre("zigzag:20/20")
        assert worst(first, simulate(model, zigzag).trajectory) < 1e-9
        stream = {"current.speed": 2 * 1852 / 3600, "current.direction": np.pi / 2}
        assert worst(second, simulate(model, zigzag, inputs=stream).trajectory) < 1e-9

    def test_a_measured_rudder_is_followed_past_the_gear(self, mariner, tmp_path):
        run = simulate(mariner, parse_manoeuvre("zigzag:20/20")).trajectory
        degrees = {name: np.degrees(run[f"motion.{name}"]) for name in ("r", "psi")}
        columns = {"t_s": run.t, "delta_deg": np.degrees(run["rudder.angle"]), "u_mps": run["motion.u"]}
        columns |= {"v_mps": run["motion.v"], "r_degps": degrees["r"], "psi_deg": degrees["psi"]}
        columns |= {"x_m": run["motion.x"], "y_m": run["motion.y"]}
        file = tmp_path / "trial.csv"
        rows = np.column_stack(list(columns.values()))
        np.savetxt(file, rows, delimiter=",", header=",".join(columns), comments="", fmt="%.12g")
        ghost = ghost_of(read_trial_file(file), mariner)
        model = ship_following_angle(mariner)
        steps = "click('trial'); click('finish'); click('save'); click('zigzag'); click('finish'); click('save');"
        _, (voyage, zigzag) = sailed(steering_page(PageShip(model=model), ghost), tmp_path, steps)
        last = np.flatnonzero(voyage["t_s"] <= run.t[-1] + 1e-4)[-1]
        assert voyage["t_s"][last] == pytest.approx(run.t[-1], abs=1e-4)
        assert np.interp(run.t, voyage["t_s"], voyage["delta_deg"]) == pytest.approx(columns["delta_deg"], abs=1e-4)
        assert voyage["psi_deg"][last] == pytest.approx(degrees["psi"][-1], abs=0.01)
        assert np.hypot(voyage["x_m"][last] - run["motion.x"][-1], voyage["y_m"][last] - run["motion.y"][-1]) < 0.1
        after = zigzag["delta_deg"][last:]  # her gear has the rudder again
        assert np.ptp(after) == pytest.approx(40, abs=0.1) and np.max(np.abs(np.diff(after))) < 2

    def test_orders_of_a_trial_are_followed_through_the_gear(self, mariner, tmp_path):
        file = tmp_path / "trial.csv"
        file.write_text(TRIAL.replace("delta_deg", "delta_order_deg"), encoding="utf-8")
        html = steering_page(PageShip(model=mariner), ghost_of(read_trial_file(file), mariner))
        _, (voyage,) = sailed(html, tmp_path, "click('trial'); click('finish'); click('save');")
        assert voyage["x_m"][0] == 100
        assert voyage["t_s"][-1] == pytest.approx(4)
        rows = np.searchsorted(voyage["t_s"], [0.55, 1.04, 2.04, 2.94, 3.04]) - 1
        assert voyage["delta_order_deg"][rows] == pytest.approx([0, 5, 5, 5, -3])
