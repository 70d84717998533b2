"""Options and result of the tuning of a card."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Annotated, Any

import tomlkit
from pydantic import Field

from tank2sim.cards.card import SteeredCard
from tank2sim.cards.reading import changed_text, parse_card
from tank2sim.errors import ArgumentError
from tank2sim.escaping import one_line
from tank2sim.files import BYTE_ORDER_MARK

FEWEST, UNCERTAIN = "fewest", "uncertain"

WITHIN = 3.0
"""Bounds of the moves, standard errors: 99.7 % of a normal distribution."""


@dataclass(frozen=True)
class Means:
    """Options of the change of a card.

    Parameters
    ----------
    by : str
        :data:`FEWEST` or :data:`UNCERTAIN`.
    within : float
        Bounds of each move, standard errors; the agreed variation has the same bounds on its multiple.
    hold : sequence of str
        Parameters that do not change, by names as a user writes them.
    bounds : mapping
        Name to lowest and highest value in the unit of the card's file, instead of `within`.
    agreed : mapping
        Kc % by name, for parameters that move only together.

    Raises
    ------
    InputError
        `by` is unknown, or `within` is not positive.
    """

    by: str = UNCERTAIN
    within: float = WITHIN
    hold: Sequence[str] = ()
    bounds: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    agreed: Mapping[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if self.by not in (FEWEST, UNCERTAIN):
            raise ArgumentError("by", "", f"is {self.by!r}", f"give {FEWEST} or {UNCERTAIN}")
        if not 0 < self.within < math.inf:
            raise ArgumentError("within", "", f"is {self.within:g}", "give a positive number")


@dataclass(frozen=True, kw_only=True)
class TunedTarget:
    """A target: figure, relation (``=``, ``<=``, ``>=``) and value, and the figure before and after."""

    figure: str
    wanted: float
    relation: str
    before: float
    after: float


@dataclass(frozen=True, kw_only=True)
class TunedNumber:
    """A number that changed, as the card's file has it; the move in standard errors, None for an exact number."""

    name: str
    before: float
    after: float
    standard_errors: float | None


@dataclass(frozen=True, eq=False, kw_only=True)
class TunedStudy:
    """A card tuned to targets, or as near to them as possible.

    Parameters
    ----------
    reached : bool
        All targets are met.
    by, within_standard_errors
        As of :class:`Means`.
    targets : dict
        By their text.
    parameters : dict
        Numbers that changed, by their keys on the card, the largest move first.
    agreed_times : float or None
        Multiple of the agreed variation.
    contradiction : tuple of str
        Targets that contradict each other within the bounds (one alone cannot be reached); empty if all are reached.
    figures : dict
        All requested figures of the tuned card.
    values : array (k,), optional
        Values of all parameters of the study, tuned; not part of the JSON.
    """

    reached: bool
    by: str
    within_standard_errors: float
    targets: dict[str, TunedTarget]
    parameters: dict[str, TunedNumber]
    agreed_times: float | None
    contradiction: tuple[str, ...]
    figures: dict[str, float]
    values: Annotated[Any, Field(exclude=True)] = None

    @property
    def contradiction_text(self) -> str:
        """Which targets cannot be reached, and the nearest that can; empty if all are reached."""
        if self.reached:
            return ""
        names = self.contradiction
        nearest = ", ".join(f"{target.figure} {target.after:.5g}" for target in self.targets.values())
        what = f"{names[0]} cannot be reached" if len(names) == 1 else f"{' and '.join(names)} contradict each other"
        return f"{what} within the bounds; the nearest is {nearest}"


_DIGITS = 10
"""Significant digits of a tuned number: rounding does not change a printed figure."""


def tuned_text(card: SteeredCard, tuned: TunedStudy) -> str:
    """Text of a card with its numbers changed: each changed key has its old value as a comment."""
    how = f"tuned by tank2sim influence to {', '.join(tuned.targets)}"
    text = card.text
    for key, number in tuned.parameters.items():
        comment = _comment(card, key, number.standard_errors) if _takes_comment(card, key) else None
        text = changed_text(text, card.source, {key: float(f"{number.after:.{_DIGITS}g}")}, comment=comment)
    text = changed_text(text, card.source, {"ship.source": f"{card.ship.source}; {how}"})
    parse_card(text, card.source)
    mark = BYTE_ORDER_MARK if text.startswith(BYTE_ORDER_MARK) else ""
    head = f"# {one_line(how[0].upper() + how[1:])} ({tuned.by}).\n"
    head += "# Keys that changed have their old values in comments.\n"
    return mark + head + text.removeprefix(mark)


def _comment(card: SteeredCard, key: str, moved: float | None) -> str:
    old = _found(card, key)
    far = "" if moved is None else f", moved {moved:+.2f} standard errors"
    return f"not stated before tuning{far}" if old is None else f"was {old.as_string()} before tuning{far}"


def _found(card: SteeredCard, key: str) -> Any:
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


def _takes_comment(card: SteeredCard, key: str) -> bool:
    """False in ``effects = [{...}]``: TOML has no comment within braces."""
    entries = _found(card, "effects")
    return not key.startswith("effects.") or isinstance(entries, tomlkit.items.AoT)
