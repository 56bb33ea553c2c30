/* The same bytes for any number of threads: maps, loss and gradients of the loop at a size that every loop divides. */
#include "tensor/threads.h"
#include "nn/adam.h"
#include "nn/model.h"
#include "ops.h"
#include "render/losses.h"
#include "render/render.h"
#include "tensor/maps.h"
#include "tests/stress/stress.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { SIDE = 48, C = MAP_CHANNELS, STEPS = 3, UPDATES = 2 };

/* A few updates from the same start; the parameters and the last maps go to out. */
static bool work(const nn_model *start, const float *truth, const float *image, float *out, ts_status *st)
{
    nn_model *m = nn_model_create(&start->arch, st);
    ag_tape *tape = m && !nn_model_train(m, st) ? ag_tape_create(true, st) : NULL;
    nn_adam adam = {0};
    bool ok = tape && !nn_adam_create(&adam, m, 0.9f, st);
    if (ok) memcpy(m->value, start->value, m->count * sizeof *m->value);
    for (int n = 0; ok && n < UPDATES; n++) {
        const nn_input in = {.image = ts_view((float *)(uintptr_t)image, (ts_shape){2, SIDE, SIDE, 3}),
                             .grid = rd_grid_full(SIDE),
                             .view = rd_flash()};
        ag_value *maps[STEPS + 1];
        rd_view views[2 * RD_LOSS_VIEWS];
        ts_rng rng = ts_rng_make(3, TS_STREAM_TEST, (uint64_t)n);
        for (int i = 0; i < 2; i++) rd_loss_views(&rng, views + i * RD_LOSS_VIEWS);
        ag_reset(tape);
        nn_lgd(tape, m, &in, STEPS, true, maps, NULL);
        ag_value *goal = ag_constant(tape, ts_view((float *)(uintptr_t)truth, (ts_shape){2, SIDE, SIDE, C}));
        ok = ag_backward(tape, ag_render_loss(tape, maps[STEPS], goal, views, RD_LOSS_VIEWS)) == TS_OK;
        if (!ok) break;
        const double norm = nn_gradient_norm(m, 0, m->count);
        nn_adam_next(&adam);
        nn_adam_step(&adam, m, 0, m->count, 1e-3f, (float)(1 / norm));
        memcpy(out + m->count, maps[STEPS]->t.data, (size_t)2 * SIDE * SIDE * C * sizeof *out);
    }
    if (ok) memcpy(out, m->value, m->count * sizeof *out);
    nn_adam_free(&adam);
    ag_tape_destroy(&tape);
    nn_model_free(&m);
    return ok;
}

bool stress_threads(const stress *s)
{
    static const int threads[] = {1, 2, 3, 7};
    (void)s; /* short enough as it is */
    nn_arch a = nn_arch_default();
    a.g_width = 8, a.g_width_max = 16, a.g_levels = 3, a.g_size = 32, a.h_width = 16, a.h_gru = 8;
    ts_status st = {0};
    nn_model *m = nn_model_create(&a, &st);
    const size_t pixels = (size_t)2 * SIDE * SIDE, values = m ? m->count + pixels * C : 0;
    float *truth = malloc(pixels * C * sizeof *truth), *image = malloc(pixels * 3 * sizeof *image),
          *first = malloc(values * sizeof *first), *other = malloc(values * sizeof *other);
    bool ok = m && truth && image && first && other;
    double different = 0;
    const int before = ts_threads();
    if (ok) {
        nn_model_init(m, 4);
        ts_rng r = ts_rng_make(2, TS_STREAM_TEST, 0);
        for (size_t i = 0; i < pixels * C; i++) truth[i] = ts_rng_range(&r, -0.6f, 0.6f);
        const rd_view flash = rd_flash();
        for (int i = 0; i < 2; i++)
            rd_render(rd_grid_full(SIDE), truth + (size_t)i * SIDE * SIDE * C, C, &flash, true,
                      image + (size_t)i * SIDE * SIDE * 3);
        for (int n = 0; n < 4 && ok; n++) {
            ts_threads_set(threads[n]);
            ok = work(m, truth, image, n ? other : first, &st);
            for (size_t i = 0; ok && n && i < values; i++)
                different += memcmp(&first[i], &other[i], sizeof *first) != 0;
        }
        ts_threads_set(before);
    }
    if (!ok) printf("%s\n", st.message);
    ok = stress_row("1, 2, 3 and 7 threads: numbers that differ", ok ? different : NAN, 0);
    free(truth);
    free(image);
    free(first);
    free(other);
    nn_model_free(&m);
    return ok;
}
