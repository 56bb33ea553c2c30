#include "data/under_sheet.h"
#include "data/materials/noise.h"
#include "tensor/rng.h"
#include "tensor/scratch.h"
#include <math.h>
#include <string.h>

/* Every fault is drawn, whether it is switched on or not, so that one key changes one fault. */
typedef struct faults {
    float exposure, right, down, bend;
    float moved[2][3]; /* of camera and light, -1 .. 1 */
} faults;

static faults draw(uint64_t seed, uint64_t index)
{
    ts_rng r = ts_rng_make(seed, TS_STREAM_WINDOWS, index);
    faults f;
    f.exposure = ts_rng_range(&r, -1, 1);
    const float away = __builtin_sqrtf(ts_rng_uniform(&r)), turn = ts_rng_range(&r, 0, 6.2831853f);
    f.right = away * cosf(turn);
    f.down = away * sinf(turn);
    f.bend = ts_rng_range(&r, -1, 1);
    for (int i = 0; i < 2; i++) { /* uniform in a ball */
        const float z = ts_rng_range(&r, -1, 1), around = ts_rng_range(&r, 0, 6.2831853f),
                    far = cbrtf(ts_rng_uniform(&r)), flat = __builtin_sqrtf(1 - z * z);
        f.moved[i][0] = far * flat * cosf(around);
        f.moved[i][1] = far * flat * sinf(around);
        f.moved[i][2] = far * z;
    }
    return f;
}

void io_under_sheet_move(const io_under_sheet *u, uint64_t seed, uint64_t index, io_rig *rig)
{
    const faults f = draw(seed, index);
    for (int k = 0; k < 3; k++) {
        rig->camera[k] += u->pose * f.moved[0][k];
        rig->light[k] += u->pose * f.moved[1][k];
    }
}

float io_under_sheet_exposure(const io_under_sheet *u, uint64_t seed, uint64_t index)
{
    /* paper of albedo .8 under the default flash: 0.8 / pi * 5.27 */
    const float paper = 1.341f, level = 0.6f;
    return level / paper * (1 + u->bracket * draw(seed, index).exposure);
}

/* Catmull and Rom's cubic, which keeps detail: its weights of the four pixels around at a fraction beyond the second.
 */
static void cubic(float t, float w[4])
{
    w[0] = ((-0.5f * t + 1) * t - 0.5f) * t;
    w[1] = (1.5f * t - 2.5f) * t * t + 1;
    w[2] = ((-1.5f * t + 2) * t + 0.5f) * t;
    w[3] = (0.5f * t - 0.5f) * t * t;
}

/* The pixel at (x, y) of [size][size][3]; the border goes on outside. */
static void sample(int size, const float *image, float x, float y, float rgb[3])
{
    float across[4], along[4];
    const int i = (int)floorf(x), j = (int)floorf(y);
    cubic(x - (float)i, across);
    cubic(y - (float)j, along);
    rgb[0] = rgb[1] = rgb[2] = 0;
    for (int b = 0; b < 4; b++) {
        const int row = j - 1 + b < 0 ? 0 : j - 1 + b < size ? j - 1 + b : size - 1;
        for (int a = 0; a < 4; a++) {
            const int column = i - 1 + a < 0 ? 0 : i - 1 + a < size ? i - 1 + a : size - 1;
            const float *from = image + ((size_t)row * (size_t)size + (size_t)column) * 3, w = across[a] * along[b];
            for (int c = 0; c < 3; c++) rgb[c] += w * from[c];
        }
    }
    for (int c = 0; c < 3; c++) rgb[c] = nz_max(rgb[c], 0); /* the cubic swings below */
}

void io_under_sheet_shift(const io_under_sheet *u, uint64_t seed, uint64_t index, int size, float *image)
{
    if (!(u->shift > 0)) return;
    const faults f = draw(seed, index);
    const size_t values = (size_t)size * (size_t)size * 3;
    const float most = u->shift * (float)size / 512;
    float *from = ts_scratch(TS_SCRATCH_SLOTS - 1, values * sizeof *from);
    memcpy(from, image, values * sizeof *from);
    for (int y = 0; y < size; y++)
        for (int x = 0; x < size; x++, image += 3) {
            /* in half sides from the centre */
            const float px = ((float)x + 0.5f) * 2 / (float)size - 1, py = ((float)y + 0.5f) * 2 / (float)size - 1,
                        bend = f.bend * (px * px + py * py);
            sample(size, from, (float)x + most * (f.right + bend * px), (float)y + most * (f.down + bend * py), image);
        }
}
