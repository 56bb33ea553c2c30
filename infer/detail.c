#include "infer/detail.h"
#include "nn/clip.h"
#include "nn/model.h"
#include "render/render.h"
#include "tensor/maps.h"
#include "tensor/resize.h"
#include "tensor/team.h"
#include <string.h>

enum {
    STEP = 1 << 12, /* pixels at a time, at least */
    AROUND = 2      /* pixels that enlarging reads */
};
#define DARK 0.004f  /* one step of 8 bits */
#define MOST 4.0f    /* times brighter or darker */
#define BRIGHT 0.75f /* values from here on are trusted less */

typedef struct level_job {
    rd_grid grid;
    const float *image, *from; /* from: the rendering, or what is enlarged */
    float *own;                /* how far each pixel by itself is to be trusted */
    float *to;
} level_job;

/* 1 for what is far from burnt out, 0 from TS_NEWTON_BURNT on. */
static float trust(const float v[3])
{
    const float left = (TS_NEWTON_BURNT - nn_brightest(v)) / (TS_NEWTON_BURNT - BRIGHT);
    return left < 0 ? 0 : left < 1 ? left : 1;
}

static void compare_pixels(const void *job, int64_t begin, int64_t end)
{
    const level_job *j = job;
    for (int64_t i = begin; i < end; i++) {
        for (int64_t c = 0; c < 3; c++) {
            const float level = (j->from[3 * i + c] + DARK) / (j->image[3 * i + c] + DARK);
            j->to[LGD_DETAIL_LEVELS * i + c] = level > MOST ? MOST : level < 1 / MOST ? 1 / MOST : level;
        }
        j->own[i] = trust(j->image + 3 * i);
    }
}

/* A pixel is trusted as far as those that enlarging reads with it. */
static void least_rows(const void *job, int64_t begin, int64_t end)
{
    const level_job *j = job;
    const int w = j->grid.w, h = j->grid.h;
    for (int y = (int)begin; y < (int)end; y++)
        for (int x = 0; x < w; x++) {
            float least = 1;
            for (int ny = y > AROUND ? y - AROUND : 0; ny <= y + AROUND && ny < h; ny++)
                for (int nx = x > AROUND ? x - AROUND : 0; nx <= x + AROUND && nx < w; nx++) {
                    const float there = j->own[(size_t)ny * (size_t)w + (size_t)nx];
                    if (there < least) least = there;
                }
            j->to[LGD_DETAIL_LEVELS * ((size_t)y * (size_t)w + (size_t)x) + 3] = least;
        }
}

ts_code lgd_detail_compare(rd_grid grid, const float *maps, int channels, const rd_view *view, const ts_tensor *image,
                           ts_arena *arena, float *levels, ts_status *st)
{
    const int64_t pixels = (int64_t)grid.h * grid.w;
    const ts_mark mark = ts_arena_mark(arena);
    ts_tensor small = ts_new(arena, (ts_shape){1, grid.h, grid.w, 3});
    float *rendering = ts_arena_alloc(arena, (size_t)pixels * 3 * sizeof *rendering),
          *own = ts_arena_alloc(arena, (size_t)pixels * sizeof *own);
    ts_code code = TS_OK;
    if (!small.data || !rendering || !own)
        code = ts_fail(st, TS_NOMEM, "out of memory for %d x %d pixels", grid.w, grid.h);
    else code = ts_resize(&small, image, arena, grid.threads, st);
    if (!code) {
        const level_job job = {grid, small.data, rendering, own, levels};
        rd_render(grid, maps, channels, view, true, rendering);
        ts_for(grid.threads, pixels, STEP, compare_pixels, &job);
        ts_for(grid.threads, grid.h, 1, least_rows, &job);
    }
    ts_arena_release(arena, mark);
    return code;
}

/* The photograph, as bright as the rendering. */
static void level_pixels(const void *job, int64_t begin, int64_t end)
{
    const level_job *j = job;
    for (int64_t i = begin; i < end; i++)
        for (int c = 0; c < 3; c++) j->to[3 * i + c] = j->image[3 * i + c] * j->from[LGD_DETAIL_LEVELS * i + c];
}

typedef struct add_job {
    const float *levels, *step;
    int channels;
    float *maps;
} add_job;

static void add_pixels(const void *job, int64_t begin, int64_t end)
{
    const add_job *j = job;
    for (int64_t i = begin; i < end; i++) {
        const float trusted = j->levels[LGD_DETAIL_LEVELS * i + 3], /* enlarging goes a little beyond 0 and 1 */
            part = trusted < 0 ? 0
            : trusted < 1      ? trusted
                               : 1;
        for (int64_t c = i * j->channels; c < i * j->channels + MAP_CHANNELS; c++) j->maps[c] += part * j->step[c];
    }
}

ts_code lgd_detail_add(rd_grid grid, const ts_taps *rows, const ts_taps *columns, const float *levels,
                       const float *image, const rd_view *view, const float *deviation, int channels, ts_arena *arena,
                       float *maps, ts_status *st)
{
    const int64_t pixels = (int64_t)grid.h * grid.w;
    const ts_mark mark = ts_arena_mark(arena);
    float *enlarged = ts_arena_alloc(arena, (size_t)pixels * LGD_DETAIL_LEVELS * sizeof *enlarged),
          *levelled = ts_arena_alloc(arena, (size_t)pixels * 3 * sizeof *levelled),
          *step = ts_arena_alloc(arena, (size_t)(pixels * channels) * sizeof *step);
    ts_code code = TS_OK;
    if (enlarged && levelled && step) {
        const rd_prior prior = {maps, deviation, nn_step_prior(NN_KNOWN_ALL, 1)};
        const float *seen = levelled;
        ts_resample(1, LGD_DETAIL_LEVELS, rows, columns, levels, enlarged, false, grid.threads);
        ts_for(grid.threads, pixels, STEP, level_pixels,
               &(level_job){.image = image, .from = enlarged, .to = levelled});
        rd_posterior_step(grid, maps, channels, view, &seen, 1, &prior, 1, NULL, step, NULL);
        ts_for(grid.threads, pixels, STEP, add_pixels, &(add_job){enlarged, step, channels, maps});
    } else code = ts_fail(st, TS_NOMEM, "out of memory for the detail of %d x %d pixels", grid.w, grid.h);
    ts_arena_release(arena, mark);
    return code;
}
