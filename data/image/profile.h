/* Colour profiles of any kind, by lcms2: look-up tables and all else that is not curves and a matrix. */
#ifndef IO_PROFILE_H
#define IO_PROFILE_H
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

typedef struct io_profile io_profile;

/* From the profile's device values, RGB (or grey, of which the first of three counts), to linear sRGB, relative
 * colorimetric. NULL where the profile is damaged or of other channels. name (size bytes) gets what it calls itself.
 * The caller closes it. */
io_profile *io_profile_open(const uint8_t *bytes, size_t length, bool grey, char *name, size_t size);
void io_profile_close(io_profile **profile);

/* [count][3] in place. Any threads may ask at once. */
void io_profile_apply(const io_profile *profile, float *rgb, int count);
#endif
