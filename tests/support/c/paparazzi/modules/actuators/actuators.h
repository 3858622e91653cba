#ifndef ACTUATORS_H
#define ACTUATORS_H
#include <stdint.h>
#define ACTUATORS_NB 4
extern int16_t actuators_pprz[ACTUATORS_NB];
#endif
