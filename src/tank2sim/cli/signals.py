"""``tank2sim signals``: statistics, spectra and filters of the signals of trials."""

from __future__ import annotations

from pathlib import Path

import click

from tank2sim.api.signals import signals
from tank2sim.arguments import PositiveArgument
from tank2sim.cli.console import json_option, show_result, write_result
from tank2sim.cli.options import OutputFile, number, page_option, plot_folder_option
from tank2sim.errors import InputError
from tank2sim.files import TABLE
from tank2sim.records.signals.requests import REQUEST_FORMS

_POSITIVE = number(PositiveArgument)


@click.command("signals")
@click.argument("trials", nargs=-1, required=True, type=click.Path(path_type=Path), metavar="TRIAL...")
@click.option("--column", "columns", multiple=True, metavar="NAME", help="Only this column (r_degps, ...); repeatable.")
@click.option(
    "--max-gap", "max_gap_s", type=_POSITIVE, metavar="S", help="Longest gap to bridge, s; by default five steps."
)
@click.option(
    "--segment",
    "segment_s",
    type=_POSITIVE,
    metavar="S",
    help="Length of spectral segments, s; by default eight, longer ones of slow signals.",
)
@click.option("--filter", "filter_text", metavar="F", help=f"Filter the column: {REQUEST_FORMS}.")
@click.option(
    "-o",
    "--output",
    "--out",
    type=OutputFile(TABLE),
    metavar="FILTERED.csv",
    help="Write the trial with the filtered column.",
)
@page_option()
@plot_folder_option
@json_option
def command(
    trials: tuple[Path, ...],
    columns: tuple[str, ...],
    max_gap_s: float | None,
    segment_s: float | None,
    filter_text: str | None,
    output: Path | None,
    page: Path | None,
    plots: Path | None,
    json_file: Path | None,
) -> None:
    """Mean, spread, correlation time, stationarity, normality and spectra of the signals of each TRIAL.

    Tests of normality are made on samples two correlation times apart: neighbours repeat each other, and all samples
    together make the tests reject what is normal.
    """
    if output and not filter_text:
        raise InputError("--output", "", "needs a filter", "say which with --filter, such as --filter lowpass:0.5")
    result = signals(trials, columns, max_gap_s=max_gap_s, segment_s=segment_s, filter=filter_text)
    files = {output: result.filtered.to_csv()} if output and result.filtered else {}
    inputs = [Path(trial.trial) for trial in result.study.trials]
    write_result(result, inputs, json_file=json_file, page=page, plots=plots, files=files)
    show_result(result)
