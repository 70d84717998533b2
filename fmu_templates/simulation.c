/* Solving the equations: initial states, derivatives and outputs, integration over a communication step. */
#include "instance.h"

#include <math.h>
#include <string.h>

/* Steady motion is found when Newton's method moves no state by more than this share of its magnitude. */
static const double TRIM_TOLERANCE = 1e-10;
enum { TRIM_ITERATIONS = 50 };

/* H = 1 s with steps of 0.1 s shall be ten steps, although H / 0.1 may come out as 10.000000000000002. */
static const double STEP_COUNT_ROUNDING = 1e-9;

/* By how much the simulator's clock may differ from that of the instance, relative and below 1 s in s: as in the
 * Reference FMUs of the Modelica Association (src/cosimulation.c, EPSILON). A clock that is kept in 32 bits adds up such
 * errors. Half a step is never exceeded, so that a step that is repeated or left out is refused. */
static const double CLOCK_TOLERANCE = 1e-5;

/* More internal steps in one communication step are a mistake, in which a simulator would seem to hang (project choice). */
static const double MOST_STEPS = 1e7;

/* States that are not finite stay so: a long step need not go to its end to find it (so often is a project choice). */
enum { STEPS_BETWEEN_CHECKS = 256 };

static const size_t STATE_BYTES = (STATES_END - STATES_BEGIN) * sizeof(double);

/* The states are all numbers that a ship can have, or the place of the first that is not. */
static bool plausible_states(const double states[], size_t *place) {
    for (size_t i = STATES_BEGIN; i < STATES_END; ++i) {
        const double largest = TIMES_BEYOND * fmax(fabs(VARIABLES[i].minimum), fabs(VARIABLES[i].maximum));
        if (!(fabs(states[i - STATES_BEGIN]) <= largest)) {
            *place = i;
            return false;
        }
    }
    return true;
}

static bool settled(const double old[], const double new[]) {
    for (size_t i = STATES_BEGIN; i < STATES_END; ++i) {
        const size_t k = i - STATES_BEGIN;
        const double magnitude = fmax(VARIABLES[i].nominal, fabs(new[k]));
        if (!(fabs(new[k] - old[k]) <= TRIM_TOLERANCE * magnitude)) return false;
    }
    return true;
}

/* Number of Newton iterations to steady motion, which replaces the states; 0 if there is none to be found. */
static int trim(Instance *self, Work *work) {
    double now[STATE_COUNT + 1], next[STATE_COUNT + 1];
    const double *arguments[] = {now, self->value + INPUTS_BEGIN, self->value + PARAMETERS_BEGIN};
    double *results[] = {next};
    memcpy(now, self->value + STATES_BEGIN, STATE_BYTES);
    for (int iteration = 1; iteration <= TRIM_ITERATIONS; ++iteration) {
        model_trim_step(arguments, results, work->integers, work->reals, 0);
        if (settled(now, next)) {
            memcpy(self->value + STATES_BEGIN, next, STATE_BYTES);
            return iteration;
        }
        memcpy(now, next, STATE_BYTES);
    }
    return 0;
}

static bool trim_wanted(const Instance *self) { return TRIM_SWITCH != TIME && self->value[TRIM_SWITCH] != 0; }

/* Initial states from the parameters; returns the iterations of the search for steady motion (0: not found). */
static int find_initial_states(Instance *self) {
    Work work;
    const double *arguments[] = {self->value + PARAMETERS_BEGIN};
    double *results[] = {self->value + STATES_BEGIN};
    model_initial(arguments, results, work.integers, work.reals, 0);
    self->stale = (self->stale & ~(unsigned)STALE_STATES) | STALE_RATES | STALE_OUTPUTS;
    return trim_wanted(self) ? trim(self, &work) : 0;
}

/* A line in the log for each cause that lowers validity, the first time that it is seen in the outputs. */
static void report_range(Instance *self) {
    if (!(self->mode & SIMULATED)) return;
    for (int i = 0; i < VALIDITY_FACTOR_COUNT; ++i) {
        const unsigned factor = VALIDITY_FACTORS[i];
        if (self->left_range[i] || !(self->value[factor] < 1)) continue;
        self->left_range[i] = true;
        report(self, WARNING, "at %g s the model leaves the range in which it holds: %s = %g", self->value[TIME],
               VARIABLES[factor].name, self->value[factor]);
    }
}

/* Calculate what of `parts` is stale. */
void refresh(Instance *self, unsigned parts) {
    Work work;
    const double *arguments[] = {self->value + STATES_BEGIN, self->value + INPUTS_BEGIN,
                                 self->value + PARAMETERS_BEGIN};
    double *rates[] = {self->value + RATES_BEGIN};
    double *outputs[] = {self->value + OUTPUTS_BEGIN};
    double *constants[] = {self->constant};
    if (self->stale & STALE_STATES) find_initial_states(self);
    if (self->stale & parts & STALE_CONSTANTS) {
        model_constants(&arguments[2], constants, work.integers, work.reals, 0);
        self->stale &= ~(unsigned)STALE_CONSTANTS;
    }
    if (self->stale & parts & STALE_RATES) {
        model_rates(arguments, rates, work.integers, work.reals, 0);
        self->stale &= ~(unsigned)STALE_RATES;
    }
    if (self->stale & parts & STALE_OUTPUTS) {
        model_outputs(arguments, outputs, work.integers, work.reals, 0);
        self->stale &= ~(unsigned)STALE_OUTPUTS;
        report_range(self);
    }
}

Status set_experiment(Instance *self, double start, bool stop_defined, double stop) {
    if (!isfinite(start)) return report(self, ERROR, "the start time cannot be %g", start);
    if (stop_defined && !(isfinite(stop) && stop >= start)) {
        return report(self, ERROR, "the stop time %g lies before the start time %g", stop, start);
    }
    self->value[TIME] = start;
    self->stop_defined = stop_defined;
    self->stop_time = stop_defined ? stop : 0;
    return OK;
}

/* Calculates the states for good and ends the initialisation, unless they are not finite. */
Status finish_initialisation(Instance *self) {
    size_t place;
    const int iterations = find_initial_states(self);
    if (!plausible_states(self->value + STATES_BEGIN, &place)) {
        self->stale |= STALE_STATES;
        return report(self, DISCARD, "%s is not finite at the start (%g)", VARIABLES[place].name, self->value[place]);
    }
    self->mode = self->kind == CO_SIMULATION ? STEPPING : EVENT;
    if (!trim_wanted(self)) return OK;
    if (iterations == 0) {
        return report(self, WARNING, "no steady motion was found with these inputs: the start is as %s",
                      "the parameters initial.* give it");
    }
    report_event(self, "steady motion found in %d iterations", iterations);
    return OK;
}

static Status check_step(const Instance *self, double start, double size) {
    const double rounding = fmin(CLOCK_TOLERANCE * fmax(fabs(start), 1.0), size / 2);
    if (!(isfinite(size) && size > 0)) return report(self, ERROR, "a communication step of %g s cannot be done", size);
    if (!(fabs(start - self->value[TIME]) <= rounding)) {
        return report(self, ERROR, "the step is to start at %.17g s, but the time is %.17g s", start,
                      self->value[TIME]);
    }
    if (!(start + size > start && isfinite(start + size))) {
        return report(self, ERROR, "a communication step of %g s from %.17g s does not change the time", size, start);
    }
    if (self->stop_defined && start + size > self->stop_time + rounding) {
        return report(self, ERROR, "the step would end at %.17g s, after the stop time %.17g s", start + size,
                      self->stop_time);
    }
    if (size > MOST_STEPS * self->value[MAX_STEP]) {
        return report(self, ERROR, "a communication step of %g s is too long for %s = %g s", size,
                      VARIABLES[MAX_STEP].name, self->value[MAX_STEP]);
    }
    return OK;
}

/* The fewest equal steps, none longer than solver.max_step, into which a communication step is divided. */
static long internal_steps(const Instance *self, double size) {
    return (long)fmax(1, ceil(size / self->value[MAX_STEP] * (1 - STEP_COUNT_ROUNDING)));
}

static void advance(Instance *self, Work *work, const double from[], double step, double to[]) {
    const double *arguments[] = {from, self->value + INPUTS_BEGIN, self->value + PARAMETERS_BEGIN, self->constant,
                                 &step};
    double *results[] = {to};
    model_step(arguments, results, work->integers, work->reals, 0);
}

static void arrive(Instance *self, const double states[], double time) {
    memcpy(self->value + STATES_BEGIN, states, STATE_BYTES);
    self->value[TIME] = time;
    self->stale |= STALE_RATES | STALE_OUTPUTS;
}

/* The input or parameter that is furthest from its start, in its usual size: the likeliest cause of a motion without
 * bounds; TIME if none has been changed. */
static size_t furthest_from_start(const Instance *self) {
    size_t found = TIME;
    double most = 0;
    for (size_t i = INPUTS_BEGIN; i < PARAMETERS_END; ++i) {
        const double usual = fmax(VARIABLES[i].nominal, fabs(VARIABLES[i].start));
        const double distance = fabs(self->value[i] - VARIABLES[i].start) / usual;
        if (distance > most) {
            most = distance;
            found = i;
        }
    }
    return found;
}

static Status diverged(const Instance *self, size_t place, double reached, double start, double size) {
    const size_t cause = furthest_from_start(self);
    const char *what = isfinite(reached) ? "leaves all bounds" : "is not finite";
    if (cause == TIME) {
        return report(self, DISCARD,
                      "%s %s (%g) in the step from %g s to %g s, with every input and parameter at its start value",
                      VARIABLES[place].name, what, reached, start, start + size);
    }
    return report(self, DISCARD, "%s %s (%g) in the step from %g s to %g s; furthest from its start value is %s = %g",
                  VARIABLES[place].name, what, reached, start, start + size, VARIABLES[cause].name,
                  self->value[cause]);
}

/* If it fails, nothing has changed. */
static Status integrate(Instance *self, double start, double size) {
    Work work;
    double path[2][STATE_COUNT + 1];
    const double *at = self->value + STATES_BEGIN;
    const long count = internal_steps(self, size);
    size_t place;
    for (long i = 0; i < count; ++i) {
        advance(self, &work, at, size / (double)count, path[i & 1]);
        at = path[i & 1];
        if ((i + 1) % STEPS_BETWEEN_CHECKS == 0 && !plausible_states(at, &place)) break;
    }
    if (!plausible_states(at, &place)) return diverged(self, place, at[place - STATES_BEGIN], start, size);
    arrive(self, at, start + size);
    return OK;
}

/* The same with an intermediate update after each internal step, in which the simulator may set inputs and ask to end
 * early; if it fails, states and time are as they were before. */
static Status integrate_in_view(Instance *self, double start, double size) {
    Work work;
    double before[STATE_COUNT + 1], next[STATE_COUNT + 1];
    const long count = internal_steps(self, size);
    const double step = size / (double)count, begun = self->value[TIME];
    double now = start, end = start + size;
    size_t place;
    memcpy(before, self->value + STATES_BEGIN, STATE_BYTES);
    for (long i = 1; now < end; ++i) {
        const double regular = i < count ? start + (double)i * step : start + size;
        double asked;
        advance(self, &work, self->value + STATES_BEGIN, regular <= end ? step : end - now, next);
        if (!plausible_states(next, &place)) {
            arrive(self, before, begun);
            return diverged(self, place, next[place - STATES_BEGIN], start, size);
        }
        asked = now = fmin(regular, end);
        arrive(self, next, now);
        self->mode = UPDATING;
        if (self->host.show(self, self->host.may_end_early && now < end, &asked)) {
            end = isfinite(asked) ? fmin(end, fmax(now, asked)) : now;
        }
        self->mode = STEPPING;
    }
    return OK;
}

/* Integrates over `size` and leaves the time it has come to in value[TIME]. */
Status do_step(Instance *self, double start, double size) {
    self->last_step = check_step(self, start, size);
    if (self->last_step != OK) return self->last_step;
    if (self->stale & STALE_CONSTANTS) refresh(self, STALE_CONSTANTS);
    self->last_step = self->host.show ? integrate_in_view(self, start, size) : integrate(self, start, size);
    return self->last_step;
}
