/* Colour spaces of files: from the stored values to linear sRGB. */
#ifndef IO_COLOUR_H
#define IO_COLOUR_H
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

typedef struct io_curve {
    enum { IO_CURVE_LINEAR, IO_CURVE_SRGB, IO_CURVE_PARAMETRIC, IO_CURVE_TABLE, IO_CURVE_PQ, IO_CURVE_HLG } kind;
    float p[7];           /* parametric: g a b c d e f; v >= d: (a v + b)^g + e, else c v + f */
    const uint8_t *table; /* big-endian 16 bit, inside the profile's bytes */
    int count;
} io_curve;

typedef struct io_space {
    io_curve curve[3];
    float matrix[3][3]; /* linear values to linear sRGB */
    bool identity;      /* the matrix is the unit matrix */
} io_space;

float io_curve_value(const io_curve *curve, float v);

io_space io_space_srgb(void);
io_space io_space_linear(void);
/* A power law with the given primaries and white (x, y of red, green, blue, white), adapted to sRGB's white. gamma 0:
 * the sRGB curve. False when the primaries span nothing. */
bool io_space_primaries(const float xy[8], float gamma, io_space *space);
io_space io_space_adobe_rgb(void);
/* Of coding-independent code points (ITU-T H.273): primaries 1, 9 or 12; transfer 8 linear, 13 sRGB, 1, 6, 14 and 15
 * taken as sRGB's, 16 PQ, 18 HLG. Of the last two HDR's reference white is 1, what is brighter is above, and primaries
 * that are not said (2) are 9. False for others. */
bool io_space_code_points(const int point[2], io_space *space);

/* From an ICC profile of the matrix and curve kind (or grey with a curve); false when it is another kind, has tables
 * too, or is damaged. The profile's bytes stay in use. A profile that describes sRGB up to rounding gives exactly sRGB.
 */
bool io_space_icc(const uint8_t *bytes, size_t size, io_space *space);

/* One pixel to linear sRGB: curves, matrix, NaN and negative to 0. */
void io_space_apply(const io_space *space, const float in[3], float out[3]);
void io_space_matrix(const io_space *space, float rgb[3]); /* the part after the curves */
#endif
