"""Aliases of array types, with their form in JSON; the docstring of what takes or returns them states the shape."""

from __future__ import annotations

import math
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray

_DEEPEST = 2
"""Lists within the list of an array, at most, in the JSON of results."""


class _InJson:
    """Form of a number or array in JSON: lists for arrays, ``[real, imaginary]`` for complex numbers, null for NaN."""

    def __init__(self, dtype: type[np.generic], scalar: bool = False, null: float = math.nan) -> None:
        self.dtype, self.scalar, self.null = dtype, scalar, null

    def __get_pydantic_core_schema__(self, source: Any, handler: Any) -> Any:
        from pydantic_core import core_schema

        written = core_schema.plain_serializer_function_ser_schema(self.write, when_used="json")
        return core_schema.no_info_plain_validator_function(self.read, serialization=written)

    def __get_pydantic_json_schema__(self, schema: Any, handler: Any) -> dict[str, Any]:
        if self.scalar and self.dtype is not np.complex128:
            return {"type": ["number", "null"]}
        number = "boolean" if self.dtype is np.bool_ else "number"
        inner: dict[str, Any] = {"type": [number, "null"]}
        for _ in range(_DEEPEST):
            inner = {"anyOf": [{"type": [number, "null"]}, {"type": "array", "items": inner}]}
        return {"type": "array", "items": inner}

    def write(self, value: Any) -> Any:
        """The value as JSON has it."""
        numbers = np.asarray(value)
        if self.dtype is np.complex128:
            numbers = np.stack([numbers.real, numbers.imag], axis=-1)
        return _finite(numbers.tolist())

    def read(self, value: Any) -> Any:
        """The value of JSON; raises ValueError if it is another thing."""
        if not self.scalar and not isinstance(value, list | tuple | np.ndarray):
            raise ValueError("should be a list of numbers")
        try:
            wanted = self.dtype if self.dtype is not np.complex128 else np.float64
            if isinstance(value, np.ndarray | complex):
                wanted = self.dtype
            elif _holds_other(value, (str, dict) if self.dtype is np.bool_ else (str, dict, bool)):
                raise ValueError
            numbers = np.asarray(value, dtype=wanted)
        except (TypeError, ValueError):
            raise ValueError("should hold numbers alone") from None
        if self.dtype is np.complex128 and numbers.dtype != np.complex128:
            if numbers.size and numbers.shape[-1:] != (2,):
                raise ValueError("should hold pairs of a real and an imaginary part")
            pairs = numbers if numbers.size else np.zeros((0, 2))
            numbers = np.asarray(pairs @ np.array([1, 1j]))
        if not self.scalar:
            return numbers
        if numbers.ndim:
            raise ValueError("should be a number")
        return self.null if value is None else numbers.item()


def _finite(value: Any) -> Any:
    if isinstance(value, list):
        return [_finite(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def _holds_other(value: Any, kinds: tuple[type, ...]) -> bool:
    """Whether nested lists hold an item of one of these types."""
    if isinstance(value, list | tuple):
        return any(_holds_other(item, kinds) for item in value)
    return isinstance(value, kinds)


Array = Annotated[NDArray[np.float64], _InJson(np.float64)]
"""Real numbers, of any shape; in JSON lists, null for what is not finite."""

ComplexArray = Annotated[NDArray[np.complex128], _InJson(np.complex128)]
"""Complex numbers, of any shape; in JSON each is ``[real, imaginary]``."""

Number = Annotated[float, _InJson(np.float64, scalar=True)]
"""A number that may be NaN (not known); in JSON null."""

Unbounded = Annotated[float, _InJson(np.float64, scalar=True, null=math.inf)]
"""A number that may be infinite (without a limit); in JSON null."""

ComplexNumber = Annotated[complex, _InJson(np.complex128, scalar=True)]
"""A complex number; in JSON ``[real, imaginary]``."""

Columns = dict[str, Array]
"""Columns (n,) by name with unit, all of one length."""

Mask = Annotated[NDArray[np.bool_], _InJson(np.bool_)]
"""Truth values, of any shape."""


def true_runs(true: NDArray[np.bool_]) -> list[slice]:
    """Slices of the runs of True in a mask (n,)."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], true.astype(int), [0]]))).tolist()
    return [slice(begin, end) for begin, end in zip(edges[::2], edges[1::2], strict=True)]
