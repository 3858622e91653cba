/* One control period of DarkO's navigation filter, and the readings on their way to it. */
#include "darko_estimator.h"

#include <string.h>

@includes@

static bool is_finite(@real@ x) {
    return x - x == 0;
}

static bool is_vector(DarkoVector v) {
    return is_finite(v.x) && is_finite(v.y) && is_finite(v.z);
}

/* Numbers of a reading; 0 of an instrument that there is not. */
static int32_t numbers_of(int32_t instrument) {
    switch (instrument) {
    case DARKO_MAGNETOMETER:
        return 3;
    case DARKO_BAROMETER:
    case DARKO_PITOT:
        return 1;
    case DARKO_GNSS:
        return 6;
    case DARKO_MOTION_CAPTURE:
    case DARKO_EXTERNAL_POSE:
        return @reading_size@;
    default:
        return 0;
    }
}

void darko_estimator_init(DarkoEstimator *estimator, const DarkoNavigationSettings *navigation,
                          const DarkoAirframe *model, bool has_tube) {
    DarkoFilter *f = &estimator->filter;
    memset(estimator, 0, sizeof *estimator);
    estimator->has_tube = has_tube;
    estimator->instruments.specification = navigation->specification;
    f->settings = navigation->settings;
    f->model = *model;
    f->support = model->g;
    f->support_of_late = model->g;
@start@
}

bool darko_estimator_read(DarkoEstimator *estimator, int32_t instrument, const darko_real *numbers, int32_t age,
                          int32_t late) {
    DarkoInstrumentsAboard *i = &estimator->instruments;
    const int32_t count = numbers_of(instrument), line = instrument - @first_delayed@;
    const int32_t now = estimator->period + 1, sampled = now - age;
    bool is_reading = count > 0 && age >= 0 && late >= 0;
    for (int32_t k = 0; k < count; ++k) {
        is_reading = is_reading && is_finite(numbers[k]);
    }
    if (!is_reading) {
        return false;
    }
    if (i->waiting[line] > 0) {
        const int32_t newest = ((int32_t)i->first[line] + (int32_t)i->waiting[line] - 1) % @queue_length@;
        if ((@real@)sampled < i->sampled[line][newest]) {
            return false;
        }
    }
    for (int32_t k = 0; k < count; ++k) {
        i->last[line][k] = numbers[k];
    }
    @send@(line, i, sampled, now + late);
    return true;
}

bool darko_estimator_step(DarkoEstimator *estimator, const DarkoInertial *inertial, const DarkoActuators *command,
                          bool lands, DarkoEstimate *estimate) {
    DarkoFilter *f = &estimator->filter;
    const bool has_read = is_vector(inertial->rates) && is_vector(inertial->force);
    const bool has_command = is_finite(command->left_motor) && is_finite(command->right_motor) &&
                             is_finite(command->left_elevon) && is_finite(command->right_elevon);
    if (has_read) {
        estimator->instruments.inertial = *inertial;
    }
    f->lands = lands;
    estimator->period += 1;
    *estimate = @navigate@(f, &estimator->instruments, estimator->steps, estimator->period,
                           has_command ? *command : f->actuators, estimator->has_tube);
@regather@    return has_read && has_command;
}

bool darko_estimator_is_running(const DarkoEstimator *estimator) {
    return estimator->filter.phase == FILTER_RUNNING;
}
