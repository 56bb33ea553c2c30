#include "render/ambient.h"
#include "render/kernels/shade.h"
#include "render/rows.h"
#include "tensor/maps.h"
#include "tensor/scratch.h"
#include <math.h>

static inline float share_of(float v) { return v < -1 ? 0 : v > 1 ? 1 : 0.5f * (v + 1); }

typedef struct ambient_job {
    rd_grid grid;
    const float *maps;
    int channels;
    ts_shade_view shade;
    float uniform[3], side[3], *image;
} ambient_job;

static void add_to_rows(const void *job, int64_t begin, int64_t end)
{
    const ambient_job *j = job;
    for (int64_t y = begin; y < end; y++) {
        const ts_shade_row row = rd_shade_row(j->grid, (int)y, j->maps, j->channels);
        float *lit = ts_scratch(0, (size_t)j->grid.w * 3 * sizeof *lit), *out = j->image + y * j->grid.w * 3;
        ts_shade_k()->render(&j->shade, &row, INFINITY, lit);
        for (int x = 0; x < j->grid.w; x++)
            for (int k = 0; k < 3; k++) {
                const float *at = row.maps + (int64_t)x * j->channels;
                const float s = share_of(at[MAP_SPECULAR + k]), d = share_of(at[MAP_DIFFUSE + k]);
                out[3 * x + k] += j->side[k] * lit[3 * x + k] + j->uniform[k] * ((1 - s) * d + s);
            }
    }
}

void rd_ambient_add(rd_grid grid, const float *maps, int channels, const rd_view *view, const rd_ambient *a,
                    float *image)
{
    enum { FAR = 100 }; /* patch widths: its directions are parallel */
    /* A white matt sample that is turned to the light sends power / (pi distance^2) from its centre. */
    const float *p = view->light;
    const float white = view->power / (3.14159265f * (p[0] * p[0] + p[1] * p[1] + p[2] * p[2]));
    rd_view from_side = {.kind = RD_NEAR}; /* a white flat matt sample has radiance 1 */
    ambient_job job = {.grid = grid, .maps = maps, .channels = channels, .image = image};
    for (int k = 0; k < 3; k++) {
        from_side.camera[k] = view->camera[k];
        from_side.light[k] = FAR * a->direction[k];
        job.uniform[k] = white * a->uniform[k];
        job.side[k] = white * a->side[k];
    }
    job.shade = rd_shade_view(&from_side);
    ts_for(grid.threads, grid.h, 1, add_to_rows, &job);
}
