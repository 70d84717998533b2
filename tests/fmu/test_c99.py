"""Ships in plain C99: the digits of the FMU, strict compilers, what is refused, what float loses."""

from __future__ import annotations

import hashlib
import platform
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

import tank2sim as t2s
from tank2sim.bundled import bundled_cards
from tank2sim.dynamics.model import Model
from tank2sim.dynamics.simulator_interface import with_simulator_interface
from tank2sim.files import write_whole
from tank2sim.fmu.c99 import TOLERANCES, PlainShip, code_prefix, plain_ship, self_test_run
from tank2sim.fmu.export import make_fmu
from tank2sim.fmu.manoeuvre import manoeuvre
from tank2sim.fmu.reference import by_scheme, reference_errors
from tank2sim.fmu.running import replay
from tank2sim.native.compiler import SHARED_SUFFIX
from tests.dynamics.effects.ships import TYPICAL, card_with
from tests.fmu.driving import ShipFmu
from tests.fmu.plain_ships import STRICT, CompiledShip, call, macro, written
from tests.marks import first_fast

CARDS = ["mariner", *(name for name in bundled_cards() if name != "mariner")]
MATH = {"sin", "cos", "sincos", "tan", "atan2", "exp", "fmax", "fmin", "sqrt", "tanh", "floor", "ceil", "fabs"}

Done = subprocess.CompletedProcess[str]
needs_gcc = pytest.mark.skipif(shutil.which("gcc") is None, reason="gcc is not installed")


def self_tests(ship: PlainShip, folder: Path, *compiler: str) -> Iterator[tuple[bool, Done, Done]]:
    """A row for each precision: whether it is single, and how compiler and self test ended."""
    written(ship, folder)
    for single in (False, True):
        done = call(*compiler, *macro(ship, single), "ship.c", "self_test.c", "-lm", "-o", "run", folder=folder)
        yield single, done, call("./run", folder=folder) if done.returncode == 0 else done


@pytest.fixture(scope="module")
def made() -> PlainShip:
    return plain_ship(t2s.load("mariner").card)


def test_double_is_the_fmu_to_the_last_bit(made: PlainShip, mariner: Model, mariner_fmu: ShipFmu) -> None:
    run = manoeuvre(mariner)
    expected = replay(mariner_fmu(2), run, mariner)
    found = CompiledShip(made).drive(run)
    assert found.shape == (1200, 29) and np.ptp(found, axis=0)[list(mariner.outputs).index("rudder.angle")] > 0.3
    for place, name in enumerate(mariner.outputs):
        assert found[:, place].tobytes() == expected[name][1:].tobytes(), name


@pytest.mark.slow
@pytest.mark.parametrize("card", CARDS[1:])
def test_every_bundled_card_is_its_fmu_to_the_last_bit(card: str, tmp_path: Path) -> None:
    ship = t2s.load(card)
    model = with_simulator_interface(ship.model)
    write_whole(tmp_path / "ship.fmu", make_fmu(model).content)
    run = manoeuvre(model)
    expected = replay(tmp_path / "ship.fmu", run, model)
    found = CompiledShip(plain_ship(ship.card)).drive(run)
    for place, name in enumerate(model.outputs):
        assert found[:, place].tobytes() == expected[name][1:].tobytes(), name


@needs_gcc
@first_fast("card", CARDS)
def test_a_strict_compiler_has_no_objection_and_the_self_test_passes(card: str, tmp_path: Path) -> None:
    ship = plain_ship(t2s.load(card).card)
    for single, done, ran in self_tests(ship, tmp_path, "gcc", *STRICT, "-O1", "-ffp-contract=off"):
        assert done.returncode == 0 and not done.stderr, done.stderr
        assert ran.returncode == 0 and ran.stdout.endswith("pass\n"), ran.stdout
        assert f"{ship.instance_bytes(single=single)} bytes" in ran.stdout


@needs_gcc
@pytest.mark.long
@pytest.mark.parametrize("effect", TYPICAL)
def test_every_effect_compiles_and_passes_its_self_test(effect: str, tmp_path: Path) -> None:
    ship = plain_ship(card_with({effect: TYPICAL[effect]}))
    for _, done, ran in self_tests(ship, tmp_path, "gcc", *STRICT):
        assert done.returncode == 0, done.stderr
        assert ran.returncode == 0, ran.stdout


@needs_gcc
def test_the_self_test_fails_with_another_coefficient_or_sign(made: PlainShip, tmp_path: Path) -> None:
    source = made.files["ship.c"]
    rows = source[source.index("mariner_class_parameters[") :].split("\n")
    place = re.findall(r"MARINER_CLASS_P_(\w+) =", made.files["ship.h"]).index("derivatives_Yd") + 1
    assert rows[place].startswith("    { -MARINER_CLASS_C(0.00278)")
    for number in ("-MARINER_CLASS_C(0.00279)", "MARINER_CLASS_C(0.00278)"):
        folder = written(made, tmp_path)
        (folder / "ship.c").write_text(source.replace("-MARINER_CLASS_C(0.00278)", number, 1))
        assert call("gcc", "-std=c99", "ship.c", "self_test.c", "-lm", "-o", "run", folder=folder).returncode == 0
        ran = call("./run", folder=folder)
        assert ran.returncode == 1 and ran.stdout.endswith("FAIL\n")


@needs_gcc
def test_the_object_is_small_and_calls_the_mathematical_library_alone(made: PlainShip, tmp_path: Path) -> None:
    folder = written(made, tmp_path)
    for single in (False, True):
        assert call("gcc", "-std=c99", "-O2", "-c", "ship.c", *macro(made, single), folder=folder).returncode == 0
        symbols = call("nm", "ship.o", folder=folder).stdout.split("\n")
        wanted = {f"{name}f" if single else name for name in MATH}
        undefined = {line.split()[-1] for line in symbols if " U " in line}
        assert undefined and undefined <= wanted
        assert not [line for line in symbols if re.search(" [bBdDC] ", line)]  # no variable lasts
        shown = {line.split()[-1] for line in symbols if " T " in line}
        functions = ("init", "start", "set", "set_parameter", "step", "get", "version")
        assert shown == {f"{made.prefix}_{name}" for name in functions}
        text, data, bss = call("size", "ship.o", folder=folder).stdout.split("\n")[1].split()[:3]
        assert int(text) < 64 * 1024 and data == bss == "0"


@needs_gcc
@pytest.mark.slow
@pytest.mark.parametrize("card", ["mariner", "otter", "container", "esso-osaka-ship"])
def test_sanitizers_find_nothing(card: str, tmp_path: Path) -> None:
    ship = plain_ship(t2s.load(card).card)
    flags = ["-std=c99", "-g", "-fsanitize=address,undefined", "-fno-sanitize-recover=all"]
    for _, done, ran in self_tests(ship, tmp_path, "gcc", *flags):
        if done.returncode != 0 and "asan" in done.stderr:
            pytest.skip("gcc has no sanitizers here")
        assert ran.returncode == 0 and not ran.stderr, ran.stderr


@pytest.fixture(scope="module")
def clang() -> tuple[str, ...]:
    pytest.importorskip("ziglang", reason="the compiler for other machines is not installed (extra platforms)")
    return (sys.executable, "-m", "ziglang", "cc")


@pytest.mark.slow
@pytest.mark.parametrize(
    "target", ["arm-linux-gnueabihf", "aarch64-linux-gnu", "thumb-linux-musleabihf -mcpu=cortex_m4"]
)
def test_a_compiler_for_arm_has_no_objection(
    target: str, clang: tuple[str, ...], made: PlainShip, tmp_path: Path
) -> None:
    folder = written(made, tmp_path)
    for single in (False, True):
        flags = ["-target", *target.split(), "-O2", *STRICT, *macro(made, single)]
        done = call(*clang, *flags, "-c", "ship.c", "-o", "ship.o", folder=folder)
        assert done.returncode == 0, done.stderr


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="a program for Linux is run")
def test_the_self_test_passes_with_another_compiler_and_mathematical_library(
    clang: tuple[str, ...], made: PlainShip, tmp_path: Path
) -> None:
    flags = ["-target", f"{platform.machine()}-linux-musl", *STRICT, "-O2"]
    for _, done, ran in self_tests(made, tmp_path, *clang, *flags):
        assert done.returncode == 0, done.stderr
        assert ran.returncode == 0


def test_single_precision_stays_near_the_model(made: PlainShip, mariner: Model) -> None:
    run = manoeuvre(mariner)  # 300 s with every input
    found = CompiledShip(made, single=True).drive(run)
    columns = dict(zip(mariner.outputs, np.vstack([found[:1], found]).T.astype(float), strict=True))
    expected = by_scheme(mariner, run)
    expected[0] = expected[1]
    errors = reference_errors(mariner, expected, columns)
    assert 1e-8 < max(errors.values()) < 1e-4


@pytest.fixture
def ship(made: PlainShip) -> CompiledShip:
    return CompiledShip(made)


def test_what_is_out_of_range_changes_nothing(ship: CompiledShip, mariner: Model) -> None:
    assert ship.set(0, 0.3) == 0 and ship.step(0.1) == 0
    before = ship.memory.copy()
    assert ship.set(0, 1.6) == ship.set(0, -1.6) == ship.set(0, float("nan")) == 1  # a rudder in degrees
    assert ship.set(len(mariner.inputs), 0.0) == ship.set_parameter(len(mariner.parameters), 0.0) == 1
    assert ship.set_parameter(mariner.parameter_names.index("ship.mass"), 0.0) == 1
    assert ship.set(1, 2.0) == 1  # a Boolean
    for dt in (0.0, -0.1, float("nan"), float("inf"), 100.2):
        assert ship.step(dt) == 1
    assert ship.memory.tobytes() == before.tobytes()
    assert ship.step(100.0) == 0


def test_a_motion_without_bounds_is_refused_and_the_last_good_state_kept(ship: CompiledShip, mariner: Model) -> None:
    assert ship.set(mariner.input_names.index("external.N"), 9e14) == 0
    status = [ship.step(0.1) for _ in range(50)]
    before = ship.memory.copy()
    assert 2 in status and ship.step(0.1) == 2
    limits = ship.made.files["ship.c"].partition("mariner_class_largest[")[2]
    assert re.findall(r"_C\(([\d.e+]+)\)", limits)[:3] == ["1000000000.0", "1000000000.0", "1000000.0"]  # as the FMU
    assert ship.memory.tobytes() == before.tobytes() and np.isfinite(before).all()


def test_a_parameter_acts_from_the_next_step_and_the_start_from_the_next_start(
    ship: CompiledShip, mariner: Model
) -> None:
    names = mariner.parameter_names
    assert ship.set_parameter(names.index("initial.u"), 6.5) == 0
    assert ship.memory[mariner.state_names.index("motion.u")] == 7.7175
    assert ship.call("start") == 0 and ship.memory[mariner.state_names.index("motion.u")] == 6.5
    changed = mariner.with_values({"derivatives.Nd": 0.002, "initial.u": 6.5})
    assert ship.set_parameter(names.index("derivatives.Nd"), 0.002) == 0
    run = self_test_run(mariner)
    found = dict(zip(mariner.outputs, ship.drive(run).T, strict=True))
    errors = reference_errors(mariner, by_scheme(changed, run)[1:], found)
    assert max(errors.values()) < 1e-12


def test_steady_motion_is_a_start_from_which_nothing_changes(ship: CompiledShip, mariner: Model) -> None:
    assert ship.set(0, 0.1) == 0
    assert ship.set_parameter(mariner.parameter_names.index("initial.trim"), 1.0) == 0
    assert ship.call("start") == 0
    before = dict(zip(mariner.outputs, ship.outputs.tolist(), strict=True))
    assert ship.step(60.0) == 0
    after = dict(zip(mariner.outputs, ship.outputs.tolist(), strict=True))
    assert before["motion.r"] > 0.001  # rudder to starboard
    for name in ("motion.u", "motion.v", "motion.r", "rudder.angle"):
        assert after[name] == pytest.approx(before[name], rel=1e-8)


def test_the_header_says_what_it_was_made_of(made: PlainShip) -> None:
    header = made.files["ship.h"]
    digest = hashlib.sha256(t2s.load("mariner").card.text.encode()).hexdigest()
    assert f'#define MARINER_CLASS_CARD_SHA256 "{digest}"' in header
    assert re.search(r"MARINER_CLASS_IN_rudder_command = 0, /\* rudder\.command \(rad\): .*starboard", header)
    names = [name.lower() for name in re.findall(r"^    (\w+) = \d", header, re.MULTILINE)]
    assert len(names) == len(set(names)) > 100 and str(Path.cwd()) not in header
    assert all(name.startswith("mariner_class_") for name in re.findall(r"^\w[\w *]*?(\w+)\(", header, re.MULTILINE))
    assert str(TOLERANCES[1]) in made.files["self_test.c"] and str(made.instance_bytes()) in made.use


@pytest.mark.parametrize(
    ("name", "prefix"),
    [("M/V Ö", "m_v_o"), ("船", "ship"), ("2", "ship"), ("int", "model_int"), ("INT32", "ship_int32")],
)
def test_a_prefix_is_an_identifier(name: str, prefix: str) -> None:
    assert code_prefix(name) == prefix


def test_libraries_of_two_ships_share_no_name() -> None:
    first, second = (code_prefix(t2s.load(name).card.ship.name) for name in ("mariner", "otter"))
    assert first != second and SHARED_SUFFIX
