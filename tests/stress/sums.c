/* Long sums, and Adam after a million steps. */
#include "nn/adam.h"
#include "render/error.h"
#include "render/render.h"
#include "tensor/maps.h"
#include "tests/stress/stress.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { C = MAP_CHANNELS };

static bool long_sums(bool full)
{
    const int side = full ? 4096 : 512;
    const size_t pixels = (size_t)side * (size_t)side;
    float *maps = malloc(pixels * C * sizeof *maps), *image = malloc(pixels * 3 * sizeof *image),
          *row = malloc((size_t)side * 3 * sizeof *row);
    bool ok = maps && image && row;
    if (!ok) printf("no memory for %d x %d pixels\n", side, side);
    ts_rng r = ts_rng_make(6, TS_STREAM_TEST, 0);
    for (size_t i = 0; ok && i < pixels * C; i++)
        maps[i] = i % C == MAP_ROUGHNESS ? ts_rng_range(&r, -0.5f, 1) : ts_rng_range(&r, -0.7f, 0.7f);
    const rd_view flash = rd_flash();
    long double sum = 0, rough = 0;
    for (int y = 0; ok && y < side; y++) {
        const rd_grid one = {.h = 1, .w = side, .y0 = y, .x0 = 0, .side = side};
        rd_render(one, maps + (size_t)y * (size_t)side * C, C, &flash, true, row);
        for (int i = 0; i < side * 3; i++) { /* errors of very different sizes, the smallest last */
            float *v = &image[(size_t)y * (size_t)side * 3 + (size_t)i];
            *v = row[i] + (y < 8 ? 0.5f : 1e-3f) * ts_rng_range(&r, -1, 1);
            const long double d = (long double)row[i] - (long double)*v;
            sum += d * d;
        }
    }
    if (ok) {
        double rmse;
        rd_flash_rmse(rd_grid_full(side), maps, C, &flash, image, &rmse);
        const double exact = (double)sqrtl(sum / (3.0L * (long double)pixels));
        char what[96];
        snprintf(what, sizeof what, "RMSE of a photograph of %d^2 against long double, relative", side);
        ok = stress_row(what, fabs(rmse / exact - 1), 1e-6);
        for (size_t i = 0; i < pixels; i++) {
            const long double d = (long double)maps[i * C + MAP_ROUGHNESS] / 2;
            rough += d * d;
        }
        float *zero = calloc(pixels, C * sizeof *zero);
        if (zero) {
            snprintf(what, sizeof what, "RMSE of roughness of %d^2 against long double, relative", side);
            ok = stress_row(what,
                            fabs(rd_map_rmse((int64_t)pixels, maps, C, zero, C).roughness /
                                     (double)sqrtl(rough / (long double)pixels) -
                                 1),
                            1e-12) &&
                ok;
        }
        free(zero);
    }
    free(maps);
    free(image);
    free(row);
    return ok;
}

static bool adam(bool full)
{
    enum { LANES = 64 };
    nn_arch a = nn_arch_default();
    a.g_width = a.g_width_max = 4, a.g_levels = 1, a.g_size = 8, a.h_width = 4, a.h_gru = 4;
    ts_status st = {0};
    nn_model *m = nn_model_create(&a, &st);
    nn_adam adam;
    if (!m || nn_model_train(m, &st) || nn_adam_create(&adam, m, 0.999f, &st)) return printf("%s\n", st.message), false;
    const long steps = full ? 1000000 : 50000;
    float gradient[LANES];
    for (int i = 0; i < LANES; i++)
        gradient[i] = i == 0 ? 0 : (float)((i % 2 ? 1 : -1) * pow(10, -30 + i / 2.0)); /* 1e-30 .. 1e1 */
    for (long n = 0; n < steps; n++) {
        memcpy(m->grad, gradient, sizeof gradient);
        nn_adam_next(&adam);
        nn_adam_step(&adam, m, 0, LANES, 1e-6f, 1);
    }
    memset(m->value, 0, LANES * sizeof *m->value);
    memcpy(m->grad, gradient, sizeof gradient);
    nn_adam_next(&adam);
    nn_adam_step(&adam, m, 0, LANES, 1e-3f, 1);
    double worst = 0;
    bool finite = true;
    for (int i = 0; i < LANES; i++) {
        finite = finite && isfinite(m->value[i]) && isfinite(adam.m[i]) && isfinite(adam.v[i]) && isfinite(adam.ema[i]);
        const double g = (double)gradient[i], expected = -1e-3 * g / (fabs(g) + 1e-8);
        worst = farther(worst, fabs((double)m->value[i] - expected) / 1e-3);
    }
    char what[96];
    snprintf(what, sizeof what, "Adam after %ld steps: a step against its limit, in steps", steps);
    const bool ok = stress_row(what, finite ? worst : NAN, 1e-4);
    nn_adam_free(&adam);
    nn_model_free(&m);
    return ok;
}

bool stress_sums(const stress *s)
{
    const bool sums = long_sums(s->full);
    return adam(s->full) && sums;
}
