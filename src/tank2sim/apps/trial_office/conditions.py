"""Conditions of a trial (MSC.137(76), MSC/Circ.1053, ISO 13643-2), each with its limit; none refuses a trial."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from tank2sim.apps.trial_office.notes import TrialNotes
from tank2sim.apps.trial_office.tried import Tried
from tank2sim.simulation.manoeuvres import Stop, Turn, Zigzag
from tank2sim.simulation.recorded import straight_over_gaps

DEPTH_OVER_DRAUGHT = 4.0
BEAUFORT = (0.3, 1.6, 3.4, 5.5, 8.0, 10.8, 13.9, 17.2, 20.8, 24.5, 28.5, 32.7)
"""Least mean wind of Beaufort 1, 2, ..., m/s (World Meteorological Organization)."""
STRONGEST_WIND = BEAUFORT[5]
"""m/s: the end of Beaufort 5 (MSC/Circ.1053, 2.2)."""
HIGHEST_SEA_STATE = 4
DRAUGHT_SHARE = 0.05
"""Deviation from the draught at full load that counts as full load (MSC/Circ.1053, 2.2); the same of the trim, for
which the circular has no number (project choice)."""
TEST_SPEED_SHARE = 0.9
"""Least test speed over that at 85 % of the largest output (MSC.137(76), 4.2)."""
APPROACH_S = 120.0
"""Least straight and steady approach (ISO 13643-2)."""
FULL_CIRCLES_DEG = 720.0
"""Least change of heading of a turn from which a current is found (MSC/Circ.1053, 3.4.2)."""
_STEADY_DEG, _STEADY_SHARE = 1.0, 0.03
"""Standard deviations of heading and speed of a steady approach. Project choice: a helmsman's on a calm day."""
_RUDDER_SHARE = 0.98
"""Rudder of a turn over the largest, from which it counts as that. Project choice: the error of an indicator."""


class Met(StrEnum):
    """Whether a condition was met."""

    MET = "met"
    NOT_MET = "not met"
    UNKNOWN = "not recorded"


@dataclass(frozen=True, kw_only=True)
class TrialCondition:
    """A condition: the requirement with its limit, the value found as text, whether it was met, and who asks for it."""

    name: str
    required: str
    found: str
    met: Met
    source: str


@dataclass(frozen=True, kw_only=True)
class TrialState:
    """The ship as tried.

    Parameters
    ----------
    draught_m, trim_m, full_load_draught_m : float
        The trim is by the stern.
    length_m : float
    largest_rudder_rad : float
    draughts_recorded : bool
        False where nobody recorded the draughts: the card's are then taken.
    wind_speed_mps, wind_from_rad : float or None
        By the records, else by the notes.
    """

    draught_m: float
    trim_m: float
    full_load_draught_m: float
    length_m: float
    largest_rudder_rad: float
    draughts_recorded: bool
    wind_speed_mps: float | None
    wind_from_rad: float | None

    @property
    def draughts_at_ends_m(self) -> tuple[float, float]:
        """Draughts forward and aft."""
        return self.draught_m - self.trim_m / 2, self.draught_m + self.trim_m / 2

    @property
    def at_full_load(self) -> bool:
        """True within :data:`DRAUGHT_SHARE` of the draught at full load on even keel."""
        apart = max(abs(self.draught_m - self.full_load_draught_m), abs(self.trim_m))
        return apart <= DRAUGHT_SHARE * self.full_load_draught_m * (1 + 1e-9)


def trial_conditions(state: TrialState, notes: TrialNotes, trials: Sequence[Tried]) -> tuple[TrialCondition, ...]:
    """Judge each condition.

    Parameters
    ----------
    state : TrialState
    notes : TrialNotes
    trials : sequence of Tried
        Without the current: the test speed is a speed through the water.
    """
    turns = [one for one in trials if isinstance(one.manoeuvre, Turn) and one.record is not None]
    speeds = [one.speed_mps for one in trials if one.trial is not None]
    slowest = min(speeds, default=None)
    stated = notes.speed_85_mcr_mps
    test = stated and slowest and slowest / stated
    depth = notes.depth_m and notes.depth_m / state.draught_m
    turned = min((angle for one in turns if (angle := one.turned_deg) is not None), default=None)
    rudder = min((abs(one.manoeuvre.rudder) for one in turns if not isinstance(one.manoeuvre, Stop)), default=None)
    sides: dict[tuple[int, ...], set[str]] = {}
    for one in trials:
        if not isinstance(one.manoeuvre, Stop):
            sides.setdefault(_to_five_degrees(one.manoeuvre), set()).add(one.side)
    both = all(len(each) == 2 for each in sides.values()) if sides else None
    away, trim = state.draught_m / state.full_load_draught_m - 1, state.trim_m
    shown = (100 * away, trim) if state.draughts_recorded else (None, None)
    circular, standards, iso = "MSC/Circ.1053", "MSC.137(76)", "ISO 13643-2"
    approaches = [_approach(one) for one in trials]
    known = [one for one in approaches if one is not None]
    return (
        _judged("deep water", f"depth over {DEPTH_OVER_DRAUGHT:g} draughts", depth, "{:.1f} draughts", circular).when(
            depth is not None and depth > DEPTH_OVER_DRAUGHT
        ),
        _judged(
            "wind speed",
            f"below {STRONGEST_WIND:g} m/s (Beaufort 5)",
            state.wind_speed_mps,
            "{:.1f} m/s",
            circular,
        ).when(state.wind_speed_mps is not None and state.wind_speed_mps < STRONGEST_WIND),
        _judged("sea state", f"up to sea state {HIGHEST_SEA_STATE}", notes.sea_state, "sea state {:d}", circular).when(
            notes.sea_state is not None and notes.sea_state <= HIGHEST_SEA_STATE
        ),
        _judged("draught", "full load within 5 %", shown[0], "{:+.1f} %", circular).when(abs(away) <= DRAUGHT_SHARE),
        _judged("trim by the stern", "even keel", shown[1], "{:+.2f} m", standards).when(
            abs(trim) <= DRAUGHT_SHARE * state.draught_m
        ),
        _judged("test speed", "at least 90 % of that at 85 % MCR", test and 100 * test, "{:.0f} %", standards).when(
            bool(test and test >= TEST_SPEED_SHARE)
        ),
        _judged("approach", f"steady for {APPROACH_S:g} s", min(known, default=None), "{:.0f} s", iso).when(
            bool(known) and min(known) >= APPROACH_S
        ),
        _judged("turns", f"{FULL_CIRCLES_DEG:g} deg of heading", turned, "{:.0f} deg", circular).when(
            turned is not None and turned >= FULL_CIRCLES_DEG - 1
        ),
        _judged(
            "rudder of the turns", "35 deg, or the largest", rudder and math.degrees(rudder), "{:.1f} deg", standards
        ).when(bool(rudder and rudder >= _RUDDER_SHARE * state.largest_rudder_rad)),
        _judged("both sides", "each manoeuvre to port and starboard", both, "{}", standards).when(bool(both)),
        _judged("engine", "its setting left alone", notes.engine_untouched, "{}", iso).when(
            bool(notes.engine_untouched)
        ),
    )


@dataclass(frozen=True)
class _judged:
    """A condition, with its value if known."""

    name: str
    required: str
    value: float | int | bool | None
    form: str
    source: str

    def when(self, met: bool) -> TrialCondition:
        """The condition, met or not."""
        if self.value is None:
            found, verdict = "", Met.UNKNOWN
        else:
            words = {True: "yes", False: "no"}.get(self.value) if isinstance(self.value, bool) else None
            found, verdict = words or self.form.format(self.value), Met.MET if met else Met.NOT_MET
        return TrialCondition(name=self.name, required=self.required, found=found, met=verdict, source=self.source)


def _to_five_degrees(manoeuvre: Turn | Zigzag) -> tuple[int, ...]:
    """Rudder and heading of a manoeuvre without its side, in steps of 5 deg."""
    angles = (manoeuvre.rudder,) if isinstance(manoeuvre, Turn) else (manoeuvre.rudder, manoeuvre.heading)
    return tuple(round(abs(math.degrees(angle)) / 5) for angle in angles)


def _approach(one: Tried) -> float | None:
    """Time before the execute for which heading and speed are steady, s."""
    if one.trial is None or "psi_rad" not in one.trial.signals:
        return None
    time = one.trial.time_s
    before = time <= one.begin_s
    if np.count_nonzero(before) < 2:
        return 0.0
    heading = np.degrees(straight_over_gaps(time, one.trial.signals["psi_rad"]))[before]
    wander = np.array([np.std(heading[row:]) for row in range(len(heading))])
    steady = wander <= _STEADY_DEG
    if "u_mps" in one.trial.signals and not np.isnan(one.trial.signals["u_mps"]).all():
        speed = straight_over_gaps(time, one.trial.signals["u_mps"])[before]
        steady &= np.array([np.std(speed[row:]) for row in range(len(speed))]) <= _STEADY_SHARE * abs(one.speed_mps)
    return float(one.begin_s - time[before][np.argmax(steady)])
