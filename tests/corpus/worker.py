"""A process that runs commands one after the other, so that none of them costs an import; killed when one hangs."""

from __future__ import annotations

import contextlib
import io
import multiprocessing
import os
import shutil
import signal
import sys
import tempfile
import warnings
from dataclasses import dataclass, field
from multiprocessing.connection import Connection
from pathlib import Path
from unittest import mock

MEMORY = 2 << 30
"""Bytes a command may take on top of the program itself; more is refused by the system, and shows as a MemoryError."""
PATIENCE_S = 60.0


@dataclass(frozen=True)
class Job:
    """A command, the files it finds in its folder, and those among them that were changed."""

    command: str
    number: int
    arguments: list[str]
    files: dict[str, bytes]
    changed: str
    words: str
    exits: tuple[int, ...] = (0, 2)
    keeps: str = ""

    def __str__(self) -> str:
        return f"{self.command} {self.number}: {self.changed}: {self.words}"


@dataclass(frozen=True)
class Outcome:
    code: int | None
    error: str = ""
    screen: str = ""
    written: list[str] = field(default_factory=list)
    peak: int = 0
    seconds: float = 0.0
    kept: bytes | None = None


class Worker:
    """Runs jobs in a process of its own; one that hangs or dies is replaced."""

    def __init__(self) -> None:
        self._process: multiprocessing.process.BaseProcess | None = None
        self._pipe: Connection | None = None

    def run(self, job: Job) -> Outcome:
        if self._process is None:
            context = multiprocessing.get_context("spawn")
            self._pipe, end = context.Pipe()
            self._process = context.Process(target=_serve, args=(end,))
            self._process.start()
            end.close()
        assert self._pipe is not None
        self._pipe.send(job)
        if not self._pipe.poll(PATIENCE_S + (60 if not self._warm else 0)):
            self.close()
            return Outcome(None, error=f"hangs: {PATIENCE_S:g} s are over")
        try:
            outcome: Outcome = self._pipe.recv()
        except EOFError:
            self._process.join()
            died = self._process.exitcode
            self.close()
            return Outcome(None, error=f"the process died ({died})")
        self._warm = True
        if outcome.peak > MEMORY:  # what a process once took it may keep, and the next job would be blamed for it
            self.close()
        return outcome

    _warm = False

    def close(self) -> None:
        if self._process is not None and self._process.pid is not None:
            with contextlib.suppress(ProcessLookupError):
                os.killpg(self._process.pid, signal.SIGKILL)
            self._process.kill()
            self._process.join()
        self._process = self._pipe = None
        self._warm = False


def _serve(pipe: Connection) -> None:
    os.setsid()
    screen = tempfile.TemporaryFile()  # noqa: SIM115
    os.dup2(screen.fileno(), 2)  # what libraries print past Python is on the user's screen, too
    with contextlib.suppress(EOFError):
        while True:
            job = pipe.recv()
            begin = os.fstat(screen.fileno()).st_size
            outcome = _run(job)
            screen.seek(begin)
            pipe.send(Outcome(**{**vars(outcome), "screen": screen.read().decode("utf-8", "replace")}))


def _run(job: Job) -> Outcome:
    import resource  # which other systems than Linux lack, or count otherwise
    import time

    from tank2sim.cli import main

    resource.setrlimit(resource.RLIMIT_DATA, (_status("VmData") + MEMORY, resource.RLIM_INFINITY))
    Path("/proc/self/clear_refs").write_text("5")  # the peak of the memory begins again
    out, err = io.StringIO(), io.StringIO()
    folder = Path(tempfile.mkdtemp(prefix="corpus-"))
    code: object = None
    begin = time.monotonic()
    try:
        for name, content in job.files.items():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            (folder / name).write_bytes(content)
        with contextlib.ExitStack() as stack:
            stack.enter_context(contextlib.chdir(folder))
            stack.enter_context(mock.patch.object(sys, "argv", ["tank2sim", job.command, *job.arguments]))
            stack.enter_context(contextlib.redirect_stdout(out))
            stack.enter_context(contextlib.redirect_stderr(err))
            stack.enter_context(_warnings_as_in_a_new_process())
            try:
                main()
            except SystemExit as end:
                code = end.code
        written = [
            path.name for path in folder.iterdir() if path.name not in {name.split("/")[0] for name in job.files}
        ]
        kept = (folder / job.keeps).read_bytes() if job.keeps and (folder / job.keeps).exists() else None
        error = err.getvalue()
        if "a fault of the program" in error:
            log = error.strip().rpartition(" ")[2]
            with contextlib.suppress(OSError):
                error += "".join(Path(log).read_text().splitlines(True)[-9:])
    finally:
        shutil.rmtree(folder, ignore_errors=True)
    peak = _status("VmHWM")
    return Outcome(
        code if isinstance(code, int) else None, error, "", sorted(written), peak, time.monotonic() - begin, kept
    )


def _status(key: str) -> int:
    """Bytes that the system reports of this process: VmData, what RLIMIT_DATA counts; VmHWM, its peak in memory."""
    for line in Path("/proc/self/status").read_text().splitlines():
        if line.startswith(f"{key}:"):
            return int(line.split()[1]) * 1024
    raise OSError(f"/proc/self/status has no {key}")


@contextlib.contextmanager
def _warnings_as_in_a_new_process():  # type: ignore[no-untyped-def]
    """Each warning once a command, not once a process; those that Python hides by default stay hidden."""
    with warnings.catch_warnings():
        warnings.simplefilter("always")
        for hidden in (DeprecationWarning, PendingDeprecationWarning, ImportWarning, ResourceWarning):
            warnings.simplefilter("ignore", hidden)
        yield
