#include "render/render.h"
#include "render/brdf.h"
#include "render/kernels/newton.h"
#include "render/kernels/shade.h"
#include "render/published.h"
#include "render/rows.h"
#include "tensor/scratch.h"
#include <math.h>

ts_shade_view rd_shade_view(const rd_view *view)
{
    const bool published = view->kind == RD_PUBLISHED, falloff = published || view->kind == RD_POINT;
    ts_shade_view s = {.guards = published ? &rd_published.guards : &rd_guards,
                       .falloff = falloff,
                       .power = falloff ? view->power : 3.14159265f,
                       .ambient = view->ambient};
    if (view->kind == RD_DIRECTIONS) {
        s.kind = TS_SHADE_DIRECTIONS;
        s.power = (float)rd_light(view, (double[2]){0}, s.light, s.camera);
        s.fresnel = (float)rd_fresnel(rd_half(s.light, s.camera, s.half));
        return s;
    }
    bool same = true;
    for (int i = 0; i < 3; i++) {
        s.light[i] = (double)view->light[i];
        s.camera[i] = (double)view->camera[i];
        same &= s.light[i] == s.camera[i];
    }
    s.kind = published ? TS_SHADE_PUBLISHED : same ? TS_SHADE_COLLOCATED : TS_SHADE_POSITIONS;
    s.fresnel = (float)rd_fresnel(1);
    return s;
}

ts_shade_row rd_shade_row(rd_grid grid, int y, const float *maps, int channels)
{
    double centre[2];
    rd_centre(grid, 0, y, centre);
    return (ts_shade_row){.y = centre[1],
                          .step = 1.0 / grid.side,
                          .column = grid.x0,
                          .count = grid.w,
                          .channels = channels,
                          .maps = maps + (int64_t)y * grid.w * channels};
}

/* What a loop over the rows of a grid is given. */
typedef struct rows_job {
    rd_grid grid;
    const float *maps;
    int channels, count;
    const ts_shade_view *view;
    const float *const *image;
    float value; /* the limit, or the scale */
    const float *damping;
    const ts_shade_disk *disk;
    double *sums;
    float *to;
} rows_job;

static void render_rows(const void *job, int64_t begin, int64_t end)
{
    const rows_job *j = job;
    for (int64_t y = begin; y < end; y++) {
        const ts_shade_row row = rd_shade_row(j->grid, (int)y, j->maps, j->channels);
        ts_shade_k()->render(j->view, &row, j->value, j->to + y * j->grid.w * 3);
    }
}

void rd_render(rd_grid grid, const float *maps, int channels, const rd_view *view, bool clamp, float *image)
{
    const ts_shade_view v = rd_shade_view(view);
    ts_for(grid.threads, grid.h, 1, render_rows,
           &(rows_job){.grid = grid,
                       .maps = maps,
                       .channels = channels,
                       .view = &v,
                       .value = clamp ? 1.0f : INFINITY,
                       .to = image});
}

static void spiral(int count, float radius, float turn, double (*point)[2])
{
    const double golden = 2.399963229728653;
    for (int i = 0; i < count; i++) {
        const double r = (double)radius * sqrt((i + 0.5) / count), angle = (double)turn + golden * i;
        point[i][0] = r * cos(angle);
        point[i][1] = r * sin(angle);
    }
}

static void render_disk_rows(const void *job, int64_t begin, int64_t end)
{
    const rows_job *j = job;
    for (int64_t y = begin; y < end; y++) {
        const ts_shade_row row = rd_shade_row(j->grid, (int)y, j->maps, j->channels);
        ts_shade_k()->render_disk(j->view, &row, j->disk, j->to + y * j->grid.w * 3);
    }
}

/* Half vectors turn half as far as the light: the disk widens a highlight as the mean over radius / (2 distance) does.
 */
void rd_render_disk(rd_grid grid, const float *maps, int channels, const rd_view *view, float radius, float turn,
                    float *image)
{
    const double half = 0.5 * (double)radius / (double)fmaxf(view->light[2], 1e-3f);
    ts_shade_view v = rd_shade_view(view);
    ts_shade_disk disk = {.as_one = (float)(8 * half), .as_few = (float)(3 * half)};
    v.kind = TS_SHADE_POSITIONS;
    spiral(TS_DISK_FEW, radius, turn, disk.few);
    spiral(TS_DISK_MANY, radius, turn, disk.many);
    ts_for(grid.threads, grid.h, 1, render_disk_rows,
           &(rows_job){.grid = grid, .maps = maps, .channels = channels, .view = &v, .disk = &disk, .to = image});
}

static void flash_rows(const void *job, int64_t begin, int64_t end)
{
    const rows_job *j = job;
    for (int64_t y = begin; y < end; y++) {
        const int64_t at = y * j->grid.w;
        const ts_shade_row row = rd_shade_row(j->grid, (int)y, j->maps, j->channels);
        j->sums[y] = ts_shade_k()->flash(j->view, &row, j->image[0] + at * 3, j->value,
                                         j->to ? j->to + at * j->channels : NULL);
    }
}

/* The RMSE, and the gradient scaled by scale unless it is NULL. A sum a row, added in order: the same for any number of
 * threads. */
static double flash(rd_grid grid, const float *maps, int channels, const rd_view *view, const float *image,
                    double scale, float *gradient)
{
    const ts_shade_view v = rd_shade_view(view);
    double *sums = ts_scratch(0, (size_t)grid.h * sizeof(double)), sum = 0;
    ts_for(grid.threads, grid.h, 1, flash_rows,
           &(rows_job){.grid = grid,
                       .maps = maps,
                       .channels = channels,
                       .view = &v,
                       .image = &image,
                       .value = (float)scale,
                       .sums = sums,
                       .to = gradient});
    for (int y = 0; y < grid.h; y++) sum += sums[y];
    return sqrt(sum / (3.0 * grid.h * grid.w));
}

void rd_flash_rmse(rd_grid grid, const float *maps, int channels, const rd_view *view, const float *image, double *rmse)
{
    *rmse = flash(grid, maps, channels, view, image, 0, NULL);
}

void rd_flash_gradient(rd_grid grid, const float *maps, int channels, const rd_view *view, const float *image,
                       double rmse0, float *gradient, double *rmse)
{
    const bool published = view->kind == RD_PUBLISHED;
    const double least = published ? rd_published.rmse : RD_RMSE_FLOOR,
                 factor = published ? rd_published.gradient : 1e5;
    double floored = rmse0 > least ? rmse0 : least;
    double now = flash(grid, maps, channels, view, image, factor / (3.0 * 256 * 256) / floored, gradient);
    if (rmse) *rmse = now;
}

static void newton_rows(const void *job, int64_t begin, int64_t end)
{
    const rows_job *j = job;
    for (int64_t y = begin; y < end; y++) {
        const int64_t at = y * j->grid.w;
        const ts_shade_row row = rd_shade_row(j->grid, (int)y, j->maps, j->channels);
        const float *part[RD_CAPTURE_VIEWS];
        for (int k = 0; k < j->count; k++) part[k] = j->image[k] + at * 3;
        ts_newton_k()->step(j->view, part, j->count, &row, j->damping, j->to + at * j->channels);
    }
}

void rd_newton_step(rd_grid grid, const float *maps, int channels, const rd_view *views, const float *const *image,
                    int count, const float *damping, float *step)
{
    ts_shade_view v[RD_CAPTURE_VIEWS];
    for (int k = 0; k < count; k++) v[k] = rd_shade_view(&views[k]);
    ts_for(grid.threads, grid.h, 1, newton_rows,
           &(rows_job){.grid = grid,
                       .maps = maps,
                       .channels = channels,
                       .count = count,
                       .view = v,
                       .image = image,
                       .damping = damping,
                       .to = step});
}
