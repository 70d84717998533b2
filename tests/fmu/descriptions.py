"""Descriptions of FMUs as a strict reader takes them."""

from __future__ import annotations

from functools import cache

from tank2sim.analysis.heading.designs import design_heading
from tank2sim.cards import read_card
from tank2sim.dynamics import Model, build
from tank2sim.fmu.export import description_text


@cache
def model_of(ship: str) -> Model:
    if ship == "autopilot":
        return design_heading(build(read_card("mariner"))).autopilot
    return build(read_card(ship))


def whole_description(ship: str, fmi: int) -> str:
    """The description with a source file, which `description_text` does not know of."""
    text = description_text(model_of(ship), fmi=fmi)
    return text.replace("<SourceFiles>", '<SourceFiles><File name="equations.c"/>')
