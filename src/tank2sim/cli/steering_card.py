"""What ``tank2sim influence`` prints for a steering card: the tables of paper 4."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path

from rich.markup import escape

from tank2sim.analysis.catalogue.comparison import SteeringComparison, compare_steering_models
from tank2sim.analysis.turning.two_point_tuning import TwoPointTuning
from tank2sim.cards.steering_card import SteeringCard, read_steering_card
from tank2sim.cli.console import json_text, screen, show_notices, show_table
from tank2sim.errors import InputError
from tank2sim.files import write_together


def refuse_options(what: str, given: Mapping[str, object]) -> None:
    """Refuse options that do not go with `what`: those of `given`, by name, that have a value.

    Raises
    ------
    InputError
        One has.
    """
    for option, value in given.items():
        if value:
            raise InputError(option, "", f"does not go with {what}", f"leave out {option}")


def show_steering_card(path: Path, json_file: Path | None, page: Path | None) -> None:
    """Compare the models of a steering card on the screen, and in JSON and on a page where asked."""
    card = read_steering_card(path)
    found = compare_steering_models(card)
    contents: dict[Path, str | bytes] = {}
    if json_file:
        contents[json_file] = json_text(found.as_json())
    if page:
        contents[page] = _page(card, found)
    write_together(contents, inputs=[path], outputs=[json_file, page])
    _show(card, found)


def _page(card: SteeringCard, found: SteeringComparison) -> str:
    from tank2sim.report.kit.page import render_page
    from tank2sim.report.steering_card.page import steering_catalogue_page

    return render_page(steering_catalogue_page(card, found))


def _show(card: SteeringCard, found: SteeringComparison) -> None:
    screen.print(f"[bold]{escape(found.ship)}[/bold]: {len(card.models)} steering models", soft_wrap=True)
    keys = ("rudder_deg", "radius_m", "yaw_rate_degpmin", "drift_deg")
    for turns in found.turns:
        if turns.model in found.runs:
            rows = [[turn.as_json()[key] for key in keys] for turn in turns.turns]
            heads = ["rudder (deg)", "radius (m)", "rate (deg/min)", "drift (deg)"]
            show_table(f"Steady turns, {turns.title}", heads, rows)
    names = list(dict.fromkeys(name for one in found.influence for name in one.K_percent))
    heads = ["", *(f"{card.models[one.model].title}" for one in found.influence)]
    show_table(
        f"K %: change of the radius at {found.rudder_deg:g} deg for 10 % more",
        heads,
        [[name, *(one.K_percent.get(name) for one in found.influence)] for name in names],
    )
    _show_predictions(card, found)
    _show_manoeuvres(card, found)
    _show_tuning(found)
    show_notices(f"{name}: {words}" for name, told in found.missing.items() for words in told)


def _show_predictions(card: SteeringCard, found: SteeringComparison) -> None:
    if not found.predictions:
        return
    rows = []
    for name, prediction in found.predictions.items():
        rows.append(["printed K, right pairs", card.models[name].title, prediction.percent, prediction.predicted_m])
        rows.append(
            [
                "printed K, as the source pairs them",
                card.models[name].title,
                prediction.misread_percent,
                prediction.misread_m,
            ]
        )
        rows.append(["K computed here", card.models[name].title, prediction.own_percent, prediction.own_m])
        percent = 100 * (prediction.direct_m / prediction.radius_m - 1)
        rows.append(["the model itself", card.models[name].title, percent, prediction.direct_m])
        percent = 100 * (prediction.direct_misread_m / prediction.radius_m - 1)
        rows.append(["the model with the source's slip", card.models[name].title, percent, prediction.direct_misread_m])
    show_table("Agreed variation of all coefficients", ["by", "to", "change (%)", "radius (m)"], rows)


def _show_manoeuvres(card: SteeringCard, found: SteeringComparison) -> None:
    keys = ("advance_m", "transfer_m", "tactical_diameter_m", "steady_diameter_m")
    rows = []
    for name, run in found.runs.items():
        overshoots = run.zigzag_figures["overshoots_deg"]
        first = overshoots[:2] if isinstance(overshoots, list) else []
        rows.append([card.models[name].title, *(run.turn_figures[key] for key in keys), [float(x) for x in first]])
    heads = ["model", *(key.removesuffix("_m").replace("_", " ") + " (m)" for key in keys), "10/10 overshoots (deg)"]
    show_table(f"Turning circle at {found.rudder_deg:g} deg, zigzag", heads, rows)


def _show_tuning(found: SteeringComparison) -> None:
    tuning = found.tuning
    if isinstance(tuning, str):
        screen.print(f"No tuning to the measured points: {escape(tuning)}", soft_wrap=True)
    if isinstance(tuning, TwoPointTuning):
        show_tuning(tuning)


def show_tuning(tuning: TwoPointTuning) -> None:
    """Print a tuning to two points: the factors, and both turns before and after."""
    rows = [
        [
            math.degrees(after.rudder_rad),
            *(turn.as_json()[key] for key in ("yaw_rate_degpmin", "radius_m") for turn in (before, after)),
        ]
        for before, after in zip(tuning.before, tuning.after, strict=True)
    ]
    heads = ["rudder (deg)", "rate before (deg/min)", "after", "radius before (m)", "after"]
    show_table(
        f"Two points met (+ to starboard): hull factor {tuning.hull:.4g}, rudder factor {tuning.rudder:.4g}",
        heads,
        rows,
    )
    if tuning.stable_before != tuning.stable_after:
        words = "stable" if tuning.stable_after else "unstable"
        screen.print(f"With these factors the ship becomes [bold]{words}[/bold] on a straight course.", soft_wrap=True)
