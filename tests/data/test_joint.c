/* What the joint statistics say of materials that are known. */
#include "data/materials/joint.h"
#include "tests/test.h"
#include <math.h>
#include <string.h>

enum { SIZE = 128 };

/* A wave of the given cycles in height whose slopes have this root mean square; diffuse follows it, roughness is its
 * opposite. */
static io_material wave(double cycles, double slope)
{
    io_material m = {0};
    CHECK(io_material_create(&m, SIZE, NULL) == TS_OK, "no memory");
    const double turn = 6.283185307179586 * cycles;
    for (int i = 0; i < SIZE * SIZE; i++) {
        const double x = (i % SIZE + 0.5) / SIZE, p = -sqrt(2.0) * slope * sin(turn * x), h = cos(turn * x);
        const float d = (float)pow(0.5 + 0.1 * h, 2.2);
        const io_texel t = {{d, d, d}, {(float)-p, 0, 1}, (float)(0.5 - 0.2 * h), {0.08f, 0.08f, 0.08f}};
        io_texel_put(m.maps + (size_t)i * MAP_CHANNELS, &t);
    }
    return m;
}

TEST(joint_statistics_tell_bands_apart)
{
    static const double cycles[] = {4, 16, 40};
    CHECK(!strcmp(io_joint_name(2), "relief 8-32") && !strcmp(io_joint_name(10), "F0"),
          "the names are in another order");
    for (int band = 0; band < 3; band++) {
        io_material m = wave(cycles[band], 0.1);
        double v[IO_JOINTS];
        ts_status st = {0};
        CHECK(io_joint(&m, v, &st) == TS_OK, "%s", st.message);
        CHECK(fabs(v[0] - 0.1) < 0.002, "relief %.4f", v[0]);
        for (int k = 0; k < 3; k++) {
            /* A sine is no cosine: its ends leak into the neighbouring bands. */
            const double leak = k == band ? 0.012 : 0.035;
            CHECK(fabs(v[1 + k] - (k == band ? 0.1 : 0)) < leak, "%g cycles, band %d: relief %.4f", cycles[band], k,
                  v[1 + k]);
        }
        CHECK(v[4 + band] > 0.99 && v[7 + band] < -0.99, "%g cycles: correlations %.3f, %.3f", cycles[band],
              v[4 + band], v[7 + band]);
        CHECK(fabs(v[10] - 0.08) < 1e-6 && fabs(v[11] - 0.5) < 1e-3, "F0 %g, roughness %g", v[10], v[11]);
        io_material_free(&m);
    }
}

TEST(joint_statistics_of_a_flat_sheet_are_zero)
{
    io_material m = wave(10, 0);
    double v[IO_JOINTS];
    CHECK(io_joint(&m, v, NULL) == TS_OK, "no memory");
    for (int k = 0; k < 10; k++) CHECK(fabs(v[k]) < 1e-5, "%s is %g", io_joint_name(k), v[k]);
    io_material_free(&m);
}

TEST(joint_quantiles_lie_between_neighbours)
{
    double rows[5][IO_JOINTS] = {{0}};
    static const double given[] = {4, 0, 3, 1, 2};
    for (int i = 0; i < 5; i++) rows[i][10] = given[i];
    const io_joint_set set = {5, rows};
    CHECK(io_joint_quantile(&set, 10, 0) == 0 && io_joint_quantile(&set, 10, 1) == 4, "the ends");
    CHECK(fabs(io_joint_quantile(&set, 10, 0.5) - 2) < 1e-12 && fabs(io_joint_quantile(&set, 10, 0.1) - 0.4) < 1e-12,
          "the median or a tenth");
}
