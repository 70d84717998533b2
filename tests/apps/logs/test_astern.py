"""Headings against the course: a vessel that goes astern throughout, or a compass that is mounted back to front."""

from __future__ import annotations

import functools

import numpy as np
import pandas as pd
import pytest

from tank2sim.apps.logs.command import log
from tests.apps.logs.made_logs import craft, frame, motion, texts, used


@functools.cache
def opposed() -> pd.DataFrame:
    """The voyage with a heading against its course and nothing that shows which way the vessel goes."""
    made = frame().drop(columns=["shaft_rpm", "rudder_deg", "rot_deg_min"])
    return made.assign(heading_deg=(made.heading_deg + 180) % 360)


# What shows the way of a vessel, as it is recorded when the vessel goes ahead
SHOWN = {
    "shaft_rpm": lambda: frame().shaft_rpm,
    "stw_kn": lambda: frame().sog_kn,
    "rudder (starboard +) deg": lambda: frame().rudder_deg,
}


def channel(found, quantity: str):
    return next(each for each in found.voyage.channels.channels if each.quantity == quantity)


@pytest.mark.parametrize("shown", SHOWN)
def test_a_vessel_that_goes_astern_throughout_keeps_its_heading(saved, shown) -> None:
    """Reversed revolutions, a negative speed ahead, or a rudder to which the bow turns the other way."""
    found = log(saved(opposed().assign(**{shown: -SHOWN[shown]()}), "astern.csv"))
    assert used(found)["heading"] == "heading_deg"
    assert channel(found, "heading").confidence >= 0.9
    said = texts(found.voyage, "note")
    assert "astern" in said and shown in said
    assert shown in used(found).values()
    assert all(each.sign == 1 for each in found.voyage.channels.channels if each.use)


@pytest.mark.parametrize("shown", SHOWN)
def test_a_compass_back_to_front_is_refused_where_the_vessel_goes_ahead(saved, shown) -> None:
    found = log(saved(opposed().assign(**{shown: SHOWN[shown]()}), "mounted.csv"))
    assert "heading" not in used(found)
    said = texts(found.voyage, "fault")
    assert "back to front" in said and "astern" in said and shown in said


@pytest.mark.parametrize("columns", [{}, {"rudder_deg": -frame().rudder_deg}], ids=["nothing", "rudder"])
def test_a_heading_against_the_course_that_nothing_explains_is_to_be_confirmed(saved, columns) -> None:
    """Nothing that shows the way, or a rudder whose sign is not stated."""
    found = log(saved(opposed().assign(**columns), "unknown.csv"))
    assert used(found)["heading"] == "heading_deg"
    assert 0.7 <= channel(found, "heading").confidence < 0.9
    said = texts(found.voyage, "fault")
    assert "back to front" in said and "astern" in said


def test_no_leg_of_a_vessel_that_goes_astern_is_a_stop(saved) -> None:
    made = opposed().assign(shaft_rpm=-frame().shaft_rpm, rudder_deg=-frame().rudder_deg)
    kinds = {stretch.kind.value for stretch in log(saved(made, "legs.csv")).found}
    assert "astern" in kinds and "stop" not in kinds


def test_a_second_heading_that_follows_the_course_shows_that_the_first_is_back_to_front(saved) -> None:
    made = opposed().assign(gyro_heading_deg=frame().heading_deg, rudder_deg=frame().rudder_deg)
    found = log(saved(made, "two.csv"))
    assert used(found)["heading"] == "gyro_heading_deg"
    assert used(found)["rudder_angle"] == "rudder_deg"
    assert all(each.sign == 1 for each in found.voyage.channels.channels if each.use)
    assert "gyro_heading_deg follows it" in texts(found.voyage, "fault")


def test_revolutions_ahead_outweigh_a_rudder_whose_sign_is_not_stated(saved) -> None:
    made = opposed().assign(shaft_rpm=frame().shaft_rpm, rudder_deg=-frame().rudder_deg)
    assert "heading" not in used(log(saved(made, "port.csv")))


def test_a_heading_against_a_straight_course_needs_revolutions_to_be_one(saved) -> None:
    """On one course, turn rates show nothing."""
    straight = opposed().iloc[:200]
    assert "heading" not in used(log(saved(straight, "leg.csv")))
    found = log(saved(straight.assign(shaft_rpm=-frame().shaft_rpm[:200]), "back.csv"))
    assert used(found)["heading"] == "heading_deg"


def test_a_mirrored_heading_stays_refused_though_the_revolutions_are_astern(saved) -> None:
    made = opposed().assign(heading_deg=lambda t: -t.heading_deg % 360, shaft_rpm=-frame().shaft_rpm)
    assert "heading" not in used(log(saved(made, "mirrored.csv")))


def test_a_craft_that_backs_most_of_the_time_keeps_its_heading_and_its_thrusters(saved) -> None:
    made = craft()
    astern = {**made, "port": -made["starboard"], "starboard": -made["port"]}
    backwards = {**astern, "psi": astern["psi"] + np.pi}
    orders = {"thrust_port": backwards["port"], "thrust_starboard": backwards["starboard"]}
    found = log(saved(motion(backwards).assign(**orders), "backing.csv"))
    assert used(found)["heading"] == "heading_deg"
    assert used(found)["thrust_order_port"] == "thrust_port"
    assert used(found)["thrust_order_starboard"] == "thrust_starboard"
    assert {"astern", "stop", "steps"} & {stretch.kind.value for stretch in found.found}
