"""What several test modules need: the measured data next to the project, and the bundled ships."""

from __future__ import annotations

import contextlib
import gc
import importlib
import importlib.util
import os
import shlex
from collections.abc import Callable, Iterator
from pathlib import Path
from types import ModuleType

# Matrices here are small and the workers of the tests share the cores: threads would only wait for each other.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import pytest

from tank2sim.cards import ManoeuvringCard, read_card
from tank2sim.dynamics import Model, build
from tank2sim.native.compiler import find_compiler

ROOT = Path(__file__).resolve().parents[1]
DATA = Path(os.environ.get("TANK2SIM_DATA", ROOT.parent / "shared"))


def pytest_sessionstart(session: pytest.Session) -> None:
    """Every second worker imports the test modules from the last one on, before they are collected.

    What an import compiles is kept next to the module. In a fresh checkout two workers that go through the modules in
    the same order would both compile all of them, their assertions included; now they meet in the middle.
    """
    gc.disable()  # until all are collected: what is imported stays, and going through it takes seconds
    worker = os.environ.get("PYTEST_XDIST_WORKER", "gw0")
    if not int(worker.removeprefix("gw")) % 2 or session.config.args_source is not session.config.ArgsSource.TESTPATHS:
        return
    for path in sorted((ROOT / "tests").rglob("test_*.py"), reverse=True):
        with contextlib.suppress(Exception, pytest.skip.Exception):  # collection reports it
            importlib.import_module(".".join(path.relative_to(ROOT).with_suffix("").parts))


def pytest_collection_finish() -> None:
    """What was imported and collected lasts as long as the process: no search for garbage goes through it again."""
    gc.freeze()
    gc.enable()


@pytest.fixture(scope="session")
def data() -> Path:
    """The folder of measured and reference data, or a skip that says it is missing."""
    if not DATA.is_dir():
        pytest.skip(f"measured data are missing: no folder {DATA} (set TANK2SIM_DATA)")
    return DATA


@pytest.fixture(scope="session")
def simulator(data: Path) -> Callable[[str], ModuleType]:
    """Gives another program's equations, written without tank2sim, by their file below ``simulators``; or skips."""

    def loaded(name: str) -> ModuleType:
        path = data / "simulators" / name
        if not path.is_file():
            pytest.skip(f"equations of another program are missing: no file {path}")
        spec = importlib.util.spec_from_file_location(path.stem, path)
        assert spec and spec.loader
        module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
        return module

    return loaded


@pytest.fixture(scope="session")
def mariner_card() -> ManoeuvringCard:
    card = read_card("mariner")
    assert isinstance(card, ManoeuvringCard)
    return card


@pytest.fixture(scope="session")
def mariner(mariner_card: ManoeuvringCard) -> Model:
    return build(mariner_card)


@pytest.fixture(scope="session")
def session_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder of this session of tests, which its worker processes share; write into it whole files only."""
    own = tmp_path_factory.getbasetemp()
    folder = (own.parent if "PYTEST_XDIST_WORKER" in os.environ else own) / "session"
    folder.mkdir(exist_ok=True)
    return folder


@pytest.fixture(autouse=True, scope="session")
def private_cache(session_folder: Path) -> None:
    """Compiled models of tests go to a folder of their own, so that no test passes on what was compiled earlier."""
    os.environ["XDG_CACHE_HOME"] = str(session_folder / "cache")


def of_every_change(config: pytest.Config) -> bool:
    """Whether the tests that run are those of every change: the fast ones, or the essential ones of the slow."""
    return "not slow" in config.option.markexpr or config.option.markexpr == "essential"


@pytest.fixture(autouse=True, scope="session")
def quick_compiler(session_folder: Path, pytestconfig: pytest.Config) -> None:
    """Tests of every change compile with little optimisation, sooner and to the same digits; others as users do."""
    compiler = find_compiler()
    if compiler is None or not of_every_change(pytestconfig) or os.name != "posix":
        return
    command, own = session_folder / "cc", session_folder / f"cc-{os.getpid()}"
    script = f'exec {shlex.join(compiler)} "$@"'
    # Essential tests run many ships in lanes, where more time is gained by optimisation than it takes.
    lanes = f'case "$*" in *lanes.c*) {script} ;; esac\n' if pytestconfig.option.markexpr == "essential" else ""
    # A model is compiled for a few runs; filters, sensitivities and lanes take many steps.
    models = f'case "$*" in *model.c*) {script} -O0 ;; esac\n'
    own.write_text(f"#!/bin/sh\n{lanes}{models}{script} -Og\n", encoding="utf-8")
    own.chmod(0o755)
    own.replace(command)  # one name for all worker processes: what one has compiled is known by it
    os.environ["CC"] = str(command)


@pytest.fixture(autouse=True, scope="session")
def one_processor(pytestconfig: pytest.Config) -> Iterator[None]:
    """Tests of every change see one processor, as their workers share them; a process that is begun takes a second.

    What needs several, and says so, begins them all the same; other tests see as many as there are.
    """
    with pytest.MonkeyPatch.context() as patch:
        if of_every_change(pytestconfig):
            patch.setattr(os, "cpu_count", lambda: 1)
        yield
