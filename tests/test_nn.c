/* The networks and the unrolled loop: structure, gradients, and the laws that the loop must obey. */
#include "nn/adam.h"
#include "nn/layers.h"
#include "nn/weights.h"
#include "ops.h"
#include "render/losses.h"
#include "render/render.h"
#include "tensor/rng.h"
#include "tensor/threads.h"
#include "tests/published.h"
#include "tests/test.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { SIDE = 16, MOST = 16 };

static nn_arch tiny(void)
{
    nn_arch a = nn_arch_default();
    a.g_width = 4, a.g_width_max = 8, a.g_levels = 2, a.g_size = SIDE, a.h_width = 8, a.h_gru = 4;
    return a;
}

static nn_model *create(const nn_arch *a, uint64_t seed)
{
    ts_status st = {0};
    nn_model *m = nn_model_create(a, &st);
    CHECK(m && !nn_model_train(m, &st), "model: %s", st.message);
    nn_model_init(m, seed);
    return m;
}

/* h begins as the identity; for tests of the loop its changes must count. */
static void enliven(nn_model *m)
{
    const nn_param *p = nn_model_find(m, "h.output.weight");
    for (size_t i = 0; i < p->count; i++) m->value[p->offset + i] *= 200;
}

static ag_tape *tape_create(bool gradients)
{
    ts_status st = {0};
    ag_tape *t = ag_tape_create(gradients, &st);
    CHECK(t, "tape: %s", st.message);
    return t;
}

static float *numbers(size_t count, uint64_t seed, float lo, float hi)
{
    float *p = malloc(count * sizeof *p);
    ts_rng r = ts_rng_make(seed, TS_STREAM_TEST, 0);
    for (size_t i = 0; i < count; i++) p[i] = ts_rng_range(&r, lo, hi);
    return p;
}

/* Flash photographs of random maps of side s. */
static nn_input photographs(int n, int s, uint64_t seed, float **maps)
{
    size_t pixels = (size_t)s * s;
    rd_view flash = rd_flash();
    float *m = numbers((size_t)n * pixels * 9, seed, -0.6f, 0.6f), *image = malloc((size_t)n * pixels * 3 * sizeof *image);
    for (int i = 0; i < n; i++) rd_render(rd_grid_full(s), m + (size_t)i * pixels * 9, 9, &flash, true, image + (size_t)i * pixels * 3);
    if (maps) *maps = m;
    else free(m);
    return (nn_input){ts_view(image, (ts_shape){n, s, s, 3}), rd_grid_full(s), flash};
}

static void check_tape(const ag_tape *t) { CHECK(!ag_status(t)->code, "tape: %s", ag_status(t)->message); }

static bool same(const ag_value *a, const ag_value *b)
{
    return ts_same(a->t.shape, b->t.shape) && !memcmp(a->t.data, b->t.data, (size_t)ts_count(a->t.shape) * sizeof(float));
}

TEST(nn_trial_model_has_the_size_of_the_design)
{
    ts_status st = {0};
    nn_arch a = nn_arch_default();
    nn_model *m = nn_model_plan(&a, &st);
    CHECK(m, "%s", st.message);
    size_t g = nn_model_numbers(m, false), h = nn_model_numbers(m, true), first, last;
    printf("  trial model: g %zu, h %zu numbers\n", g, h);
    CHECK(g > 2000000 && g < 2200000, "g has %zu numbers, not the 2.2 M of the trial less the linear layers that it never used", g);
    CHECK(h > 68500 && h < 69500, "h has %zu numbers, not about 69 k", h);
    CHECK(!m->value, "a plan holds no values");
    nn_model_range(m, false, &first, &last);
    CHECK(first == 0 && last >= g && last < g + 16 * 80, "g's range is [%zu, %zu)", first, last);
    nn_model_range(m, true, &first, &last);
    CHECK(last == m->count && last - first >= h, "h's range is [%zu, %zu) of %zu", first, last, m->count);
    for (int i = 0; i < m->params; i++) {
        CHECK(m->param[i].offset % 16 == 0, "%s is not aligned", m->param[i].name);
        CHECK(nn_model_find(m, m->param[i].name) == &m->param[i], "%s is there twice", m->param[i].name);
    }
    CHECK(!nn_model_find(m, "g.down6.conv1.weight"), "five levels have no sixth block");
    nn_model_free(&m);
}

TEST(nn_published_architecture_has_the_published_tensors)
{
    char path[1024], line[256], name[160], shape[64], ours[160];
    snprintf(path, sizeof path, "%s/paper_tensors.tsv", test_fixtures());
    FILE *f = fopen(path, "r");
    if (!f) test_skip("%s is absent", path);
    nn_arch a = published_arch();
    ts_status st = {0};
    nn_model *m = nn_model_plan(&a, &st);
    CHECK(m, "%s", st.message);
    size_t total = 0, unused = 0;
    int used = 0;
    while (fgets(line, sizeof line, f)) {
        CHECK(sscanf(line, "%159s %63s", name, shape) == 2, "line %s", line);
        char has[64] = "";
        size_t count = 1;
        for (char *p = shape; *p; p++) {
            count *= strtoul(p, &p, 10);
            if (!*p) break;
        }
        total += count;
        if (!published_name(name, ours, sizeof ours)) {
            unused += count;
            continue;
        }
        const nn_param *p = nn_model_find(m, ours);
        CHECK(p, "%s: there is no %s", name, ours);
        for (int i = 0; i < p->rank; i++) snprintf(has + strlen(has), sizeof has - strlen(has), "%s%d", i ? "x" : "", p->dim[i]);
        CHECK(!strcmp(has, shape), "%s is %s, %s is %s", name, shape, ours, has);
        used++;
    }
    fclose(f);
    CHECK(total == 160147298, "the list has %zu numbers", total);
    CHECK(used == m->params, "%d tensors are used, the model has %d", used, m->params);
    CHECK(nn_model_numbers(m, false) + nn_model_numbers(m, true) == total - unused, "numbers: %zu and %zu, not %zu", nn_model_numbers(m, false),
          nn_model_numbers(m, true), total - unused);
    CHECK(nn_model_numbers(m, true) == 405376, "h has %zu numbers", nn_model_numbers(m, true));
    nn_model_free(&m);
}

TEST(nn_arch_check_names_the_key)
{
    static const struct {
        const char *key;
        size_t at;
        int value;
    } bad[] = {{"channels", offsetof(nn_arch, channels), 8},        {"g_width", offsetof(nn_arch, g_width), 0},     {"g_width_max", offsetof(nn_arch, g_width_max), 8},
               {"g_levels", offsetof(nn_arch, g_levels), 9},        {"g_kernel", offsetof(nn_arch, g_kernel), 4},   {"g_kernel_first", offsetof(nn_arch, g_kernel_first), 2},
               {"g_size", offsetof(nn_arch, g_size), 48},           {"h_width", offsetof(nn_arch, h_width), -1},    {"h_gru", offsetof(nn_arch, h_gru), 0},
               {"iterations", offsetof(nn_arch, iterations), -1},   {"iterations", offsetof(nn_arch, h_width), 0}};
    nn_arch a = nn_arch_default();
    ts_status st = {0};
    CHECK(!nn_arch_check(&a, &st), "%s", st.message);
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        a = nn_arch_default();
        *(int *)((char *)&a + bad[i].at) = bad[i].value;
        st = (ts_status){0};
        CHECK(nn_arch_check(&a, &st) == TS_INVALID && strstr(st.message, bad[i].key), "%s = %d gives '%s'", bad[i].key, bad[i].value, st.message);
        CHECK(!nn_model_create(&a, &st), "a model of a bad architecture");
    }
}

TEST(nn_init_statistics)
{
    nn_arch a = nn_arch_default();
    nn_model *m = create(&a, 1), *again = create(&a, 1), *other = create(&a, 2);
    CHECK(!memcmp(m->value, again->value, m->count * sizeof(float)), "the same seed gives other values");
    for (int i = 0; i < m->params; i++) {
        const nn_param *p = &m->param[i];
        const float *v = m->value + p->offset;
        double sum = 0, square = 0, fan_in = (double)p->count / p->dim[0], sigma;
        for (size_t j = 0; j < p->count; j++) sum += v[j], square += (double)v[j] * v[j];
        if (p->rank == 1) {
            CHECK(square == 0, "%s is not zero", p->name);
            continue;
        }
        CHECK(memcmp(v, other->value + p->offset, p->count * sizeof *v), "%s is the same for another seed", p->name);
        if (strstr(p->name, ".hh.")) {
            int n = p->dim[1];
            for (int gate = 0; gate < 3; gate++)
                for (int r = 0; r < n; r++)
                    for (int s = 0; s <= r; s++) {
                        double dot = 0;
                        for (int c = 0; c < n; c++) dot += (double)v[(gate * n + r) * n + c] * v[(gate * n + s) * n + c];
                        CHECK(fabs(dot - (r == s)) < 1e-5, "%s gate %d: rows %d and %d have the product %g", p->name, gate, r, s, dot);
                    }
            continue;
        }
        if (p->count < 400) continue;
        sigma = sqrt(square / (double)p->count);
        if (!strcmp(p->name, "h.output.weight")) CHECK(fabs(sigma / 1e-3 - 1) < 0.1, "h's last layer has sigma %g", sigma);
        else if (!strncmp(p->name, "h.conv", 6)) CHECK(fabs(sigma * sqrt(fan_in / 2) - 1) < 0.1, "%s has sigma %g", p->name, sigma);
        else if (strstr(p->name, ".conv2.weight") && p->count > 4000)
            CHECK(fabs(sigma * sqrt(fan_in * 1.04 / 2) - 1) < 0.1, "%s has sigma %g", p->name, sigma);
        CHECK(fabs(sum / (double)p->count) < 5 * sigma / sqrt((double)p->count), "%s has mean %g", p->name, sum / (double)p->count);
    }
    nn_model_free(&m);
    nn_model_free(&again);
    nn_model_free(&other);
    CHECK(!m, "free leaves the pointer");
}

/* A scalar that every value of maps moves in its own way. */
static ag_value *projection(ag_tape *t, ag_value *maps)
{
    static float kernel[5 * 10 * 9], row[5];
    ts_rng r = ts_rng_make(77, TS_STREAM_TEST, 1);
    int c = maps->t.shape.c;
    for (int i = 0; i < 5 * c * 9; i++) kernel[i] = 0.3f * ts_rng_normal(&r);
    for (int i = 0; i < 5; i++) row[i] = ts_rng_normal(&r);
    ag_value *y = ag_conv(t, maps, ag_constant(t, ts_view(kernel, (ts_shape){5, c, 3, 3})), NULL, 1, TS_PAD_ZERO, 1);
    return ag_linear(t, ag_channel_mean(t, ag_tanh(t, y)), ag_constant(t, ts_view(row, (ts_shape){1, 1, 1, 5})), NULL);
}

/* The loop with given gradients instead of the renderer's; frozen NULL: the renderer's. */
static ag_value *loop(ag_tape *t, const nn_model *m, const nn_input *in, int steps, float *const *frozen)
{
    ag_value *maps[MOST + 1];
    if (!frozen) {
        nn_lgd(t, m, in, steps, true, maps, NULL, NULL);
        check_tape(t);
        return maps[steps];
    }
    ag_value *now = nn_predict(t, m, in), *gru[2] = {NULL, NULL};
    for (int i = 0; i < steps; i++) now = ag_add(t, now, nn_refiner(t, m, ag_concat(t, now, ag_constant(t, ts_view(frozen[i], now->t.shape))), gru));
    check_tape(t);
    return now;
}

static double value_of(ag_tape *t, const nn_model *m, const nn_input *in, int steps, float *const *frozen)
{
    ag_reset(t);
    ag_value *loss = projection(t, loop(t, m, in, steps, frozen));
    check_tape(t);
    return loss->t.data[0];
}

/* Analytic against central differences along a random direction inside each parameter in turn. */
static void check_directions(nn_model *m, const nn_input *in, int steps, float *const *frozen)
{
    ts_threads_set(1); /* thousands of tiny loops: waiting for each other would take most of the time */
    ag_tape *train = tape_create(true), *infer = tape_create(false);
    ag_value *loss = projection(train, loop(train, m, in, steps, frozen));
    CHECK(!ag_backward(train, loss), "backward: %s", ag_status(train)->message);
    float *start = malloc(m->count * sizeof *start);
    memcpy(start, m->value, m->count * sizeof *start);
    double whole = nn_gradient_norm(m, 0, m->count), worst = 0;
    CHECK(whole > 1e-3, "the gradient is %g", whole);
    for (int i = 0; i < m->params; i++) {
        const nn_param *p = &m->param[i];
        ts_rng r = ts_rng_make(5, TS_STREAM_TEST, (uint64_t)i);
        float *v = m->value + p->offset, *d = malloc(p->count * sizeof *d);
        double slope = 0, length = 0, best = INFINITY, tried = 0;
        for (size_t j = 0; j < p->count; j++) {
            d[j] = ts_rng_normal(&r) + (m->grad[p->offset + j] > 0 ? 1.0f : -1.0f); /* partly along the gradient: a slope that rounding does not hide */
            length += (double)d[j] * d[j];
        }
        for (size_t j = 0; j < p->count; j++) slope += d[j] / sqrt(length) * m->grad[p->offset + j];
        for (double e = 0.02; e > 0.001; e /= 2) { /* where a kink or curvature disturbs one step it does not disturb all */
            double f[2];
            for (int s = 0; s < 2; s++) {
                for (size_t j = 0; j < p->count; j++) v[j] = (float)(start[p->offset + j] + (s ? e : -e) * d[j] / sqrt(length));
                f[s] = value_of(infer, m, in, steps, frozen);
            }
            tried = (f[1] - f[0]) / (2 * e);
            best = fmin(best, fabs(tried - slope));
        }
        memcpy(v, start + p->offset, p->count * sizeof *v);
        worst = fmax(worst, best / (fabs(slope) + 1e-2 * whole));
        CHECK(best < 0.02 * fabs(slope) + 3e-4 * whole + 2e-5, "%s: slope %g, differences give %g (last), error %g, whole gradient %g", p->name, slope,
              tried, best, whole);
        free(d);
    }
    printf("  worst relative error %.2g\n", worst);
    free(start);
    ag_tape_destroy(&train);
    ag_tape_destroy(&infer);
}

TEST(nn_whole_loop_gradient_without_the_renderer)
{
    nn_arch a = tiny();
    a.gradient = false;
    nn_model *m = create(&a, 3);
    enliven(m);
    nn_input in = photographs(1, SIDE, 1, NULL);
    check_directions(m, &in, 3, NULL);
}

TEST(nn_whole_loop_gradient_with_resampling)
{
    nn_arch a = tiny();
    a.gradient = false, a.recurrent = false, a.mean_before_norm = false;
    nn_model *m = create(&a, 4);
    enliven(m);
    nn_input in = photographs(1, 24, 2, NULL);
    check_directions(m, &in, 2, NULL);
}

/* The renderer's gradient is a constant for back-propagation: the loop's gradient is that of a loop to which the same numbers are given,
 * bit for bit, and that loop's is right. */
TEST(nn_renderer_gradient_is_a_constant)
{
    enum { STEPS = 3 };
    nn_arch a = tiny();
    nn_model *m = create(&a, 6);
    enliven(m);
    nn_input in = photographs(1, SIDE, 3, NULL);
    size_t values = (size_t)SIDE * SIDE * 9;
    float *frozen[STEPS], *first = malloc(m->count * sizeof *first);
    ag_tape *t = tape_create(true);
    ag_value *maps[STEPS + 1];
    CHECK(!nn_lgd(t, m, &in, STEPS, true, maps, NULL, NULL), "%s", ag_status(t)->message);
    double rmse0, rmse;
    rd_flash_rmse(in.grid, maps[0]->t.data, 9, &in.view, in.image.data, &rmse0);
    for (int i = 0; i < STEPS; i++) {
        frozen[i] = malloc(values * sizeof(float));
        rd_flash_gradient(in.grid, maps[i]->t.data, 9, &in.view, in.image.data, rmse0, frozen[i], &rmse);
    }
    ag_value *loss = projection(t, maps[STEPS]);
    CHECK(!ag_backward(t, loss), "%s", ag_status(t)->message);
    memcpy(first, m->grad, m->count * sizeof *first);
    memset(m->grad, 0, m->count * sizeof *first);
    float expected = loss->t.data[0];
    ag_reset(t);
    loss = projection(t, loop(t, m, &in, STEPS, frozen));
    CHECK(loss->t.data[0] == expected, "the loop gives %g, the same with given gradients %g", (double)expected, (double)loss->t.data[0]);
    CHECK(!ag_backward(t, loss), "%s", ag_status(t)->message);
    CHECK(!memcmp(first, m->grad, m->count * sizeof *first), "the gradients differ");
    memset(m->grad, 0, m->count * sizeof *first);
    check_directions(m, &in, STEPS, frozen);
}

TEST(nn_loop_is_the_same_however_it_is_run)
{
    enum { STEPS = 4 };
    for (int variant = 0; variant < 4; variant++) {
        nn_arch a = tiny();
        a.recurrent = variant & 1, a.rmse = variant & 2 ? NN_RMSE_BATCH : NN_RMSE_START;
        nn_model *m = create(&a, 7);
        enliven(m);
        nn_input in = photographs(2, 24, 4, NULL);
        ag_tape *train = tape_create(true), *longer = tape_create(true), *infer = tape_create(false), *last = tape_create(false);
        ag_value *x[STEPS + 1], *y[STEPS + 2], *z[STEPS + 1], *w = NULL;
        CHECK(!nn_lgd(train, m, &in, STEPS, true, x, NULL, NULL), "%s", ag_status(train)->message);
        CHECK(!nn_lgd(longer, m, &in, STEPS + 1, true, y, NULL, NULL), "%s", ag_status(longer)->message);
        CHECK(!nn_lgd(infer, m, &in, STEPS, true, z, NULL, NULL), "%s", ag_status(infer)->message);
        CHECK(!nn_lgd(last, m, &in, STEPS, false, &w, NULL, NULL), "%s", ag_status(last)->message);
        for (int i = 0; i <= STEPS; i++) {
            CHECK(same(x[i], y[i]), "R_%d depends on the number of steps (variant %d)", i, variant);
            CHECK(same(x[i], z[i]), "R_%d is another one without gradients (variant %d)", i, variant);
            CHECK(i == 0 || !same(x[i], x[i - 1]), "step %d changes nothing", i);
        }
        CHECK(same(w, x[STEPS]), "R_T is another one when only it is kept (variant %d)", variant);
        nn_model_free(&m);
    }
}

TEST(nn_memory_of_inference_does_not_grow_with_steps)
{
    nn_arch a = tiny();
    nn_model *m = create(&a, 8);
    nn_input in = photographs(1, 64, 5, NULL);
    size_t peak[3], kept = (size_t)64 * 64 * 9 * sizeof(float);
    ag_value *maps[MOST + 1];
    for (int i = 0; i < 3; i++) {
        ag_tape *t = tape_create(false);
        CHECK(!nn_lgd(t, m, &in, i ? 12 : 2, i == 2, maps, NULL, NULL), "%s", ag_status(t)->message);
        peak[i] = ts_arena_peak(ag_arena(t));
        ag_tape_destroy(&t);
    }
    CHECK(peak[1] == peak[0], "2 steps take %zu bytes, 12 steps %zu", peak[0], peak[1]);
    CHECK(peak[2] <= peak[0] + 12 * (kept + 4096), "12 steps that are all kept take %zu bytes, %zu without", peak[2], peak[0]);
}

typedef struct seen {
    int count, stop;
    float first[MOST + 1];
} seen;

static bool watch(int step, const ag_value *maps, void *user)
{
    seen *s = user;
    CHECK(step == s->count, "step %d is told as number %d", step, s->count);
    s->first[s->count++] = maps->t.data[5];
    return step < s->stop;
}

TEST(nn_after_sees_every_step_and_can_stop)
{
    nn_arch a = tiny();
    nn_model *m = create(&a, 9);
    enliven(m);
    nn_input in = photographs(1, SIDE, 6, NULL);
    for (int gradients = 0; gradients < 2; gradients++) {
        ag_tape *t = tape_create(gradients);
        ag_value *maps[7];
        seen s = {0, 3, {0}};
        CHECK(!nn_lgd(t, m, &in, 6, true, maps, watch, &s), "%s", ag_status(t)->message);
        CHECK(s.count == 4, "%d calls, not 4", s.count);
        for (int i = 0; i < 4; i++) CHECK(s.first[i] == maps[i]->t.data[5], "step %d was told other maps", i);
        for (int i = 4; i <= 6; i++) CHECK(maps[i] == maps[3], "R_%d after the stop is not R_3", i);
        ag_reset(t);
        s = (seen){0, 0, {0}};
        CHECK(!nn_lgd(t, m, &in, 6, false, maps, watch, &s) && s.count == 1 && same(maps[0], maps[0]), "stopped at R_0");
        CHECK(maps[0]->t.data[5] == s.first[0], "R_0 is what is left");
    }
}

TEST(nn_same_bytes_for_any_number_of_threads)
{
    static const int threads[] = {1, 2, 3, 7};
    nn_arch a = tiny();
    float *first = NULL, *target;
    nn_input in = photographs(2, SIDE, 7, &target);
    for (int i = 0; i < 4; i++) {
        ts_threads_set(threads[i]);
        nn_model *m = create(&a, 10);
        nn_adam adam;
        ts_status st = {0};
        enliven(m);
        CHECK(!nn_adam_create(&adam, m, 0.9f, &st), "%s", st.message);
        ag_tape *t = tape_create(true);
        for (int step = 0; step < 2; step++) {
            ag_value *maps[4];
            ag_reset(t);
            nn_lgd(t, m, &in, 3, true, maps, NULL, NULL);
            ag_value *goal = ag_constant(t, ts_view(target, (ts_shape){2, SIDE, SIDE, 9}));
            CHECK(!ag_backward(t, ag_map_loss(t, maps[3], goal)), "%s", ag_status(t)->message);
            double norm = nn_gradient_norm(m, 0, m->count);
            nn_adam_step(&adam, m, 0, m->count, 1e-2f, (float)(1 / norm));
        }
        if (!first) {
            first = malloc(2 * m->count * sizeof *first);
            memcpy(first, m->value, m->count * sizeof *first);
            memcpy(first + m->count, adam.ema, m->count * sizeof *first);
        }
        CHECK(!memcmp(first, m->value, m->count * sizeof *first), "other weights with %d threads", threads[i]);
        CHECK(!memcmp(first + m->count, adam.ema, m->count * sizeof *first), "another average with %d threads", threads[i]);
        ag_tape_destroy(&t);
        nn_adam_free(&adam);
        nn_model_free(&m);
    }
}

/* h knows nothing of places: what it does to a shifted input is shifted, away from the borders. */
TEST(nn_refiner_is_translation_equivariant)
{
    enum { H = 40, W = 37, DY = 3, DX = 5, C = 18, REACH = 10 /* two steps of 2 + 2 + 1 pixels */ };
    nn_arch a = tiny();
    nn_model *m = create(&a, 11);
    enliven(m);
    float *big = numbers((size_t)(H + DY) * (W + DX) * C, 12, -1, 1);
    ts_tensor whole = ts_view(big, (ts_shape){1, H + DY, W + DX, C});
    ag_tape *t = tape_create(false);
    ag_value *out[2];
    for (int s = 0; s < 2; s++) {
        ag_value *x = ag_empty(t, (ts_shape){1, H, W, C}), *gru[2] = {NULL, NULL};
        ts_tensor part = ts_window(&whole, s * DY, s * DX, H, W);
        ts_copy(&x->t, &part);
        nn_refiner(t, m, x, gru);
        out[s] = nn_refiner(t, m, x, gru);
    }
    check_tape(t);
    double size = 0;
    for (int i = REACH; i < H - REACH - DY; i++)
        for (int j = REACH; j < W - REACH - DX; j++)
            for (int c = 0; c < 9; c++) {
                double p = out[0]->t.data[((i + DY) * W + j + DX) * 9 + c], q = out[1]->t.data[(i * W + j) * 9 + c];
                CHECK(fabs(p - q) < 1e-5, "row %d, column %d, channel %d: %g and %g", i, j, c, p, q);
                size = fmax(size, fabs(p));
            }
    CHECK(size > 0.01, "the changes are too small to say anything: %g", size);
}

static void scale(nn_model *m, const char *name, float factor)
{
    const nn_param *p = nn_model_find(m, name);
    CHECK(p, "no parameter %s", name);
    for (size_t i = 0; i < p->count; i++) m->value[p->offset + i] *= factor;
}

/* The hidden gates' weights matter from the second step on, and only to a network that carries its state; biases always. */
TEST(nn_state_is_carried_when_recurrent)
{
    for (int recurrent = 0; recurrent < 2; recurrent++) {
        nn_arch a = tiny();
        a.recurrent = recurrent;
        nn_model *m = create(&a, 13);
        enliven(m);
        nn_input in = photographs(1, SIDE, 8, NULL);
        ag_value *x[3], *y[3], *z[3], **maps[3] = {x, y, z};
        const nn_param *b = nn_model_find(m, "h.gru2.hh.bias");
        for (int i = 0; i < 3; i++) {
            if (i == 1) scale(m, "h.gru1.hh.weight", 3);
            for (size_t j = 0; i == 2 && j < b->count; j++) m->value[b->offset + j] = 0.5f;
            ag_tape *t = tape_create(false); /* a tape keeps packed weights: changed ones need another */
            CHECK(!nn_lgd(t, m, &in, 2, true, maps[i], NULL, NULL), "%s", ag_status(t)->message);
        }
        CHECK(same(x[1], y[1]), "hidden weights matter in the first step");
        CHECK(same(x[2], y[2]) == !recurrent, "recurrent %d: hidden weights %s in the second step", recurrent, recurrent ? "do not matter" : "matter");
        CHECK(!same(x[1], z[1]), "the hidden bias does not matter");
    }
}

/* After the normalisation a mean is zero: in the published network the mean's weights of every normalised block do nothing. */
TEST(nn_global_mean_before_or_after_the_norm)
{
    for (int before = 0; before < 2; before++) {
        nn_arch a = tiny();
        a.mean_before_norm = before;
        nn_model *m = create(&a, 14);
        nn_input in = photographs(1, SIDE, 9, NULL);
        ag_tape *t = tape_create(false);
        ag_value *x = nn_predict(t, m, &in);
        const nn_param *p = nn_model_find(m, "g.down1.global.weight");
        for (int o = 0; o < p->dim[0]; o++)
            for (int i = 0; i < p->dim[0]; i++) m->value[p->offset + (size_t)o * p->dim[1] + i] += 1; /* the mean comes first */
        ag_tape *u = tape_create(false);
        ag_value *y = nn_predict(u, m, &in);
        check_tape(t);
        check_tape(u);
        double difference = 0;
        for (int64_t i = 0; i < ts_count(x->t.shape); i++) difference = fmax(difference, fabs((double)x->t.data[i] - y->t.data[i]));
        if (before) CHECK(difference > 1e-2, "the mean moves the maps by %g only", difference);
        else CHECK(difference < 1e-4, "a zero mean moves the maps by %g", difference);
    }
}

/* The published form: d RMSE of the whole batch, times 1e5, anew at every step. */
TEST(nn_batch_rmse_couples_the_batch)
{
    nn_arch a = tiny();
    a.rmse = NN_RMSE_BATCH;
    nn_model *m = create(&a, 15);
    enliven(m);
    nn_input in = photographs(2, SIDE, 10, NULL);
    ag_tape *t = tape_create(false);
    ag_value *maps[3], *gru[2] = {NULL, NULL};
    CHECK(!nn_lgd(t, m, &in, 1, true, maps, NULL, NULL), "%s", ag_status(t)->message);
    size_t one = (size_t)SIDE * SIDE * 9, image = (size_t)SIDE * SIDE * 3;
    double r[2];
    for (int i = 0; i < 2; i++) rd_flash_rmse(in.grid, maps[0]->t.data + i * one, 9, &in.view, in.image.data + i * image, &r[i]);
    double whole = sqrt((r[0] * r[0] + r[1] * r[1]) / 2);
    float *g = malloc(2 * one * sizeof *g);
    for (int i = 0; i < 2; i++) rd_flash_gradient(in.grid, maps[0]->t.data + i * one, 9, &in.view, in.image.data + i * image, whole, g + i * one, NULL);
    for (size_t i = 0; i < 2 * one; i++) g[i] *= 256.0f * 256 / (2 * SIDE * SIDE);
    ag_value *x = ag_concat(t, maps[0], ag_constant(t, ts_view(g, (ts_shape){2, SIDE, SIDE, 9})));
    ag_value *y = ag_add(t, maps[0], nn_refiner(t, m, x, gru));
    check_tape(t);
    for (int64_t i = 0; i < ts_count(y->t.shape); i++)
        CHECK(fabsf(y->t.data[i] - maps[1]->t.data[i]) < 1e-5f, "value %lld: %g, not %g", (long long)i, (double)maps[1]->t.data[i], (double)y->t.data[i]);
}

TEST(nn_images_of_a_batch_do_not_meet)
{
    nn_arch a = tiny();
    nn_model *m = create(&a, 16);
    enliven(m);
    nn_input in = photographs(3, SIDE, 11, NULL), alone = in;
    alone.image = ts_images(&in.image, 1, 1);
    ag_tape *t = tape_create(false);
    ag_value *x = NULL, *y = NULL;
    nn_lgd(t, m, &in, 2, false, &x, NULL, NULL);
    nn_lgd(t, m, &alone, 2, false, &y, NULL, NULL);
    check_tape(t);
    for (int64_t i = 0; i < ts_count(y->t.shape); i++)
        CHECK(fabsf(y->t.data[i] - x->t.data[ts_count(y->t.shape) + i]) < 1e-5f, "value %lld depends on the rest of the batch", (long long)i);
}

TEST(nn_wrong_input_is_an_error_with_a_message)
{
    nn_arch a = tiny();
    a.h_width = 0, a.iterations = 0;
    nn_model *m = create(&a, 17);
    nn_input in = photographs(1, SIDE, 12, NULL), bad = in;
    ag_tape *t = tape_create(false);
    ag_value *maps[3];
    CHECK(nn_lgd(t, m, &in, 0, false, maps, NULL, NULL) == TS_OK && maps[0], "g alone: %s", ag_status(t)->message);
    CHECK(nn_lgd(t, m, &in, 2, true, maps, NULL, NULL) == TS_INVALID && strstr(ag_status(t)->message, "refiner"), "'%s'", ag_status(t)->message);
    ag_reset(t);
    bad.grid = rd_grid_full(SIDE + 1);
    CHECK(nn_lgd(t, m, &bad, 0, false, maps, NULL, NULL) == TS_INVALID && strstr(ag_status(t)->message, "17"), "'%s'", ag_status(t)->message);
    ag_reset(t);
    bad = in;
    bad.grid.h = SIDE / 2;
    bad.image = ts_view(in.image.data, (ts_shape){1, SIDE / 2, SIDE, 3});
    CHECK(nn_lgd(t, m, &bad, 0, false, maps, NULL, NULL) == TS_INVALID && strstr(ag_status(t)->message, "square"), "'%s'", ag_status(t)->message);
}

TEST(nn_tiny_network_learns_one_material)
{
    nn_arch a = tiny();
    nn_model *m = create(&a, 18);
    float *target;
    nn_input in = photographs(1, SIDE, 13, &target);
    for (int i = 0; i < SIDE * SIDE * 9; i++) target[i] = i % 9 == 5 ? 0.4f : 0.3f * (float)(i % 9) / 9; /* a plain surface of its own */
    rd_render(in.grid, target, 9, &in.view, true, in.image.data);
    nn_adam adam;
    ts_status st = {0};
    CHECK(!nn_adam_create(&adam, m, 0, &st), "%s", st.message);
    ag_tape *t = tape_create(true);
    double first = 0, last = 0;
    for (int step = 0; step < 60; step++) {
        ag_value *maps[3];
        ag_reset(t);
        nn_lgd(t, m, &in, 2, true, maps, NULL, NULL);
        ag_value *loss = ag_map_loss(t, maps[2], ag_constant(t, ts_view(target, (ts_shape){1, SIDE, SIDE, 9})));
        CHECK(!ag_backward(t, loss), "%s", ag_status(t)->message);
        last = loss->t.data[0];
        if (!step) first = last;
        double norm = nn_gradient_norm(m, 0, m->count);
        CHECK(isfinite(norm), "the gradient is not finite at step %d", step);
        nn_adam_step(&adam, m, 0, m->count, nn_learning_rate(2e-2f, 0, step, 5, 60), norm > 1 ? (float)(1 / norm) : 1);
    }
    printf("  loss %.4f -> %.4f\n", first, last);
    CHECK(last < 0.25 * first, "60 steps take the loss from %g to %g only", first, last);
}

TEST(nn_adam_is_the_papers)
{
    nn_arch a = tiny();
    nn_model *m = create(&a, 19);
    nn_adam adam;
    ts_status st = {0};
    CHECK(!nn_adam_create(&adam, m, 0.5f, &st), "%s", st.message);
    size_t first, last;
    nn_model_range(m, false, &first, &last);
    double *w = malloc(last * sizeof *w), *mean = calloc(last, sizeof *w), *square = calloc(last, sizeof *w), *ema = malloc(last * sizeof *w);
    float *rest = malloc(m->count * sizeof *rest);
    memcpy(rest, m->value, m->count * sizeof *rest);
    for (size_t i = 0; i < last; i++) w[i] = ema[i] = m->value[i];
    ts_rng r = ts_rng_make(20, TS_STREAM_TEST, 0);
    for (int step = 1; step <= 5; step++) {
        double decay = fmin(0.5, (1.0 + step) / (10.0 + step)), sum = 0;
        for (size_t i = 0; i < m->count; i++) m->grad[i] = ts_rng_normal(&r);
        for (size_t i = 0; i < last; i++) {
            double g = 0.5 * m->grad[i];
            sum += 4 * g * g;
            mean[i] = 0.9 * mean[i] + 0.1 * g;
            square[i] = 0.999 * square[i] + 0.001 * g * g;
            w[i] -= 0.01 * (mean[i] / (1 - pow(0.9, step))) / (sqrt(square[i] / (1 - pow(0.999, step))) + 1e-8);
            ema[i] = decay * ema[i] + (1 - decay) * w[i];
        }
        CHECK(fabs(nn_gradient_norm(m, first, last) / sqrt(sum) - 1) < 1e-12, "the norm is %g, not %g", nn_gradient_norm(m, first, last), sqrt(sum));
        nn_adam_step(&adam, m, first, last, 0.01f, 0.5f);
        for (size_t i = 0; i < last; i++) CHECK(m->grad[i] == 0, "a gradient is left");
        CHECK(m->grad[last] != 0, "a gradient outside of the range is gone");
    }
    CHECK(adam.step == 5, "%lld steps", (long long)adam.step);
    for (size_t i = 0; i < last; i++) {
        CHECK(fabs(m->value[i] - w[i]) < 1e-5, "value %zu is %g, not %g", i, (double)m->value[i], w[i]);
        CHECK(fabs(adam.ema[i] - ema[i]) < 1e-5, "average %zu is %g, not %g", i, (double)adam.ema[i], ema[i]);
    }
    CHECK(!memcmp(rest + last, m->value + last, (m->count - last) * sizeof *rest), "values outside of the range have moved");
    m->grad[last - 1] = NAN;
    CHECK(isnan(nn_gradient_norm(m, first, last)), "the norm hides a NaN");
    m->grad[last - 1] = INFINITY;
    CHECK(!isfinite(nn_gradient_norm(m, first, last)), "the norm hides an infinity");
    nn_adam_free(&adam);
}

TEST(nn_learning_rate_schedule)
{
    float before = 0;
    for (int i = 0; i < 100; i++) {
        float rate = nn_learning_rate(1e-3f, 0, i, 100, 1000);
        CHECK(rate > before && rate <= 1e-3f, "warm-up step %d: %g after %g", i, (double)rate, (double)before);
        before = rate;
    }
    CHECK(before == 1e-3f, "the warm-up ends at %g", (double)before);
    for (int i = 101; i < 1000; i++) {
        float rate = nn_learning_rate(1e-3f, 0.1f, i, 100, 1000);
        CHECK(rate < before && rate >= 1e-4f, "step %d: %g after %g", i, (double)rate, (double)before);
        before = rate;
    }
    CHECK(fabsf(nn_learning_rate(1e-3f, 0.1f, 550, 100, 1000) - 5.5e-4f) < 1e-9f, "the middle is %g", (double)nn_learning_rate(1e-3f, 0.1f, 550, 100, 1000));
    CHECK(nn_learning_rate(1e-3f, 0.1f, 5000, 100, 1000) == 1e-3f * 0.1f, "the end");
    CHECK(nn_learning_rate(1e-3f, 1, 0, 0, 0) == 1e-3f, "no warm-up, no length");
}
