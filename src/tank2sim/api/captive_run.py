"""One captive run, or its repeats, reduced as soon as it ends, as a result."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Literal, get_args

import numpy as np

from tank2sim.arguments import AngleArgument, SpeedArgument, checked
from tank2sim.errors import InputError, close_name
from tank2sim.identification.captive.single_runs import study_runs
from tank2sim.records.campaign_form import RUN_TYPES, CampaignFile, FilesSection, RunSheet, RunType, TankTest
from tank2sim.records.campaigns import Campaign, CaptiveRun, copied_runs, read_campaign_form, read_captive_run
from tank2sim.results.captive_run import CaptiveRunResult

ForceConvention = Literal["on_model", "on_gauge", "hydrodynamic"]
SHORT_TYPES: dict[str, RunType] = {"drift": "static_drift", "rudder": "static_rudder", "straight": "static_drift"}
"""Short names of types of run; ``combined`` is ``yaw_with_drift`` if the model yaws, else ``drift_and_rudder``."""
TYPE_NAMES = (*RUN_TYPES, *SHORT_TYPES, "combined")
"""Every name of a type of run."""

_STEADY_YAW_RADPS = 1e-6


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
        Type of the run: one of :data:`TYPE_NAMES`; by default as in the campaign's sheet.
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
    return CaptiveRunResult(*study_runs(runs, known_campaign, mirrored))


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
