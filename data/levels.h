/* How much of a picture is too dark or too bright to say anything. */
#ifndef IO_LEVELS_H
#define IO_LEVELS_H
#include <stdint.h>

/* Shares of its values. */
typedef struct io_levels {
    double dark; /* below three of 255 sRGB levels */
    double full; /* at white or above */
    double over; /* above white, by more than resampling rounds to */
} io_levels;

/* values linear ones; 1 is white. */
io_levels io_levels_of(const float *value, int64_t values);
#endif
