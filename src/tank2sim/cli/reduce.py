"""``tank2sim reduce``: captive tests to derivatives with uncertainty."""

from __future__ import annotations

from pathlib import Path

import click

from tank2sim.api.reduction import reduce
from tank2sim.cli.console import json_option, screen, show_result, write_result
from tank2sim.cli.options import OutputFile, page_option, plot_folder_option
from tank2sim.errors import InputError
from tank2sim.files import CARD, TABLE
from tank2sim.identification.captive.result_card import FILLS


@click.command("reduce")
@click.argument("campaign", type=click.Path(path_type=Path))
@click.option("-o", "--output", type=OutputFile(CARD), metavar="CARD.toml", help="Write the ship card.")
@click.option(
    "--model",
    type=click.Choice(("polynomial", "mmg")),
    default="polynomial",
    help="Into what: a polynomial, or hull, propeller and rudder of the MMG method (steady tests with thrust and "
    "normal force of the rudder).",
)
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
@click.option(
    "--budget",
    type=OutputFile(TABLE, dir_okay=False),
    metavar="FILE.csv",
    help="Write the uncertainty budget (ITTC 7.5-02-06-04): shares of the variance, combined and expanded.",
)
@page_option()
@plot_folder_option
@json_option
def command(
    campaign: Path,
    output: Path | None,
    model: str,
    fill: str | None,
    scale: str | None,
    keep_going: bool,
    keep_fast: bool,
    off_speed: bool,
    all_terms: bool,
    test_symmetry: bool,
    budget: Path | None,
    page: Path | None,
    plots: Path | None,
    json_file: Path | None,
) -> None:
    """Reduce the captive tests in CAMPAIGN (campaign.toml) to derivatives with standard errors."""
    if model == "mmg":
        polynomial = {"--fill": fill, "--scale": scale, "--keep-going": keep_going, "--keep-fast": keep_fast}
        polynomial |= {"--off-speed": off_speed, "--all-terms": all_terms, "--test-symmetry": test_symmetry}
        for option, given in {**polynomial, "--budget": budget}.items():
            if given:
                raise InputError(option, "", "is of the polynomial reduction", "leave it out with --model mmg")
        _reduce_to_mmg(campaign, output, page, plots, json_file)
        return
    result = reduce(
        campaign,
        fill=fill,
        scale=scale,
        keep_going=keep_going,
        keep_fast=keep_fast,
        off_speed=off_speed,
        all_terms=all_terms,
        test_symmetry=test_symmetry,
    )
    files = result.card.files(output) if output else {}
    if budget:
        files[budget] = result.budget.to_csv(float_format="%.6g", lineterminator="\n")
    read = result.reduction.campaign.runs if result.reduction else ()
    inputs = [campaign, *(campaign.parent / run.name.partition(" line ")[0] for run in read)]
    write_result(result, inputs, json_file=json_file, page=page, plots=plots, files=files)
    show_result(result)
    if output:
        screen.print(f"{output}: {len(result.study.derivatives)} derivatives", soft_wrap=True, markup=False)


def _reduce_to_mmg(
    campaign: Path, output: Path | None, page: Path | None, plots: Path | None, json_file: Path | None
) -> None:
    # Not for the polynomial, which needs no model:
    from tank2sim.api.mmg_reduction import reduce_to_mmg

    result = reduce_to_mmg(campaign)
    assert result.fit and result.card
    form = result.fit.tests.form
    tables = [section.file for section in (form.averages, form.open_water) if section and section.file]
    files = result.card.files(output) if output else {}
    tables += [run.file for run in form.runs if form.averages is None]
    inputs = [campaign, *(campaign.parent / table for table in tables)]
    write_result(result, inputs, json_file=json_file, page=page, plots=plots, files=files)
    show_result(result)
    if output:
        screen.print(f"{output}: {len(result.coefficients)} coefficients", soft_wrap=True, markup=False)
