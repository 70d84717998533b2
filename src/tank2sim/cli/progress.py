"""Progress of long work on the screen, and where it is to stop."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

from tank2sim.dynamics.model import Vector
from tank2sim.identification.trials.problem import Progress as Told


@contextmanager
def showing_progress(what: str) -> Iterator[Told]:
    """A line that says how far a search is, on the error stream and only where that is a terminal."""
    columns = SpinnerColumn(), TextColumn("{task.description}"), TimeElapsedColumn()
    console = Console(stderr=True)
    with Progress(*columns, console=console, transient=True, disable=not console.is_terminal) as bar:
        task = bar.add_task(what, total=None)
        steps = 0

        def told(stage: str, values: Vector, cost: float) -> None:
            nonlocal steps
            steps += 1
            bar.update(task, description=f"{stage}: step {steps}, cost {cost:.6g} (Ctrl-C keeps the best so far)")

        yield told
