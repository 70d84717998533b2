"""Every effect: what it declares, and what holds of each, whatever it is."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from dataclasses import replace
from functools import cache
from pathlib import Path

import casadi as ca
import numpy as np
import pytest

import tank2sim
from tank2sim.analysis.linearisation import state_space, straight_course
from tank2sim.cards import ManoeuvringCard, parse_card
from tank2sim.dynamics import build
from tank2sim.dynamics.abkowitz import ALL_TERMS
from tank2sim.dynamics.effects import EFFECTS, Effect, acting_variable, undisturbed_inputs
from tank2sim.dynamics.effects.effect import sensor_fault_of
from tank2sim.dynamics.model import Parameter, Quantity
from tank2sim.errors import InputError
from tank2sim.fmu.interface import interface
from tank2sim.simulation.scheme import runge_kutta_step
from tank2sim.units import from_si, to_si

from .ships import FORCES, STATES, TYPICAL, card_with, forces, mariner_text, ship, state, values

OUTPUTS = [*FORCES, "motion.udot", "motion.vdot", "motion.rdot", "motion.xdot", "motion.ydot"]

ON_THE_SHIP = [name for name, effect in EFFECTS.items() if effect.acts_on != "sensor"]


def test_every_effect_of_the_library_is_tried_here() -> None:
    assert set(EFFECTS) == set(TYPICAL)


@pytest.mark.parametrize("name", TYPICAL)
def test_an_effect_says_what_it_is_and_where_it_comes_from(name: str) -> None:
    effect = EFFECTS[name]
    assert effect.name == name and effect.description.endswith(".") and effect.source
    assert all(one.lowest(card_with()) < one.maximum for one in effect.parameters)


@pytest.mark.parametrize("name", TYPICAL)
def test_parameters_become_named_variables_that_start_at_the_cards_values(name: str) -> None:
    model, effect = ship({name: TYPICAL[name]}), EFFECTS[name]
    names = effect.model_names()
    given = dict(to_si(key, value) for key, value in TYPICAL[name].items())
    for parameter in effect.parameters:
        variable = model[names[parameter.name]]
        if isinstance(variable, Parameter):
            assert variable.name == f"{name}.{re.sub('_(rad|radps|mps|m|s|N|prime)$', '', parameter.name)}"
            assert variable.tunable and (variable.minimum, variable.maximum) == (parameter.minimum, parameter.maximum)
        if parameter.name in given:
            assert variable.start == pytest.approx(given[parameter.name])


@pytest.mark.parametrize("name", ON_THE_SHIP)
def test_typical_parameters_change_something(name: str) -> None:
    at = {
        **state(6.5, 0.5, 0.01, 0.5),
        **{"motion.psi": 0.7, "rudder.command": 0.45, "propeller.speed": -5.0, "motion.phi": 0.02},
    }
    at["azimuth.revolutions_actual_1"] = 8.0
    if name == "controllable_pitch":  # a propeller that turns ahead
        at["propeller.speed"] = 5.0
    model, bare = ship({name: TYPICAL[name]}), ship()
    names = [*OUTPUTS, "rudder.rate"]
    known = {key: value for key, value in at.items() if key in bare}
    found, without = values(model, names, at), values(bare, names, known)
    assert np.max(np.abs(found - without) / np.abs(without)) > 1e-6


@pytest.mark.parametrize("name", TYPICAL)
def test_a_model_with_an_effect_is_trimmed_linearised_and_integrated(name: str) -> None:
    model = ship({name: TYPICAL[name]})
    x = np.array(model.initial(model.parameter_values())).ravel()
    u, p = model.input_values({"rudder.command": 0.2}), model.parameter_values()
    trimmed = x
    for _ in range(15):
        trimmed = np.array(model.trim_step(trimmed, u, p)).ravel()
    steady = [place for place, one in enumerate(model.states) if one.steady]
    assert np.max(np.abs(np.array(model.rhs(trimmed, u, p)).ravel()[steady])) < 1e-12
    system = state_space(model, straight_course(model))
    assert np.all(np.isfinite(system.A)) and np.all(np.isfinite(system.B))
    step = runge_kutta_step(model)
    for _ in range(20):
        x = np.array(step(x, u, p, model.step_s)).ravel()
    assert np.all(np.isfinite(x))


@pytest.mark.parametrize("name", TYPICAL)
def test_slopes_are_finite_where_nothing_happens(name: str) -> None:
    """Straight ahead with the rudder midships, |.|, limits and roots have their corners."""
    model = ship({name: TYPICAL[name]})
    slope = ca.Function("slope", [model.x, model.u, model.p], [ca.jacobian(model.rates, ca.vcat([model.x, model.p]))])
    x = np.array(model.initial(model.parameter_values())).ravel()
    assert np.all(np.isfinite(np.array(slope(x, model.input_values(), model.parameter_values()))))


@pytest.mark.parametrize("name", TYPICAL)
def test_values_out_of_bounds_are_refused_with_their_key(name: str) -> None:
    for key in TYPICAL[name]:
        si, _ = to_si(key, 1.0)
        bounds = {one.name: one for one in EFFECTS[name].parameters}[si]
        for wrong in (bounds.lowest(card_with()) - 0.1, bounds.maximum + 0.1):
            with pytest.raises(InputError, match=rf"effects\.0\.parameters\.{key}.* was expected"):
                ship({name: {**TYPICAL[name], key: from_si(key, wrong)}})


@pytest.mark.parametrize("name", TYPICAL)
def test_a_missing_or_unknown_parameter_is_refused(name: str) -> None:
    for key in TYPICAL[name]:
        rest = {other: value for other, value in TYPICAL[name].items() if other != key}
        with pytest.raises(InputError, match=r"effects\.0\.parameters.*is missing"):
            ship({name: rest})
    with pytest.raises(InputError, match="is not a parameter of"):
        ship({name: {**TYPICAL[name], "strength": 1.0}})


@pytest.mark.parametrize("name", TYPICAL)
def test_an_fmu_can_declare_every_variable_of_an_effect(name: str) -> None:
    declared = {one.name: one for one in interface(ship({name: TYPICAL[name]})).variables}
    for own in EFFECTS[name].model_names().values():
        one = declared[own]
        assert one.start is not None and one.description and one.nominal != 0
        assert one.minimum is None or one.minimum <= one.start
        assert one.maximum is None or one.start <= one.maximum


ODD = [
    "rudder_effectiveness", "rudder_slipstream", "rudder_stall", "cross_flow_drag", "cubic_yaw_damping",
    "sway_yaw_coupling", "turning_drag", "added_yaw_inertia", "linear_yaw_damping", "linear_sway_damping",
    "shallow_water", "hull_fouling", "engine_droop", "flow_memory", "roll_coupling", "trim", "hump_resistance",
    "loading",
]  # fmt: skip
EVEN = ["propeller_side_force", "bank_suction", "bank", "asymmetric_turning", "loading_side_force"]
SYMMETRIC = mariner_text(
    **{name: f"{name} = 0.0" for name in ("Y0", "Y0u", "Y0uu", "N0", "N0u", "N0uu")},
    speed_scale='speed_scale = "nominal"',
)


@pytest.mark.parametrize("name", ODD)
def test_effects_alike_to_both_sides_keep_a_symmetric_ship_symmetric(name: str) -> None:
    model = ship({name: TYPICAL[name]}, SYMMETRIC)
    at = {**STATES[1], "motion.phi": 0.05, "motion.p": 0.01, "flow_memory.v": 0.3}
    at = {key: value for key, value in at.items() if key in model}
    mirrored = {key: value if key == "motion.u" else -value for key, value in at.items()}
    names = [*FORCES, "motion.udot", "motion.vdot", "motion.rdot"]
    signs = np.array([1, -1, -1, 1, -1, -1])
    np.testing.assert_allclose(values(model, names, mirrored), values(model, names, at) * signs, rtol=1e-11)


@pytest.mark.parametrize("name", EVEN)
def test_one_sided_effects_push_the_same_way_in_both_turns(name: str) -> None:
    at = STATES[1]
    mirrored = {key: value if key == "motion.u" else -value for key, value in at.items()}
    model, bare = ship({name: TYPICAL[name]}), ship()
    one, other = (forces(model, place) - forces(bare, place) for place in (at, mirrored))
    np.testing.assert_allclose(one, other, rtol=1e-8, atol=1e-6)
    assert np.all(one[1:] != 0)


def test_effects_stand_on_top_of_each_other_in_any_order() -> None:
    names = ["wind", "current", "rudder_bias", "rudder_stall", "linear_yaw_damping", "shallow_water", "rudder_backlash"]
    at = {**STATES[1], "motion.psi": 0.7, "rudder.command": 0.2}
    several = {name: TYPICAL[name] for name in names}
    backwards = {name: TYPICAL[name] for name in reversed(names)}
    wanted = [*OUTPUTS, "rudder.rate"]
    np.testing.assert_allclose(values(ship(several), wanted, at), values(ship(backwards), wanted, at), rtol=1e-11)


def test_effects_say_what_they_miss_in_a_card() -> None:
    with pytest.raises(InputError, match="propulsion: is missing"):
        ship({"propeller_walk": TYPICAL["propeller_walk"]}, mariner_text().split("[propulsion]")[0])
    with pytest.raises(InputError, match="a linear model has no Yrrr"):
        ship({"cubic_yaw_damping": TYPICAL["cubic_yaw_damping"]}, mariner_text(kind='kind = "linear"'))


@pytest.mark.slow
def test_the_linear_model_takes_the_effects_that_it_can() -> None:
    linear = mariner_text(kind='kind = "linear"')
    refused = []
    for name, parameters in TYPICAL.items():
        try:
            found = forces(ship({name: parameters}, linear), state(7.0, 0.2, 0.002, 0.1))
            assert np.all(np.isfinite(found))
        except InputError:
            refused.append(name)
    assert refused == ["cubic_yaw_damping", "sway_yaw_coupling", "turning_drag"]


def test_cards_without_an_effect_have_none_of_its_variables() -> None:
    assert not [one.name for one in ship().variables if one.name.split(".")[0] in EFFECTS]
    assert card_with().effects == ()


SOURCE = Path(tank2sim.__file__).parent

OTHER_MEANINGS = {
    '"trim" in function': "part of the name of a generated function",
    'lacking("trim"': "caution on the trim of a towed model",
    '"trim",': "the same caution",
    'Signal("current"': "current of a motor",
    '"current": "current_A"': "the same",
    '"wind" if true else': "part of the name of a quantity of a log",
    'quantity.startswith("wind")': "the same",
    'startswith(("wind", "current"))': "beginnings of the names of columns",
    'in ("max", "current")': "names of files of the system",
    '"bank": _Kind(': "kind of a feature of a scenario",
    'document.pop("waves"': "section of a card",
    '"water_depth": np.inf': "argument of a solver",
    '"loading": (': "parameter of loaded_rudder",
}
"""Lines, by a part of them, in which the name of an effect is another word, and what it is there."""


PARAMETERS_NAMED_ALIKE = {"loaded_rudder.py": ("loading",), "loading.py": ("trim",)}
"""Parameters of effects that have the name of another effect."""


def changed(name: str) -> set[str]:
    """Derivatives of the Mariner that an effect changes, found by values of quantities that are these derivatives."""
    given = parse_card(mariner_text(), "ship.toml")
    assert isinstance(given, ManoeuvringCard)
    # Each derivative by its speed is there: a factor of none changes nothing.
    card = replace(given, derivatives=dict.fromkeys(ALL_TERMS, 1e-4) | dict(given.derivatives))
    model = build(card)
    names = [term for term in ALL_TERMS if f"derivatives.{term}" in model]
    asked = [
        Quantity(name=f"asked.{term}", unit="1", description=term, value=model.symbol(f"derivatives.{term}"))
        for term in names
    ]
    parameters = dict(to_si(key, value) for key, value in TYPICAL[name].items())
    after = EFFECTS[name].apply(model.extend(*asked), parameters, card)
    at = state(6.5, 0.5, 0.01, 0.1)
    quantities = [f"asked.{term}" for term in names]
    pairs = zip(names, values(model.extend(*asked), quantities, at), values(after, quantities, at), strict=True)
    return {term for term, without, found in pairs if found != without}


@pytest.mark.parametrize("name", [name for name in TYPICAL if EFFECTS[name].acts_on != "sensor"])
def test_an_effect_declares_the_derivatives_that_it_changes(name: str) -> None:
    effect = EFFECTS[name]
    found = changed(name)
    if effect.magnified_by:
        assert not found and all("d" in term for term in effect.changes)  # it changes the forces of these terms
    elif effect.reads_derivatives:
        assert not effect.changes
    else:
        assert set(effect.changes) == found


@pytest.mark.parametrize("name", [name for name, effect in EFFECTS.items() if effect.in_place_of])
def test_what_acts_in_place_of_the_steering_gear_is_found(name: str) -> None:
    model = ship({name: TYPICAL[name]})
    for parameter, replaced in EFFECTS[name].in_place_of.items():
        variable = EFFECTS[name].model_names()[parameter]
        assert acting_variable(model, replaced) == variable in model.parameter_names
        assert replaced not in model.parameter_names
        assert acting_variable(ship(), replaced) == replaced in ship().parameter_names


@pytest.mark.parametrize("name", [name for name, effect in EFFECTS.items() if effect.states_behind])
def test_a_state_behind_an_order_is_one_of_the_model(name: str) -> None:
    model = ship({name: TYPICAL[name]})
    for declared, order in EFFECTS[name].states_behind.items():
        assert declared in model.state_names and order in model.input_names


def test_without_disturbances_there_is_no_current_and_no_wind() -> None:
    disturbed = ship({name: TYPICAL[name] for name in ("current", "wind", "water_depth")})
    assert undisturbed_inputs(disturbed) == {"current.speed": 0.0, "wind.speed": 0.0}
    assert undisturbed_inputs(ship()) == {}


@pytest.mark.parametrize("effect", EFFECTS.values(), ids=lambda effect: effect.name)
def test_no_built_in_effect_is_at_fault(effect: Effect) -> None:
    assert sensor_fault_of(effect) == ""


def builtin() -> list[str]:
    return [name for name in EFFECTS if EFFECTS.origin(name) is None]


@cache
def names_of_effects() -> set[str]:
    variables = {name for effect in EFFECTS.values() for name in effect.model_names().values()}
    inputs = {parameter.input_name for effect in EFFECTS.values() for parameter in effect.parameters}
    return set(builtin()) | (variables - inputs)


def names_quoted(source: str, path: str) -> Iterator[tuple[int, str]]:
    """Line and text of each string that is the name of an effect, or of the model's variable for its parameter."""
    known = names_of_effects()
    if not re.search(
        f"""["'](?:{"|".join(map(re.escape, known))})["']""", source
    ):  # most modules, which need not be taken apart
        return
    for node in ast.walk(ast.parse(source, path)):
        if isinstance(node, ast.Constant) and node.value in known:
            yield node.lineno, node.value


def quoted_elsewhere() -> Iterator[tuple[str, str]]:
    for path in sorted(SOURCE.rglob("*.py")):
        if SOURCE / "dynamics" / "effects" not in path.parents:
            source = path.read_text(encoding="utf-8")
            for line, name in names_quoted(source, str(path)):
                yield f"{path.relative_to(SOURCE)}:{line}: {name}", source.splitlines()[line - 1].strip()


def test_no_other_module_quotes_the_name_of_an_effect() -> None:
    quoted = list(quoted_elsewhere())
    assert [place for place, line in quoted if not any(part in line for part in OTHER_MEANINGS)] == []
    unused = [part for part in OTHER_MEANINGS if not any(part in line for _, line in quoted)]
    assert unused == [], "exceptions that nothing needs any more"


def test_a_quoted_name_is_seen() -> None:
    source = 'def f(x):\n    if x == "rudder_lag":\n        return {"rudder_bias.angle": "rudder_lags"}\n'
    assert list(names_quoted(source, "f.py")) == [(2, "rudder_lag"), (3, "rudder_bias.angle")]


def families() -> dict[str, str]:
    folder = SOURCE / "dynamics" / "effects"
    return {path.name: path.read_text(encoding="utf-8") for path in folder.glob("*.py")}


def test_a_family_of_effects_quotes_no_effect_of_another() -> None:
    texts = families()
    family = {name: file for file, text in texts.items() for name in builtin() if f'    name="{name}",' in text}
    assert set(family) == set(builtin())
    for file, text in texts.items():
        quoted = [name for _, name in names_quoted(text, file) if family[name.partition(".")[0]] != file]
        foreign = [name for name in quoted if name not in PARAMETERS_NAMED_ALIKE.get(file, ())]
        assert foreign == [], file
