"""Where long work is done: in processes of this machine, or on a Dask cluster.

Both are a :class:`concurrent.futures.Executor`; what is computed does not depend on which of them computes it.
"""

from __future__ import annotations

import importlib.util
import multiprocessing
import os
import re
import signal
from collections.abc import Iterator
from concurrent.futures import Executor, ProcessPoolExecutor
from contextlib import contextmanager

from tank2sim.errors import InputError

PROCESSES = "processes"
FORMS = f"{PROCESSES}, or dask://host:port"
OPTION = "--executor"

_ANSWERS_WITHIN = "10s"
"""A scheduler that has not answered by then is taken to be none (a choice of ours)."""


def check_executor(text: str) -> str:
    """The text of the option, if it is one of :data:`FORMS` and can be used here.

    Raises
    ------
    InputError
        It is none of them, or Dask is not installed.
    """
    if text == PROCESSES:
        return text
    if not re.fullmatch(r"dask://[^/\s:]+:\d{1,5}|dask://\[[0-9a-fA-F:]+\]:\d{1,5}", text):
        raise InputError(OPTION, "", f"{text!r} is no executor", f"give {FORMS}")
    if importlib.util.find_spec("distributed") is None:
        problem = "Dask, which a cluster needs, is not installed"
        raise InputError(OPTION, "", problem, "pip install 'tank2sim[dask]', or leave the option out")
    return text


@contextmanager
def executing(text: str = PROCESSES, workers: int | None = None) -> Iterator[Executor]:
    """The executor that an option names, for the time of a ``with``.

    Parameters
    ----------
    text : str
        One of :data:`FORMS`.
    workers : int, optional
        Processes; by default as many as there are processors. A cluster has those that it has.

    Raises
    ------
    InputError
        As :func:`check_executor`; no scheduler answers there, or it has no workers.
    """
    making = _processes(workers) if check_executor(text) == PROCESSES else _cluster(text)
    with making as executor:
        yield executor


@contextmanager
def _processes(workers: int | None) -> Iterator[Executor]:
    """Processes that begin anew, as threads may be at work in this one."""
    context = multiprocessing.get_context("spawn")
    # An interrupt is for this process alone: workers that were told of it, too, would each say so.
    with ProcessPoolExecutor(
        workers or os.cpu_count(), context, signal.signal, (signal.SIGINT, signal.SIG_IGN)
    ) as pool:
        try:
            yield pool
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise


@contextmanager
def _cluster(text: str) -> Iterator[Executor]:
    from distributed import Client  # seldom asked for, and no part of every installation

    try:
        client = Client(f"tcp://{text.removeprefix('dask://')}", timeout=_ANSWERS_WITHIN)
    except (OSError, TimeoutError, ValueError):
        problem = f"no scheduler answers at {text}"
        raise InputError(
            OPTION, "", problem, "start one there with `dask scheduler`, or leave the option out"
        ) from None
    with client:
        if not client.scheduler_info()["workers"]:
            problem = f"the scheduler at {text} has no workers"
            raise InputError(OPTION, "", problem, "start some with `dask worker host:port`")
        # Not `with`: when it is left by an error, that would wait for all that is under way.
        yield client.get_executor()
