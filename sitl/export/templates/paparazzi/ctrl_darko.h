/* DarkO's controller in Paparazzi: from the state interface to the actuators. */
#ifndef CTRL_DARKO_H
#define CTRL_DARKO_H

#include "std.h"
#include "darko_controller.h"

struct CtrlDarko {
  Darko darko;
  DarkoReference reference;
  DarkoActuators actuators; // where motors and elevons are by the model
  int32_t law;              // in force
  int32_t status;           // of the last step: see darko_controller.h
  float speed;              // over the ground in the hover [m/s]
  bool lands;
};

extern struct CtrlDarko ctrl_darko;

extern void ctrl_darko_init(void);
extern void ctrl_darko_enter(void);
extern void ctrl_darko_run(bool in_flight, bool motors_on, int32_t *cmd);

// What a flight plan asks for: ENU from the origin [m], heading of the belly from north to east [rad], [m/s]
extern bool ctrl_darko_hover(float east, float north, float up, float heading);
extern bool ctrl_darko_leg(float east, float north, float up, float airspeed, float heading);
extern void ctrl_darko_hover_home(void);

#endif // CTRL_DARKO_H
