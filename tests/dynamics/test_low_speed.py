"""The ship at low speed: unlike the polynomial regular at rest and astern, and the same as it in the card's range."""

from __future__ import annotations

import functools
import itertools
import math
from dataclasses import replace

import casadi as ca
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad

from tank2sim.cards import ManoeuvringCard, parse_card, read_card
from tank2sim.dynamics import Model, build
from tank2sim.dynamics.abkowitz import ABKOWITZ_TERMS, polynomial
from tank2sim.dynamics.event_indicators import kinks
from tank2sim.dynamics.low_speed import (
    BLEND,
    DRAG_COEFFICIENT,
    LEAST_RUDDER,
    LINEAR_DAMPING,
    RUDDER_ASTERN,
    STRAIGHTENING,
    THRUST_DEDUCTION,
    WAKE,
)
from tank2sim.simulation.integrator import Integrator
from tank2sim.simulation.running import Running
from tests.dynamics.states import at_start, motion, rates

from .effects.ships import TYPICAL, mariner_text, ship

L, T, U0, RHO, N0 = 160.93, 7.468, 7.7175, 1025.0, 84.0 * 2 * np.pi / 60
SLOWEST = 3.9
MOTION = ("motion.u", "motion.v", "motion.r")
MOTIONS = st.tuples(st.floats(-1.2, 1.2), st.floats(-0.5, 0.5), st.floats(-0.8, 0.8))
"""u/u0, v/u0, r L/u0."""


@functools.cache
def driven(**replaced: str) -> ManoeuvringCard:
    """The Mariner with propulsion, as the formats give it."""
    card = parse_card(mariner_text(**replaced), "ship.toml")
    assert isinstance(card, ManoeuvringCard)
    return card


@functools.cache
def symmetric() -> Model:
    """A driven Mariner without the terms by which a ship is not alike on both sides."""
    card = driven()
    even = {force + end: 0.0 for force in "YN" for end in ("0", "0u", "0uu")}
    return build(replace(card, derivatives={**card.derivatives, **even}))


@functools.cache
def driven_ship() -> Model:
    return build(driven())


def state(model: Model, u: float, v: float = 0.0, r: float = 0.0, rudder: float = 0.0) -> np.ndarray:
    return at_start(model, motion(u, v, r) | {"rudder.angle": rudder})[0]


@functools.cache
def _functions(model: Model) -> dict[str, ca.Function]:
    names = ("force.X", "force.Y", "force.N", "rudder.X", "rudder.Y", "rudder.N", "validity")
    return {name: ca.Function("f", [model.x, model.u, model.p], [model.expand(model.symbol(name))]) for name in names}


def force(model: Model, name: str, x: np.ndarray, **inputs: float) -> float:
    given_inputs = {name.replace("_", "."): value for name, value in inputs.items()}
    return float(_functions(model)[name](x, model.input_values(given_inputs), model.parameter_values()))


@functools.cache
def _integrator(model: Model) -> Integrator:
    return Integrator(model)


def run(model: Model, x: np.ndarray, seconds: float, **inputs: float) -> np.ndarray:
    integrator = _integrator(model)
    u = model.input_values({name.replace("_", "."): value for name, value in inputs.items()})
    return integrator.rollout(x, u, model.parameter_values(), model.step_s, int(seconds / model.step_s))


def energy(model: Model, states: np.ndarray, card: ManoeuvringCard) -> np.ndarray:
    """Kinetic energy with added masses, their sway-yaw coupling made symmetric; arbitrary unit."""
    c, body = card.derivatives, card.rigid_body
    u, v, r = (states[:, model.state_names.index(name)] for name in MOTION)
    r = r * card.ship.length_m
    coupling = body.mass * body.x_G - (c["Yrdot"] + c["Nvdot"]) / 2
    surge, sway, yaw = body.mass - c["Xudot"], body.mass - c["Yvdot"], body.yaw_inertia - c["Nrdot"]
    return surge * u**2 + sway * v**2 + 2 * coupling * v * r + yaw * r**2


# -- in the card's range nothing changes -----------------------------------------------------------------------------


@settings(max_examples=60, deadline=None)
@given(
    speed=st.floats(SLOWEST * (1 + 1e-9), 9.3), drift=st.floats(-1.4, 1.4), r=st.floats(-0.02, 0.02), d=st.floats(-1, 1)
)
def test_in_the_range_of_the_card_the_forces_are_those_of_its_polynomial(speed, drift, r, d) -> None:
    model, card = driven_ship(), driven()
    u, v = speed * math.cos(drift), -speed * math.sin(drift)
    primes = {"v": v / speed, "r": r * L / speed, "d": d, "u": (u - U0) / speed}
    scale = RHO / 2 * L**2 * speed**2
    coefficients = {name: card.derivatives.get(name, 0.0) for force in "XYN" for name in ABKOWITZ_TERMS[force]}
    for axis, arm in (("X", 1.0), ("Y", 1.0), ("N", L)):
        expected = scale * arm * polynomial(ABKOWITZ_TERMS[axis], coefficients, **primes)
        assert force(model, f"force.{axis}", state(model, u, v, r, d)) == pytest.approx(
            expected, rel=1e-9, abs=1e-4
        )  # N, N m: sums of terms that nearly cancel


def test_validity_is_one_in_the_range_and_nothing_well_outside_it_or_astern() -> None:
    model = driven_ship()

    def validity(u: float, v: float = 0.0, r: float = 0.0) -> float:
        return force(model, "validity", state(model, u, v, r))

    assert [validity(u) for u in (3.9, 5.0, 9.3)] == [1.0, 1.0, 1.0]
    assert [validity(u) for u in (0.0, 2.7, -5.0, 9.3 + 0.2 * U0)] == pytest.approx([0.0] * 4, abs=1e-15)
    assert validity(3.7, 2.0) == 1.0 and validity(6.0, r=6.0 / L) == 1.0
    assert 0 < validity(4.0, 4.0) < 1 and validity(1.0, 6.0) == pytest.approx(0.0, abs=0.05)
    assert validity(6.0, r=9.0 / L) == pytest.approx(0.5) == validity(6.0, r=-9.0 / L)
    assert validity(6.0, r=12.0 / L) == 0.0
    assert validity(SLOWEST * math.sqrt(1 - (1 - BLEND) / 2)) == pytest.approx(0.5)
    along = [validity(u) for u in np.linspace(2.7, 3.95, 40)]
    assert all(b >= a for a, b in itertools.pairwise(along))


def test_the_polynomial_reaches_as_far_down_as_the_card_says_and_validity_ends_where_it_was_measured() -> None:
    whole = build(driven(valid_speed_mps="valid_speed_mps = [3.0, 9.3]"))
    narrow = build(driven(valid_speed_mps="valid_speed_mps = [6.0, 9.3]\nlow_speed_below_mps = 3.0"))
    for u in (1.0, 2.5, 2.9, 3.5, 5.0, 7.0):
        x = state(whole, u, -0.1 * u, 0.002, 0.1)
        for axis in "XYN":
            name = f"force.{axis}"
            assert force(narrow, name, x) == force(whole, name, x), (u, name)
    validity = {u: force(narrow, "validity", state(narrow, u)) for u in (6.0, 5.0, 4.0, 3.1)}
    assert validity[6.0] == 1.0 and 0 < validity[5.0] < 1 and validity[4.0] == validity[3.1] == 0.0


# -- regular everywhere ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("effect", [None, *TYPICAL])
def test_values_and_derivatives_are_finite_at_rest_spinning_drifting_and_astern(effect: str | None) -> None:
    model = ship({effect: TYPICAL[effect]} if effect else {})
    variables = ca.vertcat(model.x, model.u, model.p)
    values = ca.vertcat(model.rates, model.output_values)
    everything = ca.Function("all", [model.x, model.u, model.p], [values, ca.jacobian(values, variables)])
    for u, v, r in ((0, 0, 0), (0, 0, 0.01), (0, 0.5, 0), (-2, 0, 0), (-5, 0.5, 0.01), (SLOWEST, 0, 0), (2.76, 0, 0)):
        for n in (0.0, N0, -N0):
            inputs = model.input_values({"propeller.speed": n})
            for result in everything(state(model, u, v, r, 0.2), inputs, model.parameter_values()):
                assert np.isfinite(np.array(result)).all(), (u, v, r, n)


@pytest.mark.parametrize("kind", ["abkowitz", "linear"])
def test_a_bare_hull_is_regular_at_rest_too(mariner_card, kind: str) -> None:
    c = {**mariner_card.derivatives, "X0": -8e-4, "Xu": 0.0, "Xuu": 0.0, "Xuuu": 0.0}
    model = build(replace(mariner_card, derivatives=c, model=mariner_card.model.model_copy(update={"kind": kind})))
    slopes = ca.jacobian(model.rates, ca.vertcat(model.x, model.u, model.p))
    at = state(model, 0.0, rudder=0.3), model.input_values(), model.parameter_values()
    assert np.isfinite(np.array(ca.Function("slopes", [model.x, model.u, model.p], [slopes])(*at))).all()


@pytest.mark.slow
@pytest.mark.parametrize("axis", "XYN")
def test_forces_and_their_slopes_are_continuous_on_the_way_through_rest(axis: str) -> None:
    model = driven_ship()
    f = model.expand(model.symbol(f"force.{axis}"))
    both = ca.Function("both", [model.x, model.u, model.p], [f, ca.jacobian(f, model.x[3:6])])
    assert model.state_names[3:6] == MOTION

    def along(s: float) -> np.ndarray:
        x = state(model, U0 * s, 0.05 * U0 * (s + 0.3), 0.2 * U0 / L * (s - 0.1), 0.3)
        return np.concatenate(
            [np.array(part).ravel() for part in both(x, model.input_values(), model.parameter_values())]
        )

    def largest_jump(count: int) -> np.ndarray:
        values = np.array([along(s) for s in np.linspace(-0.7, 0.7, count)])
        return np.max(np.abs(np.diff(values, axis=0)), axis=0)

    coarse, fine = largest_jump(2001), largest_jump(8001)
    # What is continuous changes by a quarter in a quarter of the step; what jumps keeps its jump.
    assert (fine < 0.4 * coarse + 1e-9).all()


def test_low_speed_needs_no_event_of_a_solver(mariner) -> None:
    assert {kink.name.split("[")[0] for kink in kinks(mariner)} == {"kinks.rudder.rate", "kinks.rudder.error"}


# -- the stated form -------------------------------------------------------------------------------------------------


def stated(card: ManoeuvringCard, u: float, v: float, r: float, d: float, n: float) -> np.ndarray:
    """X, Y, N below the range of a driven Mariner, written out again in plain numbers; n over its nominal."""
    c, half, m = card.derivatives, RHO / 2 * L**2, card.rigid_body.mass
    mass, moment = m * RHO / 2 * L**3, m * card.rigid_body.x_G * RHO / 2 * L**4
    thrust, V, e = half * U0**2 * 77e-5, math.hypot(u, v), LINEAR_DAMPING * U0
    Du = (SLOWEST - U0) / SLOWEST
    bound = half * SLOWEST**2 * (c["Xu"] * Du + c["Xuu"] * Du**2 + c["Xuuu"] * Du**3)
    resistance = max(thrust - bound, 0.7 * thrust * (SLOWEST / U0) ** 2)
    across = (lambda x: abs(v + x * r) * (v + x * r)), (lambda x: x * abs(v + x * r) * (v + x * r))
    pivot = [] if r == 0 or abs(v / r) > L / 2 else [-v / r]
    Yc, Nc = (-RHO / 2 * T * DRAG_COEFFICIENT * quad(f, -L / 2, L / 2, points=pivot)[0] for f in across)
    jet = thrust / (1 - THRUST_DEDUCTION)
    race = 2 * jet / ((1 - WAKE) ** 2 * RHO * math.pi / 4 * (0.6 * T) ** 2)
    lost = (SLOWEST / U0) ** 2 * (1 + c["Ndu"] / c["Nd"] * Du + c["Nduu"] / c["Nd"] * Du**2)
    k = min(1, max(lost, LEAST_RUDDER * (SLOWEST / U0) ** 2))
    by_race = min(k * race / (SLOWEST**2 + race), jet / (half * U0**2 * abs(c["Yd"])))
    by_stream = (k - by_race) / SLOWEST**2
    inflow = by_stream * (u * u if u > 0 else -RUDDER_ASTERN * u * u) + by_race * max(n, 0) ** 2
    swing = STRAIGHTENING * by_race / math.sqrt(race) * max(n, 0) * (v - r * L / 2)
    rudder = half * U0**2
    X = thrust * n * abs(n) - resistance * u * (V + e) / (SLOWEST * (SLOWEST + e)) + mass * v * r + moment * r * r
    X += rudder * inflow * c["Xdd"] * d * d
    Y = half * (c["Yv"] * (V + e) * v + L * (c["Yr"] + m) * u * r) - mass * u * r + Yc
    N = half * L * (c["Nv"] * u * v + L * (c["Nr"] + m * card.rigid_body.x_G) * (V + e) * r) - moment * u * r + Nc
    Y += rudder * (inflow * (c["Yd"] * d + c["Yddd"] * d**3) + swing * c["Yd"])
    N += rudder * L * (inflow * (c["Nd"] * d + c["Nddd"] * d**3) + swing * c["Nd"])
    return np.array([X, Y, N])


@functools.cache
def with_rudder(**terms: float) -> ManoeuvringCard:
    c = driven().derivatives
    return replace(driven(), derivatives={**c, **{name: factor * c[name[:2]] for name, factor in terms.items()}})


RUDDERS = {
    "lost at the bound": {},
    "as the square of speed": {"Ndu": 0.0, "Nduu": 0.0},
    "kept in the race": {"Ndu": -1.2, "Nduu": 0.45},
    "strong next to the thrust": {"Ndu": -1.2, "Nduu": 0.45, "Yd": 3.0},
}
"""Terms of the Mariner over that which is linear in the rudder."""


@pytest.mark.parametrize("rudder", RUDDERS)
@pytest.mark.parametrize("n", [1.0, 0.4, 0.0, -0.7])
@pytest.mark.parametrize("motion", [(2.0, 0.3, 0.002), (-3.0, 0.2, 0.001), (0.5, -0.8, 0.006), (-0.1, 0.6, -0.004)])
def test_below_the_range_the_forces_are_the_stated_ones(motion, n, rudder) -> None:
    card = with_rudder(**RUDDERS[rudder])
    model = built(rudder)
    x = state(model, *motion, rudder=0.35)
    found = np.array([force(model, f"force.{axis}", x, propeller_speed=n * N0) for axis in "XYN"])
    # No pivot within the hull: the stations then give the integrals exactly.
    np.testing.assert_allclose(found, stated(card, *motion, 0.35, n), rtol=1e-6)


@functools.cache
def built(rudder: str) -> Model:
    return build(with_rudder(**RUDDERS[rudder]))


@pytest.mark.parametrize("rudder", ["as the square of speed", "kept in the race", "strong next to the thrust"])
def test_at_nominal_revolutions_the_rudder_keeps_its_moment_through_the_bound(rudder) -> None:
    model = built(rudder)
    small = 1e-3  # the slope at no angle
    speeds = SLOWEST * np.sqrt(np.linspace(BLEND, 1.0, 21))
    moments = [force(model, "rudder.N", state(model, u, rudder=small), propeller_speed=N0) for u in speeds]
    assert moments[0] == pytest.approx(moments[-1], rel=0.5 if rudder == "strong next to the thrust" else 0.3)
    assert 0.85 * min(moments[0], moments[-1]) <= min(moments) <= max(moments) <= 1.02 * max(moments[0], moments[-1])


@pytest.mark.parametrize("rudder", RUDDERS)
def test_at_rest_the_rudder_gets_no_more_side_force_than_the_race_has_momentum(rudder) -> None:
    model = built(rudder)
    small = 1e-3
    side = abs(force(model, "rudder.Y", state(model, 0.0, rudder=small), propeller_speed=N0)) / small
    thrust = force(model, "force.X", state(model, 0.0), propeller_speed=N0) / (1 - THRUST_DEDUCTION)
    assert side <= thrust * (1 + 1e-6)
    if rudder == "strong next to the thrust":
        assert side == pytest.approx(thrust, rel=1e-4)


@settings(max_examples=40, deadline=None)
@given(v=st.floats(-1.0, 1.0), r=st.floats(-0.02, 0.02))
def test_four_stations_give_the_cross_flow_drag_wherever_the_pivot_lies(v, r) -> None:
    model = driven_ship()
    errors = np.array([force(model, f"force.{axis}", state(model, 0.0, v, r), propeller_speed=0.0) for axis in "XYN"])
    errors -= stated(driven(), 0.0, v, r, 0.0, 0.0)
    end = abs(v) + abs(r) * L / 2
    largest = RHO / 2 * T * DRAG_COEFFICIENT * end**2 * L
    assert abs(errors[1]) <= 0.03 * largest + 1e-3 and abs(errors[2]) <= 0.01 * largest * L / 2 + 0.1


def test_the_resistance_goes_with_the_square_of_speed_ahead_and_astern() -> None:
    card = driven(Xnn="Xnn = 90e-5")
    model = build(card)

    def resistance(u: float) -> float:
        return force(model, "force.X", state(model, u), propeller_speed=0.0)

    at_bound, e = resistance(SLOWEST), LINEAR_DAMPING * U0
    assert at_bound < 0
    for u in (2.7, 1.5, -1.5, -3.0, -6.0):
        expected = at_bound * u * (abs(u) + e) / (SLOWEST * (SLOWEST + e))
        assert resistance(u) == pytest.approx(expected, rel=1e-9)


def test_a_rudder_works_at_rest_only_in_the_race_of_a_propeller_that_turns_ahead() -> None:
    model = built("as the square of speed")
    at_rest = state(model, 0.0, rudder=0.35)
    assert force(model, "rudder.N", at_rest, propeller_speed=0.0) == 0.0
    assert force(model, "rudder.N", at_rest, propeller_speed=-N0) == 0.0
    full, half = (force(model, "rudder.N", at_rest, propeller_speed=share * N0) for share in (1.0, 0.5))
    assert full > 0 and half == pytest.approx(full / 4, rel=1e-12)
    at_u0 = force(model, "rudder.N", state(model, U0, rudder=0.35), propeller_speed=N0)
    assert 0.15 * at_u0 < full < at_u0


@settings(max_examples=60, deadline=None)
@given(motion=MOTIONS, rudder=st.floats(-0.6, 0.6), n=st.floats(-1.0, 1.0))
def test_a_symmetric_ship_is_so_at_every_speed(motion, rudder, n) -> None:
    model = symmetric()
    u, v, r = np.array(motion) * (U0, U0, U0 / L)
    here, mirrored = state(model, u, v, r, rudder), state(model, u, -v, -r, -rudder)
    for axis, sign in (("X", 1), ("Y", -1), ("N", -1)):
        one = force(model, f"force.{axis}", here, propeller_speed=n * N0)
        other = force(model, f"force.{axis}", mirrored, propeller_speed=n * N0)
        assert other == pytest.approx(sign * one, rel=1e-9, abs=1e-3)


# -- what a ship then does -------------------------------------------------------------------------------------------


@settings(max_examples=25, deadline=None)
@given(motion=MOTIONS)
def test_without_thrust_a_ship_at_low_speed_only_loses_energy(motion) -> None:
    u, v, r = np.array(motion) * (0.25 * U0, 0.3 * U0, 0.6 * U0 / L)
    model, card = driven_ship(), driven()
    states = run(model, state(model, u, v, r), 300.0, propeller_speed=0.0)
    kinetic = energy(model, states, card)
    assert (np.diff(kinetic) <= 1e-12 * kinetic[0] + 1e-30).all()


def test_without_thrust_a_ship_comes_to_rest_from_full_speed() -> None:
    model = driven_ship()
    speed = run(model, state(model, U0), 6000.0, propeller_speed=0.0)[:, model.state_names.index("motion.u")]
    assert (np.diff(speed) < 0).all() and 0 < speed[-1] < 0.05 * U0


def test_a_bare_hull_comes_to_rest_and_a_card_of_a_driven_ship_keeps_its_revolutions(mariner_card, mariner) -> None:
    def bare(**only: float) -> Model:
        return build(replace(mariner_card, derivatives={**mariner_card.derivatives, **only}))

    hull = bare(X0=-8e-4, Xu=0.0, Xuu=0.0, Xuuu=0.0)
    for u in (6.0, 2.0, -2.0):
        speed = np.abs(run(hull, state(hull, u), 2000.0)[:, hull.state_names.index("motion.u")])
        assert (np.diff(speed) < 0).all() and speed[-1] < 0.3 * abs(u)
    surge = run(mariner, state(mariner, 0.0), 2400.0)[:, mariner.state_names.index("motion.u")]
    assert surge[-1] == pytest.approx(U0, rel=0.02)


@pytest.mark.parametrize("kind", ["abkowitz", "linear"])
def test_from_the_berth_a_ship_goes_ahead_turns_stops_and_goes_astern(kind: str) -> None:
    card = with_rudder(**RUDDERS["as the square of speed"])
    model = build(replace(card, model=card.model.model_copy(update={"kind": kind})))
    index = {name: model.state_names.index(name) for name in (*MOTION, "motion.psi")}
    ahead = run(model, state(model, 0.0), 900.0, propeller_speed=N0, rudder_command=0.0)
    assert 0.8 * U0 < ahead[-1][index["motion.u"]] < 1.1 * U0
    kicked = run(model, state(model, 0.0), 200.0, propeller_speed=0.5 * N0, rudder_command=0.6)
    assert kicked[-1][index["motion.psi"]] > 0.5 and kicked[-1][index["motion.u"]] > 0
    stopped = run(model, ahead[-1], 900.0, propeller_speed=-0.5 * N0)
    surge = stopped[:, index["motion.u"]]
    assert np.isfinite(stopped).all() and surge[-1] < 0 and (np.diff(surge[surge > 0]) < 0).all()


@pytest.mark.parametrize("speed_scale", ["instantaneous", "nominal"])
@pytest.mark.parametrize("yaw_rate_terms", ["total", "hydrodynamic"])
def test_the_inertia_of_every_convention_is_that_of_the_ship_at_low_speed(speed_scale, yaw_rate_terms) -> None:
    """A card that holds the inertia in Yr, Nr, Xvr, Xrr, and the same ship with it taken out, move alike."""
    card = driven()
    m, x_G, c = card.rigid_body.mass, card.rigid_body.x_G, card.derivatives
    taken = {"Yr": c["Yr"] + m, "Nr": c["Nr"] + m * x_G, "Xvr": c["Xvr"] - m, "Xrr": c.get("Xrr", 0.0) - m * x_G}
    update = {"speed_scale": speed_scale, "yaw_rate_terms": yaw_rate_terms}
    derivatives = {**c, **taken} if yaw_rate_terms == "hydrodynamic" else c
    model = build(replace(card, derivatives=derivatives, model=card.model.model_copy(update=update)))
    x, reference = state(model, 1.0, -0.4, 0.01), driven_ship()
    for axis in "YN":
        expected = force(reference, f"force.{axis}", x, propeller_speed=0.0)
        assert force(model, f"force.{axis}", x, propeller_speed=0.0) == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize("share", [1.0, 0.8, 0.3, 0.1, 0.0, -0.3])
@pytest.mark.parametrize("guess", [0.3, 0.0])
def test_a_start_in_steady_motion_is_found_with_propulsion_at_every_speed(share: float, guess: float) -> None:
    model = ship({"wind": {"speed_mps": 0.0, "direction_deg": 0.0}, "current": TYPICAL["current"]})
    start = {"initial.trim": 1.0, "initial.u": guess * U0, "wind.still_air": 0.0}
    inputs = {"propeller.speed": share * N0}
    running = Running(Integrator(model, compiled=False), inputs, start)
    found = rates(model, {name: running.state(name) for name in model.state_names} | inputs | start)
    np.testing.assert_allclose([found[name] for name in MOTION], 0.0, atol=1e-10)
    assert np.sign(round(running.state("motion.u"), 6)) == np.sign(share)


def test_a_card_that_holds_down_to_rest_does_so_to_a_twentieth_of_its_speed() -> None:
    card = driven(valid_speed_mps="valid_speed_mps = [0.0, 9.3]")
    model = build(card)
    assert force(model, "force.X", state(model, 0.0), propeller_speed=0.0) == pytest.approx(0.0, abs=1e-6)
    x = state(model, 0.06 * U0)
    assert force(model, "force.X", x) == pytest.approx(
        RHO / 2 * L**2 * x[3] ** 2 * polynomial(("Xu", "Xuu", "Xuuu"), card.derivatives, u=(x[3] - U0) / x[3]),
        rel=1e-9,
    )


def test_bundled_ships_turn_from_rest_as_they_turn_from_speed() -> None:
    """Rudder hard over and full ahead from the berth ends in the steady turn of the card, not in a spin on the spot."""
    for name in ("mariner", "esso-osaka-estimated"):
        card = read_card(name)
        assert isinstance(card, ManoeuvringCard)
        model = build(card)
        time = 90 * card.ship.length_m / card.model.speed_mps
        surge, yaw = model.state_names.index("motion.u"), model.state_names.index("motion.r")
        rest, moving = (run(model, state(model, u), time, rudder_command=0.6)[-1] for u in (0.0, card.model.speed_mps))
        assert rest[[surge, yaw]] == pytest.approx(moving[[surge, yaw]], rel=0.01)
