"""An own ship of Bridge Command sails, by an independent program of its equations, as the card and its table say."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import tank2sim as t2s
from tank2sim.apps.programs.bridge_command import box_mesh, bridge_command_files
from tank2sim.apps.programs.program_files import ProgramFiles
from tank2sim.bundled import bundled, bundled_cards
from tank2sim.cards import Card, ManoeuvringCard, SteeredCard, parse_card, read_card
from tank2sim.dynamics import build
from tank2sim.errors import InputError
from tank2sim.simulation.integrator import Integrator
from tank2sim.simulation.running import Running
from tests.hostile_text import HOSTILE, hostile_card
from tests.marks import first_fast

STEP_S = 0.1


@cache
def converted(name: str) -> ProgramFiles:
    return bridge_command_files(read_card(name))


@pytest.fixture(scope="module")
def program(simulator: Callable[[str], Any]) -> Any:
    return simulator("bridge_command/own_ship.py")


@dataclass
class Sailing:
    """A ship at sea in the independent program."""

    ship: Any
    time: float = 0.0
    turned: float = 0.0

    def step(self, lever: float, rudder: float = 0.0) -> None:
        before = self.ship.hdg
        self.ship.step(STEP_S, lever, lever, rudder)
        self.turned += (self.ship.hdg - before + 180) % 360 - 180
        self.time += STEP_S

    def until(self, done: Callable[[Sailing], bool], lever: float, rudder: float = 0.0) -> None:
        while not done(self):
            assert self.time < 20_000
            self.step(lever, rudder)


def at_sea(program: Any, files: ProgramFiles, tmp_path: Path, card: Card, speed: float) -> Sailing:
    path = tmp_path / "boat.ini"
    path.write_text(str(files.files["boat.ini"]))
    points, _ = mesh(str(files.files["box.x"]))
    breadth, height, length = np.ptp(points, axis=0)
    above = height - card.ship.draught_m
    ship = program.OwnShip(program.read(path), length, breadth, speed / program.KTS, air_draught=above)
    return Sailing(ship)


def table(files: ProgramFiles) -> dict[tuple[str, str], tuple[float, float]]:
    return {(row.manoeuvre, row.figure): (row.before, row.after) for row in files.changes}


@first_fast("name", ["kvlcc2-mmg", "mariner"])
def test_the_ship_turns_as_the_table_says_and_as_the_card_within_ten_percent(
    name: str, program: Any, tmp_path: Path
) -> None:
    card, files = read_card(name), converted(name)
    figures, speed = table(files), card.model.speed_mps
    for rudder in (20, -30):
        sailing = at_sea(program, files, tmp_path, card, speed)
        sailing.until(lambda it: abs(it.turned) >= 90, 1.0, rudder)
        assert math.copysign(1, sailing.turned) == math.copysign(1, rudder)
        before, after = figures[f"turn:{rudder}", "advance_m"]
        assert sailing.ship.z == pytest.approx(after, rel=0.005)
        assert sailing.ship.z == pytest.approx(before, rel=0.1)
        sailing.until(lambda it: abs(it.turned) >= 180, 1.0, rudder)
        before, after = figures[f"turn:{rudder}", "tactical_diameter_m"]
        assert abs(sailing.ship.x) == pytest.approx(after, rel=0.005)
        assert abs(sailing.ship.x) == pytest.approx(before, rel=0.1)
        assert sailing.time == pytest.approx(figures[f"turn:{rudder}", "time_180_s"][1], rel=0.005)
        assert sailing.ship.u == pytest.approx(speed, rel=1e-3)


def test_the_engine_gives_the_speeds_and_the_stop_of_the_card(program: Any, tmp_path: Path) -> None:
    card, files = read_card("kvlcc2-mmg"), converted("kvlcc2-mmg")
    figures, speed = table(files), card.model.speed_mps
    for words, lever in (("full ahead", 1.0), ("half thrust ahead", 0.5), ("quarter thrust ahead", 0.25)):
        sailing = at_sea(program, files, tmp_path, card, speed)
        sailing.until(lambda it: it.time >= 4000, lever)
        before, after = figures[words, "final_speed_mps"]
        assert sailing.ship.u == pytest.approx(after, rel=4e-3)
        assert sailing.ship.u == pytest.approx(before, rel=0.03)
    sailing = at_sea(program, files, tmp_path, card, speed)
    sailing.until(lambda it: it.ship.u <= 0, -1.0)
    before, after = figures["stop", "track_reach_m"]
    assert sailing.ship.z == pytest.approx(after, rel=1e-3) and after == pytest.approx(before, rel=0.1)
    before, after = figures["stop", "time_to_stop_s"]
    assert sailing.time == pytest.approx(after, rel=1e-3) and after == pytest.approx(before, rel=0.1)


def test_a_zigzag_overshoots_as_the_table_says(program: Any, tmp_path: Path) -> None:
    card, files = read_card("mariner"), converted("mariner")
    sailing = at_sea(program, files, tmp_path, card, card.model.speed_mps)
    sailing.until(lambda it: it.turned >= 20, 1.0, 20)
    sailing.until(lambda it: it.ship.r <= 0, 1.0, -20)
    assert sailing.turned - 20 == pytest.approx(table(files)["zigzag:20/20", "overshoot_1_deg"][1], rel=0.02)


def test_an_asymmetric_ship_runs_straight_with_its_neutral_rudder(program: Any, tmp_path: Path) -> None:
    card, files = read_card("mariner"), converted("mariner")
    assert isinstance(card, ManoeuvringCard)
    neutral = math.degrees(Running(Integrator(build(card))).neutral_rudder())
    assert abs(neutral) > 0.5
    for rudder, straight in ((neutral, True), (-neutral, False)):
        sailing = at_sea(program, files, tmp_path, card, card.model.speed_mps)
        sailing.ship.rudder = rudder
        sailing.until(lambda it: it.time >= 300, 1.0, rudder)
        assert (abs(sailing.turned) < 0.1) == straight


@pytest.mark.slow
def test_a_single_screw_that_backs_turns_the_bow_as_the_card_does(program: Any, tmp_path: Path) -> None:
    card, files = read_card("esso-osaka-ship"), converted("esso-osaka-ship")
    before, after = table(files)["stop", "heading_change_deg"]
    assert before == pytest.approx(92.44, abs=0.1) and after == pytest.approx(before, rel=1e-3)  # as simulate prints
    sailing = at_sea(program, files, tmp_path, card, card.model.speed_mps)
    sailing.until(lambda it: it.ship.u <= 0, -1.0)
    assert sailing.turned == pytest.approx(after, rel=0.01)


def twin_card() -> Card:
    text = bundled_cards()["kvlcc2-l7-mmg"].read_text(encoding="utf-8")
    text = text.replace("[propeller]", "[propeller]\nnumber = 2\ny_P = 0.03").replace("C_1 = 2.0", "C_1 = 0.0")
    return parse_card(text.replace("[rudder]", "[rudder]\nnumber = 2\ny_R = 0.03"), "twin.toml")


@pytest.mark.slow
def test_either_engine_of_two_screws_has_half_of_the_thrust_at_its_side(program: Any, tmp_path: Path) -> None:
    card = twin_card()
    files = bridge_command_files(card)
    sailing = at_sea(program, files, tmp_path, card, card.model.speed_mps)
    sailing.until(lambda it: it.time >= 600, 1.0)
    assert sailing.ship.u == pytest.approx(card.model.speed_mps, rel=1e-3)
    assert (
        pytest.approx(sailing.ship.A * sailing.ship.u**2 + sailing.ship.B * sailing.ship.u, rel=2e-3)
        == 2 * sailing.ship.F
    )
    assert sailing.ship.space == pytest.approx(0.06 * card.ship.length_m)


@pytest.mark.slow
def test_a_polynomial_with_an_order_for_each_screw_has_two_engines(program: Any, tmp_path: Path) -> None:
    text = bundled_cards()["kvlcc2-l7"].read_text(encoding="utf-8") + '\n[[effects]]\nname = "twin_orders"\n'
    values = "propeller_starboard_rpm = 0.0\npropeller_port_rpm = 0.0\nplace_m = 0.25\n"
    card = parse_card(f"{text}[effects.parameters]\n{values}", "twin.toml")
    sailing = at_sea(program, bridge_command_files(card), tmp_path, card, card.model.speed_mps)
    sailing.until(lambda it: it.time >= 300, 1.0)
    assert sailing.ship.space == pytest.approx(0.5)
    assert sailing.ship.u == pytest.approx(card.model.speed_mps, rel=1e-3)
    assert sailing.ship.r == 0.0


def keys(text: str) -> dict[str, str]:
    return {key: value for key, _, value in (line.partition("=") for line in text.splitlines() if "=" in line)}


def test_the_file_has_plain_decimals_and_no_key_that_overwrites_the_fit() -> None:
    text = str(converted("kvlcc2-mmg").files["boat.ini"])
    found = keys(text)
    assert found.pop("FileName") == '"box.x"'
    assert all(re.fullmatch(r"-?\d+\.\d+", value) for value in found.values())
    assert not {key.lower() for key in found} & {"blockcoefficient", "maxspeedahead"}
    assert int(float(found["Views"])) == 1 and {"ViewX(1)", "ViewY(1)", "ViewZ(1)", "ScaleFactor"} <= set(found)
    assert float(found["MaxRevs"]) == pytest.approx(90.0469, rel=1e-4)
    assert float(found["YCorrection"]) == -20.8


def test_added_masses_of_the_card_are_in_mass_and_inertia() -> None:
    card = read_card("mariner")
    found = keys(str(converted("mariner").files["boat.ini"]))
    unit = 0.5 * card.environment.water_density_kgpm3 * card.ship.length_m**3
    assert float(found["Mass"]) == pytest.approx((798e-5 + 42e-5) * unit, rel=1e-5)  # m' and X'udot as published
    assert float(found["Inertia"]) == pytest.approx((39.2e-5 + 43.8e-5) * unit * card.ship.length_m**2, rel=2e-2)


def test_drag_across_is_that_of_a_plate() -> None:
    card = read_card("mariner")
    plate = 0.5 * card.environment.water_density_kgpm3 * card.ship.length_m * card.ship.draught_m
    found = float(keys(str(converted("mariner").files["boat.ini"]))["DynamicsLateralDragA"])
    assert 0.5 < found / plate < 2.0


def mesh(text: str) -> tuple[np.ndarray, np.ndarray]:
    """Vertices and triangles of a mesh in DirectX text."""
    numbers = re.findall(r"-?\d+(?:\.\d+)?", text[text.index("{") :])
    count = int(numbers[0])
    points = np.array(numbers[1 : 1 + 3 * count], dtype=float).reshape(count, 3)
    rest = numbers[1 + 3 * count :]
    faces = np.array(rest[1:], dtype=int).reshape(int(rest[0]), 4)
    assert (faces[:, 0] == 3).all()
    return points, faces[:, 1:]


def volume(points: np.ndarray, faces: np.ndarray) -> float:
    return float(np.linalg.det(points[faces]).sum() / 6)


def test_the_mesh_is_a_closed_box_whose_faces_look_outwards(data: Path) -> None:
    points, faces = mesh(box_mesh(100.0, 20.0, 9.0))
    assert np.ptp(points, axis=0).tolist() == [20.0, 9.0, 100.0]
    assert points.min(axis=0).tolist() == [-10.0, 0.0, -50.0]
    edges = [(int(face[i]), int(face[(i + 1) % 3])) for face in faces for i in range(3)]
    assert len(edges) == len(set(edges)) == 36 and {(b, a) for a, b in edges} == set(edges)
    assert abs(volume(points, faces)) == pytest.approx(18000.0)
    other = data / "simulators" / "bridge_command" / "box.x"
    if other.is_file():
        assert np.sign(volume(points, faces)) == np.sign(volume(*mesh(other.read_text())))


@pytest.mark.slow
def test_no_text_of_a_card_comes_into_the_files(tmp_path: Path) -> None:
    path = hostile_card(tmp_path / "ship.toml", bundled("models") / "mariner" / "ship.toml", "".join(HOSTILE))
    assert bridge_command_files(read_card(str(path))).files == converted("mariner").files


@pytest.mark.slow
def test_tunnel_thrusters_of_the_card_push_at_their_places(program: Any, tmp_path: Path) -> None:
    card = read_card("kvlcc2-mmg")
    assert isinstance(card, ManoeuvringCard)
    text = card.text + "".join(
        f'\n[[effects]]\nname = "{end}_tunnel_thruster"\n[effects.parameters]\nforce_N = {force}\nforward_m = {x}\n'
        "command = 0.0\nhalf_speed_mps = 1.5\n"
        for end, force, x in (("bow", 5e5, 140.0), ("stern", 4e5, -130.0))
    )
    new = parse_card(text, "thrusters.toml")
    files = bridge_command_files(new)
    for orders, moment in (({"bow": 1.0}, 5e5 * 140), ({"stern": 1.0}, -4e5 * 130)):
        sailing = at_sea(program, files, tmp_path, card, 0.0)
        sailing.ship.step(STEP_S, **orders)
        assert sailing.ship.r == pytest.approx(moment / sailing.ship.I * STEP_S)
        assert sailing.ship.v > 0


def test_wind_current_and_waves_of_the_card_are_not_fitted() -> None:
    def with_effects(**effects: float) -> ProgramFiles:
        """Of effects by their speed or height, from the east."""
        keys = {"wave_drift": "height_m"}
        entries = [
            {"name": name, "parameters": {keys.get(name, "speed_mps"): size, "direction_deg": 90.0}}
            for name, size in effects.items()
        ]
        return bridge_command_files(t2s.load("otter").replace({"effects": entries}).card)

    still, files = with_effects(wind=0.0), with_effects(wind=6.0, current=0.5, wave_drift=0.3)
    assert files.files == still.files and files.changes == still.changes
    assert any("calm water" in text for text in files.losses)


def test_the_readme_speaks_of_the_engines_that_the_vessel_has() -> None:
    assert "twice the thrust" in converted("kvlcc2-mmg").use and "twice the thrust" not in converted("otter").use


def test_what_is_lost_is_said_in_numbers() -> None:
    losses = converted("kvlcc2-mmg").losses
    assert any("35 deg" in text and "30 deg" in text and "1043 m" in text for text in losses)  # as simulate prints
    assert any("63 %" in text and "18 deg" in text for text in losses)
    assert any("no engine" in text for text in converted("mariner").losses)
    assert not any("no engine" in text for text in losses)
    assert {row.manoeuvre for row in converted("mariner").changes if row.manoeuvre.startswith("stop")} == set()


@pytest.mark.slow
def test_a_ship_that_heels_keeps_its_turns_and_loses_its_heel() -> None:
    files = converted("container")
    assert any("heel" in text and "11.2 deg" in text for text in files.losses)
    before, after = table(files)["turn:20", "tactical_diameter_m"]
    assert after == pytest.approx(before, rel=0.1)


def test_a_craft_has_an_engine_at_either_side_and_runs_and_turns_by_them(program: Any, tmp_path: Path) -> None:
    card, files = read_card("otter"), converted("otter")
    figures, found = table(files), keys(str(files.files["boat.ini"]))
    assert float(found["PropSpace"]) == pytest.approx(2 * 0.395)
    assert float(found["Max_propulsion_force"]) == pytest.approx(0.01108 * 103.930864**2, rel=1e-5)
    assert float(found["AsternEfficiency"]) == pytest.approx(
        0.006445 / 0.01108 * (101.736666 / 103.930864) ** 2, rel=1e-5
    )

    def lever(rpm: float) -> float:
        share = rpm * 2 * math.pi / 60 / 103.930864  # of its largest revolutions
        return share * abs(share)

    for words, figure in figures:
        kind, _, number = words.partition(":")
        before, after = figures[words, figure]
        assert after == pytest.approx(before, rel=0.2)
        ship = at_sea(program, files, tmp_path, card, 0.0).ship
        if (kind, figure) == ("straight", "final_speed_mps"):
            ends = (lever(float(number)),) * 2
        elif (kind, figure) == ("spin", "final_rate_degps"):  # thrust astern at as many revolutions: by the card
            ends = lever(float(number)), -lever(float(number)) * (103.930864 / 101.736666) ** 2
        elif (kind, figure) == ("difference", "steady_rate_degps"):
            cruise = 72.45426791175355 * 30 / math.pi
            ends = lever(cruise + float(number) / 2), lever(cruise - float(number) / 2)
        else:
            continue
        for _ in range(round(60 / STEP_S)):
            ship.step(STEP_S, *ends)
        assert (ship.u if kind == "straight" else math.degrees(ship.r)) == pytest.approx(after, rel=0.01)


def test_a_vessel_that_bridge_command_cannot_have_is_refused() -> None:
    craft = read_card("otter")
    assert isinstance(craft, SteeredCard)
    with pytest.raises(InputError) as refused:
        bridge_command_files(replace(craft, thrusters=craft.thrusters[:1]))
    assert refused.value.place == "thrusters"
    with pytest.raises(InputError) as refused:
        bridge_command_files(read_card("alyshev"))
    assert refused.value.place == "model.kind"
    card = read_card("mariner")
    short = replace(card, ship=card.ship.model_copy(update={"beam_m": None}))
    with pytest.raises(InputError) as refused:
        bridge_command_files(short)
    assert refused.value.place == "ship.beam_m"
