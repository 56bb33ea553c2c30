/* Refinement with early stop: tolerances, a mask, the automatic number of steps, each beside all steps of the whole.
 * Processor seconds of all threads, which depend less on other work than wall time. The error is that of renderings
 * under 20 views (lgd-eval's), over procedural materials and the map sets of TESTDATA. */
#include "bench/bench.h"
#include "eval/metrics/metrics.h"
#include "eval/sets.h"
#include "infer/api_model.h"
#include "infer/model_path.h"
#include "render/error.h"
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

enum { SIDE = 256, PIXELS = SIDE * SIDE, MOST = 24, EVERY = 2 /* of the maps */ };

typedef struct sample {
    float *image, *truth; /* [PIXELS][3], [PIXELS][9] in the network's encoding */
    rd_view views[RD_EVAL_VIEWS];
} sample;

typedef struct setting {
    const char *label;
    lgd_options options;
} setting;

static int load(const char *spec, int step, sample *s, int capacity)
{
    ev_set set = {0};
    ts_status st = {0};
    io_material m = {0};
    int n = 0;
    if (ev_set_open(spec, NULL, &set, &st)) return printf("  %s: %s\n", spec, st.message), 0;
    for (int i = 0; i < set.count && n < capacity; i += step) {
        if (ev_set_load(&set, i, SIDE, &m, &st)) continue;
        ts_rng rng = ts_rng_make(1, TS_STREAM_EVAL, ev_set_identity(&set, i));
        s[n].image = malloc(PIXELS * 3 * sizeof(float));
        s[n].truth = malloc(PIXELS * MAP_CHANNELS * sizeof(float));
        if (!s[n].image || !s[n].truth) abort();
        rd_eval_views(&rng, RD_EVAL_VIEWS, s[n].views);
        ev_photograph(&m, &(ev_photo){rd_flash(), 1, 0, 1, 1}, s[n].image);
        memcpy(s[n].truth, m.maps, PIXELS * MAP_CHANNELS * sizeof(float));
        n++;
    }
    io_material_free(&m);
    ev_set_close(&set);
    return n;
}

static double seconds(void)
{
    struct timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

/* Mean error and mean seconds, after an estimate that is not measured. */
static void run(lgd_model *model, const setting *k, sample *s, int count, double *time_mean, double *error_mean)
{
    static float maps[PIXELS * MAP_CHANNELS];
    ts_status st = {0};
    *time_mean = *error_mean = 0;
    for (int i = -1; i < count; i++) {
        const double begin = seconds();
        const lgd_photo photo = lgd_flash_photo(s[i < 0 ? 0 : i].image);
        if (lgd_model_estimate(model, &photo, 1, SIDE, &k->options, true, maps, &st)) abort();
        if (i < 0) continue;
        *time_mean += (seconds() - begin) / count;
        io_material truth = {.size = SIDE, .maps = s[i].truth};
        const ev_case c = ev_case_of_maps(&truth, s[i].image, s[i].views, false);
        *error_mean += ev_score(&c, maps, MAP_CHANNELS).value[EV_RENDER] / count;
    }
}

static void table(lgd_model *model, const char *what, sample *s, int count, const setting *k, int settings)
{
    double time0 = 0, error0 = 0;
    printf("  %s (%d)\n", what, count);
    for (int i = 0; i < settings && count > 0; i++) {
        double t, e;
        run(model, &k[i], s, count, &t, &e);
        if (i == 0) time0 = t, error0 = e;
        printf("    %-28s %8.1f ms %5.2f x faster   render RMSE %.5f (%+.2f %%)\n", k[i].label, 1e3 * t, time0 / t, e,
               100 * (e / error0 - 1));
        fflush(stdout);
    }
}

BENCH(adaptive)
{
    static unsigned char mask[PIXELS];
    static sample s[2 * MOST];
    char path[4096];
    ts_status st = {0};
    lgd_error error;
    const char *data = getenv("TESTDATA");
    bench_heading("adaptive refinement at 256 x 256, processor time; the first row is the fixed number of steps");
    lgd_model *model = lgd_model_path(NULL, "single", path, &st) == TS_OK ? lgd_load(path, &error) : NULL;
    if (!model) {
        printf("  no weights: nothing is measured\n");
        return;
    }
    for (int i = 0; i < PIXELS; i++) mask[i] = i % SIDE < SIDE / 4 && i / SIDE < SIDE / 2;
    setting k[] = {{"fixed", {.iterations = -1}},
                   {"fixed, --exact", {.iterations = -1, .exact = 1}},
                   {"--tolerance 0.0001", {.iterations = -1, .tolerance = 1e-4}},
                   {"--tolerance 0.001", {.iterations = -1, .tolerance = 1e-3}},
                   {"--tolerance 0.0015", {.iterations = -1, .tolerance = 1.5e-3}},
                   {"--tolerance 0.002", {.iterations = -1, .tolerance = 2e-3}},
                   {"--tolerance 0.0025", {.iterations = -1, .tolerance = 2.5e-3}},
                   {"--tolerance 0.003", {.iterations = -1, .tolerance = 3e-3}},
                   {"--tolerance 0.01", {.iterations = -1, .tolerance = 1e-2}},
                   {"--iterations auto", {.iterations = LGD_AUTO}},
                   {"--mask, an eighth wanted", {.iterations = -1, .mask = mask}}};
    const int settings = sizeof k / sizeof *k;
    for (int i = 0; i < settings; i++) k[i].options.size = sizeof k[i].options, k[i].options.orientations = 1;
    const int procedural = load("procedural:1000003,8", 1, s, MOST);
    snprintf(path, sizeof path, "maps:%s/maps", data ? data : "../shared/testdata");
    const int maps = load(path, EVERY, s + procedural, MOST);
    table(model, "procedural materials", s, procedural, k, settings);
    table(model, "map sets", s + procedural, maps, k, settings);
    for (int i = 0; i < procedural + maps; i++) free(s[i].image), free(s[i].truth);
    lgd_free(&model);
}
