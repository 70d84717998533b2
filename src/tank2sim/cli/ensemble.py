"""``--ensemble N``: how sure a result is, by many ships drawn from what the card says of its errors."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Executor
from contextlib import contextmanager
from typing import Any

import click

from tank2sim.analysis.ensemble.results import EnsembleRequest, Members, StabilityBands
from tank2sim.cards import Card, ManoeuvringCard
from tank2sim.cli.console import screen, show_marked, show_notices, show_table
from tank2sim.errors import InputError
from tank2sim.executors import EXECUTOR_FORMS, PROCESSES, check_executor, executing
from tank2sim.simulation.bands import Band
from tank2sim.simulation.ensemble import BATCH
from tank2sim.units import in_words

Command = Callable[..., Any]

executor_option = click.option(
    "--executor",
    default=PROCESSES,
    show_default=True,
    metavar="E",
    help=f"Who computes what can be computed apart: {EXECUTOR_FORMS}.",
)
"""``--executor``, the same on every command."""


def ensemble_options(command: Command) -> Command:
    """``--ensemble``, ``--seed`` and ``--executor``."""
    options = (
        click.option(
            "--ensemble",
            type=click.IntRange(2, 10_000_000),
            metavar="N",
            help="Also N ships drawn from the card's errors and their covariance: bands (5, 50, 95 %).",
        ),
        click.option("--seed", type=click.IntRange(0), default=0, show_default=True, help="Seed of the ensemble."),
        executor_option,
    )
    for option in reversed(options):
        command = option(command)
    return command


def asked_of(given: Mapping[str, object]) -> EnsembleRequest | None:
    """The ensemble asked for, if any.

    Raises
    ------
    InputError
        The executor cannot be used, or is given without an ensemble.
    """
    text = check_executor(str(given["executor"]))
    if given["ensemble"] is None:
        if text != PROCESSES:
            raise InputError("--executor", "", "has nothing to do without --ensemble", "give --ensemble N, too")
        return None
    return EnsembleRequest(int(str(given["ensemble"])), int(str(given["seed"])))


def uncertain_ship(card: Card) -> ManoeuvringCard:
    """The card, if it is one of which an ensemble can be drawn.

    Raises
    ------
    InputError
        It is no ship that manoeuvres.
    """
    if not isinstance(card, ManoeuvringCard):
        raise InputError(card.source, "model.kind", "is no ship that manoeuvres", "give a linear or abkowitz card")
    return card


@contextmanager
def computing(asked: EnsembleRequest, executor: object) -> Iterator[Executor | None]:
    """The executor of an ensemble; none for a few members, which are done before processes have begun."""
    if str(executor) == PROCESSES and asked.members <= 2 * BATCH:
        yield None
        return
    with executing(str(executor)) as found:
        yield found


def show_bands(bands: Mapping[str, Band], asked: Members, told: Sequence[str] = ()) -> None:
    """Print the bands of figures, and what is to be reported of the members and was not `told` before."""
    rows = []
    for name, band in bands.items():
        kind, at, argument = name.partition("@")
        words, unit = in_words(kind)
        rows.append([words + at + argument, unit, band.low, band.median, band.high, band.shown])
    remaining = show_marked(notice for notice in asked.notices if notice not in told)
    title = f"Ensemble of {asked.members}, seed {asked.seed}: nine of ten lie between 5 and 95 %"
    show_table(title, ["figure", "unit", "5 %", "50 %", "95 %", "shown by"], rows)
    show_notices(remaining)


def show_stability_bands(found: StabilityBands) -> None:
    """Print the bands of the straight course and the chances of the criteria."""
    show_bands(found.figures, found.asked)
    if found.stable is not None:
        screen.print(f"Stable on a straight course with probability {found.stable:.3g}")
    rows = [
        [
            chance.criterion.name,
            *((f"{value:.4g}" for value in (chance.band.low, chance.band.high)) if chance.band else (None, None)),
            f"{chance.criterion.allowed:.4g} {chance.criterion.unit}",
            None if chance.met is None else "beyond card" if chance.criterion.beyond_card else f"{chance.met:.3g}",
            None
            if chance.criterion.beyond_card
            else f"{chance.between[0]:.3f} to {chance.between[1]:.3f}"
            if chance.between
            else None,
        ]
        for chance in found.chances
    ]
    heads = ["criterion", "5 %", "95 %", "allowed", "P(met)", "interval of P"]
    show_table("IMO MSC.137(76), worse side, over the ensemble", heads, rows)
