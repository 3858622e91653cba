/* Flies replay.bin once more on whatever processor this is compiled for, and prints what differs.
 *
 * The file holds doubles: the number of periods; the design; the controller at the beginning; for each period, and once
 * more at the end, a row and what the controller has to be. It is read as it is flown: a microcontroller could not hold
 * it. With COUNT_TICKS, a function that counts instructions, it prints besides how many whole steps take. */
#include "darko_flat.c"

#include <stdio.h>
#include <stdlib.h>

static double row[ROW + CONTROLLER], begin[CONTROLLER], seen[CONTROLLER], design[DESIGN];
static Replay replay;

static void read(FILE *file, double *to, size_t n) {
    if (fread(to, sizeof *to, n, file) != n) {
        puts("replay.bin cannot be read");
        exit(1);
    }
}

#ifdef COUNT_TICKS
unsigned long COUNT_TICKS(void);

static void count(FILE *file, size_t n) {
    unsigned long most = 0, all = 0;
    for (size_t k = 0; k < n; ++k) {
        DarkoEstimate estimate;
        DarkoReference reference;
        DarkoReadings readings;
        DarkoActuators command;
        read(file, row, ROW + CONTROLLER);
        get_estimate(&estimate, row + FLAGS);
        get_reference(&reference, row + FLAGS + ESTIMATE);
        get_readings(&readings, row + FLAGS + ESTIMATE + REFERENCE);
        const unsigned long before = COUNT_TICKS();
        (void)darko_step(&replay.by_steps, &estimate, &reference, &readings, &command);
        const unsigned long taken = COUNT_TICKS() - before;
        all += taken;
        most = taken > most ? taken : most;
    }
    printf("instructions of a step: %lu in the mean, %lu at most\n", all / (unsigned long)n, most);
}
#endif

int main(void) {
    FILE *file = fopen("replay.bin", "rb");
    if (file == NULL) {
        puts("there is no replay.bin");
        return 1;
    }
    double periods;
    read(file, &periods, 1);
    read(file, design, DESIGN);
    read(file, begin, CONTROLLER);
    const size_t n = (size_t)periods;
#ifdef COUNT_TICKS
    const long first = ftell(file);
#endif
    int32_t steps = 0;
    size_t different = 0;
    flat_begin(&replay, design, begin);
    for (size_t k = 0; k <= n; ++k) {
        read(file, row, ROW + CONTROLLER);
        flat_observe(&replay, row, seen);
        for (size_t i = 0; i < CONTROLLER; ++i) {
            different += memcmp(&seen[i], &row[ROW + i], sizeof *seen) != 0;
        }
        steps += k < n ? flat_control(&replay, row) : 0;
    }
    printf("%u periods: %u numbers differ, %d steps\n", (unsigned)n, (unsigned)different, (int)steps);
#ifdef COUNT_TICKS
    (void)fseek(file, first, SEEK_SET);
    count(file, n);
#endif
    return different != 0 || steps != 0;
}
