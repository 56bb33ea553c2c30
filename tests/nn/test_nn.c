/* The networks: structure, first values, and the gradient of the whole unrolled loop. */
#include "nn/adam.h"
#include "tensor/threads.h"
#include "tests/support/networks.h"
#include "tests/support/trained.h"
#include <stddef.h>

TEST(nn_trial_model_has_the_size_of_the_design)
{
    ts_status st = {0};
    nn_arch a = nn_arch_default();
    nn_model *m = nn_model_plan(&a, &st);
    CHECK(m, "%s", st.message);
    size_t g = trained_numbers(m, NN_G), h = trained_numbers(m, NN_H), first, last;
    printf("  trial model: g %zu, h %zu numbers\n", g, h);
    CHECK(g > 2000000 && g < 2200000,
          "g has %zu numbers, not the 2.2 M of the trial less the linear layers that it never used", g);
    CHECK(h > 68500 && h < 69500, "h has %zu numbers, not about 69 k", h);
    CHECK(!m->value, "a plan holds no values");
    nn_model_range(m, NN_G, &first, &last);
    CHECK(first == 0 && last >= g && last < g + 16 * 80, "g's range is [%zu, %zu)", first, last);
    nn_model_range(m, NN_H, &first, &last);
    CHECK(last == m->count && last - first >= h, "h's range is [%zu, %zu) of %zu", first, last, m->count);
    for (int i = 0; i < m->params; i++) {
        CHECK(m->param[i].offset % 16 == 0, "%s is not aligned", m->param[i].name);
        CHECK(nn_model_find(m, m->param[i].name) == &m->param[i], "%s is there twice", m->param[i].name);
    }
    CHECK(!nn_model_find(m, "g.down6.conv1.weight"), "five levels have no sixth block");
    nn_model_free(&m);
}

TEST(nn_arch_check_names_the_key)
{
    static const struct {
        const char *key;
        size_t at;
        int value;
    } bad[] = {{"channels", offsetof(nn_arch, channels), 8},
               {"g_width", offsetof(nn_arch, g_width), 0},
               {"g_width_max", offsetof(nn_arch, g_width_max), 8},
               {"g_levels", offsetof(nn_arch, g_levels), 9},
               {"g_kernel", offsetof(nn_arch, g_kernel), 4},
               {"g_kernel_first", offsetof(nn_arch, g_kernel_first), 2},
               {"g_size", offsetof(nn_arch, g_size), 48},
               {"h_width", offsetof(nn_arch, h_width), -1},
               {"h_gru", offsetof(nn_arch, h_gru), 0},
               {"iterations", offsetof(nn_arch, iterations), -1},
               {"coarse_steps", offsetof(nn_arch, coarse_steps), 7}};
    nn_arch a = nn_arch_default();
    ts_status st = {0};
    CHECK(!nn_arch_check(&a, &st), "%s", st.message);
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        a = nn_arch_default();
        *(int *)((char *)&a + bad[i].at) = bad[i].value;
        st = (ts_status){0};
        CHECK(nn_arch_check(&a, &st) == TS_INVALID && strstr(st.message, bad[i].key), "%s = %d gives '%s'", bad[i].key,
              bad[i].value, st.message);
        CHECK(!nn_model_create(&a, &st), "a model of a bad architecture");
    }
    for (int without = 0; without < 3; without++) { /* convolutions; them and the descent; them and the gradient */
        a = nn_arch_default();
        a.h_width = 0;
        if (without == 1) a.descent = NN_DESCENT_NONE;
        if (without == 2) a.gradient = false;
        st = (ts_status){0};
        const bool fine = !nn_arch_check(&a, &st);
        CHECK(without ? !fine && strstr(st.message, "iterations") : fine, "without %d: '%s'", without, st.message);
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
        if (strstr(p->name, ".descent.") || strstr(p->name, ".newton.")) {
            const float diagonal = a.descent == NN_DESCENT_NEWTON ? 0.5f : -0.003f;
            for (int j = 0; j < p->dim[0]; j++)
                for (int k = 0; k < p->dim[1]; k++)
                    CHECK(v[j * p->dim[1] + k] == (j == k ? diagonal : 0), "%s[%d][%d] is %g", p->name, j, k,
                          (double)v[j * p->dim[1] + k]);
            continue;
        }
        CHECK(memcmp(v, other->value + p->offset, p->count * sizeof *v), "%s is the same for another seed", p->name);
        if (strstr(p->name, ".hh.")) {
            int n = p->dim[1];
            for (int gate = 0; gate < 3; gate++)
                for (int r = 0; r < n; r++)
                    for (int s = 0; s <= r; s++) {
                        double dot = 0;
                        for (int c = 0; c < n; c++)
                            dot += (double)v[(gate * n + r) * n + c] * v[(gate * n + s) * n + c];
                        CHECK(fabs(dot - (r == s)) < 1e-5, "%s gate %d: rows %d and %d have the product %g", p->name,
                              gate, r, s, dot);
                    }
            continue;
        }
        if (p->count < 400) continue;
        sigma = sqrt(square / (double)p->count);
        if (!strcmp(p->name, "h.output.weight"))
            CHECK(fabs(sigma / 1e-3 - 1) < 0.1, "h's last layer has sigma %g", sigma);
        else if (!strncmp(p->name, "h.conv", 6))
            CHECK(fabs(sigma * sqrt(fan_in / 2) - 1) < 0.1, "%s has sigma %g", p->name, sigma);
        else if (strstr(p->name, ".conv2.weight") && p->count > 4000)
            CHECK(fabs(sigma * sqrt(fan_in * 1.04 / 2) - 1) < 0.1, "%s has sigma %g", p->name, sigma);
        CHECK(fabs(sum / (double)p->count) < 5 * sigma / sqrt((double)p->count), "%s has mean %g", p->name,
              sum / (double)p->count);
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
        nn_lgd(t, m, in, steps, true, maps, NULL);
        check_tape(t);
        return maps[steps];
    }
    ag_value *now = nn_predict(t, m, in), *gru[2] = {NULL, NULL};
    for (int i = 0; i < steps; i++) {
        ag_value *gradient = ag_constant(t, ts_view(frozen[i], now->t.shape));
        now = nn_step(t, m, &((const nn_layers *)m->layers)->h, now, gradient, gradient, gru, NULL, 1, NULL);
    }
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
            d[j] = ts_rng_normal(&r) +
                (m->grad[p->offset + j] > 0
                     ? 1.0f
                     : -1.0f); /* partly along the gradient: a slope that rounding does not hide */
            length += (double)d[j] * d[j];
        }
        for (size_t j = 0; j < p->count; j++) slope += d[j] / sqrt(length) * m->grad[p->offset + j];
        for (double e = 0.02; e > 0.001;
             e /= 2) { /* where a kink or curvature disturbs one step it does not disturb all */
            double f[2];
            for (int s = 0; s < 2; s++) {
                for (size_t j = 0; j < p->count; j++)
                    v[j] = (float)(start[p->offset + j] + (s ? e : -e) * d[j] / sqrt(length));
                f[s] = value_of(infer, m, in, steps, frozen);
            }
            tried = (f[1] - f[0]) / (2 * e);
            best = fmin(best, fabs(tried - slope));
        }
        memcpy(v, start + p->offset, p->count * sizeof *v);
        worst = fmax(worst, best / (fabs(slope) + 1e-2 * whole));
        CHECK(best < 0.02 * fabs(slope) + 3e-4 * whole + 2e-5,
              "%s: slope %g, differences give %g (last), error %g, whole gradient %g", p->name, slope, tried, best,
              whole);
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

TEST(nn_whole_loop_gradient_with_coarse_steps)
{
    nn_arch a = tiny();
    a.gradient = false, a.coarse_steps = 2, a.coarse_width = 6, a.coarse_gru = 3;
    nn_model *m = create(&a, 5);
    enliven(m);
    nn_input in = photographs(1, 24, 1, NULL);
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

/* The renderer's gradient is a constant for back-propagation: the loop's gradient is that of a loop to which the same
 * numbers are given, bit for bit, and that loop's is right. */
TEST(nn_renderer_gradient_is_a_constant)
{
    enum { STEPS = 3 };
    nn_arch a = tiny();
    a.encoding = NN_GRADIENT_RAW,
    a.descent = NN_DESCENT_GRADIENT; /* the numbers given are those of rd_flash_gradient */
    nn_model *m = create(&a, 6);
    enliven(m);
    nn_input in = photographs(1, SIDE, 3, NULL);
    size_t values = (size_t)SIDE * SIDE * 9;
    float *frozen[STEPS], *first = malloc(m->count * sizeof *first);
    ag_tape *t = tape_create(true);
    ag_value *maps[STEPS + 1];
    CHECK(!nn_lgd(t, m, &in, STEPS, true, maps, NULL), "%s", ag_status(t)->message);
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
    CHECK(loss->t.data[0] == expected, "the loop gives %g, the same with given gradients %g", (double)expected,
          (double)loss->t.data[0]);
    CHECK(!ag_backward(t, loss), "%s", ag_status(t)->message);
    CHECK(!memcmp(first, m->grad, m->count * sizeof *first), "the gradients differ");
    memset(m->grad, 0, m->count * sizeof *first);
    check_directions(m, &in, STEPS, frozen);
}
