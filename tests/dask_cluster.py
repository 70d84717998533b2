"""A Dask cluster on the loopback: a scheduler, and workers that share neither folder nor environment with the tests."""

from __future__ import annotations

import os
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from concurrent.futures import Executor, Future
from contextlib import contextmanager
from pathlib import Path
from typing import Any

WITHIN_S = 60.0


class LoopbackCluster:
    """A scheduler and workers, each a process with a folder of its own."""

    def __init__(self, folder: Path):
        self.folder, self.number = folder, 0
        self.address = f"127.0.0.1:{free_port()}"
        port = self.address.rpartition(":")[2]
        self.scheduler = self._begin("scheduler", "--port", port, "--dashboard-address", ":0")
        self.workers: list[subprocess.Popen[bytes]] = []

    @property
    def option(self) -> str:
        """For ``--executor``."""
        return f"dask://{self.address}"

    def with_workers(self, count: int) -> LoopbackCluster:
        """Itself, once so many workers are there; those that were killed are replaced."""
        from distributed import Client

        self.workers = [one for one in self.workers if one.poll() is None]
        while len(self.workers) < count:
            more = "--nthreads", "1", "--no-nanny", "--no-dashboard", "--death-timeout", "60"
            self.workers.append(self._begin("worker", f"tcp://{self.address}", *more))
        with Client(f"tcp://{self.address}", timeout=WITHIN_S, set_as_default=False) as client:
            until = time.monotonic() + WITHIN_S
            while len(client.scheduler_info()["workers"]) != count:
                assert time.monotonic() < until, f"{count} workers are there"
                time.sleep(0.1)
        return self

    def kill_workers(self) -> None:
        """All of them, at once."""
        for one in self.workers:
            one.kill()

    def end(self) -> None:
        """Leave no process behind."""
        for one in (*self.workers, self.scheduler):
            one.kill()
            one.wait()

    def _begin(self, what: str, *options: str) -> subprocess.Popen[bytes]:
        self.number += 1
        home = self.folder / f"{what} {self.number}"
        home.mkdir(parents=True)
        # OPENBLAS_*: another core type adds in another order, and the last bits of sums differ.
        kept = {
            name: text
            for name, text in os.environ.items()
            if name in ("PATH", "PYTHONPATH", "SYSTEMROOT", "TMPDIR") or name.startswith("OPENBLAS_")
        }
        env = kept | {"HOME": str(home), "XDG_CACHE_HOME": str(home / "cache"), "OPENBLAS_NUM_THREADS": "1"}
        command = [sys.executable, "-m", f"distributed.cli.dask_{what}", *options, "--host", "127.0.0.1"]
        # No pipe: nobody would read it, and a full one would stop the process.
        with (home / "log").open("wb") as log:
            return subprocess.Popen(command, cwd=home, env=env, stdout=log, stderr=log)


@contextmanager
def loopback_cluster(folder: Path) -> Iterator[LoopbackCluster]:
    """A cluster with no workers yet, for the time of a ``with``."""
    cluster = LoopbackCluster(folder)
    try:
        yield cluster
    finally:
        cluster.end()


class Killing(Executor):
    """An executor one of whose workers is killed when so many results are in."""

    def __init__(self, executor: Executor, worker: subprocess.Popen[bytes], after: int):
        self.executor, self.worker, self.left = executor, worker, after

    def submit(self, fn: Any, /, *args: Any, **kwargs: Any) -> Future[Any]:
        future = self.executor.submit(fn, *args, **kwargs)
        future.add_done_callback(self._count)
        return future

    def _count(self, future: Future[Any]) -> None:
        self.left -= 1
        if self.left == 0:
            self.worker.kill()


def free_port() -> int:
    """One that nothing listened at a moment ago."""
    with socket.socket() as one:
        one.bind(("127.0.0.1", 0))
        return int(one.getsockname()[1])
