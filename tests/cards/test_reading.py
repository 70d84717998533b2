from __future__ import annotations

import math
import tomllib
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tank2sim.bundled import bundled_cards
from tank2sim.cards import parse_card, read_card, revised
from tank2sim.cards.reading import changed_text
from tank2sim.dynamics import build
from tank2sim.errors import InputError
from tests.cards.si_card import SI_CARD


def refusal(text: str) -> str:
    with pytest.raises(InputError) as error:
        build(parse_card(text, "ship.toml"))
    assert "\n" not in str(error.value)
    return str(error.value)


def test_dimensional_numbers_become_prime_by_hand() -> None:
    card = parse_card(SI_CARD, "ship.toml")
    half_rho, length, speed = 500.0, 100.0, 10.0
    assert card.rigid_body.mass == pytest.approx(5e6 / (half_rho * length**3))
    assert card.rigid_body.yaw_inertia == pytest.approx(3.2e9 / (half_rho * length**5))
    assert card.rigid_body.x_G == pytest.approx(0.01)
    assert card.derivatives["Yv"] == pytest.approx(-6e5 / (half_rho * length**2 * speed))
    assert card.derivatives["Yr"] == pytest.approx(1.5e7 / (half_rho * length**3 * speed))
    assert card.derivatives["Nr"] == pytest.approx(-1.2e9 / (half_rho * length**4 * speed))
    assert card.derivatives["Nvvr"] == pytest.approx(-4e8 * speed / (half_rho * length**4))
    assert card.derivatives["Yvdot"] == pytest.approx(-4e6 / (half_rho * length**3))
    assert card.derivatives["Nrdot"] == pytest.approx(-2e9 / (half_rho * length**5))


def test_a_rudder_to_port_changes_the_sign_of_odd_powers_alone() -> None:
    card = parse_card(SI_CARD, "ship.toml")
    assert card.derivatives["Yd"] == pytest.approx(-1.1e6 / (500.0 * 100.0**2 * 100.0))
    assert card.derivatives["Xdd"] == pytest.approx(-5e5 / (500.0 * 100.0**2 * 100.0))


def test_degrees_and_radians_are_one() -> None:
    in_degrees = read_card("mariner")
    in_radians = parse_card(
        in_degrees.text.replace("max_rate_degps = 5.0", f"max_rate_radps = {math.radians(5.0)}"), "ship.toml"
    )
    assert in_radians.steering_gear.max_rate_radps == pytest.approx(in_degrees.steering_gear.max_rate_radps)
    assert in_degrees.steering_gear.max_angle_rad == pytest.approx(math.radians(40.0))


def test_a_card_is_written_back_without_loss(tmp_path: Path) -> None:
    for path in bundled_cards().values():
        read_card(path).save(tmp_path / "copy.toml")
        assert (tmp_path / "copy.toml").read_text(encoding="utf-8") == path.read_text(encoding="utf-8")


@settings(max_examples=25, deadline=None)
@given(
    value=st.floats(-1, 1).filter(lambda v: v == 0 or abs(v) > 1e-9),
    error=st.floats(0, 0.1),
    name=st.sampled_from(["Yv", "Nddd", "Xvr", "Yvvr", "Nvdot", "Yduu", "Y0"]),
    source=st.sampled_from(["mariner", "si"]),
)
def test_revised_values_come_back_from_the_written_text(value: float, error: float, name: str, source: str) -> None:
    card = read_card("mariner") if source == "mariner" else parse_card(SI_CARD, "ship.toml")
    again = parse_card(revised(card, {name: (value, error)}).text, "again.toml")
    assert again.derivatives[name] == pytest.approx(value, rel=1e-12, abs=1e-300)
    assert again.uncertainty[name] == pytest.approx(error, rel=1e-12, abs=1e-300)
    others = set(card.derivatives) - {name}
    assert {key: again.derivatives[key] for key in others} == {key: card.derivatives[key] for key in others}


def test_comments_survive_a_revision() -> None:
    new = revised(parse_card(SI_CARD, "ship.toml"), {"Yv": (-0.01, 0.001)}).text
    assert "# kg" in new and "# N per rad/s" in new


def test_uncertainty_left_out_is_two_percent() -> None:
    card = read_card("mariner")
    assert card.standard_error("Yv") == pytest.approx(0.02 * 0.0116)


@pytest.mark.parametrize(
    ("old", "new", "place", "expected"),
    [
        ("length_m = 100.0", "", "ship.length_m", "is missing"),
        ("length_m = 100.0", "length_m = -100.0", "ship.length_m", "at least 0.01"),
        ("length_m = 100.0", "length_m = nan", "ship.length_m", "finite"),
        ("length_m = 100.0", "length_m = inf", "ship.length_m", "finite"),
        ("length_m = 100.0", "length_ft = 328.0", "ship.length_ft", "did you mean length_m?"),
        ("length_m = 100.0", 'length_m = "100"', "ship.length_m", "a number was expected"),
        ("length_m = 100.0", "length_m = 100.0\nlength_m = 101.0", "line", "once"),
        ('kind = "abkowitz"', 'kind = "norrbin"', "model.kind", "abkowitz"),
        ('rudder_sign = "port"', "", "model.rudder_sign", "is missing"),
        ('yaw_rate_terms = "hydrodynamic"', 'yaw_rate_terms = "both"', "model.yaw_rate_terms", "total"),
        ("Yv = -6e5", "Yv = -6e5\nYbeta = 1.0", "derivatives.Ybeta", "not a name of a derivative"),
        ("Yv = -6e5", "Yv = -6e5\nYvvvv = 1.0", "derivatives.Yvvvv", "not a term of (3.8)"),
        ("Xdd = -5e5", "Xudd = 1.0\nXddu = 1.0", "derivatives.Xddu", "same term as Xudd"),
        ("mass = 5e6", "mass = 5e12", "rigid_body.mass", "prime"),
        ("x_G = 1.0", "x_G = 80.0", "rigid_body.x_G", "midships"),
        ("[derivatives]", "[wings]\na = 1\n[derivatives]", "wings", "not a key of a card"),
        ("[derivatives]", "[derivatives", "line", "TOML"),
        ('kind = "abkowitz"', 'kind = ["abkowitz"]', "model.kind", "one of linear"),
        ('kind = "abkowitz"', "kind = {a = 1}", "model.kind", "one of linear"),
        ("length_m = 100.0", f"length_m = {'1' * 5000}", "", "thousands of digits"),
        ("length_m = 100.0", f"length_m = {'1' * 400}", "ship.length_m", "was expected"),
        ("length_m = 100.0", f"length_m = -{'1' * 400}", "ship.length_m", "was expected"),
        ("length_m = 100.0", "length_m = 1e100", "ship.length_m", "at most 1000 "),
        ("length_m = 100.0", "length_m = 1e-300", "ship.length_m", "at least 0.01 "),
        ("speed_mps = 10.0", "speed_mps = 1e-300", "model.speed_mps", "at least 0.001 "),
        ("kgpm3 = 1000.0", "kgpm3 = 1e30", "environment.water_density_kgpm3", "at most 1300 "),
        ("[derivatives]", "[steering_gear]\ntime_constant_s = 1e-9\n[derivatives]", "time_constant_s", "0.001 "),
        (
            "[derivatives]",
            f"[steering_gear]\nmax_rate_degps = {'1' * 400}\n[derivatives]",
            "steering_gear.max_rate_degps",
            "no number is so large",
        ),
        ("[derivatives]", f"deep = {'[' * 5000}{']' * 5000}\n[derivatives]", "", "nested too deeply"),
        ("[rigid_body]", "valid_speed_mps = [9.0, 3.0]\n[rigid_body]", "model.valid_speed_mps", "the lower first"),
        ("[rigid_body]", f"valid_speed_mps = [1, {'9' * 400}]\n[rigid_body]", "model.valid_speed_mps", "100 m/s"),
        ("Yv = -6e5", f"Yv = {'9' * 400}", "derivatives.Yv", "number"),
        ("[rigid_body]", "low_speed_below_mps = -1\n[rigid_body]", "model.low_speed_below_mps", "at least 0 "),
        (
            "[derivatives]",
            '[[fitted_trials]]\nname = "z"\nt_s = [0.0, 0.0]\n[derivatives]',
            "fitted_trials.0",
            "times t_s that rise",
        ),
        (
            "[derivatives]",
            '[[fitted_trials]]\nname = "z"\nt_s = [0.0, 1.0]\nsignals = {psi_rad = [1.0]}\n[derivatives]',
            "fitted_trials.0",
            "psi_rad has 1 value",
        ),
    ],
)
def test_a_faulty_card_is_refused_with_its_place(old: str, new: str, place: str, expected: str) -> None:
    assert old in SI_CARD
    reported = refusal(SI_CARD.replace(old, new, 1))
    assert reported.startswith("ship.toml: ") and place in reported and expected in reported
    assert len(reported) < 300 or expected == "not a term of (3.8)"  # which lists all terms


def test_a_singular_mass_matrix_is_refused() -> None:
    card = read_card("mariner")
    body, added = card.rigid_body, card.derivatives
    coupling = (body.mass * body.x_G - added["Yrdot"]) * (body.mass * body.x_G - added["Nvdot"])
    singular = body.yaw_inertia - coupling / (body.mass - added["Yvdot"])
    reported = refusal(card.text.replace("Nrdot = -43.8e-5", f"Nrdot = {singular!r}"))
    assert "f4 = 0" in reported and "rigid_body" in reported


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ("Yvdot = -748e-5", "Yvdot = 1748e-5", "not positive"),
        ("max_angle_deg = 40.0", "max_angle_deg = 40.0\nmax_angle_rad = 0.7", "given twice"),
        # in the units of the file
        ("max_angle_deg = 40.0", "max_angle_deg = 120.0", "is 120; a number below 90 "),
    ],
)
def test_what_the_mariner_cannot_have_is_refused(old: str, new: str, expected: str) -> None:
    assert expected in refusal(read_card("mariner").text.replace(old, new))


@pytest.mark.parametrize(
    ("effect", "expected"),
    [
        ('name = "curent"', "did you mean current?"),
        ('name = "current"', "speed_mps: is missing"),
        ('name = "current"\nparameters = {speed_mps = 0.5, direction_deg = 30.0, depth_m = 1.0}', "not a parameter"),
        ('name = "current"\nparameters = {speed_mps = -0.5, direction_deg = 30.0}', "was expected"),
        ('name = "current"\nparameters = {speed_mps = 0.5, direction_deg = 400}', "direction_deg: is 400; -360 to 360"),
    ],
)
def test_a_faulty_effect_is_refused(effect: str, expected: str) -> None:
    assert expected in refusal(f"{SI_CARD}\n[[effects]]\n{effect}\n")


def test_an_effect_given_twice_is_refused() -> None:
    effect = '[[effects]]\nname = "current"\nparameters = {speed_mps = 0.5, direction_deg = 30.0}\n'
    assert "is given twice" in refusal(f"{SI_CARD}\n{effect}{effect}")


def test_a_bundled_name_is_found_in_any_case_and_an_unknown_one_lists_them() -> None:
    assert read_card("MaRiNeR").ship.name == "Mariner class"
    with pytest.raises(InputError, match="mariner"):
        read_card("titanic")


def test_changes_are_made_in_the_conventions_of_the_file() -> None:
    plain, changed = read_card("mariner"), read_card("mariner", {"derivatives.Yd": 300e-5})
    assert plain.derivatives["Yd"] == pytest.approx(-278e-5)
    assert changed.derivatives["Yd"] == pytest.approx(-300e-5)


def test_the_propeller_term_of_a_dimensional_card_is_a_force() -> None:
    text = SI_CARD + "[propulsion]\nnominal_rpm = 60.0\nXnn = 1e5\n"
    assert parse_card(text, "ship.toml").propulsion.Xnn == pytest.approx(1e5 / (500.0 * 100.0**2 * 10.0**2))


def test_a_name_no_file_can_have_is_refused() -> None:
    with pytest.raises(InputError, match="cannot be read"):
        read_card("n" * 300)


def test_line_ends_and_byte_order_mark_are_written_back(tmp_path: Path) -> None:
    data = b"\xef\xbb\xbf" + SI_CARD.encode().replace(b"\n", b"\r\n")
    (tmp_path / "ship.toml").write_bytes(data)
    card = read_card(tmp_path / "ship.toml")
    card.save(tmp_path / "copy.toml")
    assert (tmp_path / "copy.toml").read_bytes() == data
    new = revised(card, {"Yv": (card.derivatives["Yv"], 0.0)}).text
    assert new.startswith("\ufeff\r\nformat") and "# kg\r\n" in new


def test_an_angle_can_be_reported_as_the_file_has_it() -> None:
    effect = '[[effects]]\nname = "current"\nparameters = {speed_mps = 0.5, direction_deg = 30.0}\n'
    card = parse_card(f"{SI_CARD}\n{effect}", "ship.toml")
    place, value = card.in_file("effects.0.parameters.direction_rad", math.pi)
    assert place == "effects.0.parameters.direction_deg" and value == pytest.approx(180.0)
    assert card.in_file("ship.length_m", 3.0) == ("ship.length_m", 3.0)


def test_a_changed_key_of_an_inline_table_leaves_the_card_readable() -> None:
    text = SI_CARD + '\n[[effects]]\nname = "rudder_lag"\nparameters = {time_constant_s = 2.0} # measured\n'
    changed = changed_text(text, "ship.toml", {"effects.0.parameters.time_constant_s": 3.0}, comment="identified")
    assert tomllib.loads(changed)["effects"][0]["parameters"] == {"time_constant_s": 3.0}
    assert changed.count("# measured") == 1


@pytest.mark.parametrize(
    ("key", "problem"),
    [
        (
            "effects.current.parameters.speed_mps",
            "current is not the number of a section; give 0 (rudder_lag), 1 (current)",
        ),
        ("effects.2.parameters.speed_mps", "2 is not the number of a section; give 0 (rudder_lag), 1 (current)"),
        ("effects.1", "it is a section; give effects.1.key=value"),
    ],
)
def test_a_section_of_several_of_one_name_is_set_by_its_place(key: str, problem: str) -> None:
    text = SI_CARD + '\n[[effects]]\nname = "rudder_lag"\n\n[[effects]]\nname = "current"\n'
    with pytest.raises(InputError) as raised:
        changed_text(text, "ship.toml", {key: 0.3})
    assert str(raised.value) == f"ship.toml: {key}: cannot be set: {problem}"
