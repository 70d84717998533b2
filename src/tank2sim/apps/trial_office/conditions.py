"""Conditions of a trial (MSC.137(76), MSC/Circ.1053, ISO 13643-2), each with its limit; none refuses a trial."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from tank2sim.apps.trial_office.notes import TrialNotes
from tank2sim.apps.trial_office.tried import Tried, logged_speed
from tank2sim.records.trials import straight_over_gaps
from tank2sim.simulation.manoeuvres import Stop, Turn, Zigzag

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

    `trim_m`: by the stern; `draughts_recorded`: false where nobody recorded the draughts (the card's are then taken);
    `wind_speed_mps`, `wind_from_rad`: by the records, else by the notes.
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
    def wind(self) -> tuple[float, float] | None:
        """Speed, m/s, and where it comes from, rad; None where one of both is unknown."""
        speed, origin = self.wind_speed_mps, self.wind_from_rad
        return None if speed is None or origin is None else (speed, origin)

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
    """Each condition, judged by trials without the current: the test speed is a speed through the water."""
    turns = [one for one in trials if isinstance(one.manoeuvre, Turn) and one.record is not None]
    stated = state.draughts_recorded
    values = (
        notes.depth_m and notes.depth_m / state.draught_m,
        state.wind_speed_mps,
        notes.sea_state,
        100 * (state.draught_m / state.full_load_draught_m - 1) if stated else None,
        state.trim_m if stated else None,
        _test_speed(notes, trials),
        _least(map(_approach, trials)),
        _least(one.turned_deg for one in turns),
        _least(map(_first_rudder_deg, turns)),
        _both_sides(trials),
        notes.engine_untouched,
    )
    return tuple(_condition(row, value, state) for row, value in zip(_REQUIRED, values, strict=True))


def _least(values: Iterable[float | None]) -> float | None:
    return min((value for value in values if value is not None), default=None)


_CIRCULAR, _RESOLUTION, _ISO = "MSC/Circ.1053", "MSC.137(76)", "ISO 13643-2"
_Requirement = tuple[str, str, str, str, Callable[[float, TrialState], bool]]
_REQUIRED: tuple[_Requirement, ...] = (
    ("deep water", f"depth over {DEPTH_OVER_DRAUGHT:g} draughts", _CIRCULAR, "{:.1f} draughts",
     lambda value, _: value > DEPTH_OVER_DRAUGHT),
    ("wind speed", f"below {STRONGEST_WIND:g} m/s (Beaufort 5)", _CIRCULAR, "{:.1f} m/s",
     lambda value, _: value < STRONGEST_WIND),
    ("sea state", f"up to sea state {HIGHEST_SEA_STATE}", _CIRCULAR, "sea state {:d}",
     lambda value, _: value <= HIGHEST_SEA_STATE),
    ("draught", "full load within 5 %", _CIRCULAR, "{:+.1f} %", lambda value, _: abs(value) <= 100 * DRAUGHT_SHARE),
    ("trim by the stern", "even keel", _RESOLUTION, "{:+.2f} m",
     lambda value, state: abs(value) <= DRAUGHT_SHARE * state.draught_m),
    ("test speed", "at least 90 % of that at 85 % MCR", _RESOLUTION, "{:.0f} %",
     lambda value, _: value >= 100 * TEST_SPEED_SHARE),
    ("approach", f"steady for {APPROACH_S:g} s", _ISO, "{:.0f} s", lambda value, _: value >= APPROACH_S),
    ("turns", f"{FULL_CIRCLES_DEG:g} deg of heading", _CIRCULAR, "{:.0f} deg",
     lambda value, _: value >= FULL_CIRCLES_DEG - 1),
    ("rudder of the turns", "35 deg, or the largest", _RESOLUTION, "{:.1f} deg",
     lambda value, state: value >= _RUDDER_SHARE * math.degrees(state.largest_rudder_rad)),
    ("both sides", "each manoeuvre to port and starboard", _RESOLUTION, "", lambda value, _: bool(value)),
    ("engine", "its setting left alone", _ISO, "", lambda value, _: bool(value)),
)  # fmt: skip
"""A condition, its requirement, who asks for it, the form of its value (a truth value has none), and its limit."""


def _condition(row: _Requirement, value: float | None, state: TrialState) -> TrialCondition:
    """A condition of :data:`_REQUIRED` by its value."""
    name, required, source, form, allowed = row
    if value is None:
        return TrialCondition(name=name, required=required, found="", met=Met.UNKNOWN, source=source)
    found = form.format(value) if form else "yes" if value else "no"
    verdict = Met.MET if allowed(value, state) else Met.NOT_MET
    return TrialCondition(name=name, required=required, found=found, met=verdict, source=source)


def _test_speed(notes: TrialNotes, trials: Sequence[Tried]) -> float | None:
    """The slowest approach over the speed at 85 % of the largest output, %."""
    slowest = min((one.speed_mps for one in trials if one.trial is not None), default=None)
    return 100 * slowest / notes.speed_85_mcr_mps if slowest and notes.speed_85_mcr_mps else None


def _both_sides(trials: Sequence[Tried]) -> bool | None:
    """Whether each turn and zigzag was made to both sides; None without one."""
    sides: dict[tuple[int, ...], set[str]] = {}
    for one in trials:
        if not isinstance(one.manoeuvre, Stop):
            sides.setdefault(_to_five_degrees(one.manoeuvre), set()).add(one.side)
    return all(len(each) == 2 for each in sides.values()) if sides else None


def _first_rudder_deg(turn: Tried) -> float:
    return 0.0 if isinstance(turn.manoeuvre, Stop) else abs(math.degrees(turn.manoeuvre.rudder))


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
    if (logged := logged_speed(one.trial)) is not None:
        speed = logged[before]
        steady &= np.array([np.std(speed[row:]) for row in range(len(speed))]) <= _STEADY_SHARE * abs(one.speed_mps)
    return float(one.begin_s - time[before][np.argmax(steady)])
