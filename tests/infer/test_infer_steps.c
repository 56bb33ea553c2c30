/* How many steps lgd_estimate makes, and what it reports of them. */
#include "tests/support/inference.h"

/* The automatic number of steps ends at the first that does not pay, and gives the maps of the one before. */
TEST(infer_auto_stops_where_the_loss_no_longer_falls)
{
    lgd_model *m = load(tiny());
    static float image[SIDE * SIDE * 3], chosen[VALUES], fixed[VALUES];
    lgd_error e;
    make_image(image, SIDE);
    trace t = {.stop_at = -1}, all = {.stop_at = -1};
    run(m, image, SIDE, LGD_AUTO, 1, &t, chosen);
    CHECK(t.calls >= 1 && t.calls < 16, "%d steps", t.calls);
    run(m, image, SIDE, t.calls, 1, &all, fixed); /* one more than was chosen */
    for (int i = 0; i < t.calls; i++)
        CHECK(t.step[i] == i && t.rmse[i] == all.rmse[i], "step %d: %g and %g", i, t.rmse[i], all.rmse[i]);
    for (int i = 1; i < t.calls; i++) CHECK(t.rmse[i] < t.rmse[i - 1] * 0.999, "step %d does not pay", i);
    CHECK(all.rmse[t.calls] >= t.rmse[t.calls - 1] * 0.999, "step %d would have paid: %g after %g", t.calls,
          all.rmse[t.calls], t.rmse[t.calls - 1]);
    run(m, image, SIDE, t.calls - 1, 1, NULL, fixed);
    CHECK(!memcmp(chosen, fixed, sizeof chosen), "the maps are not those of step %d", t.calls - 1);
    unsigned char *mask = malloc(SIDE * SIDE); /* the same number where tiles are refined */
    memset(mask, 1, SIDE * SIDE);
    const lgd_options o = {.size = sizeof o, .iterations = LGD_AUTO, .mask = mask};
    CHECK(!lgd_estimate(m, image, SIDE, &o, chosen, &e), "%s", e.message);
    for (int i = 0; i < VALUES; i++)
        CHECK(fabs((double)chosen[i] - fixed[i]) < 1e-4, "value %d: %g and %g", i, chosen[i], fixed[i]);
    free(mask);
    lgd_free(&m);
}

/* Of a photograph in tiles they are counted at fewer pixels; what is above 1 counts as 1, what is no number as 0. */
TEST(infer_auto_counts_steps_of_what_the_steps_read)
{
    enum { LARGE = 520, NUMBERS = LARGE * LARGE * 3 };
    lgd_model *m = load(tiny());
    lgd_error e;
    float *image = malloc(NUMBERS * sizeof *image), *maps = malloc((size_t)NUMBERS * 3 * sizeof *maps),
          *same = malloc((size_t)NUMBERS * 3 * sizeof *same);
    for (int odd = 0; odd < 2; odd++) {
        make_image(image, LARGE);
        for (int i = 0; i < NUMBERS; i += 51) image[i] = odd ? 60 : 1;
        for (int i = 17; i < NUMBERS; i += 5003) image[i] = odd ? NAN : 0;
        const lgd_options o = {.size = sizeof o, .iterations = LGD_AUTO};
        CHECK(!lgd_estimate(m, image, LARGE, &o, odd ? maps : same, &e), "%s", e.message);
    }
    CHECK(!memcmp(maps, same, (size_t)NUMBERS * 3 * sizeof *maps), "another number of steps");
    free(image), free(maps), free(same);
    lgd_free(&m);
}

TEST(infer_progress_sees_every_step)
{
    static float image[SIDE * SIDE * 3], maps[VALUES];
    lgd_model *m = load(tiny());
    make_image(image, SIDE);
    CHECK(lgd_trained_iterations(m) == T, "trained for %d", lgd_trained_iterations(m));
    for (int n = -1; n <= 5; n++) {
        trace t = {.stop_at = -1};
        run(m, image, SIDE, n, 1, &t, maps);
        CHECK(t.calls == (n < 0 ? T : n) + 1, "%d calls for %d iterations", t.calls, n);
        for (int i = 0; i < t.calls; i++)
            CHECK(t.step[i] == i && t.rmse[i] > 0 && t.rmse[i] < 1, "call %d: step %d, rmse %g", i, t.step[i],
                  t.rmse[i]);
    }
    lgd_free(&m);
    CHECK(!m, "lgd_free leaves the pointer");
    lgd_free(&m);
    lgd_free(NULL);
}

/* Nobody pays for the RMSE of the steps between unless he wants it: the ends' are the same, and so are the maps, and
 * those of a stop between. */
TEST(infer_rmse_of_the_ends_alone)
{
    static float image[SIDE * SIDE * 3], maps[VALUES], other[VALUES];
    static unsigned char mask[SIDE * SIDE];
    nn_arch coarse = tiny();
    coarse.coarse_steps = 2, coarse.coarse_size = 16, coarse.coarse_width = 6, coarse.coarse_gru = 3;
    lgd_model *const model[2] = {load(tiny()), load(coarse)};
    lgd_error e;
    make_image(image, SIDE);
    memset(mask, 1, sizeof mask);
    for (int way = 0; way < 4; way++) {
        lgd_model *m = model[way / 2];
        const int tiles = way % 2;
        for (int stop = -1; stop < T; stop++) {
            trace all = {.stop_at = stop}, ends = all;
            const lgd_options every = {.size = sizeof every,
                                       .iterations = T,
                                       .progress = record,
                                       .user = &all,
                                       .every_rmse = 1,
                                       .mask = tiles ? mask : NULL},
                              few = {.size = sizeof few,
                                     .iterations = T,
                                     .progress = record,
                                     .user = &ends,
                                     .mask = every.mask};
            CHECK(!lgd_estimate(m, image, SIDE, &every, maps, &e) && !lgd_estimate(m, image, SIDE, &few, other, &e),
                  "%s", e.message);
            CHECK(!memcmp(maps, other, sizeof maps), "tiles %d, stopped at %d: other maps", tiles, stop);
            CHECK(all.calls == ends.calls && ends.calls == (stop < 0 ? T : stop) + 1,
                  "tiles %d, stopped at %d: %d calls", tiles, stop, ends.calls);
            for (int i = 0; i < ends.calls; i++) {
                const bool end = i == 0 || i == T;
                CHECK(end ? ends.rmse[i] == all.rmse[i] : isnan(ends.rmse[i]), "tiles %d, step %d: %g, not %g", tiles,
                      i, ends.rmse[i], all.rmse[i]);
            }
        }
    }
    for (int i = 0; i < 2; i++) lgd_free(&(lgd_model *){model[i]});
}

TEST(infer_stopping_at_a_step_is_asking_for_that_many)
{
    static float image[SIDE * SIDE * 3], stopped[VALUES], asked[VALUES], previous[VALUES];
    lgd_model *m = load(tiny());
    make_image(image, SIDE);
    for (int n = 0; n < T; n++) {
        trace t = {.stop_at = n};
        run(m, image, SIDE, T, 1, &t, stopped);
        CHECK(t.calls == n + 1, "%d calls after a stop at %d", t.calls, n);
        run(m, image, SIDE, n, 1, NULL, asked);
        CHECK(memcmp(stopped, asked, sizeof asked) == 0, "stopped at %d differs from %d iterations", n, n);
        CHECK(n == 0 || memcmp(asked, previous, sizeof asked) != 0, "step %d changes nothing", n);
        memcpy(previous, asked, sizeof asked);
    }
    lgd_free(&m);
}

/* By default one orientation where camera or power is guessed, else two. */
TEST(infer_takes_orientations_that_suit_what_is_known)
{
    static const struct {
        bool guesses, power;
        double fov;
        int orientations;
    } of[] = {{false, true, LGD_FOV_UNKNOWN, 2},
              {false, false, LGD_FOV_UNKNOWN, 2},
              {true, true, LGD_FOV_UNKNOWN, 1},
              {true, true, 40, 2},
              {true, false, 40, 1},
              {true, true, LGD_FOV_OF_PHOTO, 2},
              {true, false, LGD_FOV_OF_PHOTO, 1}};
    static float image[SIDE * SIDE * 3], maps[3][VALUES];
    make_image(image, SIDE);
    for (size_t i = 0; i < sizeof of / sizeof *of; i++) {
        nn_arch a = tiny();
        if (of[i].guesses) {
            a.g_unshuffle = 4, a.g_detail = 6, a.h_width = 0, a.descent = NN_DESCENT_POSTERIOR;
            a.conditions = a.spread = a.scene = true;
        }
        lgd_model *m = load(a);
        for (int n = 0; n < 3; n++) {
            lgd_error e;
            double power;
            const lgd_options o = {.size = sizeof o,
                                   .iterations = 0,
                                   .orientations = n,
                                   .fov = of[i].fov,
                                   .power = of[i].power ? NULL : &power};
            CHECK(!lgd_estimate(m, image, SIDE, &o, maps[n], &e), "%s", e.message);
        }
        CHECK(memcmp(maps[1], maps[2], sizeof maps[1]), "case %zu: two orientations say what one says", i);
        CHECK(!memcmp(maps[0], maps[of[i].orientations], sizeof maps[0]), "case %zu: not %d orientations", i,
              of[i].orientations);
        lgd_free(&m);
    }
}

/* What programs ask of a model, and of the library. */
TEST(infer_usual_steps_and_the_published_network)
{
    nn_arch several = tiny(), published = tiny();
    several.g_unshuffle = 4, several.g_detail = 6, several.h_width = 0, several.descent = NN_DESCENT_POSTERIOR;
    several.conditions = several.spread = several.scene = true;
    published.compat = NN_COMPAT_PUBLISHED, published.descent = NN_DESCENT_NONE, published.rmse = NN_RMSE_BATCH;
    published.channels = 10, published.recurrent = false;
    const struct {
        nn_arch arch;
        int one, three;
        bool published;
    } kinds[] = {{tiny(), T, T, false}, {several, T, 2 * T, false}, {published, T, T, true}};
    for (int i = 0; i < 3; i++) {
        lgd_model *m = load(kinds[i].arch);
        CHECK(lgd_trained_iterations(m) == T && lgd_usual_iterations(m, 1) == kinds[i].one &&
                  lgd_usual_iterations(m, 3) == kinds[i].three,
              "kind %d: %d steps, %d of three photographs", i, lgd_usual_iterations(m, 1), lgd_usual_iterations(m, 3));
        CHECK(!lgd_published(m) == !kinds[i].published, "kind %d: published %d", i, lgd_published(m));
        lgd_free(&m);
    }
}

TEST(infer_version_is_the_makefiles)
{
    char line[256], said[64] = "";
    FILE *f = fopen("Makefile", "r");
    CHECK(f, "no Makefile here");
    while (!said[0] && fgets(line, sizeof line, f))
        if (sscanf(line, "VERSION := %63s", said) != 1) said[0] = 0;
    fclose(f);
    CHECK(said[0] && !strcmp(lgd_version(), said), "%s, and the Makefile says %s", lgd_version(), said);
}
