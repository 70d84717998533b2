"""Another ship near by: against impulse and energy of its flow, a published spreadsheet, two bodies, and by hand."""

from __future__ import annotations

import functools
import itertools
import math

import casadi as ca
import numpy as np
import pytest

from tank2sim.dynamics.effects.banks import FAR_M
from tank2sim.dynamics.effects.ships_near import kernels
from tank2sim.dynamics.model import Model
from tank2sim.errors import InputError

from .ships import CB, RHO, U0, B, L, T, mariner_text, ship, state, values

SECTION = 0.98 * B * T
EXPONENT = CB / 0.98 / (1 - CB / 0.98)
VOLUME = CB * L * B * T
NEAR = {"forward_m": 0.3 * L, "starboard_m": 4 * B, "heading_rad": 0.0, "speed_mps": 6.0}


def other(
    forward: float, starboard: float, heading: float = 0.0, speed: float = 6.0, **more: float
) -> dict[str, float]:
    return {"forward_m": forward, "starboard_m": starboard, "heading_rad": heading, "speed_mps": speed, **more}


@functools.cache
def shown(names: tuple[str, ...], depth: float | None = None, text: str | None = None) -> tuple[Model, ca.Function]:
    """A ship with the effect, in water of a depth, and the function that gives these quantities at x, u, p."""
    effects = {"finite_depth": {"depth_m": depth}} if depth else {}
    model = ship({**effects, "other_ship": NEAR}, text)
    expression = model.expand(ca.vcat([model.symbol(name) for name in names]))
    return model, ca.Function("shown", [model.x, model.u, model.p], [expression])


def seen(
    names: tuple[str, ...],
    given: dict[str, float],
    at: dict[str, float],
    depth: float | None = None,
    text: str | None = None,
) -> np.ndarray:
    """Quantities with the effect's parameters `given`, as cards have them, at a state."""
    model, function = shown(names, depth, text)
    variables = {f"other_ship.{key.removesuffix('_m').removesuffix('_rad').removesuffix('_mps')}": value
                 for key, value in given.items()}  # fmt: skip
    x = [at.get(name, 0.0) for name in model.state_names]
    u = model.input_values({key: value for key, value in variables.items() if key in model.input_names})
    p = model.parameter_values({key: value for key, value in variables.items() if key in model.parameter_names})
    return np.array(function(x, u, p)).ravel()


FORCES = ("other_ship.X", "other_ship.Y", "other_ship.N")


def forces_by(
    given: dict[str, float],
    u: float,
    v: float = 0.0,
    r: float = 0.0,
    depth: float | None = None,
    text: str | None = None,
) -> np.ndarray:
    return seen(FORCES, given, state(u, v, r), depth, text)


@functools.cache
def big_ship() -> str:
    """A card of the KVLCC2's sizes with the added masses of the bodies of benchmarks/ship_ship.py."""
    sizes = {
        "length_m": 320.0, "beam_m": 58.0, "draught_m": 20.8, "block_coefficient": 0.81, "water_density_kgpm3": 1025.0,
        "Xudot": -0.0010057, "Yvdot": -0.0144033, "Nrdot": -0.00071089,
    }  # fmt: skip
    return mariner_text(valid_speed_mps="", **{key: f"{key} = {value}" for key, value in sizes.items()})


X, WEIGHTS = (one * L / 2 for one in np.polynomial.legendre.leggauss(60))
AREAS = SECTION * (1 - np.abs(2 * X / L) ** EXPONENT)


@functools.cache
def added_masses() -> np.ndarray:
    """Those of the Mariner's card over the density: surge and sway (m3), yaw (m5)."""
    moved = values(ship(), ["inertia.surge", "inertia.sway", "inertia.yaw"], state(U0, 0.0, 0.0))
    rigid = values(ship(), ["ship.mass", "ship.mass", "ship.yaw_inertia"], state(U0, 0.0, 0.0))
    return (moved - rigid) / RHO


def sections() -> tuple[np.ndarray, np.ndarray]:
    """A + b and A + a (n,) at X: b in proportion to A, a to a parabola times A, by the masses of the card."""
    surge, sway, yaw = added_masses()
    moments = [[np.sum(WEIGHTS * AREAS * X ** (one + other)) for other in (0, 2)] for one in (0, 2)]
    parabola = np.linalg.solve(moments, [sway, yaw])
    return AREAS * (1 + surge / VOLUME), AREAS * (1 + parabola[0] + parabola[1] * X**2)


def velocity(place: np.ndarray, centre: np.ndarray, heading: float, speed: float) -> np.ndarray:
    """Velocity (n, 2) at places (n, 2) of the doublets 2 A U along a ship: not of sources, as the effect has it."""
    ahead = np.array([math.cos(heading), math.sin(heading)])
    D = place[:, None, :] - (centre + X[:, None] * ahead)[None]
    R = np.linalg.norm(D, axis=-1)[..., None]
    moment = 2 * AREAS * speed * WEIGHTS / (4 * math.pi)
    flow = 3 * D * (D @ ahead)[..., None] / R**5 - ahead / R**3
    return np.einsum("ijk,j->ik", flow, moment)


def impulse(pose: np.ndarray, centre: np.ndarray, heading: float, speed: float) -> np.ndarray:
    """-dL/d(u, v, r), L = -rho sum of (A + a)(v + x r) V + (A + b) u U: the ship `pose` (x, y, psi) in that flow."""
    along, across = sections()
    ahead, aside = (np.array([math.cos(pose[2] + one), math.sin(pose[2] + one)]) for one in (0, math.pi / 2))
    flow = velocity(pose[:2] + X[:, None] * ahead, centre, heading, speed)
    U, V = flow @ ahead, flow @ aside
    step = RHO * WEIGHTS
    return np.array([np.sum(step * along * U), np.sum(step * across * V), np.sum(step * across * X * V)])


@pytest.mark.parametrize(
    ("forward", "starboard", "heading", "speed", "u", "v", "r"),
    [
        (0.3, 0.6, 0.0, 6.0, 0.0, 0.0, 0.0),
        (0.3, -0.6, 0.0, 6.0, 7.0, 0.0, 0.0),
        (0.5, 0.7, math.pi, 5.0, 6.0, 0.3, 0.0),
        (-0.4, 0.8, 0.9, 8.0, 5.0, -0.5, 0.008),
        (0.1, -0.7, 2.2, -4.0, 6.0, 0.2, -0.01),
    ],
)
def test_forces_are_those_of_energy_and_impulse_in_the_flow_of_the_other_ship(
    forward: float, starboard: float, heading: float, speed: float, u: float, v: float, r: float
) -> None:
    """Equations of Lagrange and Kirchhoff with L by doublets, differentiated by differences along the motion."""

    def energy(pose: np.ndarray, centre: np.ndarray) -> float:
        return float(-impulse(pose, centre, heading, speed) @ (u, v, r))

    def shifted(column: int, by: float) -> np.ndarray:
        return np.array([by if column == one else 0.0 for one in range(3)])

    centre, ahead = np.array([forward * L, starboard * L]), np.array([math.cos(heading), math.sin(heading)])
    step, time = 0.05, 0.01
    later, sooner = (
        impulse(np.array([u, v, r]) * one, centre + ahead * speed * one, heading, speed) for one in (time, -time)
    )
    P = -impulse(np.zeros(3), centre, heading, speed)
    rate = -(later - sooner) / (2 * time)
    by_place = [
        (energy(shifted(one, size), centre) - energy(shifted(one, -size), centre)) / (2 * size)
        for one, size in enumerate((step, step, step / L))
    ]
    expected = np.array([r * P[1], -r * P[0], v * P[0] - u * P[1]]) - rate + by_place
    found = forces_by(other(forward * L, starboard * L, heading, speed), u, v, r)
    scale = np.array([1.0, 1.0, L]) * np.max(np.abs(expected / [1, 1, L]))
    np.testing.assert_allclose(found / scale, expected / scale, atol=1e-2)


def test_a_moored_ship_in_shallow_water_has_the_sway_force_of_a_published_spreadsheet() -> None:
    """76 440 lbf: a sheet of Wang's (1975) equations, parabolic areas, one ship half as long as the other.

    It is in the tests of the public program digitalmodel as "Calculation of forces and moments from Wang". The sheet
    has the added mass of circular sections, equal to the displaced mass.
    """
    foot, pound, slug = 0.3048, 4.448222, 14.593903
    parabola = 2 / 3 * 0.98
    length, draught, beam = 950 * foot, 30 * foot, 3192 / 30 / 0.98 * foot
    card = {
        "length_m": length, "beam_m": beam, "draught_m": draught, "block_coefficient": parabola,
        "water_density_kgpm3": 1.9905 * slug / foot**3,
    }  # fmt: skip
    text = mariner_text(valid_speed_mps="", **{key: f"{key} = {value}" for key, value in card.items()})
    effects = {
        "finite_depth": {"depth_m": 95 * foot},
        "other_ship": other(
            0.0, 190 * foot, 0.0, 11.2 * foot,
            length_m=475 * foot, beam_m=6413 / 0.98 / 100 * foot, draught_m=100 * foot, block_coefficient=parabola,
        ),
    }  # fmt: skip
    model, density = ship(effects, text), card["water_density_kgpm3"]
    circular = density * parabola * length * beam * draught * np.array([1.0, length**2 / 20])
    moved, rigid = ["inertia.sway", "inertia.yaw"], ["ship.mass", "ship.yaw_inertia"]
    start = dict(zip(model.parameter_names, model.parameter_values(), strict=True))
    at = state(0.0, 0.0, 0.0)
    added = values(model, moved, at) - values(model, rigid, at)
    for name, factor in zip(("derivatives.Yvdot", "derivatives.Nrdot"), circular / added, strict=True):
        at[name] = start[name] * factor
    np.testing.assert_allclose(values(model, moved, at) - values(model, rigid, at), circular)
    X, Y, N = values(model, [f"other_ship.{name}" for name in "XYN"], at)
    assert pytest.approx(76_440 * pound, rel=0.01) == Y
    assert abs(X) < 1e-6 * Y and abs(N) < 1e-6 * Y * length


def test_far_away_the_other_ship_is_a_doublet_and_the_own_one_a_point() -> None:
    """Y = rho (volume + added volume) dV/dt of a doublet 2 U volume, at ten lengths."""
    distance, bearing, speed = 10 * L, 0.8, 6.0
    place = np.array([math.cos(bearing), math.sin(bearing)]) * distance
    moment = 2 * speed * VOLUME / (4 * math.pi)

    def V(x: float, y: float) -> float:
        return moment * 3 * x * y / math.hypot(x, y) ** 5  # at -place from the doublet

    rate = -speed * (V(-place[0] + 1, -place[1]) - V(-place[0] - 1, -place[1])) / 2
    found = forces_by(other(*place, 0.0, speed), 0.0)
    assert found[1] == pytest.approx(RHO * (VOLUME + added_masses()[1]) * rate, rel=0.02)


@pytest.mark.parametrize(("u", "heading"), [(0.0, 0.0), (6.0, 0.0), (6.0, math.pi)])
def test_sway_is_even_and_yaw_and_surge_odd_in_the_place_ahead(u: float, heading: float) -> None:
    ahead, astern = (forces_by(other(one * 0.4 * L, 3 * B, heading), u) for one in (1, -1))
    np.testing.assert_allclose(astern, ahead * [-1, 1, -1], rtol=1e-6)


def test_a_ship_on_the_other_side_mirrors_sway_and_yaw() -> None:
    starboard = forces_by(other(50.0, 90.0, 0.7), 6.0, 0.4, 0.005)
    port = forces_by(other(50.0, -90.0, -0.7), 6.0, -0.4, -0.005)
    np.testing.assert_allclose(port, starboard * [1, -1, -1], rtol=1e-9)


def test_forces_go_with_the_square_of_all_speeds() -> None:
    slow, fast = (forces_by(other(50.0, 90.0, 0.7, 3.0 * f), 3.0 * f, 0.2 * f, 0.003 * f) for f in (1, 2))
    np.testing.assert_allclose(fast, 4 * slow, rtol=1e-9)


def test_a_meeting_pushes_the_bow_away_then_draws_in_and_turns_the_bow_back() -> None:
    """The other ship comes down the starboard side: as pilots are taught."""
    coming, abeam, gone = (forces_by(other(one * L, 3 * B, math.pi), 6.0) for one in (0.9, 0.0, -0.9))
    assert coming[1] < 0 and coming[2] < 0  # away, to port
    assert abeam[1] > 0 and abs(abeam[2]) < 1e-6 * abeam[1] * L
    assert gone[1] < 0 and gone[2] > 0  # the stern pushed away
    half_way = forces_by(other(0.35 * L, 3 * B, math.pi), 6.0)
    assert half_way[2] > 0  # the bow drawn to the other's side


BODIES = {
    (0.0, 5.0, 0.0): (0.0, 1418.3, 0.0),
    (0.0, 5.0, 0.25): (378.4, 770.4, 72.5),
    (0.0, 5.0, 1.0): (-52.9, -512.8, -31.1),
    (5.0, 5.0, 0.0): (0.0, 842.6, 0.0),
    (5.0, 5.0, 0.5): (365.2, 58.7, 99.0),
    (5.0, 5.0, 1.0): (-49.6, -296.4, -1.6),
    (5.0, -5.0, 0.0): (0.0, 2136.9, 0.0),
    (5.0, -5.0, 0.25): (379.9, 1165.3, 58.4),
    (5.0, -5.0, 1.0): (-62.8, -734.4, -61.3),
}
"""Own speed and that of the other ship on the same heading, m/s, its place ahead over L: X, Y (kN), N (MN m) by panels,
as benchmarks/ship_ship.py --all prints them: sizes of the KVLCC2, a beam between the sides."""


@pytest.mark.parametrize("encounter", BODIES)
def test_two_bodies_in_ideal_fluid_have_these_forces(encounter: tuple[float, float, float]) -> None:
    u, speed, ahead = encounter
    bodies = other(
        ahead * 320.0, 116.0, 0.0, speed, length_m=320.0, beam_m=58.0, draught_m=20.8, block_coefficient=0.81
    )
    X, Y, N = forces_by(bodies, u, text=big_ship()) / [1e3, 1e3, 1e6]
    exact = BODIES[encounter]
    assert pytest.approx(exact[0], abs=0.07 * 380) == X
    assert pytest.approx(exact[1], abs=0.15 * max(abs(one[1]) for one in same_speeds(encounter))) == Y
    assert pytest.approx(exact[2], abs=0.13 * max(abs(one[2]) for one in same_speeds(encounter))) == N


def same_speeds(encounter: tuple[float, float, float]) -> list[tuple[float, float, float]]:
    return [forces for one, forces in BODIES.items() if one[:2] == encounter[:2]]


@pytest.mark.parametrize("depth", [10.0, 30.0])
@pytest.mark.parametrize("distance", [5.0, 20.0, 60.0, 500.0])
def test_images_in_the_bottom_are_summed(depth: float, distance: float) -> None:
    square = ca.SX.sym("square")
    function = ca.Function("sums", [square], list(kernels(square, ca.SX(1e-3), ca.SX(depth))))
    squares = distance**2 + (2 * depth * np.arange(-20_000, 20_001)) ** 2
    found = [float(one) for one in function(distance**2)]
    np.testing.assert_allclose(found, [np.sum(squares**-1.5), 3 * np.sum(squares**-2.5)], rtol=0.013)


def test_deep_water_is_the_limit_of_a_great_depth() -> None:
    deep, great, shallow = (forces_by(NEAR, 6.0, depth=depth) for depth in (None, 9e3, 1.5 * T))
    np.testing.assert_allclose(great, deep, rtol=1e-4)
    assert np.all(np.abs(shallow) > 1.3 * np.abs(deep))


def test_ships_on_top_of_one_another_have_finite_forces_and_slopes_and_no_validity() -> None:
    names = (*FORCES, "validity_by.other_ship")
    model, function = shown(names)
    slopes = ca.Function(
        "slopes",
        [model.x, model.u, model.p],
        [ca.jacobian(function(model.x, model.u, model.p)[:3], ca.vcat([model.x, model.u]))],
    )
    x = [U0 if name == "motion.u" else 0.0 for name in model.state_names]
    for forward, starboard in ((0.0, 0.0), (0.2 * L, 0.1 * B), (0.03 * L, -0.5 * B)):
        u = model.input_values(
            {"other_ship.forward": forward, "other_ship.starboard": starboard, "other_ship.heading": 0.4}
        )
        values_there = np.array(function(x, u, model.parameter_values())).ravel()
        assert np.all(np.isfinite(values_there)) and values_there[3] == 0.0
        assert np.all(np.isfinite(np.array(slopes(x, u, model.parameter_values()))))


def test_clearance_is_the_least_distance_of_the_centre_lines_less_half_of_both_beams() -> None:
    along = np.linspace(-45.0, 45.0, 2001)
    for x, y, heading in itertools.product((-90.0, 0.0, 140.0), (-70.0, 20.0, 150.0), (0.0, 0.6, 1.7, 3.0)):
        forward, starboard = x + along * math.cos(heading), y + along * math.sin(heading)
        least = np.min(np.hypot(np.maximum(np.abs(forward) - L / 2, 0), starboard))
        given = other(x, y, heading, length_m=90.0, beam_m=15.0)
        found = seen(("other_ship.clearance",), given, state(U0, 0.0, 0.0))[0]
        assert found + (B + 15.0) / 2 == pytest.approx(least, abs=0.03)


def test_another_ship_of_which_nothing_is_said_has_the_own_sizes() -> None:
    own = {"length_m": L, "beam_m": B, "draught_m": T, "block_coefficient": CB}
    at = state(6.0, 0.2, 0.003)
    plain, same, larger = (
        values(ship({"other_ship": {**NEAR, **more}}), list(FORCES), at)
        for more in ({}, own, {**own, "beam_m": 1.2 * B})
    )
    np.testing.assert_allclose(plain, same, rtol=1e-12)
    assert abs(larger[1] / plain[1]) > 1.1


@pytest.mark.parametrize(("beams", "expected"), [(2.05, 1.0), (1.5, 0.5), (1.0, 0.0)])
def test_validity_is_half_where_the_sides_are_half_a_beam_apart(beams: float, expected: float) -> None:
    given = other(0.0, beams * B, 0.0, 6.0)
    found = seen(("validity_by.other_ship",), given, state(U0, 0.0, 0.0))[0]
    assert found == pytest.approx(expected, abs=1e-6)


def test_validity_falls_near_and_with_the_depth_froude_number_of_the_other_ship() -> None:
    def validity(starboard: float, speed: float = 6.0, depth: float | None = None) -> float:
        given = other(0.0, starboard, 0.0, speed)
        return float(seen(("validity_by.other_ship",), given, state(U0, 0.0, 0.0), depth)[0])

    assert validity(2.1 * B) == 1.0 and 0 < validity(1.5 * B) < 1 and validity(0.99 * B) == 0.0
    assert validity(4 * B, 7.0, 12.0) == 1.0 > validity(4 * B, 9.0, 12.0)


def test_without_another_ship_nothing_is_felt_and_a_place_beyond_bounds_is_refused() -> None:
    found = seen((*FORCES, "validity_by.other_ship"), other(FAR_M, FAR_M), state(U0, 0.0, 0.0))
    assert np.max(np.abs(found[:3])) < 10 and found[3] == 1.0
    model, _ = shown(FORCES)
    assert np.all(np.isfinite(model.input_values({"other_ship.forward": -2 * FAR_M})))
    for wrong in ({"other_ship.speed": 100.0}, {"other_ship.starboard": -3 * FAR_M}):
        with pytest.raises(InputError):
            model.input_values(wrong)
