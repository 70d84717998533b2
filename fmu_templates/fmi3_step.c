/* The functions of FMI 3.0 that solve: event and continuous-time mode of Model Exchange, steps of Co-Simulation. */
#include "fmi3Functions.h"

#include "instance.h"

/* ---- Model Exchange ---- */

fmi3Status fmi3EnterEventMode(fmi3Instance instance) {
    if (REFUSED(instance, EVENT | CONTINUOUS_TIME, MODEL_EXCHANGE)) return fmi3Error;
    ((Instance *)instance)->mode = EVENT;
    return fmi3OK;
}

fmi3Status fmi3UpdateDiscreteStates(fmi3Instance instance, fmi3Boolean *discreteStatesNeedUpdate,
                                    fmi3Boolean *terminateSimulation, fmi3Boolean *nominalsOfContinuousStatesChanged,
                                    fmi3Boolean *valuesOfContinuousStatesChanged, fmi3Boolean *nextEventTimeDefined,
                                    fmi3Float64 *nextEventTime) {
    fmi3Boolean *const flags[] = {discreteStatesNeedUpdate, terminateSimulation, nominalsOfContinuousStatesChanged,
                                  valuesOfContinuousStatesChanged, nextEventTimeDefined};
    if (REFUSED(instance, EVENT, MODEL_EXCHANGE)) return fmi3Error;
    if (MISSING(instance, nextEventTime, 1)) return fmi3Error;
    for (size_t i = 0; i < sizeof flags / sizeof flags[0]; ++i) {
        if (MISSING(instance, flags[i], 1)) return fmi3Error;
    }
    for (size_t i = 0; i < sizeof flags / sizeof flags[0]; ++i) *flags[i] = fmi3False;
    *nextEventTime = 0;
    return fmi3OK;
}

fmi3Status fmi3EnterContinuousTimeMode(fmi3Instance instance) {
    if (REFUSED(instance, EVENT, MODEL_EXCHANGE)) return fmi3Error;
    ((Instance *)instance)->mode = CONTINUOUS_TIME;
    return fmi3OK;
}

fmi3Status fmi3CompletedIntegratorStep(fmi3Instance instance, fmi3Boolean noSetFMUStatePriorToCurrentPoint,
                                       fmi3Boolean *enterEventMode, fmi3Boolean *terminateSimulation) {
    (void)noSetFMUStatePriorToCurrentPoint;
    if (REFUSED(instance, CONTINUOUS_TIME, MODEL_EXCHANGE)) return fmi3Error;
    if (MISSING(instance, enterEventMode, 1)) return fmi3Error;
    if (MISSING(instance, terminateSimulation, 1)) return fmi3Error;
    *enterEventMode = fmi3False;
    *terminateSimulation = fmi3False;
    return fmi3OK;
}

fmi3Status fmi3SetTime(fmi3Instance instance, fmi3Float64 time) {
    if (REFUSED(instance, EVENT | CONTINUOUS_TIME, MODEL_EXCHANGE)) return fmi3Error;
    return (fmi3Status)set_time(instance, time);
}

fmi3Status fmi3SetContinuousStates(fmi3Instance instance, const fmi3Float64 continuousStates[],
                                   size_t nContinuousStates) {
    if (REFUSED(instance, CONTINUOUS_TIME, MODEL_EXCHANGE)) return fmi3Error;
    if (UNFIT(instance, continuousStates, nContinuousStates, STATE_COUNT)) return fmi3Error;
    return (fmi3Status)set_states(instance, continuousStates);
}

fmi3Status fmi3GetContinuousStates(fmi3Instance instance, fmi3Float64 continuousStates[], size_t nContinuousStates) {
    if (REFUSED(instance, AFTER_START, MODEL_EXCHANGE)) return fmi3Error;
    if (UNFIT(instance, continuousStates, nContinuousStates, STATE_COUNT)) return fmi3Error;
    return (fmi3Status)get_block(instance, STATES_BEGIN, STATES_END, continuousStates);
}

fmi3Status fmi3GetContinuousStateDerivatives(fmi3Instance instance, fmi3Float64 derivatives[],
                                             size_t nContinuousStates) {
    if (REFUSED(instance, AFTER_START, MODEL_EXCHANGE)) return fmi3Error;
    if (UNFIT(instance, derivatives, nContinuousStates, STATE_COUNT)) return fmi3Error;
    return (fmi3Status)get_block(instance, RATES_BEGIN, RATES_END, derivatives);
}

fmi3Status fmi3GetNominalsOfContinuousStates(fmi3Instance instance, fmi3Float64 nominals[], size_t nContinuousStates) {
    if (REFUSED(instance, ANY_MODE, MODEL_EXCHANGE)) return fmi3Error;
    if (UNFIT(instance, nominals, nContinuousStates, STATE_COUNT)) return fmi3Error;
    for (size_t i = STATES_BEGIN; i < STATES_END; ++i) nominals[i - STATES_BEGIN] = VARIABLES[i].nominal;
    return fmi3OK;
}

fmi3Status fmi3GetEventIndicators(fmi3Instance instance, fmi3Float64 eventIndicators[], size_t nEventIndicators) {
    if (REFUSED(instance, AFTER_START, MODEL_EXCHANGE)) return fmi3Error;
    if (UNFIT(instance, eventIndicators, nEventIndicators, INDICATOR_COUNT)) return fmi3Error;
    return (fmi3Status)get_block(instance, INDICATORS_BEGIN, INDICATORS_END, eventIndicators);
}

fmi3Status fmi3GetNumberOfEventIndicators(fmi3Instance instance, size_t *nEventIndicators) {
    if (REFUSED(instance, ANY_MODE, MODEL_EXCHANGE)) return fmi3Error;
    if (MISSING(instance, nEventIndicators, 1)) return fmi3Error;
    *nEventIndicators = INDICATOR_COUNT;
    return fmi3OK;
}

fmi3Status fmi3GetNumberOfContinuousStates(fmi3Instance instance, size_t *nContinuousStates) {
    if (REFUSED(instance, ANY_MODE, MODEL_EXCHANGE)) return fmi3Error;
    if (MISSING(instance, nContinuousStates, 1)) return fmi3Error;
    *nContinuousStates = STATE_COUNT;
    return fmi3OK;
}

/* ---- Co-Simulation ---- */

fmi3Status fmi3DoStep(fmi3Instance instance, fmi3Float64 currentCommunicationPoint, fmi3Float64 communicationStepSize,
                      fmi3Boolean noSetFMUStatePriorToCurrentPoint, fmi3Boolean *eventHandlingNeeded,
                      fmi3Boolean *terminateSimulation, fmi3Boolean *earlyReturn, fmi3Float64 *lastSuccessfulTime) {
    Status status;
    (void)noSetFMUStatePriorToCurrentPoint;
    if (REFUSED(instance, STEPPING, CO_SIMULATION)) return fmi3Error;
    if (MISSING(instance, eventHandlingNeeded, 1) || MISSING(instance, terminateSimulation, 1) ||
        MISSING(instance, earlyReturn, 1) || MISSING(instance, lastSuccessfulTime, 1)) {
        return fmi3Error;
    }
    status = do_step(instance, currentCommunicationPoint, communicationStepSize);
    *eventHandlingNeeded = fmi3False;
    *terminateSimulation = status == DISCARD; /* the same step would fail again */
    *lastSuccessfulTime = ((Instance *)instance)->value[TIME];
    *earlyReturn = status == OK && *lastSuccessfulTime != currentCommunicationPoint + communicationStepSize;
    return (fmi3Status)status;
}

fmi3Status fmi3GetOutputDerivatives(fmi3Instance instance, const fmi3ValueReference valueReferences[],
                                    size_t nValueReferences, const fmi3Int32 orders[], fmi3Float64 values[],
                                    size_t nValues) {
    if (REFUSED(instance, STEPPING | UPDATING | TERMINATED, CO_SIMULATION)) return fmi3Error;
    if (MISSING(instance, valueReferences, nValueReferences)) return fmi3Error;
    if (MISSING(instance, orders, nValueReferences)) return fmi3Error;
    if (UNFIT(instance, values, nValues, nValueReferences)) return fmi3Error;
    return (fmi3Status)output_derivatives(instance, valueReferences, nValueReferences, orders, values);
}
