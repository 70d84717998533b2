"""The page of a craft with two thrusters: its levers, and, in a browser, that it sails as the simulation does."""

import math
from dataclasses import replace

import numpy as np
import pytest

import tank2sim as t2s
from tank2sim.apps.steering.members import PAGE_MEMBERS, members_of
from tank2sim.apps.steering.page import PageShip, steering_page
from tank2sim.apps.steering.ship import controls, levers_of, thrusters_of
from tank2sim.cards.covariance import Covariance
from tank2sim.errors import InputError
from tank2sim.simulation.integrator import Integrator
from tank2sim.simulation.running import Running
from tests.apps.steering.sailing import data_of, in_browser, sailed

RPM = 30 / math.pi


@pytest.fixture(scope="module")
def otter():
    return t2s.load("otter").model


@pytest.fixture(scope="module")
def page(otter):
    return steering_page(PageShip(model=otter, beam_m=1.08))


def test_the_thruster_at_port_turns_the_craft_to_starboard(otter):
    assert {one.name: one.side for one in thrusters_of(otter)} == {
        "thrusters.port.command": 1.0,
        "thrusters.starboard.command": -1.0,
    }


def test_levers_have_the_range_of_the_thrusters(otter):
    both, turn = levers_of(otter)
    low, high = -101.736666 * RPM, 103.930864 * RPM  # of the card
    assert (both.minimum, both.maximum) == pytest.approx((low, high))
    assert (turn.minimum, turn.maximum) == pytest.approx((low - high, high - low))


def test_speeds_of_a_craft_are_in_metres_and_degrees_per_second(otter):
    data = data_of(steering_page(PageShip(model=otter)))
    units = {one["name"]: (one["unit"], one["factor"]) for one in data["readouts"]}
    assert units["motion.u"] == ("m/s", 1.0)
    assert units["motion.r"] == ("deg/s", pytest.approx(math.degrees(1.0)))
    assert units["thrusters.port.speed"] == ("rpm", pytest.approx(RPM))
    assert data["speeds"]["factor"] == 1.0
    assert {one.unit for one in controls(otter) if one.name == "current.speed"} == {"m/s"}


def test_a_ship_has_no_levers():
    mariner = t2s.load("mariner").model
    assert levers_of(mariner) == thrusters_of(mariner) == []


def test_a_trial_with_a_rudder_is_refused_next_to_a_craft(tmp_path):
    with pytest.raises(InputError, match="has none"):
        t2s.load("otter").steering_page(ghost=tmp_path / "trial.csv")


def test_members_drawn_from_the_covariance_of_a_craft_sail_along(otter, tmp_path):
    card = t2s.load("otter").replace({"uncertainty.Xu": 3.0}).card
    covariance = Covariance(("derivatives.Xu",), np.array([[9.0]]))
    replace(card, covariance=covariance).save(tmp_path / "otter.toml")
    ship = t2s.load(tmp_path / "otter.toml")
    result = ship.steering_page()
    assert result.study.members == PAGE_MEMBERS
    drags = [member["derivatives.Xu"] for member in members_of(ship.card, otter, count=200)]
    assert np.std(drags) == pytest.approx(3.0, rel=0.15)


def test_a_craft_with_thrusters_on_one_side_alone_is_refused(tmp_path):
    text = t2s.load("otter").card.text
    card = tmp_path / "ship.toml"
    card.write_text(text.replace("y_m = -0.395", "y_m = 0.395"), encoding="utf-8")
    with pytest.raises(InputError, match="no thrusters that steer"):
        steering_page(PageShip(model=t2s.load(card).model))


class TestInABrowser:
    pytestmark = in_browser

    def test_the_levers_sail_the_craft_as_the_simulation_does(self, otter, page, tmp_path):
        steps = """
          const put2 = (name, value) => put(`set-${name}`, value, "input");
          const sail = async (seconds) => {
            at("factor").value = "50"; at("ahead").value = "0"; click("run");
            const begun = Number(at("read-time").textContent.split(":")[1]);
            await new Promise((done) => { const wait = setInterval(() => {
              if (Number(at("read-time").textContent.split(":")[1]) - begun < seconds) return;
              clearInterval(wait); done();
            }, 10); });
            click("run");
          };
          put2("surge", 600); put2("turn", 300);
          seen.port = at("set-thrusters.port.command").value;
          seen.starboard = at("set-thrusters.starboard.command").value;
          await sail(5);
          press("x"); put2("turn", 1e6);
          seen.spin = [at("set-thrusters.port.command").value, at("set-thrusters.starboard.command").value];
          await sail(5);
          click("save");
        """
        seen, (voyage,) = sailed(page, tmp_path, steps)
        assert (float(seen["port"]), float(seen["starboard"])) == pytest.approx((750, 450), abs=1)
        low, high = -101.736666 * RPM, 103.930864 * RPM
        assert [float(one) for one in seen["spin"]] == pytest.approx([high, low], abs=1)
        replay = replayed(otter, voyage)
        np.testing.assert_allclose(voyage["t_s"], replay.t, rtol=0, atol=1e-9)
        for name, signal in (("u_mps", "u"), ("v_mps", "v"), ("r_degps", "r"), ("psi_deg", "psi"), ("x_m", "x")):
            own = np.radians(voyage[name]) if "deg" in name else voyage[name]
            np.testing.assert_allclose(own, replay[f"motion.{signal}"], rtol=0, atol=1e-6 * max(1, np.abs(own).max()))
        assert voyage["r_degps"][-1] > 10
        assert voyage["order_port"][-1] == pytest.approx(1, abs=2e-3)  # the slider has whole rpm
        assert voyage["order_starboard"][-1] == pytest.approx(-1, abs=2e-3)

    def test_keys_move_the_levers_and_a_zigzag_turns_by_difference(self, page, tmp_path):
        # The dials are hidden, as on paper: there is nothing to draw on, and nothing to say in the console.
        steps = """
          document.querySelector(".instruments").style.display = "none";
          press("x");
          press("w"); press("w"); press("ArrowRight");
          seen.keys = [at("set-thrusters.port.command").value, at("set-thrusters.starboard.command").value];
          press("u"); seen.alone = at("set-thrusters.port.command").value;
          press("m"); seen.even = at("set-turn").value;
          put("zigzag-rudder", "400", "input"); click("zigzag"); click("finish");
        """
        seen, _ = sailed(page, tmp_path, steps)
        high, low = 103.930864 * RPM, -101.736666 * RPM
        port, starboard = (float(one) for one in seen["keys"])
        assert port + starboard == pytest.approx(2 * 0.2 * high, abs=2)
        assert port - starboard == pytest.approx(0.1 * (high - low), abs=2)
        assert float(seen["alone"]) - port == pytest.approx(0.1 * high, abs=2)
        assert float(seen["even"]) == pytest.approx(0, abs=1)
        assert seen["said"].startswith("Zigzag 400/20 has ended; overshoots")


def replayed(model, voyage):
    """The motion by the simulation with the orders of a saved voyage, at its instants."""
    running = Running(Integrator(model))
    shares = np.column_stack([voyage["order_port"], voyage["order_starboard"]])
    begins = [0, *(np.flatnonzero(np.any(np.diff(shares, axis=0), axis=1)) + 1)]
    for begin, end in zip(begins, [*begins[1:], len(shares) - 1], strict=True):
        running.order(
            {
                f"thrusters.{name}.command": share * (103.930864 if share >= 0 else 101.736666)
                for name, share in zip(("port", "starboard"), shares[begin], strict=True)
            }
        )
        running.run(voyage["t_s"][end] - voyage["t_s"][begin])
    return running.trajectory()
