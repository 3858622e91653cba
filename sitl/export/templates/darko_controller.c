/* One control period of DarkO's controller, in the order of the simulator's loop. */
#include "darko_controller.h"

#include <stddef.h>

@includes@

#define MAX_CHAIN @max_chain@ /* jumps at one instant: more than there are laws means that some law came twice */

const darko_real DARKO_PERIOD = @period@;

static bool is_finite(@real@ x) {
    return x - x == 0;
}

static bool is_usable(const DarkoEstimate *estimate) {
    return @finite@;
}

static bool is_command(const DarkoActuators *u) {
    return is_finite(u->left_motor) && is_finite(u->right_motor) && is_finite(u->left_elevon) &&
           is_finite(u->right_elevon);
}

/* Take every jump that is due. */
static int32_t settled(Darko *darko) {
    DarkoFlight *flight = &darko->flight;
    for (int32_t taken = 0; taken <= MAX_CHAIN; ++taken) {
        const int32_t row = @seek@(flight->controller.law, flight, &darko->reference, darko->design);
        if (row < 0) {
            return taken;
        }
        if (taken < MAX_CHAIN) {
            @jump@(flight->controller.law, row, flight, &darko->reference, darko->design);
        }
    }
    return DARKO_ZENO;
}

void darko_init(Darko *darko, const DarkoDesign *design, darko_real heading) {
    const Darko none = {0};
    *darko = none;
    darko->design = design;
    darko->flight.controller.wind = @start_wind@(@initial_wind_gains@);
    darko->flight.controller.states.course = heading;
}

void darko_enter(Darko *darko, int32_t law, const DarkoEstimate *estimate) {
    darko->flight.estimate = *estimate;
    darko->flight = @entered@(&darko->flight, law, darko->design);
    darko->has_stepped = false;
}

void darko_arm(Darko *darko, bool armed) {
    darko->flight.controller.is_armed = armed;
}

void darko_fly(Darko *darko, bool flying) {
    darko->flight.controller.is_flying = flying;
}

void darko_land(Darko *darko, bool landing) {
    darko->flight.controller.is_landing = landing;
}

void darko_crash(Darko *darko, bool crashed) {
    darko->flight.controller.has_crashed = crashed;
}

int32_t darko_observe(Darko *darko, const DarkoEstimate *estimate, bool estimates_wind) {
    if (!is_usable(estimate)) {
        return DARKO_NOT_FINITE;
    }
    darko->flight.estimate = *estimate;
    if (estimates_wind) {
        darko->flight.estimate.wind = darko->flight.controller.wind.wind;
    }
    if (darko->has_stepped) {
        @run_timers@(&darko->flight);
        return settled(darko);
    }
    return 0;
}

int32_t darko_control(Darko *darko, const DarkoReference *reference, const DarkoReadings *readings,
                      DarkoActuators *command) {
    DarkoFlight *flight = &darko->flight;
    const DarkoFlight before = *flight;
    darko->reference = *reference;
    *command = darko->output;
    if (!@is_known@(flight->controller.law)) {
        return DARKO_UNKNOWN_LAW;
    }
    const int32_t jumps = settled(darko);
    if (readings != NULL) {
        flight->controller.wind = @update_wind@(&flight->estimate, @readings@, @wind_gains@, @airframe@, @wind@,
                                                DARKO_PERIOD);
        flight->estimate.wind = flight->controller.wind.wind;
    }
    @tick@(flight->controller.law, flight, &darko->reference, darko->design);
    if (!is_command(&flight->controller.command)) {
        *flight = before;
        return DARKO_NOT_FINITE;
    }
    darko->output = @limited@(@command@, @may_turn@(flight), @airframe@);
    *command = darko->output;
    darko->has_stepped = true;
    return jumps;
}

int32_t darko_step(Darko *darko, const DarkoEstimate *estimate, const DarkoReference *reference,
                   const DarkoReadings *readings, DarkoActuators *command) {
    darko->reference = darko->has_stepped ? darko->reference : *reference;
    const int32_t observed = darko_observe(darko, estimate, readings != NULL);
    if (observed < 0 && observed != DARKO_ZENO) {
        *command = darko->output;
        return observed;
    }
    const int32_t controlled = darko_control(darko, reference, readings, command);
    return controlled < 0 ? controlled : (observed < 0 ? observed : observed + controlled);
}

DarkoActuators darko_actuators_after(const Darko *darko, const DarkoActuators *now, darko_real dt) {
    return @moved@(@now@, @output@, dt, @airframe@);
}

void darko_values(const Darko *darko, darko_real values[3]) {
    const @values_type@ seen = @values@(&darko->flight, &darko->reference, darko->design);
    values[0] = seen.f0;
    values[1] = seen.f1;
    values[2] = seen.f2;
}
