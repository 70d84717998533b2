"""``--agreed`` and ``--bound``: changes that go together, and how far a number may go."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from pathlib import Path

from tank2sim.cards.reading import parsed_toml
from tank2sim.errors import InputError
from tank2sim.files import read_exact_text

AGREED, BOUND = "--agreed", "--bound"


def parse_agreed(given: Iterable[str]) -> dict[str, float]:
    """Kc % by name, from ``NAME=PERCENT`` and TOML files with a number by each name (in sections, too).

    Raises
    ------
    InputError
        Something is neither, or a name is given twice.
    """
    found: dict[str, float] = {}
    for text in given:
        name, sign, percent = text.partition("=")
        pairs = {name.strip(): _number(AGREED, text, percent)} if sign else _from_file(Path(text))
        for name, value in pairs.items():
            if name in found:
                raise InputError(AGREED, name, "is given twice", "give each parameter once")
            found[name] = value
    return found


def parse_bounds(given: Iterable[str]) -> dict[str, tuple[float, float]]:
    """Lowest and highest value by name, from ``NAME=LOW..HIGH``.

    Raises
    ------
    InputError
        A bound cannot be read, or its ends are the wrong way round.
    """
    found = {}
    for text in given:
        name, _, ends = text.partition("=")
        low, dots, high = ends.partition("..")
        if not dots or not name.strip():
            raise InputError(
                BOUND, text, "is not of the form NAME=LOW..HIGH", "give, for example, --bound Yv=-0.013..-0.010"
            )
        pair = (_number(BOUND, text, low), _number(BOUND, text, high))
        if not pair[0] < pair[1]:
            raise InputError(BOUND, text, "leaves no room", "give LOW..HIGH with LOW below HIGH")
        found[name.strip()] = pair
    return found


def _number(option: str, text: str, number: str) -> float:
    try:
        value = float(number)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise InputError(option, text, f"{number.strip() or 'nothing'} is not a number", "give NAME and a number")
    return value


def _from_file(path: Path) -> dict[str, float]:
    if not path.is_file():
        raise InputError(AGREED, str(path), "is neither NAME=PERCENT nor a file", "give, for example, --agreed Yv=0.62")
    return _flat(parsed_toml(read_exact_text(path), path), path, "")


def _flat(content: Mapping[str, object], path: Path, section: str) -> dict[str, float]:
    found: dict[str, float] = {}
    for key, value in content.items():
        if isinstance(value, dict):
            found |= _flat(value, path, f"{section}{key}.")
        elif isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value):
            found[section + key] = float(value)
        else:
            raise InputError(path, section + key, f"is {value!r}", "a change in per cent was expected")
    return found
