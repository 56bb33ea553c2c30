/* The estimator that lgd.h, lgd-infer and lgd-eval share: what a watcher sees is what comes out. */
#include "data/material.h"
#include "infer/estimate.h"
#include "tests/support/networks.h"

enum { STEPS = 4, LARGE = 520 /* more than one tile */ };

typedef struct trace {
    int count, steps[STEPS + 1], side, stop_at;
    float *last; /* [side][side][9] */
} trace;

static bool see(int step, const float *maps, int channels, void *user)
{
    trace *t = user;
    CHECK(t->count <= STEPS && channels == 9, "%d calls, %d channels", t->count, channels);
    t->steps[t->count++] = step;
    memcpy(t->last, maps, (size_t)t->side * (size_t)t->side * 9 * sizeof(float));
    return step != t->stop_at;
}

static nn_model *network(int coarse_steps)
{
    nn_arch a = tiny();
    a.coarse_steps = coarse_steps, a.coarse_width = 6, a.coarse_gru = 3;
    nn_model *m = create(&a, 61);
    enliven(m);
    return m;
}

static void estimate(const nn_model *m, bool encoded, const float *image, const lgd_options *o, trace *t, float *maps)
{
    ts_status st = {0};
    ag_tape *tape = tape_create(false);
    ag_freeze(tape, true);
    const lgd_photo photo = lgd_flash_photo(image);
    const lgd_estimator e = {.net = m, .tape = tape, .encoded = encoded, .seen = t->last ? see : NULL, .user = t};
    t->count = 0;
    CHECK(!lgd_estimator_run(&e, &photo, 1, t->side, o, maps, &st), "%s", st.message);
    ag_tape_destroy(&tape);
}

/* R_0 ... R_T in turn, and the last is the result but for its form; a stop at any step is that many steps. */
TEST(estimator_watcher_sees_what_comes_out)
{
    enum { PLACE = 40, VALUES = PLACE * PLACE * 9 };
    static float encoded[VALUES], values[VALUES], stopped[VALUES];
    for (int coarse = 0; coarse <= 2; coarse += 2) {
        nn_model *m = network(coarse);
        const nn_input in = photographs(1, PLACE, 62, NULL);
        for (int stop = -1; stop <= STEPS; stop++) {
            const lgd_options o = {.size = sizeof o, .iterations = STEPS},
                              fewer = {.size = sizeof fewer, .iterations = stop < 0 ? STEPS : stop};
            trace t = {.side = PLACE, .stop_at = stop, .last = malloc(sizeof encoded)}, blind = {.side = PLACE};
            estimate(m, true, in.image.data, &o, &t, stopped);
            estimate(m, true, in.image.data, &fewer, &blind, encoded);
            estimate(m, false, in.image.data, &fewer, &blind, values);
            CHECK(t.count == fewer.iterations + 1, "stopped at %d: %d calls", stop, t.count);
            for (int i = 0; i < t.count; i++) CHECK(t.steps[i] == i, "call %d: step %d", i, t.steps[i]);
            CHECK(!memcmp(stopped, encoded, sizeof encoded), "stopped at %d: other maps", stop);
            for (int i = 0; i < PLACE * PLACE; i++) {
                float want[9];
                const io_texel texel = io_texel_get(t.last + 9 * i);
                io_texel_put(want, &texel);
                CHECK(!memcmp(want, encoded + 9 * i, sizeof want), "pixel %d is not what was seen", i);
                CHECK(values[9 * i] == texel.diffuse[0] && values[9 * i + 3] == texel.normal[0] &&
                          values[9 * i + 5] == texel.roughness && values[9 * i + 8] == texel.specular[2],
                      "pixel %d: the two forms differ", i);
            }
            free(t.last);
        }
        free(in.image.data);
        nn_model_free(&m);
    }
}

/* A large photograph is one tile for who looks at every step, to the result of its tiles; where a tolerance ends tiles
 * by themselves, only the last step is seen. */
TEST(estimator_watcher_of_a_large_photograph)
{
    nn_model *m = network(2);
    const nn_input in = photographs(1, LARGE, 63, NULL);
    const size_t count = (size_t)LARGE * LARGE * 9;
    float *tiles = malloc(count * sizeof *tiles), *one = malloc(count * sizeof *one);
    const lgd_options o = {.size = sizeof o, .iterations = STEPS},
                      tolerant = {.size = sizeof tolerant, .iterations = STEPS, .tolerance = 1e-6};
    trace t = {.side = LARGE, .stop_at = -1, .last = malloc(count * sizeof(float))}, blind = {.side = LARGE};
    CHECK(tiles && one && t.last, "no memory");
    estimate(m, true, in.image.data, &o, &blind, tiles);
    estimate(m, true, in.image.data, &o, &t, one);
    CHECK(t.count == STEPS + 1, "%d calls", t.count);
    double far = 0;
    for (size_t i = 0; i < count; i++) far = farther(far, fabs((double)tiles[i] - one[i]));
    CHECK(far < 2e-5, "%g away", far);
    estimate(m, true, in.image.data, &tolerant, &t, one);
    CHECK(t.count == 1 && t.steps[0] == STEPS, "%d calls, the first of step %d", t.count, t.steps[0]);
    free(tiles), free(one), free(t.last), free(in.image.data);
    nn_model_free(&m);
}
