#include "infer/tiles.h"
#include "infer/clip.h"
#include "render/render.h"
#include "tensor/resample.h"
#include "tensor/threads.h"
#include <math.h>
#include <stdint.h>
#include <string.h>

bool lgd_tiles_exact(const nn_arch *arch) { return arch->rmse == NN_RMSE_START || !arch->gradient; }

/* A rectangle of the photograph: rows y0 .. y1 - 1, columns x0 .. x1 - 1. */
typedef struct area {
    int y0, x0, y1, x1;
} area;

static bool same(area a, area b) { return a.y0 == b.y0 && a.x0 == b.x0 && a.y1 == b.y1 && a.x1 == b.x1; }
static int rows(area a) { return a.y1 - a.y0; }
static int columns(area a) { return a.x1 - a.x0; }

static area grown(area a, int by, int side)
{
    return (area){a.y0 > by ? a.y0 - by : 0, a.x0 > by ? a.x0 - by : 0, a.y1 + by < side ? a.y1 + by : side,
                  a.x1 + by < side ? a.x1 + by : side};
}

typedef struct work {
    ag_tape *tape;
    const nn_model *model;
    lgd_tiles *t;
    int channels;
    ag_value **coarse; /* [coarse_steps + 1]: R_0 at g's size, then those of the coarse steps at theirs */
    int coarse_steps;  /* of t->steps */
    ts_taps taps[2];   /* from R_0 and from the others to side, along rows and columns alike */
    double *rmse0;     /* [given] */
    double *squares;   /* [steps + 1]: sums over the pixels of squared differences, by t */
} work;

/* R_t of a coarse step in an area. */
static void start(const work *w, int t, area a, float *maps)
{
    const ts_taps down = ts_taps_part(&w->taps[t > 0], a.y0, rows(a)),
                  across = ts_taps_part(&w->taps[t > 0], a.x0, columns(a));
    ts_resample(1, w->channels, &down, &across, w->coarse[t]->t.data, maps, false, ag_compute(w->tape)->threads);
}

/* The given photographs in an area, one after the other. */
static void photographs(const work *w, area a, float *to)
{
    const int64_t row = 3 * (int64_t)columns(a);
#pragma omp parallel for collapse(2) num_threads(ts_threads_of(ag_compute(w->tape)->threads)) schedule(static)
    for (int k = 0; k < w->t->given; k++)
        for (int y = 0; y < rows(a); y++)
            lgd_clip(row, w->t->image[k] + ((size_t)(a.y0 + y) * (size_t)w->t->side + (size_t)a.x0) * 3,
                     to + ((int64_t)k * rows(a) + y) * row);
}

/* to (area b) = the part of from (area a) that it shows; b lies in a. Where they are the same memory rows move one
 * after the other. */
static void crop(const work *w, area a, area b, int channels, const float *from, float *to)
{
    const size_t row = (size_t)columns(b) * (size_t)channels;
    if (from == to && same(a, b)) return;
#pragma omp parallel for num_threads(ts_threads_of(ag_compute(w->tape)->threads)) schedule(static) if (from != to)
    for (int y = 0; y < rows(b); y++)
        memmove(to + (size_t)y * row,
                from + ((size_t)(b.y0 + y - a.y0) * (size_t)columns(a) + (size_t)(b.x0 - a.x0)) * (size_t)channels,
                row * sizeof *to);
}

static rd_grid grid_of(const work *w, area a)
{
    return (rd_grid){rows(a), columns(a), a.y0, a.x0, w->t->side, ag_compute(w->tape)->threads};
}

/* Sum of squared differences between each photograph (of area a, as photographs has it) and the rendering of the maps
 * (of a too) in core, added to sum [given]. */
static void add_squares(const work *w, area a, area core, const float *photo, const float *maps, double *sum)
{
    const ts_mark mark = ts_arena_mark(ag_arena(w->tape));
    const int given = w->t->given;
    const size_t pixels = (size_t)rows(core) * (size_t)columns(core), all = (size_t)rows(a) * (size_t)columns(a);
    float *cut = same(a, core)
        ? NULL
        : ts_arena_alloc(ag_arena(w->tape), pixels * (size_t)(w->channels + 3 * given) * sizeof *cut);
    if (!same(a, core) && !cut) {
        ag_fail(w->tape, TS_NOMEM, "out of memory");
        return;
    }
    if (cut) {
        crop(w, a, core, w->channels, maps, cut);
        for (int k = 0; k < given; k++)
            crop(w, a, core, 3, photo + (size_t)k * all * 3, cut + pixels * (size_t)(w->channels + 3 * k));
        maps = cut;
        photo = cut + pixels * (size_t)w->channels;
    }
    for (int k = 0; k < given; k++) {
        double rmse;
        rd_flash_rmse(grid_of(w, core), maps, w->channels, &w->t->views[k], photo + (size_t)k * pixels * 3, &rmse);
        sum[k] += rmse * rmse * (double)pixels;
    }
    ts_arena_release(ag_arena(w->tape), mark);
}

/* Of all photographs together. */
static double square_sum(const work *w, area a, area core, const float *photo, const float *maps)
{
    double each[NN_MAX_IMAGES] = {0}, sum = 0;
    add_squares(w, a, core, photo, maps, each);
    for (int k = 0; k < w->t->given; k++) sum += each[k] / w->t->given;
    return sum;
}

static double change(const float *a, const float *b, size_t values)
{
    double sum = 0;
    for (size_t i = 0; i < values; i++) sum += (double)(a[i] - b[i]) * (double)(a[i] - b[i]);
    return sqrt(sum / (double)values);
}

static bool measured(const lgd_tiles *t, int step)
{
    return t->rmse && (!t->ends_alone || step == 0 || step == t->steps);
}

/* The steps of a tile: what is refined shrinks towards the tile by h's reach at every step. Leaves R_T of the tile in
 * to. */
static void refine(work *w, area core, float *to)
{
    lgd_tiles *t = w->t;
    const int reach = nn_refiner_reach(w->model), gru = w->model->arch.h_gru, begin = w->coarse_steps;
    const int most = nn_arch_refines_full(&w->model->arch) ? t->steps : begin;
    ag_tape *tape = w->tape;
    area now = grown(core, reach * (most - begin), t->side);
    const int carried = nn_arch_carries(&w->model->arch) ? 2 : 0;
    const ts_shape s = {1, rows(now), columns(now), w->channels};
    ag_value *maps = ag_empty(tape, s), *image = ag_empty(tape, (ts_shape){t->given, s.h, s.w, 3});
    ag_value *states[2] = {0};
    for (int i = 0; i < carried; i++) states[i] = ag_empty(tape, (ts_shape){1, s.h, s.w, gru});
    if (ag_status(tape)->code) return;
    float *const buffer = maps->t.data, *const photo = image->t.data;
    photographs(w, now, photo);
    for (int i = t->rmse ? 0 : begin; i <= begin; i++) {
        if (i < begin && !measured(t, i)) continue;
        start(w, i, now, buffer);
        if (measured(t, i)) w->squares[i] += square_sum(w, now, core, photo, buffer);
    }
    nn_state state = {.rmse0 = w->rmse0, .step = begin};
    int step = begin;
    for (bool on = true; step < most && on;) {
        const area next = grown(core, reach * (most - step - 1), t->side);
        const ts_mark mark = ag_scope_begin(tape);
        const ts_shape shape = {1, rows(now), columns(now), w->channels};
        const nn_input in = {.image = ts_view(photo, (ts_shape){t->given, shape.h, shape.w, 3}),
                             .grid = grid_of(w, now),
                             .views = t->views,
                             .given = t->given};
        for (int i = 0; i < carried; i++) {
            state.to[i] = ag_constant(tape, ts_view(states[i]->t.data, (ts_shape){1, shape.h, shape.w, gru}));
            state.gru[i] = step > begin ? state.to[i] : NULL;
        }
        ag_value *before = ag_constant(tape, ts_view(buffer, shape));
        state.into = t->tolerance > 0 ? NULL : before;
        ag_value *out = nn_refine(tape, w->model, &in, before, &state);
        if (!out) return;
        on = !(t->tolerance > 0) || change(buffer, out->t.data, (size_t)ts_count(shape)) >= t->tolerance;
        crop(w, now, next, w->channels, out->t.data, buffer);
        for (int i = 0; i < carried; i++) crop(w, now, next, gru, states[i]->t.data, states[i]->t.data);
        state.gru[0] = state.gru[1] = NULL;
        ag_scope_end(tape, mark, NULL, 0);
        if (!same(now, next)) photographs(w, now = next, photo);
        step++;
        if (measured(t, step)) w->squares[step] += square_sum(w, now, core, photo, buffer);
    }
    if (t->rmse && step < t->steps) {
        const double last = square_sum(w, now, core, photo, buffer);
        for (int i = step + 1; i <= t->steps; i++) w->squares[i] += last;
    }
    t->refined += (int64_t)rows(core) * columns(core) * (step - begin);
    crop(w, now, core, w->channels, buffer, to);
}

/* The smallest area of a that holds its wanted pixels; empty (y1 = y0) when there are none. */
static area wanted(const lgd_tiles *t, area a)
{
    if (!t->mask) return a;
    area b = {a.y1, a.x1, a.y0, a.x0};
    for (int y = a.y0; y < a.y1; y++)
        for (int x = a.x0; x < a.x1; x++) {
            if (!t->mask[(size_t)y * (size_t)t->side + (size_t)x]) continue;
            if (y < b.y0) b.y0 = y;
            if (y >= b.y1) b.y1 = y + 1;
            if (x < b.x0) b.x0 = x;
            if (x >= b.x1) b.x1 = x + 1;
        }
    return b.y1 > b.y0 ? b : (area){a.y0, a.x0, a.y0, a.x0};
}

static void put(const work *w, area b, const float *from, float *maps)
{
    const size_t channels = (size_t)w->channels, row = (size_t)columns(b) * channels;
#pragma omp parallel for num_threads(ts_threads_of(ag_compute(w->tape)->threads)) schedule(static)
    for (int y = 0; y < rows(b); y++)
        memcpy(maps + ((size_t)(b.y0 + y) * (size_t)w->t->side + (size_t)b.x0) * channels, from + (size_t)y * row,
               row * sizeof *from);
}

/* What the coarse steps leave everywhere, and what is refined over it. */
static void tile(work *w, area a, float *maps)
{
    const ts_mark mark = ag_scope_begin(w->tape);
    float *own = ts_arena_alloc(ag_arena(w->tape),
                                (size_t)rows(a) * (size_t)columns(a) * (size_t)w->channels * sizeof *own);
    const area todo = wanted(w->t, a);
    if (!own) ag_fail(w->tape, TS_NOMEM, "out of memory for a tile of %d x %d pixels", columns(a), rows(a));
    else if (rows(todo) < rows(a) || columns(todo) < columns(a)) {
        start(w, w->coarse_steps, a, own);
        put(w, a, own, maps);
    }
    if (own && rows(todo) > 0) {
        refine(w, todo, own);
        put(w, todo, own, maps);
    }
    ag_scope_end(w->tape, mark, NULL, 0);
}

/* g and the coarse steps work on the whole photograph; the loss's scale is that of what they leave, measured in bands.
 */
static ts_code prepare(work *w)
{
    ts_arena *arena = ag_arena(w->tape);
    const int side = w->t->side, given = w->t->given;
    const area all = {0, 0, side, side};
    w->coarse_steps = w->t->steps < w->model->arch.coarse_steps ? w->t->steps : w->model->arch.coarse_steps;
    w->coarse = ts_arena_zalloc(arena, (size_t)w->coarse_steps + 1, sizeof *w->coarse);
    if (!w->coarse) return ag_fail(w->tape, TS_NOMEM, "out of memory"), TS_NOMEM;
    const ts_mark mark = ag_scope_begin(w->tape);
    ts_tensor photo = ts_view((float *)(uintptr_t)w->t->image[0], (ts_shape){given, side, side, 3});
    if (given > 1 || !lgd_clipped(ts_count(photo.shape), w->t->image[0], ag_compute(w->tape)->threads)) {
        const ag_value *whole = ag_empty(w->tape, photo.shape);
        if (!whole) return ag_status(w->tape)->code;
        photographs(w, all, whole->t.data);
        photo = whole->t;
    }
    const nn_input in = {.image = photo,
                         .grid = rd_grid_full(side),
                         .views = w->t->views,
                         .given = given,
                         .orientations = w->t->orientations,
                         .proposed = w->t->proposed};
    if (nn_coarse_steps(w->tape, w->model, &in, w->coarse_steps, w->coarse) != TS_OK) return ag_status(w->tape)->code;
    ag_scope_end(w->tape, mark, w->coarse, w->coarse_steps + 1);
    for (int i = 0; i < 2; i++) w->taps[i] = ts_taps_smooth(arena, w->coarse[i ? w->coarse_steps : 0]->t.shape.h, side);
    w->squares = ts_arena_zalloc(arena, (size_t)w->t->steps + 1, sizeof *w->squares);
    w->rmse0 = ts_arena_zalloc(arena, (size_t)given, sizeof *w->rmse0);
    if (!w->taps[0].weight || !w->taps[1].weight || !w->squares || !w->rmse0)
        ag_fail(w->tape, TS_NOMEM, "out of memory");
    for (int y = 0; y < side && nn_arch_reads(&w->model->arch) && !ag_status(w->tape)->code; y += w->t->tile) {
        const area band = {y, 0, y + w->t->tile < side ? y + w->t->tile : side, side};
        const ts_mark before = ag_scope_begin(w->tape);
        const ag_value *maps = ag_empty(w->tape, (ts_shape){1, rows(band), side, w->channels}),
                       *image = ag_empty(w->tape, (ts_shape){given, rows(band), side, 3});
        if (maps && image) {
            start(w, w->coarse_steps, band, maps->t.data);
            photographs(w, band, image->t.data);
            add_squares(w, band, band, image->t.data, maps->t.data, w->rmse0);
        }
        ag_scope_end(w->tape, before, NULL, 0);
    }
    for (int k = 0; k < given && !ag_status(w->tape)->code; k++)
        w->rmse0[k] = sqrt(w->rmse0[k] / ((double)side * side));
    return ag_status(w->tape)->code;
}

static ts_code run(ag_tape *tape, const nn_model *model, lgd_tiles *t, float *maps, ts_status *st)
{
    work w = {.tape = tape, .model = model, .t = t, .channels = model->arch.channels};
    t->refined = 0;
    ts_code code = prepare(&w);
    int64_t pixels = 0;
    for (int y = 0; y < t->side && !code; y += t->tile)
        for (int x = 0; x < t->side && !code; x += t->tile) {
            const area a = {y, x, y + t->tile < t->side ? y + t->tile : t->side,
                            x + t->tile < t->side ? x + t->tile : t->side},
                       b = wanted(t, a);
            if (t->alive && t->alive(t->user)) return ts_fail(st, TS_INTERRUPTED, "interrupted");
            tile(&w, a, maps);
            pixels += (int64_t)rows(b) * columns(b);
            code = ag_status(tape)->code;
        }
    if (code) return ts_fail(st, code, "%s", ag_status(tape)->message);
    for (int i = 0; i <= t->steps && t->rmse; i++)
        t->rmse[i] = !measured(t, i) ? NAN : pixels > 0 ? sqrt(w.squares[i] / (double)pixels) : 0;
    return TS_OK;
}

ts_code lgd_tiles_run(ag_tape *tape, const nn_model *model, lgd_tiles *t, float *maps, ts_status *st)
{
    const ts_mark mark = ag_scope_begin(tape);
    const ts_code code = run(tape, model, t, maps, st);
    ag_scope_end(tape, mark, NULL, 0);
    return code;
}
