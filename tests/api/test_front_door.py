"""``import tank2sim``: what it gives and what it loads."""

from __future__ import annotations

import inspect
import subprocess
import sys

import pytest

import tank2sim

SLOW = ("numpy", "casadi", "pandas", "matplotlib", "control", "scipy", "altair", "pydantic")


def loaded_by(code: str) -> set[str]:
    """Modules that a new process has loaded after `code`."""
    script = f"{code}\nimport sys; print(' '.join(sorted(name.partition('.')[0] for name in sys.modules)))"
    result = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    return set(result.stdout.split())


def test_importing_the_package_loads_no_library() -> None:
    assert not loaded_by("import tank2sim") & set(SLOW)


@pytest.mark.slow
def test_a_simulation_loads_neither_control_nor_plots_nor_tables() -> None:
    code = "import tank2sim; tank2sim.load('mariner').zigzag(20, 20).figures"
    assert not loaded_by(code) & {"control", "matplotlib", "pandas", "altair", "statsmodels", "fmpy"}


@pytest.mark.slow
def test_a_process_that_fits_explanations_loads_only_the_parts_of_scipy_that_start_fast() -> None:
    code = "import tank2sim.gap.workflow, sys; print(*sys.modules)"
    loaded = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.split()
    slow = {"scipy.signal", "scipy.stats", "scipy.interpolate", "pandas", "altair", "jinja2", "asyncio", "matplotlib"}
    assert not {*loaded} & slow


def test_the_command_simulate_loads_no_slow_library_that_it_does_not_use() -> None:
    words = "['tank2sim', 'simulate', 'mariner', '--manoeuvre', 'turn:35', '--quiet']"
    code = f"import sys; sys.argv = {words}\nfrom tank2sim.cli import main\ntry: main()\nexcept SystemExit: pass"
    assert not loaded_by(code) & {"scipy", "control", "matplotlib", "pandas", "altair", "fmpy", "jinja2"}


def test_every_name_is_there_with_a_docstring() -> None:
    assert sorted(tank2sim.__all__) == tank2sim.__all__
    for name in tank2sim.__all__:
        assert inspect.getdoc(getattr(tank2sim, name)), name
    assert set(tank2sim.__all__) <= set(dir(tank2sim))


def test_a_name_that_is_not_there_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match="simulat"):
        tank2sim.simulat  # noqa: B018
