/* Random calls of the functions of FMI 3.0; fuzz3_absent.c has those for what the model has none of. */
#include "fmi3Functions.h"

#include <float.h>
#include <stdlib.h>
#include <string.h>

#include "fuzz.h"
#include "fuzz3.h"

static Instance *in_update; /* the instance whose step is being done */

static void logger(fmi3InstanceEnvironment environment, fmi3Status status, fmi3String category, fmi3String message) {
    (void)environment, (void)status;
    line_logged(category, message);
}

/* In an intermediate update some calls are allowed; the others must be refused without harm. */
static void update(fmi3InstanceEnvironment environment, fmi3Float64 time, fmi3Boolean may_set, fmi3Boolean may_get,
                   fmi3Boolean finished, fmi3Boolean may_end, fmi3Boolean *end_asked, fmi3Float64 *end_time) {
    Instance *c = in_update;
    unsigned reference = sound_reference();
    double value = sound_value(reference);
    int order = 1;
    fmi3Boolean flags[3];
    (void)environment, (void)may_set;
    must(may_get && finished && time == c->value[TIME], "intermediate update", "is not at the time of the instance");
    switch (below(40)) {
        case 0: TRY(c, fmi3DoStep(c, time, 0.1, fmi3True, &flags[0], &flags[1], &flags[2], &value)); break;
        case 1: TRY(c, fmi3Reset(c)); break;
        case 2: {
            const Trial trial = begun(c, "fmi3FreeInstance");
            fmi3FreeInstance(c);
            ended(&trial, ERROR);
            break;
        }
        case 3: TRY(c, fmi3SetFMUState(c, states[0])); break;
        case 4: TRY(c, fmi3Terminate(c)); break;
        case 5:
            inputs_set_inside = true;
            TRY(c, fmi3SetFloat64(c, &reference, 1, &value, 1));
            break;
        case 6:
            reference = OUTPUTS_BEGIN;
            TRY_READING(c, fmi3GetFloat64(c, &reference, 1, &value, 1), &value, 1);
            break;
        case 7:
            reference = RATES_BEGIN;
            TRY_READING(c, fmi3GetOutputDerivatives(c, &reference, 1, &order, &value, 1), &value, 1);
            break;
        default: break;
    }
    if (chance(5)) {
        *end_asked = fmi3True;
        *end_time = chance(50) ? any_real() : time + 0.03;
    } else if (!may_end) {
        *end_asked = fmi3False;
    }
}

static void step_once(Instance *c, double start, double size) {
    fmi3Boolean *flags = array(3, sizeof *flags);
    double *reached = array(1, sizeof *reached), before = c ? c->value[TIME] : 0;
    const Trial trial = begun(c, "fmi3DoStep");
    int status;
    in_update = c;
    inputs_set_inside = false;
    status = (int)fmi3DoStep(c, start, size, fmi3True, flags, flags ? flags + 1 : NULL, flags ? flags + 2 : NULL,
                             reached);
    ended(&trial, status);
    inputs_set_inside = false;
    if (status != OK) return;
    must(*reached == c->value[TIME] && *reached > before, "fmi3DoStep", "has not moved time on");
    must(flags[2] == (*reached < start + size), "fmi3DoStep", "does not say truly whether it returned early");
}

Instance *instantiate(void) {
    const char *token = chance(3) ? (chance(50) ? NULL : "{%s%n}") : MODEL_TOKEN;
    const char *name = chance(3) ? (chance(50) ? NULL : "") : "ship %d #r1#";
    const size_t count = chance(70) ? 0 : any_count();
    unsigned *required = chance(80) ? array(count, sizeof *required) : references(count);
    for (size_t i = 0; required && chance(90) && i < count; ++i) required[i] = STATES_BEGIN;
    if (chance(2)) {
        must(!fmi3InstantiateScheduledExecution(name, token, NULL, false, true, NULL, logger, NULL, NULL, NULL),
             "fmi3InstantiateScheduledExecution", "made an instance");
    }
    if (chance(50)) return fmi3InstantiateModelExchange(name, token, NULL, false, chance(50), NULL, logger);
    return fmi3InstantiateCoSimulation(name, token, NULL, false, chance(50), chance(2), chance(50), required, count,
                                       NULL, logger, chance(50) ? update : NULL);
}

void free_one(Instance *instance) { fmi3FreeInstance(instance); }

void drop_state(Instance *instance, void **state) {
    if (*state && instance) fmi3FreeFMUState(instance, state);
    free(*state);
    *state = NULL;
}

static void save_and_restore(Instance *c) {
    void **state = &states[below(SLOTS)];
    size_t size = 0;
    unsigned char *bytes;
    switch (below(5)) {
        case 0: TRY(c, fmi3GetFMUState(c, chance(95) ? state : NULL)); break;
        case 1: TRY(c, fmi3SetFMUState(c, chance(95) ? *state : NULL)); break;
        case 2: TRY(c, fmi3FreeFMUState(c, chance(95) ? state : NULL)); break;
        default:
            TRY(c, fmi3SerializedFMUStateSize(c, *state, chance(95) ? &size : NULL));
            if (!c || !*state || !size) break;
            bytes = array(size, 1);
            TRY(c, fmi3SerializeFMUState(c, *state, bytes, chance(90) ? size : size / 2));
            if (!bytes) break;
            if (fmi3SerializeFMUState(c, *state, bytes, size) != fmi3OK) must(false, "fmi3SerializeFMUState", "failed");
            if (chance(50)) {
                void *made = NULL;
                const Trial trial = begun(c, "fmi3DeserializeFMUState of damaged bytes");
                bytes[below((unsigned)size)] ^= (unsigned char)(1u << below(8));
                ended(&trial, (int)fmi3DeserializeFMUState(c, bytes, size, &made));
                must(!made, trial.function, "made a state");
            } else {
                TRY(c, fmi3DeserializeFMUState(c, bytes, chance(90) ? size : size - 1, state));
            }
    }
}

static size_t nearly(size_t count) { return chance(95) ? count : count + 1 - below(3); }

/* Seeds, at times all of them finite and so large that what comes of them is not. */
static double *seeds(size_t count) {
    double *made = reals(count, NULL);
    const bool large = chance(40);
    for (size_t i = 0; made && large && i < count; ++i) made[i] = chance(50) ? DBL_MAX : -DBL_MAX;
    return made;
}

static void derive(Instance *c) {
    const size_t unknown_count = any_count(), known_count = any_count();
    unsigned *unknown = references(unknown_count), *known = references(known_count);
    int *orders = array(unknown_count, sizeof *orders);
    double *of_knowns = seeds(known_count), *of_unknowns = seeds(unknown_count);
    for (size_t i = 0; unknown && i < unknown_count && chance(90); ++i) {
        unknown[i] = RATES_BEGIN + below(OUTPUTS_END - RATES_BEGIN);
    }
    for (size_t i = 0; orders && i < unknown_count; ++i) orders[i] = chance(97) ? 1 : (int)below(5) - 2;
    switch (below(3)) {
        case 0:
            TRY_READING(c, fmi3GetDirectionalDerivative(c, unknown, unknown_count, known, known_count, of_knowns,
                        nearly(known_count), of_unknowns, nearly(unknown_count)), of_unknowns, unknown_count);
            break;
        case 1:
            TRY_READING(c, fmi3GetAdjointDerivative(c, unknown, unknown_count, known, known_count, of_unknowns,
                        nearly(unknown_count), of_knowns, nearly(known_count)), of_knowns, known_count);
            break;
        default:
            TRY_READING(c, fmi3GetOutputDerivatives(c, unknown, unknown_count, orders, of_unknowns,
                        nearly(unknown_count)), of_unknowns, unknown_count);
    }
}

static void variables(Instance *c) {
    const size_t count = any_count();
    unsigned *chosen = references(count);
    double *values = reals(count, chosen);
    fmi3Boolean *flags = array(count, sizeof *flags);
    if (chance(30)) {
        TRY(c, fmi3SetFloat64(c, chosen, count, values, nearly(count)));
        return;
    }
    for (size_t i = 0; chosen && i < count && chance(95); ++i) chosen[i] = below(VARIABLE_COUNT);
    switch (below(8)) {
        case 0: TRY(c, fmi3SetBoolean(c, chosen, count, flags, nearly(count))); break;
        case 1: TRY(c, fmi3GetBoolean(c, chosen, count, flags, nearly(count))); break;
        case 2:
        case 3: typed_call(c, chosen, count); break;
        default: TRY_READING(c, fmi3GetFloat64(c, chosen, count, values, nearly(count)), values, count);
    }
}

static void life(Instance *c) {
    static const char *const known[] = {"logStatusError", "logAll", "logEvents", "none such", NULL, "%s%n"};
    const size_t count = any_count();
    fmi3String *categories = array(count, sizeof *categories);
    for (size_t i = 0; categories && i < count; ++i) categories[i] = known[below(chance(80) ? 3 : 6)];
    switch (below(11)) {
        case 0: must(strcmp(fmi3GetVersion(), "3.0") == 0, "fmi3GetVersion", fmi3GetVersion()); break;
        case 1: TRY(c, fmi3SetDebugLogging(c, chance(70), count, categories)); break;
        case 2:
            TRY(c, fmi3EnterInitializationMode(c, chance(50), any_real(), any_real(), chance(30), any_real()));
            break;
        case 3: TRY(c, fmi3ExitInitializationMode(c)); break;
        case 4:
            if (chance(5)) TRY(c, fmi3Terminate(c));
            break;
        case 5:
            if (chance(10)) TRY(c, fmi3Reset(c));
            break;
        case 6: TRY(c, fmi3EnterEventMode(c)); break;
        case 7: TRY(c, fmi3EnterContinuousTimeMode(c)); break;
        case 8: absent_call(c); break;
        default: save_and_restore(c);
    }
}

static void solve(Instance *c) {
    const size_t count = chance(80) ? STATE_COUNT : any_count(), events = chance(80) ? INDICATOR_COUNT : any_count();
    double *values = reals(count, NULL), *indicators = reals(events, NULL), *next = array(1, sizeof *next);
    fmi3Boolean *flags = array(5, sizeof *flags), *lost = chance(95) ? flags : NULL;
    size_t *number = array(1, sizeof *number);
    switch (below(11)) {
        case 0:
            if (flags) TRY(c, fmi3UpdateDiscreteStates(c, flags, flags + 1, flags + 2, lost, flags + 4, next));
            break;
        case 1: TRY(c, fmi3CompletedIntegratorStep(c, chance(50), flags, lost)); break;
        case 2: TRY(c, fmi3SetTime(c, any_real())); break;
        case 3:
            for (size_t i = 0; values && i < count && chance(98); ++i) values[i] = 10.0 / (1 + below(100));
            TRY(c, fmi3SetContinuousStates(c, values, count));
            break;
        case 4: TRY_READING(c, fmi3GetContinuousStateDerivatives(c, values, count), values, count); break;
        case 5: TRY_READING(c, fmi3GetContinuousStates(c, values, count), values, count); break;
        case 6: TRY_READING(c, fmi3GetNominalsOfContinuousStates(c, values, count), values, count); break;
        case 7: TRY_READING(c, fmi3GetEventIndicators(c, indicators, events), indicators, events); break;
        case 8: TRY(c, fmi3GetNumberOfEventIndicators(c, number)); break;
        case 9: TRY(c, fmi3GetNumberOfContinuousStates(c, number)); break;
        default: derive(c);
    }
}

void random_call(Instance *c) {
    switch (below(4)) {
        case 0: life(c); break;
        case 1: variables(c); break;
        case 2: solve(c); break;
        default: step_once(c, chance(50) || !c ? any_real() : c->value[TIME], any_step());
    }
}

/* What a simulator would do next. */
void sound_call(Instance *c) {
    fmi3Boolean flags[5];
    fmi3Float64 next;
    if (chance(30)) {
        variables(c);
        return;
    }
    switch (c->mode) {
        case INSTANTIATED: TRY(c, fmi3EnterInitializationMode(c, false, 0, below(3), chance(10), 1000)); break;
        case INITIALISING: TRY(c, fmi3ExitInitializationMode(c)); break;
        case STEPPING: step_once(c, c->value[TIME], any_step()); break;
        case EVENT:
            TRY(c, fmi3UpdateDiscreteStates(c, flags, flags + 1, flags + 2, flags + 3, flags + 4, &next));
            TRY(c, fmi3EnterContinuousTimeMode(c));
            break;
        case CONTINUOUS_TIME:
            TRY(c, fmi3SetTime(c, c->value[TIME] + 0.1));
            solve(c);
            break;
        default: TRY(c, fmi3Reset(c));
    }
}
