"""``tank2sim stability``: stability, steady turning and the IMO criteria of a ship."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path

import click
from rich.markup import escape

from tank2sim.analysis.ensemble.results import StabilityBands, stability_bands
from tank2sim.analysis.ensemble.steering import Grid
from tank2sim.analysis.stability.imo import Criterion
from tank2sim.analysis.stability.straight_line import Nomoto
from tank2sim.analysis.stability.study import StabilityStudy, stability_study
from tank2sim.cards import read_card
from tank2sim.cli.changes import parse_changes
from tank2sim.cli.ensemble import asked_of, computing, ensemble_options, show_stability_bands, uncertain_ship
from tank2sim.cli.screen import json_option, json_text, screen, show_marked, show_notices, show_table
from tank2sim.dynamics import build
from tank2sim.files import write_together
from tank2sim.native.compiler import find_compiler
from tank2sim.simulation.integrator import NO_COMPILER

_STRONGEST = 5
"""Coefficients whose influence the screen shows; the JSON and the page have all."""


@click.command("stability")
@click.argument("card")
@click.option("--speed", type=click.FloatRange(min=0, min_open=True), metavar="MPS", help="Speed, m/s; by default u0.")
@click.option(
    "--set", "settings", multiple=True, metavar="KEY=VALUE", help="A value in place of the card's, by dotted key."
)
@click.option(
    "--spiral/--no-spiral", "spirals", default=True, help="Simulate the spirals on the steady-turning diagram."
)
@click.option(
    "-o", "--page", type=click.Path(path_type=Path, dir_okay=False), metavar="FILE.html", help="Write the page."
)
@ensemble_options
@json_option
def command(card: str, speed: float | None, settings: tuple[str, ...], spirals: bool, **more: object) -> None:
    """Judge how CARD (a file, or the name of a bundled ship) holds her course, turns and meets the IMO criteria."""
    asked, executor = asked_of(more), more["executor"]
    files = {name: path if isinstance(path := more[name], Path) else None for name in ("page", "json_file")}
    ship = read_card(card, parse_changes(settings))
    model = build(ship)
    study = stability_study(model, speed, spirals=spirals)
    bands = None
    if asked:
        drawn = study.responses and (files["page"] or files["json_file"])
        curves = (speed, Grid.of(model, study.responses[0])) if drawn else None
        with computing(asked, executor) as pool:
            bands = stability_bands(uncertain_ship(ship), study.imo, asked, pool, curves)
    notices = [*model.notices, *study.notices, *([] if find_compiler() else [NO_COMPILER])]
    contents: dict[Path, str | bytes] = {}
    if json_file := files["json_file"]:
        contents[json_file] = json_text(
            {**study.as_json(), "notices": notices, **({"ensemble": bands.as_json()} if bands else {})}
        )
    if page := files["page"]:
        contents[page] = _page(study, notices, bands)
    write_together(contents, inputs=[Path(ship.source)], outputs=files.values())
    others = show_marked(notices)
    _show(study)
    show_notices(others)
    if bands:
        show_stability_bands(bands)


def _page(study: StabilityStudy, notices: list[str], bands: StabilityBands | None) -> str:
    # Drawing is asked for seldom, and its library is slow to load.
    from tank2sim.report.ensemble import stability_section
    from tank2sim.report.page import render_page
    from tank2sim.report.stability_page import stability_page

    page = stability_page(study, notices)
    return render_page(replace(page, sections=[*page.sections, stability_section(bands)]) if bands else page)


def _show(study: StabilityStudy) -> None:
    found, margin = study.stability, study.margin
    verdict = "stable" if found.stable else "unstable"
    screen.print(
        f"{escape(found.name)} at {found.speed_mps:.4g} m/s (drift {found.drift_deg:.3g} deg, "
        f"rudder {found.rudder_deg:.3g} deg) is [bold]{verdict}[/bold] on a straight course: "
        f"{_margin_in_words(study)}",
        soft_wrap=True,
    )
    if line := _turning_in_words(study):
        screen.print(line, soft_wrap=True)
    show_table(
        f"Eigenvalues of surge, sway and yaw{''.join(f', {name}' for name in found.effect_states)}",
        ["real (1/s)", "imaginary (1/s)", "time constant (s)"],
        _rounded([value.real, value.imag, -1 / value.real if value.real else None] for value in found.eigenvalues),
    )
    both: list[Nomoto] = [found.nomoto, found.nomoto_prime]
    rows = [[scaling, *vars(own).values()] for scaling, own in zip(("1/s and s", "prime"), both, strict=True)]
    slow = " (slow motions)" if found.effect_states else ""
    show_table(f"Nomoto{slow}", ["", "K", "T", "T1", "T2", "T3"], _rounded(rows))
    show_table(
        "What moves C' most",
        ["coefficient", "C' for 10 % more (%)", "change to neutral (%)"],
        _rounded([one.short_name, one.percent, one.neutral_percent] for one in margin.influences[:_STRONGEST]),
    )
    _show_criteria(study.imo)


def _show_criteria(criteria: Sequence[Criterion]) -> None:
    """The table, its remarks under it by their numbers."""
    remarks = list(dict.fromkeys(one.remark for one in criteria if one.remark))
    rows = []
    for one in criteria:
        name = f"{one.name} ({remarks.index(one.remark) + 1})" if one.remark else one.name
        # A verdict on a figure that the card does not hold for would be taken for one.
        beyond = one.beyond_card and one.found is not None
        met, margin = ("beyond card", None) if beyond else (one.passed, one.margin_percent)
        rows.append([name, one.found, one.allowed, one.unit, met, margin])
    heads = ["criterion", "found", "allowed", "unit", "met", "margin (%)"]
    show_table("IMO MSC.137(76), worse side", heads, _rounded(rows))
    for number, remark in enumerate(remarks, 1):
        screen.print(f"({number}) {escape(remark)}", soft_wrap=True)


def _rounded(rows: Iterable[Sequence[object]]) -> list[list[object]]:
    """Numbers of four digits, which the tables have room for on a screen of 80 columns."""
    return [[float(f"{cell:.4g}") if isinstance(cell, float) else cell for cell in row] for row in rows]


def _margin_in_words(study: StabilityStudy) -> str:
    found, margin = study.stability, study.margin
    if not found.criterion_decides:
        return (
            f"a mode grows at {found.growth_per_s:.3g} 1/s, which C' = {found.criterion:.4g} does not see, so there "
            "is no margin"
        )
    return f"C' = {found.criterion:.4g}, margin {margin.percent:.3g} %, levers {margin.lever:.3g} L apart"


def _turning_in_words(study: StabilityStudy) -> str:
    turning = study.turning
    if turning is None:
        return ""
    ends = [f"{math.degrees(turning.rudder_rad[row]):.3g}" for row in (0, -1)]
    rates = [f"{math.degrees(turning.yaw_rate_radps[row]):.3g}" for row in (0, -1)]
    told = f"Steady turns: {rates[0]} to {rates[1]} deg/s at {ends[0]} to {ends[1]} deg of rudder"
    if turning.loop is None:
        return f"{told}; no hysteresis loop"
    height = turning.loop.height_radps
    high = "" if height is None else f", {math.degrees(height):.3g} deg/s high"
    return f"{told}; hysteresis loop {math.degrees(turning.loop.width_rad):.3g} deg of rudder wide{high}"
