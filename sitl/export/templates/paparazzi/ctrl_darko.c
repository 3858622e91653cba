/* DarkO's controller in Paparazzi: from the state interface to the actuators. */
#include "modules/ctrl_darko/ctrl_darko.h"

#include "autopilot.h"
#include "darko_frames.h"
#include "darko_gains.h"
#include "generated/airframe.h"
#include "modules/actuators/actuators.h"
#include "paparazzi.h"
#include "state.h"

#include <stddef.h>

#if PERIODIC_FREQUENCY != 500
#error "DarkO's controller was made for 500 Hz: configure PERIODIC_FREQUENCY"
#endif
#ifndef CTRL_DARKO_HOVERS_LEVEL
#define CTRL_DARKO_HOVERS_LEVEL FALSE
#endif
#ifndef CTRL_DARKO_HAS_PITOT
#define CTRL_DARKO_HAS_PITOT FALSE
#endif
#ifndef CTRL_DARKO_MOTOR_SPEED
#define CTRL_DARKO_MOTOR_SPEED @motor@
#endif
#ifndef CTRL_DARKO_ELEVON_TRAVEL
#define CTRL_DARKO_ELEVON_TRAVEL @elevon@
#endif
#ifndef CTRL_DARKO_SPEED
#define CTRL_DARKO_SPEED 3.f
#endif

enum { ELEVON_LEFT, ELEVON_RIGHT, MOTOR_RIGHT, MOTOR_LEFT }; // order of actuators_pprz
enum { IDLE_THRUST = 1000 };                                 // by which Paparazzi finds that it flies

struct CtrlDarko ctrl_darko;

static DarkoEstimate seen(bool in_flight)
{
  const struct NedCoor_f *p = stateGetPositionNed_f(), *v = stateGetSpeedNed_f(), *a = stateGetAccelNed_f();
  const struct FloatQuat *q = stateGetNedToBodyQuat_f();
  const struct FloatRates *w = stateGetBodyRates_f();
  DarkoEstimate estimate = darko_estimate(
      darko_from_ned(p->x, p->y, p->z), darko_from_ned(v->x, v->y, v->z), darko_from_ned(a->x, a->y, a->z),
      darko_attitude(q->qi, q->qx, q->qy, q->qz, CTRL_DARKO_HOVERS_LEVEL),
      darko_rates(w->p, w->q, w->r, CTRL_DARKO_HOVERS_LEVEL));
  estimate.actuators = ctrl_darko.actuators;
  estimate.on_ground = !in_flight;
  return estimate;
}

static int16_t scaled(darko_real value, darko_real full, int32_t least)
{
  const int32_t command = (int32_t)(value / full * (darko_real)MAX_PPRZ);
  return (int16_t)(command < least ? least : (command > MAX_PPRZ ? MAX_PPRZ : command));
}

void ctrl_darko_init(void)
{
  darko_init(&ctrl_darko.darko, &darko_design, 0);
  ctrl_darko.speed = CTRL_DARKO_SPEED;
  ctrl_darko.reference = darko_hover_at((DarkoVector){0, 0, 0}, 0, CTRL_DARKO_SPEED);
}

// The law that stands on the ground; in the air one that flies any attitude, from which the supervisor goes on to the
// law that is due. The place is kept.
void ctrl_darko_enter(void)
{
  const bool in_flight = autopilot_in_flight();
  const DarkoEstimate estimate = seen(in_flight);
  darko_enter(&ctrl_darko.darko, in_flight ? @zero_moment@ : @landed@, &estimate);
  if (in_flight) {
    ctrl_darko.reference = darko_hover_at(estimate.position, ctrl_darko.reference.heading, ctrl_darko.speed);
  }
}

void ctrl_darko_run(bool in_flight, bool motors_on, int32_t *cmd)
{
  const DarkoEstimate estimate = seen(in_flight);
  DarkoReadings readings = {0};
  readings.velocity = estimate.velocity;
  readings.normal_force = darko_normal_force(estimate.attitude, estimate.acceleration, darko_design.a.g);
  readings.has_airspeed = CTRL_DARKO_HAS_PITOT;
  readings.airspeed = CTRL_DARKO_HAS_PITOT ? stateGetAirspeed_f() : 0;
  DarkoActuators command;
  darko_arm(&ctrl_darko.darko, motors_on);
  if (motors_on && !ctrl_darko.lands) {
    darko_fly(&ctrl_darko.darko, true);
  }
  darko_land(&ctrl_darko.darko, ctrl_darko.lands);
  ctrl_darko.reference.speed = ctrl_darko.speed;
  ctrl_darko.status = darko_step(&ctrl_darko.darko, &estimate, &ctrl_darko.reference, &readings, &command);
  ctrl_darko.law = ctrl_darko.darko.flight.controller.law;
  ctrl_darko.actuators = darko_actuators_after(&ctrl_darko.darko, &ctrl_darko.actuators, DARKO_PERIOD);
  // Ours are positive nose up, trailing edges up; the left servo's command is positive down, the right one's inverted.
  actuators_pprz[ELEVON_LEFT] = scaled(-command.left_elevon, (darko_real)CTRL_DARKO_ELEVON_TRAVEL, -MAX_PPRZ);
  actuators_pprz[ELEVON_RIGHT] = scaled(command.right_elevon, (darko_real)CTRL_DARKO_ELEVON_TRAVEL, -MAX_PPRZ);
  actuators_pprz[MOTOR_RIGHT] = scaled(command.right_motor, (darko_real)CTRL_DARKO_MOTOR_SPEED, 0);
  actuators_pprz[MOTOR_LEFT] = scaled(command.left_motor, (darko_real)CTRL_DARKO_MOTOR_SPEED, 0);
  cmd[COMMAND_THRUST] = in_flight ? (actuators_pprz[MOTOR_LEFT] + actuators_pprz[MOTOR_RIGHT]) / 2 : IDLE_THRUST;
}

bool ctrl_darko_hover(float east, float north, float up, float heading)
{
  ctrl_darko.reference = darko_hover_at(darko_from_ned(north, east, -up), darko_azimuth(heading), ctrl_darko.speed);
  return false;
}

bool ctrl_darko_leg(float east, float north, float up, float airspeed, float heading)
{
  ctrl_darko.reference = darko_fly_leg(ctrl_darko.darko.flight.estimate.position, darko_from_ned(north, east, -up),
                                       airspeed, darko_azimuth(heading), ctrl_darko.speed);
  return false;
}

void ctrl_darko_hover_home(void)
{
  const DarkoVector here = ctrl_darko.darko.flight.estimate.position;
  ctrl_darko.reference = darko_hover_at((DarkoVector){0, 0, here.z}, ctrl_darko.reference.heading, ctrl_darko.speed);
}
