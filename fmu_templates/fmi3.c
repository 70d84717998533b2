/* The functions of FMI 3.0 for Model Exchange and Co-Simulation. */
#include "fmi3Functions.h"

#include "instance.h"

static void send(const Instance *self, Status status, const char *category, const char *message) {
    ((fmi3LogMessageCallback)self->host.logger)(self->host.environment, (fmi3Status)status, category, message);
}

/* ---- version, logging ---- */

const char *fmi3GetVersion(void) { return fmi3Version; }

fmi3Status fmi3SetDebugLogging(fmi3Instance instance, fmi3Boolean loggingOn, size_t nCategories,
                               const fmi3String categories[]) {
    if (REFUSED(instance, ANY_MODE, ANY_KIND)) return fmi3Error;
    if (MISSING(instance, categories, nCategories)) return fmi3Error;
    return (fmi3Status)select_logging(instance, loggingOn, nCategories, categories);
}

/* ---- life ---- */

static Host host_of(fmi3InstanceEnvironment environment, fmi3LogMessageCallback logMessage) {
    const Host host = {.environment = environment, .logger = (AnyFunction)logMessage, .send = send};
    return host;
}

/* Intermediate update: outputs may be read and continuous inputs set; true if the step shall end at `*end`. */
static bool show(const Instance *self, bool may_end, double *end) {
    const fmi3IntermediateUpdateCallback update = (fmi3IntermediateUpdateCallback)self->host.update;
    const fmi3Boolean has_inputs = INPUTS_END > INPUTS_BEGIN;
    const double now = *end;
    fmi3Boolean requested = fmi3False;
    update(self->host.environment, now, has_inputs, fmi3True, fmi3True, may_end, &requested, end);
    return may_end && requested;
}

/* May the simulator ask for these in intermediate updates? With a line in the log if not. */
static bool can_show(const Instance *self, const fmi3ValueReference variables[], size_t count) {
    if (missing(self, "fmi3InstantiateCoSimulation", "requiredIntermediateVariables", variables, count)) return false;
    for (size_t i = 0; i < count; ++i) {
        if (!self->host.update) {
            report(self, ERROR, "intermediate variables are required, but intermediateUpdate is a null pointer");
            return false;
        }
        if (!can_update(variables[i])) {
            report(self, ERROR, "%s (value reference %u) cannot be read or set in an intermediate update",
                   variables[i] < VARIABLE_COUNT ? VARIABLES[variables[i]].name : "no variable", variables[i]);
            return false;
        }
    }
    return true;
}

fmi3Instance fmi3InstantiateModelExchange(fmi3String instanceName, fmi3String instantiationToken,
                                          fmi3String resourcePath, fmi3Boolean visible, fmi3Boolean loggingOn,
                                          fmi3InstanceEnvironment instanceEnvironment,
                                          fmi3LogMessageCallback logMessage) {
    const Host host = host_of(instanceEnvironment, logMessage);
    (void)resourcePath, (void)visible;
    return create_instance(&host, instanceName, instantiationToken, MODEL_EXCHANGE, loggingOn);
}

fmi3Instance fmi3InstantiateCoSimulation(fmi3String instanceName, fmi3String instantiationToken,
                                         fmi3String resourcePath, fmi3Boolean visible, fmi3Boolean loggingOn,
                                         fmi3Boolean eventModeUsed, fmi3Boolean earlyReturnAllowed,
                                         const fmi3ValueReference requiredIntermediateVariables[],
                                         size_t nRequiredIntermediateVariables,
                                         fmi3InstanceEnvironment instanceEnvironment,
                                         fmi3LogMessageCallback logMessage,
                                         fmi3IntermediateUpdateCallback intermediateUpdate) {
    Host host = host_of(instanceEnvironment, logMessage);
    Instance *self;
    (void)resourcePath, (void)visible;
    host.update = (AnyFunction)intermediateUpdate;
    host.show = intermediateUpdate ? show : NULL;
    host.may_end_early = earlyReturnAllowed;
    self = create_instance(&host, instanceName, instantiationToken, CO_SIMULATION, loggingOn);
    if (!self) return NULL;
    if (eventModeUsed) {
        report(self, ERROR, "%s: there is no event mode in Co-Simulation (hasEventMode is false)", __func__);
    } else if (can_show(self, requiredIntermediateVariables, nRequiredIntermediateVariables)) {
        return self;
    }
    free_instance(self);
    return NULL;
}

fmi3Instance fmi3InstantiateScheduledExecution(fmi3String instanceName, fmi3String instantiationToken,
                                               fmi3String resourcePath, fmi3Boolean visible, fmi3Boolean loggingOn,
                                               fmi3InstanceEnvironment instanceEnvironment,
                                               fmi3LogMessageCallback logMessage, fmi3ClockUpdateCallback clockUpdate,
                                               fmi3LockPreemptionCallback lockPreemption,
                                               fmi3UnlockPreemptionCallback unlockPreemption) {
    (void)instanceName, (void)instantiationToken, (void)resourcePath, (void)visible, (void)loggingOn;
    (void)clockUpdate, (void)lockPreemption, (void)unlockPreemption;
    if (logMessage) {
        logMessage(instanceEnvironment, fmi3Error, "logStatusError",
                   "fmi3InstantiateScheduledExecution: the model has no Scheduled Execution");
    }
    return NULL;
}

void fmi3FreeInstance(fmi3Instance instance) { free_instance(instance); }

fmi3Status fmi3EnterInitializationMode(fmi3Instance instance, fmi3Boolean toleranceDefined, fmi3Float64 tolerance,
                                       fmi3Float64 startTime, fmi3Boolean stopTimeDefined, fmi3Float64 stopTime) {
    (void)toleranceDefined, (void)tolerance;
    if (REFUSED(instance, INSTANTIATED, ANY_KIND)) return fmi3Error;
    if (set_experiment(instance, startTime, stopTimeDefined, stopTime) != OK) return fmi3Error;
    ((Instance *)instance)->mode = INITIALISING;
    return fmi3OK;
}

fmi3Status fmi3ExitInitializationMode(fmi3Instance instance) {
    if (REFUSED(instance, INITIALISING, ANY_KIND)) return fmi3Error;
    return (fmi3Status)finish_initialisation(instance);
}

fmi3Status fmi3Terminate(fmi3Instance instance) {
    if (REFUSED(instance, SIMULATED, ANY_KIND)) return fmi3Error;
    ((Instance *)instance)->mode = TERMINATED;
    return fmi3OK;
}

fmi3Status fmi3Reset(fmi3Instance instance) {
    if (REFUSED(instance, BETWEEN_CALLS, ANY_KIND)) return fmi3Error;
    reset_instance(instance);
    return fmi3OK;
}

/* ---- variables ---- */

fmi3Status fmi3GetFloat64(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                          fmi3Float64 values[], size_t nValues) {
    if (REFUSED(instance, ANY_MODE, ANY_KIND)) return fmi3Error;
    if (MISSING(instance, valueReferences, nValueReferences)) return fmi3Error;
    if (UNFIT(instance, values, nValues, nValueReferences)) return fmi3Error;
    return (fmi3Status)get_reals(instance, valueReferences, nValueReferences, values);
}

fmi3Status fmi3SetFloat64(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                          const fmi3Float64 values[], size_t nValues) {
    if (REFUSED(instance, BEFORE_END, ANY_KIND)) return fmi3Error;
    if (MISSING(instance, valueReferences, nValueReferences)) return fmi3Error;
    if (UNFIT(instance, values, nValues, nValueReferences)) return fmi3Error;
    return (fmi3Status)set_reals(instance, valueReferences, nValueReferences, values);
}

fmi3Status fmi3GetBoolean(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                          fmi3Boolean values[], size_t nValues) {
    if (REFUSED(instance, ANY_MODE, ANY_KIND)) return fmi3Error;
    if (MISSING(instance, valueReferences, nValueReferences)) return fmi3Error;
    if (UNFIT(instance, values, nValues, nValueReferences)) return fmi3Error;
    for (size_t i = 0; i < nValues; ++i) {
        if (get_boolean(instance, valueReferences[i], &values[i]) != OK) return fmi3Error;
    }
    return fmi3OK;
}

fmi3Status fmi3SetBoolean(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                          const fmi3Boolean values[], size_t nValues) {
    if (REFUSED(instance, BEFORE_END, ANY_KIND)) return fmi3Error;
    if (MISSING(instance, valueReferences, nValueReferences)) return fmi3Error;
    if (UNFIT(instance, values, nValues, nValueReferences)) return fmi3Error;
    for (size_t i = 0; i < nValues; ++i) {
        if (check_boolean(instance, valueReferences[i]) != OK) return fmi3Error;
    }
    for (size_t i = 0; i < nValues; ++i) set_boolean(instance, valueReferences[i], values[i]);
    return fmi3OK;
}

static fmi3Status no_type(fmi3Instance instance, const char *function, const char *type,
                          const fmi3ValueReference valueReferences[], size_t count) {
    if (refused(instance, function, ANY_MODE, ANY_KIND)) return fmi3Error;
    return (fmi3Status)no_such_type(instance, type, valueReferences, count);
}

/* The model has no variables of these types. */
#define NO_VARIABLES_OF(Type)                                                                                       \
    fmi3Status fmi3Get##Type(fmi3Instance instance, const fmi3ValueReference valueReferences[],                     \
                             size_t nValueReferences, fmi3##Type values[], size_t nValues) {                        \
        (void)values, (void)nValues;                                                                                \
        return no_type(instance, __func__, #Type, valueReferences, nValueReferences);                               \
    }                                                                                                               \
    fmi3Status fmi3Set##Type(fmi3Instance instance, const fmi3ValueReference valueReferences[],                     \
                             size_t nValueReferences, const fmi3##Type values[], size_t nValues) {                  \
        (void)values, (void)nValues;                                                                                \
        return no_type(instance, __func__, #Type, valueReferences, nValueReferences);                               \
    }
NO_VARIABLES_OF(Float32)
NO_VARIABLES_OF(Int8)
NO_VARIABLES_OF(UInt8)
NO_VARIABLES_OF(Int16)
NO_VARIABLES_OF(UInt16)
NO_VARIABLES_OF(Int32)
NO_VARIABLES_OF(UInt32)
NO_VARIABLES_OF(Int64)
NO_VARIABLES_OF(UInt64)
NO_VARIABLES_OF(String)

fmi3Status fmi3GetBinary(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                         size_t valueSizes[], fmi3Binary values[], size_t nValues) {
    (void)valueSizes, (void)values, (void)nValues;
    return no_type(instance, __func__, "Binary", valueReferences, nValueReferences);
}

fmi3Status fmi3SetBinary(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                         const size_t valueSizes[], const fmi3Binary values[], size_t nValues) {
    (void)valueSizes, (void)values, (void)nValues;
    return no_type(instance, __func__, "Binary", valueReferences, nValueReferences);
}

fmi3Status fmi3GetClock(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                        fmi3Clock values[]) {
    (void)values;
    return no_type(instance, __func__, "Clock", valueReferences, nValueReferences);
}

fmi3Status fmi3SetClock(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                        const fmi3Clock values[]) {
    (void)values;
    return no_type(instance, __func__, "Clock", valueReferences, nValueReferences);
}

/* ---- the state as a whole ---- */

fmi3Status fmi3GetFMUState(fmi3Instance instance, fmi3FMUState *FMUState) {
    if (REFUSED(instance, BETWEEN_CALLS, ANY_KIND) || MISSING(instance, FMUState, 1)) return fmi3Error;
    return (fmi3Status)save_state(instance, FMUState);
}

fmi3Status fmi3SetFMUState(fmi3Instance instance, fmi3FMUState FMUState) {
    if (REFUSED(instance, BETWEEN_CALLS, ANY_KIND) || MISSING(instance, FMUState, 1)) return fmi3Error;
    return (fmi3Status)restore_state(instance, FMUState);
}

fmi3Status fmi3FreeFMUState(fmi3Instance instance, fmi3FMUState *FMUState) {
    if (REFUSED(instance, BETWEEN_CALLS, ANY_KIND)) return fmi3Error;
    if (FMUState) free_state(FMUState);
    return fmi3OK;
}

fmi3Status fmi3SerializedFMUStateSize(fmi3Instance instance, fmi3FMUState FMUState, size_t *size) {
    if (REFUSED(instance, BETWEEN_CALLS, ANY_KIND)) return fmi3Error;
    if (MISSING(instance, FMUState, 1) || MISSING(instance, size, 1)) return fmi3Error;
    *size = serialised_size();
    return fmi3OK;
}

fmi3Status fmi3SerializeFMUState(fmi3Instance instance, fmi3FMUState FMUState, fmi3Byte serializedState[],
                                 size_t size) {
    if (REFUSED(instance, BETWEEN_CALLS, ANY_KIND)) return fmi3Error;
    if (MISSING(instance, FMUState, 1) || MISSING(instance, serializedState, 1)) return fmi3Error;
    return (fmi3Status)serialise_state(instance, FMUState, (char *)serializedState, size);
}

fmi3Status fmi3DeserializeFMUState(fmi3Instance instance, const fmi3Byte serializedState[], size_t size,
                                   fmi3FMUState *FMUState) {
    if (REFUSED(instance, BETWEEN_CALLS, ANY_KIND)) return fmi3Error;
    if (MISSING(instance, serializedState, 1) || MISSING(instance, FMUState, 1)) return fmi3Error;
    return (fmi3Status)deserialise_state(instance, (const char *)serializedState, size, FMUState);
}

/* ---- partial derivatives ---- */

fmi3Status fmi3GetDirectionalDerivative(fmi3Instance instance, const fmi3ValueReference unknowns[], size_t nUnknowns,
                                        const fmi3ValueReference knowns[], size_t nKnowns, const fmi3Float64 seed[],
                                        size_t nSeed, fmi3Float64 sensitivity[], size_t nSensitivity) {
    if (REFUSED(instance, AFTER_START, ANY_KIND)) return fmi3Error;
    if (MISSING(instance, unknowns, nUnknowns) || MISSING(instance, knowns, nKnowns)) {
        return fmi3Error;
    }
    if (UNFIT(instance, seed, nSeed, nKnowns)) return fmi3Error;
    if (UNFIT(instance, sensitivity, nSensitivity, nUnknowns)) return fmi3Error;
    return (fmi3Status)directional_derivative(instance, unknowns, nUnknowns, knowns, nKnowns, seed, sensitivity);
}

fmi3Status fmi3GetAdjointDerivative(fmi3Instance instance, const fmi3ValueReference unknowns[], size_t nUnknowns,
                                    const fmi3ValueReference knowns[], size_t nKnowns, const fmi3Float64 seed[],
                                    size_t nSeed, fmi3Float64 sensitivity[], size_t nSensitivity) {
    if (REFUSED(instance, AFTER_START, ANY_KIND)) return fmi3Error;
    if (MISSING(instance, unknowns, nUnknowns) || MISSING(instance, knowns, nKnowns)) {
        return fmi3Error;
    }
    if (UNFIT(instance, seed, nSeed, nUnknowns)) return fmi3Error;
    if (UNFIT(instance, sensitivity, nSensitivity, nKnowns)) return fmi3Error;
    return (fmi3Status)adjoint_derivative(instance, unknowns, nUnknowns, knowns, nKnowns, seed, sensitivity);
}
