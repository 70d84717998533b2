"""Results of ``export`` and ``check``: an FMU that was made, and one that was compared with its card."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import ClassVar

from tank2sim.answer.charts.analysis import OutputError, error_chart
from tank2sim.answer.parts import Cell, Illustration, KeyFigure, Section, Verdict, quantities, records_table, table
from tank2sim.answer.result import Result
from tank2sim.cards.card import Card
from tank2sim.escaping import c_comment
from tank2sim.fmu.check import CheckReport
from tank2sim.fmu.export import ExportedFmu
from tank2sim.notices import Notice

MOST_PROBLEMS = 8
"""Problems that the screen shows. Project choice: they fit under the table."""


@dataclass(frozen=True, kw_only=True)
class ExportStudy:
    """An FMU that was made.

    `fmu`: path of the FMU; `ssp`: path of the SSP package in which a heading autopilot steers the ship.
    """

    ship: str
    fmu: str
    ssp: str | None
    fmi: int
    model_identifier: str
    token: str
    platforms: tuple[str, ...]
    size_bytes: int
    notices: tuple[Notice, ...]


@dataclass(frozen=True, eq=False, repr=False)
class ExportResult(Result[ExportStudy]):
    """An FMU that was made.

    Parameters
    ----------
    study : ExportStudy
    exported : ExportedFmu, optional
        The FMU with its bytes; None if the result was read from its JSON.
    files : mapping
        Paths and bytes of all files.
    card : Card, optional
        The card of the ship; None if the result was read from its JSON.
    """

    study: ExportStudy
    exported: ExportedFmu | None = None
    files: Mapping[Path, str | bytes] = field(default_factory=dict)
    card: Card | None = None
    command: ClassVar[str] = "export"
    subject: ClassVar[str] = "FMU"

    def c_files(self, folder: Path) -> dict[Path, str | bytes]:
        """The ship in plain C99 in a folder: ``ship.h``, ``ship.c``, ``self_test.c`` and a README."""
        from tank2sim.fmu.c99 import plain_ship

        if self.card is None:
            raise LookupError("the JSON of an export does not hold its card")
        made = plain_ship(self.card)
        readme = f"# {c_comment(self.study.ship)}: C99\n\n{made.use}"
        return {folder / name: text for name, text in (*made.files.items(), ("README.md", readme))}

    @property
    def path(self) -> Path:
        """Where the FMU is written."""
        return Path(self.study.fmu)

    @property
    def ssp(self) -> Path | None:
        """The SSP package, if one was made."""
        return Path(self.study.ssp) if self.study.ssp else None

    @property
    def headline(self) -> tuple[str, ...]:
        """File, version of FMI, platforms and size."""
        study = self.study
        return (
            f"{study.fmu}: {study.ship}, FMI {study.fmi}, Model Exchange and Co-Simulation, "
            f"{', '.join(study.platforms)}, {study.size_bytes / 1000:.0f} kB",
        )

    @property
    def sections(self) -> Sequence[Section]:
        """Kind and contents of the FMU."""
        study = self.study
        values: dict[str, Cell] = {"file": study.fmu, "ssp": study.ssp, "fmi": study.fmi}
        values |= {"model_identifier": study.model_identifier, "token": study.token, "size_bytes": study.size_bytes}
        return [Section("FMU", tables=[quantities("The FMU", values, on_screen=False)])]


@dataclass(frozen=True, eq=False, repr=False)
class CheckResult(Result[CheckReport]):
    """The check of an FMU against its card.

    Parameters
    ----------
    study : CheckReport

    Examples
    --------
    >>> import tank2sim as t2s
    >>> _ = t2s.load("mariner").to_fmu("mariner.fmu")
    >>> t2s.check_fmu("mariner.fmu").passed
    True
    """

    study: CheckReport
    command: ClassVar[str] = "check"

    @property
    def passed(self) -> bool:
        """True if the description is valid and no output differs from the model's by more than the limit."""
        return self.study.passed

    @property
    def problems(self) -> tuple[str, ...]:
        """Faults of the description or the outputs, one sentence each."""
        return (*self.study.validation, *self.study.differences)

    @property
    def title(self) -> str:
        """The file."""
        return f"{self.study.path}: check"

    @property
    def headline(self) -> tuple[str, ...]:
        """Verdict, version of FMI and kinds; the error against the FMU's own reference result."""
        report = self.study
        verdict = ("passed" if report.compared else "valid") if report.passed else "FAILED"
        lines = [f"{report.path}: FMI {report.fmi}, {', '.join(report.kinds)}: {verdict}"]
        if report.reference_error is not None:
            error = f"largest error {report.reference_error:.1e} of a range"
            lines.append(f"{report.path}: repeats the reference result that it carries; {error}")
        if report.host is not None:
            met = sum(one.met for one in report.conditions)
            lines.append(f"{report.path}: meets {met} of {len(report.conditions)} conditions of {report.host}")
        return tuple(lines)

    @property
    def key_figures(self) -> Sequence[KeyFigure]:
        """The verdict, and the largest error of each kind."""
        report = self.study
        verdict = Verdict.PASSED if report.passed else Verdict.FAILED
        largest = [
            KeyFigure(kind, max(errors.values()), limit=report.limits[kind], note="largest relative error")
            for kind, errors in report.errors.items()
            if errors
        ]
        return [KeyFigure("Check", str(verdict), verdict=verdict), *largest]

    @property
    def sections(self) -> Sequence[Section]:
        """Problems, and the largest error of each output, relative to its range."""
        report, sections = self.study, self._problems()
        if report.conditions:
            caption = f"Conditions of {report.host}"
            judged = records_table(caption, report.conditions, fields=("condition", "met", "found"))
            sections.append(Section(caption, tables=[judged]))
        if not report.errors:
            return sections
        rows: list[list[Cell]] = [
            [name, *(errors.get(name) for errors in report.errors.values())] for name in report.max_error
        ]
        rows.append(["limit", *(report.limits[kind] for kind in report.errors)])
        caption = f"Largest errors in {report.duration_s:g} s, relative to each output's range"
        drawn = [
            OutputError(kind=kind, output=name, error=error, limit=report.limits[kind])
            for kind, errors in report.errors.items()
            for name, error in errors.items()
        ]
        chart = Illustration(error_chart(drawn, title="Errors by output"))
        tables = [table(caption, ("output", *report.errors), rows, digits=2)]
        return [*sections, Section("Outputs", tables=tables, charts=[chart])]

    def _problems(self) -> list[Section]:
        rows: list[list[Cell]] = [[problem] for problem in self.problems]
        first = table(f"Problems, {MOST_PROBLEMS} of {len(rows)}", ["problem"], rows[:MOST_PROBLEMS])
        listed = table("Problems", ["problem"], rows, on_screen=len(rows) <= MOST_PROBLEMS)
        return [Section("Problems", tables=[listed] if listed.on_screen else [first, listed])] if rows else []
