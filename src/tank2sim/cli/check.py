"""``tank2sim check``: is an FMU what its card says?"""

from __future__ import annotations

from pathlib import Path

import click
from rich.markup import escape

from tank2sim.cards import parse_card, read_card
from tank2sim.cli.screen import json_option, json_text, screen, show_notices, show_table
from tank2sim.dynamics import build
from tank2sim.dynamics.model import Model
from tank2sim.files import write_whole
from tank2sim.fmu.check import CheckReport, check_fmu
from tank2sim.fmu.unpacking import embedded_card

MOST_PROBLEMS = 8
"""How many problems the screen shows."""


@click.command("check")
@click.argument("fmu", type=click.Path(path_type=Path))
@click.option("--card", help="What it should be: a card, or a bundled ship's name; by default the card in the FMU.")
@json_option
def command(fmu: Path, card: str | None, json_file: Path | None) -> int:
    """Validate FMU and drive it through fmpy, in each kind it offers, beside the CasADi model of its card.

    It runs the FMU's own code, with your rights: check only files from sources that you trust.

    Ends with exit code 1 if the description is not valid or an output differs.
    """
    model = _model(fmu, card)
    report = check_fmu(fmu, model=model)
    if json_file:
        write_whole(json_file, json_text(report.as_json()), inputs=[fmu, *([Path(card)] if card else [])])
    _show(report)
    return 0 if report.passed else 1


def _model(fmu: Path, card: str | None) -> Model | None:
    if card is not None:
        return build(read_card(card))
    text = embedded_card(fmu)
    return None if text is None else build(parse_card(text, f"{fmu}: resources/ship.toml"))


def _show(report: CheckReport) -> None:
    if report.errors:
        rows = [[name, *(errors.get(name) for errors in report.errors.values())] for name in report.max_error]
        rows.append(["limit", *(report.limits[kind] for kind in report.errors)])
        title = f"{report.path}: largest errors in {report.duration_s:g} s, relative to each output's range"
        show_table(title, ["output", *report.errors], rows)
    if report.reference_error is not None:
        words = f"repeats the reference result that it carries; largest error {report.reference_error:.1e} of a range"
        screen.print(f"{report.path}: {words}", soft_wrap=True, markup=False)
    problems = [*report.validation, *report.differences]
    for problem in problems[:MOST_PROBLEMS]:
        screen.print(f"[red]wrong:[/red] {escape(problem)}", soft_wrap=True)
    if len(problems) > MOST_PROBLEMS:
        screen.print(f"... and {len(problems) - MOST_PROBLEMS} more (--json has all)")
    if not report.compared:
        show_notices(["the FMU carries no card: only its description was validated; give --card to compare"])
    verdict = ("passed" if report.compared else "valid") if report.passed else "FAILED"
    screen.print(f"{report.path}: FMI {report.fmi}, {', '.join(report.kinds)}: {verdict}", soft_wrap=True, markup=False)
