/* Estimates of a model that guesses the scene and steps to the most probable maps. */
#include "infer/estimate.h"
#include "infer/tiles.h"
#include "nn/first_guess.h"
#include "render/scene_model.h"
#include "tests/support/networks.h"

enum { PLACE = 64, WIDE = 600 };

static float *estimate(const nn_model *m, const float *image, int side, int steps, double *power)
{
    ts_status st = {0};
    float *maps = malloc(sizeof *maps * (size_t)side * (size_t)side * 9);
    ag_tape *tape = tape_create(false);
    ag_freeze(tape, true);
    const lgd_photo photo = lgd_flash_photo(image);
    const lgd_options o = {
        .size = sizeof o, .iterations = steps, .power = power, .fov = power ? LGD_FOV_UNKNOWN : LGD_FOV_OF_PHOTO};
    const lgd_estimator e = {.net = m, .tape = tape, .encoded = true};
    CHECK(!lgd_estimator_run(&e, &photo, 1, side, &o, maps, &st), "%s", st.message);
    ag_tape_destroy(&tape);
    return maps;
}

static double rmse(const float *maps, const float *image, int side)
{
    const rd_view view = rd_flash();
    double error;
    rd_flash_rmse(rd_grid_full(side), maps, 9, &view, image, &error);
    return error;
}

/* g's own guess of a photograph this many times as bright as given. */
static void said_of(ag_tape *tape, const nn_model *m, nn_input in, float brightness, nn_guess *said)
{
    ag_value *v = ag_empty(tape, in.image.shape);
    for (int64_t i = 0; i < ts_count(v->t.shape); i++) v->t.data[i] = brightness * in.image.data[i];
    in.image = v->t;
    CHECK(nn_guess_from(tape, m, &in, said), "%s", ag_status(tape)->message);
}

/* A photograph whose light's power is not known is read at NN_READ_AT, another as it is; and the fit of an exposure,
 * which has nothing else to go by where g is sure of it, ends at what g says of the darker picture, made brighter. */
TEST(first_guess_reads_unknown_powers_darker)
{
    nn_model *m = guessing();
    static const char *const last[] = {"g.detail.conv5.weight", "g.scene.numbers.weight"}; /* they begin as nothing */
    for (int k = 0; k < 2; k++) {
        const nn_param *p = nn_model_find(m, last[k]);
        ts_rng r = ts_rng_make(5, TS_STREAM_TEST, k);
        CHECK(p, "no %s", last[k]);
        for (size_t i = 0; i < p->count; i++) m->value[p->offset + i] = ts_rng_range(&r, -0.1f, 0.1f);
    }
    const nn_param *bias = nn_model_find(m, "g.scene.numbers.bias");
    CHECK(bias && bias->count == 2 * RD_SCENE_NUMBERS, "the head of the scene has another name");
    m->value[bias->offset + RD_SCENE_NUMBERS + RD_SCENE_EXPOSURE] = -20;
    nn_input in = photographs(1, PLACE, 82, NULL);
    const rd_view view = rd_flash();
    for (int k = 0; k < 2; k++) {
        const unsigned char known = k ? NN_KNOWN_ALL : NN_KNOWN_CAMERA | NN_KNOWN_LIGHT;
        const nn_first_ask ask = {.image = in.image.data,
                                  .side = PLACE,
                                  .taken = {.view = view, .known = known, .photographs = 1},
                                  .orientations = 1};
        ts_status st = {0};
        ag_tape *tape = tape_create(false);
        nn_first_guess g;
        nn_guess same, darker;
        CHECK(!nn_first_guess_make(tape, m, &ask, &g, &st), "%s", st.message);
        in.views = &view, in.known = &known, in.given = 1;
        said_of(tape, m, in, 1, &same);
        said_of(tape, m, in, NN_READ_AT, &darker);
        double as_it_is = 0, as_darker = 0;
        for (int i = 0; i < PLACE * PLACE * NN_SPREADS; i++) {
            as_it_is = farther(as_it_is, fabs((double)(g.spread[i] - same.spread->t.data[i])));
            as_darker = farther(as_darker, fabs((double)(g.spread[i] - darker.spread->t.data[i])));
        }
        CHECK((k ? as_it_is : as_darker) == 0, "it is read otherwise: off by %g, %g", as_it_is, as_darker);
        CHECK((k ? as_darker : as_it_is) > 1e-4, "brightness changes nothing: %g, %g", as_it_is, as_darker);
        const double exposure = (double)darker.scene->t.data[RD_SCENE_EXPOSURE] - log2((double)NN_READ_AT);
        CHECK(k || fabs((double)g.number[RD_SCENE_EXPOSURE] - exposure) < 0.01, "an exposure of %g for %g",
              (double)g.number[RD_SCENE_EXPOSURE], exposure);
        ag_tape_destroy(&tape);
    }
    free(in.image.data);
    nn_model_free(&m);
}

/* Under a scene that is known the steps bring renderings nearer to the photograph, and leave them where it is black
 * and white alike. */
TEST(first_guess_steps_explain_the_photograph)
{
    nn_model *m = guessing();
    const nn_input in = photographs(1, PLACE, 82, NULL);
    float *r0 = estimate(m, in.image.data, PLACE, 0, NULL), *r4 = estimate(m, in.image.data, PLACE, 4, NULL);
    const double before = rmse(r0, in.image.data, PLACE), after = rmse(r4, in.image.data, PLACE);
    CHECK(after < 0.7 * before, "RMSE %g after %g", after, before);
    for (int i = 0; i < PLACE * PLACE * 9; i++) CHECK(r4[i] >= -1 && r4[i] <= 1, "a map of %g", (double)r4[i]);
    free(r0);
    free(r4);
    free(in.image.data);
    nn_model_free(&m);
}

/* The same scene, its power said to be known or not: a photograph of unknown exposure moves the maps less. */
TEST(first_guess_trusts_a_careful_photograph_more)
{
    nn_model *m = guessing();
    const nn_input in = photographs(1, PLACE, 82, NULL);
    const rd_view view = rd_flash();
    const float *image = in.image.data;
    enum { VALUES = PLACE * PLACE * 9 };
    float *maps = malloc(3 * VALUES * sizeof *maps), *deviation = malloc(PLACE * PLACE * NN_SPREADS * sizeof(float));
    for (int i = 0; i < PLACE * PLACE * NN_SPREADS; i++) deviation[i] = 0.1f;
    for (int k = 0; k < 3; k++) {
        const unsigned char known = k == 2 ? NN_KNOWN_ALL & ~NN_KNOWN_POWER : NN_KNOWN_ALL;
        float *r0 = calloc(VALUES, sizeof *r0);
        lgd_tiles t = {.image = &image,
                       .views = &view,
                       .known = &known,
                       .given = 1,
                       .r0 = r0,
                       .deviation = deviation,
                       .side = PLACE,
                       .tile = PLACE,
                       .steps = k > 0};
        ts_status st = {0};
        ag_tape *tape = tape_create(false);
        ag_freeze(tape, true);
        CHECK(!lgd_tiles_run(tape, m, &t, maps + k * VALUES, &st), "%s", st.message);
        ag_tape_destroy(&tape);
        free(r0);
    }
    double moved[2] = {0};
    for (int k = 0; k < 2; k++)
        for (int i = 0; i < VALUES; i++) moved[k] += fabs((double)(maps[(k + 1) * VALUES + i] - maps[i]));
    CHECK(moved[1] > 0 && moved[1] < 0.8 * moved[0], "moved %g with the power known, %g without", moved[0], moved[1]);
    free(maps), free(deviation);
    free(in.image.data);
    nn_model_free(&m);
}

/* What shades one side of a photograph whose power is not known is no slope of the sample. */
TEST(first_guess_leaves_a_sample_flat_where_another_light_shines)
{
    enum { PIXELS = PLACE * PLACE };
    float scene[2 * RD_SCENE_NUMBERS] = {0}, *maps = calloc(PIXELS * 9, sizeof *maps),
                    *image = malloc(PIXELS * 3 * sizeof *image);
    for (int i = 0; i < PIXELS; i++) {
        for (int k = 0; k < 3; k++) maps[i * 9 + MAP_DIFFUSE + k] = -0.4f, maps[i * 9 + MAP_SPECULAR + k] = -0.92f;
        maps[i * 9 + MAP_ROUGHNESS] = 0;
    }
    for (int i = RD_SCENE_NUMBERS; i < 2 * RD_SCENE_NUMBERS; i++) scene[i] = -1;
    rd_scene_photograph(rd_grid_full(PLACE), maps, 9, scene, false, image);
    for (int i = 0; i < PIXELS * 3; i++) image[i] *= 1 + 0.3f * nn_place(i / 3 % PLACE, PLACE);
    double leans[2];
    for (int careful = 0; careful < 2; careful++) {
        ts_status st = {0};
        ag_tape *tape = tape_create(false);
        ag_value *r0 = ag_empty(tape, (ts_shape){1, PLACE, PLACE, 9}),
                 *spread = ag_empty(tape, (ts_shape){1, PLACE, PLACE, NN_SPREADS}),
                 *deviation = ag_empty(tape, (ts_shape){1, PLACE, PLACE, NN_SPREADS});
        CHECK(r0 && spread && deviation, "out of memory");
        memcpy(r0->t.data, maps, PIXELS * 9 * sizeof *maps);
        for (int i = 0; i < PIXELS * NN_SPREADS; i++) spread->t.data[i] = -1;
        nn_first_guess g = {.r0 = r0->t.data, .spread = spread->t.data, .deviation = deviation->t.data};
        const nn_taken taken = {.view = rd_flash(), .known = careful ? NN_KNOWN_POWER : 0, .photographs = 1};
        CHECK(!nn_first_guess_settle(rd_grid_full(PLACE), 9, image, scene, &taken, ag_arena(tape), &g, &st), "%s",
              st.message);
        leans[careful] = fabs((double)g.r0[MAP_NORMAL]);
        ag_tape_destroy(&tape);
    }
    CHECK(leans[1] > 0.003 && leans[0] < 0.1 * leans[1], "it leans by %g, with the power known by %g", leans[0],
          leans[1]);
    free(maps), free(image);
}

/* A network that is sure of its maps keeps them. */
TEST(first_guess_that_is_sure_stays)
{
    nn_model *m = guessing();
    const nn_param *bias = nn_model_find(m, "g.detail.conv5.bias");
    for (size_t i = 11; i < bias->count; i++) m->value[bias->offset + i] = -6;
    const nn_input in = photographs(1, PLACE, 83, NULL);
    float *r0 = estimate(m, in.image.data, PLACE, 0, NULL), *r4 = estimate(m, in.image.data, PLACE, 4, NULL);
    double sum = 0;
    for (int i = 0; i < PLACE * PLACE * 9; i++)
        sum += ((double)r0[i] - (double)r4[i]) * ((double)r0[i] - (double)r4[i]);
    sum = sqrt(sum / (PLACE * PLACE * 9));
    CHECK(sum < 3e-4, "the maps moved by %g (RMS)", sum);
    free(r0);
    free(r4);
    free(in.image.data);
    nn_model_free(&m);
}

/* What is known of the scene is kept as it is; what is not is finite and reported. */
TEST(first_guess_keeps_what_is_known)
{
    nn_model *m = guessing();
    const nn_input in = photographs(1, PLACE, 84, NULL);
    ts_status st = {0};
    ag_tape *tape = tape_create(false);
    rd_view view = rd_flash();
    view.camera[2] = view.light[2] = 1.5f;
    view.light[0] = 0.1f;
    for (int known = 0; known <= NN_KNOWN_ALL; known++) {
        nn_first_guess g;
        float want[RD_SCENE_NUMBERS];
        const nn_first_ask ask = {.image = in.image.data, .side = PLACE, .taken = {view, known, 1, NN_KIND_UNKNOWN}};
        CHECK(!nn_first_guess_make(tape, m, &ask, &g, &st), "%s", st.message);
        rd_scene_numbers(&view, 0, 0, want);
        for (int i = 0; i < RD_SCENE_NUMBERS; i++) CHECK(isfinite(g.number[i]), "number %d is not finite", i);
        if (known & NN_KNOWN_CAMERA)
            CHECK(g.number[RD_SCENE_DISTANCE] == want[RD_SCENE_DISTANCE], "known %d: the distance moved", known);
        if (known & NN_KNOWN_LIGHT)
            CHECK(g.number[RD_SCENE_LIGHT_X] == want[RD_SCENE_LIGHT_X], "known %d: the light moved", known);
        if (known & NN_KNOWN_POWER)
            CHECK(g.number[RD_SCENE_EXPOSURE] == want[RD_SCENE_EXPOSURE], "known %d: the power changed", known);
    }
    ag_tape_destroy(&tape);
    double power = 0;
    free(estimate(m, in.image.data, PLACE, 0, &power));
    CHECK(power > 0 && isfinite(power), "a power of %g", power);
    free(in.image.data);
    nn_model_free(&m);
}

/* The field of view and the power are given or guessed each by itself. */
TEST(first_guess_is_told_view_and_power_apart)
{
    nn_model *m = guessing();
    const nn_input in = photographs(3, PLACE, 86, NULL);
    static float maps[PLACE * PLACE * 9];
    ts_status st = {0};
    ag_tape *tape = tape_create(false);
    ag_freeze(tape, true);
    const lgd_estimator e = {.net = m, .tape = tape};
    for (int k = 0; k < 4; k++) {
        const bool view = k & 1, power_known = k & 2;
        double power = 0;
        lgd_photo photo = lgd_flash_photo(in.image.data), taken;
        const lgd_options o = {.size = sizeof o,
                               .fov = view ? 30 : LGD_FOV_UNKNOWN,
                               .power = power_known ? NULL : &power,
                               .taken = &taken};
        CHECK(!lgd_estimator_run(&e, &photo, 1, PLACE, &o, maps, &st), "%s", st.message);
        const double seen = rd_fov_of((double)taken.camera[2]),
                     bright = (double)(taken.power / (taken.light[2] * taken.light[2])) /
            ((double)RD_FLASH_POWER / ((double)RD_FLASH_DISTANCE * (double)RD_FLASH_DISTANCE));
        CHECK((fabs(seen - 30) < 1e-3) == view, "case %d: a field of view of %g", k, seen);
        CHECK((fabs(bright - 1) < 1e-4) == power_known, "case %d: a power of %g", k, bright);
        CHECK(power_known || fabs(power - bright) < 1e-4, "case %d: %g is reported, %g was taken", k, power, bright);
    }
    ag_tape_destroy(&tape);
    free(in.image.data);
    nn_model_free(&m);
}

/* In tiles as in one piece; of a photograph whose power is not known, burnt out in places, also with more steps than
 * the model's. */
TEST(first_guess_in_tiles)
{
    static const struct {
        bool power;
        int steps;
    } given[] = {{true, 2}, {false, 2}, {false, 5}};
    nn_model *m = guessing();
    CHECK(m->arch.iterations < 5, "the model makes %d steps", m->arch.iterations);
    const nn_input in = photographs(1, WIDE, 85, NULL);
    for (int i = 0; i < WIDE * WIDE * 3; i++) in.image.data[i] = fminf(2.5f * in.image.data[i], 1);
    float *whole = malloc(sizeof *whole * WIDE * WIDE * 9);
    unsigned char *mask = malloc((size_t)WIDE * WIDE);
    memset(mask, 1, (size_t)WIDE * WIDE);
    for (size_t k = 0; k < sizeof given / sizeof *given; k++) {
        double power = 0;
        float *tiles = estimate(m, in.image.data, WIDE, given[k].steps, given[k].power ? NULL : &power);
        ts_status st = {0};
        ag_tape *tape = tape_create(false);
        ag_freeze(tape, true);
        const lgd_photo photo = lgd_flash_photo(in.image.data);
        const lgd_options o = {.size = sizeof o,
                               .iterations = given[k].steps,
                               .mask = mask, /* other tiles */
                               .power = given[k].power ? NULL : &power,
                               .fov = given[k].power ? LGD_FOV_OF_PHOTO : LGD_FOV_UNKNOWN};
        const lgd_estimator e = {.net = m, .tape = tape, .encoded = true};
        CHECK(!lgd_estimator_run(&e, &photo, 1, WIDE, &o, whole, &st), "%s", st.message);
        CHECK(!memcmp(tiles, whole, sizeof *whole * WIDE * WIDE * 9), "case %d: tiles of another size give other maps",
              (int)k);
        ag_tape_destroy(&tape);
        free(tiles);
    }
    free(mask);
    free(whole);
    free(in.image.data);
    nn_model_free(&m);
}

typedef struct seen_steps {
    int count, stop_at;
    int at[16];
    float *maps[16];
} seen_steps;

static bool on_seen(int step, const float *maps, int channels, void *user)
{
    seen_steps *s = user;
    const size_t size = (size_t)PLACE * PLACE * (size_t)channels * sizeof(float);
    s->at[s->count] = step;
    memcpy(s->maps[s->count++] = malloc(size), maps, size);
    return step != s->stop_at;
}

static seen_steps watch_steps(const nn_model *m, const float *images, int count, int iterations, int stop_at,
                              float *result)
{
    seen_steps s = {.stop_at = stop_at};
    ts_status st = {0};
    ag_tape *tape = tape_create(false);
    ag_freeze(tape, true);
    lgd_photo photo[3];
    for (int k = 0; k < count; k++) {
        photo[k] = lgd_flash_photo(images + k * PLACE * PLACE * 3);
        photo[k].light[0] = 0.3f * (float)k;
    }
    const lgd_options o = {.size = sizeof o, .iterations = iterations, .fov = LGD_FOV_OF_PHOTO};
    const lgd_estimator e = {.net = m, .tape = tape, .encoded = true, .seen = on_seen, .user = &s};
    CHECK(!lgd_estimator_run(&e, photo, count, PLACE, &o, result, &st), "%s", st.message);
    ag_tape_destroy(&tape);
    return s;
}

static void free_steps(seen_steps *s)
{
    for (int i = 0; i < s->count; i++) free(s->maps[i]);
}

/* Of several photographs R_0 is g's, then come h's revisions, then the steps; fewer steps end earlier, and whoever
 * stops gets what was seen last. One photograph has no revisions. */
TEST(first_guess_is_revised_in_the_first_steps)
{
    nn_model *m = revising();
    const nn_input in = photographs(3, PLACE, 86, NULL);
    enum { VALUES = PLACE * PLACE * 9 };
    static float all[VALUES], some[VALUES];
    seen_steps one = watch_steps(m, in.image.data, 1, -1, -1, all);
    CHECK(one.count == 5, "of one photograph %d steps are seen", one.count);
    free_steps(&one);
    seen_steps whole = watch_steps(m, in.image.data, 3, -1, -1, all);
    CHECK(whole.count == 9, "%d steps are seen", whole.count);
    for (int i = 0; i < whole.count; i++) CHECK(whole.at[i] == i, "step %d is seen as %d", i, whole.at[i]);
    for (int i = 1; i <= 2; i++)
        CHECK(memcmp(whole.maps[i], whole.maps[i - 1], sizeof all), "revision %d changes nothing", i);
    for (int n = 0; n <= 3; n++)
        for (int stop = 0; stop < 2; stop++) {
            seen_steps part = watch_steps(m, in.image.data, 3, stop ? -1 : n, stop ? n : -1, some);
            CHECK(part.count == n + 1, "%d of %d steps are seen", part.count, n);
            CHECK(!memcmp(part.maps[n], whole.maps[n], sizeof all), "R_%d depends on what follows", n);
            for (int i = 0; i < VALUES; i++)
                CHECK(i % 9 == MAP_NORMAL || i % 9 == MAP_NORMAL + 1 ||
                          fabsf(some[i] - fminf(fmaxf(whole.maps[n][i], -1), 1)) < 1e-6f,
                      "R_%d: value %d is %g, not %g", n, i, (double)some[i], (double)whole.maps[n][i]);
            free_steps(&part);
        }
    free_steps(&whole);
    free(in.image.data);
    nn_model_free(&m);
}

/* Steps from normals that lie nearly in the sample's plane and lean outwards end at such as the camera sees. */
TEST(first_guess_is_refined_to_normals_that_face_the_camera)
{
    enum { PIXELS = PLACE * PLACE };
    nn_model *m = guessing();
    const rd_view view = rd_flash();
    float *r0 = numbers(PIXELS * 9, 3, -0.3f, 0.3f), *image = numbers(PIXELS * 3, 4, 0, 1),
          *deviation = malloc(PIXELS * NN_SPREADS * sizeof *deviation), *maps = malloc(PIXELS * 9 * sizeof *maps);
    for (int i = 0; i < PIXELS; i++)
        r0[i * 9 + MAP_NORMAL] = i % PLACE < PLACE / 2 ? -0.97f : 0.97f, r0[i * 9 + MAP_NORMAL + 1] = 0;
    for (int i = 0; i < PIXELS * NN_SPREADS; i++) deviation[i] = 0.05f;
    ts_status st = {0};
    ag_tape *tape = tape_create(false);
    ag_freeze(tape, true);
    lgd_tiles t = {.image = (const float *const[]){image}, .views = &view, .given = 1, .r0 = r0, .steps = 1};
    t.deviation = deviation, t.side = t.tile = PLACE;
    CHECK(!lgd_tiles_run(tape, m, &t, maps, &st), "%s", st.message);
    for (int i = 0; i < PIXELS; i++) {
        const double x = (i % PLACE + 0.5) / PLACE - 0.5, y = 0.5 - (i / PLACE + 0.5) / PLACE,
                     n[2] = {(double)maps[i * 9 + MAP_NORMAL], (double)maps[i * 9 + MAP_NORMAL + 1]},
                     up = sqrt(fmax(1 - n[0] * n[0] - n[1] * n[1], 0)), height = (double)view.camera[2],
                     seen = (height * up - x * n[0] - y * n[1]) / sqrt(height * height + x * x + y * y);
        CHECK(seen > 0.199, "pixel %d has a cosine of %g", i, seen);
    }
    ag_tape_destroy(&tape);
    free(r0), free(image), free(deviation), free(maps);
    nn_model_free(&m);
}
