#include "infer/exposure.h"
#include "render/render.h"
#include <math.h>
#include <stdlib.h>

enum { LEAST = 64 };
#define BELIEVED 0.5
#define DARK 0.02f
#define BRIGHT 0.9f

static int ascending(const void *a, const void *b)
{
    const float x = *(const float *)a, y = *(const float *)b;
    return (x > y) - (x < y);
}

static bool tells(float value) { return value > DARK && value < BRIGHT; }

ts_code lgd_exposure_beside(rd_grid grid, const float *maps, int channels, const rd_view *view, const float *image,
                            int side, double *factor, ts_status *st)
{
    const int size = grid.side;
    float *seen = malloc((size_t)size * (size_t)size * 3 * sizeof *seen);
    if (!seen) return ts_fail(st, TS_NOMEM, "out of memory for %d x %d pixels", size, size);
    rd_render(grid, maps, channels, view, false, seen);
    size_t count = 0; /* ratios take the place of values that have been read */
    for (int i = 0; i < size * size; i++) {
        const size_t x = (size_t)((i % size + 0.5) * side / size), y = (size_t)((i / size + 0.5) * side / size);
        const float *photo = image + (y * (size_t)side + x) * 3, *rendering = seen + (size_t)i * 3;
        for (int c = 0; c < 3; c++) {
            const float value = rendering[c];
            if (tells(photo[c]) && tells(value)) seen[count++] = logf(photo[c] / value);
        }
    }
    *factor = 1;
    if (count >= LEAST) {
        qsort(seen, count, sizeof *seen, ascending);
        *factor = exp(BELIEVED * (double)seen[count / 2]);
    }
    free(seen);
    return TS_OK;
}
