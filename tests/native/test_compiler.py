"""A compiler that is there and of no use is reported in one line, and is not a compiler to those who can do without."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

from tank2sim.dynamics.model import Model, Parameter, Quantity, State
from tank2sim.errors import InputError
from tank2sim.fmu.export import make_fmu
from tank2sim.native.compiler import compile_shared, find_compiler, require_compiler
from tank2sim.native.library import cached_library
from tank2sim.simulation.integrator import Integrator

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="makes compilers of shell scripts")


def script(folder: Path, text: str) -> str:
    path = folder / "compiler"
    path.write_text(f"#!/bin/sh\n{text}\n")
    path.chmod(0o755)
    return str(path)


def body() -> Model:
    drag = Parameter(name="drag", unit="1", description="Drag", start=0.05)
    speed = State(name="u", unit="m/s", description="Speed", derivative="udot", start=2.0)
    rate = Quantity(name="udot", unit="m/s2", description="Rate", value=-drag.symbol * speed.symbol**2)
    return Model(
        name="Body",
        description="A body that slows down",
        states=(speed,),
        inputs=(),
        parameters=(drag,),
        quantities=(rate,),
        outputs=("u",),
        step_s=0.1,
    )


@pytest.fixture(
    params=[
        ("exit 1", "ended with code 1"),
        ("exit 0", "without a library"),
        ("echo 'In file x:' >&2; echo 'ld: cannot find -lgcc' >&2; exit 1", "ld: cannot find -lgcc"),
        (None, "no C compiler was found"),
    ],
    ids=["fails", "makes nothing", "cannot link", "open quote"],
)
def reported(request: pytest.FixtureRequest, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    """What to say of the compiler that CC names now."""
    text, words = request.param
    monkeypatch.setenv("CC", "gcc 'x" if text is None else script(tmp_path, text))
    return str(words)


def test_a_compiler_of_no_use_is_reported_in_one_line(reported: str, tmp_path: Path) -> None:
    assert find_compiler() is None
    source = tmp_path / "x.c"
    source.write_text("int x;\n")
    for use in (
        lambda: require_compiler("a test"),
        lambda: compile_shared([source], tmp_path / "x"),
        lambda: cached_library({"model.c": "int x;\n"}),
        lambda: make_fmu(body()),
    ):
        with pytest.raises(InputError, match=reported) as caught:
            use()
        assert "\n" not in str(caught.value)
        assert "environment variable CC" in caught.value.remedy


def test_the_integrator_does_without_it(reported: str) -> None:
    model = body()
    integrator = Integrator(model)
    assert not integrator.compiled
    path = integrator.rollout(np.array([2.0]), np.empty(0), model.parameter_values(), 0.1, 100)
    assert path[-1, 0] == pytest.approx(2.0 / (1 + 0.05 * 2.0 * 10.0), rel=1e-9)
    with pytest.raises(InputError, match=reported):
        Integrator(model, compiled=True)


def test_a_library_that_cannot_be_loaded_is_done_without(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    # A compiler for another machine: it makes files, but none that can be loaded here.
    monkeypatch.setenv("CC", script(tmp_path, 'while [ "$1" != -o ]; do shift; done; echo foreign > "$2"'))
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    assert find_compiler() is None
    assert not Integrator(body()).compiled
    with pytest.raises(InputError, match="cannot be loaded"):
        Integrator(body(), compiled=True)


def test_code_that_a_good_compiler_refuses_is_a_fault_of_the_program(tmp_path: Path) -> None:
    source = tmp_path / "wrong.c"
    source.write_text("int wrong( {\n")
    with pytest.raises(RuntimeError, match=r"wrong\.c"):
        compile_shared([source], tmp_path / "wrong")


def test_a_good_compiler_is_used() -> None:
    assert find_compiler()
    assert Integrator(body()).compiled
