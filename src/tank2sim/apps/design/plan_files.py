"""Files of a captive plan: runs, the campaign template for ``reduce``; and runs of a campaign or a tank's own table."""

from __future__ import annotations

import csv
import io
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import fields
from pathlib import Path

import tomlkit

from tank2sim.apps.design.captive_design import CaptiveDesign
from tank2sim.apps.design.captive_runs import RunGroup, TankRuns, oscillation_of
from tank2sim.apps.design.study import PlannedManoeuvre, PlannedRow
from tank2sim.errors import InputError
from tank2sim.files import read_text
from tank2sim.notices import Notice
from tank2sim.records.campaign_form import RunType
from tank2sim.records.campaigns import read_campaign_form


def run_rows(design: CaptiveDesign) -> tuple[PlannedRow, ...]:
    """The runs in their order."""
    rows = []
    checks = {id(run): test.check for test in design.tests for run in test.runs}
    for number, run in enumerate(design.runs, start=1):
        swings, yaws = bool(run.motion), run.motion == "yaw"
        row = PlannedRow(
            run=number,
            file=f"run_{number:03d}.csv",
            type=run.type,
            speed_mps=_rounded(run.speed_mps),
            drift_deg=_rounded(math.degrees(run.drift_rad)),
            rudder_deg=_rounded(math.degrees(run.rudder_rad)),
            frequency_radps=_rounded_if(swings, run.frequency_radps),
            period_s=_rounded_if(swings, 2 * math.pi / (run.frequency_radps or math.inf)),
            cycles=run.cycles if swings else None,
            sway_amplitude_m=_rounded_if(swings, run.sway_amplitude_m),
            yaw_rate_amplitude_degps=_rounded_if(yaws, math.degrees(run.velocity)),
            heading_amplitude_deg=_rounded_if(yaws, math.degrees(run.heading_amplitude_rad)),
            record_s=_rounded(run.record_s),
            tank_min=_rounded(run.tank_s / 60),
            purpose="check" if checks[id(run)] else "figures",
        )
        rows.append(row)
    return tuple(rows)


def _rounded(value: float) -> float:
    return float(f"{value:.6g}") + 0.0


def _rounded_if(meant: bool, value: float) -> float | None:
    return _rounded(value) if meant else None


def plan_csv(rows: Sequence[PlannedRow | PlannedManoeuvre]) -> str:
    """The plan as CSV, a row for each run or manoeuvre; empty where a column has no meaning for it."""
    heads = ",".join(field.name for field in fields(rows[0]))
    cells = [["" if value is None else f"{value}" for value in vars(row).values()] for row in rows]
    return "\n".join([heads, *map(",".join, cells)]) + "\n"


def campaign_template(design: CaptiveDesign, rows: Sequence[PlannedRow]) -> str:
    """``campaign.toml`` of the planned runs: it lacks only their files, and what the tank alone knows."""
    runs, ship, planned = design.tank_runs, design.card.ship, design.planned
    scale = runs.length_m / ship.length_m
    document = tomlkit.document()
    document.add(tomlkit.comment("A plan by tank2sim design: correct the body, the force convention and what else"))
    document.add(tomlkit.comment("differs in the tank, put the files of the runs next to it, and reduce it."))
    document["format"] = "tank2sim-campaign/1"
    model: dict[str, object] = {"name": planned.model.name, "length_m": _rounded(runs.length_m)}
    for key in ("beam_m", "draught_m"):
        if (size := getattr(ship, key, None)) is not None:
            model[key] = _rounded(size * scale)
    for key in ("mass_kg", "yaw_inertia_kgm2", "x_G_m"):
        model[key] = _rounded(getattr(planned.model, key))
    if scale < 1:
        model["scale"] = _rounded(1 / scale)
    document["model"] = model
    document["test"] = {
        "water_density_kgpm3": planned.water_density_kgpm3,
        "gravity_mps2": planned.gravity_mps2,
        "speed_mps": _rounded(runs.speed_mps),
        "force_convention": "on_gauge",
    }
    basin = {key: value for key, value in runs.tank.tank.model_dump().items() if value is not None}
    basin.setdefault("length_m", runs.tank.carriage.length_m)
    document["tank"] = basin
    sheets = tomlkit.aot()
    for row in rows:
        sheets.append(tomlkit.item(_sheet(row)))
    document["runs"] = sheets
    return tomlkit.dumps(document)


def _sheet(row: PlannedRow) -> dict[str, object]:
    sheet: dict[str, object] = {"file": row.file, "type": row.type}
    sheet |= {"drift_deg": row.drift_deg, "rudder_deg": row.rudder_deg}
    if row.frequency_radps is not None:
        sheet["frequency_radps"] = row.frequency_radps
    if row.type == "pure_sway":
        sheet["amplitude_m"] = row.sway_amplitude_m
    elif row.yaw_rate_amplitude_degps is not None:
        sheet["yaw_rate_amplitude_degps"] = row.yaw_rate_amplitude_degps
    return sheet


def runs_of_campaign(path: Path, runs: TankRuns) -> tuple[RunGroup, ...]:
    """The runs of a campaign's sheet, as this tank would make them; the records of oscillations are as long as it can.

    Raises InputError: the campaign is at fault, has no ``[[runs]]``, or a run lacks its frequency or amplitude.
    """
    form = read_campaign_form(path)
    if not form.runs:
        raise InputError(path, "runs", "has none", "give a campaign with [[runs]]")
    sign = -1.0 if form.test.rudder_sign == "port" else 1.0
    found: list[RunGroup] = []
    scale = runs.length_m / form.model.length_m
    speeds = runs.speed_mps / form.test.speed_mps
    for number, sheet in enumerate(form.runs):
        drift, rudder = sheet.drift_rad or 0.0, sign * (sheet.rudder_rad or 0.0)
        if sheet.type in ("static_drift", "static_rudder", "drift_and_rudder"):
            found.append((runs.longest_run(sheet.type, drift=drift, rudder=rudder),))
            continue
        sways = sheet.type == "pure_sway"
        needed = ("frequency_radps", "amplitude_m" if sways else "yaw_rate_amplitude_radps")
        for key in needed:
            if getattr(sheet, key) is None:
                raise InputError(path, f"runs.{number}.{key}", "is missing", "add it: the sheet is all that is read")
        frequency, amplitude = (getattr(sheet, key) * speeds for key in needed)
        velocity = amplitude * sheet.frequency_radps if sways else amplitude / scale
        run = runs.longest_run(sheet.type, drift=drift, rudder=0.0, frequency=frequency / scale, velocity=velocity)
        found.append((run,))
    return tuple(found)


_COLUMNS = {
    "type": ("type", "test", "kind"),
    "drift": ("β", "beta", "beta_deg", "drift", "drift_deg"),
    "rudder": ("δ", "delta", "delta_deg", "rudder", "rudder_deg"),
    "sway": ("v'max", "v'", "v_prime"),
    "yaw": ("r'max", "r'", "r_prime"),
    "frequency": ("frequency_radps", "omega_radps"),
    "speed": ("u/u0", "speed_ratio"),
    "repeats": ("nrep", "repeats"),
}
"""Names of the columns, without units in brackets."""

_MOST_REPEATS = 100


def runs_of_matrix(path: Path, runs: TankRuns) -> tuple[tuple[RunGroup, ...], list[Notice]]:
    """The runs of a table as this tank would make them, at its test speed, and what was assumed of them.

    Angles are in deg, rudder positive to starboard; amplitudes of sway and yaw are v' and r'. A row is a yaw with an
    r', a sway with a v', else a steady run with drift and rudder; it is made as often as its repeats say.

    `path`: CSV with a header. Raises InputError: the file has neither drift nor rudder nor amplitudes, or a number that
    cannot be read.
    """
    table = list(csv.reader(io.StringIO(read_text(path).removeprefix("\ufeff"))))
    places = _places_of_columns(path, table[0] if table else [])
    found: list[RunGroup] = []
    assumed, slower = 0, 0
    for number, cells in enumerate(table[1:], start=2):
        if not any(cell.strip() for cell in cells):
            continue
        row = {key: _number(path, number, key, cells, place) for key, place in places.items() if key != "type"}
        repeats = row.get("repeats") or 1.0
        if not 1 <= repeats <= _MOST_REPEATS or repeats % 1:
            raise InputError(path, f"row {number}", f"has {repeats:g} repeats", f"give 1 to {_MOST_REPEATS}")
        group = _run(row, runs)
        found += [group] * int(repeats)
        assumed += group[0].oscillates and not row.get("frequency")
        slower += abs(row.get("speed") or 1.0) != 1.0
    if not found:
        raise InputError(path, "", "has no run", "give a row for each run")
    said = {
        "oscillating runs without a frequency have a middle one of this tank": assumed,
        "rows at other speeds are taken at the test speed, v' and r' as given": slower,
    }
    return tuple(found), [Notice(f"{path.name}: {count} {words}") for words, count in said.items() if count]


def _places_of_columns(path: Path, header: Sequence[str]) -> dict[str, int]:
    """Places of the columns by their keys, the first of the known names of each."""
    names = [re.sub(r"\(.*\)|\s", "", name).lower() for name in header]
    present = {key: [name for name in known if name in names] for key, known in _COLUMNS.items()}
    places = {key: names.index(known[0]) for key, known in present.items() if known}
    if not {"drift", "rudder", "sway", "yaw"} & places.keys():
        remedy = "name columns beta_deg, delta_deg, v_prime, r_prime"
        raise InputError(path, "header", "has no column of drift, rudder, v' or r'", remedy)
    return places


def _number(path: Path, number: int, key: str, cells: list[str], place: int) -> float:
    """A cell; 0 for an empty one."""
    text = cells[place].strip() if place < len(cells) else ""
    try:
        value = float(text) if text else 0.0
    except ValueError:
        value = math.nan
    if not math.isfinite(value) or (key in ("drift", "rudder") and abs(value) >= 90):
        raise InputError(path, f"row {number}", f"{text!r} is not a number of {key}", "give a number, angles in deg")
    return value


def _run(row: Mapping[str, float], runs: TankRuns) -> RunGroup:
    """The run of a row; without a frequency it has the middle one of the usual matrix."""
    drift, rudder = (math.radians(row.get(key, 0.0)) for key in ("drift", "rudder"))
    sway, yaw = (abs(row.get(key, 0.0)) for key in ("sway", "yaw"))
    if not sway and not yaw:
        kind: RunType = "static_rudder" if rudder and not drift else "drift_and_rudder" if rudder else "static_drift"
        return (runs.longest_run(kind, drift=drift, rudder=rudder),)
    kind, velocity = "pure_sway", sway * runs.speed_mps
    if yaw:
        kind, velocity = "yaw_with_drift" if drift else "pure_yaw", yaw * runs.speed_mps / runs.length_m
    motion = oscillation_of(kind)
    frequencies = runs.usual_frequencies(motion) or [runs.highest_frequency(motion)]
    frequency = row.get("frequency") or frequencies[len(frequencies) // 2]
    return (runs.longest_run(kind, drift=drift, rudder=rudder, frequency=frequency, velocity=velocity),)
