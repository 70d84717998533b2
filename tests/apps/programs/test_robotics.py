"""A craft in the forms of Gazebo's and VRX's plugins: forces by their own sums, and what the simpler one loses."""

from __future__ import annotations

import re

import numpy as np
import pytest

import tank2sim as t2s
from tank2sim.cards import CraftCard, parse_card
from tank2sim.errors import InputError
from tests.dynamics.accelerations import accelerations

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


def test_gazebos_own_sum_gives_the_accelerations_of_the_card(craft: CraftCard) -> None:
    given = elements(t2s.convert(t2s.Ship(craft), "gazebo").text)
    model = t2s.Ship(craft).model
    m, x_G, inertia = 80.0, 0.153125, 16.0125
    added = np.array([[given.get(f"{f}Dot{a}", 0.0) for a in "UVR"] for f in "xyn"])
    body = np.array([[m, 0, 0], [0, m, m * x_G], [0, m * x_G, inertia]])
    rng = np.random.default_rng(2)
    for _ in range(5):
        u, v, r = rng.uniform(-1, 1, 3) * [2.0, 0.6, 0.5]
        port = np.array([u, -v, -r])
        centripetal = np.array([m * (port[1] * port[2] + x_G * port[2] ** 2), -m * u * port[2], -m * x_G * u * port[2]])
        there = np.linalg.solve(body - added, plugin_forces(given, port) + centripetal)
        stopped = {"thrusters.port.command": 0.0, "thrusters.starboard.command": 0.0}
        here = accelerations(model, {"motion.u": u, "motion.v": v, "motion.r": r}, stopped)
        assert there * [1, -1, -1] == pytest.approx(here, rel=1e-8)


def test_vrx_has_positive_damping_and_no_more_than_its_axes(craft: CraftCard) -> None:
    made = t2s.convert(t2s.Ship(craft), "vrx")
    given = elements(made.text)
    assert given == pytest.approx(
        {
            **{"xDotU": 5.281521, "yDotV": 82.5, "nDotR": 24.032424, "xU": 77.5544, "xUU": 12.0},
            **{"yV": 162.5, "yVV": 10.04, "nR": 40.044922, "nRR": 410.99},
        }
    )
    assert any("Nrabsu" in notice and "Munk" in notice for notice in made.notices)


def test_what_the_simpler_form_loses_is_in_the_figures_and_gazebos_hull_loses_nothing(craft: CraftCard) -> None:
    gazebo, vrx = (t2s.convert(t2s.Ship(craft), to).to_dict()["figures"] for to in ("gazebo", "vrx"))
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
