"""The covariance to which a card refers: read, checked against the card, and carried over to cards made of it."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from tank2sim.arrays import Array
from tank2sim.cards.card import Card, ManoeuvringCard
from tank2sim.cards.covariance import COVARIANCE_FORMAT, REFERENCE_LINE, Covariance, not_referring
from tank2sim.cards.reading import parse_card
from tank2sim.cards.scaling import LARGEST_PRIME
from tank2sim.errors import InputError
from tank2sim.files import BYTE_ORDER_MARK, named_in, parsed_json, read_text
from tank2sim.notices import Notice

_ROUNDING = 0.006
"""Share by which a standard error of the card, three figures, may differ from the covariance."""

NEGATIVE = 1e-8
"""Share of the largest eigenvalue of the correlations by which rounding may make one negative (project choice)."""

_SCATTER = 4.0
"""Standard errors of a standard deviation of n samples, 1/sqrt(2 (n - 1)) of it for a normal distribution (Kendall and
Stuart 1977, 10.5), by which samples may vary otherwise than the covariance, which may be of more of them (project
choice)."""

HOLDS = 1.0
"""Standard errors by which a number may be moved (tuned) and still be the one that the covariance is of: tuning by the
most uncertain moves nearly all numbers a little, and without the covariance they would seem known far worse (project
choice)."""


def carried(card: Card, text: str) -> Covariance | None:
    """The part of a card's covariance that holds for a card made from it, `text`: all numbers that are the same
    there, or moved within :data:`HOLDS`, with the same standard error.

    What was changed more is a number from elsewhere, and independent then. None if the card refers to none, or nothing
    of it is left.

    Raises
    ------
    InputError
        As :func:`read_covariance`.
    """
    known = read_covariance(card)
    if known is None:
        return None
    old, new = (tomllib.loads(card_text.removeprefix(BYTE_ORDER_MARK)) for card_text in (card.text, text))

    def holds(name: str, error: float) -> bool:
        effect = ".".join([*name.split(".")[:2], "name"]) if name.startswith("effects.") else name
        before, after = _at(old, name), _at(new, name)
        if not isinstance(before, int | float) or not isinstance(after, int | float):
            return False
        stated = _uncertainty_of(name)
        alike = _at(old, stated) == _at(new, stated) and (effect == name or _at(old, effect) == _at(new, effect))
        return alike and abs(after - before) <= HOLDS * error

    errors = np.sqrt(np.maximum(np.diag(known.matrix), 0.0)).tolist()
    rows = [place for place, error in enumerate(zip(known.names, errors, strict=True)) if holds(*error)]
    kept = tuple(known.names[row] for row in rows)
    if not kept:
        return None
    samples = None
    if known.samples is not None:
        moved = [float(_at(new, name)) - float(_at(old, name)) for name in kept]  # type: ignore[arg-type]
        samples = known.samples[:, rows] + np.array(moved)
    return Covariance(kept, known.matrix[np.ix_(rows, rows)], samples)


def read_covariance(card: Card) -> Covariance | None:
    """The covariance to which a card refers; None if it refers to none.

    Raises
    ------
    InputError
        The file is missing or no covariance (shape, names of the card, symmetric, positive semidefinite up to
        rounding), or its standard errors differ from the card's.
    """
    if card.covariance is not None:
        return card.covariance
    found = REFERENCE_LINE.search(card.text)
    if found is None:
        return None
    path = Path(card.source).parent / found[1]
    if not path.is_file():
        remedy = f"put it next to the card, or take the line '# covariance: {found[1]}' out"
        raise InputError(path, "", f"is missing, and {card.source} refers to it", remedy)
    with named_in(card.source, path):
        names, rows, drawn = _form(path)
        matrix = _matrix(path, names, rows)
        _check_names(card, path, names)
        _check_errors(card, path, names, matrix)
        return Covariance(tuple(names), matrix, None if drawn is None else _samples(path, matrix, drawn))


def _form(path: Path) -> tuple[list[str], object, object]:
    content = parsed_json(read_text(path), path, "write it again with reduce or identify")
    if not isinstance(content, dict) or content.get("format") != COVARIANCE_FORMAT:
        raise InputError(path, "format", f"is not {COVARIANCE_FORMAT!r}", "give a file that reduce or identify wrote")
    names = content.get("names")
    if not isinstance(names, list) or not names or not all(isinstance(name, str) for name in names):
        raise InputError(path, "names", "is not a list of keys of the card", 'give names such as "derivatives.Yv"')
    if len(set(names)) < len(names):
        raise InputError(path, "names", "has a name twice", "give each number once")
    return names, content.get("covariance"), content.get("samples")


def _samples(path: Path, matrix: Array, rows: object) -> Array:
    """Samples (n, k) with the variances of the covariance, up to sampling scatter."""
    samples = _table(rows)
    remedy = "write it again with identify, or take the samples out"
    if samples.ndim != 2 or samples.shape[1] != len(matrix) or len(samples) < 2 or not np.isfinite(samples).all():
        raise InputError(path, "samples", f"is not a table of rows of {len(matrix)} finite numbers", remedy)
    errors = np.sqrt(np.diag(matrix))
    slack = _ROUNDING + _SCATTER / math.sqrt(2 * (len(samples) - 1))
    if np.any(np.abs(samples.std(axis=0, ddof=1) - errors) > slack * errors):
        raise InputError(path, "samples", "vary by other standard deviations than the covariance", remedy)
    return samples


def _table(rows: object) -> Array:
    """Rows of numbers of a JSON file; empty if a cell is a text, a truth value or missing."""
    flat = [cell for row in rows if isinstance(row, list) for cell in row] if isinstance(rows, list) else []
    try:
        numbers = all(isinstance(cell, int | float) and not isinstance(cell, bool) for cell in flat)
        return np.array(rows, dtype=float) if numbers else np.zeros(0)
    except (TypeError, ValueError, OverflowError):  # an integer may be beyond all floats
        return np.zeros(0)


def _matrix(path: Path, names: Sequence[str], rows: object) -> Array:
    matrix = _table(rows)
    if matrix.shape != (len(names), len(names)) or not np.isfinite(matrix).all():
        problem = f"is not a matrix of {len(names)} rows of {len(names)} finite numbers"
        raise InputError(path, "covariance", problem, "give a row for each of the names")
    errors = np.sqrt(np.maximum(np.diag(matrix), 0.0))
    size = np.outer(errors, errors)
    if np.any(np.diag(matrix) < 0) or np.any(np.abs(matrix - matrix.T) > 1e-9 * size):
        raise InputError(path, "covariance", "is not symmetric with variances on its diagonal", "write it again")
    correlation = np.divide(matrix, size, out=np.zeros_like(matrix), where=size > 0)
    if np.any(matrix[size == 0] != 0):
        raise InputError(path, "covariance", "has a number that is exact and yet varies with others", "write it again")
    values = np.linalg.eigvalsh(correlation)
    if values[0] < -NEGATIVE * max(values[-1], 1.0):
        problem = "is not positive semidefinite: no numbers vary like that"
        raise InputError(path, "covariance", problem, "write it again")
    return matrix


def _check_names(card: Card, path: Path, names: Sequence[str]) -> None:
    content = tomllib.loads(card.text.removeprefix(BYTE_ORDER_MARK))
    for name in names:
        value = _at(content, name)
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise InputError(
                path, f"names: {name}", f"is not a number of {card.source}", "give dotted keys of the card"
            )


def _check_errors(card: Card, path: Path, names: Sequence[str], matrix: Array) -> None:
    content = tomllib.loads(card.text.removeprefix(BYTE_ORDER_MARK))
    known = (
        {f"derivatives.{key}": name for name, key in card.places.items()} if isinstance(card, ManoeuvringCard) else {}
    )
    for name, variance in zip(names, np.diag(matrix), strict=True):
        key = _uncertainty_of(name)
        stated = _at(content, key)
        error = math.sqrt(variance)
        if isinstance(card, ManoeuvringCard) and name in known:
            prime = error / abs(card.file_factor(known[name]))
            if prime > LARGEST_PRIME:
                problem = f"has a standard error of {prime:.4g} in the prime system"
                raise InputError(path, f"covariance of {name}", problem, f"at most {LARGEST_PRIME:g} was expected")
        if isinstance(stated, int | float) and abs(stated - error) > _ROUNDING * max(abs(stated), error):
            problem = f"is {stated:.4g}, and {path.name} says {error:.4g}"
            raise card.fault(key, problem, "make them agree, or take the line '# covariance: ...' out")


def _uncertainty_of(name: str) -> str:
    """Key of the standard error that belongs to a key: effects and thrusters have their own, or ``[uncertainty]``."""
    if name.startswith("thrusters."):
        section, _, key = name.rpartition(".")
        return f"{section}.uncertainty.{key}"
    if name.startswith("effects."):
        return name.replace(".parameters.", ".uncertainty.")
    return f"uncertainty.{name.partition('.')[2]}" if name.startswith("derivatives.") else ""


def _at(content: Any, key: str) -> object:
    """Value at a dotted key of a TOML document; None if there is none."""
    for part in key.split("."):
        if isinstance(content, list) and part.isdigit() and int(part) < len(content):
            content = content[int(part)]
        elif isinstance(content, dict) and part in content:
            content = content[part]
        else:
            return None
    return content


def derived_card(card: Card, text: str, source: str) -> tuple[Card, tuple[Notice, ...]]:
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
    notices : tuple of Notice
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
            Notice(f"{source} has no covariance: all numbers of {card.source}'s changed"),
        )
    found = replace(parse_card(text, source), covariance=kept)
    if len(kept.names) == len(known.names):
        return found, ()
    changed = ", ".join(name.removeprefix("derivatives.") for name in known.names if name not in kept.names)
    notice = f"the covariance of {source} covers {len(kept.names)} numbers, moved by {HOLDS:g} standard error"
    return found, (Notice(f"{notice} at most; errors of the others are independent now: {changed}"),)
