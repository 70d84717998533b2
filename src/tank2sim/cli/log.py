"""``tank2sim log``: a vessel's own log, cut into trials."""

from __future__ import annotations

from pathlib import Path

import click

from tank2sim.apps.logs.channels import CHANNELS_FILE
from tank2sim.apps.logs.command import log
from tank2sim.apps.logs.trial_files import remove_earlier_trials
from tank2sim.cli.console import json_option, screen, show_notices, show_result, write_result
from tank2sim.cli.options import OutputFile, page_option
from tank2sim.gap.outcome.files import folder_made


@click.command("log")
@click.argument("logs", nargs=-1, required=True, type=click.Path(path_type=Path), metavar="FILE...")
@click.option(
    "-o",
    "--output",
    required=True,
    type=OutputFile((), file_okay=False),
    metavar="DIR",
    help=f"Folder for {CHANNELS_FILE} and the trials.",
)
@click.option(
    "--channels",
    "channels_file",
    type=click.Path(path_type=Path, dir_okay=False),
    metavar="FILE.toml",
    help=f"Which stream is which quantity; by default {CHANNELS_FILE} of the folder, if it is there, else found.",
)
@click.option(
    "--card",
    metavar="CARD",
    help="Card of a small craft with thrusters: say of each coefficient whether these trials determine it, and which "
    "five minutes would.",
)
@page_option()
@json_option
def command(
    logs: tuple[Path, ...],
    output: Path,
    channels_file: Path | None,
    card: str | None,
    page: Path | None,
    json_file: Path | None,
) -> None:
    """Read the logs of one voyage, find which stream is what, and cut its manoeuvres into trials.

    FILE is NMEA 0183, NMEA 2000 (candump, Actisense), a ROS 1 or ROS 2 bag, MCAP, ArduPilot .bin or .tlog, PX4 .ulg, or
    any CSV; all but CSV need tank2sim[logs]. What is found is written to channels.toml with its confidence; correct it
    and run again, and it is taken as it is.
    """
    present = output / CHANNELS_FILE
    stated = channels_file or (present if present.is_file() else None)
    with folder_made(output):
        result = log(logs, channels=stated, card=card)
        files = result.files(output)
        inputs = [*logs, *([stated] if stated else [])]
        write_result(result, inputs, json_file=json_file, page=page, files=files)
        removed = remove_earlier_trials(output, files)
    show_result(result)
    if removed:
        show_notices([f"removed what an earlier run cut: {', '.join(removed)}"])
    names = ", ".join(sorted(path.name for path in files))
    screen.print(f"{output}: {names or 'nothing written'}", soft_wrap=True, markup=False)
