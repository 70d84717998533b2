/* The state of an instance as one flat piece of memory, which is also its serialised form. */
#include "instance.h"

#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

enum { FORMAT_VERSION = 2, SAVED_COUNT = RATES_BEGIN }; /* what follows the parameters is calculated from them */
static const char FORMAT_NAME[8] = "t2s-fmu";

typedef struct {
    char format[8];
    int32_t version, length;
    uint64_t checksum; /* of what follows */
    char token[TOKEN_SIZE];
    int32_t kind, mode, stale_states, stop_defined;
    double stop_time;
    double value[SAVED_COUNT];
} Snapshot;

/* FNV-1a with 64 bits (Fowler, Noll and Vo, RFC 9923): finds damage, and is not a protection against forgery. */
static uint64_t checksum_of(const Snapshot *snapshot) {
    const unsigned char *bytes = (const unsigned char *)snapshot;
    uint64_t sum = UINT64_C(14695981039346656037);
    for (size_t i = offsetof(Snapshot, token); i < sizeof *snapshot; ++i) {
        sum = (sum ^ bytes[i]) * UINT64_C(1099511628211);
    }
    return sum;
}

static bool possible_mode(int kind, int mode) {
    const int modes = BETWEEN_CALLS & ~(kind == CO_SIMULATION ? EVENT | CONTINUOUS_TIME : STEPPING);
    return (mode & modes) != 0 && (mode & (mode - 1)) == 0;
}

/* What is wrong with the beginning of a state, where its length is; NULL if nothing. */
static const char *fault_of_head(const Snapshot *snapshot) {
    if (memcmp(snapshot->format, FORMAT_NAME, sizeof FORMAT_NAME) != 0) return "is not a state of such an FMU";
    if (snapshot->version != FORMAT_VERSION) return "has another version of the format";
    if (snapshot->length != (int32_t)sizeof *snapshot) return "has another length";
    return NULL;
}

/* NULL if this is a state that this instance can take, else what is wrong. */
static const char *fault(const Instance *self, const Snapshot *snapshot) {
    const char *of_head = fault_of_head(snapshot);
    if (of_head) return of_head;
    if (memcmp(snapshot->token, MODEL_TOKEN, TOKEN_SIZE) != 0) return "belongs to another FMU";
    if (snapshot->checksum != checksum_of(snapshot)) return "is damaged: its checksum is not that of its bytes";
    if (snapshot->kind != self->kind) return "belongs to the other kind of instance (Model Exchange, Co-Simulation)";
    if (!possible_mode(snapshot->kind, snapshot->mode) || !isfinite(snapshot->stop_time)) return "is damaged";
    for (size_t i = 0; i < SAVED_COUNT; ++i) {
        const bool calculated_anew = snapshot->stale_states && is_block((unsigned)i, STATES_BEGIN, STATES_END);
        if (!calculated_anew && !isfinite(snapshot->value[i])) return "is damaged";
    }
    return NULL;
}

static Status refuse(const Instance *self, const char *problem) {
    return report(self, ERROR, "this state %s", problem);
}

/* `*state` is NULL, or a state saved before, whose memory is used again. */
Status save_state(Instance *self, void **state) {
    Snapshot *snapshot = *state;
    const char *problem = snapshot ? fault_of_head(snapshot) : NULL;
    if (problem) return refuse(self, problem);
    if (!snapshot) snapshot = malloc(sizeof *snapshot);
    if (!snapshot) return report(self, ERROR, "there is no memory for the state");
    memset(snapshot, 0, sizeof *snapshot);
    memcpy(snapshot->format, FORMAT_NAME, sizeof FORMAT_NAME);
    snapshot->version = FORMAT_VERSION;
    snapshot->length = (int32_t)sizeof *snapshot;
    memcpy(snapshot->token, MODEL_TOKEN, TOKEN_SIZE);
    snapshot->kind = self->kind;
    snapshot->mode = self->mode;
    snapshot->stale_states = (self->stale & STALE_STATES) != 0;
    snapshot->stop_defined = self->stop_defined;
    snapshot->stop_time = self->stop_time;
    memcpy(snapshot->value, self->value, sizeof snapshot->value);
    snapshot->checksum = checksum_of(snapshot);
    *state = snapshot;
    return OK;
}

Status restore_state(Instance *self, const void *state) {
    const Snapshot *snapshot = state;
    const char *problem = fault(self, snapshot);
    if (problem) return refuse(self, problem);
    self->mode = snapshot->mode;
    self->stale = STALE_ALL & ~(unsigned)(snapshot->stale_states ? 0 : STALE_STATES);
    self->stop_defined = snapshot->stop_defined != 0;
    self->stop_time = snapshot->stop_time;
    self->last_step = OK;
    memcpy(self->value, snapshot->value, sizeof snapshot->value);
    return OK;
}

void free_state(void **state) {
    free(*state);
    *state = NULL;
}

size_t serialised_size(void) { return sizeof(Snapshot); }

Status serialise_state(Instance *self, const void *state, char bytes[], size_t size) {
    const char *problem = fault_of_head(state);
    if (problem) return refuse(self, problem);
    if (size < sizeof(Snapshot)) {
        return report(self, ERROR, "a serialised state needs %lu bytes, not %lu", (unsigned long)sizeof(Snapshot),
                      (unsigned long)size);
    }
    memcpy(bytes, state, sizeof(Snapshot));
    return OK;
}

/* `*state` is written only if these are the bytes of a state; where it is one already, its memory is used again. */
Status deserialise_state(Instance *self, const char bytes[], size_t size, void **state) {
    Snapshot snapshot;
    const char *problem = *state ? fault_of_head(*state) : NULL;
    if (!problem && size != sizeof snapshot) problem = "has another length";
    if (!problem) {
        memcpy(&snapshot, bytes, sizeof snapshot);
        problem = fault(self, &snapshot);
    }
    if (problem) return refuse(self, problem);
    if (!*state) *state = malloc(sizeof snapshot);
    if (!*state) return report(self, ERROR, "there is no memory for the state");
    memcpy(*state, &snapshot, sizeof snapshot);
    return OK;
}
