"""Condition numbers and correlations."""

import numpy as np
import pytest

from tank2sim.identification.conditioning import correlation_matrix, scaled_condition


def test_scaled_condition_does_not_know_units():
    design = np.array([[1.0, 1.0], [1.0, -1.0], [1.0, 0.0]])
    assert scaled_condition(design) == pytest.approx(1.0)
    assert scaled_condition(design * [1e6, 1e-3]) == pytest.approx(1.0)


def test_scaled_condition_of_two_columns_follows_their_angle():
    angle = 0.1
    design = np.array([[1.0, np.cos(angle)], [0.0, np.sin(angle)]])
    # singular values of two unit columns: sqrt(1 +- cos)
    assert scaled_condition(design * [3.0, 50.0]) == pytest.approx(1 / np.tan(angle / 2))


def test_fewer_rows_than_unknowns_determine_nothing():
    assert scaled_condition(np.array([[1.0, 0.0, 0.5], [0.0, 1.0, 0.5]])) == np.inf


def test_correlation_has_ones_on_its_diagonal():
    covariance = np.array([[4.0, -3.0], [-3.0, 9.0]])
    np.testing.assert_allclose(correlation_matrix(covariance), [[1, -0.5], [-0.5, 1]])


def test_an_unknown_without_variance_is_not_correlated():
    np.testing.assert_array_equal(correlation_matrix(np.array([[4.0, 0.0], [0.0, 0.0]])), np.eye(2))
