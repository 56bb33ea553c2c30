/* Shading: pixels times views a second. */
#include "bench/bench.h"
#include "render/losses.h"
#include "render/posterior.h"
#include "render/render.h"
#include "render/scene_model.h"
#include "tensor/maps.h"
#include <stdlib.h>
#include <string.h>

enum { SIDE = 256, PART = 128, N = 8, S = 64 };

typedef struct job {
    float *maps, *target, *gradient, *image, *deviation, *after;
    double rmse;
    rd_view views[N * RD_LOSS_VIEWS];
    ag_tape *tape;
    const rd_view *below;
    int photographs, side;
} job;

static void render(void *user)
{
    job *j = user;
    rd_view view = rd_flash();
    rd_render(rd_grid_full(j->side), j->maps, MAP_CHANNELS, &view, true, j->image);
}

static void under(void *user)
{
    job *j = user;
    rd_render(rd_grid_full(j->side), j->maps, MAP_CHANNELS, j->below, true, j->image);
}

static void gradient(void *user)
{
    job *j = user;
    rd_view view = rd_flash();
    rd_flash_gradient(rd_grid_full(j->side), j->maps, MAP_CHANNELS, &view, j->image, 0.1, j->gradient, &j->rmse);
}

static void newton(void *user)
{
    job *j = user;
    rd_view views[RD_CAPTURE_VIEWS];
    const float *image[RD_CAPTURE_VIEWS];
    float damping[MAP_CHANNELS];
    for (int k = 0; k < j->photographs; k++) views[k] = rd_capture_view(k), image[k] = j->image;
    for (int i = 0; i < MAP_CHANNELS; i++) damping[i] = 0.1f;
    rd_newton_step(rd_grid_full(j->side), j->maps, MAP_CHANNELS, views, image, j->photographs, damping, j->gradient);
}

static void posterior(void *user)
{
    job *j = user;
    rd_view views[RD_CAPTURE_VIEWS];
    const float *image[RD_CAPTURE_VIEWS];
    static float best[SIDE * SIDE * MAP_CHANNELS], misfit[SIDE * SIDE];
    const rd_search search = {best, misfit, true};
    const rd_prior prior = {j->target, j->deviation, {.hue = {0.1f, 0.1f}, .model = 0.1f, .noise = 0.5f}};
    for (int k = 0; k < j->photographs; k++) views[k] = rd_capture_view(k), image[k] = j->image;
    rd_posterior_step(rd_grid_full(j->side), j->maps, MAP_CHANNELS, views, image, j->photographs, &prior, 1,
                      j->photographs > 1 ? &search : NULL, j->gradient, j->after);
}

/* Four steps, of every sixteenth row. */
static void scene(void *user)
{
    job *j = user;
    const rd_scene_prior prior = {{0}, {0.3f, 1, 1, 0.5f, 0.5f, 1, 1, 0.3f, 0.2f}};
    const rd_scene_how how = {4, 16, 100, {.hue = {0.1f, 0.1f}, .model = 0.1f, .noise = 0.02f}};
    float unknown[RD_SCENE_UNKNOWNS] = {0}, after[RD_SCENE_UNKNOWNS];
    rd_scene_fit(rd_grid_full(j->side), j->maps, MAP_CHANNELS, j->deviation, j->image, &prior, &how, unknown, after);
}

static void loss(void *user)
{
    job *j = user;
    ts_shape shape = {N, S, S, MAP_CHANNELS};
    ag_reset(j->tape);
    ag_value *maps = ag_parameter(j->tape, ts_view(j->maps, shape), j->gradient),
             *target = ag_constant(j->tape, ts_view(j->target, shape));
    ag_backward(j->tape, ag_render_loss(j->tape, maps, target, j->views, RD_LOSS_VIEWS));
}

/* What has no gradient or no light is skipped, vector by vector: the same calls on such scenes. The rows are in the
 * second cache, or memory would set the time. */
static void skipped(job *j)
{
    static const char *const name[3][2] = {{"flash loss and gradient", "  white and overexposed"},
                                           {"Newton step", "  white and overexposed"},
                                           {"value, light and camera apart", "  the light below the horizon"}};
    const size_t pixels = (size_t)PART * PART;
    const rd_view side = {.kind = RD_POINT, .camera = {0, 0.5f, 1}, .light = {0.5f, 0, 1}, .power = 5},
                  below = {.kind = RD_POINT, .camera = {0, 0.5f, 1}, .light = {0.5f, 0, -1}, .power = 5};
    void (*const call[3])(void *) = {gradient, newton, under};
    bench_heading("what a vector of pixels does not need (128 x 128)");
    j->side = PART;
    j->photographs = 1;
    for (int scene = 0; scene < 2; scene++) {
        for (size_t i = 0; i < pixels * MAP_CHANNELS && scene; i++)
            j->maps[i] = i % MAP_CHANNELS < MAP_DIFFUSE + 3 ? 1 : i % MAP_CHANNELS >= MAP_SPECULAR ? -0.9f : 0;
        for (size_t i = 0; i < pixels * 3 && scene; i++) j->image[i] = 1;
        j->below = scene ? &below : &side;
        for (int k = 0; k < 3; k++) {
            const bench_time t = bench_measure(call[k], j);
            bench_row_unit(name[k][scene], t, (double)pixels / t.seconds * 1e-6, "Mpixel/s");
        }
    }
}

BENCH(render)
{
    job j = {.side = SIDE};
    ts_rng rng = ts_rng_make(1, TS_STREAM_TEST, 0);
    size_t pixels = SIDE * SIDE;
    j.maps = malloc(pixels * MAP_CHANNELS * sizeof(float));
    j.target = malloc(pixels * MAP_CHANNELS * sizeof(float));
    j.gradient = calloc(pixels * MAP_CHANNELS, sizeof(float));
    j.image = malloc(pixels * 3 * sizeof(float));
    float *const deviation = j.deviation = malloc(pixels * MAP_GROUPS * sizeof(float)),
                 *const after = malloc(pixels * MAP_GROUPS * sizeof(float));
    j.tape = ag_tape_create(true, NULL);
    if (!j.maps || !j.target || !j.gradient || !j.image || !deviation || !after || !j.tape) abort();
    for (size_t i = 0; i < pixels * MAP_GROUPS; i++) deviation[i] = 0.2f;
    for (size_t i = 0; i < pixels * MAP_CHANNELS; i++) {
        bool normal = i % MAP_CHANNELS == MAP_NORMAL || i % MAP_CHANNELS == MAP_NORMAL + 1;
        j.maps[i] = ts_rng_range(&rng, -1, 1) * (normal ? 0.4f : 1);
        j.target[i] = ts_rng_range(&rng, -1, 1) * (normal ? 0.4f : 1);
    }
    for (size_t i = 0; i < pixels * 3; i++) j.image[i] = ts_rng_uniform(&rng);
    for (int i = 0; i < N; i++) rd_loss_views(&rng, j.views + i * RD_LOSS_VIEWS);
    bench_heading("render (pixels x views)");
    bench_time t = bench_measure(gradient, &j);
    bench_row_unit("flash loss and gradient, 256^2", t, (double)pixels / t.seconds * 1e-6, "Mpixel/s");
    t = bench_measure(render, &j);
    bench_row_unit("value, 256^2", t, (double)pixels / t.seconds * 1e-6, "Mpixel/s");
    for (j.photographs = 1; j.photographs <= 5; j.photographs += 4) {
        t = bench_measure(newton, &j);
        bench_row_unit(j.photographs == 1 ? "Newton step, 1 photograph, 256^2" : "Newton step, 5 photographs, 256^2", t,
                       (double)pixels * j.photographs / t.seconds * 1e-6, "Mpixel/s");
    }
    for (int k = 0; k < 4; k++) {
        static const char *const name[] = {"most probable maps, 1 photograph, 256^2", "  and how sure they are",
                                           "most probable maps, 5 photographs, 256^2", "  and how sure they are"};
        j.photographs = k < 2 ? 1 : 5;
        j.after = k % 2 ? after : NULL;
        t = bench_measure(posterior, &j);
        bench_row_unit(name[k], t, (double)pixels * j.photographs / t.seconds * 1e-6, "Mpixel/s");
    }
    t = bench_measure(scene, &j);
    bench_row_unit("the scene from 16 rows, 4 steps, 256^2", t, 4.0 * (double)pixels / 16 / t.seconds * 1e-6,
                   "Mpixel/s");
    skipped(&j);
    t = bench_measure(loss, &j);
    /* prediction and target are both rendered, and counted once */
    bench_row_unit("render_loss with gradient, 8 x 64^2, 9 views", t,
                   (double)N * S * S * RD_LOSS_VIEWS / t.seconds * 1e-6, "Mpixel/s");
    ag_tape_destroy(&j.tape);
    free(j.maps), free(j.target), free(j.gradient), free(j.image), free(deviation), free(after);
}
