"""A card as a body of xdyn: its expressions by an independent strict parser, its forces and its manoeuvres."""

from __future__ import annotations

import functools
import math
import re
from pathlib import Path
from types import ModuleType
from typing import Any

import casadi as ca
import numpy as np
import pytest

import tank2sim as t2s
from tank2sim.apps.programs import xdyn
from tank2sim.apps.programs.program_files import ProgramFiles
from tank2sim.apps.programs.xdyn import ship_text, xdyn_files
from tank2sim.apps.programs.xdyn_body import written_body
from tank2sim.apps.programs.xdyn_expressions import Definitions
from tank2sim.bundled import bundled_cards
from tank2sim.cards import Card, parse_card, read_card
from tank2sim.dynamics import build
from tank2sim.dynamics.model import Model
from tank2sim.errors import InputError
from tank2sim.simulation.manoeuvres import Turn, Zigzag
from tank2sim.simulation.run import simulate
from tests.dynamics.effects.ships import TYPICAL, card_with
from tests.hostile_text import HOSTILE, hostile_card
from tests.marks import first_fast

yaml = pytest.importorskip("yaml")
from xdyn import (  # noqa: E402
    NOT_EXPRESSIONS,
    CompiledForce,
    commands_of,
    evaluator_module,
    free_run,
    mass_matrices,
    model_run,
    model_tables,
    motion_difference,
    together,
)


@pytest.fixture(scope="module")
def evaluator(data: Path) -> ModuleType:
    path = data / "simulators" / "xdyn" / "evaluator.py"
    if not path.is_file():
        pytest.skip(f"the evaluator of xdyn's grammar is missing: {path}")
    return evaluator_module(path)


@functools.cache
def made(name: str) -> ProgramFiles:
    """Files of a bundled card."""
    return xdyn_files(read_card(name))


@pytest.fixture
def figures_left_out(monkeypatch: pytest.MonkeyPatch) -> None:
    """Files without the table of figures, which simulates every standard manoeuvre twice."""
    monkeypatch.setattr(xdyn, "figure_changes", lambda *_: ())


def assert_same_motion(evaluator: ModuleType, text: str, model: Model, count: int = 1000) -> None:
    assert motion_difference(evaluator, text, model, count) < 1e-12


# -- forces --------------------------------------------------------------------------------------------------------


@first_fast("name", ["mariner", "kvlcc2-l7-mmg", "otter", "mariner-nominal", "kvlcc2", "esso-osaka", "kvlcc2-captive"])
def test_a_card_moves_as_its_model_at_any_motion(name: str, evaluator: ModuleType) -> None:
    card = read_card(name)
    assert_same_motion(evaluator, made(name).files["ship.yml"], build(card))


SKEW = {"derivatives.Yrdot": -6e-4, "derivatives.Nvdot": 1e-4, "rigid_body.x_G": 0.05}
"""Of a Mariner with a centre of gravity forward and added masses that are far from symmetric."""


def skew() -> Card:
    return t2s.load("mariner").replace(SKEW).card


@first_fast("kind", ["abkowitz", "linear"])
@pytest.mark.usefixtures("figures_left_out")
def test_unsymmetric_added_masses_and_a_forward_centre_of_gravity_are_not_lost(
    kind: str, evaluator: ModuleType
) -> None:
    card = t2s.Ship(skew()).replace({"model.kind": kind}).card
    model = build(card)
    files = xdyn_files(card)
    assert_same_motion(evaluator, files.files["ship.yml"], model)
    rigid, added = mass_matrices(body_in(files))
    body = card.manoeuvring().rigid_body
    assert rigid[1, 5] == rigid[5, 1] == pytest.approx(body.mass * body.x_G * card.manoeuvring().scales.mass * 160.93)
    for matrix in (rigid, rigid + added):
        assert np.array_equal(matrix, matrix.T) and np.linalg.eigvalsh(matrix).min() > 0
    assert added[1, 1] != pytest.approx(added[0, 0], rel=0.5)
    assert rigid[5, 5] == pytest.approx(body.yaw_inertia * card.manoeuvring().scales.inertia)


@first_fast("name", ["wind", *(name for name in TYPICAL if name != "wind")])
def test_every_effect_of_a_ship_is_in_its_forces(name: str, evaluator: ModuleType) -> None:
    card = card_with({name: TYPICAL[name]})
    model = build(card)
    run = simulate(model, Turn(0.6), duration_s=5.0).trajectory
    assert_same_motion(evaluator, ship_text(card, written_body(card, model, run), run), model, 200)


def test_the_constants_of_surroundings_can_be_changed_in_the_file(evaluator: ModuleType) -> None:
    card = card_with({"wind": TYPICAL["wind"]})
    model = build(card)
    run = simulate(model, Turn(0.6), duration_s=5.0).trajectory
    text = ship_text(card, written_body(card, model, run), run)
    assert "wind_speed: 10.0 #" in text
    calm = text.replace("wind_speed: 10.0 #", "wind_speed: 0.0 #")
    assert_same_motion(evaluator, calm, build(card_with({"wind": TYPICAL["wind"] | {"speed_mps": 0.0}})), 50)


OUTBOARD = """[[thrusters]]
name = "stern"
x_m = -1.0
ahead_Ns2 = 0.02
astern_Ns2 = 0.01
speed_loss_kg = 0.05
max_radps = 110.0
dead_band_radps = 5.0
order_exponent = 0.7
time_constant_s = 0.3
max_azimuth_deg = 30
azimuth_time_constant_s = 0.4

"""


@pytest.mark.usefixtures("figures_left_out")
def test_a_craft_with_one_outboard_has_a_straight_run_and_its_lags_in_the_table(evaluator: ModuleType) -> None:
    text = t2s.load("otter").card.text
    card = parse_card(text[: text.index("[[thrusters]]")] + OUTBOARD + text[text.index("[[effects]]") :], "craft.toml")
    files = xdyn_files(card)
    assert_same_motion(evaluator, str(files.files["ship.yml"]), build(card))
    assert set(files.files) == {"ship.yml", "straight_commands.yml"}
    found = commands_of(yaml.safe_load(str(files.files["straight_commands.yml"])))
    times, speed = found["thrusters_stern_speed"]
    assert np.interp(0.3, times, speed) == pytest.approx((1 - math.exp(-1)) * speed[-1], rel=1e-4)  # from rest
    assert found["thrusters_stern_azimuth"][1] == pytest.approx(0)


@pytest.mark.usefixtures("figures_left_out")
def test_the_turn_has_the_largest_angle_of_the_gear() -> None:
    card = t2s.load("mariner").replace({"steering_gear.max_angle_deg": 25.0}).card
    text = str(xdyn_files(card).files["turn_commands.yml"])
    assert math.degrees(commands_of(yaml.safe_load(text))["rudder_angle"][1].max()) == pytest.approx(25.0, abs=1e-3)


# -- what the parser of xdyn would drop ------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["mariner", "otter", "container"])
def test_no_expression_has_a_sign_before_a_name_or_a_number_that_is_no_datum(name: str) -> None:
    (force,) = body_in(made(name))["controlled forces"]
    for key, text in force.items():
        if key in NOT_EXPRESSIONS or re.fullmatch(r"-?[\d.]+(e-?\d+)?", str(text)):
            continue
        assert not re.search(r"(^|[-+*/^(])\s*-", str(text)), key
        assert re.fullmatch(r"[A-Za-z]\w*", key) and "**" not in text


def test_operations_that_the_grammar_does_not_have_are_written_exactly(evaluator: ModuleType) -> None:
    a, b = ca.SX.sym("a"), ca.SX.sym("b")
    cases = {
        "lesser": (ca.fmin(a, b), np.minimum),
        "greater": (ca.fmax(a, b), np.maximum),
        "below": (ca.SX(a < b), lambda a, b: 1.0 * (a < b)),
        "at_most": (ca.SX(a <= b), lambda a, b: 1.0 * (a <= b)),
        "equal": (ca.SX(a == b), lambda a, b: 1.0 * (a == b)),
        "other": (ca.SX(a != b), lambda a, b: 1.0 * (a != b)),
        "both": (ca.logic_and(a > 0, b > 0), lambda a, b: 1.0 * ((a > 0) & (b > 0))),
        "either": (ca.logic_or(a > 0, b > 0), lambda a, b: 1.0 * ((a > 0) | (b > 0))),
        "neither": (ca.logic_not(ca.logic_or(a > 0, b > 0)), lambda a, b: 1.0 * ((a <= 0) & (b <= 0))),
        "switched": (ca.if_else(a > b, a, b * b), lambda a, b: np.where(a > b, a, b * b)),
        "where": (ca.if_else(a, b, 1), lambda a, b: np.where(a != 0, b, 1.0)),
        "sign": (ca.sign(a), lambda a, b: np.sign(a)),
        "angle": (ca.atan2(a, b), np.arctan2),
        "scaled_angle": (ca.atan2(a, 1.05 * b), lambda a, b: np.arctan2(a, 1.05 * b)),
        "root_angle": (ca.atan2(a, ca.sqrt(b * b + 1) - 2.1), lambda a, b: np.arctan2(a, np.sqrt(b * b + 1) - 2.1)),
        "arc": (
            ca.atan(a) - ca.asin(a / 4) + ca.acos(b / 4),
            lambda a, b: np.arctan(a) - np.arcsin(a / 4) + np.arccos(b / 4),
        ),
        "slope": (ca.tan(a / 4) + ca.tanh(5 * b), lambda a, b: np.tan(a / 4) + np.tanh(5 * b)),
        "signs": (
            -a - (-b) * 3 + (2 - (a - b)) / -(b * b + 1) - 2 ** ca.fabs(a),
            lambda a, b: -a + 3 * b - (2 - (a - b)) / (b * b + 1) - 2 ** abs(a),
        ),
        "powers": (
            (-a) ** 3 + (a - 1) ** 2 / (b - 7) ** 2 - a / (b * 2 + 9) / 3,
            lambda a, b: (-a) ** 3 + (a - 1) ** 2 / (b - 7) ** 2 - a / (b * 2 + 9) / 3,
        ),
    }
    found = Definitions()
    found.add([a, b], ["a", "b"], {name: value for name, (value, _) in cases.items()}, {})
    values = np.array([-3.0, -0.7, 0.0, 1e-9, 0.4, 2.0])
    one, two = (grid.ravel() for grid in np.meshgrid(values, values))
    asked = (one != 0) | (two != 0)  # no angle at the origin
    node = found.texts | {"name": "hull", "commands": ["a", "b"], **dict.fromkeys("XYZKMN", "0")}
    for name, (_, expected) in cases.items():
        force = CompiledForce(evaluator, node | {"X": name}, {}, np)
        got = np.broadcast_to(force.function({}, 0.0, {"a": one, "b": two})[0], one.shape)
        assert got[asked] == pytest.approx(expected(one, two)[asked], rel=1e-12, abs=1e-12), name


UNARY = [
    *(
        lambda x: -x,
        ca.sin,
        ca.cos,
        lambda x: x**2,
        lambda x: x**3,
        ca.fabs,
        lambda x: ca.sqrt(ca.fabs(x) + 1),
        ca.tanh,
    ),
    *(lambda x: ca.exp(-ca.fabs(x)), lambda x: 1 / (x**2 + 1), lambda x: ca.log(x**2 + 1), ca.atan, lambda x: 1.05 * x),
]
BINARY = [
    *(lambda x, y: x + y, lambda x, y: x - y, lambda x, y: x * y, lambda x, y: x / (y * y + 1), ca.fmin, ca.fmax),
    # Beyond ties, which rounding decides.
    lambda x, y: ca.if_else(x < y + 0.00123, x, 2 * y),
    lambda x, y: ca.if_else(ca.logic_or(x > 0.00321, y <= 0.0045), x * y, -y),
    lambda x, y: ca.atan2(x + 0.0123, y),
]


def random_expression(rng: np.random.Generator, leaves: list[ca.SX], depth: int) -> ca.SX:
    kind = rng.integers(10)
    if depth == 0 or kind == 0:
        return leaves[rng.integers(len(leaves))] if rng.integers(4) else ca.SX(round(rng.normal(), 2))
    if kind < 4:
        return UNARY[rng.integers(len(UNARY))](random_expression(rng, leaves, depth - 1))
    first, second = (random_expression(rng, leaves, depth - 1) for _ in "ab")
    return BINARY[rng.integers(len(BINARY))](first, second)


@first_fast("seed", range(4))
def test_random_expressions_have_the_value_of_the_graph(seed: int, evaluator: ModuleType) -> None:
    rng = np.random.default_rng(seed)
    a, b, constant, named = leaves = [ca.SX.sym(name) for name in ("a", "b", "constant", "named")]
    for _ in range(60):
        first, second = random_expression(rng, leaves[:3], 6), random_expression(rng, leaves, 5)
        found = Definitions()
        wanted = {"named": first, "X": second}
        found.add(leaves, ["a", "b", "constant", "named"], wanted, {"constant": 0.7})
        graph = ca.Function("f", [a, b, constant], [ca.substitute(second, named, first)])
        node = {"name": "hull", "commands": ["a", "b"], "constant": 0.7, **dict.fromkeys("YZKMN", "0"), **found.texts}
        values = {"a": rng.normal(size=4), "b": rng.normal(size=4)}
        got = CompiledForce(evaluator, node, {}, np).function({}, 0.0, values)[0]
        expected = np.array(graph(values["a"][None], values["b"][None], 0.7)).ravel()
        assert np.broadcast_to(got, 4) == pytest.approx(expected, rel=1e-9, abs=1e-9), found.texts


def test_an_operation_without_a_spelling_is_refused() -> None:
    with pytest.raises(ValueError, match="no spelling in xdyn"):
        Definitions().add([(a := ca.SX.sym("a"))], ["a"], {"stairs": ca.floor(a)}, {})


# -- manoeuvres ------------------------------------------------------------------------------------------------------


def body_in(files: ProgramFiles) -> dict[str, Any]:
    body: dict[str, Any] = yaml.safe_load(str(files.files["ship.yml"]))["bodies"][0]
    return body


CASES = [("skew", "turn"), ("skew", "zigzag"), ("kvlcc2-mmg", "turn"), ("kvlcc2-l7-mmg", "zigzag"), ("mariner", "turn")]


@first_fast(("name", "manoeuvre"), [*CASES, ("otter", "turn")])
@pytest.mark.usefixtures("figures_left_out")
def test_manoeuvres_of_ten_minutes_end_where_the_model_does(
    name: str, manoeuvre: str, evaluator: ModuleType, tmp_path: Path
) -> None:
    card = skew() if name == "skew" else read_card(name)
    text = together(xdyn_files(card), manoeuvre)
    path, dt = tmp_path / "ship.yml", 0.5 if name != "otter" else 0.1
    path.write_text(text, encoding="utf-8")
    found = evaluator.simulate(path, 600.0, dt)
    model = build(card)
    expected = model_run(model, model_tables(model, text), 600.0, dt)
    assert found.shape[1] == 7 and np.abs(found[-1, 3]) > 0.1
    assert np.abs(found[:, 1:] - expected[:, : found.shape[1] - 1]).max() < 1e-6


@first_fast("manoeuvre", ["turn", "zigzag"])
def test_a_ship_that_rolls_does_so_in_six_motions_and_stays_level(manoeuvre: str, evaluator: ModuleType) -> None:
    text, model = together(made("container"), manoeuvre), build(read_card("container"))
    found = free_run(evaluator, text, 300.0, 0.2)
    expected = model_run(model, model_tables(model, text), 300.0, 0.2)
    names = [name.removeprefix("motion.") for name in model.state_names if name.startswith("motion.")]
    columns = {name: expected[:, place] for place, name in enumerate(names)}
    x, y, z, phi, theta, psi, u = found.T[:7]
    assert np.degrees(np.abs(phi).max()) > 1
    for name, got in {"x": x, "y": y, "phi": phi, "psi": psi, "u": u}.items():
        assert np.abs(got - columns[name]).max() < 1e-5, name
    assert np.abs(z).max() < 1e-5 and np.abs(theta).max() < 1e-6


@pytest.mark.parametrize("name", ["mariner", "container"])
def test_a_table_is_the_rudder_of_the_cards_own_run(name: str) -> None:
    model = build(read_card(name))
    for manoeuvre, orders in (("turn", Turn(math.radians(35))), ("zigzag", Zigzag(math.radians(20), math.radians(20)))):
        run = simulate(model, orders).trajectory
        (times, values) = commands_of(yaml.safe_load(str(made(name).files[f"{manoeuvre}_commands.yml"])))[
            "rudder_angle"
        ]
        assert np.all(np.diff(times) > 0)
        assert np.interp(run.t, times, values) == pytest.approx(run["rudder.angle"], abs=1e-7)


def test_figures_after_are_those_of_the_written_equations() -> None:
    for name in ("mariner", "container"):
        changes = made(name).changes
        assert {one.manoeuvre for one in changes} >= {"turn:35", "turn:-35", "zigzag:20/20"}
        for one in changes:
            assert one.before is not None and one.after == pytest.approx(one.before, rel=1e-9)


# -- losses, texts and refusals --------------------------------------------------------------------------------------


def test_the_run_of_the_readme_writes_each_file_once() -> None:
    """xdyn opens the file of ``-o`` and each file of ``output`` by itself, also if they are one."""
    files = made("mariner")
    written = {one["filename"] for one in yaml.safe_load(str(files.files["ship.yml"]))["output"]}
    (run,) = re.findall(r"(?m)^xdyn .*$", files.use)
    assert written == {"out.csv"} and not written & set(run.split())


def test_states_and_a_current_that_xdyn_does_not_have_are_losses() -> None:
    assert [("rudder.angle" in line) for line in made("mariner").losses] == [True]
    assert made("otter").losses == ()
    files = xdyn_files(
        card_with({"current": {"speed_mps": 0.4, "direction_deg": 30.0}, "engine_lag": {"time_constant_s": 9.0}})
    )
    lags, drift = files.losses
    assert "rudder.angle" in lags and "engine_lag.speed" in lags
    assert "0.4 m/s" in drift
    moved = {(one.manoeuvre, one.figure): (one.before, one.after) for one in files.changes}
    before, after = moved["turn:35", "transfer_m"]
    assert before is not None and after is not None and abs(after - before) > 5


def test_no_name_of_a_ship_leaves_its_comment(tmp_path: Path) -> None:
    card = read_card("mariner")
    model = build(card)
    run = simulate(model, Turn(0.6), duration_s=5.0).trajectory
    body = written_body(card.steered(), model, run)
    plain = yaml.safe_load(ship_text(card.steered(), body, run))
    for number, text in enumerate(HOSTILE):
        named = read_card(hostile_card(tmp_path / f"{number}.toml", bundled_cards()["mariner"], text)).steered()
        assert yaml.safe_load(ship_text(named, body, run)) == plain, text


def test_a_card_that_is_no_ship_is_refused_in_one_line() -> None:
    with pytest.raises(InputError, match="is not a manoeuvring ship"):
        xdyn_files(read_card("alyshev"))
