"""``tank2sim stability``: stability, steady turning and the IMO criteria of a ship."""

from __future__ import annotations

import math
from pathlib import Path

import click
from rich.markup import escape

from tank2sim.analysis.stability.straight_line import Nomoto
from tank2sim.analysis.stability.study import StabilityStudy, stability_study
from tank2sim.cards import read_card
from tank2sim.cli.changes import parse_changes
from tank2sim.cli.screen import json_option, json_text, screen, show_notices, show_table
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
@json_option
def command(card: str, speed: float | None, settings: tuple[str, ...], spirals: bool, **files: Path | None) -> None:
    """Judge how CARD (a file, or the name of a bundled ship) holds her course, turns and meets the IMO criteria."""
    ship = read_card(card, parse_changes(settings))
    model = build(ship)
    study = stability_study(model, speed, spirals=spirals)
    notices = [*model.notices, *study.notices, *([] if find_compiler() else [NO_COMPILER])]
    contents: dict[Path, str | bytes] = {}
    if json_file := files["json_file"]:
        contents[json_file] = json_text({**study.as_json(), "notices": notices})
    if page := files["page"]:
        contents[page] = _page(study, notices)
    write_together(contents, inputs=[Path(ship.source)], outputs=files.values())
    _show(study)
    show_notices(notices)


def _page(study: StabilityStudy, notices: list[str]) -> str:
    # Drawing is asked for seldom, and its library is slow to load.
    from tank2sim.report.page import render_page
    from tank2sim.report.stability_page import stability_page

    return render_page(stability_page(study, notices))


def _show(study: StabilityStudy) -> None:
    found, margin = study.stability, study.margin
    verdict = "stable" if found.stable else "unstable"
    screen.print(
        f"{escape(found.name)} at {found.speed_mps:.4g} m/s (drift {found.drift_deg:.3g} deg, "
        f"rudder {found.rudder_deg:.3g} deg) is [bold]{verdict}[/bold] on a straight course: "
        f"C' = {found.criterion:.4g}, margin {margin.percent:.3g} %, levers {margin.lever:.3g} L apart",
        soft_wrap=True,
    )
    if line := _turning_in_words(study):
        screen.print(line, soft_wrap=True)
    show_table(
        "Eigenvalues of surge, sway and yaw",
        ["real (1/s)", "imaginary (1/s)", "time constant (s)"],
        [[value.real, value.imag, -1 / value.real if value.real else None] for value in found.eigenvalues],
    )
    both: list[Nomoto] = [found.nomoto, found.nomoto_prime]
    rows = [[scaling, *vars(own).values()] for scaling, own in zip(("1/s and s", "prime"), both, strict=True)]
    show_table("Nomoto", ["", "K", "T", "T1", "T2", "T3"], rows)
    show_table(
        "What moves C' most",
        ["coefficient", "C' for 10 % more (%)", "change to neutral (%)"],
        [[one.short_name, one.percent, one.neutral_percent] for one in margin.influences[:_STRONGEST]],
    )
    show_table(
        "IMO MSC.137(76), worse side",
        ["criterion", "found", "allowed", "unit", "met", "margin (%)"],
        [[one.name, one.found, one.allowed, one.unit, one.passed, one.margin_percent] for one in study.imo],
    )


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
