"""New cards, written from results."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

import tomlkit
from tomlkit.items import Table

from tank2sim.escaping import one_line


@dataclass(frozen=True)
class SurgeResult:
    """Contents of a card of a body that only surges.

    `name`, `source`: what it is, and where the numbers come from. `values`, `standard_errors`: keys of ``[surge]``, SI,
    to numbers. `top_speed_mps`: highest speed at which they were measured. `length_m`: length, if known. `notes`:
    anything a reader should know.
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


@dataclass(frozen=True, kw_only=True)
class YawRigResult:
    """Contents of a card of a body on the yaw rig.

    `name`, `source`, `notes`: what it is, where the numbers come from, and what a reader should know. `values`,
    `standard_errors`: keys of ``[yaw_rig]``, SI, to numbers. `programme`: keys of ``[programme]``.
    `water_density_kgpm3`, `length_m`: where they are known.
    """

    name: str
    source: str
    notes: str
    values: Mapping[str, float]
    standard_errors: Mapping[str, float]
    programme: Mapping[str, float | str]
    water_density_kgpm3: float | None = None
    length_m: float | None = None


def yaw_rig_card_text(result: YawRigResult) -> str:
    """TOML text of a card of a body on the yaw rig."""
    document = tomlkit.document()
    document["format"] = "tank2sim-ship/1"
    length = {} if result.length_m is None else {"length_m": result.length_m}
    notes = {"notes": result.notes} if result.notes else {}
    document["ship"] = _table({"name": result.name, **length, "source": result.source, **notes})
    if result.water_density_kgpm3 is not None:
        document["environment"] = _table({"water_density_kgpm3": result.water_density_kgpm3})
    document["model"] = _table({"kind": "yaw_rig"})
    document["yaw_rig"] = _table(result.values)
    document["programme"] = _table(result.programme)
    document["uncertainty"] = _table(result.standard_errors)
    return tomlkit.dumps(document)


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
    """Contents of a card of a manoeuvring ship: prime, instantaneous, "hydrodynamic", starboard-positive.

    `particulars`: keys of ``[ship]`` but source and notes; SI. `source`, `notes`: where the numbers come from, and what
    a reader should know. `environment`: keys of ``[environment]``, SI. `speed_mps`: u0, about which the forces are
    expanded. `largest`: how far the tests went. `rigid_body`: ``mass``, ``yaw_inertia``, ``x_G``. `inertia_source`:
    where the yaw inertia is from. `derivatives`: canonical name to entry, in the order of the card.
    """

    particulars: Mapping[str, float | str]
    source: str
    notes: str
    environment: Mapping[str, float]
    speed_mps: float
    largest: TestedRange
    rigid_body: Mapping[str, float]
    inertia_source: str
    derivatives: Mapping[str, DerivativeEntry]


def manoeuvring_card_text(result: ManoeuvringResult) -> str:
    """TOML text of a ship card: each derivative with how it was found."""
    document = tomlkit.document()
    document["format"] = "tank2sim-ship/1"
    document["ship"] = _table({**result.particulars, "source": result.source, "notes": result.notes})
    document["environment"] = _table(result.environment)
    document["model"] = _table(
        {
            "kind": "abkowitz",
            "speed_mps": result.speed_mps,
            "scaling": "prime",
            "speed_scale": "instantaneous",
            "yaw_rate_terms": "hydrodynamic",
            "rudder_sign": "starboard",
            "valid_drift_deg": float(f"{math.degrees(result.largest.drift_rad):.3g}"),
            "valid_rudder_deg": float(f"{math.degrees(result.largest.rudder_rad):.3g}"),
            "valid_yaw_rate_prime": float(f"{result.largest.yaw_rate_prime:.3g}"),
        }
    )
    body = _table({key: float(f"{value:.6g}") for key, value in result.rigid_body.items()})
    body["yaw_inertia"].comment(one_line(f"about midships; {result.inertia_source}"))
    document["rigid_body"] = body
    derivatives, uncertainty = tomlkit.table(), tomlkit.table()
    for name, entry in result.derivatives.items():
        derivatives[name] = entry.value
        derivatives[name].comment(one_line(entry.how))
        uncertainty[name] = entry.standard_error
    document["derivatives"], document["uncertainty"] = derivatives, uncertainty
    return tomlkit.dumps(document)


def _table(values: Mapping[str, float | str]) -> Table:
    table = tomlkit.table()
    for key, value in values.items():
        table[key] = value
    return table
