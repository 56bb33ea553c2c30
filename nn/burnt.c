#include "nn/burnt.h"
#include "tensor/maps.h"
#include "tensor/resample.h"
#include "tensor/team.h"

/* From here to 1 a photograph burns out: what a value above it says is bent by the tone curve, blurred or noise. */
#define BRIGHT 0.85f
/* So many times the part of its surroundings that is burnt out is the part of a pixel that goes with them. */
#define WITH_THEM 4
enum {
    SETTLED = 4,    /* maps: roughness, F0 */
    PIXELS_OF = 32, /* a photograph's side over the reach */
    LEAST = 2,
    MOST = 8,        /* pixels: a larger photograph's tiles are not to be little beside what is around them */
    ROWS = 4,        /* at a time, at least */
    VALUES = 1 << 12 /* the same */
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
    const float largest = v[0] > v[1] ? v[0] > v[2] ? v[0] : v[2]
        : v[1] > v[2] ? v[1]
                                      : v[2],
                t = (largest - BRIGHT) / (1 - BRIGHT);
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

typedef struct find_job {
    const float *image;
    float *t;
} find_job;

static void brightnesses(const void *of, int64_t begin, int64_t end)
{
    const find_job *j = of;
    for (int64_t i = begin; i < end; i++) j->t[i] = brightness(j->image + 3 * i);
}

static void limit(const void *of, int64_t begin, int64_t end)
{
    float *const *burnt = of;
    for (int64_t i = begin; i < end; i++) {
        const float b = WITH_THEM * (*burnt)[i];
        (*burnt)[i] = b < 1 ? b : 1;
    }
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

/* to = from [p.rows, p.columns, channels] by the filter. */
static bool blur(rd_grid grid, part p, int channels, ts_arena *arena, const float *from, float *to)
{
    const int width = nn_burnt_reach(grid.side) + 1;
    const ts_taps down = ts_taps_blur(arena, p.rows, width), across = ts_taps_blur(arena, p.columns, width);
    if (!down.weight || !across.weight) return false;
    ts_resample(1, channels, &down, &across, from, to, false, grid.threads);
    return true;
}

float *nn_burnt_find(rd_grid grid, const float *image, ts_arena *arena, bool *any)
{
    const int64_t pixels = (int64_t)grid.h * grid.w;
    float *burnt = ts_arena_alloc(arena, (size_t)pixels * sizeof *burnt);
    const ts_mark mark = ts_arena_mark(arena);
    float *t = burnt ? ts_arena_alloc(arena, (size_t)pixels * sizeof *t) : NULL;
    bool done = t != NULL;
    *any = false;
    if (done) {
        ts_for(grid.threads, pixels, VALUES, brightnesses, &(find_job){image, t});
        *any = bright(grid, t, 0).rows > 0;
        if (*any) done = blur(grid, (part){0, 0, grid.h, grid.w}, 1, arena, t, burnt);
        if (*any && done) ts_for(grid.threads, pixels, VALUES, limit, &(float *){burnt});
    }
    ts_arena_release(arena, mark);
    return done ? burnt : NULL;
}

typedef struct settle_job {
    rd_grid grid;
    part p;
    int channels;
    const float *burnt, *mean, *maps;
    float *own, *around; /* [p.rows, p.columns, SETTLED] */
    float *step;
} settle_job;

static int64_t pixel_of(const settle_job *j, int64_t y) { return (j->p.y0 + y) * j->grid.w + j->p.x0; }

static void gather_rows(const void *of, int64_t begin, int64_t end)
{
    const settle_job *j = of;
    for (int64_t y = begin; y < end; y++) {
        float *to = j->own + y * j->p.columns * SETTLED;
        const int64_t first = pixel_of(j, y) * j->channels;
        for (int64_t from = first; from < first + (int64_t)j->p.columns * j->channels; from += j->channels)
            for (int k = 0; k < SETTLED; k++)
                *to++ = j->maps[from + settled[k]] + j->step[from + settled[k]] - j->mean[from + settled[k]];
    }
}

static void settle_rows(const void *of, int64_t begin, int64_t end)
{
    const settle_job *j = of;
    for (int64_t y = begin; y < end; y++) {
        const float *burnt = j->burnt + pixel_of(j, y);
        float *to = j->step + pixel_of(j, y) * j->channels;
        for (int64_t x = 0, at = y * j->p.columns * SETTLED; x < j->p.columns; x++, to += j->channels)
            for (int k = 0; k < SETTLED; k++, at++) to[settled[k]] += burnt[x] * (j->around[at] - j->own[at]);
    }
}

bool nn_burnt_settle(rd_grid grid, const float *burnt, const float *mean, const float *maps, int channels,
                     ts_arena *arena, float *step)
{
    const part p = bright(grid, burnt, nn_burnt_reach(grid.side));
    if (p.rows == 0) return true;
    const ts_mark mark = ts_arena_mark(arena);
    const size_t bytes = (size_t)p.rows * (size_t)p.columns * SETTLED * sizeof(float);
    settle_job j = {grid, p, channels, burnt, mean, maps, NULL, NULL, step};
    j.own = ts_arena_alloc(arena, bytes);
    j.around = j.own ? ts_arena_alloc(arena, bytes) : NULL;
    bool done = j.around != NULL;
    if (done) {
        ts_for(grid.threads, p.rows, ROWS, gather_rows, &j);
        done = blur(grid, p, SETTLED, arena, j.own, j.around);
        if (done) ts_for(grid.threads, p.rows, ROWS, settle_rows, &j);
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
