"""Units as people spell them in names of columns, in rows of units and in the properties of channels."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

_DECLARED = tomllib.loads(Path(__file__).with_name("units.toml").read_text(encoding="utf-8"))
_UNIT_OF: dict[str, str] = {
    spelling: unit for unit, spellings in _DECLARED["spellings"].items() for spelling in spellings
}
_SIZES: dict[str, dict[str, float]] = _DECLARED["sizes"]
_BRACKET = re.compile(r"[\[(]\s*([^\])]*?)\s*[\])]")


def unit_of_text(text: str) -> str:
    """Unit that a text spells (``knots`` is ``kn``); the text itself if it is not known."""
    return _UNIT_OF.get(text.strip().lower(), text.strip())


def split_unit(name: str) -> tuple[str, str]:
    """Words of a name, and the unit that is in its brackets or at its end; "" where there is none.

    ``sog_kn`` is (``sog``, ``kn``), ``Heading [deg]`` is (``Heading``, ``deg``), ``ground_speed_m_s`` has ``m/s``.
    """
    for match in _BRACKET.finditer(name):
        if match[1].lower() in _UNIT_OF:
            return (name[: match.start()] + name[match.end() :]).strip(), _UNIT_OF[match[1].lower()]
    for length in (3, 2, 1):
        parts = re.split(r"[_ ]", name)
        ending = "_".join(parts[-length:]).lower()
        if len(parts) > length and ending in _UNIT_OF and not (ending in ("g", "v", "s", "m") and length == 1):
            return "_".join(parts[:-length]), _UNIT_OF[ending]
    parts = re.split(r"[_ ]", name)
    if len(parts) > 1 and parts[-1] == "m":
        return "_".join(parts[:-1]), "m"
    return name, ""


def unit_factor(text: str, suffix: str) -> float | None:
    """Factor to the SI unit `suffix` (``N``, ``Nm``, ``m``, ``s``, ``mps``, ``rad``, ``radps``) of a spelt unit; None
    if it is not a unit of that kind. ``kN`` of a force is kilonewton, ``kn`` of a speed knots."""
    sizes = _SIZES[suffix]
    for spelling in (text, unit_of_text(_plain_unit(text)), unit_of_text(text)):
        plain = _plain_unit(spelling)
        if plain in sizes:
            return sizes[plain]
    return None


def is_unit(text: str) -> bool:
    """True for the spelling of a unit, with or without brackets."""
    bare = text.strip().strip("[]()").strip()
    return bare.lower() in _UNIT_OF or bare == "1" or any(_plain_unit(bare) in sizes for sizes in _SIZES.values())


def _plain_unit(text: str) -> str:
    bare = text.strip().strip("[]()").lower()
    return re.sub(r"[\s.*·_^]|(?<=n)-(?=m)", "", bare).replace("²", "2")
