/* The compared methods: the laws that each obeys. */
#include "data/materials/procedural.h"
#include "eval/figure.h"
#include "eval/methods/tune.h"
#include "nn/weights/weights.h"
#include "render/error.h"
#include "render/render.h"
#include "tensor/peak.h"
#include "tensor/threads.h"
#include "tests/support/files.h"
#include "tests/test.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

enum { SIZE = 32, VALUES = SIZE * SIZE * MAP_CHANNELS };

typedef struct scene {
    io_material truth;
    float image[SIZE * SIZE * 3];
    rd_view views[RD_EVAL_VIEWS];
    ev_case c;
} scene;

static scene *make(uint64_t index)
{
    scene *s = calloc(1, sizeof *s);
    ts_status st = {0};
    const io_procedural p = {.seed = 77};
    CHECK(s && io_material_create(&s->truth, SIZE, &st) == TS_OK, "%s", st.message);
    io_procedural_make(&p, index, &s->truth);
    ts_rng rng = ts_rng_make(2, TS_STREAM_EVAL, index);
    rd_eval_views(&rng, RD_EVAL_VIEWS, s->views);
    ev_photograph(&s->truth, &(ev_photo){rd_flash(), 1, 0, 1, 1}, s->image);
    s->c = ev_case_of_maps(&s->truth, s->image, s->views, false);
    return s;
}

static nn_arch small(void)
{
    nn_arch a = nn_arch_default();
    a.g_width = 4, a.g_width_max = 8, a.g_levels = 2, a.g_size = 16, a.h_width = 4, a.h_gru = 4, a.iterations = 3;
    return a;
}

/* A file of random weights. */
static const char *weights_of(const nn_arch *a, const char *name)
{
    static char path[300];
    ts_status st = {0};
    nn_model *m = nn_model_create(a, &st);
    CHECK(m, "%s", st.message);
    nn_model_init(m, 5);
    snprintf(path, sizeof path, "%s/%s.safetensors", test_folder(), name);
    CHECK(nn_model_save(m, m->value, path, NULL, 0, &st) == TS_OK, "%s", st.message);
    nn_model_free(&m);
    return path;
}

/* A small g and h, or an auto-encoder, of random weights. */
static const char *weights(bool latent, bool gradient)
{
    static char path[3][300];
    char *p = path[latent ? 2 : gradient];
    ts_status st = {0};
    nn_arch a = small();
    a.gradient = gradient;
    const nn_coder coder = {.code = 4, .width = 4, .width_max = 8, .levels = 2};
    nn_model *m = latent ? nn_coder_create(&coder, &st) : nn_model_create(&a, &st);
    CHECK(m, "%s", st.message);
    nn_model_init(m, 5);
    snprintf(p, sizeof path[0], "%s/%d%d.safetensors", test_folder(), latent, gradient);
    CHECK(nn_model_save(m, m->value, p, NULL, 0, &st) == TS_OK, "%s", st.message);
    nn_model_free(&m);
    return p;
}

typedef struct seen_maps {
    int count, step[64];
    float *maps[64];
    double loss[64];
    const scene *s;
} seen_maps;

static bool keep(int step, const float *maps, int channels, void *user)
{
    seen_maps *k = user;
    const rd_view flash = rd_flash();
    CHECK(channels == MAP_CHANNELS && k->count < 64 && step == k->count, "step %d with %d channels", step, channels);
    k->maps[k->count] = malloc(VALUES * sizeof(float));
    memcpy(k->maps[k->count], maps, VALUES * sizeof(float));
    rd_flash_rmse(rd_grid_full(SIZE), maps, MAP_CHANNELS, &flash, k->s->image, &k->loss[k->count]);
    k->step[k->count++] = step;
    return true;
}

static void open(ev_estimator *e, const char *spec)
{
    ts_status st = {0};
    CHECK(ev_method_parse(spec, weights(false, true), -1, e, &st) == TS_OK && ev_open(e, &st) == TS_OK, "%s",
          st.message);
}

static void run(ev_estimator *e, const scene *s, seen_maps *k)
{
    ts_status st = {0};
    *k = (seen_maps){.s = s};
    CHECK(e->method->run(e, &s->c, keep, k, &st) == TS_OK, "%s", st.message);
}

/* Each with settings under which a few steps must already help. */
static const char *specs(int i)
{
    static char text[10][400];
    const char *const ae = weights(true, true);
    switch (i) {
    case 0: return "descent:steps=12,rate=0.02";
    case 1: return "descent:start=constant,steps=12,rate=0.02";
    case 2: return "finetune:steps=12,rate=0.001";
    case 3: return "newton:steps=12";
    case 4: return "newton:start=constant,steps=12";
    case 5: snprintf(text[5], sizeof text[5], "latent:steps=12,rate=0.05,model=%s", ae); return text[5];
    case 6: snprintf(text[6], sizeof text[6], "latent:steps=12,rate=0.05,start=constant,model=%s", ae); return text[6];
    case 7: return "mean";
    case 8: return "lgd";
    case 9: snprintf(text[9], sizeof text[9], "lgd-nograd:model=%s", weights(false, false)); return text[9];
    default: return NULL;
    }
}

TEST(methods_that_optimise_lower_the_reconstruction_loss)
{
    for (int i = 0; i < 7; i++) {
        ev_estimator e;
        seen_maps k;
        open(&e, specs(i));
        run(&e, make(3), &k);
        CHECK(k.count == 13, "%s: %d steps are seen", specs(i), k.count);
        /* What a random decoder can make of its code differs little. */
        CHECK(k.loss[12] < (i < 5 ? 0.8 : 0.98) * k.loss[0], "%s: the loss goes from %g to %g", specs(i), k.loss[0],
              k.loss[12]);
        ev_close(&e);
    }
}

TEST(methods_give_the_same_numbers_whatever_came_before_and_for_any_threads)
{
    scene *one = make(3), *two = make(4);
    for (int i = 0; specs(i); i++) {
        ev_estimator e;
        seen_maps a, b, other;
        ts_threads_set(1);
        open(&e, specs(i));
        run(&e, one, &a);
        run(&e, two, &other);
        ts_threads_set(3);
        run(&e, one, &b);
        for (int t = 0; t < a.count; t++)
            CHECK(!memcmp(a.maps[t], b.maps[t], VALUES * sizeof(float)), "%s: R_%d is another one", specs(i), t);
        CHECK(i == 7 || memcmp(a.maps[a.count - 1], other.maps[a.count - 1], VALUES * sizeof(float)),
              "%s does not look at the photograph", specs(i));
        ev_close(&e);
    }
}

TEST(methods_finetune_gives_the_weights_back)
{
    ev_estimator e;
    seen_maps k;
    open(&e, "finetune:steps=3");
    const size_t bytes = e.net->count * sizeof(float);
    float *before = malloc(bytes);
    memcpy(before, e.net->value, bytes);
    run(&e, make(3), &k);
    CHECK(!memcmp(before, e.net->value, bytes), "the weights have changed");
    CHECK(memcmp(k.maps[0], k.maps[3], VALUES * sizeof(float)) != 0, "nothing was tuned");
    ev_close(&e);
}

/* What all methods begin with is what the others say of it. */
TEST(methods_begin_with_what_they_say)
{
    ev_estimator lgd, unet, descent, constant, mean, tuned;
    seen_maps a, b, c, d, m, f;
    const scene *s = make(5);
    char spec[400];
    snprintf(spec, sizeof spec, "unet:model=%s", weights(false, true));
    open(&lgd, "lgd:iterations=0"), run(&lgd, s, &a);
    open(&unet, spec), run(&unet, s, &b);
    open(&descent, "descent:steps=0"), run(&descent, s, &c);
    open(&tuned, "finetune:steps=0"), run(&tuned, s, &f);
    CHECK(!memcmp(a.maps[0], b.maps[0], VALUES * sizeof(float)) &&
              !memcmp(a.maps[0], c.maps[0], VALUES * sizeof(float)) &&
              !memcmp(a.maps[0], f.maps[0], VALUES * sizeof(float)),
          "R_0 differs");
    open(&constant, "descent:start=constant,steps=0"), run(&constant, s, &d);
    open(&mean, "mean:fit=no"), run(&mean, s, &m);
    CHECK(!memcmp(d.maps[0], m.maps[0], VALUES * sizeof(float)), "the constant is not mean's");
    for (int i = MAP_CHANNELS; i < VALUES; i++)
        CHECK(m.maps[0][i] == m.maps[0][i % MAP_CHANNELS], "mean is not constant");
}

/* Weights of a model that guesses the scene. */
static const char *guesses_scene(void)
{
    nn_arch arch = small();
    arch.g_unshuffle = 4, arch.g_detail = 6, arch.h_width = 0, arch.descent = NN_DESCENT_POSTERIOR;
    arch.conditions = arch.spread = arch.scene = true;
    return weights_of(&arch, "scene");
}

/* Where the light is known it stays; where it is not, the method says where it found it. */
TEST(methods_say_where_light_and_camera_are)
{
    const scene *s = make(5);
    for (int known = 0; known < 2; known++) {
        ev_estimator e;
        seen_maps k;
        char spec[400];
        snprintf(spec, sizeof spec, "lgd:model=%s%s", guesses_scene(), known ? "" : ",power=auto,view=unknown");
        open(&e, spec), run(&e, s, &k);
        float off = 0;
        for (int i = 0; i < 3; i++)
            off += fabsf(e.found.light[i] - s->c.view.light[i]) + fabsf(e.found.camera[i] - s->c.view.camera[i]);
        CHECK(known ? off < 1e-5f : off > 1e-3f, "light and camera are off by %g", off);
        CHECK(known == (fabsf(e.found.power / s->c.view.power - 1) < 1e-5f), "a power of %g", e.found.power);
        ev_close(&e);
    }
}

/* R_0 of a method is g's own answer (finetune's step 0) where the estimator would fit scene and roughness first. */
TEST(methods_begin_with_what_g_says_of_a_model_that_guesses_the_scene)
{
    ev_estimator g, descent, tuned, lgd;
    seen_maps a, b, c, d;
    const scene *s = make(5);
    char spec[400];
    const char *path = guesses_scene();
    snprintf(spec, sizeof spec, "unet:model=%s", path), open(&g, spec), run(&g, s, &a);
    snprintf(spec, sizeof spec, "descent:steps=0,model=%s", path), open(&descent, spec), run(&descent, s, &b);
    snprintf(spec, sizeof spec, "finetune:steps=0,model=%s", path), open(&tuned, spec), run(&tuned, s, &c);
    snprintf(spec, sizeof spec, "lgd:iterations=0,model=%s", path), open(&lgd, spec), run(&lgd, s, &d);
    CHECK(!memcmp(a.maps[0], c.maps[0], VALUES * sizeof(float)), "unet is not what g says");
    CHECK(!memcmp(b.maps[0], c.maps[0], VALUES * sizeof(float)), "descent does not begin with what g says");
    CHECK(memcmp(d.maps[0], c.maps[0], VALUES * sizeof(float)) != 0, "lgd fits nothing");
    ev_close(&g), ev_close(&descent), ev_close(&tuned), ev_close(&lgd);
}

TEST(methods_read_no_more_photographs_than_there_are)
{
    nn_arch arch = small();
    arch.images = 2;
    char lgd[400];
    snprintf(lgd, sizeof lgd, "lgd:model=%s", weights_of(&arch, "two"));
    const char *const spec[] = {lgd, "descent:steps=2,photos=2", "newton:steps=2,photos=2"};
    static float image[2][SIZE * SIZE * 3]; /* what lies behind the one photograph is not of this case */
    scene *s = make(5);
    memcpy(image[0], s->image, sizeof image[0]);
    s->c.image = image[0];
    for (int i = 0; i < 3; i++) {
        ev_estimator e;
        seen_maps k[2];
        open(&e, spec[i]);
        for (int j = 0; j < 2; j++) {
            for (int p = 0; p < SIZE * SIZE * 3; p++) image[1][p] = j ? 0.75f : 0.25f;
            run(&e, s, &k[j]);
        }
        CHECK(!memcmp(k[0].maps[2], k[1].maps[2], VALUES * sizeof(float)), "%s reads a second photograph", spec[i]);
        ev_close(&e);
    }
}

TEST(methods_mean_is_as_bright_as_the_photograph)
{
    ev_estimator mean;
    seen_maps k;
    const rd_view flash = rd_flash();
    for (int i = 0; i < 6; i++) {
        scene *s = make((uint64_t)i);
        open(&mean, "mean"), run(&mean, s, &k);
        const float d = k.maps[0][0];
        if (d <= -1 || d >= 1) continue; /* no diffuse can do it */
        static float again[SIZE * SIZE * 3];
        double photo = 0, mine = 0;
        rd_render(rd_grid_full(SIZE), k.maps[0], MAP_CHANNELS, &flash, false, again);
        for (int p = 0; p < SIZE * SIZE; p++) photo += (double)s->image[3 * p], mine += (double)again[3 * p];
        CHECK(fabs(mine / photo - 1) < 1e-3, "red is %g times the photograph's", mine / photo);
        ev_close(&mean);
    }
}

/* --help and docs/methods.md name them. */
TEST(methods_that_are_searched_by_default)
{
    char names[200] = "";
    for (int i = 0; ev_methods[i]; i++)
        if (ev_tune_by_default(ev_methods[i])) strcat(strcat(names, ev_methods[i]->name), " ");
    CHECK(!strcmp(names, "mean lgd descent newton finetune "), "%s", names);
}

TEST(methods_points_and_settings)
{
    ev_estimator e;
    ts_status st = {0};
    int step[EV_POINTS];
    open(&e, "descent:steps=30,label=x y");
    static const int want[] = {0, 1, 2, 5, 10, 20, 30};
    CHECK(ev_points(&e, step) == 7 && !memcmp(step, want, sizeof want) && !strcmp(e.label, "x y"), "points");
    ev_close(&e);
    open(&e, "lgd:tolerance=0.5");
    CHECK(ev_points(&e, step) == 1 && step[0] == 3, "only the last is known with a tolerance");
    CHECK(ev_bytes(&e) >= e.net->count * sizeof(float), "the weights are not counted");
    ev_close(&e);
    CHECK(ev_method_parse("lgd", weights(true, true), -1, &e, &st) == TS_OK && ev_open(&e, &st) == TS_UNSUPPORTED &&
              strstr(st.message, "auto-encoder"),
          "%s", st.message);
    const double peak = ts_fma_peak();
    CHECK(isfinite(peak) && peak > 0, "the peak is %g FLOP/s", peak);
}

/* A tile that nothing may end early is the whole photograph's result. */
TEST(methods_tolerance_that_ends_nothing_changes_nothing)
{
    ev_estimator a, b;
    seen_maps whole;
    ts_status st = {0};
    const scene *s = make(6);
    open(&a, "lgd"), run(&a, s, &whole);
    open(&b, "lgd:tolerance=1e-30");
    static float last[VALUES];
    ev_row row;
    double seconds;
    const int step = 3;
    CHECK(ev_estimate(&b, &s->c, &step, 1, 1, &row, &seconds, NULL, last, &st) == TS_OK, "%s", st.message);
    for (int i = 0; i < VALUES; i++)
        CHECK(fabsf(last[i] - whole.maps[3][i]) < 1e-5f, "value %d: %g, not %g", i, (double)last[i],
              (double)whole.maps[3][i]);
}

TEST(methods_grids_are_at_least_as_large_as_lgd_s)
{
    ev_tuning t = {0};
    ts_status st = {0};
    char spec[400];
    int tried[3] = {0};
    snprintf(spec, sizeof spec, "latent:model=%s", weights(true, true));
    const char *const specs_of[] = {"descent", "finetune", spec};
    for (int i = 0; i < 3; i++)
        CHECK(ev_tune_add(&t, specs_of[i], i, weights(false, true), &st) == TS_OK, "%s", st.message);
    for (int m = 0; m < t.methods; m++) {
        int step[EV_POINTS];
        CHECK(!strcmp(t.method[m].method->name,
                      t.of[m] == 0       ? "descent"
                          : t.of[m] == 1 ? "finetune"
                                         : "latent"),
              "the wrong method");
        for (int k = 0; k < m; k++)
            CHECK(strcmp(t.method[m].label, t.method[k].label) != 0, "%s twice", t.method[m].label);
        CHECK(ev_open(&t.method[m], &st) == TS_OK, "%s: %s", t.method[m].label, st.message);
        tried[t.of[m]] += ev_points(&t.method[m], step);
        ev_close(&t.method[m]);
    }
    CHECK(tried[0] >= 25 && tried[1] >= 25 && tried[2] >= 25, "%d, %d, %d settings, lgd has 25", tried[0], tried[1],
          tried[2]);
    ev_tune_free(&t);
}

TEST(methods_pareto_has_every_size)
{
    ev_set set[2];
    ts_status st = {0};
    char path[400], line[200], bad[400];
    mkdir(path_of("strips"), 0700);
    spill(path_of("strips/bad.png"), "no strip", 8);
    snprintf(bad, sizeof bad, "strips:%s", path_of("strips"));
    const char *const name[] = {"procedural:5,1", bad};
    for (int s = 0; s < 2; s++) CHECK(ev_set_open(name[s], NULL, &set[s], &st) == TS_OK, "%s", st.message);
    ev_run r = {.set = set, .set_name = name, .sets = 2, .repeat = 1, .seed = 1};
    const int sizes[] = {16, 32};
    CHECK(ev_pareto(&r, sizes, 2, weights(false, true), test_folder(), &st) == TS_OK, "%s", st.message);
    snprintf(path, sizeof path, "%s/pareto.csv", test_folder());
    FILE *f = fopen(path, "r");
    int lines = 0, finite = 0;
    while (f && fgets(line, sizeof line, f)) {
        double seconds, error;
        const char *at = strrchr(line, ','), *name_end = line[0] == '"' ? strchr(line + 1, '"') : NULL;
        lines++;
        finite += at && name_end && sscanf(name_end, "\",%*[^,],%lf,%lf", &seconds, &error) == 2;
    }
    CHECK(f && lines == 1 + 2 * (2 * 25 + 5), "%d lines", lines);
    CHECK(finite >= 2 * (2 * 5 + 5), "%d labelled lines with numbers", finite);
    CHECK(r.failures == 2, "%d failures of a strip that is none, at two sizes", r.failures);
    for (int s = 0; s < 2; s++) ev_set_close(&set[s]);
}
