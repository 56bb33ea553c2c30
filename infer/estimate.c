#include "infer/estimate.h"
#include "data/material.h"
#include "infer/clip.h"
#include "infer/memory.h"
#include "infer/power.h"
#include "infer/tiles.h"
#include "render/render.h"
#include "tensor/resize.h"
#include "tensor/threads.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum {
    UNTILED =
        512,    /* pixels a side up to which a step of h is one piece: at most 0.8 GB with the default architecture */
    TILE = 320, /* the surroundings add a fifth to its work */
    TILE_MASK = 128, /* small enough to fit what they follow */
    TILE_EARLY = 256 /* tiles that end early: the surroundings of smaller ones cost more than ending saves */
};

/* What the unrolled loop reports to: the caller's function, and what finds the end of the automatic number of steps. */
typedef struct watch {
    const nn_input *in;
    const lgd_options *options;
    float *best; /* NULL, or R_t of the last step that paid */
    double best_rmse;
    int steps; /* t of best */
} watch;

#define AUTO_LEAST 1e-3 /* of the RMSE: a step that lowers it by less is not worth its time */

static double rmse_of(const nn_input *in, const ag_value *maps)
{
    const rd_grid g = in->grid;
    double squares = 0;
    for (int k = 0; k < in->given; k++) {
        double one;
        rd_flash_rmse(g, maps->t.data, maps->t.shape.c, &in->views[k],
                      in->image.data + (size_t)k * (size_t)g.h * (size_t)g.w * 3, &one);
        squares += one * one / in->given;
    }
    return sqrt(squares);
}

static bool after_step(int step, const ag_value *maps, void *user)
{
    watch *w = user;
    const double rmse = maps ? rmse_of(w->in, maps) : NAN;
    if (w->best) {
        if (step > 0 && !(rmse < w->best_rmse * (1 - AUTO_LEAST))) return false;
        memcpy(w->best, maps->t.data, (size_t)ts_count(maps->t.shape) * sizeof *w->best);
        w->best_rmse = rmse;
        w->steps = step;
    }
    return !w->options->progress || w->options->progress(step, rmse, w->options->user) == 0;
}

/* The network's encoding to the header's values. False when one is not finite. */
static bool decode(const ag_tape *tape, const float *from, int channels, int64_t pixels, float *maps)
{
    bool finite = true;
#pragma omp parallel for num_threads(ts_threads_of(ag_compute(tape)->threads)) schedule(static) reduction(&& : finite)
    for (int64_t i = 0; i < pixels; i++) {
        const float *x = from + i * channels;
        float *m = maps + i * MAP_CHANNELS;
        for (int c = 0; c < MAP_CHANNELS; c++) finite = finite && isfinite(x[c]);
        const io_texel t = io_texel_get(x);
        memcpy(m + MAP_DIFFUSE, t.diffuse, sizeof t.diffuse);
        m[MAP_NORMAL] = t.normal[0];
        m[MAP_NORMAL + 1] = t.normal[1];
        m[MAP_ROUGHNESS] = t.roughness;
        memcpy(m + MAP_SPECULAR, t.specular, sizeof t.specular);
    }
    return finite;
}

/* What a step of h holds at once: maps, their gradient and change, the carried states, and for each of its two cells
 * the convolution, both gates' inputs and the new state. g works at its own size and needs less. */
static double step_bytes(const nn_arch *a, int side)
{
    const double cells = a->h_width > 0 ? 2.0 * (a->h_width + 8.0 * a->h_gru)
                                        : 0; /* the coarse steps' are at a size of their own */
    return (3.0 * a->images + (3.0 + 2.0 * a->images) * a->channels + cells) * sizeof(float) * side * side;
}

static ts_code not_finite(ts_status *st)
{
    return ts_fail(st, TS_NUMERIC, "the network's maps are not finite: the weights are damaged or did not train");
}

/* What is estimated from; proposed: R_0 where it is known, as in nn_input. */
typedef struct given_photos {
    const float *const *image;
    const rd_view *views;
    int count, side;
    const float *proposed;
} given_photos;

static ts_code run_loop(const lgd_estimator *e, const given_photos *p, int steps, const lgd_options *o, float *maps,
                        int *taken, ts_status *st)
{
    const int side = p->side, given = p->count;
    const double more = step_bytes(&e->net->arch, side) -
        (double)ts_arena_peak(ag_arena(e->tape)); /* than earlier calls left */
    if (more > 0 && lgd_memory_check(more, st) != TS_OK) return ts_context(st, "%d x %d pixels", side, side);
    nn_input in = {.image = ts_new(ag_arena(e->tape), (ts_shape){given, side, side, 3}),
                   .grid = rd_grid_on(rd_grid_full(side), ag_compute(e->tape)->threads),
                   .views = p->views,
                   .given = given,
                   .orientations = o->orientations,
                   .proposed = p->proposed};
    if (!in.image.data) return ts_fail(st, TS_NOMEM, "out of memory for an image of %d x %d pixels", side, side);
    const int64_t values = (int64_t)side * side * 3;
    for (int k = 0; k < given; k++) lgd_clip(values, p->image[k], in.image.data + k * values);

    watch w = {.in = &in, .options = o, .steps = steps};
    ag_value *out = NULL;
    if (o->iterations == LGD_AUTO) {
        w.best = ts_arena_alloc(ag_arena(e->tape),
                                (size_t)side * (size_t)side * (size_t)e->net->arch.channels * sizeof *w.best);
        if (!w.best) return ts_fail(st, TS_NOMEM, "out of memory for maps of %d x %d pixels", side, side);
    }
    if (nn_lgd(e->tape, e->net, &in, steps, false, &out,
               o->progress || w.best ? &(nn_watch){after_step, &w, !w.best && !o->every_rmse} : NULL) != TS_OK ||
        !out) {
        *st = *ag_status(e->tape);
        return st->code ? st->code : ts_fail(st, TS_NUMERIC, "the network gave no result");
    }
    if (taken) *taken = w.steps;
    return decode(e->tape, w.best ? w.best : out->t.data, out->t.shape.c, (int64_t)side * side, maps) ? TS_OK
                                                                                                      : not_finite(st);
}

/* taken: NULL, or gets the number of steps that were made. */
static ts_code run_whole(const lgd_estimator *e, const given_photos *p, int steps, const lgd_options *o, float *maps,
                         int *taken, ts_status *st)
{
    const ts_mark mark = ag_scope_begin(e->tape);
    const ts_code code = run_loop(e, p, steps, o, maps, taken, st);
    ag_scope_end(e->tape, mark, NULL, 0);
    return code;
}

static ts_code estimate_whole(const lgd_estimator *e, const given_photos *p, int steps, const lgd_options *o,
                              float *maps, ts_status *st)
{
    return run_whole(e, p, steps, o, maps, NULL, st);
}

/* The number of steps that the photographs take at AUTO_SIDE pixels. */
static ts_code count_steps(const lgd_estimator *e, const given_photos *p, int most, int orientations, int *steps,
                           ts_status *st)
{
    enum { AUTO_SIDE = 256 };
    const int side = p->side, given = p->count, small = side < AUTO_SIDE ? side : AUTO_SIDE;
    const size_t pixels = (size_t)small * (size_t)small;
    const lgd_options o = {.iterations = LGD_AUTO, .orientations = orientations};
    float *photo = malloc((size_t)given * pixels * 3 * sizeof *photo),
          *maps = malloc(pixels * MAP_CHANNELS * sizeof *maps);
    const float *each[NN_MAX_IMAGES];
    ts_arena *arena = ts_arena_create(0, st);
    ts_code code = photo && maps && arena ? TS_OK : ts_fail(st, TS_NOMEM, "out of memory");
    for (int k = 0; k < given && !code; k++) {
        ts_tensor to = ts_view(photo + (size_t)k * pixels * 3, (ts_shape){1, small, small, 3});
        const ts_tensor from = ts_view((float *)(uintptr_t)p->image[k], (ts_shape){1, side, side, 3});
        if (small == side) memcpy(to.data, p->image[k], pixels * 3 * sizeof *photo);
        else code = ts_resize(&to, &from, arena, ag_compute(e->tape)->threads, st);
        each[k] = to.data;
    }
    if (!code) code = run_whole(e, &(given_photos){each, p->views, given, small, NULL}, most, &o, maps, steps, st);
    ts_arena_destroy(&arena);
    free(photo);
    free(maps);
    return code;
}

/* The caller's function, as tiles call it. */
typedef struct tile_watch {
    const lgd_options *options;
    double tiles, begun;
} tile_watch;

static int before_tile(void *user)
{
    tile_watch *w = user;
    return w->options->tile ? w->options->tile(w->begun++ / w->tiles, w->options->user) : 0;
}

static ts_code estimate_tiles(const lgd_estimator *e, const given_photos *p, int steps, const lgd_options *o,
                              float *maps, ts_status *st)
{
    const int side = p->side;
    const nn_arch *arch = &e->net->arch;
    const int64_t pixels = (int64_t)side * side;
    const int early = side > UNTILED ? TILE_EARLY : side,
              tile = o->mask ? TILE_MASK
        : o->tolerance > 0   ? early
                             : TILE,
              across = (side + tile - 1) / tile;
    tile_watch w = {o, (double)across * across, 0};
    /* the network's channels are the caller's, but for published models */
    float *raw = arch->channels == MAP_CHANNELS ? maps : malloc((size_t)pixels * (size_t)arch->channels * sizeof *raw);
    double *rmse = calloc((size_t)steps + 1, sizeof *rmse);
    ts_code code = raw && rmse ? TS_OK : ts_fail(st, TS_NOMEM, "out of memory for maps of %d x %d pixels", side, side);
    lgd_tiles t = {.image = p->image,
                   .views = p->views,
                   .given = p->count,
                   .proposed = p->proposed,
                   .mask = o->mask,
                   .side = side,
                   .tile = tile,
                   .steps = steps,
                   .orientations = o->orientations,
                   .tolerance = o->tolerance,
                   .rmse = o->progress ? rmse : NULL,
                   .ends_alone = !o->every_rmse && o->iterations != LGD_AUTO,
                   .alive = before_tile,
                   .user = &w};
    if (!code) code = lgd_tiles_run(e->tape, e->net, &t, raw, st);
    int stop = steps;
    for (int i = 0; !code && o->progress && i < stop; i++)
        if (o->progress(i, rmse[i], o->user)) stop = i;
    if (!code && stop == steps && o->progress) o->progress(steps, rmse[steps], o->user);
    if (!code && stop < steps) {
        t.steps = stop;
        code = lgd_tiles_run(e->tape, e->net, &t, raw, st);
    }
    if (!code && !decode(e->tape, raw, arch->channels, pixels, maps)) code = not_finite(st);
    if (raw != maps) free(raw);
    free(rmse);
    return code;
}

ts_code lgd_estimator_run(const lgd_estimator *e, const lgd_photo *photo, int photos, int side, const lgd_options *o,
                          float *maps, ts_status *st)
{
    const float *image[NN_MAX_IMAGES];
    rd_view views[NN_MAX_IMAGES];
    rd_view given[NN_MAX_IMAGES] = {0};
    int order[NN_MAX_IMAGES];
    for (int k = 0; k < photos; k++) {
        given[k] = (rd_view){.kind = RD_POINT, .power = photo[k].power};
        memcpy(given[k].light, photo[k].light, sizeof given[k].light);
        memcpy(given[k].camera, photo[k].camera, sizeof given[k].camera);
    }
    rd_capture_order(given, photos, order);
    for (int k = 0; k < photos; k++) {
        image[k] = photo[order[k]].image;
        views[k] = given[order[k]];
    }
    /* Once: memory that one stage has touched is there for the next, and touching it first costs as much as computing.
     */
    ag_reset(e->tape);
    const bool tiles = lgd_tiles_exact(&e->net->arch) && (side > UNTILED || o->mask || o->tolerance > 0);
    if (o->power) *o->power = 1;
    given_photos p = {image, views, photos, side, NULL};
    float *proposed = NULL;
    ts_code code = TS_OK;
    if (o->power && e->net->arch.compat == NN_COMPAT_NONE) {
        const size_t size = (size_t)e->net->arch.g_size;
        proposed = malloc(size * size * (size_t)e->net->arch.channels * sizeof *proposed);
        if (!proposed) return ts_fail(st, TS_NOMEM, "out of memory");
        code = lgd_fit_power(e->tape, e->net, image, views, photos, side, o->orientations, proposed, o->power, st);
        for (int k = 0; k < photos; k++) views[k].power *= (float)*o->power;
        p.proposed = proposed;
    }
    int steps = o->iterations == -1 ? e->net->arch.iterations : o->iterations;
    if (o->iterations == LGD_AUTO) {
        steps = nn_arch_refines(&e->net->arch) ? LGD_AUTO_MOST : 0;
        if (!code && tiles) code = count_steps(e, &p, steps, o->orientations, &steps, st);
    }
    if (!code) code = (tiles ? estimate_tiles : estimate_whole)(e, &p, steps, o, maps, st);
    if (side > UNTILED) ag_drop(e->tape); /* what is done with such maps needs memory of its own */
    free(proposed);
    return code;
}
