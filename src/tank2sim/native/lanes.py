"""C code that evaluates a CasADi function for several ships at once, each in a lane of a vector register.

Every operation acts on all lanes by itself and in the order of the function, without fused operations, and sine, cosine
and atan2 are polynomials of this file: a lane has the same bits for any number of lanes, on any processor. Conditions
are masks. Lanes are of double precision, or of single precision (``SINGLE`` defined as 1), twice as many.
"""

from __future__ import annotations

import ctypes
from functools import cache

import casadi as ca

from tank2sim.errors import InputError
from tank2sim.native.compiler import find_compiler
from tank2sim.native.library import cached_library

FLAGS_OF_LANES: dict[int, tuple[str, ...]] = {8: ("-mavx512f", "-mavx512dq"), 4: ("-mavx2",), 2: (), 1: ()}
"""Flags of the compiler for a number of lanes of double precision: AVX-512, AVX2, SSE2 or NEON, plain C."""

# The widest vectors of doubles that processor and operating system offer, asked when run: a cache of libraries may be
# shared by machines.
_WIDEST = """
#if defined(_WIN32)
__declspec(dllexport)
#else
__attribute__((visibility("default")))
#endif
int widest(void) {
#if (defined(__x86_64__) || defined(_M_X64)) && defined(__GNUC__)
  __builtin_cpu_init();
  if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq")) return 8;
  if (__builtin_cpu_supports("avx2")) return 4;
  return 2;
#elif defined(__aarch64__) && defined(__GNUC__)
  return 2;
#else
  return 1;
#endif
}
"""

# Sine, cosine and atan2 are those of fdlibm (Sun Microsystems 1993, k_sin.c, k_cos.c, e_rem_pio2.c, s_atan.c: their
# coefficients and the three parts of pi/2), within 1e-15 of the exact ones where the reduction is exact, and the C
# library's beyond. Sine and cosine in single precision are those of Cephes (Moshier 1992, sinf.c), within 1e-7.
VECTORS = """
#include <math.h>
#include <string.h>
#ifndef SINGLE
#define SINGLE 0
#endif
#if SINGLE
typedef float Real;
typedef int Whole;
#define SIGN_BIT 31
#define ROUNDING 12582912.0f /* 1.5 * 2^23: adding it rounds to an integer, in the lowest bits */
#define EXACT_ANGLE 8192.0 /* beyond it the reduction of an angle is not exact */
#define LARGE_SIDE 1e30
#define SMALL_SIDE 1e-30
#else
typedef double Real;
typedef long long Whole;
#define SIGN_BIT 63
#define ROUNDING 6755399441055744.0 /* 1.5 * 2^52 */
#define EXACT_ANGLE 1e5
#define LARGE_SIDE 1e300
#define SMALL_SIDE 1e-290
#endif
#if LANES > 1
typedef Real V __attribute__((vector_size(sizeof(Real) * LANES), may_alias));
typedef Whole M __attribute__((vector_size(sizeof(Real) * LANES), may_alias));
#if defined(__AVX512F__) || defined(__AVX__) || defined(__SSE2__)
#include <immintrin.h>
#elif defined(__ARM_NEON)
#include <arm_neon.h>
#endif
#define BITS(x) ((M) (x))
#define REALS(m) ((V) (m))
static inline V all(Real x) { V v; for (int i = 0; i < LANES; ++i) v[i] = x; return v; }
static inline V lane_sqrt(V x) {
#if SINGLE && LANES == 16 && defined(__AVX512F__)
  return (V) _mm512_sqrt_ps((__m512) x);
#elif SINGLE && LANES == 8 && defined(__AVX__)
  return (V) _mm256_sqrt_ps((__m256) x);
#elif SINGLE && LANES == 4 && defined(__SSE2__)
  return (V) _mm_sqrt_ps((__m128) x);
#elif SINGLE && LANES == 4 && defined(__ARM_NEON)
  return (V) vsqrtq_f32((float32x4_t) x);
#elif !SINGLE && LANES == 8 && defined(__AVX512F__)
  return (V) _mm512_sqrt_pd((__m512d) x);
#elif !SINGLE && LANES == 4 && defined(__AVX__)
  return (V) _mm256_sqrt_pd((__m256d) x);
#elif !SINGLE && LANES == 2 && defined(__SSE2__)
  return (V) _mm_sqrt_pd((__m128d) x);
#elif !SINGLE && LANES == 2 && defined(__ARM_NEON)
  return (V) vsqrtq_f64((float64x2_t) x);
#else
  V y;
  for (int i = 0; i < LANES; ++i) y[i] = sqrt(x[i]);
  return y;
#endif
}
static inline int some(M m) { Whole any = 0; for (int i = 0; i < LANES; ++i) any |= m[i]; return any != 0; }
#define LANE(x, i) ((x)[i])
#else
typedef Real V;
typedef Whole M;
static inline M BITS(V x) { M m; memcpy(&m, &x, sizeof m); return m; }
static inline V REALS(M m) { V x; memcpy(&x, &m, sizeof x); return x; }
static inline V all(Real x) { return x; }
static inline V lane_sqrt(V x) { return sqrt(x); }
static inline int some(M m) { return m != 0; }
#define LANE(x, i) (*(&(x) + (i)))
#endif
#if LANES > 1
#define LT(a, b) ((M) ((a) < (b)))
#define LE(a, b) ((M) ((a) <= (b)))
#define EQ(a, b) ((M) ((a) == (b)))
#define NE(a, b) ((M) ((a) != (b)))
#else
#define LT(a, b) (-(M) ((a) < (b)))
#define LE(a, b) (-(M) ((a) <= (b)))
#define EQ(a, b) (-(M) ((a) == (b)))
#define NE(a, b) (-(M) ((a) != (b)))
#endif
#define WHERE(m, a, b) REALS(((m) & BITS(a)) | (~(m) & BITS(b)))
#define WHERE0(m, a) REALS((m) & BITS(a))
#define TRUTH(m) WHERE0(m, all(1.0))
#define NOT_ZERO(a) NE(a, all(0.0))
static inline V lane_fabs(V x) { return REALS(BITS(x) & ~BITS(all(-0.0))); }
static inline V lane_fmin(V x, V y) { const M m = LT(x, y) | NE(y, y); return WHERE(m, x, y); }
static inline V lane_fmax(V x, V y) { const M m = LT(y, x) | NE(y, y); return WHERE(m, x, y); }
static inline V lane_sign(V x) {
  const V zero = all(0.0);
  return WHERE(LT(x, zero), all(-1.0), WHERE(LT(zero, x), all(1.0), x));
}
#define EACH(name, call)                                        \\
  static inline V lane_##name(V x) {                            \\
    V y = x;                                                    \\
    for (int i = 0; i < LANES; ++i) LANE(y, i) = call(LANE(x, i)); \\
    return y;                                                   \\
  }
#define EACH_OF_TWO(name, call)                                 \\
  static inline V lane_##name(V a, V b) {                       \\
    V y = a;                                                    \\
    for (int i = 0; i < LANES; ++i) LANE(y, i) = call(LANE(a, i), LANE(b, i)); \\
    return y;                                                   \\
  }
EACH(tan, tan) EACH(asin, asin) EACH(acos, acos) EACH(atan, atan) EACH(exp, exp) EACH(log, log) EACH(floor, floor)
EACH(ceil, ceil) EACH(sinh, sinh) EACH(cosh, cosh) EACH(tanh, tanh) EACH(erf, erf) EACH(log1p, log1p)
EACH(expm1, expm1) EACH(asinh, asinh) EACH(acosh, acosh) EACH(atanh, atanh)
EACH_OF_TWO(pow, pow) EACH_OF_TWO(fmod, fmod) EACH_OF_TWO(hypot, hypot)
EACH_OF_TWO(copysign, copysign)
static inline void lane_sincos(V x, V *sine, V *cosine) {
  const V shifted = x * all(6.36619772367581382433e-01) + all(ROUNDING);
  const V n = shifted - all(ROUNDING);
#if SINGLE
  const V r = ((x - n * all(1.5703125)) - n * all(4.837512969970703125e-4)) - n * all(7.549789948768648e-8);
  const V z = r * r;
  const V s = r + r * z * (all(-1.6666654611e-1) + z * (all(8.3321608736e-3) + z * all(-1.9515295891e-4)));
  const V c = all(1.0) - all(0.5) * z + z * z * (all(4.166664568298827e-2)
      + z * (all(-1.388731625493765e-3) + z * all(2.443315711809948e-5)));
#else
  const V r = ((x - n * all(1.57079632673412561417e+00)) - n * all(6.07710050630396597660e-11))
      - n * all(2.02226624871116645580e-21);
  const V z = r * r;
  const V s = r + (z * r) * (all(-1.66666666666666324348e-01) + z * (all(8.33333333332248946124e-03)
      + z * (all(-1.98412698298579493134e-04) + z * (all(2.75573137070700676789e-06)
      + z * (all(-2.50507602534068634195e-08) + z * all(1.58969099521155010221e-10))))));
  const V p = z * (all(4.16666666666666019037e-02) + z * (all(-1.38888888888741095749e-03)
      + z * (all(2.48015872894767294178e-05) + z * (all(-2.75573143513906633035e-07)
      + z * (all(2.08757232129817482790e-09) + z * all(-1.13596475577881948265e-11))))));
  const V half = all(0.5) * z, w = all(1.0) - half;
  const V c = w + (((all(1.0) - w) - half) + z * p);
#endif
  const M one = BITS(all(0.0)) - (-1), quadrant = BITS(shifted);
  const M odd = -(quadrant & one), low = (quadrant >> 1) & one, up = ((quadrant + one) >> 1) & one;
  *sine = REALS(BITS(WHERE(odd, c, s)) ^ (low << SIGN_BIT));
  *cosine = REALS(BITS(WHERE(odd, s, c)) ^ (up << SIGN_BIT));
  const M far = ~LE(lane_fabs(x), all(EXACT_ANGLE)); /* so for nan */
  if (some(far))
    for (int i = 0; i < LANES; ++i)
      if (!(fabs(LANE(x, i)) <= EXACT_ANGLE)) { LANE(*sine, i) = sin(LANE(x, i)); LANE(*cosine, i) = cos(LANE(x, i)); }
}
/* After s_atan.c: of the smaller over the larger side, reduced by atan(1/2) or atan(1). */
static inline V lane_atan2(V y, V x) {
  const V ay = lane_fabs(y), ax = lane_fabs(x), zero = all(0.0);
  const M steep = LT(ax, ay);
  const V low = WHERE(steep, ax, ay), high = WHERE(steep, ay, ax);
  const M middle = LE(all(0.4375) * high, low), large = LE(all(0.6875) * high, low);
  const V above = WHERE(large, low - high, WHERE(middle, all(2.0) * low - high, low));
  const V below = WHERE(large, low + high, WHERE(middle, all(2.0) * high + low, high));
  const V t = WHERE(EQ(high, zero), zero, above / below);
  const V z = t * t, w = z * z;
  const V odd = z * (all(3.33333333333329318027e-01) + w * (all(1.42857142725034663711e-01)
      + w * (all(9.09088713343650656196e-02) + w * (all(6.66107313738753120669e-02)
      + w * (all(4.97687799461593236017e-02) + w * all(1.62858201153657823623e-02))))));
  const V even = w * (all(-1.99999999998764832476e-01) + w * (all(-1.11111104054623557880e-01)
      + w * (all(-7.69187620504482999495e-02) + w * (all(-5.83357013379057348645e-02)
      + w * all(-3.65315727442169155270e-02)))));
  const M none_equal = NE(high, zero);
  const V first = WHERE0(none_equal, WHERE(large, all(7.85398163397448278999e-01),
      WHERE0(middle, all(4.63647609000806093515e-01))));
  const V last = WHERE0(none_equal, WHERE(large, all(3.06161699786838301793e-17),
      WHERE0(middle, all(2.26987774529616870924e-17))));
  V angle = first - ((t * (odd + even) - last) - t);
  angle = WHERE(steep, all(1.57079632679489655800e+00) - (angle - all(6.12323399573676603587e-17)), angle);
  const M sign = BITS(all(-0.0)), back = -((BITS(x) >> SIGN_BIT) & 1);
  angle = WHERE(back, all(3.14159265358979311600e+00) - (angle - all(1.22464679914735317720e-16)), angle);
  angle = REALS((BITS(angle) & ~sign) | (BITS(y) & sign));
  const M far = ~(LE(ay, all(LARGE_SIDE)) & LE(ax, all(LARGE_SIDE))) | (LT(high, all(SMALL_SIDE)) & none_equal);
  if (some(far))
    for (int i = 0; i < LANES; ++i) if (LANE(far, i)) LANE(angle, i) = atan2(LANE(y, i), LANE(x, i));
  return angle;
}
"""
"""C of vectors of LANES numbers (``V``), their masks (``M``), and the functions of them."""

_OF_TWO = {ca.OP_ADD: "+", ca.OP_SUB: "-", ca.OP_MUL: "*", ca.OP_DIV: "/"}
_COMPARISONS = {ca.OP_LT: "LT", ca.OP_LE: "LE", ca.OP_EQ: "EQ", ca.OP_NE: "NE"}
_NAMED = {
    ca.OP_SQRT: "sqrt",
    ca.OP_FABS: "fabs",
    ca.OP_SIGN: "sign",
    ca.OP_FMIN: "fmin",
    ca.OP_FMAX: "fmax",
    ca.OP_TAN: "tan",
    ca.OP_ASIN: "asin",
    ca.OP_ACOS: "acos",
    ca.OP_ATAN: "atan",
    ca.OP_EXP: "exp",
    ca.OP_LOG: "log",
    ca.OP_FLOOR: "floor",
    ca.OP_CEIL: "ceil",
    ca.OP_SINH: "sinh",
    ca.OP_COSH: "cosh",
    ca.OP_TANH: "tanh",
    ca.OP_ERF: "erf",
    ca.OP_LOG1P: "log1p",
    ca.OP_EXPM1: "expm1",
    ca.OP_ASINH: "asinh",
    ca.OP_ACOSH: "acosh",
    ca.OP_ATANH: "atanh",
    ca.OP_POW: "pow",
    ca.OP_CONSTPOW: "pow",
    ca.OP_ATAN2: "atan2",
    ca.OP_FMOD: "fmod",
    ca.OP_HYPOT: "hypot",
    ca.OP_COPYSIGN: "copysign",
}


class NoLanesError(Exception):
    """A function has an operation that cannot be evaluated in lanes."""


@cache
def widest_lanes() -> int:
    """Number of doubles in a vector register of this machine; 1 without vectors, 0 without a C compiler."""
    if find_compiler() is None:
        return 0
    try:
        library = ctypes.CDLL(str(cached_library({"widest.c": _WIDEST})))
    except (InputError, OSError):
        return 0
    except RuntimeError:  # a compiler that has no words for what a processor has
        return 1
    return int(library.widest())


def lane_function(function: ca.Function, name: str) -> str:
    """C of ``static void name(const V *const *arg, V *const *res)``, a function of scalar operations in lanes.

    Arguments and results are dense vectors of lanes, in the function's order. It needs :data:`VECTORS` before it.

    Raises
    ------
    NoLanesError
        An operation cannot be evaluated in lanes.
    """
    return _Lanes(function).code(name)


class _Lanes:
    """The instructions of a function, each a C variable that is assigned once."""

    def __init__(self, function: ca.Function):
        self.function = function
        self.lines: list[str] = []
        self.at: dict[int, str] = {}  # place in CasADi's work vector, to the variable that it holds now
        self.masks: set[str] = set()
        self.circular: dict[str, tuple[str, str]] = {}  # an angle's sine and cosine

    def code(self, name: str) -> str:
        for function in (self.function,):
            if not function.is_a("SXFunction"):
                raise NoLanesError(f"{function.name()} is not of scalar operations")
        for k in range(self.function.n_instructions()):
            self._add(k)
        body = "\n".join(f"  {line}" for line in self.lines)
        return f"static void {name}(const V *const *arg, V *const *res) {{\n{body}\n}}\n"

    def _add(self, k: int) -> None:
        f = self.function
        operation, to = f.instruction_id(k), f.instruction_output(k)
        if operation == ca.OP_OUTPUT:
            source = self._real(self.at[f.instruction_input(k)[0]])
            self.lines.append(f"res[{to[0]}][{to[1]}] = {source};")
            return
        variable = f"a{k}"
        if operation == ca.OP_INPUT:
            place = f.instruction_input(k)
            self._set(to[0], variable, f"arg[{place[0]}][{place[1]}]")
            return
        if operation == ca.OP_CONST:
            self._set(to[0], variable, f"all({f.instruction_constant(k)!r})")
            return
        sources = [self.at[place] for place in f.instruction_input(k)]
        text, mask = self._operation(operation, sources, k)
        self._set(to[0], variable, text, mask=mask)

    def _set(self, place: int, variable: str, text: str, *, mask: bool = False) -> None:
        self.lines.append(f"const {'M' if mask else 'V'} {variable} = {text};")
        self.at[place] = variable
        if mask:
            self.masks.add(variable)

    def _real(self, variable: str) -> str:
        return f"TRUTH({variable})" if variable in self.masks else variable

    def _mask(self, variable: str) -> str:
        return variable if variable in self.masks else f"NOT_ZERO({variable})"

    def _operation(self, operation: int, sources: list[str], k: int) -> tuple[str, bool]:
        """The expression of an operation, and whether it is a mask."""
        if operation in (ca.OP_AND, ca.OP_OR):
            sign = "&" if operation == ca.OP_AND else "|"
            return f"{self._mask(sources[0])} {sign} {self._mask(sources[1])}", True
        if operation == ca.OP_NOT:
            return f"~{self._mask(sources[0])}", True
        if operation == ca.OP_IF_ELSE_ZERO:
            return f"WHERE0({self._mask(sources[0])}, {self._real(sources[1])})", False
        real = [self._real(source) for source in sources]
        if operation in _COMPARISONS:
            return f"{_COMPARISONS[operation]}({real[0]}, {real[1]})", True
        if operation in _OF_TWO:
            return f"{real[0]} {_OF_TWO[operation]} {real[1]}", False
        if operation in (ca.OP_SIN, ca.OP_COS):
            return self._sine_or_cosine(real[0], k)[operation == ca.OP_COS], False
        simple = {
            ca.OP_ASSIGN: "{0}",
            ca.OP_NEG: "-{0}",
            ca.OP_SQ: "{0} * {0}",
            ca.OP_TWICE: "all(2.0) * {0}",
            ca.OP_INV: "all(1.0) / {0}",
        }
        if operation in simple:
            return simple[operation].format(*real), False
        if operation in _NAMED:
            return f"lane_{_NAMED[operation]}({', '.join(real)})", False
        raise NoLanesError(f"operation {operation} of {self.function.name()}")

    def _sine_or_cosine(self, angle: str, k: int) -> tuple[str, str]:
        if angle not in self.circular:
            self.lines.append(f"V s{k}, c{k}; lane_sincos({angle}, &s{k}, &c{k});")
            self.circular[angle] = f"s{k}", f"c{k}"
        return self.circular[angle]
