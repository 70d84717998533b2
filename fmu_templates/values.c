/* Reading and setting variables by value reference. */
#include "instance.h"

#include <math.h>

bool is_block(unsigned reference, unsigned begin, unsigned end) { return reference >= begin && reference < end; }

static bool is_input(unsigned reference) { return is_block(reference, INPUTS_BEGIN, INPUTS_END); }

static bool is_parameter(unsigned reference) { return is_block(reference, PARAMETERS_BEGIN, CLAMP_SWITCH + 1); }

/* May this variable be read or, if it is an input, set in an intermediate update? As in modelDescription.xml. */
bool can_update(unsigned reference) {
    if (reference == TIME || reference >= INDICATORS_BEGIN || is_parameter(reference)) return false;
    return !VARIABLES[reference].boolean;
}

static Status check_reference(const Instance *self, unsigned reference, bool boolean) {
    if (reference >= VARIABLE_COUNT) {
        return report(self, ERROR, "there is no variable with value reference %u", reference);
    }
    if (VARIABLES[reference].boolean != boolean) {
        return report(self, ERROR, "%s is %s variable", VARIABLES[reference].name,
                      boolean ? "a real, not a Boolean" : "a Boolean, not a real");
    }
    return OK;
}

/* May this variable be set now? (FMI 2: 3.2.3 and 4.2.4, FMI 3: 2.3.) */
static Status check_settable(const Instance *self, unsigned reference, bool boolean) {
    const Variable *variable;
    const char *why;
    if (check_reference(self, reference, boolean) != OK) return ERROR;
    variable = &VARIABLES[reference];
    if (!is_input(reference) && !is_parameter(reference)) {
        why = "is calculated";
    } else if (self->mode & BEFORE_START) {
        return OK;
    } else if (self->mode == TERMINATED) {
        why = "cannot be set after the end";
    } else if (is_parameter(reference) && !variable->tunable) {
        why = "is a fixed parameter: it can be set only before initialisation ends";
    } else if (self->mode == CONTINUOUS_TIME && (boolean || is_parameter(reference))) {
        why = "is not continuous: in Model Exchange it can be set only in event mode";
    } else if (self->mode == UPDATING && (boolean || is_parameter(reference))) {
        why = "is not continuous: it cannot be set in an intermediate update";
    } else {
        return OK;
    }
    return report(self, ERROR, "%s %s", variable->name, why);
}

static unsigned part_of(unsigned reference) {
    if (reference >= OUTPUTS_BEGIN) return STALE_OUTPUTS;
    if (reference >= RATES_BEGIN) return STALE_RATES;
    if (is_block(reference, STATES_BEGIN, STATES_END)) return STALE_STATES;
    return 0;
}

static Status get_real(Instance *self, unsigned reference, double *value) {
    const unsigned part = part_of(reference);
    if (self->stale & part) refresh(self, part);
    *value = self->value[reference];
    if (isfinite(*value)) return OK;
    return report(self, DISCARD, "%s is not finite (%g)", VARIABLES[reference].name, *value);
}

Status get_reals(Instance *self, const unsigned references[], size_t count, double values[]) {
    for (size_t i = 0; i < count; ++i) {
        Status status = check_reference(self, references[i], false);
        if (status == OK) status = get_real(self, references[i], &values[i]);
        if (status != OK) return status;
    }
    return OK;
}

/* What depends on inputs and parameters; the states too while they are still calculated from parameters. */
static void mark_stale(Instance *self, unsigned set) {
    self->stale |= STALE_RATES | STALE_OUTPUTS;
    if (is_parameter(set)) self->stale |= STALE_CONSTANTS;
    if (self->mode & BEFORE_START) self->stale |= STALE_STATES;
}

/* Parameters and inputs keep to their bounds, beyond which the equations mean nothing. */
static bool within_bounds(unsigned reference, double value) {
    const Variable *variable = &VARIABLES[reference];
    if (!is_parameter(reference) && !is_input(reference)) return true;
    return value >= variable->minimum && value <= variable->maximum;
}

static bool clamps(const Instance *self, unsigned reference) {
    return is_input(reference) && self->value[CLAMP_SWITCH] != 0;
}

/* An input at its nearer bound if it is beyond, with a line in the log the first time. */
static double clamped(Instance *self, unsigned reference, double value) {
    const Variable *variable = &VARIABLES[reference];
    const double held = fmin(fmax(value, variable->minimum), variable->maximum);
    bool *logged = &self->clamped[reference - INPUTS_BEGIN];
    if (!*logged) {
        report(self, WARNING, "%s = %g is held at %g: it lies between %g and %g", variable->name, value, held,
               variable->minimum, variable->maximum);
        *logged = true;
    }
    return held;
}

/* Sets all of the variables or, if one of them cannot be set, none. */
Status set_reals(Instance *self, const unsigned references[], size_t count, const double values[]) {
    for (size_t i = 0; i < count; ++i) {
        if (check_settable(self, references[i], false) != OK) return ERROR;
        if (!isfinite(values[i])) {
            return report(self, DISCARD, "%s cannot be set to %g", VARIABLES[references[i]].name, values[i]);
        }
        if (references[i] == MAX_STEP && !(values[i] > 0)) {
            return report(self, DISCARD, "%s must be positive", VARIABLES[MAX_STEP].name);
        }
        if (!within_bounds(references[i], values[i]) && !clamps(self, references[i])) {
            return report(self, DISCARD, "%s cannot be set to %g: it lies between %g and %g",
                          VARIABLES[references[i]].name, values[i], VARIABLES[references[i]].minimum,
                          VARIABLES[references[i]].maximum);
        }
    }
    for (size_t i = 0; i < count; ++i) {
        const bool within = within_bounds(references[i], values[i]);
        self->value[references[i]] = within ? values[i] : clamped(self, references[i], values[i]);
        mark_stale(self, references[i]);
    }
    return OK;
}

Status get_boolean(Instance *self, unsigned reference, bool *value) {
    Status status = check_reference(self, reference, true);
    if (status == OK) *value = self->value[reference] != 0;
    return status;
}

Status check_boolean(Instance *self, unsigned reference) { return check_settable(self, reference, true); }

void set_boolean(Instance *self, unsigned reference, bool value) {
    self->value[reference] = value ? 1.0 : 0.0;
    mark_stale(self, reference);
}

/* Answer to a call for variables of a type that the model has none of. */
Status no_such_type(const Instance *self, const char *type, const unsigned references[], size_t count) {
    if (count == 0) return OK;
    if (!references) return report(self, ERROR, "the value references are a null pointer");
    if (references[0] >= VARIABLE_COUNT) return check_reference(self, references[0], false);
    return report(self, ERROR, "%s is not of type %s", VARIABLES[references[0]].name, type);
}

/* Values of a whole block: continuous states, or their derivatives. */
Status get_block(Instance *self, size_t begin, size_t end, double values[]) {
    for (size_t i = begin; i < end; ++i) {
        Status status = get_real(self, (unsigned)i, &values[i - begin]);
        if (status != OK) return status;
    }
    return OK;
}

Status set_states(Instance *self, const double values[]) {
    for (size_t i = STATES_BEGIN; i < STATES_END; ++i) {
        if (!isfinite(values[i - STATES_BEGIN])) {
            return report(self, DISCARD, "%s cannot be set to %g", VARIABLES[i].name, values[i - STATES_BEGIN]);
        }
    }
    for (size_t i = STATES_BEGIN; i < STATES_END; ++i) self->value[i] = values[i - STATES_BEGIN];
    self->stale |= STALE_RATES | STALE_OUTPUTS;
    return OK;
}

Status set_time(Instance *self, double time) {
    if (!isfinite(time)) return report(self, ERROR, "time cannot be set to %g", time);
    self->value[TIME] = time;
    return OK;
}
