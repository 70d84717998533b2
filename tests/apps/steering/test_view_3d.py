"""The view from the bridge: only in pages that ask for it, and, in a browser, where it shows what is where."""

import math
import re

import pytest

from tank2sim.apps.steering.ghost import ghost_of
from tank2sim.apps.steering.page import PageShip, steering_page
from tank2sim.apps.steering.scenario import Feature, Scenario
from tank2sim.apps.steering.ship import ship_following_angle
from tank2sim.bundled import bundled
from tank2sim.cards import read_card
from tank2sim.dynamics import build
from tank2sim.records.reading import read_trial_file
from tests.answer.opened_page import WEBGL
from tests.apps.steering.sailing import data_of, in_browser, sailed

FAR = 50e3  # m: from there it makes no difference where on the ship the eye is

# The green of sky, sea and deck, read in the task that has drawn them: a browser keeps them no longer.
PICTURE = """
const picture = () => {
  click("view-3d"); click("view-3d");
  const copy = document.createElement("canvas");
  copy.width = 100; copy.height = 50;
  const pen = copy.getContext("2d");
  pen.drawImage(at("bridge-view"), 0, 0, 100, 50);
  const pixels = pen.getImageData(0, 0, 100, 50).data;
  const green = (x, y) => pixels[4 * (100 * y + x) + 1];
  return { sky: green(3, 3), sea: green(3, 31), deck: green(50, 48), bow: green(50, 27) };
};
"""


@pytest.fixture(scope="module")
def mariner():
    return build(read_card("mariner"))


def test_only_a_page_that_is_asked_for_it_has_the_view(mariner):
    ship = PageShip(model=mariner)
    plain, with_view = steering_page(ship), steering_page(ship, view_3d=True)
    assert not re.search(r"three|bridge-view|view-3d", plain, re.IGNORECASE)
    assert "Copyright 2010-2023 Three.js Authors" in with_view
    assert not re.search(r"""(src|href)=["'](?!#)[^ ]*["'] ?/?>""", with_view)
    assert data_of(plain) == data_of(with_view)  # a link with an attempt holds for both


def test_the_licence_of_three_js_is_in_the_package():
    folder = bundled("models").parent / "src" / "tank2sim" / "apps" / "steering"
    assert "three.js authors" in (folder / "three.LICENSE").read_text(encoding="utf-8")


class TestInABrowser:
    pytestmark = in_browser

    @pytest.fixture
    def page(self, mariner):
        block = ((3000.0, 500.0), (4000.0, 500.0), (4000.0, 900.0), (3000.0, 900.0), (3000.0, 500.0))
        features = (
            Feature("buoy", ((FAR, 0.0),), {"side": "port"}),
            Feature("buoy", ((0.0, 2000.0),), {"side": "starboard"}),
            Feature("bank", block, {}),
            Feature("goal", block, {}),
            Feature("channel", ((0.0, 0.0), (2000.0, 0.0), (3000.0, 500.0)), {"width_m": 400.0}),
        )
        waters = Scenario("Waters", "", 0.0, None, features)
        return steering_page(PageShip(model=mariner), scenario=waters, view_3d=True)

    def test_a_turn_to_starboard_moves_a_buoy_ahead_to_the_left(self, page, tmp_path):
        steps = f"""
        {PICTURE}
        click("view-3d");
        Object.assign(seen, picture());
        const view = at("bridge-view"), across = () => view.placeOf({FAR}, 0)[0] / view.clientWidth;
        seen.before = across();
        put("set-rudder.command", "20", "input"); put("factor", "20", "change"); click("run");
        const turned = () => parseFloat(at("read-motion.psi").textContent);
        await new Promise((done) => setInterval(() => {{ if (turned() > 15 && turned() < 90) done(); }}, 20));
        click("run");
        seen.bow_after = picture().bow; seen.after = across(); seen.heading = turned();
        seen.looking = at("bearing").textContent;
        click("reset"); press("3"); seen.starboard = view.placeOf(0, 2000)[0] / view.clientWidth;
        seen.wing = at("bearing").textContent; seen.hidden = view.placeOf(0, -2000);
        press("4"); seen.above = view.placeOf(0, 0); seen.height = view.clientHeight;
        press("b"); seen.closed = view.hidden;"""
        seen, _ = sailed(page, tmp_path, steps, *WEBGL)
        assert seen["before"] == pytest.approx(0.5, abs=1e-6)
        # A picture 60 deg wide; the readout has a decimal.
        angle = math.radians(seen["heading"])
        assert seen["after"] == pytest.approx(0.5 - math.tan(angle) / math.tan(math.radians(30)) / 2, abs=2e-3)
        assert seen["looking"] == f"Bridge {seen['heading']:03.0f}°"
        assert 0.45 < seen["starboard"] < 0.49  # the bridge is aft, and ahead is to the left of who looks to starboard
        assert seen["wing"] == "Starboard wing 090°" and seen["hidden"] is None
        assert 0.5 * seen["height"] < seen["above"][1] < seen["height"]
        assert seen["closed"] is True
        assert seen["sky"] > seen["sea"] + 40 > seen["deck"] + 50
        assert [seen["bow"], seen["bow_after"]] == pytest.approx([seen["deck"]] * 2, abs=3)

    def test_on_a_phone_the_view_of_a_measured_trial_is_within_the_window(self, mariner, tmp_path):
        file = tmp_path / "trial.csv"
        file.write_text("t_s,delta_deg,u_mps,psi_deg,x_m,y_m\n0,0,7,0,0,0\n1,5,7,0,,\n2,5,7,1,14,0\n", encoding="utf-8")
        model = ship_following_angle(mariner)
        ghost = ghost_of(read_trial_file(file), model)
        html = steering_page(PageShip(model=model), ghost, view_3d=True)
        steps = """
        click("view-3d"); click("trial"); click("finish");
        const shown = [...document.querySelectorAll("#bridge-view, #bearing, .cameras button, #view-3d")];
        const boxes = shown.map((one) => one.getBoundingClientRect());
        seen.left = Math.min(...boxes.map((one) => one.left));
        seen.right = Math.max(...boxes.map((one) => one.right));"""
        narrow = html.replace("<body>", '<body style="width: 400px">')
        seen, _ = sailed(narrow, tmp_path, steps, *WEBGL, "--window-size=500,900")
        assert seen["left"] >= 0 and seen["right"] <= 400

    def test_without_webgl_the_button_says_so_and_the_chart_stays(self, page, tmp_path):
        steps = """
        click("view-3d"); seen.button = at("view-3d").textContent; seen.hidden = at("bridge-view").hidden;
        put("set-rudder.command", "20", "input"); click("run"); click("run");"""
        seen, _ = sailed(page, tmp_path, steps, "--disable-3d-apis")
        assert "no WebGL" in seen["button"]
        assert seen["hidden"] is True
