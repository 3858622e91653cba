/* The estimator behind flat arrays of doubles: for tests and simulators, not for use aboard. */
#include "darko_estimator.h"
#include "darko_navigation.h"

#include <stddef.h>
#include <string.h>

/* A row of a recorded flight: whether it lands, inertial reading, command, count of readings, and of each its
 * instrument, age, lateness and numbers. */
enum { FILTER = @Filter@, INSTRUMENTS = @InstrumentsAboard@, STEP = @Step@, ESTIMATE = @Estimate@, STEPS = @max_horizon@ };
enum { READING = 3 + @reading_size@, LINES = @lines@, ROW = 12 + LINES * READING };

@copies@

/* Parts of the simulator's records, which are packed: doubles, whole numbers of eight bytes, flags of one. */
static void load_reals(darko_real *to, const unsigned char *from, int32_t n) {
    for (int32_t k = 0; k < n; ++k) {
        double value;
        memcpy(&value, from + (ptrdiff_t)k * 8, sizeof value);
        to[k] = (darko_real)value;
    }
}

static void store_reals(const darko_real *from, unsigned char *to, int32_t n) {
    for (int32_t k = 0; k < n; ++k) {
        const double value = (double)from[k];
        memcpy(to + (ptrdiff_t)k * 8, &value, sizeof value);
    }
}

static int32_t loaded_int(const unsigned char *from) {
    int64_t value;
    memcpy(&value, from, sizeof value);
    return (int32_t)value;
}

static void store_int(int32_t from, unsigned char *to) {
    const int64_t value = from;
    memcpy(to, &value, sizeof value);
}

@record_copies@

int32_t flat_estimator_size(void);
int32_t flat_estimator_is_single(void);
void flat_estimator_sizes(int32_t *to);
void flat_estimator_init(void *memory, const double *filter, int32_t has_tube, double *to);
void flat_estimator_begin(void *memory, const double *filter, const double *instruments, const double *steps,
                          int32_t period, int32_t has_tube);
void flat_estimator_fly(void *memory, const double *rows, int32_t n, double *estimates);
void flat_estimator_filter(const void *memory, double *to);
void flat_estimator_navigate(unsigned char *covariance, unsigned char *readings, unsigned char *steps, int32_t period,
                             const double *command, int32_t has_tube, double *to);

int32_t flat_estimator_size(void) {
    return (int32_t)sizeof(DarkoEstimator);
}

int32_t flat_estimator_is_single(void) {
    return sizeof(darko_real) == sizeof(float);
}

/* Numbers in a filter, in its instruments, in a row and in an estimate; errors that the exported filter estimates; of
 * the simulator's records: where they have what flat_estimator_navigate takes, and their bytes. */
void flat_estimator_sizes(int32_t *to) {
    to[0] = FILTER;
    to[1] = INSTRUMENTS;
    to[2] = ROW;
    to[3] = ESTIMATE;
    to[4] = darko_navigation.settings.states;
    to[5] = @covariance_offset@;
    to[6] = @readings_offset@;
    to[7] = @filter_bytes@;
    to[8] = @instruments_bytes@;
    to[9] = @step_bytes@;
}

/* A new filter of the exported instruments, about the model that another filter has. */
void flat_estimator_init(void *memory, const double *filter, int32_t has_tube, double *to) {
    DarkoEstimator *estimator = memory;
    get_filter(&estimator->filter, filter);
    const DarkoAirframe model = estimator->filter.model;
    darko_estimator_init(estimator, &darko_navigation, &model, has_tube > 0);
    put_filter(&estimator->filter, to);
}

void flat_estimator_begin(void *memory, const double *filter, const double *instruments, const double *steps,
                          int32_t period, int32_t has_tube) {
    DarkoEstimator *estimator = memory;
    get_filter(&estimator->filter, filter);
    get_instrumentsaboard(&estimator->instruments, instruments);
    for (int32_t k = 0; k < STEPS; ++k) {
        get_step(&estimator->steps[k], steps + (ptrdiff_t)k * STEP);
    }
    estimator->period = period;
    estimator->has_tube = has_tube > 0;
}

/* The estimates of n recorded periods. */
void flat_estimator_fly(void *memory, const double *rows, int32_t n, double *estimates) {
    DarkoEstimator *estimator = memory;
    for (int32_t k = 0; k < n; ++k) {
        const double *row = rows + (ptrdiff_t)k * ROW;
        DarkoInertial inertial;
        DarkoActuators command;
        DarkoEstimate estimate;
        get_inertial(&inertial, row + 1);
        get_actuators(&command, row + 7);
        for (int32_t j = 0; j < (int32_t)row[11]; ++j) {
            const double *told = row + 12 + (ptrdiff_t)j * READING;
            darko_real numbers[@reading_size@];
            for (int32_t l = 0; l < @reading_size@; ++l) {
                numbers[l] = (darko_real)told[3 + l];
            }
            (void)darko_estimator_read(estimator, (int32_t)told[0], numbers, (int32_t)told[1], (int32_t)told[2]);
        }
        (void)darko_estimator_step(estimator, &inertial, &command, row[0] > 0, &estimate);
        put_estimate(&estimate, estimates + (ptrdiff_t)k * ESTIMATE);
    }
}

void flat_estimator_filter(const void *memory, double *to) {
    put_filter(&((const DarkoEstimator *)memory)->filter, to);
}

/* One control period of the simulator's own filter: its records, of which the covariance and the readings are parts. */
void flat_estimator_navigate(unsigned char *covariance, unsigned char *readings, unsigned char *steps, int32_t period,
                             const double *command, int32_t has_tube, double *to) {
    unsigned char *filter = covariance - @covariance_offset@, *instruments = readings - @readings_offset@;
    DarkoEstimator estimator;
    DarkoActuators wanted;
    DarkoEstimate estimate;
    load_filter(&estimator.filter, filter);
    load_instrumentsaboard(&estimator.instruments, instruments);
    for (int32_t k = 0; k < STEPS; ++k) {
        load_step(&estimator.steps[k], steps + (ptrdiff_t)k * @step_bytes@);
    }
    get_actuators(&wanted, command);
    estimator.period = period - 1;
    estimator.has_tube = has_tube > 0;
    const DarkoInertial inertial = estimator.instruments.inertial;
    (void)darko_estimator_step(&estimator, &inertial, &wanted, estimator.filter.lands, &estimate);
    store_filter(&estimator.filter, filter);
    store_instrumentsaboard(&estimator.instruments, instruments);
    for (int32_t k = 0; k < STEPS; ++k) {
        store_step(&estimator.steps[k], steps + (ptrdiff_t)k * @step_bytes@);
    }
    put_estimate(&estimate, to);
}
