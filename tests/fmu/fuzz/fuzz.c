/* Drives the functions of an FMU at random: sensible calls and nonsense, several instances, null pointers, values that
 * are not finite, wrong lengths, corrupt states. Compiled together with the sources of an FMU, with sanitizers.
 *
 *     fuzz SEED CALLS
 *
 * After each call: one that was refused (Error, Discard) has left the state as it was and logged one line, or none
 * where its category is not logged, next to warnings of what it calculates; numbers that came with OK are finite. The
 * first breach ends the program with the seed and the number of the call, which repeat it.
 */
#include "fuzz.h"

#include <float.h>
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static uint64_t random_state, seed;
static long call_number, lines, warnings, refusals, done[UPDATING + 1];
static void *taken[64];
static size_t taken_count;
bool inputs_set_inside;
void *states[SLOTS];

void must(bool holds, const char *function, const char *what) {
    if (holds) return;
    fprintf(stderr, "seed %llu, call %ld: %s: %s\n", (unsigned long long)seed, call_number, function, what);
    abort();
}

/* ---- chance ---- */

/* xorshift64*: Marsaglia (2003), Vigna (2016). */
static uint64_t next_random(void) {
    random_state ^= random_state >> 12;
    random_state ^= random_state << 25;
    random_state ^= random_state >> 27;
    return random_state * UINT64_C(2685821657736338717);
}

unsigned below(unsigned bound) { return (unsigned)((next_random() >> 33) % bound); }

bool chance(unsigned percent) { return below(100) < percent; }

static double uniform(void) { return (double)(next_random() >> 11) / 9007199254740992.0; }

double any_real(void) {
    static const double strange[] = {0, -0.0, 1, -1, 1e-300, DBL_MIN, 1e300, -1e300, DBL_MAX, 1e20, 5e-324};
    switch (below(8)) {
        case 0: return NAN;
        case 1: return chance(50) ? INFINITY : -INFINITY;
        case 2:
        case 3: return strange[below(sizeof strange / sizeof strange[0])];
        default: return 20 * uniform() - 10;
    }
}

unsigned any_reference(void) {
    if (chance(5)) return (unsigned)next_random();
    return below(VARIABLE_COUNT + 2);
}

/* An input, or any parameter. */
unsigned sound_reference(void) {
    if (INPUTS_END > INPUTS_BEGIN && chance(60)) return INPUTS_BEGIN + below(INPUTS_END - INPUTS_BEGIN);
    return PARAMETERS_BEGIN + below(MAX_STEP + 1 - PARAMETERS_BEGIN);
}

double sound_value(unsigned reference) {
    if (reference == MAX_STEP) return chance(90) ? 0.01 + uniform() : -any_real();
    if (reference >= VARIABLE_COUNT || chance(10)) return any_real();
    return VARIABLES[reference].start + VARIABLES[reference].nominal * (uniform() - 0.5);
}

double any_step(void) {
    static const double usual[] = {1e-6, 1e-3, 0.1, 0.1, 0.1, 0.37, 2.0};
    static const double strange[] = {0, -1, 1e300, 1e-300, 1e9};
    if (chance(90)) return usual[below(sizeof usual / sizeof usual[0])];
    return chance(20) ? NAN : strange[below(sizeof strange / sizeof strange[0])];
}

size_t any_count(void) { return chance(10) ? 0 : 1 + below(MOST_ELEMENTS); }

/* ---- arguments: arrays of exactly the length told, so that the sanitizer sees what lies outside ---- */

void *array(size_t count, size_t size) {
    void *made;
    if (chance(3)) return NULL;
    made = calloc(count ? count : 1, size);
    must(made != NULL && taken_count < sizeof taken / sizeof taken[0], "fuzz", "no memory");
    taken[taken_count++] = made;
    return made;
}

unsigned *references(size_t count) {
    unsigned *made = array(count, sizeof *made);
    const bool sound = chance(60);
    for (size_t i = 0; made && i < count; ++i) made[i] = sound ? sound_reference() : any_reference();
    return made;
}

double *reals(size_t count, const unsigned of[]) {
    double *made = array(count, sizeof *made);
    for (size_t i = 0; made && i < count; ++i) made[i] = of ? sound_value(of[i]) : any_real();
    return made;
}

void release_arrays(void) {
    while (taken_count > 0) free(taken[--taken_count]);
}

/* ---- what must hold ---- */

void line_logged(const char *category, const char *message) {
    must(category && *category && message && *message && !strchr(message, '\n'), message, "is not a line of a log");
    if (category && strcmp(category, "logStatusWarning") == 0) ++warnings;
    else ++lines;
}

Trial begun(Instance *instance, const char *function) {
    Trial trial = {.instance = instance, .function = function, .lines = lines};
    warnings = 0;
    if (!instance) return trial;
    trial.mode = instance->mode;
    trial.logged = instance->logged;
    trial.stale_states = (instance->stale & STALE_STATES) != 0;
    trial.stop_defined = instance->stop_defined;
    trial.stop_time = instance->stop_time;
    memcpy(trial.value, instance->value, sizeof trial.value);
    return trial;
}

static void check_unchanged(const Trial *trial) {
    const Instance *instance = trial->instance;
    must(instance->mode == trial->mode, trial->function, "refused, but the mode is another");
    must(instance->logged == trial->logged, trial->function, "refused, but other categories are logged");
    must(instance->stop_defined == trial->stop_defined, trial->function, "refused, but there is a stop time or none");
    must(memcmp(&instance->stop_time, &trial->stop_time, sizeof(double)) == 0, trial->function,
         "refused, but the stop time is another");
    for (unsigned i = 0; i < RATES_BEGIN; ++i) {
        if (trial->stale_states && is_block(i, STATES_BEGIN, STATES_END)) continue;
        if (inputs_set_inside && is_block(i, INPUTS_BEGIN, INPUTS_END)) continue;
        must(memcmp(&instance->value[i], &trial->value[i], sizeof(double)) == 0, trial->function,
             "refused, but a value is another");
    }
}

void ended(const Trial *trial, int status) {
    const long logged = lines - trial->lines;
    lines = trial->lines;
    must(status >= OK && status <= ERROR, trial->function, "no such status");
    must(warnings <= VALIDITY_FACTOR_COUNT + INPUTS_END - INPUTS_BEGIN + 1, trial->function, "a warning twice");
    if (!trial->instance) {
        must(status == ERROR && logged == 0, trial->function, "took a missing instance");
    } else if (status == ERROR || status == DISCARD) {
        const bool seen = (trial->logged & (status == ERROR ? LOG_ERROR : LOG_DISCARD)) != 0;
        ++refusals;
        must(logged == (seen ? 1 : 0), trial->function, "refused, but with no line or more than one in the log");
        check_unchanged(trial);
    } else {
        must(logged <= 1, trial->function, "more than one line in the log");
        ++done[trial->mode];
    }
}

void check_finite(const Trial *trial, int status, const double values[], size_t count) {
    for (size_t i = 0; status == OK && i < count; ++i) {
        must(isfinite(values[i]), trial->function, "OK, but a number is not finite");
    }
}

int main(int count, char *arguments[]) {
    Instance *instances[SLOTS] = {NULL};
    long calls;
    if (count != 3) return 2;
    seed = strtoull(arguments[1], NULL, 10);
    calls = atol(arguments[2]);
    random_state = seed * 2 + 1;
    for (int i = 0; i < 20; ++i) next_random();
    for (call_number = 0; call_number < calls; ++call_number) {
        Instance **slot = &instances[below(SLOTS)];
        if (!*slot) *slot = instantiate();
        if (*slot && below(2000) == 0) {
            free_one(*slot);
            *slot = NULL;
        } else if (*slot && chance(50)) {
            sound_call(*slot);
        } else {
            random_call(chance(98) ? *slot : NULL);
        }
        release_arrays();
    }
    for (int i = 0; i < SLOTS; ++i) drop_state(instances[i], &states[i]);
    for (int i = 0; i < SLOTS; ++i) free_one(instances[i]);
    printf("seed %llu: %ld calls, %ld refused; done", (unsigned long long)seed, calls, refusals);
    for (int mode = INSTANTIATED; mode <= UPDATING; mode *= 2) printf(" %ld", done[mode]);
    printf(" in the modes from instantiated to intermediate update\n");
    return 0;
}
