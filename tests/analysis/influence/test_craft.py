"""Influence on the figures of a craft with thrusters, against closed forms and against central differences."""

from __future__ import annotations

import numpy as np
import pytest

from tank2sim.analysis.influence.card_influence import influence
from tank2sim.analysis.influence.figures import parse_figure
from tank2sim.analysis.influence.study import Study
from tank2sim.cards import CraftCard, read_card
from tank2sim.errors import InputError
from tests.cards.made_craft import craft_card

# Linear damping, thrust as strong astern as ahead: a spin has neither surge nor sway.
LINEAR = craft_card(
    *(60.0, 15.0, {"Xu": -80.0, "Yv": -160.0, "Nr": -90.0}),
    speed_mps=0.5,
    ahead_Ns2=0.01,
    astern_Ns2=0.01,
    max_rpm=900.0,
)
RADPS = 600 * np.pi / 30


def study_of(card, *texts: str) -> Study:
    return Study(card, [parse_figure(text) for text in texts])


def test_top_speed_and_spin_have_the_influence_of_their_closed_forms() -> None:
    study = study_of(LINEAR, "final_speed_mps@straight:600", "final_rate_degps@spin:600")
    found = influence(study)
    # u = 2 k n^2 / -Xu,  r = 2 k n^2 y / -Nr
    assert found.values == pytest.approx([0.02 * RADPS**2 / 80, np.degrees(0.02 * RADPS**2 * 0.4 / 90)], rel=1e-4)
    names = [parameter.short for parameter in found.parameters]
    exact = {name: found.exact[:, place] for place, name in enumerate(names)}
    assert exact["Xu"] == pytest.approx([-10, 0], abs=0.01)
    assert exact["Nr"] == pytest.approx([0, -10], abs=0.01)
    assert exact["port.ahead"] == pytest.approx([5, 5], abs=0.01)
    assert exact["starboard.astern"] == pytest.approx([0, 5], abs=0.01)
    assert exact["port.y"] == pytest.approx([0, 5], abs=0.01)
    assert exact["mass"] == pytest.approx([0, 0], abs=0.01)


@pytest.mark.slow
def test_slopes_of_a_turn_are_its_central_differences() -> None:
    texts = ("advance_m@difference:-200", "steady_diameter_m@difference:-200", "steady_rate_degps@difference:-200")
    study = study_of(read_card("otter"), *texts)
    values, slopes = study.slopes_at(study.values)
    assert values[2] < 0 < values[1]
    for place, parameter in enumerate(study.parameters):
        if parameter.name not in ("derivatives.Nrabsr", "thrusters.port.ahead", "ship.x_G"):
            continue
        step = np.zeros(len(study.values))
        step[place] = 1e-4 * parameter.value
        above, below = study.figures_at(study.values + step), study.figures_at(study.values - step)
        assert slopes[:, place] * 2 * step[place] == pytest.approx(above - below, rel=2e-3), parameter.name


def test_figures_without_a_name_are_of_what_the_craft_can_do() -> None:
    from tank2sim.api.influence import default_figures

    card = read_card("otter")
    assert isinstance(card, CraftCard)
    families = {figure.kind.family for figure in default_figures(card)}
    assert families == {"straight run", "turn by difference", "spin"}


@pytest.mark.parametrize("text", ["criterion_C", "steady_radius_m@20", "advance_m@35", "final_rate_degps@spin:5000"])
def test_a_figure_that_a_craft_cannot_show_is_refused(text) -> None:
    with pytest.raises(InputError):
        study_of(read_card("otter"), text)


@pytest.mark.parametrize("text", ["advance_m@spin:400", "final_speed_mps@straight:", "final_speed_mps@straight:0"])
def test_a_figure_that_does_not_exist_is_refused(text) -> None:
    with pytest.raises(InputError, match="figures"):
        parse_figure(text)


def test_a_ship_with_a_rudder_does_not_spin() -> None:
    with pytest.raises(InputError, match="thrusters"):
        study_of(read_card("mariner"), "final_rate_degps@spin:400")
