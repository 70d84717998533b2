"""Influence coefficients of Poznyakov and Yudin: K % by a difference of 10 %, and agreed variations.

K = 100 (F(1.1 c)/F(c) - 1) is the change of a figure F in per cent when one coefficient c grows by 10 %. An agreed
variation is a change of all coefficients together, by Kc per cent each, for example with the draught; to first order it
changes the figure by the sum of Kc K / 10 per cent.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping

STEP_PERCENT = 10.0
"""Step of the paper, per cent of the coefficient."""


def difference_percent(
    figure: Callable[[Mapping[str, float]], float], values: Mapping[str, float], step_percent: float = STEP_PERCENT
) -> dict[str, float]:
    """K % of each coefficient by a difference: 100 (F((1 + step) c)/F(c) - 1).

    Parameters
    ----------
    figure : callable
        ``figure(values) -> float``; nan where the figure does not exist.
    values : mapping
        Coefficients by name.
    step_percent : float
        Step, per cent of each coefficient; 10 in the paper.

    Returns
    -------
    dict
        K by name, per cent of the figure; nan where the figure is zero or does not exist.
    """
    base = figure(values)
    factor = 1 + step_percent / 100
    return {name: change_percent(figure({**values, name: factor * value}), base) for name, value in values.items()}


def change_percent(value: float, base: float) -> float:
    """Change from `base` to `value` in per cent of `base`; nan if that is zero or unknown."""
    return 100 * (value / base - 1) if base else math.nan


def combined_percent(influence: Mapping[str, float], agreed: Mapping[str, float]) -> float:
    """Change of a figure in per cent that an agreed variation predicts: sum of Kc K / 10.

    Parameters
    ----------
    influence : mapping
        K % by name, for 10 % of each coefficient.
    agreed : mapping
        Kc % by name: change of each coefficient; absent coefficients do not change.

    Raises
    ------
    KeyError
        A coefficient of `agreed` has no K.
    """
    return sum(percent * influence[name] for name, percent in agreed.items()) / STEP_PERCENT


def changed_together(values: Mapping[str, float], agreed: Mapping[str, float]) -> dict[str, float]:
    """Coefficients after an agreed variation (Kc %, by names): c (1 + Kc/100)."""
    return {name: value * (1 + agreed.get(name, 0.0) / 100) for name, value in values.items()}
