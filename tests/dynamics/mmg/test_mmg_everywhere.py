"""What takes a ship takes an MMG ship: effects, FMU, influence, identification and the search for a missing effect."""

from __future__ import annotations

import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import tank2sim as t2s
from tank2sim.analysis.turning.diagram import steady_turning
from tank2sim.bundled import bundled_cards
from tank2sim.cards import parse_card
from tank2sim.cards.card import MmgCard
from tank2sim.cards.form import EffectEntry
from tank2sim.dynamics import build
from tank2sim.dynamics.effects import EFFECTS
from tank2sim.errors import InputError
from tank2sim.gap.improve_card import add_effects_to_card
from tank2sim.identification.trials.problem.problem_from_card import free_parameters
from tests.dynamics.states import rates

TEXT = bundled_cards()["kvlcc2-l7-mmg"].read_text(encoding="utf-8")
SIZES = {"start_s": 1.0, "reversal_s": 4.0, "time_constant_s": 2.0, "depth_m": 1.5, "port_distance_m": 3.0}

LACKING = {"waves": "needs the table", "twin_orders": "two propellers and rudders"}
"""Effects for which this ship lacks something, and what the refusal says."""


def ship_of(text: str) -> t2s.Ship:
    return t2s.Ship(parse_card(text, "ship.toml"))


@pytest.mark.parametrize("name", EFFECTS)
def test_every_effect_acts_on_an_mmg_ship_or_is_refused_in_one_line(name: str) -> None:
    card = ship_of(TEXT).card
    assert isinstance(card, MmgCard)
    effect = EFFECTS[name]
    values = {}
    for parameter in effect.parameters:
        if parameter.default is None:
            typical = parameter.typical_values(card)
            values[parameter.name] = SIZES[parameter.name] if parameter.name in SIZES else typical[0]
    changed = replace(card, effects=(EffectEntry(name=name, parameters=values),))
    if effect.in_mmg:
        with pytest.raises(InputError, match=name):
            build(changed)
        assert not effect.tried(card)
        return
    if name in LACKING:
        with pytest.raises(InputError, match=LACKING[name]):
            build(changed)
        return
    model, plain = build(changed), build(card)
    at = {"motion.u": 0.9, "motion.v": -0.2, "motion.r": 0.04, "rudder.angle": 0.5, "rudder.command": 0.55}
    found, known = rates(model, at), rates(plain, at)
    assert np.isfinite(list(found.values())).all()
    if effect.acts_on in ("force", "mass", "force and mass", "kinematics") and "initial" not in name:
        assert any(found[state] != known[state] for state in known) or name in STILL


STILL = ("engine_lag", "propeller_walk", "roll_coupling", "flow_memory", "rudder_bias")
"""Effects that do nothing at that instant: revolutions as ordered and ahead, no heel yet, no change of drift yet."""


@pytest.mark.slow
def test_the_fmu_is_the_model(tmp_path: Path) -> None:
    made = t2s.load("kvlcc2-l7-mmg").to_fmu(tmp_path / "mmg.fmu", fmi=2)
    assert made is not None
    found = t2s.check_fmu(tmp_path / "mmg.fmu")
    assert found.to_dict()["passed"]


def test_influence_names_the_coefficients_of_propeller_and_rudder() -> None:
    found = t2s.load("kvlcc2-l7-mmg").influence(["tactical_diameter_m@35", "criterion_C"])
    shares = found.coefficients["tactical_diameter_m@35"]
    # More normal force turns more tightly.
    assert shares["rudder.f_alpha"] < 0 and shares["rudder.eps"] < 0
    slope = found.coefficients["tactical_diameter_m@35"]["rudder.a_H"]
    more = ship_of(TEXT.replace("a_H = 0.312", "a_H = 0.31512")).turn(35).figures["tactical_diameter_m"]
    before = t2s.load("kvlcc2-l7-mmg").turn(35).figures["tactical_diameter_m"]
    assert 1000 * (more / before - 1) == pytest.approx(slope, rel=0.05)  # by 1 %, and the influence is by 10 %


def written(ship: t2s.Ship, folder: Path) -> list[Path]:
    """Noisy records of three manoeuvres."""
    generator = np.random.default_rng(1)
    paths = []
    for number, run in enumerate((ship.zigzag(20, 20), ship.zigzag(-10, 10), ship.turn(30))):
        every = max(1, round(0.5 / (run.df.t_s[1] - run.df.t_s[0])))
        frame = run.df[::every][["t_s", "delta_deg", "n_rpm", "u_mps", "v_mps", "r_degps", "psi_deg", "x_m", "y_m"]]
        noise = {"u_mps": 0.003, "v_mps": 0.003, "r_degps": 0.02, "psi_deg": 0.05, "x_m": 0.02, "y_m": 0.02}
        frame = frame.assign(**{key: frame[key] + generator.normal(0, size, len(frame)) for key, size in noise.items()})
        paths.append(folder / f"trial{number}.csv")
        pd.DataFrame(frame).to_csv(paths[-1], index=False)
    return paths


@pytest.mark.slow
def test_coefficients_of_hull_and_rudder_are_found_in_trials(tmp_path: Path) -> None:
    paths = written(ship_of(TEXT), tmp_path)
    free = {"Yv": 0.06, "Yr": 0.02, "Nv": 0.03, "Nr": 0.01, "eps": 0.1, "gamma_R_plus": 0.15}
    keys = "R0 Xvv Xvr Xrr Xvvvv Yvvv Yvvr Yvrr Yrrr Nvvv Nvvr Nvrr Nrrr".split()
    errors = "".join(f"{key} = {free.get(key, 0.0)}\n" for key in [*keys, *free])
    wrong = {"Yv = -0.315": "Yv = -0.27", "Nv = -0.137": "Nv = -0.12", "Nr = -0.049": "Nr = -0.055"}
    wrong |= {"Yr = 0.083": "Yr = 0.07", "eps = 1.09": "eps = 1.02", "gamma_R_plus = 0.640": "gamma_R_plus = 0.55"}
    text = f"{TEXT}\n[uncertainty]\n{errors}"
    for old, new in wrong.items():
        text = text.replace(old, new)
    start = tmp_path / "start.toml"
    start.write_text(text, encoding="utf-8")
    found = t2s.identify(start, paths)
    card = found.card
    assert isinstance(card, MmgCard)
    true = {"Yv": -0.315, "Yr": 0.083, "Nv": -0.137, "Nr": -0.049}
    for name, value in true.items():
        in_file, error = (number[name] * 7 / 0.46 for number in (card.derivatives, card.uncertainty))
        assert abs(in_file - value) < 3.5 * error and error < 0.4 * free[name], name
    assert abs(card.rudder.eps - 1.09) < 3.5 * card.interaction_errors["eps"] < 0.1
    assert abs((card.rudder.gamma_R_plus or 0) - 0.64) < 3.5 * card.interaction_errors["gamma_R_plus"] < 0.2
    for structure in ("linear", "cross_flow", "auto"):
        with pytest.raises(InputError, match=f"^structure: {structure} .*MMG card"):
            t2s.identify(start, paths, structure=structure)


def test_effects_are_written_into_the_keys_of_the_method() -> None:
    card = ship_of(TEXT).card
    assert isinstance(card, MmgCard)
    found = [
        ("linear_yaw_damping", {"factor": 0.2}, {"factor": 0.02}),
        ("added_sway_mass", {"factor": 0.1}, {"factor": 0.02}),
        ("rudder_effectiveness", {"factor": 0.15}, {"factor": 0.02}),
    ]
    new = add_effects_to_card(card, found)
    in_file = tomllib.loads(new.text)["derivatives"]
    assert in_file["Nr"] == pytest.approx(-0.049 * 1.2, rel=1e-3) and in_file["Yr"] == pytest.approx(0.0996, rel=1e-3)
    assert in_file["my"] == pytest.approx(0.2453, rel=1e-3)
    # Its rudder has no derivatives: the effect stays one, and is what f_alpha would be.
    assert [entry.name for entry in new.effects] == ["rudder_effectiveness"]
    same = ship_of(TEXT.replace("f_alpha = 2.747", f"f_alpha = {2.747 * 1.15}").replace("my = 0.223", "my = 0.2453"))
    same = same.replace({f"derivatives.{key}": in_file[key] for key in ("Nr", "Yr", "my")})
    assert t2s.Ship(new).turn(35).figures == pytest.approx(same.turn(35).figures, rel=1e-9)


@pytest.mark.slow
def test_a_missing_effect_is_found_on_an_mmg_card(tmp_path: Path) -> None:
    """Far enough from the card that no error of Nr, which turns a ship alike, is as likely."""
    more = '\n[[effects]]\nname = "linear_yaw_damping"\n[effects.parameters]\nfactor = 0.4\n'
    content = t2s.find_gap("kvlcc2-l7-mmg", written(ship_of(TEXT + more), tmp_path)).to_dict()
    assert content["verdict"] == "missing effect" and content["alternatives"] == []
    (effect,) = content["effects"]  # type: ignore[misc]
    assert effect["name"] == "linear_yaw_damping"
    assert abs(effect["parameters"]["factor"] - 0.4) < 3 * effect["standard_errors"]["factor"] < 0.3


@pytest.mark.slow
def test_reports_describe_the_method_and_keep_bare_hull_and_polynomial_apart(tmp_path: Path) -> None:
    paths = written(ship_of(TEXT), tmp_path)
    page = t2s.validate("kvlcc2-l7-mmg", paths[:1], members=0).page()
    assert "MMG standard method" in page


@pytest.mark.slow
def test_the_two_languages_are_compared_by_their_linear_terms_with_the_rudder(tmp_path: Path) -> None:
    """Of the method they are Yv + Yd gamma_R U/u_R, Yr - m_x' + ..., of a fit near them; mean of both sides."""
    t2s.convert("kvlcc2-l7-mmg").save(tmp_path / "polynomial.toml")
    rows = t2s.compare(["kvlcc2-l7-mmg", tmp_path / "polynomial.toml"], members=0).to_dict()["coefficients"]
    found = {row["name"]: row for row in rows}  # type: ignore[attr-defined]
    k = 0.0539 / (7 * 0.46) * 2.747 * 1.0633**2
    Yd, Nd, gamma = -1.312 * k, (0.5 + 0.312 * 0.464) * k, 0.5 * (0.640 + 0.395) / 1.0633
    expected = {"Yd": Yd, "Nd": Nd, "Yv": -0.315 + Yd * gamma, "Nv": -0.137 + Nd * gamma}
    expected |= {"Yr": 0.083 - 0.022 - 0.71 * Yd * gamma, "Nr": -0.049 - 0.71 * Nd * gamma}
    for name, value in expected.items():
        assert found[name]["cards"][0]["value"] == pytest.approx(value * 0.46 / 7, rel=1e-3), name
        assert found[name]["differences"][0]["standard_errors"] is None
        assert abs(found[name]["differences"][0]["percent"]) < 25, name
    assert found["Nrdot"]["differences"][0]["percent"] == pytest.approx(0, abs=1e-6)
    assert "Xvr" not in found and "Yvvr" not in found


@pytest.mark.slow
def test_hull_and_rudder_are_scaled_to_turn_through_two_points(tmp_path: Path) -> None:
    wanted = steady_turning(ship_of(TEXT.replace("f_alpha = 2.747", "f_alpha = 2.6")).model)
    points = []
    for rudder in (35.0, 10.0):
        rates = [rate for rate, stable in wanted.turns_at(np.radians(rudder) * (1 - 1e-9)) if stable]
        points.append(f"{60 * np.degrees(max(rates)):.6g}@{rudder:g}")
    tuned = t2s.load("kvlcc2-l7-mmg").tune_through(points)
    card = tuned.card
    assert isinstance(card, MmgCard)
    assert card.rudder.f_alpha == pytest.approx(2.6, rel=2e-3)
    assert card.derivatives["Nv"] == pytest.approx(-0.137 * 0.46 / 7, rel=2e-3)


def test_identification_leaves_the_torque_alone_of_which_motion_shows_nothing() -> None:
    curve = "[propeller]\nq_0 = 0.03\nq_1 = -0.02\nq_2 = -0.01\n"
    text = TEXT.replace("[propeller]\n", curve, 1) + "\n[uncertainty]\nq_0 = 0.001\neta_R = 0.02\neps = 0.05\n"
    free = free_parameters(ship_of(text).card)
    assert "mmg.eps" in free and not {"mmg.q_0", "mmg.eta_R"} & set(free)
