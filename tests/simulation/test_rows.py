"""Functions over many rows: machine code, operations in NumPy and CasADi agree."""

import casadi as ca
import numpy as np
import pytest

from tank2sim.cards import read_card
from tank2sim.dynamics import build
from tank2sim.simulation.rows import ArrayFunction, Chain, RowFunction


@pytest.fixture(params=["machine code", "numpy"])
def compiler(request, monkeypatch):
    if request.param == "numpy":
        monkeypatch.setenv("CC", "no-such-compiler")
    return request.param


def function():
    a, b = ca.SX.sym("a", 2), ca.SX.sym("b", 3)
    return ca.Function("two", [a, b], [ca.densify(a @ b.T), ca.vcat([ca.sin(a[0]) * b[2]])])


def test_each_row_has_its_own_arguments_and_matrices_come_by_columns(compiler):
    rng = np.random.default_rng(1)
    a, b = rng.standard_normal((50, 2)), rng.standard_normal((50, 3))
    rows = RowFunction(function())
    assert (rows._rows is None) == (compiler == "numpy")
    outer, sine = rows(a, b)
    expected = np.einsum("ni,nj->nij", a, b)
    np.testing.assert_allclose(outer.reshape(50, 3, 2).transpose(0, 2, 1), expected, rtol=1e-14)
    np.testing.assert_allclose(sine, np.sin(a[:, :1]) * b[:, 2:], rtol=1e-14)


def test_an_argument_without_rows_holds_for_all(compiler):
    rng = np.random.default_rng(2)
    a, b = rng.standard_normal((20, 2)), rng.standard_normal(3)
    held, own = RowFunction(function())(a, b), RowFunction(function())(a, np.tile(b, (20, 1)))
    for one, other in zip(held, own, strict=True):
        np.testing.assert_array_equal(one, other)


def test_columns_of_a_larger_table_are_taken_as_they_stand(compiler):
    table = np.random.default_rng(3).standard_normal((5, 20)).T
    outer, _ = RowFunction(function())(table[:, :2], table[:, 2:])
    np.testing.assert_allclose(outer[:, 0], table[:, 0] * table[:, 2], rtol=1e-14)


def test_a_chain_is_the_recursion(compiler):
    x, u, gain = ca.SX.sym("x", 2), ca.SX.sym("u"), ca.SX.sym("gain")
    step = ca.Function("step", [x, u, gain], [ca.vcat([x[0] + gain * u, 0.5 * x[1] + x[0]])])
    inputs = np.random.default_rng(4).standard_normal((30, 1))
    states = Chain(step).run(np.array([1.0, -2.0]), inputs, np.array([0.3]))
    expected = np.array([1.0, -2.0])
    np.testing.assert_array_equal(states[0], expected)
    for row in range(30):
        expected = np.array([expected[0] + 0.3 * inputs[row, 0], 0.5 * expected[1] + expected[0]])
        np.testing.assert_allclose(states[row + 1], expected, rtol=1e-13)
    assert states.shape == (31, 2)


@pytest.mark.parametrize("name", ["esso-osaka", "kvlcc2-mmg", "otter"])
def test_rates_of_a_ship_are_those_of_casadi_also_far_astern_and_at_rest(name):
    """A card's equations hold switches, powers and angles; rows are more than pass through at once."""
    model = build(read_card(name))
    function = ca.Function("rates", [model.x, model.u, model.p], [ca.densify(model.rates)], {"cse": True})
    rng, p = np.random.default_rng(5), model.parameter_values()
    x = rng.uniform(-2.0, 2.0, (4500, len(model.states)))
    x[:10] = 0.0
    u = model.input_values() * rng.uniform(-1.0, 1.0, (4500, 1))
    (found,) = ArrayFunction(function)(x, u, p)
    expected = np.array([np.array(function(*row, p)).ravel() for row in zip(x[::50], u[::50], strict=True)])
    np.testing.assert_allclose(found[::50], expected, rtol=1e-9, atol=1e-12)
    assert np.isfinite(found).all() == np.isfinite(expected).all()
