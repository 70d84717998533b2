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
from typing import Any, NamedTuple

import numpy as np

from tank2sim.apps.logs.reference import local_metres
from tank2sim.errors import InputError, close_name
from tank2sim.files import parsed_json, read_text
from tank2sim.units import KNOT_MPS

_FOLDER = Path(__file__).parent / "scenarios"


class _Kind(NamedTuple):
    """Geometry of a kind of feature; its numbers, with the least and the most of seas and ships; those it must have."""

    geometry: str
    numbers: Mapping[str, tuple[float, float]]
    required: frozenset[str] = frozenset()


_HEADING, _SPEED = (0.0, 360.0), (0.0, 60.0)
_KINDS = {
    "start": _Kind("Point", {"heading_deg": _HEADING, "speed_knots": _SPEED}, frozenset({"heading_deg"})),
    "channel": _Kind("LineString", {"width_m": (1.0, 1e4)}, frozenset({"width_m"})),
    "buoy": _Kind("Point", {}),
    "depth": _Kind("Polygon", {"depth_m": (0.0, 1.2e4)}, frozenset({"depth_m"})),
    "bank": _Kind("Polygon", {}),
    "goal": _Kind("Polygon", {"heading_deg": _HEADING, "within_deg": (0.0, 180.0), "speed_knots": _SPEED}),
}

_FEWEST = {"Point": 1, "LineString": 2, "Polygon": 4}
"""Positions of a geometry, at least."""

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
    given = [_given(path, number, feature) for number, feature in enumerate(content["features"], start=1)]
    starts, channels = ([each for each in given if each.kind == kind] for kind in ("start", "channel"))
    if len(starts) != 1:
        remedy = "a scenario has one: where the ship begins"
        raise InputError(path, "", f"has {len(starts)} features of kind start", remedy)
    if len(channels) > 1:
        raise channels[1].fault("is the second channel", "join both to one LineString")
    positions = [each.positions() for each in given]
    if sum(map(len, positions)) > _MOST_POSITIONS:
        raise InputError(path, "", f"has more than {_MOST_POSITIONS} positions", "simplify its lines")
    start = starts[0].in_si()
    origin = starts[0].positions()[0]
    speed = start.get("speed_mps")
    return Scenario(
        name=str(content.get("name", path.stem)),
        description=str(content.get("description", "")),
        heading=float(start["heading_rad"]),
        speed=None if speed is None else float(speed),
        features=tuple(
            Feature(each.kind, each.local(where, origin), each.in_si())
            for each, where in zip(given, positions, strict=True)
            if each.kind != "start"
        ),
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


@dataclass(frozen=True)
class _Given:
    """A feature of the file, the first of which is number 1."""

    path: Path
    number: int
    kind: str
    geometry: object
    properties: Mapping[str, Any]

    def fault(self, problem: str, remedy: str) -> InputError:
        return InputError(self.path, f"feature {self.number} ({self.kind})", problem, remedy)

    def positions(self) -> list[tuple[float, float]]:
        """Positions (latitude, longitude), deg, of a point, a line or the outer ring of a polygon."""
        wanted = _KINDS[self.kind].geometry
        found = self.geometry.get("type") if isinstance(self.geometry, dict) else None
        if not isinstance(self.geometry, dict) or found != wanted:
            raise self.fault(f"is a {found}" if found else "has no geometry", f"a {self.kind} is a {wanted}")
        listed = self._listed(self.geometry.get("coordinates"), wanted)
        if not isinstance(listed, list) or len(listed) < _FEWEST[wanted]:
            raise self.fault(f"has fewer than {_FEWEST[wanted]} positions", f"complete the {wanted}")
        positions = [self._position(position) for position in listed]
        if wanted == "Polygon" and positions[0] != positions[-1]:
            raise self.fault("is not closed", "end the ring with its first position")
        return positions

    def _listed(self, coordinates: object, geometry: str) -> object:
        """The list of positions in the coordinates of a geometry."""
        if geometry == "Point":
            return [coordinates]
        if geometry == "LineString":
            return coordinates
        if not isinstance(coordinates, list) or len(coordinates) != 1:
            remedy = "give one ring, and another area above it in place of a hole"
            raise self.fault("is not a polygon of one ring", remedy)
        return coordinates[0]

    def _position(self, position: object) -> tuple[float, float]:
        if not isinstance(position, list) or len(position) < 2 or not all(map(_is_number, position[:2])):
            raise self.fault(f"{position!r:.40} is not a position", "give [longitude, latitude] in degrees")
        longitude, latitude = map(float, position[:2])
        if not (abs(longitude) <= 180 and abs(latitude) < 89):
            remedy = "give longitude (-180 to 180) before latitude (-89 to 89), in degrees"
            raise self.fault(f"[{longitude:g}, {latitude:g}] is not on the chart", remedy)
        return latitude, longitude

    def local(
        self, positions: list[tuple[float, float]], origin: tuple[float, float]
    ) -> tuple[tuple[float, float], ...]:
        """Positions north and east of the origin, m."""
        latitude, longitude = np.array(positions).T
        north, east = local_metres(latitude, longitude, origin)
        farthest = float(np.max(np.hypot(north, east)))
        if farthest > _FARTHEST:
            remedy = f"keep within {_FARTHEST / 1e3:g} km; longitude is before latitude"
            raise self.fault(f"is {farthest / 1e3:.0f} km from the start", remedy)
        return tuple((round(float(x), 3), round(float(y), 3)) for x, y in zip(north, east, strict=True))

    def in_si(self) -> dict[str, float | str]:
        """Properties in SI units and rad."""
        kind = _KINDS[self.kind]
        if missing := kind.required - set(self.properties):
            raise self.fault(f"has no {min(missing)}", f"a {self.kind} needs it")
        found: dict[str, float | str] = {}
        for name, (least, most) in kind.numbers.items():
            value = self.properties.get(name)
            if value is None:
                continue
            if not _is_number(value) or not least <= value <= most:
                raise self.fault(f"{name} {value!r:.40}", f"give a number between {least:g} and {most:g}")
            unit = name.rsplit("_", 1)[1]
            to_si = {"deg": ("rad", math.pi / 180), "knots": ("mps", KNOT_MPS), "m": ("m", 1.0)}[unit]
            found[f"{name.removesuffix(unit)}{to_si[0]}"] = float(value) * to_si[1]
        if self.kind == "buoy" and (side := self.properties.get("side")) is not None:
            if side not in _SIDES:
                raise self.fault(f"side {side!r:.40}", f"give {' or '.join(_SIDES)}, or leave it out")
            found["side"] = side
        return found


def _given(path: Path, number: int, feature: object) -> _Given:
    """A feature of a known kind; InputError for another."""
    properties = feature.get("properties") if isinstance(feature, dict) else None
    kind = properties.get("kind") if isinstance(properties, dict) else None
    if not isinstance(feature, dict) or not isinstance(properties, dict) or not isinstance(kind, str):
        raise InputError(path, f"feature {number}", "has no property kind", f"give one of {', '.join(_KINDS)}")
    if kind not in _KINDS:
        raise InputError(path, f"feature {number}", f"kind {kind!r} is unknown", close_name(kind, _KINDS))
    return _Given(path, number, kind, feature.get("geometry"), properties)


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)
