"""The whole way on bundled data, as a result."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from tank2sim.answer.parts import Table
from tank2sim.api.bounds import checked
from tank2sim.api.result import OldResult
from tank2sim.demo import PAGE
from tank2sim.files import writable_folder
from tank2sim.native.compiler import require_compiler


class DemoResult(OldResult):
    """A folder with the demo: cards, FMUs, simulated trials and a page that shows them.

    Parameters
    ----------
    folder : Path
    values : mapping
        Figures of both halves, and the names of the files.
    """

    command = "demo"
    notices = ()

    def __init__(self, folder: Path, values: Mapping[str, Any]) -> None:
        self.folder, self._values = folder, values

    @property
    def path(self) -> Path:
        """The page."""
        return self.folder / PAGE

    @property
    def files(self) -> tuple[Path, ...]:
        """All files that were written."""
        return tuple(self.folder / str(name) for name in self._values["files"])

    def content(self) -> Mapping[str, object]:
        """As :meth:`.OldResult.content`."""
        return self._values

    @property
    def headline(self) -> tuple[str, ...]:
        """Path of the page and number of files."""
        return (f"{self.path}: the page that shows it all, next to {len(self.files) - 1} files",)

    @property
    def tables(self) -> tuple[Table, ...]:
        """None: the page has them."""
        return ()

    def page(self) -> str:
        """The page that was written."""
        return self.path.read_text(encoding="utf-8")


@checked
def run_demo(folder: str | Path = "demo", *, report: Callable[[str], None] = lambda _: None) -> DemoResult:
    """Go the whole way on bundled data: tows to an FMU, the Mariner to checked FMUs, and a page that shows both.

    Parameters
    ----------
    folder : path
        Where the files go; made if it does not exist.
    report : callable
        Called with the step that begins.

    Raises
    ------
    InputError
        No C compiler is found, or a file cannot be written.
    """
    require_compiler("the demo")
    written = writable_folder(Path(folder))
    from tank2sim.demo.run import write_demo  # drawing and control: seconds

    return DemoResult(written, write_demo(written, report))
