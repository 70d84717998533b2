"""Study of the missing force or signal: its points over a state, means of bins, and means over time."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from tank2sim.arrays import Array, Columns
from tank2sim.gap.outcome.study import MISSING_COLUMNS, STATE_COLUMNS, Lacking
from tank2sim.gap.result import MissingForce, MissingSignal
from tank2sim.records.thinning import drawn_columns, thin_points
from tank2sim.units import from_si

BINS = 12
"""Bins over the state that explains the missing force (project choice): a rudder's range in steps of about 6 deg."""

FORCE_POINTS = 500
"""Instants of the missing force in the JSON, of all trials together; all of them make the means."""

PARTS_OVER_TIME = 90
"""Parts of equal length in which the means over time of a trial are given."""

NORMAL = 1.959964
"""Half a 95 % interval in standard errors."""

_TURN = 2 * math.pi


def lacking_study(lacking: MissingForce | MissingSignal | None, files: Mapping[str, str]) -> Lacking | None:
    """Return ``missing_force`` or ``missing_signal`` of ``gap.json``; None if nothing is missing.

    Parameters
    ----------
    lacking : MissingForce, MissingSignal or None
        Headings become 0 to 360 deg; rows with an unknown state or value are left out of ``points`` and ``means``.
    files : mapping
        Name of a trial to its file; by default ``<name>.csv``.
    """
    if lacking is None:
        return None
    equation = lacking.equation if isinstance(lacking, MissingForce) else None
    quantity = lacking.quantity if isinstance(lacking, MissingSignal) else None
    values = lacking.force if isinstance(lacking, MissingForce) else lacking.values
    over, what = STATE_COLUMNS[lacking.explaining], MISSING_COLUMNS[equation or quantity or ""]
    state = lacking.states[lacking.explaining]
    state = from_si(over, 1.0) * (np.mod(state, _TURN) if lacking.explaining == "heading" else state)
    values = from_si(what, 1.0) * values
    trials = np.array(lacking.trials, dtype=object)
    known = np.flatnonzero(np.isfinite(state) & np.isfinite(values))
    kept = known[thin_points([state[known], values[known]], FORCE_POINTS)]
    points, over_time = {}, {}
    for trial in dict.fromkeys(lacking.trials):
        file, rows = files.get(trial, f"{trial}.csv"), trials == trial
        shown = kept[rows[kept]]
        points[file] = _columns({over: state[shown], what: values[shown]})
        over_time[file] = _over_time(lacking.time_s[rows], values[rows], what)
    return Lacking(
        equation=equation,
        quantity=quantity,
        explaining=lacking.explaining,
        explained=dict(lacking.explained),
        points=points,
        means=_columns(means_of_bins(state[known], values[known], trials[known], over=over, what=what)),
        over_time=over_time,
    )


def means_of_bins(
    state: Array, values: Array, trials: np.ndarray, *, over: str = "state", what: str = "value"
) -> dict[str, Array]:
    """Mean of the values (n,) in each of :data:`BINS` equal bins of the state (n,), with its 95 % interval.

    The interval follows from the means of the trials in the bin; nan where there is one trial alone.

    Returns
    -------
    dict
        Columns (m,): ``over`` (mean state of the bin), ``what``, ``low_95``, ``high_95`` and ``trials`` (how many).
    """
    edges = np.linspace(state.min(), state.max(), BINS + 1) if state.size else np.zeros(BINS + 1)
    place = np.clip(np.digitize(state, edges) - 1, 0, BINS - 1)
    rows: list[tuple[float, ...]] = []
    for bin_number in np.unique(place).tolist():
        inside = place == bin_number
        means = np.array([values[inside & (trials == trial)].mean() for trial in np.unique(trials[inside])])
        mean, count = float(values[inside].mean()), len(means)
        half = NORMAL * float(means.std(ddof=1)) / math.sqrt(count) if count > 1 else math.nan
        rows.append((float(state[inside].mean()), mean, mean - half, mean + half, count))
    return dict(zip((over, what, "low_95", "high_95", "trials"), np.array(rows).reshape(-1, 5).T, strict=True))


def _over_time(time_s: Array, values: Array, what: str) -> Columns:
    """Means of a trial's values over parts of equal length."""
    known = np.flatnonzero(np.isfinite(values))
    parts = np.array_split(known, min(PARTS_OVER_TIME, len(known))) if len(known) else []
    rows = [(time_s[part[0]], time_s[min(part[-1] + 1, known[-1])], float(values[part].mean())) for part in parts]
    return _columns(dict(zip(("t_start_s", "t_end_s", what), np.array(rows).reshape(-1, 3).T, strict=True)))


def _columns(columns: dict[str, Array]) -> Columns:
    return drawn_columns(columns, len(next(iter(columns.values()))))
