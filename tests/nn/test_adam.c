/* Adam, its schedule, and what a few steps of it do to a network. */
#include "nn/adam.h"
#include "render/losses.h"
#include "tensor/threads.h"
#include "tests/support/networks.h"

TEST(nn_tiny_network_learns_one_material)
{
    nn_arch a = tiny();
    nn_model *m = create(&a, 18);
    float *target;
    nn_input in = photographs(1, SIDE, 13, &target);
    for (int i = 0; i < SIDE * SIDE * 9; i++)
        target[i] = i % 9 == 5 ? 0.4f : 0.3f * (float)(i % 9) / 9; /* a plain surface of its own */
    rd_render(in.grid, target, 9, &in.view, true, in.image.data);
    nn_adam adam;
    ts_status st = {0};
    CHECK(!nn_adam_create(&adam, m, 0, &st), "%s", st.message);
    ag_tape *t = tape_create(true);
    double first = 0, last = 0;
    for (int step = 0; step < 60; step++) {
        ag_value *maps[3];
        ag_reset(t);
        nn_lgd(t, m, &in, 2, true, maps, NULL);
        ag_value *loss = ag_map_loss(t, maps[2], ag_constant(t, ts_view(target, (ts_shape){1, SIDE, SIDE, 9})), NULL);
        CHECK(!ag_backward(t, loss), "%s", ag_status(t)->message);
        last = loss->t.data[0];
        if (!step) first = last;
        double norm = nn_gradient_norm(m, 0, m->count);
        CHECK(isfinite(norm), "the gradient is not finite at step %d", step);
        nn_adam_next(&adam);
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
    nn_model_range(m, NN_G, &first, &last);
    double *w = malloc(last * sizeof *w), *mean = calloc(last, sizeof *w), *square = calloc(last, sizeof *w),
           *ema = malloc(last * sizeof *w);
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
        CHECK(fabs(nn_gradient_norm(m, first, last) / sqrt(sum) - 1) < 1e-12, "the norm is %g, not %g",
              nn_gradient_norm(m, first, last), sqrt(sum));
        nn_adam_next(&adam);
        nn_adam_step(&adam, m, first, last, 0.01f, 0.5f);
        for (size_t i = 0; i < last; i++) CHECK(m->grad[i] == 0, "a gradient is left");
        CHECK(m->grad[last] != 0, "a gradient outside of the range is gone");
    }
    CHECK(adam.step == 5, "%lld steps", (long long)adam.step);
    for (size_t i = 0; i < last; i++) {
        CHECK(fabs(m->value[i] - w[i]) < 1e-5, "value %zu is %g, not %g", i, (double)m->value[i], w[i]);
        CHECK(fabs(adam.ema[i] - ema[i]) < 1e-5, "average %zu is %g, not %g", i, (double)adam.ema[i], ema[i]);
    }
    CHECK(!memcmp(rest + last, m->value + last, (m->count - last) * sizeof *rest),
          "values outside of the range have moved");
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
    CHECK(fabsf(nn_learning_rate(1e-3f, 0.1f, 550, 100, 1000) - 5.5e-4f) < 1e-9f, "the middle is %g",
          (double)nn_learning_rate(1e-3f, 0.1f, 550, 100, 1000));
    CHECK(nn_learning_rate(1e-3f, 0.1f, 5000, 100, 1000) == 1e-3f * 0.1f, "the end");
    CHECK(nn_learning_rate(1e-3f, 1, 0, 0, 0) == 1e-3f, "no warm-up, no length");
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
            nn_lgd(t, m, &in, 3, true, maps, NULL);
            ag_value *goal = ag_constant(t, ts_view(target, (ts_shape){2, SIDE, SIDE, 9}));
            CHECK(!ag_backward(t, ag_map_loss(t, maps[3], goal, NULL)), "%s", ag_status(t)->message);
            double norm = nn_gradient_norm(m, 0, m->count);
            nn_adam_next(&adam);
            nn_adam_step(&adam, m, 0, m->count, 1e-2f, (float)(1 / norm));
        }
        if (!first) {
            first = malloc(2 * m->count * sizeof *first);
            memcpy(first, m->value, m->count * sizeof *first);
            memcpy(first + m->count, adam.ema, m->count * sizeof *first);
        }
        CHECK(!memcmp(first, m->value, m->count * sizeof *first), "other weights with %d threads", threads[i]);
        CHECK(!memcmp(first + m->count, adam.ema, m->count * sizeof *first), "another average with %d threads",
              threads[i]);
        ag_tape_destroy(&t);
        nn_adam_free(&adam);
        nn_model_free(&m);
    }
}
