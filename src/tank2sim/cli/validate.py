"""``tank2sim validate``: a validation report of a card, against trials where there are any."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import click
from rich.markup import escape

from tank2sim.analysis.stability.imo import imo_criteria
from tank2sim.analysis.validation.standard_trials import MEMBERS, ship_of
from tank2sim.analysis.validation.study import REQUIRED, Validation, Verified, validate, verify
from tank2sim.api.trials import trial_files
from tank2sim.arrays import Array
from tank2sim.cards import ManoeuvringCard, read_card
from tank2sim.cli.bridge import manoeuvring
from tank2sim.cli.console import json_option, json_text, screen, show_marked, show_notices, show_table
from tank2sim.cli.overrides import parse_changes
from tank2sim.errors import InputError
from tank2sim.files import write_together
from tank2sim.gap.outcome.export import signal_display_name
from tank2sim.gap.proof.card_replay import replay_by_card
from tank2sim.gap.result import Passed
from tank2sim.identification.trials.problem.prepare_trials import Measured, measured
from tank2sim.records.thinning import drawn_columns
from tank2sim.simulation.integrator import NO_COMPILER
from tank2sim.units import in_words

_REPLAY_SAMPLES = 240
"""Of each trial in the JSON, for charts; the record itself is the file."""


@click.command("validate")
@click.argument("card")
@click.argument("trials", nargs=-1, type=click.Path(path_type=Path), metavar="[TRIAL]...")
@click.option(
    "--members",
    type=click.IntRange(min=0, max=100_000),
    default=MEMBERS,
    show_default=True,
    help="Ships drawn within the card's errors for u_input; 0 for none.",
)
@click.option(
    "--required",
    type=click.FloatRange(min=0, min_open=True),
    default=REQUIRED,
    show_default=True,
    metavar="PERCENT",
    help="Level of validation that is required, U_reqd in per cent of each measured figure.",
)
@click.option(
    "--set", "settings", multiple=True, metavar="KEY=VALUE", help="A value in place of the card's, by dotted key."
)
@click.option(
    "-o", "--page", type=click.Path(path_type=Path, dir_okay=False), metavar="REPORT.html", help="Write the report."
)
@json_option
def command(card: str, trials: tuple[Path, ...], **options: Any) -> None:
    """Validate CARD in the manner of ITTC 7.5-02-06-03: by TRIALs that did not make it, figure by figure.

    A TRIAL that CARD was identified from, by its content or by the names in its source, can only refute it.
    """
    ship = manoeuvring(read_card(card, parse_changes(options["settings"])), "manoeuvres")
    files = trial_files(trials)
    given = measured(files, ship) if files else Measured((), "angle", ())
    found = validate(ship, given.trials, options["members"], options["required"])
    ready = ship_of(ship)
    verified, told = verify(ready, options["members"])
    criteria = imo_criteria(ready.model)
    replays, trouble = _replays(ship, given)
    compiler = () if ready.integrator.compiled else (NO_COMPILER,)
    notices = (*ready.model.notices, *given.notices, *found.notices, *told, *trouble, *compiler)
    contents: dict[Path, str | bytes] = {}
    if json_file := options["json_file"]:
        result = {
            "kind": "validate",
            "ship": ship.ship.name,
            "source": ship.ship.source,
            **found.as_json(),
            "verification": [{**vars(one), "U_num": one.numerical} for one in verified],
            "imo": [criterion.as_json() for criterion in criteria],
            "replays": [_replay_as_json(replay) for replay in replays],
            "notices": notices,
        }
        contents[json_file] = json_text(result)
    if page := options["page"]:
        # Drawing is asked for seldom, and its library is slow to load.
        from tank2sim.report.kit.page import render_page
        from tank2sim.report.validation.page import ValidationEvidence, validation_page

        evidence = ValidationEvidence(ship, ready.model, found, verified, criteria, replays, notices)
        contents[page] = render_page(validation_page(evidence))
    write_together(contents, inputs=[Path(ship.source), *files], outputs=(options["page"], options["json_file"]))
    others = show_marked(notices)
    _show(ship, found, verified)
    show_notices(others)


def _replays(card: ManoeuvringCard, given: Measured) -> tuple[tuple[Passed, ...], tuple[str, ...]]:
    """The replays, each by itself, so that one that cannot be replayed is reported and spoils no other."""
    found: list[Passed] = []
    messages: list[str] = []
    for trial in given.trials:
        try:
            found += replay_by_card(card, Measured((trial,), given.driven_by, ()))
        except InputError as error:
            messages.append(f"{trial.name}: not replayed: {error.problem}")
    return tuple(found), tuple(messages)


def _replay_as_json(one: Passed) -> dict[str, object]:
    """A trial as measured and as simulated, thinned to draw; columns as in a trial file."""
    names = {name: signal_display_name(name) for name in one.measured if name in one.before}

    def columns(values: Mapping[str, Array]) -> dict[str, list[float]]:
        own = {column.file: column.factor * values[name] for name, column in names.items()}
        return drawn_columns({"t_s": one.time_s, **own}, _REPLAY_SAMPLES)

    return {"trial": one.name, "measured": columns(one.measured), "simulated": columns(one.before)}


def _show(card: ManoeuvringCard, found: Validation, verified: tuple[Verified, ...]) -> None:
    screen.print(f"{escape(card.ship.name)}: [bold]{found.verdict}[/bold]", soft_wrap=True)
    if found.figures:
        show_table(
            "E = simulated less measured, and the validation uncertainty",
            ["trial", "figure", "measured", "simulated", "E", "U_val", "verdict"],
            [
                [
                    figure.trial,
                    " ".join(part for part in in_words(figure.name) if part),
                    figure.measured,
                    figure.simulated,
                    figure.error,
                    figure.uncertainty,
                    str(figure.outcome),
                ]
                for figure in found.figures
            ],
        )
    shares = [100 * abs(one.numerical / one.value) for one in verified if one.numerical is not None and one.value]
    if shares:
        screen.print(f"Numerical uncertainty of {len(shares)} figures of standard trials: {max(shares):.2g} % at most")
