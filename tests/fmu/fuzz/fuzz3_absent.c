/* Random calls of the functions of FMI 3.0 for types of variables, clocks and modes that the model has none of. */
#include "fuzz3.h"

#include "fmi3Functions.h"
#include "fuzz.h"

enum { TYPES = 13 };

/* Binary and Clock have arguments of their own. */
#define BOTH(place, Type)                                                                                  \
    case place:                                                                                            \
        if (setting) {                                                                                     \
            TRY(c, fmi3Set##Type(c, references, count, values, count));                                    \
        } else {                                                                                           \
            TRY(c, fmi3Get##Type(c, references, count, values, count));                                    \
        }                                                                                                  \
        break

void typed_call(Instance *c, const unsigned references[], size_t count) {
    void *values = array(count, sizeof(fmi3Binary));
    size_t *sizes = array(count, sizeof *sizes);
    const bool setting = chance(50);
    switch (below(TYPES)) {
        BOTH(0, Float32);
        BOTH(1, Int8);
        BOTH(2, UInt8);
        BOTH(3, Int16);
        BOTH(4, UInt16);
        BOTH(5, Int32);
        BOTH(6, UInt32);
        BOTH(7, Int64);
        BOTH(8, UInt64);
        BOTH(9, String);
        case 10: TRY(c, fmi3GetBinary(c, references, count, sizes, values, count)); break;
        case 11: TRY(c, fmi3SetBinary(c, references, count, sizes, values, count)); break;
        default:
            if (setting) {
                TRY(c, fmi3SetClock(c, references, count, values));
            } else {
                TRY(c, fmi3GetClock(c, references, count, values));
            }
    }
}

void absent_call(Instance *c) {
    const size_t count = any_count();
    unsigned *reference = references(count);
    double *values = reals(count, NULL);
    void *others = array(count, sizeof(fmi3UInt64));
    size_t *places = array(count, sizeof *places);
    switch (below(16)) {
        case 0: TRY(c, fmi3EnterConfigurationMode(c)); break;
        case 1: TRY(c, fmi3ExitConfigurationMode(c)); break;
        case 2: TRY(c, fmi3GetNumberOfVariableDependencies(c, any_reference(), places)); break;
        case 3:
            TRY(c, fmi3GetVariableDependencies(c, any_reference(), places, reference, places, others, count));
            break;
        case 4: TRY(c, fmi3GetIntervalDecimal(c, reference, count, values, others)); break;
        case 5: TRY(c, fmi3GetIntervalFraction(c, reference, count, others, others, others)); break;
        case 6: TRY(c, fmi3GetShiftDecimal(c, reference, count, values)); break;
        case 7: TRY(c, fmi3GetShiftFraction(c, reference, count, others, others)); break;
        case 8: TRY(c, fmi3SetIntervalDecimal(c, reference, count, values)); break;
        case 9: TRY(c, fmi3SetIntervalFraction(c, reference, count, others, others)); break;
        case 10: TRY(c, fmi3SetShiftDecimal(c, reference, count, values)); break;
        case 11: TRY(c, fmi3SetShiftFraction(c, reference, count, others, others)); break;
        case 12: TRY(c, fmi3EvaluateDiscreteStates(c)); break;
        case 13: TRY(c, fmi3EnterStepMode(c)); break;
        default: TRY(c, fmi3ActivateModelPartition(c, any_reference(), any_real()));
    }
}
