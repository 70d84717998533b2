"""The audit of trials: what is wrong with their data, found by consistency alone."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from tank2sim.answer.parts import Table
from tank2sim.api.bounds import checked
from tank2sim.api.result import OldResult, screen_table, section_charts
from tank2sim.api.trial import TrialPaths, TrialRecord, trials_of
from tank2sim.records import audit as records_audit
from tank2sim.records.audit import Finding, record_noise
from tank2sim.records.signals.columns import file_columns
from tank2sim.records.thinning import drawn_columns
from tank2sim.records.trials import Trial, sampling_step
from tank2sim.units import from_si

if TYPE_CHECKING:
    import altair as alt
    import pandas as pd

MEASURED_SAMPLES = 400
"""Samples of each trial in the JSON, for charts. Project choice: a chart is a few hundred pixels wide, and the record
itself is the file."""


class AuditResult(OldResult):
    """Faults of the columns of trials, and the noise of each signal.

    Parameters
    ----------
    trials : sequence of Trial
        SI and radians.
    """

    command = "audit"

    def __init__(self, trials: Sequence[Trial]) -> None:
        self.trials = tuple(TrialRecord(trial) for trial in trials)
        self.found = tuple(tuple(records_audit.audit_trial(trial)) for trial in trials)
        self._noise = tuple(record_noise(trial) for trial in trials)
        self.notices = tuple(f"{trial.name}: {notice}" for trial in trials for notice in trial.notices)

    @property
    def findings(self) -> pd.DataFrame:
        """Findings, a row each: file, columns, kind (``fault`` or ``note``), what, likely truth."""
        import pandas as pd

        rows = [
            (str(finding.source), finding.column, finding.kind, finding.what, finding.likely_truth)
            for finding in self._all_findings
        ]
        return pd.DataFrame(rows, columns=["file", "column", "kind", "what", "likely_truth"])

    @property
    def passed(self) -> bool:
        """True if no column has a fault; notes are allowed."""
        return all(finding.kind != "fault" for finding in self._all_findings)

    @property
    def noise(self) -> pd.DataFrame:
        """Standard deviation of the noise of each signal, a row each: file, column, sigma in its unit, stated.

        ``stated`` is true where the file states it; elsewhere the white part is estimated from the record.
        """
        import pandas as pd

        rows = [
            (str(record.path), heading, sigma, stated)
            for record, noise in zip(self.trials, self._noise, strict=True)
            for heading, sigma, stated in _in_file_units(record.trial, noise)
        ]
        return pd.DataFrame(rows, columns=["file", "column", "sigma", "stated"])

    def content(self) -> Mapping[str, object]:
        """As :meth:`.OldResult.content`."""
        return {
            "findings": [entry for finding in self._all_findings for entry in finding.as_json()],
            "trials": [_summary(record.trial, noise) for record, noise in zip(self.trials, self._noise, strict=True)],
        }

    @property
    def headline(self) -> tuple[str, ...]:
        """Number of faults and notes."""
        kinds = [str(finding.kind) for finding in self._all_findings]
        trials = "1 trial" if len(self.trials) == 1 else f"{len(self.trials)} trials"
        if not kinds:
            return (f"{trials}: nothing wrong was found",)
        counts = [f"{kinds.count(kind)} {kind}{'s' * (kinds.count(kind) > 1)}" for kind in sorted(set(kinds))]
        return (f"{trials}: {' and '.join(counts)} found",)

    @property
    def tables(self) -> tuple[Table, ...]:
        """Findings, if there are any, and the trials with their columns and noise."""
        trials = screen_table(
            "Trials",
            ("trial", "duration (s)", "rows", "step (s)", "findings"),
            [
                [trial.name, _duration_s(trial), len(trial.time_s), sampling_step(trial), len(found)]
                for trial, found in zip((record.trial for record in self.trials), self.found, strict=True)
            ],
            tuple(
                line
                for record, noise in zip(self.trials, self._noise, strict=True)
                for line in _column_lines(record.trial, noise)
            ),
        )
        if not self._all_findings:
            return (trials,)
        columns: tuple[str, ...] = ("trial", "kind", "column", "what", "likely truth")
        rows = [[each.source.stem, each.kind, each.column, each.what, each.likely_truth] for each in self._all_findings]
        if len(self.trials) == 1:
            columns, rows = columns[1:], [row[1:] for row in rows]
        return screen_table("Findings", columns, rows), trials

    def charts(self) -> dict[str, alt.TopLevelMixin]:
        """Track and histories of each record with the places of its findings; records with findings first."""
        from tank2sim.report.audit.page import record_sections

        return section_charts(record_sections(self.to_dict()))

    @property
    def _all_findings(self) -> list[Finding]:
        return [finding for found in self.found for finding in found]


@checked
def audit(trials: TrialPaths) -> AuditResult:
    """Judge the columns of trials by their consistency alone: signs, units, frames, clocks, failed sensors.

    Parameters
    ----------
    trials : path, TrialRecord, or sequence of them
        A folder means the trials in it. Times that do not rise are a finding.

    Raises
    ------
    InputError
        A file is missing, of no known format, or its content is faulty.

    Examples
    --------
    >>> import tempfile
    >>> import tank2sim as t2s
    >>> file = tempfile.mkdtemp() + "/turn.csv"
    >>> text = t2s.load("mariner").turn(35).to_csv(file)
    >>> t2s.audit(file).passed
    True
    """
    return AuditResult(trials_of(trials, rising=False))


def _duration_s(trial: Trial) -> float:
    return float(trial.time_s.max() - trial.time_s.min())


def _in_file_units(trial: Trial, noise: Mapping[str, float]) -> list[tuple[str, float, bool]]:
    """Heading in the file, noise in the unit of the heading, and whether the file states it."""
    return [
        (trial.heading(name), from_si(trial.heading(name), sigma), name in trial.noise) for name, sigma in noise.items()
    ]


def _column_lines(trial: Trial, noise: Mapping[str, float]) -> tuple[str, str]:
    rows = [f"{name} {sigma:.2g}{'' if stated else '*'}" for name, sigma, stated in _in_file_units(trial, noise)]
    columns = f"{trial.name}: columns {', '.join(trial.heading(name) for name in trial.signals)}"
    return columns, f"{trial.name}: noise (* estimated) {', '.join(rows)}"


def _summary(trial: Trial, noise: Mapping[str, float]) -> dict[str, object]:
    """Summary of a file; noise in SI, by signal; the record thinned to draw."""
    return {
        "file": str(trial.path),
        "duration_s": _duration_s(trial),
        "step_s": sampling_step(trial),
        "rows": len(trial.time_s),
        "columns": [trial.heading(name) for name in trial.signals],
        "noise": {
            name: {"sigma": sigma, "from": "file" if name in trial.noise else "estimated"}
            for name, sigma in noise.items()
        },
        "notices": list(trial.notices),
        "histories": drawn_columns(file_columns(trial), MEASURED_SAMPLES, peaks=True),
    }
