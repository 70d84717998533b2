"""The page of a ship's stability and manoeuvrability."""

from __future__ import annotations

import math
from collections.abc import Sequence

import altair as alt

from tank2sim.analysis.stability.imo import ImoCriterion
from tank2sim.analysis.stability.study import StabilityStudy
from tank2sim.analysis.turning.characteristic import SteeringCharacteristic
from tank2sim.analysis.turning.diagram import SteadyTurning
from tank2sim.files import plain_json
from tank2sim.report.ensemble.charts import curve_charts
from tank2sim.report.kit.json_values import Json
from tank2sim.report.kit.numbers import format_number
from tank2sim.report.kit.page import Cell, Column, Illustration, KeyFigure, Page, PageSection, PageTable, Verdict
from tank2sim.report.stability.charts import (
    characteristic_chart,
    criterion_by_speed_chart,
    influence_chart,
    steering_bode,
    steering_diagram,
    steering_poles,
    step_chart,
    trim_chart,
)

BEYOND_CARD_TEXT = "beyond the card"
"""In place of a verdict, where the trial left what the card holds for."""

_VERDICTS = {True: Verdict.PASSED, False: Verdict.FAILED, None: Verdict.NONE}

_CRITERION = (
    "C′ = Y′v (N′r − m′x′G) − N′v (Y′r − m′), from the slopes of the full forces on the straight course. Its sign is "
    "that of the margin between two levers: the yaw damping lever (N′r − m′x′G)/(Y′r − m′) lies ahead of the sway "
    "lever N′v/Y′v on a ship that is stable. The margin in per cent is C′ over |Y′v (N′r − m′x′G)|, its stabilising "
    "part."
)
_TRIM = (
    "A card holds for one trim; this is an estimate. Paper 2 (Krezelewski and Misiag) says that 1 % of trim changes "
    "one of Y_r and N_r by 7.5 %; its print does not show which, nor which way and 1 % of what: both readings are "
    "drawn, as growing with trim by the stern over length. Beside them stand the corrections of Inoue, Hirano and "
    "Kijima (1981) to Y_v, Y_r, N_v and N_r. All act on the hydrodynamic part, without the inertia."
)
_RESPONSE = (
    "Of the linear equations about the straight course, yaw rate by rudder. The gear acts with its lag; its rate "
    "limit is not linear and left out. The poles of an unstable ship lie in the tinted half, and its Bode diagram is "
    "what a controller works with, not what a ship with a fixed rudder does."
)
_TURNING = (
    "All steady turns that are joined to the straight course, at constant revolutions in calm water, followed by "
    "continuation through the folds. Solid: stable with the rudder held (all eigenvalues decay). Dashed: the ship "
    "leaves the turn by itself, and only a rudder at work holds it there."
)
_SPIRALS = (
    "The spiral holds each rudder until the turn is steady, so its points lie on the stable branches and jump at the "
    "folds; the reverse spiral holds each yaw rate by the rudder and reaches the unstable branch, too. Both are "
    "simulated on the nonlinear model with its gear."
)
_CHARACTERISTIC = (
    "Bech: H(r) = δ is the diagram itself, here with the nearest cubic. Norrbin: n3 r³ + n2 r² + n1 r + n0 = K δ "
    "keeps place and slope of the straight course, so that n1 is 1 or −1. Both are fitted in rudder angle up to 20 "
    "deg; the error beyond is reported."
)
_IMO = (
    "The worse of starboard and port, at the card's speed in calm water. A margin is what is left to the limit; "
    "below zero the criterion is not met."
)


def stability_page(study: StabilityStudy, notices: Sequence[str]) -> Page:
    """The page; `notices` stand under the criteria."""
    found = study.stability
    sections = [_straight(study), _moving(study), _response(study)]
    if study.turning is not None:
        sections.append(_turning(study, study.turning))
    if study.characteristic is not None:
        sections.append(_characteristic(study.characteristic))
    sections.append(PageSection(heading="IMO criteria", text=_IMO, tables=[_imo(study.imo)]))
    if notices:
        rows: list[list[Cell]] = [[notice] for notice in notices]
        table = PageTable(caption="What the reader should know.", columns=[Column(title="")], rows=rows)
        sections.append(PageSection(heading="Notices", tables=[table]))
    subtitle = f"Stability and manoeuvrability, {found.speed_mps:.4g} m/s"
    return Page(title=found.name, subtitle=subtitle, figures=_figures(study), sections=sections)


def _figures(study: StabilityStudy) -> list[KeyFigure]:
    found = study.stability
    met = [one.passed for one in study.imo]
    beyond = sum(one.beyond_card and one.found is not None for one in study.imo)
    failed, unknown = met.count(False), met.count(None) - beyond
    verdict = Verdict.FAILED if failed else Verdict.CAUTION if unknown or beyond else Verdict.PASSED
    open_ones = [f"{unknown} open"] if unknown else []
    notes = [*open_ones, *([f"{beyond} beyond the card's validity"] if beyond else [])]
    shown = [
        KeyFigure(
            label="Straight course",
            value="stable" if found.stable else "unstable",
            verdict=Verdict.PASSED if found.stable else Verdict.CAUTION,
            note=f"C′ = {found.criterion:.4g}",
        ),
        _margin_figure(study),
        KeyFigure(label="Nomoto K′", value=found.nomoto_prime.K_per_s, note=f"T′ = {found.nomoto_prime.T_s:.3g}"),
        KeyFigure(
            label="IMO criteria met",
            value=f"{met.count(True)} of {len(met)}",
            verdict=verdict,
            note=", ".join(notes),
        ),
    ]
    if study.turning is not None and study.turning.loop is not None:
        width = math.degrees(study.turning.loop.width_rad)
        shown.insert(
            3, KeyFigure(label="Hysteresis loop", value=width, unit="deg", note="of rudder, between the folds")
        )
    return shown


def _margin_figure(study: StabilityStudy) -> KeyFigure:
    found, margin = study.stability, study.margin
    if not found.criterion_decides:
        note = f"a mode grows at {found.growth_per_s:.3g} 1/s that C′ does not see"
        return KeyFigure(label="Margin", value="none", verdict=Verdict.CAUTION, note=note)
    return KeyFigure(label="Margin", value=margin.percent, unit="%", note=f"levers {margin.lever:.3g} L apart")


def _straight(study: StabilityStudy) -> PageSection:
    found, margin = study.stability, study.margin
    with_effects = "".join(f", {name}" for name in found.effect_states)
    modes = [
        [eigenvalue.real, eigenvalue.imag, -1 / eigenvalue.real if eigenvalue.real else None]
        for eigenvalue in found.eigenvalues
    ]
    eigenvalues = PageTable(
        caption=f"Eigenvalues of surge, sway and yaw{with_effects}.",
        columns=[
            Column(title="real part", unit="1/s"),
            Column(title="imaginary part", unit="1/s"),
            Column(title="time constant", unit="s"),
        ],
        rows=modes,
    )
    slow = f", in slow motions ({', '.join(found.effect_states)} at rest)" if found.effect_states else ""
    heads = [Column(title=""), *(Column(title=name) for name in ("K", "T", "T1", "T2", "T3"))]
    nomoto = [
        [scaling, *vars(one).values()]
        for scaling, one in (("1/s and s", found.nomoto), ("prime (L/U)", found.nomoto_prime))
    ]
    levers: list[list[Cell]] = [
        ["yaw damping lever", format_number(margin.damping_lever), "L"],
        ["sway lever", format_number(margin.sway_lever), "L"],
        ["levers apart", format_number(margin.lever), "L"],
        ["margin" if found.criterion_decides else "margin of C′ alone", format_number(margin.percent), "%"],
    ]
    return PageSection(
        heading="Straight-line stability",
        text=_CRITERION,
        tables=[
            PageTable(
                caption="The margin of stability.",
                columns=[Column(title=""), Column(title="value"), Column(title="unit")],
                rows=levers,
            ),
            eigenvalues,
            PageTable(caption=f"Nomoto's coefficients, yaw rate by rudder{slow}.", columns=heads, rows=nomoto),
        ],
    )


def _moving(study: StabilityStudy) -> PageSection:
    margin = study.margin
    rows: list[list[Cell]] = [
        [influence.short_name, influence.value, influence.percent, influence.neutral_value, influence.neutral_percent]
        for influence in margin.influences
    ]
    table = PageTable(
        caption="Exact sensitivity of C′, and the value at which the ship is neutral, all else unchanged.",
        columns=[
            Column(title="coefficient"),
            Column(title="value"),
            Column(title="C′ for 10 % more", unit="%"),
            Column(title="neutral at"),
            Column(title="change to neutral", unit="%"),
        ],
        rows=rows,
    )
    return PageSection(
        heading="What moves the margin",
        text=f"Derivatives are prime, mass in kg and x_G in m. {_TRIM}",
        tables=[table],
        charts=_moving_charts(plain_json(margin.as_json()), plain_json(study.trim.as_json())),
    )


def _response(study: StabilityStudy) -> PageSection:
    responses = study.responses
    if not responses:
        return PageSection(heading="Response to the rudder", text="The yaw rate does not answer to the rudder.")
    return PageSection(
        heading="Response to the rudder",
        text=_RESPONSE,
        charts=_response_charts([plain_json(response.as_json()) for response in responses]),
    )


def _turning(study: StabilityStudy, turning: SteadyTurning) -> PageSection:
    rows: list[list[Cell]] = []
    for angle in (-35, -20, -10, -5, 0, 5, 10, 20, 35):
        for rate, stable in turning.turns_at(math.copysign(max(0.0, abs(math.radians(angle)) - 1e-9), angle)):
            rows.append([angle, math.degrees(rate), "stable" if stable else "unstable"])
    tables = [
        PageTable(
            caption="Steady turns.",
            columns=[Column(title="rudder", unit="deg"), Column(title="yaw rate", unit="deg/s"), Column(title="")],
            rows=rows,
        )
    ]
    if turning.folds:
        folds: list[list[Cell]] = [
            [math.degrees(fold.rudder_rad), math.degrees(fold.yaw_rate_radps)] for fold in turning.folds
        ]
        heads = [Column(title="rudder", unit="deg"), Column(title="yaw rate", unit="deg/s")]
        tables.append(PageTable(caption="Folds, where the ship leaves its branch.", columns=heads, rows=folds))
    spirals = study.direct is not None or study.reverse is not None
    run = {"direct": study.direct, "reverse": study.reverse}
    told = {name: one.as_json() for name, one in run.items() if one is not None}
    return PageSection(
        heading="Steady turning",
        text=f"{_TURNING}\n\n{_SPIRALS}" if spirals else _TURNING,
        tables=tables,
        charts=[_diagram(plain_json(turning.as_json()), plain_json(told))],
    )


def stability_drawn(found: Json) -> list[PageSection]:
    """The charts of a study, from its JSON."""
    sections = [PageSection(heading="What moves the margin", charts=_moving_charts(found["margins"], found["trim"]))]
    if found["responses"]:
        sections.append(PageSection(heading="Response to the rudder", charts=_response_charts(found["responses"])))
    if found["steady_turning"]:
        chart = _diagram(found["steady_turning"], found["spirals"])
        sections.append(PageSection(heading="Steering diagram", text=_TURNING, charts=[chart]))
    if found["characteristic"]:
        chart = Illustration(chart=_rudder_that_holds(found["characteristic"]))
        sections.append(PageSection(heading="Nonlinear steering characteristic", charts=[chart]))
    if curves := (found.get("ensemble") or {}).get("curves"):
        sections.append(PageSection(heading="Over the ensemble", charts=curve_charts(curves)))
    return sections


def _moving_charts(margins: Json, trim: Json) -> list[Illustration]:
    changes = ", ".join(
        f"{name} {change:+.3g} %" for name, change in trim["inoue_1981"]["change_percent_by_1_percent"].items()
    )
    caption = f"After Inoue, 1 % of length of trim by the stern changes {changes}."
    speed = margins["speed"]
    return [
        *([Illustration(chart=influence_chart(margins, title="Influence on C′"))] if margins["derivatives"] else []),
        *(
            [
                Illustration(
                    chart=criterion_by_speed_chart(speed, title="Speed"), caption="Over the card's range of speeds."
                )
            ]
            if speed
            else []
        ),
        Illustration(chart=trim_chart(trim, title="Trim (estimate)"), caption=caption),
    ]


def _response_charts(responses: Sequence[Json]) -> list[Illustration]:
    return [
        Illustration(chart=steering_poles(responses, title="Poles and zeros")),
        Illustration(chart=steering_bode(responses, title="Bode diagram")),
        Illustration(chart=step_chart(responses, title="Step of the rudder")),
    ]


def _diagram(turning: Json, spirals: Json) -> Illustration:
    return Illustration(chart=steering_diagram(turning, spirals, title="Steady turns against the rudder"))


def _rudder_that_holds(found: Json) -> alt.LayerChart:
    return characteristic_chart(found, title="Rudder that holds a yaw rate")


def _characteristic(found: SteeringCharacteristic) -> PageSection:
    n, b = found.n, found.bech.coefficients
    rows: list[list[Cell]] = [
        [
            "Bech",
            *(float(one) for one in b),
            *_errors(found.bech.rms_rad, found.bech.largest_rad, found.bech.beyond_rad),
        ],
        [
            f"Norrbin, K = {found.K_per_s:.4g} 1/s",
            *(float(one) for one in n),
            *_errors(found.norrbin.rms_rad, found.norrbin.largest_rad, found.norrbin.beyond_rad),
        ],
    ]
    heads = [
        Column(title=""),
        *(Column(title=f"r{power}") for power in ("⁰", "¹", "²", "³")),
        Column(title="rms error", unit="deg", digits=3),
        Column(title="largest", unit="deg", digits=3),
        Column(title="beyond the fit", unit="deg", digits=3),
    ]
    caption = "Coefficients by powers of the yaw rate, rad and s: Bech's of δ, Norrbin's of K δ."
    return PageSection(
        heading="Nonlinear steering characteristic",
        text=_CHARACTERISTIC,
        tables=[PageTable(caption=caption, columns=heads, rows=rows)],
        charts=[Illustration(chart=_rudder_that_holds(plain_json(found.as_json())))],
    )


def _errors(*values: float | None) -> list[float | None]:
    return [None if value is None else math.degrees(value) for value in values]


def imo_verdict(one: ImoCriterion) -> Cell:
    """The verdict of a criterion as a table has it."""
    if one.beyond_card and one.found is not None:
        return BEYOND_CARD_TEXT
    return "open" if one.passed is None else _VERDICTS[one.passed]


def _imo(criteria: Sequence[ImoCriterion]) -> PageTable:
    rows: list[list[Cell]] = [
        [
            criterion.name,
            criterion.found,
            criterion.allowed,
            criterion.unit,
            imo_verdict(criterion),
            None if criterion.beyond_card else criterion.margin,
            None if criterion.beyond_card else criterion.margin_percent,
            criterion.remark,
        ]
        for criterion in criteria
    ]
    columns = [
        Column(title="criterion"),
        Column(title="found"),
        Column(title="allowed"),
        Column(title="unit"),
        Column(title="verdict"),
        Column(title="margin", digits=3),
        Column(title="margin", unit="%", digits=3),
        Column(title="remark"),
    ]
    return PageTable(caption="IMO resolution MSC.137(76), 5.3.1 to 5.3.4.", columns=columns, rows=rows)
