"""The bundled ships as a result."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from tank2sim.answer.parts import Table
from tank2sim.api.result import OldResult, screen_table
from tank2sim.bundled import bundled_cards
from tank2sim.cards import Card, read_card

if TYPE_CHECKING:
    import pandas as pd


class ShipsResult(OldResult):
    """The bundled ships.

    Parameters
    ----------
    cards : mapping
        Name, as :func:`.load` takes it, to card.
    """

    command = "ships"
    notices = ()

    def __init__(self, cards: Mapping[str, Card]) -> None:
        self.cards = cards

    @property
    def df(self) -> pd.DataFrame:
        """Name (index), title, kind of model, length (m) and source."""
        import pandas as pd

        rows = [
            (name, card.ship.name, card.model.kind, card.ship.length_m, card.ship.source)
            for name, card in self.cards.items()
        ]
        return pd.DataFrame(rows, columns=["name", "ship", "model", "length_m", "source"]).set_index("name")

    def content(self) -> Mapping[str, object]:
        """As :meth:`.OldResult.content`."""
        listed = [
            {
                "name": name,
                "ship": card.ship.name,
                "kind": card.model.kind,
                "source": card.ship.source,
                "card": card.source,
            }
            for name, card in self.cards.items()
        ]
        return {"ships": listed}

    @property
    def headline(self) -> tuple[str, ...]:
        """None: the table says it."""
        return ()

    @property
    def tables(self) -> tuple[Table, ...]:
        """Names, kinds and lengths, with the sources as notes."""
        rows = [[name, card.ship.name, card.model.kind, card.ship.length_m] for name, card in self.cards.items()]
        sources = tuple(f"{name}: {card.ship.source}" for name, card in self.cards.items())
        return (screen_table("Bundled ships", ("CARD", "ship", "model", "length (m)"), rows, sources),)


def list_ships() -> ShipsResult:
    """The bundled ships."""
    return ShipsResult({name: read_card(path) for name, path in bundled_cards().items()})
