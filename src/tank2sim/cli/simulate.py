"""``tank2sim simulate``: a standard manoeuvre of a ship."""

from __future__ import annotations

from pathlib import Path

import click

from tank2sim.analysis.ensemble.results import ManoeuvreBands, manoeuvre_bands
from tank2sim.cards import read_card
from tank2sim.cli.changes import parse_changes
from tank2sim.cli.ensemble import asked_of, computing, ensemble_options, show_bands, uncertain_ship
from tank2sim.cli.screen import json_option, json_text, show_marked, show_notices, show_table
from tank2sim.dynamics import build
from tank2sim.files import write_together
from tank2sim.simulation.card_range import Reading, entry_name
from tank2sim.simulation.manoeuvres import FORMS, parse_manoeuvre
from tank2sim.simulation.run import Run, simulate
from tank2sim.simulation.trial_file import histories, trial_csv
from tank2sim.units import in_words


@click.command("simulate")
@click.argument("card")
@click.option(
    "--manoeuvre", required=True, metavar="M", help=f"{FORMS}. Angles in deg, + to starboard; execute at t = 0."
)
@click.option(
    "--duration", type=float, metavar="S", help="Length of the run in s; by default what the manoeuvre needs."
)
@click.option(
    "--set", "settings", multiple=True, metavar="KEY=VALUE", help="A value in place of the card's, by dotted key."
)
@click.option("--out", type=click.Path(path_type=Path), metavar="run.csv", help="Write the motion as a trial CSV.")
@click.option("--plot", type=click.Path(path_type=Path), metavar="run.png", help="Draw track and time histories.")
@ensemble_options
@json_option
def command(card: str, manoeuvre: str, duration: float | None, settings: tuple[str, ...], **more: object) -> None:
    """Simulate a manoeuvre of CARD (a file, or the name of a bundled ship) and read off its figures."""
    asked, executor = asked_of(more), more["executor"]
    files = {name: path if isinstance(path := more[name], Path) else None for name in ("out", "plot", "json_file")}
    ship = read_card(card, parse_changes(settings))
    model, steered = build(ship), parse_manoeuvre(manoeuvre)
    run = simulate(model, steered, duration_s=duration)
    bands = None
    if asked:
        length = duration, float(run.trajectory.t[-1])
        with computing(asked, executor) as pool:
            bands = manoeuvre_bands(uncertain_ship(ship), steered, length, asked, pool)
    contents: dict[Path, str | bytes] = {}
    if out := files["out"]:
        contents[out] = trial_csv(run.trajectory, f"tank2sim simulation of {ship.ship.name}: {manoeuvre}")
    if plot := files["plot"]:
        contents[plot] = _picture(run, f"{ship.ship.name}, {manoeuvre}", bands)
    if json_file := files["json_file"]:
        result = {"ship": ship.ship.name, "manoeuvre": manoeuvre, "figures": run.figures, **run.reading.as_json()}
        result["notices"] = run.notices
        result |= {"histories": histories(run.trajectory)}
        contents[json_file] = json_text(result | ({"ensemble": bands.as_json()} if bands else {}))
    orders = Path(manoeuvre.removeprefix("file:"))
    write_together(contents, inputs=[Path(ship.source), orders], outputs=files.values())
    others = show_marked(run.notices)
    rows = [[*in_words(name), value, _beyond(name, value, run.reading)] for name, value in run.figures.items()]
    heads = ["figure", "unit", "value", "card"]
    if not run.reading.message:
        rows, heads = [row[:3] for row in rows], heads[:3]
    show_table(f"{ship.ship.name}, {manoeuvre}", heads, rows)
    show_notices(others)
    if bands:
        show_bands(bands.figures, bands.asked)


def _beyond(name: str, value: object, read: Reading) -> str:
    """Whether a figure was settled outside the card's range, for the table; of a list, from which entry on."""
    if not isinstance(value, list):
        return "beyond" if value is not None and read.outside(name) else ""
    outside = [place for place in range(len(value)) if read.outside(entry_name(name, place))]
    return "" if not outside else "beyond" if outside[0] == 0 else f"beyond from no. {outside[0] + 1}"


def _picture(run: Run, title: str, bands: ManoeuvreBands | None) -> bytes:
    # Drawing is asked for seldom, and its library is slow to load.
    from tank2sim.report.charts import chart_png
    from tank2sim.report.ensemble import banded_chart
    from tank2sim.report.runs import run_chart

    return chart_png(banded_chart(title, run.trajectory, bands) if bands else run_chart(title, run.trajectory))
