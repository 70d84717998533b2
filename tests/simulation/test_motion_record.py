"""Means of inputs between any two times, against a fine sum of the held or straight course."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tank2sim.simulation.motion_record import means_of_held, means_of_lines

_SPANS = st.lists(st.floats(0.05, 3.0), min_size=2, max_size=12)


@settings(max_examples=30, deadline=None)
@given(_SPANS, _SPANS, st.floats(-4.0, 4.0), st.integers(0, 2**31), st.booleans())
def test_means_between_uneven_times_are_those_of_the_course(
    rows: list[float], spans: list[float], begin: float, seed: int, held: bool
) -> None:
    time, edges = np.cumsum([0.0, *rows]), np.cumsum([begin, *spans])
    values = np.random.default_rng(seed).uniform(-1, 1, len(time))
    found = (means_of_held if held else means_of_lines)(time, values, edges)
    for before, after, mean in zip(edges[:-1], edges[1:], found, strict=True):
        middles = before + (after - before) * (np.arange(4000) + 0.5) / 4000
        if held:
            course = values[np.clip(np.searchsorted(time, middles, side="right") - 1, 0, None)]
        else:
            course = np.interp(middles, time, values)
        assert mean == pytest.approx(course.mean(), abs=2e-3)
