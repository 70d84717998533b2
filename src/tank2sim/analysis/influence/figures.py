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


_OF_SHIPS: dict[str, dict[str, str]] = {
    STRAIGHT: {
        "K_per_s": "Nomoto's K",
        "T_s": "Nomoto's T = T1 + T2 - T3",
        "T1_s": "time constant of the slower mode",
        "T2_s": "time constant of the faster mode",
        "T3_s": "time constant of the zero",
        "K_prime": "K L/U",
        "T_prime": "T U/L",
        "criterion_C": "criterion of straight-line stability, prime system",
    },
    STEADY: {
        "steady_radius_m": "radius of the steady turn, U/|r|",
        "steady_diameter_m": "its diameter",
        "steady_rate_degps": "yaw rate of the steady turn, positive to starboard",
        "steady_drift_deg": "drift angle of the steady turn, positive when the bow points to starboard",
        "steady_speed_mps": "speed in the steady turn",
        "speed_loss_percent": "loss of speed in the steady turn",
    },
    TURN: {
        "advance_m": "advance at 90 deg",
        "transfer_m": "transfer at 90 deg",
        "tactical_diameter_m": "tactical diameter at 180 deg",
        "advance_lengths": "advance over L",
        "tactical_diameter_lengths": "tactical diameter over L",
        "time_90_s": "time to 90 deg",
        "time_180_s": "time to 180 deg",
    },
    ZIGZAG: {
        **{f"overshoot_{n}_deg": f"overshoot {n}" for n in (1, 2, 3, 4)},
        "initial_turning_distance_m": "distance to the second execute",
        "initial_turning_lengths": "the same over L",
        "initial_turning_time_s": "time to the second execute",
    },
}

_OF_CRAFT: dict[str, dict[str, str]] = {
    STRAIGHT_RUN: {"final_speed_mps": "speed of 30 lengths at the cruising speed from rest"},
    DIFFERENCE: {
        "advance_m": "advance at 90 deg",
        "transfer_m": "transfer at 90 deg",
        "tactical_diameter_m": "tactical diameter at 180 deg",
        "time_90_s": "time to 90 deg",
        "time_180_s": "time to 180 deg",
        "steady_diameter_m": "diameter of the steady turn, 2 U/|r|, after 540 deg",
        "steady_rate_degps": "yaw rate of the steady turn, positive to starboard",
        "steady_speed_mps": "speed in the steady turn",
    },
    SPIN: {
        "time_180_s": "time to 180 deg",
        "time_360_s": "time to 360 deg",
        "final_rate_degps": "yaw rate after 720 deg, positive to starboard",
    },
}

ARGUMENTS = {
    STRAIGHT: ("", "no argument"),
    STEADY: ("@20", "the rudder in deg, positive to starboard"),
    TURN: ("@35", "the rudder in deg, positive to starboard"),
    ZIGZAG: ("@20/20", "rudder/heading in deg"),
    STRAIGHT_RUN: ("@straight:600", "revolutions in rpm"),
    DIFFERENCE: ("@difference:200", "port less starboard in rpm"),
    SPIN: ("@spin:400", "revolutions in rpm"),
}
"""Family to an example of its argument, whose numbers may be others, and the meaning of the argument."""

_NUMBER = r"([+-]?\d+(?:\.\d+)?(?:[eE][+-]?\d+)?)"


def _word(family: str) -> str:
    """The beginning of the argument of a family of craft; empty for ships."""
    return ARGUMENTS[family][0].partition(":")[0] if family in _OF_CRAFT else ""


FIGURE_KINDS: dict[str, FigureKind] = {
    f"{name}{_word(family)}": FigureKind(name, family, description)
    for family, described in (_OF_SHIPS | _OF_CRAFT).items()
    for name, description in described.items()
}
"""All kinds of figures by name; of a craft with thrusters with its manoeuvre: ``final_speed_mps@straight``."""


def forms() -> str:
    """All figures with their arguments."""
    parts = []
    for family, (example, words) in ARGUMENTS.items():
        names = ", ".join(kind.name for kind in FIGURE_KINDS.values() if kind.family == family)
        parts.append(f"{family} ({words}{', as ' + example if example else ''}): {names}")
    return "; ".join(parts)


FigureManoeuvre = Turn | Zigzag | StraightRun | DifferenceTurn | Spin
_MANOEUVRES: dict[str, type[FigureManoeuvre]] = {
    STEADY: Turn,
    TURN: Turn,
    ZIGZAG: Zigzag,
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
        made = _MANOEUVRES.get(self.kind.family)
        return made(*self.angles) if made else None


def parse_figure(text: str, argument: str = "figures") -> InfluenceFigure:
    """Parse a figure: ``criterion_C``, ``steady_radius_m@20``, ``overshoot_1_deg@20/20``.

    A craft with thrusters: ``final_speed_mps@straight:600``, ``steady_diameter_m@difference:200``, in rpm.

    Raises
    ------
    InputError
        The figure does not exist, or its argument is missing, not allowed or out of bounds.
    """
    name, at, value = text.strip().partition("@")
    word, by_thrusters, _ = value.partition(":")
    key = f"{name}@{word}" if by_thrusters else name
    if (kind := FIGURE_KINDS.get(key)) is None:
        close = difflib.get_close_matches(key, FIGURE_KINDS, n=1)
        remedy = f"did you mean {close[0]}?" if close else f"there are: {forms()}"
        raise ArgumentError(argument, text, "is not a figure", remedy)
    example, words = ARGUMENTS[kind.family]
    numbers = _numbers(example, f"{at}{value}")
    if numbers is None or (by_thrusters and not 0 < abs(numbers[0]) < math.inf):
        raise ArgumentError(argument, text, "cannot be read", f"give {name}{example} ({words})")
    if by_thrusters:
        return InfluenceFigure(text.strip(), kind, (to_si("n_rpm", numbers[0])[1],))
    if any(not 0 < abs(angle) < 90 for angle in numbers) or min(numbers[1:], default=0.0) < 0:
        remedy = "the rudder lies between 0 and 90 deg to either side, the heading of a zigzag between 0 and 90 deg"
        raise ArgumentError(argument, text, "has an angle out of bounds", remedy)
    return InfluenceFigure(text.strip(), kind, tuple(map(math.radians, numbers)))


def _numbers(example: str, argument: str) -> list[float] | None:
    """The numbers of an argument that is as the example; None of another."""
    found = re.fullmatch(re.sub(r"\d+", lambda _: _NUMBER, example), argument)
    return None if found is None else [float(group) for group in found.groups()]


_ORDINALS = ("first", "second", "third", "fourth")


def figure_label(text: str) -> str:
    """Words for a figure without its unit: ``advance_m@35`` is ``advance, 35 deg``, ``@spin:400`` ends in ``rpm``."""
    kind, _, argument = text.partition("@")
    words = re.sub(r"^overshoot (\d)$", lambda found: f"{_ORDINALS[int(found[1]) - 1]} overshoot", in_words(kind)[0])
    unit = "" if "/" in argument else " rpm" if ":" in argument else " deg"
    return f"{words}, {argument}{unit}" if argument else words
