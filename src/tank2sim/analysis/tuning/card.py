"""The tuned card, in the conventions of its text."""

from __future__ import annotations

from typing import Any

import tomlkit

from tank2sim.analysis.tuning.result import Move, Tuned
from tank2sim.cards.card import ManoeuvringCard
from tank2sim.cards.reading import changed_text, parse_card
from tank2sim.files import BYTE_ORDER_MARK

_DIGITS = 10
"""Significant digits of a tuned number: rounding does not change a printed figure."""


def tuned_text(card: ManoeuvringCard, tuned: Tuned) -> str:
    """Text of a card with the moves made: each changed key has its old value as a comment."""
    targets = ", ".join(target.text for target in tuned.targets)
    how = f"tuned by tank2sim influence to {targets}"
    text = card.text
    for move in tuned.moves:
        comment = _comment(card, move) if _takes_comment(card, move.parameter.key) else None
        value = float(f"{move.after * move.parameter.factor:.{_DIGITS}g}")
        text = changed_text(text, card.source, {move.parameter.key: value}, comment=comment)
    text = changed_text(text, card.source, {"ship.source": f"{card.ship.source}; {how}"})
    parse_card(text, card.source)
    mark = BYTE_ORDER_MARK if text.startswith(BYTE_ORDER_MARK) else ""
    head = f"# {how[0].upper()}{how[1:]} ({tuned.means.by}).\n# Keys that changed have their old values in comments.\n"
    return mark + head + text.removeprefix(mark)


def _comment(card: ManoeuvringCard, move: Move) -> str:
    old = _found(card, move.parameter.key)
    moved = move.in_standard_errors
    far = "" if moved is None else f", moved {moved:+.2f} standard errors"
    return f"not stated before tuning{far}" if old is None else f"was {old.as_string()} before tuning{far}"


def _found(card: ManoeuvringCard, key: str) -> Any:
    """Value at a dotted key of the card's text; None if absent."""
    content: Any = tomlkit.parse(card.text.removeprefix(BYTE_ORDER_MARK))
    for part in key.split("."):
        if isinstance(content, list) and part.isdigit():
            content = content[int(part)]
        elif part in content:
            content = content[part]
        else:
            return None
    return content


def _takes_comment(card: ManoeuvringCard, key: str) -> bool:
    """False in ``effects = [{...}]``: TOML has no comment within braces."""
    entries = _found(card, "effects")
    return not key.startswith("effects.") or isinstance(entries, tomlkit.items.AoT)
