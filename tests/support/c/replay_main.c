/* Flies replay.bin once more on whatever processor this is compiled for, and prints what differs.
 *
 * The file holds doubles: the numbers of periods, of the design and of the controller; the design; the controller at the
 * beginning; the rows; what the controllers have to be. With COUNT_TICKS, a function that counts instructions, it prints
 * besides how many whole steps take. */
#include "darko_flat.c"

#include <stdio.h>
#include <stdlib.h>

#ifdef COUNT_TICKS
unsigned long COUNT_TICKS(void);

static void count(void *memory, const double *rows, int32_t n) {
    Darko *darko = &((Replay *)memory)->by_steps;
    unsigned long most = 0, all = 0;
    for (int32_t k = 0; k < n; ++k) {
        const double *row = rows + (ptrdiff_t)k * ROW;
        DarkoEstimate estimate;
        DarkoReference reference;
        DarkoReadings readings;
        DarkoActuators command;
        get_estimate(&estimate, row + @flags@);
        get_reference(&reference, row + @flags@ + ESTIMATE);
        get_readings(&readings, row + @flags@ + ESTIMATE + REFERENCE);
        const unsigned long before = COUNT_TICKS();
        (void)darko_step(darko, &estimate, &reference, &readings, &command);
        const unsigned long taken = COUNT_TICKS() - before;
        all += taken;
        most = taken > most ? taken : most;
    }
    printf("instructions of a step: %lu in the mean, %lu at most\n", all / (unsigned long)n, most);
}
#endif

static double *read(FILE *file, size_t n) {
    double *made = malloc(n * sizeof *made);
    if (made == NULL || fread(made, sizeof *made, n, file) != n) {
        puts("replay.bin cannot be read");
        exit(1);
    }
    return made;
}

int main(void) {
    FILE *file = fopen("replay.bin", "rb");
    if (file == NULL) {
        puts("there is no replay.bin");
        return 1;
    }
    const double *sizes = read(file, 3);
    const size_t n = (size_t)sizes[0], kept = (size_t)sizes[2];
    const double *design = read(file, (size_t)sizes[1]);
    const double *begin = read(file, kept);
    const double *rows = read(file, (n + 1) * ROW);
    const double *expected = read(file, (n + 1) * kept);
    double *seen = malloc((n + 1) * kept * sizeof *seen);
    void *memory = malloc((size_t)flat_size());
    const int32_t steps = flat_replay(memory, design, begin, rows, (int32_t)n, seen);
    size_t different = 0;
    for (size_t i = 0; i < (n + 1) * kept; ++i) {
        different += memcmp(&seen[i], &expected[i], sizeof *seen) != 0;
    }
    printf("%u periods: %u numbers differ, %d steps\n", (unsigned)n, (unsigned)different, (int)steps);
#ifdef COUNT_TICKS
    count(memory, rows, (int32_t)n);
#endif
    return different != 0 || steps != 0;
}
