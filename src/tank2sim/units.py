"""Units in the names of keys and columns, and units that an FMU declares.

A number's unit is at the end of its name (``length_m``, ``psi_deg``). Inside the program everything is SI and
radians; :func:`to_si` converts a named number once, at the door.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

KNOT_MPS = 1852.0 / 3600.0
"""One international knot, 1852 m an hour (BIPM SI brochure, 9th ed., table 8)."""

# suffix -> (SI suffix, factor). The order matters: longer suffixes first, so that `_degps` is not read as `_s`.
_SUFFIXES: dict[str, tuple[str, float]] = {
    "degps": ("radps", math.pi / 180.0),
    "degpmin": ("radps", math.pi / 180.0 / 60.0),
    "radps": ("radps", 1.0),
    "rpm": ("radps", 2.0 * math.pi / 60.0),
    "rps": ("radps", 2.0 * math.pi),
    "deg": ("rad", math.pi / 180.0),
    "rad": ("rad", 1.0),
}


def to_si(name: str, value: float) -> tuple[str, float]:
    """Name and value in SI: ``("max_angle_deg", 40.0)`` becomes ``("max_angle_rad", 0.698...)``.

    Names whose unit is SI already, or that have none, come back unchanged.
    """
    stem, _, suffix = name.rpartition("_")
    if stem and suffix in _SUFFIXES:
        si_suffix, factor = _SUFFIXES[suffix]
        return f"{stem}_{si_suffix}", value * factor
    return name, value


def from_si(name: str, value: float) -> float:
    """The inverse of :func:`to_si` for one value: the number under `name` in a file, from its SI value."""
    _, factor = to_si(name, 1.0)
    return value / factor


_WRITTEN = {
    "s2_per_rad2": "s²/rad²",
    "s3_per_rad2": "s³/rad²",
    "s2_per_rad": "s²/rad",
    "s_per_m": "s/m",
    "per_s": "1/s",
    "radpmps": "rad s/m",
    "degpmin": "deg/min",
    "kgs2pm3": "kg s²/m³",
    "kgspm2": "kg s/m²",
    "kgpm3": "kg/m³",
    "radps": "rad/s",
    "degps": "deg/s",
    "m2ps": "m²/s",
    "kgm2": "kg m²",
    "deg2s": "deg² s",
    "Nms2": "N m s²",
    "NmpA": "N m/A",
    "Nmps": "N m/s",
    "kgpm": "kg/m",
    "kgps": "kg/s",
    "mps2": "m/s²",
    "Npm": "N/m",
    "mps": "m/s",
    "Nms": "N m s",
    "rpm": "rpm",
    "rps": "1/s",
    "deg": "deg",
    "rad": "rad",
    "percent": "%",
    "lengths": "L",
    "bytes": "B",
    "dB": "dB",
    "Nm": "N m",
    "Hz": "Hz",
    "kg": "kg",
    "kn": "kn",
    "kN": "kN",
    "m2": "m²",
    "m3": "m³",
    "N": "N",
    "A": "A",
    "J": "J",
    "m": "m",
    "s": "s",
}
"""Units at the end of names, longest first, as a reader writes them."""


def in_words(name: str) -> tuple[str, str]:
    """Words and unit of a name for a reader.

    Examples
    --------
    >>> in_words("steady_rate_degps"), in_words("Kd_per_s"), in_words("members")
    (('steady rate', 'deg/s'), ('Kd', '1/s'), ('members', ''))
    """
    for suffix, unit in _WRITTEN.items():
        if name.endswith(f"_{suffix}"):
            return name.removesuffix(f"_{suffix}").replace("_", " "), unit
    return name.replace("_", " "), ""


def rounded_down(value: float) -> float:
    """The largest of 1, 2 and 5 times a power of ten that is not above a positive value, except for rounding.

    Examples
    --------
    >>> rounded_down(0.043), rounded_up(0.043)
    (0.02, 0.05)
    """
    decade = 10.0 ** math.floor(math.log10(value))
    return float(max(digit * decade for digit in (1, 2, 5) if digit * decade <= value * (1 + 1e-9)))


def rounded_up(value: float) -> float:
    """The smallest of 1, 2 and 5 times a power of ten that is not below a positive value, except for rounding."""
    decade = 10.0 ** math.floor(math.log10(value))
    return float(next(digit * decade for digit in (1, 2, 5, 10) if digit * decade >= value * (1 - 1e-9)))


@dataclass(frozen=True)
class Unit:
    """A unit as FMI describes it: exponents of the SI base units, and the units it may be shown in.

    Parameters
    ----------
    name : str
        Name in the model description, such as ``m/s``.
    base : dict
        Exponents of the SI base units and of rad (``kg m s A K mol cd rad``).
    extent : float
        Magnitude that no variable of a ship or model in this unit exceeds: the bound of those that state none.
    displays : dict
        Name of a display unit to its factor: *display = factor * value in this unit*.
    """

    name: str
    base: dict[str, int]
    extent: float
    displays: dict[str, float] = field(default_factory=dict)


UNITS: dict[str, Unit] = {
    unit.name: unit
    for unit in (
        Unit("1", {}, 1e3),
        Unit("m", {"m": 1}, 1e8),
        Unit("m2", {"m": 2}, 1e8),
        Unit("s", {"s": 1}, 1e7),
        Unit("1/s", {"s": -1}, 1e3),
        Unit("kg", {"kg": 1}, 1e10),
        Unit("rad", {"rad": 1}, 1e5, {"deg": 180.0 / math.pi}),
        Unit("m/s", {"m": 1, "s": -1}, 1e3, {"knots": 1.0 / KNOT_MPS}),
        Unit("m/s2", {"m": 1, "s": -2}, 1e3),
        Unit(
            "rad/s",
            {"rad": 1, "s": -1},
            1e3,
            {"deg/s": 180.0 / math.pi, "deg/min": 60.0 * 180.0 / math.pi, "rpm": 60.0 / (2.0 * math.pi)},
        ),
        Unit("rad/s2", {"rad": 1, "s": -2}, 1e3, {"deg/s2": 180.0 / math.pi}),
        Unit("N", {"kg": 1, "m": 1, "s": -2}, 1e12),
        Unit("N.m", {"kg": 1, "m": 2, "s": -2}, 1e15),
        Unit("N/s", {"kg": 1, "m": 1, "s": -3}, 1e15),
        Unit("N/m", {"kg": 1, "s": -2}, 1e12),
        Unit("N.m/s", {"kg": 1, "m": 2, "s": -3}, 1e18),
        Unit("W", {"kg": 1, "m": 2, "s": -3}, 1e15),
        Unit("N.m.s", {"kg": 1, "m": 2, "s": -1}, 1e15),
        Unit("N.m.s2", {"kg": 1, "m": 2}, 1e15),
        Unit("A", {"A": 1}, 1e6),
        Unit("A/s", {"A": 1, "s": -1}, 1e9),
        Unit("N.m/A", {"kg": 1, "m": 2, "s": -2, "A": -1}, 1e6),
        Unit("kg/m3", {"kg": 1, "m": -3}, 1e5),
        Unit("kg/s", {"kg": 1, "s": -1}, 1e10),
        Unit("kg.m", {"kg": 1, "m": 1}, 1e13),
        Unit("kg.m/s", {"kg": 1, "m": 1, "s": -1}, 1e13),
        Unit("kg.m2/s", {"kg": 1, "m": 2, "s": -1}, 1e16),
        Unit("kg.m2", {"kg": 1, "m": 2}, 1e16),
        Unit("kg/m", {"kg": 1, "m": -1}, 1e10),
        Unit("kg.s/m2", {"kg": 1, "m": -2, "s": 1}, 1e10),
        Unit("kg.s2/m3", {"kg": 1, "m": -3, "s": 2}, 1e10),
    )
}
"""Every unit a variable of a model may declare."""
