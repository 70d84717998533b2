/* Times the right-hand side of two FMI 3 FMUs in Model Exchange, by turns: set the time and the states, get the
 * derivatives.
 *
 * Arguments: library, token and value reference of the rudder order of each FMU, repetitions, evaluations in each.
 * Prints one line a repetition: nanoseconds an evaluation of each; then the largest difference of the derivatives,
 * relative to 1 + |derivative|; then what the second answers to Co-Simulation.
 */
#define _POSIX_C_SOURCE 200809L
#include <dlfcn.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "fmi3FunctionTypes.h"

enum { STATES = 7, SAMPLES = 64 };

typedef void (*AnyFunction)(void);

typedef struct {
    void *library;
    const char *token;
    fmi3Instance instance;
    fmi3SetTimeTYPE *set_time;
    fmi3SetContinuousStatesTYPE *set_states;
    fmi3GetContinuousStateDerivativesTYPE *get_derivatives;
} Exchange;

/* Of this process on a core, so that what else the machine does is not measured. */
static double seconds(void) {
    struct timespec now;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

/* ISO C knows no conversion from an object pointer to that of a function, POSIX promises that they look alike. */
static AnyFunction symbol(void *library, const char *name) {
    void *found = dlsym(library, name);
    AnyFunction function;
    if (!found) exit(2);
    memcpy(&function, &found, sizeof function);
    return function;
}

static void require(fmi3Status status) {
    if (status > fmi3Warning) exit(3);
}

/* From instantiation into continuous time, the rudder over. */
static void begin(const Exchange *e, fmi3ValueReference order_reference) {
    fmi3EnterInitializationModeTYPE *enter =
        (fmi3EnterInitializationModeTYPE *)symbol(e->library, "fmi3EnterInitializationMode");
    fmi3SetFloat64TYPE *set = (fmi3SetFloat64TYPE *)symbol(e->library, "fmi3SetFloat64");
    fmi3ExitInitializationModeTYPE *leave =
        (fmi3ExitInitializationModeTYPE *)symbol(e->library, "fmi3ExitInitializationMode");
    fmi3UpdateDiscreteStatesTYPE *update =
        (fmi3UpdateDiscreteStatesTYPE *)symbol(e->library, "fmi3UpdateDiscreteStates");
    fmi3EnterContinuousTimeModeTYPE *go =
        (fmi3EnterContinuousTimeModeTYPE *)symbol(e->library, "fmi3EnterContinuousTimeMode");
    const double order = 0.3;
    bool again, over, nominals, values, next_defined;
    double next;
    require(enter(e->instance, false, 0, 0, false, 0));
    require(set(e->instance, &order_reference, 1, &order, 1));
    require(leave(e->instance));
    require(update(e->instance, &again, &over, &nominals, &values, &next_defined, &next));
    require(go(e->instance));
}

static Exchange opened(char *words[]) {
    fmi3InstantiateModelExchangeTYPE *instantiate;
    Exchange e;
    e.library = dlopen(words[0], RTLD_NOW | RTLD_LOCAL);
    e.token = words[1];
    if (!e.library) {
        fprintf(stderr, "%s\n", dlerror());
        exit(2);
    }
    instantiate = (fmi3InstantiateModelExchangeTYPE *)symbol(e.library, "fmi3InstantiateModelExchange");
    e.set_time = (fmi3SetTimeTYPE *)symbol(e.library, "fmi3SetTime");
    e.set_states = (fmi3SetContinuousStatesTYPE *)symbol(e.library, "fmi3SetContinuousStates");
    e.get_derivatives =
        (fmi3GetContinuousStateDerivativesTYPE *)symbol(e.library, "fmi3GetContinuousStateDerivatives");
    e.instance = instantiate("benchmark", e.token, "", false, false, NULL, NULL);
    if (!e.instance) exit(3);
    begin(&e, (fmi3ValueReference)atol(words[2]));
    return e;
}

/* States of a ship that turns, slows down and drifts, a different one for each place. */
static void sample(int place, double x[STATES]) {
    const double share = (double)place / SAMPLES;
    x[0] = 100 * share, x[1] = -50 * share, x[2] = 6 * share, x[3] = 7.7 - 3 * share;
    x[4] = -1.5 * share, x[5] = 0.012 * share, x[6] = 0.3 - 0.4 * share;
}

static double timed(const Exchange *e, long evaluations, double samples[SAMPLES][STATES]) {
    double derivatives[STATES];
    const double begun = seconds();
    for (long i = 0; i < evaluations; ++i) {
        e->set_time(e->instance, 0.1 * (double)i);
        e->set_states(e->instance, samples[i % SAMPLES], STATES);
        if (e->get_derivatives(e->instance, derivatives, STATES) != fmi3OK) exit(3);
    }
    return 1e9 * (seconds() - begun) / (double)evaluations;
}

static double difference(const Exchange *a, const Exchange *b, double samples[SAMPLES][STATES]) {
    double largest = 0, of_a[STATES], of_b[STATES];
    for (int place = 0; place < SAMPLES; ++place) {
        a->set_states(a->instance, samples[place], STATES);
        b->set_states(b->instance, samples[place], STATES);
        require(a->get_derivatives(a->instance, of_a, STATES));
        require(b->get_derivatives(b->instance, of_b, STATES));
        for (int i = 0; i < STATES; ++i) largest = fmax(largest, fabs(of_a[i] - of_b[i]) / (1 + fabs(of_a[i])));
    }
    return largest;
}

static const char *co_simulation(const Exchange *e) {
    static const char *const names[] = {"fmi3OK", "fmi3Warning", "fmi3Discard", "fmi3Error", "fmi3Fatal"};
    fmi3InstantiateCoSimulationTYPE *instantiate =
        (fmi3InstantiateCoSimulationTYPE *)symbol(e->library, "fmi3InstantiateCoSimulation");
    fmi3DoStepTYPE *do_step = (fmi3DoStepTYPE *)symbol(e->library, "fmi3DoStep");
    bool event, end, early;
    double reached;
    fmi3Instance c;
    c = instantiate("benchmark", e->token, "", false, false, false, false, NULL, 0, NULL, NULL, NULL);
    if (!c) return "fmi3InstantiateCoSimulation gives no instance";
    return names[do_step(c, 0, 0.1, true, &event, &end, &early, &reached)];
}

int main(int count, char *words[]) {
    double samples[SAMPLES][STATES];
    long repetitions, evaluations;
    Exchange first, second;
    if (count != 9) return 2;
    first = opened(words + 1);
    second = opened(words + 4);
    repetitions = atol(words[7]);
    evaluations = atol(words[8]);
    for (int place = 0; place < SAMPLES; ++place) sample(place, samples[place]);
    for (long k = 0; k < repetitions; ++k) {
        const double a = timed(&first, evaluations, samples);
        printf("%.3f %.3f\n", a, timed(&second, evaluations, samples));
    }
    printf("%.3e\n", difference(&first, &second, samples));
    fflush(stdout);
    printf("%s\n", co_simulation(&second));
    return 0;
}
