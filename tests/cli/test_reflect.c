/* Photographs of samples that reflect otherwise than the renderer's BRDF. */
#include "cli/reflect.h"
#include "render/render.h"
#include "tensor/maps.h"
#include "tests/test.h"
#include <math.h>
#include <string.h>

enum { SIZE = 64, PIXELS = SIZE * SIZE, VALUES = PIXELS * 3 };
static const io_disk point = {0};
static float maps[PIXELS * MAP_CHANNELS], image[VALUES], other[VALUES];

/* Ridges along y of the given slope. */
static void sample(float albedo, float f0, float roughness, float slope)
{
    for (int i = 0; i < PIXELS; i++) {
        float *m = maps + i * MAP_CHANNELS;
        for (int k = 0; k < 3; k++) m[MAP_DIFFUSE + k] = 2 * albedo - 1, m[MAP_SPECULAR + k] = 2 * f0 - 1;
        m[MAP_NORMAL] = slope * sinf(0.7f * (float)(i % SIZE));
        m[MAP_NORMAL + 1] = 0;
        m[MAP_ROUGHNESS] = 2 * roughness - 1;
    }
}

static void reflect(io_reflection how, const io_disk *flash, float *to)
{
    const rd_view view = rd_flash();
    cl_reflect(&how, &view, flash, SIZE, maps, to);
}

TEST(reflection_of_the_renderers_brdf_is_its_parts)
{
    const rd_view view = rd_flash();
    const io_disk disk = {.radius = 0.02f, .turn = 1};
    sample(0.4f, 0.08f, 0.3f, 0.2f);
    reflect((io_reflection){0, 1, 1, 1}, &point, image);
    rd_render(rd_grid_full(SIZE), maps, MAP_CHANNELS, &view, false, other);
    CHECK(!memcmp(image, other, sizeof image), "without any difference it is not the renderer's");
    reflect((io_reflection){0, 1, 1, 1 - 1e-6f}, &point, other); /* diffuse and mirrored light apart */
    for (int i = 0; i < VALUES; i++)
        CHECK(fabsf(other[i] / image[i] - 1) < 1e-3f, "value %d is %g in place of %g", i, other[i], image[i]);
    reflect((io_reflection){0, 1, 1, 1}, &disk, image);
    rd_render_disk(rd_grid_full(SIZE), maps, MAP_CHANNELS, &view, disk.radius, disk.turn, other);
    CHECK(!memcmp(image, other, sizeof image), "under a disk it is not the renderer's");
}

TEST(reflection_softens_the_relief_of_diffuse_light_alone)
{
    sample(0.4f, 0, 1, 0.3f);
    reflect((io_reflection){0, 1, 1, 0}, &point, other);
    sample(0.4f, 0, 1, 0);
    reflect((io_reflection){0, 1, 1, 1}, &point, image);
    for (int i = 0; i < VALUES; i++)
        CHECK(fabsf(other[i] / image[i] - 1) < 5e-3f, "diffuse value %d is %g, flat %g", i, other[i], image[i]);
    sample(0, 0.5f, 0.4f, 0.3f);
    reflect((io_reflection){0, 1, 1, 0}, &point, other);
    reflect((io_reflection){0, 1, 1, 1}, &point, image);
    for (int i = 0; i < VALUES; i++)
        CHECK(fabsf(other[i] - image[i]) <= 1e-3f * image[i] + 2e-4f, "mirrored value %d is %g in place of %g", i,
              other[i], image[i]);
}

/* A second lobe sharpens the peak and widens the foot. */
TEST(reflection_has_two_lobes)
{
    const io_camera both = {.lobes = 0.5f, .soften = 0.5f}, none = {0};
    const int middle = (SIZE / 2 * SIZE + SIZE / 2) * 3, foot = (SIZE / 2 * SIZE + SIZE - 2) * 3;
    float most = 0, softest = 1;
    sample(0, 0.04f, 0.25f, 0);
    reflect((io_reflection){0, 1, 1, 1}, &point, image);
    for (uint64_t i = 0; i < 100; i++) {
        const io_reflection r = io_camera_reflection(&both, 3, i), same = io_camera_reflection(&none, 3, i);
        CHECK(same.share == 0 && same.broad == 1 && same.narrow == 1 && same.soft == 1, "photograph %d", (int)i);
        CHECK(r.share >= 0 && r.share <= 0.5f && r.broad >= 1.3f && r.broad <= 2.5f && r.soft >= 0.5f && r.soft <= 1,
              "photograph %d: %g %g %g", (int)i, r.share, r.broad, r.soft);
        CHECK(fabsf(r.share * logf(r.broad) + (1 - r.share) * logf(r.narrow)) < 1e-4f, "the level moves: %g", r.narrow);
        most = fmaxf(most, r.share), softest = fminf(softest, r.soft);
        if (r.share < 0.2f) continue;
        reflect(r, &point, other);
        CHECK(other[middle] > 1.05f * image[middle], "the peak is %g, of one lobe %g", other[middle], image[middle]);
        CHECK(other[foot] > 1.05f * image[foot], "the foot is %g, of one lobe %g", other[foot], image[foot]);
    }
    CHECK(most > 0.45f && softest < 0.55f, "at most %g in a lobe, %g of the relief", most, softest);
}
