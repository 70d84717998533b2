"""The notes of a trial master, next to the records: loading, depth, weather, engine, and rows of the form."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field, ValidationError

from tank2sim.arguments import AngleArgument
from tank2sim.cards.form import CardSection
from tank2sim.cards.form_faults import form_fault
from tank2sim.cards.reading import parsed_toml
from tank2sim.errors import ArgumentError, InputError, close_name
from tank2sim.files import read_text
from tank2sim.quantities import Draught, SeaState, Speed, WaterDepth, WindSpeed
from tank2sim.simulation.manoeuvres import Stop, Turn, Zigzag, parse_manoeuvre

_Words = Annotated[str, Field(max_length=200)]

REPORTED = (
    *("advance_m", "transfer_m", "tactical_diameter_m", "time_90_s", "time_180_s"),
    *("overshoot_1_deg", "overshoot_2_deg", "initial_turning_distance_m"),
    *("track_reach_m", "head_reach_m", "side_reach_m", "time_to_stop_s"),
)
"""Figures of the report."""


class FormWords(CardSection):
    """``[form]``: rows of the form that only words fill."""

    administration: _Words = ""
    reference: _Words = ""
    ship_type: _Words = ""
    rudder_type: _Words = ""
    rudders: _Words = ""
    propeller_type: _Words = ""
    propellers: _Words = ""
    engine_type: _Words = ""
    ballast_condition: _Words = ""
    remarks: _Words = ""


class TrialNotes(CardSection):
    """Notes of a trial; None for what was not recorded.

    Parameters
    ----------
    draught_fore_m, draught_aft_m
        Draughts of the trial; by default the card's, on even keel.
    full_load_draught_m
        Draught at full load, even keel; by default the card's.
    depth_m
        Depth of the water.
    wind_speed_mps, wind_from_deg
        True wind, where the records have none: its mean speed, and where it comes from, clockwise from north.
    sea_state
        By the code of the WMO.
    speed_85_mcr_mps
        Speed at 85 % of the largest continuous output of the engine.
    engine_untouched
        Whether the setting of the engine was left alone during turns and zigzags.
    place, date
        Where and when.
    form
        Words for the form.
    figures
        Manoeuvre (``turn:35``, ``zigzag:-10/10``, ``stop``) to figures by name with unit, of trials without a record.
    """

    format: Literal["tank2sim-trials/1"] = "tank2sim-trials/1"
    draught_fore_m: Draught | None = None
    draught_aft_m: Draught | None = None
    full_load_draught_m: Draught | None = None
    depth_m: WaterDepth | None = None
    wind_speed_mps: WindSpeed | None = None
    wind_from_deg: AngleArgument | None = None
    sea_state: SeaState | None = None
    speed_85_mcr_mps: Speed | None = None
    engine_untouched: bool | None = None
    place: _Words = ""
    date: _Words = ""
    form: FormWords = FormWords()
    figures: dict[str, dict[str, float]] = Field(default_factory=dict)


def read_notes(path: str | Path) -> TrialNotes:
    """Read notes from a TOML file with the keys of :class:`TrialNotes`.

    Raises
    ------
    InputError
        It cannot be read, or a key is unknown or out of its bounds.
    """
    try:
        notes = TrialNotes.model_validate(parsed_toml(read_text(Path(path)), path))
    except ValidationError as fault:
        raise form_fault(fault, path, {}, form=TrialNotes, what="notes of a trial") from None
    for words, figures in notes.figures.items():
        if not _is_tried(words):
            remedy = "give turn:35, zigzag:10/10 or stop, with - before the rudder for port"
            raise InputError(path, f"figures.{words}", "is not a turn, a zigzag or a stop", remedy)
        for name, value in figures.items():
            place = f"figures.{words}.{name}"
            if name not in REPORTED:
                raise InputError(path, place, "is not a figure", close_name(name, REPORTED))
            if value <= 0 and name != "side_reach_m" and not (name.startswith("overshoot") and value == 0):
                raise InputError(path, place, f"is {value:g}", "give a number above 0, for either side")
    return notes


def _is_tried(words: str) -> bool:
    """Whether words mean a manoeuvre of a sea trial."""
    try:
        return isinstance(parse_manoeuvre(words), Turn | Zigzag | Stop)
    except InputError:
        return False


def notes_with(notes: TrialNotes, source: str | Path, **options: object) -> TrialNotes:
    """Return notes with the options that are given (not None) in place of theirs.

    Parameters
    ----------
    notes : TrialNotes
    source : str or path
        Where the notes are from.
    **options
        Values by the names of fields.

    Raises
    ------
    InputError
        One is out of its bounds, or one of a pair is known without the other.
    """
    given = {name: value for name, value in options.items() if value is not None}
    try:
        together = notes.model_validate({**notes.model_dump(exclude_unset=True), **given})
    except ValidationError as fault:
        first = form_fault(fault, source, {}, form=TrialNotes, what="notes of a trial")
        raise ArgumentError(first.place, "", first.problem, first.remedy) from None
    for pair in _PAIRS:
        for one, other in (pair, pair[::-1]):
            if getattr(together, one) is not None and getattr(together, other) is None:
                problem, remedy = f"is missing next to {one}", "give both, or neither"
                if one in given:
                    raise ArgumentError(other, "", problem, remedy)
                raise InputError(source, other, problem, remedy)
    return together


_PAIRS = ("draught_fore_m", "draught_aft_m"), ("wind_speed_mps", "wind_from_deg")
