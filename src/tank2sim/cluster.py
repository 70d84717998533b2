"""A Dask cluster as a :class:`concurrent.futures.Executor`: machines that share no file with this one.

Work goes there as it would go to another process of this machine: a function of a module and its arguments, pickled
here and opened there, and its result likewise, so that Dask neither looks into them nor changes them.
"""

from __future__ import annotations

import hashlib
import logging
import pickle
import sys
import time
import warnings
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import Executor, Future, wait
from contextlib import contextmanager, suppress
from functools import cache, partial
from importlib.metadata import version
from pathlib import Path
from threading import Event, Lock, Thread
from typing import TYPE_CHECKING, Any, TypeVar

from tank2sim.errors import ArgumentError, InputError
from tank2sim.version import __version__

if TYPE_CHECKING:
    from distributed import Client
    from distributed import Future as Remote

_Result = TypeVar("_Result")

ANSWERS_WITHIN_S = 10.0
"""A scheduler that has not answered by then is taken to be none (project choice)."""

PATIENCE_S = 30.0
"""A cluster without workers, or whose scheduler is silent, is given up after this long: a worker that its nanny starts
again is back in a few seconds (project choice)."""

LOOKS_EVERY_S = 1.0
"""How often the cluster is asked whether it has workers (project choice)."""

_COMPUTING = ("numpy", "scipy", "casadi")
"""Packages on whose version the digits of a result depend."""

_NOT_SENT = ("_bundled/", "cli/", "demo/", "report/")
"""Parts of tank2sim that compute nothing, and may differ; a checkout has what is bundled in another place."""


@cache
def installed() -> dict[str, str]:
    """Packages that results depend on and that every worker must have in the same version."""
    digest = hashlib.sha256()
    folder = Path(__file__).parent
    code = (path for path in folder.rglob("*") if path.suffix in (".py", ".c"))
    sources = {path.relative_to(folder).as_posix(): path for path in code}
    for name in sorted(sources):
        if not name.startswith(_NOT_SENT):
            digest.update(name.encode() + sources[name].read_bytes().replace(b"\r\n", b"\n"))
    versions = {
        "Python": "{}.{}".format(*sys.version_info),
        "tank2sim": f"{__version__} (source {digest.hexdigest()[:8]})",
    }
    return versions | {name: version(name) for name in _COMPUTING}


@contextmanager
def connected(text: str) -> Iterator[Executor]:
    """The cluster whose scheduler is at ``dask://host:port``, for the time of a ``with``.

    When it is left, nothing of versions waits at the scheduler any more.

    Raises
    ------
    InputError
        No scheduler answers there; it has no workers; one of them has other versions than are installed here.
        While it works: scheduler or workers were lost for good.
    """
    with _silent():
        client = _client(text)
        cluster = Cluster(client, text)
        try:
            cluster.refuse_others()
            yield cluster
        finally:
            cluster.shutdown()


class Cluster(Executor):
    """A task is done by any worker, and again by another one if the first is lost.

    Parameters
    ----------
    client : distributed.Client
        Closed by :meth:`shutdown`.
    text : str
        How the user named the cluster.

    Attributes
    ----------
    wanted : dict
        Versions that workers must have.
    """

    def __init__(self, client: Client, text: str):
        self._client, self._text, self.wanted = client, text, installed()
        self._waiting: dict[Future[Any], Remote] = {}
        self._lock, self._ended = Lock(), Event()
        Thread(target=self._watch, daemon=True).start()

    def refuse_others(self) -> None:
        """Raise InputError if there are no workers, or one of them has other versions than are `wanted`."""
        if not self._client.scheduler_info()["workers"]:
            problem = f"the scheduler at {self._text} has no workers"
            raise ArgumentError("executor", "", problem, "start some with `dask worker host:port`")
        try:
            replies = _within(PATIENCE_S, lambda: self._client.run(installed, on_error="return"))
        except (OSError, TimeoutError):  # one does not answer now; each is asked again before it works
            return
        for address, found in replies.items():
            if not isinstance(found, OSError):  # such a one has just gone, and another may come
                _refuse_other(found if isinstance(found, dict) else {}, self.wanted, address)

    def submit(self, fn: Callable[..., _Result], /, *args: Any, **kwargs: Any) -> Future[_Result]:
        """As of any executor; raises InputError where the scheduler was lost."""
        if self._client.status == "closed":
            raise self._lost()
        promised: Future[_Result] = Future()
        task = pickle.dumps((fn, args, kwargs))
        with warnings.catch_warnings():
            warnings.filterwarnings("ignore", message="Sending large graph")
            remote = self._client.submit(_run_on_worker, self.wanted, task, pure=False)
        with self._lock:
            self._waiting[promised] = remote
        promised.add_done_callback(self._forget)
        remote.add_done_callback(partial(self._arrived, promised))
        return promised

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """Takes back what is not done, whatever is asked: at the end of a ``with`` nobody waits for it any more."""
        self._ended.set()
        with self._lock:
            remotes = list(self._waiting.values())
            self._waiting.clear()
        with suppress(Exception):  # it may be gone
            if remotes and self._client.status == "running":
                self._client.cancel(remotes, force=True)
        with suppress(Exception):
            self._client.close(timeout=ANSWERS_WITHIN_S)

    def _arrived(self, promised: Future[Any], remote: Remote) -> None:
        try:
            task_output = self._gathered(remote)
            if task_output is None:
                return
            result = pickle.loads(task_output)
        except BaseException as error:
            failure = self._explained(error, lost=remote.cancelled() or self._client.status != "running")
            self._settle(promised, lambda: promised.set_exception(failure))
        else:
            self._settle(promised, lambda: promised.set_result(result))

    def _gathered(self, remote: Remote) -> bytes | None:
        """The output of a finished task; None after the shutdown.

        `remote.result()` would wait for ever if the client's event loop is stopped in the meantime, and keep the
        interpreter from ending: the thread of Dask's callbacks is joined at the exit.
        """
        import asyncio  # slow to import

        coroutine = self._client.gather(remote, asynchronous=True)
        try:
            gathering = asyncio.run_coroutine_threadsafe(coroutine, self._client.loop.asyncio_loop)
        except RuntimeError:  # the loop is closed
            coroutine.close()
            raise
        while not wait([gathering], timeout=LOOKS_EVERY_S).done:
            if self._ended.is_set():
                gathering.cancel()
                return None
        data: bytes = gathering.result()
        return data

    def _settle(self, promised: Future[Any], settle: Callable[[], None]) -> None:
        """Once: by its result, or by the watch."""
        with self._lock:
            known = self._waiting.pop(promised, None) is not None
        if known and promised.set_running_or_notify_cancel():
            settle()

    def _forget(self, promised: Future[Any]) -> None:
        with self._lock:
            remote = self._waiting.pop(promised, None)
        if remote is not None and not self._ended.is_set():
            remote.cancel()

    def _watch(self) -> None:
        """Dask would wait for ever for workers that do not come back."""
        well = time.monotonic()
        while not self._ended.wait(LOOKS_EVERY_S):
            trouble = self._trouble() if self._waiting else ""
            if not trouble:
                well = time.monotonic()
            elif time.monotonic() - well > PATIENCE_S:
                with self._lock:
                    waiting = list(self._waiting)
                for promised in waiting:
                    error = ArgumentError("executor", "", trouble, "correct the cluster, or leave executor out")
                    self._settle(promised, partial(promised.set_exception, error))

    def _trouble(self) -> str:
        """The reason why the cluster cannot work now, if any."""
        try:
            workers = self._client.sync(self._client.scheduler.ncores, callback_timeout=ANSWERS_WITHIN_S)
        except Exception:  # whatever a broken connection raises
            return f"the scheduler at {self._text} has not answered for {PATIENCE_S:g} s"
        return "" if workers else f"all workers of {self._text} are lost, and none has come for {PATIENCE_S:g} s"

    def _explained(self, error: BaseException, *, lost: bool) -> BaseException:
        from distributed.scheduler import KilledWorker

        if isinstance(error, KilledWorker):
            problem = "one piece of work was lost with worker after worker"
            return ArgumentError("executor", "", problem, "see what their logs say; perhaps each has too little memory")
        return self._lost() if lost else error

    def _lost(self) -> InputError:
        problem = f"the scheduler at {self._text} was lost during the work"
        return ArgumentError("executor", "", problem, "start it and its workers again, or leave executor out")


_SINGLE_TASK = Lock()
"""In a worker, whose threads share what is kept from task to task, and the symbols of CasADi."""


def working_for_another() -> bool:
    """Whether this process is a worker that is at work for some client."""
    return _SINGLE_TASK.locked()


def _run_on_worker(wanted: Mapping[str, str], task: bytes) -> bytes:
    from distributed import get_worker

    _refuse_other(installed(), wanted, get_worker().address)
    with _SINGLE_TASK:
        fn, args, kwargs = pickle.loads(task)
        return pickle.dumps(fn(*args, **kwargs))


def _client(text: str) -> Client:
    from distributed import Client  # seldom asked for, and no part of every installation

    address = f"tcp://{text.removeprefix('dask://')}"
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of other versions; those that matter are reported below
            # A listener that is not a scheduler may keep Dask waiting longer than it was asked to.
            return _within(
                2 * ANSWERS_WITHIN_S, lambda: Client(address, timeout=ANSWERS_WITHIN_S, set_as_default=False)
            )
    except (OSError, TimeoutError, ValueError):
        problem, remedy = f"no scheduler answers at {text}", "start one there with `dask scheduler`"
        raise ArgumentError("executor", "", problem, f"{remedy}, or leave executor out") from None


def _refuse_other(theirs: Mapping[str, str], versions: Mapping[str, str], address: str) -> None:
    for name, wanted in versions.items():
        if theirs.get(name) != wanted:
            problem = f"has {name} {theirs[name]}, but here it is {wanted}" if name in theirs else f"lacks this {name}"
            raise ArgumentError(
                "executor", f"worker {address}", problem, "install the same on both, and start the worker again"
            )


def _within(seconds: float, make: Callable[[], _Result]) -> _Result:
    """Result (or error) of `make`; TimeoutError if it does neither in that time."""
    promised: Future[_Result] = Future()

    def work() -> None:
        try:
            promised.set_result(make())
        except BaseException as error:
            promised.set_exception(error)

    Thread(target=work, daemon=True).start()
    return promised.result(seconds)


@contextmanager
def _silent() -> Iterator[None]:
    """Dask reports each broken connection on the error stream; tank2sim reports what the user needs to know of it."""
    import distributed  # noqa: F401 - it sets up its loggers when it is imported

    trees = ("distributed", "tornado", "asyncio")
    names = {*trees, *(name for name in logging.root.manager.loggerDict if name.startswith(trees))}
    before = {name: logging.getLogger(name).level for name in names}
    for name in names:
        logging.getLogger(name).setLevel(logging.CRITICAL + 1)
    try:
        yield
    finally:
        for name, level in before.items():
            logging.getLogger(name).setLevel(level)
