#include "nn/burnt.h"
#include "nn/clip.h"
#include "tensor/kernels/resample.h"
#include "tensor/maps.h"
#include "tensor/team.h"

/* From here to 1 a photograph burns out: what a value above it says is bent by the tone curve, blurred or noise. */
#define BRIGHT 0.85f
/* So many times the part of its surroundings that is burnt out is the part of a pixel that goes with them. */
#define WITH_THEM 4
enum {
    SETTLED = 4,    /* maps: roughness, F0 */
    PIXELS_OF = 32, /* a photograph's side over the reach */
    LEAST = 2,
    MOST = 8, /* pixels: a larger photograph's tiles are not to be little beside what is around them */
    ROWS = 4  /* at a time, at least */
};
static const int settled[SETTLED] = {MAP_ROUGHNESS, MAP_SPECULAR, MAP_SPECULAR + 1, MAP_SPECULAR + 2};

int nn_burnt_reach(int side)
{
    const int reach = side / PIXELS_OF;
    return reach < LEAST ? LEAST : reach < MOST ? reach : MOST;
}

/* Of a window: what is not 0, or what it reads, of no rows where all is 0. */
typedef struct part {
    int y0, x0, rows, columns;
} part;

static float brightness(const float v[3])
{
    const float t = (nn_brightest(v) - BRIGHT) / (1 - BRIGHT);
    return t < 0 ? 0 : t < 1 ? t : 1;
}

bool nn_burnt_any(rd_grid window, const float *image)
{
    for (int y = window.y0; y < window.y0 + window.h; y++) {
        const float *row = image + ((int64_t)y * window.side + window.x0) * 3;
        for (int x = 0; x < window.w; x++)
            if (brightness(row + 3 * x) > 0) return true;
    }
    return false;
}

/* Rows and columns in which v [h, w] is not 0, and by more on either side, as far as the window goes. */
static part bright(rd_grid g, const float *v, int by)
{
    int y0 = g.h, y1 = 0, x0 = g.w, x1 = 0;
    for (int y = 0; y < g.h; y++) {
        const float *row = v + (int64_t)y * g.w;
        int first = 0, last = g.w;
        while (first < last && !(row[first] > 0)) first++;
        while (last > first && !(row[last - 1] > 0)) last--;
        if (first == last) continue;
        if (y1 == 0) y0 = y;
        y1 = y + 1;
        if (first < x0) x0 = first;
        if (last > x1) x1 = last;
    }
    if (y1 == 0) return (part){0};
    y0 = y0 > by ? y0 - by : 0;
    x0 = x0 > by ? x0 - by : 0;
    y1 = y1 + by < g.h ? y1 + by : g.h;
    x1 = x1 + by < g.w ? x1 + by : g.w;
    return (part){y0, x0, y1 - y0, x1 - x0};
}

/* The triangle filter, of rows that reach beyond what is wanted by as many pixels as it reads. */
typedef struct filter {
    int rows, columns, channels, reach;
    float weight[2 * MOST + 1];
    float *wide, *across, *to; /* [rows, columns + 2 reach, channels]; [rows, columns, channels] */
} filter;

static bool make_filter(rd_grid grid, int rows, int columns, int channels, ts_arena *arena, float *to, filter *f)
{
    const int reach = nn_burnt_reach(grid.side), width = reach + 1;
    *f = (filter){.rows = rows, .columns = columns, .channels = channels, .reach = reach, .to = to};
    for (int i = 0; i <= 2 * reach; i++)
        f->weight[i] = (float)(width - (i < reach ? reach - i : i - reach)) / (float)(width * width);
    const size_t row = (size_t)channels * sizeof(float);
    f->wide = ts_arena_alloc(arena, (size_t)rows * (size_t)(columns + 2 * reach) * row);
    f->across = f->wide ? ts_arena_alloc(arena, (size_t)rows * (size_t)columns * row) : NULL;
    return f->across != NULL;
}

/* Where row y of what is wanted begins. */
static float *row_of(const filter *f, int64_t y)
{
    return f->wide + (y * (f->columns + 2 * f->reach) + f->reach) * f->channels;
}

/* A row's ends are repeated beyond it, and it is filtered. */
static void filter_across(const filter *f, int64_t y)
{
    const int c = f->channels, n = f->columns * c;
    float *row = row_of(f, y);
    for (int i = 0; i < f->reach * c; i++) {
        row[i - f->reach * c] = row[i % c];
        row[n + i] = row[n - c + i % c];
    }
    ts_resample_k()->rows(n, 2 * f->reach + 1, f->weight, row - f->reach * c, c, f->across + y * n);
}

static void filter_down(const void *of, int64_t begin, int64_t end)
{
    const filter *f = of;
    const int64_t n = (int64_t)f->columns * f->channels;
    for (int64_t y = begin; y < end; y++) {
        const int64_t first = y > f->reach ? y - f->reach : 0,
                      last = y + f->reach < f->rows ? y + f->reach : f->rows - 1;
        float weight[2 * MOST + 1] = {0};
        for (int k = 0; k <= 2 * f->reach; k++) {
            const int64_t at = y + k - f->reach;
            weight[at < first ? 0 : at > last ? last - first : at - first] += f->weight[k];
        }
        ts_resample_k()->rows(n, (int)(last - first + 1), weight, f->across + first * n, n, f->to + y * n);
    }
}

typedef struct find_job {
    const float *image;
    filter f;
} find_job;

static void brightness_rows(const void *of, int64_t begin, int64_t end)
{
    const find_job *j = of;
    for (int64_t y = begin; y < end; y++) {
        float *t = row_of(&j->f, y);
        for (int x = 0; x < j->f.columns; x++) t[x] = brightness(j->image + (y * j->f.columns + x) * 3);
        filter_across(&j->f, y);
    }
}

static void burnt_rows(const void *of, int64_t begin, int64_t end)
{
    const filter *f = of;
    filter_down(f, begin, end);
    for (int64_t i = begin * f->columns; i < end * f->columns; i++) {
        const float b = WITH_THEM * f->to[i];
        f->to[i] = b < 1 ? b : 1;
    }
}

float *nn_burnt_find(rd_grid grid, const float *image, ts_arena *arena)
{
    float *burnt = ts_arena_alloc(arena, (size_t)grid.h * (size_t)grid.w * sizeof *burnt);
    const ts_mark mark = ts_arena_mark(arena);
    find_job j = {.image = image};
    const bool done = burnt && make_filter(grid, grid.h, grid.w, 1, arena, burnt, &j.f);
    if (done) {
        ts_for(grid.threads, grid.h, ROWS, brightness_rows, &j);
        ts_for(grid.threads, grid.h, ROWS, burnt_rows, &j.f);
    }
    ts_arena_release(arena, mark);
    return done ? burnt : NULL;
}

typedef struct settle_job {
    rd_grid grid;
    part p;
    int channels;
    const float *burnt, *mean, *maps;
    filter f;
    float *step;
} settle_job;

static int64_t pixel_of(const settle_job *j, int64_t y) { return (j->p.y0 + y) * j->grid.w + j->p.x0; }

static void change_rows(const void *of, int64_t begin, int64_t end)
{
    const settle_job *j = of;
    for (int64_t y = begin; y < end; y++) {
        float *to = row_of(&j->f, y);
        const int64_t first = pixel_of(j, y) * j->channels;
        for (int64_t from = first; from < first + (int64_t)j->p.columns * j->channels; from += j->channels)
            for (int k = 0; k < SETTLED; k++)
                *to++ = j->maps[from + settled[k]] + j->step[from + settled[k]] - j->mean[from + settled[k]];
        filter_across(&j->f, y);
    }
}

static void settle_rows(const void *of, int64_t begin, int64_t end)
{
    const settle_job *j = of;
    filter_down(&j->f, begin, end);
    for (int64_t y = begin; y < end; y++) {
        const float *burnt = j->burnt + pixel_of(j, y), *own = row_of(&j->f, y),
                    *around = j->f.to + y * j->p.columns * SETTLED;
        float *to = j->step + pixel_of(j, y) * j->channels;
        const float *maps = j->maps + pixel_of(j, y) * j->channels;
        for (int x = 0; x < j->p.columns;
             x++, to += j->channels, maps += j->channels, own += SETTLED, around += SETTLED)
            for (int k = 0; k < SETTLED && burnt[x] > 0; k++) {
                const float from = maps[settled[k]], step = to[settled[k]] + burnt[x] * (around[k] - own[k]);
                to[settled[k]] = from + step > 1 ? 1 - from : from + step < -1 ? -1 - from : step;
            }
    }
}

bool nn_burnt_settle(rd_grid grid, const float *burnt, const float *mean, const float *maps, int channels,
                     ts_arena *arena, float *step)
{
    const part p = bright(grid, burnt, nn_burnt_reach(grid.side));
    if (p.rows == 0) return true;
    const ts_mark mark = ts_arena_mark(arena);
    settle_job j = {
        .grid = grid, .p = p, .channels = channels, .burnt = burnt, .mean = mean, .maps = maps, .step = step};
    float *around = ts_arena_alloc(arena, (size_t)p.rows * (size_t)p.columns * SETTLED * sizeof *around);
    const bool done = around && make_filter(grid, p.rows, p.columns, SETTLED, arena, around, &j.f);
    if (done) {
        ts_for(grid.threads, p.rows, ROWS, change_rows, &j);
        ts_for(grid.threads, p.rows, ROWS, settle_rows, &j);
    }
    ts_arena_release(arena, mark);
    return done;
}

static void hold_rows(const void *of, int64_t begin, int64_t end)
{
    const settle_job *j = of;
    for (int64_t i = begin * j->grid.w; i < end * j->grid.w; i++)
        for (int k = 0; k < SETTLED; k++) j->step[i * j->channels + settled[k]] *= 1 - j->burnt[i];
}

void nn_burnt_hold(rd_grid grid, const float *burnt, int channels, float *step)
{
    ts_for(grid.threads, grid.h, ROWS, hold_rows,
           &(settle_job){.grid = grid, .channels = channels, .burnt = burnt, .step = step});
}
