"""A table of derivatives from elsewhere, whose conventions are not stated: TOML like a ship card, or ``name,value``.

What a card must state may be missing: scaling, sign of the rudder, whether terms in yaw rate hold the inertia of the
ship, the origin. Names may be written as print has them: ``Y_v'``, ``Y_vvr``, ``N_delta``, ``Ybeta`` (of the drift
angle beta = -v'), ``m'``, ``my``.
"""

from __future__ import annotations

import csv
import io
import math
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from tank2sim.arguments import bounds_of
from tank2sim.cards.card import OPPOSITE
from tank2sim.cards.form import Environment
from tank2sim.cards.reading import parsed_toml
from tank2sim.cards.terms import parse_term
from tank2sim.errors import InputError, close_name
from tank2sim.files import BYTE_ORDER_MARK, read_text
from tank2sim.quantities import (
    Area,
    BlockCoefficient,
    BodyPlace,
    Breadth,
    Draught,
    Length,
    Mass,
    Speed,
    WaterDensity,
)

STATED_CONVENTIONS: Mapping[str, tuple[str, ...]] = {
    "rudder_sign": ("starboard", "port"),
    "scaling": ("prime", "prime_ii", "bis", "dimensional"),
    "yaw_rate_terms": ("hydrodynamic", "total"),
    "origin": ("midships", "centre_of_gravity"),
}
"""Conventions of a table, and what each may be."""

_SIZES = {
    **{"length_m": Length, "beam_m": Breadth, "draught_m": Draught, "speed_mps": Speed, "displacement_kg": Mass},
    **{"block_coefficient": BlockCoefficient, "rudder_area_m2": Area, "centre_of_gravity_m": BodyPlace},
    "water_density_kgpm3": WaterDensity,
}
"""Known sizes of a ship."""

_LENGTH_TO_BEAM, _BEAM_TO_DRAUGHT, _BLOCK = 6.5, 2.7, 0.7
"""Proportions of an ordinary merchant ship, used where a table has no beam, draught or displacement. Project choices:
the bundled ships have 5.5 to 6.9, 2.4 to 3.1 and 0.56 to 0.83."""

_BODY = {"mass": "mass", "m": "mass", "xG": "x_G"}
_BODY |= dict.fromkeys(("yawinertia", "Iz", "Izz", "Jzz"), "yaw_inertia")
_PRINTED = re.compile(r"[\s_'′{}$\\^]")
_RUDDER = re.compile(r"delta|δ")
_DRIFT = re.compile(r"beta|β|b")


@dataclass(frozen=True)
class CoefficientTable:
    """Numbers of a ship as somebody printed them.

    Parameters
    ----------
    source : str
        The file.
    length_m, beam_m, draught_m, speed_mps : float
        Between perpendiculars, moulded, mean; speed about which the forces are expanded.
    displacement_kg : float
        Given, or of the block coefficient.
    derivatives : mapping
        Canonical name to the number as printed.
    body : mapping
        ``mass``, ``yaw_inertia``, ``x_G`` as printed, those that are given.
    conventions : mapping
        Those that the file states: keys of :data:`STATED_CONVENTIONS`.
    centre_of_gravity_m : float, optional
        Forward of midships.
    rudder_area_m2 : float, optional
    environment : Environment
    left_out : tuple of str
        Sections of the file that are of no table: gear, propulsion, effects.
    speed_scale : str, optional
        As the file states it: ``instantaneous`` or ``nominal``.
    assumed : tuple of str
        Sizes that the file lacks, taken from an ordinary ship of its length.
    """

    source: str
    length_m: float
    beam_m: float
    draught_m: float
    speed_mps: float
    displacement_kg: float
    derivatives: Mapping[str, float]
    body: Mapping[str, float]
    conventions: Mapping[str, str] = field(default_factory=dict)
    centre_of_gravity_m: float | None = None
    rudder_area_m2: float | None = None
    environment: Environment = field(default_factory=Environment)
    assumed: tuple[str, ...] = ()
    left_out: tuple[str, ...] = ()
    speed_scale: str | None = None

    @property
    def block(self) -> float:
        """C_B."""
        box = self.length_m * self.beam_m * self.draught_m
        return self.displacement_kg / self.environment.water_density_kgpm3 / box


def read_coefficients(path: str | Path) -> CoefficientTable:
    """A table of coefficients: ``.toml`` like a ship card, else rows of name and value.

    Raises
    ------
    InputError
        The file is missing or not of this form, a name is not a derivative, or a size is missing.
    """
    source = str(path)
    text = read_text(Path(path)).removeprefix(BYTE_ORDER_MARK)
    return _of_toml(text, source) if source.endswith(".toml") else _of_rows(text, source)


def _of_toml(text: str, source: str) -> CoefficientTable:
    content = parsed_toml(text, source)
    sections = {}
    read = ("ship", "model", "rigid_body", "derivatives", "environment")
    for name in read:
        sections[name] = content.get(name, {})
        if not isinstance(sections[name], dict):
            raise InputError(source, name, "is not a section", f"write [{name}]")
    stated: dict[str, Any] = {}
    places = (("ship", _SIZES), ("environment", _SIZES), ("model", ("speed_mps", "speed_scale", *STATED_CONVENTIONS)))
    for name, keys in places:
        stated |= {key: value for key, value in sections[name].items() if key in keys}
    stated |= {_BODY[_plain(key)]: value for key, value in sections["rigid_body"].items() if _plain(key) in _BODY}
    left_out = tuple(name for name in content if name not in (*read, "format", "uncertainty"))
    return replace(_table(stated, sections["derivatives"], source, "derivatives."), left_out=left_out)


def _of_rows(text: str, source: str) -> CoefficientTable:
    stated: dict[str, Any] = {}
    derivatives: dict[str, Any] = {}
    for cells in _cells(text):
        if len(cells) < 2:
            raise InputError(source, cells[0], "is not a row of name and value", "write: Yv, -0.0116")
        name, written = cells[0], cells[1]
        if name.lower() in ("name", "coefficient", "derivative"):
            continue
        name = _BODY.get(_plain(name), name)
        of_words = name in STATED_CONVENTIONS or name == "speed_scale"
        into = stated if name in _SIZES or of_words or name in _BODY.values() else derivatives
        if name in into:
            raise InputError(source, name, "is given twice", "give each number once")
        into[name] = written if of_words else _number(written, name, source)
    return _table(stated, derivatives, source, "")


def _cells(text: str) -> Iterator[list[str]]:
    """Rows of a text that has commas or semicolons between its cells, without comments."""
    lines = [line for line in text.splitlines() if line.strip() and not line.lstrip().startswith("#")]
    rows = csv.reader(io.StringIO("\n".join(lines)), delimiter=";" if ";" in "\n".join(lines) else ",")
    return ([cell.strip() for cell in row] for row in rows)


def _table(stated: Mapping[str, Any], printed: Mapping[str, Any], source: str, section: str) -> CoefficientTable:
    known = {**STATED_CONVENTIONS, "speed_scale": ("instantaneous", "nominal")}
    for key, choices in known.items():
        if key in stated and stated[key] not in choices:
            raise InputError(source, key, f"is {stated[key]!r}", close_name(str(stated[key]), choices))
    sizes = _sizes(stated, source)
    density = sizes.pop("water_density_kgpm3", None)
    water = Environment() if density is None else Environment(water_density_kgpm3=density)
    assumed = _assume_sizes(sizes, water)
    table = CoefficientTable(
        source=source,
        derivatives=_derivatives(printed, source, section),
        body={key: _number(stated[key], key, source) for key in dict.fromkeys(_BODY.values()) if key in stated},
        conventions={key: value for key, value in stated.items() if key in STATED_CONVENTIONS},
        environment=water,
        assumed=assumed,
        speed_scale=stated.get("speed_scale"),
        **sizes,
    )
    if not 0.2 <= table.block <= 1.0:
        problem = f"means a block coefficient of {table.block:.3g}"
        raise InputError(source, "displacement_kg", problem, "check length_m, beam_m, draught_m and displacement_kg")
    return table


def _assume_sizes(sizes: dict[str, Any], water: Environment) -> tuple[str, ...]:
    """Add missing sizes from an ordinary ship; return their keys."""
    assumed = tuple(key for key in ("beam_m", "draught_m") if key not in sizes)
    sizes.setdefault("beam_m", sizes["length_m"] / _LENGTH_TO_BEAM)
    sizes.setdefault("draught_m", sizes["beam_m"] / _BEAM_TO_DRAUGHT)
    block = sizes.pop("block_coefficient", None)
    if "displacement_kg" not in sizes:
        if block is None:
            block, assumed = _BLOCK, (*assumed, "displacement_kg")
        volume = block * sizes["length_m"] * sizes["beam_m"] * sizes["draught_m"]
        sizes["displacement_kg"] = volume * water.water_density_kgpm3
    return assumed


def _sizes(stated: Mapping[str, Any], source: str) -> dict[str, Any]:
    sizes = {key: _number(stated[key], key, source) for key in _SIZES if key in stated}
    for key, value in sizes.items():
        bounds = bounds_of(_SIZES[key])
        if bounds is not None and not bounds.hold(value):
            raise InputError(source, key, f"is {value:g}", f"{bounds.words} was expected")
    for key in ("length_m", "speed_mps"):
        if key not in sizes:
            raise InputError(source, key, "is missing", "give length_m and speed_mps, and beam_m, draught_m if known")
    return sizes


def _derivatives(printed: Mapping[str, Any], source: str, section: str) -> dict[str, float]:
    derivatives: dict[str, float] = {}
    for name, value in printed.items():
        canonical, sign = _canonical(name, source, section)
        if canonical in derivatives:
            raise InputError(source, f"{section}{name}", f"is {canonical} again", "give each number once")
        derivatives[canonical] = sign * _number(value, f"{section}{name}", source)
    if missing := sorted({"Yv", "Yr", "Nv", "Nr"} - set(derivatives)):
        raise InputError(source, section.rstrip("."), f"lacks {', '.join(missing)}", "give at least Yv Yr Nv Nr")
    return derivatives


def _plain(name: str) -> str:
    return _PRINTED.sub("", name)


def _number(value: Any, place: str, source: str) -> float:
    try:
        number = math.nan if isinstance(value, bool) else float(value)
    except (TypeError, ValueError, OverflowError):
        number = math.nan
    if not math.isfinite(number):
        raise InputError(source, place, f"is {value!r}, no finite number", "give a number")
    return number


def _canonical(name: str, source: str, section: str) -> tuple[str, float]:
    """Canonical name of a printed one, and the factor of its number."""
    plain = _RUDDER.sub("d", _plain(name))
    if plain in OPPOSITE:
        return OPPOSITE[plain]
    letters = _DRIFT.sub("v", plain)
    term = parse_term(letters)
    if term is None:
        raise InputError(
            source, f"{section}{name}", "is not the name of a derivative", "write Yv, Yvvr, Nd, Yvdot, my, R0"
        )
    drifts = len(_DRIFT.findall(plain))
    return term.name, -1.0 if drifts % 2 else 1.0
