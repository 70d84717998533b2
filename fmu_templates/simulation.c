/* Solving the equations: initial states, derivatives and outputs, integration over a communication step. */
#include "instance.h"

#include <math.h>
#include <string.h>

/* Steady motion is found when Newton's method moves no state by more than this share of its magnitude. */
static const double TRIM_TOLERANCE = 1e-10;
enum { TRIM_ITERATIONS = 50 };

/* H = 1 s with steps of 0.1 s shall be ten steps, although H / 0.1 may come out as 10.000000000000002. */
static const double STEP_COUNT_ROUNDING = 1e-9;
static const double MOST_STEPS = 1e9;

static const size_t STATE_BYTES = (STATES_END - STATES_BEGIN) * sizeof(double);

/* The values of a range are all finite, or the place of the first that is not. */
static bool finite_states(const double states[], size_t *place) {
    for (size_t i = STATES_BEGIN; i < STATES_END; ++i) {
        if (!isfinite(states[i - STATES_BEGIN])) {
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
static int trim(Instance *self) {
    double *states = self->value + STATES_BEGIN;
    const double *arguments[] = {self->next[0], self->value + INPUTS_BEGIN, self->value + PARAMETERS_BEGIN};
    double *results[] = {self->next[1]};
    memcpy(self->next[0], states, STATE_BYTES);
    for (int iteration = 1; iteration <= TRIM_ITERATIONS; ++iteration) {
        model_trim_step(arguments, results, self->integer_work, self->work, 0);
        if (settled(self->next[0], self->next[1])) {
            memcpy(states, self->next[1], STATE_BYTES);
            return iteration;
        }
        memcpy(self->next[0], self->next[1], STATE_BYTES);
    }
    return 0;
}

static bool trim_wanted(const Instance *self) { return TRIM_SWITCH != TIME && self->value[TRIM_SWITCH] != 0; }

/* Initial states from the parameters; returns the iterations of the search for steady motion (0: not found). */
static int find_initial_states(Instance *self) {
    const double *arguments[] = {self->value + PARAMETERS_BEGIN};
    double *results[] = {self->value + STATES_BEGIN};
    model_initial(arguments, results, self->integer_work, self->work, 0);
    self->stale = (self->stale & ~(unsigned)STALE_STATES) | STALE_RATES | STALE_OUTPUTS;
    return trim_wanted(self) ? trim(self) : 0;
}

/* Calculate what of `parts` is stale. */
void refresh(Instance *self, unsigned parts) {
    const double *arguments[] = {self->value + STATES_BEGIN, self->value + INPUTS_BEGIN,
                                 self->value + PARAMETERS_BEGIN};
    double *rates[] = {self->value + RATES_BEGIN};
    double *outputs[] = {self->value + OUTPUTS_BEGIN};
    if (self->stale & STALE_STATES) find_initial_states(self);
    if (self->stale & parts & STALE_RATES) {
        model_rates(arguments, rates, self->integer_work, self->work, 0);
        self->stale &= ~(unsigned)STALE_RATES;
    }
    if (self->stale & parts & STALE_OUTPUTS) {
        model_outputs(arguments, outputs, self->integer_work, self->work, 0);
        self->stale &= ~(unsigned)STALE_OUTPUTS;
    }
}

Status set_experiment(Instance *self, double start, bool stop_defined, double stop) {
    if (!isfinite(start)) return report(self, ERROR, "the start time cannot be %g", start);
    if (stop_defined && !(isfinite(stop) && stop >= start)) {
        return report(self, ERROR, "the stop time %g lies before the start time %g", stop, start);
    }
    self->value[TIME] = start;
    self->stop_defined = stop_defined;
    self->stop_time = stop;
    return OK;
}

/* Calculates the states for good and ends the initialisation, unless they are not finite. */
Status finish_initialisation(Instance *self) {
    size_t place;
    const int iterations = find_initial_states(self);
    if (!finite_states(self->value + STATES_BEGIN, &place)) {
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
    const double rounding = 1e-6 * size + 1e-12 * fabs(start);
    if (!(isfinite(size) && size > 0)) return report(self, ERROR, "a communication step of %g s cannot be done", size);
    if (!(fabs(start - self->value[TIME]) <= rounding)) {
        return report(self, ERROR, "the step is to start at %.17g s, but the time is %.17g s", start, self->value[TIME]);
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

/* Integrates over `size` in equal steps, none longer than solver.max_step; if that fails, nothing has changed. */
Status do_step(Instance *self, double start, double size) {
    const double *arguments[] = {self->value + STATES_BEGIN, self->value + INPUTS_BEGIN,
                                 self->value + PARAMETERS_BEGIN, NULL};
    double *results[1], count, step;
    size_t place;
    self->last_step = check_step(self, start, size);
    if (self->last_step != OK) return self->last_step;
    count = fmax(1, ceil(size / self->value[MAX_STEP] * (1 - STEP_COUNT_ROUNDING)));
    step = size / count;
    arguments[3] = &step;
    for (long i = 0; i < (long)count; ++i) {
        results[0] = self->next[i & 1];
        model_step(arguments, results, self->integer_work, self->work, 0);
        arguments[0] = results[0];
    }
    if (!finite_states(arguments[0], &place)) {
        self->last_step = report(self, DISCARD, "%s is not finite at the end of the step from %g s to %g s",
                                 VARIABLES[place].name, start, start + size);
        return DISCARD;
    }
    memcpy(self->value + STATES_BEGIN, arguments[0], STATE_BYTES);
    self->value[TIME] = start + size;
    self->stale |= STALE_RATES | STALE_OUTPUTS;
    return OK;
}
