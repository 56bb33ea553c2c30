/* y[n,p,c] = (x[n,p,c] - mean_nc) q_nc,   q = 1 / sqrt(variance_nc + epsilon), both over the P pixels p of one image,
 * the variance biased;   dx = q (dy - mean_p(dy) - y mean_p(dy y))
 *
 * Ulyanov et al., "Instance Normalization", 2016, equation 1; without scale and shift. x, y: [N,H,W,C]; q: [N,C].
 * epsilon keeps a constant channel finite: it becomes 0. */
#include "autograd/gradcheck.h"
#include "autograd/op.h"
#include "ops.h"
#include "tensor/kernels/norm.h"
#include <math.h>

#ifdef AG_API
/* Every channel of every image of x [N,H,W,C] with mean 0 and variance 1 over its pixels (biased variance, no affine).
 */
ag_value *ag_instance_norm(ag_tape *tape, ag_value *x, float epsilon);
#endif

static void moments_of_chunks(const void *job, int64_t begin, int64_t end)
{
    const ag_chunks *a = job;
    for (int64_t t = begin; t < end; t++) {
        double *part = (double *)a->part + t * 2 * a->c;
        ts_norm_k()->moments(ag_chunk_count(a, t), a->c, a->node->in[0]->t.data + ag_chunk_at(a, t), part, part + a->c);
    }
}

static void normalise_chunks(const void *job, int64_t begin, int64_t end)
{
    const ag_chunks *a = job;
    for (int64_t t = begin; t < end; t++) {
        const float *stat = (const float *)a->stat + ag_chunk_image(a, t) * 3 * a->c;
        ts_norm_k()->normalise(ag_chunk_count(a, t), a->c, a->node->in[0]->t.data + ag_chunk_at(a, t), stat,
                               stat + a->c, stat + 2 * a->c, a->node->out->t.data + ag_chunk_at(a, t));
    }
}

static void forward(ag_tape *tape, ag_node *node)
{
    const ts_shape s = node->out->t.shape;
    const int c = s.c;
    const size_t nc = (size_t)s.n * (size_t)c;
    const float epsilon = *(const float *)node->attr;
    ag_chunks a = ag_chunks_of(node, s, ag_sum_chunk((int64_t)s.h * s.w, c));
    float *q = node->out->needs_grad ? ts_arena_alloc(ag_arena(tape), nc * sizeof(float)) : NULL;
    node->saved = q;
    const ts_mark mark = ts_arena_mark(ag_arena(tape));
    double *part = ts_arena_alloc(ag_arena(tape),
                                  (size_t)a.tasks * 2 * (size_t)c * sizeof(double)); /* [N][parts][mean, m2][C] */
    float *stat = ts_arena_alloc(ag_arena(tape), nc * 3 * sizeof(float));            /* [N][high, low, q][C] */
    if (!part || !stat || (node->out->needs_grad && !q)) {
        ag_fail(tape, TS_NOMEM, "instance_norm: no memory for the sums");
        return;
    }
    a.part = part;
    a.stat = stat;
    ts_for(ag_threads(tape), a.tasks, 1, moments_of_chunks, &a);
    for (int64_t i = 0; i < (int64_t)nc; i++) {
        const int64_t n = i / c, j = i % c;
        double mean = 0, m2 = 0, count = 0; /* Chan, Golub, LeVeque 1979: moments of parts into those of the whole */
        for (int64_t t = 0; t < a.parts; t++) {
            const double *from = part + (n * a.parts + t) * 2 * c + j, m = (double)ag_chunk_count(&a, t),
                         d = from[0] - mean;
            count += m;
            mean += d * m / count;
            m2 += from[c] + d * d * m * (count - m) / count;
        }
        float *to = stat + n * 3 * c + j;
        to[0] = (float)mean;
        to[c] = (float)(mean - to[0]);
        to[2 * c] = (float)(1 / sqrt(m2 / (double)a.pixels + epsilon));
        if (q) q[i] = to[2 * c];
    }
    ts_for(ag_threads(tape), a.tasks, 1, normalise_chunks, &a);
    ts_arena_release(ag_arena(tape), mark);
}

static void sums_of_chunks(const void *job, int64_t begin, int64_t end)
{
    const ag_chunks *a = job;
    for (int64_t t = begin; t < end; t++) {
        const int64_t at = ag_chunk_at(a, t);
        double *part = (double *)a->part + t * 2 * a->c;
        ts_norm_k()->gradient_sums(ag_chunk_count(a, t), a->c, a->node->out->t.data + at, a->node->out->grad + at, part,
                                   part + a->c);
    }
}

static void gradient_of_chunks(const void *job, int64_t begin, int64_t end)
{
    const ag_chunks *a = job;
    for (int64_t t = begin; t < end; t++) {
        const int64_t at = ag_chunk_at(a, t), n = ag_chunk_image(a, t);
        const float *mean = (const float *)a->stat + n * 2 * a->c, *q = a->node->saved;
        ts_norm_k()->gradient(ag_chunk_count(a, t), a->c, a->node->out->t.data + at, a->node->out->grad + at, mean,
                              mean + a->c, q + n * a->c, a->dx + at, a->accumulate);
    }
}

static void backward(ag_tape *tape, ag_node *node)
{
    const ts_shape s = node->out->t.shape;
    const int c = s.c;
    const size_t nc = (size_t)s.n * (size_t)c;
    ag_chunks a = ag_chunks_of(node, s, ag_sum_chunk((int64_t)s.h * s.w, c));
    a.dx = ag_grad_target(tape, node->in[0], &a.accumulate);
    if (!a.dx) return;
    const ts_mark mark = ts_arena_mark(ag_arena(tape));
    double *part = ts_arena_zalloc(ag_arena(tape), (size_t)a.tasks * 2 * (size_t)c,
                                   sizeof(double));                       /* [N][parts][dy, dy y][C] */
    float *mean = ts_arena_alloc(ag_arena(tape), nc * 2 * sizeof(float)); /* [N][dy, dy y][C] */
    if (!part || !mean) {
        ag_fail(tape, TS_NOMEM, "instance_norm: no memory for the sums");
        return;
    }
    a.part = part;
    a.stat = mean;
    ts_for(ag_threads(tape), a.tasks, 1, sums_of_chunks, &a);
    for (int64_t i = 0; i < (int64_t)s.n * 2 * c; i++) {
        double sum = 0;
        for (int64_t t = 0; t < a.parts; t++) sum += part[(i / (2 * c) * a.parts + t) * 2 * c + i % (2 * c)];
        mean[i] = (float)(sum / (double)a.pixels);
    }
    ts_for(ag_threads(tape), a.tasks, 1, gradient_of_chunks, &a);
    ts_arena_release(ag_arena(tape), mark);
}

static void reference(const ag_node *node, const double *const *in, double *out)
{
    const ts_shape s = node->out->t.shape;
    const int pixels = s.h * s.w;
    for (int n = 0; n < s.n; n++)
        for (int c = 0; c < s.c; c++) {
            const double *x = in[0] + (int64_t)n * pixels * s.c + c;
            double mean = 0, variance = 0;
            for (int p = 0; p < pixels; p++) mean += x[p * s.c] / pixels;
            for (int p = 0; p < pixels; p++) variance += (x[p * s.c] - mean) * (x[p * s.c] - mean) / pixels;
            for (int p = 0; p < pixels; p++)
                out[((int64_t)n * pixels + p) * s.c + c] = (x[p * s.c] - mean) /
                    sqrt(variance + *(const float *)node->attr);
        }
}

static ag_value *build(ag_tape *tape, ag_value *const *in, const void *user)
{
    return ag_instance_norm(tape, in[0], *(const float *)user);
}

static void offset(float *const *in, const void *user)
{
    (void)user;
    for (int i = 0; i < 4 * 5 * 3; i++) in[0][i] += 1000.0f;
}

static void cases(ag_gradcheck *check)
{
    static const float epsilon = 1e-5f, large = 0.1f;
    ts_rng *r = ag_gradcheck_rng(check);
    for (int i = 0; i < 6; i++) {
        ag_case c = {
            .label = "random", .inputs = 1, .lo = -1, .hi = 1, .build = build, .user = i % 2 ? &large : &epsilon};
        c.shape[0] = (ts_shape){1 + ts_rng_int(r, 3), 2 + ts_rng_int(r, 7), 2 + ts_rng_int(r, 9),
                                1 + ts_rng_int(r, 33)};
        ag_gradcheck_run(check, &c);
    }
    ag_case one = {.label = "one pixel becomes 0",
                   .inputs = 1,
                   .shape = {{2, 1, 1, 5}},
                   .lo = -1,
                   .hi = 1,
                   .build = build,
                   .user = &epsilon};
    ag_gradcheck_run(check, &one);
    ag_case far = {.label = "mean 1000, spread 0.6",
                   .inputs = 1,
                   .shape = {{1, 4, 5, 3}},
                   .lo = -1,
                   .hi = 1,
                   .build = build,
                   .user = &epsilon,
                   .prepare = offset};
    ag_gradcheck_run(check, &far);
    ag_case big = {.label = "several chunks",
                   .inputs = 1,
                   .shape = {{2, 70, 61, 7}},
                   .lo = -1,
                   .hi = 3,
                   .build = build,
                   .user = &epsilon};
    ag_gradcheck_run(check, &big);
}

const ag_op op_instance_norm = {"instance_norm", forward, backward, reference, cases};

ag_value *ag_instance_norm(ag_tape *tape, ag_value *x, float epsilon)
{
    if (!ag_ready(tape, "instance_norm", 1, &x)) return NULL;
    if (!(epsilon > 0))
        return ag_fail(tape, TS_INVALID, "instance_norm: epsilon is %g, it must be positive", (double)epsilon);
    return ag_apply(tape, &op_instance_norm, 1, &x, x->t.shape, &epsilon, sizeof epsilon);
}
