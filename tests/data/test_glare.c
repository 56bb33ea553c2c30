/* Light that the lens scatters, and a flash that is a disk. */
#include "cli/camera.h"
#include "data/glare.h"
#include "tensor/maps.h"
#include "tensor/rng.h"
#include "tests/test.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { MOST = 128, VALUES = MOST * MOST * 3 };
static float image[VALUES], other[VALUES];

TEST(glare_keeps_constants_and_light)
{
    const int sides[] = {1, 2, 7, 37, 64, MOST};
    for (int s = 0; s < (int)(sizeof sides / sizeof *sides); s++) {
        const int side = sides[s], values = side * side * 3;
        for (int i = 0; i < values; i++) image[i] = (float)(1 + i % 3);
        io_glare(side, 0.7f, image);
        for (int i = 0; i < values; i++)
            CHECK(fabsf(image[i] - (float)(1 + i % 3)) < 1e-5f, "%d pixels: a constant became %g", side, image[i]);
    }
    double before = 0, after = 0;
    ts_rng r = ts_rng_make(3, TS_STREAM_TEST, 0);
    for (int i = 0; i < VALUES; i++) before += image[i] = ts_rng_uniform(&r);
    io_glare(MOST, 1, image);
    for (int i = 0; i < VALUES; i++) after += image[i];
    CHECK(fabs(after / before - 1) < 0.01, "%g of the light is left", after / before);
}

TEST(glare_is_linear_and_none_without_a_share)
{
    static float sum[VALUES];
    ts_rng r = ts_rng_make(4, TS_STREAM_TEST, 0);
    for (int i = 0; i < VALUES; i++) {
        image[i] = ts_rng_uniform(&r), other[i] = 30 * ts_rng_uniform(&r);
        sum[i] = image[i] + other[i];
    }
    float *all[] = {image, other, sum};
    for (int k = 0; k < 3; k++) io_glare(MOST, 0.3f, all[k]);
    for (int i = 0; i < VALUES; i++)
        CHECK(fabsf(sum[i] - image[i] - other[i]) < 1e-4f, "%g is not %g and %g", sum[i], image[i], other[i]);
    memcpy(image, sum, sizeof image);
    io_glare(MOST, 0, image);
    CHECK(!memcmp(image, sum, sizeof image), "no glare changes something");
}

/* Of one bright pixel: what is not scattered stays, and the rest falls off like 1 / r^2 within the levels' blocks. */
TEST(glare_falls_off_with_the_distance)
{
    const int y = 63, x = 64;
    memset(image, 0, sizeof image);
    for (int c = 0; c < 3; c++) image[(y * MOST + x) * 3 + c] = 1000;
    io_glare(MOST, 0.1f, image);
    const float centre = image[(y * MOST + x) * 3];
    CHECK(centre > 900 && centre < 910, "the pixel itself has %g", centre);
    for (int d = 4; d <= 32; d *= 2) {
        float near = 0, far = 0; /* means over rings */
        int nears = 0, fars = 0;
        for (int i = 0; i < MOST * MOST; i++) {
            const float r = hypotf((float)(i % MOST - x), (float)(i / MOST - y));
            if (r > 0.4f * (float)d && r < 0.6f * (float)d) near += image[3 * i], nears++;
            if (r > 0.9f * (float)d && r < 1.1f * (float)d) far += image[3 * i], fars++;
        }
        const float ratio = near / (float)nears / (far / (float)fars);
        CHECK(ratio > 2 && ratio < 8, "from %d to %d pixels it falls to 1 / %g", d / 2, d, ratio);
    }
}

static void sample(float roughness, float *maps)
{
    for (int i = 0; i < MOST * MOST; i++) {
        float *m = maps + i * MAP_CHANNELS;
        memset(m, 0, MAP_CHANNELS * sizeof *m);
        for (int c = 0; c < 3; c++) m[MAP_DIFFUSE + c] = -0.9f, m[MAP_SPECULAR + c] = -0.92f;
        m[MAP_ROUGHNESS] = 2 * roughness - 1;
    }
}

/* Pixels above half of the brightest, and the sum of all. */
static int highlight(const io_camera *camera, uint64_t index, const float *maps, float *picture, double *light)
{
    const rd_view flash = rd_flash();
    float most = 0;
    int count = 0;
    *light = 0;
    cl_expose(camera, 1, index, &flash, MOST, maps, picture);
    for (int i = 0; i < MOST * MOST; i++) *light += picture[3 * i], most = fmaxf(most, picture[3 * i]);
    for (int i = 0; i < MOST * MOST; i++) count += picture[3 * i] > most / 2;
    return count;
}

/* A smooth surface mirrors the disk at half of its size; a rough one does not show it; the light is the same. */
TEST(flash_disk_is_seen_in_smooth_surfaces)
{
    static float maps[MOST * MOST * MAP_CHANNELS];
    const io_camera point = {0}, disk = {.flash_size = 0.1f};
    double alone, light;
    sample(0.15f, maps);
    const int small = highlight(&point, 1, maps, image, &alone);
    float largest = 0;
    for (uint64_t index = 0; index < 30; index++) {
        const io_disk d = io_camera_flash(&disk, 1, index, 1);
        CHECK(d.radius >= 0 && d.radius <= 0.1f, "a radius of %g", d.radius);
        largest = fmaxf(largest, d.radius);
        const int seen = highlight(&disk, index, maps, image, &light);
        const double mirrored = 3.14159 * pow(0.5 * d.radius * RD_FLASH_DISTANCE * MOST, 2);
        CHECK(seen > 0.7 * mirrored && seen < 1.5 * mirrored + 2.5 * small, "%d pixels of %g and %d", seen, mirrored,
              small);
        CHECK(fabs(light / alone - 1) < 0.02, "%g of the light", light / alone);
    }
    CHECK(largest > 0.09f && io_camera_flash(&point, 1, 1, 1).radius == 0, "the largest radius is %g", largest);
    sample(0.9f, maps);
    highlight(&point, 1, maps, image, &alone);
    highlight(&disk, 1, maps, other, &light);
    for (int i = 0; i < VALUES; i++)
        CHECK(fabsf(other[i] / image[i] - 1) < 0.03f, "a matt sample is %g in place of %g", other[i], image[i]);
}
