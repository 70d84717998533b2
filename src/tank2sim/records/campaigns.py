"""Captive campaigns: what a towing tank measured on a model that a carriage drives, read and brought to one convention.

Inside the program a :class:`CaptiveRun` has, whatever its file says:

- SI units and radians; the rudder positive to starboard; ``drift_rad`` is beta = -asin(v/U);
- ``X_N``, ``Y_N``, ``N_Nm`` in the *hydrodynamic* sense: positive as the water pushes the model (forward, to
  starboard, bow to starboard). Unless :attr:`Campaign.inertia_removed`, they still hold the reaction of the carried
  body's inertia: Y_N = Y_hydrodynamic - m (v' + u r + x_G r'). So a file ``on_model`` has its signs changed, one
  ``on_gauge`` keeps them;
- ``speed_mps`` is the speed U through the water.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from tank2sim.arrays import Array
from tank2sim.cards.reading import parsed_toml
from tank2sim.cards.scaling import Scales
from tank2sim.errors import InputError
from tank2sim.files import named_in, read_text
from tank2sim.notices import Notice, caution
from tank2sim.records.averages import Condition, read_averages
from tank2sim.records.campaign_form import (
    OSCILLATING,
    CampaignFile,
    ColumnEntry,
    FilesSection,
    FullScaleSection,
    ModelSection,
    RunSheet,
    RunType,
    SpeltColumn,
    TankSection,
    TankTest,
    UncertaintySection,
    campaign_file,
)
from tank2sim.records.csv_table import CsvTable
from tank2sim.records.run_tables import read_run_table
from tank2sim.records.same_record import Likeness, Recording, has_noise, likeness

FORCE_COLUMNS = ("X", "Y", "N")
_FEWEST_READINGS = 16
"""Readings of three gauges that cannot agree by chance, however coarse the gauges are."""
_FAULTS_SAID = 8
"""Different faults that one message lists; the others are counted. Project choice: they fill a screen."""
_FORCE_COLUMNS = {"X": "X_N", "Y": "Y_N", "N": "N_Nm"}


@dataclass(frozen=True, eq=False, kw_only=True)
class CaptiveRun:
    """One captive run."""

    name: str  # Its file's name, or ``captive.csv line 12`` for a row of averages
    type: RunType  # One of :data:`tank2sim.records.campaign_form.RUN_TYPES`
    sheet: RunSheet  # What the test sheet says (SI, rudder to starboard); None where it is silent
    time_s: Array  # (rows,): Rising; a single 0 for a row of averages
    # `v_mps`, `r_radps`, `speed_mps`, `delta_rad`: (rows,): Sway velocity, yaw rate, speed U through the water, rudder
    # angle
    v_mps: Array
    r_radps: Array
    speed_mps: Array
    delta_rad: Array
    # `X_N`, `Y_N`, `N_Nm`: (rows,): Forces and moment in the hydrodynamic sense (see the module), about midships
    X_N: Array
    Y_N: Array
    N_Nm: Array
    # `y_m`, `psi_rad`: (rows,): Sideways position in the tank and heading against its axis
    y_m: Array | None = None
    psi_rad: Array | None = None
    propeller_radps: float | None = None  # Revolutions: the mean of the record, or those of the sheet
    # `thrust_N`, `rudder_normal_force_N`: (rows,): Thrust of the propeller, positive forward; force of the water on the
    # rudder, positive to port
    thrust_N: Array | None = None
    rudder_normal_force_N: Array | None = None
    torque_Nm: Array | None = None  # (rows,): That the propeller takes
    heel_rad: float = 0.0  # At which the model is held, positive to starboard
    force_delay_s: float = 0.0  # By how much the forces lag the motion

    @property
    def is_average(self) -> bool:
        """A row of averages: one reading without a history."""
        return len(self.time_s) == 1

    @property
    def oscillates(self) -> bool:
        """The model oscillates in it."""
        return self.type in OSCILLATING

    @property
    def duration_s(self) -> float:
        """Length of the record, the last sample's own interval included."""
        count = len(self.time_s)
        return float(self.time_s[-1] - self.time_s[0]) * count / (count - 1) if count > 1 else 0.0

    def force(self, name: str) -> Array:
        """``X``, ``Y`` (N) or ``N`` (N m), (rows,)."""
        values: Array = getattr(self, _FORCE_COLUMNS[name])
        return values


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
    form, spelt = read_campaign_file(path)
    runs: list[CaptiveRun] = []
    faults: list[InputError] = []
    remarks: list[Notice] = []
    if (form.averages is None) == (not form.runs):
        problem = "has both [averages] and [[runs]]" if form.runs else "has no run"
        raise InputError(path, "", problem, "give [[runs]] with a file each, or one table in [averages]")
    if form.averages is not None:
        with named_in(path, path.parent / form.averages.file):
            conditions, remarks = read_averages(form, spelt, path)
        runs = [_averaged_run(condition, form) for condition in conditions]
    _refuse_doubled_names(form, path)
    for sheet in form.runs:
        try:
            columns, file = {**form.columns, **sheet.columns}, path.parent / sheet.file
            with named_in(path, file):
                runs.append(read_captive_run(file, sheet, form.test, columns, form.files))
        except InputError as fault:
            faults.append(fault)
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


def copied_runs(runs: Sequence[CaptiveRun]) -> tuple[dict[str, InputError], list[Notice]]:
    """Runs whose forces are those of a run before, as :func:`tank2sim.records.same_record.likeness` finds: name to
    fault; and remarks on mirror images.

    Noise never repeats itself; records without noise, of a computed campaign or a dead gauge, are not evidence.
    """
    faults: dict[str, InputError] = {}
    remarks: list[Notice] = []
    seen: list[tuple[CaptiveRun, Recording, Array]] = []
    looked_for = (Likeness.COPY, Likeness.MIRROR)
    for run in runs:
        record = Recording(run.time_s, {column: run.force(force) for force, column in _FORCE_COLUMNS.items()})
        if run.is_average or len(run.time_s) < _FEWEST_READINGS or not all(map(np.ptp, record.signals.values())):
            continue
        sizes = np.array([[np.mean(values), np.std(values)] for values in record.signals.values()]).T
        for other, before, its_sizes in seen:
            alike = likeness(before, record, looked_for) if _similar(its_sizes, sizes) else None
            if alike is Likeness.COPY:
                problem = f"has the forces of {other.name}, reading for reading"
                remedy = "one is a copy of the other: take it out, or give the run its own record"
                faults.setdefault(run.name, InputError(run.name, "", problem, remedy))
            elif alike is Likeness.MIRROR and has_noise(record):
                remarks.append(
                    caution(f"{run.name} is the mirror image of {other.name}, noise included: not a second run.")
                )
        seen.append((run, record, sizes))
    return faults, remarks


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
    remedy = first.remedy + (", or leave such runs out with --keep-going" if can_leave_out else "")
    return InputError(first.source, first.place, "; ".join(said), remedy)


def read_campaign_file(path: Path) -> tuple[CampaignFile, dict[str, SpeltColumn]]:
    """The checked form of ``campaign.toml`` and how it spells its columns of averages; raises as `campaign_file`."""
    return campaign_file(parsed_toml(read_text(path), path), path)


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
    return read_campaign_file(path)[0]


def read_captive_run(
    path: Path, sheet: RunSheet, test: TankTest, columns: Mapping[str, ColumnEntry | str], files: FilesSection
) -> CaptiveRun:
    """Read one captive run from its file.

    `path`: The file, of any layout (:func:`tank2sim.records.run_tables.read_run_table`); `sheet`: What the test sheet
    says of it; `test`: Signs, speed and delay; `columns`: Column of the file to its quantity; `files`: Layout of text
    files.

    Raises InputError: The file cannot be read, or lacks a column.
    """
    table = read_run_table(path, columns, files)
    time = table.increasing("t_s") - float(table.column("t_s")[0])
    to_port = test.rudder_sign == "port"
    if to_port and sheet.rudder_rad is not None:
        sheet = sheet.model_copy(update={"rudder_rad": -sheet.rudder_rad})
    rudder, speed, y, psi, recorded = (
        _optional(table, name) for name in ("delta_rad", "speed_mps", "y_m", "psi_rad", "propeller_radps")
    )
    if rudder is None:
        rudder = np.full(len(time), sheet.rudder_rad or 0.0)
    elif to_port:
        rudder = -rudder
    speed = np.full(len(time), test.speed_mps) if speed is None else speed
    revolutions = sheet.propeller_radps if sheet.propeller_radps is not None else test.propeller_radps
    revolutions = revolutions if recorded is None else float(np.mean(recorded))
    return CaptiveRun(
        name=sheet.file,
        type=sheet.type,
        sheet=sheet,
        time_s=time,
        v_mps=_sway_velocity(table, sheet, (time, y, speed)),
        r_radps=_yaw_rate(table, sheet, psi, time),
        speed_mps=speed,
        delta_rad=rudder,
        **{column: test.sense * _filled(table, column) for column in _FORCE_COLUMNS.values()},
        y_m=y,
        psi_rad=psi,
        propeller_radps=revolutions,
        thrust_N=_optional(table, "thrust_N"),
        rudder_normal_force_N=_optional(table, "rudder_normal_force_N"),
        torque_Nm=_optional(table, "torque_Nm"),
        heel_rad=sheet.heel_rad or 0.0,
        force_delay_s=test.force_delay_s,
    )


def _yaw_rate(table: CsvTable, sheet: RunSheet, psi: Array | None, time: Array) -> Array:
    """Yaw rate (n,), rad/s: as recorded, by the sheet of a steady turn, or the slope of the heading."""
    recorded = _optional(table, "r_radps")
    if recorded is not None:
        return recorded
    if sheet.type == "steady_turn" and sheet.yaw_rate_radps is not None:
        return np.full(len(time), sheet.yaw_rate_radps)
    if sheet.type not in ("pure_yaw", "yaw_with_drift", "steady_turn"):
        return np.zeros(len(time))
    if psi is None:
        raise InputError(table.path, "header", "there is neither r_radps nor psi_rad", "add one of them")
    return np.asarray(np.gradient(np.unwrap(psi), time))


def _filled(table: CsvTable, name: str) -> Array:
    values = table.column(name)
    empty = np.flatnonzero(np.isnan(values))
    if empty.size:
        raise InputError(table.path, table.place(int(empty[0]), name), "is empty", "give each row its value")
    return values


def _optional(table: CsvTable, name: str) -> Array | None:
    return _filled(table, name) if name in table.columns else None


def _sway_velocity(table: CsvTable, sheet: RunSheet, motion: tuple[Array, Array | None, Array]) -> Array:
    """v as measured; else from the position (pure sway), or from the drift angle of the sheet."""
    time, y, speed = motion
    measured = _optional(table, "v_mps")
    if measured is not None:
        return measured
    if sheet.type == "pure_sway":
        if y is None:
            raise InputError(table.path, "header", "there is neither v_mps nor y_m", "add one of them")
        return np.asarray(np.gradient(y, time))
    drifts = ("static_drift", "drift_and_rudder", "steady_turn", "yaw_with_drift")
    if sheet.drift_rad is None and sheet.type in drifts:
        raise InputError(table.path, "header", "there is no v_mps, and the campaign gives no drift", "give one of them")
    return np.asarray(-speed * np.sin(sheet.drift_rad or 0.0))


def _averaged_run(condition: Condition, form: CampaignFile) -> CaptiveRun:
    assert form.averages is not None
    kind: RunType = "drift_and_rudder"
    if condition.yaw_rate_radps:
        kind = "steady_turn"
    elif condition.rudder_rad == 0.0:
        kind = "static_drift"
    elif condition.drift_rad == 0.0:
        kind = "static_rudder"
    sense = form.test.sense
    sheet = RunSheet(file=form.averages.file, type=kind, drift_rad=condition.drift_rad, rudder_rad=condition.rudder_rad)
    return CaptiveRun(
        name=condition.name,
        type=kind,
        sheet=sheet,
        time_s=np.zeros(1),
        v_mps=np.array([-condition.speed_mps * np.sin(condition.drift_rad)]),
        r_radps=np.array([condition.yaw_rate_radps]),
        speed_mps=np.array([condition.speed_mps]),
        delta_rad=np.array([condition.rudder_rad]),
        X_N=sense * np.array([condition.X_N]),
        Y_N=sense * np.array([condition.Y_N]),
        N_Nm=sense * np.array([condition.N_Nm]),
        propeller_radps=condition.propeller_radps,
        heel_rad=condition.heel_rad,
    )
