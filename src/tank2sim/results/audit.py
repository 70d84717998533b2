"""Result of ``audit``: faults of the columns of trials, and the noise of each signal."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import PurePath
from typing import TYPE_CHECKING, Any, ClassVar

from tank2sim.answer.charts.motion import TimeMark, motions, stem_of
from tank2sim.answer.parts import Cell, Illustration, KeyFigure, Section, Table, Verdict, data_frame, table
from tank2sim.answer.result import Result
from tank2sim.notices import Notice
from tank2sim.records.audit import AuditedTrial, AuditStudy
from tank2sim.records.audit.finding import ColumnFinding
from tank2sim.units import from_si

if TYPE_CHECKING:
    import pandas as pd

_MOST_RECORDS = 12
"""Records drawn in one page, a quarter of a MB each. Project choice."""


@dataclass(frozen=True, eq=False, repr=False)
class AuditResult(Result[AuditStudy]):
    """Faults of the columns of trials, and the noise of each signal.

    Parameters
    ----------
    study : AuditStudy
    trials : tuple of TrialRecord
        The records; empty if the result was read from its JSON.
    """

    study: AuditStudy
    trials: tuple[Any, ...] = ()
    command: ClassVar[str] = "audit"

    @property
    def findings(self) -> pd.DataFrame:
        """Findings, a row each: file, columns, kind (``fault`` or ``note``), what, likely truth."""
        rows = [(one.file, names, one.kind, one.what, one.likely_truth) for one, names in self._findings()]
        return data_frame(rows, columns=["file", "column", "kind", "what", "likely_truth"])

    @property
    def passed(self) -> bool:
        """True if no column has a fault; notes are allowed."""
        return all(finding.kind != "fault" for finding in self.study.findings)

    @property
    def noise(self) -> pd.DataFrame:
        """Standard deviation of the noise of each signal, a row each: file, column, sigma in its unit, stated.

        ``stated`` is true where the file states it; elsewhere the white part is estimated from the record.
        """
        rows = [
            asdict(noise) | {"file": trial.file, "sigma": from_si(noise.column, noise.sigma)}
            for trial in self.study.trials
            for noise in trial.noise.values()
        ]
        return data_frame(rows, columns=["file", "column", "sigma", "stated"])

    @property
    def title(self) -> str:
        """The file, or that there are several."""
        trials = self.study.trials
        return "Audit of trials" if len(trials) > 1 else f"Audit of {_name(trials[0])}"

    @property
    def headline(self) -> tuple[str, ...]:
        """Number of faults and notes, and the first fault."""
        trials = "1 trial" if len(self.study.trials) == 1 else f"{len(self.study.trials)} trials"
        findings = self._findings()
        if not findings:
            agree = "signs, units, times and positions of all columns agree with each other"
            return (f"Nothing wrong was found in {trials}: {agree}.",)
        kinds = [one.kind for one, _ in findings]
        counts = [f"{kinds.count(kind)} {kind}{'s' * (kinds.count(kind) > 1)}" for kind in sorted(set(kinds))]
        found = f"{' and '.join(counts)} found in {trials}."
        fault, columns = findings[0]
        if fault.kind == "note":
            return (f"{found} Notes do not keep a trial from being used.",)
        repaired = "repaired when the trial is read" if fault.repaired else "not repaired"
        return (found, f"{columns} of {_name(fault)} is wrong: {fault.likely_truth} ({repaired}).")

    @property
    def notices(self) -> tuple[Notice, ...]:
        """Changes made on reading."""
        return tuple(notice.of(PurePath(trial.file).stem) for trial in self.study.trials for notice in trial.notices)

    @property
    def key_figures(self) -> Sequence[KeyFigure]:
        """Faults, notes and repairs."""
        findings = [one for one, _ in self._findings()]
        faults, repaired = (sum(one.kind == "fault" for one in findings), sum(one.repaired for one in findings))
        trials = self.study.trials
        clean = len(trials) - len({finding.file for finding in findings})
        return [
            KeyFigure("Faults", faults, verdict=Verdict.FAILED if faults else Verdict.PASSED),
            KeyFigure("Notes", len(findings) - faults, note="smaller findings to look at"),
            KeyFigure("Repaired when the trials are read", f"{repaired} of {len(findings)}"),
            KeyFigure("Trials without a finding", f"{clean} of {len(trials)}"),
        ]

    @property
    def sections(self) -> Sequence[Section]:
        """Findings, records with the places of findings, and the trials."""
        first = [Section("Findings", tables=[self._findings_table()])] if self.study.findings else []
        trials = Section("Trials", tables=[self._trials_table(), self._noise_table()])
        return [*first, *self._records(), trials]

    def _findings(self) -> list[tuple[ColumnFinding, str]]:
        """Each finding with the columns of a file that it is about, faults first."""
        columns: dict[tuple[str, ...], tuple[ColumnFinding, list[str]]] = {}
        for finding in sorted(self.study.findings, key=lambda finding: finding.kind != "fault"):
            said = (finding.file, finding.what, finding.likely_truth)
            columns.setdefault(said, (finding, []))[1].append(finding.column)
        return [(finding, ", ".join(names)) for finding, names in columns.values()]

    def _findings_table(self) -> Table:
        rows: list[list[Cell]] = [
            [_name(one), one.kind, names, one.what, one.likely_truth, one.repaired] for one, names in self._findings()
        ]
        heads = ["file", "kind", "column", "what", "likely truth", "repaired"]
        if len(self.study.trials) == 1:
            heads, rows = heads[1:], [row[1:] for row in rows]
        return table("Findings", heads, rows, folded=False)

    def _records(self) -> list[Section]:
        """Records with the places of their findings; those with findings first, all but the first folded."""
        faulty = {finding.file for finding in self.study.findings}
        drawn = [trial for trial in self.study.trials if len(trial.histories["t_s"]) > 1]
        drawn = sorted(drawn, key=lambda trial: trial.file not in faulty)[:_MOST_RECORDS]
        return [replace(self._record(trial), folded=place > 0) for place, trial in enumerate(drawn)]

    def _record(self, trial: AuditedTrial) -> Section:
        mine = [finding for finding in self.study.findings if finding.file == trial.file]
        marks = _marks(mine, trial)
        charts: Sequence[Illustration] = motions(_name(trial), {"measured": trial.histories}, marks=marks)
        red = "Red in the histories: where findings about single values and rows are."
        return Section(
            f"Record {_name(trial)}",
            text=red if marks else "" if mine else "Nothing wrong was found.",
            charts=[replace(chart, half=len(charts) > 1, name=f"record {_name(trial)}") for chart in charts],
        )

    def _trials_table(self) -> Table:
        files = [finding.file for finding, _ in self._findings()]
        rows: list[list[Cell]] = [
            [_name(one), one.duration_s, one.rows, one.step_s, files.count(one.file), ", ".join(one.columns)]
            for one in self.study.trials
        ]
        heads = ("file", "duration (s)", "rows", "step (s)", "findings", "columns")
        return table("Trials", heads, rows, digits=6, folded=False)

    def _noise_table(self) -> Table:
        shown = {
            trial.file: {
                noise.column: f"{from_si(noise.column, noise.sigma):.2g}{'' if noise.stated else '*'}"
                for noise in trial.noise.values()
            }
            for trial in self.study.trials
        }
        columns = list(dict.fromkeys(column for noise in shown.values() for column in noise))
        rows: list[list[Cell]] = [
            [_name(trial), *(shown[trial.file].get(column) for column in columns)] for trial in self.study.trials
        ]
        caption = "Noise of each column: standard deviation in its unit (* estimated)"
        return table(caption, ["file", *columns], rows, folded=False)


def _name(entry: AuditedTrial | ColumnFinding) -> str:
    return PurePath(entry.file).name


def _marks(findings: Sequence[ColumnFinding], trial: AuditedTrial) -> list[TimeMark]:
    """Places of a finding about a column in its panel, and of a finding about the time in all panels."""
    _, *columns = trial.histories
    stems = dict(zip(trial.columns, map(stem_of, columns), strict=True))
    marks = []
    for finding in findings:
        at = [stems[finding.column]] if finding.column in stems else list(stems.values())
        for begin, end in finding.places_s:
            marks += [TimeMark(signal=name, begin_s=begin, end_s=end, text=finding.what) for name in at]
    return marks
