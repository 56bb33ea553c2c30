#include "data/glare.h"
#include "tensor/scratch.h"
#include <math.h>
#include <stddef.h>
#include <string.h>

enum { LEVELS = 5 };

static int half_of(int size) { return (size + 1) / 2; }

/* to[half][half][3]: means of 2 x 2 pixels, the last row and column repeated. */
static void halve(int size, const float *from, float *to)
{
    const int half = half_of(size);
    for (int y = 0; y < half; y++)
        for (int x = 0; x < half; x++) {
            const int x2 = 2 * x + 1 < size ? 2 * x + 1 : 2 * x, y2 = 2 * y + 1 < size ? 2 * y + 1 : 2 * y;
            const int at[4] = {2 * y * size + 2 * x, 2 * y * size + x2, y2 * size + 2 * x, y2 * size + x2};
            for (int c = 0; c < 3; c++) {
                float sum = 0;
                for (int k = 0; k < 4; k++) sum += from[at[k] * 3 + c];
                to[(y * half + x) * 3 + c] = sum / 4;
            }
        }
}

/* Where pixel i of twice the resolution lies between the pixels of size: 3/4 of one, 1/4 of its neighbour. */
static void between(int i, int size, int *near, int *far)
{
    *near = i / 2;
    *far = i % 2 ? i / 2 + 1 : i / 2 - 1;
    if (*far < 0) *far = 0;
    if (*far >= size) *far = size - 1;
}

/* to[size][size][3] = weight to + rest from, enlarged to twice its side (less one where size is odd) by the linear
 * filter. */
static void add_enlarged(int size, const float *from, float weight, float rest, float *to)
{
    const int half = half_of(size);
    for (int y = 0; y < size; y++) {
        int near, far;
        between(y, half, &near, &far);
        const float *a = from + (size_t)near * (size_t)half * 3, *b = from + (size_t)far * (size_t)half * 3;
        float *row = to + (size_t)y * (size_t)size * 3;
        for (int x = 0; x < size; x++) {
            int beside, next;
            between(x, half, &beside, &next);
            for (int c = 0; c < 3; c++)
                row[3 * x + c] = weight * row[3 * x + c] +
                    rest *
                        (0.5625f * a[3 * beside + c] + 0.1875f * (a[3 * next + c] + b[3 * beside + c]) +
                         0.0625f * b[3 * next + c]);
        }
    }
}

void io_glare(int size, float share, float *image)
{
    int side[LEVELS + 1] = {size};
    size_t at[LEVELS + 1] = {0}, values = 0;
    for (int l = 1; l <= LEVELS; l++) {
        side[l] = half_of(side[l - 1]);
        at[l] = values;
        values += (size_t)side[l] * (size_t)side[l] * 3;
    }
    float *level = ts_scratch(TS_SCRATCH_SLOTS - 1, values * sizeof *level);
    for (int l = 1; l <= LEVELS; l++) halve(side[l - 1], l == 1 ? image : level + at[l - 1], level + at[l]);
    /* From the coarsest on, a level becomes the mean of itself and of those above it. */
    for (int l = LEVELS - 1; l > 0; l--) {
        const float above = (float)(LEVELS - l);
        add_enlarged(side[l], level + at[l + 1], 1 / (above + 1), above / (above + 1), level + at[l]);
    }
    add_enlarged(size, level + at[1], 1 - share, share, image);
}
