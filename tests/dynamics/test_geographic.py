"""Latitude and longitude against the tangent plane of WGS 84 carried out in space, without series."""

from __future__ import annotations

import math
from dataclasses import dataclass

import casadi as ca
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tank2sim.dynamics.geographic import GEOGRAPHIC_OUTPUTS, HIGHEST_LATITUDE, geographic
from tank2sim.dynamics.model import Model, Quantity

A, INVERSE_F = 6378137.0, 298.257223563
E2 = (2 - 1 / INVERSE_F) / INVERSE_F


@dataclass(frozen=True)
class Place:
    """Geodetic latitude and longitude, rad."""

    latitude: float
    longitude: float

    @property
    def in_space(self) -> np.ndarray:
        """Earth-centred coordinates (3,), m."""
        N = A / math.sqrt(1 - E2 * math.sin(self.latitude) ** 2)
        across = N * math.cos(self.latitude)
        along = (across * math.cos(self.longitude), across * math.sin(self.longitude))
        return np.array([*along, N * (1 - E2) * math.sin(self.latitude)])


def exactly(origin: Place, north: float, east: float) -> Place:
    """The place below a point of the plane that touches the ellipsoid at the origin."""
    sin, cos = (math.sin(origin.latitude), math.cos(origin.latitude))
    to_north = np.array([-sin * math.cos(origin.longitude), -sin * math.sin(origin.longitude), cos])
    to_east = np.array([-math.sin(origin.longitude), math.cos(origin.longitude), 0.0])
    x, y, z = origin.in_space + north * to_north + east * to_east
    latitude, radius = math.atan2(z, math.hypot(x, y) * (1 - E2)), math.hypot(x, y)
    for _ in range(60):  # to a fixed point
        N = A / math.sqrt(1 - E2 * math.sin(latitude) ** 2)
        latitude = math.atan2(z + E2 * N * math.sin(latitude), radius)
    return Place(latitude, math.atan2(y, x))


@pytest.fixture(scope="module")
def of_the_ship() -> ca.Function:
    north, east = ca.SX.sym("north"), ca.SX.sym("east")
    variables = geographic(north, east)
    values = [one.value for one in variables if isinstance(one, Quantity)]
    return ca.Function("where", [variables[0].symbol, variables[1].symbol, north, east], values)


def error(where: ca.Function, origin: Place, north: float, east: float) -> float:
    found = Place(*(float(value) for value in where(origin.latitude, origin.longitude, north, east)))
    return float(np.linalg.norm(found.in_space - exactly(origin, north, east).in_space))


@pytest.mark.parametrize(
    ("latitude_deg", "largest_m"), [(0, 0.009), (45, 0.017), (-45, 0.017), (60, 0.033), (70, 0.07), (85, 1.13)]
)
def test_the_error_10_km_from_the_origin_is_as_stated(
    latitude_deg: float, largest_m: float, of_the_ship: ca.Function
) -> None:
    origin = Place(math.radians(latitude_deg), math.radians(12.0))
    for bearing in np.linspace(0, 2 * np.pi, 16, endpoint=False):
        assert error(of_the_ship, origin, 1e4 * math.cos(bearing), 1e4 * math.sin(bearing)) < largest_m


def test_the_error_falls_with_the_cube_of_the_distance(of_the_ship: ca.Function) -> None:
    origin = Place(math.radians(54.4), math.radians(18.6))
    far, near = (error(of_the_ship, origin, 0.6 * d, -0.8 * d) for d in (4e4, 1e4))
    assert far / near == pytest.approx(64, rel=0.05)


def test_a_minute_of_latitude_is_a_nautical_mile(of_the_ship: ca.Function) -> None:
    latitude, longitude = of_the_ship(math.radians(45.0), 0.0, 1852.0, 0.0)
    assert math.degrees(float(latitude)) * 60 - 45 * 60 == pytest.approx(1.0, rel=1e-3)
    assert float(longitude) == 0.0


def test_the_date_line_is_crossed(of_the_ship: ca.Function) -> None:
    _, east = of_the_ship(0.0, math.radians(179.99), 0.0, 5000.0)
    _, west = of_the_ship(0.0, math.radians(-179.99), 0.0, -5000.0)
    assert math.degrees(float(east)) == pytest.approx(-180 + 0.0349, abs=1e-3)
    assert math.degrees(float(west)) == pytest.approx(180 - 0.0349, abs=1e-3)


@settings(max_examples=30, deadline=None)
@given(latitude=st.floats(-2.0, 2.0), north=st.floats(-1e5, 1e5), east=st.floats(-1e5, 1e5))
def test_it_is_regular_everywhere(latitude: float, north: float, east: float, of_the_ship: ca.Function) -> None:
    values = [float(value) for value in of_the_ship(latitude, 0.3, north, east)]
    limited = max(-HIGHEST_LATITUDE, min(HIGHEST_LATITUDE, latitude))
    assert np.isfinite(values).all()
    assert values == [float(value) for value in of_the_ship(limited, 0.3, north, east)]


def test_a_ship_shows_where_it_is(mariner: Model) -> None:
    names = dict(zip(mariner.outputs, range(len(mariner.outputs)), strict=True))
    origin = {"origin.latitude": math.radians(54.4), "origin.longitude": math.radians(18.6)}
    p = mariner.parameter_values({**origin, "initial.x": 3000.0, "initial.y": -2000.0})
    y = np.array(mariner.output(mariner.initial(p), mariner.input_values(), p)).ravel()
    found = Place(*(y[names[name]] for name in GEOGRAPHIC_OUTPUTS))
    expected = exactly(Place(*origin.values()), 3000.0, -2000.0)
    assert np.linalg.norm(found.in_space - expected.in_space) < 1e-3
    assert mariner["position.latitude"].display_unit == "deg"
