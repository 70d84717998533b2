"""Another ship near by, that meets, overtakes or passes: its place, heading and speed are inputs."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from tank2sim.cards.card import SteeredCard
from tank2sim.dynamics.effects.banks import FAR_M
from tank2sim.dynamics.effects.depth import DEPTH_FROUDE_MARGIN, LARGEST_DEPTH_FROUDE, MIDSHIP_COEFFICIENT
from tank2sim.dynamics.effects.effect import Effect, EffectParameter, EffectSymbols
from tank2sim.dynamics.effects.forces import with_forces, with_validity
from tank2sim.dynamics.effects.froude_scale import lengths, speeds
from tank2sim.dynamics.effects.particulars import FINEST, FULLEST, model_particular, with_particulars
from tank2sim.dynamics.hull import inside_range
from tank2sim.dynamics.model import Model, Quantity

POINTS, OTHER_POINTS = 8, 6
"""Points of Gauss and Legendre on the own hull and on the other one: on a moored ship forces and moment differ from
those of many points by at most 1.3 % of their largest where the sides are half a beam apart
(``benchmarks/ship_ship.py``)."""

CLEAR_BEAMS = 1.0
"""Clearance over the mean beam from which ``validity`` is 1; it falls to 0 at contact. There forces differ from those
of two bodies in ideal fluid by up to 14 % of the largest (``benchmarks/ship_ship.py``), except in sway of a ship that
overtakes, where they are small: project choice."""

IMAGES = 1
"""Images of the other ship in bottom and surface that are summed one by one, above and below; the further ones are an
integral (:func:`kernels`)."""


@dataclass(frozen=True)
class Body:
    """A ship as the theory of slender bodies sees it; numbers or expressions, SI.

    `section` is the area of its midship section, `prismatic` the displaced volume over section and length.
    """

    length: Any
    section: Any
    prismatic: Any


def _points(count: int) -> tuple[ca.DM, ca.DM]:
    """Points and weights (count,) between -1 and 1."""
    points, weights = np.polynomial.legendre.leggauss(count)
    return ca.DM(points), ca.DM(weights)


def _exponent(body: Body) -> Any:
    """p of the areas A_m (1 - abs(2 x/L)^p), which have the prismatic coefficient p/(p + 1)."""
    prismatic = ca.fmin(body.prismatic, FULLEST / MIDSHIP_COEFFICIENT)
    return prismatic / (1 - prismatic)


@dataclass(frozen=True)
class Sections:
    """Sections of the own hull, each (POINTS,): weights w of a sum over its length, m, and what they have at x.

    `x` in m, forward of midships; areas A, m2, and added masses over the density, m2: `along`, b, and `across`, a.
    """

    x: ca.SX
    weights: ca.SX
    areas: ca.SX
    along: ca.SX
    across: ca.SX


def sections(body: Body, masses: tuple[ca.SX, ca.SX, ca.SX]) -> Sections:
    """Sections of the areas A = A_m (1 - abs(2 x/L)^p), with the added masses b = k_x A, a = (k_0 + k_2 (2 x/L)^2) A.

    Parameters
    ----------
    body : Body
    masses : tuple of casadi.SX
        Added masses in surge and in sway, m3, and added inertia in yaw, m5, over the density: sums of b, a and x^2 a.
    """
    points, weights = _points(POINTS)
    areas = body.section * (1 - ca.fabs(points) ** _exponent(body))
    step = weights * body.length / 2
    zeroth, second, fourth = (ca.sum1(areas * step * points**power) for power in (0, 2, 4))
    surge, sway, yaw = *masses[:2], masses[2] / (body.length / 2) ** 2
    determinant = zeroth * fourth - second**2
    middle, ends = (sway * fourth - yaw * second) / determinant, (yaw * zeroth - sway * second) / determinant
    across = (middle + ends * points**2) * areas
    return Sections(points * body.length / 2, step, areas, surge / zeroth * areas, across)


def sources(body: Body, speed: ca.SX) -> tuple[ca.SX, ca.SX]:
    """Places x (m) and strengths (m3/s) of the sources that stand for a ship and its mirror image in the surface.

    -2 U A'(x) for each length, positive at the bow of a ship that moves ahead at U = `speed` (m/s).
    """
    points, weights = _points(OTHER_POINTS)
    p = _exponent(body)
    slopes = -body.section * p * ca.fabs(points) ** (p - 1) * ca.sign(points)
    return points * body.length / 2, -2 * speed * slopes * weights


def kernels(square: ca.SX, least: ca.SX, depth: ca.SX | None) -> tuple[ca.SX, ca.SX]:
    """Sum of R^-3 (1/m3) and of 3 R^-5 (1/m5) over a source and its images in the bottom and the surface.

    Parameters
    ----------
    square : casadi.SX
        Square of the horizontal distance, m2.
    least : casadi.SX
        Nearer than this, m, the distance R of the source itself is replaced by (R^8 + least^8)^(1/8), so that both sums
        are bounded; at twice the distance they change by 0.2 %.
    depth : casadi.SX or None
        Depth H of the water, m; None: deep water. The images are 2 n H above and below. Those beyond :data:`IMAGES` are
        summed by the rule of the midpoint, an integral of closed form from (2 IMAGES + 1) H on.
    """
    near = 1 / ca.sqrt(ca.sqrt(square**4 + least**8))
    cube = near * ca.sqrt(near)
    fifth = 3 * cube * near
    if depth is None:
        return cube, fifth
    for image in range(1, IMAGES + 1):
        inverse = 1 / (square + (2 * image * depth) ** 2)
        part = 2 * inverse * ca.sqrt(inverse)
        cube, fifth = cube + part, fifth + 3 * part * inverse
    start = (2 * IMAGES + 1) * depth
    root = ca.sqrt(square + start**2)
    tail = 1 / (root * (root + start))
    return cube + tail / depth, fifth + tail**2 * (2 * root + start) / (root * depth)


@dataclass(frozen=True)
class Flow:
    """Flow of the other ship at points of the own centre line, in own axes: each (n,).

    `U`, `V` are the velocities forward and to starboard, m/s, `U_t`, `V_t` their rates at a point that rests in the
    water, m/s2, and `V_x` the slope of V along the own ship, 1/s.
    """

    U: ca.SX
    V: ca.SX
    U_t: ca.SX
    V_t: ca.SX
    V_x: ca.SX


def flow_of(other: Body, speed: ca.SX, at: ca.SX, given: EffectSymbols, least: ca.SX, depth: ca.SX | None) -> Flow:
    """The flow of a ship that moves steadily ahead at `speed`, at places `at` (m) of the own centre line.

        grad phi = sum q D K_3/(4 pi),   grad grad phi = sum q (K_3 I - K_5 D D)/(4 pi),   d/dt = -U_2 e_2 . grad

    D are the distances from the sources q, K_3 and K_5 the sums of :func:`kernels`, which takes `least` and `depth`;
    e_2 is ahead of the other ship. `given` are the symbols of the effect.
    """
    ahead = ca.cos(given["heading"]), ca.sin(given["heading"])
    xi, strengths = sources(other, speed)
    columns, rows = ca.DM.ones(1, OTHER_POINTS), ca.DM.ones(at.shape[0], 1)
    dx = at @ columns - rows @ (given["forward"] + ahead[0] * xi).T
    dy = -rows @ (given["starboard"] + ahead[1] * xi).T
    cube, fifth = kernels(dx**2 + dy**2, least, depth)
    q = strengths / (4 * math.pi)
    along = dx * ahead[0] + dy * ahead[1]
    return Flow(
        U=(dx * cube) @ q,
        V=(dy * cube) @ q,
        U_t=-(cube * ahead[0] - fifth * dx * along) @ q * speed,
        V_t=-(cube * ahead[1] - fifth * dy * along) @ q * speed,
        V_x=-(fifth * dx * dy) @ q,
    )


def clearance(given: EffectSymbols, ship: Body, other: Body) -> ca.SX:
    """Least distance, m, between the centre lines of both ships; zero where they cross."""
    cos, sin = ca.cos(given["heading"]), ca.sin(given["heading"])
    x, y = given["forward"], given["starboard"]
    halves = ship.length / 2, other.length / 2
    # ends of the other ship in own axes, and own ends in its axes
    other_ends = [(x + side * cos * halves[1], y + side * sin * halves[1]) for side in (1, -1)]
    ship_ends = [((side * halves[0] - x) * cos - y * sin, -(side * halves[0] - x) * sin - y * cos) for side in (1, -1)]
    squares = [
        ca.fmax(ca.fabs(along) - half, 0) ** 2 + across**2
        for ends, half in ((other_ends, halves[0]), (ship_ends, halves[1]))
        for along, across in ends
    ]
    apart = ca.fmin(ca.fmin(squares[0], squares[1]), ca.fmin(squares[2], squares[3]))
    crossed = ca.logic_and(other_ends[0][1] * other_ends[1][1] < 0, ship_ends[0][1] * ship_ends[1][1] < 0)
    least: ca.SX = ca.sqrt(ca.if_else(crossed, 0, apart))
    return least


def _with_other_ship(model: Model, given: EffectSymbols, card: SteeredCard) -> Model:
    """X, Y, N of a slender hull in the flow U, V of another one, sums over its length with c = a - b:

        X = rho sum of (A + b) U_t - c ((v + x r) V_x + r V)
        Y = rho sum of (A + a) V_t + c (u V_x - r U)
        N = rho sum of x (A + a) V_t + c (u (V + x V_x) + v U)

    A, a, b as in :func:`sections`, with the added masses of the model. The equations of Lagrange and Kirchhoff
    for L = -rho sum of (A + a)(v + x r) V + (A + b) u U, which is linear in the other's flow; with b = 0 they are the
    forces of Lagally on the own sources and doublets and the rate of their impulse: Landweber and Yih (1956), Forces,
    moments, and added masses for Rankine bodies, J. Fluid Mech. 1, 319-336; of two ships Tuck and Newman (1974),
    Hydrodynamic interactions between ships, 10th Symposium on Naval Hydrodynamics, and of a moored one Wang (1975),
    Dynamic effects of ship passage on moored vessels, J. Waterways, Harbors Coastal Eng. Div. 101, 247-258 (the papers
    were not at hand).
    """
    model, (beam, draught, block) = with_particulars(model, card, "beam_m", "draught_m", "block_coefficient")
    length, density = model.symbol("ship.length"), model.symbol("ship.water_density")
    u, v, r = (model.symbol(f"motion.{name}") for name in "uvr")
    ship = Body(length, MIDSHIP_COEFFICIENT * beam * draught, block / MIDSHIP_COEFFICIENT)
    other_section = MIDSHIP_COEFFICIENT * given["beam"] * given["draught"]
    other = Body(given["length"], other_section, given["block_coefficient"] / MIDSHIP_COEFFICIENT)
    speed, mean_beam = given["speed"], (beam + given["beam"]) / 2
    depth = model.symbol("water.depth") if "water.depth" in model else None
    moved = zip(("surge", "sway", "yaw"), ("mass", "mass", "yaw_inertia"), strict=True)
    surge, sway, yaw = (
        (model.symbol(f"inertia.{one}") - model.symbol(f"ship.{rigid}")) / density for one, rigid in moved
    )
    hull = sections(ship, (surge, sway, yaw))
    x, flow = hull.x, flow_of(other, speed, hull.x, given, mean_beam / 2, depth)
    along, across = hull.areas + hull.along, hull.areas + hull.across
    passed = hull.across - hull.along
    per_length = (
        along * flow.U_t - passed * ((v + x * r) * flow.V_x + r * flow.V),
        across * flow.V_t + passed * (u * flow.V_x - r * flow.U),
        x * across * flow.V_t + passed * (u * (flow.V + x * flow.V_x) + v * flow.U),
    )
    X, Y, N = (density * ca.sum1(hull.weights * one) for one in per_length)
    left = Quantity(
        "other_ship.clearance",
        "m",
        "Distance of the centre lines of both ships, where they are nearest, less half of both beams",
        clearance(given, ship, other) - mean_beam,
        nominal=model_particular(card, "beam_m"),
    )
    inside = inside_range(CLEAR_BEAMS - left.symbol / mean_beam, CLEAR_BEAMS)
    if depth is not None:
        froude = ca.fabs(speed) / ca.sqrt(card.environment.gravity_mps2 * depth)
        inside *= inside_range(froude - LARGEST_DEPTH_FROUDE, DEPTH_FROUDE_MARGIN)
    met = with_forces(model, X=X, Y=Y, N=N).extend(left, outputs=[left.name])
    cause = "the distance of the other ship and its depth Froude number"
    return with_validity(met, "other_ship", cause, inside)


def _place(name: str, description: str, typical: float) -> EffectParameter:
    return EffectParameter(
        f"{name}_m",
        f"midships of the other ship {description} ({FAR_M:.0f}: none)",
        -FAR_M,
        FAR_M,
        input_name=f"other_ship.{name}",
        absent=FAR_M,
        typical=lengths(typical),
    )


OTHER_SHIP = Effect(
    name="other_ship",
    acts_on="force",
    description="Another ship that meets, overtakes or passes pushes the bow away, draws the ship in and turns it.",
    source="Tuck and Newman (1974); Wang (1975); Landweber and Yih (1956)",
    parameters=(
        # Half a length ahead, three beams abeam: an encounter that is felt (project choice).
        _place("forward", "forward of own midships, along own centre line", 0.5),
        _place("starboard", "to starboard of own centre line", 0.4),
        EffectParameter(
            "heading_rad",
            "heading of the other ship less the own one, clockwise (pi: it comes the other way)",
            -2 * math.pi,
            2 * math.pi,
            input_name="other_ship.heading",
            typical=(math.pi,),
        ),
        EffectParameter(
            "speed_mps",
            "speed of the other ship ahead through the water",
            -15.0,
            15.0,
            input_name="other_ship.speed",
            absent=0.0,
            typical=speeds(1.0),
        ),
        EffectParameter("length_m", "length of the other ship", 1.0, 500.0, lambda card: card.ship.length_m),
        EffectParameter("beam_m", "beam of the other ship", 0.1, 100.0, lambda card: model_particular(card, "beam_m")),
        EffectParameter(
            "draught_m", "draught of the other ship", 0.05, 40.0, lambda card: model_particular(card, "draught_m")
        ),
        EffectParameter(
            "block_coefficient",
            "block coefficient of the other ship",
            FINEST,
            FULLEST,
            lambda card: model_particular(card, "block_coefficient"),
        ),
    ),
    equations=_with_other_ship,
    sought=False,
    terminal="Other ship",
)
