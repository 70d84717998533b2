"""What effects declare of themselves is what they do, and nothing but these declarations names them elsewhere."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from dataclasses import replace
from functools import cache
from pathlib import Path

import pytest

import tank2sim
from tank2sim.cards import ManoeuvringCard, parse_card
from tank2sim.dynamics import build
from tank2sim.dynamics.abkowitz import ALL_TERMS
from tank2sim.dynamics.effects import EFFECTS, Effect, acting_variable, undisturbed_inputs
from tank2sim.dynamics.effects.effect import sensor_fault_of
from tank2sim.dynamics.model import Quantity
from tank2sim.units import to_si

from .ships import TYPICAL, mariner_text, ship, state, values

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
    '"bank": "Polygon"': "kind of a feature of a scenario",
    '"bank": {}': "the same",
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
