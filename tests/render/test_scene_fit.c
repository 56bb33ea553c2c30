/* What is found of the scene from a photograph and its maps. */
#include "render/rows.h"
#include "render/scene_model.h"
#include "tensor/cpu.h"
#include "tensor/threads.h"
#include "tests/support/farther.h"
#include "tests/support/scene_maps.h"
#include <math.h>
#include <string.h>

enum { SIDE = 48, PIXELS = SIDE * SIDE, K = RD_SCENE_UNKNOWNS, G = MAP_GROUPS };

typedef struct job {
    float *maps, *deviation, *image, truth[K];
    rd_scene_prior prior;
    rd_scene_how how;
} job;

/* The photograph of maps that are as rough as is true. */
static void photograph(job *j, const float *maps)
{
    float *rough = floats(PIXELS * C);
    rd_scene_roughen(PIXELS, maps, C, j->truth[RD_SCENE_ROUGHNESS], 1, rough);
    rd_scene_photograph(rd_grid_full(SIDE), rough, C, j->truth, true, j->image);
    free(rough);
}

/* A photograph, and a prior of a camera that is about the usual one. */
static job begin(uint64_t round)
{
    static const float deviation[K] = {0.5f, 1, 1, 0.5f, 0.5f, 1.5f, 1, 0.3f, 0.2f};
    ts_rng rng = ts_rng_make(52, TS_STREAM_TEST, round);
    job j = {.maps = floats(PIXELS * C),
             .deviation = floats(PIXELS * G),
             .image = floats(PIXELS * 3),
             .how = {8, 1, 1, {{0.1f, 0.1f}, 0.01f, 0.001f}}};
    scene_maps(&rng, PIXELS, j.maps);
    memcpy(j.prior.deviation, deviation, sizeof deviation);
    for (int i = 0; i < K; i++) j.truth[i] = deviation[i] * ts_rng_range(&rng, -1, 1);
    j.truth[RD_SCENE_AMBIENT] = fabsf(j.truth[RD_SCENE_AMBIENT]);
    memset(j.deviation, 0, PIXELS * G * sizeof(float));
    photograph(&j, j.maps);
    return j;
}

static void end(job *j) { free(j->maps), free(j->deviation), free(j->image); }

static void fit(const job *j, float number[K], float after[K])
{
    memcpy(number, j->prior.mean, K * sizeof *number);
    rd_scene_fit(rd_grid_full(SIDE), j->maps, C, j->deviation, j->image, &j->prior, &j->how, number, after);
}

/* The photograph becomes one of maps that are off those that are known by what deviation says, colours together. */
static void disturb(job *j, ts_rng *rng, float deviation, bool relief)
{
    float *other = floats(PIXELS * C);
    for (int p = 0; p < PIXELS; p++) {
        const float diffuse = ts_rng_normal(rng), specular = ts_rng_normal(rng);
        for (int i = 0; i < C; i++) {
            const float x = i < 3 ? diffuse : i >= MAP_SPECULAR ? specular : ts_rng_normal(rng);
            const bool normal = i == MAP_NORMAL || i == MAP_NORMAL + 1;
            other[p * C + i] = j->maps[p * C + i] +
                deviation * x *
                    (i >= MAP_SPECULAR       ? 0.2f
                         : normal && !relief ? 0
                                             : 1);
        }
        for (int g = 0; g < G; g++)
            j->deviation[p * G + g] = deviation * (g == GROUP_SPECULAR ? 0.2f : g == GROUP_NORMAL && !relief ? 0 : 1);
    }
    j->how.scale.hue[0] = j->how.scale.hue[1] = 0;
    photograph(j, other);
    free(other);
}

TEST(scene_is_found_from_true_maps)
{
    double worst[K] = {0};
    for (uint64_t round = 0; round < 12; round++) {
        job j = begin(round);
        float number[K], after[K];
        fit(&j, number, after);
        for (int i = 0; i < K; i++) {
            worst[i] = farther(worst[i], fabs((double)number[i] - (double)j.truth[i]));
            CHECK(fabsf(number[i] - j.truth[i]) < 0.02f, "round %d: number %d is %g, not %g", (int)round, i,
                  (double)number[i], (double)j.truth[i]);
            CHECK(after[i] > 0 && after[i] < j.prior.deviation[i], "number %d is left with %g", i, (double)after[i]);
        }
        end(&j);
    }
    for (int i = 0; i < K; i++) printf("%s%.2g", i ? " " : "off by at most ", worst[i]);
    printf("\n");
}

/* Of a material that is off its maps by what is said of it: less certain than from true maps, and off by no more than
 * it says, to either side alike. Relief that the maps lack widens highlights, which the level takes for roughness: of
 * maps whose normals are off, the level is not looked at. */
static void from_uncertain_maps(bool relief)
{
    enum { ROUNDS = 40 };
    const int looked_at = relief ? RD_SCENE_NUMBERS : K;
    double sum[K] = {0}, squares[K] = {0}, ratio = INFINITY;
    for (uint64_t round = 0; round < ROUNDS; round++) {
        job j = begin(round);
        ts_rng rng = ts_rng_make(53, TS_STREAM_TEST, round);
        float number[K], after[K], sure[K];
        j.truth[RD_SCENE_EXPOSURE] = -0.5f - fabsf(j.truth[RD_SCENE_EXPOSURE]); /* next to nothing is burnt out */
        j.how.every = 6; /* of more pixels what is not linear would be seen */
        photograph(&j, j.maps);
        fit(&j, number, sure);
        disturb(&j, &rng, 0.05f, relief);
        fit(&j, number, after);
        for (int i = 0; i < K; i++) {
            const double z = ((double)number[i] - (double)j.truth[i]) / (double)after[i];
            sum[i] += z / ROUNDS, squares[i] += z * z / ROUNDS;
            ratio = fmin(ratio, (double)after[i] / (double)sure[i]);
        }
        end(&j);
    }
    for (int i = 0; i < K; i++) printf("number %d: off by %.2f +- %.2f of what is said\n", i, sum[i], sqrt(squares[i]));
    for (int i = 0; i < looked_at; i++) {
        CHECK(fabs(sum[i]) < 1, "number %d is off by %.2f deviations on average", i, sum[i]);
        CHECK(squares[i] < 4, "number %d is off by %.2f deviations", i, sqrt(squares[i]));
    }
    CHECK(ratio > 1, "as certain from uncertain maps: %g", ratio);
}

TEST(scene_is_found_from_uncertain_maps) { from_uncertain_maps(true); }
TEST(scene_is_found_from_uncertain_colours_and_gloss) { from_uncertain_maps(false); }

TEST(middle_pixels_of_an_even_number_of_parts_are_mirrored)
{
    for (int parts = 2; parts <= 64; parts += 2)
        for (int wide = 1; wide <= 9; wide++)
            for (int i = 0, size = parts * wide; i < parts; i++) {
                const int at = rd_middle(i, parts, size), mirrored = rd_middle(parts - 1 - i, parts, size);
                CHECK(at / wide == i && at + mirrored == size - 1, "%d and %d of %d", at, mirrored, size);
            }
}

/* Upside down, with the normals and the light's place. */
static void turn_over(job *j)
{
    job from = *j;
    j->maps = floats(PIXELS * C), j->deviation = floats(PIXELS * G), j->image = floats(PIXELS * 3);
    for (int p = 0; p < PIXELS; p++) {
        const int to = (SIDE - 1 - p / SIDE) * SIDE + p % SIDE;
        memcpy(j->maps + to * C, from.maps + p * C, C * sizeof(float));
        memcpy(j->deviation + to * G, from.deviation + p * G, G * sizeof(float));
        memcpy(j->image + to * 3, from.image + p * 3, 3 * sizeof(float));
        j->maps[to * C + MAP_NORMAL + 1] *= -1;
    }
    end(&from);
}

/* Whichever rows are read, an even number of them. */
TEST(scene_of_a_mirrored_photograph_is_mirrored)
{
    static const int rows[] = {48, 24, 16, 12, 8, 6};
    for (size_t n = 0; n < sizeof rows / sizeof *rows; n++) {
        const int every = SIDE / rows[n];
        job j = begin(3);
        ts_rng rng = ts_rng_make(56, TS_STREAM_TEST, 0);
        float number[K], mirrored[K], after[K];
        disturb(&j, &rng, 0.1f, true);
        j.how.every = every, j.how.correlated = 32;
        fit(&j, number, after);
        turn_over(&j);
        fit(&j, mirrored, after);
        mirrored[RD_SCENE_LIGHT_Y] *= -1, mirrored[RD_SCENE_CAMERA_Y] *= -1;
        for (int i = 0; i < K; i++)
            CHECK(fabsf(mirrored[i] - number[i]) < 1e-3f, "of %d rows one: number %d is %g, and %g in the mirror",
                  every, i, (double)number[i], (double)mirrored[i]);
        end(&j);
    }
}

TEST(scene_level_is_a_factor_on_the_roughness)
{
    static const float level[] = {0, -0.7f, 0.4f, 3};
    float *maps = floats(PIXELS * C), *to = floats(PIXELS * C);
    ts_rng rng = ts_rng_make(55, TS_STREAM_TEST, 0);
    scene_maps(&rng, PIXELS, maps);
    for (size_t k = 0; k < sizeof level / sizeof *level; k++) {
        rd_scene_roughen(PIXELS, maps, C, level[k], 1, to);
        for (int i = 0; i < PIXELS * C; i++) {
            const double want = i % C != MAP_ROUGHNESS ? (double)maps[i]
                                                       : fmin(((double)maps[i] + 1) * exp((double)level[k]) - 1, 1);
            CHECK(fabs((double)to[i] - want) < 1e-6, "level %g: %g, not %g", (double)level[k], (double)to[i], want);
        }
    }
    rd_scene_roughen(PIXELS, maps, C, level[3], 1, maps);
    CHECK(!memcmp(maps, to, PIXELS * C * sizeof *to), "in place it is another");
    free(maps), free(to);
}

TEST(scene_without_doubt_stays)
{
    job j = begin(1);
    float number[K], after[K];
    memset(j.prior.deviation, 0, sizeof j.prior.deviation);
    fit(&j, number, after);
    for (int i = 0; i < K; i++)
        CHECK(number[i] == j.prior.mean[i] && after[i] == 0, "number %d is %g +- %g", i, (double)number[i],
              (double)after[i]);
    end(&j);
}

TEST(scene_is_the_same_for_any_number_of_threads)
{
    job j = begin(2);
    float number[2][K], after[2][K];
    j.how.every = 3, j.how.correlated = 10;
    for (int threads = 1; threads <= 5; threads += 2) {
        ts_threads_set(threads);
        fit(&j, number[threads > 1], after[threads > 1]);
        CHECK(threads == 1 ||
                  (!memcmp(number[0], number[1], sizeof number[0]) && !memcmp(after[0], after[1], sizeof after[0])),
              "other bytes with %d threads", threads);
    }
    ts_threads_set(0);
    end(&j);
}

TEST(scene_fit_is_finite)
{
    static const float extreme[] = {-1, 1, 0, -0.999999f, 0.999999f, 2, -5, 1e30f, -1e30f, 1e-40f};
    static const float widths[] = {0, 1e-20f, 0.1f, 1, 1e30f, INFINITY, -1, NAN};
    enum { EXTREMES = sizeof extreme / sizeof *extreme, WIDTHS = sizeof widths / sizeof *widths };
    for (int isa = TS_BASE; isa <= (int)ts_isa_best(); isa++) {
        ts_isa_use((ts_isa)isa);
        job j = begin(3);
        ts_rng rng = ts_rng_make(54, TS_STREAM_TEST, 0);
        for (int round = 0; round < 40; round++) {
            float number[K], after[K];
            for (int i = 0; i < PIXELS * C; i++)
                j.maps[i] = ts_rng_int(&rng, 3) ? extreme[ts_rng_int(&rng, EXTREMES)] : ts_rng_range(&rng, -1, 1);
            for (int i = 0; i < PIXELS * G; i++) j.deviation[i] = widths[ts_rng_int(&rng, WIDTHS)];
            for (int i = 0; i < PIXELS * 3; i++)
                j.image[i] = round % 4 < 2 ? (float)(round % 2) : ts_rng_range(&rng, 0, 1);
            j.how = (rd_scene_how){
                6, 1 + round % 3, 10, {{0.1f, 0}, round % 5 ? 0.1f : 0, round % 3 ? 0.1f : 0, round % 4 ? 0 : 0.2f, 0}};
            fit(&j, number, after);
            for (int i = 0; i < K; i++)
                CHECK(fabsf(number[i]) <= 6 && after[i] >= 0 && after[i] <= j.prior.deviation[i] * 1.00001f,
                      "%s, round %d: number %d is %g +- %g", ts_isa_name((ts_isa)isa), round, i, (double)number[i],
                      (double)after[i]);
        }
        end(&j);
    }
}
