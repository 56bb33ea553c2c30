/* Levels that a photograph under a known light tells. */
#include "nn/level.h"
#include "render/render.h"
#include "tests/support/networks.h"
#include <math.h>
#include <string.h>

enum { C = MAP_CHANNELS, EDGE = 80, PIXELS = EDGE * EDGE, VALUES = PIXELS * C };

/* A glossy material, brown, with some relief and grain. */
static void paint(float diffuse, float f0, float *maps)
{
    static const float hue[3] = {1.2f, 1, 0.7f};
    float *r = numbers(VALUES, 17, -1, 1);
    for (int i = 0; i < VALUES; i++) {
        const int c = i % C;
        const float grain = 1 + 0.1f * r[i];
        maps[i] = c < MAP_NORMAL ? 2 * diffuse * hue[c] * grain - 1
            : c < MAP_ROUGHNESS  ? 0.02f * r[i]
            : c == MAP_ROUGHNESS ? 2 * 0.35f * grain - 1
                                 : 2 * f0 * hue[c - MAP_SPECULAR] * grain - 1;
    }
    free(r);
}

static float mean_of(const float *maps, int first, int count)
{
    double sum = 0;
    for (int i = 0; i < PIXELS; i++)
        for (int c = first; c < first + count; c++) sum += ((double)maps[i * C + c] + 1) / 2;
    return (float)(sum / PIXELS / count);
}

/* R_0 = read after a photograph of truth. */
static void find_of(nn_kind kind, const float *truth, int threads, float *read)
{
    float *image = malloc(PIXELS * 3 * sizeof *image), *deviation = malloc(PIXELS * NN_SPREADS * sizeof *deviation);
    const rd_view view = rd_flash();
    ts_status st = {0};
    for (int i = 0; i < PIXELS * NN_SPREADS; i++) deviation[i] = 0.04f;
    rd_render(rd_grid_full(EDGE), truth, C, &view, false, image);
    CHECK(!nn_find_levels(rd_grid_on(rd_grid_full(EDGE), threads), image, EDGE, &view, kind, deviation, C, read, &st),
          "%s", st.message);
    free(image), free(deviation);
}

static void find(const float *truth, int threads, float *read) { find_of(NN_KIND_UNKNOWN, truth, threads, read); }

/* F0 and roughness change one highlight and are not told apart to less than a quarter. The search's last stride of F0
 * is .025. */
TEST(levels_that_are_off_are_found)
{
    static const struct {
        const char *what;
        double most; /* that any level is off by afterwards */
        float level[NN_LEVELS];
    } off[] = {{"F0", 0.05, {[NN_LEVEL_F0] = 0.5f}},
               {"roughness", 0.21, {[NN_LEVEL_ROUGHNESS] = 0.4f}},
               {"roughness, too smooth", 0.21, {[NN_LEVEL_ROUGHNESS] = -0.4f}},
               {"diffuse", 0.026, {[NN_LEVEL_DIFFUSE] = 0.5f}},
               {"F0 and roughness", 0.2, {[NN_LEVEL_F0] = 0.5f, [NN_LEVEL_ROUGHNESS] = 0.3f}}};
    float *truth = malloc(VALUES * sizeof *truth), *read = malloc(VALUES * sizeof *read);
    paint(0.12f, 0.2f, truth);
    for (size_t k = 0; k < sizeof off / sizeof *off; k++) {
        memcpy(read, truth, VALUES * sizeof *read);
        nn_set_levels(PIXELS, C, off[k].level, read);
        find(truth, 2, read);
        const int map[] = {MAP_DIFFUSE, MAP_SPECULAR, MAP_ROUGHNESS}, count[] = {3, 3, 1};
        for (int m = 0; m < 3; m++) {
            const double left = log((double)(mean_of(read, map[m], count[m]) / mean_of(truth, map[m], count[m]))),
                         begun = (double)off[k].level[m];
            CHECK(fabs(left) < off[k].most && (begun == 0 || fabs(left) < 0.55 * fabs(begun)),
                  "%s: the level of map %d is off by e^%.2f, it was by e^%.2f", off[k].what, m, left, begun);
        }
    }
    free(truth), free(read);
}

/* A level that is ever more off, of a photograph whose pixels differ from the maps otherwise too, is repaired ever
 * more, without a jump from nothing to all of it. */
TEST(levels_are_believed_by_degrees)
{
    enum { STEPS = 80 };
    float *truth = malloc(VALUES * sizeof *truth), *read = malloc(VALUES * sizeof *read);
    float *shown = malloc(VALUES * sizeof *shown), *r = numbers(PIXELS, 19, -1, 1);
    double before = 0, most = 0, jump = 0;
    paint(0.12f, 0.2f, truth);
    memcpy(shown, truth, VALUES * sizeof *shown);
    for (int i = 0; i < PIXELS; i++)
        for (int c = 0; c < 3; c++) shown[i * C + MAP_DIFFUSE + c] = (1 + 0.9f * r[i]) * (truth[i * C + c] + 1) - 1;
    for (int i = 0; i <= STEPS; i++) {
        const float off[NN_LEVELS] = {[NN_LEVEL_DIFFUSE] = 0.4f * (float)i / STEPS};
        memcpy(read, truth, VALUES * sizeof *read);
        nn_set_levels(PIXELS, C, off, read);
        find(shown, 2, read);
        const double left = log((double)(mean_of(read, MAP_DIFFUSE, 3) / mean_of(truth, MAP_DIFFUSE, 3))),
                     repaired = (double)off[NN_LEVEL_DIFFUSE] - left;
        jump = fmax(jump, fabs(repaired - before)), most = fmax(most, repaired), before = repaired;
    }
    CHECK(most > 0.35 && jump < 0.25 * most, "e^%.3f of e^0.4 is repaired, a jump is e^%.3f", most, jump);
    free(truth), free(read), free(shown), free(r);
}

/* Red and blue of diffuse beside its green. */
TEST(levels_find_a_hue)
{
    const float off[NN_LEVELS] = {[NN_LEVEL_DIFFUSE_RED] = 0.4f, [NN_LEVEL_DIFFUSE_BLUE] = -0.3f};
    float *truth = malloc(VALUES * sizeof *truth), *read = malloc(VALUES * sizeof *read);
    paint(0.12f, 0.2f, truth);
    memcpy(read, truth, VALUES * sizeof *read);
    nn_set_levels(PIXELS, C, off, read);
    find(truth, 2, read);
    for (int c = 0; c < 3; c += 2) {
        const double left = log((double)(mean_of(read, MAP_DIFFUSE + c, 1) / mean_of(truth, MAP_DIFFUSE + c, 1))) -
            log((double)(mean_of(read, MAP_DIFFUSE + 1, 1) / mean_of(truth, MAP_DIFFUSE + 1, 1)));
        CHECK(fabs(left) < 0.12, "diffuse's channel %d over green is off by e^%.2f", c, left);
    }
    free(truth), free(read);
}

/* What looks like a metal with nearly black diffuse has some beneath. */
TEST(levels_find_diffuse_that_a_metal_has_not)
{
    float *truth = malloc(VALUES * sizeof *truth), *read = malloc(VALUES * sizeof *read);
    paint(0.15f, 0.25f, truth);
    paint(0.005f, 0.4f, read);
    find(truth, 1, read);
    const float diffuse = mean_of(read, MAP_DIFFUSE, 3), f0 = mean_of(read, MAP_SPECULAR, 3);
    CHECK(fabsf(diffuse - 0.15f) < 0.07f && fabsf(f0 - 0.25f) < 0.1f, "diffuse %g, F0 %g", (double)diffuse, (double)f0);
    free(truth), free(read);
}

/* Of a sample that is told to be a dielectric F0 stays, of a metal diffuse; the other levels are found. */
TEST(levels_of_a_told_kind)
{
    static const struct {
        nn_kind kind;
        float diffuse, f0, off[NN_LEVELS];
        int told, other;
    } of[] = {{NN_KIND_DIELECTRIC,
               0.12f,
               0.2f,
               {[NN_LEVEL_DIFFUSE] = 0.5f, [NN_LEVEL_F0] = 0.3f, [NN_LEVEL_F0_RED] = 0.1f},
               MAP_SPECULAR,
               MAP_DIFFUSE},
              {NN_KIND_METAL,
               0.02f,
               0.4f,
               {[NN_LEVEL_DIFFUSE] = 0.5f, [NN_LEVEL_F0] = 0.6f, [NN_LEVEL_DIFFUSE_RED] = 0.2f},
               MAP_DIFFUSE,
               MAP_SPECULAR}};
    float *truth = malloc(VALUES * sizeof *truth), *read = malloc(VALUES * sizeof *read),
          *before = malloc(VALUES * sizeof *before);
    for (int k = 0; k < 2; k++) {
        paint(of[k].diffuse, of[k].f0, truth);
        memcpy(before, truth, VALUES * sizeof *before);
        nn_set_levels(PIXELS, C, of[k].off, before);
        memcpy(read, before, VALUES * sizeof *read);
        find_of(of[k].kind, truth, 2, read);
        for (int i = 0; i < PIXELS; i++) {
            const int at = i * C + of[k].told;
            CHECK(!memcmp(read + at, before + at, 3 * sizeof *read), "case %d: pixel %d of the told map", k, i);
        }
        CHECK(mean_of(read, of[k].other, 3) < 0.9f * mean_of(before, of[k].other, 3), "case %d: the other stays", k);
    }
    free(truth), free(read), free(before);
}

TEST(levels_that_are_right_stay)
{
    float *truth = malloc(VALUES * sizeof *truth), *read = malloc(VALUES * sizeof *read);
    for (int metal = 0; metal < 2; metal++) {
        paint(metal ? 0.02f : 0.3f, metal ? 0.6f : 0.04f, truth);
        memcpy(read, truth, VALUES * sizeof *read);
        find(truth, 2, read);
        CHECK(!memcmp(read, truth, VALUES * sizeof *read), "%s", metal ? "a metal" : "a dielectric");
    }
    free(truth), free(read);
}

TEST(levels_do_not_depend_on_threads)
{
    static const float off[NN_LEVELS] = {
        [NN_LEVEL_DIFFUSE] = -0.2f, [NN_LEVEL_F0] = 0.5f, [NN_LEVEL_ROUGHNESS] = 0.3f, [NN_LEVEL_F0_RED] = 0.2f};
    float *truth = malloc(VALUES * sizeof *truth), *one = malloc(VALUES * sizeof *one),
          *three = malloc(VALUES * sizeof *three);
    paint(0.12f, 0.2f, truth);
    memcpy(one, truth, VALUES * sizeof *one);
    nn_set_levels(PIXELS, C, off, one);
    memcpy(three, one, VALUES * sizeof *one);
    find(truth, 1, one), find(truth, 3, three);
    CHECK(!memcmp(one, three, VALUES * sizeof *one), "three threads find other levels than one");
    free(truth), free(one), free(three);
}
