"""Options that mean the same on every command."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import click

from tank2sim.arguments import DEFAULT_MEMBERS, ENSEMBLE, PROCESSES, Seed, bounds_of
from tank2sim.cli.overrides import parse_changes
from tank2sim.executors import EXECUTOR_FORMS
from tank2sim.files import JSON, PAGE, PICTURE, STANDARD_OUTPUT, refuse_other_ending

Command = Callable[..., Any]


def _parsed_changes(context: click.Context, parameter: click.Parameter, given: Sequence[str]) -> dict[str, object]:
    return parse_changes(given)


set_option = click.option(
    "--set",
    "values",
    multiple=True,
    metavar="KEY=VALUE",
    callback=_parsed_changes,
    help="A value in place of the card's, by dotted key: derivatives.Yv=-0.012.",
)
"""``--set KEY=VALUE``: values by dotted key."""


def number(kind: Any) -> click.IntRange | click.FloatRange:
    """The type of an option that has the bounds of a type of :mod:`tank2sim.arguments`."""
    bounds = bounds_of(kind)
    assert bounds is not None
    if bounds.whole:
        return click.IntRange(int(bounds.low or 0), None if bounds.high is None else int(bounds.high))
    return click.FloatRange(bounds.low, bounds.high, min_open=bounds.above)


class OutputFile(click.Path):
    """A file to be written, whose name ends as files of its kind do (:mod:`tank2sim.files`); a folder has no ending."""

    def __init__(self, endings: Sequence[str] | None, **more: Any) -> None:
        super().__init__(path_type=Path, **more)
        self.endings = endings

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """As of any parameter. Raises InputError if the name ends as files of another kind do."""
        path = Path(os.fsdecode(super().convert(value, param, ctx)))
        if self.endings == JSON and str(path) == "-":
            return STANDARD_OUTPUT
        if self.endings is not None:
            refuse_other_ending(path, self.endings)
        return path


plot_option = click.option(
    "--plot",
    type=OutputFile(PICTURE, dir_okay=False),
    metavar="FILE.png",
    help="Draw the main chart: .png, .svg or .pdf.",
)
"""``--plot FILE.png``."""

plot_folder_option = click.option(
    "--plot",
    "plots",
    type=OutputFile((), file_okay=False),
    metavar="DIR",
    help="Write a picture of each chart, and the page (report.html), into a folder.",
)
"""``--plot DIR``, where there are many charts."""

executor_option = click.option(
    "--executor",
    default=PROCESSES,
    show_default=True,
    metavar="E",
    help=f"Where independent work is computed: {EXECUTOR_FORMS}.",
)
"""``--executor``: processes of this machine, or a cluster."""


def page_option(*names: str) -> Callable[[Command], Command]:
    """``--page FILE.html``, and other names of it where the page is the main result."""
    path = OutputFile(PAGE, dir_okay=False)
    return click.option(*names, "--page", "page", type=path, metavar="FILE.html", help="Write the page.")


class _NumberOfShips(click.IntRange):
    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        try:
            int(value)
        except ValueError:
            self.fail(f"{value!r} is not a number of ships; give a whole number from {self.min} to {self.max}")
        return super().convert(value, param, ctx)


def ensemble_options(command: Command) -> Command:
    """``--ensemble``, ``--seed`` and ``--executor``."""
    options = (
        click.option(
            "--ensemble",
            "members",
            type=_NumberOfShips(2, int(ENSEMBLE.high or 0)),
            is_flag=False,
            flag_value=DEFAULT_MEMBERS,
            metavar="N",
            help="Also N ships drawn from the card's errors and their covariance, 2000 if N is left out: bands (5, 50, "
            "95 %).",
        ),
        click.option("--seed", type=number(Seed), default=0, show_default=True, help="Seed of the ensemble."),
        executor_option,
    )
    for option in reversed(options):
        command = option(command)
    return command
