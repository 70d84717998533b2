"""The bundled ships as a user of the API has them."""

from __future__ import annotations

import tank2sim as t2s
from tank2sim.bundled import bundled_cards


def test_every_bundled_ship_is_listed_and_can_be_loaded() -> None:
    listed = t2s.ships()
    assert list(listed.index) == list(bundled_cards()) and len(listed) >= 6
    for name, row in listed.iterrows():
        card = t2s.load(str(name)).card
        assert (row["ship"], row["model"], row["source"]) == (card.ship.name, card.model.kind, card.ship.source)
    assert listed.loc["mariner", "length_m"] == 160.93
