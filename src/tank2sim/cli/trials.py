"""What commands on several trials share: options with many names, and the trials that are fitted and held out."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

import click

from tank2sim.cards import ManoeuvringCard
from tank2sim.errors import InputError
from tank2sim.identification.trials.problem.prepare_trials import Measured, measured
from tank2sim.records.reading import looks_like_a_trial
from tank2sim.records.same_record import refuse_copies


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


def trial_files(given: Sequence[Path]) -> list[Path]:
    """The files named; a folder stands for the trials in it.

    Raises
    ------
    InputError
        A folder holds no trial.
    """
    found: list[Path] = []
    for path in given:
        inside = sorted(file for file in path.glob("*") if looks_like_a_trial(file)) if path.is_dir() else [path]
        if not inside:
            raise InputError(path, "", "holds no trial", "a folder with trials (.csv or .dat) was expected")
        found += inside
    return found


def fitted_and_held(
    trials: Sequence[Path], holdout: Sequence[Path], card: ManoeuvringCard
) -> tuple[Measured, Measured]:
    """Trials to be fitted and held out, at the size of the card's ship.

    Raises
    ------
    InputError
        A file is at fault (:func:`.measured.measured`), or two have one name or are one record, also where one of them
        is held out.
    """
    fitted, held = measured(trial_files(trials), card), measured(trial_files(holdout), card)
    for trial in held.trials:
        if trial.name in {other.name for other in fitted.trials}:
            raise InputError(trial.path, "", "is both fitted and held out", "hold out what is not fitted")
    refuse_copies(fitted.trials, held.trials)
    return fitted, held
