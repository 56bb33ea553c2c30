/* The unrolled loop: the laws that it obeys however it is run. */
#include "tests/support/networks.h"

TEST(nn_loop_is_the_same_however_it_is_run)
{
    enum { STEPS = 4 };
    for (int variant = 0; variant < 8; variant++) {
        nn_arch a = tiny();
        a.recurrent = variant & 1, a.rmse = variant < 6 && variant & 2 ? NN_RMSE_BATCH : NN_RMSE_START;
        if (variant > 5) a.coarse_steps = 2, a.coarse_width = 6, a.coarse_gru = 3;
        if (variant > 3) a.h_width = 0, a.descent = variant & 1 ? NN_DESCENT_GRADIENT : NN_DESCENT_NEWTON;
        nn_model *m = create(&a, 7);
        enliven(m);
        nn_input in = photographs(2, 24, 4, NULL);
        ag_tape *train = tape_create(true), *longer = tape_create(true), *infer = tape_create(false),
                *last = tape_create(false);
        ag_value *x[STEPS + 1], *y[STEPS + 2], *z[STEPS + 1], *w = NULL;
        CHECK(!nn_lgd(train, m, &in, STEPS, true, x, NULL), "%s", ag_status(train)->message);
        CHECK(!nn_lgd(longer, m, &in, STEPS + 1, true, y, NULL), "%s", ag_status(longer)->message);
        CHECK(!nn_lgd(infer, m, &in, STEPS, true, z, NULL), "%s", ag_status(infer)->message);
        CHECK(!nn_lgd(last, m, &in, STEPS, false, &w, NULL), "%s", ag_status(last)->message);
        for (int i = 0; i <= STEPS; i++) {
            CHECK(same(x[i], y[i]), "R_%d depends on the number of steps (variant %d)", i, variant);
            CHECK(same(x[i], z[i]), "R_%d is another one without gradients (variant %d)", i, variant);
            CHECK(i == 0 || !same(x[i], x[i - 1]), "step %d changes nothing", i);
        }
        CHECK(same(w, x[STEPS]), "R_T is another one when only it is kept (variant %d)", variant);
        nn_model_free(&m);
    }
}

TEST(nn_steps_beyond_the_trained_ones_are_shortened)
{
    nn_arch a = tiny();
    a.recurrent = true;
    nn_model *m = create(&a, 7);
    enliven(m);
    nn_input in = photographs(1, 24, 4, NULL);
    for (int variant = 0; variant < 4; variant++) { /* with gradients, without, recomputed, published */
        ag_tape *short_of = tape_create(variant != 1), *whole = tape_create(variant != 1);
        ag_value *x[4], *y[4];
        in.recompute = variant == 2;
        m->arch.compat = variant == 3 ? NN_COMPAT_PUBLISHED : NN_COMPAT_NONE;
        m->arch.iterations = 2;
        CHECK(!nn_lgd(short_of, m, &in, 3, true, x, NULL), "%s", ag_status(short_of)->message);
        m->arch.iterations = 3;
        CHECK(!nn_lgd(whole, m, &in, 3, true, y, NULL), "%s", ag_status(whole)->message);
        CHECK(same(x[2], y[2]), "a trained step is shortened (variant %d)", variant);
        double worst = 0;
        for (int64_t i = 0; i < ts_count(x[3]->t.shape); i++) {
            const double from = x[2]->t.data[i], step = y[3]->t.data[i] - from, weight = variant == 3 ? 1 : 4.0 / 9;
            worst = farther(worst, fabs(x[3]->t.data[i] - (from + weight * step)));
        }
        CHECK(worst < 1e-6 && !same(x[2], x[3]), "the third step of two is off by %g (variant %d)", worst, variant);
        ag_tape_destroy(&short_of);
        ag_tape_destroy(&whole);
    }
    nn_model_free(&m);
}

TEST(nn_memory_of_inference_does_not_grow_with_steps)
{
    nn_arch a = tiny();
    a.iterations = 2; /* those after it are shortened */
    nn_model *m = create(&a, 8);
    nn_input in = photographs(1, 64, 5, NULL);
    size_t peak[3], kept = (size_t)64 * 64 * 9 * sizeof(float);
    ag_value *maps[MOST + 1];
    for (int i = 0; i < 3; i++) {
        ag_tape *t = tape_create(false);
        CHECK(!nn_lgd(t, m, &in, i ? 12 : 3, i == 2, maps, NULL), "%s", ag_status(t)->message);
        peak[i] = ts_arena_peak(ag_arena(t));
        ag_tape_destroy(&t);
    }
    CHECK(peak[1] == peak[0], "3 steps take %zu bytes, 12 steps %zu", peak[0], peak[1]);
    CHECK(peak[2] <= peak[0] + 12 * (kept + 4096), "12 steps that are all kept take %zu bytes, %zu without", peak[2],
          peak[0]);
}

typedef struct seen {
    int count, stop;
    float first[MOST + 1];
} seen;

static bool watch(int step, const ag_value *maps, void *user)
{
    seen *s = user;
    CHECK(step == s->count, "step %d is reported as number %d", step, s->count);
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
        CHECK(!nn_lgd(t, m, &in, 6, true, maps, &(nn_watch){watch, &s, false}), "%s", ag_status(t)->message);
        CHECK(s.count == 4, "%d calls, not 4", s.count);
        for (int i = 0; i < 4; i++) CHECK(s.first[i] == maps[i]->t.data[5], "step %d was reported with other maps", i);
        for (int i = 4; i <= 6; i++) CHECK(maps[i] == maps[3], "R_%d after the stop is not R_3", i);
        ag_reset(t);
        s = (seen){0, 0, {0}};
        CHECK(!nn_lgd(t, m, &in, 6, false, maps, &(nn_watch){watch, &s, false}) && s.count == 1 &&
                  same(maps[0], maps[0]),
              "stopped at R_0");
        CHECK(maps[0]->t.data[5] == s.first[0], "R_0 is what is left");
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
        nn_change(t, m, &((const nn_layers *)m->layers)->h, x, NULL, gru, NULL);
        out[s] = nn_change(t, m, &((const nn_layers *)m->layers)->h, x, NULL, gru, NULL);
    }
    check_tape(t);
    double size = 0;
    for (int i = REACH; i < H - REACH - DY; i++)
        for (int j = REACH; j < W - REACH - DX; j++)
            for (int c = 0; c < 9; c++) {
                double p = out[0]->t.data[((i + DY) * W + j + DX) * 9 + c], q = out[1]->t.data[(i * W + j) * 9 + c];
                CHECK(fabs(p - q) < 1e-5, "row %d, column %d, channel %d: %g and %g", i, j, c, p, q);
                size = farther(size, fabs(p));
            }
    CHECK(size > 0.01, "the changes are too small to say anything: %g", size);
}

/* What is refined in a window is what the whole has there, but for the reach of T steps from the window's border. */
static void check_window(int coarse_steps)
{
    enum { WHOLE = 64, Y0 = 9, X0 = 17, H = 31, W = 40, STEPS = 2, REACH = STEPS * 5 };
    nn_arch a = tiny();
    a.g_size = 32, a.coarse_steps = coarse_steps, a.coarse_width = 6, a.coarse_gru = 3;
    nn_model *m = create(&a, 21);
    enliven(m);
    nn_input whole = photographs(2, WHOLE, 22, NULL), part = whole;
    ts_status st = {0};
    ts_arena *arena = ts_arena_create(1 << 16, &st);
    CHECK(arena, "%s", st.message);
    ts_tensor view = ts_window(&whole.image, Y0, X0, H, W);
    part.whole = whole.image;
    part.image = ts_new(arena, view.shape);
    ts_copy(&part.image, &view);
    part.grid = (rd_grid){.h = H, .w = W, .y0 = Y0, .x0 = X0, .side = WHOLE};
    ag_tape *t[2] = {tape_create(false), tape_create(false)};
    ag_value *maps[2][STEPS + 1];
    nn_lgd(t[0], m, &whole, STEPS, true, maps[0], NULL);
    nn_lgd(t[1], m, &part, STEPS, true, maps[1], NULL);
    check_tape(t[0]);
    check_tape(t[1]);
    double moved = 0;
    for (int k = 0; k <= STEPS; k += STEPS)
        for (int n = 0; n < 2; n++)
            for (int i = k ? REACH : 0; i < H - (k ? REACH : 0); i++)
                for (int j = k ? REACH : 0; j < W - (k ? REACH : 0); j++)
                    for (int c = 0; c < 9; c++) {
                        const int64_t big = (((int64_t)n * WHOLE + i + Y0) * WHOLE + j + X0) * 9 + c,
                                      small = (((int64_t)n * H + i) * W + j) * 9 + c;
                        const double p = maps[0][k]->t.data[big], q = maps[1][k]->t.data[small];
                        CHECK(fabs(p - q) < 1e-5, "R_%d, image %d, row %d, column %d, channel %d: %g and %g", k, n, i,
                              j, c, p, q);
                        moved = farther(moved, fabs(p - maps[0][0]->t.data[big]));
                    }
    CHECK(moved > 0.01, "the refinement is too small to say anything: %g", moved);
    ts_arena_destroy(&arena);
}

TEST(nn_window_equals_the_whole)
{
    for (int coarse = 0; coarse < 2; coarse++) check_window(coarse);
}

static void scale(nn_model *m, const char *name, float factor)
{
    const nn_param *p = nn_model_find(m, name);
    CHECK(p, "no parameter %s", name);
    for (size_t i = 0; i < p->count; i++) m->value[p->offset + i] *= factor;
}

/* The hidden gates' weights matter from the second step on, and only to a network that carries its state; biases
 * always. */
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
            CHECK(!nn_lgd(t, m, &in, 2, true, maps[i], NULL), "%s", ag_status(t)->message);
        }
        CHECK(same(x[1], y[1]), "hidden weights matter in the first step");
        CHECK(same(x[2], y[2]) == !recurrent, "recurrent %d: hidden weights %s in the second step", recurrent,
              recurrent ? "do not matter" : "matter");
        CHECK(!same(x[1], z[1]), "the hidden bias does not matter");
    }
}

/* After the normalisation a mean is zero: in the published network the mean's weights of every normalised block do
 * nothing. */
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
            for (int i = 0; i < p->dim[0]; i++)
                m->value[p->offset + (size_t)o * p->dim[1] + i] += 1; /* the mean comes first */
        ag_tape *u = tape_create(false);
        ag_value *y = nn_predict(u, m, &in);
        check_tape(t);
        check_tape(u);
        double difference = 0;
        for (int64_t i = 0; i < ts_count(x->t.shape); i++)
            difference = farther(difference, fabs((double)x->t.data[i] - y->t.data[i]));
        if (before) CHECK(difference > 1e-2, "the mean moves the maps by %g only", difference);
        else CHECK(difference < 1e-4, "a zero mean moves the maps by %g", difference);
    }
}

/* The published form: d RMSE of the whole batch, times 1e5, anew at every step. */
TEST(nn_batch_rmse_couples_the_batch)
{
    nn_arch a = tiny();
    a.rmse = NN_RMSE_BATCH, a.encoding = NN_GRADIENT_RAW, a.descent = NN_DESCENT_GRADIENT;
    nn_model *m = create(&a, 15);
    enliven(m);
    nn_input in = photographs(2, SIDE, 10, NULL);
    ag_tape *t = tape_create(false);
    ag_value *maps[3], *gru[2] = {NULL, NULL};
    CHECK(!nn_lgd(t, m, &in, 1, true, maps, NULL), "%s", ag_status(t)->message);
    size_t one = (size_t)SIDE * SIDE * 9, image = (size_t)SIDE * SIDE * 3;
    double r[2];
    for (int i = 0; i < 2; i++)
        rd_flash_rmse(in.grid, maps[0]->t.data + i * one, 9, &in.view, in.image.data + i * image, &r[i]);
    double whole = sqrt((r[0] * r[0] + r[1] * r[1]) / 2);
    float *g = malloc(2 * one * sizeof *g);
    for (int i = 0; i < 2; i++)
        rd_flash_gradient(in.grid, maps[0]->t.data + i * one, 9, &in.view, in.image.data + i * image, whole,
                          g + i * one, NULL);
    for (size_t i = 0; i < 2 * one; i++) g[i] *= 256.0f * 256 / (2 * SIDE * SIDE);
    ag_value *gradient = ag_constant(t, ts_view(g, (ts_shape){2, SIDE, SIDE, 9}));
    ag_value *y = nn_step(t, m, &((const nn_layers *)m->layers)->h, maps[0], gradient, gradient, gru, NULL, 1, NULL);
    check_tape(t);
    for (int64_t i = 0; i < ts_count(y->t.shape); i++)
        CHECK(fabsf(y->t.data[i] - maps[1]->t.data[i]) < 1e-5f, "value %lld: %g, not %g", (long long)i,
              (double)maps[1]->t.data[i], (double)y->t.data[i]);
}

TEST(nn_images_of_a_batch_do_not_meet)
{
    nn_arch a = tiny();
    nn_model *m = create(&a, 16);
    enliven(m);
    nn_input in = photographs(3, SIDE, 11, NULL), alone = in;
    ts_shape one = in.image.shape;
    one.n = 1;
    alone.image = ts_view(in.image.data + in.image.stride_n, one);
    ag_tape *t = tape_create(false);
    ag_value *x = NULL, *y = NULL;
    nn_lgd(t, m, &in, 2, false, &x, NULL);
    nn_lgd(t, m, &alone, 2, false, &y, NULL);
    check_tape(t);
    for (int64_t i = 0; i < ts_count(y->t.shape); i++)
        CHECK(fabsf(y->t.data[i] - x->t.data[ts_count(y->t.shape) + i]) < 1e-5f,
              "value %lld depends on the rest of the batch", (long long)i);
}

TEST(nn_wrong_input_is_an_error_with_a_message)
{
    nn_arch a = tiny();
    a.h_width = 0, a.iterations = 0;
    nn_model *m = create(&a, 17);
    nn_input in = photographs(1, SIDE, 12, NULL), bad = in;
    ag_tape *t = tape_create(false);
    ag_value *maps[3];
    CHECK(nn_lgd(t, m, &in, 0, false, maps, NULL) == TS_OK && maps[0], "g alone: %s", ag_status(t)->message);
    CHECK(nn_lgd(t, m, &in, 2, true, maps, NULL) == TS_INVALID && strstr(ag_status(t)->message, "refiner"), "'%s'",
          ag_status(t)->message);
    ag_reset(t);
    bad.grid = rd_grid_full(SIDE + 1);
    CHECK(nn_lgd(t, m, &bad, 0, false, maps, NULL) == TS_INVALID && strstr(ag_status(t)->message, "17"), "'%s'",
          ag_status(t)->message);
    ag_reset(t);
    bad = in;
    bad.grid.h = SIDE / 2;
    bad.image = ts_view(in.image.data, (ts_shape){1, SIDE / 2, SIDE, 3});
    CHECK(nn_lgd(t, m, &bad, 0, false, maps, NULL) == TS_INVALID && strstr(ag_status(t)->message, "square"), "'%s'",
          ag_status(t)->message);
}
