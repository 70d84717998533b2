"""MMG cards: converted once by hand-written factors, written back, and refused with the key that is wrong."""

from __future__ import annotations

import math
import tomllib

import numpy as np
import pytest

from tank2sim.apps.rigs.yaw.found_card import with_nrdot
from tank2sim.bundled import bundled_cards
from tank2sim.cards import parse_card, revised
from tank2sim.cards.card import MmgCard
from tank2sim.cards.mmg import fujii, open_water_fit
from tank2sim.dynamics import build
from tank2sim.dynamics.card_parameters import card_parameters
from tank2sim.errors import InputError

TEXT = bundled_cards()["kvlcc2-l7-mmg"].read_text(encoding="utf-8")


def mmg_of(text: str) -> MmgCard:
    card = parse_card(text, "ship.toml")
    assert isinstance(card, MmgCard)
    return card


def test_prime_ii_becomes_prime_by_draught_over_length() -> None:
    card = mmg_of(TEXT)
    ratio = 0.46 / 7.0
    assert card.derivatives["Yv"] == pytest.approx(-0.315 * ratio)
    assert card.derivatives["X0"] == pytest.approx(-0.022 * ratio)
    assert card.derivatives["Xudot"] == pytest.approx(-0.022 * ratio)
    assert card.derivatives["Yvdot"] == pytest.approx(-0.223 * ratio)
    assert card.derivatives["Nrdot"] == pytest.approx(-0.011 * ratio)
    assert card.rigid_body.mass * card.scales.mass == pytest.approx(3270.0, rel=1e-5)
    gyration = card.rigid_body.yaw_inertia - card.rigid_body.mass * card.rigid_body.x_G**2
    assert gyration / card.rigid_body.mass == pytest.approx(0.0625, rel=1e-4)


@pytest.mark.parametrize(("name", "value"), [("Yv", -0.02), ("X0", -0.0015), ("Yvdot", -0.014)])
def test_new_values_are_written_in_the_language_of_the_card(name: str, value: float) -> None:
    new = revised(mmg_of(TEXT), {name: (value, 0.001)})
    assert new.derivatives[name] == pytest.approx(value, rel=1e-12)
    assert new.uncertainty[name] == pytest.approx(0.001, rel=1e-12)
    key = {"X0": "R0", "Yvdot": "my"}.get(name, name)
    assert f"\n{key} = {'-' if key == 'Yv' else ''}" in new.text


def test_the_keys_of_the_polynomial_mean_the_same() -> None:
    renamed = TEXT.replace("R0 = 0.022", "X0 = -0.022").replace("my = 0.223", "Yvdot = -0.223")
    assert mmg_of(renamed).derivatives == pytest.approx(mmg_of(TEXT).derivatives)


def test_every_coefficient_is_a_tunable_parameter_with_its_error() -> None:
    card = mmg_of(TEXT + "\n[uncertainty]\neps = 0.05\nYv = 0.02\nR0 = 0.001\n")
    model = build(card)
    known = {parameter.name: parameter for parameter in model.parameters}
    assert all(known[f"mmg.{key}"].tunable for key in card.interaction_places())
    found = {parameter.name: parameter for parameter in card_parameters(card, model)}
    assert found["mmg.eps"].standard_error == 0.05 and not found["mmg.eps"].assumed
    assert found["mmg.eps"].key == "rudder.eps" and found["mmg.t_P"].key == "propeller.t_P"
    assert found["mmg.kappa"].standard_error == pytest.approx(0.01) and found["mmg.kappa"].assumed
    assert found["derivatives.X0"].value * found["derivatives.X0"].factor == pytest.approx(0.022)
    assert found["derivatives.X0"].standard_error == pytest.approx(0.001 * 0.46 / 7)
    assert found["ship.mass"].value * found["ship.mass"].factor == pytest.approx(0.290151)


def test_fujiis_slope_is_that_of_the_kvlcc2() -> None:
    """f_alpha = 2.747 belongs to Lambda = 1.827."""
    assert fujii(1.827) == pytest.approx(2.747, abs=1e-3)
    assert mmg_of(TEXT.replace("f_alpha = 2.747", "aspect_ratio = 1.827")).rudder.f_alpha == pytest.approx(fujii(1.827))


def test_a_yaw_rig_writes_the_added_inertia_of_the_method() -> None:
    new = with_nrdot(mmg_of(TEXT), -8e-4, 1e-4, "output_error")
    assert tomllib.loads(new.text)["derivatives"]["Jz"] == pytest.approx(8e-4 * 7 / 0.46, rel=1e-5)
    assert new.derivatives["Nrdot"] == pytest.approx(-8e-4, rel=1e-5)
    assert new.uncertainty["Nrdot"] == pytest.approx(1e-4, rel=1e-5)


def test_stated_revolutions_are_taken() -> None:
    card = mmg_of(TEXT + "\n[propulsion]\nnominal_rpm = 620.0\n")
    assert card.propulsion is not None and card.propulsion.nominal_radps == pytest.approx(64.9262, abs=1e-4)


@pytest.mark.parametrize(
    ("old", "new", "key"),
    [
        ("w_P0 = 0.40", "w_P0 = 1.0", "propeller.w_P0"),
        ("t_P = 0.220", "t_P = 1.2", "propeller.t_P"),
        ("C_2_minus = 1.1\n", "", "propeller.C_2_minus"),
        ("C_2_plus = 1.6\n", "", "propeller.C_2_plus"),
        ("C_1 = 2.0\n", "", "propeller.C_1"),
        ("gamma_R_minus = 0.395", "", "rudder.gamma_R_minus"),
        ("gamma_R_plus = 0.640", "", "rudder.gamma_R_plus"),
        ("gamma_R_plus = 0.640\ngamma_R_minus = 0.395", "", "rudder.gamma_R_plus"),
        ("draught_m = 0.46\n", "", "ship.draught_m"),
        ("propeller_diameter_m = 0.216\n", "", "ship.propeller_diameter_m"),
        ("rudder_area_m2 = 0.0539\n", "", "ship.rudder_area_m2"),
        ("[propeller]\n", "[screw]\n", "screw"),
        (TEXT[TEXT.index("[propeller]") : TEXT.index("[rudder]")], "", "propeller"),
        (TEXT[TEXT.index("[rudder]") : TEXT.index("[steering_gear]")], "", "rudder"),
        ("k_2 = -0.1385\n", "", "propeller.k_2"),
        ("k_0 = 0.2931", "k_0 = 0.2931\nJ = [0.0, 0.3, 0.6]\nK_T = [0.3, 0.2, 0.1]", "propeller.J"),
        ("k_0 = 0.2931\nk_1 = -0.2753\nk_2 = -0.1385", "J = [0.0, 0.5]\nK_T = [0.3, 0.1]", "propeller.J"),
        ("k_0 = 0.2931\nk_1 = -0.2753\nk_2 = -0.1385", "J = [0.0, 0.3, 0.6]\nK_T = [0.3]", "propeller.K_T"),
        ("k_0 = 0.2931\nk_1 = -0.2753\nk_2 = -0.1385", "", "propeller.k_0"),
        ("f_alpha = 2.747\n", "", "rudder.f_alpha"),
        ("height_m = 0.345", "height_m = 0.2", "rudder.height_m"),
        ("height_m = 0.345", "height_m = 0.345\nnumber = 2\ny_R = 0.1", "rudder.number"),
        ("t_P = 0.220", "t_P = 0.220\nnumber = 2", "propeller.y_P"),
        ("length_m = 7.0", "length_m = 70.0", "rigid_body.mass"),
        ("draught_m = 0.46", "draught_m = 4.6", "rigid_body.mass"),
        ('kind = "mmg"', 'kind = "mmg"\nscaling = "prime"', "rigid_body.mass"),
        ("displacement_kg = 3270.0", "displacement_kg = 327.0", "rigid_body.mass"),
        ("Yv = -0.315", "Yv = -0.0207", "derivatives.Yv"),
        ("Yv = -0.315", "Yv = 0.315", "derivatives.Yv"),
        ("Nvrr = 0.055", "Nvrrr = 0.055", "derivatives.Nvrrr"),
        ("Nvrr = 0.055", "Yd = 0.055", "derivatives.Yd"),
        ("Nvrr = 0.055", "Yrdot = 0.055", "derivatives.Yrdot"),
        ("R0 = 0.022", "R0 = 0.022\nX0 = -0.022", "derivatives.X0"),
        ("R0 = 0.022", "R0 = 2e5", "derivatives.R0"),
        ("mx = 0.022", "mx = -5.0", "derivatives"),
        ("eps = 1.09", "epsilon = 1.09", "rudder.epsilon"),
        ('kind = "mmg"', 'kind = "mmg"\nrudder_sign = "port"', "model.rudder_sign"),
        ("[steering_gear]", "[uncertainty]\neps_R = 0.1\n[steering_gear]", "uncertainty.eps_R"),
        (
            "[steering_gear]",
            "[[effects]]\nname = 'rudder_slipstream'\nparameters = {gain = 0.5}\n[steering_gear]",
            "effects",
        ),
        ("[steering_gear]", "[propulsion]\nnominal_rpm = 700.0\nXnn = 0.001\n[steering_gear]", "propulsion.Xnn"),
    ],
)
def test_a_faulty_mmg_card_is_refused_in_one_line_with_its_key(old: str, new: str, key: str) -> None:
    assert old in TEXT
    with pytest.raises(InputError) as error:
        build(mmg_of(TEXT.replace(old, new, 1)))
    line = str(error.value)
    assert "\n" not in line and line.startswith(f"ship.toml: {key}:"), line


def test_a_rudder_is_as_high_as_the_propeller_or_states_its_share_in_the_race() -> None:
    def with_height(metres: float, more: str = "") -> MmgCard:
        return mmg_of(TEXT.replace("height_m = 0.345", f"height_m = {metres}{more}"))

    assert with_height(0.217).rudder.height_m == 0.217
    with pytest.raises(InputError) as refused:
        with_height(0.215)
    assert refused.value.place == "rudder.height_m"
    assert with_height(0.215, "\neta = 0.9").interaction("eta") == 0.9


@pytest.mark.parametrize(("times", "taken"), [(0.28, False), (0.32, True), (7.8, True), (8.2, False)])
def test_a_sway_damping_is_taken_for_one_of_the_scaling_within_bounds_of_slender_wings(
    times: float, taken: bool
) -> None:
    """Y_v' over -pi (d/L)^2, in the prime II of the card -pi d/L."""
    text = TEXT.replace("Yv = -0.315", f"Yv = {-times * 3.14159265 * 0.46 / 7.0!r}")
    if taken:
        mmg_of(text)
    else:
        with pytest.raises(InputError) as refused:
            mmg_of(text)
        assert refused.value.place == "derivatives.Yv"


def test_revolutions_hold_the_resistance_with_thrust_deduction_wake_and_two_propellers() -> None:
    """(1 - t) z rho n^2 D^4 K_T(J) = 1/2 rho L d U^2 R_0, J = (1 - w) U/(n D)."""
    two = TEXT.replace("[propeller]", "[propeller]\nnumber = 2\ny_P = 0.03").replace(
        "[rudder]", "[rudder]\nnumber = 2\ny_R = 0.03"
    )
    for text, number in ((TEXT, 1), (two, 2)):
        card = mmg_of(text)
        assert card.propulsion is not None
        n = card.propulsion.nominal_radps / (2 * math.pi)
        J = 0.6 * 1.179 / (n * 0.216)
        thrust = 1000.0 * n**2 * 0.216**4 * (0.2931 - 0.2753 * J - 0.1385 * J**2)
        assert 0.78 * number * thrust == pytest.approx(0.5 * 1000 * 7 * 0.46 * 1.179**2 * 0.022, rel=1e-9)


@pytest.mark.parametrize(("points", "coefficients"), [(3, (0.3, -0.2, -0.1)), (9, (0.05, -0.03, -0.02))])
def test_an_open_water_fit_is_the_least_squares_parabola_and_tells_its_largest_error(points, coefficients) -> None:
    J = np.linspace(0.0, 0.8, points)
    values = np.polynomial.polynomial.polyval(J, coefficients)
    fit = open_water_fit(J.tolist(), values.tolist(), "x.toml")
    assert fit.coefficients == pytest.approx(coefficients, rel=1e-9) and fit.largest_error < 1e-12
    bent = values + 0.01 * (-1.0) ** np.arange(points)
    expected = np.polynomial.polynomial.polyfit(J, bent, 2)
    fit = open_water_fit(J.tolist(), bent.tolist(), "x.toml")
    assert fit.coefficients == pytest.approx(expected, rel=1e-6)
    left = np.abs(np.polynomial.polynomial.polyval(J, expected) - bent).max()
    assert fit.largest_error == pytest.approx(left, rel=1e-6, abs=1e-12)


def test_torque_needs_its_curve_whole_once_and_with_its_J() -> None:
    def refused_at(more: str, text: str = TEXT) -> str:
        with pytest.raises(InputError) as refused:
            mmg_of(text.replace("[propeller]\n", f"[propeller]\n{more}\n", 1))
        return refused.value.place

    table = TEXT.replace("k_0 = 0.2931\nk_1 = -0.2753\nk_2 = -0.1385", "J = [0.0, 0.3, 0.6]\nK_T = [0.3, 0.2, 0.1]")
    assert refused_at("q_0 = 0.03\nq_1 = -0.02") == "propeller.q_2"
    assert refused_at("eta_R = 1.01") == "propeller.eta_R"
    assert refused_at("K_Q = [0.03, 0.02, 0.01]") == "propeller.J"
    assert refused_at("q_0 = 0.03\nK_Q = [0.03, 0.02, 0.01]", table) == "propeller.K_Q"
    card = mmg_of(table.replace("[propeller]\n", "[propeller]\nK_Q = [0.03, 0.021, 0.01]\n"))
    given = card.propeller
    assert given.eta_R == 1.0
    at = [given.q_0 + given.q_1 * J + given.q_2 * J**2 for J in (0.0, 0.3, 0.6)]
    assert at == pytest.approx([0.03, 0.021, 0.01])


def test_a_ship_without_resistance_that_thrust_can_balance_has_no_revolutions() -> None:
    with pytest.raises(InputError, match=r"R0.*no revolutions"):
        mmg_of(TEXT.replace("k_0 = 0.2931", "k_0 = -0.2931"))


def test_an_error_of_a_polynomial_that_the_card_does_not_state_is_refused() -> None:
    table = TEXT.replace("k_0 = 0.2931\nk_1 = -0.2753\nk_2 = -0.1385", "J = [0, 0.3, 0.6]\nK_T = [0.3, 0.2, 0.1]")
    with pytest.raises(InputError, match=r"uncertainty\.k_0"):
        mmg_of(table.replace("J = [0, ", "J = [0.0, ") + "\n[uncertainty]\nk_0 = 0.01\n")


def test_a_stated_slope_of_the_rudder_goes_before_its_aspect_ratio() -> None:
    assert mmg_of(TEXT.replace("f_alpha = 2.747", "f_alpha = 2.9\naspect_ratio = 1.8")).rudder.f_alpha == 2.9
