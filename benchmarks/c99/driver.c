/* Times a step of ship.c against fmi2DoStep of the FMU of the same card, by turns.
 *
 * Arguments: library of ship.c, prefix of its names, numbers in an instance; library and token of the FMU; its first
 * and last value reference of outputs; step (s), steps, repetitions. Prints a line a repetition: nanoseconds a step of
 * ship.c, of fmi2DoStep, of fmi2DoStep with fmi2GetReal of those outputs. With SINGLE the ship is in single precision.
 */
#define _POSIX_C_SOURCE 200809L
#include <dlfcn.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

#include "fmi2FunctionTypes.h"

#ifdef SINGLE
typedef float real;
#else
typedef double real;
#endif
typedef int (*Init)(real *self);
typedef int (*Step)(real *self, real dt);

static double seconds(void) {
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

static void *symbol(void *library, const char *prefix, const char *name) {
    char whole[128];
    void *found;
    snprintf(whole, sizeof whole, "%s%s", prefix, name);
    found = dlsym(library, whole);
    if (!found) exit(2);
    return found;
}

static void *opened(const char *path) {
    void *library = dlopen(path, RTLD_NOW | RTLD_LOCAL);
    if (!library) exit(2);
    return library;
}

static double by_ship(void *library, char *argv[], double step, long steps) {
    real *self = calloc((size_t)atol(argv[3]), sizeof *self);
    Step advance = (Step)symbol(library, argv[2], "_step");
    double begun;
    ((Init)symbol(library, argv[2], "_init"))(self);
    begun = seconds();
    for (long i = 0; i < steps; ++i) {
        if (advance(self, (real)step) != 0) exit(3);
    }
    begun = seconds() - begun;
    free(self);
    return begun;
}

static double by_fmu(void *library, char *argv[], double step, long steps, int reads) {
    fmi2CallbackFunctions callbacks = {NULL, calloc, free, NULL, NULL};
    fmi2DoStepTYPE *advance = (fmi2DoStepTYPE *)symbol(library, "", "fmi2DoStep");
    fmi2GetRealTYPE *get = (fmi2GetRealTYPE *)symbol(library, "", "fmi2GetReal");
    fmi2Component c = ((fmi2InstantiateTYPE *)symbol(library, "", "fmi2Instantiate"))(
        "benchmark", fmi2CoSimulation, argv[5], "", &callbacks, fmi2False, fmi2False);
    const unsigned first = (unsigned)atol(argv[6]), last = (unsigned)atol(argv[7]);
    unsigned references[512];
    double values[512], begun;
    if (!c || last - first >= 512) exit(2);
    for (unsigned i = first; i <= last; ++i) references[i - first] = i;
    ((fmi2EnterInitializationModeTYPE *)symbol(library, "", "fmi2EnterInitializationMode"))(c);
    ((fmi2ExitInitializationModeTYPE *)symbol(library, "", "fmi2ExitInitializationMode"))(c);
    begun = seconds();
    for (long i = 0; i < steps; ++i) {
        if (advance(c, (double)i * step, step, fmi2True) != fmi2OK) exit(3);
        if (reads && get(c, references, last - first + 1, values) != fmi2OK) exit(3);
    }
    begun = seconds() - begun;
    ((fmi2FreeInstanceTYPE *)symbol(library, "", "fmi2FreeInstance"))(c);
    return begun;
}

int main(int argc, char *argv[]) {
    if (argc != 11) return 2;
    const double step = atof(argv[8]);
    const long steps = atol(argv[9]), repetitions = atol(argv[10]);
    void *ship = opened(argv[1]), *fmu = opened(argv[4]);
    for (long i = 0; i < repetitions; ++i) {
        const double times[3] = {by_ship(ship, argv, step, steps), by_fmu(fmu, argv, step, steps, 0),
                                 by_fmu(fmu, argv, step, steps, 1)};
        for (int k = 0; k < 3; ++k) printf("%.6g ", 1e9 * times[k] / (double)steps);
        printf("\n");
    }
    return 0;
}
