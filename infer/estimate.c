#include "infer/estimate.h"
#include "data/material.h"
#include "infer/exposure.h"
#include "infer/first_guess.h"
#include "infer/metal.h"
#include "infer/power.h"
#include "infer/tiles.h"
#include "nn/need.h"
#include "tensor/budget.h"
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

/* What is estimated from; r0: R_0 where it is known, as in nn_input. */
typedef struct given_photos {
    const float *image[NN_MAX_IMAGES];
    rd_view views[NN_MAX_IMAGES];
    unsigned char known[NN_MAX_IMAGES]; /* what of the views is true, nn_known */
    int order[NN_MAX_IMAGES];           /* the caller's number of each */
    int count, side;
    const float *r0, *deviation; /* deviation: of a model that says it */
} given_photos;

/* The photographs in the order in which models read them. */
static given_photos in_order(const lgd_photo *photo, int photos, int side, double fov)
{
    given_photos p = {.count = photos, .side = side};
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
    float *best; /* NULL, or R_t of the last step that paid */
    double best_rmse;
    int best_step, channels;
    size_t values;
} watch;

static bool after_step(int step, double rmse, const float *maps, void *user)
{
    watch *w = user;
    const lgd_options *o = w->options;
    if (w->best) {
        if (step > 0 && !(rmse < w->best_rmse * (1 - AUTO_LEAST))) return false;
        memcpy(w->best, maps, w->values * sizeof *w->best);
        w->best_rmse = rmse;
        w->best_step = step;
    }
    if (w->e->seen && maps && !w->e->seen(step, maps, w->channels, w->e->user)) return false;
    return !o->progress || o->progress(step, rmse, o->user) == 0;
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

/* What an estimate holds at once, at most: g, or a step; beside them the whole photograph's maps. */
static double most_bytes(const nn_arch *a, int photos, int side, int tile, int orientations)
{
    const int part = tile < side ? tile : side, coarse = a->coarse_size < side ? a->coarse_size : side;
    double most = fmax(nn_guess_bytes(a, orientations), step_bytes(a, photos, part, a->h_width, a->h_gru));
    if (a->coarse_steps > 0) most = fmax(most, step_bytes(a, photos, coarse, a->coarse_width, a->coarse_gru));
    return most + 2.0 * a->channels * sizeof(float) * side * side;
}

double lgd_estimator_bytes(const lgd_estimator *e, int side, const lgd_options *o)
{
    return most_bytes(&e->net->arch, e->net->arch.images, side, tile_side(e, side, o), o->orientations);
}

/* choose: the number of steps that paid, of the given most, is found on the way and left in *steps. */
static ts_code refine(const lgd_estimator *e, const given_photos *p, const lgd_options *o, bool choose, int *steps,
                      float *maps, ts_status *st)
{
    const int side = p->side, channels = e->net->arch.channels;
    const int64_t pixels = (int64_t)side * side;
    watch w = {
        .e = e, .options = o, .best_step = *steps, .channels = channels, .values = (size_t)pixels * (size_t)channels};
    float *raw = channels == MAP_CHANNELS ? maps
                                          : malloc(w.values * sizeof *raw); /* only published networks have more */
    double *rmse = o->progress || choose ? calloc((size_t)*steps + 1, sizeof *rmse) : NULL;
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
                   .steps = *steps,
                   .orientations = o->orientations,
                   .tolerance = o->tolerance,
                   .before = before_tile,
                   .after = o->progress || e->seen || choose ? after_step : NULL,
                   .user = &w,
                   .rmse = rmse,
                   .ends_alone = !choose && !e->seen && !o->every_rmse && o->iterations != LGD_AUTO};
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
static ts_code count_steps(const lgd_estimator *e, const given_photos *p, int orientations, int *steps, ts_status *st)
{
    const int side = p->side, given = p->count, small = side < AUTO_SIDE ? side : AUTO_SIDE;
    const size_t pixels = (size_t)small * (size_t)small;
    const lgd_options o = {.size = sizeof o, .iterations = LGD_AUTO, .orientations = orientations};
    const lgd_estimator quiet = {.net = e->net, .tape = e->tape};
    given_photos reduced = *p;
    float *photo = malloc((size_t)given * pixels * 3 * sizeof *photo),
          *maps = malloc(pixels * MAP_CHANNELS * sizeof *maps);
    ts_arena *arena = ts_arena_create(0, st);
    ts_code code = photo && maps && arena ? TS_OK : ts_fail(st, TS_NOMEM, "out of memory");
    reduced.side = small;
    reduced.r0 = NULL;
    for (int k = 0; k < given && !code; k++) {
        ts_tensor to = ts_view(photo + (size_t)k * pixels * 3, (ts_shape){1, small, small, 3});
        const ts_tensor from = ts_view((float *)(uintptr_t)p->image[k], (ts_shape){1, side, side, 3});
        if (small == side) memcpy(to.data, p->image[k], pixels * 3 * sizeof *photo);
        else code = ts_resize(&to, &from, arena, ag_compute(e->tape)->threads, st);
        reduced.image[k] = to.data;
    }
    if (!code) code = refine(&quiet, &reduced, &o, true, steps, maps, st);
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
static ts_code fit_power(const lgd_estimator *e, given_photos *p, const lgd_options *o, float **r0, ts_status *st)
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

/* What of the views is true. A flash is beside the lens, at a place that is not known. */
static int known(const lgd_options *o)
{
    return (o->power ? 0 : NN_KNOWN_POWER) |
        (o->fov > 0                       ? NN_KNOWN_CAMERA
             : o->fov == LGD_FOV_OF_PHOTO ? NN_KNOWN_CAMERA | NN_KNOWN_LIGHT
                                          : 0);
}

/* Power over distance squared at the centre of the sample, of a light above it. */
static double irradiance(const rd_view *view) { return (double)view->power / pow((double)view->light[2], 2); }

/* Where the power is not known, of photographs besides the first neither is their exposure; their lights are first as
 * much stronger or weaker than supposed as that one's. */
static ts_code expose_others(const lgd_estimator *e, given_photos *p, double factor, ts_status *st)
{
    const rd_grid grid = rd_grid_on(rd_grid_full(nn_arch_side(&e->net->arch)), ag_compute(e->tape)->threads);
    for (int k = 1; k < p->count; k++) {
        double own;
        p->views[k].power *= (float)factor;
        if (lgd_exposure_beside(grid, p->r0, e->net->arch.channels, &p->views[k], p->image[k], p->side, &own, st))
            return st->code;
        p->views[k].power *= (float)own;
    }
    return TS_OK;
}

/* What a model that guesses the scene says first, of the photograph that is taken most from above. */
static ts_code first_guess(const lgd_estimator *e, given_photos *p, const lgd_options *o, lgd_first_guess *guess,
                           ts_status *st)
{
    const double before = irradiance(&p->views[0]);
    const ts_code code = lgd_first_guess_make(e->tape, e->net, p->image[0], p->side, &p->views[0], known(o),
                                              p->count > 1, o->orientations, guess, st);
    if (code) return code;
    const rd_view given = p->views[0];
    p->views[0] = rd_scene_view(guess->number);
    if (known(o) & NN_KNOWN_LIGHT) { /* whose height a scene does not have */
        const float higher = given.light[2] / p->views[0].light[2];
        memcpy(p->views[0].light, given.light, sizeof given.light);
        p->views[0].power *= higher * higher;
    }
    p->r0 = guess->r0;
    p->deviation = guess->deviation;
    if (o->power) {
        *o->power = irradiance(&p->views[0]) / before;
        if (expose_others(e, p, *o->power, st)) return st->code;
    }
    if (p->count == 1) return TS_OK;
    const nn_arch *a = &e->net->arch;
    const lgd_metal_photos photos = {p->image, p->views, p->count, p->side, known(o)};
    return lgd_tell_metal(rd_grid_on(rd_grid_full(nn_arch_side(a)), ag_compute(e->tape)->threads), &photos,
                          guess->deviation, nn_arch_steps(a, p->count), a->channels, guess->r0, st);
}

static ts_code estimate(const lgd_estimator *e, const lgd_photo *photo, int photos, int side, const lgd_options *given,
                        float *maps, ts_status *st)
{
    const nn_arch *a = &e->net->arch;
    lgd_options o = *given;
    if (photos > 1) o.fov = LGD_FOV_OF_PHOTO; /* together they are of use only where their places are true */
    given_photos p = in_order(photo, photos, side, o.fov);
    for (int k = 0; k < photos; k++) p.known[k] = (unsigned char)known(&o);
    float *r0 = NULL;
    o.tolerance = tolerance(a, given);
    int steps = o.iterations == -1 ? nn_arch_steps(a, photos) : o.iterations;
    if (o.iterations == LGD_AUTO) steps = nn_arch_refines(a) ? LGD_AUTO_MOST : 0;
    const bool choose = o.iterations == LGD_AUTO && tile_side(e, side, &o) == side && !apart(&o);
    /* Once: memory that one stage has touched is there for the next, and touching it first costs as much as computing.
     */
    ag_reset(e->tape);
    ts_arena *arena = ag_arena(e->tape);
    const double most = most_bytes(a, photos, side, tile_side(e, side, &o), o.orientations),
                 more = most - (double)ts_arena_peak(arena); /* than earlier calls left */
    if (more > 0 && ts_budget_check(more, st) != TS_OK)
        return ts_context(st, "%d x %d pixels, of which the network reads %d x %d", side, side, nn_arch_side(a),
                          nn_arch_side(a));
    if (more > 0) ts_arena_reserve(arena, (size_t)most);
    lgd_first_guess guess = {0};
    ts_code code = TS_OK;
    if (a->descent == NN_DESCENT_POSTERIOR && !e->g_alone) code = first_guess(e, &p, &o, &guess, st);
    else if (o.power) code = fit_power(e, &p, &o, &r0, st);
    if (!code && o.iterations == LGD_AUTO && !choose) code = count_steps(e, &p, o.orientations, &steps, st);
    for (int k = 0; k < photos && !code && o.taken; k++) {
        lgd_photo *to = &o.taken[p.order[k]];
        *to = (lgd_photo){.image = p.image[k], .power = p.views[k].power};
        memcpy(to->light, p.views[k].light, sizeof to->light);
        memcpy(to->camera, p.views[k].camera, sizeof to->camera);
    }
    if (!code) code = refine(e, &p, &o, choose, &steps, maps, st);
    if (side > ONE_TILE) ag_drop(e->tape); /* what is done with such maps needs memory of its own */
    free(r0);
    lgd_first_guess_free(&guess);
    return code;
}

ts_code lgd_estimator_run(const lgd_estimator *e, const lgd_photo *photo, int photos, int side, const lgd_options *o,
                          float *maps, ts_status *st)
{
    ag_compute_set(e->tape,
                   (ts_compute){/* whoever runs the published network wants its numbers */
                                .exact = o->exact || e->net->arch.compat == NN_COMPAT_PUBLISHED,
                                .precision = o->precision == LGD_BF16 ? TS_BF16 : TS_F32,
                                .threads = o->threads > 0 ? o->threads : ts_threads_allowed()});
    return estimate(e, photo, photos, side, o, maps, st);
}
