/* Vectors of LANES numbers (V), their masks (M), and the functions of them. Sine, cosine and atan2 are those of fdlibm
   (Sun Microsystems 1993, k_sin.c, k_cos.c, e_rem_pio2.c, s_atan.c: their coefficients and the three parts of pi/2),
   within 1e-15 of the exact ones where the reduction is exact, and the C library's beyond. Sine and cosine in single
   precision are those of Cephes (Moshier 1992, sinf.c), within 1e-7. */
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
/* A call would pass vectors through memory. */
#ifdef __GNUC__
#define INLINE static inline __attribute__((always_inline))
#else
#define INLINE static inline
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
#define EACH(name, call)                                        \
  static inline V lane_##name(V x) {                            \
    V y = x;                                                    \
    for (int i = 0; i < LANES; ++i) LANE(y, i) = call(LANE(x, i)); \
    return y;                                                   \
  }
#define EACH_OF_TWO(name, call)                                 \
  static inline V lane_##name(V a, V b) {                       \
    V y = a;                                                    \
    for (int i = 0; i < LANES; ++i) LANE(y, i) = call(LANE(a, i), LANE(b, i)); \
    return y;                                                   \
  }
EACH(tan, tan) EACH(asin, asin) EACH(acos, acos) EACH(atan, atan) EACH(exp, exp) EACH(log, log) EACH(floor, floor)
EACH(ceil, ceil) EACH(sinh, sinh) EACH(cosh, cosh) EACH(tanh, tanh) EACH(erf, erf) EACH(log1p, log1p)
EACH(expm1, expm1) EACH(asinh, asinh) EACH(acosh, acosh) EACH(atanh, atanh)
EACH_OF_TWO(pow, pow) EACH_OF_TWO(fmod, fmod) EACH_OF_TWO(hypot, hypot)
EACH_OF_TWO(copysign, copysign)
INLINE void lane_sincos(V x, V *sine, V *cosine) {
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
INLINE V lane_atan2(V y, V x) {
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
