/* DarkO's controller: laws, supervisor, allocation, observers and wind estimator.
 *
 * No memory is allocated, nothing is static but constants: everything that is kept is in a Darko, which the caller owns.
 * One task calls it; two Darkos know nothing of each other.
 *
 *     darko_init(&darko, &darko_design, heading);
 *     every DARKO_PERIOD: status = darko_step(&darko, &estimate, &reference, readings or NULL, &command);
 */
#ifndef DARKO_CONTROLLER_H
#define DARKO_CONTROLLER_H

#include "darko_types.h"

#ifdef __cplusplus
extern "C" {
#endif

/* How a step went; from 0 on, the number of jumps between laws that it took. */
enum {
    DARKO_UNKNOWN_LAW = -1,
    DARKO_ZENO = -2,      /* the supervisor jumps without end: the law in force flew all the same */
    DARKO_NOT_FINITE = -3 /* estimate or command was no number: nothing changed, the last command stays */
};

typedef struct {
    DarkoFlight flight;
    DarkoReference reference;
    const DarkoDesign *design;
    DarkoActuators output; /* of the last step, within the actuators' limits */
    bool has_stepped;
} Darko;

extern const darko_real DARKO_PERIOD; /* between two steps [s] */

/* A vehicle that stands, disarmed; the design has to stay where it is. Heading of the belly, from north to west [rad]. */
void darko_init(Darko *darko, const DarkoDesign *design, darko_real heading);

/* Put a law in force from the estimate as it is, as if it had always flown: after a manual flight, or missed steps. */
void darko_enter(Darko *darko, int32_t law, const DarkoEstimate *estimate);

/* What the autopilot wants; the controller takes the wish to fly back when it has landed, and disarms in a crash. */
void darko_arm(Darko *darko, bool armed);
void darko_fly(Darko *darko, bool flying);
void darko_land(Darko *darko, bool landing);
/* Tell that it hit the ground too fast, or that it is whole again. */
void darko_crash(Darko *darko, bool crashed);

/* One control period: timers, jumps, wind, and the law in force. With readings the wind is estimated here, and that of
 * the estimate is not looked at; without, the estimate has it. The command is within the actuators' limits: motors
 * [rad/s], 0 while disarmed, elevons [rad], positive nose up. */
int32_t darko_step(Darko *darko, const DarkoEstimate *estimate, const DarkoReference *reference,
                   const DarkoReadings *readings, DarkoActuators *command);

/* The halves of a step: what an estimate brings, and what a reference asks; each gives what darko_step gives. */
int32_t darko_observe(Darko *darko, const DarkoEstimate *estimate, bool estimates_wind);
int32_t darko_control(Darko *darko, const DarkoReference *reference, const DarkoReadings *readings,
                      DarkoActuators *command);

/* Actuators some time [s] later, on their way to the last output, by the airframe's model: for the estimate of a vehicle
 * that does not measure them. */
DarkoActuators darko_actuators_after(const Darko *darko, const DarkoActuators *now, darko_real dt);

/* Lyapunov values for the telemetry: of the linear hover law, the linear forward law, the attitude law. */
void darko_values(const Darko *darko, darko_real values[3]);

#ifdef __cplusplus
}
#endif

#endif
