"""The JSON of any result: words and units of its keys; tables, series and matrices in it."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any, TypeGuard

from tank2sim.answer.numbers import format_number
from tank2sim.answer.parts import Cell, Column, Table, Verdict
from tank2sim.units import in_words

Json = Any
"""What JSON holds: numbers, text, truth values, None, lists and objects of these."""

LONGEST_LIST = 12
"""Largest number of items of a list in one cell; longer lists are series. Project choice."""

_MOST_ROWS = 400
"""Rows of a table; what is beyond is left to the JSON. Project choice."""

MOST_COLUMNS, FEW_ROWS = 8, 4
"""More columns than fit on a sheet in the type of the text, and so few rows that the table is turned. Project
choice."""

_WIDE = 300.0
"""Largest over smallest number of a column that still have their digits in common. Project choice."""

VERDICT_TEXTS = ("passed", "met", "within", "stable", "finished", "course_stable_before", "course_stable_after")
"""Keys whose truth is good."""

_NAMES = {
    "speed_polynomial": ("speed polynomial, constant first", "m/s, by powers of t/s"),
    "force_polynomial": ("force polynomial, constant first", "N, by powers of t/s"),
    "could_hide": ("sizes that would not show", ""),
    "could_hide_in_words": ("sizes that would not show, in words", ""),
    "left_card_range_s": ("left the range of the card after", "s"),
    "left_card_range_at": ("where it left the range of the card", ""),
    "outside_card_range": ("outside the range of the card", ""),
    "p_values": ("p", ""),
    "members": ("members of the ensemble", ""),
}
"""Keys that mean nothing to a reader."""


def words(key: str) -> tuple[str, str]:
    """A key as a reader sees it, and its unit: ``("advance", "m")``; names of files and parameters stay as they are."""
    if key in _NAMES:
        return _NAMES[key]
    stem, _, condition = key.partition("@")
    if stem.endswith("_prime"):
        return f"{stem.removesuffix('_prime')}′", ""
    if unit := in_words(stem)[1]:
        name = words(stem[: stem.rindex("_") if not stem.endswith("_per_s") else stem.rindex("_per_s")])[0]
        return (f"{name} at {condition} deg" if condition else name), unit
    named = "." in key or "/" in key or key[1:2] == "_"  # a file, a parameter, x_G
    return (key if named else key.replace("_", " ")), ""


def titled(key: str) -> str:
    """A key as a reader sees it, with its unit in brackets."""
    name, unit = words(key)
    return f"{name} ({unit})" if unit else name


def is_number_value(value: Json) -> TypeGuard[float]:
    """Whether this is a number, and not a truth value."""
    return isinstance(value, int | float) and not isinstance(value, bool)


def as_number(value: float | None) -> float:
    """A number of the JSON; infinity for null."""
    return math.inf if value is None else value


def is_scalar(value: Json) -> bool:
    """Return whether a value fits one cell: a scalar, or a short list of scalars."""
    if isinstance(value, list):
        return len(value) <= LONGEST_LIST and not any(isinstance(item, list | Mapping) for item in value)
    return not isinstance(value, Mapping)


def is_series(value: Json) -> bool:
    """Whether this is a long list of scalars."""
    return isinstance(value, list) and len(value) > LONGEST_LIST and not any(isinstance(v, list | dict) for v in value)


def is_matrix(value: Json) -> bool:
    """Whether this is a list of lists of numbers, all of one length."""
    if not (isinstance(value, list) and value and all(isinstance(row, list) and row for row in value)):
        return False
    return all(
        len(row) == len(value[0]) and all(is_number_value(number) or number is None for number in row) for row in value
    )


def is_objects(value: Json) -> bool:
    """Whether this is a list of objects."""
    return isinstance(value, list) and bool(value) and all(isinstance(item, Mapping) for item in value)


def scalars(value: Mapping[str, Json]) -> dict[str, Json]:
    """Return the items of an object that fit one cell."""
    return {key: item for key, item in value.items() if is_scalar(item)}


def cell(key: str, value: Json) -> Cell:
    """A value in a table."""
    if isinstance(value, bool) and key in VERDICT_TEXTS:
        return Verdict.PASSED if value else Verdict.FAILED
    if isinstance(value, list):
        return ", ".join(f"{item:.4g}" if is_number_value(item) else str(item) for item in value) or None
    if value is None or isinstance(value, int | float | bool):
        return value
    return str(value)


def json_quantities(caption: str, values: Mapping[str, Json], unit: str = "") -> Table:
    """One row a value: its name, the value, its unit, which is `unit` where its key has none."""
    return _listed(caption, ["quantity"], [(words(key)[0], key, value) for key, value in values.items()], unit)


def grouped(caption: str, groups: Mapping[str, Mapping[str, Json]]) -> Table:
    """One row a value, under the name of its object: for small objects that have little in common."""
    rows = [
        (titled(group) if place == 0 else "", words(key)[0], key, value)
        for group, values in groups.items()
        for place, (key, value) in enumerate(values.items())
    ]
    return _listed(caption, ["of", "quantity"], rows)


def _listed(caption: str, heads: Sequence[str], rows: Sequence[tuple[Json, ...]], unit: str = "") -> Table:
    """Rows that end with a key and its value: each value has its own digits, for the column has no one unit. What is
    not known has no row."""
    rows = [row for row in rows if cell(row[-2], row[-1]) is not None]
    units = [words(key)[1] or (unit if is_number_value(value) else "") for *_, key, value in rows]
    heads = [*heads, "value", *(["unit"] if any(units) else [])]
    cells = [
        [*names, _digits(cell(key, value)), *([unit_shown] if any(units) else [])]
        for (*names, key, value), unit_shown in zip(rows, units, strict=True)
    ]
    return Table(caption=caption, columns=[Column(title=head) for head in heads], rows=cells)


def _digits(value: Cell) -> Cell:
    return format_number(value) if is_number_value(value) else value


def rows_of(caption: str, named: Sequence[tuple[str, Mapping[str, Json]]], first: str) -> Table:
    """One row an object, one column a key that any of them has; `first` heads the names, empty where there are none."""
    keys = [
        key for key in dict.fromkeys(key for _, values in named for key in scalars(values)) if _is_known(key, named)
    ]
    if len(keys) > MOST_COLUMNS and len(named) <= FEW_ROWS:
        return _turned(caption, named, keys)
    columns = [Column(title=words(key)[0], unit=words(key)[1]) for key in keys]
    wide = _wide(named, keys)
    cells = [[_shown(key, values.get(key), key in wide) for key in keys] for _, values in named[:_MOST_ROWS]]
    if first:
        columns.insert(0, Column(title=first))
        cells = [[name, *row] for (name, _), row in zip(named, cells, strict=False)]
    note = f" The first {_MOST_ROWS} of {len(named)} rows." if len(named) > _MOST_ROWS else ""
    return Table(caption=f"{caption}.{note}" if note else caption, columns=columns, rows=cells)


def _is_known(key: str, named: Sequence[tuple[str, Mapping[str, Json]]]) -> bool:
    return any(is_scalar(values.get(key)) and cell(key, values.get(key)) is not None for _, values in named)


def _turned(caption: str, named: Sequence[tuple[str, Mapping[str, Json]]], keys: Sequence[str]) -> Table:
    """A row a key and a column an object, for few objects with many keys: on paper a wide table is cut off."""
    units = [words(key)[1] for key in keys]
    heads = [name or f"no. {place}" if len(named) > 1 else name or "value" for place, (name, _) in enumerate(named, 1)]
    messages = [Column(title=head) for head in ("quantity", *heads, *(["unit"] if any(units) else []))]
    rows = [
        [words(key)[0], *(_shown(key, values.get(key), True) for _, values in named), *([unit] if any(units) else [])]
        for key, unit in zip(keys, units, strict=True)
    ]
    return Table(caption=caption, columns=messages, rows=rows)


def _wide(named: Sequence[tuple[str, Mapping[str, Json]]], keys: Sequence[str]) -> set[str]:
    """Columns of numbers so far apart that each needs its own digits."""
    found = set()
    for key in keys:
        sizes = [abs(values[key]) for _, values in named if is_number_value(values.get(key)) and values[key] != 0]
        if sizes and max(sizes) > _WIDE * min(sizes):
            found.add(key)
    return found


def _shown(key: str, value: Json, wide: bool) -> Cell:
    shown = cell(key, value) if is_scalar(value) else None
    return _digits(shown) if wide else shown


def alike(values: Mapping[str, Json]) -> bool:
    """Whether these are objects of one kind: two or more that share at least half of what they have in cells."""
    if len(values) < 2 or not all(isinstance(value, Mapping) for value in values.values()):
        return False
    keys = [set(scalars(value)) or set(value) for value in values.values()]
    return 2 * len(set.intersection(*keys)) >= len(set.union(*keys))


def short_columns(values: Mapping[str, Json]) -> list[str]:
    """Keys of short lists of numbers that belong together: two or more of one length, above one."""
    lists = {
        k: v for k, v in values.items() if isinstance(v, list) and v and all(map(is_number_value, v)) and is_scalar(v)
    }
    return [key for key, numbers in lists.items() if len(numbers) > 1 and _as_long(numbers, lists.values())]


def _as_long(column: list[Json], all_of_them: Any) -> bool:
    return sum(len(numbers) == len(column) for numbers in all_of_them) > 1


def numbered(caption: str, values: Mapping[str, list[Json]]) -> Table:
    """Short lists next to each other, one row a place, counted from 1."""
    longest = max(len(value) for value in values.values())
    columns = [Column(title="no."), *(Column(title=words(key)[0], unit=words(key)[1]) for key in values)]
    rows = [
        [place + 1, *(value[place] if place < len(value) else None for value in values.values())]
        for place in range(longest)
    ]
    return Table(caption=caption, columns=columns, rows=rows)


def rises(values: Sequence[Json]) -> bool:
    """Whether numbers rise all the way."""
    return all(is_number_value(value) for value in values) and all(low < high for low, high in pairwise(values))
