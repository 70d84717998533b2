"""``tank2sim influence``: influence coefficients of a card, and tuning it to a trial or a standard."""

from __future__ import annotations

import math
from pathlib import Path

import click
import numpy as np
from rich.markup import escape

from tank2sim.analysis.ensemble.results import FigureBands, named_bands
from tank2sim.analysis.influence.card_influence import CardInfluence, influence
from tank2sim.analysis.influence.figures import InfluenceFigure, forms, parse_figure
from tank2sim.analysis.influence.study import Study
from tank2sim.analysis.tuning.card import tuned_text
from tank2sim.analysis.tuning.result import FEWEST, UNCERTAIN, WITHIN, Means, Tuned
from tank2sim.analysis.tuning.targets import TARGET_OPTION, Wish, parse_wish
from tank2sim.analysis.tuning.tune import tune
from tank2sim.cards import ManoeuvringCard, read_card
from tank2sim.cards.covariance import with_carried_covariance
from tank2sim.cards.steering_card import find_steering_card
from tank2sim.cli.console import json_option, json_text, screen, show_marked, show_notices, show_table
from tank2sim.cli.ensemble import asked_of, computing, ensemble_options, show_bands
from tank2sim.cli.joint_variation import parse_agreed, parse_bounds
from tank2sim.cli.overrides import parse_changes
from tank2sim.cli.steering_card import refuse_options, show_steering_card
from tank2sim.cli.through_points import ThroughFiles, tune_through
from tank2sim.cli.trials import TakesSeveral
from tank2sim.errors import InputError
from tank2sim.files import plain_json, write_together
from tank2sim.native.compiler import find_compiler
from tank2sim.simulation.integrator import NO_COMPILER

DEFAULT_FIGURES = (
    "criterion_C",
    "steady_radius_m@20",
    "advance_m@35",
    "tactical_diameter_m@35",
    "overshoot1_deg@20/20",
)
"""Figures where none is asked: one of each kind that is most looked at (project choice)."""

_ALONE = (
    "tuning takes standard errors as if they were independent: its bounds, and what counts as a small move, leave out "
    "the covariance next to the card"
)

ROWS = 15
"""Parameters in the table on the screen: the most influential; JSON and page have all."""

_PAIR, _MARGINS = 17, 3
"""Characters of two coefficients, -123.45 | -123.45, and of what stands between columns."""


@click.command("influence", cls=TakesSeveral, several=("--figure", "--tune", "--agreed", "--through"))
@click.argument("card")
@click.option(
    "--figure",
    "figures",
    multiple=True,
    metavar="F ...",
    help=f"Figures, FIGURE@ARGUMENT. {forms()}. Several may follow.",
)
@click.option(
    "--tune",
    "wishes",
    multiple=True,
    metavar="FIGURE=VALUE ...",
    help="Change the card until a figure has a value: steady_radius_m=424@20, 'overshoot1_deg@20/20<=25' (also >=).",
)
@click.option(
    "--by",
    type=click.Choice((FEWEST, UNCERTAIN)),
    default=UNCERTAIN,
    show_default=True,
    help="Tune with the fewest parameters, or the most uncertain: the least squared moves in standard errors.",
)
@click.option(
    "--within",
    type=click.FloatRange(min=0, min_open=True, max=100),
    default=WITHIN,
    show_default=True,
    help="Bounds of tuning, standard errors of the card.",
)
@click.option("--hold", multiple=True, metavar="NAME", help="Do not tune this parameter.")
@click.option(
    "--bound",
    "bounds",
    multiple=True,
    metavar="NAME=LOW..HIGH",
    help="Bounds of a parameter, in the card's conventions.",
)
@click.option(
    "--agreed",
    multiple=True,
    metavar="NAME=PERCENT ...",
    help="An agreed variation (Kc), as with 1 % of draught: by how much each changes with the others; or a TOML file "
    "of such. Tuning moves these together only.",
)
@click.option(
    "--through",
    multiple=True,
    metavar="RATE@RUDDER ...",
    help="Scale the hull's balance of moment and damping, and the rudder, until the steady turns meet two points: "
    "deg/min to the side of the rudder, without a sign, at deg of rudder, + to starboard (20@-3: 20 deg/min to port at "
    "3 deg to port; at 0, of an unstable ship: to starboard), or a radius, 424m@20. "
    "Not with --figure, --tune, --hold, "
    "--bound, --agreed, --page or --ensemble.",
)
@click.option("--set", "settings", multiple=True, metavar="KEY=VALUE", help="A value in place of the card's.")
@click.option("-o", "--output", type=click.Path(path_type=Path), metavar="CARD.toml", help="Write the tuned card.")
@click.option("--page", type=click.Path(path_type=Path), metavar="PAGE.html", help="Write a page with the charts.")
@ensemble_options
@json_option
def command(
    card: str,
    figures: tuple[str, ...],
    wishes: tuple[str, ...],
    settings: tuple[str, ...],
    **more: object,
) -> None:
    """How much each number on CARD (a file, or a bundled ship) moves the figures of the ship.

    CARD may be a steering card (poznyakov-yudin): then the models on it are compared.

    K % is the change of a figure for 10 % more of one number, by exact slopes and by a 10 % difference. Wishes that
    contradict each other within the bounds are reported, with the nearest that can be reached; with -o that is an
    error.
    """
    asked = asked_of(more)
    if steering := find_steering_card(card):
        refuse_options(
            f"a steering card ({card})", {"--figure": figures, "--tune": wishes, "--set": settings, **_options(more)}
        )
        show_steering_card(steering, _file(more["json_file"]), _file(more["page"]))
        return
    ship = _ship(card, settings)
    output, page, json_file = (_file(more[key]) for key in ("output", "page", "json_file"))
    if through := _texts(more, "through"):
        others = {"--figure": figures, "--tune": wishes, "--page": page, "--ensemble": more["ensemble"]}
        of_tuning = {"--hold": more["hold"], "--bound": more["bounds"], "--agreed": more["agreed"]}
        refuse_options("--through", others | of_tuning)
        tune_through(ship, through, ThroughFiles(output, json_file))
        return
    if not wishes:
        _refuse_without_wishes({"-o": output, "--hold": more["hold"], "--bound": more["bounds"]})
    wanted = [parse_wish(text) for text in wishes]
    study = Study(ship, _asked(figures, wanted))
    means = _means(more)
    tuned = tune(study, wanted, means) if wanted else None
    if output and tuned and not tuned.reached:
        raise InputError(TARGET_OPTION, "", _contradiction(tuned), "widen --within or state --bound, or wish for less")
    result = influence(study, means.agreed)
    bands = None
    if asked:
        with computing(asked, more["executor"]) as pool:
            bands = named_bands(ship, [figure.text for figure in study.figures], asked, pool)
    written, of_card = with_carried_covariance(ship, tuned_text(ship, tuned), output) if output and tuned else ({}, [])
    notices = [*result.notices, *([_ALONE] if tuned and result.errors.together else []), *of_card]
    notices = list(dict.fromkeys([*notices, *([] if find_compiler() else [NO_COMPILER])]))
    told = _told(study, result, tuned, bands) | {"notices": notices} if json_file or page else {}
    contents = {
        **written,
        **({json_file: json_text(told)} if json_file else {}),
        **({page: _page(told)} if page else {}),
    }
    write_together(contents, inputs=[Path(ship.source)], outputs=[json_file, output, page])
    remaining = show_marked(notices)
    _show(result)
    if tuned:
        _show_tuned(tuned)
    show_notices(remaining)
    if bands:
        show_bands(bands.figures, bands.asked, told=notices)


def _ship(card: str, settings: tuple[str, ...]) -> ManoeuvringCard:
    ship = read_card(card, parse_changes(settings))
    if not isinstance(ship, ManoeuvringCard):
        raise InputError(ship.source, "model.kind", "is no ship that manoeuvres", "give a linear or abkowitz card")
    return ship


def _file(given: object) -> Path | None:
    return given if isinstance(given, Path) else None


def _asked(figures: tuple[str, ...], wanted: list[Wish]) -> list[InfluenceFigure]:
    """Figures asked for, and those of the wishes; each once."""
    named = figures or (() if wanted else DEFAULT_FIGURES)
    return list(dict.fromkeys([*(parse_figure(text) for text in named), *(wish.figure for wish in wanted)]))


def _texts(more: dict[str, object], key: str) -> tuple[str, ...]:
    given = more[key]
    return tuple(str(one) for one in given) if isinstance(given, tuple) else ()


def _options(more: dict[str, object]) -> dict[str, object]:
    """Options of ship cards alone, with what was given for them."""
    return {f"--{key}": more[key] for key in ("hold", "agreed", "through", "ensemble")} | {
        "--bound": more["bounds"],
        "-o": more["output"],
    }


def _refuse_without_wishes(given: dict[str, object]) -> None:
    for option, value in given.items():
        if value:
            raise InputError(option, "", "has no meaning without --tune", "give --tune FIGURE=VALUE, too")


def _means(more: dict[str, object]) -> Means:
    return Means(
        by=str(more["by"]),
        within=float(str(more["within"])),
        hold=_texts(more, "hold"),
        bounds=parse_bounds(_texts(more, "bounds")),
        agreed=parse_agreed(_texts(more, "agreed")),
    )


def _told(study: Study, result: CardInfluence, tuned: Tuned | None, bands: FigureBands | None) -> dict[str, object]:
    """All that was found, as JSON has it."""
    told = result.as_json()
    if tuned:
        after = study.figures_at(tuned.values).tolist()
        told["tuned"] = tuned.as_json(dict(zip((figure.text for figure in study.figures), after, strict=True)))
    return told | ({"ensemble": bands.as_json()} if bands else {})


def _page(told: dict[str, object]) -> str:
    from tank2sim.report.influence.page import influenced_page
    from tank2sim.report.kit.page import render_page

    return render_page(influenced_page(plain_json(told)))


def _contradiction(tuned: Tuned) -> str:
    names = [wish.text for wish in tuned.contradiction]
    pairs = zip(tuned.wishes, tuned.after, strict=True)
    nearest = ", ".join(f"{wish.figure.text} {value:.5g}" for wish, value in pairs)
    what = f"{names[0]} cannot be reached" if len(names) == 1 else f"{' and '.join(names)} contradict each other"
    return f"{what} within the bounds; the nearest is {nearest}"


def _show(result: CardInfluence) -> None:
    screen.print(f"[bold]{escape(result.ship)}[/bold]: {len(result.parameters)} parameters", soft_wrap=True)
    show_table(
        "Figures",
        ["figure", "value", "standard error", "most of it from"],
        [
            [figure.text, float(result.values[row]), float(result.standard_errors[row]), _largest_shares(result, row)]
            for row, figure in enumerate(result.figures)
        ],
    )
    screen.print(result.of_errors[:1].upper() + result.of_errors[1:], soft_wrap=True)
    exact, difference = result.exact, result.difference
    largest = np.nan_to_num(np.abs(exact)).max(axis=0)
    order = [place for place in np.argsort(-largest, kind="stable") if largest[place] > 0][:ROWS]
    names = [result.parameters[k].short for k in order]
    for first in _parts(len(result.figures), screen.width - max(map(len, names), default=0)):
        heads = ["", *(result.figures[row].text.replace("@", "\n@") for row in first)]
        rows = [
            [name, *(_pair(exact[row, k], difference[row, k]) for row in first)]
            for name, k in zip(names, order, strict=True)
        ]
        show_table("K %: change for 10 % more, by exact slopes | by the 10 % difference", heads, rows)
    if result.agreed:
        agreed = result.agreed
        columns = zip(agreed.foretold, agreed.foretold_by_difference, agreed.direct, strict=True)
        show_table(
            "Agreed variation, change in %",
            ["figure", "sum of Kc K, exact", "by differences", "direct"],
            [[figure.text, *row] for figure, row in zip(result.figures, columns, strict=True)],
        )


def _parts(count: int, width: int) -> list[range]:
    """Figures in tables as wide as the screen at most, as even as it goes: digits are not to be cut."""
    most = max(1, (width - _MARGINS) // (_PAIR + _MARGINS))
    each = -(-count // -(-count // most))
    return [range(first, min(first + each, count)) for first in range(0, count, each)]


def _pair(exact: float, difference: float) -> str:
    return " | ".join(f"{round(value, 2) + 0.0:+.2f}" if math.isfinite(value) else "-" for value in (exact, difference))


def _largest_shares(result: CardInfluence, row: int) -> str:
    shares = result.shares[row]
    return ", ".join(
        f"{result.parameters[k].short} {100 * shares[k]:.0f} %" for k in np.argsort(-shares)[:3] if shares[k]
    )


def _show_tuned(tuned: Tuned) -> None:
    rows = [[w.text, float(a), float(b)] for w, a, b in zip(tuned.wishes, tuned.before, tuned.after, strict=True)]
    show_table("Tuning" if tuned.reached else "Nearest that can be reached", ["wish", "before", "after"], rows)
    heads = ["", "before", "after", "standard errors"]
    moves = [
        [
            move.parameter.short,
            *(value * move.parameter.factor for value in (move.before, move.after)),
            move.in_standard_errors,
        ]
        for move in tuned.moves
    ]
    show_table(f"Parameters changed ({tuned.means.by}): {len(moves)}", heads, moves[:ROWS])
    if tuned.agreed_times is not None:
        screen.print(f"the agreed variation {tuned.agreed_times:+.3g} times")
    if not tuned.reached:
        screen.print(f"[bold]{escape(_contradiction(tuned))}[/bold]", soft_wrap=True)
