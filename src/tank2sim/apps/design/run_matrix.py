"""A tank's own run matrix as a table: a row for each run, with drift, rudder and amplitudes, without records."""

from __future__ import annotations

import csv
import io
import math
import re
from collections.abc import Mapping
from pathlib import Path

from tank2sim.apps.design.captive_runs import RunGroup, TankRuns
from tank2sim.errors import InputError
from tank2sim.files import read_text
from tank2sim.notices import Notice
from tank2sim.records.campaign_form import RunType

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
_FREQUENCIES, _FREQUENCY_RATIO = 3, 2.0
"""As of :meth:`.TankRuns.usual_matrix`: the middle one is taken for runs without a frequency."""


def runs_of_matrix(path: Path, runs: TankRuns) -> tuple[tuple[RunGroup, ...], list[Notice]]:
    """The runs of a table as this tank would make them, at its test speed, and what was assumed of them.

    Angles are in deg, rudder positive to starboard; amplitudes of sway and yaw are v' and r'. A row is a yaw with an
    r', a sway with a v', else a steady run with drift and rudder; it is made as often as its repeats say.

    `path`: CSV with a header. Raises InputError: the file has neither drift nor rudder nor amplitudes, or a number that
    cannot be read.
    """
    table = list(csv.reader(io.StringIO(read_text(path).removeprefix("\ufeff"))))
    names = [re.sub(r"\(.*\)|\s", "", name).lower() for name in (table[0] if table else [])]
    places = {
        key: names.index(name)
        for key, known in _COLUMNS.items()
        if (name := next((n for n in known if n in names), ""))
    }
    if not {"drift", "rudder", "sway", "yaw"} & places.keys():
        remedy = "name columns beta_deg, delta_deg, v_prime, r_prime"
        raise InputError(path, "header", "has no column of drift, rudder, v' or r'", remedy)
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
    notices = []
    if assumed:
        notices.append(
            Notice(f"{path.name}: {assumed} oscillating runs without a frequency have a middle one of this tank")
        )
    if slower:
        notices.append(
            Notice(f"{path.name}: {slower} rows at other speeds are taken at the test speed, v' and r' as given")
        )
    return tuple(found), notices


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
    drift, rudder = (math.radians(row.get(key, 0.0)) for key in ("drift", "rudder"))
    sway, yaw = (abs(row.get(key, 0.0)) for key in ("sway", "yaw"))
    if not sway and not yaw:
        kind: RunType = "static_rudder" if rudder and not drift else "drift_and_rudder" if rudder else "static_drift"
        return (runs.run(kind, runs.longest_s, drift=drift, rudder=rudder),)
    motion = "yaw" if yaw else "sway"
    frequencies = runs.frequencies(motion, _FREQUENCIES, _FREQUENCY_RATIO) or [runs.highest_frequency(motion)]
    frequency = row.get("frequency") or frequencies[len(frequencies) // 2]
    velocity = yaw * runs.speed_mps / runs.length_m if yaw else sway * runs.speed_mps
    period = 2 * math.pi / frequency
    cycles = max(math.floor(runs.longest_s / period + 1e-9), 1)
    oscillating: RunType = "pure_sway" if not yaw else "yaw_with_drift" if drift else "pure_yaw"
    return (runs.run(oscillating, cycles * period, drift=drift, rudder=rudder, frequency=frequency, velocity=velocity),)
