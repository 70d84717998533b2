"""``tank2sim influence CARD --through 61@35 20@0``: hull and rudder scaled until two measured turns are met."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from tank2sim.analysis.turning.two_point_tuning import TwoPointTuning, WantedTurn, levers_of_ship, tune_to_two_points
from tank2sim.cards import ManoeuvringCard
from tank2sim.cards.covariance import with_carried_covariance
from tank2sim.cards.reading import revised
from tank2sim.cli.console import json_text, show_notices
from tank2sim.cli.steering_card import show_tuning
from tank2sim.dynamics import build
from tank2sim.errors import InputError
from tank2sim.files import write_together

OPTION = "--through"

_POINT = re.compile(r"(?P<value>[\d.]+)(?P<metre>m?)@(?P<rudder>[+-]?[\d.]+)")


@dataclass(frozen=True)
class ThroughFiles:
    """Where the results go: the tuned card, the JSON; None for neither."""

    card: Path | None
    json: Path | None


def parse_points(texts: Sequence[str]) -> tuple[WantedTurn, WantedTurn]:
    """The two points that a command line means: ``61@35`` (deg/min at deg of rudder) or ``424m@20`` (a radius).

    A yaw rate is to the side of the rudder; with the rudder amidships it is to starboard.

    Raises
    ------
    InputError
        They are not two, or one of them cannot be read.
    """
    remedy = "give two, as --through 61@35 47@15 (deg/min at deg of rudder) or 424m@20 (radius in m)"
    if len(texts) != 2:
        raise InputError(OPTION, "", f"has {len(texts)} point{'s' * (len(texts) != 1)}", remedy)
    first, second = (_parse_point(text, remedy) for text in texts)
    return first, second


def _parse_point(text: str, remedy: str) -> WantedTurn:
    found = _POINT.fullmatch(text.strip())
    try:
        value, rudder = (float(found[key]) for key in ("value", "rudder")) if found else (math.nan, math.nan)
    except ValueError:
        value = rudder = math.nan
    if not found or not value > 0 or not abs(rudder) < 90:
        raise InputError(OPTION, text, "is no point", remedy)
    angle = math.radians(rudder)
    if found["metre"]:
        return WantedTurn(angle, radius_m=value)
    return WantedTurn(angle, math.copysign(math.radians(value) / 60, angle))


def tune_through(card: ManoeuvringCard, texts: Sequence[str], files: ThroughFiles) -> None:
    """Tune a ship's hull and rudder to two points of its steering diagram; print, and write card and JSON if asked."""
    model = build(card)
    tuning = tune_to_two_points(model, levers_of_ship(card, model), *parse_points(texts))
    contents: dict[Path, str | bytes] = {}
    if files.json:
        contents[files.json] = json_text({**tuning.as_json(), "notices": list(model.notices)})
    told = list(model.notices)
    if files.card:
        found, of_covariance = with_carried_covariance(card, _tuned(card, tuning, " ".join(texts)).text, files.card)
        contents, told = contents | found, [*told, *of_covariance]
    write_together(contents, inputs=[Path(card.source)], outputs=[files.card, files.json])
    show_tuning(tuning)
    show_notices(told)


def _tuned(card: ManoeuvringCard, tuning: TwoPointTuning, points: str) -> ManoeuvringCard:
    """The card with the scaled derivatives; their standard errors keep their share."""
    changed: dict[str, tuple[float, float]] = {}
    for place, value in tuning.parameters.items():
        name = place.removeprefix("derivatives.")
        if old := card.derivatives.get(name, 0.0):
            changed[name] = (value, abs(value / old) * card.standard_error(name))
    how = f"hull and rudder scaled by {tuning.hull:.5g} and {tuning.rudder:.5g} to turn through {points}"
    return revised(card, changed, {"ship.source": f"{card.ship.source}; {how}"}, comment="scaled to two turns")
