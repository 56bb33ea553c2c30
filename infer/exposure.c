#include "infer/exposure.h"
#include "render/render.h"
#include <math.h>
#include <stdlib.h>

enum { LEAST = 64 };
#define BELIEVED 0.5
#define DARK 0.02f
#define BRIGHT 0.9f

/* The k-th smallest of count values, which are moved about (Hoare 1961, "Find"). */
static float smallest(float *v, size_t count, size_t k)
{
    size_t first = 0, last = count - 1;
    while (first < last) {
        const float pivot = v[first + (last - first) / 2];
        size_t i = first, j = last;
        for (;; i++, j--) {
            while (v[i] < pivot) i++;
            while (v[j] > pivot) j--;
            if (i >= j) break;
            const float swapped = v[i];
            v[i] = v[j], v[j] = swapped;
        }
        if (k <= j) last = j;
        else first = j + 1;
    }
    return v[k];
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
            if (tells(photo[c]) && tells(value)) seen[count++] = photo[c] / value;
        }
    }
    *factor = 1;
    if (count >= LEAST) *factor = pow((double)smallest(seen, count, count / 2), BELIEVED);
    free(seen);
    return TS_OK;
}

double lgd_irradiance(const rd_view *view) { return (double)view->power / pow((double)view->light[2], 2); }

ts_code lgd_expose_others(rd_grid grid, const float *maps, int channels, int count, rd_view *views,
                          const float *const *image, int side, double factor, ts_status *st)
{
    for (int k = 1; k < count; k++) {
        double own;
        views[k].power *= (float)factor;
        if (lgd_exposure_beside(grid, maps, channels, &views[k], image[k], side, &own, st)) return st->code;
        views[k].power *= (float)own;
    }
    return TS_OK;
}
