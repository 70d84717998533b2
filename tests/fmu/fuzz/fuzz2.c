/* Random calls of the functions of FMI 2.0. */
#include "fmi2Functions.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "fuzz.h"

static void logger(fmi2ComponentEnvironment environment, fmi2String name, fmi2Status status, fmi2String category,
                   fmi2String message, ...) {
    char text[2048];
    va_list arguments;
    (void)environment, (void)name, (void)status;
    va_start(arguments, message);
    vsnprintf(text, sizeof text, message, arguments);
    va_end(arguments);
    line_logged(category, text);
}

Instance *instantiate(void) {
    static const fmi2CallbackFunctions silent = {NULL, calloc, free, NULL, NULL};
    static const fmi2CallbackFunctions functions = {logger, calloc, free, NULL, NULL};
    const fmi2CallbackFunctions *given = chance(2) ? NULL : &functions;
    const char *token = chance(3) ? (chance(50) ? NULL : "{%s%n}") : MODEL_TOKEN;
    const char *name = chance(3) ? (chance(50) ? NULL : "") : "ship %d #r1#";
    const fmi2Type kind = chance(2) ? (fmi2Type)7 : chance(50) ? fmi2CoSimulation : fmi2ModelExchange;
    if (chance(1)) {
        fmi2Component quiet = fmi2Instantiate("quiet", fmi2CoSimulation, "?", NULL, &silent, fmi2False, fmi2True);
        must(!quiet, "fmi2Instantiate", "took a wrong token");
    }
    return fmi2Instantiate(name, kind, token, chance(50) ? NULL : "file:///%20", given, chance(50), chance(50));
}

void free_one(Instance *instance) { fmi2FreeInstance(instance); }

void drop_state(Instance *instance, void **state) {
    if (*state && instance) fmi2FreeFMUstate(instance, state);
    free(*state);
    *state = NULL;
}

static void save_and_restore(Instance *c) {
    void **state = &states[below(SLOTS)];
    size_t size = 0;
    char *bytes;
    switch (below(5)) {
        case 0: TRY(c, fmi2GetFMUstate(c, chance(95) ? state : NULL)); break;
        case 1: TRY(c, fmi2SetFMUstate(c, chance(95) ? *state : NULL)); break;
        case 2: TRY(c, fmi2FreeFMUstate(c, chance(95) ? state : NULL)); break;
        default:
            TRY(c, fmi2SerializedFMUstateSize(c, *state, chance(95) ? &size : NULL));
            if (!c || !*state || !size) break;
            bytes = array(size, 1);
            TRY(c, fmi2SerializeFMUstate(c, *state, bytes, chance(90) ? size : size / 2));
            if (!bytes) break;
            if (fmi2SerializeFMUstate(c, *state, bytes, size) != fmi2OK) must(false, "fmi2SerializeFMUstate", "failed");
            if (chance(50)) {
                void *made = NULL;
                const Trial trial = begun(c, "fmi2DeSerializeFMUstate of damaged bytes");
                bytes[below((unsigned)size)] ^= (char)(1 << below(8));
                ended(&trial, (int)fmi2DeSerializeFMUstate(c, bytes, size, &made));
                must(!made, trial.function, "made a state");
            } else {
                TRY(c, fmi2DeSerializeFMUstate(c, bytes, chance(90) ? size : size - 1, state));
            }
    }
}

static void derive(Instance *c) {
    const size_t unknown_count = any_count(), known_count = any_count();
    unsigned *unknown = references(unknown_count), *known = references(known_count);
    double *seeds = reals(known_count, NULL), *result = reals(unknown_count, NULL);
    int *orders = array(unknown_count, sizeof *orders);
    for (size_t i = 0; unknown && i < unknown_count && chance(90); ++i) {
        unknown[i] = RATES_BEGIN + below(OUTPUTS_END - RATES_BEGIN);
    }
    for (size_t i = 0; orders && i < unknown_count; ++i) orders[i] = chance(97) ? 1 : (int)below(5) - 2;
    if (chance(50)) {
        TRY_READING(c, fmi2GetDirectionalDerivative(c, unknown, unknown_count, known, known_count, seeds, result),
                    result, unknown_count);
    } else {
        TRY_READING(c, fmi2GetRealOutputDerivatives(c, unknown, unknown_count, orders, result), result, unknown_count);
    }
}

static void variables(Instance *c) {
    const size_t count = any_count();
    unsigned *chosen = references(count);
    double *values = reals(count, chosen);
    int *others = array(count, sizeof *others);
    fmi2String *texts = array(count, sizeof *texts);
    if (chance(30)) {
        TRY(c, fmi2SetReal(c, chosen, count, values));
        return;
    }
    for (size_t i = 0; chosen && i < count && chance(95); ++i) chosen[i] = below(VARIABLE_COUNT);
    switch (below(8)) {
        case 0: TRY(c, fmi2SetBoolean(c, chosen, count, others)); break;
        case 1: TRY(c, fmi2GetBoolean(c, chosen, count, others)); break;
        case 2: TRY(c, fmi2SetInteger(c, chosen, count, others)); break;
        case 3: TRY(c, fmi2GetInteger(c, chosen, count, others)); break;
        case 4: TRY(c, fmi2SetString(c, chosen, count, texts)); break;
        case 5: TRY(c, fmi2GetString(c, chosen, count, texts)); break;
        default: TRY_READING(c, fmi2GetReal(c, chosen, count, values), values, count);
    }
}

static void life(Instance *c) {
    static const char *const known[] = {"logStatusError", "logAll", "logEvents", "none such", NULL, "%s%n"};
    const size_t count = any_count();
    fmi2String *categories = array(count, sizeof *categories);
    for (size_t i = 0; categories && i < count; ++i) categories[i] = known[below(chance(80) ? 3 : 6)];
    switch (below(12)) {
        case 0: must(strcmp(fmi2GetVersion(), "2.0") == 0, "fmi2GetVersion", "is another"); break;
        case 1: must(strcmp(fmi2GetTypesPlatform(), "default") == 0, "fmi2GetTypesPlatform", "is another"); break;
        case 2: TRY(c, fmi2SetDebugLogging(c, chance(70), count, categories)); break;
        case 3: TRY(c, fmi2SetupExperiment(c, chance(50), any_real(), any_real(), chance(30), any_real())); break;
        case 4: TRY(c, fmi2EnterInitializationMode(c)); break;
        case 5: TRY(c, fmi2ExitInitializationMode(c)); break;
        case 6:
            if (chance(5)) TRY(c, fmi2Terminate(c));
            break;
        case 7:
            if (chance(10)) TRY(c, fmi2Reset(c));
            break;
        case 8: TRY(c, fmi2EnterEventMode(c)); break;
        case 9: TRY(c, fmi2EnterContinuousTimeMode(c)); break;
        default: save_and_restore(c);
    }
}

static void solve(Instance *c) {
    const size_t count = chance(80) ? STATE_COUNT : any_count(), events = chance(80) ? INDICATOR_COUNT : any_count();
    double *values = reals(count, NULL), *indicators = reals(events, NULL);
    fmi2EventInfo *info = array(1, sizeof *info);
    int *enter = array(1, sizeof *enter), *end = array(1, sizeof *end);
    switch (below(9)) {
        case 0: TRY(c, fmi2NewDiscreteStates(c, info)); break;
        case 1: TRY(c, fmi2CompletedIntegratorStep(c, chance(50), enter, end)); break;
        case 2: TRY(c, fmi2SetTime(c, any_real())); break;
        case 3:
            for (size_t i = 0; values && i < count && chance(98); ++i) values[i] = 10.0 / (1 + below(100));
            TRY(c, fmi2SetContinuousStates(c, values, count));
            break;
        case 4: TRY_READING(c, fmi2GetDerivatives(c, values, count), values, count); break;
        case 5: TRY_READING(c, fmi2GetContinuousStates(c, values, count), values, count); break;
        case 6: TRY_READING(c, fmi2GetNominalsOfContinuousStates(c, values, count), values, count); break;
        case 7: TRY_READING(c, fmi2GetEventIndicators(c, indicators, events), indicators, events); break;
        default: derive(c);
    }
}

static void step(Instance *c) {
    double *real = array(1, sizeof *real);
    int *integer = array(1, sizeof *integer);
    fmi2String *text = array(1, sizeof *text);
    fmi2Status *status = array(1, sizeof *status);
    const fmi2StatusKind kind = (fmi2StatusKind)below(6);
    switch (below(9)) {
        case 0: TRY(c, fmi2DoStep(c, any_real(), any_step(), chance(50))); break;
        case 1: TRY(c, fmi2CancelStep(c)); break;
        case 2: TRY(c, fmi2GetStatus(c, kind, status)); break;
        case 3: TRY(c, fmi2GetRealStatus(c, kind, real)); break;
        case 4: TRY(c, fmi2GetIntegerStatus(c, kind, integer)); break;
        case 5: TRY(c, fmi2GetBooleanStatus(c, kind, integer)); break;
        case 6: TRY(c, fmi2GetStringStatus(c, kind, text)); break;
        case 7: TRY(c, fmi2SetRealInputDerivatives(c, NULL, below(3), NULL, NULL)); break;
        default: derive(c);
    }
}

void random_call(Instance *c) {
    switch (below(4)) {
        case 0: life(c); break;
        case 1: variables(c); break;
        case 2: solve(c); break;
        default: step(c);
    }
}

/* What a simulator would do next. */
void sound_call(Instance *c) {
    fmi2EventInfo info;
    if (chance(30)) {
        variables(c);
        return;
    }
    switch (c->mode) {
        case INSTANTIATED:
            if (chance(50)) TRY(c, fmi2SetupExperiment(c, fmi2False, 0, below(3), chance(10), 1000));
            TRY(c, fmi2EnterInitializationMode(c));
            break;
        case INITIALISING: TRY(c, fmi2ExitInitializationMode(c)); break;
        case STEPPING: TRY(c, fmi2DoStep(c, c->value[TIME], any_step(), fmi2True)); break;
        case EVENT:
            TRY(c, fmi2NewDiscreteStates(c, &info));
            TRY(c, fmi2EnterContinuousTimeMode(c));
            break;
        case CONTINUOUS_TIME:
            TRY(c, fmi2SetTime(c, c->value[TIME] + 0.1));
            solve(c);
            break;
        default: TRY(c, fmi2Reset(c));
    }
}
