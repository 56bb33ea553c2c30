/* y = mean over values of |x - t| / (u e^s) + s, the negative logarithm of Laplace's density of t about x but for a
 * constant, s being the logarithm of its scale over u, held in [-6, 4];   dx = sign(x - t) / (u e^s) / count,
 * ds = (1 - |x - t| / (u e^s)) / count, summed over the channels that share it, 0 outside of the range
 * x, t: [N,H,W,C], s: [N,H,W,G], y: [1,1,1,1] */
#include "autograd/gradcheck.h"
#include "autograd/log_scale.h"
#include "autograd/op.h"
#include "ops.h"
#include "tensor/kernels/elementwise.h"
#include "tensor/kernels/vmath_arrays.h"
#include <math.h>

#ifdef AG_API
/* How unlikely target [N,H,W,C] is where x [N,H,W,C] is expected and off by u e^spread. spread: [N,H,W,G]; group: for
 * each of the C <= 32 channels its channel of spread; x and spread may be constants, target is one. The mean over all
 * values. */
ag_value *ag_laplace(ag_tape *tape, ag_value *x, ag_value *spread, ag_value *target, const signed char *group,
                     float unit);
#endif

enum { MOST = 32, BLOCK = 64 /* pixels whose scales are computed at once */ };

typedef struct laplace_attr {
    float unit;
    signed char group[MOST], member[MOST], first[MOST + 1]; /* group g has the channels member[first[g]] .. */
} laplace_attr;

/* What forward keeps: its derivatives by x and s times count, NULL where nobody asks. */
typedef struct slopes {
    float *dx, *ds;
} slopes;

typedef struct laplace_job {
    const ag_node *node;
    slopes to;
    int64_t pixels, chunk;
    double *sums;
} laplace_job;

/* s in its range, and 1 / (u e^s), of count values of s, at most BLOCK pixels of MOST channels. */
static void invert(const float *s, int64_t count, float unit, float *scale, float *inverse)
{
    for (int64_t i = 0; i < count; i++) scale[i] = ag_log_scale_held(s[i]);
    for (int64_t i = 0; i < count; i++) inverse[i] = -scale[i];
    ts_vmath_arrays_k()->exp(count, inverse, inverse);
    for (int64_t i = 0; i < count; i++) inverse[i] /= unit;
}

/* The sum of so many pixels, and their slopes. */
static double block(const laplace_attr *a, int64_t pixels, int c, int g, const float *x, const float *s, const float *t,
                    float *dx, float *ds)
{
    float scale[BLOCK * MOST], inverse[BLOCK * MOST];
    double sum = 0;
    invert(s, pixels * g, a->unit, scale, inverse);
    for (int64_t p = 0; p < pixels; p++, x += c, t += c, s += g) {
        const float *of = inverse + p * g;
        float pixel = 0;
        for (int j = 0; j < g; j++) {
            const int first = a->first[j], count = a->first[j + 1] - first;
            float off = 0;
            for (int k = first; k < first + count; k++) off += fabsf(x[a->member[k]] - t[a->member[k]]);
            off *= of[j];
            pixel += off + (float)count * scale[p * g + j];
            if (ds) ds[p * g + j] = s[j] > AG_LOG_SCALE_LEAST && s[j] < AG_LOG_SCALE_MOST ? (float)count - off : 0;
        }
        sum += (double)pixel;
        for (int i = 0; dx && i < c; i++) dx[p * c + i] = (float)((x[i] > t[i]) - (x[i] < t[i])) * of[a->group[i]];
    }
    return sum;
}

static void chunk(const void *job, int64_t k)
{
    const laplace_job *j = job;
    const float *x = j->node->in[0]->t.data, *s = j->node->in[1]->t.data, *t = j->node->in[2]->t.data;
    const int c = j->node->in[0]->t.shape.c, g = j->node->in[1]->t.shape.c;
    const int64_t end = k * j->chunk + ag_part(j->pixels, k * j->chunk, j->chunk);
    double part = 0;
    for (int64_t p = k * j->chunk; p < end; p += BLOCK)
        part += block(j->node->attr, ag_part(end, p, BLOCK), c, g, x + p * c, s + p * g, t + p * c,
                      j->to.dx ? j->to.dx + p * c : NULL, j->to.ds ? j->to.ds + p * g : NULL);
    j->sums[k] = part;
}

/* Room for the slopes that backward asks for. */
static bool slopes_of(ag_tape *tape, const ag_node *node, slopes *to)
{
    float **of[2] = {&to->dx, &to->ds};
    for (int i = 0; i < 2; i++)
        if (ag_gradients(tape) && node->in[i]->needs_grad &&
            !(*of[i] = ts_new(ag_arena(tape), node->in[i]->t.shape).data))
            return false;
    return true;
}

static void forward(ag_tape *tape, ag_node *node)
{
    const int c = node->in[0]->t.shape.c;
    const int64_t pixels = ts_pixels(node->in[0]->t.shape), each = ag_pixel_chunk(c),
                  chunks = (pixels + each - 1) / each;
    double *sums = ts_arena_alloc(ag_arena(tape), (size_t)chunks * sizeof *sums), sum = 0;
    slopes *to = ts_arena_zalloc(ag_arena(tape), 1, sizeof *to);
    if (!sums || !to || !slopes_of(tape, node, to)) {
        ag_fail(tape, TS_NOMEM, "laplace: no memory for %lld pixels", (long long)pixels);
        return;
    }
    node->saved = to;
    ts_tasks(ag_threads(tape), chunks, chunk,
             &(laplace_job){.node = node, .to = *to, .pixels = pixels, .chunk = each, .sums = sums});
    for (int64_t k = 0; k < chunks; k++) sum += sums[k];
    node->out->t.data[0] = (float)(sum / ((double)pixels * c));
}

typedef struct scaling {
    const float *slope;
    float up, *to;
    bool accumulate;
} scaling;

static void scale_range(const void *job, int64_t begin, int64_t end)
{
    const scaling *s = job;
    ts_elementwise_k()->scale(end - begin, s->up, s->slope + begin, s->to + begin, s->accumulate);
}

static void backward(ag_tape *tape, ag_node *node)
{
    const slopes *of = node->saved;
    const float *slope[2] = {of->dx, of->ds};
    for (int i = 0; i < 2; i++) {
        scaling s = {.slope = slope[i], .up = node->out->grad[0] / (float)ts_count(node->in[0]->t.shape)};
        s.to = ag_grad_target(tape, node->in[i], &s.accumulate);
        if (s.to) ts_for(ag_threads(tape), ts_count(node->in[i]->t.shape), AG_CHUNK, scale_range, &s);
    }
}

static void reference(const ag_node *node, const double *const *in, double *out)
{
    const laplace_attr *a = node->attr;
    const int c = node->in[0]->t.shape.c, g = node->in[1]->t.shape.c;
    const int64_t count = ts_count(node->in[0]->t.shape);
    double sum = 0;
    for (int64_t i = 0; i < count; i++) {
        const double s = fmin(fmax(in[1][i / c * g + a->group[i % c]], (double)AG_LOG_SCALE_LEAST),
                              (double)AG_LOG_SCALE_MOST);
        sum += fabs(in[0][i] - in[2][i]) / ((double)a->unit * exp(s)) + s;
    }
    out[0] = sum / (double)count;
}

static bool kink(const double *const *in, int input, int64_t i, double step, const void *user)
{
    (void)user;
    if (input == 0) return fabs(in[0][i] - in[2][i]) <= step;
    return fabs(in[1][i] - (double)AG_LOG_SCALE_LEAST) <= step || fabs(in[1][i] - (double)AG_LOG_SCALE_MOST) <= step;
}

static const signed char few[] = {0, 0, 0, 1, 1, 2, 3, 3, 3};

static ag_value *build(ag_tape *tape, ag_value *const *in, const void *user)
{
    return ag_laplace(tape, in[0], in[1], in[2], few, *(const float *)user);
}

static void cases(ag_gradcheck *check)
{
    static const float units[] = {1, 0.25f};
    static const ts_shape shapes[] = {{1, 1, 1, 9}, {2, 9, 7, 9}}; /* of one block of pixels, and of two */
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
    for (int g = 0, members = 0; g < of.c; g++) {
        a.first[g] = (signed char)members;
        for (int i = 0; i < s.c; i++)
            if (group[i] == g) a.member[members++] = (signed char)i;
        a.first[g + 1] = (signed char)members;
    }
    return ag_apply(tape, &op_laplace, 3, in, (ts_shape){1, 1, 1, 1}, &a, sizeof a);
}
