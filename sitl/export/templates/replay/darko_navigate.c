/* Navigates navigation.bin once more on whatever processor this is compiled for, and prints what differs.
 *
 * The file holds doubles: the numbers of periods, the period at the beginning, whether there is a tube; the filter, its
 * instruments and its steps at the beginning; the filter at the end; for each period a row and what the estimate has to
 * be. With COUNT_TICKS, a function that counts instructions, it prints besides what periods take. */
#include "darko_estimator_flat.c"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static double filter[FILTER], instruments[INSTRUMENTS], steps[STEPS * STEP], end[FILTER], row[ROW + ESTIMATE];
static DarkoEstimator estimator;

#ifdef COUNT_TICKS
unsigned long COUNT_TICKS(void);
#endif

static void read(FILE *file, double *to, size_t n) {
    if (fread(to, sizeof *to, n, file) != n) {
        puts("navigation.bin cannot be read");
        exit(1);
    }
}

static unsigned different(const double *seen, const double *expected, size_t n) {
    unsigned found = 0;
    for (size_t k = 0; k < n; ++k) {
        found += memcmp(&seen[k], &expected[k], sizeof *seen) != 0;
    }
    return found;
}

int main(void) {
    FILE *file = fopen("navigation.bin", "rb");
    if (file == NULL) {
        puts("there is no navigation.bin");
        return 1;
    }
    double head[3];
    read(file, head, 3);
    read(file, filter, FILTER);
    read(file, instruments, INSTRUMENTS);
    read(file, steps, (size_t)STEPS * STEP);
    read(file, end, FILTER);
    const size_t n = (size_t)head[0];
    unsigned wrong = 0;
    flat_estimator_begin(&estimator, filter, instruments, steps, (int32_t)head[1], head[2] > 0);
#ifdef COUNT_TICKS
    unsigned long most = 0, all = 0, least = (unsigned long)-1;
#endif
    for (size_t k = 0; k < n; ++k) {
        double estimate[ESTIMATE];
        read(file, row, ROW + ESTIMATE);
#ifdef COUNT_TICKS
        const unsigned long before = COUNT_TICKS();
#endif
        flat_estimator_fly(&estimator, row, 1, estimate);
#ifdef COUNT_TICKS
        const unsigned long taken = COUNT_TICKS() - before;
        all += taken;
        most = taken > most ? taken : most;
        least = taken < least ? taken : least;
#endif
        wrong += different(estimate, row + ROW, ESTIMATE);
    }
    flat_estimator_filter(&estimator, filter);
    wrong += different(filter, end, FILTER);
    printf("%u periods: %u numbers differ\n", (unsigned)n, wrong);
#ifdef COUNT_TICKS
    printf("instructions of a period: %lu at least, %lu in the mean, %lu at most\n", least, all / (unsigned long)n, most);
#endif
    return wrong != 0;
}
