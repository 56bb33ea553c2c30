/* y = mean over values of |x - t| / (u e^s) + s, the negative logarithm of Laplace's density of t about x but for a
 * constant, s being the logarithm of its scale over u, held in [-6, 4];   dx = sign(x - t) / (u e^s) / count,
 * ds = (1 - |x - t| / (u e^s)) / count, summed over the channels that share it, 0 outside of the range
 * x, t: [N,H,W,C], s: [N,H,W,G], y: [1,1,1,1] */
#include "autograd/gradcheck.h"
#include "autograd/op.h"
#include "ops.h"
#include <math.h>
#include <string.h>

#ifdef AG_API
/* How unlikely target [N,H,W,C] is where x [N,H,W,C] is expected and off by u e^spread. spread: [N,H,W,G]; group: for
 * each of the C <= 32 channels its channel of spread; x and spread may be constants, target is one. The mean over all
 * values. */
ag_value *ag_laplace(ag_tape *tape, ag_value *x, ag_value *spread, ag_value *target, const signed char *group,
                     float unit);
#endif

enum { MOST = 32 };
#define LEAST (-6.0f) /* narrower or wider than anything that is learned: keeps a first step's exponentials finite */
#define LARGEST 4.0f

typedef struct laplace_attr {
    float unit;
    signed char group[MOST];
} laplace_attr;

static float held(float s) { return fminf(fmaxf(s, LEAST), LARGEST); }

typedef struct laplace_job {
    const ag_node *node;
    int64_t pixels, chunk;
    double *sums;
    float up, *dx, *ds;
} laplace_job;

static void sum_chunk(const void *job, int64_t k)
{
    const laplace_job *j = job;
    const laplace_attr *a = j->node->attr;
    const float *x = j->node->in[0]->t.data, *s = j->node->in[1]->t.data, *t = j->node->in[2]->t.data;
    const int c = j->node->in[0]->t.shape.c, g = j->node->in[1]->t.shape.c;
    double part = 0;
    for (int64_t p = k * j->chunk; p < k * j->chunk + ag_part(j->pixels, k * j->chunk, j->chunk); p++) {
        float inverse[MOST];
        for (int i = 0; i < g; i++) inverse[i] = expf(-held(s[p * g + i])) / a->unit;
        for (int i = 0; i < c; i++)
            part += (double)(fabsf(x[p * c + i] - t[p * c + i]) * inverse[a->group[i]] + held(s[p * g + a->group[i]]));
    }
    j->sums[k] = part;
}

static void forward(ag_tape *tape, ag_node *node)
{
    const int c = node->in[0]->t.shape.c;
    const int64_t pixels = ts_pixels(node->in[0]->t.shape), chunk = ag_pixel_chunk(c),
                  chunks = (pixels + chunk - 1) / chunk;
    double *sums = ts_arena_alloc(ag_arena(tape), (size_t)chunks * sizeof *sums), sum = 0;
    if (!sums) {
        ag_fail(tape, TS_NOMEM, "laplace: no memory for %lld sums", (long long)chunks);
        return;
    }
    ts_tasks(ag_threads(tape), chunks, sum_chunk,
             &(laplace_job){.node = node, .pixels = pixels, .chunk = chunk, .sums = sums});
    for (int64_t k = 0; k < chunks; k++) sum += sums[k];
    node->out->t.data[0] = (float)(sum / ((double)pixels * c));
}

static void backward_pixels(const void *job, int64_t begin, int64_t end)
{
    const laplace_job *j = job;
    const laplace_attr *a = j->node->attr;
    const float *x = j->node->in[0]->t.data, *s = j->node->in[1]->t.data, *t = j->node->in[2]->t.data, up = j->up;
    const int c = j->node->in[0]->t.shape.c, g = j->node->in[1]->t.shape.c;
    for (int64_t p = begin; p < end; p++) {
        float inverse[MOST];
        for (int i = 0; i < g; i++) inverse[i] = expf(-held(s[p * g + i])) / a->unit;
        for (int i = 0; i < c; i++) {
            const int m = a->group[i];
            const float e = x[p * c + i] - t[p * c + i], now = s[p * g + m];
            if (j->dx) j->dx[p * c + i] += e > 0 ? up * inverse[m] : e < 0 ? -up * inverse[m] : 0;
            if (j->ds && now > LEAST && now < LARGEST) j->ds[p * g + m] += up * (1 - fabsf(e) * inverse[m]);
        }
    }
}

static void backward(ag_tape *tape, ag_node *node)
{
    const int c = node->in[0]->t.shape.c;
    const int64_t pixels = ts_pixels(node->in[0]->t.shape);
    ts_for(ag_threads(tape), pixels, ag_pixel_chunk(c), backward_pixels,
           &(laplace_job){.node = node,
                          .up = node->out->grad[0] / (float)(pixels * c),
                          .dx = ag_grad_add(tape, node->in[0]),
                          .ds = ag_grad_add(tape, node->in[1])});
}

static void reference(const ag_node *node, const double *const *in, double *out)
{
    const laplace_attr *a = node->attr;
    const int c = node->in[0]->t.shape.c, g = node->in[1]->t.shape.c;
    const int64_t count = ts_count(node->in[0]->t.shape);
    double sum = 0;
    for (int64_t i = 0; i < count; i++) {
        const double s = fmin(fmax(in[1][i / c * g + a->group[i % c]], (double)LEAST), (double)LARGEST);
        sum += fabs(in[0][i] - in[2][i]) / ((double)a->unit * exp(s)) + s;
    }
    out[0] = sum / (double)count;
}

static bool kink(const double *const *in, int input, int64_t i, double step, const void *user)
{
    (void)user;
    if (input == 0) return fabs(in[0][i] - in[2][i]) <= step;
    return fabs(in[1][i] - (double)LEAST) <= step || fabs(in[1][i] - (double)LARGEST) <= step;
}

static const signed char few[] = {0, 0, 0, 1, 1, 2, 3, 3, 3};

static ag_value *build(ag_tape *tape, ag_value *const *in, const void *user)
{
    return ag_laplace(tape, in[0], in[1], in[2], few, *(const float *)user);
}

static void cases(ag_gradcheck *check)
{
    static const float units[] = {1, 0.25f};
    static const ts_shape shapes[] = {{1, 1, 1, 9}, {2, 5, 4, 9}};
    for (int i = 0; i < 4; i++) {
        ts_shape s = shapes[i / 2], of = s;
        of.c = 4;
        ag_case c = {.label = i < 2 ? "one pixel" : "images",
                     .inputs = 3,
                     .shape = {s, of, s},
                     .fixed = {false, false, true},
                     .lo = -1.5f,
                     .hi = 1.5f,
                     .kink = kink,
                     .build = build,
                     .user = &units[i % 2]};
        ag_gradcheck_run(check, &c);
    }
}

const ag_op op_laplace = {"laplace", forward, backward, reference, cases};

ag_value *ag_laplace(ag_tape *tape, ag_value *x, ag_value *spread, ag_value *target, const signed char *group,
                     float unit)
{
    ag_value *in[3] = {x, spread, target};
    char text[3][AG_SHAPE_TEXT];
    if (!ag_ready(tape, "laplace", 3, in)) return NULL;
    const ts_shape s = x->t.shape, of = spread->t.shape;
    if (!ts_same(s, target->t.shape) || s.n != of.n || s.h != of.h || s.w != of.w || s.c > MOST || of.c > MOST)
        return ag_fail(tape, TS_INVALID, "laplace: x %s, spread %s and target %s do not fit", ag_shape_text(text[0], s),
                       ag_shape_text(text[1], of), ag_shape_text(text[2], target->t.shape));
    if (target->needs_grad) return ag_fail(tape, TS_INVALID, "laplace: target has no gradient here; detach it");
    laplace_attr a = {.unit = unit};
    for (int i = 0; i < s.c; i++) {
        a.group[i] = group[i];
        if (group[i] < 0 || group[i] >= of.c)
            return ag_fail(tape, TS_INVALID, "laplace: channel %d has spread %d of %d", i, group[i], of.c);
    }
    return ag_apply(tape, &op_laplace, 3, in, (ts_shape){1, 1, 1, 1}, &a, sizeof a);
}
