/* Steps that are computed again for the gradient: the same numbers in less memory. */
#include "render/losses.h"
#include "tensor/threads.h"
#include "tests/support/networks.h"

/* The gradient of a loss on R_0 and R_T; memory: the most that the tape held. */
static float *gradient(nn_model *m, const nn_input *in, const float *target, int steps, bool recompute, size_t *memory,
                       double *loss_value)
{
    ag_tape *t = tape_create(true);
    ag_value *maps[MOST * 2];
    nn_input now = *in;
    now.recompute = recompute;
    float *result = malloc(m->count * sizeof *result);
    for (int repeat = 0; repeat < 2; repeat++) { /* the second time in memory that was used */
        ag_reset(t);
        memset(m->grad, 0, m->count * sizeof(float));
        nn_lgd(t, m, &now, steps, true, maps, NULL);
        check_tape(t);
        ag_value *goal = ag_constant(t, ts_view((float *)(uintptr_t)target, maps[0]->t.shape));
        ag_value *loss = ag_add(t, ag_map_loss(t, maps[steps], goal, NULL), ag_map_loss(t, maps[0], goal, NULL));
        ag_backward(t, loss);
        check_tape(t);
        *loss_value = (double)loss->t.data[0];
    }
    memcpy(result, m->grad, m->count * sizeof *result);
    *memory = ts_arena_peak(ag_arena(t));
    ag_tape_destroy(&t);
    return result;
}

static void compare(nn_arch arch, int steps)
{
    float *target;
    nn_model *m = create(&arch, 3);
    enliven(m);
    nn_input in = photographs(2, SIDE, 4, &target);
    size_t memory[2];
    double loss[2];
    float *a = gradient(m, &in, target, steps, false, &memory[0], &loss[0]),
          *b = gradient(m, &in, target, steps, true, &memory[1], &loss[1]);
    CHECK(loss[0] == loss[1], "the loss is %.9g, and %.9g when steps are computed again", loss[0], loss[1]);
    double largest = 0;
    for (size_t i = 0; i < m->count; i++) largest = farther(largest, fabs((double)a[i]));
    CHECK(largest > 0, "no gradient");
    for (size_t i = 0; i < m->count; i++)
        CHECK(a[i] == b[i], "gradient %zu is %.9g, and %.9g when steps are computed again", i, a[i], b[i]);
    CHECK(steps < 3 || memory[1] < memory[0], "%zu bytes, and %zu when steps are computed again", memory[0], memory[1]);
    free(a), free(b), free(target), free(in.image.data);
    nn_model_free(&m);
}

TEST(checkpoint_steps_same_gradients)
{
    nn_arch a = tiny();
    compare(a, 1);
    compare(a, 4);
    a.encoding = NN_GRADIENT_ASINH;
    compare(a, 3);
    a.recurrent = false;
    compare(a, 3);
    a = tiny();
    a.iterations = 2; /* two more are shortened */
    compare(a, 4);
    a.rmse = NN_RMSE_BATCH;
    a.gradient = true;
    compare(a, 3);
    for (a.descent = NN_DESCENT_NONE; a.descent <= NN_DESCENT_NEWTON; a.descent++) compare(a, 2);
    a = tiny();
    a.h_width = 0;
    compare(a, 2);
    a = tiny();
    a.coarse_steps = 3, a.coarse_size = 12, a.coarse_width = 8, a.coarse_gru = 4;
    compare(a, 2);
    compare(a, 5);
    a.h_width = 0;
    compare(a, 5);
    a.recurrent = false;
    compare(a, 3);
}

/* From 6 steps to so many. */
static void grow(nn_arch a, int most, size_t state)
{
    nn_model *m = create(&a, 5);
    float *target;
    nn_input in = photographs(2, SIDE, 6, &target);
    size_t few, many;
    double loss;
    free(gradient(m, &in, target, 6, true, &few, &loss));
    free(gradient(m, &in, target, most, true, &many, &loss));
    const size_t states = (size_t)(most - 6) * state, small = (size_t)(most - 6) * 4096; /* nodes, headers */
    CHECK(many - few <= states + small, "%zu bytes more for %d more steps, their states are %zu", many - few, most - 6,
          states);
    free(target), free(in.image.data);
    nn_model_free(&m);
}

TEST(checkpoint_steps_memory_grows_by_states)
{
    nn_arch a = tiny();
    a.h_width = 16;
    a.iterations = 24; /* no step is shortened, which would take a little more */
    grow(a, 24, 2 * SIDE * SIDE * (size_t)(a.channels + 2 * a.h_gru) * sizeof(float));
    a.coarse_steps = 16, a.coarse_size = 12, a.coarse_width = 16, a.coarse_gru = 6;
    const size_t kept = 2 * SIDE * SIDE * (size_t)a.channels *
        sizeof(float); /* R_t at the photograph's size, since the test asks for all */
    grow(a, 16, 2 * 12 * 12 * (size_t)(a.channels + 2 * a.coarse_gru) * sizeof(float) + kept);
}
