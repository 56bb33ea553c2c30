#include "infer/estimate.h"
#include "data/material.h"
#include "infer/guess.h"
#include "infer/power.h"
#include "infer/tiles.h"
#include "nn/burnt.h"
#include "nn/clip.h"
#include "nn/likely_views.h"
#include "nn/need.h"
#include "nn/revise.h"
#include "tensor/budget.h"
#include "tensor/resample.h"
#include "tensor/resize.h"
#include "tensor/team.h"
#include "tensor/threads.h"
#include <math.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

enum {
    ONE_TILE = 512,   /* pixels a side up to which a photograph is one tile: at most 0.8 GB with the default
                         architecture */
    TILE = 320,       /* the surroundings add a fifth to its work */
    TILE_MASK = 128,  /* small enough to fit what they follow */
    TILE_EARLY = 256, /* tiles that end early: the surroundings of smaller ones cost more than ending saves */
    AUTO_SIDE = 256   /* pixels a side at which automatic steps are counted, unless every step is seen anyway */
};
#define AUTO_LEAST 1e-3 /* of the RMSE: a step that lowers it by less is not worth its time */

/* The photographs in the order in which models read them. */
static lgd_given in_order(const lgd_photo *photo, int photos, int side, double fov)
{
    lgd_given p = {.count = photos, .side = side};
    rd_view view[NN_MAX_IMAGES] = {0};
    for (int k = 0; k < photos; k++) {
        view[k] = (rd_view){.kind = RD_POINT, .power = photo[k].power};
        memcpy(view[k].light, photo[k].light, sizeof view[k].light);
        memcpy(view[k].camera, photo[k].camera, sizeof view[k].camera);
        if (fov > 0) view[k] = rd_view_from(view[k], rd_fov_distance(fov));
    }
    rd_capture_order(view, photos, p.order);
    for (int k = 0; k < photos; k++) {
        p.image[k] = photo[p.order[k]].image;
        p.views[k] = view[p.order[k]];
    }
    return p;
}

typedef struct conversion {
    const float *from;
    int channels;
    bool encoded;
    float *maps;
    atomic_bool *finite;
} conversion;

static void convert_pixels(const void *job, int64_t begin, int64_t end)
{
    const conversion *c = job;
    bool finite = true;
    for (int64_t i = begin; i < end; i++) {
        const float *x = c->from + i * c->channels;
        float *m = c->maps + i * MAP_CHANNELS;
        for (int k = 0; k < MAP_CHANNELS; k++) finite = finite && isfinite(x[k]);
        const io_texel t = io_texel_get(x);
        if (c->encoded) {
            io_texel_put(m, &t);
            continue;
        }
        memcpy(m + MAP_DIFFUSE, t.diffuse, sizeof t.diffuse);
        m[MAP_NORMAL] = t.normal[0];
        m[MAP_NORMAL + 1] = t.normal[1];
        m[MAP_ROUGHNESS] = t.roughness;
        memcpy(m + MAP_SPECULAR, t.specular, sizeof t.specular);
    }
    if (!finite) atomic_store(c->finite, false);
}

/* The network's maps to the caller's values, one conversion for each; from may be maps. False when one is not finite.
 */
static bool convert(const float *from, int channels, int64_t pixels, bool encoded, int threads, float *maps)
{
    enum { STEP = 1 << 10 };
    atomic_bool finite = true;
    ts_for(threads, pixels, STEP, convert_pixels, &(conversion){from, channels, encoded, maps, &finite});
    return finite;
}

/* What the steps report to: the caller's functions, and what finds the end of the automatic number of steps. */
typedef struct watch {
    const lgd_estimator *e;
    const lgd_options *options;
    int first, last; /* R_first is what the tiles begin with, R_last is wanted */
    bool ends_alone; /* as in lgd_tiles */
    float *best;     /* NULL, or R_t of the last step that paid */
    double best_rmse;
    int best_step, channels;
    size_t values;
} watch;

/* R_t. */
static bool show(const watch *w, int t, double rmse, const float *maps)
{
    const lgd_options *o = w->options;
    if (w->e->seen && maps && !w->e->seen(t, maps, w->channels, w->e->user)) return false;
    return !o->progress || o->progress(t, rmse, o->user) == 0;
}

static bool after_step(int tile_step, double rmse, const float *maps, void *user)
{
    watch *w = user;
    const int step = w->first + tile_step;
    if (w->best) {
        if (tile_step > 0 && !(rmse < w->best_rmse * (1 - AUTO_LEAST))) return false;
        memcpy(w->best, maps, w->values * sizeof *w->best);
        w->best_rmse = rmse;
        w->best_step = step;
    }
    const bool between = w->ends_alone && step > 0 && step < w->last;
    return show(w, step, between ? NAN : rmse, maps);
}

static int before_tile(double done, void *user)
{
    const watch *w = user;
    return w->options->tile ? w->options->tile(done, w->options->user) : 0;
}

/* What a step holds at once at so many pixels a side: maps, their gradient and change, the carried states, and for each
 * of its two cells the convolution, both gates' inputs and the new state. */
static double step_bytes(const nn_arch *a, int photos, int side, int width, int gru)
{
    const double cells = width > 0 ? 2.0 * (width + 8.0 * gru) : 0;
    return (3.0 * photos + (3.0 + 2.0 * a->images) * a->channels + cells) * sizeof(float) * side * side;
}

/* Mask and tolerance ask for tiles of which each ends by itself. */
static bool apart(const lgd_options *o) { return o->mask || o->tolerance > 0; }

static int tile_side(const lgd_estimator *e, int side, const lgd_options *o)
{
    const bool exact = lgd_tiles_exact(&e->net->arch);
    if (exact && o->mask) return TILE_MASK;
    if (!exact || side <= ONE_TILE || (e->seen && !apart(o))) return side;
    return o->tolerance > 0 ? TILE_EARLY : TILE;
}

/* Where camera and power are known a second orientation pays (docs/accuracy.md). Models that do not guess them take
 * them for known. */
static int orientations_of(const nn_arch *a, const lgd_options *o)
{
    enum { SURE = NN_KNOWN_CAMERA | NN_KNOWN_POWER };
    if (o->orientations != LGD_ORIENTATIONS_DEFAULT) return o->orientations;
    return a->scene && (lgd_guess_known(o) & SURE) != SURE ? 1 : 2;
}

/* What an estimate holds at once, at most: g, or a step; beside them the whole photograph's maps, and photographs that
 * are clipped as a whole. */
static double most_bytes(const nn_arch *a, int photos, int copied, int side, int tile, const lgd_options *o)
{
    const int around = a->descent == NN_DESCENT_POSTERIOR ? 2 * a->iterations * nn_burnt_reach(side) : 0,
              part = tile + around < side ? tile + around : side,
              coarse = a->coarse_size < side ? a->coarse_size : side;
    double most = fmax(nn_guess_bytes(a, orientations_of(a, o), nn_likely_views(a, lgd_guess_known(o))),
                       step_bytes(a, photos, part, a->h_width, a->h_gru));
    if (a->coarse_steps > 0) most = fmax(most, step_bytes(a, photos, coarse, a->coarse_width, a->coarse_gru));
    if (a->revisions > 0 && photos > 1) most = fmax(most, nn_revision_bytes(a, photos));
    if (a->scene) most += nn_first_guess_bytes(a);
    return most + (2.0 * a->channels + 3.0 * copied) * sizeof(float) * side * side;
}

double lgd_estimator_bytes(const lgd_estimator *e, int side, const lgd_options *o)
{
    const nn_arch *a = &e->net->arch;
    return most_bytes(a, a->images, a->images > 1 ? a->images : 0, side, tile_side(e, side, o), o);
}

/* At most so many of the photographs are clipped as a whole. */
static int copied(const nn_arch *a, const lgd_given *p, bool tiled, int threads)
{
    if (p->count > 1) return tiled && a->descent == NN_DESCENT_POSTERIOR ? 0 : p->count;
    return !nn_clipped((int64_t)p->side * p->side * 3, p->image[0], threads);
}

/* The RMSE and maps of R_0 and R_steps alone are wanted. */
static bool ends_alone(const lgd_estimator *e, const lgd_options *o, bool choose)
{
    return !choose && !e->seen && !o->every_rmse && o->iterations != LGD_AUTO;
}

/* choose: the number of steps that paid, of the given most, is found on the way and left in *steps. first of them are
 * done; watched: somebody sees the others. */
static ts_code refine(const lgd_estimator *e, const lgd_given *p, const lgd_options *o, bool choose, int first,
                      bool watched, int *steps, float *maps, ts_status *st)
{
    const int side = p->side, channels = e->net->arch.channels;
    const int64_t pixels = (int64_t)side * side;
    watch w = {.e = e,
               .options = o,
               .first = first,
               .last = *steps,
               .ends_alone = ends_alone(e, o, choose),
               .best_step = *steps,
               .channels = channels,
               .values = (size_t)pixels * (size_t)channels};
    float *raw = channels == MAP_CHANNELS ? maps
                                          : malloc(w.values * sizeof *raw); /* only published networks have more */
    double *rmse = o->progress || choose ? calloc((size_t)(*steps - first) + 1, sizeof *rmse) : NULL;
    if (choose) w.best = malloc(w.values * sizeof *w.best);
    lgd_tiles t = {.image = p->image,
                   .views = p->views,
                   .known = p->known,
                   .given = p->count,
                   .r0 = p->r0,
                   .deviation = p->deviation,
                   .mask = o->mask,
                   .side = side,
                   .tile = tile_side(e, side, o),
                   .steps = *steps - first,
                   .orientations = o->orientations,
                   .tolerance = o->tolerance,
                   .before = before_tile,
                   .after = (watched && (o->progress || e->seen)) || choose ? after_step : NULL,
                   .user = &w,
                   .rmse = rmse,
                   .ends_alone = w.ends_alone};
    const bool memory = raw && (rmse || !(o->progress || choose)) && (w.best || !choose);
    ts_code code = memory ? lgd_tiles_run(e->tape, e->net, &t, raw, st)
                          : ts_fail(st, TS_NOMEM, "out of memory for maps of %d x %d pixels", side, side);
    if (!code && !convert(w.best ? w.best : raw, channels, pixels, e->encoded, ag_compute(e->tape)->threads, maps))
        code = ts_fail(st, TS_NUMERIC, "the network's maps are not finite: the weights are damaged or did not train");
    *steps = w.best_step;
    if (raw != maps) free(raw);
    free(rmse);
    free(w.best);
    return code;
}

/* The number of steps that the photographs take at AUTO_SIDE pixels. */
static ts_code count_steps(const lgd_estimator *e, const lgd_given *p, int orientations, int *steps, ts_status *st)
{
    const int side = p->side, given = p->count, small = side < AUTO_SIDE ? side : AUTO_SIDE;
    const size_t pixels = (size_t)small * (size_t)small;
    const lgd_options o = {.size = sizeof o, .iterations = LGD_AUTO, .orientations = orientations};
    const lgd_estimator quiet = {.net = e->net, .tape = e->tape};
    lgd_given reduced = *p;
    float *photo = malloc((size_t)given * pixels * 3 * sizeof *photo),
          *maps = malloc(pixels * MAP_CHANNELS * sizeof *maps);
    ts_arena *arena = ts_arena_create(0, st);
    ts_code code = photo && maps && arena ? TS_OK : ts_fail(st, TS_NOMEM, "out of memory");
    reduced.side = small;
    for (int k = 0; k < given && !code; k++) {
        const ts_tensor to = ts_view(photo + (size_t)k * pixels * 3, (ts_shape){1, small, small, 3});
        code = nn_clip_to(&p->image[k], side, &to, arena, ag_compute(e->tape)->threads, st);
        reduced.image[k] = to.data;
    }
    if (!code) code = refine(&quiet, &reduced, &o, true, 0, true, steps, maps, st);
    ts_arena_destroy(&arena);
    free(photo);
    free(maps);
    return code;
}

/* LGD_TOLERANCE_DEFAULT and what it stands for. */
static double tolerance(const nn_arch *a, const lgd_options *o)
{
    if (o->tolerance != LGD_TOLERANCE_DEFAULT) return o->tolerance;
    return o->iterations == -1 && !o->exact && a->h_width > 0 && lgd_tiles_exact(a) ? LGD_TOLERANCE : 0;
}

/* The photographs' lights as strong as they seem, and R_0, which that takes. */
static ts_code fit_power(const lgd_estimator *e, lgd_given *p, const lgd_options *o, float **r0, ts_status *st)
{
    const nn_arch *a = &e->net->arch;
    *o->power = 1;
    if (a->compat != NN_COMPAT_NONE) return TS_OK;
    *r0 = malloc((size_t)nn_arch_side(a) * (size_t)nn_arch_side(a) * (size_t)a->channels * sizeof **r0);
    if (!*r0) return ts_fail(st, TS_NOMEM, "out of memory");
    const ts_code code = lgd_fit_power(e->tape, e->net, p->image, p->views, p->count, p->side, o->orientations, *r0,
                                       o->power, st);
    for (int k = 0; k < p->count; k++) p->views[k].power *= (float)*o->power;
    p->r0 = *r0;
    return code;
}

typedef struct revision_watch {
    const lgd_estimator *e;
    const lgd_given *given;
    const lgd_options *options;
    bool stopped;
} revision_watch;

/* R_t before its revision, at the photographs' size, with its error in all of them. */
static bool see_revision(int step, const float *r, void *user)
{
    revision_watch *u = user;
    const lgd_options *o = u->options;
    const nn_model *net = u->e->net;
    ag_tape *tape = u->e->tape;
    const int side = u->given->side, size = nn_arch_side(&net->arch), channels = net->arch.channels;
    const watch w = {.e = u->e, .options = o, .channels = channels};
    const bool wanted = u->e->seen || (o->progress && (step == 0 || !ends_alone(u->e, o, false)));
    const ts_mark mark = ag_scope_begin(tape);
    const float *maps = NULL;
    double rmse = NAN;
    if (wanted) {
        const int threads = ag_compute(tape)->threads;
        const ts_taps taps = ts_taps_smooth(ag_arena(tape), size, side);
        ag_value *v = ag_empty(tape, (ts_shape){1, side, side, channels}),
                 *image = ag_empty(tape, (ts_shape){1, side, side, 3});
        if (!taps.weight) ag_fail(tape, TS_NOMEM, "out of memory for maps of %d x %d pixels", side, side);
        if (!taps.weight || !v || !image) return false;
        ts_resample(1, channels, &taps, &taps, r, v->t.data, false, threads);
        double squares = 0;
        for (int k = 0; k < u->given->count; k++) {
            nn_clip(ts_count(image->t.shape), u->given->image[k], image->t.data);
            const nn_input in = {.image = image->t,
                                 .grid = rd_grid_on(rd_grid_full(side), threads),
                                 .views = &u->given->views[k],
                                 .given = 1};
            nn_add_squares(net, &in, v->t.data, channels, &squares);
        }
        rmse = nn_rmse_of(&squares, 1, u->given->count * (double)side * side);
        maps = v->t.data;
    }
    u->stopped = !show(&w, step, rmse, maps);
    ag_scope_end(tape, mark, NULL, 0);
    return !u->stopped;
}

static ts_code estimate(const lgd_estimator *e, const lgd_photo *photo, int photos, int side, const lgd_options *given,
                        float *maps, ts_status *st)
{
    const nn_arch *a = &e->net->arch;
    lgd_options o = *given;
    if (photos > 1) o.fov = LGD_FOV_OF_PHOTO; /* together they are of use only where their places are true */
    o.orientations = orientations_of(a, &o);
    lgd_given p = in_order(photo, photos, side, o.fov);
    for (int k = 0; k < photos; k++) p.known[k] = (unsigned char)lgd_guess_known(&o);
    _Static_assert(LGD_SAMPLE_DIELECTRIC == (int)NN_KIND_DIELECTRIC && LGD_SAMPLE_METAL == (int)NN_KIND_METAL, "kinds");
    p.kind = (nn_kind)o.sample;
    float *r0 = NULL;
    o.tolerance = tolerance(a, given);
    int steps = o.iterations == -1 ? nn_arch_steps(a, photos) : o.iterations;
    if (o.iterations == LGD_AUTO) steps = nn_arch_refines(a) ? LGD_AUTO_MOST : 0;
    const int tile = tile_side(e, side, &o);
    const bool choose = o.iterations == LGD_AUTO && tile == side && !apart(&o);
    /* Once: memory that one stage has touched is there for the next, and touching it first costs as much as computing.
     */
    ag_reset(e->tape);
    ts_arena *arena = ag_arena(e->tape);
    const int copies = copied(a, &p, tile < side || o.mask, ag_compute(e->tape)->threads);
    const double most = most_bytes(a, photos, copies, side, tile, &o),
                 more = most - (double)ts_arena_peak(arena); /* than earlier calls left */
    if (more > 0 && ts_budget_check(more, st) != TS_OK)
        return ts_context(st, "%d x %d pixels, of which the network reads %d x %d", side, side, nn_arch_side(a),
                          nn_arch_side(a));
    if (more > 0) ts_arena_reserve(arena, (size_t)most, ag_compute(e->tape)->threads);
    nn_first_guess guess = {0};
    ts_code code = TS_OK;
    revision_watch user = {e, &p, &o, false};
    const bool guesses = a->descent == NN_DESCENT_POSTERIOR && !e->g_alone;
    int revised = 0;
    if (guesses) code = lgd_guess_first(e->tape, e->net, &p, &o, &guess, st);
    else if (o.power && !e->g_alone) code = fit_power(e, &p, &o, &r0, st);
    if (!code && guesses)
        code = lgd_guess_revise(e->tape, e->net, &p, nn_arch_revisions(a, photos, p.known[0], steps),
                                o.progress || e->seen ? see_revision : NULL, &user, &guess, &revised, st);
    if (!code && user.stopped) steps = revised;
    else if (!code && o.iterations == LGD_AUTO && !choose) {
        steps -= revised; /* of the most */
        code = count_steps(e, &p, o.orientations, &steps, st);
        steps += revised;
    }
    for (int k = 0; k < photos && !code && o.taken; k++) {
        lgd_photo *to = &o.taken[p.order[k]];
        *to = (lgd_photo){.image = p.image[k], .power = p.views[k].power};
        memcpy(to->light, p.views[k].light, sizeof to->light);
        memcpy(to->camera, p.views[k].camera, sizeof to->camera);
    }
    if (o.ambient) *o.ambient = code || p.order[0] != 0 ? 0 : (double)p.views[0].ambient;
    if (!code) code = refine(e, &p, &o, choose && !user.stopped, revised, !user.stopped, &steps, maps, st);
    if (side > ONE_TILE) ag_drop(e->tape); /* what is done with such maps needs memory of its own */
    free(r0);
    return code;
}

ts_code lgd_estimator_run(const lgd_estimator *e, const lgd_photo *photo, int photos, int side, const lgd_options *o,
                          float *maps, ts_status *st)
{
    ag_compute_set(e->tape,
                   (ts_compute){.exact = o->exact,
                                .precision = o->precision == LGD_BF16 ? TS_BF16 : TS_F32,
                                .threads = o->threads > 0 ? o->threads : ts_threads_allowed()});
    return estimate(e, photo, photos, side, o, maps, st);
}
