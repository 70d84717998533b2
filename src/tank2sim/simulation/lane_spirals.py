"""Direct spirals of many ships in lanes: each rudder angle is held by all ships, by each until its turn is steady."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tank2sim.arrays import Array
from tank2sim.simulation.card_range import entry_name
from tank2sim.simulation.figures import spiral_loop
from tank2sim.simulation.lane_runs import FINE, LanePlan, LaneRunner
from tank2sim.simulation.manoeuvres import SPIRAL_HOLD, STEADY_AFTER, SpiralManoeuvre, is_steady


@dataclass(frozen=True, eq=False)
class SpiralRuns:
    """What is kept of the spirals of n ships; nan where there is none.

    Parameters
    ----------
    rates : array (n, rudders)
        Yaw rate when the next rudder was ordered, rad/s.
    states : array (n, times, nx)
        At the requested times.
    left : array (n,)
        Time at which the card's range was first left, s; inf if it was not.
    fine : array (n,)
        False for a ship whose motion left all bounds.
    """

    rates: Array
    states: Array
    left: Array
    fine: NDArray[np.bool_]


class LaneSpirals:
    """Runs direct spirals of a model in lanes.

    Parameters
    ----------
    runner : LaneRunner
    """

    def __init__(self, runner: LaneRunner):
        self._runner = runner

    def run(
        self,
        spiral: SpiralManoeuvre,
        p: Array,
        starts: Array,
        inputs: Array,
        at_most: float | None = None,
        times: Sequence[float] | Array = (),
    ) -> SpiralRuns:
        """Spirals of n ships, as :meth:`tank2sim.simulation.manoeuvres.SpiralManoeuvre.drive` of each.

        Parameters
        ----------
        spiral : SpiralManoeuvre
        p, starts : arrays (n, np), (n, nx)
            Parameters and initial states.
        inputs : array (nu,)
            Inputs of the model; the rudder order among them is not used.
        at_most : float, optional
            Longest time for which a rudder is held, s; by default :data:`tank2sim.simulation.manoeuvres.SPIRAL_HOLD`
            L/u0.
        times : array (m,)
            Times at which states are kept, s, rising.
        """
        model, count, at = self._runner.model, len(p), np.asarray(times, dtype=float)
        ship_times = p[:, model.parameter_names.index("ship.length")] / p[:, model.parameter_names.index("ship.speed")]
        yaw_rate = model.state_names.index("motion.r")
        longest = SPIRAL_HOLD * ship_times if at_most is None else np.full(count, at_most)
        x, elapsed, left, fine = starts.copy(), np.zeros(count), np.full(count, np.inf), np.ones(count, dtype=np.bool_)
        rates = np.full((count, len(spiral.rudders)), np.nan)
        states = np.full((count, len(at), starts.shape[1]), np.nan)
        for place, rudder in enumerate(spiral.rudders):
            held, before, turning = np.zeros(count), np.full(count, np.inf), np.flatnonzero(fine)
            while len(turning):
                lengths = np.minimum(STEADY_AFTER * ship_times[turning], longest[turning] - held[turning])
                due, places = _due(at, elapsed[turning], elapsed[turning] + lengths)
                plan = LanePlan((rudder, rudder), "motion.psi", 1.0, 0, (), 0, inputs, due)
                no_levels, no_goals = np.zeros((len(turning), 0)), np.zeros((len(turning), 2))
                found = self._runner.runs(plan, p[turning], x[turning], lengths, no_levels, no_goals)
                fine[turning] = (found.ended == FINE) & np.isfinite(found.last).all(axis=1)
                left[turning] = np.minimum(left[turning], found.left + elapsed[turning])
                rows, columns = np.nonzero(places >= 0)
                states[turning[rows], places[rows, columns]] = found.states[rows, columns]
                x[turning] = found.last
                held[turning] += lengths
                elapsed[turning] += lengths
                rate = found.last[:, yaw_rate]
                over = longest[turning] - held[turning] <= 1e-6 * ship_times[turning]  # apart from rounding
                steady = is_steady(before[turning], rate, ship_times[turning])
                before[turning] = rate
                turning = turning[fine[turning] & ~over & ~steady]
            rates[:, place] = np.where(fine, x[:, yaw_rate], np.nan)
        return SpiralRuns(rates, states, np.where(fine, left, np.nan), fine)


def _due(times: Array, since: Array, until: Array) -> tuple[Array, NDArray[np.intp]]:
    """Times (n, m), s after `since` (n,) up to `until` (n,), and their places among all; inf and -1 after the last."""
    first, last = np.searchsorted(times, since), np.searchsorted(times, until, side="right")
    places = first[:, None] + np.arange(int(np.max(last - first, initial=0)))
    inside = places < last[:, None]
    due = np.where(inside, times[np.minimum(places, len(times) - 1)] - since[:, None], np.inf) if len(times) else places
    return np.asarray(due, dtype=float), np.where(inside, places, -1)


def spiral_figures(spiral: SpiralManoeuvre, rates: Array) -> dict[str, Array]:
    """Figures of spirals by their yaw rates (n, rudders), rad/s, as :func:`tank2sim.simulation.figures.figures_of`.

    Entries of lists have names of their own (``rate_1_degps``).
    """
    angles, degrees = np.degrees(spiral.rudders), np.degrees(rates)
    known = np.isfinite(degrees).all(axis=1)
    loops = np.full((len(degrees), 2), np.nan)
    loops[known] = [spiral_loop(angles, row) for row in degrees[known]]
    columns = {"loop_width_deg": loops[:, 0], "loop_height_degps": loops[:, 1]}
    for place, (angle, column) in enumerate(zip(np.round(angles, 9), degrees.T, strict=True)):
        columns[entry_name("rudder_deg", place)] = np.where(known, angle, np.nan)
        columns[entry_name("rate_degps", place)] = np.where(known, column, np.nan)
    return columns
