"""One check of a card's sizes and signs: impossible cards are refused, implausible ones are said with every result."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import tank2sim as t2s
from tank2sim.bundled import bundled_cards
from tank2sim.cards import read_card
from tank2sim.cards.examination import doubts
from tank2sim.dynamics import build
from tank2sim.errors import InputError
from tank2sim.marks import CHECK

FOOT = 0.3048
RADIANS_PER_DEGREE = 0.017453292519943295

IMPOSSIBLE = {
    "density in t/m3": ("mariner", "environment.water_density_kgpm3", 1.025),
    "gravity in ft/s2": ("mariner", "environment.gravity_mps2", 9.80665 / FOOT),
    "viscosity in cSt": ("mariner", "environment.kinematic_viscosity_m2ps", 1.19),
    "air as heavy as water": ("mariner", "environment.air_density_kgpm3", 1000.0),
    "length in feet": ("mariner", "ship.length_m", 160.93 / FOOT),
    "largest angle in radians": ("mariner", "steering_gear.max_angle_deg", 40 * RADIANS_PER_DEGREE),
    "steering rate in rad/s": ("mariner", "steering_gear.max_rate_degps", 5 * RADIANS_PER_DEGREE),
    "centre of gravity at the quarter": ("mariner", "rigid_body.x_G", 0.23),
    "inertia ten times too large": ("mariner", "rigid_body.yaw_inertia", 39.2e-4),
    "prime II as prime": ("kvlcc2-mmg", "model.scaling", "prime"),
    "aground": ("mariner", "ship.water_depth_m", 7.0),
    "craft with its mass in pounds": ("otter", "rigid_body.mass", 176.0),
    "coefficients without scale as dimensional": ("mariner", "model.scaling", "dimensional"),
}

IMPLAUSIBLE = {
    "rudder of the other sign": ("mariner", {"model.rudder_sign": "starboard"}, "wrong way"),
    "Yv positive": ("mariner", {"derivatives.Yv": 1160e-5}, "Yv"),
    "Nr positive": ("mariner", {"derivatives.Nr": 166e-5}, "Nr"),
    "Nv positive": ("mariner", {"derivatives.Nv": 264e-5}, "Nv"),
    "Yvdot positive": ("mariner", {"derivatives.Yvdot": 748e-5}, "Yvdot"),
    "beam and draught exchanged": ("mariner", {"ship.beam_m": 7.468, "ship.draught_m": 23.17}, "beam over draught"),
    "prime as prime II": ("mariner", {"model.scaling": "prime_ii"}, "block coefficient"),
    "mass without particulars": ("esso-osaka", {"rigid_body.x_G": 0.15}, "centre of gravity"),
    "speed of the ship on its model": ("kvlcc2-l7-mmg", {"model.speed_mps": 7.97}, "Froude"),
    "speed of the model on its ship": ("kvlcc2-mmg", {"model.speed_mps": 1.179}, "Froude"),
    "rudder at the bow": ("kvlcc2-l7-mmg", {"rudder.x_R": 0.5}, "x_R"),
    "flow to a rudder at the bow": ("kvlcc2-l7-mmg", {"rudder.l_R": 0.71}, "l_R"),
    "added masses in another prime system": ("kvlcc2-mmg", {"derivatives.my": 0.223 * 20.8 / 320}, "Yvdot"),
    "added inertia in another prime system": ("kvlcc2-mmg", {"derivatives.Jz": 0.011 * 20.8 / 320}, "Nrdot"),
    "half the rudder's area over L d": ("kvlcc2-mmg", {"ship.rudder_area_m2": 320 * 20.8 / 193}, "rudder area"),
    "revolutions per second as rpm": ("kvlcc2-mmg", {"propulsion.nominal_rpm": 1.7}, "advance ratio"),
    "range of the rudder in radians": ("kvlcc2", {"model.valid_rudder_deg": 0.61}, "valid_rudder_deg"),
    "derivatives of the rudder per degree": (
        "mariner",
        {"derivatives.Yd": 278e-5 * RADIANS_PER_DEGREE, "derivatives.Nd": -139e-5 * RADIANS_PER_DEGREE},
        "N_delta",
    ),
    "resistance that falls with speed": ("mariner", {"derivatives.Xu": 184e-5}, "Xu"),
    "steering rate in deg/min": ("mariner", {"steering_gear.max_rate_degps": 300.0}, "max_rate_degps"),
    "rudder's height in mm": ("kvlcc2-l7-mmg", {"rudder.height_m": 345.0}, "rudder height"),
    "slope of the rudder's force per degree": ("kvlcc2-l7-mmg", {"rudder.f_alpha": 0.0479}, "f_alpha"),
    "thrust that rises with J": ("kvlcc2-l7-mmg", {"propeller.k_1": 0.2753}, "k_1"),
    "thrust deduction in place of 1 - t": ("kvlcc2-l7-mmg", {"propeller.t_P": 0.78}, "t_P"),
    "flow straightening of the other sign": ("kvlcc2-l7-mmg", {"rudder.gamma_R_plus": -0.64}, "gamma_R_plus"),
    "thrust for revolutions per second": ("otter", {"thrusters.0.ahead_Ns2": 2.0}, "thrust over weight"),
    "craft pushed on by drift": ("otter", {"derivatives.Yv": 20.0}, "Yv"),
    "craft with negative added inertia": ("otter", {"derivatives.Nrdot": 2.0}, "Nrdot"),
}


@pytest.mark.parametrize("name", sorted(bundled_cards()))
def test_bundled_cards_raise_no_doubt(name: str) -> None:
    assert doubts(read_card(name)) == ()


@pytest.mark.parametrize(("ship", "key", "value"), IMPOSSIBLE.values(), ids=IMPOSSIBLE)
def test_what_no_body_can_have_is_refused_at_its_key(ship: str, key: str, value: object) -> None:
    with pytest.raises(InputError) as refused:
        read_card(ship, {key: value})
    beside = {
        "ship.length_m": "rigid_body.mass",
        "model.scaling": "rigid_body.mass",
        "rigid_body.x_G": "rigid_body.yaw_inertia",
    }
    assert refused.value.place == beside.get(key, key)


@pytest.mark.parametrize(("ship", "changes", "word"), IMPLAUSIBLE.values(), ids=IMPLAUSIBLE)
def test_what_no_known_ship_has_is_a_marked_notice_of_the_model(
    ship: str, changes: dict[str, object], word: str
) -> None:
    card = read_card(ship, changes)
    (doubt,) = doubts(card)
    assert doubt.startswith(CHECK) and word in doubt
    assert build(card).notices[0] == doubt


def test_a_sign_within_twice_its_stated_error_raises_no_doubt() -> None:
    changes = {"derivatives.Nr": 50e-5, "uncertainty.Nr": 200e-5}
    assert doubts(read_card("mariner", {**changes, "uncertainty.Nr": 10e-5}))
    assert not [text for text in doubts(read_card("mariner", changes)) if "Nr is" in text]


def test_total_and_hydrodynamic_yaw_terms_are_judged_alike() -> None:
    card = read_card("mariner")
    body, total = card.rigid_body, card.derivatives
    same = {
        "model.yaw_rate_terms": "hydrodynamic",
        "derivatives.Yr": total["Yr"] + body.mass,
        "derivatives.Nr": total["Nr"] + body.mass * body.x_G,
    }
    assert doubts(read_card("mariner", same)) == doubts(card) == ()


ASKED: dict[str, Callable[[t2s.Ship, Path], Any]] = {
    "simulate": lambda ship, folder: ship.turn(20),
    "stability": lambda ship, folder: ship.stability(spirals=False),
    "convert": lambda ship, folder: t2s.convert(ship, to="mss"),
    "compare": lambda ship, folder: t2s.compare(["mariner", ship]),
    "poster": lambda ship, folder: ship.poster(),
    "pilotcard": lambda ship, folder: ship.pilot_card(),
    "validate": lambda ship, folder: t2s.validate(ship, members=0),
}


@pytest.mark.slow
@pytest.mark.parametrize("command", ASKED)
def test_every_answer_about_an_implausible_card_says_so_first_on_screen_and_page(command: str, tmp_path: Path) -> None:
    ship = t2s.load("mariner").replace({"model.rudder_sign": "starboard"})
    found = ASKED[command](ship, tmp_path)
    (mark,) = [mark for mark in found.marks if "wrong way" in mark]
    assert repr(found).startswith(mark)
    assert mark in json.loads(found.to_json())["notices"]
    assert CHECK in found.page()
