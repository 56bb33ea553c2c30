/* The light's strength from the photograph. */
#include "infer/power.h"
#include "infer/tiles.h"
#include "tests/support/networks.h"

enum { LARGE = 40 };

/* A network whose R_0 is one material, whatever it sees. */
static nn_model *constant_material(int images)
{
    nn_arch a = tiny();
    a.images = images;
    nn_model *m = create(&a, 51);
    memset(m->value, 0, m->count * sizeof *m->value);
    const nn_param *p = nn_model_find(m, "g.output.add.bias");
    static const float encoded[9] = {-0.2f, 0.1f, -0.6f, 0, 0, 0.1f, -0.9f, -0.9f, -0.9f};
    memcpy(m->value + p->offset, encoded, sizeof encoded);
    return m;
}

static double fit(const nn_model *m, const float *const *image, const rd_view *views, int given, int side)
{
    ts_status st = {0};
    ag_tape *t = tape_create(false);
    double factor = -1;
    float *r0 = malloc((size_t)(m->arch.g_size * m->arch.g_size * m->arch.channels) * sizeof *r0);
    CHECK(r0 && !lgd_fit_power(t, m, image, views, given, side, 1, r0, &factor, &st), "%s", st.message);
    free(r0);
    ag_tape_destroy(&t);
    return factor;
}

TEST(infer_power_of_what_is_rendered_is_found)
{
    nn_model *m = constant_material(3);
    static float maps[LARGE * LARGE * 9], photo[2][LARGE * LARGE * 3];
    for (int i = 0; i < LARGE * LARGE * 9; i++) {
        const nn_param *p = nn_model_find(m, "g.output.add.bias");
        maps[i] = tanhf(m->value[p->offset + (size_t)(i % 9)]);
    }
    for (int given = 1; given <= 2; given++)
        for (double factor = 0.25; factor < 3.5; factor *= 1.1) {
            rd_view views[2] = {rd_capture_view(0), rd_capture_view(3)};
            for (int k = 0; k < given; k++) {
                rd_view strong = views[k];
                strong.power *= (float)factor;
                rd_render(rd_grid_full(LARGE), maps, 9, &strong, true,
                          photo[k]); /* clipped, where the light is strong */
            }
            const double found = fit(m, (const float *const[]){photo[0], photo[1]}, views, given, LARGE);
            const double stops = log2(factor), want = exp2(stops > 0.2 ? stops - 0.2 : stops < -0.2 ? stops + 0.2 : 0);
            CHECK(fabs(found / want - 1) < 0.02, "%d photographs: %g, not %g", given, found,
                  want); /* resampling moves the highlight a little */
        }
    nn_model_free(&m);
}

TEST(infer_power_stays_in_its_range)
{
    nn_model *m = constant_material(1);
    static float photo[LARGE * LARGE * 3];
    const rd_view flash = rd_flash();
    const float *const image[] = {photo};
    CHECK(fit(m, image, &flash, 1, LARGE) == 1, "a black photograph has a light of %g",
          fit(m, image, &flash, 1, LARGE));
    for (int i = 0; i < LARGE * LARGE * 3; i++) photo[i] = 1;
    CHECK(fit(m, image, &flash, 1, LARGE) == 1, "a white photograph has a light of %g",
          fit(m, image, &flash, 1, LARGE));
    for (int i = 0; i < LARGE * LARGE * 3; i++) photo[i] = i % 2 ? NAN : 1e-4f;
    CHECK(fit(m, image, &flash, 1, LARGE) == 0.125, "a dark one has %g", fit(m, image, &flash, 1, LARGE));
    nn_model_free(&m);
}

/* What follows the fit begins with the fit's R_0 in place of running g again, to the same bytes, on the whole and in
 * tiles. */
TEST(infer_power_leaves_r0_for_what_follows)
{
    ts_status st = {0};
    nn_arch a = tiny();
    nn_model *m = create(&a, 52);
    static float photo[LARGE * LARGE * 3], maps[2][LARGE * LARGE * 9];
    ts_rng r = ts_rng_make(53, TS_STREAM_TEST, 0);
    for (int i = 0; i < LARGE * LARGE * 3; i++) photo[i] = 0.3f * ts_rng_uniform(&r);
    const float *const image[] = {photo};
    float *r0 = malloc((size_t)(a.g_size * a.g_size * a.channels) * sizeof *r0);
    CHECK(r0, "no memory");
    for (int orientations = 1; orientations <= 4; orientations *= 4) {
        rd_view flash = rd_flash();
        double factor = 1;
        ag_tape *t = tape_create(false);
        CHECK(!lgd_fit_power(t, m, image, &flash, 1, LARGE, orientations, r0, &factor, &st), "%s", st.message);
        flash.power *= (float)factor;
        for (int tiles = 0; tiles < 2; tiles++) {
            for (int again = 0; again < 2; again++) {
                nn_input in = {.image = ts_view(photo, (ts_shape){1, LARGE, LARGE, 3}),
                               .grid = rd_grid_full(LARGE),
                               .view = flash,
                               .orientations = orientations,
                               .r0 = again ? NULL : r0};
                lgd_tiles of = {.image = image,
                                .views = &flash,
                                .given = 1,
                                .side = LARGE,
                                .tile = 16,
                                .steps = 2,
                                .orientations = orientations,
                                .r0 = in.r0};
                ag_value *out;
                ag_reset(t);
                if (tiles) CHECK(!lgd_tiles_run(t, m, &of, maps[again], &st), "%s", st.message);
                else {
                    CHECK(!nn_lgd(t, m, &in, 2, false, &out, NULL), "%s", ag_status(t)->message);
                    memcpy(maps[again], out->t.data, sizeof maps[again]);
                }
            }
            CHECK(!memcmp(maps[0], maps[1], sizeof maps[0]), "%d orientations, %s: other maps", orientations,
                  tiles ? "tiles" : "whole");
        }
        ag_tape_destroy(&t);
    }
    free(r0);
    nn_model_free(&m);
}
