/* One running copy of the model, independent of the version of FMI.
 *
 * fmi2.c and fmi3.c translate the functions of the standard into those declared here. All memory belongs to an
 * instance, so any number of them may live in one process, each in its own thread.
 *
 * The variables stand in one array in the order of their value references, in blocks (see model.h): time, states,
 * inputs, parameters, the largest internal step, derivatives of the states, outputs. The generated equations read and
 * write the blocks in place.
 */
#ifndef INSTANCE_H
#define INSTANCE_H

#include <stdbool.h>
#include <stddef.h>

#include "model.h"

/* The values are those of fmi2Status and fmi3Status. */
typedef enum { OK, WARNING, DISCARD, ERROR } Status;

/* Kinds and modes are bits, so that the set in which a function may be called is one number. */
enum { MODEL_EXCHANGE = 1, CO_SIMULATION = 2, ANY_KIND = 3 };
enum { INSTANTIATED = 1, INITIALISING = 2, EVENT = 4, CONTINUOUS_TIME = 8, STEPPING = 16, TERMINATED = 32, ANY_MODE = 63 };

/* What may be logged, one bit a category. */
enum { LOG_ERROR = 1, LOG_DISCARD = 2, LOG_WARNING = 4, LOG_EVENTS = 8, LOG_ALL = 15 };

/* Parts of the values that must be calculated before they are read. */
enum { STALE_STATES = 1, STALE_RATES = 2, STALE_OUTPUTS = 4, STALE_ALL = 7 };

typedef struct Instance Instance;
typedef void (*AnyFunction)(void);

/* What the simulator gave; the two loggers differ in type, so `send` knows how to call `logger`. */
typedef struct {
    void *environment;
    AnyFunction logger;
    void (*send)(const Instance *self, Status status, const char *category, const char *message);
    void *(*allocate)(size_t count, size_t size);
    void (*release)(void *memory);
} Host;

struct Instance {
    double value[VARIABLE_COUNT];
    double next[2][STATE_COUNT + 1]; /* states on the way through a communication step */
    double tangent[VARIABLE_COUNT];  /* seeds and results of derivatives */
    double work[WORK_REALS + 1];
    long long int integer_work[WORK_INTEGERS + 1];
    int kind, mode;
    unsigned stale;
    unsigned logged;
    bool stop_defined;
    double stop_time;
    Status last_step;
    Host host;
    char *name;
};

/* instance.c */
Instance *create_instance(const Host *host, const char *name, const char *token, int kind, bool logging);
void free_instance(Instance *self);
void reset_instance(Instance *self);
Status report(const Instance *self, Status status, const char *format, ...);
void report_event(const Instance *self, const char *format, ...);
bool refused(const Instance *self, const char *function, int modes, int kinds);
bool missing(const Instance *self, const char *function, const void *pointer, size_t count);
Status unsupported(const Instance *self, const char *function, const char *why);
Status select_logging(Instance *self, bool on, size_t count, const char *const categories[]);

/* values.c */
Status get_reals(Instance *self, const unsigned references[], size_t count, double values[]);
Status set_reals(Instance *self, const unsigned references[], size_t count, const double values[]);
Status get_boolean(Instance *self, unsigned reference, bool *value);
Status check_boolean(Instance *self, unsigned reference);
void set_boolean(Instance *self, unsigned reference, bool value);
Status no_such_type(const Instance *self, const char *type, const unsigned references[], size_t count);
Status get_block(Instance *self, size_t begin, size_t end, double values[]);
Status set_states(Instance *self, const double values[]);
Status set_time(Instance *self, double time);

/* simulation.c */
void refresh(Instance *self, unsigned parts);
Status set_experiment(Instance *self, double start, bool stop_defined, double stop);
Status finish_initialisation(Instance *self);
Status do_step(Instance *self, double start, double size);

/* derivatives.c */
Status directional_derivative(Instance *self, const unsigned unknowns[], size_t unknown_count,
                              const unsigned knowns[], size_t known_count, const double seed[], double result[]);
Status adjoint_derivative(Instance *self, const unsigned unknowns[], size_t unknown_count, const unsigned knowns[],
                          size_t known_count, const double seed[], double result[]);

/* snapshot.c */
Status save_state(Instance *self, void **state);
Status restore_state(Instance *self, const void *state);
void free_state(const Instance *self, void **state);
size_t serialised_size(void);
Status serialise_state(Instance *self, const void *state, char bytes[], size_t size);
Status deserialise_state(Instance *self, const char bytes[], size_t size, void **state);

#endif
