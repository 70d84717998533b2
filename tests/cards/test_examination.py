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
    "rudder's height in cm": ("kvlcc2-l7-mmg", {"rudder.height_m": 34.5}, "rudder height"),
    "slope of the rudder's force per degree": ("kvlcc2-l7-mmg", {"rudder.f_alpha": 0.0479}, "f_alpha"),
    "thrust that rises with J": ("kvlcc2-l7-mmg", {"propeller.k_1": 0.2753}, "k_1"),
    "thrust deduction in place of 1 - t": ("kvlcc2-l7-mmg", {"propeller.t_P": 0.78}, "t_P"),
    "flow straightening of the other sign": ("kvlcc2-l7-mmg", {"rudder.gamma_R_plus": -0.64}, "gamma_R_plus"),
    "thrust for revolutions per second": ("otter", {"thrusters.0.ahead_Ns2": 2.0}, "thrust over weight"),
    "craft pushed on by drift": ("otter", {"derivatives.Yv": 20.0}, "Yv"),
    "craft with negative added inertia": ("otter", {"derivatives.Nrdot": 2.0}, "Nrdot"),
}


def sized(beam: float, draught: float) -> dict[str, float]:
    return {"ship.beam_m": beam, "ship.draught_m": draught}


SECTION = 23.17 * 7.468
BOUNDS = {
    "length over beam": (lambda value: sized(160.93 / value, SECTION * value / 160.93), 1.5, 20.0),
    "beam over draught": (lambda value: sized((SECTION * value) ** 0.5, (SECTION / value) ** 0.5), 1.0, 12.0),
    "Froude number": (lambda value: {"model.speed_mps": value * (9.80665 * 160.93) ** 0.5}, 0.03, 0.7),
    "centre of gravity": (lambda value: {"rigid_body.x_G": value}, -0.1, 0.1),
    "radius of gyration": (lambda value: {"rigid_body.yaw_inertia": 798e-5 * value**2}, 0.15, 0.4),
    "added mass ahead": (lambda value: {"derivatives.Xudot": -value * 798e-5}, 0.01, 0.4),
    "metacentric height": (lambda value: {"ship.metacentric_height_m": value * 23.17}, None, 0.5),
    "propeller diameter": (lambda value: {"ship.propeller_diameter_m": value * 7.468}, 0.1, 1.2),
    "block coefficient by mass": (lambda value: {"ship.block_coefficient": 0.597196 / value}, 0.75, 1.33),
    "block coefficient is": (lambda value: {"rigid_body.mass": value / 0.597196 * 798e-5}, 0.2, 1.0),
}
"""Size: the Mariner with a proportion, by hand, and the bounds that ships are within."""


@pytest.mark.parametrize("name", BOUNDS)
def test_a_proportion_is_doubted_just_beyond_its_bounds_and_not_just_within(name: str) -> None:
    changed, low, high = BOUNDS[name]
    for bound, out in ((low, -1), (high, 1)):
        if bound is None:
            continue
        for sign, doubted in ((out, True), (-out, False)):
            at = bound + sign * 0.01 * abs(bound)
            changes = {"rigid_body.yaw_inertia": 0.25**2 * 798e-5, "rigid_body.x_G": 0.0, **changed(at)}
            if "rigid_body.mass" in changes:
                changes["rigid_body.yaw_inertia"] = 0.25**2 * changes["rigid_body.mass"]
            (text,) = doubts(read_card("mariner", changes)) or ("",)
            assert (name in text) == doubted, (at, text)


@pytest.mark.parametrize(
    ("name", "unit", "low", "high"),
    [
        ("Yvdot", 798e-5, 0.5, 1.6),
        ("Nrdot", 39.2e-5, 0.25, 2.0),
        ("Nr", 3.14159265 * (7.468 / 160.93) ** 2, 0.05, 1.0),
        ("Y_v'", 3.14159265 * (7.468 / 160.93) ** 2, 0.5, 6.0),
    ],
)
def test_a_derivative_is_doubted_beyond_the_sizes_of_hulls_by_more_than_two_of_its_errors(
    name, unit, low, high
) -> None:
    key = "Yv" if name == "Y_v'" else name
    error = 0.02 * unit
    for bound, out in ((low, -1), (high, 1)):
        for errors, doubted in ((2.2, True), (1.8, False)):
            value = -(bound * unit + out * errors * error)
            value += 798e-5 * 0.023 * (key == "Nr")  # her N_r has -m' x_G' in it
            card = read_card("mariner", {f"derivatives.{key}": value, f"uncertainty.{key}": error})
            (text,) = doubts(card) or ("",)
            assert (f"{name} is" in text or f"{name} over" in text) == doubted, text


@pytest.mark.parametrize(("moment", "force", "low", "high"), [("Nv", "Yv", -0.25, 0.75), ("Nd", "Yd", -0.7, -0.2)])
def test_a_lever_is_doubted_beyond_that_of_ships_and_the_room_of_effects(moment, force, low, high) -> None:
    """N_v/Y_v of -0.1 to 0.6 and N_d/Y_d of -0.55 to -0.35, with 0.15 either way, of a ship without errors."""
    hull = read_card("mariner").derivatives
    for bound, out in ((low, -1), (high, 1)):
        for beyond, doubted in ((0.01, True), (-0.01, False)):
            value = (bound + out * beyond) * hull[force]
            if moment == "Nv" and value > 0:
                continue  # the sign is doubted in place of the lever
            value = -value if moment == "Nd" else value  # her file has the rudder positive to port
            exact = {f"uncertainty.{name}": 1e-9 for name in (moment, force)}
            (text,) = doubts(read_card("mariner", {f"derivatives.{moment}": value, **exact})) or ("",)
            assert (f"{moment}/{force} is" in text) == doubted, text


def test_shallow_water_raises_no_doubt_of_added_masses_and_damping_and_deep_water_does() -> None:
    changes = {"derivatives.Yvdot": -2.5 * 798e-5, "uncertainty.Yvdot": 1e-5}
    assert "Yvdot" in doubts(read_card("mariner", changes))[0]
    assert "Yvdot" in doubts(read_card("mariner", {**changes, "ship.water_depth_m": 4.1 * 7.468}))[0]
    assert doubts(read_card("mariner", {**changes, "ship.water_depth_m": 3.9 * 7.468})) == ()


@pytest.mark.parametrize(("depth", "refused"), [(7.468, True), (7.5, False)])
def test_a_ship_is_aground_in_water_as_deep_as_its_draught(depth: float, refused: bool) -> None:
    if refused:
        with pytest.raises(InputError, match="aground"):
            read_card("mariner", {"ship.water_depth_m": depth})
    else:
        read_card("mariner", {"ship.water_depth_m": depth})


@pytest.mark.parametrize(
    ("key", "least"), [("steering_gear.max_angle_deg", 2.0), ("steering_gear.max_rate_degps", 0.2)]
)
def test_a_gear_is_one_from_two_degrees_and_a_fifth_of_a_degree_a_second(key: str, least: float) -> None:
    read_card("mariner", {key: 1.01 * least})
    with pytest.raises(InputError):
        read_card("mariner", {key: 0.99 * least})


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
def test_what_no_known_ship_has_is_a_caution_of_the_model(ship: str, changes: dict[str, object], word: str) -> None:
    card = read_card(ship, changes)
    (doubt,) = doubts(card)
    assert doubt.leads and word in doubt
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
    (doubt,) = [caution for caution in found.cautions if "wrong way" in caution]
    assert repr(found).startswith(doubt.line)
    assert {"level": "caution", "text": doubt} in json.loads(found.to_json())["notices"]
    assert "CHECK: " in found.page()
