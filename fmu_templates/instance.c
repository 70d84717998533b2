/* Life of an instance, its log, and what may be called when. */
#include "instance.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const struct {
    const char *name;
    unsigned bits;
} CATEGORIES[] = {
    {"logStatusError", LOG_ERROR},
    {"logStatusDiscard", LOG_DISCARD},
    {"logStatusWarning", LOG_WARNING},
    {"logEvents", LOG_EVENTS},
    {"logAll", LOG_ALL},
};
enum { CATEGORY_COUNT = sizeof CATEGORIES / sizeof CATEGORIES[0] };

static void send(const Instance *self, Status status, unsigned category, const char *format, va_list arguments) {
    char message[512];
    if (!(self->logged & category) || !self->host.logger) return;
    vsnprintf(message, sizeof message, format, arguments);
    for (size_t i = 0; i < CATEGORY_COUNT; ++i) {
        if (CATEGORIES[i].bits == category) self->host.send(self, status, CATEGORIES[i].name, message);
    }
}

/* Report to the simulator why a call did not end with OK; returns `status`. */
Status report(const Instance *self, Status status, const char *format, ...) {
    static const unsigned category[] = {LOG_EVENTS, LOG_WARNING, LOG_DISCARD, LOG_ERROR};
    va_list arguments;
    va_start(arguments, format);
    send(self, status, category[status], format, arguments);
    va_end(arguments);
    return status;
}

void report_event(const Instance *self, const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    send(self, OK, LOG_EVENTS, format, arguments);
    va_end(arguments);
}

/* NULL if there is no memory, the kind is none, the name is missing, or the token is that of another FMU. */
Instance *create_instance(const Host *host, const char *name, const char *token, int kind, bool logging) {
    const char *called = name ? name : "";
    Instance *self = calloc(1, sizeof *self + strlen(called) + 1);
    if (!self) return NULL;
    self->host = *host;
    self->kind = kind;
    self->logged = logging ? LOG_ALL : LOG_ALL & ~(unsigned)LOG_EVENTS;
    strcpy(self->name, called);
    reset_instance(self);
    if ((kind & ANY_KIND) && *called && token && strcmp(token, MODEL_TOKEN) == 0) return self;
    if (!(kind & ANY_KIND)) {
        report(self, ERROR, "an instance can be of Model Exchange or of Co-Simulation, and of nothing else");
    } else if (!*called) {
        report(self, ERROR, "the instance name is missing");
    } else {
        report(self, ERROR, "the token is %s and must be %s, as in modelDescription.xml",
               token ? token : "missing", MODEL_TOKEN);
    }
    free_instance(self);
    return NULL;
}

void free_instance(Instance *self) {
    if (!self) return;
    if (self->mode == UPDATING) {
        report(self, ERROR, "an instance cannot be freed in an intermediate update: its step is still being done");
    } else {
        free(self);
    }
}

void reset_instance(Instance *self) {
    for (size_t i = 0; i < VARIABLE_COUNT; ++i) self->value[i] = VARIABLES[i].start;
    self->mode = INSTANTIATED;
    self->stale = STALE_ALL;
    self->stop_defined = false;
    self->last_step = OK;
    memset(self->left_range, 0, sizeof self->left_range);
    memset(self->clamped, 0, sizeof self->clamped);
}

static const char *mode_name(int mode) {
    switch (mode) {
        case INSTANTIATED: return "instantiated";
        case INITIALISING: return "initialization mode";
        case EVENT: return "event mode";
        case CONTINUOUS_TIME: return "continuous-time mode";
        case STEPPING: return "step mode";
        case UPDATING: return "intermediate update";
        default: return "terminated";
    }
}

bool refused(const Instance *self, const char *function, int modes, int kinds) {
    if (!self) return true;
    if (!(self->kind & kinds)) {
        report(self, ERROR, "%s: is not for %s", function,
               self->kind == CO_SIMULATION ? "Co-Simulation" : "Model Exchange");
        return true;
    }
    if (!(self->mode & modes)) {
        report(self, ERROR, "%s: cannot be called in state '%s'", function, mode_name(self->mode));
        return true;
    }
    return false;
}

bool missing(const Instance *self, const char *function, const char *argument, const void *array, size_t count) {
    if (array || count == 0) return false;
    report(self, ERROR, "%s: %s is a null pointer", function, argument);
    return true;
}

bool unfit(const Instance *self, const char *function, const char *argument, const void *array, size_t count,
           size_t expected) {
    if (count == expected) return missing(self, function, argument, array, count);
    report(self, ERROR, "%s: %s has %lu elements and must have %lu", function, argument, (unsigned long)count,
           (unsigned long)expected);
    return true;
}

Status unsupported(const Instance *self, const char *function, const char *why) {
    return self ? report(self, ERROR, "%s: %s", function, why) : ERROR;
}

/* Switch the named categories, or all if none is named. */
Status select_logging(Instance *self, bool on, size_t count, const char *const categories[]) {
    unsigned bits = count == 0 ? LOG_ALL : 0;
    for (size_t i = 0; i < count; ++i) {
        size_t known = 0;
        while (known < CATEGORY_COUNT && (!categories[i] || strcmp(categories[i], CATEGORIES[known].name) != 0)) {
            ++known;
        }
        if (known == CATEGORY_COUNT) {
            return report(self, ERROR, "there is no log category %s", categories[i] ? categories[i] : "NULL");
        }
        bits |= CATEGORIES[known].bits;
    }
    self->logged = on ? self->logged | bits : self->logged & ~bits;
    return OK;
}
