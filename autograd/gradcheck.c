#include "autograd/gradcheck.h"
#include "autograd/op.h"
#include "autograd/op_list.h"
#include <math.h>
#include <stdio.h>
#include <string.h>

struct ag_gradcheck {
    const ag_op *op;
    ts_rng rng;
    ag_tape *tape;
    ts_arena *arena; /* of one case */
    int cases;
    int64_t compared, excluded;
    ts_status status; /* the first failure */
};

/* One case under way. */
typedef struct check {
    ag_gradcheck *g;
    const ag_case *c;
    const ag_node *node;         /* of the last run; valid until the next */
    ag_value *in[AG_MAX_INPUTS]; /* what build was given */
    float *f[AG_MAX_INPUTS];     /* the values of the inputs, */
    double *d[AG_MAX_INPUTS];    /* the same in double, */
    float *grad[AG_MAX_INPUTS];  /* and their gradients */
    float *weight;               /* of the outputs in the loss */
    int64_t outputs;
    double *reference; /* [outputs] */
} check;

/* y = x: its gradient is the first to reach what it copies, so that ops are tested overwriting as well as adding. */
static void same_forward(ag_tape *tape, ag_node *node)
{
    (void)tape;
    memcpy(node->out->t.data, node->in[0]->t.data, (size_t)ts_count(node->out->t.shape) * sizeof(float));
}

static void same_backward(ag_tape *tape, ag_node *node)
{
    float *dx = ag_grad_add(tape, node->in[0]);
    for (int64_t i = 0; dx && i < ts_count(node->out->t.shape); i++) dx[i] += node->out->grad[i];
}

static const ag_op same = {.name = "same", .forward = same_forward, .backward = same_backward};

/* loss = sum of weight y */
static void loss_forward(ag_tape *tape, ag_node *node)
{
    (void)tape;
    const float *w = *(float *const *)node->attr, *y = node->in[0]->t.data;
    double sum = 0;
    for (int64_t i = 0; i < ts_count(node->in[0]->t.shape); i++) sum += (double)w[i] * y[i];
    node->out->t.data[0] = (float)sum;
}

static void loss_backward(ag_tape *tape, ag_node *node)
{
    const float *w = *(float *const *)node->attr;
    float *dx = ag_grad_add(tape, node->in[0]);
    for (int64_t i = 0; dx && i < ts_count(node->in[0]->t.shape); i++) dx[i] += w[i] * node->out->grad[0];
}

static const ag_op weighted_sum = {.name = "weighted sum", .forward = loss_forward, .backward = loss_backward};

ts_rng *ag_gradcheck_rng(ag_gradcheck *g) { return &g->rng; }

static ts_code fail(const check *k, const char *format, ...) __attribute__((format(printf, 2, 3)));
static ts_code fail(const check *k, const char *format, ...)
{
    char text[400];
    va_list args;
    va_start(args, format);
    vsnprintf(text, sizeof text, format, args);
    va_end(args);
    ts_status *st = &k->g->status;
    if (st->code == TS_OK) ts_fail(st, TS_NUMERIC, "%s, case \"%s\": %s", k->g->op->name, k->c->label, text);
    return TS_NUMERIC;
}

/* Forward (and backward, with gradients only for the inputs in the mask) on a tape whose memory is full of NaN. */
static ag_value *run(check *k, unsigned wanted, bool copied, bool backward)
{
    ag_tape *tape = k->g->tape;
    ag_reset(tape);
    const size_t size = (size_t)4 << 20;
    float *dirt = ts_arena_alloc(ag_arena(tape), size);
    if (dirt) memset(dirt, 0xff, size); /* all bits set is a NaN */
    ag_reset(tape);
    for (int i = 0; i < k->c->inputs; i++) {
        ts_tensor t = ts_view(k->f[i], k->c->shape[i]);
        bool needs = wanted >> i & 1;
        memset(k->grad[i], 0, (size_t)ts_count(t.shape) * sizeof(float));
        k->in[i] = needs ? ag_parameter(tape, t, k->grad[i]) : ag_constant(tape, t);
        if (needs && copied) k->in[i] = ag_apply(tape, &same, 1, &k->in[i], t.shape, NULL, 0);
    }
    ag_value *y = k->c->build(tape, k->in, k->c->user);
    if (y) k->node = ag_node_of(tape, y);
    if (y && backward) {
        ag_value *loss = ag_apply(tape, &weighted_sum, 1, &y, (ts_shape){1, 1, 1, 1}, &k->weight, sizeof k->weight);
        ag_backward(tape, loss);
    }
    return ag_status(tape)->code == TS_OK ? y : NULL;
}

/* The double reference with the inputs as they are now. */
static void refer(const check *k, double *out)
{
    const double *in[AG_MAX_INPUTS] = {0};
    for (int j = 0; j < k->node->inputs; j++)
        for (int i = 0; i < k->c->inputs; i++)
            if (k->node->in[j] && k->node->in[j] == k->in[i]) in[j] = k->d[i];
    k->g->op->reference(k->node, in, out);
}

static double loss_at(const check *k, double *out, double *place, double x)
{
    const double before = *place;
    *place = x;
    refer(k, out);
    *place = before;
    double sum = 0;
    for (int64_t i = 0; i < k->outputs; i++) sum += k->weight[i] * out[i];
    return sum;
}

/* The central difference at a step where it agrees best with the one of the next smaller step; false: a kink is too
 * near. */
static bool difference(const check *k, double *out, int input, int64_t i, double *slope)
{
    static const double steps[] = {1e-3, 1e-4, 1e-5, 1e-6};
    double x = k->d[input][i], size = fabs(x) > 1 ? fabs(x) : 1, last = 0, best = INFINITY;
    bool have = false;
    for (int s = 0; s < 4; s++) {
        const double h = steps[s] * size;
        if (k->c->kink && k->c->kink((const double *const *)k->d, input, i, h, k->c->user)) continue;
        const double now = (loss_at(k, out, &k->d[input][i], x + h) - loss_at(k, out, &k->d[input][i], x - h)) /
            (2 * h);
        if (have && fabs(now - last) < best) {
            best = fabs(now - last);
            *slope = now;
        }
        if (have && best <= 1e-9 * fabs(now)) break;
        last = now;
        have = true;
    }
    return best < INFINITY;
}

static double largest(const float *x, int64_t n)
{
    double m = 0;
    for (int64_t i = 0; i < n; i++) m = fabs(x[i]) > m || isnan(x[i]) ? fabs(x[i]) : m;
    return m;
}

static ts_code check_gradient(check *k, int input)
{
    enum { MOST = 64 };
    const int64_t n = ts_count(k->c->shape[input]);
    const int64_t tries = n < MOST ? n : MOST;
    double *numeric = ts_arena_zalloc(k->g->arena, (size_t)tries, sizeof(double)),
           *out = ts_arena_zalloc(k->g->arena, (size_t)k->outputs, sizeof(double));
    int64_t *which = ts_arena_zalloc(k->g->arena, (size_t)tries, sizeof(int64_t));
    if (!numeric || !out || !which) return fail(k, "no memory");
    double scale = largest(k->grad[input], n);
    for (int64_t t = 0; t < tries; t++) {
        which[t] = n <= MOST ? t : (int64_t)(ts_rng_u32(&k->g->rng) % (uint64_t)n);
        if (!difference(k, out, input, which[t], &numeric[t])) {
            which[t] = -1;
            k->g->excluded++;
        } else if (fabs(numeric[t]) > scale) {
            scale = fabs(numeric[t]);
        }
    }
    const double tolerance = k->c->gradient_tolerance > 0 ? k->c->gradient_tolerance : 1e-3;
    int64_t worst = -1;
    double error = 0;
    for (int64_t t = 0; t < tries; t++) {
        if (which[t] < 0) continue;
        k->g->compared++;
        double e = fabs(k->grad[input][which[t]] - numeric[t]);
        if (!(e <= error)) {
            error = e;
            worst = t;
        }
    }
    if (!(error <= tolerance * scale))
        return fail(k, "input %d value %lld: gradient %.9g, by differences %.9g (largest %.3g)", input,
                    (long long)which[worst], (double)k->grad[input][which[worst]], numeric[worst], scale);
    return TS_OK;
}

/* Gradients must not depend on which others are wanted, on whether they come first or are added, or on an earlier
 * backward. */
static ts_code check_variant(check *k, unsigned wanted, bool copied, int times, float *const *expected,
                             const char *what)
{
    if (!run(k, wanted, copied, true)) return fail(k, "%s: %s", what, ag_status(k->g->tape)->message);
    for (int t = 1; t < times; t++) {
        ag_value *y = k->node->out;
        ag_backward(k->g->tape,
                    ag_apply(k->g->tape, &weighted_sum, 1, &y, (ts_shape){1, 1, 1, 1}, &k->weight, sizeof k->weight));
    }
    for (int i = 0; i < k->c->inputs; i++) {
        const int64_t n = ts_count(k->c->shape[i]);
        const double scale = largest(expected[i], n);
        for (int64_t j = 0; j < n; j++) {
            double want = wanted >> i & 1 ? (double)times * expected[i][j] : 0;
            if (!(fabs(k->grad[i][j] - want) <= 1e-5 * scale))
                return fail(k, "%s: input %d value %lld: gradient %.9g, not %.9g", what, i, (long long)j,
                            (double)k->grad[i][j], want);
        }
    }
    return TS_OK;
}

static ts_code check_case(check *k)
{
    ag_gradcheck *g = k->g;
    unsigned all = 0;
    for (int i = 0; i < k->c->inputs; i++) {
        const int64_t n = ts_count(k->c->shape[i]);
        k->f[i] = ts_arena_alloc(g->arena, (size_t)n * sizeof(float));
        k->d[i] = ts_arena_alloc(g->arena, (size_t)n * sizeof(double));
        k->grad[i] = ts_arena_alloc(g->arena, (size_t)n * sizeof(float));
        if (!k->f[i] || !k->d[i] || !k->grad[i]) return fail(k, "no memory");
        for (int64_t j = 0; j < n; j++) k->f[i][j] = ts_rng_range(&g->rng, k->c->lo, k->c->hi);
        if (!k->c->fixed[i]) all |= 1u << i;
    }
    if (k->c->prepare) k->c->prepare(k->f, k->c->user);
    for (int i = 0; i < k->c->inputs; i++)
        for (int64_t j = 0; j < ts_count(k->c->shape[i]); j++) k->d[i][j] = k->f[i][j];

    const ag_value *y = run(k, all, false, false);
    if (!y) return fail(k, "%s", ag_status(g->tape)->message);
    if (!k->node || k->node->op != g->op)
        return fail(k, "the output was not made by the op from an input with a gradient");
    k->outputs = ts_count(y->t.shape);
    k->weight = ts_arena_alloc(g->arena, (size_t)k->outputs * sizeof(float));
    k->reference = ts_arena_zalloc(g->arena, (size_t)k->outputs, sizeof(double));
    if (!k->weight || !k->reference) return fail(k, "no memory");
    for (int64_t i = 0; i < k->outputs; i++) k->weight[i] = ts_rng_range(&g->rng, -1, 1);

    refer(k, k->reference);
    double scale = 0;
    for (int64_t i = 0; i < k->outputs; i++) scale = fabs(k->reference[i]) > scale ? fabs(k->reference[i]) : scale;
    const double tolerance = k->c->forward_tolerance > 0 ? k->c->forward_tolerance : 1e-5;
    for (int64_t i = 0; i < k->outputs; i++)
        if (!(fabs(y->t.data[i] - k->reference[i]) <= tolerance * scale))
            return fail(k, "output %lld is %.9g, the reference %.9g (largest %.3g)", (long long)i, (double)y->t.data[i],
                        k->reference[i], scale);

    if (!run(k, all, false, true)) return fail(k, "%s", ag_status(g->tape)->message);
    for (int i = 0; i < k->c->inputs; i++)
        if (!k->c->fixed[i] && check_gradient(k, i) != TS_OK) return TS_NUMERIC;

    float *expected[AG_MAX_INPUTS] = {0};
    for (int i = 0; i < k->c->inputs; i++) {
        const size_t bytes = (size_t)ts_count(k->c->shape[i]) * sizeof(float);
        expected[i] = ts_arena_alloc(g->arena, bytes);
        if (!expected[i]) return fail(k, "no memory");
        memcpy(expected[i], k->grad[i], bytes);
    }
    ts_code code = check_variant(k, all, true, 1, expected, "first gradient");
    if (code == TS_OK) code = check_variant(k, all, false, 2, expected, "two backward passes");
    for (int i = 0; code == TS_OK && i < k->c->inputs; i++)
        if (!k->c->fixed[i]) code = check_variant(k, 1u << i, i & 1, 1, expected, "gradient of one input alone");
    return code;
}

ts_code ag_gradcheck_run(ag_gradcheck *g, const ag_case *c)
{
    if (g->status.code != TS_OK) return g->status.code;
    check k = {.g = g, .c = c};
    ts_arena_reset(g->arena);
    g->cases++;
    return check_case(&k);
}

int ag_gradcheck_all(uint64_t seed,
                     void (*report)(const char *op, int cases, int64_t compared, int64_t excluded, const ts_status *st,
                                    void *user),
                     void *user)
{
    int failed = 0;
    for (int i = 0; ag_op_list[i]; i++) {
        ag_gradcheck g = {.op = ag_op_list[i], .rng = ts_rng_make(seed, TS_STREAM_TEST, (uint64_t)i)};
        g.tape = ag_tape_create(true, &g.status);
        g.arena = g.tape ? ts_arena_create(0, &g.status) : NULL;
        if (g.arena) g.op->cases(&g);
        if (g.status.code == TS_OK && g.compared == 0)
            ts_fail(&g.status, TS_INVALID, "%s: no gradient was compared", g.op->name);
        if (g.status.code != TS_OK) failed++;
        if (report) report(g.op->name, g.cases, g.compared, g.excluded, &g.status, user);
        ts_arena_destroy(&g.arena);
        ag_tape_destroy(&g.tape);
    }
    return failed;
}
