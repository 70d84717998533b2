"""The ship at low speed and astern, where the polynomial of (3.5), (3.8) does not hold.

Its prime system divides by U, and its powers of Du' = (u - u0)/U grow without bound as the ship stops. So below a speed
u_b (the card's ``low_speed_below_mps``, by default the lowest speed at which it holds) the forces pass into those of
this module, which are regular everywhere, at rest too:

    X = F_p - R_b u (V + e)/(u_b (u_b + e))
    Y = 1/2 rho L^2 (Y_v (V + e) v + L Y_r u r) - 1/2 rho T C_D integral of (v + x r) abs(v + x r) dx
    N = 1/2 rho L^3 (N_v u v + L N_r (V + e) r) - 1/2 rho T C_D integral of x (v + x r) abs(v + x r) dx

with the hydrodynamic parts of Y_r and N_r, the inertia of (3.1) and the added masses of the card. V is U, with a slope
at rest (:func:`regular_speed`), and e is small. Damping of the first order goes with V, so that it resists ahead and
astern; couplings go with u, as lift and the moment of Munk do: they change sides astern. Asymmetries (Y0, N0) and all
other terms of the polynomial are left out.

F_p is the thrust at nominal revolutions (to which :func:`tank2sim.dynamics.propulsion.propeller_force` adds what others
make of it), and the resistance R_b is that of the card at u_b: F_p less the card's X straight ahead at u_b. A card
without propulsion keeps its revolutions, whatever the speed, unless its X at u_b is a resistance already (a bare hull:
F_p = 0, and it comes to rest).

The rudder is in the race of the propeller, with the card's own terms in delta alone, as they are at u0:

    F = F_delta(u0) (A u|u| + B n^2/n0^2) + F_d(u0) gamma B/sqrt(J) n/n0 (v - r L/2)
    A u_b^2 + B = k,    B/A = J, but B abs(Y_d(u0)) <= F_p/(1 - t),    J = 2 F_p/(c rho pi D^2/4)

k is the slope of the polynomial's yaw moment by rudder at u_b over that at u0 (N_d, N_du, N_duu), so that at nominal
revolutions the two forms meet at u_b. It is held between :data:`LEAST_RUDDER` (u_b/u0)^2 and 1. J is what the propeller
adds to the square of the speed in its race by momentum theory, at nominal revolutions, where c = (1 - t)(1 - w)^2; only
a propeller that turns ahead (n > 0) adds it. The bound on B is that of momentum: a rudder that turns the whole race by
its own angle gets F_p/(1 - t) sin(delta) from it. Astern the first term is weaker. F_d is the part linear in delta: a
stern that swings meets the race at an angle, and so the rudder damps the swing (what it does in the stream of the hull
is in Y_v to N_r).

Oltmann and Sharma (1984), Simulation of combined engine and rudder maneuvers using an improved model of
hull-propeller-rudder interactions, 15th Symposium on Naval Hydrodynamics (the same division: lift, cross-flow drag,
resistance, rudder in the race); Hooft (1994), The cross flow drag on a manoeuvring ship, Ocean Engineering 21,
329-342; Faltinsen (1990), Sea Loads, 6.4; Brix (ed.) (1993), Manoeuvring Technical Manual (momentum theory of the
race). That the card's linear terms are taken as they are is project choice.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from tank2sim.cards.card import ManoeuvringCard
from tank2sim.dynamics.effects.particulars import model_particular
from tank2sim.dynamics.model import Parameter

Symbols = Mapping[str, ca.SX]
"""Symbols of the hull's variables, by name."""

Forces = tuple[Any, Any, Any]
"""X, Y (N) and N (N m)."""

LEAST_BOUND, LARGEST_BOUND = 0.05, 0.9
"""Bounds of u_b over u0: a card that holds down to rest still divides by U there, and the thrust of a card without
propulsion is found from how X falls between u_b and u0. Project choices."""

BLEND = 0.5
"""The polynomial's share falls from 1 at u_b to 0 at this share of u_b^2 (0.71 u_b): project choice, narrow because a
polynomial soon departs from the truth beyond its range, and as wide as the KVLCC2 needs to turn steadily within it. In
the hull's surge force it is the cube of that: the Mariner's polynomial would drive it on with a stopped engine."""

STILL_SPEED = 1e-7
"""Speed over u0 at which the ship counts as at rest: project choice. Above 0.1 u0 it changes U by less than 1e-12 of
itself."""

LINEAR_DAMPING = 0.025
"""e over u0, the speed at which a ship at rest is damped: small next to cross-flow drag at any speed that matters, but
it brings the ship to rest. Project choice."""

LEAST_SHARE, LEAST_RESISTANCE = 0.7, 1e-4
"""R_b is not taken to be less than this share of (u_b/u0)^2 times the resistance at u0, of which waves, that fall away,
make up three tenths at most on ships that push no hump; nor than this much of 1/2 rho L^2 u_b^2, a sixth of a usual
resistance. Both are project choices, for cards whose thrust and polynomial disagree."""

DRAG_COEFFICIENT = 1.0
"""C_D: the largest of 0.6 to 1 for whole hulls (Faltinsen 1990, 6.4), for a turn on the spot works on the ends, which
are sharp and have more of it than midships."""

RUDDER_ASTERN = 0.5
"""Rudder force going astern over that ahead at one speed: the flow comes from the trailing edge, with less lift and an
earlier stall. Project choice."""

THRUST_DEDUCTION, WAKE = 0.2, 0.3
"""t and w of usual ships with one screw (Harvald 1983, Resistance and Propulsion of Ships)."""

LEAST_RUDDER = 0.3
"""k is not taken to be less than this share of (u_b/u0)^2, which a polynomial has whose rudder goes with the square of
speed: some lose it all at the lower end of their range (the Mariner at u0/2). Project choice."""

STRAIGHTENING = 0.5
"""gamma, the share of the stern's cross flow that reaches a rudder in the race: between the 0.40 and 0.64 of the KVLCC2
(Yasukawa and Yoshimura 2015, J. Mar. Sci. Technol. 20)."""

SOURCES = {
    "low_speed.drag_coefficient": "the largest of 0.6 to 1 for whole hulls (Faltinsen 1990, Sea Loads, 6.4)",
    "low_speed.rudder_astern": "a choice of tank2sim's: the flow comes from the trailing edge, with an earlier stall",
    "low_speed.straightening": "between the 0.40 and 0.64 of the KVLCC2 (Yasukawa and Yoshimura 2015)",
    "low_speed.thrust_deduction": "usual for ships with one screw (Harvald 1983, Resistance and Propulsion of Ships)",
    "low_speed.wake_fraction": "usual for ships with one screw (Harvald 1983, Resistance and Propulsion of Ships)",
}
"""Where the values of parameters that no card states are from, in a few words."""

STATIONS = 4
"""Gauss-Legendre stations along the hull, taken as the rectangle L T: exact unless the pivot lies within the hull; then
the moment errs by 1 % and the force by 3 % at most of the largest that the end speed can give."""


def low_speed_parameters(card: ManoeuvringCard) -> tuple[Parameter, ...]:
    """Parameters of the forces at low speed: ``ship.draught``, ``ship.propeller_diameter`` and ``low_speed.*``."""
    bound = card.model.low_speed_bound_mps

    def length(key: str, name: str, description: str) -> Parameter:
        estimated = "" if getattr(card.ship, key) else " (estimated: the card states none)"
        value = model_particular(card, key)
        return Parameter(
            name,
            "m",
            f"{description}, for the forces at low speed{estimated}",
            nominal=value,
            minimum=1e-6,
            start=value,
            tunable=False,
        )

    def number(name: str, description: str, start: float, maximum: float = 3.0) -> Parameter:
        return Parameter(name, "1", description, minimum=0.0, maximum=maximum, start=start)

    return (
        length("draught_m", "ship.draught", "Draught"),
        length("propeller_diameter_m", "ship.propeller_diameter", "Diameter of the propeller"),
        Parameter(
            "low_speed.bound",
            "m/s",
            "Speed below which the forces at low speed replace the polynomial, within 0.05 and 0.9 u0",
            display_unit="knots",
            nominal=bound or 1.0,
            minimum=0.0,
            start=bound,
            tunable=False,
        ),
        number("low_speed.drag_coefficient", "Cross-flow drag coefficient of the hull at low speed", DRAG_COEFFICIENT),
        number("low_speed.rudder_astern", "Rudder force going astern over that ahead at one speed", RUDDER_ASTERN),
        number(
            "low_speed.straightening",
            "Share of the stern's cross flow that reaches a rudder in the race",
            STRAIGHTENING,
            maximum=0.95,
        ),
        number(
            "low_speed.thrust_deduction",
            "Thrust deduction t, for the race at low speed",
            THRUST_DEDUCTION,
            maximum=0.95,
        ),
        number("low_speed.wake_fraction", "Wake fraction w, for the race at low speed", WAKE, maximum=0.95),
    )


def lowest_speed(s: Symbols) -> ca.SX:
    """u_b, m/s: the lowest speed of the polynomial, within its bounds over u0."""
    return _bounded(s, s["low_speed.bound"])


def _bounded(s: Symbols, speed: ca.SX) -> ca.SX:
    u0 = s["ship.speed"]
    return ca.fmax(LEAST_BOUND * u0, ca.fmin(speed, LARGEST_BOUND * u0))


def share_of_low_speed(s: Symbols) -> ca.SX:
    """Share of the forces at low speed: 0 from u_b upwards, to the last digit, 1 at rest and astern."""
    return _share_below(s, lowest_speed(s))


def share_out_of_range(s: Symbols) -> ca.SX:
    """How far the speed is below the lowest speed at which the card holds: 0 to 1, as the share of low speed is."""
    return _share_below(s, _bounded(s, s["ship.slowest"]))


def _share_below(s: Symbols, bound: ca.SX) -> ca.SX:
    """3 y^2 - 2 y^3, y from 0 to 1 between 1 and :data:`BLEND` of (u|u| + v^2)/bound^2, which is U^2/bound^2 ahead."""
    u, v = s["motion.u"], s["motion.v"]
    square = bound**2
    short = square - (u * ca.fabs(u) + v * v)
    # The greater of `short` and 0, the lesser of that and 1: with |a|, to which a solver need not step up as to a kink.
    below = (short + ca.fabs(short)) * (0.5 / ((1 - BLEND) * square))
    twice = 1 + below - ca.fabs(1 - below)
    return twice * twice * (0.75 - 0.25 * twice)


def regular_speed(s: Symbols) -> ca.SX:
    """V, m/s: U, but :data:`STILL_SPEED` u0 at rest, so that it has a slope there and may be divided by."""
    return ca.sqrt(s["motion.u"] ** 2 + s["motion.v"] ** 2 + (STILL_SPEED * s["ship.speed"]) ** 2)


def nominal_thrust(s: Symbols, X_bound: ca.SX) -> ca.SX:
    """F_p, N: effective thrust at nominal revolutions, from the card's X straight ahead at u_b (N).

    Without propulsion it is what leaves X_bound over a resistance ~ u^2 at u_b and nothing at u0; zero for a hull whose
    X_bound is a resistance.
    """
    u0, bound = s["ship.speed"], lowest_speed(s)
    if "propulsion.Xnn" in s:
        return 0.5 * s["ship.water_density"] * (s["ship.length"] * u0) ** 2 * s["propulsion.Xnn"]
    return ca.fmax(0, X_bound) * u0**2 / (u0**2 - bound**2)


def hull_forces(s: Symbols, V: ca.SX, X_bound: ca.SX, X_u0: ca.SX, linear: Mapping[str, Any]) -> Forces:
    """X with the thrust at nominal revolutions, Y and N of the hull at low speed, with the inertial terms of (3.1).

    Parameters
    ----------
    s : mapping
        Symbols of the hull.
    V : casadi.SX
        :func:`regular_speed`, m/s.
    X_bound, X_u0 : casadi.SX
        The card's X straight ahead at u_b and at u0, N.
    linear : mapping
        Hydrodynamic parts of Yv, Yr, Nv, Nr, SI at a speed of 1 m/s.
    """
    u, v, r = s["motion.u"], s["motion.v"], s["motion.r"]
    mass, moment, bound = s["ship.mass"], s["ship.mass"] * s["ship.x_G"], lowest_speed(s)
    damping = LINEAR_DAMPING * s["ship.speed"]
    thrust = nominal_thrust(s, X_bound)
    least = LEAST_SHARE * (bound / s["ship.speed"]) ** 2 * (thrust - X_u0)
    least = ca.fmax(least, LEAST_RESISTANCE * 0.5 * s["ship.water_density"] * (s["ship.length"] * bound) ** 2)
    resistance = ca.fmax(thrust - X_bound, least) / (bound * (bound + damping))
    Y, N = slow_sway_and_yaw(s, V, linear)
    return (
        thrust + slow_resistance(s, V, resistance) + (mass * v + moment * r) * r,
        Y - mass * u * r,
        N - moment * u * r,
    )


def slow_resistance(s: Symbols, V: ca.SX, resistance: Any) -> ca.SX:
    """X (N) of a resistance (kg/m) that goes with the square of speed V (m/s) and opposes motion ahead and astern."""
    force: ca.SX = -resistance * s["motion.u"] * (V + LINEAR_DAMPING * s["ship.speed"])
    return force


def slow_sway_and_yaw(s: Symbols, V: ca.SX, linear: Mapping[str, Any]) -> tuple[ca.SX, ca.SX]:
    """Y and N (N, N m) of the hull at low speed without inertial terms; V, `linear` as in :func:`hull_forces`."""
    u, v, r = s["motion.u"], s["motion.v"], s["motion.r"]
    Y_drag, N_drag = _cross_flow_drag(s)
    V = V + LINEAR_DAMPING * s["ship.speed"]
    return (
        linear["Yv"] * v * V + linear["Yr"] * u * r + Y_drag,
        linear["Nv"] * v * u + linear["Nr"] * r * V + N_drag,
    )


def _cross_flow_drag(s: Symbols) -> tuple[ca.SX, ca.SX]:
    """Y and N of the cross flow, N and N m; stations forward and aft are taken in pairs."""
    v, r, half = s["motion.v"], s["motion.r"], s["ship.length"] / 2
    pressure = -0.5 * s["ship.water_density"] * s["ship.draught"] * s["low_speed.drag_coefficient"]
    Y = N = ca.SX(0)
    nodes, weights = np.polynomial.legendre.leggauss(STATIONS)
    for node, weight in zip(nodes[STATIONS // 2 :], weights[STATIONS // 2 :], strict=True):
        x, strip = float(node) * half, pressure * (float(weight) * half)
        forward, aft = v + x * r, v - x * r
        forward, aft = ca.fabs(forward) * forward, ca.fabs(aft) * aft
        Y, N = Y + strip * (forward + aft), N + (strip * x) * (forward - aft)
    return Y, N


@dataclass(frozen=True)
class RudderAtU0:
    """The polynomial's rudder forces straight ahead, linear in the angle.

    Parameters
    ----------
    Y_slope : casadi.SX
        Sway force by rudder angle at u0, N/rad.
    at_bound : casadi.SX
        Yaw moment by rudder angle at u_b over that at u0.
    """

    Y_slope: ca.SX
    at_bound: ca.SX


def rudder_factors(s: Symbols, X_bound: ca.SX, rudder: RudderAtU0) -> tuple[ca.SX, ca.SX]:
    """Factors of F_delta(u0) and F_d(u0) in the rudder's force at low speed."""
    u, u0, bound, astern = s["motion.u"], s["ship.speed"], lowest_speed(s), s["low_speed.rudder_astern"]
    thrust = ca.fmax(0, nominal_thrust(s, X_bound)) / (1 - s["low_speed.thrust_deduction"])
    disc = ca.pi / 4 * s["ship.propeller_diameter"] ** 2
    # its root has a slope without thrust, too
    race = (
        2 * thrust / ((1 - s["low_speed.wake_fraction"]) ** 2 * s["ship.water_density"] * disc)
        + (STILL_SPEED * u0) ** 2
    )
    k = ca.fmax(LEAST_RUDDER * (bound / u0) ** 2, ca.fmin(rudder.at_bound, 1))
    by_race = k * race / (bound**2 + race)
    # As a quotient of the two bounds' inverses it is regular for a card without Y_d.
    by_race = by_race / ca.fmax(
        1, by_race * ca.fabs(rudder.Y_slope) / (thrust + STILL_SPEED**2 * ca.fabs(rudder.Y_slope))
    )
    by_stream = (k - by_race) / bound**2
    ahead = ca.SX(1)
    if "propeller.speed" in s:
        n = s["propeller.speed_actual"] / s["propulsion.nominal_speed"]
        ahead = (n + ca.fabs(n)) / 2
    # u|u| ahead, and the stated share of it astern
    stream = (1 + astern) / 2 * (u * ca.fabs(u)) + (1 - astern) / 2 * (u * u)
    stern = s["motion.v"] - 0.5 * s["ship.length"] * s["motion.r"]
    return by_stream * stream + by_race * ahead**2, s["low_speed.straightening"] * by_race / ca.sqrt(
        race
    ) * ahead * stern
