"""The audit of trials: faults of their data, found by consistency alone."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from tank2sim.api.verbs import verb

if TYPE_CHECKING:
    import pandas as pd

    from tank2sim.api.trial import TrialRecord
    from tank2sim.results.audit import AuditResult


@verb("faults in the data of trials", results=("tank2sim.results.audit:AuditResult",))
def audit(
    trials: str | Path | TrialRecord | pd.DataFrame | Sequence[str | Path | TrialRecord | pd.DataFrame],
) -> AuditResult:
    """Judge the columns of trials by their consistency alone: signs, units, frames, clocks, failed sensors.

    Parameters
    ----------
    trials : path, TrialRecord, DataFrame, or sequence of them
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
    from tank2sim.api.trial import TrialRecord, trials_of
    from tank2sim.records.audit import study_audit
    from tank2sim.results.audit import AuditResult

    records = trials_of(trials, rising=False)
    return AuditResult(study_audit(records), tuple(map(TrialRecord, records)))
