"""Force, moment and sinkage of a ship's model near seven banks: measured, and by the effect ``bank``.

Needs the data folder (Lataire, Vantorre and Eloot 2009: ten steady tests with forces, fifteen with sinkage of an 8000
TEU container ship). Its tables give no length between perpendiculars: 0.945 of the length over all is taken. The bank's
distance is that of a wall with the same mean nearness over the draught; the bare wall of the tank is the other bank. Of
the two tests with drift, the hull's force is added by the regressions of Clarke, Gedling and Hine (1983) and the depth
factors of Kijima et al. (1990).

The form of the equations was chosen with all tests in sight. The two coefficients of a propeller at work are the
medians over the five tests with one; each such test is also calculated with the medians of the other four (``held
out``), and the squat with its two shares fitted without the test. Those of a stopped propeller are fitted to three
tests, and no test is left to check them.

    python benchmarks/bank.py
"""

from __future__ import annotations

import csv
import os
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import casadi as ca
import numpy as np

import tank2sim as t2s
from tank2sim.cards.estimates import Particulars, estimate
from tank2sim.dynamics.effects.banks import SQUAT_BY_BANK, SQUAT_BY_PROPELLER

DATA = Path(os.environ.get("TANK2SIM_DATA", Path(__file__).resolve().parents[1] / ".." / "shared")) / "data"
LENGTH_M, BEAM_M, WALL_M, DENSITY = 0.945 * 4.332, 0.530, 3.5, 1000.0
SELF_PROPULSION = 12.0 / 0.6868
"""Revolutions over speed that about hold it, 1/m: of test E, whose propeller pulls the carriage with 1.4 N."""


@dataclass(frozen=True)
class ComparedTest:
    """A test: force to the bank (N), moment that turns the bow to it (N m), largest sinkage (m), and calculated ones.

    `nearness` is y_B, `revolutions` 1/s; `force` and `moment` have the hull's of drift in them if it is `drifting`.
    """

    name: str
    drifting: bool
    revolutions: float
    nearness: float
    measured_force: float
    measured_moment: float
    measured_sinkage: float
    force: float
    moment: float
    sinkage: float
    scale: float
    plain_sinkage: float


@dataclass(frozen=True)
class Bank:
    """Bank in the tank: its toe (m from the centre line), run per rise, height (m; None: above the water)."""

    toe: float
    slope: float
    height: float | None

    def place(self, rise: np.ndarray) -> np.ndarray:
        """Distance of the bank from the tank's centre line (n,), m, at heights above the bottom (n,), m."""
        inside = rise <= (np.inf if self.height is None else self.height)
        return np.minimum(np.where(inside, self.toe + self.slope * rise, WALL_M), WALL_M)


def banks(folder: Path) -> dict[str, Bank]:
    """Banks by name."""
    with (folder / "banks.csv").open() as file:
        rows = list(csv.DictReader(file))
    return {
        row["bank"]: Bank(
            float(row["y0_toe_m"]), float(row["slope_dy_per_dz"]), float(row["h0_m"]) if row["h0_m"] else None
        )
        for row in rows
    }


def equivalent_distances(bank: Bank, place: float, draught: float, depth: float) -> tuple[float, float]:
    """Distances of walls from the ship's sides, m, that are as near as the bank in the mean, and as the other wall."""
    heights = depth - draught + (np.arange(400) + 0.5) / 400 * draught
    nearness = float(np.mean(1 / (bank.place(heights) - place)))
    return 1 / nearness - BEAM_M / 2, WALL_M + place - BEAM_M / 2


def calculated(
    sizes: tuple[float, float, float], distances: tuple[float, float], speed: float, revolutions: float
) -> np.ndarray:
    """Force to the bank, N, moment, N m, squat, m, and the squat without the shares of bank and propeller, m.

    `sizes` are draught, depth (m) and block coefficient; `distances` those of the bank and of the other wall, m.
    """
    draught, depth, block = sizes
    near, far = distances
    ship = t2s.load("mariner").replace(
        {
            "ship.length_m": LENGTH_M,
            "ship.beam_m": BEAM_M,
            "ship.draught_m": draught,
            "ship.block_coefficient": block,
            "environment.water_density_kgpm3": DENSITY,
            "propulsion": {"nominal_rpm": 84.0, "Xnn": 77e-5},
            "effects": [
                {"name": "finite_depth", "parameters": {"depth_m": depth, "resistance": 0.0}},
                {"name": "bank", "parameters": {"port_distance_m": far, "starboard_distance_m": near}},
            ],
        }
    )
    model = ship.model
    names = ["force.Y", "force.N", "squat.bank"]
    value = ca.Function(
        "value", [model.x, model.u, model.p], [model.expand(ca.vcat([model.symbol(name) for name in names]))]
    )
    parameters = dict(zip(model.parameter_names, model.parameter_values(), strict=True))
    loading = revolutions / speed / SELF_PROPULSION
    order = {"propeller.speed": loading * speed / parameters["ship.speed"] * parameters["propulsion.nominal_speed"]}
    none = {"bank.port_distance": 1e4, "bank.starboard_distance": 1e4}
    x = np.zeros(len(model.states))
    x[model.state_names.index("motion.u")] = speed
    found, without = (
        np.array(value(x, model.input_values(order | walls), model.parameter_values())).ravel() for walls in ({}, none)
    )
    raised = 1 + SQUAT_BY_BANK * abs(near_bank(distances)) + SQUAT_BY_PROPELLER * (revolutions > 0)
    return np.array([*(found - without)[:2], found[2], found[2] / raised])


def near_bank(distances: tuple[float, float]) -> float:
    """y_B of walls at these distances from the sides."""
    return BEAM_M / 2 * (1 / (distances[0] + BEAM_M / 2) - 1 / (distances[1] + BEAM_M / 2))


def drift_force(draught: float, depth: float, block: float, velocity: tuple[float, float]) -> np.ndarray:
    """Force to starboard, N, and moment, N m, of a hull that moves with u and v, m/s, in water of this depth."""
    u, v = velocity
    particulars = Particulars(
        length_m=LENGTH_M, beam_m=BEAM_M, draught_m=draught, density_kgpm3=DENSITY, block_coefficient=block
    )
    deep = estimate(particulars, ["Yv", "Nv"])
    ship = t2s.load("mariner").replace(
        {
            "ship.length_m": LENGTH_M,
            "ship.beam_m": BEAM_M,
            "ship.draught_m": draught,
            "ship.block_coefficient": block,
            "effects": [{"name": "water_depth", "parameters": {"depth_m": depth}}],
        }
    )
    bare = ship.replace({"effects": []})
    ratios = [slope(ship.model, name) / slope(bare.model, name) for name in ("force.Y", "force.N")]
    scale = 0.5 * DENSITY * LENGTH_M**2 * np.hypot(u, v) * v
    return np.array([deep["Yv"].value * scale * ratios[0], deep["Nv"].value * scale * LENGTH_M * ratios[1]])


def slope(model, name: str) -> float:
    """Derivative of a force by v at the speed of the card."""
    gradient = ca.Function(
        "gradient", [model.x, model.u, model.p], [ca.jacobian(model.expand(model.symbol(name)), model.x)]
    )
    x = np.zeros(len(model.states))
    x[model.state_names.index("motion.u")] = model.parameter_values()[model.parameter_names.index("ship.speed")]
    row = np.array(gradient(x, model.input_values(), model.parameter_values())).ravel()
    return float(row[model.state_names.index("motion.v")])


def compared_tests(folder: Path) -> list[ComparedTest]:
    """The ten tests with forces, mirrored where the bank is to port."""
    with (folder / "subset2_forces.csv").open() as file:
        rows = list(csv.DictReader(file))
    known, found = banks(folder), []
    for row in rows:
        value = {key: float(text) for key, text in row.items() if key not in ("test", "test_code", "bank", "bank_type")}
        side = -1.0 if value["psi_deg"] == 180.0 else 1.0
        draught, depth, speed = value["draught_m"], value["water_depth_m"], value["u_mps"]
        sizes = draught, depth, 0.66 if draught > 0.17 else 0.65
        distances = equivalent_distances(known[row["bank"]], value["y0_m"], draught, depth)
        revolutions = max(value["n_rpm"], 0.0) / 60
        force, moment, sinkage, plain = calculated(sizes, distances, speed, revolutions)
        drifting = value["v_mps"] != 0
        if drifting:
            hull = drift_force(*sizes, (speed, value["v_mps"]))
            force, moment = force + hull[0], moment + hull[1]
        found.append(
            ComparedTest(
                name=row["test"],
                drifting=drifting,
                revolutions=revolutions,
                nearness=near_bank(distances),
                measured_force=side * value["Y_N"],
                measured_moment=side * value["N_Nm"],
                measured_sinkage=1e-3 * max(value["sinkage_fore_mm"], value["sinkage_aft_mm"]),
                force=force,
                moment=moment,
                sinkage=sinkage,
                scale=0.5 * DENSITY * LENGTH_M * draught * speed**2 * near_bank(distances),
                plain_sinkage=plain,
            )
        )
    return found


def compared_squats(folder: Path) -> list[tuple[str, float, float, float, float]]:
    """Of the tests of squat: name, measured and calculated sinkage (m), y_B, calculated without its share (m)."""
    bank, found = banks(folder)["V"], []
    with (folder / "subset1_squat.csv").open() as file:
        for row in csv.DictReader(file):
            distances = equivalent_distances(bank, float(row["y0_m"]), 0.180, 0.243)
            sinkage, plain = calculated((0.180, 0.243, 0.66), distances, float(row["u_mps"]), 0.0)[2:]
            measured = 1e-3 * max(float(row["sinkage_fore_mm"]), float(row["sinkage_aft_mm"]))
            found.append((f"{row['u_mps']} m/s, {row['y0_m']} m", measured, sinkage, near_bank(distances), plain))
    return found


def held_out(values: Sequence[float]) -> np.ndarray:
    """Median of all others (n,), for each of n values."""
    return np.array([np.median(np.delete(values, place)) for place in range(len(values))])


def shares(nearness: np.ndarray, working: np.ndarray, ratio: np.ndarray) -> np.ndarray:
    """Shares (2,) of y_B and of a propeller at work in calculated over measured sinkage, least squares."""
    rows = np.column_stack([nearness, working]) * ratio[:, None]
    return np.asarray(np.linalg.lstsq(rows, 1 - ratio, rcond=None)[0])


def main() -> None:
    """Print every test."""
    folder = DATA / "bank_effects"
    if not folder.is_dir():
        sys.exit(f"needs {folder} (set TANK2SIM_DATA)")
    tests, squats = compared_tests(folder), compared_squats(folder)
    working = [test for test in tests if test.revolutions > 0 and not test.drifting]
    sway = [test.measured_force / test.scale for test in working]
    yaw = [-test.measured_moment / test.scale / LENGTH_M for test in working]
    print(f"propeller at work: c_Y {np.median(sway):.3f} (each {np.round(sway, 3)}), c_N {np.median(yaw):.3f}")
    others = dict(zip([test.name for test in working], zip(held_out(sway), held_out(yaw), strict=True), strict=True))
    for test in tests:
        kind = "drift" if test.drifting else "propeller at work" if test.name in others else "propeller stopped"
        line = (
            f"{test.name} {kind:17s} y_B {test.nearness:.3f}: Y {test.measured_force:+.2f} N, calculated "
            f"{test.force:+.2f}; N {test.measured_moment:+.2f} N m, calculated {test.moment:+.2f}"
        )
        if test.name in others:
            force, moment = others[test.name]
            line += f"; held out Y {force * test.scale:+.2f}, N {-moment * test.scale * LENGTH_M:+.2f}"
        print(line)
    rows = [
        (test.measured_sinkage, test.sinkage, test.nearness, test.plain_sinkage, test.revolutions) for test in tests
    ]
    rows += [(measured, sinkage, nearness, plain, 0.0) for _, measured, sinkage, nearness, plain in squats]
    measured, sinkage, nearness, plain, revolutions = np.array(rows).T
    nearness, at_work = np.abs(nearness), (revolutions > 0).astype(float)
    found = shares(nearness, at_work, plain / measured)
    print(f"squat: shares of bank and propeller {found[0]:.2f}, {found[1]:.2f}")
    without = []
    for place in range(len(measured)):
        left = np.arange(len(measured)) != place
        bank, propeller = shares(nearness[left], at_work[left], (plain / measured)[left])
        without.append(plain[place] * (1 + bank * nearness[place] + propeller * at_work[place]))
    names = [*(test.name for test in tests), *(squat[0] for squat in squats)]
    for name, *sinkages in zip(names, measured, sinkage, without, strict=True):
        print("  {}: {:.1f} mm, calculated {:.1f}, held out {:.1f}".format(name, *(1e3 * one for one in sinkages)))
    for label, values in (("calculated", sinkage), ("held out", np.array(without)), ("ICORELS alone", plain)):
        errors = np.abs(values / measured - 1)
        within, rms = np.sum(errors <= 0.2), np.sqrt(np.mean(errors**2))
        print(f"{label}: {within} of {len(errors)} sinkages within 20 %, rms {rms:.0%}")


if __name__ == "__main__":
    main()
