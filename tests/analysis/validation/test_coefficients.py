"""Cards coefficient by coefficient: the same physics in other conventions is the same card."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from tank2sim.analysis.validation.coefficients import SAME, compare_coefficients, compare_effects, expanded_as
from tank2sim.cards import ManoeuvringCard, parse_card, read_card
from tank2sim.dynamics import build


def rows_of(*cards: ManoeuvringCard):
    rows, notes = compare_coefficients(cards)
    return {row.name: row for row in rows}, notes


def in_convention(card: ManoeuvringCard, **changes: object) -> ManoeuvringCard:
    """The card rewritten in another convention and at another speed, by the conversion under test."""
    target = replace(card, model=card.model.model_copy(update=changes))
    found = expanded_as(card, target).coefficients
    values = {name: one.value for name, one in found.items() if name not in ("mass", "yaw_inertia", "x_G")}
    return replace(target, derivatives=values, uncertainty={})


def accelerations(card: ManoeuvringCard, u: float, v: float, r: float, rudder: float) -> np.ndarray:
    model = build(card)
    x = np.array(model.initial(model.parameter_values())).ravel()
    for name, value in (("motion.u", u), ("motion.v", v), ("motion.r", r), ("rudder.angle", rudder)):
        x[model.state_names.index(name)] = value
    y = np.array(model.output(x, model.input_values(), model.parameter_values())).ravel()
    return np.array([y[model.outputs.index(name)] for name in ("motion.udot", "motion.vdot", "motion.rdot")])


def test_a_card_does_not_differ_from_itself(mariner_card) -> None:
    rows, notes = rows_of(mariner_card, mariner_card)
    assert not notes
    for name, value in mariner_card.derivatives.items():
        if value:
            in_file = -value if name.count("d") % 2 and not name.endswith("dot") else value  # rudder positive to port
            assert rows[name].cards[1].value == pytest.approx(in_file, rel=1e-12), name
            # Its own number is no second one that agrees.
            assert rows[name].differences[0].standard_errors is None and rows[name].differences[0].why == SAME


def test_a_difference_is_reported_in_the_root_of_both_variances(mariner_card) -> None:
    first = replace(mariner_card, uncertainty={"Yv": 3e-4})
    other = replace(first, derivatives={**first.derivatives, "Yv": -1160e-5 + 1e-3}, uncertainty={"Yv": 4e-4})
    rows, _ = rows_of(first, other)
    assert rows["Yv"].differences[0].standard_errors == pytest.approx(2.0)
    assert rows["Yv"].differences[0].percent == pytest.approx(100 * 1e-3 / 1160e-5)
    assert rows["Yv"].cards[0].stated and not rows["Nv"].cards[0].stated
    assert rows["Nv"].cards[0].standard_error == pytest.approx(0.02 * 264e-5)


def test_a_number_that_was_taken_over_is_not_compared_however_the_other_card_spells_it(mariner_card) -> None:
    moved = {**mariner_card.derivatives, "Yv": -1160e-5 * (1 + 1e-6)}
    rows, _ = rows_of(mariner_card, in_convention(replace(mariner_card, derivatives=moved), speed_scale="nominal"))
    assert rows["Nv"].differences[0].why == SAME and rows["Nv"].differences[0].standard_errors is None
    assert rows["Yv"].differences[0].standard_errors == pytest.approx(-1e-6 * -1 / (-0.02 * math.sqrt(2)), rel=1e-3)


def test_parameters_of_effects_are_compared_and_those_with_a_unit_at_one_size_alone(mariner_card) -> None:
    def card(Y: float, tau: float) -> ManoeuvringCard:
        text = (
            f"{mariner_card.text}\n[[effects]]\nname = 'propeller_side_force'\n"
            f"parameters = {{Y_prime = {Y}, N_prime = -2e-5}}\nuncertainty = {{Y_prime = 3e-6}}\n"
            f"[[effects]]\nname = 'flow_memory'\n[effects.parameters]\nshare = 0.3\ntime_constant_s = {tau}\n"
        )
        return parse_card(text, "made.toml")

    cards = [card(4e-5, 5.0), card(5e-5, 6.0)]
    names = [name for name in build(cards[0]).parameter_names if name.startswith(("propeller_side", "flow_memory"))]
    rows = {row.name: row for row in compare_effects(cards, [build(one) for one in cards])}
    assert set(rows) == set(names) and rows[names[0]].differences[0].standard_errors == pytest.approx(
        1e-5 / (3e-6 * math.sqrt(2)), rel=1e-9
    )
    assert rows[names[1]].differences[0].why == SAME
    longer = replace(cards[1], ship=cards[1].ship.model_copy(update={"length_m": 300.0}))
    other = {row.name: row for row in compare_effects([cards[0], longer], [build(cards[0]), build(longer)])}
    assert other[names[0]].differences[0].standard_errors is not None
    assert other[names[-1]].differences[0].why == "of a ship of another size"


def test_a_term_that_one_model_has_not_is_reported_and_not_compared(mariner_card) -> None:
    fewer = {name: value for name, value in mariner_card.derivatives.items() if name != "Nvvd"}
    rows, _ = rows_of(mariner_card, replace(mariner_card, derivatives=fewer))
    assert rows["Nvvd"].cards[1].value is None
    assert rows["Nvvd"].differences[0].why == "not in this model"
    assert rows["Nvvd"].differences[0].standard_errors is None


@pytest.mark.parametrize(
    "changes",
    [
        {"yaw_rate_terms": "hydrodynamic"},
        {"speed_scale": "nominal"},
        {"speed_mps": 1.01 * 7.7175},
        {"speed_mps": 0.99 * 7.7175, "yaw_rate_terms": "hydrodynamic", "speed_scale": "nominal"},
    ],
    ids=["inertia", "nominal", "speed", "all"],
)
def test_a_card_in_another_convention_moves_the_ship_alike(mariner_card, changes) -> None:
    """Against the model itself: accelerations agree to the fourth order in the motion, for a small one."""
    other = in_convention(mariner_card, **changes)
    u0 = 7.7175
    apart = []
    for size in (1.0, 0.5):
        motion = (u0 * (1 + 0.02 * size), 0.05 * u0 * size, 0.1 * u0 / 160.93 * size, 0.05 * size)
        one, two = accelerations(mariner_card, *motion), accelerations(other, *motion)
        apart.append(np.max(np.abs(one - two) / (np.abs(one) + 1e-9)))
    assert apart[0] < 5e-3
    # What the third order leaves out falls with the motion; a small part is left of the change of speed.
    assert apart[1] < 0.4 * apart[0] or apart[0] < 1e-4


def test_inertia_leaves_the_yaw_rate_terms_as_the_card_format_says(mariner_card) -> None:
    target = replace(mariner_card, model=mariner_card.model.model_copy(update={"yaw_rate_terms": "hydrodynamic"}))
    rows, notes = rows_of(target, mariner_card)
    mass, x_G = 798e-5, -0.023
    expected = {
        "Yr": -499e-5 + mass,
        "Nr": -166e-5 + mass * x_G,
        "Xrr": 18e-5 - mass * x_G,
        "Xvr": 798e-5 - mass,
        # m (V - u) r is m v^2 r/(2 V) at a drift
        "Yvvr": 15356e-5 - mass / 2,
    }
    for name, value in expected.items():
        own = rows[name].cards[1]
        if abs(value) < 1e-12:
            assert own.value == pytest.approx(0.0, abs=1e-12)
        else:
            assert own.value == pytest.approx(value, rel=1e-9), name
    assert any("yaw rate terms" in note for note in notes)


def test_a_model_and_her_ship_have_the_same_coefficients(mariner_card) -> None:
    ratio = 25.0
    ship = mariner_card.ship.model_copy(update={"length_m": 160.93 / ratio})
    model = mariner_card.model.model_copy(update={"speed_mps": 7.7175 / math.sqrt(ratio)})
    rows, notes = rows_of(mariner_card, replace(mariner_card, ship=ship, model=model))
    assert not notes
    assert rows["Nvu"].differences[0].why == SAME


def test_a_speed_outside_the_cards_range_is_not_extrapolated_to(mariner_card) -> None:
    model = mariner_card.model.model_copy(update={"speed_mps": 3.0, "valid_speed_mps": (1.5, 3.6)})
    rows, _ = rows_of(replace(mariner_card, model=model), mariner_card)
    assert "outside the range" in rows["Yv"].differences[0].why  # it has a Yvu
    assert rows["Xvr"].differences[0].why == SAME  # and this no slope
    assert "revolutions" in rows["Xu"].differences[0].why


def test_of_a_linear_card_only_the_linear_terms_are_compared() -> None:
    card = read_card("kvlcc2-captive").manoeuvring()
    linear = replace(card, model=card.model.model_copy(update={"kind": "linear"}))
    rows, _ = rows_of(card, linear)
    assert rows["Nd"].differences[0].why == SAME
    assert rows["Nvvv"].differences[0].why == "not in the linear model"
