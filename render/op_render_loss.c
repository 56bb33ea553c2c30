/* Mean |log(a + 0.01) - log(b + 0.01)| over the renderings a of maps and b of target (render/losses.h). Rendering, loss
 * and gradient are one pass over the pixels, in forward; backward only multiplies. */
#include "autograd/gradcheck.h"
#include "autograd/op.h"
#include "render/brdf.h"
#include "render/kernels/shade.h"
#include "render/losses.h"
#include "render/rows.h"
#include <math.h>
#include <string.h>

extern const ag_op op_render_loss;

typedef struct attributes {
    const rd_view *views;
    int per_image;
} attributes;

ag_value *ag_render_loss(ag_tape *tape, ag_value *maps, ag_value *target, const rd_view *views, int views_per_image)
{
    ag_value *in[2] = {maps, target};
    if (!ag_ready(tape, "render_loss", 2, in)) return NULL;
    ts_shape s = maps->t.shape;
    char text[2][AG_SHAPE_TEXT];
    if (s.h != s.w || s.c != MAP_CHANNELS || !ts_same(s, target->t.shape))
        return ag_fail(tape, TS_INVALID, "render_loss: maps %s and target %s must both be [N,S,S,9]",
                       ag_shape_text(text[0], s), ag_shape_text(text[1], target->t.shape));
    if (views_per_image < 1)
        return ag_fail(tape, TS_INVALID, "render_loss: %d views for each image, at least one is needed",
                       views_per_image);
    if (target->needs_grad) return ag_fail(tape, TS_INVALID, "render_loss: target has no gradient here; detach it");
    size_t bytes = (size_t)s.n * (size_t)views_per_image * sizeof *views;
    rd_view *copy = ts_arena_alloc(ag_arena(tape), bytes);
    if (!copy) return ag_fail(tape, TS_NOMEM, "render_loss: no memory for %zu bytes of views", bytes);
    memcpy(copy, views, bytes);
    attributes attr = {copy, views_per_image};
    return ag_apply(tape, &op_render_loss, 2, in, (ts_shape){1, 1, 1, 1}, &attr, sizeof attr);
}

typedef struct loss_job {
    const ag_node *node;
    const ts_shade_view *views;
    float mean, *gradient;
    double *sums;
} loss_job;

static void loss_of_rows(const void *job, int64_t begin, int64_t end)
{
    const loss_job *j = job;
    const ts_tensor *maps = &j->node->in[0]->t, *target = &j->node->in[1]->t;
    const ts_shape s = maps->shape;
    const rd_grid grid = rd_grid_full(s.h);
    const int per_image = ((const attributes *)j->node->attr)->per_image;
    for (int64_t i = begin; i < end; i++) {
        const int64_t image = i / s.h, at = image * s.h * s.w * s.c;
        const int y = (int)(i % s.h);
        const ts_shade_row a = rd_shade_row(grid, y, maps->data + at, s.c),
                           b = rd_shade_row(grid, y, target->data + at, s.c);
        j->sums[i] = ts_shade_k()->log_loss(j->views + image * per_image, per_image, &a, &b, j->mean,
                                            j->gradient ? j->gradient + i * s.w * s.c : NULL);
    }
}

static void forward(ag_tape *tape, ag_node *node)
{
    const attributes *attr = node->attr;
    ts_shape s = node->in[0]->t.shape;
    int per_image = attr->per_image, rows = s.n * s.h;
    size_t count = (size_t)ts_count(s);
    double *sums = ts_arena_alloc(ag_arena(tape), (size_t)rows * sizeof *sums);
    ts_shade_view *views = ts_arena_alloc(ag_arena(tape), (size_t)s.n * (size_t)per_image * sizeof *views);
    float *gradient = node->out->needs_grad ? ts_arena_alloc(ag_arena(tape), count * sizeof *gradient) : NULL;
    if (!sums || !views || (node->out->needs_grad && !gradient)) {
        ag_fail(tape, TS_NOMEM, "render_loss: no memory for the gradient of %zu values", count);
        return;
    }
    for (int i = 0; i < s.n * per_image; i++) views[i] = rd_shade_view(&attr->views[i]);
    double mean = 1 / (3.0 * s.n * s.h * s.w * per_image);
    ts_for(ag_threads(tape), rows, 1, loss_of_rows, &(loss_job){node, views, (float)mean, gradient, sums});
    double sum = 0;
    for (int i = 0; i < rows; i++) sum += sums[i];
    node->out->t.data[0] = (float)(sum * mean);
    node->saved = gradient;
}

static void backward_range(const void *job, int64_t begin, int64_t end)
{
    const ag_back *b = job;
    const float up = b->node->out->grad[0], *from = b->node->saved;
    for (int64_t i = begin; i < end; i++) b->dx[i] = b->accumulate ? b->dx[i] + up * from[i] : up * from[i];
}

static void backward(ag_tape *tape, ag_node *node)
{
    ag_back b = {.node = node};
    b.dx = ag_grad_target(tape, node->in[0], &b.accumulate);
    if (b.dx) ts_for(ag_threads(tape), ts_count(node->in[0]->t.shape), AG_CHUNK, backward_range, &b);
}

static void reference(const ag_node *node, const double *const *in, double *out)
{
    const attributes *attr = node->attr;
    ts_shape s = node->in[0]->t.shape;
    rd_grid grid = rd_grid_full(s.h);
    double sum = 0;
    for (int64_t i = 0; i < ts_pixels(s); i++)
        for (int j = 0; j < attr->per_image; j++) {
            const rd_view *view = &attr->views[i / (s.h * s.w) * attr->per_image + j];
            double point[2], a[3], b[3];
            rd_centre(grid, (int)(i % s.w), (int)(i / s.w % s.h), point);
            rd_radiance(in[0] + i * s.c, point, view, a, NULL);
            rd_radiance(in[1] + i * s.c, point, view, b, NULL);
            for (int c = 0; c < 3; c++) sum += fabs(log(a[c] + 0.01) - log(b[c] + 0.01));
        }
    out[0] = sum / (3.0 * (double)ts_pixels(s) * attr->per_image);
}

typedef struct check {
    ts_shape shape;
    rd_view *views;
    int per_image;
    float tilt;   /* normals are scaled by this */
    float spread; /* everything is scaled by this, so that values beyond +-1 occur */
} check;

/* The side of every kink that a pixel is on: clamps, the normal's guard, what is seen, and the sign of a - b. */
static uint64_t sides(const double *maps, const double *target, const double point[2], const rd_view *views, int count)
{
    rd_surface s;
    rd_decode_double(maps, &s);
    uint64_t bits = 14695981039346656037u; /* FNV-1a over the sides */
    double z2 = 1 - maps[MAP_NORMAL] * maps[MAP_NORMAL] - maps[MAP_NORMAL + 1] * maps[MAP_NORMAL + 1];
#define SIDE(b) (bits = (bits ^ (uint64_t)(b)) * 1099511628211u)
    SIDE(z2 < rd_guards.nz2);
    for (int i = 0; i < MAP_CHANNELS; i++) SIDE(s.slope[i] > 0);
    for (int j = 0; j < count; j++) {
        double a[3], b[3], l[3], v[3];
        rd_light(&views[j], point, l, v);
        SIDE(s.n[0] * l[0] + s.n[1] * l[1] + s.n[2] * l[2] > 0);
        SIDE(s.n[0] * v[0] + s.n[1] * v[1] + s.n[2] * v[2] > 0);
        rd_radiance(maps, point, &views[j], a, NULL);
        rd_radiance(target, point, &views[j], b, NULL);
        for (int c = 0; c < 3; c++) SIDE(a[c] > b[c] ? 2 : a[c] == b[c]);
    }
#undef SIDE
    return bits;
}

static bool kink(const double *const *in, int input, int64_t i, double step, const void *user)
{
    const check *k = user;
    int64_t pixel = i / MAP_CHANNELS, per = (int64_t)k->shape.h * k->shape.w;
    const rd_view *views = k->views + pixel / per * k->per_image;
    double point[2], x[MAP_CHANNELS];
    rd_centre(rd_grid_full(k->shape.h), (int)(pixel % k->shape.w), (int)(pixel / k->shape.w % k->shape.h), point);
    if (input != 0) return true;
    uint64_t side[3];
    for (int t = 0; t < 3; t++) {
        memcpy(x, in[0] + pixel * MAP_CHANNELS, sizeof x);
        x[i % MAP_CHANNELS] += (t - 1) * step;
        side[t] = sides(x, in[1] + pixel * MAP_CHANNELS, point, views, k->per_image);
    }
    /* within a step of the guard n_z changes faster than any finite step resolves */
    double nx = x[MAP_NORMAL], ny = x[MAP_NORMAL + 1], z2 = 1 - nx * nx - ny * ny;
    bool edge = (i % MAP_CHANNELS == MAP_NORMAL || i % MAP_CHANNELS == MAP_NORMAL + 1) && fabs(z2) < 0.01;
    return edge || side[0] != side[1] || side[1] != side[2];
}

static void prepare(float *const *in, const void *user)
{
    const check *k = user;
    for (int64_t i = 0; i < ts_count(k->shape); i++)
        for (int j = 0; j < 2; j++) {
            int c = (int)(i % MAP_CHANNELS);
            in[j][i] *= k->spread * (c == MAP_NORMAL || c == MAP_NORMAL + 1 ? k->tilt : 1);
            /* a highlight narrower than this is not linear over a difference's step */
            if (c == MAP_ROUGHNESS && in[j][i] < -0.6f && in[j][i] > -1) in[j][i] = -0.6f;
        }
}

static ag_value *build(ag_tape *tape, ag_value *const *in, const void *user)
{
    const check *k = user;
    return ag_render_loss(tape, in[0], in[1], k->views, k->per_image);
}

static void cases(ag_gradcheck *g)
{
    static const struct {
        const char *label;
        ts_shape shape;
        float tilt, spread;
    } list[] = {
        {"flat 3x3", {1, 3, 3, 9}, 0.3f, 0.95f},
        {"steep 2x5x5", {2, 5, 5, 9}, 0.75f, 0.95f},
        {"beyond the range 2x4x4", {2, 4, 4, 9}, 1, 1.3f},
        {"one pixel", {1, 1, 1, 9}, 0.5f, 0.9f},
        {"wider than a vector 1x17x17", {1, 17, 17, 9}, 0.5f, 0.9f},
    };
    for (size_t i = 0; i < sizeof list / sizeof *list; i++) {
        rd_view views[2 * (RD_LOSS_VIEWS + 1)];
        check k = {.shape = list[i].shape,
                   .views = views,
                   .per_image = RD_LOSS_VIEWS + 1,
                   .tilt = list[i].tilt,
                   .spread = list[i].spread};
        for (int n = 0; n < k.shape.n; n++) {
            rd_loss_views(ag_gradcheck_rng(g), views + n * k.per_image);
            views[n * k.per_image + RD_LOSS_VIEWS] = rd_flash();
            views[n * k.per_image + RD_LOSS_VIEWS].ambient = n ? 0.1f : 0;
        }
        ag_case c = {.label = list[i].label,
                     .inputs = 2,
                     .shape = {k.shape, k.shape},
                     .fixed = {false, true},
                     .lo = -1,
                     .hi = 1,
                     .kink = kink,
                     .prepare = prepare,
                     .build = build,
                     .user = &k};
        if (ag_gradcheck_run(g, &c) != TS_OK) return;
    }
}

const ag_op op_render_loss = {
    .name = "render_loss", .forward = forward, .backward = backward, .reference = reference, .cases = cases};
