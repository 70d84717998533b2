/* The functions of FMI 3.0 for Model Exchange and Co-Simulation. */
#include "fmi3Functions.h"

#include <stdlib.h>

#include "instance.h"

enum { BEFORE_END = ANY_MODE & ~TERMINATED, AFTER_START = ANY_MODE & ~INSTANTIATED };
enum { SIMULATED = EVENT | CONTINUOUS_TIME | STEPPING };

static void send(const Instance *self, Status status, const char *category, const char *message) {
    ((fmi3LogMessageCallback)self->host.logger)(self->host.environment, (fmi3Status)status, category, message);
}

/* True if an array cannot be taken: not as long as it must be, or a null pointer. */
static bool unfit(fmi3Instance instance, const char *function, const void *values, size_t count, size_t expected) {
    if (count != expected) {
        report(instance, ERROR, "%s: the array has %lu elements and must have %lu", function, (unsigned long)count,
               (unsigned long)expected);
        return true;
    }
    return missing(instance, function, values, count);
}

/* ---- version, logging ---- */

const char *fmi3GetVersion(void) { return fmi3Version; }

fmi3Status fmi3SetDebugLogging(fmi3Instance instance, fmi3Boolean loggingOn, size_t nCategories,
                               const fmi3String categories[]) {
    if (refused(instance, __func__, ANY_MODE, ANY_KIND)) return fmi3Error;
    if (missing(instance, __func__, categories, nCategories)) return fmi3Error;
    return (fmi3Status)select_logging(instance, loggingOn, nCategories, categories);
}

/* ---- life ---- */

static Host host_of(fmi3InstanceEnvironment environment, fmi3LogMessageCallback logMessage) {
    const Host host = {environment, (AnyFunction)logMessage, send, calloc, free};
    return host;
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
    const Host host = host_of(instanceEnvironment, logMessage);
    Instance *self = create_instance(&host, instanceName, instantiationToken, CO_SIMULATION, loggingOn);
    (void)resourcePath, (void)visible, (void)earlyReturnAllowed, (void)requiredIntermediateVariables;
    (void)intermediateUpdate;
    if (self && eventModeUsed) {
        report(self, ERROR, "%s: there is no event mode in Co-Simulation (hasEventMode is false)", __func__);
    } else if (self && nRequiredIntermediateVariables > 0) {
        report(self, ERROR, "%s: there is no intermediate update (providesIntermediateUpdate is false)", __func__);
    } else {
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
    if (refused(instance, __func__, INSTANTIATED, ANY_KIND)) return fmi3Error;
    if (set_experiment(instance, startTime, stopTimeDefined, stopTime) != OK) return fmi3Error;
    ((Instance *)instance)->mode = INITIALISING;
    return fmi3OK;
}

fmi3Status fmi3ExitInitializationMode(fmi3Instance instance) {
    if (refused(instance, __func__, INITIALISING, ANY_KIND)) return fmi3Error;
    return (fmi3Status)finish_initialisation(instance);
}

fmi3Status fmi3EnterEventMode(fmi3Instance instance) {
    if (refused(instance, __func__, EVENT | CONTINUOUS_TIME, MODEL_EXCHANGE)) return fmi3Error;
    ((Instance *)instance)->mode = EVENT;
    return fmi3OK;
}

fmi3Status fmi3Terminate(fmi3Instance instance) {
    if (refused(instance, __func__, SIMULATED, ANY_KIND)) return fmi3Error;
    ((Instance *)instance)->mode = TERMINATED;
    return fmi3OK;
}

fmi3Status fmi3Reset(fmi3Instance instance) {
    if (refused(instance, __func__, ANY_MODE, ANY_KIND)) return fmi3Error;
    reset_instance(instance);
    return fmi3OK;
}

/* ---- variables ---- */

fmi3Status fmi3GetFloat64(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                          fmi3Float64 values[], size_t nValues) {
    if (refused(instance, __func__, ANY_MODE, ANY_KIND)) return fmi3Error;
    if (missing(instance, __func__, valueReferences, nValueReferences)) return fmi3Error;
    if (unfit(instance, __func__, values, nValues, nValueReferences)) return fmi3Error;
    return (fmi3Status)get_reals(instance, valueReferences, nValueReferences, values);
}

fmi3Status fmi3SetFloat64(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                          const fmi3Float64 values[], size_t nValues) {
    if (refused(instance, __func__, BEFORE_END, ANY_KIND)) return fmi3Error;
    if (missing(instance, __func__, valueReferences, nValueReferences)) return fmi3Error;
    if (unfit(instance, __func__, values, nValues, nValueReferences)) return fmi3Error;
    return (fmi3Status)set_reals(instance, valueReferences, nValueReferences, values);
}

fmi3Status fmi3GetBoolean(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                          fmi3Boolean values[], size_t nValues) {
    if (refused(instance, __func__, ANY_MODE, ANY_KIND)) return fmi3Error;
    if (missing(instance, __func__, valueReferences, nValueReferences)) return fmi3Error;
    if (unfit(instance, __func__, values, nValues, nValueReferences)) return fmi3Error;
    for (size_t i = 0; i < nValues; ++i) {
        if (get_boolean(instance, valueReferences[i], &values[i]) != OK) return fmi3Error;
    }
    return fmi3OK;
}

fmi3Status fmi3SetBoolean(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                          const fmi3Boolean values[], size_t nValues) {
    if (refused(instance, __func__, BEFORE_END, ANY_KIND)) return fmi3Error;
    if (missing(instance, __func__, valueReferences, nValueReferences)) return fmi3Error;
    if (unfit(instance, __func__, values, nValues, nValueReferences)) return fmi3Error;
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
    if (refused(instance, __func__, ANY_MODE, ANY_KIND) || missing(instance, __func__, FMUState, 1)) return fmi3Error;
    return (fmi3Status)save_state(instance, FMUState);
}

fmi3Status fmi3SetFMUState(fmi3Instance instance, fmi3FMUState FMUState) {
    if (refused(instance, __func__, ANY_MODE, ANY_KIND) || missing(instance, __func__, FMUState, 1)) return fmi3Error;
    return (fmi3Status)restore_state(instance, FMUState);
}

fmi3Status fmi3FreeFMUState(fmi3Instance instance, fmi3FMUState *FMUState) {
    if (refused(instance, __func__, ANY_MODE, ANY_KIND)) return fmi3Error;
    if (FMUState) free_state(instance, FMUState);
    return fmi3OK;
}

fmi3Status fmi3SerializedFMUStateSize(fmi3Instance instance, fmi3FMUState FMUState, size_t *size) {
    if (refused(instance, __func__, ANY_MODE, ANY_KIND)) return fmi3Error;
    if (missing(instance, __func__, FMUState, 1) || missing(instance, __func__, size, 1)) return fmi3Error;
    *size = serialised_size();
    return fmi3OK;
}

fmi3Status fmi3SerializeFMUState(fmi3Instance instance, fmi3FMUState FMUState, fmi3Byte serializedState[],
                                 size_t size) {
    if (refused(instance, __func__, ANY_MODE, ANY_KIND)) return fmi3Error;
    if (missing(instance, __func__, FMUState, 1) || missing(instance, __func__, serializedState, 1)) return fmi3Error;
    return (fmi3Status)serialise_state(instance, FMUState, (char *)serializedState, size);
}

fmi3Status fmi3DeserializeFMUState(fmi3Instance instance, const fmi3Byte serializedState[], size_t size,
                                   fmi3FMUState *FMUState) {
    if (refused(instance, __func__, ANY_MODE, ANY_KIND)) return fmi3Error;
    if (missing(instance, __func__, serializedState, 1) || missing(instance, __func__, FMUState, 1)) return fmi3Error;
    return (fmi3Status)deserialise_state(instance, (const char *)serializedState, size, FMUState);
}

/* ---- partial derivatives ---- */

fmi3Status fmi3GetDirectionalDerivative(fmi3Instance instance, const fmi3ValueReference unknowns[], size_t nUnknowns,
                                        const fmi3ValueReference knowns[], size_t nKnowns, const fmi3Float64 seed[],
                                        size_t nSeed, fmi3Float64 sensitivity[], size_t nSensitivity) {
    if (refused(instance, __func__, AFTER_START, ANY_KIND)) return fmi3Error;
    if (missing(instance, __func__, unknowns, nUnknowns) || missing(instance, __func__, knowns, nKnowns)) {
        return fmi3Error;
    }
    if (unfit(instance, __func__, seed, nSeed, nKnowns)) return fmi3Error;
    if (unfit(instance, __func__, sensitivity, nSensitivity, nUnknowns)) return fmi3Error;
    return (fmi3Status)directional_derivative(instance, unknowns, nUnknowns, knowns, nKnowns, seed, sensitivity);
}

fmi3Status fmi3GetAdjointDerivative(fmi3Instance instance, const fmi3ValueReference unknowns[], size_t nUnknowns,
                                    const fmi3ValueReference knowns[], size_t nKnowns, const fmi3Float64 seed[],
                                    size_t nSeed, fmi3Float64 sensitivity[], size_t nSensitivity) {
    if (refused(instance, __func__, AFTER_START, ANY_KIND)) return fmi3Error;
    if (missing(instance, __func__, unknowns, nUnknowns) || missing(instance, __func__, knowns, nKnowns)) {
        return fmi3Error;
    }
    if (unfit(instance, __func__, seed, nSeed, nUnknowns)) return fmi3Error;
    if (unfit(instance, __func__, sensitivity, nSensitivity, nKnowns)) return fmi3Error;
    return (fmi3Status)adjoint_derivative(instance, unknowns, nUnknowns, knowns, nKnowns, seed, sensitivity);
}

/* ---- Model Exchange ---- */

fmi3Status fmi3UpdateDiscreteStates(fmi3Instance instance, fmi3Boolean *discreteStatesNeedUpdate,
                                    fmi3Boolean *terminateSimulation, fmi3Boolean *nominalsOfContinuousStatesChanged,
                                    fmi3Boolean *valuesOfContinuousStatesChanged, fmi3Boolean *nextEventTimeDefined,
                                    fmi3Float64 *nextEventTime) {
    fmi3Boolean *const flags[] = {discreteStatesNeedUpdate, terminateSimulation, nominalsOfContinuousStatesChanged,
                                  valuesOfContinuousStatesChanged, nextEventTimeDefined};
    if (refused(instance, __func__, EVENT, MODEL_EXCHANGE)) return fmi3Error;
    if (missing(instance, __func__, nextEventTime, 1)) return fmi3Error;
    for (size_t i = 0; i < sizeof flags / sizeof flags[0]; ++i) {
        if (missing(instance, __func__, flags[i], 1)) return fmi3Error;
    }
    for (size_t i = 0; i < sizeof flags / sizeof flags[0]; ++i) *flags[i] = fmi3False;
    *nextEventTime = 0;
    return fmi3OK;
}

fmi3Status fmi3EnterContinuousTimeMode(fmi3Instance instance) {
    if (refused(instance, __func__, EVENT, MODEL_EXCHANGE)) return fmi3Error;
    ((Instance *)instance)->mode = CONTINUOUS_TIME;
    return fmi3OK;
}

fmi3Status fmi3CompletedIntegratorStep(fmi3Instance instance, fmi3Boolean noSetFMUStatePriorToCurrentPoint,
                                       fmi3Boolean *enterEventMode, fmi3Boolean *terminateSimulation) {
    (void)noSetFMUStatePriorToCurrentPoint;
    if (refused(instance, __func__, CONTINUOUS_TIME, MODEL_EXCHANGE)) return fmi3Error;
    if (missing(instance, __func__, enterEventMode, 1)) return fmi3Error;
    if (missing(instance, __func__, terminateSimulation, 1)) return fmi3Error;
    *enterEventMode = fmi3False;
    *terminateSimulation = fmi3False;
    return fmi3OK;
}

fmi3Status fmi3SetTime(fmi3Instance instance, fmi3Float64 time) {
    if (refused(instance, __func__, EVENT | CONTINUOUS_TIME, MODEL_EXCHANGE)) return fmi3Error;
    return (fmi3Status)set_time(instance, time);
}

fmi3Status fmi3SetContinuousStates(fmi3Instance instance, const fmi3Float64 continuousStates[],
                                   size_t nContinuousStates) {
    if (refused(instance, __func__, CONTINUOUS_TIME, MODEL_EXCHANGE)) return fmi3Error;
    if (unfit(instance, __func__, continuousStates, nContinuousStates, STATE_COUNT)) return fmi3Error;
    return (fmi3Status)set_states(instance, continuousStates);
}

fmi3Status fmi3GetContinuousStates(fmi3Instance instance, fmi3Float64 continuousStates[], size_t nContinuousStates) {
    if (refused(instance, __func__, AFTER_START, MODEL_EXCHANGE)) return fmi3Error;
    if (unfit(instance, __func__, continuousStates, nContinuousStates, STATE_COUNT)) return fmi3Error;
    return (fmi3Status)get_block(instance, STATES_BEGIN, STATES_END, continuousStates);
}

fmi3Status fmi3GetContinuousStateDerivatives(fmi3Instance instance, fmi3Float64 derivatives[],
                                             size_t nContinuousStates) {
    if (refused(instance, __func__, AFTER_START, MODEL_EXCHANGE)) return fmi3Error;
    if (unfit(instance, __func__, derivatives, nContinuousStates, STATE_COUNT)) return fmi3Error;
    return (fmi3Status)get_block(instance, RATES_BEGIN, RATES_END, derivatives);
}

fmi3Status fmi3GetNominalsOfContinuousStates(fmi3Instance instance, fmi3Float64 nominals[], size_t nContinuousStates) {
    if (refused(instance, __func__, ANY_MODE, MODEL_EXCHANGE)) return fmi3Error;
    if (unfit(instance, __func__, nominals, nContinuousStates, STATE_COUNT)) return fmi3Error;
    for (size_t i = STATES_BEGIN; i < STATES_END; ++i) nominals[i - STATES_BEGIN] = VARIABLES[i].nominal;
    return fmi3OK;
}

fmi3Status fmi3GetEventIndicators(fmi3Instance instance, fmi3Float64 eventIndicators[], size_t nEventIndicators) {
    if (refused(instance, __func__, AFTER_START, MODEL_EXCHANGE)) return fmi3Error;
    return unfit(instance, __func__, eventIndicators, nEventIndicators, 0) ? fmi3Error : fmi3OK;
}

fmi3Status fmi3GetNumberOfEventIndicators(fmi3Instance instance, size_t *nEventIndicators) {
    if (refused(instance, __func__, ANY_MODE, MODEL_EXCHANGE)) return fmi3Error;
    if (missing(instance, __func__, nEventIndicators, 1)) return fmi3Error;
    *nEventIndicators = 0;
    return fmi3OK;
}

fmi3Status fmi3GetNumberOfContinuousStates(fmi3Instance instance, size_t *nContinuousStates) {
    if (refused(instance, __func__, ANY_MODE, MODEL_EXCHANGE)) return fmi3Error;
    if (missing(instance, __func__, nContinuousStates, 1)) return fmi3Error;
    *nContinuousStates = STATE_COUNT;
    return fmi3OK;
}

/* ---- Co-Simulation ---- */

fmi3Status fmi3DoStep(fmi3Instance instance, fmi3Float64 currentCommunicationPoint, fmi3Float64 communicationStepSize,
                      fmi3Boolean noSetFMUStatePriorToCurrentPoint, fmi3Boolean *eventHandlingNeeded,
                      fmi3Boolean *terminateSimulation, fmi3Boolean *earlyReturn, fmi3Float64 *lastSuccessfulTime) {
    Status status;
    (void)noSetFMUStatePriorToCurrentPoint;
    if (refused(instance, __func__, STEPPING, CO_SIMULATION)) return fmi3Error;
    if (missing(instance, __func__, eventHandlingNeeded, 1) || missing(instance, __func__, terminateSimulation, 1) ||
        missing(instance, __func__, earlyReturn, 1) || missing(instance, __func__, lastSuccessfulTime, 1)) {
        return fmi3Error;
    }
    status = do_step(instance, currentCommunicationPoint, communicationStepSize);
    *eventHandlingNeeded = fmi3False;
    *terminateSimulation = status == DISCARD; /* the same step would fail again */
    *earlyReturn = fmi3False;
    *lastSuccessfulTime = ((Instance *)instance)->value[TIME];
    return (fmi3Status)status;
}
