"""A vessel: its card and the model that it describes."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Self

from tank2sim.arguments import checked
from tank2sim.cards import Card, ManoeuvringCard, SteeredCard, parse_card, read_card
from tank2sim.cards.reading import changed_text
from tank2sim.dynamics.build import build
from tank2sim.dynamics.model import Model
from tank2sim.errors import ArgumentError
from tank2sim.files import write_together

if TYPE_CHECKING:
    import pandas as pd


class Vessel:
    """A ship (or another body) as its card describes it, with the model of the card.

    Parameters
    ----------
    card : Card
        What is known of the ship, SI and radians.

    Raises
    ------
    InputError
        It is something else, such as the name of a ship.
    """

    def __init__(self, card: Card) -> None:
        if not isinstance(card, Card):
            named = repr(card) if isinstance(card, str | Path) else f"of the type {type(card).__name__}"
            raise ArgumentError("card", "", f"is {named}, and no card", 'tank2sim.load("mariner") reads one')
        self.card = card

    @property
    def name(self) -> str:
        """Name of the ship."""
        return self.card.ship.name

    @property
    def source(self) -> str:
        """Where the numbers of the card are from."""
        return self.card.ship.source

    @cached_property
    def model(self) -> Model:
        """The equations of motion in CasADi: states, inputs, outputs and parameters with units; SI and radians.

        Raises
        ------
        InputError
            The card names what its model does not have.
        """
        return build(self.card)

    @property
    def derivatives(self) -> pd.DataFrame:
        """Hydrodynamic derivatives: value and standard error by name; prime with the rudder positive to starboard, of a
        craft with thrusters SI.

        Raises
        ------
        InputError
            The card is not one of a ship or craft that manoeuvres.
        """
        import pandas as pd

        card = self.steered()
        rows = [(name, value, card.standard_error(name)) for name, value in card.derivatives.items()]
        return pd.DataFrame(rows, columns=["name", "value", "standard_error"]).set_index("name")

    def manoeuvring(self) -> ManoeuvringCard:
        """The card, if it is one of a ship that manoeuvres in the horizontal plane.

        Raises
        ------
        InputError
            It is not: a towed body, a yaw rig, a glider or a craft without a rudder.
        """
        return self.card.manoeuvring()

    def steered(self) -> SteeredCard:
        """The card, if it is one of a ship that manoeuvres or of a small craft with thrusters.

        Raises
        ------
        InputError
            It is neither: a towed body, a yaw rig or a glider.
        """
        return self.card.steered()

    @checked
    def replace(self, values: Mapping[str, object]) -> Self:
        """The ship with other values on its card, by dotted key: ``{"derivatives.Yv": -0.012}``.

        Values are in the scaling and signs of the card's file; :attr:`derivatives` has others.

        Raises
        ------
        InputError
            The card does not have the key, or the value is out of its bounds.
        """
        return type(self)(parse_card(changed_text(self.card.text, self.card.source, values), self.card.source))

    @checked
    def save(self, path: str | Path) -> None:
        """Write the card's TOML to a file, whole or not at all.

        Raises
        ------
        InputError
            The file cannot be written.
        """
        write_together({Path(path): self.card.text})

    def __repr__(self) -> str:
        particulars = [f"{self.card.model.kind} model"]
        if isinstance(self.card, SteeredCard):
            particulars += [f"L = {self.card.ship.length_m:g} m", f"u0 = {self.card.model.speed_mps:.4g} m/s"]
            particulars += [f"{len(self.card.derivatives)} derivatives"]
            particulars += (
                [f"effects: {', '.join(effect.name for effect in self.card.effects)}"] if self.card.effects else []
            )
        return f"{self.name} ({', '.join(particulars)}); {self.card.source}"


def as_vessel(card: Vessel | Card | str | Path) -> Vessel:
    """A vessel, whatever names it: itself, its card, the name of a bundled ship or a file.

    Raises
    ------
    InputError
        The file is missing or at fault.
    """
    if isinstance(card, Vessel):
        return card
    return Vessel(card if isinstance(card, Card) else read_card(card))
