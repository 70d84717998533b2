"""Result of ``demo``: the whole way on bundled data."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

from tank2sim.answer.parts import Cell, Section, table
from tank2sim.answer.result import Result
from tank2sim.apps.demo import PAGE


@dataclass(frozen=True)
class DemoStudy:
    """The demonstration: figures of its two halves, and the files that it wrote."""

    towed_vehicle: dict[str, Any]
    mariner: dict[str, Any]
    files: tuple[str, ...]


@dataclass(frozen=True, eq=False, repr=False)
class DemoResult(Result[DemoStudy]):
    """A folder with the demo: cards, FMUs, simulated trials and a page that shows them.

    Parameters
    ----------
    study : DemoStudy
    folder : Path
        Where the files are.
    """

    study: DemoStudy
    folder: Path = Path()
    command: ClassVar[str] = "demo"

    @property
    def path(self) -> Path:
        """The page."""
        return self.folder / PAGE

    @property
    def files(self) -> tuple[Path, ...]:
        """All files that were written."""
        return tuple(self.folder / name for name in self.study.files)

    @property
    def title(self) -> str:
        """The way."""
        return "From tests to a checked simulator"

    @property
    def headline(self) -> tuple[str, ...]:
        """Path of the page and number of files."""
        return (f"{self.path}: the page that shows it all, next to {len(self.study.files) - 1} files",)

    @property
    def sections(self) -> Sequence[Section]:
        """The files."""
        rows: list[list[Cell]] = [[name] for name in self.study.files]
        return [Section("Files", tables=[table("Files", ["file"], rows, on_screen=False)])]

    def page(self) -> str:
        """The page that was written."""
        return self.path.read_text(encoding="utf-8") if self.path.is_file() else super().page()
