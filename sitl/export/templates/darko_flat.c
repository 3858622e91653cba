/* The controller behind flat arrays of doubles: for tests and simulators, not for use aboard. */
#include "darko_controller.h"
#include "darko_gains.h"
#include "laws_in_force.h"

#include <stddef.h>
#include <string.h>

enum { ESTIMATE = @Estimate@, REFERENCE = @Reference@, READINGS = @Readings@, CONTROLLER = @Controller@ };
enum { DESIGN = @Design@, FLAGS = @flags@, ROW = FLAGS + ESTIMATE + REFERENCE + READINGS };

typedef struct {
    Darko by_halves, by_steps;
    DarkoDesign design;
} Replay;

@copies@

void flat_design(double *to);
void flat_tick(int32_t law, double *controller, const double *estimate, const double *reference);
int32_t flat_seek(int32_t law, const double *controller, const double *estimate, const double *reference);
void flat_jump(int32_t law, int32_t row, double *controller, const double *estimate, const double *reference);
void flat_values(const double *controller, const double *estimate, const double *reference, double *to);
void flat_init(double heading, double *controller);
int32_t flat_size(void);
int32_t flat_is_single(void);
void flat_sizes(int32_t *to);
int32_t flat_enter(void *memory, int32_t law, const double *estimate, double *controller);
void flat_begin(void *memory, const double *design, const double *begin);
void flat_observe(void *memory, const double *row, double *to);
int32_t flat_control(void *memory, const double *row);
int32_t flat_replay(void *memory, const double *design, const double *begin, const double *rows, int32_t n, double *to);

/* The exported design. */
void flat_design(double *to) {
    put_design(&darko_design, to);
}

static DarkoFlight flight_of(const double *controller, const double *estimate) {
    DarkoFlight flight;
    get_controller(&flight.controller, controller);
    get_estimate(&flight.estimate, estimate);
    return flight;
}

/* The laws, the guards and the jumps one by one, on a controller that is somebody else's. */
void flat_tick(int32_t law, double *controller, const double *estimate, const double *reference) {
    DarkoFlight flight = flight_of(controller, estimate);
    DarkoReference asked;
    get_reference(&asked, reference);
    laws_in_force_tick(law, &flight, &asked, &darko_design);
    put_controller(&flight.controller, controller);
}

int32_t flat_seek(int32_t law, const double *controller, const double *estimate, const double *reference) {
    const DarkoFlight flight = flight_of(controller, estimate);
    DarkoReference asked;
    get_reference(&asked, reference);
    return laws_in_force_seek(law, &flight, &asked, &darko_design);
}

void flat_jump(int32_t law, int32_t row, double *controller, const double *estimate, const double *reference) {
    DarkoFlight flight = flight_of(controller, estimate);
    DarkoReference asked;
    get_reference(&asked, reference);
    laws_in_force_jump(law, row, &flight, &asked, &darko_design);
    put_controller(&flight.controller, controller);
}

void flat_values(const double *controller, const double *estimate, const double *reference, double *to) {
    const DarkoFlight flight = flight_of(controller, estimate);
    DarkoReference asked;
    get_reference(&asked, reference);
    const @values_type@ seen = laws_in_force_values(&flight, &asked, &darko_design);
    to[0] = (double)seen.f0;
    to[1] = (double)seen.f1;
    to[2] = (double)seen.f2;
}

void flat_init(double heading, double *controller) {
    Darko darko;
    darko_init(&darko, &darko_design, (darko_real)heading);
    put_controller(&darko.flight.controller, controller);
}

/* Bytes that a replay needs. */
int32_t flat_size(void) {
    return (int32_t)sizeof(Replay);
}

int32_t flat_is_single(void) {
    return sizeof(darko_real) == sizeof(float);
}

/* Numbers in a controller, an estimate, a reference and a design. */
void flat_sizes(int32_t *to) {
    to[0] = CONTROLLER;
    to[1] = ESTIMATE;
    to[2] = REFERENCE;
    to[3] = DESIGN;
}

/* The controller after a law was put in force, about the exported design. */
int32_t flat_enter(void *memory, int32_t law, const double *estimate, double *controller) {
    Replay *replay = memory;
    DarkoEstimate seen;
    get_estimate(&seen, estimate);
    darko_init(&replay->by_steps, &darko_design, 0);
    get_controller(&replay->by_steps.flight.controller, controller);
    darko_enter(&replay->by_steps, law, &seen);
    put_controller(&replay->by_steps.flight.controller, controller);
    return replay->by_steps.flight.controller.law;
}

static void ask(Darko *darko, const double *row) {
    darko_arm(darko, row[1] > 0);
    darko_fly(darko, row[2] > 0);
    darko_land(darko, row[3] > 0);
}

/* A recorded flight is flown once more: its design, and the controller at its beginning. */
void flat_begin(void *memory, const double *design, const double *begin) {
    Replay *replay = memory;
    get_design(&replay->design, design);
    darko_init(&replay->by_halves, &replay->design, 0);
    get_controller(&replay->by_halves.flight.controller, begin);
    replay->by_steps = replay->by_halves;
}

/* The controller after it has seen the estimate of a row: flags, estimate, reference and readings. */
void flat_observe(void *memory, const double *row, double *to) {
    Replay *replay = memory;
    DarkoEstimate estimate;
    get_estimate(&estimate, row + FLAGS);
    darko_crash(&replay->by_halves, row[5] > 0);
    darko_crash(&replay->by_steps, row[5] > 0);
    (void)darko_observe(&replay->by_halves, &estimate, row[4] > 0);
    put_controller(&replay->by_halves.flight.controller, to);
}

/* The rest of that period; gives 1 if a whole step commands anything else than halves of it, or leaves anything else
 * behind. */
int32_t flat_control(void *memory, const double *row) {
    Darko *halves = &((Replay *)memory)->by_halves, *steps = &((Replay *)memory)->by_steps;
    DarkoEstimate estimate;
    DarkoReference reference;
    DarkoReadings readings;
    DarkoActuators commands[2];
    double left_behind[2][CONTROLLER];
    get_estimate(&estimate, row + FLAGS);
    get_reference(&reference, row + FLAGS + ESTIMATE);
    get_readings(&readings, row + FLAGS + ESTIMATE + REFERENCE);
    const bool asked = row[0] > 0, has_readings = row[4] > 0;
    if (asked) {
        (void)darko_observe(steps, &estimate, has_readings);
        ask(halves, row);
        ask(steps, row);
        (void)darko_control(steps, &reference, has_readings ? &readings : NULL, &commands[1]);
    } else {
        (void)darko_step(steps, &estimate, &reference, has_readings ? &readings : NULL, &commands[1]);
    }
    (void)darko_control(halves, &reference, has_readings ? &readings : NULL, &commands[0]);
    put_controller(&halves->flight.controller, left_behind[0]);
    put_controller(&steps->flight.controller, left_behind[1]);
    return memcmp(left_behind[0], left_behind[1], sizeof left_behind[0]) != 0 ||
           memcmp(&commands[0], &commands[1], sizeof commands[0]) != 0;
}

/* All of it: n rows, and one that is only observed. After each observation the controller is written; gives in how many
 * periods whole steps did anything else than halves of them. */
int32_t flat_replay(void *memory, const double *design, const double *begin, const double *rows, int32_t n, double *to) {
    int32_t different = 0;
    flat_begin(memory, design, begin);
    for (int32_t k = 0; k <= n; ++k) {
        const double *row = rows + (ptrdiff_t)k * ROW;
        flat_observe(memory, row, to + (ptrdiff_t)k * CONTROLLER);
        if (k < n) {
            different += flat_control(memory, row);
        }
    }
    return different;
}
