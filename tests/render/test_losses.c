/* The training losses as ops (render/losses.h): against the double reference, their promises and their complaints. The
 * gradients against differences are in the check of all ops. */
#include "render/brdf.h"
#include "render/losses.h"
#include "tensor/cpu.h"
#include "tensor/threads.h"
#include "tests/test.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { N = 3, S = 19, C = MAP_CHANNELS, COUNT = N * S * S * C };
static const ts_shape shape = {N, S, S, C};

typedef struct problem {
    float *maps, *target, *gradient;
    rd_view views[N * RD_LOSS_VIEWS];
    ag_tape *tape;
} problem;

static problem make(uint64_t seed)
{
    problem p = {.maps = malloc(COUNT * sizeof(float)),
                 .target = malloc(COUNT * sizeof(float)),
                 .gradient = calloc(COUNT, sizeof(float))};
    p.tape = ag_tape_create(true, NULL);
    CHECK(p.maps && p.target && p.gradient && p.tape, "no memory");
    ts_rng rng = ts_rng_make(seed, TS_STREAM_TEST, 0);
    for (int i = 0; i < COUNT; i++) {
        float size = i % C == MAP_NORMAL || i % C == MAP_NORMAL + 1 ? 0.6f : 1.02f;
        p.maps[i] = ts_rng_range(&rng, -size, size);
        p.target[i] = ts_rng_range(&rng, -size, size);
        if (i % C == MAP_ROUGHNESS) p.maps[i] = fmaxf(p.maps[i], -0.9f), p.target[i] = fmaxf(p.target[i], -0.9f);
    }
    for (int i = 0; i < N; i++) {
        enum { FLASH = 4 };
        rd_view *views = p.views + i * RD_LOSS_VIEWS;
        rd_loss_views(&rng, views);
        if (i % 2) rd_flash_views(&rng, FLASH, views + RD_LOSS_VIEWS - FLASH); /* as train.flash_views has them */
    }
    return p;
}

static void release(problem *p)
{
    ag_tape_destroy(&p->tape);
    free(p->maps), free(p->target), free(p->gradient);
}

static float loss(problem *p)
{
    ag_reset(p->tape);
    memset(p->gradient, 0, COUNT * sizeof(float));
    ag_value *maps = ag_parameter(p->tape, ts_view(p->maps, shape), p->gradient),
             *target = ag_constant(p->tape, ts_view(p->target, shape));
    ag_value *l = ag_render_loss(p->tape, maps, target, p->views, RD_LOSS_VIEWS);
    CHECK(l && ag_backward(p->tape, l) == TS_OK, "%s", ag_status(p->tape)->message);
    return l->t.data[0];
}

TEST(render_loss_matches_reference)
{
    problem p = make(1);
    for (int isa = TS_BASE; isa <= (int)ts_isa_best(); isa++) {
        ts_isa_use((ts_isa)isa);
        double got = (double)loss(&p), expected = 0, worst = 0, mean = 1.0 / (3 * N * S * S * RD_LOSS_VIEWS);
        for (int i = 0; i < N * S * S; i++) {
            double a[C], b[C], point[2], by[C] = {0}, pull = 0;
            for (int c = 0; c < C; c++) a[c] = (double)p.maps[i * C + c], b[c] = (double)p.target[i * C + c];
            rd_centre(rd_grid_full(S), i % S, i / S % S, point);
            for (int v = 0; v < RD_LOSS_VIEWS; v++) {
                double ra[3], rb[3], g[3][C];
                rd_radiance(a, point, &p.views[i / (S * S) * RD_LOSS_VIEWS + v], ra, g);
                rd_radiance(b, point, &p.views[i / (S * S) * RD_LOSS_VIEWS + v], rb, NULL);
                for (int k = 0; k < 3; k++) {
                    expected += fabs(log(ra[k] + 0.01) - log(rb[k] + 0.01)) * mean;
                    for (int c = 0; c < C; c++) {
                        double d = g[k][c] / (ra[k] + 0.01) * mean;
                        by[c] += ra[k] > rb[k] ? d : -d;
                        pull = farther(pull, fabs(d));
                    }
                }
            }
            for (int c = 0; c < C; c++) worst = farther(worst, fabs((double)p.gradient[i * C + c] - by[c]) / pull);
        }
        CHECK(fabs(got - expected) < 1e-6 * expected, "%s: %.9g instead of %.9g", ts_isa_name((ts_isa)isa), got,
              expected);
        CHECK(worst < 1e-4, "%s: a gradient is off by %g of what one rendering pulls", ts_isa_name((ts_isa)isa), worst);
    }
    release(&p);
}

TEST(render_loss_same_bytes_for_any_threads)
{
    problem p = make(2);
    float *first = malloc(COUNT * sizeof *first);
    CHECK(first, "no memory");
    ts_threads_set(1);
    float one = loss(&p);
    memcpy(first, p.gradient, COUNT * sizeof *first);
    for (int threads = 2; threads <= 5; threads++) {
        ts_threads_set(threads);
        float other = loss(&p);
        CHECK(one == other && !memcmp(first, p.gradient, COUNT * sizeof *first), "%d threads give other bytes than one",
              threads);
    }
    free(first);
    release(&p);
}

TEST(render_loss_is_zero_for_the_same_maps)
{
    problem p = make(3);
    memcpy(p.target, p.maps, COUNT * sizeof(float));
    CHECK(loss(&p) == 0, "loss %g", (double)loss(&p));
    for (int i = 0; i < COUNT; i++) CHECK(p.gradient[i] == 0, "gradient %g", (double)p.gradient[i]);
    release(&p);
}

/* Images of a batch do not see each other: the loss is the mean of theirs. */
TEST(render_loss_is_the_mean_over_images)
{
    problem p = make(4);
    float whole = loss(&p);
    double mean = 0;
    ts_shape one = {1, S, S, C};
    for (int i = 0; i < N; i++) {
        ag_reset(p.tape);
        ag_value *maps = ag_constant(p.tape, ts_view(p.maps + i * S * S * C, one));
        ag_value *target = ag_constant(p.tape, ts_view(p.target + i * S * S * C, one));
        ag_value *l = ag_render_loss(p.tape, maps, target, p.views + i * RD_LOSS_VIEWS, RD_LOSS_VIEWS);
        CHECK(l, "%s", ag_status(p.tape)->message);
        mean += (double)l->t.data[0] / N;
    }
    CHECK(fabs(mean - (double)whole) < 1e-6 * mean, "%.9g instead of %.9g", (double)whole, mean);
    release(&p);
}

TEST(map_loss_value_and_gradient)
{
    float a[4] = {0, 2, -1, 0.5f}, b[4] = {1, 0, -1, 0.25f}, g[4] = {0};
    ag_tape *tape = ag_tape_create(true, NULL);
    CHECK(tape, "no memory");
    ts_shape s = {1, 1, 1, 4};
    ag_value *l = ag_map_loss(tape, ag_parameter(tape, ts_view(a, s), g), ag_constant(tape, ts_view(b, s)), NULL);
    CHECK(l && ag_backward(tape, l) == TS_OK, "%s", ag_status(tape)->message);
    CHECK(l->t.data[0] == 3.25f / 4, "loss %g", (double)l->t.data[0]);
    static const float expected[4] = {-0.25f, 0.25f, 0, 0.25f};
    for (int i = 0; i < 4; i++) CHECK(g[i] == expected[i], "gradient %d is %g", i, (double)g[i]);
    ag_tape_destroy(&tape);
}

TEST(losses_refuse_what_makes_no_sense)
{
    problem p = make(5);
    static const ts_shape wrong[] = {{N, S, S, 10}, {N, S, S - 1, C}, {N - 1, S, S, C}};
    for (int i = 0; i < 5; i++) {
        ag_reset(p.tape);
        float *room = calloc((size_t)N * S * S * 10, sizeof *room);
        CHECK(room, "no memory");
        ag_value *maps = ag_constant(p.tape, ts_view(room, i < 3 ? wrong[i] : shape));
        ag_value *target = i == 3 ? ag_parameter(p.tape, ts_view(p.target, shape), p.gradient)
                                  : ag_constant(p.tape, ts_view(p.target, shape));
        ag_value *l = ag_render_loss(p.tape, maps, target, p.views, i == 4 ? 0 : RD_LOSS_VIEWS);
        CHECK(!l && ag_status(p.tape)->code == TS_INVALID && strstr(ag_status(p.tape)->message, "render_loss"),
              "case %d was accepted", i);
        if (i < 4) {
            ag_reset(p.tape);
            maps = ag_constant(p.tape, ts_view(room, i < 3 ? wrong[i] : shape));
            target = i == 3 ? ag_parameter(p.tape, ts_view(p.target, shape), p.gradient)
                            : ag_constant(p.tape, ts_view(p.target, shape));
            l = ag_map_loss(p.tape, maps, target, NULL);
            CHECK(!l && ag_status(p.tape)->code == TS_INVALID && strstr(ag_status(p.tape)->message, "map_loss"),
                  "map loss, case %d was accepted", i);
        }
        free(room);
    }
    release(&p);
}
