"""CasADi functions in plain C99: every operation, in both precisions, and constants that read back."""

from __future__ import annotations

import ctypes
import math
import re

import casadi as ca
import numpy as np
import pytest

from tank2sim.native.library import cached_library
from tank2sim.native.plain_c import c_number, math_functions, operation_counts, plain_c


def every_operation() -> ca.Function:
    a, b, c = ca.vertsplit(ca.SX.sym("x", 3))
    size = ca.fabs(a) + 0.5
    values = [
        *(a + b, a - b, a * b, a / (b * b + 1), -a, a * a, 2 * a, 1 / size, size**b),
        *(ca.sqrt(size), ca.fabs(b), ca.fmin(a, b), ca.fmax(a, b), ca.fmod(a, size), ca.copysign(a, b)),
        *(ca.sin(a), ca.cos(a), ca.tan(a), ca.asin(ca.tanh(a)), ca.acos(ca.tanh(b)), ca.atan(a), ca.atan2(a, b)),
        *(ca.exp(a), ca.log(size), ca.floor(a), ca.ceil(a), ca.sinh(a), ca.cosh(a), ca.tanh(a), ca.log1p(size)),
        *(ca.expm1(a), ca.asinh(a), ca.acosh(size + 1), ca.atanh(ca.tanh(b) / 2), ca.hypot(a, b), ca.sign(a)),
        *(a < b, a <= b, a == b, a != b, ca.logic_not(c), ca.logic_and(a, c), ca.logic_or(a, c)),
        *(ca.if_else(a < b, a * c, b - c), size**2.5, a * 1e-300 * 1e300, a + 5e-8),
    ]
    return ca.Function("f", [ca.vertcat(a, b, c)], [ca.densify(ca.vertcat(*values))], {"cse": True})


def compiled(function: ca.Function, *, single: bool) -> ctypes.CDLL:
    real, end = ("float", "f") if single else ("double", "")
    lines = [f"#define T_{name.upper()} {name}{end}" for name in math_functions([function])]
    literal = "#define T_C(x) x##F" if single else "#define T_C(x) x"
    head = "\n".join(["#include <math.h>", literal, f"typedef {real} t_real;", *lines])
    body = plain_c(function, "t", ["x"], ["y"])
    source = f"{head}\nvoid f(const t_real x[], t_real y[]) {{\n{body}\n}}\n"
    flags = ("-fvisibility=default", "-Wall", "-Wextra", "-Werror", "-Wconversion", "-Wdouble-promotion")
    return ctypes.CDLL(str(cached_library({"f.c": source}, flags=flags if not single else flags[:3])))


POINTS = [(0.7, -1.3, 2.0), (-0.7, -1.3, 0.0), (2.5, 2.5, -1.0), (0.0, 0.4, 0.0), (-3.9, 0.0, 1.0), (1e-9, -0.0, 1.0)]


@pytest.mark.parametrize("single", [False, True])
def test_every_operation_is_that_of_casadi(single: bool) -> None:
    function = every_operation()
    library, real = compiled(function, single=single), np.float32 if single else np.float64
    for point in POINTS:
        x, y = np.array(point, real), np.empty(function.numel_out(0), real)
        library.f(ctypes.c_void_p(x.ctypes.data), ctypes.c_void_p(y.ctypes.data))
        expected = np.array(function(x.astype(float))).ravel()
        exact = np.isclose(y, expected, rtol=2e-5 if single else 4e-16, atol=1e-6 if single else 0.0)
        assert exact.all(), (point, np.flatnonzero(~exact), y[~exact], expected[~exact])


@pytest.mark.parametrize("value", [0.0, -0.0, 1.0, -2.5, 1e-300, 1.7976931348623157e308, 0.1, math.pi, 5e-324])
def test_a_constant_reads_back(value: float) -> None:
    text = c_number(value, "t")
    number = re.fullmatch(r"(-?)T_C\(([\d.e+-]+)\)", text)
    assert number is not None
    again = float(number[1] + number[2])
    assert again == value and math.copysign(1, again) == math.copysign(1, value)
    assert "." in number[2] or "e" in number[2]  # no whole number, which has no suffix F


def test_what_is_no_number_is_a_macro_of_the_library() -> None:
    assert [c_number(value, "t") for value in (math.inf, -math.inf, math.nan)] == ["INFINITY", "-INFINITY", "NAN"]


def test_operations_are_counted_by_kind() -> None:
    a, b = ca.SX.sym("a"), ca.SX.sym("b")
    function = ca.Function("f", [a, b], [a * b + ca.sin(a) - 2 * b / a, ca.sqrt(b) * (a < b)])
    assert operation_counts(function) == {
        **{"multiplications": 3, "additions": 2, "comparisons": 1, "divisions": 1, "sin": 1, "sqrt": 1}
    }


def test_an_operation_without_c_is_refused() -> None:
    a = ca.SX.sym("a")
    with pytest.raises(ValueError, match="has no C"):
        plain_c(ca.Function("f", [a], [ca.erf(a)]), "t", ["x"], ["y"])
