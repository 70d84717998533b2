"""What rules for simulators ask of a ship's model: each row follows from the inputs that the model has."""

from __future__ import annotations

import pytest

from tank2sim.cards import read_card
from tank2sim.dynamics import build
from tank2sim.dynamics.model import Model
from tank2sim.dynamics.simulator_interface import with_external_forces
from tank2sim.fmu.passport import Shown, simulator_rules
from tests.dynamics.effects.ships import TYPICAL, ship

ALWAYS = {
    "hydrodynamic forces allowed for", "prediction of forces", "modelling of forces", "integration method",
    "simulation software",
}  # fmt: skip
OF_THE_BRIDGE = {
    "operating environment in real time: instruments and controls", "visual scenario as seen from the bridge",
    "communication with vessel traffic services",
}  # fmt: skip


def shown(model: Model, *, manoeuvres: bool = False, errors: bool = False) -> set[str]:
    rows = simulator_rules(model, manoeuvres=manoeuvres, errors=errors)
    assert {row.subject for row in rows if row.shown == Shown.NOT_APPLICABLE} == OF_THE_BRIDGE
    return {row.subject for row in rows if row.shown == Shown.SHOWN}


@pytest.mark.parametrize(
    ("effect", "subject"),
    [
        ("current", "tidal stream, currents"),
        ("current_field", "tidal stream, currents"),
        ("wind", "effects of weather: wind"),
        ("wind_field", "effects of weather: wind"),
        ("waves", "effects of weather: waves"),
        ("wave_drift", None),
        ("bank", None),
        ("other_ship", None),
    ],
)
def test_current_wind_and_waves_are_shown_by_the_model_that_has_their_inputs(effect: str, subject: str | None) -> None:
    assert shown(ship({effect: TYPICAL[effect]})) == ALWAYS | ({subject} if subject else set())


def test_a_model_without_effects_shows_none_of_them_and_manoeuvres_and_errors_as_they_are() -> None:
    assert shown(ship()) == ALWAYS
    run = {"own ship dynamics in open water", "simulated manoeuvres"}
    assert shown(ship(), manoeuvres=True) == ALWAYS | run
    assert shown(ship(), errors=True) == ALWAYS | {"potential causes of prediction error"}


def test_only_the_model_of_a_ship_with_a_rudder_has_rows() -> None:
    assert simulator_rules(build(read_card("otter")), manoeuvres=True, errors=True) == ()


def test_remarks_name_the_inputs_from_outside_the_heel_and_the_step() -> None:
    def remark(model: Model, subject: str) -> str:
        (row,) = (row for row in simulator_rules(model, manoeuvres=True, errors=True) if row.subject == subject)
        return row.remark

    six, others = "motion in six degrees of freedom", "interaction with other ships"
    model = ship()
    assert "external" not in remark(model, others) and "external.*" in remark(with_external_forces(model), others)
    assert "roll" not in remark(model, six) and "roll" in remark(build(read_card("container")), six)
    assert f"{model.step_s:.3g} s" in remark(model, "integration method")
    errors = "potential causes of prediction error"
    (none,) = (row for row in simulator_rules(model, manoeuvres=True, errors=False) if row.subject == errors)
    assert "no standard error" in none.remark and "no standard error" not in remark(model, errors)
