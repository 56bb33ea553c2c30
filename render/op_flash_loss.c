/* The reconstruction error as an op (render/losses.h), for the compared methods that optimise weights or codes. */
#include "autograd/gradcheck.h"
#include "autograd/op.h"
#include "render/brdf.h"
#include "render/losses.h"
#include "render/render.h"
#include <math.h>
#include <string.h>

extern const ag_op op_flash_loss;

ag_value *ag_flash_loss(ag_tape *tape, ag_value *maps, ag_value *image, const rd_view *view)
{
    ag_value *in[2] = {maps, image};
    if (!ag_ready(tape, "flash_loss", 2, in)) return NULL;
    const ts_shape s = maps->t.shape;
    char text[2][AG_SHAPE_TEXT];
    if (s.h != s.w || s.c < MAP_CHANNELS || !ts_same(image->t.shape, (ts_shape){s.n, s.h, s.w, 3}))
        return ag_fail(tape, TS_INVALID,
                       "flash_loss: maps %s must be [N,S,S,9] or more and the photographs %s [N,S,S,3]",
                       ag_shape_text(text[0], s), ag_shape_text(text[1], image->t.shape));
    if (image->needs_grad)
        return ag_fail(tape, TS_INVALID, "flash_loss: the photographs have no gradient here; detach them");
    return ag_apply(tape, &op_flash_loss, 2, in, (ts_shape){1, 1, 1, 1}, view, sizeof *view);
}

static void forward(ag_tape *tape, ag_node *node)
{
    const ts_tensor *maps = &node->in[0]->t, *image = &node->in[1]->t;
    const ts_shape s = maps->shape;
    double *rmse = ts_arena_alloc(ag_arena(tape), (size_t)s.n * sizeof *rmse), sum = 0;
    if (!rmse) {
        ag_fail(tape, TS_NOMEM, "flash_loss: no memory for %d losses", s.n);
        return;
    }
    for (int n = 0; n < s.n; n++) {
        rd_flash_rmse(rd_grid_on(rd_grid_full(s.h), ag_threads(tape)), maps->data + n * maps->stride_n, s.c, node->attr,
                      image->data + n * image->stride_n, &rmse[n]);
        sum += rmse[n];
    }
    node->out->t.data[0] = (float)(sum / s.n);
    node->saved = rmse;
}

typedef struct sum_job {
    const float *gradient;
    float scale, *sum;
} sum_job;

static void add_range(const void *job, int64_t begin, int64_t end)
{
    const sum_job *j = job;
    for (int64_t i = begin; i < end; i++) j->sum[i] += j->scale * j->gradient[i];
}

static void backward(ag_tape *tape, ag_node *node)
{
    const ts_tensor *maps = &node->in[0]->t, *image = &node->in[1]->t;
    const ts_shape s = maps->shape;
    const int64_t count = maps->stride_n;
    const double *rmse = node->saved;
    float *gradient = ts_arena_alloc(ag_arena(tape), (size_t)count * sizeof *gradient);
    if (!gradient) {
        ag_fail(tape, TS_NOMEM, "flash_loss: no memory for the gradient of %lld values", (long long)count);
        return;
    }
    float *to = ag_grad_add(tape, node->in[0]);
    if (!to) return;
    /* rd_flash_gradient's scale is that of 1e5 RMSE at 256 x 256. */
    const float scale = (float)((double)node->out->grad[0] / s.n * 256.0 * 256.0 / (1e5 * s.h * s.w));
    for (int n = 0; n < s.n; n++) {
        rd_flash_gradient(rd_grid_on(rd_grid_full(s.h), ag_threads(tape)), maps->data + n * count, s.c, node->attr,
                          image->data + n * image->stride_n, rmse[n], gradient, NULL);
        ts_for(ag_threads(tape), count, AG_CHUNK, add_range, &(sum_job){gradient, scale, to + n * count});
    }
}

static void reference(const ag_node *node, const double *const *in, double *out)
{
    const ts_shape s = node->in[0]->t.shape;
    const rd_grid grid = rd_grid_full(s.h);
    out[0] = 0;
    for (int n = 0; n < s.n; n++) {
        double sum = 0;
        for (int64_t i = 0; i < (int64_t)s.h * s.w; i++) {
            const int64_t at = (int64_t)n * s.h * s.w + i;
            double point[2], radiance[3];
            rd_centre(grid, (int)(i % s.w), (int)(i / s.w), point);
            rd_radiance(in[0] + at * s.c, point, node->attr, radiance, NULL);
            for (int c = 0; c < 3; c++) {
                const double d = fmin(radiance[c], 1) - in[1][at * 3 + c];
                sum += d * d;
            }
        }
        out[0] += sqrt(sum / (3.0 * s.h * s.w)) / s.n;
    }
}

/* The sides of the clamps that a pixel is on: of each map, of the normal, of the rendering. */
static bool kink(const double *const *in, int input, int64_t i, double step, const void *user)
{
    const ts_shape s = *(const ts_shape *)user;
    const rd_view flash = rd_flash();
    if (input != 0) return true;
    const int64_t pixel = i / s.c, m = i % s.c;
    double point[2], x[MAP_CHANNELS];
    unsigned side[3];
    if (m >= MAP_CHANNELS) return false;
    rd_centre(rd_grid_full(s.h), (int)(pixel % s.w), (int)(pixel / s.w % s.h), point);
    for (int t = 0; t < 3; t++) {
        double radiance[3];
        rd_surface surface;
        memcpy(x, in[0] + pixel * s.c, sizeof x);
        x[m] += (t - 1) * step;
        rd_decode_double(x, &surface);
        rd_radiance(x, point, &flash, radiance, NULL);
        side[t] = surface.slope[m] > 0;
        for (int c = 0; c < 3; c++) side[t] = 3 * side[t] + (radiance[c] < 1) + (radiance[c] > 0);
    }
    const double nx = x[MAP_NORMAL], ny = x[MAP_NORMAL + 1];
    return side[0] != side[1] || side[1] != side[2] ||
        ((m == MAP_NORMAL || m == MAP_NORMAL + 1) && fabs(1 - nx * nx - ny * ny) < 0.01);
}

static void prepare(float *const *in, const void *user)
{
    const ts_shape s = *(const ts_shape *)user;
    for (int64_t i = 0; i < ts_count(s); i++) {
        const int64_t m = i % s.c;
        if (m == MAP_NORMAL || m == MAP_NORMAL + 1) in[0][i] *= 0.5f;
        if (m == MAP_ROUGHNESS && in[0][i] < -0.6f)
            in[0][i] = -0.6f; /* a narrower highlight is not linear over a difference's step */
    }
}

static ag_value *build(ag_tape *tape, ag_value *const *in, const void *user)
{
    const rd_view flash = rd_flash();
    (void)user;
    return ag_flash_loss(tape, in[0], in[1], &flash);
}

static void cases(ag_gradcheck *g)
{
    static const ts_shape shapes[] = {{1, 1, 1, 9}, {2, 5, 5, 9}, {1, 17, 17, 9}, {2, 4, 4, 10}};
    for (size_t i = 0; i < sizeof shapes / sizeof *shapes; i++) {
        const ts_shape s = shapes[i];
        ag_case c = {.label = s.h == 1 ? "one pixel"
                         : s.c == 10   ? "ten channels"
                                       : "images",
                     .inputs = 2,
                     .shape = {s, {s.n, s.h, s.w, 3}},
                     .fixed = {false, true},
                     .lo = -0.95f,
                     .hi = 0.95f,
                     .kink = kink,
                     .prepare = prepare,
                     .build = build,
                     .user = &shapes[i]};
        if (ag_gradcheck_run(g, &c) != TS_OK) return;
    }
}

const ag_op op_flash_loss = {
    .name = "flash_loss", .forward = forward, .backward = backward, .reference = reference, .cases = cases};
