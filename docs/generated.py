"""Parts of the manual that are read off the program: effects, commands, and the reference of its modules.

A page asks for one by a comment of its own, ``<!-- effects -->``, ``<!-- commands -->``, ``<!-- reference: cards -->``,
``<!-- keys: Glider -->``, ``<!-- schemas -->``, ``<!-- project choices -->``, ``<!-- benchmark records -->`` or
``<!-- fmu: mariner -->``; nothing is written into the sources.
"""

from __future__ import annotations

import ast
import importlib
import json
import math
import pkgutil
import re
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from itertools import pairwise
from pathlib import Path

import click
from pydantic import BaseModel
from pydantic_core import PydanticUndefined
from sphinx.application import Sphinx
from sphinx.util import logging

import tank2sim
from tank2sim.api.results import commands_with_results, json_schema
from tank2sim.apps.design import tank_form
from tank2sim.apps.rigs import kinds as rig_kinds
from tank2sim.apps.rigs.glider import card as glider_card
from tank2sim.apps.rigs.yaw import card as yaw_card
from tank2sim.cards import form, read_card
from tank2sim.cli import COMMANDS
from tank2sim.cli import tank2sim as program
from tank2sim.dynamics import build
from tank2sim.dynamics.effects import EFFECTS, Effect, EffectParameter
from tank2sim.dynamics.simulator_interface import with_simulator_interface
from tank2sim.fmu.interface import FmuVariable, interface
from tank2sim.records import campaign_form

SOURCES = Path(tank2sim.__file__).parent

FORMS = (form, campaign_form, tank_form, glider_card, rig_kinds, yaw_card)
"""Modules with the sections and keys of cards and campaigns."""

_CHOICE = re.compile(r"project\s+choice", re.IGNORECASE)

logger = logging.getLogger(__name__)

FAMILIES = {
    "surroundings": "Surroundings",
    "fields": "Surroundings",
    "waves": "Surroundings",
    "banks": "Surroundings",
    "ships_near": "Surroundings",
    "depth": "Surroundings",
    "propeller": "Propeller and engine",
    "controllable_pitch": "Propeller and engine",
    "twin_screws": "Propeller and engine",
    "harbour": "Thrusters and tugs",
    "azimuths": "Thrusters and tugs",
    "rudder": "Rudder",
    "loaded_rudder": "Rudder",
    "gear": "Steering gear",
    "hull": "Hull",
    "derivatives": "Hull: derivatives and masses",
    "loading": "Hull: derivatives and masses",
    "dynamic_effects": "Hull: states of their own",
    "sensors": "Sensors",
}
"""Module of an effect's equations to the heading under which a reader looks for it."""

OTHERS = "From installed packages"
"""Heading of the effects that are not built in."""

_SUFFIXES = {"rad": ("deg", 180 / math.pi), "radps": ("degps", 180 / math.pi)}
_UNITS = {"deg": "deg", "degps": "deg/s", "mps": "m/s", "m": "m", "s": "s", "N": "N", "prime": "prime"}


def effects() -> str:
    """Every effect with its parameters, units and bounds, by family."""
    text: list[str] = []
    family = ""
    families = [*FAMILIES.values(), OTHERS]
    for effect in sorted(EFFECTS.values(), key=lambda one: families.index(_family(one))):
        if _family(effect) != family:
            family = _family(effect)
            text += [f"## {family}", ""]
        text += _effect(effect)
    return "\n".join(text)


def _family(effect: Effect) -> str:
    if EFFECTS.origin(effect.name):
        return OTHERS
    return next(
        family
        for module, family in FAMILIES.items()
        if effect in vars(importlib.import_module(f"tank2sim.dynamics.effects.{module}")).values()
    )


def _effect(effect: Effect) -> list[str]:
    origin = EFFECTS.origin(effect.name)
    whence = f"[Equation, source and test](../theory/effects.md#{effect.name})."
    if origin:
        whence = f"From the package {_text(origin.distribution)}. Source: {_text(effect.source)}."
    return [
        *[f"### `{effect.name}`", "", f"{effect.description} Acts on: {effect.acts_on}. {whence}", ""],
        *["| parameter | unit | bounds | where the card gives none | meaning |", "|---|---|---|---|---|"],
        *(_parameter(one) for one in effect.parameters),
        "",
    ]


def _parameter(one: EffectParameter) -> str:
    stem, suffix, factor = one.stem, one.name.removeprefix(one.stem).lstrip("_"), 1.0
    if suffix in _SUFFIXES:
        suffix, factor = _SUFFIXES[suffix]
    name = f"{stem}_{suffix}" if suffix else stem
    lowest = "by the card" if callable(one.minimum) else f"{one.minimum * factor:.4g}"
    bounds = f"{lowest} to {one.maximum * factor:.4g}"
    default = "required" if one.default is None else "by the card" if callable(one.default) else _number(one, factor)
    held = f" (input `{one.input_name}`)" if one.input_name else ""
    return f"| `{name}` | {_UNITS.get(suffix, '1')} | {bounds} | {default} | {_text(one.description)}{held} |"


def _number(one: EffectParameter, factor: float) -> str:
    assert isinstance(one.default, int | float)
    return f"{one.default * factor:.4g}"


def _text(words: str) -> str:
    return re.sub(r"([|*_<>\[\]$`])", r"\\\1", words)


def commands() -> str:
    """Every command with its arguments and options, as ``--help`` has them."""
    text: list[str] = []
    for name in COMMANDS:
        try:
            command = program.get_command(click.Context(program), name)
        except ImportError as error:
            logger.warning("the command %s cannot be imported: %s", name, error)
            continue
        if command is None:
            raise ValueError(f"unknown command: {name}")
        text += [f"## `tank2sim {name}`", "", *_command(name, command)]
    return "\n".join(text)


def _command(name: str, command: click.Command) -> list[str]:
    context = click.Context(command, info_name=f"tank2sim {name}")
    usage = command.get_usage(context).removeprefix("Usage: ")
    lines = ["```text", " ".join(usage.split()), "```", ""]
    for paragraph in (command.help or "").split("\n\n"):
        lines += [_text(" ".join(paragraph.split())), ""]
    lines += ["{.options}", "| option | meaning |", "|---|---|"]
    for parameter in command.get_params(context):
        help_record = parameter.get_help_record(context)
        if help_record is not None and help_record[1] and "--help" not in parameter.opts:
            lines.append(
                f"| `{help_record[0].replace('|', chr(92) + '|')}` | {_text(' '.join(help_record[1].split()))} |"
            )
    return [*lines, ""]


@dataclass(frozen=True)
class ProjectConstant:
    """A number that rests on no source: name below ``tank2sim``, value as the code has it, meaning and reason."""

    name: str
    value: str
    reason: str


def project_constants() -> list[ProjectConstant]:
    """The constants whose docstrings call them a project choice, by module."""
    found = []
    for path in sorted(SOURCES.rglob("*.py")):
        text = path.read_text(encoding="utf-8")
        body = ast.parse(text).body if re.search(_CHOICE, text) else []
        for node, after in pairwise(body):
            if not (isinstance(node, ast.Assign | ast.AnnAssign) and isinstance(after, ast.Expr)):
                continue
            target = node.targets[0] if isinstance(node, ast.Assign) else node.target
            reason = after.value.value if isinstance(after.value, ast.Constant) else None
            if not isinstance(reason, str) or not re.search(_CHOICE, reason):
                continue
            place = path.relative_to(SOURCES).with_suffix("").as_posix().replace("/", ".")
            value = " ".join(ast.unparse(node.value).split()) if node.value else ""
            found.append(ProjectConstant(f"{place}.{ast.unparse(target)}", value, " ".join(reason.split())))
    return found


def project_choices() -> str:
    """Numbers that rest on no source: value, place, reason, and what was measured at half and at twice the value."""
    measured = json.loads((Path(__file__).parent / "static" / "project_choices.json").read_text(encoding="utf-8"))
    rows: dict[str, list[str]] = {}
    for constant in project_constants():
        value = constant.value if len(constant.value) < 60 else constant.value[:57] + "..."
        reason = re.sub(r":\w+:`~?([^`]+)`", r"`\1`", constant.reason)
        cells = [f"`{constant.name}`", f"`{value}`", reason, *measured.get(constant.name, ("", ""))]
        line = " | ".join(cell.replace("|", "\\|") for cell in cells)
        rows.setdefault(constant.name.partition(".")[0], []).append(f"| {line} |")
    heads = "| name | value | meaning and reason | at half | at twice |\n|---|---|---|---|---|"
    return "\n\n".join("\n".join([f"## {room}\n", heads, *lines]) for room, lines in rows.items())


def benchmark_records() -> str:
    """What the scripts of benchmarks printed when their figures were taken, as written by ``benchmarks/table.py``."""
    files = sorted((Path(__file__).parent / "static" / "benchmarks").glob("*.txt"))
    return "\n\n".join(f"```text\n{file.read_text(encoding='utf-8').rstrip()}\n```" for file in files)


def schemas() -> str:
    """The JSON Schema of each command's JSON."""
    parts = []
    for command in commands_with_results():
        text = json.dumps(json_schema(command), indent=1)
        parts.append(f"## `{command}`\n\n```json\n{text}\n```\n")
    return "\n".join(parts)


def keys(name: str) -> str:
    """The keys of a section of a card or campaign, with the default where the file gives none."""
    section: type[BaseModel] = next(vars(module)[name] for module in FORMS if name in vars(module))
    lines = ["| key | where the file gives none |", "|---|---|"]
    for key, field in section.model_fields.items():
        absent = "required" if field.is_required() else _absent(field.default)
        lines.append(f"| `{_in_degrees(key)}` | {absent} |")
    return "\n".join([*lines, ""])


def _absent(default: object) -> str:
    if default is None or default is PydanticUndefined or default in ((), [], {}):
        return "none"
    return f"`{default}`"


def _in_degrees(key: str) -> str:
    return re.sub(r"_rad(ps)?$", r"_deg\1", key) if "propeller" not in key and "nominal" not in key else key


def fmu_variables(ship: str) -> str:
    """Every variable of the FMU of a bundled ship, as its ``modelDescription.xml`` has it."""
    text: list[str] = []
    variables = interface(with_simulator_interface(build(read_card(ship)))).variables
    for causality in ("input", "output", "parameter"):
        rows = [one for one in variables if one.causality == causality]
        text += [f"### {causality.capitalize()}s", "", "| variable | unit (shown) | start | range | meaning |"]
        text += ["|---|---|---|---|---|", *(_variable(one) for one in rows), ""]
    return "\n".join(text)


def _variable(one: FmuVariable) -> str:
    shown = f" ({one.display_unit})" if one.display_unit else ""
    unit = "Boolean" if one.boolean else f"{one.unit}{shown}"
    start = "" if one.start is None else str(bool(one.start)).lower() if one.boolean else f"{one.start:.5g}"
    low, high = ("" if bound is None else f"{bound:.4g}" for bound in (one.minimum, one.maximum))
    bounds = f"{low} to {high}" if low and high else f"from {low}" if low else f"to {high}" if high else ""
    fixed = " *Fixed.*" if one.variability == "fixed" else ""
    return f"| `{one.name}` | {unit} | {start} | {bounds} | {_text(one.description)}{fixed} |"


def modules(package: str) -> list[str]:
    """Public modules of a package: commands, what they and the Python API import, and what the theory names."""
    path = importlib.import_module(f"tank2sim.{package}").__path__
    there = [f"tank2sim.{package}", *(one.name for one in pkgutil.walk_packages(path, f"tank2sim.{package}."))]
    return sorted(name for name in there if name in _imported_by_interfaces() or name in _named_by_theory())


@cache
def _imported_by_interfaces() -> frozenset[str]:
    files = [*SOURCES.glob("cli/*.py"), *SOURCES.glob("api/*.py"), *_commands_of_apps()]
    return frozenset(
        name for file in files for name in re.findall(r"from (tank2sim[\w.]+) import", file.read_text("utf-8"))
    )


def _commands_of_apps() -> Iterator[Path]:
    """The modules of apps that declare commands."""
    return (path for path in SOURCES.glob("apps/**/*.py") if "\n@verb" in path.read_text("utf-8"))


@cache
def _named_by_theory() -> frozenset[str]:
    text = "".join(page.read_text("utf-8") for page in (Path(__file__).parent / "theory").glob("*.md"))
    names = {f"tank2sim.{name}" for name in re.findall(r"`(\w+(?:\.\w+)+)`", text)}
    return frozenset(names | {name.rpartition(".")[0] for name in names})


def reference(package: str) -> str:
    """All public modules of a package by their docstrings, with what each is for as a table before them."""
    names = modules(package)
    text = ["| module | what is in it |", "|---|---|"]
    for name in names:
        anchor = re.sub(r"[^\w-]", "", name)
        text.append(f"| [`{name.removeprefix('tank2sim.')}`](#{anchor}) | {_first_sentence(name)} |")
    text.append("")
    for name in names:
        text += [f"## `{name}`", "", "```{eval-rst}", f".. automodule:: {name}", "```", ""]
    return "\n".join(text)


def _first_sentence(module: str) -> str:
    """The summary of a module, without marks of reStructuredText."""
    paragraph = " ".join((importlib.import_module(module).__doc__ or "").split("\n\n")[0].split())
    return _text(re.sub(r":\w+:`[~.]*([^`<]*)[^`]*`", r"\1", paragraph).replace("`", ""))


def _fill(app: Sphinx, page: str, source: list[str]) -> None:
    text = source[0]
    if "<!-- effects -->" in text:
        text = text.replace("<!-- effects -->", effects())
    if "<!-- project choices -->" in text:
        text = text.replace("<!-- project choices -->", project_choices())
    if "<!-- benchmark records -->" in text:
        text = text.replace("<!-- benchmark records -->", benchmark_records())
    if "<!-- schemas -->" in text:
        text = text.replace("<!-- schemas -->", schemas())
    if "<!-- commands -->" in text:
        text = text.replace("<!-- commands -->", commands())
    text = re.sub(r"<!-- keys: (\w+) -->", lambda found: keys(found[1]), text)
    text = re.sub(r"<!-- fmu: ([\w-]+) -->", lambda found: fmu_variables(found[1]), text)
    text = re.sub(r"<!-- reference: (\w+) -->", lambda found: reference(found[1]), text)
    source[0] = text


def setup(app: Sphinx) -> dict[str, bool]:
    """Fill pages as they are read; they are read again when the program changes."""
    app.connect("source-read", _fill)
    app.connect("env-get-outdated", lambda app, env, added, changed, removed: _GENERATED & env.found_docs)
    return {"parallel_read_safe": True, "parallel_write_safe": True}


_GENERATED = {
    "benchmarks",
    "formats/effects",
    "formats/campaign",
    "formats/other_cards",
    "fmu",
    "commands",
    *(f"reference/{one.name}" for one in pkgutil.iter_modules(tank2sim.__path__)),
}
