/* Partial derivatives: forward (directional) and reverse (adjoint), by the generated functions; those by time. */
#include "instance.h"

#include <math.h>
#include <string.h>

/* Before the start, the states are functions of parameters and inputs, not knowns of their own. */
static bool before_start(const Instance *self) { return (self->mode & BEFORE_START) != 0; }

static bool is_state(unsigned reference) { return is_block(reference, STATES_BEGIN, STATES_END); }

static bool is_known(const Instance *self, unsigned reference) {
    if (reference >= RATES_BEGIN || VARIABLES[reference].boolean) return false;
    return !(before_start(self) && is_state(reference));
}

static bool is_unknown(unsigned reference) {
    return is_state(reference) || is_block(reference, RATES_BEGIN, OUTPUTS_END);
}

static Status refuse(const Instance *self, unsigned reference, const char *why) {
    return report(self, ERROR, "%s (value reference %u) %s",
                  reference < VARIABLE_COUNT ? VARIABLES[reference].name : "no variable", reference, why);
}

static Status check_roles(const Instance *self, const unsigned unknowns[], size_t unknown_count,
                          const unsigned knowns[], size_t known_count) {
    for (size_t i = 0; i < unknown_count; ++i) {
        if (!is_unknown(unknowns[i])) return refuse(self, unknowns[i], "is not a state, derivative or output");
    }
    for (size_t i = 0; i < known_count; ++i) {
        if (!is_known(self, knowns[i])) return refuse(self, knowns[i], "is not a real variable to derive by now");
    }
    return OK;
}

static Status check_seed(const Instance *self, const unsigned references[], size_t count, const double seed[]) {
    for (size_t i = 0; i < count; ++i) {
        if (!isfinite(seed[i])) {
            return report(self, DISCARD, "the seed of %s cannot be %g", VARIABLES[references[i]].name, seed[i]);
        }
    }
    return OK;
}

static Status check_result(const Instance *self, const unsigned references[], size_t count, const double result[]) {
    for (size_t i = 0; i < count; ++i) {
        if (!isfinite(result[i])) {
            return report(self, DISCARD, "the derivative of or by %s is not finite (%g)", VARIABLES[references[i]].name,
                          result[i]);
        }
    }
    return OK;
}

/* Tangents of the initial states from those of inputs and parameters. */
static void initial_tangents(const Instance *self, Work *work, double tangent[]) {
    double moved[STATE_COUNT + 1];
    const double *initial[] = {self->value + PARAMETERS_BEGIN, tangent + PARAMETERS_BEGIN};
    const double *trimmed[] = {self->value + STATES_BEGIN, self->value + INPUTS_BEGIN, self->value + PARAMETERS_BEGIN,
                               moved, tangent + INPUTS_BEGIN, tangent + PARAMETERS_BEGIN};
    double *results[] = {tangent + STATES_BEGIN};
    model_initial_forward(initial, results, work->integers, work->reals, 0);
    if (TRIM_SWITCH == TIME || self->value[TRIM_SWITCH] == 0) return;
    /* Steady motion is a fixed point of the Newton step, which there depends on the steady states no more. */
    memcpy(moved, tangent + STATES_BEGIN, (STATES_END - STATES_BEGIN) * sizeof(double));
    model_trim_forward(trimmed, results, work->integers, work->reals, 0);
}

/* Fills the tangents of rates and outputs, and before the start those of the states, from those of the knowns. */
static void push_forward(const Instance *self, double tangent[]) {
    Work work;
    const double *arguments[] = {self->value + STATES_BEGIN, self->value + INPUTS_BEGIN,
                                 self->value + PARAMETERS_BEGIN, tangent + STATES_BEGIN,
                                 tangent + INPUTS_BEGIN, tangent + PARAMETERS_BEGIN};
    double *results[] = {tangent + RATES_BEGIN, tangent + OUTPUTS_BEGIN};
    if (before_start(self)) initial_tangents(self, &work, tangent);
    model_forward(arguments, results, work.integers, work.reals, 0);
}

Status directional_derivative(Instance *self, const unsigned unknowns[], size_t unknown_count,
                              const unsigned knowns[], size_t known_count, const double seed[], double result[]) {
    double tangent[VARIABLE_COUNT] = {0};
    Status status = check_roles(self, unknowns, unknown_count, knowns, known_count);
    if (status == OK) status = check_seed(self, knowns, known_count, seed);
    if (status != OK) return status;
    refresh(self, STALE_STATES);
    for (size_t i = 0; i < known_count; ++i) tangent[knowns[i]] += seed[i];
    push_forward(self, tangent);
    for (size_t i = 0; i < unknown_count; ++i) result[i] = tangent[unknowns[i]];
    return check_result(self, unknowns, unknown_count, result);
}

/* Adjoints before the start: rare, so one forward sweep for each known will do. */
static void initial_adjoints(const Instance *self, const unsigned unknowns[], size_t unknown_count,
                             const unsigned knowns[], size_t known_count, const double seed[], double result[]) {
    for (size_t k = 0; k < known_count; ++k) {
        double tangent[VARIABLE_COUNT] = {0};
        tangent[knowns[k]] = 1;
        push_forward(self, tangent);
        result[k] = 0;
        for (size_t i = 0; i < unknown_count; ++i) result[k] += seed[i] * tangent[unknowns[i]];
    }
}

static void pull_back(const Instance *self, const unsigned unknowns[], size_t unknown_count, const unsigned knowns[],
                      size_t known_count, const double seed[], double result[]) {
    Work work;
    double adjoint[VARIABLE_COUNT] = {0}, through[STATE_COUNT + 1];
    const double *arguments[] = {self->value + STATES_BEGIN, self->value + INPUTS_BEGIN,
                                 self->value + PARAMETERS_BEGIN, adjoint + RATES_BEGIN, adjoint + OUTPUTS_BEGIN};
    double *results[] = {through, adjoint + INPUTS_BEGIN, adjoint + PARAMETERS_BEGIN};
    for (size_t i = 0; i < unknown_count; ++i) adjoint[unknowns[i]] += seed[i];
    model_reverse(arguments, results, work.integers, work.reals, 0);
    /* A state that is itself an unknown has its own seed; what comes through the equations is added. */
    for (size_t i = STATES_BEGIN; i < STATES_END; ++i) adjoint[i] += through[i - STATES_BEGIN];
    for (size_t k = 0; k < known_count; ++k) result[k] = adjoint[knowns[k]];
}

Status adjoint_derivative(Instance *self, const unsigned unknowns[], size_t unknown_count, const unsigned knowns[],
                          size_t known_count, const double seed[], double result[]) {
    Status status = check_roles(self, unknowns, unknown_count, knowns, known_count);
    if (status == OK) status = check_seed(self, unknowns, unknown_count, seed);
    if (status != OK) return status;
    refresh(self, STALE_STATES);
    if (before_start(self)) {
        initial_adjoints(self, unknowns, unknown_count, knowns, known_count, seed, result);
    } else {
        pull_back(self, unknowns, unknown_count, knowns, known_count, seed, result);
    }
    return check_result(self, knowns, known_count, result);
}

/* dy/dt = dy/dx dx/dt of outputs (and states and rates) y, with the inputs held as they are between two steps. */
Status output_derivatives(Instance *self, const unsigned references[], size_t count, const int orders[],
                          double values[]) {
    double tangent[VARIABLE_COUNT] = {0};
    for (size_t i = 0; i < count; ++i) {
        if (!is_unknown(references[i])) return refuse(self, references[i], "is not a state, derivative or output");
        if (orders[i] != 1) return refuse(self, references[i], "has a derivative of order 1 and of no other");
    }
    refresh(self, STALE_RATES);
    memcpy(tangent + STATES_BEGIN, self->value + RATES_BEGIN, (STATES_END - STATES_BEGIN) * sizeof(double));
    push_forward(self, tangent);
    for (size_t i = 0; i < count; ++i) values[i] = tangent[references[i]];
    return check_result(self, references, count, values);
}
