/* Navigates navigation.bin once more on whatever processor this is compiled for, and prints what differs.
 *
 * The file holds doubles: the numbers of periods, the period at the beginning, whether there is a tube; the filter, its
 * instruments and its steps at the beginning; the rows; what the estimates have to be, and the filter at the end. With
 * COUNT_TICKS, a function that counts instructions, it prints besides what periods take. */
#include "darko_estimator_flat.c"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#ifdef COUNT_TICKS
unsigned long COUNT_TICKS(void);
#endif

static double *read(FILE *file, size_t n) {
    double *made = malloc(n * sizeof *made);
    if (made == NULL || fread(made, sizeof *made, n, file) != n) {
        puts("navigation.bin cannot be read");
        exit(1);
    }
    return made;
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
    const double *head = read(file, 3);
    const size_t n = (size_t)head[0];
    const double *filter = read(file, FILTER), *instruments = read(file, INSTRUMENTS);
    const double *steps = read(file, (size_t)STEPS * STEP), *rows = read(file, n * ROW);
    const double *expected = read(file, n * ESTIMATE), *end = read(file, FILTER);
    void *memory = malloc((size_t)flat_estimator_size());
    double *kept = malloc(FILTER * sizeof *kept);
    unsigned wrong = 0;
    flat_estimator_begin(memory, filter, instruments, steps, (int32_t)head[1], head[2] > 0);
#ifdef COUNT_TICKS
    unsigned long most = 0, all = 0, least = (unsigned long)-1;
#endif
    for (size_t k = 0; k < n; ++k) {
        double estimate[ESTIMATE];
#ifdef COUNT_TICKS
        const unsigned long before = COUNT_TICKS();
#endif
        flat_estimator_fly(memory, rows + k * ROW, 1, estimate);
#ifdef COUNT_TICKS
        const unsigned long taken = COUNT_TICKS() - before;
        all += taken;
        most = taken > most ? taken : most;
        least = taken < least ? taken : least;
#endif
        wrong += different(estimate, expected + k * ESTIMATE, ESTIMATE);
    }
    flat_estimator_filter(memory, kept);
    wrong += different(kept, end, FILTER);
    printf("%u periods: %u numbers differ\n", (unsigned)n, wrong);
#ifdef COUNT_TICKS
    printf("instructions of a period: %lu at least, %lu in the mean, %lu at most\n", least, all / (unsigned long)n, most);
#endif
    return wrong != 0;
}
