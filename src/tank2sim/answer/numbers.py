"""How a reader is shown numbers: significant digits, one number of decimals down a column, a true minus sign."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from numbers import Integral, Real
from typing import TypeGuard

NO_VALUE = "–"
"""Shown for what is missing or no number."""

_SUPERSCRIPT = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
_THIN_SPACE = "\u202f"
_SMALL, _LARGE = 1e-3, 1e7


def is_number_text(value: object) -> TypeGuard[float]:
    """True for integers and floats (numpy's too), not for truth values."""
    return isinstance(value, Real) and not isinstance(value, bool)


def format_number(value: float, digits: int = 4) -> str:
    """One number with `digits` significant digits, without zeros that say nothing: ``1 234``, ``0.25``, ``3.1×10⁻⁹``.

    Integers keep all their digits. NaN is shown as a dash.
    """
    if isinstance(value, Integral):
        return _grouped(f"{value:d}")
    value = float(value)
    if not math.isfinite(value):
        return NO_VALUE if math.isnan(value) else _signed("∞" if value > 0 else "-∞")
    if value != 0 and not _SMALL <= abs(value) < _LARGE:
        return _scientific(value, digits)
    decimals = _decimals(abs(value), digits)
    return _grouped(f"{value:.{_needed([value], decimals)}f}")


def without_exponents(text: str) -> str:
    """Text whose numbers with an exponent are as :func:`format_number` shows them.

    Examples
    --------
    >>> without_exponents("off by 5e-06 m/s")
    'off by 5×10⁻⁶ m/s'
    """
    return re.sub(r"-?\b\d+(\.\d+)?e[+-]\d+\b", lambda number: format_number(float(number[0]), 6), text)


def format_column(values: Sequence[float], digits: int = 4) -> list[str]:
    """Numbers of one column, with one number of decimals so that their points are aligned.

    The largest gets `digits` significant digits. A column whose numbers are too far apart for that (some would be
    shown as 0), or too large or small, shows each number for itself as :func:`format_number` does.
    """
    finite = list(map(float, filter(math.isfinite, values)))
    sizes = sorted(filter(None, map(abs, finite))) or [0.0]
    decimals = _decimals(sizes[-1], digits)
    apart = not _SMALL <= sizes[-1] < _LARGE or sizes[0] < 10.0**-decimals
    if apart or all(isinstance(value, Integral) for value in values):
        return [format_number(value, digits) for value in values]
    needed = _needed(finite, decimals)
    return [
        _grouped(f"{float(value):.{needed}f}") if math.isfinite(value) else format_number(value) for value in values
    ]


def _decimals(size: float, digits: int) -> int:
    return max(0, digits - 1 - (math.floor(math.log10(size)) if size > 0 else 0))


def _needed(values: Sequence[float], decimals: int) -> int:
    texts = [f"{value:.{decimals}f}".partition(".")[2].rstrip("0") for value in values]
    return max(len(text) for text in texts)


def _scientific(value: float, digits: int) -> str:
    mantissa, _, exponent = f"{value:.{digits - 1}e}".partition("e")
    shown = mantissa.rstrip("0").rstrip(".") if "." in mantissa else mantissa
    return _signed(f"{shown}×10{str(int(exponent)).translate(_SUPERSCRIPT)}")


def _grouped(text: str) -> str:
    if not text.strip("-0."):
        text = text.lstrip("-")  # -0.00 is 0.00
    whole, point, decimals = text.partition(".")
    if len(whole.lstrip("-")) > 4:
        whole = f"{int(whole):,}".replace(",", _THIN_SPACE)
    return _signed(f"{whole}{point}{decimals}")


def _signed(text: str) -> str:
    return text.replace("-", "−", 1) if text.startswith("-") else text
