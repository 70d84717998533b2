"""``tank2sim compare``: cards of one ship side by side, by coefficients and by trajectories."""

from __future__ import annotations

from pathlib import Path

import click
from rich.markup import escape

from tank2sim.analysis.validation.coefficients import BEYOND_STANDARD_ERRORS
from tank2sim.analysis.validation.comparison import CardComparison, compare_cards
from tank2sim.analysis.validation.standard_trials import MEMBERS
from tank2sim.cards import read_card
from tank2sim.cli.bridge import manoeuvring
from tank2sim.cli.console import json_option, json_text, screen, show_marked, show_notices, show_table
from tank2sim.files import write_together
from tank2sim.units import in_words

_MOST = 10
"""Coefficients that the screen shows of each card; the JSON and the page have all."""

_SHOWN = ("advance_m", "tactical_diameter_m", "overshoot_1_deg", "overshoot_2_deg", "track_reach_m")


@click.command("compare")
@click.argument("cards", nargs=-1, required=True, metavar="CARD CARD ...")
@click.option(
    "--members",
    type=click.IntRange(min=0, max=100_000),
    default=MEMBERS,
    show_default=True,
    help="Ships drawn within the errors of each card for the deviations of figures; 0 for none.",
)
@click.option(
    "-o", "--page", type=click.Path(path_type=Path, dir_okay=False), metavar="FILE.html", help="Write the page."
)
@json_option
def command(cards: tuple[str, ...], members: int, page: Path | None, json_file: Path | None) -> None:
    """Compare cards of one ship; the first is the reference (captive, trial, estimate: in any order)."""
    ships = [manoeuvring(read_card(card), "manoeuvres") for card in cards]
    found = compare_cards(ships, members)
    contents: dict[Path, str | bytes] = {}
    if json_file:
        contents[json_file] = json_text(found.as_json())
    if page:
        contents[page] = _page(found)
    write_together(contents, inputs=[Path(ship.source) for ship in ships], outputs=(page, json_file))
    _show(found)


def _page(found: CardComparison) -> str:
    # Drawing is asked for seldom, and its library is slow to load.
    from tank2sim.report.comparison.page import compare_page
    from tank2sim.report.kit.page import render_page

    return render_page(compare_page(found))


def _show(found: CardComparison) -> None:
    others = show_marked(found.notices)
    for place, label in enumerate(found.labels[1:], start=1):
        rms = found.rms(place)
        apart = "" if rms is None else f", rms {rms:.3g} (1 by chance)"
        apart += f"; {same} more are the reference's own numbers" if (same := found.same(place)) else ""
        screen.print(
            f"[bold]{escape(label)}[/bold] against {escape(found.labels[0])}: of {len(found.in_errors(place))} "
            f"coefficients {found.beyond(place)} differ by more than {BEYOND_STANDARD_ERRORS:g} standard errors{apart}",
            soft_wrap=True,
        )
        rows = [row for row in found.rows if row.differences[place - 1].standard_errors is not None]
        rows.sort(key=lambda row: -abs(row.differences[place - 1].standard_errors or 0.0))
        show_table(
            f"Farthest apart: {label}",
            ["coefficient", found.labels[0], label, "difference (%)", "standard errors"],
            [
                [
                    row.name,
                    row.cards[0].value,
                    row.cards[place].value,
                    row.differences[place - 1].percent,
                    row.differences[place - 1].standard_errors,
                ]
                for row in rows[:_MOST]
            ],
        )
    show_table(
        "Figures (standard deviation)",
        ["trial", "figure", *found.labels],
        [
            [
                trial.name,
                " ".join(part for part in in_words(row.name) if part),
                *_with_errors(row.values, row.deviations),
            ]
            for trial in found.trials
            for row in trial.figures
            if row.name in _SHOWN
        ],
    )
    show_notices(others)


def _with_errors(values: tuple[float | None, ...], deviations: tuple[float | None, ...]) -> list[str]:
    return [
        "-" if value is None else f"{value:.4g}" + ("" if error is None else f" ({error:.3g})")
        for value, error in zip(values, deviations, strict=True)
    ]
