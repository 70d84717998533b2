/* The loops of the filter over time: forward for covariances and for columns, backward for slopes.

   The equations are in kalman_filter.py; arrays, arguments and results in kalman_kernels.py. States are ordered as
   there: 6 errors of the motion, 3 accelerations, NY sensor errors, and with WAVES 3 accelerations of a narrow band, each
   with its quadrature. A row of `known` that is 0 has zeros for its row of the reading matrix H. Matrices are dense and
   by rows; columns lie next to each other, so that each innermost loop runs over them. NY and WAVES (0 or 1) are
   defined when this is compiled. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#ifdef _WIN32
#define EXPORT __declspec(dllexport)
#else
#define EXPORT __attribute__((visibility("default")))
#endif

enum { MOTION = 6, FORCES = 3, SHORT = MOTION + FORCES, SLOW = FORCES + NY, BAND = 2 * FORCES * WAVES };
enum { BAND_AT = MOTION + SLOW, NZ = BAND_AT + BAND, PUSHED = FORCES + BAND };

/* What a step is made of: transition, spreading, push (MOTION rows each), and the share of each slow process that
   remains, followed with WAVES by real and imaginary part of that of the band. */
typedef struct {
  const double *phi, *spreading, *push, *fading;
} Step;

/* target += factor * source, over the columns. */
static inline void add(double *restrict target, double factor, const double *restrict source, int count) {
  for (int c = 0; c < count; ++c) target[c] += factor * source[c];
}

static inline double dot(const double *restrict a, const double *restrict b, int count) {
  double total = 0.0;
  for (int c = 0; c < count; ++c) total += a[c] * b[c];
  return total;
}

/* F z, the whole transition F being (phi, push, 0; 0, fading). */
static void advance(double *restrict moved, const double *restrict z, Step step, int count) {
  memset(moved, 0, sizeof(double) * MOTION * count);
  for (int i = 0; i < MOTION; ++i) {
    for (int j = 0; j < MOTION; ++j)
      if (step.phi[i * MOTION + j] != 0.0) add(moved + i * count, step.phi[i * MOTION + j], z + j * count, count);
    for (int j = 0; j < FORCES; ++j) add(moved + i * count, step.push[i * PUSHED + j], z + (MOTION + j) * count, count);
    for (int j = 0; j < BAND; ++j)
      add(moved + i * count, step.push[i * PUSHED + FORCES + j], z + (BAND_AT + j) * count, count);
  }
  for (int i = MOTION; i < BAND_AT; ++i)
    for (int c = 0; c < count; ++c) moved[i * count + c] = step.fading[i - MOTION] * z[i * count + c];
  for (int i = BAND_AT; i < NZ; i += 2)
    for (int c = 0; c < count; ++c) {
      const double value = z[i * count + c], quadrature = z[(i + 1) * count + c];
      moved[i * count + c] = step.fading[SLOW] * value - step.fading[SLOW + 1] * quadrature;
      moved[(i + 1) * count + c] = step.fading[SLOW + 1] * value + step.fading[SLOW] * quadrature;
    }
}

/* F' r. */
static void carry_back(double *restrict earlier, const double *restrict r, Step step, int count) {
  memset(earlier, 0, sizeof(double) * SHORT * count);
  for (int i = MOTION; i < BAND_AT; ++i)
    for (int c = 0; c < count; ++c) earlier[i * count + c] = step.fading[i - MOTION] * r[i * count + c];
  for (int i = BAND_AT; i < NZ; i += 2)
    for (int c = 0; c < count; ++c) {
      const double value = r[i * count + c], quadrature = r[(i + 1) * count + c];
      earlier[i * count + c] = step.fading[SLOW] * value + step.fading[SLOW + 1] * quadrature;
      earlier[(i + 1) * count + c] = step.fading[SLOW] * quadrature - step.fading[SLOW + 1] * value;
    }
  for (int i = 0; i < MOTION; ++i) {
    for (int j = 0; j < MOTION; ++j)
      if (step.phi[i * MOTION + j] != 0.0) add(earlier + j * count, step.phi[i * MOTION + j], r + i * count, count);
    for (int j = 0; j < FORCES; ++j)
      add(earlier + (MOTION + j) * count, step.push[i * PUSHED + j], r + i * count, count);
    for (int j = 0; j < BAND; ++j)
      add(earlier + (BAND_AT + j) * count, step.push[i * PUSHED + FORCES + j], r + i * count, count);
  }
}

static void transpose(double *restrict to, const double *restrict from) {
  for (int i = 0; i < NZ; ++i)
    for (int j = 0; j < NZ; ++j) to[j * NZ + i] = from[i * NZ + j];
}

/* Inverse of the lower Cholesky factor of S; nan if S is not positive definite. */
static void inverse_root(double *restrict W, const double *restrict S) {
  double L[NY * NY] = {0};
  memset(W, 0, sizeof(double) * NY * NY);
  for (int i = 0; i < NY; ++i)
    for (int j = 0; j <= i; ++j) {
      double total = S[i * NY + j];
      for (int c = 0; c < j; ++c) total -= L[i * NY + c] * L[j * NY + c];
      if (i > j) {
        L[i * NY + j] = total / L[j * NY + j];
      } else if (total > 0.0) {
        L[i * NY + i] = sqrt(total);
      } else {
        for (int c = 0; c < NY * NY; ++c) W[c] = NAN;
        return;
      }
    }
  for (int i = 0; i < NY; ++i) {
    W[i * NY + i] = 1.0 / L[i * NY + i];
    for (int j = 0; j < i; ++j) {
      double total = 0.0;
      for (int c = j; c < i; ++c) total -= L[i * NY + c] * W[c * NY + j];
      W[i * NY + j] = total / L[i * NY + i];
    }
  }
}

EXPORT void covariances(long runs, long blocks, const double *start, const double *transition, const double *push,
                        const double *fading, const double *added, const double *reading, const unsigned char *known,
                        const double *white_noise, double *gain, double *white, double *filtered) {
  for (long run = 0; run < runs; ++run) {
    double P[NZ * NZ] = {0}, FP[NZ * NZ], turned[NZ * NZ];
    for (int a = 0; a < NZ; ++a) P[a * NZ + a] = start[a];
    for (long k = 0; k < blocks; ++k) {
      const long at = run * blocks + k;
      const double *H = reading + at * NY * MOTION;
      const unsigned char *seen = known + at * NY;
      double *W = white + at * NY * NY, *K = gain + at * NZ * NY;
      double HP[NY * NZ] = {0}, S[NY * NY] = {0}, G[NY * NZ]; /* H P, and W H P */
      for (int i = 0; i < NY; ++i) {
        if (seen[i]) {
          memcpy(HP + i * NZ, P + (SHORT + i) * NZ, sizeof(double) * NZ); /* P is symmetric */
          for (int j = 0; j < MOTION; ++j)
            if (H[i * MOTION + j] != 0.0) add(HP + i * NZ, H[i * MOTION + j], P + j * NZ, NZ);
        }
      }
      for (int i = 0; i < NY; ++i) {
        if (seen[i]) {
          for (int j = 0; j < NY; ++j) {
            S[i * NY + j] = HP[j * NZ + SHORT + i];
            for (int a = 0; a < MOTION; ++a) S[i * NY + j] += H[i * MOTION + a] * HP[j * NZ + a];
          }
          S[i * NY + i] += white_noise[run * NY + i];
        } else {
          S[i * NY + i] = 1.0;
        }
      }
      inverse_root(W, S);
      memset(G, 0, sizeof G);
      for (int i = 0; i < NY; ++i)
        for (int j = 0; j <= i; ++j) add(G + i * NZ, W[i * NY + j], HP + j * NZ, NZ);
      for (int i = 0; i < NY; ++i)
        for (int a = 0; a < NZ; ++a) add(P + a * NZ, -G[i * NZ + a], G + i * NZ, NZ);
      for (int a = 0; a < NZ; ++a)
        for (int j = 0; j < NY; ++j) {
          double total = 0.0;
          for (int i = j; i < NY; ++i) total += G[i * NZ + a] * W[i * NY + j];
          K[a * NY + j] = total;
        }
      memcpy(filtered + at * NZ * NZ, P, sizeof P);
      if (k + 1 < blocks) {
        const long step_at = run * (blocks - 1) + k;
        const Step step = {transition + step_at * MOTION * MOTION, NULL, push + step_at * MOTION * PUSHED, fading};
        const double *Q = added + step_at * NZ * NZ;
        advance(FP, P, step, NZ);
        transpose(turned, FP);
        advance(P, turned, step, NZ);
        for (int a = 0; a < NZ; ++a)
          for (int b = 0; b <= a; ++b)
            P[a * NZ + b] = P[b * NZ + a] =
                0.5 * (P[a * NZ + b] + P[b * NZ + a] + Q[a * NZ + b] + Q[b * NZ + a]);
      }
    }
  }
}

/* Of `count` columns the first `seen_count` have readings in `shown`; those of the others are zero. */
EXPORT int run_filter(long runs, long blocks, int count, int seen_count, const double *reading,
                      const unsigned char *known, const double *transition, const double *spreading,
                      const double *push, const double *fading, const double *gain, const double *white,
                      const double *driving, const double *shown, int keep, double *whitened, double *after) {
  double *work = malloc(sizeof(double) * count * (2 * NZ + NY));
  if (!work) return 1;
  double *z = work, *moved = work + NZ * count, *e = work + 2 * NZ * count;
  for (long run = 0; run < runs; ++run) {
    memset(z, 0, sizeof(double) * NZ * count);
    for (long k = 0; k < blocks; ++k) {
      const long at = run * blocks + k;
      const double *H = reading + at * NY * MOTION, *K = gain + at * NZ * NY, *W = white + at * NY * NY;
      double *innovations = whitened + at * NY * count;
      memset(innovations, 0, sizeof(double) * NY * count);
      for (int i = 0; i < NY; ++i) {
        double *row = e + i * count;
        if (!known[at * NY + i]) {
          memset(row, 0, sizeof(double) * count);
          continue;
        }
        for (int c = 0; c < count; ++c) row[c] = -z[(SHORT + i) * count + c];
        add(row, 1.0, shown + (at * NY + i) * seen_count, seen_count);
        for (int j = 0; j < MOTION; ++j)
          if (H[i * MOTION + j] != 0.0) add(row, -H[i * MOTION + j], z + j * count, count);
      }
      for (int i = 0; i < NY; ++i) {
        for (int a = 0; a < NZ; ++a) add(z + a * count, K[a * NY + i], e + i * count, count);
        for (int j = 0; j <= i; ++j) add(innovations + i * count, W[i * NY + j], e + j * count, count);
      }
      if (keep) memcpy(after + at * NZ * count, z, sizeof(double) * NZ * count);
      if (k + 1 < blocks) {
        const long step_at = run * (blocks - 1) + k;
        const double *spread = spreading + step_at * MOTION * MOTION, *d = driving + step_at * MOTION * count;
        const Step step = {transition + step_at * MOTION * MOTION, spread, push + step_at * MOTION * PUSHED, fading};
        advance(moved, z, step, count);
        for (int i = 0; i < MOTION; ++i)
          for (int j = 0; j < MOTION; ++j)
            if (spread[i * MOTION + j] != 0.0) add(moved + i * count, spread[i * MOTION + j], d + j * count, count);
        double *swapped = z;
        z = moved;
        moved = swapped;
      }
    }
  }
  free(work);
  return 0;
}

/* u = W' e - K' later, and later + H' u in its place: r, what later measurements say of the state before this one. */
static void measure_back(double *restrict u, double *restrict later, const double *restrict e, const double *K,
                         const double *W, const double *H, const unsigned char *seen, int count) {
  memset(u, 0, sizeof(double) * NY * count);
  for (int i = 0; i < NY; ++i) {
    for (int j = i; j < NY; ++j) add(u + i * count, W[j * NY + i], e + j * count, count);
    for (int a = 0; a < NZ; ++a) add(u + i * count, -K[a * NY + i], later + a * count, count);
  }
  for (int i = 0; i < NY; ++i) {
    if (!seen[i]) continue;
    add(later + (SHORT + i) * count, 1.0, u + i * count, count);
    for (int j = 0; j < MOTION; ++j)
      if (H[i * MOTION + j] != 0.0) add(later + j * count, H[i * MOTION + j], u + i * count, count);
  }
}

EXPORT int smooth_backward(long runs, long blocks, int count, const double *reading, const unsigned char *known,
                           const double *transition, const double *push, const double *fading, const double *gain,
                           const double *white, const double *filtered, const double *whitened, const double *after,
                           double *states) {
  double *work = malloc(sizeof(double) * count * (2 * NZ + NY));
  if (!work) return 1;
  double *r = work, *later = work + NZ * count, *u = work + 2 * NZ * count;
  memcpy(states, after, sizeof(double) * runs * blocks * NZ * count);
  for (long run = 0; run < runs; ++run) {
    memset(r, 0, sizeof(double) * NZ * count);
    for (long k = blocks - 1; k >= 0; --k) {
      const long at = run * blocks + k, step_at = run * (blocks - 1) + k;
      memset(later, 0, sizeof(double) * NZ * count);
      if (k + 1 < blocks) {
        const Step step = {transition + step_at * MOTION * MOTION, NULL, push + step_at * MOTION * PUSHED, fading};
        carry_back(later, r, step, count);
      }
      for (int a = 0; a < NZ; ++a)
        for (int b = 0; b < NZ; ++b)
          add(states + (at * NZ + a) * count, filtered[(at * NZ + a) * NZ + b], later + b * count, count);
      measure_back(u, later, whitened + at * NY * count, gain + at * NZ * NY, white + at * NY * NY,
                   reading + at * NY * MOTION, known + at * NY, count);
      double *swapped = r;
      r = later;
      later = swapped;
    }
  }
  free(work);
  return 0;
}

/* product = A B, or product = A' B with `by_columns` of A. */
static void multiply(double *restrict product, const double *restrict A, const double *restrict B, int by_columns) {
  memset(product, 0, sizeof(double) * NZ * NZ);
  for (int i = 0; i < NZ; ++i)
    for (int a = 0; a < NZ; ++a) {
      const double factor = by_columns ? A[a * NZ + i] : A[i * NZ + a];
      if (factor != 0.0) add(product + i * NZ, factor, B + a * NZ, NZ);
    }
}

/* (I - K H)' N (I - K H) + H' W'W H in the place of N, and the diagonal of W'W + K' N K.
   Not multiplied out: the terms would cancel where a sensor is good, and with them the last digits of the slopes. */
static void seen_from_before(double *restrict N, double *restrict D, const double *K, const double *W, const double *H,
                             const unsigned char *seen) {
  double correction[NZ * NZ] = {0}, moved[NZ * NZ], WH[NY * NZ] = {0}, NK[NZ * NY] = {0};
  for (int a = 0; a < NZ; ++a)
    for (int b = 0; b < NZ; ++b) add(NK + a * NY, N[a * NZ + b], K + b * NY, NY);
  for (int i = 0; i < NY; ++i) {
    D[i] = 0.0;
    for (int j = i; j < NY; ++j) D[i] += W[j * NY + i] * W[j * NY + i];
    for (int a = 0; a < NZ; ++a) D[i] += K[a * NY + i] * NK[a * NY + i];
  }
  for (int a = 0; a < NZ; ++a) correction[a * NZ + a] = 1.0;
  for (int i = 0; i < NY; ++i) {
    if (!seen[i]) continue;
    for (int a = 0; a < NZ; ++a) {
      add(correction + a * NZ, -K[a * NY + i], H + i * MOTION, MOTION);
      correction[a * NZ + SHORT + i] -= K[a * NY + i];
    }
    for (int j = i; j < NY; ++j) {
      add(WH + j * NZ, W[j * NY + i], H + i * MOTION, MOTION);
      WH[j * NZ + SHORT + i] += W[j * NY + i];
    }
  }
  multiply(moved, N, correction, 0);
  multiply(N, correction, moved, 1);
  for (int i = 0; i < NY; ++i)
    for (int a = 0; a < NZ; ++a)
      if (WH[i * NZ + a] != 0.0) add(N + a * NZ, WH[i * NZ + a], WH + i * NZ, NZ);
}

/* Sums of the slopes, each over all steps: by the variance of each slow process's driving noise, of its beginning, by
   its fading (SLOW each), by variances and gain of a force over a block (FORCES each), and for each run by each sensor's
   white noise (NY). */
typedef struct {
  double *variance, *start, *fading, *way, *both, *gain, *white;
} Sums;

/* What one step adds: r (NZ, C), N and N F are of the later block, F' r, P and `after` of the earlier. */
static void between(Sums sums, const double *r, const double *N, const double *NF, const double *later,
                    const double *spread, const double *P, const double *after, double *restrict smooth,
                    double *restrict pushing, int count) {
  for (int i = 0; i < SLOW; ++i) {
    const double *ri = r + (MOTION + i) * count;
    double *row = smooth + i * count;
    memcpy(row, after + (MOTION + i) * count, sizeof(double) * count);
    for (int b = 0; b < NZ; ++b) add(row, P[(MOTION + i) * NZ + b], later + b * count, count);
    sums.variance[i] += N[(MOTION + i) * (NZ + 1)] - dot(ri, ri, count);
    sums.fading[i] += -2 * (dot(ri, row, count) - dot(NF + (MOTION + i) * NZ, P + (MOTION + i) * NZ, NZ));
  }
  for (int f = 0; f < FORCES; ++f) {
    double BN[NZ] = {0}, BNF[NZ] = {0}, by_way = 0.0;
    memset(pushing, 0, sizeof(double) * count);
    for (int i = 0; i < MOTION; ++i) {
      const double b = spread[i * MOTION + f];
      add(pushing, b, r + i * count, count);
      add(BN, b, N + i * NZ, NZ);
      add(BNF, b, NF + i * NZ, NZ);
    }
    for (int i = 0; i < MOTION; ++i) by_way += BN[i] * spread[i * MOTION + f];
    sums.way[f] += by_way - dot(pushing, pushing, count);
    sums.both[f] += 2 * (BN[MOTION + f] - dot(pushing, r + (MOTION + f) * count, count));
    sums.gain[f] += -2 * (dot(pushing, smooth + f * count, count) - dot(BNF, P + (MOTION + f) * NZ, NZ));
  }
}

EXPORT int backward(long runs, long blocks, int count, const double *reading, const unsigned char *known,
                    const double *transition, const double *spreading, const double *push, const double *fading,
                    const double *gain, const double *white, const double *filtered, const double *whitened,
                    const double *after, double *variance, double *start, double *by_fading, double *way, double *both,
                    double *by_gain, double *by_white) {
  const Sums sums = {variance, start, by_fading, way, both, by_gain, by_white};
  double *work = malloc(sizeof(double) * count * (2 * NZ + NY + SLOW + 1));
  if (!work) return 1;
  double *r = work, *later = r + NZ * count, *u = later + NZ * count;
  double *smooth = u + NY * count, *pushing = smooth + SLOW * count;
  for (long run = 0; run < runs; ++run) {
    double N[NZ * NZ] = {0}, FN[NZ * NZ], NF[NZ * NZ], D[NY];
    memset(r, 0, sizeof(double) * NZ * count);
    for (long k = blocks - 1; k >= 0; --k) {
      const long at = run * blocks + k, step_at = run * (blocks - 1) + k;
      const double *K = gain + at * NZ * NY, *W = white + at * NY * NY, *H = reading + at * NY * MOTION;
      memset(later, 0, sizeof(double) * NZ * count);
      if (k + 1 < blocks) {
        const double *spread = spreading + step_at * MOTION * MOTION;
        const Step step = {transition + step_at * MOTION * MOTION, spread, push + step_at * MOTION * PUSHED, fading};
        carry_back(FN, N, step, NZ);
        transpose(NF, FN); /* N is symmetric */
        carry_back(later, r, step, count);
        between(sums, r, N, NF, later, spread, filtered + at * NZ * NZ, after + at * NZ * count, smooth, pushing, count);
        carry_back(N, NF, step, NZ);
      }
      measure_back(u, later, whitened + at * NY * count, K, W, H, known + at * NY, count);
      seen_from_before(N, D, K, W, H, known + at * NY);
      for (int i = 0; i < NY; ++i)
        if (known[at * NY + i]) by_white[run * NY + i] += D[i] - dot(u + i * count, u + i * count, count);
      double *swapped = r;
      r = later;
      later = swapped;
    }
    for (int i = 0; i < SLOW; ++i)
      start[i] += N[(MOTION + i) * (NZ + 1)] - dot(r + (MOTION + i) * count, r + (MOTION + i) * count, count);
  }
  free(work);
  return 0;
}
