/* Several photographs tell a metal from a dielectric, whatever was read of the first. */
#include "nn/metal.h"
#include "render/render.h"
#include "tests/support/networks.h"
#include <math.h>
#include <string.h>

enum { C = MAP_CHANNELS, EDGE = 96, PIXELS = EDGE * EDGE, VALUES = PIXELS * C, TAKEN = 5, STEPS = 8 };

static void paint(float diffuse, float f0, float *maps)
{
    float *r = numbers(VALUES, 31, -0.1f, 0.1f);
    for (int i = 0; i < VALUES; i++) {
        const int c = i % C;
        const float of = c < MAP_NORMAL ? 2 * diffuse - 1
            : c < MAP_ROUGHNESS         ? 0
            : c == MAP_ROUGHNESS        ? -0.2f
                                        : 2 * f0 - 1;
        maps[i] = fminf(fmaxf(of + (c < MAP_NORMAL || c > MAP_ROUGHNESS ? 0.2f : 1) * r[i], -0.98f), 0.98f);
    }
    free(r);
}

static float mean_of(const float *maps, int channel)
{
    double sum = 0;
    for (int i = channel; i < VALUES; i += C) sum += ((double)maps[i] + 1) / 2;
    return (float)(sum / PIXELS);
}

/* Photographs of truth, and what R_0 = read becomes of them. */
static void tell(const float *truth, float *read)
{
    float *image[TAKEN], *deviation = malloc(PIXELS * NN_SPREADS * sizeof *deviation);
    rd_view view[TAKEN];
    ts_status st = {0};
    for (int i = 0; i < PIXELS * NN_SPREADS; i++) deviation[i] = 0.15f;
    for (int k = 0; k < TAKEN; k++) {
        view[k] = rd_capture_view(k);
        image[k] = malloc(PIXELS * 3 * sizeof *image[k]);
        rd_render(rd_grid_full(EDGE), truth, C, &view[k], false, image[k]);
    }
    const nn_photos photos = {(const float *const *)image, view, TAKEN, EDGE, NN_KNOWN_ALL};
    CHECK(!nn_tell_metal(rd_grid_full(EDGE), &photos, deviation, STEPS, C, read, &st), "%s", st.message);
    for (int k = 0; k < TAKEN; k++) free(image[k]);
    free(deviation);
}

TEST(metal_that_was_read_as_diffuse_is_a_metal)
{
    float *truth = malloc(VALUES * sizeof *truth), *read = malloc(VALUES * sizeof *read);
    paint(0.02f, 0.7f, truth);
    paint(0.5f, 0.04f, read);
    tell(truth, read);
    CHECK(mean_of(read, MAP_SPECULAR) > 0.5f && mean_of(read, MAP_DIFFUSE) < 0.1f, "F0 %g, diffuse %g",
          (double)mean_of(read, MAP_SPECULAR), (double)mean_of(read, MAP_DIFFUSE));
    free(truth), free(read);
}

TEST(dielectric_that_was_read_as_a_metal_is_a_dielectric)
{
    float *truth = malloc(VALUES * sizeof *truth), *read = malloc(VALUES * sizeof *read);
    paint(0.5f, 0.04f, truth);
    paint(0.05f, 0.7f, read);
    tell(truth, read);
    CHECK(mean_of(read, MAP_SPECULAR) < 0.06f && mean_of(read, MAP_DIFFUSE) > 0.3f, "F0 %g, diffuse %g",
          (double)mean_of(read, MAP_SPECULAR), (double)mean_of(read, MAP_DIFFUSE));
    free(truth), free(read);
}

/* What was read right keeps every byte. */
TEST(what_was_read_right_stays)
{
    for (int metal = 0; metal < 2; metal++) {
        float *truth = malloc(VALUES * sizeof *truth), *read = malloc(VALUES * sizeof *read),
              *before = malloc(VALUES * sizeof *before);
        paint(metal ? 0.02f : 0.5f, metal ? 0.7f : 0.04f, truth);
        paint(metal ? 0.06f : 0.45f, metal ? 0.6f : 0.06f, read);
        memcpy(before, read, VALUES * sizeof *before);
        tell(truth, read);
        CHECK(!memcmp(before, read, VALUES * sizeof *before), "a %s was changed", metal ? "metal" : "dielectric");
        free(truth), free(read), free(before);
    }
}
