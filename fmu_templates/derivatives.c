/* Partial derivatives: forward (directional) and reverse (adjoint), by the generated functions. */
#include "instance.h"

#include <math.h>
#include <string.h>

/* While the model is initialised, the states are functions of parameters and inputs, not knowns of their own. */
static bool initialising(const Instance *self) { return (self->mode & (INSTANTIATED | INITIALISING)) != 0; }

static bool is_known(const Instance *self, unsigned reference) {
    if (reference >= VARIABLE_COUNT || VARIABLES[reference].boolean) return false;
    if (initialising(self) && reference >= STATES_BEGIN && reference < STATES_END) return false;
    return reference < RATES_BEGIN;
}

static bool is_unknown(unsigned reference) {
    return reference < VARIABLE_COUNT && !VARIABLES[reference].boolean &&
           (reference >= RATES_BEGIN || (reference >= STATES_BEGIN && reference < STATES_END));
}

static Status check_roles(const Instance *self, const unsigned unknowns[], size_t unknown_count,
                          const unsigned knowns[], size_t known_count) {
    for (size_t i = 0; i < unknown_count; ++i) {
        if (!is_unknown(unknowns[i])) {
            return report(self, ERROR, "value reference %u is no state, derivative or output", unknowns[i]);
        }
    }
    for (size_t i = 0; i < known_count; ++i) {
        if (!is_known(self, knowns[i])) {
            return report(self, ERROR, "value reference %u is no real variable to derive by in this state", knowns[i]);
        }
    }
    return OK;
}

/* Tangents of the initial states from those of inputs and parameters. */
static void initial_tangents(Instance *self) {
    double *tangent = self->tangent;
    const double *initial[] = {self->value + PARAMETERS_BEGIN, tangent + PARAMETERS_BEGIN};
    const double *trimmed[] = {self->value + STATES_BEGIN, self->value + INPUTS_BEGIN, self->value + PARAMETERS_BEGIN,
                               self->next[0], tangent + INPUTS_BEGIN, tangent + PARAMETERS_BEGIN};
    double *results[] = {tangent + STATES_BEGIN};
    model_initial_forward(initial, results, self->integer_work, self->work, 0);
    if (TRIM_SWITCH == TIME || self->value[TRIM_SWITCH] == 0) return;
    /* Steady motion is a fixed point of the Newton step, which there depends on the steady states no more. */
    memcpy(self->next[0], tangent + STATES_BEGIN, (STATES_END - STATES_BEGIN) * sizeof(double));
    model_trim_forward(trimmed, results, self->integer_work, self->work, 0);
}

/* Fills self->tangent from the tangents of the knowns already there. */
static void push_forward(Instance *self) {
    double *tangent = self->tangent;
    const double *arguments[] = {self->value + STATES_BEGIN, self->value + INPUTS_BEGIN,
                                 self->value + PARAMETERS_BEGIN, tangent + STATES_BEGIN,
                                 tangent + INPUTS_BEGIN, tangent + PARAMETERS_BEGIN};
    double *results[] = {tangent + RATES_BEGIN, tangent + OUTPUTS_BEGIN};
    if (initialising(self)) initial_tangents(self);
    model_forward(arguments, results, self->integer_work, self->work, 0);
}

static void clear_tangents(Instance *self) {
    for (size_t i = 0; i < VARIABLE_COUNT; ++i) self->tangent[i] = 0;
}

static Status check_finite(const Instance *self, const unsigned references[], size_t count, const double result[]) {
    for (size_t i = 0; i < count; ++i) {
        if (!isfinite(result[i])) {
            return report(self, DISCARD, "the derivative of or by %s is not finite (%g)", VARIABLES[references[i]].name,
                          result[i]);
        }
    }
    return OK;
}

Status directional_derivative(Instance *self, const unsigned unknowns[], size_t unknown_count,
                              const unsigned knowns[], size_t known_count, const double seed[], double result[]) {
    if (check_roles(self, unknowns, unknown_count, knowns, known_count) != OK) return ERROR;
    refresh(self, STALE_STATES);
    clear_tangents(self);
    for (size_t i = 0; i < known_count; ++i) self->tangent[knowns[i]] += seed[i];
    push_forward(self);
    for (size_t i = 0; i < unknown_count; ++i) result[i] = self->tangent[unknowns[i]];
    return check_finite(self, unknowns, unknown_count, result);
}

/* Adjoints while initialising: rare, so one forward sweep for each known will do. */
static void initial_adjoints(Instance *self, const unsigned unknowns[], size_t unknown_count, const unsigned knowns[],
                             size_t known_count, const double seed[], double result[]) {
    for (size_t k = 0; k < known_count; ++k) {
        clear_tangents(self);
        self->tangent[knowns[k]] = 1;
        push_forward(self);
        result[k] = 0;
        for (size_t i = 0; i < unknown_count; ++i) result[k] += seed[i] * self->tangent[unknowns[i]];
    }
}

static void pull_back(Instance *self, const unsigned unknowns[], size_t unknown_count, const unsigned knowns[],
                      size_t known_count, const double seed[], double result[]) {
    double *adjoint = self->tangent;
    const double *arguments[] = {self->value + STATES_BEGIN,     self->value + INPUTS_BEGIN,
                                 self->value + PARAMETERS_BEGIN, adjoint + RATES_BEGIN,
                                 adjoint + OUTPUTS_BEGIN};
    double *results[] = {self->next[0], adjoint + INPUTS_BEGIN, adjoint + PARAMETERS_BEGIN};
    clear_tangents(self);
    for (size_t i = 0; i < unknown_count; ++i) adjoint[unknowns[i]] += seed[i];
    model_reverse(arguments, results, self->integer_work, self->work, 0);
    /* A state that is itself an unknown has its own seed; what comes through the equations is added. */
    for (size_t i = STATES_BEGIN; i < STATES_END; ++i) adjoint[i] += self->next[0][i - STATES_BEGIN];
    for (size_t k = 0; k < known_count; ++k) result[k] = adjoint[knowns[k]];
}

Status adjoint_derivative(Instance *self, const unsigned unknowns[], size_t unknown_count, const unsigned knowns[],
                          size_t known_count, const double seed[], double result[]) {
    if (check_roles(self, unknowns, unknown_count, knowns, known_count) != OK) return ERROR;
    refresh(self, STALE_STATES);
    if (initialising(self)) {
        initial_adjoints(self, unknowns, unknown_count, knowns, known_count, seed, result);
    } else {
        pull_back(self, unknowns, unknown_count, knowns, known_count, seed, result);
    }
    return check_finite(self, knowns, known_count, result);
}
