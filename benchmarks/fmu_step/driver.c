/* Times fmi2DoStep and fmi3DoStep of two libraries against the ship written by hand.
 *
 * Arguments: library and token of the FMI 2 FMU, the same of the FMI 3 FMU, repetitions, steps in each, ships of the
 * fleet, and the numbers of a Ship. Prints one line a repetition: nanoseconds a step by hand, by FMI 2, by FMI 3, by
 * one ship and by a fleet of FMI 2, the same of FMI 3; and at the end the largest difference of the states by hand and
 * by the FMUs, relative to 1 + |state|.
 */
#define _POSIX_C_SOURCE 200809L
#include <dlfcn.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "fmi2FunctionTypes.h"
#include "fmi3FunctionTypes.h"
#include "mariner.h"

enum { STATES = 7, FIRST_STATE = 1, RUDDER = FIRST_STATE + STATES, HALF_PERIOD = 500 };
static const double STEP = 0.1;

static const unsigned state_references[STATES] = {1, 2, 3, 4, 5, 6, 7};
static const unsigned rudder_reference[1] = {RUDDER};

static double seconds(void) {
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

static void *symbol(void *library, const char *name) {
    void *found = dlsym(library, name);
    if (!found) exit(2);
    return found;
}

static void *opened(const char *path) {
    void *library = dlopen(path, RTLD_NOW | RTLD_LOCAL);
    if (!library) {
        fprintf(stderr, "%s\n", dlerror());
        exit(2);
    }
    return library;
}

static double order_at(long step) { return (step / HALF_PERIOD) % 2 ? -0.35 : 0.35; }

static double by_hand(const Ship *ship, long steps, Motion *motion) {
    const Motion start = {0, 0, 0, ship->speed, 0, 0, 0};
    double order = 0, begun;
    *motion = start;
    begun = seconds();
    for (long i = 0; i < steps; ++i) {
        if (i % HALF_PERIOD == 0) order = order_at(i);
        mariner_step(ship, motion, order, STEP);
    }
    return seconds() - begun;
}

static double by_fmi2(void *library, const char *token, long steps, double states[]) {
    fmi2CallbackFunctions callbacks = {NULL, calloc, free, NULL, NULL};
    fmi2InstantiateTYPE *instantiate = (fmi2InstantiateTYPE *)symbol(library, "fmi2Instantiate");
    fmi2SetRealTYPE *set = (fmi2SetRealTYPE *)symbol(library, "fmi2SetReal");
    fmi2GetRealTYPE *get = (fmi2GetRealTYPE *)symbol(library, "fmi2GetReal");
    fmi2DoStepTYPE *do_step = (fmi2DoStepTYPE *)symbol(library, "fmi2DoStep");
    fmi2Component c = instantiate("benchmark", fmi2CoSimulation, token, "", &callbacks, fmi2False, fmi2False);
    double begun, taken;
    if (!c) exit(2);
    ((fmi2EnterInitializationModeTYPE *)symbol(library, "fmi2EnterInitializationMode"))(c);
    ((fmi2ExitInitializationModeTYPE *)symbol(library, "fmi2ExitInitializationMode"))(c);
    begun = seconds();
    for (long i = 0; i < steps; ++i) {
        const double order = order_at(i);
        if (i % HALF_PERIOD == 0) set(c, rudder_reference, 1, &order);
        if (do_step(c, (double)i * STEP, STEP, fmi2True) != fmi2OK) exit(2);
    }
    taken = seconds() - begun;
    get(c, state_references, STATES, states);
    ((fmi2FreeInstanceTYPE *)symbol(library, "fmi2FreeInstance"))(c);
    return taken;
}

static double by_fmi3(void *library, const char *token, long steps, double states[]) {
    fmi3InstantiateCoSimulationTYPE *instantiate =
        (fmi3InstantiateCoSimulationTYPE *)symbol(library, "fmi3InstantiateCoSimulation");
    fmi3SetFloat64TYPE *set = (fmi3SetFloat64TYPE *)symbol(library, "fmi3SetFloat64");
    fmi3GetFloat64TYPE *get = (fmi3GetFloat64TYPE *)symbol(library, "fmi3GetFloat64");
    fmi3DoStepTYPE *do_step = (fmi3DoStepTYPE *)symbol(library, "fmi3DoStep");
    fmi3Instance c = instantiate("benchmark", token, "", false, false, false, false, NULL, 0, NULL, NULL, NULL);
    bool event, end, early;
    double begun, taken, reached;
    if (!c) exit(2);
    ((fmi3EnterInitializationModeTYPE *)symbol(library, "fmi3EnterInitializationMode"))(c, false, 0, 0, false, 0);
    ((fmi3ExitInitializationModeTYPE *)symbol(library, "fmi3ExitInitializationMode"))(c);
    begun = seconds();
    for (long i = 0; i < steps; ++i) {
        const double order = order_at(i);
        if (i % HALF_PERIOD == 0) set(c, rudder_reference, 1, &order, 1);
        if (do_step(c, (double)i * STEP, STEP, true, &event, &end, &early, &reached) != fmi3OK) exit(2);
    }
    taken = seconds() - begun;
    get(c, state_references, STATES, states, STATES);
    ((fmi3FreeInstanceTYPE *)symbol(library, "fmi3FreeInstance"))(c);
    return taken;
}

/* The same steps, each by one of `ships` instances in turn: seconds for `steps` steps in all. */
static double by_fleet2(void *library, const char *token, long steps, long ships) {
    fmi2CallbackFunctions callbacks = {NULL, calloc, free, NULL, NULL};
    fmi2InstantiateTYPE *instantiate = (fmi2InstantiateTYPE *)symbol(library, "fmi2Instantiate");
    fmi2SetRealTYPE *set = (fmi2SetRealTYPE *)symbol(library, "fmi2SetReal");
    fmi2DoStepTYPE *do_step = (fmi2DoStepTYPE *)symbol(library, "fmi2DoStep");
    fmi2Component *fleet = malloc((size_t)ships * sizeof *fleet);
    double begun, taken;
    for (long k = 0; k < ships; ++k) {
        const double order = 0.35 - 0.7 * (double)k / (double)ships;
        fleet[k] = instantiate("benchmark", fmi2CoSimulation, token, "", &callbacks, fmi2False, fmi2False);
        if (!fleet[k]) exit(2);
        ((fmi2EnterInitializationModeTYPE *)symbol(library, "fmi2EnterInitializationMode"))(fleet[k]);
        ((fmi2ExitInitializationModeTYPE *)symbol(library, "fmi2ExitInitializationMode"))(fleet[k]);
        set(fleet[k], rudder_reference, 1, &order);
    }
    begun = seconds();
    for (long i = 0; i < steps / ships; ++i) {
        for (long k = 0; k < ships; ++k) {
            if (do_step(fleet[k], (double)i * STEP, STEP, fmi2True) != fmi2OK) exit(2);
        }
    }
    taken = seconds() - begun;
    for (long k = 0; k < ships; ++k) ((fmi2FreeInstanceTYPE *)symbol(library, "fmi2FreeInstance"))(fleet[k]);
    free(fleet);
    return taken;
}

static double by_fleet3(void *library, const char *token, long steps, long ships) {
    fmi3InstantiateCoSimulationTYPE *instantiate =
        (fmi3InstantiateCoSimulationTYPE *)symbol(library, "fmi3InstantiateCoSimulation");
    fmi3SetFloat64TYPE *set = (fmi3SetFloat64TYPE *)symbol(library, "fmi3SetFloat64");
    fmi3DoStepTYPE *do_step = (fmi3DoStepTYPE *)symbol(library, "fmi3DoStep");
    fmi3Instance *fleet = malloc((size_t)ships * sizeof *fleet);
    bool event, end, early;
    double begun, taken, reached;
    for (long k = 0; k < ships; ++k) {
        const double order = 0.35 - 0.7 * (double)k / (double)ships;
        fleet[k] = instantiate("benchmark", token, "", false, false, false, false, NULL, 0, NULL, NULL, NULL);
        if (!fleet[k]) exit(2);
        ((fmi3EnterInitializationModeTYPE *)symbol(library, "fmi3EnterInitializationMode"))(fleet[k], false, 0, 0,
                                                                                             false, 0);
        ((fmi3ExitInitializationModeTYPE *)symbol(library, "fmi3ExitInitializationMode"))(fleet[k]);
        set(fleet[k], rudder_reference, 1, &order, 1);
    }
    begun = seconds();
    for (long i = 0; i < steps / ships; ++i) {
        for (long k = 0; k < ships; ++k) {
            if (do_step(fleet[k], (double)i * STEP, STEP, true, &event, &end, &early, &reached) != fmi3OK) exit(2);
        }
    }
    taken = seconds() - begun;
    for (long k = 0; k < ships; ++k) ((fmi3FreeInstanceTYPE *)symbol(library, "fmi3FreeInstance"))(fleet[k]);
    free(fleet);
    return taken;
}

static double difference(const double a[], const double b[]) {
    double largest = 0;
    for (int i = 0; i < STATES; ++i) largest = fmax(largest, fabs(a[i] - b[i]) / (1 + fabs(a[i])));
    return largest;
}

int main(int count, char *arguments[]) {
    enum { NUMBERS = sizeof(Ship) / sizeof(double), FIXED = 8 };
    double numbers[NUMBERS], hand[STATES], fmi2[STATES], fmi3[STATES], largest = 0;
    long repetitions, steps, ships;
    void *library2, *library3;
    Ship ship;
    Motion motion;
    if (count != FIXED + NUMBERS) return 2;
    library2 = opened(arguments[1]);
    library3 = opened(arguments[3]);
    repetitions = atol(arguments[5]);
    steps = atol(arguments[6]);
    ships = atol(arguments[7]);
    for (int i = 0; i < NUMBERS; ++i) numbers[i] = atof(arguments[FIXED + i]);
    memcpy(&ship, numbers, sizeof ship);
    for (long k = 0; k < repetitions; ++k) {
        const double a = by_hand(&ship, steps, &motion);
        const double b = by_fmi2(library2, arguments[2], steps, fmi2);
        const double c = by_fmi3(library3, arguments[4], steps, fmi3);
        const double taken[] = {a, b, c, by_fleet2(library2, arguments[2], steps, 1),
                                by_fleet2(library2, arguments[2], steps, ships),
                                by_fleet3(library3, arguments[4], steps, 1),
                                by_fleet3(library3, arguments[4], steps, ships)};
        for (size_t i = 0; i < sizeof taken / sizeof taken[0]; ++i) printf("%.3f ", 1e9 * taken[i] / (double)steps);
        printf("\n");
        memcpy(hand, &motion, sizeof hand);
        largest = fmax(largest, fmax(difference(hand, fmi2), difference(hand, fmi3)));
    }
    printf("%.3e\n", largest);
    return 0;
}
