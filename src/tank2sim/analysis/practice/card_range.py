"""Where a run leaves what its card holds for, and which of its figures were read off before that."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from tank2sim.analysis.practice.standard_trials import Numbers, numbers
from tank2sim.analysis.stability.imo import HOLDS
from tank2sim.simulation.run import Run
from tank2sim.simulation.trajectory import Trajectory

_QUARTER = ("advance_m", "transfer_m", "time_90_s")
_HALF = ("tactical_diameter_m", "time_180_s")
_FIRST_HEADING = ("initial_turning_time_s", "initial_turning_distance_m")


@dataclass(frozen=True)
class Reading:
    """Figures of a run, and which of them the card holds for.

    Parameters
    ----------
    figures : mapping
        Figure by name with unit.
    read_s : mapping
        When each is settled, s from the order; the end of the run for those that are not in it.
    left_s : float or None
        When the output ``validity`` first leaves 1; None if it never does.
    """

    figures: Numbers
    read_s: Numbers
    left_s: float | None = None

    def outside(self, name: str) -> bool:
        """True if the run had left the card's range before this figure was settled."""
        return self.left_s is not None and self.read_s.get(name, math.inf) >= self.left_s

    def as_json(self) -> dict[str, object]:
        """The figures, with the names of those that are outside the card's range."""
        return {
            "figures": self.figures,
            "left_card_range_s": self.left_s,
            "outside_card_range": [name for name in self.figures if self.outside(name)],
        }


def reading(run: Run) -> Reading:
    """The figures of a run with the times at which they are settled."""
    found = numbers(run.figures)
    row = left_at(run.trajectory)
    left = None if row is None else float(run.trajectory.t[row])
    read: Numbers = {}
    for names, last in ((_QUARTER, "time_90_s"), (_HALF, "time_180_s"), (_FIRST_HEADING, "initial_turning_time_s")):
        if last in found:
            read |= dict.fromkeys(names, found[last])
    executes, waits = (run.figures.get(name) or [] for name in ("execute_times_s", "overshoot_times_s"))
    if isinstance(executes, list) and isinstance(waits, list):
        pairs = enumerate(zip(executes, waits, strict=False), start=1)
        read |= {f"overshoot_{place}_deg": begun + later for place, (begun, later) in pairs}
    return Reading(found, read, left)


def left_at(run: Trajectory) -> int | None:
    """Row at which ``validity`` first leaves 1; None if it never does, or the model does not tell it."""
    if "validity" not in run.model.outputs:
        return None
    rows = np.flatnonzero(run["validity"] < HOLDS)
    return int(rows[0]) if len(rows) else None
