"""One captive run, or its repeats, reduced as soon as it ends, as a result."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Literal, get_args

import numpy as np

from tank2sim.answer.parts import Table
from tank2sim.api.bounds import AngleArgument, SpeedArgument, checked
from tank2sim.api.result import OldResult, screen_table
from tank2sim.errors import InputError, close_name
from tank2sim.files import write_together
from tank2sim.identification.captive.single_runs import (
    REPEATS_DIFFER,
    FourierCoefficient,
    RepeatedCoefficient,
    SingleRun,
    repeated_coefficients,
    same_test,
    single_run,
)
from tank2sim.marks import CHECK
from tank2sim.records.campaign_form import RUN_TYPES, CampaignFile, FilesSection, RunSheet, RunType, TankTest
from tank2sim.records.campaigns import (
    FORCE_COLUMNS,
    Campaign,
    CaptiveRun,
    copied_runs,
    read_campaign_form,
    read_captive_run,
)
from tank2sim.records.thinning import drawn_columns

if TYPE_CHECKING:
    import altair as alt
    import pandas as pd

ForceConvention = Literal["on_model", "on_gauge", "hydrodynamic"]
SHORT_TYPES: dict[str, RunType] = {"drift": "static_drift", "rudder": "static_rudder", "straight": "static_drift"}
"""Short names of types of run; ``combined`` is ``yaw_with_drift`` if the model yaws, else ``drift_and_rudder``."""
TYPE_NAMES = (*RUN_TYPES, *SHORT_TYPES, "combined")
"""Every name of a type of run."""

_STEADY_YAW_RADPS = 1e-6


class CaptiveRunResult(OldResult):
    """Fourier coefficients, averaged cycle, residual and repeats of captive runs.

    Parameters
    ----------
    runs : sequence of SingleRun
    campaign : Campaign or None
        Model and test, if they were given.
    mirrored : sequence of str
        Remarks on runs that are mirror images.
    """

    command = "run"

    def __init__(self, runs: Sequence[SingleRun], campaign: Campaign | None, mirrored: Sequence[str] = ()) -> None:
        self.runs, self.campaign = tuple(runs), campaign
        notices = [*mirrored]
        notices += [f"{CHECK} {fault}" for run in runs for fault in run.faults]
        if campaign is None:
            notices.append(
                "Without a campaign the forces are as recorded, with the reaction of the model's inertia, and no "
                "derivatives are given: --campaign campaign.toml."
            )
        if len(self.runs) > 1 and not same_test(self.runs):
            notices.append("The runs are of different tests (angles, frequency, amplitude or speed): not compared.")
        odd = [row for row in self.repeats if row.chance < REPEATS_DIFFER]
        notices += [
            f"Repeats differ in {row.signal} {row.part} {row.order or ''}".rstrip()
            + f" by {row.deviation:.3g} {row.unit}, and their noise explains {row.expected:.2g} (chance "
            f"{row.chance:.1g})."
            for row in odd
        ]
        self.notices = tuple(notices)

    @cached_property
    def repeats(self) -> tuple[RepeatedCoefficient, ...]:
        """Scatter of the coefficients between the runs; empty for a single one and for runs of different tests."""
        return repeated_coefficients(self.runs) if len(self.runs) > 1 and same_test(self.runs) else ()

    @property
    def coefficients(self) -> pd.DataFrame:
        """A row each Fourier coefficient: run, signal, unit, order, cosine, sine, amplitude, phase (deg), errors."""
        import pandas as pd

        return pd.DataFrame(self._rows(), columns=_HEADS)

    def cycle(self, run: int = 0) -> pd.DataFrame:
        """Averaged cycle of a run: ``phase_deg``, and mean, standard deviation and fit of each force (N, N m).

        Parameters
        ----------
        run : int
            Place of the run.

        Raises
        ------
        InputError
            The run does not oscillate.
        """
        import pandas as pd

        found = self.runs[run]
        if not found.cycles:
            raise InputError(found.reduced.run.name, "", "does not oscillate: it has no cycle", "take a run that does")
        columns = {"phase_deg": np.degrees(found.cycles["Y"].phase_rad)}
        for force, cycle in found.cycles.items():
            columns |= {
                f"{force}_mean": cycle.mean, f"{force}_deviation": cycle.deviation, f"{force}_fit": cycle.fit
            }  # fmt: skip
        return pd.DataFrame(columns)

    def cycle_csv(self, run: int = 0) -> str:
        """The averaged cycle of a run as CSV, columns as :meth:`cycle` has them.

        Parameters
        ----------
        run : int
            Place of the run.

        Raises
        ------
        InputError
            The run does not oscillate.
        """
        text: str = self.cycle(run).to_csv(index=False, float_format="%.9g", lineterminator="\n")
        return text

    def to_csv(self, path: str | Path | None = None) -> str:
        """Return the Fourier coefficients as CSV, also written to `path`.

        Raises
        ------
        InputError
            The file cannot be written.
        """
        text = io.StringIO()
        writer = csv.writer(text, lineterminator="\n")
        writer.writerow(_HEADS)
        writer.writerows([f"{cell:.9g}" if isinstance(cell, float) else cell for cell in row] for row in self._rows())
        if path is not None:
            write_together({Path(path): text.getvalue()}, inputs=[])
        return text.getvalue()

    def content(self) -> Mapping[str, object]:
        """As :meth:`.OldResult.content`."""
        return {
            "runs": [_run_json(run) for run in self.runs],
            "repeats": [asdict(row) for row in self.repeats],
            "inertia_removed": self.campaign is not None,
            "notices": list(self.notices),
        }

    @property
    def headline(self) -> tuple[str, ...]:
        """Type, speed, frequency and periods of each run."""
        lines = []
        for run in self.runs:
            motion, record = run.reduced.motion, run.reduced.run
            swing = ""
            if record.oscillates:
                swing = f", {motion.frequency_radps:.4g} rad/s, {motion.periods} periods"
            lines.append(f"{record.name}: {record.type}, {motion.mean_speed_mps:.4g} m/s{swing}")
        return tuple(lines)

    @property
    def tables(self) -> tuple[Table, ...]:
        """Coefficients of the forces to the third order, derivatives of the run, repeats."""
        water = self.campaign is not None
        shown = {f"{force}_water" for force in FORCE_COLUMNS} if water else set(FORCE_COLUMNS)
        rows: list[list[object]] = [
            [run.reduced.run.name, _shown(each), each.order, *map(_with_error, *_values(each)), _phase(each)]
            for run in self.runs
            for each in run.coefficients
            if each.signal in shown and each.order <= _SHOWN_ORDERS
        ]
        text = "of the water, inertia removed" if water else "as recorded"
        title = f"Fourier coefficients of the forces {text}, about the leading velocity"
        tables = [screen_table(title, ("run", "force", "order", "cos", "sin", "phase (deg)"), rows, wide=True)]
        derivatives: list[list[object]] = [
            [run.reduced.run.name, name, f"{value:.5g} ± {run.derivatives.standard_errors[name]:.2g}"]
            for run in self.runs
            if run.derivatives
            for name, value in run.derivatives.values.items()
        ]
        if derivatives:
            tables.append(screen_table("Derivatives of the run alone (prime)", ("run", "", "value"), derivatives))
        if self.repeats:
            repeats: list[list[object]] = [
                [row.signal, row.part, row.order, row.mean, row.deviation, row.expected, row.chance]
                for row in self.repeats
                if row.order <= 1
            ]
            heads = ("force", "", "order", "mean", "deviation", "by noise", "chance")
            tables.append(screen_table(f"{len(self.runs)} runs compared", heads, repeats))
        return tuple(tables)

    def charts(self) -> dict[str, alt.TopLevelMixin]:
        """Averaged cycle, forces over time and residual of each run, by file stem."""
        from tank2sim.report.captive.run_page import run_charts

        return dict(run_charts(self.to_dict()))

    def _rows(self) -> list[list[object]]:
        return [
            [
                run.reduced.run.name, each.signal, each.unit, each.order, each.cosine, each.cosine_error, each.sine,
                each.sine_error, each.amplitude, each.amplitude_error, math.degrees(each.phase_rad),
                math.degrees(each.phase_error_rad),
            ]
            for run in self.runs
            for each in run.coefficients
        ]  # fmt: skip


_HEADS = (
    "run", "signal", "unit", "order", "cos", "cos_error", "sin", "sin_error", "amplitude", "amplitude_error",
    "phase_deg", "phase_error_deg",
)  # fmt: skip
_SHOWN_ORDERS = 3


def _values(each: FourierCoefficient) -> tuple[tuple[float, float], tuple[float, float]]:
    return (each.cosine, each.sine), (each.cosine_error, each.sine_error)


def _with_error(value: float, error: float) -> str:
    return f"{value:.5g} ± {error:.2g}" if error else f"{value:.5g}"


def _shown(each: FourierCoefficient) -> str:
    return f"{each.signal.partition('_')[0]} ({each.unit})"


def _phase(each: FourierCoefficient) -> str | None:
    return f"{math.degrees(each.phase_rad):.4g} ± {math.degrees(each.phase_error_rad):.2g}" if each.order else None


@checked
def reduce_runs(
    files: str | Path | Sequence[str | Path],
    *,
    type: str | None = None,
    campaign: str | Path | None = None,
    force_convention: ForceConvention | None = None,
    speed_mps: SpeedArgument | None = None,
    drift_deg: AngleArgument | None = None,
    rudder_deg: AngleArgument | None = None,
) -> CaptiveRunResult:
    """Reduce one captive run, or several repeats of it, by itself.

    Parameters
    ----------
    files : path or sequence of paths
        Files of the run, of any layout that ``campaign.toml`` may have.
    type : str, optional
        Type of the run: one of :data:`TYPE_NAMES`; by default that of the campaign's sheet.
    campaign : path, optional
        ``campaign.toml`` with tank, model, signs and columns; the run need not be in it.
    force_convention : str, optional
        Whose force the file has, if no campaign is given; by default that on the gauge.
    speed_mps : float, optional
        Test speed, if no campaign is given and the file has no speed.
    drift_deg, rudder_deg : float, optional
        Angles, where neither file nor sheet has them.

    Raises
    ------
    InputError
        A file is missing or at fault, or the type is not known.

    Examples
    --------
    >>> import tank2sim as t2s
    >>> t2s.reduce_runs("run12.csv", type="sway")
    Traceback (most recent call last):
    tank2sim.errors.InputError: type: 'sway' is not a type of run; did you mean pure_sway?
    """
    paths = [Path(files)] if isinstance(files, str | Path) else [Path(file) for file in files]
    if not paths:
        raise InputError("run", "", "has no file", "give at least one run")
    if type is not None and type not in TYPE_NAMES:
        raise InputError("type", "", f"{type!r} is not a type of run", close_name(type, TYPE_NAMES))
    if force_convention is not None and force_convention not in get_args(ForceConvention):
        known = ", ".join(get_args(ForceConvention))
        raise InputError("force_convention", "", f"{force_convention!r} is not known", f"known are: {known}")
    form = read_campaign_form(campaign) if campaign is not None else None
    if form is not None and (force_convention or speed_mps):
        raise InputError(str(campaign), "test", "has the speed and the convention of forces", "leave out the options")
    angles = {
        name: math.radians(angle)
        for name, angle in (("drift_rad", drift_deg), ("rudder_rad", rudder_deg))
        if angle is not None
    }
    if type == "straight":
        angles = {"drift_rad": 0.0, "rudder_rad": 0.0} | angles
    test = form.test if form else TankTest(speed_mps=speed_mps or 1.0, force_convention=force_convention or "on_gauge")
    if again := next((path for place, path in enumerate(paths) if path in paths[:place]), None):
        raise InputError(again, "", "is given twice", "give each run once")
    runs = [_read(path, type, form, Path(campaign) if campaign else None, test, angles) for path in paths]
    copies, mirrored = copied_runs(runs)
    if copies:
        raise next(iter(copies.values()))
    if form is None and speed_mps is None:
        for path, run in zip(paths, runs, strict=True):
            if np.ptp(run.speed_mps) == 0.0 and run.speed_mps[0] == 1.0:
                raise InputError(path, "header", "there is no speed", "give --speed, or --campaign campaign.toml")
    known_campaign = None
    if form is not None:
        known_campaign = Campaign(
            path=Path(str(campaign)),
            model=form.model,
            test=form.test,
            tank=form.tank,
            uncertainty=form.uncertainty,
            full_scale=form.full_scale,
            runs=tuple(runs),
        )
    return CaptiveRunResult([single_run(run, known_campaign) for run in runs], known_campaign, mirrored)


def _read(
    path: Path,
    type_name: str | None,
    form: CampaignFile | None,
    campaign: Path | None,
    test: TankTest,
    angles: Mapping[str, float],
) -> CaptiveRun:
    sheet = None
    if form is not None and campaign is not None:
        place = path.resolve()
        sheet = next((sheet for sheet in form.runs if (campaign.parent / sheet.file).resolve() == place), None)
    columns = {**(form.columns if form else {}), **(sheet.columns if sheet else {})}
    files = form.files if form else FilesSection()
    if type_name is None and sheet is None:
        remedy = f"give --type, one of: {', '.join(TYPE_NAMES)}"
        raise InputError(path, "", "its type is not known", remedy)
    kinds: list[RunType]
    if type_name == "combined":
        kinds = ["yaw_with_drift", "drift_and_rudder"]
    elif type_name in SHORT_TYPES:
        kinds = [SHORT_TYPES[type_name]]
    else:
        kinds = [kind for kind in RUN_TYPES if kind == type_name] or [sheet.type for sheet in (sheet,) if sheet]
    stated = sheet.model_dump(exclude={"type", "file", "columns"}) if sheet else {}
    for kind in kinds:
        described = RunSheet(file=path.name, type=kind, **{**stated, **angles})
        try:
            run = read_captive_run(path, described, test, columns, files)
        except InputError:
            if kind == kinds[-1]:
                raise
            continue
        if len(kinds) == 1 or kind == kinds[-1] or float(np.ptp(run.r_radps)) > _STEADY_YAW_RADPS:
            return run
    raise AssertionError("every type was tried")


def _run_json(run: SingleRun) -> dict[str, object]:
    motion, record = run.reduced.motion, run.reduced.run
    forces = {force: record.force(force)[motion.kept] for force in FORCE_COLUMNS}
    fits = {force: run.reduced.fitted(force) for force in FORCE_COLUMNS}
    time = record.time_s[motion.kept]
    unit = {"X": "N", "Y": "N", "N": "Nm"}
    history = {"t_s": time}
    for force in FORCE_COLUMNS:
        history |= {
            f"{force}_{unit[force]}": forces[force],
            f"{force}_fit_{unit[force]}": fits[force],
            f"{force}_residual_{unit[force]}": forces[force] - fits[force],
        }
    return {
        "name": record.name,
        "type": record.type,
        "speed_mps": motion.mean_speed_mps,
        "frequency_radps": motion.frequency_radps,
        "periods": motion.periods,
        "readings": len(time),
        "coefficients": [
            {
                **asdict(each),
                "amplitude": each.amplitude,
                "amplitude_error": each.amplitude_error,
                "phase_rad": each.phase_rad,
                "phase_error_rad": each.phase_error_rad,
            }
            for each in run.coefficients
        ],
        "cycles": {
            force: {
                "phase_rad": cycle.phase_rad,
                "mean": cycle.mean,
                "deviation": cycle.deviation,
                "fit": cycle.fit,
                "count": cycle.count,
            }
            for force, cycle in run.cycles.items()
        },
        "residual_rms": dict(run.residual_rms),
        "derivatives": None if run.derivatives is None else asdict(run.derivatives),
        "history": drawn_columns(history),
        "faults": list(run.faults),
    }
