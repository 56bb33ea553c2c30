/* z = sigmoid(ih_z + hh_z),  r = sigmoid(ih_r + hh_r),  m = tanh(ih_n + r hh_n),  y = (1 - z) old + z m
 * dm = dy z (1 - m^2)  (before the tanh),  dz = dy (m - old) z (1 - z),  dr = dm hh_n r (1 - r),
 * dih = [dz, dr, dm],  dhh = [dz, dr, dm r],  dold = dy (1 - z)
 * Cho et al., "Learning Phrase Representations using RNN Encoder-Decoder", EMNLP 2014, with the reset gate applied after hh's
 * matrix and z weighing the new candidate.
 * ih: [N,H,W,3C] in chunks z, r, n; hh: the same, or [1,1,1,3C] for all pixels; old: [N,H,W,C] or NULL = 0; y: [N,H,W,C] */
#include "autograd/gradcheck.h"
#include "autograd/op.h"
#include "ops.h"
#include "tensor/kernels/elementwise.h"
#include <math.h>

#ifdef AG_API
/* The new state [N,H,W,C] of a gated recurrent unit: ih [N,H,W,3C] in chunks z, r, n; hh the same or [1,1,1,3C] for all pixels;
 * old [N,H,W,C], or NULL for a state of zeros. */
ag_value *ag_gru(ag_tape *tape, ag_value *ih, ag_value *hh, ag_value *old);
#endif

static bool one_hh(const ag_node *node) { return ts_pixels(node->in[1]->t.shape) == 1; }

static void forward(ag_tape *tape, ag_node *node)
{
    const struct ts_elementwise_kernels *k = ts_elementwise_k();
    const ts_shape s = node->out->t.shape;
    const int c = s.c;
    const float *ih = node->in[0]->t.data, *hh = node->in[1]->t.data, *old = node->in[2] ? node->in[2]->t.data : NULL;
    float *y = node->out->t.data, *zrn = NULL;
    const int64_t pixels = ts_pixels(s), chunk = ag_pixel_chunk(3 * c), step = one_hh(node) ? 0 : 3 * c;
    if (node->out->needs_grad) {
        node->saved = zrn = ts_arena_alloc(ag_arena(tape), (size_t)pixels * 3 * (size_t)c * sizeof(float));
        if (!zrn) {
            ag_fail(tape, TS_NOMEM, "gru: no memory for the gates");
            return;
        }
    }
    #pragma omp parallel for num_threads(ts_threads()) schedule(static) if (pixels > chunk)
    for (int64_t p = 0; p < pixels; p += chunk)
        k->gru(ag_part(pixels, p, chunk), c, ih + p * 3 * c, hh + p * step, step, old ? old + p * c : NULL, y + p * c, zrn ? zrn + p * 3 * c : NULL);
}

static void backward(ag_tape *tape, ag_node *node)
{
    const struct ts_elementwise_kernels *k = ts_elementwise_k();
    const ts_shape s = node->out->t.shape;
    const int c = s.c;
    const bool one = one_hh(node);
    const float *hh = node->in[1]->t.data, *old = node->in[2] ? node->in[2]->t.data : NULL, *zrn = node->saved, *dy = node->out->grad;
    const int64_t pixels = ts_pixels(s), chunk = ag_sum_chunk(pixels, 3 * c), step = one ? 0 : 3 * c, tasks = (pixels + chunk - 1) / chunk;
    bool ih_adds = false, hh_adds = false, old_adds = false;
    float *dih = ag_grad_target(tape, node->in[0], &ih_adds), *dhh = ag_grad_target(tape, node->in[1], &hh_adds);
    float *dold = ag_grad_target(tape, node->in[2], &old_adds);
    float *done = one ? dhh : NULL;
    if (one) dhh = NULL;
    const ts_mark mark = ts_arena_mark(ag_arena(tape));
    double *part = done ? ts_arena_zalloc(ag_arena(tape), (size_t)tasks * 3 * (size_t)c, sizeof(double)) : NULL; /* [tasks][3C] */
    if (done && !part) {
        ag_fail(tape, TS_NOMEM, "gru: no memory for the sums");
        return;
    }
    #pragma omp parallel for num_threads(ts_threads()) schedule(static) if (tasks > 1)
    for (int64_t t = 0; t < tasks; t++) {
        const int64_t p = t * chunk;
        k->gru_backward(ag_part(pixels, p, chunk), c, hh + p * step, step, old ? old + p * c : NULL, zrn + p * 3 * c, dy + p * c,
                        dih ? dih + p * 3 * c : NULL, ih_adds, dhh ? dhh + p * 3 * c : NULL, hh_adds, dold ? dold + p * c : NULL, old_adds,
                        part ? part + t * 3 * c : NULL);
    }
    for (int i = 0; done && i < 3 * c; i++) {
        double sum = 0;
        for (int64_t t = 0; t < tasks; t++) sum += part[t * 3 * c + i];
        done[i] = (float)(hh_adds ? done[i] + sum : sum);
    }
    ts_arena_release(ag_arena(tape), mark);
}

static void reference(const ag_node *node, const double *const *in, double *out)
{
    const int c = node->out->t.shape.c;
    for (int64_t p = 0; p < ts_pixels(node->out->t.shape); p++)
        for (int i = 0; i < c; i++) {
            const double *a = in[0] + p * 3 * c + i, *b = in[1] + (one_hh(node) ? 0 : p * 3 * c) + i;
            const double z = 1 / (1 + exp(-a[0] - b[0])), r = 1 / (1 + exp(-a[c] - b[c])), m = tanh(a[2 * c] + r * b[2 * c]);
            out[p * c + i] = (in[2] ? (1 - z) * in[2][p * c + i] : 0) + z * m;
        }
}

/* user: the case's input that is old, as a number; 0 for none */
static ag_value *build(ag_tape *tape, ag_value *const *in, const void *user) { return ag_gru(tape, in[0], in[1], *(const int *)user ? in[2] : NULL); }

static ag_value *build_same(ag_tape *tape, ag_value *const *in, const void *user)
{
    (void)user;
    return ag_gru(tape, in[0], in[0], NULL);
}

static void cases(ag_gradcheck *check)
{
    ts_rng *r = ag_gradcheck_rng(check);
    static const char *const labels[] = {"no state", "state", "no state, one hh", "state, one hh"};
    for (int t = 0; t < 8; t++) {
        const int old = t % 2 ? 2 : 0;
        ts_shape s = {1 + ts_rng_int(r, 3), 1 + ts_rng_int(r, 5), 1 + ts_rng_int(r, 5), 1 + ts_rng_int(r, 35)};
        ag_case c = {.label = labels[t % 4], .inputs = old ? 3 : 2, .lo = -2, .hi = 2, .build = build, .user = &old};
        c.shape[0] = c.shape[1] = (ts_shape){s.n, s.h, s.w, 3 * s.c};
        if (t & 2) c.shape[1] = (ts_shape){1, 1, 1, 3 * s.c};
        c.shape[2] = s;
        ag_gradcheck_run(check, &c);
    }
    const int old = 2;
    ag_case big = {.label = "several chunks, one hh", .inputs = 3, .shape = {{1, 33, 34, 15}, {1, 1, 1, 15}, {1, 33, 34, 5}}, .lo = -3, .hi = 3, .build = build, .user = &old};
    ag_gradcheck_run(check, &big);
    ag_case twice = {.label = "ih is hh", .inputs = 1, .shape = {{1, 3, 5, 21}}, .lo = -2, .hi = 2, .build = build_same};
    ag_gradcheck_run(check, &twice);
}

const ag_op op_gru = {"gru", forward, backward, reference, cases};

ag_value *ag_gru(ag_tape *tape, ag_value *ih, ag_value *hh, ag_value *old)
{
    ag_value *in[3] = {ih, hh, old};
    char a[AG_SHAPE_TEXT], b[AG_SHAPE_TEXT];
    if (!ag_ready(tape, "gru", 2, in)) return NULL;
    ts_shape s = ih->t.shape;
    if (s.c % 3) return ag_fail(tape, TS_INVALID, "gru: ih has %d channels, not three times the state's", s.c);
    if (!ts_same(hh->t.shape, s) && !ts_same(hh->t.shape, (ts_shape){1, 1, 1, s.c}))
        return ag_fail(tape, TS_INVALID, "gru: hh is %s, ih %s", ag_shape_text(b, hh->t.shape), ag_shape_text(a, s));
    s.c /= 3;
    if (old && !ts_same(old->t.shape, s)) return ag_fail(tape, TS_INVALID, "gru: old is %s, the state %s", ag_shape_text(b, old->t.shape), ag_shape_text(a, s));
    return ag_apply(tape, &op_gru, 3, in, s, NULL, 0);
}
