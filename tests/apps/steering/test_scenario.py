"""Waters to steer in: files and their faults, and, in a browser, what is touched, what is scored, and the goal."""

import json
import math
import random
from pathlib import Path

import numpy as np
import pytest

import tank2sim as t2s
from tank2sim.apps.steering.command import make_steering_page
from tank2sim.apps.steering.scenario import bundled_scenarios, read_scenario
from tank2sim.errors import InputError
from tests.apps.steering.sailing import data_of, in_browser, sailed
from tests.corpus.mutations import mutate

LATITUDE, LONGITUDE = 10.0, 20.0
# Metres of a degree at 10 deg of latitude: Torge & Mueller (2012), 4.1, with a = 6378137 m and e2 = 0.00669438.
NORTH_M = math.pi / 180 * 6378137 * (1 - 0.00669438) / (1 - 0.00669438 * math.sin(math.radians(10)) ** 2) ** 1.5
EAST_M = (
    math.pi / 180 * 6378137 * math.cos(math.radians(10)) / math.sqrt(1 - 0.00669438 * math.sin(math.radians(10)) ** 2)
)


def position(x, y):
    return [LONGITUDE + y / EAST_M, LATITUDE + x / NORTH_M]


def feature(kind, form, points, **properties):
    places = [position(*point) for point in points]
    coordinates = {"Point": places[0], "LineString": places, "Polygon": [[*places, places[0]]]}[form]
    geometry = {"type": form, "coordinates": coordinates}
    return {"type": "Feature", "properties": {"kind": kind, **properties}, "geometry": geometry}


def box(south, north, west, east):
    return [(south, west), (north, west), (north, east), (south, east)]


START = feature("start", "Point", [(0, 0)], heading_deg=0)


def written(folder, *features, **changed):
    file = folder / "waters.geojson"
    file.write_text(json.dumps({"type": "FeatureCollection", "features": features, **changed}), encoding="utf-8")
    return file


def test_positions_become_metres_north_and_east_of_the_start(tmp_path: Path):
    start = feature("start", "Point", [(0, 0)], heading_deg=90, speed_knots=10)
    channel = feature("channel", "LineString", [(0, 0), (1000, 50)], width_m=200)
    scenario = read_scenario(written(tmp_path, start, channel, name="A reach"))
    assert (scenario.name, scenario.heading) == ("A reach", pytest.approx(math.pi / 2))
    assert scenario.speed == pytest.approx(10 * 1852 / 3600)
    ((_, (x, y)),) = [feature.points for feature in scenario.features]
    assert (x, y) == pytest.approx((1000, 50), abs=0.3)
    assert scenario.features[0].properties == {"width_m": 200.0}


@pytest.mark.parametrize("name", bundled_scenarios())
def test_bundled_waters_have_a_channel_that_is_deep_enough_for_a_tanker(name: str):
    scenario = read_scenario(name)
    kinds = [feature.kind for feature in scenario.features]
    assert {"channel", "goal", "bank", "depth", "buoy"} == set(kinds) and kinds.count("channel") == 1


FAULTS = {
    "no start": ([], "has 0 features of kind start"),
    "two starts": ([START, START], "has 2 features of kind start"),
    "unknown kind": (
        [START, feature("bouy", "Point", [(0, 0)])],
        "feature 2: kind 'bouy' is unknown; did you mean buoy",
    ),
    "wrong form": (
        [START, feature("bank", "LineString", [(0, 0), (1, 1)])],
        "feature 2 (bank): is a LineString; a bank",
    ),
    "no width": ([START, feature("channel", "LineString", [(0, 0), (9, 9)])], "feature 2 (channel): has no width_m"),
    "text": ([START, feature("depth", "Polygon", box(0, 9, 0, 9), depth_m="deep")], "depth_m 'deep'; give a number"),
    "far": ([START, feature("buoy", "Point", [(5e5, 0)])], "km from the start"),
    "side": ([START, feature("buoy", "Point", [(5, 0)], side="left")], "side 'left'; give port or starboard"),
    "two channels": ([START] + 2 * [feature("channel", "LineString", [(0, 0), (9, 9)], width_m=9)], "second channel"),
}


@pytest.mark.parametrize("name", FAULTS)
def test_a_fault_is_one_line_with_its_place(name: str, tmp_path: Path):
    features, words = FAULTS[name]
    file = written(tmp_path, *features)
    with pytest.raises(InputError) as caught:
        read_scenario(file)
    assert words in str(caught.value) and str(file) in str(caught.value) and "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("{", "is not JSON"),
        ("[]", "is not FeatureCollection"),
        ('{"type": "FeatureCollection"}', "features: is not a list"),
        ('{"type": "FeatureCollection", "features": [7]}', "has no property kind"),
        (
            '{"type":"FeatureCollection","features":[{"properties":{"kind":"start","heading_deg":1},"geometry":'
            '{"type":"Point","coordinates":[200, 10]}}]}',
            "is not on the chart",
        ),
        (
            '{"type":"FeatureCollection","features":[{"properties":{"kind":"bank"},"geometry":'
            '{"type":"Polygon","coordinates":[[[0,0],[0,1],[1,1],[1,0]]]}},{"properties":{"kind":"start",'
            '"heading_deg":1},"geometry":{"type":"Point","coordinates":[0,0]}}]}',
            "is not closed",
        ),
    ],
)
def test_other_files_are_refused(text: str, words: str, tmp_path: Path):
    file = tmp_path / "waters.geojson"
    file.write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match=words):
        read_scenario(file)


def test_a_changed_file_is_read_or_refused_with_its_name(tmp_path: Path):
    file = tmp_path / "waters.json"
    good = {file.name: bundled_scenarios()["channel"].read_bytes()}
    refusals = 0
    for seed in range(200):
        changed, _, words = mutate(good, {"other.json": b'{"type": 1}'}, random.Random(seed))
        file.write_bytes(changed[file.name])
        try:
            read_scenario(file)
        except InputError as error:
            refusals += 1
            assert str(file) in str(error) and "\n" not in str(error), words
    assert refusals > 40


def test_a_missing_file_names_the_bundled_waters_and_a_trial_goes_not_with_a_scenario(tmp_path: Path):
    with pytest.raises(InputError, match="bundled scenario: basin, channel"):
        read_scenario(tmp_path / "none.geojson")
    with pytest.raises(InputError, match="scenario: does not go with a ghost"):
        make_steering_page(t2s.load("mariner"), ghost="trial.csv", scenario="channel")


class TestInABrowser:
    pytestmark = in_browser

    def test_the_score_is_that_of_the_track(self, tmp_path: Path):
        # Channel to the north, 300 m wide; a buoy on the course; a shoal that a deeper area covers; a goal; a bank.
        start = feature("start", "Point", [(0, 0)], heading_deg=4)
        waters = [
            feature("channel", "LineString", [(0, 0), (3000, 0)], width_m=300),
            feature("buoy", "Point", [(300, 300 * math.tan(math.radians(4)))], side="starboard"),
            feature("buoy", "Point", [(1000, 200)]),
            feature("depth", "Polygon", box(3300, 3700, -500, 900), depth_m=5),
            feature("depth", "Polygon", box(3300, 4700, -500, 900), depth_m=9),
            feature("bank", "Polygon", box(5000, 5200, -2000, 2000)),
            feature("goal", "Polygon", box(4200, 4400, -500, 900), heading_deg=0, within_deg=10, speed_knots=20),
        ]
        file = written(tmp_path, start, *waters)
        page = make_steering_page(t2s.load("mariner"), scenario=file).page()
        steps = """
        const shown = (name) => at(`score-${name}`).textContent;
        const figures = (score) => ({ rms: score.rms, most: score.most, out: score.out, buoys: [...score.buoys],
          aground: score.aground, arrived: score.arrived, points: score.points });
        const helm = window.helm;
        const until = (what) => { while (helm.time < 1500) if (helm.advance() === what) return helm.time; };
        helm.steer(4 * DEG); seen.time = until(FIRST); seen.score = figures(helm.score); press("f");
        seen.points = shown("points");
        seen.shown = [shown("aground"), shown("buoys"), shown("goal"), shown("off")];
        seen.pose = Voyage.POSE.map((name) => helm.own.samples[name].at(-1)); click("save");
        click("run"); await new Promise((done) => setTimeout(done, 100));
        seen.run = at("run").textContent; seen.again = at("said").textContent;"""
        harness = page.replace("helm = new Helm(", "window.helm = helm = new Helm(")
        seen, (voyage,) = sailed(harness, tmp_path, steps.replace("FIRST", '"arrived"'))
        x, y, t = voyage["x_m"], voyage["y_m"], voyage["t_s"]
        within = (x >= 0) & (x <= 3000)
        weights = np.diff(t, prepend=0.0) * within
        score = seen["score"]
        assert score["rms"] == pytest.approx(math.sqrt(np.sum(weights * y**2) / np.sum(weights)), rel=1e-3)
        assert score["most"] == pytest.approx(np.max(np.abs(y[within])), rel=1e-3)
        assert score["out"] == pytest.approx(np.sum(weights * (np.abs(y) > 150)), abs=0.3)
        assert score["buoys"] == [0]
        assert score["aground"] is None and x[-1] == pytest.approx(4200, abs=1)
        late = max(0, t[-1] / (3000 / 7.7175) - 1)
        lost = 40 * score["rms"] / 150 + 10 + 5 * score["out"] / 60 + 20 * late
        assert score["points"] == pytest.approx(100 - lost, abs=0.2)
        assert seen["points"] == f"{100 - lost:.0f}" and seen["shown"][2].startswith("reached")

        shoal = feature("depth", "Polygon", box(2000, 3700, -500, 900), depth_m=7)  # the Mariner's draught is 7.468 m
        page = make_steering_page(t2s.load("mariner"), scenario=written(tmp_path, start, shoal, *waters)).page()
        harness = page.replace("helm = new Helm(", "window.helm = helm = new Helm(")
        seen, (voyage,) = sailed(harness, tmp_path, steps.replace("FIRST", '"aground"'))
        bow = voyage["x_m"][-1] + 160.93 / 2 * math.cos(math.radians(voyage["psi_deg"][-1]))
        assert bow == pytest.approx(2000, abs=2)
        assert seen["score"]["points"] == 0 and seen["shown"][0].startswith("the bottom")
        assert seen["run"] == "Start" and "Reset to begin again" in seen["again"]

    def test_the_bundled_channel_has_members_aground_when_the_course_is_held(self, tmp_path: Path):
        result = make_steering_page(t2s.load("esso-osaka-ship"), scenario="channel")
        data = data_of(result.page())
        assert data["start"]["initial.psi"] == 0 and data["draught"] == pytest.approx(21.775)
        steps = """
        const helm = window.helm;
        while (helm.time < 3000) if (helm.advance() === "aground") break;
        seen.by = helm.score.aground.by; press("v"); seen.members = at("score-members").textContent;
        seen.finite = helm.members.every((one) => Number.isFinite(one.voyage.samples["motion.x"].at(-1)));
        """
        harness = result.page().replace("helm = new Helm(", "window.helm = helm = new Helm(")
        seen, _ = sailed(harness, tmp_path, steps)
        assert seen["by"] == "the bottom" and seen["finite"]
        assert int(seen["members"].split(" of ")[0]) > 0
