/* Structs of the controller; each is a NamedTuple of the source. World NWU, body FLU, SI units. */
#ifndef DARKO_TYPES_H
#define DARKO_TYPES_H

#include <float.h>
#include <math.h>
#include <stdbool.h>
#include <stdint.h>

#if defined(__FAST_MATH__)
#error "DarkO's controller must be compiled without -ffast-math, and with -ffp-contract=off"
#endif
#if FLT_EVAL_METHOD != 0
#error "DarkO's controller needs arithmetic that is rounded to the type: not the x87"
#endif

typedef @real@ darko_real;

/* As Python and the compiled simulator choose: the first of two that are equal, or that cannot be compared. */
static inline @real@ darko_min_@real@(@real@ a, @real@ b) { return b < a ? b : a; }
static inline @real@ darko_max_@real@(@real@ a, @real@ b) { return b > a ? b : a; }
static inline int32_t darko_min_int(int32_t a, int32_t b) { return b < a ? b : a; }
static inline int32_t darko_max_int(int32_t a, int32_t b) { return b > a ? b : a; }
/* The rest that has the sign of the divisor, which is positive. */
static inline int32_t darko_modulo(int32_t a, int32_t b) { return a % b < 0 ? a % b + b : a % b; }

@structs@

#endif
