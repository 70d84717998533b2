"""Several files in one command: parts of a voyage, instruments of the same time, or records of their own."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import tank2sim as t2s
from tank2sim.apps.logs.result import LogResult
from tank2sim.errors import InputError

from .made_logs import frame

Saved = Callable[[pd.DataFrame, str], Path]


@pytest.fixture
def saved(tmp_path: Path) -> Saved:
    def save(table: pd.DataFrame, name: str) -> Path:
        table.to_csv(tmp_path / name, index=False)
        return tmp_path / name

    return save


@pytest.fixture(scope="module")
def undated() -> pd.DataFrame:
    """The made-up voyage with seconds from its beginning in place of dates."""
    table = frame()
    moments = pd.to_datetime(table["utc"])
    table.insert(0, "time_s", (moments - moments[0]) / pd.Timedelta(seconds=1))
    return table.drop(columns="utc")


def same_trials(found: LogResult, expected: LogResult, times: int = 1) -> bool:
    """Whether the trials are the expected ones, several times."""
    pairs = zip(found.cuts, times * expected.cuts, strict=True)
    return all(
        np.allclose(cut.trial.signals[name], values, atol=1e-4, equal_nan=True)
        for cut, other in pairs
        for name, values in other.trial.signals.items()
    )


@pytest.mark.parametrize("begins_s", [(0.0, 0.0, 0.0), (0.0, 50.0, 20.0), (0.0, 4000.0, 8000.0)])
def test_files_with_the_same_columns_are_records_of_their_own(saved, undated, begins_s) -> None:
    alone = t2s.log(saved(undated, "alone.csv"))
    files = []
    for place, begin in enumerate(begins_s):
        files.append(saved(undated.assign(time_s=undated["time_s"] + begin), f"{place}.csv"))
    found = t2s.log(files)
    assert len(alone.cuts) == 2 and same_trials(found, alone, times=3)
    assert [cut.trial.path.name[:2] for cut in found.cuts] == [f"{number:02d}" for number in range(1, 7)]
    assert list(dict.fromkeys(found.stretches["log"])) == [file.name for file in files]
    assert found.study.duration_s == pytest.approx(3 * alone.study.duration_s)
    assert not found.cautions and not any("nothing for" in notice for notice in found.notices)


def test_each_trial_names_the_file_that_it_was_cut_from(saved, undated, tmp_path) -> None:
    files = [saved(undated, name) for name in ("first.csv", "second.csv")]
    t2s.log(files, tmp_path / "trials")
    texts = [path.read_text(encoding="utf-8") for path in sorted((tmp_path / "trials").glob("*.csv"))]
    assert [("from first.csv" in text, "from second.csv" in text) for text in texts] == 2 * [(True, False)] + 2 * [
        (False, True)
    ]


def test_parts_of_one_clock_without_a_date_are_one_voyage(saved, undated) -> None:
    whole = t2s.log(saved(undated, "whole.csv"))
    found = t2s.log([saved(undated[700:], "b.csv"), saved(undated[:700], "a.csv")])
    assert same_trials(found, whole)
    assert found.study.duration_s == whole.study.duration_s and set(found.stretches["log"]) == {None}


def test_other_columns_of_the_same_time_are_one_voyage(saved, undated) -> None:
    rudder, others = undated[["time_s", "rudder_deg"]], undated.drop(columns="rudder_deg")
    found = t2s.log([saved(others, "bridge.csv"), saved(rudder, "rudder.csv")])
    assert len(found.cuts) == 2 and set(found.stretches["log"]) == {None}


def test_a_file_of_one_of_several_records_is_refused(saved, undated) -> None:
    rudder, others = undated[["time_s", "rudder_deg"]], undated.drop(columns="rudder_deg")
    files = [saved(others, "a.csv"), saved(others, "b.csv"), saved(rudder, "rudder.csv")]
    with pytest.raises(InputError, match="to which of several records"):
        t2s.log(files)


def test_runs_of_a_real_craft_in_one_command_are_all_cut(data: Path) -> None:
    files = sorted((data / "data" / "blueboat").glob("*.csv"))
    if not files:
        pytest.skip("the runs of the BlueBoat are not here")
    found = t2s.log(files)
    assert set(found.stretches.dropna(subset="file")["log"]) == {file.name for file in files}
    assert not any("another heading" in notice for notice in found.notices)
    used = found.channels[found.channels["use"]].set_index("quantity")["stream"]
    assert (used["thrust_order_port"], used["thrust_order_starboard"]) == ("thr_right", "thr_left")
