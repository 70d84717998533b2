"""``tank2sim identify``: coefficients from free-running trials."""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import Executor
from contextlib import contextmanager
from pathlib import Path

import click

from tank2sim.analysis.ensemble.draws import by_file_name
from tank2sim.cards import ManoeuvringCard, parse_card, read_card
from tank2sim.cli.console import json_option, json_text, screen, show_notices, show_table
from tank2sim.cli.ensemble import executor_option, with_covariance
from tank2sim.cli.progress import showing_progress
from tank2sim.cli.trials import TakesSeveral, fitted_and_held, trial_files
from tank2sim.errors import InputError
from tank2sim.executors import PROCESSES, check_executor, executing
from tank2sim.files import writable_folder, write_together
from tank2sim.identification.trials.as_json import (
    estimate_rows,
    figure_rows,
    following_rows,
    identification_as_json,
    identified_card_text,
    structure_rows,
)
from tank2sim.identification.trials.assessment.notices import remarks
from tank2sim.identification.trials.assessment.replays import replays, replays_as_json
from tank2sim.identification.trials.identify import AUTO, TRIAL_METHODS, Identification, IdentificationOptions, identify
from tank2sim.identification.trials.problem.prepare_trials import Measured
from tank2sim.identification.trials.problem.structures import STRUCTURES
from tank2sim.marks import FORCED
from tank2sim.units import in_words


@click.command("identify", cls=TakesSeveral, several=("--holdout",))
@click.argument("card")
@click.argument("trials", nargs=-1, required=True, type=click.Path(path_type=Path))
@click.option(
    "--holdout",
    multiple=True,
    type=click.Path(path_type=Path),
    metavar="TRIAL...",
    help="Compare with these; do not fit them.",
)
@click.option("-o", "--output", type=click.Path(path_type=Path), metavar="CARD.toml", help="Write the card found.")
@click.option("--method", type=click.Choice(TRIAL_METHODS), default="output_error", show_default=True)
@click.option(
    "--structure",
    type=click.Choice((*STRUCTURES, AUTO)),
    default="card",
    show_default=True,
    help="; ".join(f"{one.name}: {one.description}" for one in STRUCTURES.values())
    + f"; {AUTO}: cross-validation decides.",
)
@click.option("--inertia", is_flag=True, help="Estimate acceleration derivatives, too.")
@click.option("--piece", type=float, metavar="S", help="Length of the pieces of output error, s; by default 5 L/u0.")
@click.option("--workers", type=click.IntRange(1), metavar="N", help="Processes for cross-validation and bootstrap.")
@executor_option
@click.option(
    "--members",
    type=click.IntRange(0, 100000),
    default=100,
    show_default=True,
    help="Simulations behind the intervals of figures of trials held out.",
)
@click.option(
    "--bootstrap",
    type=click.IntRange(0),
    default=0,
    metavar="N",
    help="Fit N sets of trials simulated anew with the estimate, for the scatter of the estimates.",
)
@click.option("--hold", multiple=True, metavar="NAME", help="Leave a derivative or parameter as the card has it.")
@click.option("--force", is_flag=True, help="Fit trials also if they look like another ship's; the card says so.")
@click.option("--trust-card", is_flag=True, help="Take the card's standard errors as they are.")
@click.option("--plot", "plots", type=click.Path(path_type=Path, file_okay=False), metavar="DIR", help="Plots, page.")
@json_option
def command(
    card: str,
    trials: tuple[Path, ...],
    *,
    holdout: tuple[Path, ...],
    output: Path | None,
    plots: Path | None,
    **more: object,
) -> None:
    """Estimate the coefficients of CARD from the free-running TRIALs (CSV, SIMMAN .dat or Esso Osaka CSV)."""
    json_file = more.pop("json_file")
    known = read_card(card)
    if not isinstance(known, ManoeuvringCard):
        raise InputError(known.source, "model.kind", "is no ship that manoeuvres", "give a linear or abkowitz card")
    options = _options(more)
    fitted, held = fitted_and_held(trials, holdout, known)
    with showing_progress("fitting") as progress, _executor(options, more, held=bool(held.trials)) as executor:
        result = identify(known, fitted, held, options, progress, executor)
    both = fitted, held
    told = remarks(result)
    text = identified_card_text(result, [trial.name for trial in fitted.trials])
    parse_card(text, str(output or "the card found"))
    files: dict[Path, str | bytes] = {}
    if output:
        found = by_file_name(result.card, result.estimate.free, result.estimate.covariance)
        files |= with_covariance(text, output, found)
    if isinstance(json_file, Path):
        files[json_file] = json_text({**identification_as_json(result, told), "replays": _replays(known, result, both)})
    if plots:
        files |= _pictures(result, known, both, plots)
    asked = [output, json_file if isinstance(json_file, Path) else None]
    write_together(
        files,
        inputs=[*trial_files(trials), *trial_files(holdout), *([Path(card)] if Path(card).exists() else [])],
        outputs=asked,
    )
    _show(result, told)
    if output:
        screen.print(f"{output}: {len(result.estimate.free)} coefficients", soft_wrap=True, markup=False)


@contextmanager
def _executor(options: IdentificationOptions, given: dict[str, object], *, held: bool) -> Iterator[Executor | None]:
    """For cross-validation and bootstrap, and a cluster for the intervals of what is held out, too."""
    text, workers = check_executor(str(given["executor"])), given["workers"]
    here = text == PROCESSES
    if not here and not (options.structure == AUTO or options.bootstrap or (held and options.members)):
        problem, remedy = "has nothing to do", f"give --structure {AUTO}, --bootstrap N or --holdout TRIAL, too"
        raise InputError("--executor", "", problem, remedy)
    if here and options.structure != AUTO and not options.bootstrap:
        yield None
        return
    with executing(text, workers if isinstance(workers, int) else None) as executor:
        yield executor


def _options(given: dict[str, object]) -> IdentificationOptions:
    piece = given["piece"]
    if isinstance(piece, float) and not 0 < piece < float("inf"):
        raise InputError("--piece", "", f"is {piece:g} s", "a positive number of seconds was expected")
    return IdentificationOptions(
        method=str(given["method"]),
        structure=str(given["structure"]),
        inertia=bool(given["inertia"]),
        piece_s=piece if isinstance(piece, float) else None,
        scale_prior=not given["trust_card"],
        members=int(str(given["members"])),
        bootstrap=int(str(given["bootstrap"])),
        force=bool(given["force"]),
        hold=tuple(str(name) for name in given["hold"]),  # type: ignore[attr-defined]
    )


def _replays(
    known: ManoeuvringCard, result: Identification, trials: tuple[Measured, Measured]
) -> list[dict[str, object]]:
    """Every trial, fitted or held out, beside both cards."""
    return [
        told
        for held_out, those in enumerate(trials)
        if those.trials
        for told in replays_as_json(replays(known, result, those), held_out=bool(held_out))
    ]


def _pictures(
    result: Identification, known: ManoeuvringCard, trials: tuple[Measured, Measured], folder: Path
) -> dict[Path, str | bytes]:
    """A picture of each chart, and the page that has them all."""
    from tank2sim.report.identification.page import identification_charts, identification_page, pairs_of
    from tank2sim.report.kit.charts import chart_png
    from tank2sim.report.kit.page import render_page

    writable_folder(folder)
    fitted, held = (pairs_of(known, result, those) if those.trials else () for those in trials)
    charts = identification_charts(result, fitted, held)
    pictures: dict[Path, str | bytes] = {folder / f"{stem}.png": chart_png(chart) for stem, chart in charts.items()}
    return {**pictures, folder / "report.html": render_page(identification_page(result, charts))}


def _show(result: Identification, told: tuple[str, ...]) -> None:
    estimate = result.estimate
    if result.forced:
        screen.print(f"{FORCED}: {'; '.join(result.forced)}", soft_wrap=True, markup=False)
    title = f"{result.card.ship.name}: {len(estimate.free)} coefficients from {len(result.problem.runs)} trials"
    show_table(title, ["", "found", "before", "from trials"], estimate_rows(result))
    if result.bootstrap is not None:
        scatter = result.bootstrap.std(axis=0, ddof=1)
        pairs = zip(estimate.free, estimate.standard_errors, scatter, strict=True)
        title = f"Standard errors, and scatter over {len(result.bootstrap)} sets of trials simulated anew"
        show_table(title, ["", "standard error", "bootstrap"], [[name, float(a), float(b)] for name, a, b in pairs])
    show_table(
        "Yaw rate: error over windows of 5 ship lengths, of its root mean square",
        ["trial", "", "before", "now"],
        following_rows(result),
    )
    if rows := structure_rows(result):
        title = "Yaw-rate error of trials left out of the fit, %"
        show_table(title, ["structure", "one at a time, mean", "those of largest amplitude"], rows)
    if rows := figure_rows(result):
        heads = ["trial", "", "figure", "measured", "before", "now", "error", "95 %"]
        named = [[trial, word, ", ".join(in_words(str(name))), *rest] for trial, word, name, *rest in rows]
        show_table(
            "Figures, simulated in closed loop from the measured start, with the rudder rate and lag of each trial",
            heads,
            named,
        )
    show_notices([*result.notices, *result.identifiability.notices, *told])
