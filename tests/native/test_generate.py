"""Generated C gives the numbers of the CasADi functions it comes from."""

from __future__ import annotations

import ctypes
import sys
from pathlib import Path

import casadi as ca
import pytest

from tank2sim.native.compiler import SHARED_SUFFIX, compile_shared
from tank2sim.native.generate import generate_c, work_sizes

_CALL = """
__attribute__((visibility("default"))) int call(const double *x, const double *p, double *y) {
    double between[2], w[%d];
    long long int iw[%d];
    const double *first[] = {x, p}, *second[] = {between};
    double *halfway[] = {between}, *results[] = {y};
    return one(first, halfway, iw, w, 0) + another(second, results, iw, w, 0);
}
"""


@pytest.mark.skipif(sys.platform == "win32", reason="exports a function in the manner of gcc and clang")
def test_generated_code_computes_what_the_functions_do(tmp_path: Path) -> None:
    x, p = ca.SX.sym("x", 2), ca.SX.sym("p")
    one = ca.Function("one", [x, p], [ca.vertcat(ca.sin(x[0]) * p, ca.atan2(x[1], x[0]) - p)])
    another = ca.Function("another", [x], [ca.vertcat(ca.fmax(x[0], x[1]), x[0] ** 3)])
    sizes = work_sizes([one, another])
    source, library = tmp_path / "both.c", tmp_path / f"both{SHARED_SUFFIX}"
    source.write_text(generate_c([one, another], "both") + _CALL % (sizes.reals + 1, sizes.integers + 1))
    compile_shared([source], library)
    loaded = ctypes.CDLL(str(library))
    result = (ctypes.c_double * 2)()
    assert loaded.call((ctypes.c_double * 2)(0.3, -0.8), (ctypes.c_double * 1)(1.7), result) == 0
    expected = another(one([0.3, -0.8], 1.7))
    assert list(result) == [float(expected[0]), float(expected[1])]
    assert not hasattr(loaded, "one")
