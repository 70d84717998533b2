"""``tank2sim stability``: straight-line stability, Nomoto's coefficients and the IMO criteria of a ship."""

from __future__ import annotations

from pathlib import Path

import click
from rich.markup import escape

from tank2sim.analysis.imo import Criterion, imo_criteria
from tank2sim.analysis.stability import Nomoto, Stability, stability
from tank2sim.cards import Card, ManoeuvringCard, read_card
from tank2sim.cli.changes import parse_changes
from tank2sim.cli.screen import json_option, json_text, screen, show_notices, show_table
from tank2sim.dynamics import build
from tank2sim.files import write_whole
from tank2sim.native.compiler import find_compiler
from tank2sim.simulation.integrator import NO_COMPILER


@click.command("stability")
@click.argument("card")
@click.option("--speed", type=click.FloatRange(min=0, min_open=True), metavar="MPS", help="Speed, m/s; by default u0.")
@click.option(
    "--set", "settings", multiple=True, metavar="KEY=VALUE", help="A value in place of the card's, by dotted key."
)
@json_option
def command(card: str, speed: float | None, settings: tuple[str, ...], json_file: Path | None) -> None:
    """Linearise CARD (a file, or the name of a bundled ship) on a straight course and judge it."""
    ship = read_card(card, parse_changes(settings))
    model = build(ship)
    result = stability(model, speed)
    criteria = imo_criteria(model)
    notices = [*model.notices, *_notices(ship, result)]
    if json_file:
        imo = [criterion.as_json() for criterion in criteria]
        told = json_text({**result.as_json(), "imo": imo, "notices": notices})
        write_whole(json_file, told, inputs=[Path(ship.source)])
    _show(result, criteria)
    show_notices(notices)


def _notices(ship: Card, result: Stability) -> list[str]:
    told = [] if find_compiler() else [NO_COMPILER]
    if isinstance(ship, ManoeuvringCard):
        slowest, fastest = ship.model.speed_range_mps
        if not slowest <= result.speed_mps <= fastest:
            told.append(f"{result.speed_mps:.4g} m/s is outside the card's range of {slowest:g} to {fastest:g} m/s")
        if abs(result.speed_mps / ship.model.speed_mps - 1) > 0.01:
            told.append(f"the IMO criteria are those at the card's speed, {ship.model.speed_mps:.4g} m/s")
    return told


def _show(result: Stability, criteria: tuple[Criterion, ...]) -> None:
    verdict = "stable" if result.stable else "unstable"
    screen.print(
        f"{escape(result.name)} at {result.speed_mps:.4g} m/s (drift {result.drift_deg:.3g} deg, "
        f"rudder {result.rudder_deg:.3g} deg) is [bold]{verdict}[/bold] on a straight course: "
        f"C' = {result.criterion:.4g}",
        soft_wrap=True,
    )
    show_table(
        "Eigenvalues of surge, sway and yaw",
        ["real (1/s)", "imaginary (1/s)", "time constant (s)"],
        [[value.real, value.imag, -1 / value.real if value.real else None] for value in result.eigenvalues],
    )
    both: list[Nomoto] = [result.nomoto, result.nomoto_prime]
    rows = [[scaling, *vars(own).values()] for scaling, own in zip(("1/s and s", "prime"), both, strict=True)]
    show_table("Nomoto", ["", "K", "T", "T1", "T2", "T3"], rows)
    show_table(
        "IMO MSC.137(76), worse side",
        ["criterion", "found", "allowed", "unit", "met"],
        [[one.name, one.found, one.allowed, one.unit, one.passed] for one in criteria],
    )
