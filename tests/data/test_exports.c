/* What is made of the maps for other people's tools: heights, metalness. */
#include "data/height.h"
#include "data/metallic.h"
#include "tensor/rng.h"
#include "tests/test.h"
#include <math.h>
#include <stdlib.h>

#define PI 3.14159265358979323846

static io_material material(int size)
{
    io_material m;
    ts_status st = {0};
    CHECK(io_material_create(&m, size, &st) == TS_OK, "%s", st.message);
    return m;
}

/* A smooth relief that does not repeat at the borders, x right and y up in patch widths. */
static double relief(double x, double y)
{
    return 0.02 * cos(2 * PI * (1.3 * x + 0.4 * y)) + 0.01 * sin(2 * PI * 2.7 * y) + 0.05 * x - 0.03 * y;
}

static double relief_error(int size, double *spread)
{
    io_material m = material(size);
    const double e = 1e-5;
    for (int i = 0; i < size; i++)
        for (int j = 0; j < size; j++) {
            const double x = (j + 0.5) / size - 0.5, y = 0.5 - (i + 0.5) / size;
            const double p = (relief(x + e, y) - relief(x - e, y)) / (2 * e),
                         q = (relief(x, y + e) - relief(x, y - e)) / (2 * e);
            io_texel t = {.normal = {(float)-p, (float)-q, 1}};
            io_texel_put(m.maps + ((size_t)i * (size_t)size + (size_t)j) * MAP_CHANNELS, &t);
        }
    float *height = malloc((size_t)size * (size_t)size * sizeof *height);
    ts_status st = {0};
    CHECK(io_height(&m, height, 0, &st) == TS_OK, "%s", st.message);
    double mean = 0, got = 0, worst = 0, square = 0;
    const double pixels = (double)size * size;
    for (int k = 0; k < size * size; k++) {
        mean += relief((k % size + 0.5) / size - 0.5, 0.5 - (k / size + 0.5) / size) / pixels;
        got += (double)height[k] / pixels;
    }
    CHECK(fabs(got) < 1e-6, "the mean height is %g", got);
    for (int k = 0; k < size * size; k++) {
        const double want = relief((k % size + 0.5) / size - 0.5, 0.5 - (k / size + 0.5) / size) - mean;
        worst = fmax(worst, fabs((double)height[k] - want));
        square += want * want;
    }
    *spread = sqrt(square / pixels);
    free(height);
    io_material_free(&m);
    return worst;
}

/* Slopes of a known relief give it back, to the trapezoid rule's error: a quarter for half the pixel. */
TEST(height_gives_the_relief_back)
{
    double spread;
    const double coarse = relief_error(48, &spread), fine = relief_error(96, &spread),
                 finest = relief_error(331, &spread);
    CHECK(coarse < 0.01 * spread && fine < 0.3 * coarse && finest < 0.1 * fine, "errors %g, %g, %g of relief %g",
          coarse, fine, finest, spread);
}

TEST(height_is_finite_for_any_maps)
{
    static const float extreme[] = {-1, 1, 0, 0.7071068f, 1e30f, -1e30f, INFINITY, NAN};
    ts_rng r = ts_rng_make(5, TS_STREAM_TEST, 0);
    for (int size = 1; size < 20; size++) {
        io_material m = material(size);
        for (int k = 0; k < size * size * MAP_CHANNELS; k++) m.maps[k] = extreme[ts_rng_int(&r, 8)];
        float height[400];
        ts_status st = {0};
        CHECK(io_height(&m, height, 0, &st) == TS_OK, "%s", st.message);
        for (int k = 0; k < size * size; k++)
            CHECK(isfinite(height[k]), "%d x %d, pixel %d: %g", size, size, k, (double)height[k]);
        io_material_free(&m);
    }
}

/* What a metallic workflow can express comes back exactly; what it cannot is reported as an error. */
TEST(metallic_conversion_and_its_error)
{
    enum { N = 12 };
    io_material m = material(N);
    ts_rng r = ts_rng_make(6, TS_STREAM_TEST, 0);
    float base[N * N][3], metal[N * N], got_base[N * N * 3], got_metal[N * N];
    for (int i = 0; i < N * N; i++) {
        metal[i] = i % 3 == 0 ? 0 : i % 3 == 1 ? 1 : ts_rng_range(&r, 0, 1);
        io_texel t = {.normal = {0, 0, 1}, .roughness = 0.5f};
        for (int c = 0; c < 3; c++) {
            base[i][c] = ts_rng_range(&r, 0.2f, 0.9f);
            t.diffuse[c] = base[i][c] * (1 - metal[i]);
            t.specular[c] = 0.04f * (1 - metal[i]) + base[i][c] * metal[i];
        }
        io_texel_put(m.maps + i * MAP_CHANNELS, &t);
    }
    io_metallic_error e = io_to_metallic(&m, got_base, got_metal);
    CHECK(e.diffuse < 1e-4 && e.specular < 1e-4, "RMS error of what can be expressed: %g and %g", e.diffuse,
          e.specular);
    for (int i = 0; i < N * N; i++) {
        CHECK(fabsf(got_metal[i] - metal[i]) < 2e-3f, "metalness %g became %g", (double)metal[i], (double)got_metal[i]);
        for (int c = 0; c < 3; c++)
            CHECK(fabsf(got_base[3 * i + c] - base[i][c]) < 5e-3f, "base %g became %g", (double)base[i][c],
                  (double)got_base[3 * i + c]);
    }
    for (int i = 0; i < N * N; i++) { /* a dielectric with a blue reflection */
        const io_texel t = {.normal = {0, 0, 1}, .diffuse = {0.5f, 0.5f, 0.5f}, .specular = {0.04f, 0.04f, 0.3f}};
        io_texel_put(m.maps + i * MAP_CHANNELS, &t);
    }
    e = io_to_metallic(&m, got_base, got_metal);
    CHECK(e.diffuse + e.specular > 0.05, "no error is reported for what cannot be expressed: %g and %g", e.diffuse,
          e.specular);
    io_material_free(&m);
}
