"""Result of captive runs: tables and charts hold the numbers of the study."""

from __future__ import annotations

import math

import pytest

import tank2sim as t2s
from tank2sim.answer.parts import Verdict
from tank2sim.results.captive_run import CaptiveRunResult
from tests.answer.drawn import line, panels, whole_panel
from tests.identification.captive.generator import Campaign, write
from tests.identification.captive.made_runs import oscillation


@pytest.fixture(scope="module")
def yaw(tmp_path_factory: pytest.TempPathFactory) -> CaptiveRunResult:
    path = write(Campaign(seed=3, size="linear", rate_hz=5.0), tmp_path_factory.mktemp("campaign")).path
    return t2s.reduce_runs(path.parent / "yaw_00.csv", campaign=path)


def test_tables_hold_coefficients_and_derivatives(yaw: CaptiveRunResult) -> None:
    derivatives, forces, every = yaw.tables
    (run,) = yaw.runs
    assert {row[1]: row[2] for row in derivatives.rows} == {
        name: 1e5 * value for name, value in run.derivatives.values.items()
    }
    first = next(row for row in forces.rows if row[1:3] == ["Y (N)", 1])
    found = run.coefficient("Y_water", 1)
    assert first[3] == f"{found.cosine:.5g} ± {found.cosine_error:.2g}"
    row = next(row for row in every.rows if (row[0], row[2]) == ("Y_water", 1))
    assert row[7] == pytest.approx(math.hypot(found.cosine, found.sine))
    assert yaw.key_figures[0].value == 1e5 * run.derivatives.values[yaw.key_figures[0].label.partition(",")[0]]


def test_charts_hold_the_cycle_and_the_residual(yaw: CaptiveRunResult) -> None:
    charts = yaw._charts()
    assert list(charts) == ["cycle", "forces_1", "residual_1"]
    (run,) = yaw.runs
    means = [row["v"] for row in whole_panel(charts["cycle"], 1) if "low" in row]
    assert means[: len(run.cycles["Y"].mean)] == pytest.approx(run.cycles["Y"].mean, rel=1e-4)
    residual = panels(charts["residual_1"])["Y (N)"]
    assert {row["v"] for row in residual} <= {float(f"{value:.6g}") for value in run.history["Y_residual_N"]}
    assert line(charts["forces_1"], "v", "fit")


def test_repeats_that_differ_are_marked(tmp_path) -> None:
    files = [oscillation(tmp_path, "a.csv"), oscillation(tmp_path, "b.csv"), oscillation(tmp_path, "c.csv", change=0.5)]
    found = t2s.reduce_runs(files, type="pure_yaw")
    (repeats,) = (each for each in found.tables if each.caption == "3 runs compared")
    marked = {tuple(row[:3]) for row in repeats.rows if row[-1] is Verdict.CAUTION}
    assert ("Y", "cos", 1) in marked
    assert marked == {(row.signal, row.part, row.order) for row in found.repeats if row.chance < 0.01}
    assert f"in {len(marked)} of 33 coefficients" in found.headline[0]
    again = CaptiveRunResult.read(found.to_dict(), "r.json")
    assert again.to_dict() == found.to_dict() and again.page() == found.page()
