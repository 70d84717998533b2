"""``tank2sim influence``: influence coefficients of a card, and tuning it to a trial or a standard."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import click

from tank2sim.analysis.influence.figures import forms
from tank2sim.analysis.tuning.result import FEWEST, UNCERTAIN, WITHIN
from tank2sim.apps.steering_cards.card import find_steering_card
from tank2sim.apps.steering_cards.command import steering_models
from tank2sim.apps.steering_cards.result import SteeringModelsResult
from tank2sim.apps.steering_cards.tuning_command import THROUGH_OPTION, THROUGH_REMEDY, tune_ship_through
from tank2sim.apps.steering_cards.tuning_result import TurnTuningResult
from tank2sim.arguments import TuningRange
from tank2sim.cli.console import json_option, show_result, write_result
from tank2sim.cli.joint_variation import parse_agreed, parse_bounds
from tank2sim.cli.options import OutputFile, ensemble_options, number, page_option, plot_option, set_option
from tank2sim.cli.trials import TakesSeveral
from tank2sim.dynamics.vessel import Vessel
from tank2sim.errors import InputError
from tank2sim.files import CARD
from tank2sim.results.influence import InfluenceResult, TuningResult
from tank2sim.ship import load


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
    "targets",
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
    type=number(TuningRange),
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
    help="A joint variation (Kc), as with 1 % of draught: by how much each changes with the others; or a TOML file "
    "of such. Tuning moves these together only.",
)
@click.option(
    THROUGH_OPTION,
    multiple=True,
    metavar="RATE@RUDDER ...",
    help="Scale the hull's balance of moment and damping, and the rudder, until the steady turns meet two points: "
    "deg/min to the side of the rudder, without a sign, at deg of rudder, + to starboard (20@-3: 20 deg/min to port at "
    "3 deg to port; at 0, of an unstable ship: to starboard), or a radius, 424m@20. "
    "Not with --figure, --tune, --hold, --bound, --agreed, --plot or --ensemble.",
)
@set_option
@click.option("-o", "--output", type=OutputFile(CARD), metavar="CARD.toml", help="Write the tuned card.")
@page_option()
@plot_option
@ensemble_options
@json_option
def command(
    card: str,
    figures: tuple[str, ...],
    targets: tuple[str, ...],
    by: str,
    within: float,
    hold: tuple[str, ...],
    bounds: tuple[str, ...],
    agreed: tuple[str, ...],
    through: tuple[str, ...],
    values: dict[str, object],
    output: Path | None,
    page: Path | None,
    plot: Path | None,
    members: int | None,
    seed: int,
    executor: str,
    json_file: Path | None,
) -> None:
    """How much each number on CARD (a file, or a bundled ship) moves the figures of the ship.

    CARD may be a steering card (poznyakov-yudin): then the models on it are compared.

    K % is the change of a figure for 10 % more of one number, by exact slopes and by a 10 % difference. Targets that
    contradict each other within the bounds are reported, with the nearest that can be reached; with -o that is an
    error.
    """
    tuning = {"--hold": hold, "--bound": bounds}
    others = {"--figure": figures, "--tune": targets, **tuning, "--agreed": agreed, "--ensemble": members}
    result: InfluenceResult | TurnTuningResult | SteeringModelsResult
    source = card
    if find_steering_card(card):
        what = f"a steering card ({card})"
        _refuse(f"does not go with {what}", others | {"--set": values, "--through": through, "-o": output})
        result = steering_models(card)
    else:
        ship = load(card, values)
        source = ship.card.source
        if through:
            _refuse("does not go with --through", others | {"--plot": plot})
            result = _through(ship, through)
        elif targets:
            result = ship.tune(
                targets,
                figures=figures,
                by=by,
                within=within,
                hold=hold,
                bounds=parse_bounds(bounds),
                joint_variation=parse_agreed(agreed),
                members=members or 0,
                seed=seed,
                executor=executor,
            )
        else:
            _refuse("has no meaning without --tune", {"-o": output, **tuning})
            joint = parse_agreed(agreed)
            result = ship.influence(figures, joint_variation=joint, members=members or 0, seed=seed, executor=executor)
    card_found = result.card if output and isinstance(result, TuningResult | TurnTuningResult) else None
    files = card_found.files(output) if output and card_found else {}
    write_result(result, [source], json_file=json_file, page=page, plot=plot, files=files)
    show_result(result)


def _through(ship: Vessel, points: Sequence[str]) -> TurnTuningResult:
    if len(points) != 2:
        problem = f"has {len(points)} point{'s' * (len(points) != 1)}"
        raise InputError(THROUGH_OPTION, "", problem, THROUGH_REMEDY)
    return tune_ship_through(ship, points[0], points[1])


def _refuse(problem: str, options: Mapping[str, object]) -> None:
    """Refuse those of the options, by name, that have a value."""
    for option, value in options.items():
        if value:
            remedy = "give --tune FIGURE=VALUE, too" if "without" in problem else f"leave out {option}"
            raise InputError(option, "", problem, remedy)
