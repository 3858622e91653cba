/* The exported design for C++, which has no initialisers by name. */
#include "darko_design.h"
#include "darko_gains.h"

const DarkoDesign *darko_exported_design(void) {
    return &darko_design;
}
