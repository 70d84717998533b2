"""Cards of one ship compared, by coefficients and by trajectories."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from tank2sim.api.verbs import verb
from tank2sim.arguments import VALIDATION_MEMBERS, SmallEnsemble

if TYPE_CHECKING:
    from tank2sim.cards import Card
    from tank2sim.dynamics.vessel import Vessel
    from tank2sim.results.comparison import ComparisonResult


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
