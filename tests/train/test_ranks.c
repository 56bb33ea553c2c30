/* What several ranks rest on, without MPI: shares, buckets that are sent when they are complete, sums in bf16. */
#include "render/losses.h"
#include "tests/support/networks.h"
#include "train/mpi/parts.h"
#include "train/mpi/rounded.h"
#include "train/ranks.h"
#include "train/reduce.h"

TEST(ranks_share_out_everything_once)
{
    for (int total = 0; total < 40; total++)
        for (int count = 1; count < 12; count++) {
            int next = 0;
            for (int rank = 0; rank < count; rank++) {
                int from;
                const int n = tr_share(&(tr_ranks){.rank = rank, .count = count}, total, &from);
                CHECK(from == next && n >= total / count && n <= (total + count - 1) / count,
                      "rank %d of %d has %d of %d from %d on", rank, count, n, total, from);
                next = from + n;
            }
            CHECK(next == total, "%d of %d are shared out", next, total);
        }
}

/* One rank's MPI: what it is given is kept as it was then. */
static struct {
    float *sent;        /* like the model's block */
    unsigned char *has; /* how often each float was sent */
    float *block;
    size_t most; /* of the values of a bucket */
    int buckets;
} given;

static ts_code keep(float *values, size_t count, tr_reduce how, ts_status *st)
{
    (void)how, (void)st;
    const size_t at = (size_t)(values - given.block);
    memcpy(given.sent + at, values, count * sizeof *values);
    for (size_t i = 0; i < count; i++) given.has[at + i]++;
    if (count > given.most) given.most = count;
    given.buckets++;
    return TS_OK;
}
static void nothing(void) {}
static const tr_mpi one_rank = {.begin_gradient = keep, .poke = nothing, .complete = nothing};

/* Each gradient is sent once, when it is what it is at the end, and all but the last bucket before backward ends. */
static void check_buckets(const nn_arch *arch, int steps, bool recompute, int fixed, size_t bytes)
{
    float *target;
    ts_status st = {0};
    nn_model *m = create(arch, 3);
    enliven(m);
    if (fixed >= 0) m->fixed[fixed] = true;
    nn_input in = photographs(2, SIDE, 4, &target);
    in.recompute = recompute;
    ag_tape *t = tape_create(true);
    tr_reducer r;
    CHECK(tr_reducer_create(&r, &one_rank, m, bytes, TR_REDUCE_F32, &st) == TS_OK, "%s", st.message);
    ag_watch(t, tr_reduce_walked, &r);
    given.sent = calloc(m->count, sizeof(float));
    given.has = calloc(m->count, 1);
    given.block = m->grad;
    for (int repeat = 0; repeat < 2; repeat++) {
        ag_value *maps[MOST * 2];
        memset(given.has, 0, m->count);
        memset(m->grad, 0, m->count * sizeof(float));
        given.buckets = 0, given.most = 0;
        ag_reset(t);
        nn_lgd(t, m, &in, steps, true, maps, NULL);
        ag_value *goal = ag_constant(t, ts_view(target, maps[0]->t.shape));
        ag_value *loss = ag_add(t, ag_map_loss(t, maps[steps], goal, NULL), ag_map_loss(t, maps[0], goal, NULL));
        tr_reduce_begin(&r);
        ag_backward(t, loss);
        check_tape(t);
        const int early = given.buckets;
        CHECK(tr_reduce_finish(&r, &st) == TS_OK, "%s", st.message);
        CHECK(given.buckets == r.count && early >= r.count - 1, "%d of %d buckets are sent in backward", early,
              r.count);
    }
    size_t largest = 0;
    for (int i = 0; i < m->params; i++) {
        const nn_param *p = &m->param[i];
        int part = NN_G;
        for (size_t first, last; nn_model_range(m, (nn_part)part, &first, &last), p->offset >= last;) part++;
        for (size_t k = p->offset; k < p->offset + p->count; k++) {
            CHECK(given.has[k] == !m->fixed[part], "%s is sent %d times", p->name, given.has[k]);
            CHECK(!given.has[k] || given.sent[k] == m->grad[k], "%s is sent as %g and ends as %g", p->name,
                  (double)given.sent[k], (double)m->grad[k]);
        }
        if (p->count > largest) largest = p->count;
    }
    CHECK(given.most * sizeof(float) < bytes + (largest + 16) * sizeof(float), "a bucket of %zu values", given.most);
    tr_reducer_free(&r);
    free(given.sent), free(given.has), free(target), free(in.image.data);
    ag_tape_destroy(&t);
    nn_model_free(&m);
}

TEST(buckets_are_sent_once_when_they_are_complete)
{
    nn_arch a = tiny();
    for (int recompute = 0; recompute < 2; recompute++) {
        check_buckets(&a, 3, recompute, -1, 0); /* one for each parameter */
        check_buckets(&a, 3, recompute, -1, 4000);
        check_buckets(&a, 3, recompute, -1, 1 << 30);
        check_buckets(&a, 2, recompute, NN_G, 4000);
        check_buckets(&a, 2, recompute, NN_H, 4000);
    }
    a.coarse_steps = 2, a.coarse_size = 12, a.coarse_width = 8, a.coarse_gru = 4;
    for (int recompute = 0; recompute < 2; recompute++) {
        check_buckets(&a, 4, recompute, -1, 0);
        check_buckets(&a, 4, recompute, NN_COARSE, 4000);
    }
}

/* Ranks that share memory: each value is summed once, in the ranks' order, by one that knows that it is its own. */
static void check_parts(int ranks, size_t count)
{
    enum { MOST_RANKS = 5 };
    float *value[MOST_RANKS], *sum = calloc(count, sizeof *sum);
    unsigned char *owners = calloc(count, 1);
    for (int r = 0; r < ranks; r++) {
        value[r] = numbers((int)count, (uint64_t)(20 + r), -1, 1);
        for (size_t i = 0; i < count; i++) sum[i] += value[r][i];
    }
    for (int r = 0; r < ranks; r++) {
        tr_bucket bucket[] = {{.first = count / 3, .last = count}, {.first = 0, .last = count / 3}};
        const tr_reducer own = {.bucket = bucket, .count = 2, .parts = ranks, .part = r};
        for (int k = 0; k < 2; k++) {
            const size_t all = bucket[k].last - bucket[k].first, from = tr_part(all, ranks, r);
            tr_add_parts(value, ranks, bucket[k].first + from, tr_part(all, ranks, r + 1) - from, value[r]);
        }
        size_t first, last;
        for (int i = 0; first = 1, last = count - 1, tr_reduce_own(&own, i, &first, &last); i++)
            for (size_t v = first; v < last; v++) owners[v] += value[r][v] == sum[v];
    }
    for (size_t i = 0; i < count; i++) {
        int zeros = 0;
        for (int r = 0; r < ranks; r++) zeros += value[r][i] == 0;
        CHECK(owners[i] == (i > 0 && i < count - 1), "value %zu of %zu has %d owners", i, count, owners[i]);
        CHECK(zeros == ranks - 1, "value %zu of %zu is zero in %d of %d ranks", i, count, zeros, ranks);
    }
    for (int r = 0; r < ranks; r++) free(value[r]);
    free(sum), free(owners);
}

TEST(ranks_that_share_memory_sum_each_value_once)
{
    static const size_t counts[] = {3, 16, 100, 4096, 12345};
    for (int ranks = 2; ranks <= 5; ranks++)
        for (int i = 0; i < 5; i++) check_parts(ranks, counts[i]);
    size_t first = 5, last = 9;
    CHECK(tr_reduce_own(&(tr_reducer){0}, 0, &first, &last) && first == 5 && last == 9 &&
              !tr_reduce_own(&(tr_reducer){0}, 1, &first, &last),
          "who shares nothing has %zu to %zu", first, last);
}

typedef struct heard {
    float *grad[8];
    int count, calls;
} heard;
static void hear(float *const *grad, int count, void *user)
{
    heard *h = user;
    h->calls++;
    for (int i = 0; i < count; i++) h->grad[h->count++] = grad[i];
}

TEST(watch_tells_of_each_gradient_once)
{
    float value[3] = {2, 3, 5}, grad[3] = {0};
    heard h = {.count = 0};
    ag_tape *t = tape_create(true);
    ag_watch(t, hear, &h);
    const ts_shape one = {1, 1, 1, 1};
    ag_value *a = ag_parameter(t, ts_view(&value[0], one), &grad[0]);
    ag_value *x = ag_scale(t, a, 2);
    ag_value *b = ag_parameter(t, ts_view(&value[1], one), &grad[1]);
    ag_parameter(t, ts_view(&value[2], one), &grad[2]);                         /* nobody uses it */
    x = ag_add(t, x, ag_add(t, b, ag_parameter(t, ts_view(value, one), grad))); /* the first one again */
    for (int pass = 1; pass < 3; pass++) {                                      /* the tape may be gone through again */
        ag_backward(t, x);
        check_tape(t);
        CHECK(h.count == 3 && h.calls == 3, "%d gradients in %d calls", h.count, h.calls);
        CHECK(h.grad[2] == &grad[0] && grad[0] == 3.0f * (float)pass && grad[1] == (float)pass && grad[2] == 0,
              "%g %g %g", (double)grad[0], (double)grad[1], (double)grad[2]);
        h = (heard){.count = 0};
    }
    ag_tape_destroy(&t);
}

/* Off by a 256th of the magnitudes and of the sum (train/mpi/mpi.h), for any number of ranks. */
TEST(rounded_sums_are_near_the_sums)
{
    enum { COUNT = 1001 };
    static const int ranks[] = {2, 3, 8, 64};
    for (int k = 0; k < 4; k++) {
        const size_t part = tr_rounded_part(COUNT, ranks[k]), padded = part * (size_t)ranks[k];
        uint16_t *sent = malloc((size_t)ranks[k] * padded * sizeof *sent), *from = malloc(padded * sizeof *from),
                 *sums = malloc(padded * sizeof *sums);
        double exact[COUNT] = {0}, magnitude[COUNT] = {0};
        float out[COUNT];
        for (int r = 0; r < ranks[k]; r++) {
            float *v = numbers(COUNT, (uint64_t)(10 + r), -1, 1);
            for (int i = 0; i < COUNT; i++) {
                v[i] *= i % 7 == 0 ? 1e-20f : i % 5 == 0 ? 1e20f : 1;
                exact[i] += (double)v[i], magnitude[i] += fabs((double)v[i]);
            }
            tr_round(v, COUNT, padded, sent + (size_t)r * padded);
            free(v);
        }
        for (int owner = 0; owner < ranks[k]; owner++) { /* what MPI_Alltoall gives it */
            for (int r = 0; r < ranks[k]; r++)
                memcpy(from + (size_t)r * part, sent + (size_t)r * padded + (size_t)owner * part, part * sizeof *from);
            tr_round_sums(from, ranks[k], part, sums + (size_t)owner * part);
        }
        tr_unround(sums, COUNT, out);
        for (int i = 0; i < COUNT; i++)
            CHECK(fabs((double)out[i] - exact[i]) <= (magnitude[i] + fabs(exact[i])) / 256 * 1.001,
                  "value %d of %d ranks is %g, not %g", i, ranks[k], (double)out[i], exact[i]);
        free(sent), free(from), free(sums);
    }
}

TEST(rounding_keeps_what_is_not_finite)
{
    const float in[] = {INFINITY, -INFINITY, NAN, 3.4e38f, 1.00390625f, 1.01171875f};
    uint16_t bits[8], sum[8];
    float out[6];
    tr_round(in, 6, 8, bits);
    tr_unround(bits, 6, out);
    CHECK(out[0] == INFINITY && out[1] == -INFINITY && isnan(out[2]) && out[3] == INFINITY, "%g %g %g %g",
          (double)out[0], (double)out[1], (double)out[2], (double)out[3]);
    CHECK(out[4] == 1 && out[5] == 1.015625f, "ties go to %.9g and %.9g", (double)out[4], (double)out[5]);
    CHECK(bits[6] == 0 && bits[7] == 0, "the padding is not zero");
    tr_round_sums((uint16_t[]){bits[0], bits[2], bits[1], bits[4]}, 2, 2, sum); /* inf - inf, NaN + 1 */
    tr_unround(sum, 2, out);
    CHECK(isnan(out[0]) && isnan(out[1]), "%g %g", (double)out[0], (double)out[1]);
}
