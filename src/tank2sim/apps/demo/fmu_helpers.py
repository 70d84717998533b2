"""Shared by both halves of the demo: where files go, how progress is reported, and how a checked FMU is made."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from tank2sim.answer.charts.analysis import OutputError
from tank2sim.answer.numbers import format_number
from tank2sim.answer.parts import KeyFigure, Section
from tank2sim.cards import Card
from tank2sim.dynamics import Model
from tank2sim.dynamics.simulator_interface import with_simulator_interface
from tank2sim.errors import InputError
from tank2sim.files import write_whole
from tank2sim.fmu.check import CheckReport, compare_with_model
from tank2sim.fmu.export import write_fmu
from tank2sim.fmu.provenance import documents_of


@dataclass(frozen=True)
class DemoOutcome:
    """Results of a half of the demo: key figures and sections for the page, and the same as plain data."""

    figures: Sequence[KeyFigure]
    sections: Sequence[Section]
    result: dict[str, object]


@dataclass
class Workshop:
    """A folder in which files appear whole, one after the other.

    Parameters
    ----------
    folder : Path
        An existing folder.
    begin : callable
        Called with a few words at the beginning of each step.
    """

    folder: Path
    begin: Callable[[str], None]
    files: list[str] = field(default_factory=list)

    def write(self, name: str, content: str | bytes) -> Path:
        """Write a file of the demo."""
        path = self.folder / name
        write_whole(path, content)
        self.files.append(name)
        return path

    def checked_fmu(self, card: Card, model: Model, name: str, fmi: int) -> tuple[Path, CheckReport]:
        """Export a model and check the file against it.

        Raises
        ------
        InputError
            The FMU differs from the model, or is not valid: the demo would show something untrue.
        """
        path, model = self.folder / f"{name}-fmi{fmi}.fmu", with_simulator_interface(model)
        self.begin(f"{path.name}: exporting")
        write_fmu(model, path, fmi=fmi, documents=documents_of(card))
        self.files.append(path.name)
        self.begin(f"{path.name}: checking")
        report = compare_with_model(path, model=model)
        if not report.passed:
            what = "; ".join((*report.validation, *report.differences)) or f"errors {report.max_error}"
            raise InputError(
                path, "", f"is not what it was made from: {what}", "report this, with your platform and compiler"
            )
        return path, report


def demo_output_errors(reports: Sequence[CheckReport]) -> list[OutputError]:
    """Errors of checked FMUs as the chart of errors takes them."""
    short = {"ModelExchange": "ME", "CoSimulation": "CS"}
    return [
        OutputError(kind=f"FMI {report.fmi} {short[kind]}", output=name, error=error, limit=report.limits[kind])
        for report in reports
        for kind, errors in report.errors.items()
        for name, error in errors.items()
    ]


def error_words(error: float) -> str:
    """A relative error for a reader."""
    return format_number(error, 2) if error else "no difference"


def largest_error(reports: Sequence[CheckReport], kind: str) -> float:
    """Largest relative error of any output in one kind, over several FMUs."""
    return max(error for report in reports for error in report.errors[kind].values())  # type: ignore[index]
