"""Stretches of a voyage as trial files."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np

from tank2sim.apps.logs.clock import utc_text
from tank2sim.apps.logs.quantities import QUANTITIES
from tank2sim.apps.logs.reference import held, interpolated, thinned_series
from tank2sim.apps.logs.stretches import LEAST_TRIAL_ROWS, Stretch, StretchKind
from tank2sim.apps.logs.voyage import QuantitySeries, Voyage, drift_current
from tank2sim.arrays import Array
from tank2sim.records.signals.sampling import GAP_STEPS
from tank2sim.records.signals.writing import trial_text
from tank2sim.records.trials import MEASURED_COLUMNS, RUDDERS, TRIAL_SIGNALS, Trial, usual_step

CUT_BY = "cut by tank2sim"
"""Words in a comment of every trial that is cut from a log."""

_HEAD_LINES = 100  # Lines of a file in which the comments of a trial are looked for

LEAD_S = 5.0
"""Time before the execute with which a trial begins, s. Project choice: long enough to see the approach, too short for
a disturbance before it to matter."""

SHORTEST_STEP_S = 0.1
"""Least step of a trial, s; denser streams are averaged. Project choice: no vessel yaws faster, and files are small."""

LONGEST_STEP_S = 1.0
"""Largest step of a trial, s: slower streams leave empty cells. Project choice: rudders move within seconds."""

PREDICTABLE_S = 40.0
"""Length from which a trial of a craft is one by itself, s: ten in which a filter finds its state, and a prediction."""

_HELD = ("rudder_order", "rpm_order", "thrust_order_port", "thrust_order_starboard")

# Columns of vessels with two thrusters, and their factors: the trial format has none for them
_THRUSTER_COLUMNS = {
    "rpm_port": ("n_port_rpm", 60 / (2 * math.pi)),
    "rpm_starboard": ("n_starboard_rpm", 60 / (2 * math.pi)),
    "thrust_order_port": ("order_port", 1.0),
    "thrust_order_starboard": ("order_starboard", 1.0),
}


@dataclass(frozen=True, eq=False)
class TrialCut:
    """Stretches as a trial.

    Parameters
    ----------
    stretches : tuple of Stretch
        One; of a craft several that follow each other.
    trial : Trial
        Times from its begin; signals in SI.
    begins_s : float
        Time of its first row on the voyage's clock.
    text : str
        The file.
    steered : bool
        Whether it has a rudder, as the trial format asks; a craft with two thrusters has none.
    """

    stretches: tuple[Stretch, ...]
    trial: Trial
    begins_s: float
    text: str
    steered: bool


def cut_trials(voyage: Voyage, stretches: tuple[Stretch, ...], first: int = 1) -> list[TrialCut]:
    """Cut the stretches that excite the vessel into trials, in the order of time, with numbers from the `first` on.

    The rows of a trial have an even step, the heading's between :data:`SHORTEST_STEP_S` and
    :data:`LONGEST_STEP_S`. Each sample of a slower stream is in the nearest row, by a straight line to its neighbour at
    the time of the row; rows without a sample are empty. Orders hold. Nothing is bridged over gaps.

    A craft without a rudder does not make the manoeuvres of ships, and its motion is predicted for longer than one of
    them: stretches that follow each other go together until they last :data:`PREDICTABLE_S`.
    """
    cuts: list[TrialCut] = []
    steered = any(name in voyage.series for name in ("rudder_angle", "rudder_order"))
    for place, length in _places(stretches, whole=not steered):
        before = stretches[place - 1] if place else None
        lead = 0.0 if before is None else min(LEAD_S, before.duration_s)
        cut = _cut(voyage, stretches[place : place + length], stretches[place].begin_s - lead, first + len(cuts))
        if cut is not None:
            cuts.append(cut)
    return cuts


def _places(stretches: Sequence[Stretch], whole: bool) -> Iterator[tuple[int, int]]:
    """First stretch of each trial and how many it has: one that excites the vessel, or several."""
    place = 0
    while place < len(stretches):
        first, end = stretches[place], place + 1
        if whole and first.kind.excites:
            for last, following in pairwise(stretches[place:]):
                apart = following.kind is StretchKind.REST or following.begin_s != last.end_s
                if apart or last.end_s - first.begin_s >= PREDICTABLE_S:
                    break
                end += 1
            while not stretches[end - 1].kind.excites:
                end -= 1
        if first.kind.excites:
            yield place, end - place
        place = end


def _cut(voyage: Voyage, stretches: tuple[Stretch, ...], begin: float, number: int) -> TrialCut | None:
    """A trial of stretches that begins at a time; None where it is too short, or lacks orders or a measured motion."""
    series = dict(voyage.series)
    clock = next((series[name] for name in ("heading", "yaw_rate", "x", "sog") if name in series), None)
    if clock is None:
        return None
    step = float(np.clip(usual_step(clock.time_s), SHORTEST_STEP_S, LONGEST_STEP_S))
    at = _rows(clock.time_s, begin, stretches[-1].end_s, step)
    if len(at) < LEAST_TRIAL_ROWS:
        return None
    signals = _signals(series, at, step)
    thrusters = {
        column: factor * _sampled(series[name], at, step, name)
        for name, (column, factor) in _THRUSTER_COLUMNS.items()
        if name in series
    }
    steered = not signals.keys().isdisjoint(RUDDERS)
    if signals.keys().isdisjoint(MEASURED_COLUMNS) or not (steered or thrusters):
        return None
    name = f"{number:02d}_run" if len(stretches) > 1 else _name(number, stretches[0], steered)
    first = float(at[0])
    trial = Trial(Path(f"{name}.csv"), np.round(at - first, 6), signals)
    text = trial_text(trial, _remarks(voyage, stretches, first), thrusters)
    return TrialCut(stretches, trial, first, text, steered)


def _rows(time_s: Array, begin: float, end: float, step: float) -> Array:
    """Times of the rows of a trial (n,), the first at a sample of its clock or whole steps before."""
    first = time_s[np.clip(np.searchsorted(time_s, begin), 0, len(time_s) - 1)]
    first -= step * math.floor((first - begin) / step)
    return np.asarray(first + step * np.arange(math.floor((end - first) / step + 1e-6) + 1))


def _signals(series: dict[str, QuantitySeries], at: Array, step: float) -> dict[str, Array]:
    """Signals of the trial format at the rows (n,), those that the log has."""
    if "rpm" in series:  # the format has ordered revolutions
        series.setdefault("rpm_order", series["rpm"])
    columns = {name: quantity.column for name, quantity in QUANTITIES.items()}
    columns |= {"rpm": "", "rpm_order": columns["rpm"]} | dict.fromkeys(_redundant(series), "")
    sampled = {columns.get(name): _sampled(entry, at, step, name) for name, entry in series.items()}
    return {name: sampled[name] for name in TRIAL_SIGNALS if name in sampled and np.isfinite(sampled[name]).any()}


def _redundant(series: Mapping[str, QuantitySeries]) -> tuple[str, ...]:
    """Velocities over the ground that the better record, the positions, holds already."""
    ground = ("u_ground", "v_ground")
    if "x" not in series or "y" not in series:
        return ()
    if "u_water" in series:
        return (*ground, "sog", "cog")
    return ground if "sog" in series and "cog" in series else ()


def _name(number: int, stretch: Stretch, steered: bool) -> str:
    if math.isnan(stretch.rudder_rad) or stretch.kind.value in ("accelerate", "coast", "stop", "astern"):
        return f"{number:02d}_{stretch.kind}"
    level = math.degrees(stretch.rudder_rad) if steered else 100 * stretch.rudder_rad
    return f"{number:02d}_{stretch.kind}_{level:+z.0f}"


def _remarks(voyage: Voyage, stretches: Sequence[Stretch], first: float) -> list[str]:
    begin, end = stretches[0].begin_s, stretches[-1].end_s
    logs = ", ".join(log.path.name for log in voyage.logs)
    remarks: list[str] = [*voyage.faults]
    remarks.append(f"{', '.join(dict.fromkeys(one.kind for one in stretches))}, {CUT_BY} from {logs}")
    if voyage.dated:
        remarks.append(f"begins: {utc_text(first)}")
    remarks.append(f"execute: {begin - first:.2f}")
    if voyage.origin_deg:
        remarks.append(f"origin: {voyage.origin_deg[0]:g} {voyage.origin_deg[1]:g}")
    if current := drift_current(voyage, begin, end):
        remarks.append(f"current {current.speed_mps:.2f} m/s towards {current.direction_deg:.0f} deg, by {current.by}")
    if "rpm" in voyage.series and "rpm_order" not in voyage.series:
        remarks.append("n_rpm are measured revolutions, not ordered")
    return remarks


def _sampled(entry: QuantitySeries, at: Array, step: float, name: str) -> Array:
    """Values (n,) at the rows: orders held, dense streams interpolated, of slow ones a sample in the nearest row."""
    near = (entry.time_s >= at[0] - 60) & (entry.time_s <= at[-1] + 60)
    time, values = entry.time_s[near], entry.values[near]
    if not len(time):
        return np.full(len(at), np.nan)
    if name in _HELD:
        return held(at, time, values)
    circular = name in ("cog", "wind_rel_direction", "wind_direction")
    if circular:
        values = np.unwrap(values)
    if usual_step(time) < 0.75 * step:
        time, values = thinned_series(time, values, step)
    own_step = usual_step(time)
    found = interpolated(at, time, values, max(GAP_STEPS * step, 1.5 * own_step))
    # A rudder angle drives the vessel, and moves evenly between its samples.
    if own_step > 1.5 * step and name != "rudder_angle":
        rows = np.clip(np.round((time - at[0]) / step).astype(int), 0, len(at) - 1)
        sampled = np.zeros(len(at), dtype=bool)
        sampled[rows[(time >= at[0] - step / 2) & (time <= at[-1] + step / 2)]] = True
        found = np.where(sampled, found, np.nan)
    return np.mod(found, 2 * math.pi) if circular else found


def remove_earlier_trials(folder: Path, written: Iterable[Path]) -> list[str]:
    """Remove the trials that an earlier run cut into a folder and this one did not write; return their names.

    Only files that say in their comments that they were cut by tank2sim are removed; files of this run, `written`,
    stay.
    """
    removed = []
    for path in sorted(set(folder.glob("[0-9][0-9]*_*.csv")) - set(written)):
        with path.open(encoding="utf-8", errors="replace") as file:
            cut = any(CUT_BY in line for line in itertools.islice(file, _HEAD_LINES) if line.startswith("#"))
        if cut:
            path.unlink()
            removed.append(path.name)
    return removed
