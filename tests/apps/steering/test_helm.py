"""The helm of the steering page: telegraph, autopilot, what is ahead, members, replay by a link, gamepad, chart."""

import json
import re
from html import escape, unescape
from pathlib import Path

import numpy as np
import pytest

import tank2sim as t2s
from tank2sim.apps.steering.command import make_steering_page
from tank2sim.apps.steering.members import members_of
from tank2sim.apps.steering.ship import telegraph_of
from tank2sim.bundled import bundled
from tank2sim.cards import read_card
from tank2sim.dynamics import build
from tank2sim.dynamics.ship import mass_fault
from tank2sim.simulation.manoeuvres import parse_manoeuvre
from tank2sim.simulation.run import simulate
from tests.answer.opened_page import opened
from tests.apps.steering.sailing import data_of, in_browser, sailed

SAIL = """
  const sail = (seconds) => {
    const until = helm().time + seconds - 1e-6;
    while (helm().time < until) helm().advance();
  };
  const pressed = (name) => at(name).getAttribute("aria-pressed");
  const helm = () => window.helm;
  const pose = (voyage) => Voyage.POSE.map((name) => voyage.samples[name].at(-1));
"""


@pytest.fixture(scope="module")
def kvlcc2():
    return make_steering_page(t2s.load("kvlcc2"))


PHONE = """<script>
const measure = () => {
  const page = document.querySelector("iframe").contentDocument;
  if (page?.documentElement?.dataset.ship !== "ready") return setTimeout(measure, 100);
  const telegraph = page.getElementById("telegraph").getBoundingClientRect();
  document.body.dataset.seen = JSON.stringify([telegraph.bottom, page.documentElement.scrollWidth]);
};
measure();
</script>"""


def within(html):
    """The page with its helm in reach of the test."""
    changed = html.replace("helm = new Helm(", "window.helm = helm = new Helm(")
    assert changed != html
    return changed


def test_the_telegraph_has_the_orders_and_shares_of_the_poster():
    orders = telegraph_of(build(read_card("esso-osaka-ship")))
    nominal = 57.6461
    assert [order.name for order in orders[:2]] == ["Full astern", "Half astern"]
    assert (orders[4].name, orders[4].value) == ("Stop", 0)
    rpm = [order.rpm for order in orders]
    assert rpm == sorted(rpm)
    assert rpm[0] == pytest.approx(-0.7 * nominal, rel=1e-5)
    assert rpm[-2:] == pytest.approx([0.8 * nominal, nominal], rel=1e-5)
    assert telegraph_of(build(read_card("mariner"))) == []


def test_members_have_the_spread_of_the_covariance():
    card = read_card("kvlcc2")
    model = build(card)
    members = members_of(card, model, count=400)
    drawn = np.array([[member["derivatives.Nr"], member["derivatives.Nv"]] for member in members])
    covariance = json.loads(bundled("models", "kvlcc2", "ship.covariance.json").read_text(encoding="utf-8"))
    places = [covariance["names"].index(f"derivatives.{name}") for name in ("Nr", "Nv")]
    stated = np.array(covariance["covariance"])[np.ix_(places, places)]
    errors = np.sqrt(np.diag(stated))
    assert drawn.std(axis=0) == pytest.approx(errors, rel=0.12)
    assert np.corrcoef(drawn.T)[0, 1] == pytest.approx(stated[0, 1] / errors.prod(), abs=0.12)
    values = dict(zip(model.parameter_names, model.parameter_values().tolist(), strict=True))
    assert not any(mass_fault(model, values | member) for member in members)


def test_a_card_without_covariance_has_no_members_and_says_so():
    result = make_steering_page(t2s.load("mariner"))
    assert result.study.members == 0
    assert "has no covariance" in result.headline[1]


class TestInABrowser:
    pytestmark = in_browser

    def test_keys_step_the_telegraph_and_steer_the_autopilot(self, kvlcc2, tmp_path: Path):
        steps = (
            SAIL
            + """
        const rpm = () => helm().own.orders["propeller.speed"] * 30 / Math.PI;
        const lit = () => document.querySelector("#telegraph [aria-pressed=true]")?.textContent.trim();
        seen.orders = [[rpm(), lit()]];
        for (let step = 0; step < 10; step += 1) { press("s"); seen.orders.push([rpm(), lit()]); }
        press("W", { shiftKey: true }); seen.between = [rpm(), lit() ?? null];
        press("w"); seen.next = rpm();
        document.querySelector('[data-order="9"]').click(); seen.sea = rpm();
        press("r"); press("a"); seen.on = pressed("autopilot"); sail(1200);
        seen.heading = pose(helm().own)[2] * 180 / Math.PI; seen.rate = helm().own.ship.get("motion.r");
        seen.headings = helm().members.map((one) => pose(one.voyage)[2] * 180 / Math.PI);
        press(">"); press(","); press("<"); press("."); press("."); seen.course = at("course").value;
        press("ArrowLeft");
        seen.off = pressed("autopilot"); seen.hand = at("said").textContent;
        put("course", "280", "change"); press("a"); seen.short = helm().own.course;
        """
        )
        seen, _ = sailed(within(kvlcc2.page()), tmp_path, steps)
        rpm = [one for one, _ in seen["orders"]]
        assert rpm == pytest.approx(91.7 * np.array([1, 0.8, 0.6, 0.4, 0.2, 0, -0.175, -0.35, -0.525, -0.7, -0.7]))
        assert [name for _, name in seen["orders"]][:2] == ["▲ Sea", "▲ Full"] and seen["orders"][5][1] == "Stop"
        assert seen["between"] == [pytest.approx(-0.7 * 91.7 + 1), None]
        assert seen["next"] == pytest.approx(-0.525 * 91.7)
        assert seen["sea"] == pytest.approx(91.7)
        assert (seen["on"], seen["off"]) == ("true", "false")
        assert seen["heading"] == pytest.approx(45, abs=0.5) and abs(seen["rate"]) < 1e-4
        assert seen["headings"] == pytest.approx([45] * 20, abs=2)
        assert seen["course"] == "046"
        assert "the autopilot is off" in seen["hand"]
        assert np.degrees(seen["short"]) == pytest.approx(280)

    def test_the_telegraph_is_on_the_first_screen_of_a_phone(self, kvlcc2, tmp_path: Path):
        inner = escape(kvlcc2.page())
        html = f'<body><iframe width="400" height="850" srcdoc="{inner}"></iframe>{PHONE}</body>'
        seen, _ = opened(html, tmp_path)
        low, wide = json.loads(unescape(re.search(r'data-seen="(.*?)"', seen)[1]))
        assert 400 < low <= 850 and wide <= 400

    def test_a_link_replays_the_attempt_to_the_last_digit(self, kvlcc2, tmp_path: Path):
        steps = (
            SAIL
            + """
        put("approach", "12.34", "change");
        press("ArrowRight", { shiftKey: true }); sail(61); press("s"); sail(30.6); press("a"); sail(100);
        at("failed").checked = true; at("failed").dispatchEvent(new Event("change")); sail(3);
        at("failed").checked = false; at("failed").dispatchEvent(new Event("change")); sail(20);
        click("zigzag"); click("run"); sail(300.4); press("m"); sail(33); press("w"); press("s"); sail(10);
        seen.pose = pose(helm().own); seen.time = helm().time; seen.other = pose(helm().members[7].voyage);
        const track = JSON.stringify(helm().own.samples);
        click("share"); sail(20); await new Promise((done) => setTimeout(done, 300)); seen.link = at("link").value;
        seen.still = helm().time > seen.time + 10; // it is not replayed in the page that made it
        put("approach", "9", "change"); sail(50);
        const hash = location.hash; location.hash = ""; await new Promise((done) => setTimeout(done, 100));
        location.hash = hash; await new Promise((done) => setTimeout(done, 100));
        seen.under = at("said").textContent; click("run"); click("finish");
        seen.replayed = pose(helm().own); seen.until = helm().time; seen.again = pose(helm().members[7].voyage);
        seen.same = JSON.stringify(helm().own.samples) === track;
        seen.text = helm().attempt.text({ ...JSON.parse(at("ship").textContent) }) === hash.slice(1);
        location.hash = hash.replace("#", "#x");
        await new Promise((done) => setTimeout(done, 100));
        seen.foreign = at("said").textContent;
        location.hash = hash.replace(/~[^~]*$/, "~12!o");
        await new Promise((done) => setTimeout(done, 100));
        seen.broken = at("said").textContent;
        """
        )
        seen, _ = sailed(within(kvlcc2.page()), tmp_path, steps)
        assert "Replayed from the link" in seen["under"]
        assert seen["same"] and seen["text"] and seen["still"]
        assert (seen["replayed"], seen["until"]) == (seen["pose"], seen["time"])
        assert seen["again"] == seen["other"]
        assert np.hypot(*seen["pose"][:2]) > 1000
        assert len(seen["link"].split("#")[1]) < 400
        assert "of another page" in seen["foreign"] and "broken" in seen["broken"]

    def test_the_ship_comes_to_where_it_was_predicted_and_members_spread(self, kvlcc2, tmp_path: Path):
        steps = (
            SAIL
            + """
        press("ArrowRight", { shiftKey: true }); press("ArrowRight", { shiftKey: true }); sail(40);
        const places = helm().own.ahead(360, 6);
        seen.count = places.length; seen.from = places[0].t; seen.end = places.at(-1); seen.at = places[30];
        sail(180); seen.later = [helm().time, ...pose(helm().own)];
        sail(180); seen.last = [helm().time, ...pose(helm().own)];
        seen.members = helm().members.map((one) => pose(one.voyage));
        seen.times = helm().members.map((one) => one.voyage.time);
        press("a"); const steered = helm().own.ahead(60, 60); sail(60);
        seen.steered = [steered[1].x, pose(helm().own)[0]];
        at("ahead").value = "360"; at("ahead").dispatchEvent(new Event("change", { bubbles: true })); press("v");
        press("g");
        seen.whole = pressed("whole"); press("+"); seen.free = pressed("whole");
        press("f"); seen.follow = pressed("follow"); seen.shown = at("members").checked;
        """
        )
        seen, _ = sailed(within(kvlcc2.page()), tmp_path, steps)
        assert (seen["count"], seen["from"]) == (61, pytest.approx(40))
        for place, later in ((seen["at"], seen["later"]), (seen["end"], seen["last"])):
            assert [place[name] for name in ("t", "x", "y", "psi")] == later
        assert seen["steered"][0] == seen["steered"][1]
        assert seen["times"] == [seen["last"][0]] * 20
        spread = np.std(np.array(seen["members"])[:, :2], axis=0)
        assert np.hypot(*spread) > 10  # m, of a track of 3 km
        own = np.array(seen["last"][1:3])
        assert np.max(np.hypot(*(np.array(seen["members"])[:, :2] - own).T)) < 1500
        assert (seen["whole"], seen["free"], seen["follow"], seen["shown"]) == ("true", "false", "true", False)

    def test_members_are_the_ships_of_the_simulation(self, kvlcc2, tmp_path: Path):
        steps = (
            SAIL + "press('ArrowRight', { shiftKey: true }); sail(300); seen.third = pose(helm().members[2].voyage);"
            "helm().zigzag(0.3, 0.3); helm().own.zigzag = null; press('m');"
            "seen.left = helm().members.filter((one) => one.voyage.zigzag).length;"
        )
        seen, _ = sailed(within(kvlcc2.page()), tmp_path, steps)
        assert seen["left"] == 0  # a hand on the rudder ends the zigzag of each, whose own may have ended before
        member = build(read_card("kvlcc2")).with_values(data_of(kvlcc2.page())["members"][2])
        run = simulate(member, parse_manoeuvre("turn:5"), duration_s=300.0).trajectory
        assert seen["third"][:2] == pytest.approx([run["motion.x"][-1], run["motion.y"][-1]], abs=1e-3)

    def test_a_gamepad_steers_and_touches_move_the_chart(self, kvlcc2, tmp_path: Path):
        steps = (
            SAIL
            + """
        const pad = { connected: true, axes: [0.56], buttons: Array.from({ length: 16 }, () => ({ pressed: false })) };
        navigator.getGamepads = () => [pad];
        const frames = () => new Promise((done) => setTimeout(done, 100));
        dispatchEvent(new Event("gamepadconnected")); await frames();
        seen.stick = helm().own.orders["rudder.command"] * 180 / Math.PI;
        pad.buttons[13] = { pressed: true }; await frames(); pad.buttons[13] = { pressed: false }; await frames();
        seen.rpm = helm().own.orders["propeller.speed"] * 30 / Math.PI;
        pad.axes[0] = 0.05; await frames(); seen.dead = helm().own.orders["rudder.command"];
        pad.buttons[0] = { pressed: true }; await frames(); seen.run = at("run").textContent;
        pad.buttons[0] = { pressed: false };
        click("run"); navigator.getGamepads = () => [];
        const touch = (kind, id, x, y) => at("track").dispatchEvent(new PointerEvent(kind,
          { pointerId: id, pointerType: "touch", clientX: x, clientY: y, bubbles: true }));
        at("track").setPointerCapture = () => {};
        touch("pointerdown", 1, 300, 300); touch("pointermove", 1, 320, 340); seen.one = pressed("follow");
        touch("pointerdown", 2, 420, 340); touch("pointermove", 2, 520, 340);
        seen.two = pressed("follow");
        """
        )
        seen, _ = sailed(within(kvlcc2.page()), tmp_path, steps)
        assert seen["stick"] == pytest.approx(17.5)  # (0.56 - 0.12)/0.88 of 35 deg
        assert seen["rpm"] == pytest.approx(0.8 * 91.7)
        assert seen["dead"] == 0
        assert seen["run"] == "Stop"
        assert (seen["one"], seen["two"]) == ("true", "true")  # pinched about the ship that is followed
