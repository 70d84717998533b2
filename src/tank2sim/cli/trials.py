"""Options that take several words."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import click


class TakesSeveral(click.Command):
    """A command some options of which take all words up to the next option: ``--holdout A B -o C``.

    Parameters
    ----------
    several : sequence of str
        These options; each is declared with ``multiple=True``.
    """

    def __init__(self, *args: Any, several: Sequence[str] = (), **more: Any):
        super().__init__(*args, **more)
        self.several = frozenset(several)

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Give each of the words an option of its own, as click has it."""
        spread: list[str] = []
        taking = ""
        for word, following in pairwise([*args, "-"]):
            if word in self.several and following.startswith("-"):
                what = {"--holdout": "trial", "--figure": "figure", "--tune": "figure"}.get(word, "effect")
                raise click.UsageError(f"{word} names no {what}", ctx)
            if word.startswith("-"):
                taking = word if word in self.several else ""
                spread += [] if taking else [word]
            else:
                spread += [taking, word] if taking else [word]
        return super().parse_args(ctx, spread)
