"""Executors: options that cannot be used, and what may begin processes."""

from __future__ import annotations

import importlib.util
import os
import pickle

import pytest

from tank2sim import cluster, executors
from tank2sim.errors import InputError
from tank2sim.executors import check_executor, executing, processes_to_begin
from tests.dask_cluster import free_port

needs_dask = pytest.mark.skipif(importlib.util.find_spec("distributed") is None, reason="dask[distributed] is missing")


@pytest.mark.parametrize("text", ["threads", "dask://", "dask://host", "dask://host:x", "tcp://host:8786", ""])
def test_what_is_no_executor_is_refused(text: str) -> None:
    with pytest.raises(InputError, match="is not an executor"):
        check_executor(text)


def test_dask_that_is_not_installed_is_reported_with_the_way_to_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(executors.importlib.util, "find_spec", lambda name: None)
    with pytest.raises(InputError, match=r"pip install 'tank2sim\[dask\]'"):
        check_executor("dask://localhost:8786")


@needs_dask
@pytest.mark.slow
def test_a_scheduler_that_is_not_there_is_reported_in_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cluster, "ANSWERS_WITHIN_S", 1.0)
    with pytest.raises(InputError, match="no scheduler answers"), executing(f"dask://127.0.0.1:{free_port()}"):
        pass


def test_an_input_error_comes_whole_from_another_process() -> None:
    error = InputError("trial.csv", "line 3", "is empty", "give a number")
    again = pickle.loads(pickle.dumps(error))
    assert isinstance(again, InputError) and str(again) == str(error)
    assert (again.source, again.place, again.problem, again.remedy) == (
        "trial.csv",
        "line 3",
        "is empty",
        "give a number",
    )


def test_as_many_processes_as_were_asked_for_or_there_are_processors() -> None:
    assert processes_to_begin(3) == 3
    assert processes_to_begin() == os.cpu_count()


@pytest.mark.slow
def test_work_in_another_process_begins_none() -> None:
    with executing(workers=1) as executor:
        assert executor.submit(processes_to_begin, 3).result() == 1
