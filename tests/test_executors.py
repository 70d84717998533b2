"""Executors: options that cannot be used, and a cluster on the loopback that loses a worker."""

from __future__ import annotations

import importlib.util
import os
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from concurrent.futures import Executor
from contextlib import contextmanager

import numpy as np
import pytest

from tank2sim import executors
from tank2sim.analysis.ensemble.draws import draws_of
from tank2sim.analysis.ensemble.questions import OfManoeuvre, ShipText
from tank2sim.cards import ManoeuvringCard
from tank2sim.errors import InputError
from tank2sim.executors import check_executor, executing
from tank2sim.simulation.ensemble import ensemble
from tank2sim.simulation.manoeuvres import Turn

needs_dask = pytest.mark.skipif(importlib.util.find_spec("distributed") is None, reason="dask[distributed] is missing")


@pytest.mark.parametrize("text", ["threads", "dask://", "dask://host", "dask://host:x", "tcp://host:8786", ""])
def test_what_is_no_executor_is_refused(text: str) -> None:
    with pytest.raises(InputError, match="is no executor"):
        check_executor(text)


def test_dask_that_is_not_installed_is_told_with_the_way_to_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(executors.importlib.util, "find_spec", lambda name: None)
    with pytest.raises(InputError, match=r"pip install 'tank2sim\[dask\]'"):
        check_executor("dask://localhost:8786")


@needs_dask
@pytest.mark.slow
def test_a_scheduler_that_is_not_there_is_told_in_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(executors, "_ANSWERS_WITHIN", "1s")
    with pytest.raises(InputError, match="no scheduler answers"), executing(f"dask://127.0.0.1:{free_port()}"):
        pass


@needs_dask
@pytest.mark.slow
def test_a_cluster_that_loses_a_worker_gives_the_local_result_to_the_bit(mariner_card: ManoeuvringCard) -> None:
    draws, _ = draws_of(mariner_card, 11)
    question = OfManoeuvre(ShipText.of(mariner_card), Turn(np.radians(20.0)), 600.0, np.linspace(0, 600, 31))
    here = ensemble(question, draws, 150)
    with cluster() as (address, workers), executing(f"dask://{address}") as executor:
        there = ensemble(question, draws, 150, Killing(executor, workers[0]), batch=3)
        assert workers[0].wait(10) != 0, "the worker was killed"
    np.testing.assert_array_equal(there.figures["advance_m"], here.figures["advance_m"])
    assert set(there.figures) == set(here.figures) and there.unusable == here.unusable
    np.testing.assert_array_equal(there.histories, here.histories)


class Killing(Executor):
    """An executor one of whose workers is killed when the third result is in."""

    def __init__(self, executor: Executor, worker: subprocess.Popen[bytes]):
        self.executor, self.worker = executor, worker

    def map(self, work, *tasks, **more):
        for number, result in enumerate(self.executor.map(work, *tasks, **more)):
            if number == 2:
                self.worker.kill()
            yield result


def free_port() -> int:
    with socket.socket() as one:
        one.bind(("127.0.0.1", 0))
        return int(one.getsockname()[1])


@contextmanager
def cluster() -> Iterator[tuple[str, list[subprocess.Popen[bytes]]]]:
    """A scheduler and two workers as processes on the loopback; its address, and the workers."""
    address = f"127.0.0.1:{free_port()}"
    env = os.environ | {"DASK_DISTRIBUTED__WORKER__DAEMON": "False"}
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL, "env": env}
    dask = [sys.executable, "-m", "distributed.cli.dask_scheduler", "--host", "127.0.0.1"]
    started = [subprocess.Popen([*dask, "--port", address.rpartition(":")[2], "--dashboard-address", ":0"], **quiet)]
    worker = [sys.executable, "-m", "distributed.cli.dask_worker", f"tcp://{address}", "--host", "127.0.0.1"]
    worker += ["--nthreads", "1", "--no-nanny", "--no-dashboard", "--death-timeout", "60"]
    workers = [subprocess.Popen(worker, **quiet) for _ in range(2)]
    try:
        _wait_for_two(address)
        yield address, workers
    finally:
        for process in (*workers, *started):
            process.kill()
            process.wait()


def _wait_for_two(address: str) -> None:
    from distributed import Client

    until = time.monotonic() + 60
    with Client(f"tcp://{address}", timeout="60s") as client:
        while len(client.scheduler_info()["workers"]) < 2:
            assert time.monotonic() < until, "two workers have begun"
            time.sleep(0.1)
