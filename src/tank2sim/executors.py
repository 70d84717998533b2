"""Where long work is done: in processes of this machine, or on a Dask cluster.

Both are a :class:`concurrent.futures.Executor`; what is computed does not depend on which of them computes it.
"""

from __future__ import annotations

import importlib
import importlib.util
import multiprocessing
import multiprocessing.util
import os
import re
import signal
import sys
import threading
import warnings
from collections.abc import Iterator
from concurrent.futures import Executor, ProcessPoolExecutor
from contextlib import contextmanager

from tank2sim.arguments import PROCESSES
from tank2sim.cluster import connected, working_for_another
from tank2sim.errors import ArgumentError
from tank2sim.memory import keep_freed_memory
from tank2sim.plugins import PluginWarning

EXECUTOR_FORMS = f"{PROCESSES}, or dask://host:port"


def check_executor(text: str) -> str:
    """The text of the option, if it is one of :data:`EXECUTOR_FORMS` and can be used here.

    Raises
    ------
    InputError
        It is none of them, or Dask is not installed.
    """
    if text == PROCESSES:
        return text
    if not re.fullmatch(r"dask://[^/\s:]+:\d{1,5}|dask://\[[0-9a-fA-F:]+\]:\d{1,5}", text):
        raise ArgumentError("executor", "", f"{text!r} is not an executor", f"give {EXECUTOR_FORMS}")
    if importlib.util.find_spec("distributed") is None:
        problem = "Dask, which a cluster needs, is not installed"
        raise ArgumentError("executor", "", problem, "pip install 'tank2sim[dask]', or leave executor out")
    return text


@contextmanager
def executing(text: str = PROCESSES, workers: int | None = None) -> Iterator[Executor]:
    """The executor that an option names, for the time of a ``with``.

    Parameters
    ----------
    text : str
        One of :data:`EXECUTOR_FORMS`.
    workers : int, optional
        Processes; by default as many as there are processors. A cluster has those that it has.

    Raises
    ------
    InputError
        As :func:`check_executor`; what :func:`tank2sim.cluster.connected` says.
    """
    making = _processes(workers) if check_executor(text) == PROCESSES else connected(text)
    with making as executor:
        yield executor


@contextmanager
def executing_beside(text: str, workers: int | None, module: str) -> Iterator[Executor | None]:
    """As :func:`executing`, for work next to this process; None where all of it is to be done in this one.

    Parameters
    ----------
    text : str
        One of :data:`EXECUTOR_FORMS`.
    workers : int, optional
        Processes, as in :func:`processes_to_begin`.
    module : str
        Name of a module that the processes of this machine import while they wait for work.

    Raises
    ------
    InputError
        As :func:`executing`.
    """
    local, number = check_executor(text) == PROCESSES, processes_to_begin(workers)
    if local and number == 1:
        yield None
        return
    with executing(text, number) as executor:
        for _ in range(number if local else 0):
            executor.submit(importlib.import_module, module)
        yield executor


def processes_to_begin(workers: int | None = None) -> int:
    """As many as were asked for, by default one for each processor; 1 in work that is itself handed to an executor.

    That one keeps the other processors busy, and a worker of Dask may begin no processes.
    """
    if multiprocessing.parent_process() is not None or working_for_another():
        return 1
    return workers or os.cpu_count() or 1


class _Process(multiprocessing.context.SpawnProcess):
    """A process that does not run the user's script again: all that it computes is in packages that it can import."""

    _starting = threading.Lock()  # the main module belongs to all threads

    def start(self) -> None:
        """Start it while the main module has no name and no file by which the new process would run it."""
        with self._starting:
            main = sys.modules["__main__"]
            kept = {name: getattr(main, name) for name in ("__spec__", "__file__") if hasattr(main, name)}
            for name in kept:
                setattr(main, name, None)
            try:
                super().start()
            finally:
                for name, value in kept.items():
                    setattr(main, name, value)


class _Context(multiprocessing.context.SpawnContext):
    Process = _Process


@contextmanager
def _processes(workers: int | None) -> Iterator[Executor]:
    """Processes that are started from nothing, as threads may be at work in this one."""
    context = _Context()
    before = set(multiprocessing.active_children())
    with ProcessPoolExecutor(workers or os.cpu_count(), context, _prepare) as pool:
        try:
            yield pool
        except BaseException:
            # Who stops a run does not wait for work of minutes whose results nobody will fetch.
            pool.shutdown(wait=False, cancel_futures=True)
            for process in set(multiprocessing.active_children()) - before:
                process.terminate()
            raise


def _end() -> None:
    """End a process that has done its work, without taking its modules apart: its owner waits for it."""
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(0)


def _prepare() -> None:
    """Prepare a process for work.

    An interrupt is for the one that began it alone: workers that received it, too, would each report it. A worker that
    is busy for minutes does not outlive, unseen, the one that began it and was killed.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    multiprocessing.util.Finalize(None, _end, exitpriority=-1)
    keep_freed_memory()
    warnings.simplefilter("ignore", PluginWarning)  # the process that began it has printed them
    import scipy.linalg  # noqa: F401  loads the libraries whose threads are limited: each processor has its process
    from threadpoolctl import threadpool_limits

    threadpool_limits(limits=1, user_api="blas")
    parent = multiprocessing.parent_process()
    assert parent is not None

    def watch() -> None:
        parent.join()
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()
