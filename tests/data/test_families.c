/* What makes single families what they are. */
#include "data/materials/procedural.h"
#include "tests/data/new_material.h"
#include "tests/test.h"
#include <math.h>

/* Root mean square of the normals' x and y, averaged over squares of side pixels. */
static double lean(const io_material *m, int side)
{
    double sum = 0;
    const int squares = m->size / side;
    for (int q = 0; q < 2 * squares * squares; q++) {
        const int k = q % 2, x0 = q / 2 % squares * side, y0 = q / 2 / squares * side;
        double mean = 0;
        for (int p = 0; p < side * side; p++)
            mean += m->maps[((y0 + p / side) * m->size + x0 + p % side) * MAP_CHANNELS + MAP_NORMAL + k];
        sum += mean / (side * side) * (mean / (side * side));
    }
    return sqrt(sum / (squares * squares));
}

TEST(faces_lean_as_a_whole)
{
    enum { COUNT = 40, SIZE = 128 };
    static const char *const families[] = {"faces", "tile", "panels", "woven"};
    double mean[4] = {0};
    for (int f = 0; f < 4; f++) {
        const io_procedural p = {.seed = 5, .families = io_family_mask(families[f])};
        for (int i = 0; i < COUNT; i++) {
            io_material m = new_material(SIZE);
            io_procedural_make(&p, (uint64_t)i, &m);
            mean[f] += lean(&m, SIZE / 8) / COUNT;
            io_material_free(&m);
        }
    }
    for (int f = 1; f < 4; f++)
        CHECK(mean[0] > 1.5 * mean[f], "faces lean by %.3f, %s by %.3f", mean[0], families[f], mean[f]);
}

/* Correlation of the normals' x and y with the slope of the logarithm of green diffuse albedo and F0 together, -1 where
 * what is dark lies low. */
static double darkness_lies_low(const io_material *m)
{
    double product = 0, normals = 0, slopes = 0;
    for (int y = 1; y + 1 < m->size; y++)
        for (int x = 1; x + 1 < m->size; x++) {
            const float *at = m->maps + (y * m->size + x) * MAP_CHANNELS, *diffuse = at + MAP_DIFFUSE + 1,
                        *specular = at + MAP_SPECULAR + 1;
            const int side[2] = {MAP_CHANNELS, -m->size * MAP_CHANNELS}; /* x right, y up */
            for (int k = 0; k < 2; k++) {
                const double n = at[MAP_NORMAL + k],
                             s = log((diffuse[side[k]] + specular[side[k]] + 2.02) /
                                     (diffuse[-side[k]] + specular[-side[k]] + 2.02));
                product += n * s, normals += n * n, slopes += s * s;
            }
        }
    return product / sqrt(normals * slopes + 1e-12);
}

TEST(openings_are_dark_and_lie_low)
{
    enum { COUNT = 60, SIZE = 96 };
    static const char *const families[] = {"pierced", "lattice", "printed"};
    double mean[3] = {0};
    for (int f = 0; f < 3; f++) {
        const io_procedural p = {.seed = 6, .families = io_family_mask(families[f])};
        for (int i = 0; i < COUNT; i++) {
            io_material m = new_material(SIZE);
            io_procedural_make(&p, (uint64_t)i, &m);
            mean[f] += darkness_lies_low(&m) / COUNT;
            io_material_free(&m);
        }
    }
    for (int f = 0; f < 2; f++)
        CHECK(mean[f] < -0.15 && mean[f] < mean[2] - 0.1, "%s: %.3f, printed ones %.3f", families[f], mean[f], mean[2]);
}
