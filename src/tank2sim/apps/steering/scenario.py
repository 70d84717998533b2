"""Waters to steer in, from a GeoJSON file: a start, a channel, buoys, depths, banks, and a goal.

GeoJSON is RFC 7946: positions are longitude and latitude in degrees (WGS 84), polygons have closed rings. The property
``kind`` of a feature says what it is:

=========== ========== ===============================================================================================
kind        geometry   other properties
=========== ========== ===============================================================================================
``start``   Point      ``heading_deg``; ``speed_knots`` (else the card's)
``channel`` LineString ``width_m``; from the start on, its centre line
``buoy``    Point      ``side``: ``port`` or ``starboard`` of a ship that follows the channel, or left out
``depth``   Polygon    ``depth_m`` of the water; of areas that overlap the last holds
``bank``    Polygon    land or a quay: what touches it is aground
``goal``    Polygon    the berth, or where the attempt ends: ``heading_deg``, ``within_deg`` either way, ``speed_knots``
                       at most; each may be left out
=========== ========== ===============================================================================================
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from tank2sim.apps.logs.reference import local_metres
from tank2sim.errors import InputError, close_name
from tank2sim.files import parsed_json, read_text
from tank2sim.units import KNOT_MPS

_FOLDER = Path(__file__).parent / "scenarios"

_GEOMETRIES = {
    "start": "Point",
    "channel": "LineString",
    "buoy": "Point",
    "depth": "Polygon",
    "bank": "Polygon",
    "goal": "Polygon",
}

_NUMBERS = {
    "start": {"heading_deg": (0.0, 360.0), "speed_knots": (0.0, 60.0)},
    "channel": {"width_m": (1.0, 1e4)},
    "buoy": {},
    "depth": {"depth_m": (0.0, 1.2e4)},
    "bank": {},
    "goal": {"heading_deg": (0.0, 360.0), "within_deg": (0.0, 180.0), "speed_knots": (0.0, 60.0)},
}
"""Numbers of each kind, with the least and the most that they may be: of the seas and of ships."""

_REQUIRED = {"start": {"heading_deg"}, "channel": {"width_m"}, "depth": {"depth_m"}}

_FARTHEST = 1e5
"""Farthest from the start, m: beyond it plane coordinates are off by more than a ship's beam (project choice)."""

_MOST_POSITIONS = 20_000
"""Positions of a file: a browser draws no more of them at each frame (project choice)."""

_SIDES = ("port", "starboard")


@dataclass(frozen=True)
class Feature:
    """A feature: points (x north, y east of the start, m), of a polygon its outer ring; and its properties, SI, rad."""

    kind: str
    points: tuple[tuple[float, float], ...]
    properties: Mapping[str, float | str]


@dataclass(frozen=True)
class Scenario:
    """Waters to steer in. Heading (rad) and speed (m/s; None: the card's) of the start, which is at x = y = 0."""

    name: str
    description: str
    heading: float
    speed: float | None
    features: tuple[Feature, ...]

    def as_data(self) -> dict[str, Any]:
        """Its data for the page."""
        features = [{"kind": feature.kind, "points": feature.points, **feature.properties} for feature in self.features]
        return {"name": self.name, "description": self.description, "features": features}


def bundled_scenarios() -> dict[str, Path]:
    """The bundled scenarios: name to file."""
    return {path.stem: path for path in sorted(_FOLDER.glob("*.geojson"))}


def read_scenario(source: str | Path) -> Scenario:
    """A scenario of a file, or a bundled one by its name.

    Raises
    ------
    InputError
        The file cannot be read or is not such a GeoJSON, or has no start or two.

    Examples
    --------
    >>> scenario = read_scenario("channel")
    >>> scenario.heading, sorted({feature.kind for feature in scenario.features})
    (0.0, ['bank', 'buoy', 'channel', 'depth', 'goal'])
    """
    path = bundled_scenarios().get(str(source), Path(source))
    content = _content(path)
    features = content["features"]
    starts = [number for number, feature in enumerate(features) if _kind(path, number, feature) == "start"]
    if len(starts) != 1:
        raise InputError(
            path, "", f"has {len(starts)} features of kind start", "a scenario has one: where the ship begins"
        )
    channels = [number for number, feature in enumerate(features) if feature["properties"]["kind"] == "channel"]
    if len(channels) > 1:
        raise InputError(path, _place(channels[1], "channel"), "is the second channel", "join both to one LineString")
    positions = [_positions(path, number, feature) for number, feature in enumerate(features)]
    if sum(map(len, positions)) > _MOST_POSITIONS:
        raise InputError(path, "", f"has more than {_MOST_POSITIONS} positions", "simplify its lines")
    origin = positions[starts[0]][0]
    read = [
        Feature(feature["properties"]["kind"], _local(path, number, where, origin), _properties(path, number, feature))
        for number, (feature, where) in enumerate(zip(features, positions, strict=True))
    ]
    start = read[starts[0]].properties
    speed = start.get("speed_mps")
    return Scenario(
        name=str(content.get("name", path.stem)),
        description=str(content.get("description", "")),
        heading=float(start["heading_rad"]),
        speed=None if speed is None else float(speed),
        features=tuple(feature for feature in read if feature.kind != "start"),
    )


def _content(path: Path) -> dict[str, Any]:
    known = ", ".join(bundled_scenarios())
    if not path.exists():
        raise InputError(path, "", "does not exist", f"give a GeoJSON file, or a bundled scenario: {known}")
    content = parsed_json(read_text(path), path, "give a GeoJSON file (RFC 7946)")
    if not isinstance(content, dict) or content.get("type") != "FeatureCollection":
        raise InputError(path, "type", "is not FeatureCollection", "a scenario is a GeoJSON FeatureCollection")
    if not isinstance(content.get("features"), list):
        raise InputError(path, "features", "is not a list", "list the features of the FeatureCollection")
    return content


def _place(number: int, kind: str = "") -> str:
    return f"feature {number + 1}{f' ({kind})' if kind else ''}"


def _kind(path: Path, number: int, feature: object) -> str:
    properties = feature.get("properties") if isinstance(feature, dict) else None
    kind = properties.get("kind") if isinstance(properties, dict) else None
    if not isinstance(kind, str):
        raise InputError(path, _place(number), "has no property kind", f"give one of {', '.join(_GEOMETRIES)}")
    if kind not in _GEOMETRIES:
        raise InputError(path, _place(number), f"kind {kind!r} is unknown", close_name(kind, _GEOMETRIES))
    return kind


def _positions(path: Path, number: int, feature: Mapping[str, Any]) -> list[tuple[float, float]]:
    """Positions (latitude, longitude), deg, of a point, a line or the outer ring of a polygon."""
    kind = feature["properties"]["kind"]
    place, wanted = _place(number, kind), _GEOMETRIES[kind]
    geometry = feature.get("geometry")
    found = geometry.get("type") if isinstance(geometry, dict) else None
    if not isinstance(geometry, dict) or found != wanted:
        raise InputError(path, place, f"is a {found}" if found else "has no geometry", f"a {kind} is a {wanted}")
    coordinates = geometry.get("coordinates")
    if wanted == "Polygon":
        if not isinstance(coordinates, list) or len(coordinates) != 1:
            remedy = "give one ring, and another area above it in place of a hole"
            raise InputError(path, place, "is not a polygon of one ring", remedy)
        coordinates = coordinates[0]
    listed = [coordinates] if wanted == "Point" else coordinates
    least = {"Point": 1, "LineString": 2, "Polygon": 4}[wanted]
    if not isinstance(listed, list) or len(listed) < least:
        raise InputError(path, place, f"has fewer than {least} positions", f"complete the {wanted}")
    positions = [_position(path, place, position) for position in listed]
    if wanted == "Polygon" and positions[0] != positions[-1]:
        raise InputError(path, place, "is not closed", "end the ring with its first position")
    return positions


def _position(path: Path, place: str, position: object) -> tuple[float, float]:
    if not isinstance(position, list) or len(position) < 2 or not all(map(_is_number, position[:2])):
        raise InputError(path, place, f"{position!r:.40} is not a position", "give [longitude, latitude] in degrees")
    longitude, latitude = map(float, position[:2])
    if not (abs(longitude) <= 180 and abs(latitude) < 89):
        remedy = "give longitude (-180 to 180) before latitude (-89 to 89), in degrees"
        raise InputError(path, place, f"[{longitude:g}, {latitude:g}] is not on the chart", remedy)
    return latitude, longitude


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)


def _local(
    path: Path, number: int, positions: list[tuple[float, float]], origin: tuple[float, float]
) -> tuple[tuple[float, float], ...]:
    latitude, longitude = np.array(positions).T
    north, east = local_metres(latitude, longitude, origin)
    farthest = float(np.max(np.hypot(north, east)))
    if farthest > _FARTHEST:
        remedy = f"keep within {_FARTHEST / 1e3:g} km; longitude is before latitude"
        raise InputError(path, _place(number), f"is {farthest / 1e3:.0f} km from the start", remedy)
    return tuple((round(float(x), 3), round(float(y), 3)) for x, y in zip(north, east, strict=True))


def _properties(path: Path, number: int, feature: Mapping[str, Any]) -> dict[str, float | str]:
    """Properties in SI units and rad."""
    given, kind = feature["properties"], feature["properties"]["kind"]
    place = _place(number, kind)
    if missing := _REQUIRED.get(kind, set()) - set(given):
        raise InputError(path, place, f"has no {missing.pop()}", f"a {kind} needs it")
    found: dict[str, float | str] = {}
    for name, (least, most) in _NUMBERS[kind].items():
        value = given.get(name)
        if value is None:
            continue
        if not _is_number(value) or not least <= value <= most:
            raise InputError(path, place, f"{name} {value!r:.40}", f"give a number between {least:g} and {most:g}")
        unit = name.rsplit("_", 1)[1]
        to_si = {"deg": ("rad", math.pi / 180), "knots": ("mps", KNOT_MPS), "m": ("m", 1.0)}[unit]
        found[f"{name.removesuffix(unit)}{to_si[0]}"] = float(value) * to_si[1]
    if kind == "buoy" and (side := given.get("side")) is not None:
        if side not in _SIDES:
            raise InputError(path, place, f"side {side!r:.40}", f"give {' or '.join(_SIDES)}, or leave it out")
        found["side"] = side
    return found
