/* Functions of FMI 3.0 for what the model has none of. */
#ifndef FUZZ3_H
#define FUZZ3_H

#include "instance.h"

void typed_call(Instance *instance, const unsigned references[], size_t count);
void absent_call(Instance *instance);

#endif
