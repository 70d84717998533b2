"""Where on the Earth: latitude and longitude of a ship whose position is known to north and east of an origin.

The plane of x to north and y to east touches the ellipsoid of WGS 84 at the origin. To the second order in distance,
with M and N the radii of curvature in the meridian and in the prime vertical at the latitude phi0 of the origin,

    phi    = phi0 + x/M - y^2 tan(phi0)/(2 M N) - 3/2 e^2 sin(phi0) cos(phi0) x^2/(M^2 (1 - e^2 sin^2(phi0)))
    lambda = lambda0 + y/(N cos(phi0)) + x y tan(phi0)/(N^2 cos(phi0))

Torge & Mueller (2012), Geodesy, 4th ed., 4.1 (M and N) and 6.3 (series of the geodetic direct problem), cut after the
second order. What is left out grows with the cube of the distance: 10 km away from the origin the position is 0.03 m
wrong at 60 deg of latitude and 1.1 m at the limit of 85 deg (tests/dynamics/test_geographic.py). Headings count from
the meridian of the origin; at the ship it differs by y tan(phi0)/N, 0.16 deg at 10 km to east and 60 deg of latitude.
"""

from __future__ import annotations

import math

import casadi as ca

from tank2sim.dynamics.model import Parameter, Quantity, Variable

EQUATORIAL_RADIUS_M = 6378137.0
"""Semi-major axis of WGS 84 (NGA.STND.0036_1.0.0_WGS84)."""

FLATTENING = 1 / 298.257223563
"""Flattening of WGS 84 (same source)."""

HIGHEST_LATITUDE = math.radians(85.0)
"""Origins nearer to a pole are taken as lying here, where the series is regular: project choice, beyond harbours."""

NOMINAL_ANGLE = 1e-4
"""Nominal value of a latitude or longitude, rad: a few ship lengths, 640 m."""

GEOGRAPHIC_OUTPUTS = ("position.latitude", "position.longitude")


def geographic(north: ca.SX, east: ca.SX) -> tuple[Variable, ...]:
    """Parameters ``origin.latitude``, ``origin.longitude`` (rad), and the quantities of :data:`GEOGRAPHIC_OUTPUTS`.

    Parameters
    ----------
    north, east : casadi.SX
        Position from the origin, m.
    """
    most = math.degrees(HIGHEST_LATITUDE)
    latitude, longitude = (
        Parameter(
            f"origin.{name}",
            "rad",
            f"Geodetic {name} (WGS 84) of the origin of motion.x and motion.y, positive to {side}{limit}",
            display_unit="deg",
            minimum=-bound,
            maximum=bound,
            start=0.0,
            tunable=False,
        )
        for name, side, limit, bound in (
            ("latitude", "north", f"; beyond {most:g} deg it is taken as {most:g} deg", HIGHEST_LATITUDE),
            ("longitude", "east", "", math.pi),
        )
    )
    phi, turned = _position(north, east, latitude.symbol)
    where = longitude.symbol + turned
    values = {"latitude": phi, "longitude": ca.atan2(ca.sin(where), ca.cos(where))}
    sides = {"latitude": "north", "longitude": "east, -180 to 180 deg"}
    return (
        latitude,
        longitude,
        *(
            Quantity(
                f"position.{name}",
                "rad",
                f"Geodetic {name} (WGS 84) of the ship, positive to {sides[name]}",
                value,
                display_unit="deg",
                nominal=NOMINAL_ANGLE,
                minimum=-bound,
                maximum=bound,
            )
            for (name, value), bound in zip(values.items(), (math.pi / 2, math.pi), strict=True)
        ),
    )


def _position(north: ca.SX, east: ca.SX, origin: ca.SX) -> tuple[ca.SX, ca.SX]:
    """Latitude, and longitude relative to the origin, rad."""
    phi0 = ca.fmax(-HIGHEST_LATITUDE, ca.fmin(HIGHEST_LATITUDE, origin))
    sine, cosine = ca.sin(phi0), ca.cos(phi0)
    eccentricity = FLATTENING * (2 - FLATTENING)  # e^2
    squared = 1 - eccentricity * sine**2
    prime_vertical = EQUATORIAL_RADIUS_M / ca.sqrt(squared)
    meridian = prime_vertical * (1 - eccentricity) / squared
    x, y, tangent = north / meridian, east / prime_vertical, sine / cosine
    bent = y**2 * tangent * prime_vertical / meridian / 2 + 1.5 * eccentricity * sine * cosine * x**2 / squared
    return phi0 + x - bent, y * (1 + x * meridian / prime_vertical * tangent) / cosine
