"""Captive campaigns: what a towing tank measured on a model that a carriage drives, in one convention."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from tank2sim.arrays import Array
from tank2sim.cards.reading import parsed_toml
from tank2sim.cards.scaling import Scales
from tank2sim.errors import InputError
from tank2sim.files import named_in, read_text
from tank2sim.notices import Notice, caution
from tank2sim.records.averages import read_averages
from tank2sim.records.campaign_form import (
    CampaignFile,
    FullScaleSection,
    ModelSection,
    TankSection,
    TankTest,
    UncertaintySection,
    campaign_file,
)
from tank2sim.records.captive_record import FORCE_COLUMNS, CaptiveRun, read_captive_run
from tank2sim.records.same_record import Likeness, Recording, has_noise, likeness

_FEWEST_READINGS = 16  # Readings of three gauges that cannot agree by chance, however coarse the gauges are

_FAULTS_SAID = 8
"""Different faults that one message lists; the others are counted. Project choice: they fill a screen."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Campaign:
    """A captive campaign with one model."""

    path: Path  # Its ``campaign.toml``
    # `model`, `test`, `tank`, `uncertainty`, `full_scale`: Sections of the file, SI and radians
    # (:mod:`tank2sim.records.campaign_form`). ``full_scale`` may be None
    model: ModelSection
    test: TankTest
    tank: TankSection
    uncertainty: UncertaintySection
    full_scale: FullScaleSection | None
    runs: tuple[CaptiveRun, ...]  # In the order of the file
    faults: tuple[InputError, ...] = ()  # Runs that could not be read and were left out, because that was asked for
    remarks: tuple[Notice, ...] = field(default=())  # What was done on reading and should know

    @property
    def inertia_removed(self) -> bool:
        """The forces are the water's alone, the reaction of the body's inertia already taken out."""
        return self.test.force_convention == "hydrodynamic"

    @property
    def scales(self) -> Scales:
        """Scales of the prime system at the test speed."""
        return self.scales_at(self.test.speed_mps)

    def scales_at(self, speed_mps: float) -> Scales:
        """Scales of the prime system at another speed."""
        return Scales(self.test.water_density_kgpm3, self.model.length_m, speed_mps)

    def without(self, names: set[str]) -> Campaign:
        """The campaign less some runs."""
        return replace(self, runs=tuple(run for run in self.runs if run.name not in names))


def read_campaign(path: Path | str, *, keep_going: bool = False) -> Campaign:
    """Read a campaign and all its runs.

    `path`: ``campaign.toml``; the names of files in it are relative to its folder; `keep_going`: Leave out runs that
    cannot be read (a missing file, text in a number column) and list them in ``faults``.

    Raises InputError: The campaign's file is at fault; or a run is, and `keep_going` is not asked for: then all such
    runs are reported.
    """
    path = Path(path)
    form, spelt = campaign_file(parsed_toml(read_text(path), path), path)
    if (form.averages is None) == (not form.runs):
        problem = "has both [averages] and [[runs]]" if form.runs else "has no run"
        raise InputError(path, "", problem, "give [[runs]] with a file each, or one table in [averages]")
    remarks: list[Notice] = []
    faults: list[InputError] = []
    if form.averages is not None:
        with named_in(path, path.parent / form.averages.file):
            runs, remarks = read_averages(form, spelt, path)
    else:
        _refuse_doubled_names(form, path)
        runs, faults = _read_runs(form, path)
    copies, mirrored = copied_runs(runs)
    runs = [run for run in runs if run.name not in copies]
    faults += copies.values()
    remarks += mirrored
    if faults and not keep_going:
        raise together(faults)
    if not runs:
        raise InputError(path, "runs", "no run can be used", f"correct them first: {faults[0]}")
    return Campaign(
        path=path,
        model=form.model,
        test=form.test,
        tank=form.tank,
        uncertainty=form.uncertainty,
        full_scale=form.full_scale,
        runs=tuple(runs),
        faults=tuple(faults),
        remarks=tuple(remarks),
    )


def _read_runs(form: CampaignFile, path: Path) -> tuple[list[CaptiveRun], list[InputError]]:
    """The runs of a campaign that can be read, and the faults of the others."""
    runs: list[CaptiveRun] = []
    faults: list[InputError] = []
    for sheet in form.runs:
        try:
            columns, file = {**form.columns, **sheet.columns}, path.parent / sheet.file
            with named_in(path, file):
                runs.append(read_captive_run(file, sheet, form.test, columns, form.files))
        except InputError as fault:
            faults.append(fault)
    return runs, faults


def copied_runs(runs: Sequence[CaptiveRun]) -> tuple[dict[str, InputError], list[Notice]]:
    """Runs that repeat the forces of an earlier run, as :func:`tank2sim.records.same_record.likeness` finds: name to
    fault; and remarks on mirror images.

    Noise never repeats itself; records without noise, of a computed campaign or a dead gauge, are not evidence.
    """
    faults: dict[str, InputError] = {}
    remarks: list[Notice] = []
    records = [(run.name, record) for run in runs if (record := _moving_forces(run)) is not None]
    sizes = [_mean_and_scatter(record) for _, record in records]
    looked_for = (Likeness.COPY, Likeness.MIRROR)
    for number, (name, record) in enumerate(records):
        for (other, before), its_sizes in zip(records[:number], sizes, strict=False):
            alike = likeness(before, record, looked_for) if _similar(its_sizes, sizes[number]) else None
            if alike is Likeness.COPY:
                problem = f"has the forces of {other}, reading for reading"
                remedy = "one is a copy of the other: take it out, or give the run its own record"
                faults.setdefault(name, InputError(name, "", problem, remedy))
            elif alike is Likeness.MIRROR and has_noise(record):
                remarks.append(caution(f"{name} is the mirror image of {other}, noise included: not a second run."))
    return faults, remarks


def _moving_forces(run: CaptiveRun) -> Recording | None:
    """The forces of a run; None if they cannot show a copy: averages, few readings, or a gauge that does not move."""
    forces = {column: run.force(force) for force, column in FORCE_COLUMNS.items()}
    if run.is_average or len(run.time_s) < _FEWEST_READINGS or not all(map(np.ptp, forces.values())):
        return None
    return Recording(run.time_s, forces)


def _mean_and_scatter(record: Recording) -> Array:
    """Means and standard deviations (2, n) of all forces."""
    return np.array([[np.mean(values), np.std(values)] for values in record.signals.values()]).T


def _similar(first: Array, second: Array) -> bool:
    """Whether means and scatter (2, n) of all forces, or their mirror image, are worth a closer look."""
    (means, scatter), (other_means, other_scatter) = first, second
    largest, least = np.maximum(scatter, other_scatter), np.minimum(scatter, other_scatter)
    apart = np.abs(np.abs(means) - np.abs(other_means))
    return bool(np.all((apart <= largest) & (largest <= 2 * least)))


def together(faults: list[InputError], *, can_leave_out: bool = True) -> InputError:
    """Several faults as one error: runs with the same one are counted together, and the remedy is the first one's, and
    to go on without those runs if the command can (`can_leave_out`)."""
    alike: dict[tuple[str, str], list[InputError]] = {}
    for fault in faults:
        alike.setdefault((fault.place, fault.problem), []).append(fault)
    said: list[str] = []
    for one, *others in list(alike.values())[:_FAULTS_SAID]:
        more = f" (the same of {len(others)} more, the last {Path(others[-1].source).name})" if others else ""
        where = [Path(one.source).name, one.place] if said else []
        said.append(": ".join(filter(None, [*where, one.problem])) + more)
    if rest := sum(map(len, list(alike.values())[_FAULTS_SAID:])):
        said.append(f"and {rest} more faults")
    first = faults[0]
    remedy = first.remedy + (", or leave such runs out (keep_going=True)" if can_leave_out else "")
    return InputError(first.source, first.place, "; ".join(said), remedy)


def _refuse_doubled_names(form: CampaignFile, path: Path) -> None:
    names = [sheet.file for sheet in form.runs]
    for number, name in enumerate(names):
        if name in names[:number]:
            raise InputError(path, f"runs.{number}.file", f"{name} is given twice", "give each run once")


def read_campaign_form(path: Path | str) -> CampaignFile:
    """The checked content of ``campaign.toml``, without the files of its runs.

    Raises InputError: The file is missing or at fault.
    """
    path = Path(path)
    return campaign_file(parsed_toml(read_text(path), path), path)[0]
