"""A finding of the audit: a column whose content contradicts its name, and what it holds instead."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Literal

from tank2sim.arrays import Array, Number
from tank2sim.records.trials import Trial, with_signals

Repair = Callable[[Trial], Trial]
SeenPlaces = tuple[tuple[float, float], ...]


@dataclass(frozen=True, kw_only=True)
class ColumnFinding:
    """A finding about one column of a file.

    - `what`, `likely_truth`, `kind`, `evidence`, `places_s`: As of :class:`Finding`.
    - `repaired`: Whether the trial is corrected when it is read.
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

    `columns` are what it is about, as the file calls them; `what` does not agree with what; `likely_truth` is what they
    hold instead. A "fault" is a column that is not what its name says, or a sensor that failed; a "note" what a right
    record may show too (a current, a small bias, a gap). `evidence` are figures, the unit in the name.

    A `safe` repair only restates what was measured (a frame, a sign, a unit, a time base, a failed sensor left out),
    and :func:`tank2sim.records.audit.repair_trial` applies it. The others (a bias, a scale, a clock) change measured
    values by an estimate and are for the user, or for the gap workflow, to decide. `places_s` are the times from when
    to when it is seen, in the time of the file; empty where it is of the whole record.
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
        return self.kind == "fault" and not self.repaired

    @property
    def repaired(self) -> bool:
        """Whether :func:`tank2sim.records.audit.repair_trial` corrects the trial as it says."""
        return self.safe_repair is not None

    @property
    def safe_repair(self) -> Repair | None:
        """The repair if it is safe."""
        return self.repair if self.safe else None

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
                repaired=self.repaired,
                evidence=dict(self.evidence),
                places_s=self.places_s,
            )
            for column in self.columns
        )


def found_in(
    trial: Trial,
    names: Iterable[str],
    what: str,
    truth: str,
    evidence: Mapping[str, float] | None = None,
    repair: Repair | None = None,
) -> Finding:
    """A fault of the columns of these signals, with a safe repair."""
    columns = tuple(trial.heading(name) for name in names)
    return Finding(trial.path, columns, what, truth, "fault", evidence or {}, repair, safe=repair is not None)


def noted_in(
    trial: Trial,
    names: Iterable[str],
    what: str,
    truth: str,
    evidence: Mapping[str, float] | None = None,
    repair: Repair | None = None,
) -> Finding:
    """A note on the columns of these signals; its repair is an estimate."""
    return replace(found_in(trial, names, what, truth, evidence, repair), kind="note", safe=False)


def changed(names: Iterable[str], change: Callable[[Array], Array], notice: str) -> Repair:
    """The repair that changes the values (n,) of signals."""
    names = tuple(names)
    return lambda trial: with_signals(trial, {name: change(trial.signals[name]) for name in names}, notice)


def negated(values: Array) -> Array:
    """Values of the opposite sign, without -0."""
    return 0.0 - values
