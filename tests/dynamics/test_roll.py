"""A ship that rolls is that of Son and Nomoto's equations: at a known state, along runs made elsewhere, by symmetry."""

from __future__ import annotations

import csv
import math
import shutil
import subprocess
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import tank2sim as t2s
from tank2sim.bundled import bundled_cards
from tank2sim.cards import parse_card
from tank2sim.cards.card import ManoeuvringCard
from tank2sim.cards.form import EffectEntry
from tank2sim.dynamics import build
from tank2sim.dynamics.roll import natural_period_s, roll_fault
from tank2sim.dynamics.simulator_interface import with_external_forces
from tank2sim.errors import InputError
from tank2sim.simulation.manoeuvres import Manoeuvre, Orders, Turn, Zigzag
from tank2sim.simulation.run import simulate
from tests.dynamics.states import rates, replaced

TEXT = bundled_cards()["container"].read_text(encoding="utf-8")
RPM = 2 * math.pi / 60


def rolling_card(*pairs: tuple[str, str]) -> ManoeuvringCard:
    """The container ship's card with parts of its text replaced."""
    card = parse_card(replaced(TEXT, *pairs), "rolling.toml")
    assert isinstance(card, ManoeuvringCard)
    return card


def moving(**state: float) -> dict[str, float]:
    return {"rudder.angle" if name == "delta" else f"motion.{name}": value for name, value in state.items()}


def test_accelerations_are_those_of_the_published_program() -> None:
    """container.m of MSS at one state, to the ten digits that its check values have."""
    motion = moving(u=8.0, v=0.5, r=0.01, psi=0.3, p=0.002, phi=0.05, delta=0.1)
    orders = {"rudder.command": 0.15, "propeller.speed": 75 * RPM}
    found = rates(build(rolling_card()), motion | orders)
    expected = {
        "motion.u": 0.004913203437,
        "motion.v": -0.05946638388,
        "motion.r": -0.001511921367,
        "motion.p": -0.003960333182,
        "motion.x": 7.495116471,
        "motion.y": 2.841232937,
        "motion.psi": 0.009987502604,
        "motion.phi": 0.002,
        "rudder.angle": 0.05,
    }
    assert found == pytest.approx(expected, rel=1e-9)


def reference_columns(data: Path, name: str) -> dict[str, np.ndarray]:
    lines = (data / "reference" / f"container_{name}.csv").read_text().splitlines()
    rows = list(csv.DictReader(line for line in lines if not line.startswith("#")))
    return {key: np.array([float(row[key]) for row in rows]) for key in rows[0]}


def speeding_up() -> Orders:
    """10 deg of rudder, while the shaft goes from 70 to 80 rpm: dn/dt = n (80 rpm - n)/5.65, in closed form."""
    step, final, first = 0.05, 80 / 60, 70 / 60
    t = np.arange(0, 700, step)
    middle = t + step / 2
    n = final / (1 + (final / first - 1) * np.exp(-final * middle / 5.65))
    return Orders(t, {"rudder.command": np.full_like(t, math.radians(10)), "propeller.speed": 2 * math.pi * n}, "n")


RUNS: dict[str, Manoeuvre] = {
    "turn_10_stbd": speeding_up(),
    "turn_35_stbd": Turn(math.radians(35)),
    "turn_35_port": Turn(-math.radians(35)),
    "zigzag_10_10": Zigzag(math.radians(10), math.radians(10)),
    "zigzag_20_20": Zigzag(math.radians(20), math.radians(20)),
}


@pytest.mark.parametrize("name", RUNS)
def test_runs_of_the_container_ship_are_those_of_an_integration_elsewhere(data: Path, name: str) -> None:
    columns = reference_columns(data, name)
    inputs = {} if name == "turn_10_stbd" else {"propeller.speed": 80 * RPM}
    parameters = {"initial.u": 8.0, "initial.trim": 0.0}
    run = simulate(build(rolling_card()), RUNS[name], duration_s=600, inputs=inputs, parameters=parameters).trajectory
    t = columns["t_s"][columns["t_s"] <= 600]
    assert t[-1] > 590
    scales = {"phi": 0.01, "psi": 0.01, "r": 0.001, "x": 0.1, "y": 0.1, "u": 1e-3, "v": 1e-3}
    for state, largest in scales.items():
        unit = {"phi": "deg", "psi": "deg", "r": "degps", "x": "m", "y": "m", "u": "mps", "v": "mps"}[state]
        found = np.array([run.at(f"motion.{state}", time) for time in t])
        found = np.degrees(found) if unit.startswith("deg") else found
        assert np.abs(found - columns[f"{state}_{unit}"][: len(t)]).max() < largest, state


def test_heel_in_a_turn_is_inwards_first_and_then_outwards() -> None:
    run = t2s.load("container").turn(10)
    heel = run.df.phi_deg.to_numpy()
    assert heel[: heel.argmin()].max() > 0.2 and heel.min() == pytest.approx(-6.7, abs=0.3)
    assert run.figures["largest_heel_deg"] == pytest.approx(heel.min(), abs=1e-6)


def test_mirrored_orders_give_the_mirrored_motion() -> None:
    starboard, port = (t2s.load("container").zigzag(side * 10, 10).df for side in (1, -1))
    for name in ("phi_deg", "v_mps", "r_degps", "y_m"):
        assert starboard[name].to_numpy() == pytest.approx(-port[name].to_numpy(), abs=1e-9)
    assert starboard.u_mps.to_numpy() == pytest.approx(port.u_mps.to_numpy(), abs=1e-12)


def test_a_ship_at_rest_rolls_with_its_natural_period() -> None:
    """2 pi sqrt((I_x + J_x)/(rho g nabla GM)) = 33 s for GM = 0.3 m; without sway coupling and damping."""
    card = rolling_card(("Ypdot = 0.0002206337", "Ypdot = 0.0"), ("Kvdot = 0.0002206337", "Kvdot = 0.0"))
    scale = 0.5 * 1025 * 175**5
    period = 2 * math.pi * math.sqrt(2.1e-5 * scale / (1025 * 9.81 * 21222 * 0.3))
    assert natural_period_s(card) == pytest.approx(period, rel=1e-9) and period == pytest.approx(33.0, abs=0.5)
    begins = {"initial.u": 0.0, "initial.phi": 0.1, "initial.trim": 0.0}
    orders = Orders(np.array([0.0]), {"rudder.command": np.array([0.0])}, "rest")
    run = simulate(build(card), orders, duration_s=40, inputs={"propeller.speed": 0.0}, parameters=begins).trajectory
    down = run.crossings("motion.phi", "motion.p", 0.0)
    assert down[0] == pytest.approx(period / 4, rel=1e-3) and down[1] == pytest.approx(0.75 * period, rel=1e-3)


def test_a_centre_of_gravity_below_the_origin_couples_as_a_pendulum() -> None:
    """Rigid body with z_G alone, by hand: m (v' - z_G p') = Y, I_x p' - m z_G (v' + u r) = K - W GM phi."""
    model = build(rolling_card(("roll_inertia = 0.0000176", "roll_inertia = 0.0000176\nz_G = 0.01")))
    p = dict(zip(model.parameter_names, model.parameter_values().tolist(), strict=True))
    at = moving(u=8.0, v=0.3, r=0.008, p=0.003, phi=0.04, delta=0.05)
    at |= {"propeller.speed": 80 * RPM, "rudder.command": 0.05}
    found, plain = rates(model, at), rates(build(rolling_card()), at)
    m, z, scale = p["ship.mass"], 0.01 * 175, 0.5 * 1025 * 175**3
    m_x, m_y, l_y, a_y = 0.000238 * scale, 0.007049 * scale, 0.0313 * 175, 0.05 * 175
    Ix, Iz = 2.1e-5 * scale * 175**2, 8.75e-4 * scale * 175**2
    # Forces from the ship without z_G, put through the mass matrix with it.
    vdot, pdot, rdot = (plain[f"motion.{name}"] for name in "vpr")
    Y = (m + m_y) * vdot - m_y * l_y * pdot + m_y * a_y * rdot
    K = Ix * pdot - m_y * l_y * vdot + m * z * 8.0 * 0.008
    N = Iz * rdot + m_y * a_y * vdot
    vdot, pdot, rdot = (found[f"motion.{name}"] for name in "vpr")
    left = (m + m_y) * vdot - (m_y * l_y + m * z) * pdot + m_y * a_y * rdot
    assert left == pytest.approx(Y, rel=1e-9)
    assert Ix * pdot - (m_y * l_y + m * z) * vdot == pytest.approx(K, rel=1e-9)
    assert Iz * rdot + m_y * a_y * vdot == pytest.approx(N, rel=1e-9)
    surge = (plain["motion.u"] - found["motion.u"]) * (m + m_x)
    assert surge == pytest.approx(m * z * 0.003 * 0.008, rel=1e-6)


@pytest.mark.parametrize(
    ("old", "new", "key"),
    [
        ("metacentric_height_m = 0.3\n", "", "ship.metacentric_height_m"),
        ("metacentric_height_m = 0.3", "metacentric_height_m = -0.1", "ship.metacentric_height_m"),
        ("Kp = -0.0000075\n", "", "derivatives.Kp"),
        ("[roll]\nroll_inertia = 0.0000176\nl_x = 0.0313\nz_R = 0.033\n", "", "derivatives.Xphiphi"),
        ("roll_inertia = 0.0000176", "roll_inertia = 0.0", "roll.roll_inertia"),
        ("Kpdot = -0.0000034", "Kpdot = 0.0000176", "roll.roll_inertia"),
        ("z_R = 0.033", "z_R = 5.775", "roll.z_R"),
        ("tau = 1.09", "tau = 1.09\nC_1 = 2.0", "propeller.tau"),
        ("C_Rv = 0.088", "C_Rv = 0.088\nl_R = -0.7", "rudder.C_Rv"),
        ("eta = 0.631", "eta = 1.631", "rudder.eta"),
    ],
)
def test_a_faulty_card_is_refused_in_one_line_with_its_key(old: str, new: str, key: str) -> None:
    with pytest.raises(InputError) as error:
        build(rolling_card((old, new)))
    assert error.value.place == key


@pytest.mark.parametrize(("share", "positive"), [(0.999, True), (1.001, False)])
@pytest.mark.parametrize("pair", [("Ypdot", "Kvdot"), ("Krdot", "Npdot")])
def test_added_masses_that_couple_roll_are_refused_where_the_mass_matrix_is_no_longer_positive(
    pair: tuple[str, str], share: float, positive: bool
) -> None:
    """Sway, roll and yaw: m_y, c; J_x; c, J_z. Coupled to roll by a, a^2 reaches what roll and the other two leave."""
    card = rolling_card()
    body, d, roll = card.rigid_body, card.derivatives, card.roll
    assert roll is not None and roll.z_G == 0
    assert d["Yrdot"] == d["Nvdot"] != 0
    m_y, coupled = body.mass - d["Yvdot"], body.mass * body.x_G - d["Yrdot"]
    J_x, J_z = roll.roll_inertia - d["Kpdot"], body.yaw_inertia - d["Nrdot"]
    own = m_y - coupled**2 / J_z if pair[0] == "Ypdot" else J_z - coupled**2 / m_y
    largest = math.sqrt(own * J_x)
    added = {**d, "Ypdot": 0.0, "Kvdot": 0.0, **dict.fromkeys(pair, share * largest)}
    assert (roll_fault(replace(card, derivatives=added)) == "") == positive
    heavy = replace(card, derivatives={**added, **dict.fromkeys(pair, -share * largest)})
    assert (roll_fault(heavy) == "") == positive


def test_the_effect_of_heel_is_refused_on_a_ship_that_rolls_by_itself() -> None:
    from tank2sim.dynamics.effects import EFFECTS

    card = rolling_card()
    entry = EffectEntry(name="roll_coupling", parameters={"Yphi": 0.001, "Nphi": -0.0005})
    with pytest.raises(InputError, match="roll"):
        build(replace(card, effects=(entry,)))
    assert not EFFECTS["roll_coupling"].tried(card)


def test_every_scaling_of_the_card_is_the_same_ship() -> None:
    ship = t2s.load("container")
    expected = ship.turn(10).figures["tactical_diameter_m"]
    for scaling in ("dimensional", "prime_ii", "bis"):
        made = t2s.convert(ship, to="mmg", scaling=scaling).ship
        assert made.turn(10).figures["tactical_diameter_m"] == pytest.approx(expected, rel=1e-9)
        assert made.turn(10).figures["largest_heel_deg"] == pytest.approx(
            ship.turn(10).figures["largest_heel_deg"], rel=1e-8
        )


@pytest.mark.slow
def test_the_polynomial_of_a_ship_that_rolls_rolls_alike() -> None:
    made = t2s.convert("container", to="abkowitz")
    assert {change.after is None for change in made.made.changes} == {False}
    for manoeuvre in ("turn:10", "zigzag:10/10"):
        first, second = (ship.simulate(manoeuvre).figures for ship in (t2s.load("container"), made.ship))
        assert second["largest_heel_deg"] == pytest.approx(first["largest_heel_deg"], rel=0.05)


@pytest.mark.slow
def test_an_origin_moved_forward_and_back_is_the_same_ship() -> None:
    made = t2s.convert("container", to="abkowitz").ship
    there = t2s.convert(made, origin_m=10.0).ship
    back = t2s.convert(there, origin_m=-10.0).ship
    for name in made.manoeuvring().derivatives:
        expected = made.manoeuvring().derivatives[name]
        assert back.manoeuvring().derivatives[name] == pytest.approx(expected, rel=1e-8, abs=1e-15), name
    assert there.manoeuvring().derivatives["Kr"] != pytest.approx(made.manoeuvring().derivatives["Kr"], rel=1e-3)


def test_shipmmg_has_no_ship_that_rolls() -> None:
    with pytest.raises(InputError, match="roll"):
        t2s.convert("container", to="shipmmg")


@pytest.mark.skipif(shutil.which("octave") is None, reason="needs GNU Octave")
def test_an_mss_function_has_the_rates_of_the_ship_that_rolls(tmp_path: Path) -> None:
    made, model = t2s.convert("container", to="mss"), t2s.load("container").model
    function = made.text.partition("= ")[2].partition("(")[0]
    made.save(tmp_path / f"{function}.m")
    x = [3.0, -2.0, 0.4, 7.0, 0.4, 0.01, 0.1, 0.05, 0.004]
    call = f"[xd, U] = {function}([{' '.join(map(str, x))}]'); printf('%.17g ', xd)"
    command = ["octave", "--no-gui", "-q", "--eval", call]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=True)
    expected = np.array(model.rhs(x, model.input_values(), model.parameter_values())).ravel()
    assert [float(word) for word in done.stdout.split()] == pytest.approx(expected, rel=1e-12)


@pytest.mark.slow
def test_the_fmu_is_the_model_and_shows_heel(tmp_path: Path) -> None:
    import fmpy

    t2s.load("container").to_fmu(tmp_path / "container.fmu", fmi=3)
    assert t2s.check_fmu(tmp_path / "container.fmu").to_dict()["passed"]
    description = fmpy.read_model_description(str(tmp_path / "container.fmu"))
    causality = {variable.name: variable.causality for variable in description.modelVariables}
    assert {causality[name] for name in ("motion.phi", "motion.p", "force.K")} == {"output"}


@pytest.mark.slow
def test_terms_of_roll_are_found_in_trials_that_measured_heel(tmp_path: Path) -> None:
    """Wrong by 10, 10 and 25 %: found within three of the errors that are stated, with the other trial held out."""
    true = {"Yv": -0.0116, "Nr": -0.00222, "Kv": 0.0003026}
    wrong = {"Yv = -0.0116": "Yv = -0.0128", "Nr = -0.00222": "Nr = -0.0020", "Kv = 0.0003026": "Kv = 0.00038"}
    keys = [
        line.split(" =")[0]
        for line in TEXT.partition("[derivatives]")[2].partition("[propeller]")[0].split("\n")
        if line
    ]
    free = {"Yv": 0.001, "Nr": 0.0002, "Kv": 0.0001}
    text = TEXT + "\n[uncertainty]\n" + "".join(f"{key} = {free.get(key, 0.0)}\n" for key in keys)
    text = replaced(text, *wrong.items())
    (tmp_path / "start.toml").write_text(text, encoding="utf-8")
    generator, ship, paths = np.random.default_rng(2), t2s.load("container"), []
    noise = {"u_mps": 0.02, "v_mps": 0.02, "r_degps": 0.01, "psi_deg": 0.1, "x_m": 0.5, "y_m": 0.5, "phi_deg": 0.05}
    for name, run in (("turn", ship.turn(10, duration_s=400.0)), ("zigzag", ship.zigzag(10, 10))):
        frame = run.df.iloc[::10].copy()
        for column, size in noise.items():
            frame[column] += generator.normal(size=len(frame)) * size
        frame.to_csv(tmp_path / f"{name}.csv", index=False)
        paths.append(tmp_path / f"{name}.csv")
    found = t2s.identify(tmp_path / "start.toml", paths[1], holdout=paths[0]).card
    for name, value in true.items():
        assert abs(found.derivatives[name] - value) < 3 * found.uncertainty[name] < free[name], name


def test_an_external_moment_heels_the_ship_as_far_as_its_stability_holds() -> None:
    """At rest K = W GM phi; a force above the origin heels to its side, as its moment does."""
    model = with_external_forces(build(rolling_card()))
    moment = 0.02 * 21752550.0 * 9.81 * 0.3
    upright = {"motion.u": 0.0, "motion.phi": 0.02, "propeller.speed": 0.0}
    assert rates(model, upright | {"external.K": moment})["motion.p"] == pytest.approx(0.0, abs=1e-9)
    by_force = rates(model, upright | {"external.Y": moment / 5, "external.point_z": -5.0})
    pushed = rates(model, upright | {"external.Y": moment / 5, "external.K": moment})
    assert by_force == pytest.approx(pushed, rel=1e-12, abs=1e-15)
    with pytest.raises(InputError, match="rolls"):
        t2s.load("mariner").simulate("turn:10", external={"K": 1e6})


@pytest.mark.slow
def test_a_slow_gear_of_a_ship_that_rolls_is_found_and_nothing_where_nothing_is_missing(tmp_path: Path) -> None:
    generator, paths = np.random.default_rng(4), {}
    noise = {"u_mps": 0.02, "v_mps": 0.02, "r_degps": 0.01, "psi_deg": 0.1, "x_m": 0.5, "y_m": 0.5, "phi_deg": 0.05}
    for kind, rate in (("slow", 1.5), ("right", 5.0)):
        (tmp_path / f"{kind}.toml").write_text(TEXT.replace("max_rate_degps = 5.0", f"max_rate_degps = {rate}"))
        ship, paths[kind] = t2s.load(tmp_path / f"{kind}.toml"), []
        for name, run in (
            ("turn", ship.turn(10, duration_s=300.0)),
            ("zigzag", ship.zigzag(10, 10)),
            ("other", ship.zigzag(-10, 10)),
        ):
            frame = run.df.iloc[::5].drop(columns="delta_deg")
            for column, size in noise.items():
                frame[column] += generator.normal(size=len(frame)) * size
            paths[kind].append(tmp_path / f"{kind}_{name}.csv")
            frame.to_csv(paths[kind][-1], index=False)
    effects = ["rudder_rate_limit", "cross_flow_drag", "wind"]
    found = t2s.find_gap("container", paths["slow"][:2], holdout=paths["slow"][2], effects=effects).to_dict()
    named = {effect["name"]: effect for effect in found["effects"]}  # type: ignore[attr-defined]
    assert set(named) == {"rudder_rate_limit"}
    before, after = (found["misfit"][card]["holdout"] for card in ("before", "after"))  # type: ignore[index]
    assert before > 4 and after < 0.4 * before
    nothing = t2s.find_gap("container", paths["right"][:2], holdout=paths["right"][2], effects=effects).to_dict()
    assert nothing["effects"] == []
