"""``tank2sim reduce``: captive tests to derivatives with uncertainty."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import click
from rich.markup import escape

from tank2sim.cards import parse_card
from tank2sim.cards.covariance import Covariance
from tank2sim.cli.console import json_option, json_text, screen, show_notices, show_table
from tank2sim.cli.ensemble import with_covariance
from tank2sim.errors import InputError
from tank2sim.files import writable_folder, write_together
from tank2sim.identification.captive.as_json import reduction_as_json
from tank2sim.identification.captive.covariance import reduction_covariance
from tank2sim.identification.captive.findings import implausible, reduction_findings
from tank2sim.identification.captive.reduction import Reduction, ReductionOptions, reduce_campaign
from tank2sim.identification.captive.result_card import (
    FILLS,
    Contents,
    card_contents,
    reduced_card_text,
    reynolds_ratio,
)
from tank2sim.identification.captive.tables import (
    derivative_rows,
    prediction_rows,
    terms_left_out,
    terms_not_excited,
)
from tank2sim.records.campaigns import FORCE_COLUMNS, Campaign, read_campaign


@click.command("reduce")
@click.argument("campaign", type=click.Path(path_type=Path))
@click.option("-o", "--output", type=click.Path(path_type=Path), metavar="CARD.toml", help="Write the ship card.")
@click.option(
    "--fill",
    type=click.Choice(tuple(FILLS)),
    help="Take what the campaign cannot give from this published estimate, marked and with a wide uncertainty.",
)
@click.option(
    "--scale", metavar="LAMBDA", help="Write the card of a ship so many times as long; 'ship': [model] scale."
)
@click.option("--keep-going", is_flag=True, help="Leave out runs at fault and reduce the rest.")
@click.option("--keep-fast", is_flag=True, help="Use runs with omega U/g of 0.1 and more, too.")
@click.option("--off-speed", is_flag=True, help="Use runs away from the test speed, too, for terms in the speed.")
@click.option("--all-terms", is_flag=True, help="Keep terms that the tests do not determine.")
@click.option("--test-symmetry", is_flag=True, help="Test terms that port-starboard symmetry leaves out.")
@click.option("--plot", "plots", type=click.Path(path_type=Path, file_okay=False), metavar="DIR", help="Plots, page.")
@json_option
def command(
    campaign: Path, *, fill: str | None, scale: str | None, plots: Path | None, output: Path | None, **more: object
) -> None:
    """Reduce the captive tests in CAMPAIGN (campaign.toml) to derivatives with standard errors."""
    json_file = more.pop("json_file")
    read = read_campaign(campaign, keep_going=bool(more["keep_going"]))
    ratio = scale_of(read, scale)
    if ratio is not None:
        read = at_scale(read, ratio)
    reduction = reduce_campaign(read, ReductionOptions(**{key: bool(value) for key, value in more.items()}))
    card = card_contents(reduction, fill)
    warnings = (*reduction_findings(reduction), *_fill_notices(card, fill, ratio, read))
    files: dict[Path, str | bytes] = {}
    if output:
        text = reduced_card_text(reduction, card, ratio or 1.0)
        parse_card(text, str(output))  # refuses what is no ship here, before anything is written
        files |= with_covariance(text, output, _covariance(reduction, card))
    if isinstance(json_file, Path):
        files[json_file] = json_text(reduction_as_json(reduction, card, warnings))
    if plots:
        files |= _pictures(reduction, card, warnings, plots)
    measured = [campaign.parent / run.name.partition(" line ")[0] for run in read.runs]
    asked = [output, json_file if isinstance(json_file, Path) else None]
    write_together(files, inputs=[campaign, *measured], outputs=asked)
    grave = implausible(reduction)
    for warning in grave:
        screen.print(f"[bold red]warning:[/bold red] {escape(warning)}", soft_wrap=True)
    _show(reduction, card)
    show_notices(warning for warning in warnings if warning not in grave)
    if output:
        screen.print(f"{output}: {len(card.entries)} derivatives", soft_wrap=True, markup=False)


def _covariance(reduction: Reduction, card: Contents) -> Covariance:
    """Of what was measured; what is estimated is independent of it."""
    names = [name for name in card.entries if name in reduction.derivatives and name not in card.estimated]
    return Covariance(tuple(f"derivatives.{name}" for name in names), reduction_covariance(reduction, names))


def scale_of(campaign: Campaign, given: str | None) -> float | None:
    """The ratio of lengths asked for: a number, or ``ship`` for that of the campaign; None if none was.

    Raises
    ------
    InputError
        It is no number of at least 1, or the campaign gives none.
    """
    if given is None:
        return None
    if given == "ship":
        if campaign.model.scale is None:
            raise InputError(campaign.path, "model.scale", "is missing", "add it, or give --scale a number")
        return campaign.model.scale
    try:
        ratio = float(given)
    except ValueError:
        ratio = 0.0
    if not 1.0 <= ratio < 1e4:
        raise InputError("--scale", "", f"{given} is no ratio of lengths", "give a number such as 46.4, or 'ship'")
    return ratio


def at_scale(campaign: Campaign, ratio: float) -> Campaign:
    """The campaign with this ratio of lengths in place of its own."""
    return replace(campaign, model=campaign.model.model_copy(update={"scale": ratio}))


def _fill_notices(card: Contents, fill: str | None, ratio: float | None, campaign: Campaign) -> list[str]:
    told = []
    if card.estimated:
        told.append(
            f"Estimated, not measured, with wide standard errors ({FILLS[fill or '']}): {', '.join(card.estimated)}."
        )
    if card.missing:
        remedy = "" if fill else f" --fill {next(iter(FILLS))} takes what it can from a published estimate."
        told.append(
            f"The card has no {', '.join(card.missing)}: they are zero there, and a manoeuvre simulated with it is as "
            f"wrong as that.{remedy}"
        )
    if {"Yr", "Nr"} & set(card.estimated) and not {"Nvvr", "Nrrr"} & set(card.entries):
        told.append("No term of third order in the yaw rate was measured or estimated: hard turns come out too tight.")
    if ratio:
        told.append(
            f"The card is of a ship {ratio:g} times as long as the model, at the same Froude number; its Reynolds "
            f"number is {reynolds_ratio(campaign, ratio):.4g} times the model's, for which nothing was corrected."
        )
    return told


def _pictures(reduction: Reduction, card: Contents, warnings: tuple[str, ...], folder: Path) -> dict[Path, str | bytes]:
    """A picture of each chart, and the page that has them all."""
    from tank2sim.report.captive.page import reduction_page
    from tank2sim.report.captive.results import reduction_charts
    from tank2sim.report.kit.charts import chart_png
    from tank2sim.report.kit.page import render_page

    writable_folder(folder)
    charts = reduction_charts(reduction)
    pictures: dict[Path, str | bytes] = {folder / f"{stem}.png": chart_png(chart) for stem, chart in charts.items()}
    return {**pictures, folder / "report.html": render_page(reduction_page(reduction, card, warnings, charts))}


def _show(reduction: Reduction, card: Contents) -> None:
    rows: list[list[object]] = []
    for row in derivative_rows(reduction, card):
        own, steps = f"{row.value:.5g} ± {row.standard_error:.2g}", row.stepped
        other = f"{steps.value:.5g} ± {steps.standard_error:.2g} ({steps.found_in})" if steps else "-"
        rows.append([row.name, own, other, row.origin])
    title = f"{reduction.campaign.model.name}: derivatives from {len(reduction.runs)} runs (prime, rudder to starboard)"
    show_table(title, ["", "whole campaign", "paper's order", ""], rows)
    if dropped := [[choice.name, choice.reason, choice.told] for choice in terms_left_out(reduction)]:
        show_table("Terms that the runs excite and that were left out", ["", "", "why"], dropped)
    screen.print(f"Not excited by any run: {', '.join(terms_not_excited(reduction))}", soft_wrap=True, markup=False)
    show_table(
        "Leave-one-out: root mean square error of each run predicted from the others, % of the range",
        ["runs of type", *FORCE_COLUMNS],
        [
            [kind, *(f"{errors[force]:.2g}" if force in errors else "-" for force in FORCE_COLUMNS)]
            for kind, errors in prediction_rows(reduction).items()
        ],
    )
