#ifndef AUTOPILOT_H
#define AUTOPILOT_H
#include <stdbool.h>
extern bool autopilot_in_flight(void);
extern bool autopilot_get_motors_on(void);
#endif
