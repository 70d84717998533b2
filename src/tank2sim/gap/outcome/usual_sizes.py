"""Whether data in which no effect is missing could have shown one."""

from __future__ import annotations

from collections.abc import Mapping

from tank2sim.cards.card import ManoeuvringCard
from tank2sim.dynamics.effects import EFFECTS
from tank2sim.gap.result import NO_EFFECT_MISSING, Gap

MANY_HIDDEN = 0.25
"""Share of the effects that would not show at their usual size, from which "no missing effect" says little (project
choice: of varied manoeuvres a tenth does not show, of the first 50 s of one turn two fifths, of 10 s nearly all)."""


def hidden_effects_caution(gap: Gap) -> tuple[str, ...]:
    """How many effects would not show at their usual size, where none is missing and these are many.

    Parameters
    ----------
    gap : Gap
    """
    if gap.verdict != NO_EFFECT_MISSING:
        return ()
    known = [
        hidden for name, sizes in gap.could_hide.items() if (hidden := _is_hidden(gap.card, name, sizes)) is not None
    ]
    if not known or sum(known) <= MANY_HIDDEN * len(known):
        return ()
    return (f"{sum(known)} of {len(known)} effects would not show in these data at their usual size",)


def _is_hidden(card: ManoeuvringCard, name: str, sizes: Mapping[str, float]) -> bool | None:
    """Whether an effect would not show at its usual size in any of its amplitudes; None without a usual size."""
    typical = {parameter.name: parameter.typical_values(card) for parameter in EFFECTS[name].parameters}
    pairs = [(size, max(map(abs, typical[key]))) for key, size in sizes.items() if typical[key]]
    return all(size >= usual for size, usual in pairs) if pairs else None
