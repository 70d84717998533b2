"""The audit of trials: faults of the data, found by consistency alone, and the study of them.

Each group of checks sees the record as the safe corrections of those before it leave it.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from tank2sim.arrays import Columns, Number
from tank2sim.notices import Notice
from tank2sim.records.audit.finding import ColumnFinding, Finding
from tank2sim.records.audit.noise import record_noise
from tank2sim.records.audit.rudder import rudder_clock_findings, rudder_findings, rudder_unit_findings
from tank2sim.records.audit.sensors import sensor_findings
from tank2sim.records.audit.time_base import time_findings, time_unit_findings
from tank2sim.records.audit.track import speed_unit_findings, track_findings
from tank2sim.records.audit.yaw import heading_unit_findings, rate_unit_findings, yaw_findings
from tank2sim.records.signals.columns import file_columns
from tank2sim.records.thinning import MEASURED_SAMPLES, drawn_columns
from tank2sim.records.trials import Trial, sampling_step, with_signals

__all__ = ["Finding", "audit_and_repair", "audit_trial", "record_noise", "repair_trial"]

CHECKS: tuple[Callable[[Trial], list[Finding]], ...] = (
    time_findings,
    time_unit_findings,
    sensor_findings,
    heading_unit_findings,
    rate_unit_findings,
    speed_unit_findings,
    rudder_unit_findings,
    yaw_findings,
    track_findings,
    rudder_findings,
    rudder_clock_findings,
)
"""Checks in their order: signs are judged on values whose unit is repaired, the rudder on a rate of turn whose sign
is repaired."""


def audit_trial(trial: Trial) -> tuple[Finding, ...]:
    """Faults of a trial, by its consistency alone, and the quantities that its columns look like instead.

    Checked are the time base; each sensor by itself (missing, stuck, spikes); r against dpsi/dt; velocities against
    positions in body and earth axes with both signs; the rudder against the turn and against its order. A column that
    is found to be something else is taken for that in the checks that follow, so that one fault is reported once.
    """
    return audit_and_repair(trial)[1]


def repair_trial(trial: Trial) -> tuple[Trial, tuple[Finding, ...]]:
    """The trial with every safe correction applied (frames, signs, units, time base, failed readings left out), and
    the findings that they correct.

    The notices of the trial state each change. Findings without a safe correction (:class:`Finding`) are not among
    those returned: biases, scales and clocks stay as measured.
    """
    repaired, findings = audit_and_repair(trial)
    return repaired, tuple(finding for finding in findings if finding.repaired)


def audit_and_repair(trial: Trial) -> tuple[Trial, tuple[Finding, ...]]:
    """The trial as :func:`repair_trial` returns it, and all findings, as :func:`audit_trial` does.

    After a fault that is not repaired (:attr:`.Finding.open`) nothing more is repaired: later findings may depend on it
    and are reported only if they concern other columns. After a fault of the time nothing else can be judged.
    """
    findings: list[Finding] = []
    doubtful: set[str] = set()
    for check in CHECKS:
        if trial.heading("t_s") in doubtful:
            break
        found = [finding for finding in check(trial) if not doubtful.intersection(finding.columns)]
        if doubtful:
            found = [replace(finding, safe=False) for finding in found]
        findings += found
        for finding in found:
            if finding.open:
                doubtful.update(finding.columns)
            if (repair := finding.safe_repair) is not None:
                trial = _without_empty(repair(trial))
    return trial, tuple(findings)


def _without_empty(trial: Trial) -> Trial:
    """The trial without signals whose only readings a repair has left out."""
    empty = [name for name, values in trial.signals.items() if np.isnan(values).all()]
    if not empty:
        return trial
    headings = ", ".join(trial.heading(name) for name in empty)
    return with_signals(trial, dict.fromkeys(empty), f"{headings}: no reading is left")


@dataclass(frozen=True, kw_only=True)
class ColumnNoise:
    """White noise of a signal.

    - `column`: Head of the column in the file.
    - `sigma`: Standard deviation, SI.
    - `stated`: Whether the file states it; elsewhere it is estimated from the record.
    """

    column: str
    sigma: Number
    stated: bool


@dataclass(frozen=True, eq=False, kw_only=True)
class AuditedTrial:
    """An audited trial.

    - `columns`: Heads in the file.
    - `noise`: Noise by the name of the signal in SI.
    - `histories`: The record thinned to draw.
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
