"""The place in a result that was read last, so that a value that cannot be drawn is reported by its key."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeVar

from tank2sim.answer.study import not_as_written
from tank2sim.report.json_values import Json

_T = TypeVar("_T")
_FAULTS = (AttributeError, IndexError, KeyError, TypeError, ValueError, ArithmeticError)


@dataclass
class _Place:
    """The path of what was read last."""

    last: str = ""


class _Watched(dict[str, Json]):
    """An object of JSON that notes each key as it is read."""

    def __init__(self, values: dict[str, Json], path: str, place: _Place):
        super().__init__(
            {key: _watched(value, f"{path}.{key}" if path else key, place) for key, value in values.items()}
        )
        self._path, self._place = path, place

    def __getitem__(self, key: str) -> Json:
        self._note(key)
        return super().__getitem__(key)

    def get(self, key: str, default: Json = None) -> Json:
        """As of any dict."""
        self._note(key)
        return super().get(key, default)

    def _note(self, key: str) -> None:
        self._place.last = f"{self._path}.{key}" if self._path else key


def _watched(value: Json, path: str, place: _Place) -> Json:
    if isinstance(value, dict):
        return _Watched(value, path, place)
    if isinstance(value, list) and value and isinstance(value[0], dict | list):
        return [_watched(item, f"{path}[{number}]", place) for number, item in enumerate(value)]
    return value


def drawn_from(result: Json, source: str, draw: Callable[[Json], _T]) -> _T:
    """What `draw` makes of a result.

    Raises
    ------
    InputError
        It fails on the shape of a value, which is then no longer as the command wrote it; named by its key.
    """
    place = _Place()
    try:
        return draw(_watched(result, "", place))
    except _FAULTS as error:
        raise not_as_written(source, place.last) from error
