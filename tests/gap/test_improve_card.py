"""Cards to which effects were added: the same model by whichever way they are written, and a card that is used."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Mapping
from functools import cache

import numpy as np
import pytest

from tank2sim.analysis.stability.straight_line import stability
from tank2sim.cards import ManoeuvringCard, parse_card
from tank2sim.dynamics import Model, build
from tank2sim.dynamics.abkowitz import ALL_TERMS
from tank2sim.dynamics.effects import EFFECTS
from tank2sim.gap.improve_card import _rounded, add_effects_to_card, card_with_effects_text
from tank2sim.units import to_si
from tests.dynamics.effects.ships import TYPICAL, card_with, mariner_text
from tests.marks import first_fast

ON_THE_SHIP = [name for name, effect in EFFECTS.items() if effect.acts_on != "sensor"]
KEYS = [name for name, effect in EFFECTS.items() if effect.in_place_of or effect.changes]
READING = [name for name, effect in EFFECTS.items() if effect.reads_derivatives]


def si(name: str) -> dict[str, float]:
    return dict(to_si(key, value) for key, value in TYPICAL[name].items())


def in_si(text: str) -> str:
    """The card in SI: each prime number times what it was divided by, (rho/2) L^a u0^b, written out."""
    content = tomllib.loads(text)
    rho, length, speed = 1025.0, 160.93, 7.7175
    scales = {"mass": 0.5 * rho * length**3, "yaw_inertia": 0.5 * rho * length**5, "x_G": length}
    for key in content["derivatives"]:
        moment, turns = key[0] == "N", key.count("r")
        if key.endswith("dot"):
            scales[key] = 0.5 * rho * length ** (3 + moment + turns)
        else:
            velocities = key.count("v") + key.count("r") + key.count("u")
            scales[key] = 0.5 * rho * length ** (2 + moment + turns) * speed ** (2 - velocities)
    scales["Xnn"] = 0.5 * rho * length**2 * speed**2
    numbers = {**content["derivatives"], **content["rigid_body"], **content["propulsion"]}
    keys = [line.split("=")[0].strip() for line in text.splitlines()]
    lines = [
        f"{key} = {numbers[key] * scales[key]!r}" if key in scales else line
        for key, line in zip(keys, text.splitlines(), strict=True)
    ]
    return "\n".join(lines).replace('scaling = "prime"', 'scaling = "dimensional"') + "\n"


def bare(text: str) -> str:
    """Without what effects can estimate, and without a steering gear."""
    gone = ("beam_m", "draught_m", "block_coefficient", "projected_area", "time_constant", "max_rate")
    return "\n".join(line for line in text.splitlines() if not line.startswith(gone)) + "\n"


OTHER_SPELLING = {"Yvvr": "Yrvv = 15356e-5", "Ydu": "Yud = 556e-5", "max_rate_degps": "max_rate_radps = 0.087"}
CARDS = {
    "total": mariner_text(),
    "dimensional": in_si(mariner_text()),
    "hydrodynamic": mariner_text(
        yaw_rate_terms='yaw_rate_terms = "hydrodynamic"',
        speed_scale='speed_scale = "nominal"',
        rudder_sign='rudder_sign = "starboard"',
        **OTHER_SPELLING,
    ),
    "little known": bare(mariner_text()),
}
ESTIMATING = ["wind", "wave_drift", "cross_flow_drag", "water_depth", "trim", "roll_coupling", "rudder_lag"]
TRIED = {**dict.fromkeys(CARDS, KEYS), "total": ON_THE_SHIP, "little known": ESTIMATING}


@cache
def read(text: str) -> ManoeuvringCard:
    card = parse_card(text, "ship.toml")
    assert isinstance(card, ManoeuvringCard)
    return card


RNG = np.random.default_rng(3)
MOTIONS = RNG.uniform(-1, 1, (5, 20))


def rates(model: Model) -> np.ndarray:
    """Rates of all states at motions of all kinds; what a model has beside those of the bare ship is excited too."""
    sizes = {"motion.u": 1.5, "motion.v": 1.0, "motion.r": 0.01, "motion.psi": 3.0, "rudder.angle": 0.5}
    found = []
    for numbers in MOTIONS:
        x = [
            sizes.get(name, 0.1) * numbers[place] + (6.5 if name == "motion.u" else 0.0)
            for place, name in enumerate(model.state_names)
        ]
        u = model.input_values()
        for name, value in {"rudder.command": 0.4 * numbers[-1], "propeller.speed": 9.0 * numbers[-2]}.items():
            u[model.input_names.index(name)] = value
        found.append(np.array(model.rhs(x, u, model.parameter_values())).ravel())
    return np.array(found)


def same(found: Model, expected: Model) -> None:
    """Equal rates, to 1e-9 of the largest of each state."""
    assert found.state_names == expected.state_names
    obtained, wanted = rates(found), rates(expected)
    np.testing.assert_allclose(obtained, wanted, rtol=0, atol=1e-9 * np.abs(wanted).max(axis=0).max())
    scale = np.maximum(np.abs(wanted).max(axis=0), 1e-12)
    np.testing.assert_allclose(obtained / scale, wanted / scale, rtol=0, atol=2e-9)


@cache
def bare_rates(kind: str) -> np.ndarray:
    return rates(build(read(CARDS[kind])))


BUILT: dict[str, Model] = {}


def with_all(card: ManoeuvringCard, found: list[tuple[str, Mapping[str, float], Mapping[str, float]]]) -> Model:
    model = BUILT.setdefault(card.text, build(card)) if card.text not in BUILT else BUILT[card.text]
    for name, values, _ in found:
        model = EFFECTS[name].apply(model, values, card)
    return model


@pytest.mark.parametrize(("kind", "name"), [(kind, name) for kind, names in TRIED.items() for name in names])
def test_the_improved_card_has_the_model_that_was_fitted(kind: str, name: str) -> None:
    card = read(CARDS[kind])
    improved = build(add_effects_to_card(card, [(name, si(name), {})]))
    same(improved, with_all(card, [(name, si(name), {})]))
    before, after = bare_rates(kind), rates(improved)
    assert not np.allclose(after[:, : before.shape[1]], before, rtol=1e-7, atol=0), "it does nothing"


@first_fast("other", [*READING, "rudder_stall"])
def test_several_have_the_model_that_was_fitted_in_either_order(other: str) -> None:
    card = read(CARDS["total"])
    changes = ["linear_sway_damping", "cubic_yaw_damping", "rudder_effectiveness"]
    for names in ((*changes, other), (other, *changes)):
        found = [(name, si(name), {}) for name in names]
        improved = add_effects_to_card(card, found)
        same(build(improved), with_all(card, found))
        assert len(improved.effects) == (4 if names[-1] in READING else 1)


@pytest.mark.slow
def test_every_effect_that_reads_derivatives_declares_it() -> None:
    """An effect that does another thing when derivatives are changed before it says that it reads them."""
    card = read(CARDS["total"])
    kinds = (
        "linear_sway_damping",
        "linear_yaw_damping",
        "sway_yaw_coupling",
        "added_sway_mass",
        "rudder_effectiveness",
    )
    changes = [(key, si(key), {}) for key in kinds]
    changed = with_all(card, changes)
    for name in ON_THE_SHIP:
        if name not in KEYS:
            other = (name, si(name), {})
            before = rates(EFFECTS[name].apply(changed, si(name), card))
            after = rates(with_all(card, [other, *changes]))
            apart = not np.allclose(before, after, rtol=1e-9, atol=1e-15)
            assert not apart or name in READING, name


def test_what_the_card_states_is_changed_there_and_the_old_value_is_a_comment() -> None:
    card = read(CARDS["total"])
    error = {"max_rate_radps": math.radians(0.0312)}
    improved = add_effects_to_card(card, [("rudder_rate_limit", {"max_rate_radps": math.radians(2.123456789)}, error)])
    assert not improved.effects and "[[effects]]" not in improved.text
    (line,) = [line for line in improved.text.splitlines() if line.startswith("max_rate_degps")]
    assert line.startswith("max_rate_degps = 2.12346 # was 5.0 before rudder_rate_limit; standard error 0.031")
    lagging = add_effects_to_card(card, [("rudder_lag", {"time_constant_s": 3.0}, {})])
    assert lagging.steering_gear is not None and lagging.steering_gear.time_constant_s == 3.0
    radians = add_effects_to_card(read(CARDS["hydrodynamic"]), [("rudder_rate_limit", {"max_rate_radps": 0.05}, {})])
    assert "max_rate_radps = 0.05 # was 0.087" in radians.text and "degps" not in radians.text.replace("5 deg/s", "")
    new = add_effects_to_card(
        read(CARDS["little known"]), [("rudder_rate_limit", {"max_rate_radps": math.radians(2.5)}, {})]
    )
    assert "max_rate_degps = 2.5 # not stated before" in new.text


def test_derivatives_change_with_the_error_of_the_card_and_of_the_effect() -> None:
    card = read(mariner_text() + "\n[uncertainty]\nNr = 5e-5\n")
    improved = add_effects_to_card(card, [("linear_yaw_damping", {"factor": 0.1}, {"factor": 0.02})])
    # The Mariner's N_r holds -m x_G (total): 0.00166 = m x_G - N_r, and only the rest is magnified.
    bare_part = -166e-5 + 798e-5 * -0.023
    assert improved.derivatives["Nr"] == pytest.approx(-166e-5 + 0.1 * bare_part, rel=1e-5)
    assert improved.uncertainty["Nr"] == pytest.approx(math.hypot(1.1 * 5e-5, 0.02 * bare_part), rel=5e-3)
    assert improved.uncertainty["Yr"] == pytest.approx(
        math.hypot(1.1 * 0.02 * 499e-5, 0.02 * (-499e-5 + 798e-5)), rel=5e-3
    )
    assert "was -166e-5 before linear_yaw_damping" in improved.text
    assert improved.derivatives["Nru"] == pytest.approx(-166e-5 + 0.1 * bare_part, rel=1e-5)  # as N_r, which it equals
    unchanged = set(card.derivatives) - {"Nr", "Yr", "Nru", "Yru"}
    assert all(improved.derivatives[name] == card.derivatives[name] for name in unchanged)
    assert set(improved.uncertainty) == {"Nr", "Yr", "Nru", "Yru"}


def test_every_term_of_the_rudder_is_magnified_and_no_other() -> None:
    card = read(CARDS["hydrodynamic"])
    improved = add_effects_to_card(card, [("rudder_effectiveness", {"factor": -0.2}, {"factor": 0.05})])
    assert set(improved.derivatives) == set(card.derivatives), "nothing is added where there was nothing"
    for name in ALL_TERMS:
        factor = 0.8 if "d" in name.removesuffix("dot") else 1.0
        assert improved.derivatives.get(name, 0.0) == pytest.approx(factor * card.derivatives.get(name, 0.0))
    assert improved.uncertainty["Nd"] == pytest.approx(139e-5 * math.hypot(0.8 * 0.02, 0.05), rel=5e-3)


def test_a_term_that_the_card_has_not_is_added_with_the_error_of_the_effect() -> None:
    found = ("cubic_yaw_damping", {"Yrrr": 1e-3, "Nrrr": -2.0001234e-3}, {"Nrrr": 2e-4})
    for kind in ("total", "dimensional"):
        improved = add_effects_to_card(read(CARDS[kind]), [found])
        assert improved.derivatives["Nrrr"] == pytest.approx(-2e-3, rel=1e-3)
        assert improved.uncertainty["Nrrr"] == pytest.approx(2e-4, rel=5e-3)
        assert "Yrrr" not in improved.uncertainty, "none is known"
    assert "Nrrr = -0.0020001" in add_effects_to_card(read(CARDS["total"]), [found]).text


def test_an_effect_bears_its_parameters_and_their_errors_rounded() -> None:
    values = {"speed_mps": 0.449876543, "direction_rad": math.radians(-121.98765432)}
    errors = {"speed_mps": 0.02, "direction_rad": math.radians(1.0)}
    text = CARDS["total"] + '\n[[effects]] # mine\nname = "rudder_bias"\n[effects.parameters]\nangle_deg = 1.0 # own\n'
    improved = add_effects_to_card(read(text), [("current", values, errors)])
    bias, current = improved.effects
    assert bias.name == "rudder_bias" and current.name == "current"
    assert current.parameters["direction_rad"] == pytest.approx(math.radians(238.01), abs=1e-4)
    assert current.uncertainty == pytest.approx(errors)
    assert "direction_deg = 238.012\n" in improved.text and "speed_mps = 0.44988\n" in improved.text
    assert improved.text.startswith(text.rstrip()), "comments and everything else stay"
    same(build(improved), with_all(read(text), [("current", dict(current.parameters), {})]))


@first_fast("end", ["minimum", "maximum"])
def test_values_at_their_bounds_are_read_again(end: str) -> None:
    names = ["current", "wind", "rudder_bias", "rudder_stall", "rudder_backlash", "rudder_dead_band"]
    for error in (0.0, 0.01):
        values = {
            name: {
                parameter.name: getattr(parameter, end)
                for parameter in EFFECTS[name].parameters
                if parameter.name in si(name)
            }
            for name in names
        }
        build(
            add_effects_to_card(
                read(CARDS["total"]), [(name, values[name], dict.fromkeys(values[name], error)) for name in names]
            )
        )


def test_an_inline_list_of_effects_grows_too() -> None:
    line = 'effects = [{name = "rudder_bias", parameters = {angle_deg = 1.0}}]\n'
    improved = add_effects_to_card(read(line + CARDS["total"]), [("current", si("current"), {"speed_mps": 0.1})])
    assert [entry.name for entry in improved.effects] == ["rudder_bias", "current"]
    assert improved.effects[1].uncertainty == {"speed_mps": 0.1}


def test_particulars_that_were_estimated_are_written_into_the_card() -> None:
    card = read(CARDS["little known"])
    improved = add_effects_to_card(card, [("wind", si("wind"), {})])
    assert improved.ship.projected_area_side_m2 == pytest.approx(0.055 * 160.93**2)
    (line,) = [line for line in improved.text.splitlines() if line.startswith("projected_area_side_m2")]
    assert "# estimated for wind: 0.055 of the length squared, typical" in line
    for name in ESTIMATING:
        notices = build(add_effects_to_card(card, [(name, si(name), {})])).notices
        assert not [notice for notice in notices if "is taken" in notice and "time constant" not in notice], name
    full = add_effects_to_card(read(CARDS["total"]), [("wind", si("wind"), {})])
    assert full.ship == read(CARDS["total"]).ship


def test_faults_of_sensors_never_enter_the_card() -> None:
    card = read(CARDS["total"])
    faults = [(name, si(name), {}) for name, effect in EFFECTS.items() if effect.acts_on == "sensor"]
    assert add_effects_to_card(card, faults) is card
    assert card_with_effects_text(card, faults, ["turn"]) == card.text
    both = add_effects_to_card(card, [*faults, ("current", si("current"), {})])
    assert [entry.name for entry in both.effects] == ["current"]


def test_an_effect_that_the_card_has_is_not_added_again() -> None:
    card = card_with({"current": TYPICAL["current"]})
    with pytest.raises(ValueError, match="has current already"):
        add_effects_to_card(card, [("current", si("current"), {})])


def test_the_file_tells_what_was_added_by_which_trials() -> None:
    for mark in ("", "\ufeff"):
        card = read(mark + CARDS["total"])
        found = [("current", si("current"), {"speed_mps": 0.0213})]
        text = card_with_effects_text(add_effects_to_card(card, found), found, ["turn\n35", "zig\x01zag"])
        assert text.startswith(f"{mark}# current added by tank2sim gap from turn 35, zig zag\n")
        assert "# current: speed 0.4 m/s (standard error 0.021), direction 30 deg\n" in text
        again = read(text)
        assert again.ship.source.endswith("; current added by tank2sim gap from turn\n35, zig\x01zag")
        same(build(again), with_all(card, found))
        assert "# The Mariner class cargo ship in the third-order" in text


@first_fast("name", ["current", "wind", "rudder_rate_limit", "roll_coupling", "flow_memory"])
def test_the_improved_card_is_linearised(name: str) -> None:
    found = [(name, si(name), {})]
    result = stability(
        build(read(card_with_effects_text(add_effects_to_card(read(CARDS["little known"]), found), found, ["turn"])))
    )
    assert np.all(np.isfinite(result.eigenvalues))


def test_a_value_is_rounded_by_its_error_and_without_one_to_ten_digits() -> None:
    assert _rounded(0.123456789, 0.01) == pytest.approx(0.123456789, abs=0.0006)
    assert len(str(_rounded(0.123456789, 0.01))) < len("0.123456789")
    assert _rounded(1.2345678901234, 0.0) == 1.23456789
    assert math.copysign(1.0, _rounded(-0.0, 0.0)) == 1.0
