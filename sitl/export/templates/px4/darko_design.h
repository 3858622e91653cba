/* The exported design for C++, which has no initialisers by name. */
#pragma once

#include "darko_types.h"

#ifdef __cplusplus
extern "C" {
#endif

const DarkoDesign *darko_exported_design(void);

#ifdef __cplusplus
}
#endif
