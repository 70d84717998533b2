"""Quantities that a log may hold: their units, and the words that names of columns and topics use for them.

Both are declared in ``quantities.toml``.
"""

from __future__ import annotations

import math
import re
import tomllib
import unicodedata
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from tank2sim.arrays import Array
from tank2sim.units import KNOT_MPS

_UNITS = {
    "angle": {"rad": 1.0, "deg": math.pi / 180},
    "rate": {"rad/s": 1.0, "deg/s": math.pi / 180, "deg/min": math.pi / 180 / 60},
    "speed": {"m/s": 1.0, "kn": KNOT_MPS, "km/h": 1 / 3.6},
    "turns": {"rad/s": 1.0, "rpm": 2 * math.pi / 60, "1/s": 2 * math.pi},
    "share": {"1": 1.0, "%": 0.01},
    "degrees": {"deg": 1.0, "rad": 180 / math.pi, "1e-7 deg": 1e-7},
    "length": {"m": 1.0},
    "acceleration": {"m/s2": 1.0, "g": 9.80665},
    "none": {"": 1.0},
}
_DECLARED = tomllib.loads(Path(__file__).with_suffix(".toml").read_text(encoding="utf-8"))
CLOCK_WORDS: dict[str, Any] = _DECLARED["clock"]
"""Words for times and dates, seconds of units by their words, and hours of zones."""

TIME_LINES: dict[str, str] = _DECLARED["lines"]
"""Quantities on the time line of a page, from top to bottom, and their words there."""

_WORDS = {group: rf"\b({'|'.join(words)})\b" for group, words in _DECLARED["words"].items()}


@dataclass(frozen=True, kw_only=True)
class LogQuantity:
    """A quantity that a channel of a log may hold.

    - `words`: For people.
    - `units`: Unit to the factor that gives SI (rad, m/s, rad/s; degrees for latitude and longitude); the first is SI.
    - `column`: Signal of the trial format that it becomes; empty if it becomes none.
    - `largest_deg`: Largest size of a value in deg.
    - `unknown`, `nowhere`: Numbers that are sent for no value: if the values around are others; before the first fix.
    """

    words: str
    units: dict[str, float]
    column: str = ""
    largest_deg: float = math.inf
    unknown: Sequence[float] = ()
    nowhere: Sequence[float] = ()


QUANTITIES: dict[str, LogQuantity] = {
    name: LogQuantity(**entry | {"units": {u: f for kind in entry["units"].split() for u, f in _UNITS[kind].items()}})
    for name, entry in _DECLARED["quantities"].items()
}
"""Every quantity of a channel. Signs follow the trial format: starboard, ahead and clockwise are positive."""


def _compiled(words: str) -> re.Pattern[str]:
    """Pattern of words; names in braces are its groups. Without words it fits no name."""
    return re.compile(words.format(**_WORDS) or r"(?!)")


_SIZES = {quantity: entry["limits"] for entry in _DECLARED["sizes"] for quantity in entry["quantities"]}

_NAMES = [
    (entry["quantity"], _compiled(entry["words"]), _compiled(entry.get("barred", ""))) for entry in _DECLARED["names"]
]
_ANOTHER, _THRUST = _compiled("{another}"), _compiled("{thrust}")
_NO_THRUST = _compiled("{revolutions}|{rudder}|{not_speed}")
_REST = re.compile(r"\b(zero|neutral|trim|rest|idle|center|centre|mid|middle)\b")
_SIDES = [
    (sign, re.compile(rf"\b({words})\s*\+|\+\s*(to\s+)?({words})\b"))
    for sign, words in ((-1, "|".join(_DECLARED["words"]["port"])), (1, "|".join(_DECLARED["words"]["starboard"])))
]
_SIGNAL_K = re.compile(r"^(navigation|propulsion|steering|environment)\.[a-z]")
# Letters that are not one of a to z with an accent
_LETTERS = str.maketrans({"ø": "o", "æ": "ae", "ß": "ss", "ł": "l", "ı": "i"})


def unit_of_signal_k(name: str, quantity: str) -> str:
    """Unit of a path of Signal K, which is SI (signalk.org, 1.7), revolutions in Hz; empty of any other name.

    Examples
    --------
    >>> unit_of_signal_k("propulsion.main.revolutions", "rpm")
    '1/s'
    """
    if not quantity or not _SIGNAL_K.match(name):
        return ""
    return "1/s" if name.endswith(".revolutions") else next(iter(QUANTITIES[quantity].units))


def unit_by_size(quantity: str, values: Array) -> str:
    """Unit of a quantity by the size of its values (n,), outliers excepted; empty where that is not certain.

    Examples
    --------
    >>> import numpy as np
    >>> unit_by_size("rudder_angle", np.array([-20.0, 20.0])), unit_by_size("rudder_angle", np.array([1.2]))
    ('deg', '')
    """
    most = float(np.nanpercentile(np.abs(values), 99.9))
    return next((unit for limit, unit in _SIZES.get(quantity, ()) if most <= limit), "")


def plain_words(name: str, *, numbered: bool = True) -> str:
    """Small letters without accents, words separated by single spaces: ``/ship/shaftRPM`` is ``ship shaft rpm``.

    Without `numbered`, a number behind a word is a word of its own (``ROT1``).
    """
    text = _without_accents(re.sub(r"(?<=[a-z])(?=[A-Z])", " ", name))
    words = re.sub(r"[^a-z0-9]+", " ", text).strip()
    return words if numbered else re.sub(r"(?<=[a-z])(?=\d)", " ", words)


def _without_accents(text: str) -> str:
    """Small letters without accents."""
    text = unicodedata.normalize("NFKD", text.lower().translate(_LETTERS))
    return "".join(letter for letter in text if not unicodedata.combining(letter))


def quantity_of_name(name: str, unit: str = "") -> str:
    """Quantity that the words of a name suggest; empty if they suggest none, or one that has not this unit."""
    words = plain_words(name, numbered=False)
    found = next((name for name, wanted, barred in _NAMES if wanted.search(words) and not barred.search(words)), "")
    return found if not (found and unit) or unit in QUANTITIES[found].units else ""


def names_another(name: str) -> bool:
    """Whether the words of a name say that it is none of the quantities: a temperature, a voltage, a depth."""
    return bool(_ANOTHER.search(plain_words(name)))


def names_thrust(name: str) -> bool:
    """Whether the words of a name say that it is of thrusters or motors, of whatever side: ``/usv/thrusters[0]``.

    Examples
    --------
    >>> names_thrust("/usv/thrusters.data[1]"), names_thrust("/battery.current")
    (True, False)
    """
    words = plain_words(name, numbered=False)
    return bool(_THRUST.search(words)) and not _NO_THRUST.search(words)


def names_rest(name: str) -> bool:
    """Whether the words of a name say that its values are the pulse at which a controller rests.

    Examples
    --------
    >>> names_rest("thr_left_pwm_zero_point"), names_rest("thr_left")
    (True, False)
    """
    return bool(_REST.search(plain_words(name)))


def sign_of_name(name: str) -> int:
    """Sign that a name states, -1 where port is positive (``Ruderlage (Bb +)``), 1 where starboard is, 0 if none."""
    text = re.sub(r"\b(positive?|pos|positiv)\b\.?", "+", _without_accents(name).replace("_", " "))
    return next((sign for sign, stated in _SIDES if stated.search(text)), 0)
