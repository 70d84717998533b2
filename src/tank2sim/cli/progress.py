"""Progress of long work on the screen, and where it is to stop."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from rich.console import Console
from rich.progress import Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

from tank2sim.arrays import Array

if TYPE_CHECKING:  # the identification takes long to import, and most commands do without
    from tank2sim.identification.trials.problem.estimation_problem import SearchReport


@contextmanager
def showing_progress(what: str) -> Iterator[SearchReport]:
    """A line that says how far a search is, on the error stream and only where that is a terminal."""
    with showing_stages(what) as show:
        steps = 0

        def report(stage: str, values: Array, cost: float) -> None:
            nonlocal steps
            steps += 1
            show(f"{stage}: step {steps}, cost {cost:.6g} (Ctrl-C keeps the best so far)")

        yield report


@contextmanager
def showing_stages(what: str) -> Iterator[Callable[[str], None]]:
    """A line that says what is being done, and for how long; shown as that of :func:`showing_progress`."""
    columns = SpinnerColumn(), TextColumn("{task.description}", markup=False), TimeElapsedColumn()
    console = Console(stderr=True)
    with Progress(*columns, console=console, transient=True, disable=not console.is_terminal) as bar:
        task = bar.add_task(what, total=None)

        def report(stage: str) -> None:
            bar.update(task, description=stage)

        yield report
