"""``tank2sim guess``: a ship from dimensions and the figures of a wheelhouse poster."""

from __future__ import annotations

from pathlib import Path

import click

from tank2sim.api.bounds import GuessedShips, Seed
from tank2sim.api.guess import guess as guess_a_ship
from tank2sim.arguments import DEFAULT_MEMBERS
from tank2sim.cli.console import json_option, screen, show_result, write_result
from tank2sim.cli.options import OutputFile, number, page_option
from tank2sim.files import CARD


@click.command("guess")
@click.option("--length", type=float, required=True, metavar="M", help="Length between perpendiculars, m.")
@click.option("--beam", type=float, required=True, metavar="M", help="Moulded beam, m.")
@click.option("--draught", type=float, required=True, metavar="M", help="Mean draught, m.")
@click.option("--block", type=float, required=True, metavar="CB", help="Block coefficient.")
@click.option("--speed", type=float, required=True, metavar="KN", help="Speed at which the manoeuvres begin, knots.")
@click.option(
    "--turn35",
    metavar="FIGURES",
    help='Of a turn at 35 deg of rudder, m: "advance=970 transfer=400 tactical=980+-30", each if known, +- its error.',
)
@click.option("--zigzag10", metavar="FIGURES", help='Overshoots of a 10/10 zigzag, deg: "first=9.4 second=15".')
@click.option("--zigzag20", metavar="FIGURES", help='Overshoots of a 20/20 zigzag, deg: "first=14".')
@click.option("--name", default="guessed ship", show_default=True, help="Name of the ship on the card.")
@click.option("--members", type=number(GuessedShips), default=DEFAULT_MEMBERS, show_default=True)
@click.option("--seed", type=number(Seed), default=0, show_default=True, help="Seed of the members.")
@click.option("-o", "--output", type=OutputFile(CARD), metavar="CARD.toml", help="Write the card.")
@page_option()
@json_option
def command(
    length: float,
    beam: float,
    draught: float,
    block: float,
    speed: float,
    turn35: str | None,
    zigzag10: str | None,
    zigzag20: str | None,
    name: str,
    members: int,
    seed: int,
    output: Path | None,
    page: Path | None,
    json_file: Path | None,
) -> None:
    """Guess a ship from dimensions and the figures of a wheelhouse poster.

    A prior over ships, from published regressions and the bundled ships, is moved to the figures by simulation. The
    card has the errors that are left, next to it lies their covariance.
    """
    stated = {"turn35": turn35, "zigzag10": zigzag10, "zigzag20": zigzag20}
    result = guess_a_ship(
        length_m=length,
        beam_m=beam,
        draught_m=draught,
        block=block,
        speed_kn=speed,
        figures={manoeuvre: text for manoeuvre, text in stated.items() if text is not None},
        name=name,
        members=members,
        seed=seed,
    )
    files = result.card.files(output) if output and result.card else {}
    write_result(result, [], json_file=json_file, page=page, files=files)
    show_result(result)
    if output:
        screen.print(f"{output}: the card, with its covariance", soft_wrap=True, markup=False)
