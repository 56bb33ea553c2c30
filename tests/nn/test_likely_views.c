/* g told a photograph's scene more than once, and what a camera that is not known is taken for. */
#include "nn/likely_views.h"
#include "tensor/maps.h"
#include "tests/support/networks.h"

enum { FINE = 4 * SIDE, NUMBERS = 2 * RD_SCENE_NUMBERS };

/* Layers that begin as zero say something of what they read. */
static nn_model *talking(bool detailed)
{
    nn_arch a = tiny();
    a.conditions = a.scene = true;
    if (detailed) a.g_unshuffle = 4, a.g_detail = 6, a.spread = true, a.h_width = 0, a.descent = NN_DESCENT_POSTERIOR;
    nn_model *m = create(&a, 91);
    const nn_param *p = nn_model_find(m, "g.scene.numbers.weight");
    ts_rng r = ts_rng_make(11, TS_STREAM_TEST, 0);
    for (size_t i = 0; p && i < p->count; i++) m->value[p->offset + i] = ts_rng_range(&r, -0.1f, 0.1f);
    return m;
}

static rd_view from(float distance)
{
    rd_view view = rd_flash();
    view.camera[2] = distance;
    return view;
}

static double apart(const ag_value *a, const float *b)
{
    double most = 0;
    for (int64_t i = 0; i < ts_count(a->t.shape); i++) most = farther(most, fabs((double)a->t.data[i] - (double)b[i]));
    return most;
}

/* Told the same over and over, g says what it says when it is told once, in every orientation. */
TEST(likely_views_tellings_of_one_scene_are_one)
{
    for (int detailed = 0; detailed < 2; detailed++) {
        nn_model *m = talking(detailed);
        nn_input in = photographs(1, detailed ? FINE : SIDE, 92, NULL);
        const rd_view views[4] = {from(2), from(2), from(2), from(2)};
        const unsigned char known[4] = {NN_KNOWN_CAMERA, NN_KNOWN_CAMERA, NN_KNOWN_CAMERA, NN_KNOWN_CAMERA};
        static const float parts[2][4] = {{0.7f, 0.3f}, {0.1f, 0.2f, 0.3f, 0.4f}};
        in.views = views, in.known = known;
        for (int orientations = 1; orientations <= 4; orientations *= 2)
            for (int tellings = 2; tellings <= 4; tellings += 2) {
                ag_tape *tape = tape_create(false);
                nn_guess once, more;
                in.orientations = orientations;
                in.tellings = 1;
                CHECK(nn_guess_from(tape, m, &in, &once), "%s", ag_status(tape)->message);
                in.tellings = tellings;
                in.parts = parts[tellings / 2 - 1];
                CHECK(nn_guess_from(tape, m, &in, &more), "%s", ag_status(tape)->message);
                const double maps = apart(once.maps, more.maps->t.data),
                             spread = detailed ? apart(once.spread, more.spread->t.data) : 0;
                CHECK(maps < 1e-5 && spread < 1e-5, "%d tellings, %d orientations: maps %g, spread %g", tellings,
                      orientations, maps, spread);
                CHECK(more.scene->t.shape.n == tellings, "%d scenes of %d tellings", more.scene->t.shape.n, tellings);
                for (int t = 0; t < tellings; t++)
                    CHECK(apart(once.scene, more.scene->t.data + (ptrdiff_t)t * NUMBERS) < 1e-5,
                          "%d tellings, %d orientations: the scene of number %d is another", tellings, orientations, t);
                ag_tape_destroy(&tape);
            }
        nn_model_free(&m);
        free(in.image.data);
    }
}

/* Where the U-Net's maps are the maps, those of two tellings are the mean of both before the tanh. */
TEST(likely_views_are_the_mean_of_the_tellings)
{
    nn_model *m = talking(false);
    nn_input in = photographs(1, SIDE, 93, NULL);
    const rd_view views[2] = {from(0.7f), from(4)};
    const unsigned char known[2] = {0, NN_KNOWN_CAMERA};
    ag_tape *tape = tape_create(false);
    nn_guess first, second, both;
    in.views = views, in.known = known;
    CHECK(nn_guess_from(tape, m, &in, &first), "%s", ag_status(tape)->message);
    in.views = views + 1, in.known = known + 1;
    CHECK(nn_guess_from(tape, m, &in, &second), "%s", ag_status(tape)->message);
    const float parts[2] = {0.75f, 0.25f};
    in.views = views, in.known = known, in.tellings = 2, in.parts = parts;
    CHECK(nn_guess_from(tape, m, &in, &both), "%s", ag_status(tape)->message);
    double worst = 0, differ = 0;
    for (int64_t i = 0; i < ts_count(both.maps->t.shape); i++) {
        const double a = (double)first.maps->t.data[i], b = (double)second.maps->t.data[i],
                     want = tanh(0.75 * atanh(a) + 0.25 * atanh(b));
        worst = farther(worst, fabs((double)both.maps->t.data[i] - want));
        differ = farther(differ, fabs(a - b));
    }
    CHECK(worst < 1e-5 && differ > 1e-3, "%g from the mean of tellings that are %g apart", worst, differ);
    CHECK(apart(first.scene, both.scene->t.data) < 1e-5 && apart(second.scene, both.scene->t.data + NUMBERS) < 1e-5,
          "the scenes are not those of the tellings");
    /* In several orientations each telling's scene is the mean of its own. */
    for (int orientations = 2; orientations <= 4; orientations *= 2) {
        in.orientations = orientations;
        in.tellings = 1;
        CHECK(nn_guess_from(tape, m, &in, &first), "%s", ag_status(tape)->message);
        in.views = views + 1, in.known = known + 1;
        CHECK(nn_guess_from(tape, m, &in, &second), "%s", ag_status(tape)->message);
        in.views = views, in.known = known, in.tellings = 2;
        CHECK(nn_guess_from(tape, m, &in, &both), "%s", ag_status(tape)->message);
        CHECK(apart(first.scene, second.scene->t.data) > 1e-4, "both tellings have one scene");
        CHECK(apart(first.scene, both.scene->t.data) < 1e-5 && apart(second.scene, both.scene->t.data + NUMBERS) < 1e-5,
              "%d orientations: the scenes are not those of the tellings", orientations);
    }
    ag_tape_destroy(&tape);
    nn_model_free(&m);
    free(in.image.data);
}

TEST(likely_views_tellings_are_for_estimates)
{
    nn_model *m = talking(true);
    nn_input in = photographs(1, FINE, 95, NULL);
    const rd_view views[2] = {from(1), from(2)};
    const float parts[2] = {0.5f, 0.5f};
    in.views = views, in.tellings = 2;
    for (int gradients = 0; gradients < 2; gradients++) {
        ag_tape *tape = tape_create(gradients);
        nn_guess guess;
        in.parts = gradients ? parts : NULL;
        CHECK(!nn_guess_from(tape, m, &in, &guess) && ag_status(tape)->code == TS_INVALID, "gradients %d: no error",
              gradients);
        ag_tape_destroy(&tape);
    }
    nn_model_free(&m);
    free(in.image.data);
}

/* A camera that is known is believed; of one that is not known the scene is the mean of what is guessed in the likely
 * views, and where the view says that it is does not matter. */
TEST(likely_views_are_for_a_camera_that_is_not_known)
{
    nn_model *m = talking(true);
    nn_input in = photographs(1, FINE, 94, NULL);
    for (int known = 0; known <= NN_KNOWN_ALL; known++) {
        const unsigned char flags = (unsigned char)known;
        const rd_view near = from(0.8f), far = from(5);
        ag_tape *tape = tape_create(false);
        nn_guess alone, guess[2];
        in.known = &flags, in.views = &near;
        CHECK(nn_guess_from(tape, m, &in, &alone), "%s", ag_status(tape)->message);
        CHECK(nn_guess_in_likely_views(tape, m, &in, &guess[0]), "%s", ag_status(tape)->message);
        in.views = &far;
        CHECK(nn_guess_in_likely_views(tape, m, &in, &guess[1]), "%s", ag_status(tape)->message);
        const double moved = apart(alone.maps, guess[0].maps->t.data),
                     differ = apart(guess[0].maps, guess[1].maps->t.data);
        if (known & NN_KNOWN_CAMERA)
            CHECK(moved == 0 && differ > 1e-7 && nn_likely_views(&m->arch, known) == 1, "known %d: moved by %g", known,
                  moved);
        else {
            const float *const distance = nn_likely_distance, *const part = nn_likely_part;
            double want[NUMBERS] = {0}, parts = 0;
            CHECK(moved > 1e-6 && differ == 0 && nn_likely_views(&m->arch, known) == NN_LIKELY_VIEWS,
                  "known %d: moved by %g, and by %g where the view is another", known, moved, differ);
            for (int t = 0; t < NN_LIKELY_VIEWS; t++) {
                const rd_view told_view = from(distance[t]);
                const unsigned char told = distance[t] > 0 ? flags | NN_KNOWN_CAMERA : flags;
                nn_guess one;
                in.known = &told, in.views = &told_view;
                CHECK(nn_guess_from(tape, m, &in, &one), "%s", ag_status(tape)->message);
                float *said = one.scene->t.data;
                if (distance[t] > 0) said[RD_SCENE_DISTANCE] = logf(distance[t] / RD_FLASH_DISTANCE);
                for (int i = 0; i < NUMBERS; i++) want[i] += (double)part[t] * (double)said[i];
                parts += (double)part[t];
            }
            CHECK(fabs(parts - 1) < 1e-6, "the parts' sum is %g", parts);
            for (int i = 0; i < NUMBERS; i++)
                CHECK(fabs((double)guess[0].scene->t.data[i] - want[i]) < 1e-5,
                      "known %d: number %d of the scene is %g, the mean %g", known, i,
                      (double)guess[0].scene->t.data[i], want[i]);
        }
        ag_tape_destroy(&tape);
    }
    nn_model_free(&m);
    free(in.image.data);
}
