"""Lack of fit next to the scatter of repeated tows, at the percentiles of F that tables print."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from tank2sim.apps.rigs.tow.findings import _worst_misfit
from tank2sim.apps.rigs.tow.records import Tows

SCATTER = 0.01


def tows(readings: list[list[float]]) -> Tows:
    """Readings of two tows at 0, 1, 2 ... s; at rest at first."""
    table = np.array([[0.0, 0.0], *readings])
    return Tows(Path("made_up.csv"), ("speed_1_mps", "speed_2_mps"), np.arange(len(table), dtype=float), table)


@pytest.mark.parametrize("sign", [1, -1])
def test_a_misfit_is_distinguished_from_the_95th_percentile_of_f_on_with_one_and_two_degrees_of_freedom(
    sign: int,
) -> None:
    """F(1, 2) is 18.51 at 95 %: two times, one estimate, two tows each."""
    pair = [[1 - SCATTER, 1 + SCATTER], [2 - SCATTER, 2 + SCATTER]]
    limit = SCATTER * math.sqrt(18.51)  # lack is 2 e^2, pure error 4 s^2 over 2 degrees of freedom
    assert _worst_misfit(tows(pair), np.array([0.0, 1.0, 2.0 + 0.99 * sign * limit]), 1) is None
    assert _worst_misfit(tows(pair), np.array([0.0, 1.0, 2.0 + 1.01 * sign * limit]), 1) == 2
    assert _worst_misfit(tows(pair), np.array([0.0, 1.0 + 1.01 * sign * limit, 2.0]), 1) == 1


def test_a_misfit_is_reported_with_a_single_repetition() -> None:
    """F(1, 1) is 161.4 at 95 %."""
    once = [[1 - SCATTER, 1 + SCATTER], [2.0, math.nan]]
    limit = SCATTER * math.sqrt(2 * 161.45)  # lack is e^2, pure error 2 s^2
    assert _worst_misfit(tows(once), np.array([0.0, 1.0, 2.0 + 0.99 * limit]), 1) is None
    assert _worst_misfit(tows(once), np.array([0.0, 1.0, 2.0 + 1.01 * limit]), 1) == 2


def test_no_misfit_is_reported_without_freedom_without_repetition_or_without_scatter() -> None:
    off = np.array([0.0, 1.0, 9.0])
    pair = [[1 - SCATTER, 1 + SCATTER], [2 - SCATTER, 2 + SCATTER]]
    assert _worst_misfit(tows(pair), off, 1) == 2
    assert _worst_misfit(tows(pair), off, 2) is None
    assert _worst_misfit(tows([[1.0, math.nan], [2.0, math.nan]]), off, 1) is None
    assert _worst_misfit(tows([[1.0, 1.0], [2.0, 2.0]]), off, 1) is None
