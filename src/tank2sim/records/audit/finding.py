"""What the audit finds: a column that does not say what its name says, and what it says instead."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

from tank2sim.arrays import Number
from tank2sim.records.trials import Trial

Repair = Callable[[Trial], Trial]


@dataclass(frozen=True, kw_only=True)
class ColumnFinding:
    """A finding about one column of a file.

    Parameters
    ----------
    file, column : str
    what, likely_truth, kind, evidence, places_s
        As of :class:`Finding`.
    repaired : bool
        Whether the trial is corrected when it is read.
    """

    file: str
    column: str
    what: str
    likely_truth: str
    kind: Literal["fault", "note"]
    repaired: bool
    evidence: dict[str, Number]
    places_s: tuple[tuple[float, float], ...]


@dataclass(frozen=True)
class Finding:
    """One finding about a trial.

    Parameters
    ----------
    source : Path
        The file.
    columns : tuple of str
        The columns it is about, as the file calls them.
    what : str
        What does not agree with what.
    likely_truth : str
        What the columns hold instead.
    kind : str
        "fault" if a column is not what its name says or a sensor failed; "note" for what a right record may show too
        (a current, a small bias, a gap).
    evidence : mapping
        Figures, the unit in the name.
    correct : callable or None
        Trial to repaired trial.
    safe : bool
        Whether the correct only restates what was measured (a frame, a sign, a unit, a time base, a failed sensor left
        out), so that :func:`tank2sim.records.audit.repair_trial` applies it. The others (a bias, a scale, a clock)
        change measured values by an estimate and are for the user, or for the gap workflow, to decide.
    places_s : tuple of (float, float)
        From when to when it is seen, in the time of the file; empty where it is of the whole record.
    """

    source: Path
    columns: tuple[str, ...]
    what: str
    likely_truth: str
    kind: Literal["fault", "note"] = "fault"
    evidence: Mapping[str, float] = field(default_factory=dict)
    repair: Repair | None = None
    safe: bool = False
    places_s: tuple[tuple[float, float], ...] = ()

    @property
    def column(self) -> str:
        """The columns in one text."""
        return ", ".join(self.columns)

    @property
    def open(self) -> bool:
        """Whether it is a fault that :func:`tank2sim.records.audit.repair_trial` leaves: the trial is then not to be
        used."""
        return self.kind == "fault" and not (self.safe and self.repair is not None)

    @property
    def entries(self) -> tuple[ColumnFinding, ...]:
        """The finding for each of its columns."""
        return tuple(
            ColumnFinding(
                file=str(self.source),
                column=column,
                what=self.what,
                likely_truth=self.likely_truth,
                kind=self.kind,
                repaired=self.safe and self.repair is not None,
                evidence=dict(self.evidence),
                places_s=self.places_s,
            )
            for column in self.columns
        )
