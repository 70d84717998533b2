"""``tank2sim tow``: surge mass and drag from accelerating tows."""

from __future__ import annotations

from pathlib import Path

import click

from tank2sim.cards import parse_card
from tank2sim.cli.screen import json_option, json_text, screen, show_notices, show_table, shown
from tank2sim.files import write_together
from tank2sim.identification.tow import METHODS, TowResult, identify_tow, parse_terms
from tank2sim.identification.tow_card import tow_card_text
from tank2sim.identification.tow_fit import TowFit
from tank2sim.records.tows import read_tows


@click.command("tow")
@click.argument("tow", type=click.Path(path_type=Path))
@click.option(
    "--force-N", "--force-n", "force", type=float, metavar="F", help="Towing force, N; else that in the file."
)
@click.option(
    "--mass-kg", "mass", type=float, metavar="M", help="Mass with the water inside, kg; else that in the file."
)
@click.option("--terms", default="B3,B2,B1", show_default=True, help="Drag terms of (1.5) beside M; or none.")
@click.option(
    "--method",
    type=click.Choice(METHODS),
    default="output_error",
    show_default=True,
    help="Whose numbers the card gets.",
)
@click.option("-o", "--output", type=click.Path(path_type=Path), metavar="CARD.toml", help="Write a surge card.")
@json_option
def command(
    tow: Path, force: float | None, mass: float | None, *, terms: str, method: str, **files: Path | None
) -> None:
    """Estimate M and drag of M dv/dt + B1 v^4 + B2 v^3 + B3 v^2 = T from the tows in TOW (a CSV)."""
    result = identify_tow(read_tows(tow), force, mass, terms=parse_terms(terms))
    contents: dict[Path, str | bytes] = {}
    if output := files["output"]:
        contents[output] = card_text(result, method, str(output))
    if json_file := files["json_file"]:
        contents[json_file] = json_text(result.as_json())
    write_together(contents, inputs=[tow], outputs=files.values())
    _show(result)
    if output:
        screen.print(f"{output}: the card has the numbers of {method}", soft_wrap=True, markup=False)


def card_text(result: TowResult, method: str, name: str) -> str:
    """Text of the card with one method's numbers.

    Raises
    ------
    InputError
        They are no body's: the total mass is not positive.
    """
    fit = result.fits.get(method) or result.fits["qr"]
    source = f"tank2sim tow {result.tows.path.name}, method {fit.method}"
    text = tow_card_text(result, fit, name=Path(name).stem, source=source)
    parse_card(text, name)  # refuses a negative mass here, before anything is written
    return text


def _show(result: TowResult) -> None:
    fits = result.fits.values()
    rows: list[list[object]] = [[name, *(_estimate(fit, name) for fit in fits)] for name in next(iter(fits)).estimates]
    rows.append(["J of (1.6), N s^1/2", *(shown(fit.J) for fit in fits)])
    rows.append(["condition number, scaled", *(f"{fit.condition_scaled:.3g}" for fit in fits)])
    rows.append(["largest speed error, m/s", *(shown(fit.largest_speed_error_mps) for fit in fits)])
    title = f"{result.tows.path.name}: T = {result.force_N:g} N, m = {result.mass_kg:g} kg"
    show_table(title, ["", *result.fits], rows)
    show_notices(result.warnings)


def _estimate(fit: TowFit, name: str) -> str:
    error = fit.standard_errors.get(name)
    return f"{fit.estimates[name]:.5g}" + (f" ± {error:.2g}" if error is not None else "")
