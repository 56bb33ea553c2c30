#include "render/ambient.h"
#include "render/rows.h"
#include "tensor/maps.h"
#include "tensor/scratch.h"
#include "tensor/threads.h"
#include <math.h>

static inline float share_of(float v) { return v < -1 ? 0 : v > 1 ? 1 : 0.5f * (v + 1); }

void rd_ambient_add(rd_grid grid, const float *maps, int channels, const rd_view *view, const rd_ambient *a,
                    float *image)
{
    enum { FAR = 100 }; /* patch widths: its directions are parallel */
    /* A white flat matt sample sends power / (pi distance^2) from its centre. */
    const float *p = view->light;
    const float white = view->power / (3.14159265f * (p[0] * p[0] + p[1] * p[1] + p[2] * p[2]));
    rd_view from_side = {.kind = RD_NEAR}; /* a white flat matt sample has radiance 1 */
    float uniform[3], side[3];
    for (int k = 0; k < 3; k++) {
        from_side.camera[k] = view->camera[k];
        from_side.light[k] = FAR * a->direction[k];
        uniform[k] = white * a->uniform[k];
        side[k] = white * a->side[k];
    }
    const ts_shade_view shade = rd_shade_view(&from_side);
#pragma omp parallel for num_threads(ts_threads_of(grid.threads)) schedule(static)
    for (int y = 0; y < grid.h; y++) {
        const ts_shade_row row = rd_shade_row(grid, y, maps, channels);
        float *lit = ts_scratch(0, (size_t)grid.w * 3 * sizeof *lit), *out = image + (int64_t)y * grid.w * 3;
        ts_shade_k()->render(&shade, &row, INFINITY, lit);
        for (int x = 0; x < grid.w; x++)
            for (int k = 0; k < 3; k++) {
                const float *at = row.maps + (int64_t)x * channels;
                const float s = share_of(at[MAP_SPECULAR + k]), d = share_of(at[MAP_DIFFUSE + k]);
                out[3 * x + k] += side[k] * lit[3 * x + k] + uniform[k] * ((1 - s) * d + s);
            }
    }
}
