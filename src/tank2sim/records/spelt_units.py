"""Units as people spell them in names of columns, in rows of units and in the properties of channels."""

from __future__ import annotations

import math
import re

from tank2sim.units import KNOT_MPS

_UNIT_SPELLINGS = {
    "deg": ("deg", "degree", "degrees", "°", "grad"),
    "rad": ("rad", "radian", "radians"),
    "deg/s": ("deg/s", "degps", "deg_s", "dps", "°/s", "deg_per_s", "degs"),
    "deg/min": ("deg/min", "degpmin", "deg_min", "°/min", "dpm", "deg_per_min"),
    "rad/s": ("rad/s", "radps", "rad_s", "rad_per_s"),
    "kn": ("kn", "kt", "kts", "knot", "knots", "kns"),
    "km/h": ("km/h", "kmh", "km_h", "kph", "kmph"),
    "m/s": ("m/s", "mps", "m_s", "ms-1", "m_per_s"),
    "rpm": (
        "rpm",
        "1/min",
        "u/min",
        "min-1",
        "r/min",
        "rev/min",
        "obr/min",
        "tr/min",
        "giri/min",
        "varv/min",
        "omdr/min",
    ),
    "1/s": ("rps", "1/s", "hz", "rev/s"),
    "%": ("%", "percent", "pct", "prozent"),
    "m": ("m", "metre", "meter", "metres", "meters"),
    "m/s2": ("m/s2", "m/s^2", "m/s/s", "mps2", "m_s2", "m/s²"),
    "g": ("g",),
    "s": ("s", "sec", "seconds"),
    "V": ("v", "volt"),
    "degC": ("degc", "°c"),
}
_UNIT_OF = {spelling: unit for unit, spellings in _UNIT_SPELLINGS.items() for spelling in spellings}
_UNIT_OF |= {"degheading": "deg", "deglatitude": "deg", "deglongitude": "deg"}
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


_FORCE = {"n": 1.0, "kn": 1e3, "kgf": 9.80665, "kp": 9.80665, "lbf": 4.4482216152605}
_SIZES = {
    "N": _FORCE,
    "Nm": {
        "nm": 1.0, "knm": 1e3, "nmm": 1e-3, "ncm": 1e-2, "kgfm": 9.80665, "kpm": 9.80665, "lbfft": 1.3558179483314,
    },
    "m": {"m": 1.0, "mm": 1e-3, "cm": 1e-2, "ft": 0.3048, "in": 0.0254},
    "s": {"s": 1.0, "sec": 1.0, "ms": 1e-3, "us": 1e-6, "µs": 1e-6, "min": 60.0},
    "mps": {"m/s": 1.0, "mm/s": 1e-3, "cm/s": 1e-2, "kn": KNOT_MPS, "km/h": 1 / 3.6, "ft/s": 0.3048},
    "rad": {"rad": 1.0, "deg": math.pi / 180, "mrad": 1e-3},
    "radps": {"rad/s": 1.0, "deg/s": math.pi / 180, "deg/min": math.pi / 180 / 60, "mrad/s": 1e-3},
}  # fmt: skip
"""SI unit, as names of columns end with it, to the spelling of units of that kind (small letters, no blanks, points or
stars) and their factor to it: BIPM SI brochure (9th ed.), NIST SP 811 for lbf, ft and in; kp and kgf 9.80665 N."""


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
