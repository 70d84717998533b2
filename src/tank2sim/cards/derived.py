"""Cards made of other cards: what of the covariance still holds."""

from __future__ import annotations

from dataclasses import replace

from tank2sim.cards.card import Card
from tank2sim.cards.covariance import not_referring
from tank2sim.cards.covariance_reading import HOLDS, carried, read_covariance
from tank2sim.cards.reading import parse_card


def derived_card(card: Card, text: str, source: str) -> tuple[Card, tuple[str, ...]]:
    """The card of `text`, which was made of `card`, with what of the covariance of that still holds.

    Parameters
    ----------
    card : Card
        The card before.
    text : str
        TOML of the card now.
    source : str
        What messages call it.

    Returns
    -------
    card : Card
        Its ``files`` and ``save`` write the covariance, too.
    notices : tuple of str
        What of the covariance was lost.

    Raises
    ------
    InputError
        The covariance to which `card` refers is at fault, or the text is.
    """
    known = read_covariance(card)
    if known is None:
        return parse_card(text, source), ()
    kept = carried(card, text)
    if kept is None:
        return parse_card(not_referring(text), source), (
            f"{source} has no covariance: all numbers of {card.source}'s changed",
        )
    found = replace(parse_card(text, source), covariance=kept)
    if len(kept.names) == len(known.names):
        return found, ()
    changed = ", ".join(name.removeprefix("derivatives.") for name in known.names if name not in kept.names)
    notice = f"the covariance of {source} is that of {len(kept.names)} numbers, moved by {HOLDS:g} standard error"
    return found, (f"{notice} at most; errors of the others are independent now: {changed}",)
