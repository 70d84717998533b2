"""New cards, written from results."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import tomlkit


@dataclass(frozen=True)
class SurgeResult:
    """What a card of a body that only surges is made of.

    Parameters
    ----------
    name, source : str
        What it is, and where the numbers come from.
    values, standard_errors : mapping
        Keys of ``[surge]``, SI, to numbers.
    top_speed_mps : float
        Highest speed at which they were measured.
    length_m : float, optional
        Length, if known.
    notes : str
        Anything a reader should know.
    """

    name: str
    source: str
    values: Mapping[str, float]
    standard_errors: Mapping[str, float]
    top_speed_mps: float
    length_m: float | None = None
    notes: str = ""


def surge_card_text(result: SurgeResult) -> str:
    """TOML text of a surge card."""
    ship = tomlkit.table()
    ship["name"] = result.name
    if result.length_m is not None:
        ship["length_m"] = result.length_m
    ship["source"] = result.source
    if result.notes:
        ship["notes"] = result.notes
    model = tomlkit.table()
    model["kind"] = "surge"
    model["valid_speed_mps"] = [0.0, result.top_speed_mps]
    surge, uncertainty = tomlkit.table(), tomlkit.table()
    for key, value in result.values.items():
        surge[key] = value
    for key, value in result.standard_errors.items():
        uncertainty[key] = value
    document = tomlkit.document()
    document["format"] = "tank2sim-ship/1"
    document["ship"], document["model"], document["surge"] = ship, model, surge
    document["uncertainty"] = uncertainty
    return tomlkit.dumps(document)
