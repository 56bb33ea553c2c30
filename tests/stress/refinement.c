/* Many more refinement steps than anybody trained, from pictures that are none. */
#include "data/materials/procedural.h"
#include "nn/weights/weights.h"
#include "render/error.h"
#include "render/render.h"
#include "tensor/maps.h"
#include "tests/stress/stress.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { MOST = 200, C = MAP_CHANNELS };

typedef struct watch {
    int size, steps;
    bool finite;
    const float *truth; /* NULL: no photograph of anything */
    rd_view views[RD_EVAL_VIEWS];
    double rmse[MOST + 1];
    double largest;
} watch;

static bool after(int step, const ag_value *maps, void *user)
{
    watch *w = user;
    for (int64_t i = 0; i < ts_count(maps->t.shape); i++) {
        w->finite = w->finite && isfinite(maps->t.data[i]);
        w->largest = farther(w->largest, fabs((double)maps->t.data[i]));
    }
    w->rmse[step] = w->truth
        ? rd_render_rmse(rd_grid_full(w->size), maps->t.data, maps->t.shape.c, w->truth, C, w->views, RD_EVAL_VIEWS)
        : 0;
    return true;
}

static void picture(int kind, int size, float *p)
{
    ts_rng r = ts_rng_make(12, TS_STREAM_TEST, (uint64_t)kind);
    for (int y = 0; y < size; y++)
        for (int x = 0; x < size; x++)
            for (int c = 0; c < 3; c++) {
                const float u = ts_rng_uniform(&r);
                const float v[] = {u,
                                   0,
                                   1,
                                   0.5f,
                                   (float)((x + y) % 2),
                                   x == size / 2 && y == size / 2,
                                   (float)(c == 0),
                                   u < 0.5f ? 0 : 1,
                                   1e-40f,
                                   x < size / 2 ? 0 : 1};
                p[(y * size + x) * 3 + c] = v[kind];
            }
}
static const char *const picture_name[] = {"random",           "black",    "saturated",        "constant", "chequered",
                                           "one bright pixel", "pure red", "0 or 1 at random", "denormal", "half"};
enum { PICTURES = sizeof picture_name / sizeof *picture_name };

static bool run(ag_tape *tape, const nn_model *model, float *image, watch *w)
{
    const nn_input in = {
        .image = ts_view(image, (ts_shape){1, w->size, w->size, 3}), .grid = rd_grid_full(w->size), .view = rd_flash()};
    ag_value *maps = NULL;
    ag_reset(tape);
    w->finite = true;
    w->largest = 0;
    return nn_lgd(tape, model, &in, w->steps, false, &maps, &(nn_watch){after, w, false}) == TS_OK && w->finite;
}

/* An adversary: rectangles of pure colours are put into noise, and stay where they drive the maps further out. */
static void provoke(ag_tape *tape, const nn_model *model, int tries, float *image, watch *w)
{
    const int size = w->size, steps = w->steps;
    const size_t bytes = (size_t)size * (size_t)size * 3 * sizeof *image;
    ts_rng r = ts_rng_make(13, TS_STREAM_TEST, 0);
    float *best = malloc(bytes);
    picture(7, size, image);
    double most = 0;
    for (int n = 0; best && n < tries; n++) {
        memcpy(best, image, bytes);
        const int y0 = ts_rng_int(&r, size), x0 = ts_rng_int(&r, size), y1 = y0 + 1 + ts_rng_int(&r, size - y0),
                  x1 = x0 + 1 + ts_rng_int(&r, size - x0), colour = ts_rng_int(&r, 8);
        for (int y = n ? y0 : size; y < y1; y++)
            for (int x = x0; x < x1; x++)
                for (int c = 0; c < 3; c++) image[(y * size + x) * 3 + c] = (float)(colour >> c & 1);
        w->steps = 12;
        if (!run(tape, model, image, w)) break; /* found: the run that follows reports it */
        if (w->largest > most) most = w->largest;
        else memcpy(image, best, bytes);
    }
    w->steps = steps;
    free(best);
}

/* The error of the best guess without looking: the mean of other materials. */
static double blind(const watch *w, int size, const float *mean)
{
    float *maps = malloc((size_t)size * (size_t)size * C * sizeof *maps);
    for (int i = 0; maps && i < size * size; i++) memcpy(maps + i * C, mean, C * sizeof *maps);
    const double e = maps ? rd_render_rmse(rd_grid_full(size), maps, C, w->truth, C, w->views, RD_EVAL_VIEWS) : NAN;
    free(maps);
    return e;
}

static void mean_material(float mean[C])
{
    enum { SIZE = 16, COUNT = 64 };
    const io_procedural p = {.seed = 77};
    io_material m = {0};
    ts_status st = {0};
    double sum[C] = {0};
    if (io_material_create(&m, SIZE, &st)) return;
    for (int i = 0; i < COUNT; i++) {
        io_procedural_make(&p, (uint64_t)i, &m);
        for (int k = 0; k < SIZE * SIZE * C; k++) sum[k % C] += (double)m.maps[k] / (SIZE * SIZE * COUNT);
    }
    for (int k = 0; k < C; k++) mean[k] = (float)sum[k];
    io_material_free(&m);
}

bool stress_refinement(const stress *s)
{
    const char *path = getenv("LGD_MODEL");
    const int size = s->full ? 64 : 32, materials = s->full ? 8 : 2;
    ts_status st = {0};
    nn_model *model = nn_model_load(path && *path ? path : "models/single.safetensors", &st);
    ag_tape *tape = model ? ag_tape_create(false, &st) : NULL;
    float *image = malloc((size_t)size * (size_t)size * 3 * sizeof *image), mean[C] = {0};
    watch *w = calloc(1, sizeof *w);
    io_material m = {0};
    bool ok = tape && image && w && io_material_create(&m, size, &st) == TS_OK;
    if (!ok) printf("%s\n", st.message);
    double least = 0, last = 0, floor = 0, at[MOST + 1] = {0};
    if (ok) {
        ag_freeze(tape, true);
        w->size = size;
        w->steps = s->full ? MOST : 24;
        for (int k = 0; k <= PICTURES; k++) {
            char what[96];
            if (k < PICTURES) picture(k, size, image);
            else provoke(tape, model, s->full ? 100 : 10, image, w);
            const bool finite = run(tape, model, image, w);
            snprintf(what, sizeof what, "%d steps from a %s picture: largest |value|", w->steps,
                     k < PICTURES ? picture_name[k] : "hostile");
            ok = stress_row(what, finite ? w->largest : NAN, 100) && ok;
        }
        mean_material(mean);
        const io_procedural p = {.seed = 4242};
        for (int i = 0; i < materials; i++) {
            const rd_view flash = rd_flash();
            ts_rng rng = ts_rng_make(1, TS_STREAM_EVAL, (uint64_t)i);
            io_procedural_make(&p, (uint64_t)i, &m);
            rd_render(rd_grid_full(size), m.maps, C, &flash, true, image);
            rd_eval_views(&rng, RD_EVAL_VIEWS, w->views);
            w->truth = m.maps;
            ok = run(tape, model, image, w) && ok;
            floor += blind(w, size, mean) / materials;
            for (int t = 0; t <= w->steps; t++) at[t] += w->rmse[t] / materials;
        }
        least = INFINITY;
        for (int t = 0; t <= w->steps; t++) least = fmin(least, at[t]);
        last = at[w->steps];
        printf("photographs, render RMSE after");
        for (int t = 0; t < w->steps; t += t < 10 ? 2 : t < 40 ? 10 : 40) printf(" %d: %.4f", t, at[t]);
        printf(" %d: %.4f\n", w->steps, last);
        ok = stress_row("photographs: last render RMSE over the least of all steps", last / least, 1.5) && ok;
        ok = stress_row("photographs: last render RMSE over the mean material's", last / floor, 1) && ok;
    }
    io_material_free(&m);
    free(w);
    free(image);
    ag_tape_destroy(&tape);
    nn_model_free(&model);
    return ok;
}
