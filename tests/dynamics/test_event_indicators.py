"""Event indicators found in the equations: they change sign where the right-hand side has a kink; none stays at 0."""

from __future__ import annotations

import math

import casadi as ca
import numpy as np
import pytest

from tank2sim.cards import parse_card, read_card
from tank2sim.dynamics import Model, build
from tank2sim.dynamics.event_indicators import EVENT_SHIFT, kinks
from tests.fmu.conftest import coasting_body, gain, steered_hull


def with_effect(name: str, **parameters: float) -> Model:
    lines = [f"{key} = {value}" for key, value in parameters.items()]
    text = (
        read_card("mariner").text + f'\n[[effects]]\nname = "{name}"\n[effects.parameters]\n' + "\n".join(lines) + "\n"
    )
    return build(parse_card(text, "test"))


def indicated(model: Model, rudder: float, order: float) -> dict[str, float]:
    """Values of the indicators at a rudder angle and order (rad)."""
    found = kinks(model)
    values = ca.Function("z", [model.x, model.u, model.p], [ca.vcat([kink.value for kink in found])])
    x = np.array(model.initial(model.parameter_values())).ravel()
    x[model.state_names.index("rudder.angle")] = rudder
    answer = np.array(values(x, model.input_values({"rudder.command": order}), model.parameter_values())).ravel()
    return {kink.name: float(value) for kink, value in zip(found, answer, strict=True)}


def test_the_rate_limit_of_a_gear_is_indicated_where_it_is_reached() -> None:
    hull, limit = steered_hull(), math.radians(5.0)
    assert {kink.name for kink in kinks(hull)} == {"kinks.rudder.rate[1]", "kinks.rudder.rate[2]"}
    for side in (-1, 1):
        inside, outside = (indicated(hull, 0.0, side * limit * share) for share in (0.999, 1.001))
        changed = [name for name in inside if (inside[name] > 0) != (outside[name] > 0)]
        assert len(changed) == 1


def test_what_stays_at_a_kink_has_an_indicator_that_is_not_zero() -> None:
    mariner = build(read_card("mariner"))
    largest = mariner.parameter_values()[mariner.parameter_names.index("steering.max_angle")]
    assert min(abs(value) for value in indicated(mariner, largest, largest).values()) >= 0.5 * EVENT_SHIFT


def test_models_without_kinks_have_no_indicators() -> None:
    assert kinks(gain()) == ()
    assert kinks(coasting_body()) == ()


def test_an_effect_with_a_kink_is_indicated_without_a_word_from_it() -> None:
    plain = {kink.name for kink in kinks(build(read_card("mariner")))}
    banded = with_effect("rudder_dead_band", half_width_deg=2.0)
    names = {kink.name for kink in kinks(banded)}
    assert plain <= names
    assert len(names) == len(plain) + 2
    inside, outside = (indicated(banded, 0.0, math.radians(order)) for order in (1.9, 2.1))
    assert [name for name in names if (inside[name] > 0) != (outside[name] > 0)]


@pytest.mark.parametrize("name", ["rudder_backlash", "rudder_stall"])
def test_indicators_depend_on_states_or_inputs(name: str) -> None:
    given = {"rudder_backlash": {"width_deg": 3.0}, "rudder_stall": {"angle_deg": 20.0, "loss": 0.4}}[name]
    model = with_effect(name, **given)
    found = kinks(model)
    assert len(found) > len(kinks(build(read_card("mariner"))))
    assert all(ca.depends_on(kink.value, ca.vertcat(model.x, model.u)) for kink in found)
