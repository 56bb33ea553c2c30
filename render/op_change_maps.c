/* y = maps x changed by c and by levels l of the whole image, with v(x) = max((x + 1) / 2, LEAST), enc(v) = 2 v - 1:
 *     diffuse    enc(min(v e^a, 1)),  a = DIFFUSE (c_0 + c_1 + c_2) / 3: the hue stays
 *     normal     x + c
 *     roughness  enc(min(v e^b, 1)),  b = ROUGHNESS l_0
 *     F0         enc(min(v e^b, 1)),  b = F0 (l_1 + l_2 + l_3) / 3
 * and d enc / da = 2 v e^a, d enc / dx = e^a, both 0 where the value ends at 1, the latter also below LEAST.
 * x: [N,H,W,9], c: [N,H,W,9], of which roughness and F0 are not read, l: [N,1,1,4], y: [N,H,W,9] */
#include "autograd/gradcheck.h"
#include "autograd/op.h"
#include "render/losses.h"
#include "tensor/maps.h"
#include <math.h>
#include <string.h>

extern const ag_op op_change_maps;

#define DIFFUSE 2.0f /* what adds as much to an albedo of 1/4 as to a normal */
#define ROUGHNESS 1.25f
#define F0 4.0f
#define LEAST 0.004f /* one step of 8 bits */

static float mean_of(const float *v) { return (v[0] + v[1] + v[2]) / 3; }
enum { LEVELS = MAP_CHANNELS - MAP_ROUGHNESS };

static float value(float x) { return fmaxf((x + 1) / 2, LEAST); }

/* enc of a value times a factor, and whether it is not cut. */
static float scaled(float x, float factor, bool *inside)
{
    const float v = value(x) * factor;
    *inside = v < 1;
    return *inside ? 2 * v - 1 : 1;
}

static void forward_rows(const void *job, int64_t begin, int64_t end)
{
    const ag_node *node = job;
    const ts_shape s = node->out->t.shape;
    for (int64_t p = begin * s.w; p < end * s.w; p++) {
        const float *x = node->in[0]->t.data + p * MAP_CHANNELS, *c = node->in[1]->t.data + p * MAP_CHANNELS,
                    *l = node->in[2]->t.data + p / ((int64_t)s.h * s.w) * LEVELS;
        const float a = expf(DIFFUSE * mean_of(c)), b = expf(F0 * mean_of(l + 1));
        float *y = node->out->t.data + p * MAP_CHANNELS;
        bool inside;
        for (int k = 0; k < 3; k++) {
            y[MAP_DIFFUSE + k] = scaled(x[MAP_DIFFUSE + k], a, &inside);
            y[MAP_SPECULAR + k] = scaled(x[MAP_SPECULAR + k], b, &inside);
        }
        y[MAP_ROUGHNESS] = scaled(x[MAP_ROUGHNESS], expf(ROUGHNESS * l[0]), &inside);
        for (int k = MAP_NORMAL; k < MAP_ROUGHNESS; k++) y[k] = x[k] + c[k];
    }
}

static void forward(ag_tape *tape, ag_node *node)
{
    const ts_shape s = node->out->t.shape;
    ts_for(ag_threads(tape), (int64_t)s.n * s.h, 4, forward_rows, node);
}

typedef struct gradients {
    const ag_node *node;
    float *dx, *dc;
    bool add_x, add_c;
    double (*db)[2]; /* of each row: the gradients by the logarithms of its image's two factors */
} gradients;

/* One value: adds to the gradient by the factor's logarithm, and to that by x. */
static void by_factor(float x, float factor, float dy, double *dlog, float *dx)
{
    bool inside;
    const float v = scaled(x, factor, &inside);
    if (!inside) return;
    *dlog += (double)(dy * (v + 1));
    if (dx && (x + 1) / 2 > LEAST) *dx += dy * factor;
}

static void backward_rows(const void *job, int64_t begin, int64_t end)
{
    const gradients *g = job;
    const ag_node *node = g->node;
    const ts_shape s = node->out->t.shape;
    for (int64_t row = begin; row < end; row++) {
        double db[2] = {0};
        for (int64_t p = row * s.w; p < (row + 1) * s.w; p++) {
            const float *x = node->in[0]->t.data + p * MAP_CHANNELS, *c = node->in[1]->t.data + p * MAP_CHANNELS,
                        *l = node->in[2]->t.data + p / ((int64_t)s.h * s.w) * LEVELS,
                        *dy = node->out->grad + p * MAP_CHANNELS;
            const float a = expf(DIFFUSE * mean_of(c)), b = expf(F0 * mean_of(l + 1)), r = expf(ROUGHNESS * l[0]);
            float *dx = g->dx ? g->dx + p * MAP_CHANNELS : NULL, *dc = g->dc ? g->dc + p * MAP_CHANNELS : NULL;
            double da = 0;
            if (dx && !g->add_x) memset(dx, 0, MAP_CHANNELS * sizeof *dx);
            if (dc && !g->add_c) memset(dc, 0, MAP_CHANNELS * sizeof *dc);
            for (int k = 0; k < 3; k++) {
                const int d = MAP_DIFFUSE + k, f = MAP_SPECULAR + k;
                by_factor(x[d], a, dy[d], &da, dx ? &dx[d] : NULL);
                by_factor(x[f], b, dy[f], &db[1], dx ? &dx[f] : NULL);
            }
            by_factor(x[MAP_ROUGHNESS], r, dy[MAP_ROUGHNESS], &db[0], dx ? &dx[MAP_ROUGHNESS] : NULL);
            for (int k = 0; k < 3 && dc; k++) dc[MAP_DIFFUSE + k] += (float)da * (DIFFUSE / 3);
            for (int k = MAP_NORMAL; k < MAP_ROUGHNESS; k++) {
                if (dx) dx[k] += dy[k];
                if (dc) dc[k] += dy[k];
            }
        }
        memcpy(g->db[row], db, sizeof db);
    }
}

static void backward(ag_tape *tape, ag_node *node)
{
    const ts_shape s = node->out->t.shape;
    gradients g = {.node = node};
    g.dx = ag_grad_target(tape, node->in[0], &g.add_x);
    g.dc = ag_grad_target(tape, node->in[1], &g.add_c);
    float *dl = ag_grad_add(tape, node->in[2]);
    const ts_mark mark = ts_arena_mark(ag_arena(tape));
    g.db = ts_arena_alloc(ag_arena(tape), (size_t)s.n * (size_t)s.h * sizeof *g.db);
    if (!g.db) {
        ag_fail(tape, TS_NOMEM, "no memory for the gradient of a change of maps");
        return;
    }
    ts_for(ag_threads(tape), (int64_t)s.n * s.h, 4, backward_rows, &g);
    for (int n = 0; n < s.n && dl; n++) {
        double sum[2] = {0};
        for (int y = 0; y < 2 * s.h; y++) sum[y % 2] += g.db[(size_t)n * (size_t)s.h + (size_t)(y / 2)][y % 2];
        for (int k = 0; k < LEVELS; k++)
            dl[LEVELS * n + k] += k == 0 ? (float)sum[0] * ROUGHNESS : (float)sum[1] * (F0 / 3);
    }
    ts_arena_release(ag_arena(tape), mark);
}

static double reference_value(double x, double log_factor)
{
    const double v = fmax((x + 1) / 2, (double)LEAST) * exp(log_factor);
    return v < 1 ? 2 * v - 1 : 1;
}

static void reference(const ag_node *node, const double *const *in, double *out)
{
    const ts_shape s = node->out->t.shape;
    for (int64_t p = 0; p < ts_pixels(s); p++) {
        const double *x = in[0] + p * MAP_CHANNELS, *c = in[1] + p * MAP_CHANNELS,
                     *l = in[2] + p / ((int64_t)s.h * s.w) * LEVELS;
        const double a = (double)DIFFUSE * (c[0] + c[1] + c[2]) / 3, b = (double)F0 * (l[1] + l[2] + l[3]) / 3;
        for (int k = 0; k < MAP_CHANNELS; k++)
            out[p * MAP_CHANNELS + k] = k < MAP_NORMAL ? reference_value(x[k], a)
                : k < MAP_ROUGHNESS                    ? x[k] + c[k]
                : k == MAP_ROUGHNESS                   ? reference_value(x[k], (double)ROUGHNESS * l[0])
                                                       : reference_value(x[k], b);
    }
}

static ag_value *build(ag_tape *tape, ag_value *const *in, const void *user)
{
    (void)user;
    return ag_change_maps(tape, in[0], in[1], in[2]);
}

/* Of four pixels the first ends at 1 in every value that a factor changes, the second has no diffuse. */
static void at_the_ends(float *const *in, const void *user)
{
    (void)user;
    for (int k = 0; k < 3; k++) {
        in[0][MAP_DIFFUSE + k] = in[1][MAP_DIFFUSE + k] = 0.9f;
        in[0][MAP_CHANNELS + MAP_DIFFUSE + k] = -1;
        for (int p = 0; p < 4; p++) in[0][p * MAP_CHANNELS + MAP_SPECULAR + k] = p ? -0.5f : 0.9f;
    }
    in[0][MAP_ROUGHNESS] = 0.95f;
    for (int k = 0; k < LEVELS; k++) in[2][k] = 0.2f;
}

static void cases(ag_gradcheck *check)
{
    static const ts_shape shapes[] = {{1, 1, 1, 9}, {2, 5, 3, 9}, {1, 9, 8, 9}, {1, 2, 2, 9}};
    static const char *const labels[] = {"one pixel", "two images", "an image", "ends"};
    for (size_t i = 0; i < sizeof shapes / sizeof *shapes; i++) {
        ag_case c = {.label = labels[i],
                     .inputs = 3,
                     .shape = {shapes[i], shapes[i], {shapes[i].n, 1, 1, LEVELS}},
                     .lo = -0.6f,
                     .hi = 0.2f, /* nothing ends at 1 by chance */
                     .prepare = i == 3 ? at_the_ends : NULL,
                     .build = build};
        ag_gradcheck_run(check, &c);
    }
}

const ag_op op_change_maps = {
    .name = "change_maps", .forward = forward, .backward = backward, .reference = reference, .cases = cases};

ag_value *ag_change_maps(ag_tape *tape, ag_value *maps, ag_value *change, ag_value *level)
{
    ag_value *const in[3] = {maps, change, level};
    char text[AG_SHAPE_TEXT];
    if (!ag_ready(tape, "change_maps", 3, in)) return NULL;
    const ts_shape s = maps->t.shape;
    if (s.c != MAP_CHANNELS || !ts_same(s, change->t.shape) || !ts_same(level->t.shape, (ts_shape){s.n, 1, 1, LEVELS}))
        return ag_fail(tape, TS_INVALID, "change_maps: %s is not [N,H,W,9] with a change of that shape and four levels",
                       ag_shape_text(text, s));
    return ag_apply(tape, &op_change_maps, 3, in, s, NULL, 0);
}
