/* One running copy of the model, independent of the version of FMI.
 *
 * fmi2.c and the files fmi3*.c translate the functions of the standard into those declared here. All memory that
 * outlives a call belongs to an instance, so any number of them may live in one process, each in its own thread; what
 * does not outlive it is on the stack, so that an instance is small and a fleet of them fits into a cache.
 *
 * The variables are in one array in the order of their value references, in blocks (see model.h): time, states,
 * inputs, parameters, the largest internal step, derivatives of the states, outputs with the event indicators last.
 * The generated equations read and write the blocks in place.
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
enum {
    INSTANTIATED = 1,
    INITIALISING = 2,
    EVENT = 4,
    CONTINUOUS_TIME = 8,
    STEPPING = 16,
    TERMINATED = 32,
    UPDATING = 64, /* in an intermediate update, called from within a step */
    BEFORE_START = INSTANTIATED | INITIALISING,
    BETWEEN_CALLS = BEFORE_START | EVENT | CONTINUOUS_TIME | STEPPING | TERMINATED,
    ANY_MODE = BETWEEN_CALLS | UPDATING,
    BEFORE_END = ANY_MODE & ~TERMINATED,
    AFTER_START = ANY_MODE & ~INSTANTIATED,
    SIMULATED = EVENT | CONTINUOUS_TIME | STEPPING
};

/* What may be logged, one bit a category. */
enum { LOG_ERROR = 1, LOG_DISCARD = 2, LOG_WARNING = 4, LOG_EVENTS = 8, LOG_ALL = 15 };

/* Parts of the values that must be calculated before they are read. */
enum { STALE_STATES = 1, STALE_RATES = 2, STALE_OUTPUTS = 4, STALE_CONSTANTS = 8, STALE_ALL = 15 };

typedef struct Instance Instance;
typedef void (*AnyFunction)(void);

/* What the simulator gave. Its functions differ in type, so `send` knows how to call `logger`, and `show` (NULL where
 * the simulator does not ask for it) how to call `update` after an internal step: true if the step shall end early, at
 * `*end`, which `show` is given as the present time. */
typedef struct {
    void *environment;
    AnyFunction logger;
    void (*send)(const Instance *self, Status status, const char *category, const char *message);
    AnyFunction update;
    bool (*show)(const Instance *self, bool may_end, double *end);
    bool may_end_early;
} Host;

struct Instance {
    int kind, mode;
    unsigned stale;
    unsigned logged;
    Status last_step;
    bool left_range[VALIDITY_FACTOR_COUNT + 1]; /* the log has this cause of a lower validity */
    bool clamped[INPUT_COUNT + 1];              /* the log has that this input is held at a bound */
    bool stop_defined;
    double stop_time;
    double constant[CONSTANT_COUNT + 1]; /* what the step needs and only parameters determine */
    double value[VARIABLE_COUNT];
    Host host;
    char name[];
};

/* Scratch memory of the generated equations. */
typedef struct {
    double reals[WORK_REALS + 1];
    long long int integers[WORK_INTEGERS + 1];
} Work;

/* instance.c */
Instance *create_instance(const Host *host, const char *name, const char *token, int kind, bool logging);
void free_instance(Instance *self);
void reset_instance(Instance *self);
Status report(const Instance *self, Status status, const char *format, ...);
void report_event(const Instance *self, const char *format, ...);
Status select_logging(Instance *self, bool on, size_t count, const char *const categories[]);

/* True, with a line in the log, if a call must be refused: the function cannot be called on this instance, or not in
 * its mode; an array of `count` elements is NULL, or has not the number of elements it must have. */
#define REFUSED(self, modes, kinds) refused(self, __func__, modes, kinds)
#define MISSING(self, array, count) missing(self, __func__, #array, array, count)
#define UNFIT(self, array, count, expected) unfit(self, __func__, #array, array, count, expected)
bool refused(const Instance *self, const char *function, int modes, int kinds);
bool missing(const Instance *self, const char *function, const char *argument, const void *array, size_t count);
bool unfit(const Instance *self, const char *function, const char *argument, const void *array, size_t count,
           size_t expected);
Status unsupported(const Instance *self, const char *function, const char *why);

/* values.c */
bool is_block(unsigned reference, unsigned begin, unsigned end);
bool can_update(unsigned reference);
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
Status output_derivatives(Instance *self, const unsigned references[], size_t count, const int orders[],
                          double values[]);

/* snapshot.c */
Status save_state(Instance *self, void **state);
Status restore_state(Instance *self, const void *state);
void free_state(void **state);
size_t serialised_size(void);
Status serialise_state(Instance *self, const void *state, char bytes[], size_t size);
Status deserialise_state(Instance *self, const char bytes[], size_t size, void **state);

#endif
