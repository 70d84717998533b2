/* Random calls of every function of FMI, and what must hold after each (see fuzz.c). */
#ifndef FUZZ_H
#define FUZZ_H

#include "instance.h"

enum { SLOTS = 4, MOST_ELEMENTS = 6 };

/* A call that is being made: what the instance held before it. */
typedef struct {
    Instance *instance;
    const char *function;
    int mode;
    unsigned logged;
    bool stale_states, stop_defined;
    double stop_time;
    double value[RATES_BEGIN];
    long lines;
} Trial;

/* fuzz.c */
unsigned below(unsigned bound);
bool chance(unsigned percent);
double any_real(void);
unsigned any_reference(void);
unsigned sound_reference(void);
double sound_value(unsigned reference);
double any_step(void);
size_t any_count(void);
void *array(size_t count, size_t size);
unsigned *references(size_t count);
double *reals(size_t count, const unsigned of[]);
void release_arrays(void);
void line_logged(const char *category, const char *message);
Trial begun(Instance *instance, const char *function);
void ended(const Trial *trial, int status);
void check_finite(const Trial *trial, int status, const double values[], size_t count);
void must(bool holds, const char *function, const char *what);
extern bool inputs_set_inside;
extern void *states[SLOTS];

/* fuzz2.c or fuzz3.c */
Instance *instantiate(void);
void free_one(Instance *instance);
void sound_call(Instance *instance);
void random_call(Instance *instance);
void drop_state(Instance *instance, void **state);

#define TRY(instance, call)                              \
    do {                                                 \
        const Trial trial = begun(instance, #call);      \
        ended(&trial, (int)(call));                      \
    } while (0)

#define TRY_READING(instance, call, values, count)       \
    do {                                                 \
        const Trial trial = begun(instance, #call);      \
        const int status = (int)(call);                  \
        ended(&trial, status);                           \
        check_finite(&trial, status, values, count);     \
    } while (0)

#endif
