"""A page in which a ship is steered, as a result."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

from tank2sim.answer.parts import Table
from tank2sim.api.result import OldResult
from tank2sim.api.ship import Ship
from tank2sim.cards import CraftCard, ManoeuvringCard
from tank2sim.errors import InputError

if TYPE_CHECKING:
    from tank2sim.dynamics.model import Model
    from tank2sim.report.steering.ghost import Ghost
    from tank2sim.report.steering.scenario import Scenario

FIRST_COMPILATION = "the compiler makes its own library first, once: about a minute"


class SteeringPageResult(OldResult):
    """A page in which a ship is steered; it needs no network.

    Parameters
    ----------
    ship : Ship
    model : Model
        What the page holds: with a measured rudder angle, one that can follow it.
    library : str
        The model as WebAssembly, base64.
    ghost : Ghost, optional
        A measured trial next to the ship.
    notices : tuple of str
    members : tuple of mapping
        Parameters of ships that the measurements cannot exclude, which are steered together with the card's.
    autopilot : str
        How the autopilot of the page was designed; empty without one.
    scenario : Scenario, optional
        Waters to steer in.
    view_3d : bool
        Whether the page has the view from the bridge.
    """

    command = "steer"

    def __init__(
        self,
        ship: Ship,
        model: Model,
        library: str,
        ghost: Ghost | None,
        notices: tuple[str, ...],
        members: Sequence[Mapping[str, float]] = (),
        autopilot: str = "",
        scenario: Scenario | None = None,
        view_3d: bool = False,
    ) -> None:
        self.ship, self.model, self.library, self.ghost = ship, model, library, ghost
        self.members, self.autopilot, self.scenario = tuple(members), autopilot, scenario
        self.view_3d = view_3d
        self.notices = tuple(dict.fromkeys(notices))

    def content(self) -> Mapping[str, object]:
        """As :meth:`.OldResult.content`."""
        return {
            "ship": self.ship.name,
            "ghost": self.ghost.label if self.ghost else None,
            "steerable": True,
            "members": len(self.members),
            "autopilot": self.autopilot or None,
            "scenario": self.scenario.name if self.scenario else None,
            "page_kB": self._size_kB,
            "notices": self.notices,
        }

    @property
    def headline(self) -> tuple[str, ...]:
        """Name of the ship, size of the page, and the ships that are steered together with it."""
        from tank2sim.report.steering.members import NO_COVARIANCE

        size = f"{self.ship.name}: a page of {self._size_kB:.0f} kB"
        return (size, f"{len(self.members)} ships from the covariance of the card" if self.members else NO_COVARIANCE)

    @property
    def tables(self) -> tuple[Table, ...]:
        """None."""
        return ()

    def page(self) -> str:
        """The page: self-contained HTML."""
        return self._html

    @cached_property
    def _html(self) -> str:
        from tank2sim.report.steering.page import PageShip, steering_page

        ship = PageShip(
            model=self.model,
            library=self.library,
            members=self.members,
            autopilot=self.autopilot,
            beam_m=self.ship.card.ship.beam_m,
            draught_m=self.ship.card.ship.draught_m,
        )
        return steering_page(ship, self.ghost, self.notices, self.scenario, self.view_3d)

    @property
    def _size_kB(self) -> float:
        return len(self._html.encode()) / 1e3


def make_steering_page(
    ship: Ship,
    ghost: str | Path | None = None,
    scenario: str | Path | None = None,
    view_3d: bool = False,
    report: Callable[[str], None] = lambda _: None,
) -> SteeringPageResult:
    """Make the page, without writing it. Raises as :meth:`.Ship.steering_page`.

    Parameters
    ----------
    ship : Ship
    ghost : path, optional
        A measured trial.
    scenario : path or str, optional
        GeoJSON file of the waters, or the name of bundled ones.
    view_3d : bool
        Whether the page has the view from the bridge.
    report : callable
        Called before what takes long.
    """
    from tank2sim.identification.trials.problem.prepare_trials import measured
    from tank2sim.report.steering import ship as page_ship
    from tank2sim.report.steering.ghost import ghost_of
    from tank2sim.report.steering.members import members_of
    from tank2sim.report.steering.scenario import read_scenario

    card, model = ship.card, ship.model
    if isinstance(card, CraftCard):
        if ghost:
            raise InputError(
                "--ghost", "", "is a trial with a rudder, and a craft with thrusters has none", "leave it out"
            )
        library = _compiled(model, report)
        return SteeringPageResult(
            ship,
            model,
            library,
            None,
            model.notices,
            scenario=read_scenario(scenario) if scenario else None,
            view_3d=view_3d,
        )
    if not isinstance(card, ManoeuvringCard):
        raise InputError(
            card.source,
            "",
            "has no rudder",
            "a ship (kind linear, abkowitz or mmg) or a craft (small_craft) can be steered",
        )
    if ghost and scenario:
        raise InputError("--scenario", "", "goes not with --ghost", "both say where the ship starts: leave one out")
    waters = read_scenario(scenario) if scenario else None
    trial = measured([Path(ghost)], card) if ghost else None
    shown = ghost_of(trial.trials[0], model) if trial else None
    if shown and shown.by_angle:
        model = page_ship.ship_following_angle(model)
    model, autopilot, no_autopilot = _with_autopilot(model)
    library = _compiled(model, report)
    notices = (*(trial.notices if trial else ()), *(shown.notices if shown else ()), *no_autopilot, *model.notices)
    members = members_of(card, model)
    return SteeringPageResult(ship, model, library, shown, notices, members, autopilot, waters, view_3d)


def _compiled(model: Model, report: Callable[[str], None]) -> str:
    """The library of a model. Raises InputError without the compiler for WebAssembly."""
    from tank2sim.native.cross import has_compiled
    from tank2sim.report.steering import ship as page_ship

    if not page_ship.has_compiler():
        problem = "needs a compiler for WebAssembly, which is not installed: without it no ship is in the page"
        raise InputError("steer", "", problem, "pip install tank2sim[platforms], and write the page again")
    if not has_compiled(page_ship.WEB):
        report(FIRST_COMPILATION)
    return page_ship.ship_in_page(model)


def _with_autopilot(model: Model) -> tuple[Model, str, tuple[str, ...]]:
    """The model with the autopilot of the command ``autopilot`` (PID), how it was designed, and a notice without it."""
    from tank2sim.analysis.heading.designs import design_heading
    from tank2sim.dynamics.autopilot_loop import ship_steered_by_either

    try:
        design = design_heading(model)
    except InputError as error:
        return model, "", (f"no autopilot: {error.problem}",)
    gains = ", ".join(f"{name} {value:.3g}" for name, value in design.gains.items())
    return ship_steered_by_either(model, design.autopilot), f"{design.source}: {gains}", ()
