import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from tank2sim.records.thinning import thin_line, thin_points

VALUES = arrays(float, st.integers(1, 3000), elements=st.floats(-1e6, 1e6))


@given(VALUES, st.integers(4, 300))
def test_a_thinned_line_keeps_its_extremes_and_ends_and_is_no_longer_than_allowed(values, limit):
    kept = thin_line([values], limit)
    assert values[kept].min() == values.min()
    assert values[kept].max() == values.max()
    assert kept[0] == 0
    assert kept[-1] == len(values) - 1
    assert np.all(np.diff(kept) > 0)
    assert len(kept) <= limit + 2


def test_a_peak_of_one_sample_survives_in_each_part_of_a_line():
    values = np.zeros(6000)
    peaks = [17, 2345, 5990]
    values[peaks] = [1.0, -2.0, 0.5]
    assert set(peaks) <= set(thin_line([values], 600).tolist())


def test_a_track_keeps_the_extremes_of_both_coordinates():
    angle = np.linspace(0, 20, 6000)
    x, y = 300 * np.sin(angle), 500 * np.cos(angle)
    kept = thin_line([x, y], 600)
    assert (x[kept].max(), x[kept].min(), y[kept].max(), y[kept].min()) == (x.max(), x.min(), y.max(), y.min())
    assert len(kept) <= 602


def test_the_thinned_track_lies_on_the_track_within_a_pixel():
    angle = np.linspace(0, 20, 6000)
    x, y = 300 * np.sin(angle), 300 * np.cos(angle)
    kept = thin_line([x, y], 600)
    # The chord of an arc lies r (1 - cos(arc / 2)) inside the circle.
    largest_arc = np.diff(angle[kept]).max()
    assert 300 * (1 - np.cos(largest_arc / 2)) < 600 / 700


def test_a_gap_in_a_line_stays_a_gap():
    values = np.sin(np.linspace(0, 50, 6000))
    values[3000:3010] = np.nan
    assert np.isnan(values[thin_line([values], 200)]).any()


def test_a_short_line_keeps_every_sample():
    assert thin_line([np.arange(10.0)], 10).tolist() == list(range(10))


@given(VALUES, st.integers(2, 100))
def test_thinned_points_are_spread_and_keep_the_extremes(values, limit):
    kept = thin_points([values], limit)
    assert values[kept].min() == values.min()
    assert values[kept].max() == values.max()
    assert len(kept) <= limit + 2
    if len(values) > limit:
        assert np.diff(kept).max() <= np.ceil((len(values) - 1) / (limit - 1))


def test_points_of_nothing_but_gaps_can_be_thinned():
    assert len(thin_points([np.full(500, np.nan)], 100)) == 100
