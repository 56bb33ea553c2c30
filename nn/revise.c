#include "nn/revise.h"
#include "nn/deviation.h"
#include "nn/lgd_internal.h"
#include "ops.h"
#include "render/render.h"
#include "render/tone.h"
#include "tensor/maps.h"
#include "tensor/team.h"
#include <math.h>
#include <string.h>

/* The channels that are read of a pixel, in this order. */
enum {
    PHOTO,
    LEFT = PHOTO + 3, /* of the photographs, less the renderings of R + d */
    STEP = LEFT + 3,  /* d */
    LEARNED = STEP + MAP_CHANNELS,
    MISFIT = LEARNED + MAP_GROUPS,
    COUNT,
    MAPS,
    SPREAD = MAPS + MAP_CHANNELS,
    READ = SPREAD + NN_SPREADS
};
_Static_assert((int)READ == NN_REVISION_READS, "what layers read is what is written for them");

#define STEP_SCALE 4.0f
#define MISFIT_SCALE 0.25f

/* What is read, of n materials: each pixel's READ channels at the full size, and the same in squares of r x r pixels at
 * g_size, one pixel's after the other's. */
typedef struct reading {
    ag_value *pixels, *squares;
} reading;

/* Of one material. */
typedef struct one {
    const float *photo, *left; /* encoded; [pixels, 3] */
    const float *before, *maps, *spread, *deviation, *after, *misfit;
    float count;
    int side, r;
    float *pixels, *squares;
} one;

static void put_pixel(const one *o, int64_t i, float *to)
{
    memcpy(to + PHOTO, o->photo + 3 * i, 3 * sizeof *to);
    memcpy(to + LEFT, o->left + 3 * i, 3 * sizeof *to);
    for (int c = 0; c < MAP_CHANNELS; c++)
        to[STEP + c] = STEP_SCALE * (o->maps[i * MAP_CHANNELS + c] - o->before[i * MAP_CHANNELS + c]);
    for (int k = 0; k < MAP_GROUPS; k++)
        to[LEARNED + k] = o->after[i * MAP_GROUPS + k] / fmaxf(o->deviation[i * MAP_GROUPS + k], 1e-6f);
    to[MISFIT] = MISFIT_SCALE * log1pf(o->misfit[i]);
    to[COUNT] = o->count;
    memcpy(to + MAPS, o->maps + i * MAP_CHANNELS, MAP_CHANNELS * sizeof *to);
    memcpy(to + SPREAD, o->spread + i * NN_SPREADS, NN_SPREADS * sizeof *to);
}

/* Rows of squares. */
static void put_rows(const void *job, int64_t begin, int64_t end)
{
    const one *o = job;
    const int r = o->r, across = o->side / r;
    for (int64_t k = begin * across; k < end * across; k++) {
        float *to = o->squares + k * r * r * READ;
        const int64_t y0 = k / across * r, x0 = k % across * r;
        for (int j = 0; j < r * r; j++, to += READ) {
            const int64_t i = (y0 + j / r) * o->side + x0 + j % r;
            put_pixel(o, i, to);
            memcpy(o->pixels + i * READ, to, READ * sizeof *to);
        }
    }
}

typedef struct sum_job {
    const float *a, *b;
    float scale, *to;
} sum_job;

/* to += scale (a - b). */
static void add_difference(const void *job, int64_t begin, int64_t end)
{
    const sum_job *j = job;
    for (int64_t i = begin; i < end; i++) j->to[i] += j->scale * (j->a[i] - j->b[i]);
}

enum { TOGETHER = 1 << 12 }; /* values at a time, at least */

/* Memory for one material's steps, a float a pixel and channel. */
typedef struct room {
    float *maps, *step, *best, *misfit, *deviation, *after, *photo, *other, *seen, *left;
} room;
enum { ROOM = 3 * MAP_CHANNELS + 1 + 2 * MAP_GROUPS + 4 * 3 };

static bool room_make(ts_arena *arena, size_t pixels, room *r)
{
    float *at = ts_arena_alloc(arena, pixels * ROOM * sizeof *at);
    if (!at) return false;
    r->maps = at, at += pixels * MAP_CHANNELS;
    r->step = at, at += pixels * MAP_CHANNELS;
    r->best = at, at += pixels * MAP_CHANNELS;
    r->misfit = at, at += pixels;
    r->deviation = at, at += pixels * MAP_GROUPS;
    r->after = at, at += pixels * MAP_GROUPS;
    r->photo = at, at += pixels * 3;
    r->other = at, at += pixels * 3;
    r->seen = at, at += pixels * 3;
    r->left = at;
    return true;
}

/* Material n's part of what is read; maps: R + d goes there. */
static bool read_one(ag_tape *tape, const nn_model *model, const nn_revision *r, int n, const reading *to, float *maps)
{
    ts_arena *arena = ag_arena(tape);
    const int side = r->image.shape.h, threads = ag_compute(tape)->threads, size = model->arch.g_size;
    const size_t pixels = (size_t)side * (size_t)side;
    const rd_grid grid = rd_grid_on(rd_grid_full(side), threads);
    const float *before = r->maps->t.data + (size_t)n * pixels * MAP_CHANNELS,
                *spread = r->spread->t.data + (size_t)n * pixels * NN_SPREADS, *image[NN_MAX_IMAGES];
    const rd_view *views = r->views + n * r->given;
    const ts_mark mark = ts_arena_mark(arena);
    room m;
    if (!room_make(arena, pixels, &m))
        return ag_fail(tape, TS_NOMEM, "no memory for a revision of %d x %d pixels", side, side), false;
    for (int k = 0; k < r->given; k++) image[k] = r->image.data + ((size_t)(n * r->given + k)) * pixels * 3;
    nn_deviations((int64_t)pixels, spread, (nn_belief){.photographs = r->given, .revised = r->made > 0}, threads,
                  m.deviation);
    nn_deviations_of_kind(r->kind, (int64_t)pixels, m.deviation);
    const rd_prior prior = {before, m.deviation, nn_step_prior(r->known[n * r->given], r->given)};
    rd_posterior_steps(grid, MAP_CHANNELS, views, image, r->given, &prior, nn_arch_steps(&model->arch, r->given),
                       (rd_search){.best = m.best, .misfit = m.misfit}, m.maps, m.step, m.after);
    memset(m.left, 0, pixels * 3 * sizeof *m.left);
    for (int k = r->given; k-- > 0;) { /* the first one's stays in m.photo */
        rd_log_encode((int64_t)pixels * 3, image[k], m.photo, threads);
        rd_render(grid, m.maps, MAP_CHANNELS, &views[k], true, m.other);
        rd_log_encode((int64_t)pixels * 3, m.other, m.seen, threads);
        ts_for(threads, (int64_t)pixels * 3, TOGETHER, add_difference,
               &(sum_job){m.photo, m.seen, 1 / (float)r->given, m.left});
    }
    ts_for(threads, size, 1, put_rows,
           &(one){.photo = m.photo,
                  .left = m.left,
                  .before = before,
                  .maps = m.maps,
                  .spread = spread,
                  .deviation = m.deviation,
                  .after = m.after,
                  .misfit = m.misfit,
                  .count = (float)r->given / NN_MAX_IMAGES,
                  .side = side,
                  .r = side / size,
                  .pixels = to->pixels->t.data + (size_t)n * pixels * READ,
                  .squares = to->squares->t.data + (size_t)n * pixels * READ});
    memcpy(maps, m.maps, pixels * MAP_CHANNELS * sizeof *maps);
    ts_arena_release(arena, mark);
    return true;
}

static ag_value *two(ag_tape *tape, const nn_model *model, const nn_layer layer[2], ag_value *x)
{
    for (int i = 0; i < 2; i++) x = nn_conv(tape, model, layer[i], x, 1, TS_PAD_ZERO, NN_LEAK_G);
    return x;
}

/* Features of squares: [n, g_size, g_size, revise_width]. */
static ag_value *see(ag_tape *tape, const nn_model *model, ag_value *seen)
{
    const nn_reviser *h = &((const nn_layers *)model->layers)->revise;
    ag_value *skip[NN_REVISE_LEVELS], *x = two(tape, model, h->read, seen);
    for (int i = 0; i < NN_REVISE_LEVELS; i++) {
        skip[i] = x;
        x = two(tape, model, h->down[i], ag_max_pool(tape, x));
    }
    x = ag_add_leaky(tape, x, nn_linear(tape, model, h->global, ag_channel_mean(tape, x)), NN_LEAK_G);
    for (int i = NN_REVISE_LEVELS; i-- > 0;)
        x = two(tape, model, h->up[i], ag_concat(tape, skip[i], ag_upsample(tape, x)));
    return x;
}

static bool fits(ag_tape *tape, const nn_model *model, const nn_revision *r)
{
    const int side = nn_arch_side(&model->arch);
    if (ag_status(tape)->code || !r->maps || !r->spread) return false;
    if (model->arch.revisions == 0) ag_fail(tape, TS_INVALID, "the model has no h that revises maps");
    else if (r->given < 2 || r->given > NN_MAX_IMAGES)
        ag_fail(tape, TS_INVALID, "%d photographs are given: a revision is of 2 to %d", r->given, NN_MAX_IMAGES);
    else if (r->image.shape.h != side || r->maps->t.shape.h != side || r->maps->t.shape.c != MAP_CHANNELS)
        ag_fail(tape, TS_INVALID, "revisions are of %d x %d pixels, not %d", side, side, r->image.shape.h);
    return !ag_status(tape)->code;
}

/* A metal's diffuse, a dielectric's F0: h, which does not know of kinds, does not move them. */
static void hold_kind(const nn_revision *r, ag_value *maps)
{
    const int first = r->kind == NN_KIND_METAL ? MAP_DIFFUSE : MAP_SPECULAR;
    const int64_t pixels = ts_count(maps->t.shape) / MAP_CHANNELS;
    for (int64_t i = 0; i < pixels; i++)
        memcpy(maps->t.data + i * MAP_CHANNELS + first, r->maps->t.data + i * MAP_CHANNELS + first, 3 * sizeof(float));
}

bool nn_revise(ag_tape *tape, const nn_model *model, nn_revision *r)
{
    if (!fits(tape, model, r)) return false;
    const nn_reviser *h = &((const nn_layers *)model->layers)->revise;
    const ts_shape s = r->maps->t.shape;
    const int size = model->arch.g_size, per = s.h / size;
    const size_t values = (size_t)s.h * (size_t)s.w * MAP_CHANNELS;
    const ts_mark mark = ag_scope_begin(tape);
    ag_value *found = ag_empty(tape, s);
    const reading read = {ag_empty(tape, (ts_shape){s.n, s.h, s.w, READ}),
                          ag_empty(tape, (ts_shape){s.n, size, size, per * per * READ})};
    if (!found || !read.pixels || !read.squares) return false;
    for (int n = 0; n < s.n; n++)
        if (!read_one(tape, model, r, n, &read, found->t.data + (size_t)n * values)) return false;
    const ts_mark inner = ag_scope_begin(tape);
    ag_value *y = see(tape, model, read.squares);
    ag_scope_end(tape, inner, &y, 1);
    y = ag_depth_to_space(tape, nn_conv(tape, model, h->squares, y, 1, TS_PAD_ZERO, NN_LEAK_G), per);
    y = nn_conv_with_constants(tape, model, h->full[0], y, read.pixels, 1, TS_PAD_REPLICATE, NN_LEAK_G);
    y = nn_conv(tape, model, h->full[1], y, 1, TS_PAD_REPLICATE, NN_LEAK_G);
    y = nn_conv(tape, model, h->full[2], y, 1, TS_PAD_REPLICATE, 1);
    ag_value *keep[2] = {ag_add(tape, found, ag_channels(tape, y, 0, MAP_CHANNELS)),
                         ag_add(tape, r->spread, ag_channels(tape, y, MAP_CHANNELS, NN_SPREADS))};
    if (ag_status(tape)->code) return false;
    if (r->kind != NN_KIND_UNKNOWN) hold_kind(r, keep[0]);
    ag_scope_end(tape, mark, keep, 2);
    r->maps = keep[0], r->spread = keep[1], r->made++;
    return true;
}

/* Counted as above, in floats a pixel of the full size. */
double nn_revision_bytes(const nn_arch *a, int photographs)
{
    const double squares = (double)a->g_unshuffle * a->g_unshuffle, w = a->revise_width,
                 held = 3.0 * photographs + 2 * READ + MAP_CHANNELS + a->revisions * (MAP_CHANNELS + NN_SPREADS),
                 seeing = 20 * w / squares,
                 writing = w / squares + 2 * 12 + READ + 3 * NN_REVISION_FINE + 3 * (MAP_CHANNELS + NN_SPREADS);
    const double most = fmax(ROOM, fmax(seeing, writing)), side = nn_arch_side(a);
    return side * side * sizeof(float) * (held + most);
}
