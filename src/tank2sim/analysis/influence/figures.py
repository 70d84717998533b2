"""Figures with influence coefficients, and their text form: ``FIGURE@ARGUMENT``."""

from __future__ import annotations

import difflib
import math
import re
from dataclasses import dataclass

from tank2sim.errors import ArgumentError
from tank2sim.simulation.manoeuvres import Turn, Zigzag
from tank2sim.simulation.thruster_manoeuvres import DifferenceTurn, Spin, StraightRun
from tank2sim.units import in_words, to_si

STRAIGHT, STEADY, TURN, ZIGZAG = "straight course", "steady turn", "turning circle", "zigzag"
"""Origin of a figure: a linearised straight course, an equilibrium, or a simulated manoeuvre."""

STRAIGHT_RUN, DIFFERENCE, SPIN = "straight run", "turn by difference", "spin"
"""Origin of a figure of a craft with thrusters: a simulated manoeuvre."""


@dataclass(frozen=True)
class FigureKind:
    """A kind of figure: its name with the unit at its end, its origin, and its description."""

    name: str
    family: str
    description: str


FIGURE_KINDS: dict[str, FigureKind] = {
    kind.name: kind
    for kind in (
        FigureKind("K_per_s", STRAIGHT, "Nomoto's K"),
        FigureKind("T_s", STRAIGHT, "Nomoto's T = T1 + T2 - T3"),
        FigureKind("T1_s", STRAIGHT, "time constant of the slower mode"),
        FigureKind("T2_s", STRAIGHT, "time constant of the faster mode"),
        FigureKind("T3_s", STRAIGHT, "time constant of the zero"),
        FigureKind("K_prime", STRAIGHT, "K L/U"),
        FigureKind("T_prime", STRAIGHT, "T U/L"),
        FigureKind("criterion_C", STRAIGHT, "criterion of straight-line stability, prime system"),
        FigureKind("steady_radius_m", STEADY, "radius of the steady turn, U/|r|"),
        FigureKind("steady_diameter_m", STEADY, "its diameter"),
        FigureKind("steady_rate_degps", STEADY, "yaw rate of the steady turn, positive to starboard"),
        FigureKind(
            "steady_drift_deg", STEADY, "drift angle of the steady turn, positive when the bow points to starboard"
        ),
        FigureKind("steady_speed_mps", STEADY, "speed in the steady turn"),
        FigureKind("speed_loss_percent", STEADY, "loss of speed in the steady turn"),
        FigureKind("advance_m", TURN, "advance at 90 deg"),
        FigureKind("transfer_m", TURN, "transfer at 90 deg"),
        FigureKind("tactical_diameter_m", TURN, "tactical diameter at 180 deg"),
        FigureKind("advance_lengths", TURN, "advance over L"),
        FigureKind("tactical_diameter_lengths", TURN, "tactical diameter over L"),
        FigureKind("time_90_s", TURN, "time to 90 deg"),
        FigureKind("time_180_s", TURN, "time to 180 deg"),
        *(FigureKind(f"overshoot_{n}_deg", ZIGZAG, f"overshoot {n}") for n in (1, 2, 3, 4)),
        FigureKind("initial_turning_distance_m", ZIGZAG, "distance to the second execute"),
        FigureKind("initial_turning_lengths", ZIGZAG, "the same over L"),
        FigureKind("initial_turning_time_s", ZIGZAG, "time to the second execute"),
    )
}
"""All kinds of figures by name."""

_CRAFT_TURN = (
    ("advance_m", "advance at 90 deg"),
    ("transfer_m", "transfer at 90 deg"),
    ("tactical_diameter_m", "tactical diameter at 180 deg"),
    ("time_90_s", "time to 90 deg"),
    ("time_180_s", "time to 180 deg"),
    ("steady_diameter_m", "diameter of the steady turn, 2 U/|r|, after 540 deg"),
    ("steady_rate_degps", "yaw rate of the steady turn, positive to starboard"),
    ("steady_speed_mps", "speed in the steady turn"),
)

CRAFT_FIGURE_KINDS: dict[str, dict[str, FigureKind]] = {
    word: {name: FigureKind(name, family, description) for name, description in described}
    for word, family, described in (
        ("straight", STRAIGHT_RUN, (("final_speed_mps", "speed of 30 lengths at the cruising speed from rest"),)),
        ("difference", DIFFERENCE, _CRAFT_TURN),
        (
            "spin",
            SPIN,
            (
                ("time_180_s", "time to 180 deg"),
                ("time_360_s", "time to 360 deg"),
                ("final_rate_degps", "yaw rate after 720 deg, positive to starboard"),
            ),
        ),
    )
}
"""Manoeuvre of a craft with thrusters, by its word, to its figures by name."""

ARGUMENTS = {
    STRAIGHT: ("", "no argument"),
    STEADY: ("@20", "the rudder in deg, positive to starboard"),
    TURN: ("@35", "the rudder in deg, positive to starboard"),
    ZIGZAG: ("@20/20", "rudder/heading in deg"),
}
"""Family to an example of its argument, and the meaning of the argument."""


def forms() -> str:
    """All figures with their arguments."""
    parts = []
    for family, (example, words) in ARGUMENTS.items():
        names = ", ".join(kind.name for kind in FIGURE_KINDS.values() if kind.family == family)
        parts.append(f"{family} ({words}{', as ' + example if example else ''}): {names}")
    for word, kinds in CRAFT_FIGURE_KINDS.items():
        parts.append(f"of a craft with thrusters @{word}:RPM: {', '.join(kinds)}")
    return "; ".join(parts)


FigureManoeuvre = Turn | Zigzag | StraightRun | DifferenceTurn | Spin
_BY_THRUSTERS: dict[str, type[StraightRun | DifferenceTurn | Spin]] = {
    STRAIGHT_RUN: StraightRun,
    DIFFERENCE: DifferenceTurn,
    SPIN: Spin,
}


@dataclass(frozen=True)
class InfluenceFigure:
    """A figure of a ship: its kind, rudder (and heading) in rad or revolutions in rad/s, and the user's text."""

    text: str
    kind: FigureKind
    angles: tuple[float, ...] = ()

    @property
    def manoeuvre(self) -> FigureManoeuvre | None:
        """The simulated manoeuvre: for a steady turn the turning circle to it; None on a straight course."""
        if self.kind.family in _BY_THRUSTERS:
            return _BY_THRUSTERS[self.kind.family](*self.angles)
        if self.kind.family == STRAIGHT:
            return None
        return Zigzag(*self.angles) if self.kind.family == ZIGZAG else Turn(*self.angles)


def parse_figure(text: str, argument: str = "figures") -> InfluenceFigure:
    """Parse a figure: ``criterion_C``, ``steady_radius_m@20``, ``overshoot_1_deg@20/20``.

    A craft with thrusters: ``final_speed_mps@straight:600``, ``steady_diameter_m@difference:200``, in rpm.

    Raises
    ------
    InputError
        The figure does not exist, or its argument is missing, not allowed or out of bounds.
    """
    name, at, value = text.strip().partition("@")
    if value.partition(":")[0] in CRAFT_FIGURE_KINDS:
        return _craft_figure(text.strip(), name, value, argument)
    kind = FIGURE_KINDS.get(name)
    if kind is None:
        close = difflib.get_close_matches(name, FIGURE_KINDS, n=1)
        remedy = f"did you mean {close[0]}?" if close else f"there are: {forms()}"
        raise ArgumentError(argument, text, "is not a figure", remedy)
    example, words = ARGUMENTS[kind.family]
    number = r"([+-]?\d+(?:\.\d+)?)"
    pattern = {STRAIGHT: "", ZIGZAG: f"{number}/{number}"}.get(kind.family, number)
    found = re.fullmatch(pattern, value)
    if found is None or bool(at) != bool(example):
        raise ArgumentError(argument, text, "cannot be read", f"give {name}{example} ({words})")
    angles = tuple(float(group) for group in found.groups())
    if any(not 0 < abs(angle) < 90 for angle in angles) or (len(angles) == 2 and angles[1] < 0):
        remedy = "the rudder lies between 0 and 90 deg to either side, the heading of a zigzag between 0 and 90 deg"
        raise ArgumentError(argument, text, "has an angle out of bounds", remedy)
    return InfluenceFigure(text.strip(), kind, tuple(math.radians(angle) for angle in angles))


def _craft_figure(text: str, name: str, value: str, argument: str) -> InfluenceFigure:
    word, _, number = value.partition(":")
    kinds = CRAFT_FIGURE_KINDS[word]
    if name not in kinds:
        close = difflib.get_close_matches(name, kinds, n=1)
        remedy = f"did you mean {close[0]}?" if close else f"there are: {', '.join(kinds)}"
        raise ArgumentError(argument, text, f"is not a figure of {word}", remedy)
    try:
        rpm = float(number)
    except ValueError:
        rpm = 0.0
    if not rpm or not math.isfinite(rpm):
        raise ArgumentError(argument, text, "cannot be read", f"give revolutions in rpm, as {name}@{word}:400")
    return InfluenceFigure(text, kinds[name], (to_si("n_rpm", rpm)[1],))


_ORDINALS = ("first", "second", "third", "fourth")


def figure_label(text: str) -> str:
    """Words for a figure without its unit: ``advance_m@35`` is ``advance, 35 deg``, ``@spin:400`` ends in ``rpm``."""
    kind, _, argument = text.partition("@")
    words = re.sub(r"^overshoot (\d)$", lambda found: f"{_ORDINALS[int(found[1]) - 1]} overshoot", in_words(kind)[0])
    unit = "" if "/" in argument else " rpm" if ":" in argument else " deg"
    return f"{words}, {argument}{unit}" if argument else words
