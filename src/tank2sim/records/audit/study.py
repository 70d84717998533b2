"""Study of trials by their audit: findings, noise of each signal, and records to draw."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from tank2sim.arrays import Columns, Number
from tank2sim.notices import Notice
from tank2sim.records.audit import audit_trial, record_noise
from tank2sim.records.audit.finding import ColumnFinding
from tank2sim.records.signals.columns import file_columns
from tank2sim.records.thinning import MEASURED_SAMPLES, drawn_columns
from tank2sim.records.trials import Trial, sampling_step


@dataclass(frozen=True, kw_only=True)
class ColumnNoise:
    """White noise of a signal.

    Parameters
    ----------
    column : str
        Head of the column in the file.
    sigma : float
        Standard deviation, SI.
    stated : bool
        Whether the file states it; elsewhere it is estimated from the record.
    """

    column: str
    sigma: Number
    stated: bool


@dataclass(frozen=True, eq=False, kw_only=True)
class AuditedTrial:
    """An audited trial.

    Parameters
    ----------
    file : str
    duration_s, step_s : float
    rows : int
    columns : tuple of str
        Heads in the file.
    noise : dict
        Noise by the name of the signal in SI.
    notices : tuple of Notice
    histories : dict
        The record thinned to draw.
    """

    file: str
    duration_s: Number
    step_s: Number
    rows: int
    columns: tuple[str, ...]
    noise: dict[str, ColumnNoise]
    notices: tuple[Notice, ...]
    histories: Columns


@dataclass(frozen=True, eq=False, kw_only=True)
class AuditStudy:
    """Faults and notes by column, and the trials with their noise."""

    findings: tuple[ColumnFinding, ...]
    trials: tuple[AuditedTrial, ...]


def study_audit(trials: Sequence[Trial]) -> AuditStudy:
    """Audit trials, SI and radians."""
    findings = [finding for trial in trials for finding in audit_trial(trial)]
    return AuditStudy(
        findings=tuple(entry for finding in findings for entry in finding.entries),
        trials=tuple(map(_audited, trials)),
    )


def _audited(trial: Trial) -> AuditedTrial:
    return AuditedTrial(
        file=str(trial.path),
        duration_s=float(trial.time_s.max() - trial.time_s.min()),
        step_s=sampling_step(trial),
        rows=len(trial.time_s),
        columns=tuple(trial.heading(name) for name in trial.signals),
        noise={
            name: ColumnNoise(column=trial.heading(name), sigma=sigma, stated=name in trial.noise)
            for name, sigma in record_noise(trial).items()
        },
        notices=tuple(trial.notices),
        histories=drawn_columns(file_columns(trial), MEASURED_SAMPLES, peaks=True),
    )
