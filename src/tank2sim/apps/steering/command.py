"""A page in which a ship is steered."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from tank2sim.api.verbs import verb
from tank2sim.errors import ArgumentError, InputError
from tank2sim.notices import Notice
from tank2sim.units import in_words

if TYPE_CHECKING:
    import pandas as pd

    from tank2sim.api.trial import TrialRecord
    from tank2sim.apps.steering.ghost import Ghost
    from tank2sim.apps.steering.page import PageShip
    from tank2sim.apps.steering.result import SteeringPageResult
    from tank2sim.apps.steering.scenario import Scenario
    from tank2sim.dynamics.model import Model
    from tank2sim.dynamics.vessel import Vessel

STEERED_SHIP = "esso-osaka-ship"
"""Bundled ship of the page without a card: full scale, with an engine that goes astern, and with a covariance."""


@verb(
    "a page on which the ship is steered",
    default_ship=STEERED_SHIP,
    page_required=True,
    name="steer",
    results=("tank2sim.apps.steering.result:SteeringPageResult",),
    charts=False,
)
def make_steering_page(
    ship: Vessel,
    *,
    ghost: str | Path | TrialRecord | pd.DataFrame | None = None,
    scenario: str | Path | None = None,
    view_3d: bool = False,
) -> SteeringPageResult:
    """Make a page on which a ship is steered in a browser; it needs no network.

    Parameters
    ----------
    ship : Vessel
        A ship with a rudder, or a craft with thrusters.
    ghost : path, TrialRecord or DataFrame, optional
        Measured trial that moves next to the ship.
    scenario : path or str, optional
        Waters to steer in: a GeoJSON file, or ``channel`` or ``basin``.
    view_3d : bool
        Also show the view from the bridge (three.js, 0.6 MB).

    Raises
    ------
    InputError
        The ship cannot be steered, the trial is at fault or has no positions, or the scenario is at fault.
    """
    from tank2sim.api.trial import trials_of
    from tank2sim.apps.steering import ship as page_ship
    from tank2sim.apps.steering.ghost import ghost_of
    from tank2sim.apps.steering.members import members_of
    from tank2sim.apps.steering.page import PageShip
    from tank2sim.apps.steering.scenario import read_scenario
    from tank2sim.cards import SteeredBy
    from tank2sim.identification.trials.problem.prepare_trials import measured

    card, model = ship.steered(), ship.model
    by_rudder = card.steered_by is SteeredBy.RUDDER
    if ghost is not None and not by_rudder:
        problem = "is a trial with a rudder, and a craft with thrusters has none"
        raise ArgumentError("ghost", "", problem, "leave it out")
    if ghost is not None and scenario:
        raise ArgumentError("scenario", "", "does not go with a ghost: both set the start of the ship", "leave one out")
    waters = read_scenario(scenario) if scenario else None
    trial = None if ghost is None else measured(trials_of(ghost, "ghost"), card.manoeuvring())
    shown = ghost_of(trial.trials[0], model) if trial else None
    if shown and shown.by_angle:
        model = page_ship.ship_following_angle(model)
    model, autopilot, no_autopilot = _with_autopilot(model) if by_rudder else (model, "", ())
    members = tuple(members_of(card, model))
    in_page = PageShip(
        model=model,
        beam_m=card.ship.beam_m,
        draught_m=card.ship.draught_m,
        members=members,
        autopilot=autopilot,
    )
    notices = (*(trial.notices if trial else ()), *(shown.notices if shown else ()), *no_autopilot, *model.notices)
    return _result(in_page, shown, notices, waters, view_3d)


def _result(
    ship: PageShip, ghost: Ghost | None, notices: Sequence[Notice], scenario: Scenario | None, view_3d: bool
) -> SteeringPageResult:
    from tank2sim.apps.steering.page import steering_page
    from tank2sim.apps.steering.result import SteeringPageResult, SteeringStudy

    said = tuple(dict.fromkeys(notices))
    html = steering_page(ship, ghost, said, scenario, view_3d)
    study = SteeringStudy(
        ship=ship.model.name,
        ghost=ghost.label if ghost else None,
        steerable=True,
        members=len(ship.members),
        autopilot=ship.autopilot or None,
        scenario=scenario.name if scenario else None,
        page_kB=len(html.encode()) / 1e3,
        notices=said,
    )
    return SteeringPageResult(study, html)


def _with_autopilot(model: Model) -> tuple[Model, str, tuple[Notice, ...]]:
    """The model with the autopilot of the command ``autopilot`` (PID), how it was designed, and a notice without it."""
    from tank2sim.analysis.heading.designs import design_heading
    from tank2sim.dynamics.autopilot_loop import ship_steered_by_either

    try:
        design = design_heading(model)
    except InputError as error:
        return model, "", (Notice(f"no autopilot: {error.problem}"),)
    named = ((*in_words(name), value) for name, value in design.gains.items())
    gains = ", ".join(" ".join((words, f"{value:.3g}", unit)).rstrip() for words, unit, value in named)
    return ship_steered_by_either(model, design.autopilot), f"{design.source}: {gains}", ()
