/* DarkO's navigation filter: the instruments' readings in, the estimate that darko_step wants out.
 *
 * No memory is allocated, nothing is static but constants: everything that is kept is in a DarkoEstimator, which the
 * caller owns. World NWU, body FLU, SI units.
 *
 *     darko_estimator_init(&estimator, &darko_navigation, &darko_design.a, has_tube);
 *     whenever a reading arrives: darko_estimator_read(&estimator, DARKO_GNSS, numbers, age, 0);
 *     every DARKO_PERIOD: darko_estimator_step(&estimator, &inertial, &command, landing, &estimate);
 *                         darko_step(&darko, &estimate, &reference, NULL, &command);
 */
#ifndef DARKO_ESTIMATOR_INTERFACE_H
#define DARKO_ESTIMATOR_INTERFACE_H

#include "darko_types.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Instruments that read now and then, and the numbers of a reading. */
enum {
    DARKO_MAGNETOMETER = @magnetometer@,   /* 3: field by the body's axes [T] */
    DARKO_BAROMETER = @barometer@,      /* 1: height above where it was set to zero [m] */
    DARKO_GNSS = @gnss@,           /* 6: position and velocity of the antenna, world NWU [m], [m/s] */
    DARKO_PITOT = @pitot@,          /* 1: airspeed along the nose [m/s] */
    DARKO_MOTION_CAPTURE = @motion_capture@, /* 10: position [m], attitude (w, x, y, z), variances of a position's axis [m2] and of
                                 the attitude about one [rad2], 1 if there is an attitude, else 0 */
    DARKO_EXTERNAL_POSE = @external_pose@   /* the same, of somebody else's cameras */
};

typedef struct {
    DarkoFilter filter;
    DarkoInstrumentsAboard instruments;
    DarkoStep steps[@max_horizon@]; /* between the filter's horizon and now */
    int32_t period;      /* control periods so far */
    bool has_tube;       /* whether there is a pitot tube */
} DarkoEstimator;

/* A filter that has yet to be aligned, on the ground or in the hover. */
void darko_estimator_init(DarkoEstimator *estimator, const DarkoNavigationSettings *navigation,
                          const DarkoAirframe *model, bool has_tube);

/* Take a reading for the coming step. It was measured so many control periods before that step's end, and may be known
 * so many after it: 0 aboard. False, and it is forgotten, of what is no reading: a number that is not finite, an
 * unknown instrument, a time older than that of the reading before. */
bool darko_estimator_read(DarkoEstimator *estimator, int32_t instrument, const darko_real *numbers, int32_t age,
                          int32_t late);

/* One control period: means of the inertial readings over it, the command in force during it, whether the vehicle wants
 * to touch the ground. False where a number was not finite: the reading before stands in, and counts as an odd one. */
bool darko_estimator_step(DarkoEstimator *estimator, const DarkoInertial *inertial, const DarkoActuators *command,
                          bool lands, DarkoEstimate *estimate);

/* Whether the filter is aligned; before, its estimate is worth nothing. */
bool darko_estimator_is_running(const DarkoEstimator *estimator);

#ifdef __cplusplus
}
#endif

#endif
