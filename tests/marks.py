"""Marks of tests that take long."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import pytest
from _pytest.mark import ParameterSet


def first_fast(names: str | tuple[str, ...], values: Iterable[Any], **more: Any) -> pytest.MarkDecorator:
    """``pytest.mark.parametrize`` of which the first value is a fast test and the others are slow ones."""
    several, (first, *others), slow = not isinstance(names, str) or "," in names, values, []
    for value in others:
        if isinstance(value, ParameterSet):
            slow.append(pytest.param(*value.values, marks=[*value.marks, pytest.mark.slow], id=value.id))
        else:
            slow.append(pytest.param(*(value if several else (value,)), marks=pytest.mark.slow))
    return pytest.mark.parametrize(names, [first, *slow], **more)
