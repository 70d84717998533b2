"""One captive run, or its repeats, reduced as soon as it ends, as a result."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, get_args

from tank2sim.api.verbs import Output, verb
from tank2sim.errors import ArgumentError, InputError
from tank2sim.files import TABLE, refuse_missing
from tank2sim.quantities import SlantAngle, Speed

if TYPE_CHECKING:
    from tank2sim.records.campaign_form import CampaignFile, RunSheet, RunType, TankTest
    from tank2sim.records.captive_record import CaptiveRun
    from tank2sim.results.captive_run import CaptiveRunResult

RunName = Literal[
    "static_drift",
    "static_rudder",
    "drift_and_rudder",
    "steady_turn",
    "pure_sway",
    "pure_yaw",
    "yaw_with_drift",
    "drift",
    "rudder",
    "straight",
    "combined",
]
"""Types of run of :data:`tank2sim.records.campaign_form.RUN_TYPES`, and short names of some."""

SHORT_TYPES: dict[str, RunType] = {"drift": "static_drift", "rudder": "static_rudder", "straight": "static_drift"}
"""Short names of types of run."""

_STEADY_YAW_RADPS = 1e-6


@verb(
    "one captive run, as soon as it ends: harmonics, cycle, repeats",
    Output(
        "-o", TABLE, "Write the Fourier coefficients.", lambda result, path: {path: result.to_csv()}, "HARMONICS.csv"
    ),
    Output(
        "--cycle",
        TABLE,
        "Write the averaged cycle of the first run.",
        lambda result, path: {path: result.cycle_csv()},
        "CYCLE.csv",
    ),
    name="run",
    results=("tank2sim.results.captive_run:CaptiveRunResult",),
)
def reduce_runs(
    runs: str | Path | Sequence[str | Path],
    *,
    type: RunName | None = None,
    campaign: str | Path | None = None,
    force_convention: Literal["on_model", "on_gauge", "hydrodynamic"] | None = None,
    speed_mps: Speed | None = None,
    drift_deg: SlantAngle | None = None,
    rudder_deg: SlantAngle | None = None,
) -> CaptiveRunResult:
    """Reduce one captive run by itself to Fourier coefficients with errors, an averaged cycle and a residual.

    Several files are repeats of one run. Their differences are compared with the noise within them.

    Parameters
    ----------
    runs : path or sequence of paths
        Files of the run, of any layout that ``campaign.toml`` may have.
    type : str, optional
        Type of the run; by default as in the campaign. ``combined`` is ``yaw_with_drift`` if the model yaws, else
        ``drift_and_rudder``.
    campaign : path, optional
        ``campaign.toml`` with tank, model, signs and columns; the run need not be in it.
    force_convention : str, optional
        Sign convention of the forces, if no campaign is given; by default ``on_gauge``.
    speed_mps : float, optional
        Test speed, m/s, if no campaign is given and the file has no speed.
    drift_deg : float, optional
        Drift angle, deg, where neither file nor campaign states it.
    rudder_deg : float, optional
        Rudder angle, deg, where neither file nor campaign states it.

    Raises
    ------
    InputError
        A file is missing or at fault, or the type is unknown.

    Examples
    --------
    >>> import tank2sim as t2s
    >>> t2s.reduce_runs("run12.csv", type="sway")
    Traceback (most recent call last):
    tank2sim.errors.ArgumentError: type: is 'sway'; did you mean pure_sway?
    """
    from tank2sim.identification.captive.single_runs import study_runs
    from tank2sim.records.campaign_form import TankTest
    from tank2sim.records.campaigns import Campaign, copied_runs, read_campaign_form
    from tank2sim.results.captive_run import CaptiveRunResult

    paths = _files(runs)
    form = None
    if campaign is not None:
        form = read_campaign_form(campaign)
        if given := "force_convention" if force_convention else "speed_mps" if speed_mps else "":
            raise ArgumentError(given, "", f"is stated by {campaign}", "leave it out")
    angles = _angles(type, {"drift_rad": drift_deg, "rudder_rad": rudder_deg})
    test = TankTest(speed_mps=speed_mps or 1.0, force_convention=force_convention or "on_gauge")
    read = [_read(path, type, form, campaign, test, angles) for path in paths]
    copies, mirrored = copied_runs(read)
    if copies:
        raise next(iter(copies.values()))
    if form is None:
        if speed_mps is None:
            _refuse_unknown_speed(paths, read)
        return CaptiveRunResult(*study_runs(read, None, mirrored))
    sections = {name: getattr(form, name) for name in ("model", "test", "tank", "uncertainty", "full_scale")}
    known = Campaign(path=Path(str(campaign)), runs=tuple(read), **sections)
    return CaptiveRunResult(*study_runs(read, known, mirrored))


def _angles(type_name: str | None, stated_deg: Mapping[str, float | None]) -> dict[str, float]:
    """Angles (rad) of those stated (deg), by the names of the result; of a straight run the others are 0."""
    straight = dict.fromkeys(stated_deg, 0.0) if type_name == "straight" else {}
    return straight | {name: math.radians(angle) for name, angle in stated_deg.items() if angle is not None}


def _files(runs: str | Path | Sequence[str | Path]) -> list[Path]:
    paths = [Path(file) for file in ([runs] if isinstance(runs, str | Path) else runs)]
    if not paths:
        raise ArgumentError("runs", "", "has no file", "give at least one run")
    if again := next((path for place, path in enumerate(paths) if path in paths[:place]), None):
        raise InputError(again, "", "is given twice", "give each run once")
    for path in paths:
        refuse_missing(path)
    return paths


def _refuse_unknown_speed(paths: Sequence[Path], runs: Sequence[CaptiveRun]) -> None:
    """Refuse runs with the speed of 1 m/s, which is put in for an unknown one."""
    for path, run in zip(paths, runs, strict=True):
        if (run.speed_mps == 1.0).all():
            raise ArgumentError("speed_mps", str(path), "states no speed", "give the speed, or a campaign")


def _read(
    path: Path,
    type_name: str | None,
    form: CampaignFile | None,
    campaign: str | Path | None,
    test: TankTest,
    angles: Mapping[str, float],
) -> CaptiveRun:
    """A run by its form; without one by `test`, and `angles` (rad) that are known."""
    import numpy as np

    from tank2sim.records.campaign_form import FilesSection, RunSheet
    from tank2sim.records.captive_record import read_captive_run

    sheet, columns, files = None, {}, FilesSection()
    if form is not None:
        folder, place = Path(str(campaign)).parent, path.resolve()
        sheet = next((sheet for sheet in form.runs if (folder / sheet.file).resolve() == place), None)
        test, columns, files = form.test, dict(form.columns), form.files
    stated: dict[str, Any] = dict(angles)
    if sheet:
        columns |= sheet.columns
        stated = sheet.model_dump(exclude={"type", "file", "columns"}) | stated
    kinds = _kinds(path, type_name, sheet)
    for kind in kinds:
        described = RunSheet(file=path.name, type=kind, **stated)
        try:
            run = read_captive_run(path, described, test, columns, files)
        except InputError:
            if kind == kinds[-1]:
                raise
            continue
        if kind == kinds[-1] or float(np.ptp(run.r_radps)) > _STEADY_YAW_RADPS:
            return run
    raise AssertionError("every type was tried")


def _kinds(path: Path, type_name: str | None, sheet: RunSheet | None) -> list[RunType]:
    """Types of run to try: the one asked for, else the campaign's."""
    from tank2sim.records.campaign_form import RUN_TYPES

    if type_name is None and sheet is None:
        raise ArgumentError("type", str(path), "is not stated", f"give one of: {', '.join(get_args(RunName))}")
    if type_name == "combined":
        return ["yaw_with_drift", "drift_and_rudder"]
    if type_name in SHORT_TYPES:
        return [SHORT_TYPES[type_name]]
    return [kind for kind in RUN_TYPES if kind == type_name] or [sheet.type for sheet in (sheet,) if sheet]
