/* Counts what an FMU allocates while it runs: 0 is expected. Compiled with the FMU's sources, FMI = 2 or 3 and the
 * linker's --wrap for malloc, calloc and realloc. */
#include <stdio.h>
#include <stdlib.h>

#include "instance.h"

static long allocations, updates;

void *__real_malloc(size_t size);
void *__real_calloc(size_t count, size_t size);
void *__real_realloc(void *memory, size_t size);

void *__wrap_malloc(size_t size) {
    ++allocations;
    return __real_malloc(size);
}

void *__wrap_calloc(size_t count, size_t size) {
    ++allocations;
    return __real_calloc(count, size);
}

void *__wrap_realloc(void *memory, size_t size) {
    ++allocations;
    return __real_realloc(memory, size);
}

static const unsigned input[1] = {INPUTS_BEGIN}, output[1] = {OUTPUTS_BEGIN};
static const int order[1] = {1};
static double value[1] = {0.2};

#if FMI == 2
#include "fmi2Functions.h"

static void *make(void) {
    static const fmi2CallbackFunctions none = {NULL, NULL, NULL, NULL, NULL};
    fmi2Component c = fmi2Instantiate("one", fmi2CoSimulation, MODEL_TOKEN, "", &none, fmi2False, fmi2False);
    return fmi2EnterInitializationMode(c) == fmi2OK && fmi2ExitInitializationMode(c) == fmi2OK ? c : NULL;
}

static int go_on(void *c, double time) {
    const double seed = 1;
    return fmi2SetReal(c, input, 1, value) || fmi2DoStep(c, time, 0.5, fmi2True) || fmi2GetReal(c, output, 1, value) ||
           fmi2GetRealOutputDerivatives(c, output, 1, order, value) ||
           fmi2GetDirectionalDerivative(c, output, 1, input, 1, &seed, value);
}

static void drop(void *c) { fmi2FreeInstance(c); }
#else
#include "fmi3Functions.h"

static void update(fmi3InstanceEnvironment environment, fmi3Float64 time, fmi3Boolean may_set, fmi3Boolean may_get,
                   fmi3Boolean finished, fmi3Boolean may_end, fmi3Boolean *end_asked, fmi3Float64 *end_time) {
    (void)environment, (void)time, (void)may_set, (void)may_get, (void)finished, (void)may_end, (void)end_time;
    *end_asked = fmi3False;
    ++updates;
}

static void *make(void) {
    fmi3Instance c = fmi3InstantiateCoSimulation("one", MODEL_TOKEN, "", false, false, false, true, NULL, 0, NULL, NULL,
                                                 update);
    return fmi3EnterInitializationMode(c, false, 0, 0, false, 0) == fmi3OK && fmi3ExitInitializationMode(c) == fmi3OK
               ? c
               : NULL;
}

static int go_on(void *c, double time) {
    const double seed = 1;
    double reached;
    bool event, end, early;
    return fmi3SetFloat64(c, input, 1, value, 1) ||
           fmi3DoStep(c, time, 0.5, true, &event, &end, &early, &reached) || fmi3GetFloat64(c, output, 1, value, 1) ||
           fmi3GetOutputDerivatives(c, output, 1, order, value, 1) ||
           fmi3GetDirectionalDerivative(c, output, 1, input, 1, &seed, 1, value, 1) ||
           fmi3GetAdjointDerivative(c, output, 1, input, 1, &seed, 1, value, 1);
}

static void drop(void *c) { fmi3FreeInstance(c); }
#endif

int main(void) {
    enum { CALLS = 200 };
    void *c = make();
    long made = allocations;
    if (!c || made == 0) return 3; /* the wrapping does not work */
    for (int i = 0; i < CALLS; ++i) {
        if (go_on(c, 0.5 * i)) return 2;
    }
    made = allocations - made;
    drop(c);
    printf("%ld allocations in %d calls, %ld updates\n", made, CALLS, updates);
    return made == 0 ? 0 : 1;
}
