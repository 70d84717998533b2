"""``tank2sim design``: the next captive campaign, or the next sea trial."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import click

from tank2sim.api.bounds import DrawsArgument, Seed
from tank2sim.api.design import DESIGN_FIGURES, CampaignDesignResult, TrialDesignResult, design_campaign, design_trial
from tank2sim.api.ship import load
from tank2sim.cli.console import json_option, screen, show_result, write_result
from tank2sim.cli.options import OutputFile, number, page_option, plot_option, set_option
from tank2sim.cli.trials import TakesSeveral
from tank2sim.design.captive_design import DRAWN_SHIPS
from tank2sim.errors import InputError
from tank2sim.files import CARD, TABLE, refuse_doubled, writable_folder


@click.command("design", cls=TakesSeveral, several=("--figures", "--sensors"))
@click.argument("card")
@click.option(
    "--figures",
    multiple=True,
    metavar="F ...",
    help="Figures to be certain of, with blanks or commas between, as of tank2sim influence; units may be left out: "
    f"advance@35,overshoot_1_deg@10/10.  [default: {', '.join(DESIGN_FIGURES)}]",
)
@click.option("--hours", type=float, metavar="H", help="Time in the tank; by default that of the usual matrix once.")
@click.option(
    "--tank",
    type=click.Path(path_type=Path, dir_okay=False),
    metavar="TANK.toml",
    help="Carriage, mechanism and gauges of the tank, and the model.",
)
@click.option("--carriage-length", type=float, metavar="M", help="Way of the carriage, m, in place of the file's.")
@click.option("--model-length", type=float, metavar="M", help="Length of the model, m; by default 4.")
@click.option(
    "--usual",
    type=click.Path(path_type=Path, dir_okay=False),
    metavar="CAMPAIGN.toml",
    help="Compare with the runs of this campaign, in place of the usual matrix.",
)
@click.option(
    "--largest",
    metavar="DRIFT/RUDDER/RATE",
    help="Largest drift and rudder, deg, and r' of the tests: 12/35/0.6; by default those of the figures' manoeuvres.",
)
@click.option("--trial", is_flag=True, help="Design a sea trial in place of a campaign.")
@click.option("--minutes", type=float, metavar="M", help="Time of the trial; by default that of the usual set.")
@click.option(
    "--sensors",
    multiple=True,
    metavar="COLUMN=SD ...",
    help="Of a trial: standard deviation of a reading a second, by column: u_mps=0.05 r_degps=0.02 x_m=1.",
)
@click.option(
    "--orders",
    type=OutputFile((), file_okay=False),
    metavar="DIR",
    help="Of a trial: write the orders of each manoeuvre, for simulate --manoeuvre file:.",
)
@click.option("--one-side", is_flag=True, help="Figures to the side of the given rudder, not the mean of both sides.")
@click.option("--no-checks", is_flag=True, help="No runs that show whether the polynomial holds.")
@click.option(
    "--draws",
    type=number(DrawsArgument),
    default=DRAWN_SHIPS,
    show_default=True,
    help="Ships drawn from the card's errors, for which the plan is to be good as well.",
)
@click.option("--seed", type=number(Seed), default=0, show_default=True, help="Seed of the drawn ships.")
@set_option
@click.option("-o", "--output", type=OutputFile(TABLE), metavar="PLAN.csv", help="Write the plan.")
@click.option(
    "--campaign",
    "template",
    type=OutputFile(CARD),
    metavar="CAMPAIGN.toml",
    help="Write the campaign's file for tank2sim reduce, which then lacks only the files of the runs.",
)
@page_option()
@plot_option
@json_option
def command(
    card: str,
    figures: tuple[str, ...],
    hours: float | None,
    tank: Path | None,
    carriage_length: float | None,
    model_length: float | None,
    usual: Path | None,
    largest: str | None,
    trial: bool,
    minutes: float | None,
    sensors: tuple[str, ...],
    orders: Path | None,
    one_side: bool,
    no_checks: bool,
    draws: int,
    seed: int,
    values: dict[str, object],
    output: Path | None,
    template: Path | None,
    page: Path | None,
    plot: Path | None,
    json_file: Path | None,
) -> None:
    """Design the next captive campaign of CARD (a file, or a bundled ship), or with --trial the next sea trial.

    Of all runs that the tank can make, those with repeats that make the figures most certain in the hours, shown next
    to the usual matrix: standard errors of the figures by both, and the hours in which a plan is as certain.
    """
    refuse_doubled([output, template, page, plot, json_file])
    ship = load(card, values)
    tank_options: dict[str, object] = {"--hours": hours, "--tank": tank, "--carriage-length": carriage_length}
    tank_options |= {"--model-length": model_length, "--usual": usual, "--campaign": template}
    tank_options |= {"--largest": largest}
    trial_options = {"--minutes": minutes, "--sensors": sensors, "--orders": orders}
    result: CampaignDesignResult | TrialDesignResult
    files: list[tuple[Path, str | bytes]] = []
    if trial:
        _refuse_options(
            tank_options | {"--no-checks": no_checks or None}, "is of a campaign", "leave out --trial, or it"
        )
        result = design_trial(
            ship,
            figures=figures or DESIGN_FIGURES,
            minutes=minutes,
            sensors=_parsed_sensors(sensors) if sensors else None,
            one_side=one_side,
        )
        if orders:
            writable_folder(orders)
            files += [(orders / name, text) for name, text in result.orders.items()]
    else:
        _refuse_options(trial_options, "is of a sea trial", "add --trial, or leave it out")
        result = design_campaign(
            ship,
            figures=figures or DESIGN_FIGURES,
            hours=hours,
            tank=tank,
            carriage_length_m=carriage_length,
            model_length_m=model_length,
            usual=usual,
            largest=_parsed_range(largest) if largest else None,
            check_runs=not no_checks,
            one_side=one_side,
            draws=draws,
            seed=seed,
        )
        if template:
            files.append((template, result.template))
    if output:
        files.append((output, result.plan))
    inputs: list[str | Path] = [ship.card.source, *(path for path in (tank, usual) if path)]
    write_result(result, inputs, json_file=json_file, page=page, plot=plot, files=files)
    show_result(result)
    for path, _ in files:
        screen.print(f"{path} written", soft_wrap=True, markup=False)


def _refuse_options(options: Mapping[str, object], problem: str, remedy: str) -> None:
    for option, value in options.items():
        if value not in (None, ()):
            raise InputError(option, "", problem, remedy)


def _parsed_range(text: str) -> tuple[float, float, float]:
    try:
        drift, rudder, rate = map(float, text.split("/"))
    except ValueError:
        raise InputError("--largest", text, "cannot be read", "give DRIFT/RUDDER/RATE, as 12/35/0.6") from None
    return drift, rudder, rate


def _parsed_sensors(given: Sequence[str]) -> dict[str, float]:
    found: dict[str, float] = {}
    for text in (part for each in given for part in each.split(",") if part.strip()):
        column, _, number = text.partition("=")
        column = column.strip()
        try:
            size = float(number)
        except ValueError:
            raise InputError("--sensors", text, "cannot be read", "give COLUMN=SD, as r_degps=0.02") from None
        if found.setdefault(column, size) != size:
            raise InputError("--sensors", text, f"is given before as {found[column]:g}", "give each sensor once")
    return found
