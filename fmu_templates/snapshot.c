/* The state of an instance as one flat piece of memory, which is also its serialised form. */
#include "instance.h"

#include <math.h>
#include <string.h>

enum { FORMAT_VERSION = 1, SAVED_COUNT = RATES_BEGIN }; /* what follows the parameters is calculated from them */
static const char FORMAT_NAME[8] = "t2s-fmu";

typedef struct {
    char format[8];
    int version;
    int length;
    char token[TOKEN_SIZE];
    int kind, mode;
    int stale_states, stop_defined;
    double stop_time;
    double value[SAVED_COUNT];
} Snapshot;

/* NULL if these are the bytes of a state that this instance can take, else what is wrong. */
static const char *fault(const Instance *self, const Snapshot *snapshot) {
    const int modes = self->kind == CO_SIMULATION ? INSTANTIATED | INITIALISING | STEPPING | TERMINATED
                                                  : ANY_MODE & ~STEPPING;
    if (memcmp(snapshot->format, FORMAT_NAME, sizeof FORMAT_NAME) != 0) return "are no state of such an FMU";
    if (snapshot->version != FORMAT_VERSION) return "have another version of the format";
    if (snapshot->length != (int)sizeof *snapshot) return "have another length";
    if (memcmp(snapshot->token, MODEL_TOKEN, TOKEN_SIZE) != 0) return "belong to another FMU";
    if (snapshot->kind != self->kind) return "belong to the other kind of instance (Model Exchange, Co-Simulation)";
    if ((snapshot->mode & modes) == 0 || (snapshot->mode & (snapshot->mode - 1)) != 0) return "are damaged";
    for (size_t i = 0; i < SAVED_COUNT; ++i) {
        const bool calculated_anew = snapshot->stale_states && i >= STATES_BEGIN && i < STATES_END;
        if (!calculated_anew && !isfinite(snapshot->value[i])) return "are damaged";
    }
    return NULL;
}

/* `*state` is NULL, or a state saved before, whose memory is used again. */
Status save_state(Instance *self, void **state) {
    Snapshot *snapshot = *state ? *state : self->host.allocate(1, sizeof *snapshot);
    if (!snapshot) return report(self, ERROR, "there is no memory for the state");
    memset(snapshot, 0, sizeof *snapshot);
    memcpy(snapshot->format, FORMAT_NAME, sizeof FORMAT_NAME);
    snapshot->version = FORMAT_VERSION;
    snapshot->length = (int)sizeof *snapshot;
    memcpy(snapshot->token, MODEL_TOKEN, TOKEN_SIZE);
    snapshot->kind = self->kind;
    snapshot->mode = self->mode;
    snapshot->stale_states = (self->stale & STALE_STATES) != 0;
    snapshot->stop_defined = self->stop_defined;
    snapshot->stop_time = self->stop_time;
    memcpy(snapshot->value, self->value, sizeof snapshot->value);
    *state = snapshot;
    return OK;
}

Status restore_state(Instance *self, const void *state) {
    const Snapshot *snapshot = state;
    const char *problem = fault(self, snapshot);
    if (problem) return report(self, ERROR, "these bytes %s", problem);
    self->mode = snapshot->mode;
    self->stale = STALE_RATES | STALE_OUTPUTS | (snapshot->stale_states ? STALE_STATES : 0);
    self->stop_defined = snapshot->stop_defined != 0;
    self->stop_time = snapshot->stop_time;
    self->last_step = OK;
    memcpy(self->value, snapshot->value, sizeof snapshot->value);
    return OK;
}

void free_state(const Instance *self, void **state) {
    if (*state) self->host.release(*state);
    *state = NULL;
}

size_t serialised_size(void) { return sizeof(Snapshot); }

Status serialise_state(Instance *self, const void *state, char bytes[], size_t size) {
    if (size < sizeof(Snapshot)) {
        return report(self, ERROR, "a serialised state needs %lu bytes, not %lu", (unsigned long)sizeof(Snapshot),
                      (unsigned long)size);
    }
    memcpy(bytes, state, sizeof(Snapshot));
    return OK;
}

Status deserialise_state(Instance *self, const char bytes[], size_t size, void **state) {
    Snapshot snapshot;
    const char *problem = "have another length";
    if (size == sizeof snapshot) {
        memcpy(&snapshot, bytes, sizeof snapshot);
        problem = fault(self, &snapshot);
    }
    if (problem) return report(self, ERROR, "these bytes %s", problem);
    if (!*state) *state = self->host.allocate(1, sizeof snapshot);
    if (!*state) return report(self, ERROR, "there is no memory for the state");
    memcpy(*state, &snapshot, sizeof snapshot);
    return OK;
}
