"""The audit as a whole: each group of checks on what the safe mends of those before it have left."""

from __future__ import annotations

from collections.abc import Callable

from tank2sim.records.audit.finding import Finding
from tank2sim.records.audit.rudder import rudder_findings
from tank2sim.records.audit.sensors import sensor_findings
from tank2sim.records.audit.time_base import time_findings
from tank2sim.records.audit.time_unit import time_unit_findings
from tank2sim.records.audit.track import track_findings
from tank2sim.records.audit.yaw import yaw_findings
from tank2sim.records.trials import Trial

CHECKS: tuple[Callable[[Trial], list[Finding]], ...] = (
    time_findings,
    time_unit_findings,
    sensor_findings,
    yaw_findings,
    track_findings,
    rudder_findings,
)
"""In this order, for a later check takes what an earlier one judges for granted."""


def audit(trial: Trial) -> tuple[Finding, ...]:
    """What is wrong with a trial, by its consistency alone, and what its columns look like instead.

    Checked are the time base; each sensor by itself (missing, stuck, spikes); r against dpsi/dt; velocities against
    positions in body and earth axes with both signs; the rudder against the turn and against its order. A column that
    is found to be something else is taken for that in the checks that follow, so that one fault is told once.
    """
    return audited(trial)[1]


def mended(trial: Trial) -> tuple[Trial, tuple[Finding, ...]]:
    """The trial with every safe mend applied (frames, signs, units, time base, failed readings left out), and what for.

    The notices of the trial tell each change. Findings without a safe mend (:class:`Finding`) are not among those
    returned: biases, scales and clocks stay as measured.
    """
    repaired, findings = audited(trial)
    return repaired, tuple(finding for finding in findings if finding.safe and finding.mend is not None)


def audited(trial: Trial) -> tuple[Trial, tuple[Finding, ...]]:
    """The trial as :func:`mended` gives it, and all that is wrong with it, as :func:`audit` does."""
    findings: list[Finding] = []
    for check in CHECKS:
        found = check(trial)
        findings += found
        for finding in found:
            if finding.safe and finding.mend is not None:
                trial = finding.mend(trial)
    return trial, tuple(findings)
