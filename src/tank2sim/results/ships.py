"""The bundled ships as a result."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, ClassVar

from tank2sim.answer.parts import Section, records_frame, records_table
from tank2sim.answer.result import Result
from tank2sim.cards import Card

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True, kw_only=True)
class BundledShip:
    """A bundled ship: the name that CARD takes, the ship, kind of model, length, source and file of its card."""

    name: str
    ship: str
    kind: str
    length_m: float | None
    source: str
    card: str


@dataclass(frozen=True)
class BundledShips:
    """The bundled ships."""

    ships: tuple[BundledShip, ...]


@dataclass(frozen=True, eq=False, repr=False)
class ShipsResult(Result[BundledShips]):
    """The bundled ships.

    Parameters
    ----------
    study : BundledShips
    cards : mapping
        Name, as :func:`.load` takes it, to card; empty if the result was read from its JSON.
    """

    study: BundledShips
    cards: Mapping[str, Card] = field(default_factory=dict)
    command: ClassVar[str] = "ships"

    @property
    def title(self) -> str:
        """Number of ships."""
        return f"{len(self.study.ships)} bundled ships"

    @property
    def headline(self) -> tuple[str, ...]:
        """None: the table says it."""
        return ()

    @property
    def df(self) -> pd.DataFrame:
        """Name (index), ship, kind of model, length (m) and source."""
        frame = records_frame(self.study.ships, ("name", "ship", "kind", "length_m", "source"))
        return frame.rename(columns={"kind": "model"}).set_index("name")

    @property
    def sections(self) -> Sequence[Section]:
        """Names, kinds and lengths, with the sources as notes."""
        fields = {"name": "CARD", "ship": "", "kind": "model", "length_m": ""}
        listed = records_table("Bundled ships", self.study.ships, fields=fields, folded=False)
        sources = [f"{one.name}: {one.source}" for one in self.study.ships]
        return [Section("Ships", tables=[replace(listed, notes=sources)])]
