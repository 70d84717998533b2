"""A card validated against trials in the manner of ITTC 7.5-02-06-03, and cards of one ship compared."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from tank2sim.api.verbs import verb
from tank2sim.arguments import REQUIRED_PERCENT, VALIDATION_MEMBERS, PositivePercent, SmallEnsemble

if TYPE_CHECKING:
    import pandas as pd

    from tank2sim.api.trial import TrialRecord
    from tank2sim.cards import Card
    from tank2sim.dynamics.vessel import Vessel
    from tank2sim.results.comparison import ComparisonResult
    from tank2sim.results.validation import ValidationResult


@verb(
    "a validation report after ITTC 7.5-02-06-03",
    results=("tank2sim.results.validation:ValidationResult",),
)
def validate(
    ship: Vessel,
    trials: str | Path | TrialRecord | pd.DataFrame | Sequence[str | Path | TrialRecord | pd.DataFrame] = (),
    *,
    members: SmallEnsemble = VALIDATION_MEMBERS,
    required_percent: PositivePercent = REQUIRED_PERCENT,
) -> ValidationResult:
    """Validate a ship in the manner of ITTC 7.5-02-06-03 by trials that did not make its card, figure by figure.

    A trial that the card was identified from can only refute it. Trials of a craft with thrusters are predicted by
    their recorded revolutions, 30 s at a time.

    Parameters
    ----------
    ship : Vessel, Card, str or path
    trials : path, TrialRecord, DataFrame, or sequence of them
        Turning circles and zigzags of a ship, any trials of a craft; a folder means the trials in it. Without any, the
        model is documented and verified.
    members : int
        Ships drawn within the errors of the card for u_input; with 0 no figure can be judged.
    required_percent : float
        Required level of validation, U_reqd, in per cent of each measured figure.

    Raises
    ------
    InputError
        The card is not one of a ship or craft that manoeuvres, a file is at fault, or no trial of a craft is long
        enough to be predicted.
    """
    from tank2sim.api.trial import trials_of
    from tank2sim.api.validation_study import validate_ship
    from tank2sim.results.validation import ValidationResult

    card = ship.steered()
    return ValidationResult(
        *validate_ship(card, trials_of(trials, thrusters=card.thrusters), members, required_percent)
    )


@verb("cards of one ship side by side", results=("tank2sim.results.comparison:ComparisonResult",))
def compare(
    cards: Sequence[Vessel | Card | str | Path], *, members: SmallEnsemble = VALIDATION_MEMBERS
) -> ComparisonResult:
    """Compare cards of one ship, or of ships and models of one form; the first is the reference, whose size is taken.

    Cards of a craft with thrusters are compared at its own size, by a straight run, turns by difference and a spin.

    Parameters
    ----------
    cards : sequence of Vessel, Card, str or path
        Two or more (captive, trial, estimate: in any order).
    members : int
        Ships drawn within the errors of each card for the deviations of the figures; 0 for none.

    Raises
    ------
    InputError
        There is only one card, a card is not one of a ship or craft that manoeuvres, or both are mixed.

    Examples
    --------
    >>> import tank2sim as t2s
    >>> ship = t2s.load("mariner")
    >>> found = t2s.compare([ship, ship.replace({"derivatives.Yv": -0.012})], members=0)
    >>> changed = found.coefficients.query("difference_percent != 0").set_index("coefficient")
    >>> list(changed.index)
    ['Yv']
    """
    from tank2sim.analysis.validation.comparison import compare_cards
    from tank2sim.dynamics.vessel import as_vessel
    from tank2sim.results.comparison import ComparisonResult

    ships = [as_vessel(card) for card in ([cards] if isinstance(cards, str | Path) else cards)]
    return ComparisonResult(compare_cards([ship.steered() for ship in ships], members), tuple(ships))
