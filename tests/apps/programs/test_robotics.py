"""A craft in the forms of Gazebo's and VRX's plugins: forces by their own sums, and what the simpler one loses."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from types import ModuleType

import numpy as np
import pytest

import tank2sim as t2s
from tank2sim.apps.programs.robotics import growth_per_step
from tank2sim.bundled import bundled_cards
from tank2sim.cards import CraftCard, parse_card, read_card
from tank2sim.dynamics import build
from tank2sim.errors import InputError
from tests.dynamics.states import accelerations, motion

CROSS = (
    "Yrdot = -9.0\nNvdot = -9.0\nYvabsr = -40.0\nYr = -8.0\nNv = -14.0\nNrabsv = -60.0\nNrabsu = -30.0\n"
    "Xuabsu = -12.0\n"
)


@pytest.fixture(scope="module")
def craft() -> CraftCard:
    """The Otter without effects, with cross terms."""
    text = t2s.load("otter").card.text
    text = text[: text.index("[[effects]]")].replace("[derivatives]\n", f"[derivatives]\n{CROSS}")
    card = parse_card(text, "craft.toml")
    assert isinstance(card, CraftCard)
    return card


def elements(text: str) -> dict[str, float]:
    return {name: float(value) for name, value in re.findall(r"<(\w+)>(-?[\d.e+-]+)</\1>", text)}


def plugin_forces(given: dict[str, float], nu: np.ndarray) -> np.ndarray:
    """X, Y, N by Gazebo's sum over all products, axes x forward, y to port: of velocities u, v, r there."""
    found = np.zeros(3)
    for row, force in enumerate("xyn"):
        for j, first in enumerate("UVR"):
            found[row] += given.get(f"{force}{first}", 0.0) * nu[j]
            for k, second in enumerate("UVR"):
                found[row] += given.get(f"{force}{first}abs{second}", 0.0) * nu[j] * abs(nu[k])
                found[row] += given.get(f"{force}{first}{second}", 0.0) * nu[j] * nu[k]
    return found


HEAVY = {"rigid_body.mass": 120.0, "rigid_body.yaw_inertia": 62.0}
"""Of a craft so heavy that its added mass is stable in a plugin."""


@pytest.fixture(scope="module")
def heavy(craft: CraftCard) -> CraftCard:
    card = t2s.Ship(craft).replace(HEAVY).card
    assert isinstance(card, CraftCard)
    return card


def largest_root(m: np.ndarray, a: np.ndarray, d: np.ndarray, dt: float) -> float:
    """Of one explicit step of a plugin, by iterating it on a small error."""
    inverse = np.linalg.inv(m)
    now, before = np.array([1e-6, 1e-6, 1e-6]), np.zeros(3)
    sizes = []
    for _ in range(400):
        now, before = now + dt * inverse @ (-d @ now - a @ (now - before) / dt), now
        sizes.append(np.linalg.norm(now))
    return float((sizes[-1] / sizes[-101]) ** (1 / 100))


def matrices(card: CraftCard) -> tuple[np.ndarray, np.ndarray]:
    """Mass and added mass (3, 3) of surge, sway and yaw by the numbers of the card."""
    body, d = card.rigid_body, card.derivatives
    lever = body.mass * body.x_G
    mass = np.array([[body.mass, 0, 0], [0, body.mass, lever], [0, lever, body.yaw_inertia]])
    added = np.zeros((3, 3))
    for term, row, column in (("Xudot", 0, 0), ("Yvdot", 1, 1), ("Yrdot", 1, 2), ("Nvdot", 2, 1), ("Nrdot", 2, 2)):
        added[row, column] = -d.get(term, 0.0)
    return mass, added


def test_the_growth_of_an_error_is_that_of_the_plugins_step(craft: CraftCard, heavy: CraftCard) -> None:
    otter = t2s.load("otter").card
    assert isinstance(otter, CraftCard)
    for card in (craft, heavy, otter):
        mass, added = matrices(card)
        damping = -np.diag([card.derivatives.get(name, 0.0) for name in ("Xu", "Yv", "Nr")])
        assert growth_per_step(card) == pytest.approx(largest_root(mass, added, damping, 1e-3), rel=0.01)
    assert growth_per_step(otter) == pytest.approx(1.985, abs=0.005)
    assert growth_per_step(heavy) < 1 < growth_per_step(craft)


@pytest.mark.parametrize("name", [name for name in bundled_cards() if isinstance(read_card(name), CraftCard)])
def test_the_growth_of_each_bundled_craft_is_that_of_an_independent_calculation(
    name: str, simulator: Callable[[str], ModuleType]
) -> None:
    card = read_card(name)
    assert isinstance(card, CraftCard)
    model = build(replace(card, effects=()))
    fastest, nothing = card.model.speed_range_mps[1], {command.name: 0.0 for command in model.inputs}

    def rates(u: float, v: float, r: float) -> np.ndarray:
        return accelerations(model, motion(u, v, r) | nothing)

    mass, added = matrices(card)
    lever = mass[1, 2]
    # Damping by the slope of the accelerations, without the inertial forces of a turning craft.
    step, slopes = 1e-5, []
    for axis in range(3):
        moved = [np.array([fastest, 0.0, 0.0]) + side * step * np.eye(3)[axis] for side in (1, -1)]
        slopes.append((rates(*moved[0]) - rates(*moved[1])) / (2 * step))
    inertial = np.array(
        [
            [0, 0, 0],
            [0, 0, -(mass[0, 0] + added[0, 0]) * fastest],
            [0, (added[0, 0] - added[1, 1]) * fastest, -(lever + (added[1, 2] + added[2, 1]) / 2) * fastest],
        ]
    )
    damping = inertial - (mass + added) @ np.array(slopes).T
    expected = simulator("gazebo/stability.py").largest_root(mass, added, damping, 1e-3)
    assert growth_per_step(card) == pytest.approx(expected, rel=1e-6)


@pytest.mark.parametrize("to", ["gazebo", "vrx"])
def test_added_mass_that_diverges_goes_into_the_inertia_of_the_link(craft: CraftCard, to: str) -> None:
    made = t2s.convert(t2s.Ship(craft), to)
    given = elements(made.text)
    expected = {"xx": 5.281521, "yy": 82.5, "yr": 9.0, "rr": 24.032424}
    assert {key: given[key] for key in expected} == pytest.approx(expected)
    assert not any(value for name, value in given.items() if "Dot" in name)
    assert not {"xVR", "yUR", "nUV"} & set(given)  # the engine has C_A with the inertia
    assert any("1." in notice and "step" in notice for notice in made.notices)
    with pytest.raises(InputError, match="added_mass"):
        t2s.convert(t2s.Ship(craft), to, added_mass="plugin")


def test_gazebos_own_sum_gives_the_accelerations_of_the_card(heavy: CraftCard) -> None:
    craft = heavy
    given = elements(t2s.convert(t2s.Ship(craft), "gazebo").text)
    model = t2s.Ship(craft).model
    m, x_G, inertia = 120.0, 0.153125, 62.0
    added = np.array([[given.get(f"{f}Dot{a}", 0.0) for a in "UVR"] for f in "xyn"])
    body = np.array([[m, 0, 0], [0, m, m * x_G], [0, m * x_G, inertia]])
    rng = np.random.default_rng(2)
    for _ in range(5):
        u, v, r = rng.uniform(-1, 1, 3) * [2.0, 0.6, 0.5]
        port = np.array([u, -v, -r])
        centripetal = np.array([m * (port[1] * port[2] + x_G * port[2] ** 2), -m * u * port[2], -m * x_G * u * port[2]])
        there = np.linalg.solve(body - added, plugin_forces(given, port) + centripetal)
        stopped = {"thrusters.port.command": 0.0, "thrusters.starboard.command": 0.0}
        here = accelerations(model, motion(u, v, r) | stopped)
        assert there * [1, -1, -1] == pytest.approx(here, rel=1e-8)


def test_vrx_has_positive_damping_and_no_more_than_its_axes(heavy: CraftCard) -> None:
    made = t2s.convert(t2s.Ship(heavy), "vrx")
    given = elements(made.text)
    assert given == pytest.approx(
        {
            **{"xDotU": 5.281521, "yDotV": 82.5, "nDotR": 24.032424, "xU": 77.5544, "xUU": 12.0},
            **{"yV": 162.5, "yVV": 10.04, "nR": 40.044922, "nRR": 410.99},
        }
    )
    assert any("Nrabsu" in notice and "Munk" in notice for notice in made.notices)


def test_what_the_simpler_form_loses_is_in_the_figures_and_gazebos_hull_loses_nothing(heavy: CraftCard) -> None:
    gazebo, vrx = (t2s.convert(t2s.Ship(heavy), to).to_dict()["figures"] for to in ("gazebo", "vrx"))
    assert all(entry["after"] == pytest.approx(entry["before"], rel=1e-12) for entry in gazebo)
    straight = [entry for entry in vrx if entry["manoeuvre"].startswith("straight")]
    turn = next(entry for entry in vrx if entry["figure"] == "steady_diameter_m")
    assert all(entry["after"] == pytest.approx(entry["before"], rel=1e-9) for entry in straight)
    assert abs(turn["error_percent"]) > 5


def test_a_card_goes_to_prime_and_back_to_the_last_digits(craft: CraftCard) -> None:
    prime = t2s.convert(t2s.Ship(craft), "small_craft", scaling="prime")
    assert '"prime"' in prime.text and prime.ship.card.rigid_body.mass == pytest.approx(80.0, rel=1e-14)
    back = t2s.convert(prime.ship, "small_craft", scaling="dimensional").ship.card
    assert back.derivatives == pytest.approx(craft.derivatives, rel=1e-14)


@pytest.mark.parametrize(
    ("card", "to", "options"),
    [
        ("otter", "abkowitz", {}),
        ("mariner", "gazebo", {}),
        ("otter", "vrx", {"scaling": "prime"}),
        ("otter", "small_craft", {"scaling": "bis"}),
        ("otter", "small_craft", {"origin_m": 0.2}),
    ],
)
def test_what_cannot_be_had_is_refused(card: str, to: str, options: dict) -> None:
    with pytest.raises(InputError):
        t2s.convert(card, to, **options)


def test_a_thruster_that_is_turned_has_the_axis_of_its_joint() -> None:
    """30 deg to starboard at the port side: in Gazebo y is to port, so that the axis leans to minus y."""
    turned = t2s.load("otter").replace({"thrusters.0.azimuth_rad": np.pi / 6})
    text = t2s.convert(turned, to="gazebo").text
    found = re.findall(r"x (\S+), y (\S+) m \(to port\), axis of the joint (\S+) (\S+) (\S+);", text)
    expected = [[0, 0.395, np.cos(np.pi / 6), -0.5, 0], [0, -0.395, 1, 0, 0]]
    assert np.array(found, float) == pytest.approx(np.array(expected), abs=1e-5)


def test_a_thruster_that_turns_is_a_loss_in_gazebo() -> None:
    values = {"thrusters.0.max_azimuth_rad": np.pi / 6, "thrusters.0.azimuth_time_constant_s": 0.4}
    notices = t2s.convert(t2s.load("otter").replace(values), to="gazebo").study.notices
    assert any("port by 30 deg" in str(one) for one in notices)
    assert not any("turn" in str(one) for one in t2s.convert("otter", to="gazebo").study.notices)
