"""Cards in other languages are the same ship: by formulas, by other programs, and by the equations themselves."""

from __future__ import annotations

import math
import shutil
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import tank2sim as t2s
from tank2sim.apps.programs.conventions import shift_matrix
from tank2sim.apps.programs.polynomial_fit import fit_polynomial
from tank2sim.apps.programs.program_code import program_name
from tank2sim.bundled import bundled_cards
from tank2sim.cards import parse_card, read_card
from tank2sim.cards.card import ManoeuvringCard, MmgCard
from tank2sim.dynamics import build
from tank2sim.errors import InputError
from tests.marks import first_fast

TEXT = bundled_cards()["kvlcc2-l7-mmg"].read_text(encoding="utf-8")
ALIKE = TEXT.replace("gamma_R_minus = 0.395", "gamma_R_minus = 0.640").replace("C_2_minus = 1.1", "C_2_minus = 1.6")


def mmg_ship(text: str) -> t2s.Ship:
    return t2s.Ship(parse_card(text, "ship.toml"))


def polynomial(name: str) -> ManoeuvringCard:
    card = read_card(name)
    assert isinstance(card, ManoeuvringCard)
    return card


# -- conventions ---------------------------------------------------------------------------------------------------


def test_moving_the_origin_follows_the_formulas() -> None:
    """v_O = v_P - a r, N_P = N_O - a Y, term by term as printed for a third-order polynomial."""
    old = {"Yv": -1.1, "Yr": 0.3, "Nv": -0.2, "Nr": -0.15, "Yvvv": -1.7, "Yvvr": 0.4, "Yvrr": -0.5, "Yrrr": 0.1}
    old |= {"Nd": -0.13, "Yd": 0.28, "Yvdot": -0.7, "Yrdot": -0.01, "Nvdot": 0.02, "Nrdot": -0.04}
    old |= {"Xvv": -0.04, "Xvr": 0.8, "Xrr": 0.02, "Xu": -0.2}
    a = 0.07
    names, matrix = shift_matrix(tuple(old), a)
    new = dict(zip(names, matrix @ list(old.values()), strict=True))
    Y, N = {name[1:]: value for name, value in old.items() if name[0] == "Y"}, old
    assert new["Yv"] == pytest.approx(Y["v"])
    assert new["Yr"] == pytest.approx(Y["r"] - a * Y["v"])
    assert new["Nv"] == pytest.approx(N["Nv"] - a * Y["v"])
    assert new["Nr"] == pytest.approx(N["Nr"] - a * (N["Nv"] + Y["r"]) + a**2 * Y["v"])
    assert new["Nd"] == pytest.approx(N["Nd"] - a * Y["d"])
    assert new["Yrdot"] == pytest.approx(Y["rdot"] - a * Y["vdot"])
    assert new["Nvdot"] == pytest.approx(N["Nvdot"] - a * Y["vdot"])
    assert new["Nrdot"] == pytest.approx(N["Nrdot"] - a * (N["Nvdot"] + Y["rdot"]) + a**2 * Y["vdot"])
    assert new["Yvvr"] == pytest.approx(Y["vvr"] - 3 * a * Y["vvv"])
    assert new["Yvrr"] == pytest.approx(Y["vrr"] - 2 * a * Y["vvr"] + 3 * a**2 * Y["vvv"])
    assert new["Yrrr"] == pytest.approx(Y["rrr"] - a * Y["vrr"] + a**2 * Y["vvr"] - a**3 * Y["vvv"])
    assert new["Nvvr"] == pytest.approx(-a * new["Yvvr"])
    assert new["Xvr"] == pytest.approx(old["Xvr"] - 2 * a * old["Xvv"])
    assert new["Xrr"] == pytest.approx(old["Xrr"] - a * old["Xvr"] + a**2 * old["Xvv"])
    assert new["Xu"] == old["Xu"]


@first_fast("name", ["mariner", "kvlcc2-captive"])
def test_a_ship_is_as_stable_about_any_origin(name: str) -> None:
    """Eigenvalues of straight motion do not know the origin; with "total" and with "hydrodynamic" cards."""
    moved = t2s.convert(name, origin_m=-4.0)
    before, after = (ship.stability(spirals=False).to_dict()["eigenvalues"] for ship in (t2s.load(name), moved.ship))
    assert np.array(after) == pytest.approx(np.array(before), rel=1e-6)
    assert moved.made.card is not None
    assert moved.made.card.rigid_body.x_G == pytest.approx(
        polynomial(name).rigid_body.x_G + 4.0 / polynomial(name).ship.length_m
    )


def test_there_and_back_is_the_same_card() -> None:
    there = t2s.convert("mariner", origin_m=5.0).ship
    back = t2s.convert(there, origin_m=-5.0).ship.manoeuvring()
    for name, value in polynomial("mariner").derivatives.items():
        assert back.derivatives[name] == pytest.approx(value, rel=1e-9, abs=1e-15), name


@pytest.mark.parametrize("scaling", ["prime_ii", "bis", "dimensional"])
@first_fast("sign", ["port", "starboard"])
def test_other_conventions_are_the_same_ship(scaling: str, sign: str) -> None:
    made = t2s.convert("kvlcc2", scaling=scaling, rudder_sign=sign)
    assert made.made.card is not None
    old, new = polynomial("kvlcc2"), made.made.card
    assert (new.model.scaling, new.model.rudder_sign) == (scaling, sign)
    for name, value in old.derivatives.items():
        assert new.derivatives[name] == pytest.approx(value, rel=1e-9), name
        assert new.uncertainty[name] == pytest.approx(old.uncertainty[name], rel=5e-3), name
    assert made.ship.turn(35).figures == pytest.approx(t2s.load("kvlcc2").turn(35).figures, rel=1e-6)


def test_numbers_of_the_file_have_the_factors_of_their_system() -> None:
    """Prime II: L/d for all. Bis: 1/m' for masses, Fn/m' for linear, Fn^2/m' for rudder terms."""
    old = polynomial("kvlcc2")
    in_file = t2s.convert("kvlcc2", scaling="prime_ii", rudder_sign="port").made.text
    values = parse_toml(in_file)["derivatives"]
    assert values["Yv"] / old.derivatives["Yv"] == pytest.approx(320 / 20.7988)
    assert values["Nd"] / old.derivatives["Nd"] == pytest.approx(-320 / 20.7988)
    values = parse_toml(t2s.convert("kvlcc2", scaling="bis").made.text)
    froude, mass = 7.97199 / math.sqrt(9.80665 * 320), 320419000.0 / (512.5 * 320**3)
    assert values["rigid_body"]["mass"] == pytest.approx(1.0, rel=1e-4)
    assert values["derivatives"]["Yvdot"] == pytest.approx(old.derivatives["Yvdot"] / mass)
    assert values["derivatives"]["Nr"] == pytest.approx(old.derivatives["Nr"] * froude / mass)
    assert values["derivatives"]["Yd"] == pytest.approx(old.derivatives["Yd"] * froude**2 / mass)
    assert values["derivatives"]["N0u"] == pytest.approx(old.derivatives["N0u"] * froude / mass)
    assert values["derivatives"]["Xuu"] == pytest.approx(old.derivatives["Xuu"] / mass)
    assert values["derivatives"]["Nvvr"] == pytest.approx(old.derivatives["Nvvr"] / (mass * froude))


def parse_toml(text: str) -> dict[str, dict[str, float]]:
    import tomllib

    return tomllib.loads(text)


@pytest.mark.slow
def test_an_mmg_card_in_other_scalings_is_the_same_ship() -> None:
    for scaling in ("prime", "dimensional", "bis"):
        made = t2s.convert("kvlcc2-l7-mmg", to="mmg", scaling=scaling).ship
        before, after = t2s.load("kvlcc2-l7-mmg").turn(35).figures, made.turn(35).figures
        assert after["tactical_diameter_m"] == pytest.approx(before["tactical_diameter_m"], rel=1e-6), scaling


# -- MMG to a polynomial -------------------------------------------------------------------------------------------


def test_in_small_motions_the_fit_is_the_linear_map_of_the_method() -> None:
    """Of a ship alike to both sides, in Prime II: hull with the rudder's share, Yr - m_x', X_vr + m_y', Yd, Nd."""
    card = mmg_ship(ALIKE.replace("C_1 = 2.0", "C_1 = 0.0")).card
    assert isinstance(card, MmgCard)
    model, size, U = build(card), 1e-2, 1.179
    generator = np.random.default_rng(1)
    spread = generator.uniform(-1, 1, (4000, 4)) * size
    motions = np.array([U, 0, 0, 0]) + spread * np.array([3 * U, U, U / 7, 1])
    fit = fit_polynomial(card, model, motions)
    found = {name: value * 7 / 0.46 for name, value in fit.derivatives.items()}
    k = 0.0539 / (7 * 0.46) * 2.747 * 1.063344**2
    Yd, Nd, gamma = -1.312 * k, (0.5 + 0.312 * 0.464) * k, 0.640 / 1.063344
    expected = {
        "Yd": Yd,
        "Nd": Nd,
        "Yv": -0.315 + Yd * gamma,
        "Yr": 0.083 - 0.022 - 0.710 * Yd * gamma,
        "Nv": -0.137 + Nd * gamma,
        "Nr": -0.049 - 0.710 * Nd * gamma,
        "Xvr": 0.002 + 0.223,
        "Xvv": -0.040 - 0.022,  # the thrust of R_0' is by u, and the scaling by U: u^2/U^2 = 1 - v'^2
        "Xrr": 0.011,
        "Xdd": -(1 - 0.387) * k,
        "Xvd": -(1 - 0.387) * k * gamma,
        "Xrd": 0.710 * (1 - 0.387) * k * gamma,
        "Xudot": -0.022,
        "Yvdot": -0.223,
        "Nrdot": -0.011,
    }
    for name, value in expected.items():
        assert found[name] == pytest.approx(value, rel=2e-3, abs=2e-4), name
    assert abs(found["X0"]) < 1e-6


def test_errors_are_carried_through_the_fit_as_the_linear_map_has_them() -> None:
    """Yd = -(1 + a_H) k and Nd = -(x_R + a_H x_H) k go with a_H; Yv = Yv_hull + Yd gamma_R U/u_R with both."""
    exact = "R0 Xvv Xvr Xrr Xvvvv Yr Yvvv Yvvr Yvrr Yrrr Nv Nr Nvvv Nvvr Nvrr Nrrr mx my Jz k_0 k_1 k_2 t_P w_P0 "
    exact += "x_P C_1 C_2_plus C_2_minus f_alpha t_R x_H x_R eps kappa l_R gamma_R_plus gamma_R_minus"
    stated = "".join(f"{key} = 0.0\n" for key in exact.split())
    card = mmg_ship(f"{ALIKE.replace('C_1 = 2.0', 'C_1 = 0.0')}\n[uncertainty]\nYv = 0.012\na_H = 0.03\n{stated}").card
    assert isinstance(card, MmgCard)
    size, U = 1e-2, 1.179
    spread = np.random.default_rng(1).uniform(-1, 1, (4000, 4)) * size
    fit = fit_polynomial(card, build(card), np.array([U, 0, 0, 0]) + spread * np.array([3 * U, U, U / 7, 1]))
    assert fit.covariance is not None
    names = list(fit.derivatives)
    in_prime_ii = fit.covariance * (7 / 0.46) ** 2
    k = 0.0539 / (7 * 0.46) * 2.747 * 1.063344**2
    slopes = {"Yd": -k, "Nd": 0.464 * k, "Yv": -k * 0.640 / 1.063344, "Nv": 0.464 * k * 0.640 / 1.063344}
    for first, second in (("Yd", "Yd"), ("Nd", "Nd"), ("Yd", "Nd"), ("Yv", "Yv"), ("Nv", "Nv"), ("Yv", "Yd")):
        expected = slopes[first] * slopes[second] * 0.03**2 + (0.012**2 if first == second == "Yv" else 0.0)
        found = in_prime_ii[names.index(first), names.index(second)]
        assert found == pytest.approx(expected, rel=5e-3), (first, second)


@pytest.mark.slow
def test_a_polynomial_of_a_card_with_errors_has_its_covariance_next_to_it(tmp_path: Path) -> None:
    text = f"{TEXT}\n[uncertainty]\nYv = 0.012\nNv = 0.006\nNr = 0.002\neps = 0.05\n"
    made = t2s.convert(mmg_ship(text))
    made.save(tmp_path / "ship.toml")
    assert (tmp_path / "ship.covariance.json").is_file()
    bands = [
        ship.simulate("turn:35", members=60).to_dict()["ensemble"]["figures"]["tactical_diameter_m"]  # type: ignore[index]
        for ship in (mmg_ship(text), t2s.load(tmp_path / "ship.toml"))
    ]
    widths = [band["p95"] - band["p5"] for band in bands]
    assert widths[1] == pytest.approx(widths[0], rel=0.25)


@pytest.mark.slow
def test_the_polynomial_follows_standard_manoeuvres_and_says_how_well() -> None:
    made = t2s.convert("kvlcc2-l7-mmg")
    found = {(entry["manoeuvre"], entry["figure"]): entry for entry in made.to_dict()["figures"]}  # type: ignore[attr-defined]
    assert abs(found["turn:35", "tactical_diameter_m"]["error_percent"]) < 4
    assert abs(found["turn:-35", "tactical_diameter_m"]["error_percent"]) < 4
    for side in ("", "-"):
        for angle in ("10/10", "20/20"):
            entry = found[f"zigzag:{side}{angle}", "overshoot_1_deg"]
            assert abs(entry["after"] - entry["before"]) < 1.2
    again = made.ship.turn(35).figures["tactical_diameter_m"]
    assert again == pytest.approx(found["turn:35", "tactical_diameter_m"]["after"], rel=1e-6)
    assert made.made.card is not None and made.made.card.model.kind == "abkowitz"


@pytest.mark.slow
def test_a_ship_alike_to_both_sides_gets_a_polynomial_that_is_so_too() -> None:
    made = t2s.convert(mmg_ship(ALIKE))
    assert made.made.card is not None
    derivatives = made.made.card.derivatives
    assert not any(derivatives.get(name) for name in ("Y0", "Y0u", "N0", "N0uu", "Xv"))
    port, starboard = (made.ship.turn(side).figures["advance_m"] for side in (-35, 35))
    assert port == pytest.approx(starboard, rel=1e-6)


@pytest.mark.slow
def test_revolutions_have_the_effect_that_the_propeller_gives_them() -> None:
    card, ship = t2s.convert("kvlcc2-l7-mmg").made.card, t2s.load("kvlcc2-l7-mmg")
    assert card is not None and card.propulsion is not None and ship.card.propulsion is not None  # type: ignore[union-attr]
    assert card.propulsion.nominal_radps == pytest.approx(ship.card.propulsion.nominal_radps)  # type: ignore[union-attr]
    n, D, u_P = 11.8516, 0.216, 0.6 * 1.179
    slope = 0.78 * 1000 * (2 * 0.2931 * n * D**4 - 0.2753 * u_P * D**3)
    assert card.propulsion.Xnn == pytest.approx(slope * n / 2 / (500 * 49 * 1.179**2), rel=1e-5)


# -- other programs ------------------------------------------------------------------------------------------------

STATE = [1.0, 2.0, 0.3, 0.8, -0.2, 0.05, 0.3]


@pytest.mark.parametrize("name", ["kvlcc2-l7-mmg", "mariner", "kvlcc2"])
def test_a_pvs_vehicle_has_the_rates_of_the_model(name: str) -> None:
    ship = t2s.load(name)
    scope: dict[str, object] = {}
    exec(compile(t2s.convert(name, to="pvs").text, "vehicle.py", "exec"), scope)
    model = ship.model
    for factor in (1.0, -0.6, 0.0):
        x = [factor * value for value in STATE]
        expected = np.array(model.rhs(x, model.input_values(), model.parameter_values())).ravel()
        found = scope["rates_of"](x, scope["UI"], scope["P"])  # type: ignore[operator]
        assert found == pytest.approx(expected, rel=1e-12, abs=1e-300)
    vehicle = scope[program_name(ship.name)](r=20.0)  # type: ignore[operator]
    eta, nu, u = np.zeros(6), vehicle.nu, vehicle.u_actual
    for step in range(200):
        nu, u = vehicle.dynamics(eta, nu, u, vehicle.stepInput(step * 0.1), 0.1)
        eta[5] += 0.1 * nu[5]
    assert nu[5] > 0 > nu[1] and u[0] > 0.1


@pytest.mark.skipif(shutil.which("octave") is None, reason="needs GNU Octave")
@pytest.mark.parametrize("name", ["kvlcc2-l7-mmg", "mariner"])
def test_an_mss_function_has_the_rates_of_the_model(name: str, tmp_path: Path) -> None:
    model = t2s.load(name).model
    made = t2s.convert(name, to="mss")
    function = program_name(t2s.load(name).name)
    made.save(tmp_path / f"{function}.m")
    call = f"[xd, U] = {function}([{' '.join(map(str, STATE))}]'); printf('%.17g ', xd, U)"
    command = ["octave", "--no-gui", "-q", "--eval", call]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=True)
    found = [float(word) for word in done.stdout.split()]
    expected = np.array(model.rhs(STATE, model.input_values(), model.parameter_values())).ravel()
    assert found[:-1] == pytest.approx(expected, rel=1e-12) and found[-1] == pytest.approx(math.hypot(0.8, 0.2))


SAME_EQUATIONS = (
    TEXT.replace("w_P0 = 0.40", "w_P0 = 0.0")
    .replace("C_1 = 2.0", "C_1 = 0.0")
    .replace("x_G = 0.0357143", "x_G = 0.0")
    .replace("0.0185045", "0.01813444")
)
"""A ship without wake and with G midship, for which other programs have the same equations."""


def converted_scope(to: str) -> dict[str, Any]:
    """Names that the file of another program defines for :data:`SAME_EQUATIONS`."""
    scope: dict[str, Any] = {}
    exec(compile(t2s.convert(mmg_ship(SAME_EQUATIONS), to=to).text, "converted.py", "exec"), scope)
    return scope


def rates_by_the_model() -> dict[str, float]:
    """Rates of the states of :data:`SAME_EQUATIONS` in a turn with drift and rudder."""
    model = mmg_ship(SAME_EQUATIONS).model
    states = {"motion.u": 1.0, "motion.v": -0.2, "motion.r": 0.05, "rudder.angle": 0.3}
    x = [states.get(name, 0.0) for name in model.state_names]
    rates = np.array(model.rhs(x, model.input_values(), model.parameter_values())).ravel()
    return dict(zip(model.state_names, rates.tolist(), strict=True))


def test_shipmmg_sails_the_same_path_where_it_has_the_same_equations() -> None:
    """Its own wake law and its mixed velocities do not show."""
    shipmmg = pytest.importorskip("shipmmg.mmg_3dof")
    scope = converted_scope("shipmmg")
    run = mmg_ship(SAME_EQUATIONS).turn(25).df
    t = run.t_s.to_numpy()[:: max(1, len(run) // 3000)]
    rudder = np.radians(np.interp(t, run.t_s, run.delta_deg))
    solution = shipmmg.simulate_mmg_3dof(
        scope["basic_params"], scope["maneuvering_params"], t, rudder, np.full_like(t, scope["nps"]),
        u0=scope["u0"], ρ=scope["rho"], method="DOP853", rtol=1e-9, atol=1e-10,
    )  # fmt: skip
    x, y, psi = solution.sol(t)[3:6]
    assert np.degrees(psi) == pytest.approx(np.interp(t, run.t_s, run.psi_deg), abs=0.1)
    for name, values in (("x_m", x), ("y_m", y)):
        assert values == pytest.approx(np.interp(t, run.t_s, run[name]), abs=0.02)


def test_mmg_programs_are_in_its_units() -> None:
    scope = {"Mmg3DofBasicParams": dict, "Mmg3DofManeuveringParams": dict}
    text = t2s.convert("kvlcc2-l7-mmg", to="shipmmg").text
    exec(compile(text.replace("from shipmmg.mmg_3dof import", "# "), "parameters.py", "exec"), scope)
    basic, hull = scope["basic_params"], scope["maneuvering_params"]
    assert basic["m"] == pytest.approx(3270, rel=1e-5) and basic["I_zG"] == pytest.approx(3270 * 1.75**2, rel=1e-4)
    assert basic["m_y"] == pytest.approx(0.223 * 500 * 49 * 0.46) and basic["J_z"] == pytest.approx(
        0.011 * 500 * 7**4 * 0.46
    )
    assert basic["x_H"] == pytest.approx(-0.464 * 7) and basic["η"] == pytest.approx(0.626, abs=1e-3)
    assert hull["R_0_dash"] == pytest.approx(0.022) and hull["N_vvr_dash"] == pytest.approx(-0.294)
    assert len(hull) == 20


def test_a_vessel_of_mmgdynamics_has_the_forces_of_the_method() -> None:
    """Its keys, in its units, put into its formulas: hull, thrust and rudder in a turn, without drift at the screw."""
    scope = converted_scope("mmgdynamics")
    p = scope["vessel"]
    assert isinstance(p, dict) and p["m"] == pytest.approx(3270, rel=1e-5) and p["x_P"] == pytest.approx(-3.36)
    u, v, r, delta, n = 1.0, -0.2, 0.05, 0.3, scope["nps"]
    U, J = math.hypot(u, v), u / (n * p["D_p"])  # type: ignore[operator]
    K_T = p["k_0"] + p["k_1"] * J + p["k_2"] * J**2
    beta_R = math.atan2(-v, u) - p["l_R"] * r * p["Lpp"] / U
    race = 1 + p["kappa"] * (math.sqrt(1 + 8 * K_T / (math.pi * J**2)) - 1)
    u_R = u * p["epsilon"] * math.sqrt(p["eta"] * race**2 + 1 - p["eta"])
    v_R = U * p["gamma_R_plus"] * beta_R
    area = 0.5 * p["A_R"] * p["rho"] * p["f_alpha"]
    F_N = area * (u_R**2 + v_R**2) * math.sin(delta - math.atan2(v_R, u_R))
    v_, r_ = v / U, r * p["Lpp"] / U
    hull = sum(
        p[f"N_{term}_dash"] * v_ ** term.count("v") * r_ ** term.count("r") for term in "v r vvv vvr vrr rrr".split()
    )
    N = 0.5 * p["rho"] * p["Lpp"] ** 2 * p["d"] * U**2 * hull
    N -= (-p["Lpp"] / 2 + p["a_H"] * p["x_H_dash"] * p["Lpp"]) * F_N * math.cos(delta)
    inertia = p["I_zG"] + p["J_z_dash"] * 0.5 * p["rho"] * p["Lpp"] ** 4 * p["d"]
    assert rates_by_the_model()["motion.r"] == pytest.approx(N / inertia, rel=1e-4)


def test_mmgdynamics_has_the_rates_of_the_model_where_it_has_the_same_equations() -> None:
    """Where it is installed (it is on no package index)."""
    mmgdynamics = pytest.importorskip("mmgdynamics.dynamics")
    scope = converted_scope("mmgdynamics")
    motion = np.array([1.0, -0.2, 0.05, 0.3, scope["nps"]])
    rates = mmgdynamics.mmg_dynamics(0.0, motion, scope["vessel"], 0.0, None, None, scope["nps"], 0.3)
    expected = rates_by_the_model()
    assert rates[:3] == pytest.approx([expected[name] for name in ("motion.u", "motion.v", "motion.r")], rel=1e-4)


# -- refusals ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("card", "options", "words"),
    [
        ("mariner", {"to": "mmg"}, ["model.kind", "cannot be split"]),
        ("mariner", {"to": "shipmmg"}, ["model.kind"]),
        ("mariner", {"to": "mmgdynamics"}, ["model.kind"]),
        ("container", {"to": "mmgdynamics"}, ["roll"]),
        ("mariner", {"to": "abkowits"}, ["to", "abkowitz"]),
        ("mariner", {"scaling": "bis"}, ["ship.displacement_kg", "bis"]),
        ("mariner", {"scaling": "imperial"}, ["scaling"]),
        ("mariner", {"rudder_sign": "left"}, ["rudder_sign"]),
        ("mariner", {"origin_m": 1e4}, ["origin_m"]),
        ("mariner", {"to": "mss", "scaling": "prime"}, ["to", "mss"]),
        ("kvlcc2", {"origin_m": 1.0}, ["effects", "midships"]),
        ("kvlcc2-l7-mmg", {"to": "mmg", "origin_m": 1.0}, ["model.kind", "abkowitz"]),
        ("kvlcc2-l7-mmg", {"scatter": 0.0}, ["scatter"]),
        ("wilinski-zellman", {}, ["model.kind"]),
    ],
)
def test_what_cannot_be_converted_is_refused_in_one_line(
    card: str, options: dict[str, object], words: list[str]
) -> None:
    with pytest.raises(InputError) as error:
        t2s.convert(card, **options)  # type: ignore[arg-type]
    assert "\n" not in str(error.value)
    for word in words:
        assert word in str(error.value)
