/* The memory of g, counted before it is taken, against what it takes. */
#include "nn/need.h"
#include "tests/support/networks.h"

static void fits_told(const char *what, const nn_arch *a, int given, int orientations, int tellings)
{
    nn_model *m = create(a, 5);
    const int side = nn_arch_side(a) / 2; /* resampled to g's size */
    nn_input in = photographs(given, side, 6, NULL);
    in.given = given;
    in.orientations = orientations;
    const rd_view views[2] = {rd_flash(), rd_flash()};
    const float parts[2] = {0.5f, 0.5f};
    if (tellings > 1) in.views = views, in.tellings = tellings, in.parts = parts;
    ag_tape *tape = tape_create(false);
    nn_guess g;
    CHECK(nn_guess_from(tape, m, &in, &g), "%s: %s", what, ag_status(tape)->message);
    const double taken = (double)ts_arena_peak(ag_arena(tape)), counted = nn_guess_bytes(a, orientations, tellings);
    CHECK(taken <= counted && counted < 2 * taken, "%s: %.0f bytes are counted and %.0f taken", what, counted, taken);
    ag_tape_destroy(&tape);
    nn_model_free(&m);
    free(in.image.data);
}

static void fits_given(const char *what, const nn_arch *a, int given, int orientations)
{
    fits_told(what, a, given, orientations, 1);
}

static void fits(const char *what, const nn_arch *a, int orientations) { fits_given(what, a, a->images, orientations); }

TEST(need_of_g_is_counted)
{
    const int levels[] = {1, 3, 6};
    for (int i = 0; i < 3; i++)
        for (int wide = 0; wide < 2; wide++) {
            nn_arch a = tiny();
            a.g_levels = levels[i], a.g_size = 128, a.g_width = wide ? 24 : 2, a.g_width_max = wide ? 96 : 512;
            fits("U-Net", &a, 1);
            fits("two orientations", &a, 2);
            a.conditions = true;
            fits("conditions", &a, 1);
            fits_told("told twice", &a, 1, 1, 2);
            fits_told("two orientations, told twice", &a, 1, 2, 2);
            a.images = 5;
            fits("five photographs", &a, 1);
            fits_given("one of five photographs", &a, 1, 2);
            fits_given("one of five photographs", &a, 1, 8);
        }
    for (int detail = 4; detail <= 64; detail *= 4)
        for (int trunk = 0; trunk <= 4; trunk += 4) {
            nn_arch a = tiny();
            a.g_unshuffle = 4, a.g_size = 32, a.g_levels = 3, a.g_detail = detail, a.g_trunk = trunk;
            fits("detail", &a, 1);
            a.g_half = trunk * detail / 8;
            fits("detail and half of the side", &a, 1);
            a.spread = a.scene = a.conditions = true;
            fits("detail, spread, scene and conditions", &a, 2);
            fits_told("the same, told twice", &a, 1, 1, 2);
            fits_told("the same in two orientations", &a, 1, 2, 2);
        }
}
