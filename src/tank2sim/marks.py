"""Marks of a result that its data do not carry: a message that contains one is shown before the result itself."""

from __future__ import annotations

from collections.abc import Iterable

EXTRAPOLATED = "EXTRAPOLATED beyond"
"""Figures settled outside what the card was measured in."""

ASSUMED = "ASSUMED standard errors"
"""No standard error is known, and every interval rests on an assumed one."""

LINEARISED = "LINEARISED standard errors"
"""Predicted errors of a ship whose motion is not linear in its coefficients within their errors."""

ASSUMED_TANK = "ASSUMED of the tank"
"""Lengths and times of a tank that none has stated."""

FORCED = "FORCED"
"""A refusal was overridden."""

UNCONFIRMED = "UNCONFIRMED"
"""A channel of a log, or its clock, is not what it seems; somebody must confirm or correct it."""

CHECK = "CHECK:"
"""A result that needs a second look before it is used: it is hardly certain, or compared under other conditions than
were asked for, or tests contradict each other or give what no ship has."""


def assumed_words(messages: Iterable[str]) -> str:
    """Words for the title of what rests on assumed standard errors, with a comma before them; empty otherwise."""
    return ", standard errors assumed" if any(ASSUMED in text for text in messages) else ""


def marked(messages: Iterable[str]) -> list[str]:
    """The messages that contain a mark, each once: those with CHECK first, else in their order."""
    marks = (EXTRAPOLATED, ASSUMED, ASSUMED_TANK, CHECK, LINEARISED, FORCED, UNCONFIRMED)
    found = dict.fromkeys(text for text in messages if any(mark in text for mark in marks))
    return sorted(found, key=lambda text: CHECK not in text)
