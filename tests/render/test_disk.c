/* A flash that is a disk. */
#include "data/material.h"
#include "render/tone.h"
#include "tensor/cpu.h"
#include "tensor/threads.h"
#include "tests/support/shading.h"
#include <dirent.h>
#include <math.h>
#include <string.h>

/* The mean of rd_radiance over a fine grid of a disk's points. */
static void under_disk(const float *m, const double point[2], const rd_view *view, double radius, double value[3])
{
    enum { RINGS = 16, TURNS = 48 };
    double maps[C], one[3];
    to_double(m, maps);
    for (int c = 0; c < 3; c++) value[c] = 0;
    for (int i = 0; i < RINGS * TURNS; i++) {
        const double r = radius * sqrt((i / TURNS + 0.5) / RINGS), turn = 6.283185307 * (i % TURNS + 0.5) / TURNS;
        rd_view at = *view;
        at.light[0] += (float)(r * cos(turn));
        at.light[1] += (float)(r * sin(turn));
        rd_radiance(maps, point, &at, one, NULL);
        for (int c = 0; c < 3; c++) value[c] += one[c] / (RINGS * TURNS);
    }
}

/* Whatever the roughness, and so the number of points that is taken for it. */
TEST(render_disk_is_the_mean_over_its_points)
{
    enum { SIDE = 64 };
    static float maps[SIDE * SIDE * C], image[SIDE * SIDE * 3];
    const rd_view view = {.kind = RD_POINT, .camera = {0.02f, -0.03f, 0.9f}, .light = {0.1f, 0.05f, 0.9f}, .power = 3};
    const double radius = 0.09, half = 0.5 * radius / 0.9;
    for (double roughness = 0.25; roughness < 1; roughness += 0.05) {
        for (int i = 0; i < SIDE * SIDE * C; i++) {
            const float of[C] = {-0.2f, 0, 0.1f, 0.05f, -0.1f, (float)(2 * roughness - 1), -0.9f, 0, 0.4f};
            maps[i] = of[i % C];
        }
        rd_render_disk(rd_grid_full(SIDE), maps, C, &view, (float)radius, 0.4f, image);
        double most = 0;
        for (int p = 0; p < SIDE * SIDE; p += 7) {
            double point[2], value[3];
            rd_centre(rd_grid_full(SIDE), p % SIDE, p / SIDE, point);
            under_disk(maps + p * C, point, &view, radius, value);
            for (int c = 0; c < 3; c++) most = farther(most, fabs((double)image[p * 3 + c] / value[c] - 1));
        }
        const double alpha = roughness * roughness;
        printf("roughness %.2f, alpha %.1f half angles: off by at most %.4f\n", roughness, alpha / half, most);
        CHECK(most < 0.045, "roughness %.2f: off by %.4f", roughness, most);
    }
}
