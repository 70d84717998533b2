"""Tables of averages: static captive conditions, one a row, as a basin publishes them."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from tank2sim.arrays import Array
from tank2sim.cards.scaling import Scales
from tank2sim.errors import InputError
from tank2sim.files import read_all_bytes
from tank2sim.notices import Notice
from tank2sim.records.campaign_form import CampaignFile, RunSheet, RunType, SpeltColumn
from tank2sim.records.captive_record import CaptiveRun
from tank2sim.records.csv_table import LARGEST
from tank2sim.records.run_tables import RUN_QUANTITIES
from tank2sim.records.spelt_units import unit_factor
from tank2sim.records.text_layout import TextLayout, cells_of, decoded_text, lines_of_text, rows_of_text, text_layout

LEAST_FORCE = 1e-9
"""A column of forces that stays below it (N, N m or prime) was not measured. Project choice: the resistance of a model,
the smallest of them, is about 1e-3 in prime, and no gauge resolves a millionth of it."""


def read_averages(
    form: CampaignFile, spelt: Mapping[str, SpeltColumn], path: Path
) -> tuple[list[CaptiveRun], list[Notice]]:
    """Every distinct row of the table that ``[averages]`` names, and what should know of reading it.

    Only the columns that ``[averages.columns]`` names are read; others may hold text.

    `form`: The campaign's file; `spelt`: Quantity to its key in the file and the factor that brings its column to SI;
    `path`: File of the campaign, for messages and the folder of the table.

    Raises InputError: The table is missing, a column is, or a number in it cannot be.
    """
    averages = form.averages
    assert averages is not None
    file = path.parent / averages.file
    lines, columns, units = _columns(file)
    values: dict[str, list[float]] = {}
    for key, heading in averages.columns.model_dump(exclude_none=True).items():
        _refuse_missing(columns, heading, path, f"averages.columns.{spelt[key].key}")
        _refuse_other_unit(file, heading, key, units.get(heading, ""), spelt[key].factor)
        cells = _numbers(file, heading, lines, columns[heading])
        _refuse_dead_gauge(file, heading, key, cells)
        values[key] = [cell * spelt[key].factor for cell in cells]
    if (averages.rudder_sign or form.test.rudder_sign) == "port" and "rudder_rad" in values:
        values["rudder_rad"] = [-angle for angle in values["rudder_rad"]]
    table = np.column_stack(list(values.values())) + 0.0  # + 0.0 turns -0.0 into 0.0
    _, first = np.unique(table, axis=0, return_index=True)
    distinct = sorted(first.tolist())
    runs = [
        _averaged_run(dict(zip(values, table[row].tolist(), strict=True)), (file, lines[row]), form, spelt)
        for row in distinct
    ]
    repeated = len(lines) - len(distinct)
    text = Notice(
        f"{file.name}: {repeated} of {len(lines)} rows repeat another to the last digit; each is counted once."
    )
    return runs, [text] if repeated else []


def read_columns(file: Path, headings: Mapping[str, str]) -> dict[str, list[float]]:
    """Columns of a table by their headings: `headings` has key to heading, the result key to values.

    Raises InputError: The table cannot be read, lacks a column, or has text where a number is expected.
    """
    lines, columns, _ = _columns(file)
    for heading in headings.values():
        _refuse_missing(columns, heading, file, "header")
    return {key: _numbers(file, heading, lines, columns[heading]) for key, heading in headings.items()}


def _refuse_missing(columns: Mapping[str, Sequence[str]], heading: str, source: Path, place: str) -> None:
    if heading not in columns:
        problem = f"the table has no column {heading!r}"
        raise InputError(source, place, problem, f"its columns are {', '.join(columns)}")


def _columns(file: Path) -> tuple[list[int], dict[str, list[str]], dict[str, str]]:
    """Line numbers of the rows, cells by the headings of their columns, and units by these, if there are any."""
    lines = lines_of_text(decoded_text(read_all_bytes(file))[0])
    layout = _layout(file, lines)
    rows = layout.rows(lines)
    cells = [[_with_point(cell.strip(), layout.comma) for cell in cells_of(row, layout.separator)] for _, row in rows]
    columns: dict[str, list[str]] = {}
    for place, head in enumerate(layout.names):
        columns.setdefault(head, [row[place] if place < len(row) else "" for row in cells])
    return [number for number, _ in rows], columns, dict(zip(layout.names, layout.units, strict=True))


def _layout(file: Path, lines: Sequence[str]) -> TextLayout:
    """The layout of a table of averages. A CSV with commas has one header line, and columns of text may outnumber its
    numbers."""
    rows = rows_of_text(lines)
    if len(rows) < 2:
        raise InputError(file, "", "has no rows under a header", "give a header and a row for each condition")
    number, header = rows[0]
    if "," not in header or re.search("[;\t]", header):
        return text_layout(file, lines)
    names = tuple(cell.strip() for cell in cells_of(header, ","))
    return TextLayout(",", comma=False, names=names, units=("",) * len(names), skip=number)


def _with_point(cell: str, comma: bool) -> str:
    """A cell with a decimal point; one with both signs stays a text that cannot be read."""
    if not comma:
        return cell
    return f"{cell} (point)" if "." in cell else cell.replace(",", ".")


def _refuse_other_unit(file: Path, heading: str, key: str, unit: str, factor: float) -> None:
    """Refuse a unit under a heading that is not the one in which the column is read."""
    suffix = RUN_QUANTITIES.get(key.removesuffix("_left"), key.rpartition("_")[2])
    if unit in ("", "-", "1") or (key == "propeller_radps"):
        return
    size = unit_factor(unit, suffix)
    if size is None or not math.isclose(size, factor, rel_tol=1e-6):
        problem = f"is in {unit} by the row of units, and read as {key}"
        raise InputError(file, f"column {heading}", problem, "name the key with its unit (drift_deg), forces in N")


def _refuse_dead_gauge(file: Path, heading: str, key: str, cells: Sequence[float]) -> None:
    if key in ("X", "Y", "N") and max(map(abs, cells)) < LEAST_FORCE:
        remedy = "give the readings of the gauge"
        raise InputError(file, f"column {heading}", "is zero in every row: the gauge is dead", remedy)


def _numbers(file: Path, heading: str, lines: Sequence[int], cells: Sequence[str]) -> list[float]:
    """Numbers of one column."""
    values = []
    for line, text in zip(lines, cells, strict=True):
        try:
            value = float(text)
        except ValueError:
            value = math.nan
        if not abs(value) <= LARGEST:
            problem = f"{text[:30]!r} is not a number" + (f" up to {LARGEST:g}" if math.isfinite(value) else "")
            raise InputError(file, f"line {line}, column {heading}", problem, "give each condition its value")
        values.append(value)
    return values


def _averaged_run(
    at: Mapping[str, float], place: tuple[Path, int], form: CampaignFile, spelt: Mapping[str, SpeltColumn]
) -> CaptiveRun:
    """A row of averages as a run of one reading."""
    averages, (file, line) = form.averages, place
    assert averages is not None
    _refuse_far_angles(at, place, spelt)
    speed, drift, rudder = at.get("speed_mps", form.test.speed_mps), at.get("drift_rad", 0.0), at.get("rudder_rad", 0.0)
    if speed <= 0:
        raise InputError(file, f"line {line}", f"the speed is {speed:g} m/s", "a positive one was expected")
    unit = _unit_of_force(form, Scales(form.test.water_density_kgpm3, form.model.length_m, speed))
    arm = 1.0 if averages.scaling == "dimensional" else form.model.length_m
    yaw_rate = at.get("yaw_rate_radps", at.get("yaw_rate_prime", 0.0) * speed / form.model.length_m)
    to_port = 1.0 if averages.normal_force_sign == "port" else -1.0
    kind: RunType = "drift_and_rudder"
    if yaw_rate:
        kind = "steady_turn"
    elif rudder == 0.0:
        kind = "static_drift"
    elif drift == 0.0:
        kind = "static_rudder"

    def scaled(key: str, factor: float) -> Array | None:
        return np.array([at[key] * factor]) if key in at else None

    return CaptiveRun(
        name=f"{file.name} line {line}",
        type=kind,
        sheet=RunSheet(file=averages.file, type=kind, drift_rad=drift, rudder_rad=rudder),
        time_s=np.zeros(1),
        v_mps=np.array([-speed * np.sin(drift)]),
        r_radps=np.array([yaw_rate]),
        speed_mps=np.array([speed]),
        delta_rad=np.array([rudder]),
        X_N=form.test.sense * np.array([at["X"] * unit]),
        Y_N=form.test.sense * np.array([at["Y"] * unit]),
        N_Nm=form.test.sense * np.array([at["N"] * unit * arm]),
        propeller_radps=at.get("propeller_radps", form.test.propeller_radps),
        thrust_N=scaled("thrust", unit),
        rudder_normal_force_N=scaled("rudder_normal_force", unit * to_port),
        thrust_left_N=scaled("thrust_left", unit),
        rudder_normal_force_left_N=scaled("rudder_normal_force_left", unit * to_port),
        torque_Nm=scaled("torque", unit * arm),
        heel_rad=at.get("heel_rad", 0.0),
    )


def _refuse_far_angles(at: Mapping[str, float], place: tuple[Path, int], spelt: Mapping[str, SpeltColumn]) -> None:
    """Refuse a row with an angle beyond 90 deg, probably of another unit."""
    for key in ("drift_rad", "rudder_rad", "heel_rad"):
        if abs(at.get(key, 0.0)) >= math.pi / 2:
            as_given = spelt[key]
            problem = f"{as_given.key} is {at[key] / as_given.factor:g}, not within 90 deg"
            in_degrees = as_given.key != key
            remedy = "correct the row" if in_degrees else f"name its column {key[:-4]}_deg if it is degrees"
            raise InputError(place[0], f"line {place[1]}", problem, remedy)


def _unit_of_force(form: CampaignFile, scales: Scales) -> float:
    """Newtons of a force of one in the table: by 1/2 rho L^2 U^2 (prime), 1/2 rho L d U^2 (prime II), or itself."""
    assert form.averages is not None
    if form.averages.scaling == "dimensional":
        return 1.0
    draught = form.model.draught_m
    if form.averages.scaling == "prime_ii" and draught is None:
        raise InputError(form.averages.file, "model.draught_m", "is missing, by which prime_ii is scaled", "add it")
    share = (draught or 0.0) / form.model.length_m if form.averages.scaling == "prime_ii" else 1.0
    return float(scales.force) * share
