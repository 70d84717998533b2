"""The bundled ships."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tank2sim.api.verbs import verb

if TYPE_CHECKING:
    from tank2sim.results.ships import ShipsResult


@verb(
    "the bundled ships, by the names that CARD takes",
    name="ships",
    results=("tank2sim.results.ships:ShipsResult",),
    charts=False,
)
def list_ships() -> ShipsResult:
    """List the bundled ships, by the names that CARD takes."""
    from tank2sim.bundled import bundled_cards
    from tank2sim.cards import read_card
    from tank2sim.results.ships import BundledShip, BundledShips, ShipsResult

    cards = {name: read_card(path) for name, path in bundled_cards().items()}
    ships = tuple(
        BundledShip(
            name=name,
            ship=card.ship.name,
            kind=card.model.kind,
            length_m=card.ship.length_m,
            source=card.ship.source,
            card=str(card.source),
        )
        for name, card in cards.items()
    )
    return ShipsResult(BundledShips(ships), cards)
