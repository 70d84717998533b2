"""Models are made once for equal cards, and for no others."""

from __future__ import annotations

import sys
from dataclasses import replace

import numpy as np
import pytest

from tank2sim.cards import ManoeuvringCard, parse_card, read_card
from tank2sim.dynamics import build
from tank2sim.dynamics.effects import EFFECTS
from tank2sim.simulation.integrator import Integrator

SHALLOW = "\n[[effects]]\nname = 'shallow_water'\n[effects.parameters]\nmagnification = 1.2\n"


def test_equal_cards_have_one_model_and_its_compiled_loop() -> None:
    one, other = build(read_card("mariner")), build(read_card("mariner"))
    assert one is other
    x, u, p = (np.array(one.initial(one.parameter_values())).ravel(), one.input_values(), one.parameter_values())
    runs = [Integrator(one).rollout(x, u, p, one.step_s, 5), Integrator(one, compiled=False).rollout(x, u, p, 0.1, 5)]
    np.testing.assert_allclose(*runs, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("what", ["derivatives", "source", "kind of yaw-rate terms"])
def test_a_card_that_differs_in_what_its_text_does_not_show_has_its_own(mariner_card: ManoeuvringCard, what) -> None:
    changes = {
        "derivatives": {"derivatives": {**mariner_card.derivatives, "Yv": -0.0123}},
        "source": {"source": "other.toml"},
        "kind of yaw-rate terms": {"model": mariner_card.model.model_copy(update={"yaw_rate_terms": "hydrodynamic"})},
    }
    changed = replace(mariner_card, **changes[what])
    assert changed.text == mariner_card.text
    one, other = build(mariner_card), build(changed)
    assert one is not other and build(changed) is other
    values = dict(zip(other.parameter_names, other.parameter_values().tolist(), strict=True))
    if what == "derivatives":
        assert values["derivatives.Yv"] == -0.0123
    elif what == "source":
        assert other.origin.startswith("other.toml") and one.origin != other.origin


def test_an_effect_of_the_same_name_in_place_of_another_has_its_own(mariner_card, monkeypatch) -> None:
    card = parse_card(mariner_card.text + SHALLOW, "shallow.toml")
    one = build(card)
    same = replace(EFFECTS["shallow_water"], description="another one")
    monkeypatch.setattr(sys.modules[build.__module__], "EFFECTS", {**EFFECTS, "shallow_water": same})
    assert build(card) is not one and build(card) is build(card)
    monkeypatch.undo()
    assert build(card) is one
