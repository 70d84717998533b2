/* Manoeuvres of many ships, each in a lane: see lane_runs.py. Defined before: LANES and the functions of vectors.h; step,
   constants and speed_and_validity of lanes; the lengths NX, NU, NP, NC and the places X, Y, R, RUDDER of the model.
   See Running.run_until and bracketed_root for the steps to an event. A lane that has ended takes steps of zero length. */
enum { ROW = 2 + NX };
#if SINGLE
/* After the states, what their rounding has lost (Kahan 1965); shares of a step: of a time's rounding, of a root. */
enum { KEPT = 2 * NX };
#define SAME_TIME 1e-4
#define SAME_ROOT 1e-7
#else
enum { KEPT = NX };
#define SAME_TIME 1e-9
#define SAME_ROOT 1e-13
#endif
typedef struct {
  double h, first, second, side;
  long changing, limit, kept, watches, most, times, stride; /* from the times of one ship to those of the next */
  const double *inputs, *limits, *at;
} Plan;
typedef struct {
  double *end, *last, *way, *then, *speeds, *left, *order_times, *order_states, *windows, *states;
  int *ended, *orders, *crossings;
} Found;
typedef struct {
  V states[3][KEPT], *before, *x, *next, u[NU], p[NP], c[NC], h[1], t_before, t, t_next;
  long changing; /* the state at a level of which the order changes */
} Group;
static void take(Group *g, V *to) {
  const V *const arg[5] = {g->x, g->u, g->p, g->c, g->h};
#if SINGLE
  V change[NX];
  V *const res[1] = {change};
  step(arg, res);
  for (int i = 0; i < NX; ++i) {
    const V part = change[i] - g->x[NX + i];
    to[i] = g->x[i] + part;
    to[NX + i] = (to[i] - g->x[i]) - part;
  }
#else
  V *const res[1] = {to};
  step(arg, res);
#endif
}
/* The speed, and 1 within the card's range. */
static void look(const Group *g, const V *x, V *speed, V *valid) {
  const V *const arg[3] = {x, g->u, g->p};
  V *const res[2] = {speed, valid};
  speed_and_validity(arg, res);
}
/* The states of a lane after a step of a length; by how much it is beyond the goal. */
static double beyond_after(Group *g, V *to, int lane, double length, double side, double goal) {
  LANE(g->h[0], lane) = length;
  take(g, to);
  return side * (LANE(to[g->changing], lane) - goal);
}
/* The step to a goal within the step that was tried, by the method of Ridders, as bracketed_root. */
static double step_to(Group *g, V *to, int lane, double high, double side, double goal) {
  double low = 0.0, best = INFINITY, f_low = side * (LANE(g->x[g->changing], lane) - goal);
  double f_high = side * (LANE(g->next[g->changing], lane) - goal);
  if (f_low == 0) return low;
  if (f_high == 0) return high;
  for (int k = 0; k < 200; ++k) {
    const double middle = (low + high) / 2, f_middle = beyond_after(g, to, lane, middle, side, goal);
    const double root = sqrt(f_middle * f_middle - f_low * f_high), before = best;
    if (!(root != 0)) return middle;
    best = middle + (middle - low) * copysign(1.0, f_low - f_high) * f_middle / root;
    const double f_best = beyond_after(g, to, lane, best, side, goal);
    if (f_best == 0 || fabs(best - before) <= SAME_ROOT) return best;
    double x[4] = {low, middle, best, high}, f[4] = {f_low, f_middle, f_best, f_high};
    if (best < middle) { x[1] = best; f[1] = f_best; x[2] = middle; f[2] = f_middle; }
    int at = 0;
    while (at < 2 && !(f[at] * f[at + 1] <= 0)) ++at;
    low = x[at]; f_low = f[at]; high = x[at + 1]; f_high = f[at + 1];
    if (fabs(high - low) <= SAME_ROOT) return (low + high) / 2;
  }
  return best;
}
/* What a step adds to a state. */
static V gained(const Group *g, int i) {
#if SINGLE
  return (g->next[i] - g->x[i]) + (g->next[NX + i] - g->x[NX + i]);
#else
  return g->next[i] - g->x[i];
#endif
}
static void keep_sample(double *row, double t, double order, const V *x, int lane) {
  row[0] = t;
  row[1] = order;
  for (int i = 0; i < NX; ++i) row[2 + i] = LANE(x[i], lane);
}
EXPORT void run_lanes(long members, const Plan *plan, const double *p, const double *starts, const double *ends,
    const double *goals, const double *levels, const double *lengths, const int *watched, const Found *found) {
  static const M none = {0};
  V rates[REMEMBERED], velocities[REMEMBERED];
  const double h = plan->h, tolerance = SAME_TIME * h;
  for (long begin = 0; begin < members; begin += LANES) {
    Group g;
    long member[LANES], due[LANES], events[LANES], open[LANES][2][2];
    const double *at[LANES];
    V goal = all(0), sides = all(plan->side), end, level[2] = {all(0), all(0)}, steps = all(0), soon = all(INFINITY);
    V approach, slowest, fastest, speed, valid, left, way = all(0), lost = all(0);
    M active = ~none, waiting = none;
    g.changing = plan->changing;
    g.before = g.states[0]; g.x = g.states[1]; g.next = g.states[2];
    for (int l = 0; l < LANES; ++l) {
      const long k = begin + l < members ? begin + l : members - 1;
      if (begin + l >= members) LANE(active, l) = 0; /* to fill the lanes: nothing is kept of it */
      member[l] = k; due[l] = events[l] = 0;
      open[l][0][0] = open[l][0][1] = open[l][1][0] = open[l][1][1] = 0;
      for (int i = 0; i < NP; ++i) LANE(g.p[i], l) = p[k * NP + i];
      for (int i = 0; i < KEPT; ++i) LANE(g.x[i], l) = i < NX ? starts[k * NX + i] : 0.0;
      LANE(end, l) = ends[k];
      LANE(goal, l) = goals[2 * k];
      for (int w = 0; w < plan->watches; ++w) LANE(level[w], l) = levels[k * plan->watches + w];
      at[l] = plan->at + k * plan->stride;
      if (plan->times) LANE(soon, l) = at[l][0];
    }
    for (int i = 0; i < NU; ++i) g.u[i] = all(plan->inputs[i]);
    g.u[RUDDER] = all(plan->first);
    { const V *const arg[1] = {g.p}; V *const res[1] = {g.c}; constants(arg, res); }
    g.t = g.t_before = all(0);
    look(&g, g.x, &speed, &valid);
    approach = slowest = fastest = speed;
    left = WHERE(LT(valid, all(INSIDE)), all(0), all(INFINITY));
    rates[0] = g.x[R]; velocities[0] = slowest;
    for (long n = 1; some(active); ++n) {
      const V grid = steps * all(h);
      V after = steps + all(1);
      g.t_next = after * all(h);
      g.h[0] = WHERE(LT(grid + all(tolerance), g.t), g.t_next - g.t, all(h));
      const M late = LT(end + all(tolerance), g.t_next);
      g.h[0] = WHERE0(active, WHERE(late, end - g.t, g.h[0]));
      g.t_next = WHERE(late, end, g.t_next);
      take(&g, g.next);
      M event = none, crossed[2] = {none, none}, bad = none;
      const V before_rudder = g.u[RUDDER];
      if (plan->limit) {
        event = active & LE(all(0), sides * (g.next[g.changing] - goal));
        if (some(event)) {
          V to[KEPT];
          const V tried = g.h[0];
          for (int l = 0; l < LANES; ++l) {
            if (!LANE(event, l)) continue;
            const double direction = LANE(sides, l), aim = LANE(goal, l);
            const double length = step_to(&g, to, l, LANE(tried, l), direction, aim);
            beyond_after(&g, to, l, length, direction, aim);
            for (int i = 0; i < KEPT; ++i) LANE(g.next[i], l) = LANE(to[i], l);
            LANE(g.t_next, l) = LANE(g.t, l) + length;
            LANE(after, l) = LANE(steps, l);
          }
        }
      }
      for (int i = 0; i < NX; ++i) bad |= ~LE(lane_fabs(g.next[i]), all(plan->limits[i]));
      bad &= active;
      look(&g, g.next, &speed, &valid);
      left = WHERE(active & LT(valid, all(INSIDE)) & LT(g.t_next, left), g.t_next, left);
      slowest = WHERE(active & LT(speed, slowest), speed, slowest);
      fastest = WHERE(active & LT(fastest, speed), speed, fastest);
      rates[n & (REMEMBERED - 1)] = g.next[R];
      velocities[n & (REMEMBERED - 1)] = speed;
      for (int w = 0; w < plan->watches; ++w)
        crossed[w] = active & (LT(g.x[watched[w]], level[w]) ^ LT(g.next[watched[w]], level[w]));
      { /* with what the rounding of the sum has lost (Kahan 1965) */
        const V north = gained(&g, X), east = gained(&g, Y), part = lane_sqrt(north * north + east * east) - lost;
        const V sum = way + WHERE0(active, part);
        lost = WHERE0(active, (sum - way) - part);
        way = sum;
      }
      const M over = active & LE(end - g.t_next, all(tolerance)), now = active & LE(soon, g.t_next);
      if (some(event | bad | crossed[0] | crossed[1] | over | now | waiting)) {
        for (int l = 0; l < LANES; ++l) {
          const long k = member[l];
          if (!LANE(active, l)) continue;
          const double t = LANE(g.t, l), t_next = LANE(g.t_next, l), old = LANE(before_rudder, l);
          int finished = LANE(over, l) != 0;
          for (; due[l] < plan->times && at[l][due[l]] <= t_next; ++due[l]) {
            double *row = found->states + (k * plan->times + due[l]) * NX;
            const double share = t_next > t ? (at[l][due[l]] - t) / (t_next - t) : 0.0;
            for (int i = 0; i < NX; ++i) row[i] = LANE(g.x[i], l) + share * (LANE(g.next[i], l) - LANE(g.x[i], l));
          }
          if (plan->times) LANE(soon, l) = due[l] < plan->times ? at[l][due[l]] : INFINITY;
          if (LANE(bad, l)) {
            found->ended[k] = RUNAWAY;
            LANE(active, l) = 0;
            continue;
          }
          if (LANE(event, l)) {
            if (events[l] < plan->kept) {
              const long row = k * plan->kept + events[l];
              found->order_times[row] = t_next;
              for (int i = 0; i < NX; ++i) found->order_states[row * NX + i] = LANE(g.next[i], l);
            } else found->ended[k] = UNKNOWN;
            events[l] += 1;
            finished |= events[l] == plan->limit;
            if (!finished) {
              LANE(sides, l) = -LANE(sides, l);
              LANE(g.u[RUDDER], l) = events[l] & 1 ? plan->second : plan->first;
              LANE(goal, l) = goals[2 * k + (events[l] & 1)];
            }
          }
          LANE(waiting, l) = 0;
          for (int w = 0; w < plan->watches; ++w) {
            int *count = found->crossings + k * plan->watches + w;
            double *windows = found->windows + (k * plan->watches + w) * plan->most * SAMPLES * ROW;
            if (open[l][w][0]) {
              keep_sample(windows + ((open[l][w][1] * SAMPLES) + 3) * ROW, t_next, LANE(g.u[RUDDER], l), g.next, l);
              open[l][w][0] = 0;
            }
            if (!LANE(crossed[w], l)) continue;
            if (*count < plan->most) {
              double *row = windows + *count * SAMPLES * ROW;
              if (n > 1) keep_sample(row, LANE(g.t_before, l), old, g.before, l);
              keep_sample(row + ROW, t, old, g.x, l);
              keep_sample(row + 2 * ROW, t_next, LANE(g.u[RUDDER], l), g.next, l);
              open[l][w][0] = 1; open[l][w][1] = *count;
              LANE(waiting, l) = -1;
              *count += 1;
            } else if (plan->most > 1) found->ended[k] = UNKNOWN;
          }
          if (!finished) continue;
          LANE(active, l) = 0;
          LANE(waiting, l) = 0;
          found->end[k] = t_next;
          found->way[k] = LANE(way, l);
          for (int i = 0; i < NX; ++i) found->last[k * NX + i] = LANE(g.next[i], l);
          found->orders[k] = (int) events[l];
          found->left[k] = LANE(left, l);
          found->speeds[k * 4] = LANE(approach, l);
          found->speeds[k * 4 + 1] = LANE(slowest, l);
          found->speeds[k * 4 + 2] = LANE(fastest, l);
          found->speeds[k * 4 + 3] = LANE(speed, l);
          /* The sample two lengths before the end: all samples except the last are on the grid. */
          const double earlier = t_next - 2 * lengths[k] / fmax(LANE(speed, l), 1e-9);
          if (plan->most == 1 && earlier >= 0) {
            long at = (long) ceil(earlier / h);
            while (at > 0 && (at - 1) * h >= earlier) --at;
            while (at * h < earlier) ++at;
            if (at > n) at = n;
            if (n - at >= REMEMBERED) found->ended[k] = UNKNOWN;
            else {
              found->then[k * 2] = LANE(rates[at & (REMEMBERED - 1)], l);
              found->then[k * 2 + 1] = LANE(velocities[at & (REMEMBERED - 1)], l);
            }
          }
        }
      }
      V *freed = g.before;
      g.before = g.x; g.x = g.next; g.next = freed;
      g.t_before = g.t; g.t = g.t_next;
      steps = after;
    }
  }
}
