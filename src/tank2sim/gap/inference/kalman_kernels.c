/* The loops of the filter over time: forward for covariances and for columns, backward for slopes.

   The equations are in kalman_filter.py; arrays, arguments and results in kalman_kernels.py. States are ordered as
   there: 6 errors of the motion, 3 accelerations, NY sensor errors, and with WAVES 3 accelerations of a narrow band, each
   with its quadrature. A row of `known` that is 0 has zeros for its row of the reading matrix H.

   Columns pass in tiles of LANES, each a vector V in every state: a tile stays in the cache over all blocks of a run. A
   covariance is ROW tiles, the last one filled up with zeros. NY, WAVES (0 or 1) and LANES are defined when this is
   compiled. */
#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#ifdef _WIN32
#define EXPORT __declspec(dllexport)
#else
#define EXPORT __attribute__((visibility("default")))
#endif
#define INLINE static inline __attribute__((always_inline))

#if LANES > 1
typedef double V __attribute__((vector_size(sizeof(double) * LANES), may_alias));
#else
typedef double V;
#endif

enum { MOTION = 6, FORCES = 3, SHORT = MOTION + FORCES, SLOW = FORCES + NY, BAND = 2 * FORCES * WAVES };
enum { BAND_AT = MOTION + SLOW, NZ = BAND_AT + BAND, PUSHED = FORCES + BAND, ROW = (NZ + LANES - 1) / LANES };

/* Arguments are structures of addresses and of whole numbers as large as these.

   Motion of all runs: slopes of each step, readings, and what was read. */
typedef struct {
  intptr_t runs, blocks;
  const double *transition, *spreading, *reading;
  const unsigned char *known;
} Motion;

/* Accelerations and sensor errors over a block: the share that remains (SLOW, and with WAVES real and imaginary part of
   the band's), the change of speed by each value (PUSHED), and what noise adds: the variance of the change of speed
   (FORCES), its covariance with each value at the end (PUSHED), and the variance of each value (NZ - MOTION). */
typedef struct {
  const double *fading, *gain, *way, *both, *end;
} Process;

/* Gains, inverse roots of the innovations' covariances, covariances after each measurement. */
typedef struct {
  double *gain, *white, *filtered;
} Filter;

/* Element of a matrix that is tiles of `rows` vectors. */
#define AT(tiles, rows, a, b) (((double *)(tiles))[((b) / LANES * (rows) + (a)) * LANES + (b) % LANES])

/* The first `width` of the numbers at a place, and zeros. */
INLINE V load(const double *from, int width) {
  V v;
  if (width == LANES) {
    memcpy(&v, from, sizeof v);
  } else {
    double lanes[LANES] = {0};
    for (int c = 0; c < width; ++c) lanes[c] = from[c];
    memcpy(&v, lanes, sizeof v);
  }
  return v;
}

INLINE void store(double *to, V v, int width) {
  if (width == LANES) {
    memcpy(to, &v, sizeof v);
  } else {
    double lanes[LANES];
    memcpy(lanes, &v, sizeof v);
    for (int c = 0; c < width; ++c) to[c] = lanes[c];
  }
}

INLINE int width_of(int count, int begin) { return count - begin < LANES ? count - begin : LANES; }

static double sum(V v) {
  double lanes[LANES], total = 0.0;
  memcpy(lanes, &v, sizeof v);
  for (int c = 0; c < LANES; ++c) total += lanes[c];
  return total;
}

/* F z + B d, the whole transition F being (phi, B gain, 0; 0, fading) and B the spreading; no d if NULL. */
INLINE void advance(V *moved, const V *z, const double *phi, const double *spreading, Process by, const V *d) {
  V pushed[MOTION] = {0};
  const int count = d ? MOTION : FORCES;
  if (d) memcpy(pushed, d, sizeof pushed);
  for (int f = 0; f < FORCES; ++f) pushed[f] += by.gain[f] * z[MOTION + f];
  for (int j = 0; j < BAND; ++j) pushed[j / 2] += by.gain[FORCES + j] * z[BAND_AT + j];
  for (int i = 0; i < MOTION; ++i) {
    V total = phi[i * MOTION] * z[0];
    for (int j = 1; j < MOTION; ++j) total += phi[i * MOTION + j] * z[j];
    for (int j = 0; j < count; ++j) total += spreading[i * MOTION + j] * pushed[j];
    moved[i] = total;
  }
  for (int i = MOTION; i < BAND_AT; ++i) moved[i] = by.fading[i - MOTION] * z[i];
  for (int i = BAND_AT; i < NZ; i += 2) {
    moved[i] = by.fading[SLOW] * z[i] - by.fading[SLOW + 1] * z[i + 1];
    moved[i + 1] = by.fading[SLOW + 1] * z[i] + by.fading[SLOW] * z[i + 1];
  }
}

/* F' r, and the first FORCES rows of B' r. */
INLINE void carry_back(V *earlier, V *pushing, const V *r, const double *phi, const double *spreading, Process by) {
  for (int f = 0; f < FORCES; ++f) {
    pushing[f] = spreading[f] * r[0];
    for (int i = 1; i < MOTION; ++i) pushing[f] += spreading[i * MOTION + f] * r[i];
  }
  for (int j = 0; j < MOTION; ++j) {
    V total = phi[j] * r[0];
    for (int i = 1; i < MOTION; ++i) total += phi[i * MOTION + j] * r[i];
    earlier[j] = total;
  }
  for (int i = MOTION; i < BAND_AT; ++i) earlier[i] = by.fading[i - MOTION] * r[i];
  for (int f = 0; f < FORCES; ++f) earlier[MOTION + f] += by.gain[f] * pushing[f];
  for (int i = BAND_AT; i < NZ; i += 2) {
    const V push = pushing[(i - BAND_AT) / 2];
    earlier[i] = by.fading[SLOW] * r[i] + by.fading[SLOW + 1] * r[i + 1] + by.gain[FORCES + i - BAND_AT] * push;
    earlier[i + 1] = by.fading[SLOW] * r[i + 1] - by.fading[SLOW + 1] * r[i] + by.gain[FORCES + i - BAND_AT + 1] * push;
  }
}

static void transpose(V (*to)[NZ], V (*from)[NZ]) {
  for (int a = 0; a < NZ; ++a)
    for (int b = 0; b < NZ; ++b) AT(to, NZ, b, a) = AT(from, NZ, a, b);
}

/* Inverse of the lower Cholesky factor of S, of which the lower half is read; nan if it is not positive definite. */
static void inverse_root(double *restrict W, const double *restrict S) {
  double L[NY * NY];
  memset(W, 0, sizeof(double) * NY * NY);
  for (int i = 0; i < NY; ++i) {
    for (int j = 0; j <= i; ++j) {
      double total = S[i * NY + j];
      for (int c = 0; c < j; ++c) total -= L[i * NY + c] * L[j * NY + c];
      if (i > j) {
        L[i * NY + j] = total * W[j * NY + j];
      } else if (total > 0.0) {
        W[i * NY + i] = 1.0 / sqrt(total);
      } else {
        for (int c = 0; c < NY * NY; ++c) W[c] = NAN;
        return;
      }
    }
    for (int j = 0; j < i; ++j) {
      double total = 0.0;
      for (int c = j; c < i; ++c) total -= L[i * NY + c] * W[c * NY + j];
      W[i * NY + j] = total * W[i * NY + i];
    }
  }
}

/* The covariance P in the light of one measurement; its gain K and the inverse root W of the innovations'. */
static void measure(V (*P)[NZ], double *K, double *W, const double *H, const unsigned char *seen,
                    const double *white_noise) {
  V HP[ROW][NY], G[ROW][NY], KT[ROW][NY]; /* H P, W H P, and K' */
  double S[NY * NY];
  memset(HP, 0, sizeof HP);
  for (int t = 0; t < ROW; ++t)
    for (int i = 0; i < NY; ++i) {
      if (!seen[i]) continue;
      HP[t][i] = P[t][SHORT + i]; /* P is symmetric */
      for (int j = 0; j < MOTION; ++j) HP[t][i] += H[i * MOTION + j] * P[t][j];
    }
  for (int i = 0; i < NY; ++i) {
    for (int j = 0; j <= i; ++j) {
      double total = AT(HP, NY, j, SHORT + i);
      for (int a = 0; a < MOTION; ++a) total += H[i * MOTION + a] * AT(HP, NY, j, a);
      S[i * NY + j] = seen[i] ? total : 0.0;
    }
    S[i * NY + i] = seen[i] ? S[i * NY + i] + white_noise[i] : 1.0;
  }
  inverse_root(W, S);
  for (int t = 0; t < ROW; ++t)
    for (int i = 0; i < NY; ++i) {
      G[t][i] = W[i * NY] * HP[t][0];
      for (int j = 1; j <= i; ++j) G[t][i] += W[i * NY + j] * HP[t][j];
    }
  for (int t = 0; t < ROW; ++t) {
    for (int a = 0; a < NZ; ++a) {
      V total = P[t][a];
      for (int i = 0; i < NY; ++i) total -= AT(G, NY, i, a) * G[t][i];
      P[t][a] = total;
    }
    for (int j = 0; j < NY; ++j) {
      KT[t][j] = W[j * NY + j] * G[t][j];
      for (int i = j + 1; i < NY; ++i) KT[t][j] += W[i * NY + j] * G[t][i];
    }
  }
  for (int a = 0; a < NZ; ++a)
    for (int j = 0; j < NY; ++j) K[a * NY + j] = AT(KT, NY, j, a);
}

/* F P F' and what noise adds, exactly symmetric. */
static void pass(V (*P)[NZ], const double *phi, const double *spreading, Process by) {
  V FP[ROW][NZ], turned[ROW][NZ];
  memset(FP, 0, sizeof FP);
  for (int t = 0; t < ROW; ++t) advance(FP[t], P[t], phi, spreading, by, NULL);
  memset(turned, 0, sizeof turned);
  transpose(turned, FP);
  for (int t = 0; t < ROW; ++t) advance(P[t], turned[t], phi, spreading, by, NULL);
  for (int a = 0; a < NZ; ++a)
    for (int b = 0; b <= a; ++b) {
      double added = 0.0;
      const int force = a < SHORT ? a - MOTION : (a - BAND_AT) / 2, place = a < SHORT ? force : FORCES + a - BAND_AT;
      if (a < MOTION)
        for (int f = 0; f < FORCES; ++f) added += by.way[f] * spreading[a * MOTION + f] * spreading[b * MOTION + f];
      else if (b < MOTION)
        added = a < SHORT || a >= BAND_AT ? by.both[place] * spreading[b * MOTION + force] : 0.0;
      else if (a == b)
        added = by.end[a - MOTION];
      AT(P, NZ, a, b) = AT(P, NZ, b, a) = 0.5 * (AT(P, NZ, a, b) + AT(P, NZ, b, a)) + added;
    }
}

EXPORT int covariances(const Motion *of, const Process *by, const double **start, const double **white_noise,
                       const Filter *found) {
  for (long run = 0; run < of->runs; ++run) {
    V P[ROW][NZ];
    memset(P, 0, sizeof P);
    for (int a = 0; a < NZ; ++a) AT(P, NZ, a, a) = (*start)[a];
    for (long k = 0; k < of->blocks; ++k) {
      const long at = run * of->blocks + k, step = (run * (of->blocks - 1) + k) * MOTION * MOTION;
      double *filtered = found->filtered + at * NZ * NZ;
      measure(P, found->gain + at * NZ * NY, found->white + at * NY * NY, of->reading + at * NY * MOTION,
              of->known + at * NY, *white_noise + run * NY);
      for (int a = 0; a < NZ; ++a)
        for (int t = 0; t < ROW; ++t) store(filtered + a * NZ + t * LANES, P[t][a], width_of(NZ, t * LANES));
      if (k + 1 < of->blocks) pass(P, of->transition + step, of->spreading + step, *by);
    }
  }
  return 0;
}

/* Driving, and what the first `shown_count` of `count` columns show. */
typedef struct {
  intptr_t count, shown_count;
  const double *driving, *shown;
} Columns;

/* One tile of columns over a run: its innovations, each in units of their deviations, to `whitened` (NY at a block), and
   its states after each measurement to `after` (NZ at a block) unless that is NULL. */
INLINE void forward(const Motion *of, Process by, const Filter *filter, Columns columns, long run, int begin, V *whitened,
                    V *after) {
  const int width = width_of(columns.count, begin), shown = width_of(columns.shown_count, begin);
  V z[NZ], e[NY];
  memset(z, 0, sizeof z);
  for (long k = 0; k < of->blocks; ++k) {
    const long at = run * of->blocks + k, step = run * (of->blocks - 1) + k;
    const double *H = of->reading + at * NY * MOTION, *K = filter->gain + at * NZ * NY;
    const double *W = filter->white + at * NY * NY;
    memset(e, 0, sizeof e);
    for (int i = 0; i < NY; ++i) {
      if (!of->known[at * NY + i]) continue;
      if (shown > 0) e[i] = load(columns.shown + (at * NY + i) * columns.shown_count + begin, shown);
      e[i] -= z[SHORT + i];
      for (int j = 0; j < MOTION; ++j) e[i] -= H[i * MOTION + j] * z[j];
    }
    for (int i = 0; i < NY; ++i) {
      V total = W[i * NY] * e[0];
      for (int j = 1; j <= i; ++j) total += W[i * NY + j] * e[j];
      whitened[k * NY + i] = total;
    }
    for (int a = 0; a < NZ; ++a) {
      V total = z[a];
      for (int i = 0; i < NY; ++i) total += K[a * NY + i] * e[i];
      z[a] = total;
    }
    if (after) memcpy(after + k * NZ, z, sizeof z);
    if (k + 1 < of->blocks) {
      V d[MOTION], moved[NZ];
      for (int i = 0; i < MOTION; ++i) d[i] = load(columns.driving + (step * MOTION + i) * columns.count + begin, width);
      advance(moved, z, of->transition + step * MOTION * MOTION, of->spreading + step * MOTION * MOTION, by, d);
      memcpy(z, moved, sizeof z);
    }
  }
}

/* Room for `count` vectors at every block, aligned; to be freed at *raw. NULL without memory. */
static V *room(long blocks, int count, void **raw) {
  *raw = malloc(sizeof(V) * (blocks * count + 1));
  return *raw ? (V *)(((uintptr_t)*raw + sizeof(V) - 1) / sizeof(V) * sizeof(V)) : NULL;
}

EXPORT int whiten(const Motion *of, const Process *by, const Filter *filter, const Columns *columns, double **whitened) {
  void *raw;
  V *tile = room(of->blocks, NY, &raw);
  if (!tile) return 1;
  for (long run = 0; run < of->runs; ++run)
    for (int begin = 0; begin < columns->count; begin += LANES) {
      const int width = width_of(columns->count, begin);
      forward(of, *by, filter, *columns, run, begin, tile, NULL);
      for (long row = 0; row < of->blocks * NY; ++row)
        store(*whitened + (run * of->blocks * NY + row) * columns->count + begin, tile[row], width);
    }
  free(raw);
  return 0;
}

/* u = W' e - K' later, and later + H' u in its place: r, what later measurements say of the state before this one. */
INLINE void measure_back(V *u, V *later, const V *e, const double *K, const double *W, const double *H,
                         const unsigned char *seen) {
  memset(u, 0, sizeof(V) * NY);
  for (int i = 0; i < NY; ++i) {
    if (!seen[i]) continue;
    u[i] = W[i * NY + i] * e[i];
    for (int j = i + 1; j < NY; ++j) u[i] += W[j * NY + i] * e[j];
    for (int a = 0; a < NZ; ++a) u[i] -= K[a * NY + i] * later[a];
  }
  for (int i = 0; i < NY; ++i) later[SHORT + i] += u[i];
  for (int j = 0; j < MOTION; ++j) {
    V total = later[j];
    for (int i = 0; i < NY; ++i) total += H[i * MOTION + j] * u[i];
    later[j] = total;
  }
}

/* States given all measurements, of one column. */
EXPORT int smooth(const Motion *of, const Process *by, const Filter *filter, const Columns *columns, double **states) {
  void *raw;
  V *whitened = room(of->blocks, NY + NZ, &raw), *after = whitened + of->blocks * NY;
  if (!whitened) return 1;
  for (long run = 0; run < of->runs; ++run) {
    V r[NZ], later[NZ], pushing[FORCES], u[NY];
    memset(r, 0, sizeof r);
    forward(of, *by, filter, *columns, run, 0, whitened, after);
    for (long k = of->blocks - 1; k >= 0; --k) {
      const long at = run * of->blocks + k, step = (run * (of->blocks - 1) + k) * MOTION * MOTION;
      memset(later, 0, sizeof later);
      if (k + 1 < of->blocks) carry_back(later, pushing, r, of->transition + step, of->spreading + step, *by);
      for (int a = 0; a < NZ; ++a) {
        V total = after[k * NZ + a];
        for (int b = 0; b < NZ; ++b) total += filter->filtered[(at * NZ + a) * NZ + b] * later[b];
        store(*states + at * NZ + a, total, 1);
      }
      measure_back(u, later, whitened + k * NY, filter->gain + at * NZ * NY, filter->white + at * NY * NY,
                   of->reading + at * NY * MOTION, of->known + at * NY);
      memcpy(r, later, sizeof r);
    }
  }
  free(raw);
  return 0;
}

/* Sums of the slopes, each over all steps: by the variance of each slow process's driving noise, of its beginning, by
   its fading (SLOW each), by variances and gain of a force over a block (FORCES each), and for each run by each sensor's
   white noise (NY). */
typedef struct {
  double *variance, *start, *fading, *way, *both, *gain, *white;
} Sums;

/* (I - K H)' N (I - K H) + H' W'W H in the place of N, and the diagonal of W'W + K' N K.
   First N (I - K H), then this from the left: multiplied out, the terms would cancel where a sensor is good, and with
   them the last digits of the slopes. */
static void seen_from_before(V (*N)[NZ], double *D, const double *K, const double *W, const double *H,
                             const unsigned char *seen) {
  V reading[ROW][NZ], KN[ROW][NY], back[ROW][NY]; /* H, of which the first NY rows are used; K' N */
  memset(reading, 0, sizeof reading);
  for (int i = 0; i < NY; ++i) {
    if (!seen[i]) continue;
    for (int j = 0; j < MOTION; ++j) AT(reading, NZ, i, j) = H[i * MOTION + j];
    AT(reading, NZ, i, SHORT + i) = 1.0;
  }
  for (int t = 0; t < ROW; ++t)
    for (int i = 0; i < NY; ++i) {
      V total = K[i] * N[t][0];
      for (int a = 1; a < NZ; ++a) total += K[a * NY + i] * N[t][a];
      KN[t][i] = total;
    }
  for (int i = 0; i < NY; ++i) {
    D[i] = 0.0;
    for (int j = i; j < NY; ++j) D[i] += W[j * NY + i] * W[j * NY + i];
    for (int a = 0; a < NZ; ++a) D[i] += K[a * NY + i] * AT(KN, NY, i, a);
  }
  for (int t = 0; t < ROW; ++t) {
    V WH[NY];
    for (int a = 0; a < NZ; ++a) {
      V total = N[t][a];
      for (int i = 0; i < NY; ++i) total -= AT(KN, NY, i, a) * reading[t][i];
      N[t][a] = total;
    }
    for (int i = 0; i < NY; ++i) {
      WH[i] = W[i * NY] * reading[t][0];
      for (int j = 1; j <= i; ++j) WH[i] += W[i * NY + j] * reading[t][j];
    }
    for (int i = 0; i < NY; ++i) {
      V total = W[i * NY + i] * WH[i];
      for (int j = i + 1; j < NY; ++j) total += W[j * NY + i] * WH[j];
      for (int a = 0; a < NZ; ++a) total -= K[a * NY + i] * N[t][a];
      back[t][i] = total;
    }
    for (int i = 0; i < NY; ++i) {
      if (!seen[i]) continue;
      for (int j = 0; j < MOTION; ++j) N[t][j] += H[i * MOTION + j] * back[t][i];
      N[t][SHORT + i] += back[t][i];
    }
  }
}

/* What covariances add to the sums: N carries the information of later measurements about the states back. */
static void sum_over_covariances(const Motion *of, Process by, const Filter *filter, long run, Sums sums) {
  V N[ROW][NZ], FN[ROW][NZ], NF[ROW][NZ], BN[ROW][FORCES], BNF[ROW][FORCES];
  double D[NY];
  memset(N, 0, sizeof N);
  memset(NF, 0, sizeof NF);
  for (long k = of->blocks - 1; k >= 0; --k) {
    const long at = run * of->blocks + k, step = (run * (of->blocks - 1) + k) * MOTION * MOTION;
    if (k + 1 < of->blocks) {
      const double *phi = of->transition + step, *spreading = of->spreading + step;
      for (int i = 0; i < SLOW; ++i) sums.variance[i] += AT(N, NZ, MOTION + i, MOTION + i);
      for (int t = 0; t < ROW; ++t) carry_back(FN[t], BN[t], N[t], phi, spreading, by);
      transpose(NF, FN); /* N is symmetric */
      for (int t = 0; t < ROW; ++t) carry_back(N[t], BNF[t], NF[t], phi, spreading, by);
      for (int i = 0; i < SLOW; ++i) {
        V by_fading = {0}, by_gain = {0};
        for (int t = 0; t < ROW; ++t) {
          const double *P = filter->filtered + (at * NZ + MOTION + i) * NZ + t * LANES;
          const V row = load(P, width_of(NZ, t * LANES));
          by_fading += NF[t][MOTION + i] * row;
          if (i < FORCES) by_gain += BNF[t][i] * row;
        }
        sums.fading[i] += 2 * sum(by_fading);
        if (i < FORCES) sums.gain[i] += 2 * sum(by_gain);
      }
      for (int f = 0; f < FORCES; ++f) {
        for (int i = 0; i < MOTION; ++i) sums.way[f] += AT(BN, FORCES, f, i) * spreading[i * MOTION + f];
        sums.both[f] += 2 * AT(BN, FORCES, f, MOTION + f);
      }
    }
    seen_from_before(N, D, filter->gain + at * NZ * NY, filter->white + at * NY * NY, of->reading + at * NY * MOTION,
                     of->known + at * NY);
    for (int i = 0; i < NY; ++i)
      if (of->known[at * NY + i]) sums.white[run * NY + i] += D[i];
  }
  for (int i = 0; i < SLOW; ++i) sums.start[i] += AT(N, NZ, MOTION + i, MOTION + i);
}

/* What a tile of columns takes from the sums; r carries what later measurements say of the states back. */
static void sum_over_columns(const Motion *of, Process by, const Filter *filter, long run, const V *whitened,
                             const V *after, Sums sums) {
  V variance[SLOW] = {0}, fading[SLOW] = {0}, way[FORCES] = {0}, both[FORCES] = {0}, gain[FORCES] = {0}, white[NY] = {0};
  V r[NZ], later[NZ], pushing[FORCES], u[NY];
  memset(r, 0, sizeof r);
  for (long k = of->blocks - 1; k >= 0; --k) {
    const long at = run * of->blocks + k, step = (run * (of->blocks - 1) + k) * MOTION * MOTION;
    memset(later, 0, sizeof later);
    if (k + 1 < of->blocks) {
      carry_back(later, pushing, r, of->transition + step, of->spreading + step, by);
      for (int i = 0; i < SLOW; ++i) {
        V state = after[k * NZ + MOTION + i];
        for (int b = 0; b < NZ; ++b) state += filter->filtered[(at * NZ + MOTION + i) * NZ + b] * later[b];
        variance[i] += r[MOTION + i] * r[MOTION + i];
        fading[i] += r[MOTION + i] * state;
        if (i < FORCES) gain[i] += pushing[i] * state;
      }
      for (int f = 0; f < FORCES; ++f) {
        way[f] += pushing[f] * pushing[f];
        both[f] += pushing[f] * r[MOTION + f];
      }
    }
    measure_back(u, later, whitened + k * NY, filter->gain + at * NZ * NY, filter->white + at * NY * NY,
                 of->reading + at * NY * MOTION, of->known + at * NY);
    for (int i = 0; i < NY; ++i) white[i] += u[i] * u[i];
    memcpy(r, later, sizeof r);
  }
  for (int i = 0; i < SLOW; ++i) {
    sums.variance[i] -= sum(variance[i]);
    sums.fading[i] -= 2 * sum(fading[i]);
    sums.start[i] -= sum(r[MOTION + i] * r[MOTION + i]);
  }
  for (int f = 0; f < FORCES; ++f) {
    sums.way[f] -= sum(way[f]);
    sums.both[f] -= 2 * sum(both[f]);
    sums.gain[f] -= 2 * sum(gain[f]);
  }
  for (int i = 0; i < NY; ++i) sums.white[run * NY + i] -= sum(white[i]);
}

EXPORT int slope_sums(const Motion *of, const Process *by, const Filter *filter, const Columns *columns,
                      const Sums *sums) {
  void *raw;
  V *whitened = room(of->blocks, NY + NZ, &raw), *after = whitened + of->blocks * NY;
  if (!whitened) return 1;
  for (long run = 0; run < of->runs; ++run) {
    sum_over_covariances(of, *by, filter, run, *sums);
    for (int begin = 0; begin < columns->count; begin += LANES) {
      forward(of, *by, filter, *columns, run, begin, whitened, after);
      sum_over_columns(of, *by, filter, run, whitened, after, *sums);
    }
  }
  free(raw);
  return 0;
}
