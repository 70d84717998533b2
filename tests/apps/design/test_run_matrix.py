"""A tank's own run matrix from a table, against the numbers of its rows."""

from __future__ import annotations

import math
from collections import Counter
from pathlib import Path

import pytest

from tank2sim.apps.design.captive_runs import TankRuns
from tank2sim.apps.design.plan_files import runs_of_matrix
from tank2sim.apps.design.tank_form import TankFile
from tank2sim.cards import writing
from tank2sim.errors import InputError

RUNS = TankRuns(
    tank=TankFile(), length_m=4.0, speed_mps=1.0, largest=writing.TestedRange(math.radians(20), math.radians(35), 0.8)
)

TABLE = """id,beta (deg) ,delta (deg),v'max,r'max,Nrep,U/U0,Type
1,4,0,,,1,1,Static Drift
2,0,-35,,,2,1,Static Rudder
3,-8,10,,,1,0.6,Static Drift
4,0,0,0.16,,1,1,Pure Sway
5,0,20,,0.4,1,0.8,Pure Yaw
6,-12,0,,0.7,1,1,Yaw-and-Drift
"""


def table(folder: Path, text: str) -> Path:
    path = folder / "matrix.csv"
    path.write_text(text)
    return path


def test_each_row_is_a_run_with_its_angles_and_amplitudes(tmp_path: Path) -> None:
    groups, notices = runs_of_matrix(table(tmp_path, TABLE), RUNS)
    runs = [run for group in groups for run in group]
    assert [run.type for run in runs] == [
        *("static_drift", "static_rudder", "static_rudder", "drift_and_rudder"),
        *("pure_sway", "pure_yaw", "yaw_with_drift"),
    ]
    degrees = [(round(math.degrees(run.drift_rad)), round(math.degrees(run.rudder_rad))) for run in runs]
    assert degrees == [(4, 0), (0, -35), (0, -35), (-8, 10), (0, 0), (0, 20), (-12, 0)]
    assert runs[4].velocity == pytest.approx(0.16)  # v' U
    assert [run.velocity for run in runs[5:]] == pytest.approx([0.1, 0.175])  # r' U/L
    assert [run.cycles for run in runs[4:]] == [
        math.floor(RUNS.longest_s * run.frequency_radps / (2 * math.pi)) for run in runs[4:]
    ]
    text = " ".join(map(str, notices))
    assert "3 oscillating runs" in text and "2 rows at other speeds" in text


@pytest.mark.parametrize(
    ("text", "place"),
    [
        ("id,force\n1,2\n", "header"),
        (TABLE.replace("1,4,0", "1,fore,0"), "row 2"),
        (TABLE.replace("1,4,0", "1,95,0"), "row 2"),
        (TABLE.replace("2,0,-35,,,2", "2,0,-35,,,0.5"), "row 3"),
        (TABLE.partition("\n")[0] + "\n", ""),
    ],
)
def test_a_table_that_is_no_matrix_is_refused(tmp_path: Path, text: str, place: str) -> None:
    with pytest.raises(InputError) as refused:
        runs_of_matrix(table(tmp_path, text), RUNS)
    assert refused.value.place == place


def test_the_matrix_of_insean_has_its_141_runs(data: Path) -> None:
    """SOURCE.txt: 118 static runs, 4 of pure sway, 13 of pure yaw, 6 of yaw with drift."""
    groups, _ = runs_of_matrix(data / "data/kvlcc2_insean_runs/index_PMM.csv", RUNS)
    kinds = Counter(run.type for group in groups for run in group)
    steady = sum(kinds[name] for name in ("static_drift", "static_rudder", "drift_and_rudder"))
    assert (steady, kinds["pure_sway"], kinds["pure_yaw"], kinds["yaw_with_drift"]) == (118, 4, 13, 6)
