/* y = the photograph of maps in the scene of some numbers (render/scene_model.h has the equations and derivatives). */
#include "autograd/gradcheck.h"
#include "autograd/op.h"
#include "render/brdf.h"
#include "render/rows.h"
#include "render/scene_model.h"
#include "tensor/scratch.h"
#include <math.h>
#include <string.h>

extern const ag_op op_scene_render;

ag_value *ag_scene_render(ag_tape *tape, ag_value *maps, ag_value *numbers, bool clamp)
{
    ag_value *in[2] = {maps, numbers};
    if (!ag_ready(tape, "scene_render", 2, in)) return NULL;
    const ts_shape s = maps->t.shape;
    char text[2][AG_SHAPE_TEXT];
    if (s.h != s.w || s.c < MAP_CHANNELS || !ts_same(numbers->t.shape, (ts_shape){s.n, 1, 1, RD_SCENE_NUMBERS}))
        return ag_fail(tape, TS_INVALID,
                       "scene_render: maps %s must be [N,S,S,9] or more and the scenes' numbers %s [N,1,1,%d]",
                       ag_shape_text(text[0], s), ag_shape_text(text[1], numbers->t.shape), RD_SCENE_NUMBERS);
    return ag_apply(tape, &op_scene_render, 2, in, (ts_shape){s.n, s.h, s.w, 3}, &clamp, sizeof clamp);
}

static void forward(ag_tape *tape, ag_node *node)
{
    const ts_tensor *maps = &node->in[0]->t, *out = &node->out->t;
    const rd_grid grid = rd_grid_on(rd_grid_full(maps->shape.h), ag_threads(tape));
    for (int n = 0; n < maps->shape.n; n++)
        rd_scene_photograph(grid, maps->data + n * maps->stride_n, maps->shape.c,
                            node->in[1]->t.data + n * RD_SCENE_NUMBERS, *(const bool *)node->attr,
                            out->data + n * out->stride_n);
}

typedef struct backward_job {
    const ag_node *node;
    int n;
    ts_scene scene;
    double *sums; /* [rows][RD_SCENE_NUMBERS] */
    float *to;    /* NULL, or the gradient of image n's maps */
} backward_job;

static void backward_rows(const void *job, int64_t begin, int64_t end)
{
    const backward_job *j = job;
    const ts_tensor *maps = &j->node->in[0]->t;
    const ts_shape s = maps->shape;
    const float limit = *(const bool *)j->node->attr ? 1.0f : INFINITY;
    const size_t count = (size_t)s.w * (size_t)s.c;
    for (int64_t y = begin; y < end; y++) {
        const ts_shade_row row = rd_shade_row(rd_grid_full(s.h), (int)y, maps->data + j->n * maps->stride_n, s.c);
        float *gradient = j->to ? ts_scratch(0, count * sizeof *gradient) : NULL;
        ts_scene_k()->backward(&j->scene, &row, limit, j->node->out->grad + ((int64_t)j->n * s.h + y) * s.w * 3,
                               j->sums + y * RD_SCENE_NUMBERS, gradient);
        for (size_t i = 0; j->to && i < count; i++) j->to[(size_t)y * count + i] += gradient[i];
    }
}

/* A sum a row, added in order: the same for any number of threads. */
static void backward(ag_tape *tape, ag_node *node)
{
    const ts_tensor *maps = &node->in[0]->t;
    const ts_shape s = maps->shape;
    float *to = ag_grad_add(tape, node->in[0]), *by = ag_grad_add(tape, node->in[1]);
    double *sums = ts_arena_alloc(ag_arena(tape), (size_t)s.h * RD_SCENE_NUMBERS * sizeof *sums);
    if (!sums) {
        ag_fail(tape, TS_NOMEM, "scene_render: no memory for the sums of %d rows", s.h);
        return;
    }
    for (int n = 0; n < s.n; n++) {
        const backward_job job = {.node = node,
                                  .n = n,
                                  .scene = rd_scene_of(node->in[1]->t.data + n * RD_SCENE_NUMBERS),
                                  .sums = sums,
                                  .to = to ? to + n * maps->stride_n : NULL};
        memset(sums, 0, (size_t)s.h * RD_SCENE_NUMBERS * sizeof *sums);
        ts_for(ag_threads(tape), s.h, 1, backward_rows, &job);
        for (int i = 0; by && i < RD_SCENE_NUMBERS; i++) {
            double sum = 0;
            for (int y = 0; y < s.h; y++) sum += sums[y * RD_SCENE_NUMBERS + i];
            by[n * RD_SCENE_NUMBERS + i] += (float)sum;
        }
    }
}

static void reference(const ag_node *node, const double *const *in, double *out)
{
    const ts_shape s = node->in[0]->t.shape;
    const bool clamp = *(const bool *)node->attr;
    for (int64_t i = 0; i < ts_pixels(s); i++) {
        double point[2];
        rd_centre(rd_grid_full(s.h), (int)(i % s.w), (int)(i / s.w % s.h), point);
        rd_scene_value(in[0] + i * s.c, point, in[1] + i / (s.h * s.w) * RD_SCENE_NUMBERS, out + i * 3);
        for (int c = 0; c < 3 && clamp; c++) out[i * 3 + c] = fmin(out[i * 3 + c], 1);
    }
}

typedef struct check {
    ts_shape shape;
    bool clamp, fixed[2];
} check;

/* The sides of the kinks that a pixel is on: of each map's clamp, of 1, and whether it sees light and camera. */
static uint64_t sides(const double *maps, const double *number, const double point[2])
{
    rd_surface s;
    double value[3], dark[RD_SCENE_NUMBERS];
    uint64_t bits = 1;
    rd_decode_double(maps, &s);
    memcpy(dark, number, sizeof dark);
    dark[RD_SCENE_AMBIENT] = 0;
    for (int i = 0; i < MAP_CHANNELS; i++) bits = 2 * bits + (s.slope[i] > 0);
    rd_scene_value(maps, point, number, value);
    for (int c = 0; c < 3; c++) bits = 2 * bits + (value[c] < 1);
    rd_scene_value(maps, point, dark, value);
    for (int c = 0; c < 3; c++) bits = 2 * bits + (value[c] > 0);
    return bits;
}

static bool kink(const double *const *in, int input, int64_t i, double step, const void *user)
{
    const check *k = user;
    const ts_shape s = k->shape;
    const int64_t pixels = (int64_t)s.h * s.w, first = input ? i / RD_SCENE_NUMBERS * pixels : i / s.c,
                  last = input ? first + pixels : first + 1;
    for (int64_t p = first; p < last; p++) {
        double point[2], maps[MAP_CHANNELS], number[RD_SCENE_NUMBERS];
        uint64_t side[3];
        rd_centre(rd_grid_full(s.h), (int)(p % s.w), (int)(p / s.w % s.h), point);
        for (int t = 0; t < 3; t++) {
            memcpy(maps, in[0] + p * s.c, sizeof maps);
            memcpy(number, in[1] + p / pixels * RD_SCENE_NUMBERS, sizeof number);
            if (input) number[i % RD_SCENE_NUMBERS] += (t - 1) * step;
            else if (i % s.c < MAP_CHANNELS) maps[i % s.c] += (t - 1) * step;
            side[t] = sides(maps, number, point);
        }
        if (side[0] != side[1] || side[1] != side[2]) return true;
    }
    return false;
}

static void prepare(float *const *in, const void *user)
{
    const check *k = user;
    for (int64_t i = 0; i < ts_count(k->shape); i++) {
        const int64_t m = i % k->shape.c;
        if (m == MAP_NORMAL || m == MAP_NORMAL + 1) in[0][i] *= 0.5f;
        if (m == MAP_ROUGHNESS && in[0][i] < -0.3f)
            in[0][i] = -0.3f; /* a narrower highlight is not linear over a difference's step */
    }
    for (int i = 0; i < k->shape.n * RD_SCENE_NUMBERS; i++) {
        if (i % RD_SCENE_NUMBERS == RD_SCENE_AMBIENT) in[1][i] = fabsf(in[1][i]) + 0.1f;
        if (i % RD_SCENE_NUMBERS == RD_SCENE_EXPOSURE && !k->clamp) in[1][i] -= 1.5f;
    }
}

static ag_value *build(ag_tape *tape, ag_value *const *in, const void *user)
{
    return ag_scene_render(tape, in[0], in[1], ((const check *)user)->clamp);
}

static void cases(ag_gradcheck *g)
{
    static const struct {
        const char *label;
        check c;
    } list[] = {
        {"one pixel", {{1, 1, 1, 9}, false, {false, false}}},
        {"images", {{2, 5, 5, 9}, false, {false, false}}},
        {"wider than a vector 1x17x17", {{1, 17, 17, 9}, false, {false, false}}},
        {"ten channels, clamped", {{2, 4, 4, 10}, true, {false, false}}},
        {"the maps fixed", {{1, 5, 5, 9}, true, {true, false}}},
        {"the scene fixed", {{1, 5, 5, 9}, false, {false, true}}},
    };
    for (size_t i = 0; i < sizeof list / sizeof *list; i++) {
        const check *k = &list[i].c;
        ag_case c = {.label = list[i].label,
                     .inputs = 2,
                     .shape = {k->shape, {k->shape.n, 1, 1, RD_SCENE_NUMBERS}},
                     .fixed = {k->fixed[0], k->fixed[1]},
                     .lo = -0.9f,
                     .hi = 0.9f,
                     .kink = kink,
                     .prepare = prepare,
                     .build = build,
                     .user = k};
        if (ag_gradcheck_run(g, &c) != TS_OK) return;
    }
}

const ag_op op_scene_render = {
    .name = "scene_render", .forward = forward, .backward = backward, .reference = reference, .cases = cases};
