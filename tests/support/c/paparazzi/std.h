/* The public interface of Paparazzi that the module uses, without what is behind it. */
#ifndef STD_H
#define STD_H
#include <inttypes.h>
#include <stdbool.h>
#define TRUE true
#define FALSE false
#endif
