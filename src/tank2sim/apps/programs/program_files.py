"""Files of another program that a card becomes, and what is lost on the way."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from tank2sim.apps.programs.polynomial_fit import FigureChange


@dataclass(frozen=True, kw_only=True)
class ProgramFiles:
    """What a card is in another program.

    Parameters
    ----------
    files : mapping
        Path within the folder to content.
    use : str
        How the program takes the files, in Markdown, for the README next to them.
    losses : tuple of str
        What the program does not have of the card, a sentence each.
    changes : tuple of FigureChange
        Figures of standard manoeuvres by tank2sim and by the equations of the program.
    """

    files: Mapping[str, str | bytes]
    use: str
    losses: tuple[str, ...] = ()
    changes: tuple[FigureChange, ...] = ()
