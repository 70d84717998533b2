"""Outputs for displays and hosts, against angles and forces by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tank2sim.cards import read_card
from tank2sim.dynamics import build
from tank2sim.dynamics.simulator_interface import with_simulator_interface

from .effects.ships import TYPICAL, added_forces, ship, state, values


@pytest.mark.parametrize(
    ("psi_deg", "heading_deg"), [(0, 0), (359, 359), (361, 1), (-1, 359), (-725, 355), (1000, 280)]
)
def test_the_heading_is_within_a_turn(psi_deg: float, heading_deg: float) -> None:
    found = values(with_simulator_interface(ship()), ["motion.heading"], {"motion.psi": math.radians(psi_deg)})
    assert np.degrees(found) == pytest.approx([heading_deg], abs=1e-9)


@pytest.mark.parametrize("name", ["wind", "wind_field"])
@pytest.mark.parametrize("heading_deg", [0.0, 70.0, 200.0])
def test_the_relative_wind_is_what_an_anemometer_shows(name: str, heading_deg: float) -> None:
    """With complex numbers: over the ground, and from where it comes."""
    model = with_simulator_interface(ship({name: {"speed_mps": 10.0, "direction_deg": 40.0}}))
    psi = math.radians(heading_deg)
    at = {**state(6.0, 0.8, 0.0), "motion.psi": psi}
    air = -10.0 * np.exp(1j * math.radians(40.0)) - (6.0 + 0.8j) * np.exp(1j * psi)
    expected = [abs(air), (np.angle(-air) - psi) % (2 * np.pi)]
    np.testing.assert_allclose(
        values(model, ["wind.relative_speed", "wind.relative_direction"], at), expected, rtol=1e-9
    )


def test_forces_by_origin_are_those_that_each_effect_adds() -> None:
    names = ("wind", "bow_tunnel_thruster", "tugs", "current", "linear_yaw_damping")
    model = with_simulator_interface(ship({name: TYPICAL[name] for name in names}))
    at = {**state(3.0, 0.3, 0.01, 0.2), "motion.psi": 0.3}
    alone = {name: added_forces(name, TYPICAL[name], at) for name in ("bow_tunnel_thruster", "tugs")}
    for name, expected in alone.items():
        shown = [f"{name}.{letter}" for letter in "XYN" if f"{name}.{letter}" in model]
        found = dict(zip(shown, values(model, shown, at), strict=True))
        np.testing.assert_allclose(
            [found.get(f"{name}.{letter}", 0.0) for letter in "XYN"], expected, rtol=1e-6, atol=1e-3
        )
    assert {"wind.X", "wind.Y", "wind.N", "bow_tunnel_thruster.Y", "rudder.N", "motion.heading"} <= set(model.outputs)
    assert not any(name.startswith(("current.X", "linear_yaw_damping.")) for name in model.outputs)


def test_the_parts_of_an_mmg_ship_are_shown_and_a_body_without_forces_is_left_alone() -> None:
    shown = with_simulator_interface(build(read_card("kvlcc2-l7-mmg"))).outputs
    assert {"rudder.X", "rudder.Y", "rudder.N", "propeller.X"} <= set(shown)
    rig = build(read_card("alyshev"))
    assert with_simulator_interface(rig) is rig
