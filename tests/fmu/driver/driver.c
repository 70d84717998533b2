/* A simulator in small: runs the library of an FMU through a 20/20 zigzag by Co-Simulation.
 *
 * Arguments: version of FMI (2 or 3), library, token, number of steps, value references of the rudder order and of the
 * heading, then of what is printed. Every tenth step prints a line of these with 17 digits, which tell every double
 * from every other. The rudder goes over at the first communication point at which the heading is 20 degrees or more to
 * the side that it was turned to. Ends with 2 and a line that says why if anything is not OK.
 */
#include <stdarg.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>

#include "fmi2FunctionTypes.h"
#include "fmi3FunctionTypes.h"

#ifdef _WIN32
#include <windows.h>
typedef HMODULE Library;
#else
#include <dlfcn.h>
typedef void *Library;
#endif

enum { MOST_VALUES = 64, STEPS_A_LINE = 10 };
static const double STEP = 0.1;                 /* s */
static const double ORDER = 0.3490658503988659; /* 20 degrees, rad */

typedef struct {
    Library library;
    void *instance;
    const char *token;
} Fmu;

/* What a version of FMI does. */
typedef struct {
    void (*start)(Fmu *fmu);
    void (*set)(const Fmu *fmu, unsigned reference, double value);
    void (*get)(const Fmu *fmu, const unsigned references[], size_t count, double values[]);
    void (*step)(const Fmu *fmu, double time);
    void (*end)(const Fmu *fmu);
} Calls;

static void fail(const char *what, const char *which) {
    fprintf(stderr, "%s: %s\n", what, which);
    exit(2);
}

static Library opened(const char *path) {
#ifdef _WIN32
    Library library = LoadLibraryA(path);
    if (!library) fail(path, "cannot be loaded");
#else
    Library library = dlopen(path, RTLD_NOW | RTLD_LOCAL);
    if (!library) fail(path, dlerror());
#endif
    return library;
}

/* A pointer to a function of any type; the caller casts it to its own. */
typedef void (*Function)(void);

static Function function(const Fmu *fmu, const char *name) {
#ifdef _WIN32
    const Function found = (Function)GetProcAddress(fmu->library, name);
#else
    Function found;
    *(void **)&found = dlsym(fmu->library, name);
#endif
    if (!found) fail(name, "is not in the library");
    return found;
}

#define CALL(name, ...)                                                                    \
    do {                                                                                   \
        if (((name##TYPE *)function(fmu, #name))(__VA_ARGS__) != 0) fail(#name, "not OK"); \
    } while (0)

static void logged2(fmi2ComponentEnvironment environment, fmi2String name, fmi2Status status, fmi2String category,
                 fmi2String message, ...) {
    va_list arguments;
    (void)environment, (void)name, (void)status, (void)category;
    va_start(arguments, message);
    vfprintf(stderr, message, arguments);
    va_end(arguments);
    fputc('\n', stderr);
}

static void logged3(fmi3InstanceEnvironment environment, fmi3Status status, fmi3String category, fmi3String message) {
    (void)environment, (void)status, (void)category;
    fprintf(stderr, "%s\n", message);
}

static void start2(Fmu *fmu) {
    static const fmi2CallbackFunctions callbacks = {logged2, calloc, free, NULL, NULL};
    fmi2InstantiateTYPE *instantiate = (fmi2InstantiateTYPE *)function(fmu, "fmi2Instantiate");
    fmu->instance = instantiate("driver", fmi2CoSimulation, fmu->token, "", &callbacks, fmi2False, fmi2False);
    if (!fmu->instance) fail("fmi2Instantiate", "no instance");
    CALL(fmi2SetupExperiment, fmu->instance, fmi2False, 0, 0, fmi2False, 0);
    CALL(fmi2EnterInitializationMode, fmu->instance);
    CALL(fmi2ExitInitializationMode, fmu->instance);
}

static void set2(const Fmu *fmu, unsigned reference, double value) {
    CALL(fmi2SetReal, fmu->instance, &reference, 1, &value);
}

static void get2(const Fmu *fmu, const unsigned references[], size_t count, double values[]) {
    CALL(fmi2GetReal, fmu->instance, references, count, values);
}

static void step2(const Fmu *fmu, double time) { CALL(fmi2DoStep, fmu->instance, time, STEP, fmi2True); }

static void end2(const Fmu *fmu) {
    CALL(fmi2Terminate, fmu->instance);
    ((fmi2FreeInstanceTYPE *)function(fmu, "fmi2FreeInstance"))(fmu->instance);
}

static void start3(Fmu *fmu) {
    fmi3InstantiateCoSimulationTYPE *instantiate =
        (fmi3InstantiateCoSimulationTYPE *)function(fmu, "fmi3InstantiateCoSimulation");
    fmu->instance = instantiate("driver", fmu->token, "", false, false, false, false, NULL, 0, NULL, logged3, NULL);
    if (!fmu->instance) fail("fmi3InstantiateCoSimulation", "no instance");
    CALL(fmi3EnterInitializationMode, fmu->instance, false, 0, 0, false, 0);
    CALL(fmi3ExitInitializationMode, fmu->instance);
}

static void set3(const Fmu *fmu, unsigned reference, double value) {
    CALL(fmi3SetFloat64, fmu->instance, &reference, 1, &value, 1);
}

static void get3(const Fmu *fmu, const unsigned references[], size_t count, double values[]) {
    CALL(fmi3GetFloat64, fmu->instance, references, count, values, count);
}

static void step3(const Fmu *fmu, double time) {
    bool event, terminate, early;
    double reached;
    CALL(fmi3DoStep, fmu->instance, time, STEP, true, &event, &terminate, &early, &reached);
    if (event || terminate || early) fail("fmi3DoStep", "wants something that was not expected");
}

static void end3(const Fmu *fmu) {
    CALL(fmi3Terminate, fmu->instance);
    ((fmi3FreeInstanceTYPE *)function(fmu, "fmi3FreeInstance"))(fmu->instance);
}

static void print(const double values[], size_t count) {
    for (size_t i = 0; i < count; ++i) printf("%.17g%c", values[i], i + 1 < count ? ' ' : '\n');
}

int main(int count, char *arguments[]) {
    static const Calls calls_of[] = {{start2, set2, get2, step2, end2}, {start3, set3, get3, step3, end3}};
    enum { FIXED = 7 };
    unsigned references[MOST_VALUES], rudder, heading;
    double values[MOST_VALUES], psi, order = ORDER;
    const size_t printed = (size_t)count - FIXED;
    const Calls *calls;
    long steps;
    Fmu fmu;
    if (count <= FIXED || printed > MOST_VALUES) fail("driver", "fmi library token steps rudder heading reference...");
    calls = &calls_of[atoi(arguments[1]) == 3];
    fmu.library = opened(arguments[2]);
    fmu.token = arguments[3];
    steps = atol(arguments[4]);
    rudder = (unsigned)atol(arguments[5]);
    heading = (unsigned)atol(arguments[6]);
    for (size_t i = 0; i < printed; ++i) references[i] = (unsigned)atol(arguments[FIXED + i]);
    calls->start(&fmu);
    for (long i = 0; i < steps; ++i) {
        calls->get(&fmu, &heading, 1, &psi);
        if (order > 0 ? psi >= ORDER : psi <= -ORDER) order = -order;
        calls->set(&fmu, rudder, order);
        calls->step(&fmu, (double)i * STEP);
        if ((i + 1) % STEPS_A_LINE) continue;
        calls->get(&fmu, references, printed, values);
        print(values, printed);
    }
    calls->end(&fmu);
    return 0;
}
