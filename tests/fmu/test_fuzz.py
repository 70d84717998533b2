"""The C sources of an FMU by themselves: no warnings, no allocation while running, no harm by calls at random.

``fuzz/fuzz.c`` says what must hold after each call. A failure prints the seed and the number of the call; the test
``test_a_million_calls_at_random_do_no_harm`` takes another seed from the environment variable TANK2SIM_FUZZ_SEED.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from tank2sim.cards import read_card
from tank2sim.dynamics import build
from tank2sim.dynamics.model import Model
from tank2sim.fmu.interface import interface
from tank2sim.fmu.sources import c_sources

HERE = Path(__file__).parent / "fuzz"
TOKEN = "{%s-#-token}"
STRICT = ("-std=c99", "-Wall", "-Wextra", "-Wpedantic", "-Werror")
SANITISED = ("-g", "-O0", "-fsanitize=address,undefined", "-fno-sanitize-recover=all")
FUZZ = {2: ("fuzz.c", "fuzz2.c"), 3: ("fuzz.c", "fuzz3.c", "fuzz3_absent.c")}
Sources = Callable[[Model, int], Path]
Program = Callable[..., Path]

pytestmark = pytest.mark.skipif(
    sys.platform != "linux" or not shutil.which("gcc"), reason="gcc on Linux compiles these programs"
)


@pytest.fixture(scope="module")
def sources(tmp_path_factory: pytest.TempPathFactory) -> Sources:
    """A folder with the C sources of a model's FMU, the generated equations compiled to objects once for each kind."""
    made: dict[tuple[str, int], Path] = {}

    def folder(model: Model, fmi: int) -> Path:
        if (model.name, fmi) not in made:
            made[model.name, fmi] = target = tmp_path_factory.mktemp("sources")
            for name, text in c_sources(model, interface(model), fmi, TOKEN).items():
                (target / name).write_text(text, encoding="utf-8")
        return made[model.name, fmi]

    return folder


def program(folder: Path, names: tuple[str, ...], *flags: str) -> Path:
    """A program of the FMU's sources and of files in ``fuzz/``; skips where gcc lacks what the flags ask for."""
    target = folder / f"program-{names[-1]}-{len(flags)}"
    if target.exists():
        return target
    objects = folder / f"{target.name}.objects"
    objects.mkdir()
    # CasADi's code has arguments it does not use: that is not ours to warn of.
    generated = sorted(folder.glob("equations*.c"))
    ours = [path for path in sorted(folder.glob("*.c")) if path not in generated]
    commands: list[list[str]] = [
        ["gcc", "-std=c99", "-w", *flags, "-c", str(path), "-o", str(objects / f"{path.stem}.o")] for path in generated
    ]
    commands += [
        [
            *("gcc", *STRICT, *flags, f"-I{folder}", f"-I{HERE}"),
            *(str(objects / f"{path.stem}.o") for path in generated),
            *(str(path) for path in (*ours, *(HERE / name for name in names))),
            *("-o", str(target), "-lm"),
        ],
    ]
    for command in commands:
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        if "cannot find" in done.stderr and "san" in done.stderr:
            pytest.skip("gcc has no sanitizers here")
        assert done.returncode == 0, done.stderr
    return target


def fuzzed(program: Path, seed: int, calls: int, *before: str) -> None:
    done = subprocess.run([*before, str(program), str(seed), str(calls)], capture_output=True, text=True, check=False)
    print(done.stdout)
    assert done.returncode == 0, done.stderr
    modes = [int(word) for word in done.stdout.partition("done ")[2].split(" in ")[0].split()]
    assert min(modes[:6]) > 0, "no mode of an instance is left out"


@pytest.mark.slow
@pytest.mark.skipif(not shutil.which("nm"), reason="nm lists the symbols of objects")
def test_nothing_is_written_that_instances_share(fmi: int, hull: Model, sources: Sources, tmp_path: Path) -> None:
    """No variable outside instances and the stack: then any number of instances may run, each in its own thread."""
    files = [str(path) for path in sorted(sources(hull, fmi).glob("*.c"))]
    subprocess.run(["gcc", "-std=c99", "-O2", "-fno-pic", "-w", "-c", *files], cwd=tmp_path, check=True)
    objects = [str(path) for path in sorted(tmp_path.glob("*.o"))]
    listed = subprocess.run(["nm", *objects], capture_output=True, text=True, check=True).stdout
    symbols = [line.split() for line in listed.splitlines() if len(line.split()) == 3]
    assert len(symbols) > 100
    assert [name for _, kind, name in symbols if kind in "bBcCdDsS"] == []


@pytest.mark.slow
def test_nothing_is_allocated_while_an_fmu_runs(fmi: int, hull: Model, sources: Sources) -> None:
    wrapped = ("-O2", f"-DFMI={fmi}", *(f"-Wl,--wrap={name}" for name in ("malloc", "calloc", "realloc")))
    counted = program(sources(hull, fmi), ("counted.c",), *wrapped)
    done = subprocess.run([str(counted)], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout
    assert done.stdout.startswith("0 allocations")
    assert ("1000 updates" in done.stdout) == (fmi == 3)


@pytest.mark.slow
def test_calls_at_random_do_no_harm(fmi: int, hull: Model, sources: Sources) -> None:
    fuzzed(program(sources(hull, fmi), FUZZ[fmi], *SANITISED), seed=1, calls=100_000)


@pytest.mark.slow
@pytest.mark.skipif(not shutil.which("valgrind"), reason="valgrind is not installed")
def test_calls_at_random_leak_nothing(fmi: int, hull: Model, sources: Sources) -> None:
    plain = program(sources(hull, fmi), FUZZ[fmi], "-O0", "-g")
    fuzzed(plain, 2, 5_000, "valgrind", "-q", "--leak-check=full", "--show-leak-kinds=all", "--error-exitcode=9")


@pytest.mark.slow
@pytest.mark.parametrize("name", ["mariner", "gain", "body"])
def test_a_million_calls_at_random_do_no_harm(fmi: int, name: str, models: dict[str, Model], sources: Sources) -> None:
    model = models[name] if name in models else build(read_card(name))
    seed = int(os.environ.get("TANK2SIM_FUZZ_SEED", "3"))
    fuzzed(program(sources(model, fmi), FUZZ[fmi], *SANITISED), seed, 1_000_000)
