#include "infer/tiles.h"
#include "infer/detail.h"
#include "nn/burnt.h"
#include "nn/clip.h"
#include "nn/window.h"
#include "tensor/resample.h"
#include "tensor/team.h"
#include <math.h>
#include <stdint.h>
#include <string.h>

bool lgd_tiles_exact(const nn_arch *arch) { return arch->rmse == NN_RMSE_START || !arch->gradient; }

typedef struct work {
    ag_tape *tape;
    const nn_model *model;
    lgd_tiles *t;
    int channels;
    int threads;       /* the tape's */
    float *maps;       /* the caller's */
    bool one;          /* the photograph is one tile, which works on the caller's maps */
    ts_tensor photo;   /* the photographs, clipped; where nothing reads them whole, their shape alone */
    ag_value **coarse; /* [coarse_steps + 1]: R_0 at g's size, then those of the coarse steps at theirs */
    int coarse_steps;  /* of t->steps */
    ts_taps taps[2];   /* from R_0 and from the others to side, along rows and columns alike */
    float *levels;     /* of lgd_detail_compare, at g's size; NULL: the steps see all detail */
    double *rmse0;     /* [given] */
    double *squares;   /* [steps + 1]: sums over the pixels of squared differences, by t; NULL: not measured */
    bool stopped;      /* by t->after, while one tile was refined */
} work;

/* R_t of a coarse step in a window. */
static void start(const work *w, int t, rd_grid g, float *maps)
{
    const ts_taps down = ts_taps_part(&w->taps[t > 0], g.y0, g.h), across = ts_taps_part(&w->taps[t > 0], g.x0, g.w);
    ts_resample(1, w->channels, &down, &across, w->coarse[t]->t.data, maps, false, w->threads);
}

typedef struct rows_job {
    const work *w;
    rd_grid g;
    const float *from;
    float *to;
} rows_job;

static void clip_rows(const void *job, int64_t begin, int64_t end)
{
    const rows_job *j = job;
    const size_t side = (size_t)j->w->t->side, row = 3 * (size_t)j->g.w;
    for (int64_t i = begin; i < end; i++)
        nn_clip((int64_t)row,
                j->w->t->image[i / j->g.h] + ((size_t)(j->g.y0 + i % j->g.h) * side + (size_t)j->g.x0) * 3,
                j->to + (size_t)i * row);
}

/* The given photographs in a window, one after the other. */
static void photographs(const work *w, rd_grid g, float *to)
{
    ts_for(w->threads, (int64_t)w->t->given * g.h, 1, clip_rows, &(rows_job){.w = w, .g = g, .to = to});
}

static rd_grid whole(const work *w) { return rd_grid_on(rd_grid_full(w->t->side), w->threads); }

static nn_input input(const work *w, rd_grid g, ts_tensor image)
{
    return (nn_input){.image = image,
                      .grid = g,
                      .views = w->t->views,
                      .known = w->t->known,
                      .given = w->t->given,
                      .orientations = w->t->orientations,
                      .r0 = w->t->r0};
}

/* What nn_add_squares adds for the core of in's window. */
static void add_squares(const work *w, const nn_input *in, rd_grid core, const float *maps, double *squares)
{
    const ts_mark mark = ts_arena_mark(ag_arena(w->tape));
    nn_input part = *in;
    if (!nn_window_same(in->grid, core)) {
        ts_tensor cut = ts_new(ag_arena(w->tape), (ts_shape){1, core.h, core.w, w->channels});
        part.image = ts_new(ag_arena(w->tape), (ts_shape){w->t->given, core.h, core.w, 3});
        if (!cut.data || !part.image.data) {
            ag_fail(w->tape, TS_NOMEM, "out of memory");
            return;
        }
        nn_window_crop(in->grid, core, 1, w->channels, maps, cut.data);
        nn_window_crop(in->grid, core, w->t->given, 3, in->image.data, part.image.data);
        maps = cut.data;
        part.grid = core;
    }
    nn_add_squares(w->model, &part, maps, w->channels, squares);
    ts_arena_release(ag_arena(w->tape), mark);
}

/* R_step of a window: measured in its core, where maps are given, and shown to the caller when it is the whole. */
static bool look(work *w, const nn_input *in, rd_grid core, int step, const float *maps)
{
    double rmse = NAN;
    if (w->squares && maps) {
        double each[NN_MAX_IMAGES] = {0};
        add_squares(w, in, core, maps, each);
        for (int k = 0; k < w->t->given; k++) w->squares[step] += each[k] / w->t->given;
        rmse = nn_rmse_of(&w->squares[step], 1, (double)nn_window_pixels(core));
    }
    w->stopped = w->one && w->t->after && !w->t->after(step, rmse, maps, w->t->user);
    return !w->stopped && !ag_status(w->tape)->code;
}

/* Whether anybody wants R_step. */
static bool wanted_at(const work *w, int step)
{
    const lgd_tiles *t = w->t;
    return (w->squares || (w->one && t->after)) && (!t->ends_alone || step == 0 || step == t->steps);
}

typedef struct tile_watch {
    work *w;
    const nn_loop *loop;
} tile_watch;

static bool after_step(int step, const ag_value *maps, void *user)
{
    const tile_watch *u = user;
    return look(u->w, &u->loop->in, u->loop->core, step, maps ? maps->t.data : NULL);
}

/* R_0 of a window with the photograph's detail, which its steps will overwrite, and its errors' deviations there. */
static bool prior(const work *w, rd_grid window, const float *image, float *maps, nn_state *state)
{
    const size_t pixels = (size_t)nn_window_pixels(window);
    const ts_taps down = ts_taps_part(&w->taps[0], window.y0, window.h),
                  across = ts_taps_part(&w->taps[0], window.x0, window.w);
    float *mean = ts_arena_alloc(ag_arena(w->tape), pixels * (size_t)w->channels * sizeof *mean),
          *deviation = ts_arena_alloc(ag_arena(w->tape), pixels * NN_SPREADS * sizeof *deviation);
    if (w->t->given > 1) {
        state->best = ts_arena_alloc(ag_arena(w->tape), pixels * MAP_CHANNELS * sizeof *state->best);
        state->misfit = ts_arena_alloc(ag_arena(w->tape), pixels * sizeof *state->misfit);
    }
    if (!mean || !deviation || (w->t->given > 1 && !(state->best && state->misfit)))
        return ag_fail(w->tape, TS_NOMEM, "out of memory"), false;
    ts_resample(1, NN_SPREADS, &down, &across, w->t->deviation, deviation, false, w->threads);
    ts_status st = {0};
    if (w->levels &&
        lgd_detail_add(window, &down, &across, w->levels, image, &w->t->views[0], deviation, w->channels,
                       ag_arena(w->tape), maps, &st))
        return ag_fail(w->tape, st.code, "%s", st.message), false;
    const nn_input in = input(w, window, w->photo);
    if (nn_settles_burnt(w->model, &in) && nn_burnt_any(window, w->t->image[0])) {
        state->burnt = nn_burnt_find(window, image, ag_arena(w->tape));
        if (!state->burnt) return ag_fail(w->tape, TS_NOMEM, "out of memory"), false;
    }
    memcpy(mean, maps, pixels * (size_t)w->channels * sizeof *mean);
    state->mean = mean;
    state->deviation = deviation;
    return true;
}

/* The steps of a tile. window: the tile and as much around it as its last step depends on, of which image is; maps gets
 * R_T of the tile. */
static void refine(work *w, rd_grid core, rd_grid window, ts_tensor image, float *maps)
{
    lgd_tiles *t = w->t;
    const int begin = w->coarse_steps;
    nn_loop loop = {.in = input(w, window, image),
                    .core = core,
                    .steps = t->steps,
                    .state = {.rmse0 = w->rmse0, .step = begin},
                    .tolerance = t->tolerance};
    tile_watch user = {w, &loop};
    const nn_watch watch = {after_step, &user, t->ends_alone};
    if (w->squares || w->one) loop.watch = &watch;
    for (int i = 0; i <= begin && !w->one; i++) { /* of one tile they were looked at when they were made */
        const bool looks = wanted_at(w, i);
        if (looks || i == begin) start(w, i, window, maps);
        if (looks) look(w, &loop.in, core, i, maps);
    }
    const ts_mark mark = ts_arena_mark(ag_arena(w->tape));
    if (t->deviation && !w->stopped && !prior(w, window, image.data, maps, &loop.state)) return;
    ag_value *now = ag_constant(w->tape, ts_view(maps, (ts_shape){1, window.h, window.w, w->channels}));
    if (now && !w->stopped) nn_steps(w->tape, w->model, &loop, &now);
    t->refined += (int64_t)nn_window_pixels(core) * loop.made;
    ts_arena_release(ag_arena(w->tape), mark);
}

/* The smallest part of a tile that holds its wanted pixels; of no rows when there are none. */
static rd_grid wanted(const lgd_tiles *t, rd_grid a)
{
    if (!t->mask) return a;
    int x0 = a.x0 + a.w, x1 = a.x0, y0 = a.y0 + a.h, y1 = a.y0;
    for (int y = a.y0; y < a.y0 + a.h; y++)
        for (int x = a.x0; x < a.x0 + a.w; x++) {
            if (!t->mask[(size_t)y * (size_t)t->side + (size_t)x]) continue;
            if (y < y0) y0 = y;
            if (y >= y1) y1 = y + 1;
            if (x < x0) x0 = x;
            if (x >= x1) x1 = x + 1;
        }
    return y1 > y0 ? (rd_grid){y1 - y0, x1 - x0, y0, x0, a.side, a.threads}
                   : (rd_grid){0, a.w, a.y0, a.x0, a.side, a.threads};
}

static void put_rows(const void *job, int64_t begin, int64_t end)
{
    const rows_job *j = job;
    const size_t channels = (size_t)j->w->channels, row = (size_t)j->g.w * channels, side = (size_t)j->w->t->side;
    for (int64_t y = begin; y < end; y++)
        memcpy(j->to + ((size_t)(j->g.y0 + y) * side + (size_t)j->g.x0) * channels, j->from + (size_t)y * row,
               row * sizeof *j->to);
}

static void put(const work *w, rd_grid g, const float *from)
{
    ts_for(w->threads, g.h, 1, put_rows, &(rows_job){w, g, from, w->maps});
}

/* A tile, and what its last step depends on. */
static rd_grid surrounded(const work *w, rd_grid core)
{
    const nn_input in = input(w, core, w->photo);
    if (!nn_arch_refines_full(&w->model->arch)) return core;
    const rd_grid window = nn_window_grown(core, nn_steps_reach(w->model, &in, w->coarse_steps, w->t->steps));
    return nn_settles_burnt(w->model, &in) && !nn_burnt_any(window, w->t->image[0]) ? core : window;
}

/* Of several tiles one: what the coarse steps leave everywhere, and what is refined over it. */
static void tile(work *w, rd_grid a)
{
    const ts_mark mark = ag_scope_begin(w->tape);
    const rd_grid core = wanted(w->t, a);
    const rd_grid window = surrounded(w, core);
    const size_t most = nn_window_pixels(a) > nn_window_pixels(window) ? nn_window_pixels(a) : nn_window_pixels(window);
    float *maps = ts_arena_alloc(ag_arena(w->tape), most * (size_t)w->channels * sizeof *maps);
    if (!maps) ag_fail(w->tape, TS_NOMEM, "out of memory for a tile of %d x %d pixels", a.w, a.h);
    if (maps && !nn_window_same(core, a)) {
        start(w, w->coarse_steps, a, maps);
        put(w, a, maps);
    }
    if (maps && core.h > 0) {
        const ag_value *image = ag_empty(w->tape, (ts_shape){w->t->given, window.h, window.w, 3});
        if (image) {
            photographs(w, window, image->t.data);
            refine(w, core, window, image->t, maps);
            put(w, core, maps);
        }
    }
    ag_scope_end(w->tape, mark, NULL, 0);
}

/* Of one tile: R_t of the coarse steps as the caller sees it, and the last as what is refined. */
static bool after_coarse(int t, void *user)
{
    work *w = user;
    const rd_grid all = whole(w);
    const bool looks = wanted_at(w, t);
    if (looks || t == w->coarse_steps) start(w, t, all, w->maps);
    const nn_input in = input(w, all, w->photo);
    const bool on = look(w, &in, all, t, looks ? w->maps : NULL);
    if (!on && !looks && t < w->coarse_steps) start(w, t, all, w->maps);
    return on;
}

/* The loss's scale: RMSE of what the coarse steps leave, measured in bands where the whole is not at hand. */
static ts_code measure_start(work *w)
{
    const int side = w->t->side, height = w->one ? side : w->t->tile;
    w->rmse0 = ts_arena_zalloc(ag_arena(w->tape), (size_t)w->t->given, sizeof *w->rmse0);
    if (!w->rmse0) ag_fail(w->tape, TS_NOMEM, "out of memory");
    for (int y = 0; y < side && !ag_status(w->tape)->code; y += height) {
        const rd_grid band = {y + height < side ? height : side - y, side, y, 0, side, w->threads};
        const ts_mark mark = ag_scope_begin(w->tape);
        const ag_value *maps = w->one ? NULL : ag_empty(w->tape, (ts_shape){1, band.h, side, w->channels}),
                       *image = w->one ? NULL : ag_empty(w->tape, (ts_shape){w->t->given, band.h, side, 3});
        const nn_input in = input(w, band, image ? image->t : w->photo);
        if (maps && image) {
            start(w, w->coarse_steps, band, maps->t.data);
            photographs(w, band, image->t.data);
        }
        if (!ag_status(w->tape)->code)
            nn_add_squares(w->model, &in, maps ? maps->t.data : w->maps, w->channels, w->rmse0);
        ag_scope_end(w->tape, mark, NULL, 0);
    }
    for (int k = 0; k < w->t->given && w->rmse0; k++) w->rmse0[k] = nn_rmse_of(&w->rmse0[k], 1, (double)side * side);
    return ag_status(w->tape)->code;
}

/* One photograph of more pixels than g reads, whose exposure is not known. */
static bool lacks_detail(const work *w)
{
    const lgd_tiles *t = w->t;
    return t->deviation && t->r0 && t->given == 1 && t->steps > 0 && t->known && !(t->known[0] & NN_KNOWN_POWER) &&
        t->side > nn_arch_side(&w->model->arch);
}

static void compare_levels(work *w)
{
    const rd_grid grid = rd_grid_on(rd_grid_full(nn_arch_side(&w->model->arch)), w->threads);
    ts_status st = {0};
    if (lgd_detail_compare(grid, w->t->r0, w->channels, &w->t->views[0], &w->photo, ag_arena(w->tape), w->levels, &st))
        ag_fail(w->tape, st.code, "%s", st.message);
}

/* g and the coarse steps work on the whole photograph. */
static ts_code prepare(work *w)
{
    const lgd_tiles *t = w->t;
    const nn_arch *a = &w->model->arch;
    ts_arena *arena = ag_arena(w->tape);
    const int side = t->side, size = side < a->coarse_size ? side : a->coarse_size;
    w->coarse_steps = t->steps < a->coarse_steps ? t->steps : a->coarse_steps;
    w->coarse = ts_arena_zalloc(arena, (size_t)w->coarse_steps + 1, sizeof *w->coarse);
    w->taps[0] = ts_taps_smooth(arena, nn_arch_side(a), side);
    if (w->coarse_steps > 0) w->taps[1] = ts_taps_smooth(arena, size, side);
    w->squares = t->rmse ? ts_arena_zalloc(arena, (size_t)t->steps + 1, sizeof *w->squares) : NULL;
    if (!w->coarse || !w->taps[0].weight || (w->coarse_steps > 0 && !w->taps[1].weight) || (t->rmse && !w->squares))
        return ag_fail(w->tape, TS_NOMEM, "out of memory"), TS_NOMEM;
    const size_t pixels = (size_t)nn_arch_side(a) * (size_t)nn_arch_side(a);
    if (lacks_detail(w) && !(w->levels = ts_arena_alloc(arena, pixels * LGD_DETAIL_LEVELS * sizeof *w->levels)))
        return ag_fail(w->tape, TS_NOMEM, "out of memory"), TS_NOMEM;
    ts_mark mark = ag_scope_begin(w->tape);
    w->photo = ts_view((float *)(uintptr_t)t->image[0], (ts_shape){t->given, side, side, 3});
    const bool read = w->one || !t->r0 || w->coarse_steps > 0 || w->levels; /* else each tile has its part */
    if (read && (t->given > 1 || !nn_clipped(ts_count(w->photo.shape), t->image[0], w->threads))) {
        const ag_value *clipped = ag_empty(w->tape, w->photo.shape);
        if (!clipped) return ag_status(w->tape)->code;
        photographs(w, whole(w), clipped->t.data);
        w->photo = clipped->t;
    }
    if (w->levels) compare_levels(w);
    if (w->one) mark = ag_scope_begin(w->tape); /* which needs them again */
    const nn_input in = input(w, whole(w), w->photo);
    if (nn_coarse_steps(w->tape, w->model, &in, w->coarse_steps, w->coarse, w->one ? after_coarse : NULL, w) != TS_OK)
        return ag_status(w->tape)->code;
    if (w->stopped) return TS_OK;
    ag_scope_end(w->tape, mark, w->coarse, w->coarse_steps + 1);
    const bool scaled = nn_arch_reads(a) && a->rmse == NN_RMSE_START && t->steps > w->coarse_steps;
    return scaled ? measure_start(w) : TS_OK;
}

static ts_code refine_all(work *w, ts_status *st)
{
    lgd_tiles *t = w->t;
    const rd_grid all = whole(w);
    const int across = (t->side + t->tile - 1) / t->tile;
    int64_t pixels = 0;
    ts_code code = prepare(w);
    if (w->one) {
        pixels = (int64_t)nn_window_pixels(all);
        if (!code && !w->stopped) refine(w, all, all, w->photo, w->maps);
    }
    for (int i = 0; i < across * across && !w->one && !ag_status(w->tape)->code; i++) {
        const int y = i / across * t->tile, x = i % across * t->tile;
        const rd_grid a = {y + t->tile < t->side ? t->tile : t->side - y,
                           x + t->tile < t->side ? t->tile : t->side - x,
                           y,
                           x,
                           t->side,
                           w->threads};
        if (t->before && t->before((double)i / ((double)across * across), t->user))
            return ts_fail(st, TS_INTERRUPTED, "interrupted");
        tile(w, a);
        pixels += (int64_t)nn_window_pixels(wanted(t, a));
    }
    code = ag_status(w->tape)->code;
    if (code) return ts_fail(st, code, "%s", ag_status(w->tape)->message);
    for (int i = 0; i <= t->steps && t->rmse; i++)
        t->rmse[i] = !wanted_at(w, i) ? NAN : pixels > 0 ? nn_rmse_of(&w->squares[i], 1, (double)pixels) : 0;
    return TS_OK;
}

static ts_code run(ag_tape *tape, const nn_model *model, lgd_tiles *t, float *maps, bool *one, ts_status *st)
{
    work w = {.tape = tape,
              .model = model,
              .t = t,
              .channels = model->arch.channels,
              .threads = ag_compute(tape)->threads,
              .maps = maps,
              .one = t->tile >= t->side && !t->mask};
    const ts_mark mark = ag_scope_begin(tape);
    t->refined = 0;
    const ts_code code = refine_all(&w, st);
    ag_scope_end(tape, mark, NULL, 0);
    *one = w.one;
    return code;
}

ts_code lgd_tiles_run(ag_tape *tape, const nn_model *model, lgd_tiles *t, float *maps, ts_status *st)
{
    bool one;
    ts_code code = run(tape, model, t, maps, &one, st);
    if (code || one || !t->after) return code;
    int stop = 0;
    while (t->after(stop, t->rmse ? t->rmse[stop] : NAN, stop == t->steps ? maps : NULL, t->user) && stop < t->steps)
        stop++;
    if (stop == t->steps) return TS_OK;
    t->steps = stop;
    return run(tape, model, t, maps, &one, st);
}
