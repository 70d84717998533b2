"""Result of ``steer``: a page in which a ship is steered."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

from tank2sim.answer.parts import Cell, Section, quantities
from tank2sim.answer.result import Result
from tank2sim.apps.steering.members import NO_COVARIANCE
from tank2sim.notices import Notice


@dataclass(frozen=True, kw_only=True)
class SteeringStudy:
    """A page in which a ship is steered.

    Parameters
    ----------
    ship : str
    ghost : str or None
        Measured trial that moves next to the ship.
    steerable : bool
    members : int
        Ships that the measurements cannot exclude, which are steered together with the card's.
    autopilot : str or None
        How the autopilot of the page was designed.
    scenario : str or None
        Waters to steer in.
    page_kB : float
    notices : tuple of Notice
    """

    ship: str
    ghost: str | None
    steerable: bool
    members: int
    autopilot: str | None
    scenario: str | None
    page_kB: float
    notices: tuple[Notice, ...]


@dataclass(frozen=True, eq=False, repr=False)
class SteeringPageResult(Result[SteeringStudy]):
    """A page in which a ship is steered; it needs no network.

    Parameters
    ----------
    study : SteeringStudy
    html : str
        The page; empty if the result was read from its JSON.
    """

    study: SteeringStudy
    html: str = ""
    command: ClassVar[str] = "steer"

    @property
    def title(self) -> str:
        """The ship."""
        return f"{self.study.ship}: a page to steer"

    @property
    def headline(self) -> tuple[str, ...]:
        """Name of the ship, size of the page, and the ships that are steered together with it."""
        study = self.study
        others = f"{study.members} ships from the covariance of the card" if study.members else NO_COVARIANCE
        found = f"{study.ship}: a page of {study.page_kB:.0f} kB", others
        again = "The page itself is not in the JSON: tank2sim steer CARD --page FILE.html makes it."
        return found if self.html else (*found, again)

    @property
    def sections(self) -> Sequence[Section]:
        """Contents of the page."""
        study = self.study
        values: dict[str, Cell] = {"measured trial": study.ghost, "autopilot": study.autopilot}
        values |= {"waters": study.scenario, "ships": study.members + 1}
        return [Section("The page", tables=[quantities("The page", values, on_screen=False)])]

    def page(self) -> str:
        """The page: self-contained HTML."""
        return self.html or super().page()
