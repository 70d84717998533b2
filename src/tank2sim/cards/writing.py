"""New cards, written from results."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import tomlkit

from tank2sim.escaping import one_line


def card_text(sections: Mapping[str, Mapping[str, Any] | None]) -> str:
    """TOML text of a card: section to its keys and values, SI.

    A section that is None is left out, as is a value that is None or an empty text.
    """
    return tomlkit.dumps(_document(sections))


def _document(sections: Mapping[str, Mapping[str, Any] | None]) -> tomlkit.TOMLDocument:
    document = tomlkit.document()
    document["format"] = "tank2sim-ship/1"
    for name, values in sections.items():
        if values is not None:
            document[name] = {key: value for key, value in values.items() if value not in (None, "")}
    return document


class TestedRange(NamedTuple):
    """Largest drift angle and rudder angle (rad) and r' of the tests behind a card."""

    drift_rad: float
    rudder_rad: float
    yaw_rate_prime: float


class DerivativeEntry(NamedTuple):
    """A derivative (prime, rudder positive to starboard), its standard error, and how it was found."""

    value: float
    standard_error: float
    how: str


@dataclass(frozen=True, kw_only=True)
class ManoeuvringResult:
    """Contents of a card of a manoeuvring ship: prime, instantaneous, "hydrodynamic", starboard-positive."""

    particulars: Mapping[str, float | str]  # Keys of ``[ship]`` but source and notes; SI
    # `source`, `notes`: Where the numbers come from, and what a reader should know.
    source: str
    notes: str
    environment: Mapping[str, float]  # Keys of ``[environment]``, SI
    speed_mps: float  # U0, about which the forces are expanded
    largest: TestedRange  # Largest motions that were tested
    rigid_body: Mapping[str, float]  # ``mass``, ``yaw_inertia``, ``x_G``
    inertia_source: str  # Where the yaw inertia is from
    derivatives: Mapping[str, DerivativeEntry]  # Canonical name to entry, in the order of the card


def manoeuvring_card_text(result: ManoeuvringResult) -> str:
    """TOML text of a ship card: each derivative with how it was found."""
    document = _document(
        {
            "ship": {**result.particulars, "source": result.source, "notes": result.notes},
            "environment": result.environment,
            "model": {
                "kind": "abkowitz",
                "speed_mps": result.speed_mps,
                "scaling": "prime",
                "speed_scale": "instantaneous",
                "yaw_rate_terms": "hydrodynamic",
                "rudder_sign": "starboard",
                "valid_drift_deg": float(f"{math.degrees(result.largest.drift_rad):.3g}"),
                "valid_rudder_deg": float(f"{math.degrees(result.largest.rudder_rad):.3g}"),
                "valid_yaw_rate_prime": float(f"{result.largest.yaw_rate_prime:.3g}"),
            },
            "rigid_body": {key: float(f"{value:.6g}") for key, value in result.rigid_body.items()},
            "derivatives": {name: entry.value for name, entry in result.derivatives.items()},
            "uncertainty": {name: entry.standard_error for name, entry in result.derivatives.items()},
        }
    )
    document["rigid_body"]["yaw_inertia"].comment(one_line(f"about midships; {result.inertia_source}"))
    for name, entry in result.derivatives.items():
        document["derivatives"][name].comment(one_line(entry.how))
    return tomlkit.dumps(document)
