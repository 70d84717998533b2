"""The page one steers on: what stands in it, and, in a browser, that its ship sails as the simulation does."""

import csv
import io
import json
import re
from html import unescape

import numpy as np
import pytest

from tank2sim.bundled import bundled
from tank2sim.cards import read_card
from tank2sim.dynamics import build
from tank2sim.errors import InputError
from tank2sim.records.reading import read_trial
from tank2sim.report.steer import ghost_of, steering_page
from tank2sim.report.steer_ship import NO_COMPILER, WEB, controls, has_compiler, ship_in_page
from tank2sim.simulation.manoeuvres import parse_manoeuvre
from tank2sim.simulation.run import simulate
from tests.report.test_page_in_browser import CHROMIUM, opened

in_browser = [
    pytest.mark.slow,
    pytest.mark.skipif(CHROMIUM is None, reason="no Chromium is installed to open the page in"),
    pytest.mark.skipif(not has_compiler(), reason="ziglang is not installed, which compiles the ship for the page"),
]

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

# Frames by the clock, for a headless browser draws none that nobody asks for.
FRAMES = "<script>window.requestAnimationFrame = (draw) => setTimeout(() => draw(performance.now()), 16);</script>"

# Keeps what the page saves; then does `steps` one after the other and tells what came of it.
DRIVE = """<script>{{
  const saved = [];
  const made = URL.createObjectURL;
  URL.createObjectURL = (blob) => {{ saved.push(blob.text()); return made.call(URL, blob); }};
  const at = (name) => document.getElementById(name);
  const click = (name) => at(name).click();
  const put = (name, value, kind) => {{ at(name).value = value; at(name).dispatchEvent(new Event(kind)); }};
  const press = (key, rest) =>
    document.body.dispatchEvent(new KeyboardEvent("keydown", {{ key, bubbles: true, ...rest }}));
  const ready = setInterval(async () => {{
    if (document.documentElement.dataset.ship !== "ready") return;
    clearInterval(ready);
    const told = {{}};
    {steps}
    const read = (one) => at(one).textContent;
    told.said = read("said");
    for (const one of document.querySelectorAll("[id^=read-], output")) told[one.id] = read(one.id);
    document.body.dataset.told = JSON.stringify({{ ...told, saved: await Promise.all(saved) }});
  }}, 50);
}}</script>"""


@pytest.fixture(scope="module")
def mariner():
    return build(read_card("mariner"))


@pytest.fixture(scope="module")
def page(mariner):
    return steering_page(mariner, ship_in_page(mariner))


@pytest.fixture
def ghost(tmp_path):
    file = tmp_path / "trial.csv"
    file.write_text(TRIAL, encoding="utf-8")
    return ghost_of(read_trial(file))


def sailed(html, folder, steps):
    """What the page told after these steps, and the voyages that it saved."""
    html = html.replace("<body>", "<body>" + FRAMES).replace("</body>", DRIVE.format(steps=steps) + "</body>")
    seen, console = opened(html, folder)
    assert console == []
    told = json.loads(unescape(re.search(r'data-told="(.*?)"', seen)[1]))
    voyages = []
    for text in told.pop("saved"):
        rows = list(csv.DictReader(io.StringIO(text.split("\n", 1)[1])))
        voyages.append({name: np.array([float(row[name]) for row in rows]) for name in rows[0]})
    return told, voyages


def worst(voyage, trajectory):
    """Largest difference between a voyage and a simulation, relative to the size of each signal."""
    np.testing.assert_allclose(voyage["t_s"], trajectory.t, rtol=0, atol=1e-9)
    found = {}
    for name, signal in COLUMNS.items():
        expected = trajectory[signal]
        own = voyage[name] * (np.pi / 180 if "_deg" in name else 1.0)
        found[name] = np.max(np.abs(own - expected)) / np.max(np.abs(expected))
    return max(found.values())


def data_of(html):
    return json.loads(re.search(r'id="ship">(.*?)</script>', html, re.DOTALL)[1])


def test_without_the_compiler_the_page_says_what_is_missing(mariner):
    html = steering_page(mariner, None, None, [NO_COMPILER])
    assert "pip install tank2sim[platforms]" in html
    assert "<canvas" not in html
    assert "<script" not in html


def test_a_model_without_a_rudder_is_refused():
    with pytest.raises(InputError, match="has no rudder"):
        steering_page(build(read_card("wilinski-zellman")), None)


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
    data = data_of(steering_page(mariner, "AA==", ghost))
    assert data["start"]["initial.u"] == 7.5
    assert data["ghost"]["t"] == pytest.approx([0, 1, 2.05, 3, 4])
    assert data["ghost"]["x"][3] is None
    assert data["ghost"]["rudder"] == pytest.approx(np.radians([0, 5, 5, -3, -3]))


def test_a_ghost_without_positions_is_refused(tmp_path):
    file = tmp_path / "trial.csv"
    file.write_text("t_s,delta_deg,u_mps\n0,0,7\n1,0,7\n2,0,7\n", encoding="utf-8")
    with pytest.raises(InputError, match="hold no track"):
        ghost_of(read_trial(file))


def test_the_page_fetches_nothing(mariner):
    html = steering_page(mariner, "AA==")
    assert not re.search(r"""(src|href)=["'](?!#)""", html)
    assert "default-src 'none'" in html


def test_a_web_library_exports_what_the_page_calls():
    flags = WEB.flags
    assert "-Wl,--export=fmi3DoStep" in flags and "-ffp-contract=off" in flags
    assert not {"-shared", "-fPIC"} & set(flags)


class TestInABrowser:
    pytestmark = in_browser

    def test_zigzags_are_those_of_the_simulation(self, mariner, page, tmp_path):
        manoeuvres = {"zigzag:20/20": (20, 20), "zigzag:-10/15": (-10, 15)}
        steps = "".join(
            f"""click('reset'); at('zigzag-rudder').value = {rudder}; at('zigzag-heading').value = {heading};
            click('zigzag'); click('finish'); click('save');"""
            for rudder, heading in manoeuvres.values()
        )
        told, voyages = sailed(page, tmp_path, steps)
        for manoeuvre, voyage in zip(manoeuvres, voyages, strict=True):
            run = simulate(mariner, parse_manoeuvre(manoeuvre))
            assert worst(voyage, run.trajectory) < 1e-9
        shown = re.search(r"overshoots (.*) deg", told["said"])[1].split(", ")
        assert [float(one) for one in shown] == pytest.approx(run.figures["overshoots_deg"], abs=0.06)
        assert len(page.encode()) < 1e6

    def test_keys_steer_and_readouts_bear_units(self, page, tmp_path):
        steps = """
        press("ArrowRight", { shiftKey: true }); press("ArrowRight"); press("ArrowLeft"); press("+");
        told.factor = at("factor").value;
        press("z"); press("ArrowRight", { shiftKey: true });  // a hand on the rudder ends the zigzag
        told.finish = at("finish").disabled;
        const wait = (ms) => new Promise((done) => setTimeout(done, ms));
        press("m"); press("ArrowLeft"); press("ArrowLeft"); await wait(1500); press(" "); click("save");
        const signals = ["motion.speed", "motion.r", "rudder.angle", "motion.psi"];
        told.read = Object.fromEntries(signals.map((name) => [name, at(`read-${name}`).textContent]));
        click("reset"); put("factor", "50", "change"); click("run"); await wait(2000); click("run"); click("save");
        click("reset"); press("ArrowRight"); press("ArrowLeft"); press("ArrowLeft"); press("ArrowLeft");"""
        told, (voyage, fast) = sailed(page, tmp_path, steps)
        assert 60 < fast["t_s"][-1] < 101
        assert told["factor"] == "10"
        assert told["finish"] is True
        assert told["now-rudder.command"] == "\u22122 deg"
        assert voyage["psi_deg"][-1] < 0
        read = {name: float(text.replace("\u2212", "-")) for name, text in told["read"].items()}
        assert read["motion.speed"] == pytest.approx(voyage["u_mps"][-1] * 3600 / 1852, abs=0.02)
        assert read["motion.r"] == pytest.approx(60 * voyage["r_degps"][-1], abs=0.06)
        assert read["rudder.angle"] == pytest.approx(voyage["delta_deg"][-1], abs=0.06)
        assert read["motion.psi"] == pytest.approx(360 + voyage["psi_deg"][-1], abs=0.06)

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
        _, (first, second) = sailed(steering_page(model, ship_in_page(model)), tmp_path, steps)
        zigzag = parse_manoeuvre("zigzag:20/20")
        assert worst(first, simulate(model, zigzag).trajectory) < 1e-9
        stream = {"current.speed": 2 * 1852 / 3600, "current.direction": np.pi / 2}
        assert worst(second, simulate(model, zigzag, inputs=stream).trajectory) < 1e-9

    def test_the_trial_is_followed_order_by_order(self, mariner, ghost, tmp_path):
        html = steering_page(mariner, ship_in_page(mariner), ghost)
        _, (voyage,) = sailed(html, tmp_path, "click('follow'); click('finish'); click('save');")
        assert voyage["x_m"][0] == 100
        assert voyage["t_s"][-1] == pytest.approx(4)
        rows = np.searchsorted(voyage["t_s"], [0.55, 1.04, 2.04, 2.94, 3.04]) - 1
        assert voyage["delta_order_deg"][rows] == pytest.approx([0, 5, 5, 5, -3])
