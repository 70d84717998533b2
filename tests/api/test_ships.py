"""The bundled ships as a user of the API has them."""

from __future__ import annotations

import tank2sim as t2s
from tank2sim.api.bundled_ships import list_ships
from tank2sim.bundled import bundled_cards


def test_every_bundled_ship_is_listed_and_can_be_loaded() -> None:
    listed = t2s.ships()
    assert list(listed.index) == list(bundled_cards()) and len(listed) >= 6
    for name, row in listed.iterrows():
        card = t2s.load(str(name)).card
        assert (row["ship"], row["model"], row["source"]) == (card.ship.name, card.model.kind, card.ship.source)
    assert listed.loc["mariner", "length_m"] == 160.93


def test_the_json_names_the_same_ships_and_the_list_fits_a_screen() -> None:
    found = list_ships()
    values = found.to_dict()
    assert values["schema"] == "tank2sim/ships/1"
    assert [ship["name"] for ship in values["ships"]] == list(t2s.ships().index)  # type: ignore[attr-defined]
    assert len(repr(found).splitlines()) <= 24 and "<table" in found._repr_html_()
