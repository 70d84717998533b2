"""Targets of a ship: figures with values, as a user writes them."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass

from tank2sim.analysis.influence.figures import STRAIGHT, InfluenceFigure, parse_figure
from tank2sim.errors import ArgumentError

EQUAL, AT_MOST, AT_LEAST = "=", "<=", ">="

_TARGET = re.compile(
    r"(?P<name>[^@<>=]+)(?P<at>@[^<>=]+)?(?P<relation><=|>=|=)(?P<value>[^@<>=]+)(?P<behind>@[^<>=]+)?"
)


@dataclass(frozen=True)
class Target:
    """A figure and its target value, an equality or a limit; in the unit of the figure's name."""

    figure: InfluenceFigure
    relation: str
    value: float

    @property
    def text(self) -> str:
        """As a text: ``steady_radius_m@20=424``."""
        return f"{self.figure.text}{self.relation}{self.value:g}"


def parse_target(text: str) -> Target:
    """Parse a target: ``steady_radius_m@20=424`` or ``steady_radius_m=424@20``, ``<=``, ``>=``.

    Raises
    ------
    InputError
        The text is not a target, its figure does not exist, or its value is not finite or impossible for a ship.
    """
    found = _TARGET.fullmatch(text.strip())
    if found is None or (found["at"] and found["behind"]):
        remedy = "give FIGURE@ARGUMENT=VALUE, <= or >=, as steady_radius_m@20=424 or 'overshoot_1_deg@20/20<=25'"
        raise ArgumentError("targets", text, "is not a target", remedy)
    try:
        value = float(found["value"])
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise ArgumentError(
            "targets", text, f"{found['value'].strip()} is not a number", "give a value in the figure's unit"
        )
    figure = parse_figure(found["name"].strip() + (found["at"] or found["behind"] or "").strip(), "targets")
    if not _possible(figure, value):
        problem = f"no ship has {figure.kind.description} of {value:g}"
        raise ArgumentError("targets", text, problem, "give a value that a ship can have")
    return Target(figure, found["relation"], value)


def _possible(figure: InfluenceFigure, value: float) -> bool:
    """True for a possible value of a figure: sizes and times are positive; a ship turns to the side of the order
    and keeps some speed."""
    kind = figure.kind
    if kind.name in ("steady_rate_degps", "final_rate_degps"):
        return value * figure.angles[0] > 0
    if kind.family == STRAIGHT or kind.name == "transfer_m":
        return True
    if kind.name == "steady_drift_deg":
        return abs(value) < 90
    if kind.name == "speed_loss_percent":
        return 0 <= value < 100
    return value >= 0 if kind.name.startswith("overshoot") else value > 0
