#include "render/published.h"

const rd_published_constants rd_published = {
    .distance = 250.0 / 256, /* 250 pixels of a patch of 256 */
    .power = 329288.0 / (256.0 * 256),
    .gamma = 2.2,
    .gradient = 1e5,
    .rmse = 1e-30,
    .guards = {.roughness = 1e-6,
               .nz2 = 1e-6,
               .distance2 = 1e-8 /* never met */,
               .lz = 0.001 /* not used */,
               .distribution = 1e-6,
               .k = 1e-6,
               .cosines = 1e-6},
};

rd_view rd_published_flash(void)
{
    const float d = (float)rd_published.distance;
    return (rd_view){.kind = RD_PUBLISHED, .camera = {0, 0, d}, .light = {0, 0, d}, .power = (float)rd_published.power};
}
