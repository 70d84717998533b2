"""Marks of tests that take long."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import pytest
from _pytest.mark import ParameterSet


def first_fast(names: str, values: Iterable[Any], *, count: int = 1, **more: Any) -> pytest.MarkDecorator:
    """``pytest.mark.parametrize`` of which the first values, ``count`` of them, are fast tests, the rest slow ones."""
    several, listed, slow = "," in names, list(values), []
    for value in listed[count:]:
        if isinstance(value, ParameterSet):
            slow.append(pytest.param(*value.values, marks=[*value.marks, pytest.mark.slow], id=value.id))
        else:
            slow.append(pytest.param(*(value if several else (value,)), marks=pytest.mark.slow))
    return pytest.mark.parametrize(names, [*listed[:count], *slow], **more)
