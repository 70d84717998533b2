"""``tank2sim stability``: straight-line stability, Nomoto's coefficients and the IMO criteria of a ship."""

from __future__ import annotations

from pathlib import Path

import click

from tank2sim.analysis.imo import Criterion, imo_criteria
from tank2sim.analysis.stability import Nomoto, Stability, stability
from tank2sim.cards import read_card
from tank2sim.cli.changes import parse_changes
from tank2sim.cli.screen import json_option, json_text, screen, show_notices, show_table
from tank2sim.dynamics import build
from tank2sim.files import write_whole


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
    if json_file:
        imo = [criterion.as_json() for criterion in criteria]
        write_whole(json_file, json_text({**result.as_json(), "imo": imo, "notices": model.notices}))
    _show(result, criteria)
    show_notices(model.notices)


def _show(result: Stability, criteria: tuple[Criterion, ...]) -> None:
    verdict = "stable" if result.stable else "unstable"
    screen.print(
        f"{result.name} at {result.speed_mps:.4g} m/s (drift {result.drift_deg:.3g} deg, "
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
    rows = [[scaling, *vars(own).values()] for scaling, own in zip(("SI", "prime"), both, strict=True)]
    show_table("Nomoto", ["", "K (1/s)", "T (s)", "T1 (s)", "T2 (s)", "T3 (s)"], rows)
    show_table(
        "IMO MSC.137(76), worse side",
        ["criterion", "found", "allowed", "unit", "met"],
        [[one.name, one.found, one.allowed, one.unit, one.passed] for one in criteria],
    )
