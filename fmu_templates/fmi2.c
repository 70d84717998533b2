/* The functions of FMI 2.0 for Model Exchange and Co-Simulation. */
#include "fmi2Functions.h"

#include <string.h>

#include "instance.h"

/* The logger of FMI 2 takes a format, in which # announces a reference to a variable: both signs are doubled. */
static void send(const Instance *self, Status status, const char *category, const char *message) {
    const fmi2CallbackLogger logger = (fmi2CallbackLogger)self->host.logger;
    char format[1024];
    size_t length = 0;
    for (; *message && length + 2 < sizeof format; ++message) {
        if (*message == '%' || *message == '#') format[length++] = *message;
        format[length++] = *message;
    }
    format[length] = '\0';
    logger(self->host.environment, self->name, (fmi2Status)status, category, format);
}

/* ---- version, logging ---- */

const char *fmi2GetTypesPlatform(void) { return fmi2TypesPlatform; }

const char *fmi2GetVersion(void) { return fmi2Version; }

fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean loggingOn, size_t nCategories,
                               const fmi2String categories[]) {
    if (REFUSED(c, ANY_MODE, ANY_KIND)) return fmi2Error;
    if (MISSING(c, categories, nCategories)) return fmi2Error;
    return (fmi2Status)select_logging(c, loggingOn != fmi2False, nCategories, categories);
}

/* ---- life ---- */

fmi2Component fmi2Instantiate(fmi2String instanceName, fmi2Type fmuType, fmi2String fmuGUID,
                              fmi2String fmuResourceLocation, const fmi2CallbackFunctions *functions,
                              fmi2Boolean visible, fmi2Boolean loggingOn) {
    /* Memory is never the caller's: engines exist whose allocateMemory cuts the address to 32 bits. */
    Host host = {.send = send};
    int kind = 0;
    (void)fmuResourceLocation;
    (void)visible;
    if (!functions) return NULL;
    host.environment = functions->componentEnvironment;
    host.logger = (AnyFunction)functions->logger;
    if (fmuType == fmi2ModelExchange) kind = MODEL_EXCHANGE;
    if (fmuType == fmi2CoSimulation) kind = CO_SIMULATION;
    return create_instance(&host, instanceName, fmuGUID, kind, loggingOn != fmi2False);
}

void fmi2FreeInstance(fmi2Component c) { free_instance(c); }

fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean toleranceDefined, fmi2Real tolerance, fmi2Real startTime,
                               fmi2Boolean stopTimeDefined, fmi2Real stopTime) {
    (void)toleranceDefined;
    (void)tolerance;
    if (REFUSED(c, INSTANTIATED, ANY_KIND)) return fmi2Error;
    return (fmi2Status)set_experiment(c, startTime, stopTimeDefined != fmi2False, stopTime);
}

fmi2Status fmi2EnterInitializationMode(fmi2Component c) {
    if (REFUSED(c, INSTANTIATED, ANY_KIND)) return fmi2Error;
    ((Instance *)c)->mode = INITIALISING;
    return fmi2OK;
}

fmi2Status fmi2ExitInitializationMode(fmi2Component c) {
    if (REFUSED(c, INITIALISING, ANY_KIND)) return fmi2Error;
    return (fmi2Status)finish_initialisation(c);
}

fmi2Status fmi2Terminate(fmi2Component c) {
    if (REFUSED(c, SIMULATED, ANY_KIND)) return fmi2Error;
    ((Instance *)c)->mode = TERMINATED;
    return fmi2OK;
}

fmi2Status fmi2Reset(fmi2Component c) {
    if (REFUSED(c, ANY_MODE, ANY_KIND)) return fmi2Error;
    reset_instance(c);
    return fmi2OK;
}

/* ---- variables ---- */

fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, fmi2Real value[]) {
    if (REFUSED(c, ANY_MODE, ANY_KIND)) return fmi2Error;
    if (MISSING(c, vr, nvr) || MISSING(c, value, nvr)) return fmi2Error;
    return (fmi2Status)get_reals(c, vr, nvr, value);
}

fmi2Status fmi2GetBoolean(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, fmi2Boolean value[]) {
    if (REFUSED(c, ANY_MODE, ANY_KIND)) return fmi2Error;
    if (MISSING(c, vr, nvr) || MISSING(c, value, nvr)) return fmi2Error;
    for (size_t i = 0; i < nvr; ++i) {
        bool held = false;
        if (get_boolean(c, vr[i], &held) != OK) return fmi2Error;
        value[i] = held ? fmi2True : fmi2False;
    }
    return fmi2OK;
}

fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, const fmi2Real value[]) {
    if (REFUSED(c, BEFORE_END, ANY_KIND)) return fmi2Error;
    if (MISSING(c, vr, nvr) || MISSING(c, value, nvr)) return fmi2Error;
    return (fmi2Status)set_reals(c, vr, nvr, value);
}

fmi2Status fmi2SetBoolean(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, const fmi2Boolean value[]) {
    if (REFUSED(c, BEFORE_END, ANY_KIND)) return fmi2Error;
    if (MISSING(c, vr, nvr) || MISSING(c, value, nvr)) return fmi2Error;
    for (size_t i = 0; i < nvr; ++i) {
        if (check_boolean(c, vr[i]) != OK) return fmi2Error;
    }
    for (size_t i = 0; i < nvr; ++i) set_boolean(c, vr[i], value[i] != fmi2False);
    return fmi2OK;
}

static fmi2Status no_type(fmi2Component c, const char *function, const char *type, const fmi2ValueReference vr[],
                          size_t nvr) {
    if (refused(c, function, ANY_MODE, ANY_KIND)) return fmi2Error;
    return (fmi2Status)no_such_type(c, type, vr, nvr);
}

fmi2Status fmi2GetInteger(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, fmi2Integer value[]) {
    (void)value;
    return no_type(c, __func__, "Integer", vr, nvr);
}

fmi2Status fmi2GetString(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, fmi2String value[]) {
    (void)value;
    return no_type(c, __func__, "String", vr, nvr);
}

fmi2Status fmi2SetInteger(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, const fmi2Integer value[]) {
    (void)value;
    return no_type(c, __func__, "Integer", vr, nvr);
}

fmi2Status fmi2SetString(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, const fmi2String value[]) {
    (void)value;
    return no_type(c, __func__, "String", vr, nvr);
}

/* ---- the state as a whole ---- */

fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *FMUstate) {
    if (REFUSED(c, BETWEEN_CALLS, ANY_KIND) || MISSING(c, FMUstate, 1)) return fmi2Error;
    return (fmi2Status)save_state(c, FMUstate);
}

fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate FMUstate) {
    if (REFUSED(c, BETWEEN_CALLS, ANY_KIND) || MISSING(c, FMUstate, 1)) return fmi2Error;
    return (fmi2Status)restore_state(c, FMUstate);
}

fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *FMUstate) {
    if (REFUSED(c, BETWEEN_CALLS, ANY_KIND)) return fmi2Error;
    if (FMUstate) free_state(FMUstate);
    return fmi2OK;
}

fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, fmi2FMUstate FMUstate, size_t *size) {
    if (REFUSED(c, BETWEEN_CALLS, ANY_KIND)) return fmi2Error;
    if (MISSING(c, FMUstate, 1) || MISSING(c, size, 1)) return fmi2Error;
    *size = serialised_size();
    return fmi2OK;
}

fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate FMUstate, fmi2Byte serializedState[], size_t size) {
    if (REFUSED(c, BETWEEN_CALLS, ANY_KIND)) return fmi2Error;
    if (MISSING(c, FMUstate, 1) || MISSING(c, serializedState, 1)) return fmi2Error;
    return (fmi2Status)serialise_state(c, FMUstate, serializedState, size);
}

fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const fmi2Byte serializedState[], size_t size,
                                   fmi2FMUstate *FMUstate) {
    if (REFUSED(c, BETWEEN_CALLS, ANY_KIND)) return fmi2Error;
    if (MISSING(c, serializedState, 1) || MISSING(c, FMUstate, 1)) return fmi2Error;
    return (fmi2Status)deserialise_state(c, serializedState, size, FMUstate);
}

/* ---- partial derivatives ---- */

fmi2Status fmi2GetDirectionalDerivative(fmi2Component c, const fmi2ValueReference vUnknown_ref[], size_t nUnknown,
                                        const fmi2ValueReference vKnown_ref[], size_t nKnown,
                                        const fmi2Real dvKnown[], fmi2Real dvUnknown[]) {
    if (REFUSED(c, AFTER_START, ANY_KIND)) return fmi2Error;
    if (MISSING(c, vUnknown_ref, nUnknown) || MISSING(c, dvUnknown, nUnknown)) return fmi2Error;
    if (MISSING(c, vKnown_ref, nKnown) || MISSING(c, dvKnown, nKnown)) return fmi2Error;
    return (fmi2Status)directional_derivative(c, vUnknown_ref, nUnknown, vKnown_ref, nKnown, dvKnown, dvUnknown);
}

/* ---- Model Exchange ---- */

fmi2Status fmi2EnterEventMode(fmi2Component c) {
    if (REFUSED(c, EVENT | CONTINUOUS_TIME, MODEL_EXCHANGE)) return fmi2Error;
    ((Instance *)c)->mode = EVENT;
    return fmi2OK;
}

fmi2Status fmi2NewDiscreteStates(fmi2Component c, fmi2EventInfo *eventInfo) {
    if (REFUSED(c, EVENT, MODEL_EXCHANGE) || MISSING(c, eventInfo, 1)) return fmi2Error;
    memset(eventInfo, 0, sizeof *eventInfo);
    return fmi2OK;
}

fmi2Status fmi2EnterContinuousTimeMode(fmi2Component c) {
    if (REFUSED(c, EVENT, MODEL_EXCHANGE)) return fmi2Error;
    ((Instance *)c)->mode = CONTINUOUS_TIME;
    return fmi2OK;
}

fmi2Status fmi2CompletedIntegratorStep(fmi2Component c, fmi2Boolean noSetFMUStatePriorToCurrentPoint,
                                       fmi2Boolean *enterEventMode, fmi2Boolean *terminateSimulation) {
    (void)noSetFMUStatePriorToCurrentPoint;
    if (REFUSED(c, CONTINUOUS_TIME, MODEL_EXCHANGE)) return fmi2Error;
    if (MISSING(c, enterEventMode, 1) || MISSING(c, terminateSimulation, 1)) return fmi2Error;
    *enterEventMode = fmi2False;
    *terminateSimulation = fmi2False;
    return fmi2OK;
}

fmi2Status fmi2SetTime(fmi2Component c, fmi2Real time) {
    if (REFUSED(c, EVENT | CONTINUOUS_TIME, MODEL_EXCHANGE)) return fmi2Error;
    return (fmi2Status)set_time(c, time);
}

fmi2Status fmi2SetContinuousStates(fmi2Component c, const fmi2Real x[], size_t nx) {
    if (REFUSED(c, CONTINUOUS_TIME, MODEL_EXCHANGE)) return fmi2Error;
    if (UNFIT(c, x, nx, STATE_COUNT)) return fmi2Error;
    return (fmi2Status)set_states(c, x);
}

fmi2Status fmi2GetDerivatives(fmi2Component c, fmi2Real derivatives[], size_t nx) {
    if (REFUSED(c, AFTER_START, MODEL_EXCHANGE)) return fmi2Error;
    if (UNFIT(c, derivatives, nx, STATE_COUNT)) return fmi2Error;
    return (fmi2Status)get_block(c, RATES_BEGIN, RATES_END, derivatives);
}

fmi2Status fmi2GetEventIndicators(fmi2Component c, fmi2Real eventIndicators[], size_t ni) {
    if (REFUSED(c, AFTER_START, MODEL_EXCHANGE)) return fmi2Error;
    if (UNFIT(c, eventIndicators, ni, INDICATOR_COUNT)) return fmi2Error;
    return (fmi2Status)get_block(c, INDICATORS_BEGIN, INDICATORS_END, eventIndicators);
}

fmi2Status fmi2GetContinuousStates(fmi2Component c, fmi2Real x[], size_t nx) {
    if (REFUSED(c, AFTER_START, MODEL_EXCHANGE)) return fmi2Error;
    if (UNFIT(c, x, nx, STATE_COUNT)) return fmi2Error;
    return (fmi2Status)get_block(c, STATES_BEGIN, STATES_END, x);
}

fmi2Status fmi2GetNominalsOfContinuousStates(fmi2Component c, fmi2Real x_nominal[], size_t nx) {
    if (REFUSED(c, ANY_MODE, MODEL_EXCHANGE)) return fmi2Error;
    if (UNFIT(c, x_nominal, nx, STATE_COUNT)) return fmi2Error;
    for (size_t i = STATES_BEGIN; i < STATES_END; ++i) x_nominal[i - STATES_BEGIN] = VARIABLES[i].nominal;
    return fmi2OK;
}

/* ---- Co-Simulation ---- */

/* Orders change in steps, and inputs held over a step are what the reference integrates too: a line through them would
 * make the result depend on the length of communication steps. */
fmi2Status fmi2SetRealInputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t nvr,
                                       const fmi2Integer order[], const fmi2Real value[]) {
    (void)vr, (void)nvr, (void)order, (void)value;
    return (fmi2Status)unsupported(c, __func__, "inputs are not interpolated (canInterpolateInputs is false)");
}

fmi2Status fmi2GetRealOutputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t nvr,
                                        const fmi2Integer order[], fmi2Real value[]) {
    if (REFUSED(c, STEPPING | TERMINATED, CO_SIMULATION)) return fmi2Error;
    if (MISSING(c, vr, nvr) || MISSING(c, order, nvr) || MISSING(c, value, nvr)) return fmi2Error;
    return (fmi2Status)output_derivatives(c, vr, nvr, order, value);
}

fmi2Status fmi2DoStep(fmi2Component c, fmi2Real currentCommunicationPoint, fmi2Real communicationStepSize,
                      fmi2Boolean noSetFMUStatePriorToCurrentPoint) {
    (void)noSetFMUStatePriorToCurrentPoint;
    if (REFUSED(c, STEPPING, CO_SIMULATION)) return fmi2Error;
    return (fmi2Status)do_step(c, currentCommunicationPoint, communicationStepSize);
}

fmi2Status fmi2CancelStep(fmi2Component c) {
    return (fmi2Status)unsupported(c, __func__, "no step is ever pending: fmi2DoStep returns when it is done");
}

fmi2Status fmi2GetStatus(fmi2Component c, const fmi2StatusKind s, fmi2Status *value) {
    if (REFUSED(c, ANY_MODE, CO_SIMULATION) || MISSING(c, value, 1)) return fmi2Error;
    if (s != fmi2DoStepStatus) return (fmi2Status)report(c, DISCARD, "%s: unknown status", __func__);
    *value = (fmi2Status)((Instance *)c)->last_step;
    return fmi2OK;
}

fmi2Status fmi2GetRealStatus(fmi2Component c, const fmi2StatusKind s, fmi2Real *value) {
    if (REFUSED(c, ANY_MODE, CO_SIMULATION) || MISSING(c, value, 1)) return fmi2Error;
    if (s != fmi2LastSuccessfulTime) return (fmi2Status)report(c, DISCARD, "%s: unknown status", __func__);
    *value = ((Instance *)c)->value[TIME];
    return fmi2OK;
}

fmi2Status fmi2GetIntegerStatus(fmi2Component c, const fmi2StatusKind s, fmi2Integer *value) {
    (void)s;
    if (REFUSED(c, ANY_MODE, CO_SIMULATION) || MISSING(c, value, 1)) return fmi2Error;
    return (fmi2Status)report(c, DISCARD, "%s: unknown status", __func__);
}

fmi2Status fmi2GetBooleanStatus(fmi2Component c, const fmi2StatusKind s, fmi2Boolean *value) {
    if (REFUSED(c, ANY_MODE, CO_SIMULATION) || MISSING(c, value, 1)) return fmi2Error;
    if (s != fmi2Terminated) return (fmi2Status)report(c, DISCARD, "%s: unknown status", __func__);
    /* The same step would fail again: a simulator that only asks whether to go on would ask for ever. */
    *value = ((Instance *)c)->last_step == DISCARD;
    return fmi2OK;
}

fmi2Status fmi2GetStringStatus(fmi2Component c, const fmi2StatusKind s, fmi2String *value) {
    (void)s;
    if (REFUSED(c, ANY_MODE, CO_SIMULATION) || MISSING(c, value, 1)) return fmi2Error;
    return (fmi2Status)report(c, DISCARD, "%s: unknown status", __func__);
}
