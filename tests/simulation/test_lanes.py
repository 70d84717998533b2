"""Runs in lanes against single runs with a sample at each step, for any number of lanes; the sine against mpmath."""

from __future__ import annotations

import ctypes
import math

import casadi as ca
import numpy as np
import pytest

from tank2sim.analysis.ensemble.draws import draws_of
from tank2sim.arrays import Array
from tank2sim.cards import ManoeuvringCard, read_card
from tank2sim.cards.reading import revised
from tank2sim.dynamics import build
from tank2sim.dynamics.model import Model
from tank2sim.errors import InputError
from tank2sim.native.generate import c_loop
from tank2sim.native.lanes import FLAGS_OF_LANES, NoLanesError, lane_function, widest_lanes
from tank2sim.native.library import cached_library
from tank2sim.simulation import lane_figures, lane_runs, manoeuvres
from tank2sim.simulation.card_range import single_figures
from tank2sim.simulation.lane_figures import LaneManoeuvres, Pace, runs_in_lanes
from tank2sim.simulation.manoeuvres import PullOut, SpiralManoeuvre, Stop, Turn, Zigzag
from tank2sim.simulation.run import simulate
from tests.marks import first_fast

pytestmark = pytest.mark.skipif(widest_lanes() == 0, reason="needs a C compiler")

WIDTHS = [lanes for lanes in (8, 4, 2, 1) if lanes <= widest_lanes()]
ENDS_FIRST = first_fast("widths", [WIDTHS[:: len(WIDTHS) - 1 or 1], WIDTHS], ids=["two", "all"])
"""The widest and the narrowest alone in a fast test: each width is compiled by itself."""

TEN, TWENTY, LARGE = (math.radians(angle) for angle in (10.0, 20.0, 35.0))

MANOEUVRES = [
    (Turn(LARGE), 600.0),
    (Turn(-LARGE), None),
    (Turn(TEN), 251.13),
    (Zigzag(TEN, TEN), None),
    (Zigzag(-TWENTY, TWENTY), None),
    (Zigzag(TWENTY, TEN, opposite=-TEN), 300.05),
]
CASES = [(name, *case) for name in ("mariner", "kvlcc2") for case in MANOEUVRES]
CASES += [("kvlcc2", Stop(), None)]
CASES += [pytest.param("esso-osaka-ship", stop, None, marks=pytest.mark.slow) for stop in (Stop(0.0), Stop())]


def ships(card: ManoeuvringCard, model: Model, count: int) -> tuple[list[dict[str, float]], Array]:
    """Members with errors of a tenth of what is assumed, and their parameters."""
    draws, _ = draws_of(card, 3)
    members = [draws.member(number) for number in range(count)]
    return members, np.array([model.parameter_values(member) for member in members])


@pytest.mark.parametrize(("name", "manoeuvre", "duration"), CASES)
def test_figures_in_lanes_are_those_of_single_runs(name: str, manoeuvre, duration) -> None:
    card = read_card(name)
    assert isinstance(card, ManoeuvringCard)
    model = build(card)
    members, p = ships(card, model, 3)
    times = np.linspace(0.0, 240.0, 7)
    found = LaneManoeuvres(model).run(manoeuvre, p, duration, times)
    assert found.fine.all()
    for number, member in enumerate(members):
        run = simulate(model, manoeuvre, duration_s=duration, parameters=member)
        expected = single_figures(run.figures)
        shown = {name for name, values in found.figures.items() if np.isfinite(values[number])}
        assert shown == set(expected)
        for figure, value in expected.items():
            assert found.figures[figure][number] == pytest.approx(value, rel=1e-12), figure
        for place, state in enumerate(model.state_names):
            values = np.interp(times, run.trajectory.t, run.trajectory[state])
            np.testing.assert_allclose(found.states[number, :, place], values, rtol=1e-11, atol=1e-10)


@pytest.mark.parametrize("name", ["mariner", "kvlcc2"])
def test_spirals_in_lanes_are_those_of_single_runs_to_the_error_of_their_steps(name: str) -> None:
    card = read_card(name)
    assert isinstance(card, ManoeuvringCard)
    model = build(card)
    members, p = ships(card, model, 3)
    spiral = SpiralManoeuvre((TWENTY, TEN, 0.0, -TEN, 0.0, TEN, TWENTY))
    times = np.linspace(0.0, 3000.0, 31)
    found = LaneManoeuvres(model).run(spiral, p, None, times)
    assert found.fine.all() and np.isinf(found.left_s).all()
    for number, member in enumerate(members):
        run = simulate(model, spiral, parameters=member)
        expected = single_figures(run.figures)
        assert set(found.figures) == set(expected)
        for figure, value in expected.items():
            assert found.figures[figure][number] == pytest.approx(value, rel=1e-7, abs=1e-9), figure
        inside = times <= run.trajectory.t[-1]
        assert np.isnan(found.states[number, ~inside]).all()
        for place, state in enumerate(model.state_names):
            values = np.interp(times[inside], run.trajectory.t, run.trajectory[state])
            # Steps begin anew where the steadiness is judged: states are interpolated between other samples.
            np.testing.assert_allclose(found.states[number, inside, place], values, rtol=1e-5, atol=1e-2)
    assert (found.figures["loop_width_deg"] > 0).all() == (name == "kvlcc2")


@pytest.mark.parametrize("lengths", [None, 3.3])
def test_a_spiral_holds_each_rudder_for_the_longest_time_at_most(monkeypatch, mariner_card, mariner, lengths) -> None:
    """Of 3.3 L/u0 the turn is not steady: 3 rudders end at 9.9 L/u0, however the longest time was said."""
    for module in (lane_figures, manoeuvres):
        monkeypatch.setattr(module, "SPIRAL_HOLD", 3.3)
    passage = mariner_card.ship.length_m / mariner_card.model.speed_mps
    hold = None if lengths is None else lengths * passage
    spiral = SpiralManoeuvre((LARGE, 0.0, -LARGE))
    members, p = ships(mariner_card, mariner, 3)
    times = np.array([3.2, 3.4, 9.85, 9.95]) * passage
    found = LaneManoeuvres(mariner).run(spiral, p, hold, times)
    assert np.isfinite(found.states[:, :3]).all() and np.isnan(found.states[:, 3]).all()
    rudder = found.states[:, :, mariner.state_names.index("rudder.angle")]
    assert (rudder[:, 0] > 0.5).all() and (rudder[:, 1] < rudder[:, 0]).all() and (rudder[:, 2] < -0.3).all()
    for number, member in enumerate(members):
        single = simulate(mariner, spiral, duration_s=hold, parameters=member)
        assert single.trajectory.t[-1] == pytest.approx(9.9 * passage)
        for figure, value in single_figures(single.figures).items():
            assert found.figures[figure][number] == pytest.approx(value, rel=1e-6, abs=1e-9), figure


def test_a_ship_that_leaves_all_bounds_in_a_spiral_and_the_range_of_its_card_are_found(mariner_card, mariner) -> None:
    speed = mariner_card.model.speed_mps
    narrow = build(revised(mariner_card, {}, {"model.valid_speed_mps": [0.79 * speed, 1.2 * speed]}))
    spiral = SpiralManoeuvre((LARGE, 0.0, LARGE))
    lost = {"derivatives.Nr": 5.0 * narrow.parameter_values()[narrow.parameter_names.index("derivatives.Nv")] * -1.0}
    p = np.array([narrow.parameter_values(), narrow.parameter_values(lost)])
    found = LaneManoeuvres(narrow).run(spiral, p)
    assert found.fine.tolist() == [True, False]
    assert np.isnan([values[1] for values in found.figures.values()]).all()
    assert found.left_s[0] == pytest.approx(simulate(narrow, spiral).reading.exit_s, abs=narrow.step_s)
    with pytest.raises(InputError):
        simulate(narrow, spiral, parameters=lost)


@pytest.mark.parametrize(("manoeuvre", "slowest"), [(Turn(LARGE), 0.79), (Zigzag(TWENTY, TWENTY), 0.87)])
def test_figures_outside_the_cards_range_are_those_of_single_runs(mariner_card, manoeuvre, slowest) -> None:
    speed = mariner_card.model.speed_mps
    narrow = build(revised(mariner_card, {}, {"model.valid_speed_mps": [slowest * speed, 1.2 * speed]}))
    members, p = ships(mariner_card, narrow, 4)
    found = LaneManoeuvres(narrow).run(manoeuvre, p)
    marked = []
    for number, member in enumerate(members):
        reading = simulate(narrow, manoeuvre, parameters=member).reading
        assert reading.exit_s is not None and found.left_s[number] == pytest.approx(reading.exit_s, rel=1e-12)
        outside = {name for name in reading.figures if found.outside(name)[number]}
        assert outside == set(reading.outside_names)
        marked += [len(outside), len(reading.figures) - len(outside)]
    assert min(marked) > 0
    calm = LaneManoeuvres(build(mariner_card)).run(Zigzag(TEN, TEN), p)
    assert np.isinf(calm.left_s).all() and not calm.outside("overshoot_1_deg").any()


@pytest.mark.parametrize("manoeuvre", [Turn(LARGE), Zigzag(TEN, TEN)])
@ENDS_FIRST
def test_no_bit_depends_on_the_number_of_lanes_or_on_neighbours(mariner_card, mariner, manoeuvre, widths) -> None:
    _, p = ships(mariner_card, mariner, 11)
    results = [LaneManoeuvres(mariner, lanes).run(manoeuvre, p, None, [10.0, 50.0]) for lanes in widths]
    results.append(LaneManoeuvres(mariner).run(manoeuvre, p[3:8], None, [10.0, 50.0]))
    for result in results[1:]:
        part = slice(3, 8) if len(result.states) == 5 else slice(None)
        np.testing.assert_array_equal(result.states, results[0].states[part])
        for figure, values in result.figures.items():
            np.testing.assert_array_equal(values, results[0].figures[figure][part], err_msg=figure)


@pytest.mark.slow
def test_a_stop_leaves_the_cards_range_as_a_single_run_does_and_depends_on_no_neighbour() -> None:
    card = read_card("kvlcc2")
    assert isinstance(card, ManoeuvringCard)
    model = build(card)
    members, p = ships(card, model, 5)
    results = [LaneManoeuvres(model, lanes).run(Stop(), p) for lanes in WIDTHS]
    for number in (0, 4):
        reading = simulate(model, Stop(), parameters=members[number]).reading
        assert reading.exit_s is not None
        assert results[0].left_s[number] == pytest.approx(reading.exit_s, rel=1e-12)
        outside = {name for name in reading.figures if results[0].outside(name)[number]}
        assert outside == set(reading.outside_names) == set(reading.figures)
    for result in results[1:]:
        for figure, values in result.figures.items():
            np.testing.assert_array_equal(values, results[0].figures[figure], err_msg=figure)


def test_a_ship_that_begins_at_rest_has_stopped_as_it_begins() -> None:
    model = build(read_card("kvlcc2"))
    at_rest = model.parameter_values({"initial.u": 0.0})
    found = LaneManoeuvres(model).run(Stop(), np.array([at_rest, model.parameter_values()]))
    expected = single_figures(simulate(model, Stop(), parameters={"initial.u": 0.0}).figures)
    assert found.fine.all() and np.isfinite(found.figures["track_reach_m"][1])
    assert {name for name, values in found.figures.items() if np.isfinite(values[0])} == set(expected)


def test_ships_that_are_doubtful_with_longer_steps_are_run_with_the_usual_ones(mariner_card) -> None:
    _, p = ships(mariner_card, build(mariner_card), 24)
    slowest = np.median(LaneManoeuvres(build(mariner_card)).run(Turn(TWENTY), p).figures["steady_speed_mps"])
    narrow = build(revised(mariner_card, {}, {"model.valid_speed_mps": [float(slowest), 20.0]}))
    _, p = ships(mariner_card, narrow, 24)
    lanes = LaneManoeuvres(narrow)
    usual, longer = (lanes.run(Turn(TWENTY), p, pace=Pace(factor)) for factor in (1, 3))
    np.testing.assert_array_equal(longer.doubtful, np.isfinite(usual.left_s))
    assert 0 < longer.doubtful.sum() < len(p)
    np.testing.assert_array_equal(longer.left_s, usual.left_s)
    for figure, values in longer.figures.items():
        np.testing.assert_allclose(values, usual.figures[figure], rtol=1e-6)
        np.testing.assert_array_equal((values == usual.figures[figure])[longer.doubtful], True)
    same = longer.figures["advance_m"] == usual.figures["advance_m"]
    np.testing.assert_array_equal(same, longer.doubtful)


SINGLE = Pace(1, single=True)


@first_fast("name", ["mariner", "kvlcc2"])
@pytest.mark.parametrize("manoeuvre", [Turn(LARGE), Zigzag(TEN, TEN)])
def test_figures_in_single_precision_are_those_of_single_runs(name: str, manoeuvre) -> None:
    card = read_card(name)
    assert isinstance(card, ManoeuvringCard)
    model = build(card)
    members, p = ships(card, model, 2)
    found = LaneManoeuvres(model).run(manoeuvre, p, 900.0, pace=SINGLE)
    for number, member in enumerate(members):
        expected = single_figures(simulate(model, manoeuvre, duration_s=900.0, parameters=member).figures)
        assert {name for name, values in found.figures.items() if np.isfinite(values[number])} == set(expected)
        for figure, value in expected.items():
            assert found.figures[figure][number] == pytest.approx(value, rel=3e-6), figure


@pytest.mark.parametrize("manoeuvre", [Turn(LARGE), Zigzag(TEN, TEN)])
@ENDS_FIRST
def test_no_bit_in_single_precision_depends_on_lanes_or_neighbours(mariner_card, mariner, manoeuvre, widths) -> None:
    _, p = ships(mariner_card, mariner, 19)
    results = [LaneManoeuvres(mariner, lanes).run(manoeuvre, p, pace=SINGLE) for lanes in widths]
    part = LaneManoeuvres(mariner).run(manoeuvre, p[3:8], pace=SINGLE)
    for figure, values in results[0].figures.items():
        for result in results[1:]:
            np.testing.assert_array_equal(result.figures[figure], values, err_msg=figure)
        np.testing.assert_array_equal(part.figures[figure], values[3:8], err_msg=figure)


def test_a_turn_near_the_limit_of_a_steady_one_is_doubtful() -> None:
    model = build(read_card("kvlcc2"))
    lanes, ends = LaneManoeuvres(model), np.arange(595.0, 630.0, 5.0)  # it becomes steady at some 603 s
    runs = [lanes.run(Turn(LARGE), model.parameter_values()[None], end, pace=Pace(3)) for end in ends.tolist()]
    steady = np.array([np.isfinite(run.figures["steady_speed_mps"][0]) for run in runs])
    doubtful = np.array([run.doubtful[0] for run in runs])
    assert doubtful[~steady].all() and not steady.all()
    assert doubtful[steady].any() and not doubtful[steady].all()


def test_a_runaway_is_marked_and_disturbs_no_other_ship(mariner_card, mariner) -> None:
    _, p = ships(mariner_card, mariner, 4)
    wild = p.copy()
    wild[1, mariner.parameter_names.index("derivatives.Yv")] = 0.5
    calm, both = (LaneManoeuvres(mariner).run(Turn(LARGE), values, 300.0) for values in (p, wild))
    assert both.fine.tolist() == [True, False, True, True] and calm.fine.all()
    for figure, values in both.figures.items():
        assert math.isnan(values[1])
        np.testing.assert_array_equal(np.delete(values, 1), np.delete(calm.figures[figure], 1))


def test_a_zigzag_with_more_executes_than_are_kept_is_run_by_itself(mariner_card, mariner) -> None:
    members, p = ships(mariner_card, mariner, 2)
    zigzag, duration = Zigzag(TWENTY, math.radians(1.0)), 900.0
    found = LaneManoeuvres(mariner).run(zigzag, p, duration)
    run = simulate(mariner, zigzag, duration_s=duration, parameters=members[1])
    expected = single_figures(run.figures)
    assert f"execute_time_{lane_runs.CROSSINGS + 2}_s" in expected
    for figure, value in expected.items():
        assert found.figures[figure][1] == pytest.approx(value, rel=1e-9), figure


def test_what_lanes_do_not_have_is_left_to_single_runs(mariner) -> None:
    assert runs_in_lanes(Turn(TEN)) and runs_in_lanes(Zigzag(TEN, TEN)) and runs_in_lanes(Stop())
    assert runs_in_lanes(SpiralManoeuvre((TEN, 0.0, TEN)), 100.0) and not runs_in_lanes(Stop(), 100.0)
    assert not runs_in_lanes(PullOut(TEN)) and not runs_in_lanes(Zigzag(TEN, TEN, lag_s=1.0))
    assert not runs_in_lanes(Turn(TEN, wait_s=2.0)) and not runs_in_lanes(Zigzag(TEN, TEN, course=0.1))
    with pytest.raises(NoLanesError):
        LaneManoeuvres(mariner.with_values({"initial.trim": 1.0}))
    for other in ("otter", "container", "wilinski-zellman"):  # no rudder, roll, a rig
        with pytest.raises(NoLanesError):
            LaneManoeuvres(build(read_card(other)))
    with pytest.raises(NoLanesError):
        lane_runs.LaneRunner(build(read_card("otter")))
    x = ca.MX.sym("x")
    with pytest.raises(NoLanesError):
        lane_function(ca.Function("f", [x], [x]), "f")


def evaluated(function: ca.Function, columns: list[Array], lanes: int, *, single: bool = False) -> Array:
    """A function of scalars at each row (n,) of its arguments, in lanes; its outputs (n_out, n)."""
    numbers = 2 * lanes if single and lanes > 1 else lanes
    loop = f"""
EXPORT void each(long n, const double *in, double *out) {{
  for (long k = 0; k < n; k += LANES) {{
    V x[{len(columns)}][1], y[{function.n_out()}][1];
    for (int l = 0; l < LANES; ++l)
      for (int i = 0; i < {len(columns)}; ++i) LANE(x[i][0], l) = in[i * n + k + l];
    const V *arg[{len(columns)}];
    V *res[{function.n_out()}];
    for (int i = 0; i < {len(columns)}; ++i) arg[i] = x[i];
    for (int i = 0; i < {function.n_out()}; ++i) res[i] = y[i];
    f(arg, res);
    for (int l = 0; l < LANES; ++l)
      for (int i = 0; i < {function.n_out()}; ++i) out[i * n + k + l] = LANE(y[i][0], l);
  }}
}}
"""
    sizes = f"#define LANES {numbers}\n#define SINGLE {int(single)}\n"
    source = f"{sizes}{c_loop('vectors.h')}{lane_function(function, 'f')}{loop}"
    library = ctypes.CDLL(str(cached_library({"f.c": source}, flags=FLAGS_OF_LANES[lanes])))
    given = np.ascontiguousarray(columns)
    found = np.empty((function.n_out(), given.shape[1]))
    library.each(
        ctypes.c_long(given.shape[1]), given.ctypes.data_as(ctypes.c_void_p), found.ctypes.data_as(ctypes.c_void_p)
    )
    return found


@first_fast("lanes", WIDTHS)
def test_sine_and_cosine_are_exact_to_the_last_places(lanes: int) -> None:
    rng = np.random.default_rng(2)
    angles = np.concatenate([rng.uniform(-r, r, 4000) for r in (1.0, 10.0, 1e3, 9.9e4, 1e7)])
    angles = np.concatenate([angles, np.pi / 4 * np.arange(-16, 16), [0.0, 1e-300, np.inf, np.nan] * 2])
    x = ca.SX.sym("x")
    sine, cosine = evaluated(ca.Function("f", [x], [ca.sin(x), ca.cos(x)]), [angles], lanes)
    with np.errstate(invalid="ignore"):
        for values, expected in ((sine, np.sin(angles)), (cosine, np.cos(angles))):
            # Absolute: near a multiple of pi the last bit is of the reduced angle.
            np.testing.assert_allclose(values, expected, rtol=4e-16, atol=2e-16)


@first_fast("lanes", WIDTHS)
def test_angles_in_single_precision_are_exact_to_its_last_places(lanes: int) -> None:
    rng = np.random.default_rng(2)
    angles = np.concatenate([rng.uniform(-r, r, 4000) for r in (1.0, 10.0, 1e3, 8e3, 1e5)] + [np.zeros(16)])
    angles = angles.astype(np.float32).astype(float)
    x, y = ca.SX.sym("x"), ca.SX.sym("y")
    sine, cosine = evaluated(ca.Function("f", [x], [ca.sin(x), ca.cos(x)]), [angles], lanes, single=True)
    np.testing.assert_allclose(sine, np.sin(angles), rtol=0, atol=1.5e-7)
    np.testing.assert_allclose(cosine, np.cos(angles), rtol=0, atol=1.5e-7)
    a, b = rng.normal(size=(2, 4000)) * 10.0 ** rng.integers(-8, 8, size=(2, 4000))
    (found,) = evaluated(ca.Function("f", [x, y], [ca.atan2(x, y)]), [a, b], lanes, single=True)
    np.testing.assert_allclose(found, np.arctan2(a, b), rtol=4e-7, atol=0)


@first_fast("lanes", WIDTHS)
def test_angles_of_sides_are_exact_to_the_last_places(lanes: int) -> None:
    rng = np.random.default_rng(3)
    y, x = rng.normal(size=(2, 4000)) * 10.0 ** rng.integers(-8, 8, size=(2, 4000))
    corners = [
        0.0,
        -0.0,
        1.0,
        -1.0,
        7 / 16,
        11 / 16,
        0.5,
        1e-300,
        -1e-300,
        1e305,
        np.inf,
        -np.inf,
        np.nan,
        2.0,
        -7e8,
        3.0,
    ]
    y = np.concatenate([y, np.repeat(corners, len(corners))])
    x = np.concatenate([x, np.tile(corners, len(corners))])
    a, b = ca.SX.sym("a"), ca.SX.sym("b")
    (found,) = evaluated(ca.Function("f", [a, b], [ca.atan2(a, b)]), [y, x], lanes)
    np.testing.assert_allclose(found, np.arctan2(y, x), rtol=5e-16, atol=0)
    np.testing.assert_array_equal(np.signbit(found[~np.isnan(found)]), np.signbit(np.arctan2(y, x)[~np.isnan(found)]))


@first_fast("lanes", WIDTHS)
def test_operations_have_the_values_of_casadi_to_the_bit(lanes: int) -> None:
    rng = np.random.default_rng(5)
    a, b = rng.normal(size=(2, 400)).round(1)  # with ties and zeros
    a[:8], b[4:12] = 0.0, 0.0
    x, y = ca.SX.sym("x"), ca.SX.sym("y")
    both = ca.logic_and(x < y, y <= 1)
    values = [
        *(x + y, x - y, x * y, x / (y + 7), -x, x * x, 2 * x, 1 / (y + 9), ca.sqrt(ca.fabs(x)), ca.fabs(y)),
        *(ca.fmin(x, y), ca.fmax(x, y), ca.sign(x), x < y, x <= y, x == y, x != y, both, ca.logic_or(x < y, y > 1)),
        *(ca.logic_not(x < y), ca.if_else(x < y, x, y), ca.if_else(x, y, 3.0), ca.if_else(both, x, -y) + (x < 0)),
        *(ca.tanh(x), ca.exp(x), ca.floor(x), ca.fabs(x) ** (y + 0.1)),
    ]
    function = ca.Function("f", [x, y], [ca.SX(value) for value in values])
    expected = np.array([np.array(part).ravel() for part in function.map(400)(a[None], b[None])])
    np.testing.assert_array_equal(evaluated(function, [a, b], lanes), expected)
