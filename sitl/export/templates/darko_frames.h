/* From the world NED and a body FRD to the controller's NWU and FLU, whose x points out of the nose.
 *
 * Autopilots know two bodies of a tail-sitter: one with x out of the nose, as of an aeroplane, and one with z out of the
 * tail, as of a multicopter that hovers level (PX4's tail-sitters, Paparazzi's INDI). The second pitched up by 90 deg is
 * the first. */
#ifndef DARKO_FRAMES_H
#define DARKO_FRAMES_H

#include "darko_types.h"

#ifdef __cplusplus
#define DARKO_NOTHING {}
#else
#define DARKO_NOTHING {0}
#endif
#define DARKO_SQRT_HALF ((darko_real)0.70710678118654752440)

/* A vector of the world. */
static inline DarkoVector darko_from_ned(darko_real north, darko_real east, darko_real down) {
    return (DarkoVector){north, -east, -down};
}

/* An attitude, from the body to NED, scalar first; with hovers_level of the body that is level in the hover. */
static inline DarkoQuaternion darko_attitude(darko_real w, darko_real x, darko_real y, darko_real z, bool hovers_level) {
    const darko_real h = DARKO_SQRT_HALF;
    const DarkoQuaternion q = hovers_level ? (DarkoQuaternion){h * (w - y), h * (x - z), h * (y + w), h * (z + x)}
                                           : (DarkoQuaternion){w, x, y, z};
    return (DarkoQuaternion){q.w, q.x, -q.y, -q.z};
}

/* Body rates. */
static inline DarkoVector darko_rates(darko_real p, darko_real q, darko_real r, bool hovers_level) {
    return hovers_level ? (DarkoVector){-r, -q, -p} : (DarkoVector){p, -q, -r};
}

/* What an accelerometer feels along z_b at an attitude, of the acceleration of the body in the world [m/s2]. */
static inline darko_real darko_normal_force(DarkoQuaternion q, DarkoVector acceleration, darko_real g) {
    const darko_real x = (darko_real)2 * (q.x * q.z + q.w * q.y), y = (darko_real)2 * (q.y * q.z - q.w * q.x);
    const darko_real z = (darko_real)1 - (darko_real)2 * (q.x * q.x + q.y * q.y);
    return x * acceleration.x + y * acceleration.y + z * (acceleration.z + g);
}

/* The azimuth of a course or a heading, from north to west, of one from north to east [rad]. */
static inline darko_real darko_azimuth(darko_real to_east) {
    return -to_east;
}

/* An estimate of everything that autopilots know; the rest is as in calm air, known at once. */
static inline DarkoEstimate darko_estimate(DarkoVector position, DarkoVector velocity, DarkoVector acceleration,
                                           DarkoQuaternion attitude, DarkoVector rates) {
    DarkoEstimate seen = DARKO_NOTHING;
    seen.position = position;
    seen.velocity = velocity;
    seen.acceleration = acceleration;
    seen.attitude = attitude;
    seen.rates = rates;
    return seen;
}

/* A hover at a place: the belly looks to the heading [rad], at most so fast over the ground [m/s]. */
static inline DarkoReference darko_hover_at(DarkoVector place, darko_real heading, darko_real speed) {
    DarkoReference asked = DARKO_NOTHING;
    asked.position = place;
    asked.heading = heading;
    asked.speed = speed;
    asked.path.start = place;
    asked.path.end = place;
    asked.path.airspeed = (darko_real)12;
    asked.path.stop = true;
    asked.attitude.attitude.w = (darko_real)1;
    return asked;
}

/* A leg flown forward, to a hover at its end. */
static inline DarkoReference darko_fly_leg(DarkoVector start, DarkoVector end, darko_real airspeed, darko_real heading,
                                           darko_real speed) {
    DarkoReference asked = darko_hover_at(end, heading, speed);
    asked.forward = true;
    asked.path.start = start;
    asked.path.airspeed = airspeed;
    return asked;
}

#endif
