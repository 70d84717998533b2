"""Result of ``serve``: the parameters of the boat, and what was answered."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import ClassVar

from tank2sim.answer.parts import Section, quantities
from tank2sim.answer.result import Result
from tank2sim.apps.ardupilot.parameters import BoatParameters


@dataclass(frozen=True, kw_only=True)
class Served:
    """A session with SITL: the parameters, packets answered and refused, and how often it was repeated or restarted."""

    ship: str
    port: int
    parameters: BoatParameters
    answered: int
    refused: int
    repeated: int
    restarts: int
    simulated_s: float


@dataclass(frozen=True, eq=False, repr=False)
class ServeResult(Result[Served]):
    """A session with SITL.

    Parameters
    ----------
    study : Served
    wrote : tuple of Path
        The parameter file.
    """

    study: Served
    wrote: tuple[Path, ...] = ()
    command: ClassVar[str] = "serve"

    @property
    def title(self) -> str:
        """The ship."""
        return f"{self.study.ship}: physics of ArduPilot's SITL"

    @property
    def headline(self) -> tuple[str, ...]:
        """What was answered."""
        study = self.study
        return (
            f"{study.ship}: {study.answered} frames answered on port {study.port}, {study.simulated_s:.4g} s simulated "
            f"({study.repeated} repeated, {study.restarts} restarts, {study.refused} other packets).",
        )

    @property
    def written(self) -> tuple[Path, ...]:
        """The parameter file."""
        return self.wrote

    @property
    def sections(self) -> Sequence[Section]:
        """The parameters."""
        return [Section("Parameters", tables=[quantities("Of the boat", asdict(self.study.parameters))])]
