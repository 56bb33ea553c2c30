/* A model whose steps go to the most probable maps fits several photographs of one sample, though g reads one. */
#include "infer/estimate.h"
#include "infer/exposure.h"
#include "infer/tiles.h"
#include "tests/support/networks.h"

enum { EDGE = 64, PIXELS = EDGE * EDGE, VALUES = PIXELS * MAP_CHANNELS, TAKEN = 5 };

typedef struct sample {
    float *truth, *image[RD_CAPTURE_VIEWS];
    rd_view view[RD_CAPTURE_VIEWS];
} sample;

static sample take(void)
{
    sample s = {.truth = numbers(VALUES, 7, -0.6f, 0.6f)};
    for (int i = 0; i < PIXELS; i++)
        for (int k = 0; k < 2; k++) s.truth[i * MAP_CHANNELS + MAP_NORMAL + k] *= 0.3f;
    for (int v = 0; v < RD_CAPTURE_VIEWS; v++) {
        s.view[v] = rd_capture_view(v);
        s.image[v] = malloc(PIXELS * 3 * sizeof(float));
        rd_render(rd_grid_full(EDGE), s.truth, MAP_CHANNELS, &s.view[v], true, s.image[v]);
    }
    return s;
}

static void leave(sample *s)
{
    for (int v = 0; v < RD_CAPTURE_VIEWS; v++) free(s->image[v]);
    free(s->truth);
}

/* From maps that are off by .2 and a prior that says so: the more photographs, the nearer maps and other views. */
TEST(several_photographs_are_fitted_at_once)
{
    nn_model *m = guessing();
    sample s = take();
    float *r0 = numbers(VALUES, 8, -0.35f, 0.35f), *maps = malloc(VALUES * sizeof *maps),
          *deviation = malloc(PIXELS * NN_SPREADS * sizeof *deviation);
    for (int i = 0; i < PIXELS; i++) /* the colours are off by a factor, as the prior says */
        for (int first = 0; first <= MAP_SPECULAR; first += MAP_SPECULAR) {
            float *r = r0 + i * MAP_CHANNELS + first, squares = 0, most = 0;
            const float *truth = s.truth + i * MAP_CHANNELS + first;
            for (int c = 0; c < 3; c++) {
                squares += (truth[c] + 1) * (truth[c] + 1);
                most = fmaxf(most, truth[c] + 1);
            }
            const float factor = fminf(r[0] / sqrtf(squares / 3), 2 / most - 1);
            for (int c = 0; c < 3; c++) r[c] = factor * (truth[c] + 1);
        }
    for (int i = 0; i < VALUES; i++) r0[i] += s.truth[i];
    for (int i = 0; i < PIXELS * NN_SPREADS; i++) deviation[i] = 0.2f;
    double off[TAKEN + 1] = {0}, seen[TAKEN + 1] = {0};
    for (int count = 1; count <= TAKEN; count += 2) {
        ts_status st = {0};
        ag_tape *tape = tape_create(false);
        ag_freeze(tape, true);
        lgd_tiles t = {.image = (const float *const *)s.image,
                       .views = s.view,
                       .given = count,
                       .r0 = r0,
                       .deviation = deviation,
                       .side = EDGE,
                       .tile = EDGE,
                       .steps = 12 /* the search is near its end */};
        CHECK(!lgd_tiles_run(tape, m, &t, maps, &st), "%s", st.message);
        ag_tape_destroy(&tape);
        for (int i = 0; i < VALUES; i++) off[count] += pow((double)maps[i] - (double)s.truth[i], 2);
        off[count] = sqrt(off[count] / VALUES);
        for (int v = TAKEN; v < RD_CAPTURE_VIEWS; v++) {
            double error;
            rd_flash_rmse(rd_grid_full(EDGE), maps, MAP_CHANNELS, &s.view[v], s.image[v], &error);
            seen[count] += error / (RD_CAPTURE_VIEWS - TAKEN);
        }
    }
    CHECK(off[3] < 0.95 * off[1] && off[5] < 0.95 * off[3], "maps are off by %g, %g, %g of 1, 3, 5 photographs", off[1],
          off[3], off[5]);
    CHECK(seen[3] < 0.8 * seen[1] && seen[5] < 0.9 * seen[3], "other views by %g, %g, %g of 1, 3, 5", seen[1], seen[3],
          seen[5]);
    free(r0), free(maps), free(deviation);
    leave(&s);
    nn_model_free(&m);
}

/* Three photographs larger than g's maps, one with values that no camera gives, in tiles of tile pixels. Returns the
 * most that the arena held. */
static size_t fit_in_tiles(const nn_model *m, const sample *s, const float *const *image, int side, int tile,
                           float *maps)
{
    ts_status st = {0};
    float *deviation = malloc(PIXELS * NN_SPREADS * sizeof *deviation);
    for (int i = 0; i < PIXELS * NN_SPREADS; i++) deviation[i] = 0.2f;
    ag_tape *tape = tape_create(false);
    ag_freeze(tape, true);
    lgd_tiles t = {.image = image,
                   .views = s->view,
                   .given = 3,
                   .r0 = s->truth,
                   .deviation = deviation,
                   .side = side,
                   .tile = tile,
                   .steps = 2};
    CHECK(!lgd_tiles_run(tape, m, &t, maps, &st), "%s", st.message);
    const size_t peak = ts_arena_peak(ag_arena(tape));
    ag_tape_destroy(&tape);
    free(deviation);
    return peak;
}

TEST(several_photographs_in_tiles_are_those_of_one_tile_and_never_held_whole)
{
    enum { LARGE = 384, TILE = 100 };
    const size_t values = (size_t)LARGE * LARGE * MAP_CHANNELS, photo = (size_t)LARGE * LARGE * 3;
    nn_model *m = guessing();
    sample s = take();
    float *image[3], *whole = malloc(values * sizeof *whole), *tiled = malloc(values * sizeof *tiled);
    for (int v = 0; v < 3; v++) image[v] = numbers((int)photo, 20 + v, v == 1 ? -0.5f : 0, v == 1 ? 2 : 1);
    fit_in_tiles(m, &s, (const float *const *)image, LARGE, LARGE, whole);
    const size_t peak = fit_in_tiles(m, &s, (const float *const *)image, LARGE, TILE, tiled);
    CHECK(!memcmp(whole, tiled, values * sizeof *whole), "tiles have other maps");
    CHECK(peak < 3 * photo * sizeof(float), "%zu bytes, three photographs are %zu", peak, 3 * photo * sizeof(float));
    for (int v = 0; v < 3; v++) free(image[v]);
    free(whole), free(tiled);
    leave(&s);
    nn_model_free(&m);
}

static double lit; /* ambient light of the first photograph that estimate was given */

static void estimate(const nn_model *m, const lgd_photo *photo, double *power, lgd_photo *taken, float *maps)
{
    ts_status st = {0};
    ag_tape *tape = tape_create(false);
    ag_freeze(tape, true);
    const lgd_options o = {.size = sizeof o,
                           .iterations = 4,
                           .power = power,
                           .taken = taken,
                           .ambient = &lit,
                           .fov = power ? LGD_FOV_UNKNOWN : LGD_FOV_OF_PHOTO};
    const lgd_estimator e = {.net = m, .tape = tape, .encoded = true};
    CHECK(!lgd_estimator_run(&e, photo, TAKEN, EDGE, &o, maps, &st), "%s", st.message);
    ag_tape_destroy(&tape);
}

/* In whatever order they are given; and where the power is not known, with an exposure for each. */
TEST(several_photographs_in_any_order)
{
    nn_model *m = guessing();
    sample s = take();
    CHECK(nn_most_photographs(&m->arch) == NN_MAX_IMAGES && m->arch.images == 1, "%d photographs, of which g reads %d",
          nn_most_photographs(&m->arch), m->arch.images);
    lgd_photo photo[TAKEN], turned[TAKEN], taken[TAKEN];
    for (int k = 0; k < TAKEN; k++) {
        photo[k] = (lgd_photo){.image = s.image[k], .power = s.view[k].power * (float)(k + 1)};
        memcpy(photo[k].light, s.view[k].light, sizeof photo[k].light);
        memcpy(photo[k].camera, s.view[k].camera, sizeof photo[k].camera);
    }
    for (int k = 0; k < TAKEN; k++) turned[k] = photo[(k + 2) % TAKEN];
    float *maps[2] = {malloc(VALUES * sizeof(float)), malloc(VALUES * sizeof(float))};
    estimate(m, photo, NULL, NULL, maps[0]);
    estimate(m, turned, NULL, NULL, maps[1]);
    CHECK(!memcmp(maps[0], maps[1], VALUES * sizeof(float)), "the order of the photographs changes the maps");
    double factor = 0, ambient[2];
    for (int k = 0; k < 2; k++) {
        lit = -1;
        estimate(m, k ? turned : photo, &factor, taken, maps[0]);
        ambient[k] = lit;
    }
    CHECK(ambient[0] > 0 && ambient[1] == 0, "ambient light of the flash's photograph %g, of another %g", ambient[0],
          ambient[1]);
    estimate(m, photo, &factor, taken, maps[0]);
    /* of weights that were drawn it may be any number, but of one that was not looked for it would be 1 */
    CHECK(factor > 0 && fabs(factor - 1) > 1e-5, "a factor of %g on the lights", factor);
    for (int k = 0; k < TAKEN; k++) { /* each photograph has an exposure of its own */
        const double own = (double)taken[k].power / (factor * (double)photo[k].power);
        CHECK(own > 0.01 && own < 100 && (k == 0) == (fabs(own - 1) < 1e-5), "light %d is %g times its power", k, own);
    }
    free(maps[0]), free(maps[1]);
    leave(&s);
    nn_model_free(&m);
}

/* A light that is known stays where it is, higher than the camera too, and as bright as the factor on it says. */
TEST(several_photographs_keep_known_lights)
{
    nn_model *m = guessing();
    sample s = take();
    lgd_photo photo[TAKEN], taken[TAKEN];
    float *maps = malloc(VALUES * sizeof *maps);
    for (int k = 0; k < TAKEN; k++) {
        photo[k] = (lgd_photo){.image = s.image[k], .power = s.view[k].power};
        memcpy(photo[k].camera, s.view[k].camera, sizeof photo[k].camera);
        for (int i = 0; i < 3; i++) photo[k].light[i] = s.view[k].light[i] * (i == 2 ? 1.5f : 1) + 0.1f;
    }
    double factor = 0;
    estimate(m, photo, &factor, taken, maps);
    for (int k = 0; k < TAKEN; k++)
        for (int i = 0; i < 3; i++)
            CHECK(fabsf(taken[k].light[i] - photo[k].light[i]) < 1e-5f &&
                      fabsf(taken[k].camera[i] - photo[k].camera[i]) < 1e-5f,
                  "photograph %d: light and camera have moved", k);
    CHECK(fabs((double)taken[0].power / (factor * (double)photo[0].power) - 1) < 1e-5, "a power of %g, the factor %g",
          (double)taken[0].power, factor);
    free(maps);
    leave(&s);
    nn_model_free(&m);
}

/* Of a photograph with another exposure, half of that is believed; what is black or burnt out tells nothing. */
TEST(several_photographs_exposures)
{
    sample s = take();
    const rd_grid grid = rd_grid_full(EDGE);
    enum { LARGE = 2 * EDGE };
    float *photo = malloc(LARGE * LARGE * 3 * sizeof *photo);
    double found = 0;
    ts_status st = {0};
    for (int stops = -1; stops <= 1; stops++)
        for (int side = EDGE; side <= LARGE; side += EDGE) {
            rd_render(grid, s.truth, MAP_CHANNELS, &s.view[2], false, s.image[0]);
            for (int i = 0; i < side * side * 3; i++) {
                const int c = i % 3, x = i / 3 % side * EDGE / side, y = i / 3 / side * EDGE / side;
                photo[i] = s.image[0][(y * EDGE + x) * 3 + c] * exp2f((float)stops);
            }
            CHECK(!lgd_exposure_beside(grid, s.truth, MAP_CHANNELS, &s.view[2], photo, side, &found, &st), "%s",
                  st.message);
            CHECK(fabs(log2(found) - 0.5 * stops) < 1e-5, "%d stops, %d pixels a side: a factor of %g", stops, side,
                  found);
        }
    for (int k = 0; k < 2; k++) {
        for (int i = 0; i < EDGE * EDGE * 3; i++) photo[i] = (float)k;
        CHECK(!lgd_exposure_beside(grid, s.truth, MAP_CHANNELS, &s.view[2], photo, EDGE, &found, &st) && found == 1,
              "of nothing but %d: %g", k, found);
    }
    free(photo);
    leave(&s);
}
