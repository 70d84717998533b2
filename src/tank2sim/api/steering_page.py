"""A page in which a ship is steered, as a result."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

from tank2sim.api.result import Result, ResultTable
from tank2sim.api.ship import Ship
from tank2sim.cards import ManoeuvringCard
from tank2sim.errors import InputError

if TYPE_CHECKING:
    from tank2sim.dynamics.model import Model
    from tank2sim.report.steering.ghost import Ghost

FIRST_COMPILATION = "the compiler makes its own library first, once: about a minute"


class SteeringPageResult(Result):
    """A page in which a ship is steered; it needs no network.

    Parameters
    ----------
    ship : Ship
    model : Model
        What the page holds: with a measured rudder angle, one that can follow it.
    library : str or None
        The model as WebAssembly, base64; None without its compiler.
    ghost : Ghost, optional
        A measured trial next to the ship.
    notices : tuple of str
    """

    command = "steer"

    def __init__(
        self, ship: Ship, model: Model, library: str | None, ghost: Ghost | None, notices: tuple[str, ...]
    ) -> None:
        from tank2sim.report.steering.ship import NO_WASM_COMPILER

        self.ship, self.model, self.library, self.ghost = ship, model, library, ghost
        self._page_notices = tuple(dict.fromkeys(notices))  # the page itself says first that there is no ship in it
        self.notices = self._page_notices if library else (NO_WASM_COMPILER, *self._page_notices)

    def content(self) -> Mapping[str, object]:
        """As :meth:`.Result.content`."""
        return {
            "ship": self.ship.name,
            "ghost": self.ghost.label if self.ghost else None,
            "steerable": self.library is not None,
            "page_kB": self._size_kB,
            "notices": self.notices,
        }

    @property
    def headline(self) -> tuple[str, ...]:
        """Name of the ship and size of the page."""
        return (f"{self.ship.name}: a page of {self._size_kB:.0f} kB",)

    @property
    def tables(self) -> tuple[ResultTable, ...]:
        """None."""
        return ()

    def page(self) -> str:
        """The page: self-contained HTML."""
        return self._html

    @cached_property
    def _html(self) -> str:
        from tank2sim.report.steering.page import steering_page

        return steering_page(self.model, self.library, self.ghost, self._page_notices)

    @property
    def _size_kB(self) -> float:
        return len(self._html.encode()) / 1e3


def make_steering_page(
    ship: Ship, ghost: str | Path | None = None, report: Callable[[str], None] = lambda _: None
) -> SteeringPageResult:
    """Make the page, without writing it. Raises as :meth:`.Ship.steering_page`.

    Parameters
    ----------
    ship : Ship
    ghost : path, optional
        A measured trial.
    report : callable
        Called before what takes long.
    """
    from tank2sim.identification.trials.problem.prepare_trials import measured
    from tank2sim.native.cross import has_compiled
    from tank2sim.report.steering import ship as page_ship
    from tank2sim.report.steering.ghost import ghost_of

    card, model = ship.card, ship.model
    if not isinstance(card, ManoeuvringCard):
        raise InputError(card.source, "", "has no rudder", "only a ship (kind linear, abkowitz or mmg) can be steered")
    trial = measured([Path(ghost)], card) if ghost else None
    shown = ghost_of(trial.trials[0], model) if trial else None
    if shown and shown.by_angle:
        model = page_ship.ship_following_angle(model)
    library = None
    if page_ship.has_compiler():
        if not has_compiled(page_ship.WEB):
            report(FIRST_COMPILATION)
        library = page_ship.ship_in_page(model)
    notices = (*(trial.notices if trial else ()), *(shown.notices if shown else ()), *model.notices)
    return SteeringPageResult(ship, model, library, shown, notices)
