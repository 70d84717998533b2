"""Water of finite depth: against the formulas by hand, measured sinkage, and what a pilot sees."""

from __future__ import annotations

import csv
import math
from pathlib import Path

import numpy as np
import pytest

from tank2sim.cards import read_card
from tank2sim.dynamics.model import Model
from tank2sim.simulation.integrator import Integrator
from tank2sim.simulation.running import Running

from .ships import CB, N0, RHO, STATES, U0, B, G, L, T, forces, mariner_text, ship, state, values

DEEP = {"depth_m": 5000.0}
SHOWN = ["squat.barrass", "squat.icorels", "water.under_keel_clearance", "validity"]


@pytest.mark.parametrize("depth", [9.0, 12.0, 20.0])
@pytest.mark.parametrize("u", [3.0, 6.0, 7.7, -2.0])
def test_resistance_is_that_at_the_speed_of_the_same_power_in_deep_water(depth: float, u: float) -> None:
    """Lackenby's loss of speed (ITTC 7.5-04-01-01.1) and a resistance of 77e-5 1/2 rho L^2 u^2."""
    loss = 0.1242 * max(0.98 * B * T / depth**2 - 0.05, 0) + 1 - math.sqrt(math.tanh(G * depth / u**2))
    resistance = [77e-5 * 0.5 * RHO * L**2 * speed**2 for speed in (abs(u) / (1 - loss), abs(u))]
    at = state(u, 0.0, 0.0)
    X = (
        forces(ship({"finite_depth": {"depth_m": depth}}), at)[0]
        - forces(ship({"water_depth": {"depth_m": depth}}), at)[0]
    )
    assert pytest.approx(-math.copysign(resistance[0] - resistance[1], u), rel=1e-5) == X
    assert X * u < 0


def test_the_resistance_of_an_mmg_card_is_its_own() -> None:
    """KVLCC2: R_0' = 0.0141 of 1/2 rho L d U^2."""
    text = Path(read_card("kvlcc2-mmg").source).read_text()
    X = [forces(build_with(text, name), {"motion.u": 5.0})[0] for name in ("finite_depth", "water_depth")]
    loss = 0.1242 * (0.98 * 58.0 * 20.8 / 25.0**2 - 0.05) + 1 - math.sqrt(math.tanh(G * 25.0 / 25.0))
    resistance = 0.0141 * 0.5 * RHO * 320.0 * 20.8 * 5.0**2
    assert X[0] - X[1] == pytest.approx(-resistance * (1 / (1 - loss) ** 2 - 1), rel=1e-5)


def build_with(text: str, name: str) -> Model:
    return ship({name: {"depth_m": 25.0}}, text)


def test_squat_and_clearance_are_the_published_formulas() -> None:
    found = values(ship({"finite_depth": {"depth_m": 12.0}}), SHOWN, state(6.0, 0.0, 0.0))
    barrass = CB * (6.0 / 0.514444444444) ** 2 / 100
    froude = 6.0 / math.sqrt(G * 12.0)
    icorels = 2.4 * CB * L * B * T / L**2 * froude**2 / math.sqrt(1 - froude**2)
    np.testing.assert_allclose(found, [barrass, icorels, 12.0 - T - max(barrass, icorels), 1.0], rtol=1e-6)
    assert 0.5 < icorels < barrass < 1.0


def test_in_deep_water_nothing_changes_but_the_outputs() -> None:
    for at in STATES:
        np.testing.assert_allclose(forces(ship({"finite_depth": DEEP}), at), forces(ship(), at), rtol=2e-3)


def test_a_ship_is_slower_in_shallow_water_and_derivatives_are_those_of_water_depth() -> None:
    shallow = {"depth_m": 1.2 * T}
    reached = {}
    for name, given in (("finite_depth", shallow), ("water_depth", shallow)):
        running = Running(Integrator(ship({name: given})), {"propeller.speed": 0.6 * N0}, {"initial.u": 0.6 * U0})
        running.run(1500.0)
        reached[name] = running.state("motion.u")
    assert 0.75 < reached["finite_depth"] / reached["water_depth"] < 0.98
    at = STATES[0]
    pair = [forces(ship({name: {**shallow}}), at)[1:] for name in ("finite_depth", "water_depth")]
    np.testing.assert_allclose(*pair, rtol=1e-12)


def test_grounding_takes_all_validity_and_a_fast_ship_grounds_where_a_slow_one_floats() -> None:
    model = ship({"finite_depth": {"depth_m": 1.10 * T}}, mariner_text(valid_speed_mps="valid_speed_mps = [2.0, 9.3]"))
    slow, fast = (values(model, SHOWN, state(u, 0.0, 0.0)) for u in (2.2, 7.5))
    assert slow[2] > 0 and slow[3] > 0.9
    assert fast[2] < 0 and fast[3] == 0.0
    factor = values(model, ["validity_by.under_keel_clearance"], state(7.5, 0.0, 0.0))
    assert factor == [0.0]


def test_icorels_is_near_the_sinkage_that_was_measured_in_mid_tank_and_barrass_above_it(data: Path) -> None:
    """8000 TEU container ship, draught 0.180 m, depth 0.243 m (Lataire, Vantorre and Eloot 2009), in mid-tank."""
    with (data / "data" / "bank_effects" / "subset1_squat.csv").open() as file:
        rows = [row for row in csv.DictReader(file) if float(row["y0_m"]) == 0.0]
    size = {
        "length_m": 4.1, "beam_m": 0.530, "draught_m": 0.180, "speed_mps": 0.6, "block_coefficient": 0.66,
        "projected_area_front_m2": 0.1, "projected_area_side_m2": 0.5,
    }  # fmt: skip
    text = mariner_text(valid_speed_mps="", **{key: f"{key} = {value}" for key, value in size.items()})
    model = ship({"finite_depth": {"depth_m": 0.243}}, text)
    assert len(rows) == 4
    for row in rows[:3]:  # the fourth is at the critical speed of the tank
        measured = 1e-3 * max(float(row["sinkage_fore_mm"]), float(row["sinkage_aft_mm"]))
        barrass, icorels, *_ = values(model, SHOWN, state(float(row["u_mps"]), 0.0, 0.0))
        assert icorels == pytest.approx(measured, rel=0.25)
        assert barrass > measured
