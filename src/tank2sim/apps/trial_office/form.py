"""The form for reporting trials to IMO (MSC/Circ.1053), as boxes of rows; a value that is not known is a blank."""

from __future__ import annotations

import math
from collections.abc import Mapping

from markupsafe import Markup

from tank2sim.analysis.stability.imo import (
    ADVANCE,
    FIRST_OF_TEN,
    FIRST_OF_TWENTY,
    INITIAL,
    SECOND_OF_TEN,
    TACTICAL,
    TRACK_REACH,
)
from tank2sim.answer.numbers import format_number
from tank2sim.answer.page import filled_template, resource_text
from tank2sim.apps.bridge.boxes import Box, Row
from tank2sim.apps.trial_office.conditions import BEAUFORT
from tank2sim.apps.trial_office.study import TrialOffice

_ROWS = {
    ADVANCE: "Turning circle: advance, ship lengths",
    TACTICAL: "Turning circle: tactical diameter, ship lengths",
    FIRST_OF_TEN: "10/10 zigzag: first overshoot, deg",
    SECOND_OF_TEN: "10/10 zigzag: second overshoot, deg",
    FIRST_OF_TWENTY: "20/20 zigzag: first overshoot, deg",
    INITIAL: "Initial turning: distance to 10 deg with 10 deg of rudder, ship lengths",
    TRACK_REACH: "Stopping, full astern: track reach, ship lengths",
}

_CORRECTION = "R = T F/B (MSC/Circ.1053), F and B simulated; annex"


def form_boxes(study: TrialOffice) -> tuple[Box, ...]:
    """The blocks of the form; PORT and STBD of a zigzag are the side of the first execute."""
    words, sizes, state = study.form, study.particulars, study.state
    head = {"Administration": words.administration, "Reference no.": words.reference}
    ship: Mapping[str, str | float | None] = {
        "Ship type": words.ship_type,
        "L/V, s": sizes.length_over_speed_s,
        "L/B": sizes.length_over_beam,
        "B/T": sizes.beam_over_draught,
        "Block coefficient": sizes.block_coefficient,
        "Rudder type": words.rudder_type,
        "Total rudder area over L T": sizes.rudder_area_share,
        "Number of rudders": words.rudders,
        "Propeller type": words.propeller_type,
        "Number of propellers": words.propellers,
        "Engine type": words.engine_type,
        "Trim, m by the stern": state.trim_m if study.tested_at_full_load else 0.0,
        "Ballast condition": words.ballast_condition,
    }
    depth = study.depth_m and study.depth_m / state.draught_m
    wind = state.wind_speed_mps
    weather: Mapping[str, str | float | None] = {
        "Water depth over trial draught": depth,
        "Wind: Beaufort number": None if wind is None else sum(wind >= least for least in BEAUFORT),
        "Wave: sea state": study.sea_state,
    }
    ticks: tuple[str | None, str | None] = ("[x]", "[ ]") if study.tested_at_full_load else ("[ ]", "[x]")
    if not state.draughts_recorded:
        ticks = None, None
    loadings = "Tested at full load", "Tested at partial load and corrected"
    condition = Box(
        "Manoeuvring data: loading condition",
        tuple(Row(label, (tick,)) for label, tick in zip(loadings, ticks, strict=True)),
    )
    data = Box("Manoeuvring data", tuple(_data_rows(study)), ("PORT", "STBD", "Criterion"))
    return (
        Box("Report", _rows(head)),
        Box("Ship data (full load condition)", _rows(ship)),
        Box("Trials data (environmental condition)", _rows(weather)),
        condition,
        data,
        Box("Remarks", (Row(words.remarks or None, ()), *_remarks(study))),
    )


def _rows(values: Mapping[str, str | float | None]) -> tuple[Row, ...]:
    return tuple(Row(label, (_text(value),)) for label, value in values.items())


def _text(value: str | float | None) -> str | None:
    if value is None or value == "":
        return None
    return value if isinstance(value, str) else format_number(float(value), 4)


def _data_rows(study: TrialOffice) -> list[Row]:
    rows = []
    for criterion in study.criteria:
        sides: dict[str, float] = {}
        for one in criterion.sides:
            value = one.full_load if one.full_load is not None or not study.tested_at_full_load else one.as_run
            if value is not None:
                sides[one.side] = max(value, sides.get(one.side, -math.inf))
        limit = format_number(criterion.allowed, 3)
        if criterion.name == TRACK_REACH:
            shown = _text(next(iter(sides.values()), None))
            rows.append(Row(_ROWS[criterion.name], (shown, shown and "", f"{limit} to 20")))
        else:
            rows.append(Row(_ROWS[criterion.name], (_text(sides.get("port")), _text(sides.get("starboard")), limit)))
    return rows


def _remarks(study: TrialOffice) -> list[Row]:
    """Data without a row in the form: current, wind, correction, and uncertainty."""
    state, current = study.state, study.current
    fore, aft = (format_number(draught, 4) for draught in state.draughts_at_ends_m)
    wind = ""
    if state.wind is not None:
        speed, origin = state.wind
        wind = f"{speed:.1f} m/s from {math.degrees(origin) % 360:.0f} deg, taken off by the model"
    said = {
        "Draughts of the trial": f"{fore} m forward, {aft} m aft" * state.draughts_recorded,
        "Conditions not met": study.conditions_not_met,
        "Current": current and f"{current.words}, taken off{'' if current.separated else ' with any wind'}",
        "Wind": wind,
        "Correction to full load": "" if study.tested_at_full_load else _CORRECTION,
        "Not certified: EXTRAPOLATED to full load": "; ".join(one.name for one in study.not_certified),
        "Application": "" if study.applies else "L < 100 m: MSC.137(76) does not bind",
    }
    return [Row(label, (text,)) for label, text in said.items() if text]


def form_page(study: TrialOffice) -> str:
    """The form as an HTML page that prints on A4."""
    return filled_template(
        "apps/trial_office/form.html.j2",
        style=Markup(resource_text("apps/bridge/sheet.css")),
        name=study.ship,
        source=study.source,
        place=", ".join(part for part in (study.place, study.date) if part),
        boxes=form_boxes(study),
    )
