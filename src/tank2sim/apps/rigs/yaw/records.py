"""Records of the yaw rig: angle and motor current of a body that is turned to a programme."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal, get_args

import numpy as np

from tank2sim.apps.rigs.yaw.programme import PAPER_PROGRAMME, PROGRAMME_KINDS, YawProgramme, full_turns
from tank2sim.arguments import PositiveArgument
from tank2sim.arrays import Array
from tank2sim.errors import InputError
from tank2sim.notices import Notice, caution
from tank2sim.quantities import (
    Duration,
    Length,
    MotorCurrent,
    TorqueConstant,
    WaterDensity,
    YawInertia,
    YawInertiaError,
)
from tank2sim.records.csv_table import CsvTable, read_table
from tank2sim.records.same_record import Likeness, Recording, has_noise, likeness
from tank2sim.units import to_si

Medium = Literal["air", "water"]

_COMMENTS = "medium programme max_rate_degps max_rate_radps rise_s settle_s start_s humps".split()
_PLAIN: Mapping[str, object] = {
    **{"torque_constant_NmpA": TorqueConstant, "inertia_kgm2": YawInertia, "inertia_error_kgm2": YawInertiaError},
    **{"max_current_A": MotorCurrent, "current_lag_s": PositiveArgument, "length_m": Length},
    "water_density_kgpm3": WaterDensity,
}
"""Comments that are numbers and no part of the programme."""


@dataclass(frozen=True, eq=False, kw_only=True)
class YawRecord:
    """One record, SI; arrays (rows,).

    Parameters
    ----------
    path : Path
        The file it comes from.
    time_s : array
        Rising.
    angle_rad : array
        Yaw angle as the encoder counts it, + clockwise.
    current_A : array
        Current of the motor, + turns clockwise.
    medium : str
        ``air`` or ``water``.
    programme : YawProgramme
        What was to be run.
    stated : bool
        As the file states it; else the programme of the paper.
    constants : dict
        What else the comments state: ``torque_constant_NmpA``, ``inertia_kgm2`` (J_zz of the body with the rotor),
        its standard error ``inertia_error_kgm2``, ``max_current_A``, ``current_lag_s``, ``length_m``,
        ``water_density_kgpm3``.
    notes : tuple of Notice
        What the user should know of the file.
    """

    path: Path
    time_s: Array
    angle_rad: Array
    current_A: Array
    medium: Medium
    programme: YawProgramme
    stated: bool
    constants: dict[str, float]
    notes: tuple[Notice, ...] = ()

    def fault(self, place: str, problem: str, remedy: str) -> InputError:
        """An error about this record, to be raised: its place, the problem, and the remedy."""
        return InputError(self.path, place, problem, remedy)


def read_yaw_record(path: Path | str | CsvTable) -> YawRecord:
    """Read ``t_s,phi_rad,current_A`` (or phi_deg), with the programme in comments.

    ``# medium: air``, ``# programme: reversing`` (or unidirectional, full_turn), ``# max_rate_degps: 15``, ``# rise_s:
    4.444``, ``# settle_s: 0.5``, ``# start_s: 0``, ``# humps: 5``, ``# torque_constant_NmpA: 0.051``, ``# inertia_kgm2:
    0.0204``, ``# inertia_error_kgm2: 0.0002``, ``# max_current_A: 1``. What the file does not state of the programme is
    as in the paper, and as many humps as the record has time for. An angle that is counted within one turn is put
    together.

    Raises
    ------
    InputError
        The table is at fault, a column is missing, a cell is empty, the time does not rise, a comment is none of
        these values, or the record is shorter than the programme.
    """
    table = read_table(path).si()
    table.refuse_misspelt_keys((*_COMMENTS, *_PLAIN))
    time = table.increasing("t_s")
    angle, current = (
        table.filled_column("phi_rad", "delete the row"),
        table.filled_column("current_A", "delete the row"),
    )
    medium = table.comments.get("medium", "water").strip().lower()
    if medium not in get_args(Medium):
        raise table.fault("comment medium", f"is {medium!r}", "write '# medium: air' or '# medium: water'")
    programme, missing = _programme(table, time)
    unknown = f"the file does not state {' and '.join(missing)} of the programme"
    notes = [f"{unknown}; the values of the published rig are used."] if missing else []
    whole = np.unwrap(angle)
    turns = int(np.count_nonzero(np.abs(np.diff(angle)) > math.pi))
    if turns:
        notes.append(f"the angle jumps by a whole turn {turns} times and is put together again.")
    return YawRecord(
        path=table.path,
        time_s=time,
        angle_rad=whole if turns else angle,
        current_A=current,
        medium="air" if medium == "air" else "water",
        programme=programme,
        stated=not missing,
        constants=table.bounded_comments(_PLAIN),
        notes=tuple(map(Notice, notes)),
    )


def refuse_copied_records(records: Sequence[YawRecord]) -> tuple[Notice, ...]:
    """Refuse a record that is another one again, also turned, cut, thinned or rounded; notices of mirror images.

    InputError names the second file, and which one it is again.
    """
    seen = [
        Recording(record.time_s, {"angle_rad": record.angle_rad, "current_A": record.current_A}) for record in records
    ]
    notices = []
    for number, record in enumerate(records):
        for before in range(number):
            alike, name = likeness(seen[number], seen[before]), records[before].path.name
            if alike is Likeness.COPY:
                remedy = "give each record once: a copy is not a second run"
                raise record.fault("", f"is the record of {name} again", remedy)
            if alike is Likeness.MIRROR and has_noise(seen[number]):
                said = f"is the mirror image of {name}, noise included, not a second run"
                notices.append(caution(f"{record.path.name} {said}."))
    return tuple(notices)


def yaw_record_text(record: YawRecord) -> str:
    """The record as the CSV file that :func:`read_yaw_record` reads."""
    flown = record.programme
    head = [f"# medium: {record.medium}", f"# programme: {flown.kind}"]
    head += [f"# max_rate_degps: {math.degrees(flown.max_rate_radps):.12g}", f"# rise_s: {flown.rise_s:.12g}"]
    head += [f"# settle_s: {flown.settle_s:g}", f"# start_s: {flown.start_s:g}", f"# humps: {flown.humps}"]
    head += [f"# {key}: {value:g}" for key, value in record.constants.items()]
    rows = zip(record.time_s.tolist(), record.angle_rad.tolist(), record.current_A.tolist(), strict=True)
    body = [f"{t:.9g},{angle:.9g},{current:.6g}" for t, angle, current in rows]
    return "\n".join([*head, "t_s,phi_rad,current_A", *body]) + "\n"


def _programme(table: CsvTable, time: Array) -> tuple[YawProgramme, list[str]]:
    """The programme, and what the file does not state of it."""
    kinds = (*PROGRAMME_KINDS, "full_turn")
    kind = table.comments.get("programme", "unidirectional").strip().lower()
    if kind not in kinds:
        problem, remedy = f"is {kind!r}", f"one of {', '.join(kinds)} was expected"
        raise table.fault("comment programme", problem, remedy)
    stated = {
        "max_rate_radps": _rate(table),
        "rise_s": table.bounded_comment("rise_s", Duration),
        "settle_s": table.comment_number("settle_s"),
        "start_s": table.comment_number("start_s"),
    }
    missing = ["max_rate_degps"] if stated["max_rate_radps"] is None else []
    missing += ["rise_s"] if stated["rise_s"] is None and kind != "full_turn" else []
    known = {key: value for key, value in stated.items() if value is not None}
    try:
        programme = replace(PAPER_PROGRAMME, humps=1, **known)  # type: ignore[arg-type]
        programme = full_turns(programme) if kind == "full_turn" else programme
        humps = _humps(table, time, programme, kind)
        whole = replace(programme, humps=humps, kind="reversing" if kind == "reversing" else "unidirectional")
    except ValueError as error:
        raise table.fault("programme", str(error), "correct the comments that describe it") from None
    return whole, missing


def _rate(table: CsvTable) -> float | None:
    """The programme's rate in rad/s, from whichever unit it is reported in; with the sign of the turn."""
    for key in ("max_rate_degps", "max_rate_radps"):
        value = table.comment_number(key)
        if value is not None:
            if value == 0:
                raise table.fault(f"comment {key}", "is 0", "give the rate that is held")
            return to_si(key, value)[1]
    return None


def _humps(table: CsvTable, time: Array, programme: YawProgramme, kind: str) -> int:
    """Number of humps in the file, stated or counted; their last braking interval is within it."""
    length = programme.pairs()[0].braking_s[1] - programme.start_s
    fit = math.floor((time[-1] - programme.start_s - length) / programme.period_s + 1e-9) + 1
    stated = table.comment_number("humps")
    humps = fit - fit % 2 if stated is None and kind == "reversing" else fit if stated is None else int(stated)
    if humps < 1 or humps > fit or time[0] > programme.pairs()[0].accelerating_s[0]:
        problem = (
            f"lasts from {time[0]:g} to {time[-1]:g} s, and {max(humps, 1)} humps of the programme take from "
            f"{programme.start_s:g} s to {programme.start_s + (max(humps, 1) - 1) * programme.period_s + length:g} s"
        )
        raise table.fault("", problem, "give the whole record, or correct start_s, rise_s or humps")
    return humps
