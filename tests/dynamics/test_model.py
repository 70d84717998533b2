from __future__ import annotations

import casadi as ca
import numpy as np
import pytest

from tank2sim.dynamics.model import TRIM_STRIDE, Input, Model, Parameter, Quantity, State, Variable


def decay(*more: Variable, outputs: tuple[str, ...] = ("decay.v",)) -> Model:
    """dv/dt = F - k v, with k = 2 a."""
    a = Parameter(name="decay.a", unit="1", description="half the rate", start=1.5)
    k = Quantity(name="decay.k", unit="1", description="rate", value=2 * a.symbol)
    force = Input(name="decay.F", unit="N", description="force")
    v = State(name="decay.v", unit="m/s", description="speed", derivative="decay.vdot", start=a.symbol, steady=True)
    rate = Quantity(name="decay.vdot", unit="m/s2", description="", value=force.symbol - k.symbol * v.symbol)
    empty = Model("decay", "", (), (), (), (), (), step_s=0.1)
    # the rate stands before the quantity it uses: order is the model's business
    return empty.extend(force, v, rate, k, a, *more, outputs=outputs)


def test_quantities_are_replaced_by_their_definitions_in_any_order() -> None:
    model = decay()
    assert float(model.rhs([2.0], [5.0], [1.5])) == pytest.approx(5 - 3 * 2)
    assert float(model.initial([1.5])) == 1.5


def test_a_redefined_quantity_reaches_everything_that_uses_it() -> None:
    model = decay().redefine("decay.k", lambda k: k + 1)
    assert float(model.rhs([2.0], [5.0], [1.5])) == pytest.approx(5 - 4 * 2)
    assert float(decay().rhs([2.0], [5.0], [1.5])) == pytest.approx(-1)


def test_trim_finds_the_steady_state() -> None:
    model = decay()
    x = np.array([9.0])
    strides = []
    for _ in range(60):
        strides.append(x - np.array(model.trim_step(x, [5.0], [1.5])).ravel())
        x = x - strides[-1]
    assert np.max(np.abs(strides)) <= TRIM_STRIDE * (1 + 1e-12)  # its nominal size is 1
    assert float(model.rhs(x, [5.0], [1.5])) == pytest.approx(0, abs=1e-14)


def test_faults_in_a_model_are_refused() -> None:
    with pytest.raises(ValueError, match="doubled"):
        decay(Parameter(name="decay.v", unit="1", description="", start=0.0))
    with pytest.raises(ValueError, match="unknown unit"):
        decay(Parameter(name="decay.w", unit="furlong", description="", start=0.0))
    with pytest.raises(ValueError, match="not a state or quantity"):
        decay(outputs=("decay.speed",))
    with pytest.raises(ValueError, match="not variables of the model"):
        decay(Quantity(name="decay.q", unit="1", description="", value=ca.SX.sym("stranger")))
    one = Quantity(name="decay.one", unit="1", description="", value=ca.SX(0))
    two = Quantity(name="decay.two", unit="1", description="", value=one.symbol)
    with pytest.raises(ValueError, match="circle"):
        decay(one, two).redefine("decay.one", lambda _: two.symbol)


def test_unknown_names_in_changed_values_are_refused() -> None:
    with pytest.raises(KeyError, match=r"decay\.z"):
        decay().parameter_values({"decay.z": 1.0})


def test_constants_in_place_of_parameters_change_no_rate(mariner: Model) -> None:
    names = [name for name in mariner.parameter_names if name.startswith("derivatives.")]
    fixed = mariner.with_constants(names)
    assert set(mariner.parameter_names) - set(fixed.parameter_names) == set(names)
    x, u = np.array([0.0, 0.0, 0.2, 7.0, 0.3, 0.01, 0.1]), mariner.input_values()
    rates = [np.array(model.rhs(x, u, model.parameter_values())).ravel() for model in (mariner, fixed)]
    np.testing.assert_allclose(rates[1], rates[0], rtol=1e-13)
    assert np.abs(rates[0]).min() > 0 and mariner.with_constants([]) is mariner
