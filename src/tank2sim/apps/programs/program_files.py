"""Files of another program that a card becomes, and what is lost on the way."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from tank2sim.apps.programs.polynomial_fit import FigureChange


@dataclass(frozen=True, kw_only=True)
class ProgramFiles:
    """What a card is in another program."""

    files: Mapping[str, str | bytes]  # Path within the folder to content
    use: str  # How the program takes the files, in Markdown, for the README next to them
    losses: tuple[str, ...] = ()  # What the program does not have of the card, a sentence each
    # Figures of standard manoeuvres by tank2sim and by the equations of the program
    changes: tuple[FigureChange, ...] = ()
