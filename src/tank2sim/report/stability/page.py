"""The page of a ship's stability and manoeuvrability."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from tank2sim.answer.numbers import format_number
from tank2sim.answer.page import Page
from tank2sim.answer.parts import Cell, Column, Illustration, KeyFigure, Section, Table, Verdict, notices_section
from tank2sim.report.ensemble.sections import BEYOND_CARD_TEXT, stability_section
from tank2sim.report.json_values import Json
from tank2sim.report.stability.charts import (
    BECH,
    NORRBIN,
    characteristic_chart,
    criteria_chart,
    criterion_by_speed_chart,
    influence_chart,
    steering_bode,
    steering_diagram,
    steering_poles,
    step_chart,
    trim_chart,
)

_VERDICTS = {True: Verdict.PASSED, False: Verdict.FAILED}

_CRITERION = (
    "C′ = Y′v (N′r − m′x′G) − N′v (Y′r − m′), from the slopes of the full forces on the straight course. Its sign is "
    "that of the margin between two levers: the yaw damping lever (N′r − m′x′G)/(Y′r − m′) lies ahead of the sway "
    "lever N′v/Y′v on a ship that is stable. The margin in per cent is C′ over |Y′v (N′r − m′x′G)|, its stabilising "
    "part."
)
_TRIM = (
    "A card holds for one trim; this is an estimate. Krezelewski and Misiag say that 1 % of trim changes one of Y_r "
    "and N_r by 7.5 %; the print does not show which, nor which way and 1 % of what: both readings are drawn, as "
    "growing with trim by the stern over length. The chart also shows the corrections of Inoue, Hirano and "
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


_BARS = "Bars: the worse of both sides, over the limit (red). Pale: beyond the range of the card, and no verdict."


def stability_page(found: Json) -> Page:
    """Return the page of the JSON of ``tank2sim stability``."""
    sections = [imo_section(found["imo"])]
    if found["steady_turning"]:
        sections.append(_turning(found["steady_turning"], found["spirals"]))
    if found.get("ensemble"):
        sections.append(stability_section(found["ensemble"], found["imo"]))
    sections += [_straight_line(found), _margin_influences(found), _response(found["responses"])]
    if found["characteristic"]:
        sections.append(_characteristic(found["characteristic"]))
    sections += notices_section(found["notices"])
    subtitle = f"Stability and manoeuvrability, {found['operating_point']['speed_mps']:.4g} m/s"
    return Page(
        title=found["ship"], subtitle=subtitle, verdict=_verdict(found), figures=_figures(found), sections=sections
    )


def _figures(found: Json) -> list[KeyFigure]:
    straight, prime = found["stability_criterion"], found["nomoto"]["prime"]
    met = [criterion["passed"] for criterion in found["imo"]]
    beyond = sum(criterion["beyond_card"] and criterion["found"] is not None for criterion in found["imo"])
    failed, unknown = met.count(False), met.count(None) - beyond
    verdict = Verdict.FAILED if failed else Verdict.CAUTION if unknown or beyond else Verdict.PASSED
    notes = [*([f"{unknown} open"] if unknown else []), *([f"{beyond} beyond the card's validity"] if beyond else [])]
    figures = [
        KeyFigure(
            label="Straight course",
            value="stable" if straight["stable"] else "unstable",
            verdict=Verdict.PASSED if straight["stable"] else Verdict.CAUTION,
            note=f"C′ = {format_number(straight['C_prime'], 3)}",
        ),
        _margin_figure(straight, found["margins"]),
        KeyFigure(label="Nomoto K′", value=prime["K_prime"], note=f"T′ = {format_number(prime['T_prime'], 3)}"),
        KeyFigure(
            label="IMO criteria met", value=f"{met.count(True)} of {len(met)}", verdict=verdict, note=", ".join(notes)
        ),
    ]
    if loop := (found["steady_turning"] or {}).get("loop"):
        note = "of rudder, between the folds"
        figures.insert(3, KeyFigure(label="Hysteresis loop", value=loop["width_deg"], unit="deg", note=note))
    return figures


def _verdict(found: Json) -> str:
    straight, imo = found["stability_criterion"], found["imo"]
    course = "Stable on a straight course" if straight["stable"] else "Unstable on a straight course"
    loop = (found["steady_turning"] or {}).get("loop")
    width = f", with a loop {loop['width_deg']:.3g} deg wide" if loop else ""
    met = [criterion["passed"] for criterion in imo]
    if missed := [criterion["name"] for criterion in imo if criterion["passed"] is False]:
        return f"{course}{width}. Beyond IMO MSC.137(76): {'; '.join(missed)}."
    if not any(met):
        return f"{course}{width}."
    judged = "all criteria" if all(met) else f"{met.count(True)} of {len(met)} criteria, the others are open,"
    return f"{course}{width}. It meets {judged} of IMO MSC.137(76)."


def _margin_figure(straight: Json, margins: Json) -> KeyFigure:
    if not straight["C_prime_decides"]:
        note = f"a mode grows at {straight['growth_per_s']:.3g} 1/s that C′ does not show"
        return KeyFigure(label="Margin", value="none", verdict=Verdict.CAUTION, note=note)
    note = f"levers {format_number(margins['lever_margin_lengths'], 3)} L apart"
    return KeyFigure(label="Margin", value=margins["margin_percent"], unit="%", note=note)


_NOMOTO_TIMES = ("T", "T1", "T2", "T3")


def _straight_line(found: Json) -> Section:
    straight, margins, nomoto = found["stability_criterion"], found["margins"], found["nomoto"]
    states = straight["settled_states"]
    eigenvalues = Table(
        caption=f"Eigenvalues of surge, sway and yaw{''.join(f', {name}' for name in states)}.",
        columns=[
            Column(title="real part", unit="1/s"),
            Column(title="imaginary part", unit="1/s"),
            Column(title="time constant", unit="s"),
        ],
        rows=[[real, imaginary, -1 / real if real else None] for real, imaginary in found["eigenvalues"]],
    )
    name = "margin" if straight["C_prime_decides"] else "margin of C′ alone"
    levers: list[list[Cell]] = [
        ["yaw damping lever", format_number(margins["damping_lever_lengths"]), "L"],
        ["sway lever", format_number(margins["sway_lever_lengths"]), "L"],
        ["levers apart", format_number(margins["lever_margin_lengths"]), "L"],
        [name, format_number(margins["margin_percent"]), "%"],
    ]
    slow = f", in slow motions ({', '.join(states)} at rest)" if states else ""
    return Section(
        heading="Straight-line stability",
        text=_CRITERION,
        tables=[
            Table(
                caption="The margin of stability.",
                columns=[Column(title=""), Column(title="value"), Column(title="unit")],
                rows=levers,
            ),
            eigenvalues,
            Table(
                caption=f"Nomoto's coefficients, yaw rate by rudder{slow}.",
                columns=[Column(title="K", unit="1/s"), *(Column(title=name, unit="s") for name in _NOMOTO_TIMES)],
                rows=[list(nomoto["dimensional"].values())],
            ),
        ],
    )


def _margin_influences(found: Json) -> Section:
    margins, trim = found["margins"], found["trim"]
    keys = ("value", "percent", "neutral_value", "neutral_percent")
    rows: list[list[Cell]] = [
        [influence["name"].rpartition(".")[2], *(influence[key] for key in keys)]
        for influence in margins["derivatives"]
    ]
    table = Table(
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
    changes = trim["inoue_1981"]["change_percent_by_1_percent"].items()
    caption = ", ".join(f"{name} {change:+.3g} %" for name, change in changes)
    charts = [
        Illustration(
            chart=trim_chart(trim, title="Trim (estimate)"),
            caption=f"After Inoue, 1 % of length of trim by the stern changes {caption}.",
        )
    ]
    if speed := margins["speed"]:
        chart = criterion_by_speed_chart(speed, title="Speed")
        charts.insert(0, Illustration(chart=chart, caption="Over the card's range of speeds."))
    if margins["derivatives"]:
        charts.insert(0, Illustration(chart=influence_chart(margins, title="Influence on C′")))
    text = f"Derivatives are prime, mass in kg and x_G in m. {_TRIM}"
    return Section(heading="What moves the margin", text=text, tables=[table], charts=charts, folded=True)


def _response(responses: Sequence[Json]) -> Section:
    heading = "Response to the rudder"
    if not responses:
        return Section(heading=heading, text="The yaw rate does not answer to the rudder.")
    charts = [
        Illustration(chart=steering_poles(responses, title="Poles and zeros")),
        Illustration(chart=steering_bode(responses, title="Bode diagram")),
        Illustration(chart=step_chart(responses, title="Step of the rudder")),
    ]
    return Section(heading=heading, text=_RESPONSE, charts=charts, folded=True)


def _turning(turning: Json, spirals: Json) -> Section:
    heads = [Column(title="rudder", unit="deg"), Column(title="yaw rate", unit="deg/s")]
    rows: list[list[Cell]] = [
        [turn["rudder_deg"], turn["yaw_rate_degps"], "stable" if turn["stable"] else "unstable"]
        for turn in turning.get("turns") or ()
    ]
    tables = [Table(caption="Steady turns.", columns=[*heads, Column(title="")], rows=rows)]
    if turning["folds"]:
        folds: list[list[Cell]] = [[fold["rudder_deg"], fold["yaw_rate_degps"]] for fold in turning["folds"]]
        tables.append(Table(caption="Folds, where the ship leaves its branch.", columns=heads, rows=folds))
    chart = steering_diagram(turning, spirals, title="Steady turns against the rudder")
    return Section(
        heading="Steady turning",
        text=f"{_TURNING}\n\n{_SPIRALS}" if any(spirals.values()) else _TURNING,
        tables=tables,
        charts=[Illustration(chart=chart)],
    )


def _characteristic(found: Json) -> Section:
    bech, norrbin = found["bech"], found["norrbin"]
    rows: list[list[Cell]] = [
        ["Bech", *(bech[key] for key in BECH), *bech["error"].values()],
        [
            f"Norrbin, K = {norrbin['K_per_s']:.4g} 1/s",
            *(norrbin[key] for key in NORRBIN),
            *norrbin["error"].values(),
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
    return Section(
        heading="Nonlinear steering characteristic",
        text=_CHARACTERISTIC,
        tables=[Table(caption=caption, columns=heads, rows=rows)],
        folded=True,
        charts=[Illustration(chart=characteristic_chart(found, title="Rudder that holds a yaw rate"))],
    )


def imo_verdict(criterion: Mapping[str, Json]) -> Cell:
    """Return the verdict of one of ``imo`` of the JSON as a cell."""
    if criterion["beyond_card"] and criterion["found"] is not None:
        return BEYOND_CARD_TEXT
    return "open" if criterion["passed"] is None else _VERDICTS[criterion["passed"]]


def imo_section(criteria: Sequence[Mapping[str, Json]]) -> Section:
    """Return the criteria of IMO MSC.137(76), from ``imo`` of the JSON: bars, table, and what is to be said of each."""
    charts = []
    if any(criterion["found"] is not None for criterion in criteria):
        charts.append(Illustration(chart=criteria_chart(criteria, title="IMO MSC.137(76)"), caption=_BARS))
    remarks: dict[str, list[str]] = {}
    for criterion in criteria:
        if criterion["remark"]:
            remarks.setdefault(criterion["remark"], []).append(criterion["name"])
    notes = [f"{'; '.join(names)}: {remark}" for remark, names in remarks.items()]
    return Section(heading="IMO criteria", text=_IMO, tables=[_imo(criteria)], charts=charts, notes=notes)


def _imo(criteria: Sequence[Mapping[str, Json]]) -> Table:
    rows: list[list[Cell]] = [
        [
            *(criterion[key] for key in ("name", "found", "allowed", "unit")),
            imo_verdict(criterion),
            None if criterion["beyond_card"] else criterion["margin_percent"],
        ]
        for criterion in criteria
    ]
    columns = [
        Column(title="criterion"),
        Column(title="found"),
        Column(title="allowed"),
        Column(title="unit"),
        Column(title="verdict"),
        Column(title="margin", unit="%", digits=3),
    ]
    return Table(caption="IMO resolution MSC.137(76), 5.3.1 to 5.3.4.", columns=columns, rows=rows)
