/* What is made of the maps for other people's tools: heights, metalness. */
#include "data/height.h"
#include "data/label.h"
#include "data/metallic.h"
#include "data/seamless.h"
#include "tensor/rng.h"
#include "tests/data/new_material.h"
#include "tests/test.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

#define PI 3.14159265358979323846

/* A smooth relief that does not repeat at the borders, x right and y up in patch widths. */
static double relief(double x, double y)
{
    return 0.02 * cos(2 * PI * (1.3 * x + 0.4 * y)) + 0.01 * sin(2 * PI * 2.7 * y) + 0.05 * x - 0.03 * y;
}

static double relief_error(int size, double *spread)
{
    io_material m = new_material(size);
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
    CHECK(io_height(&m, false, height, 0, &st) == TS_OK, "%s", st.message);
    double mean = 0, got = 0, worst = 0, square = 0;
    const double pixels = (double)size * size;
    for (int k = 0; k < size * size; k++) {
        mean += relief((k % size + 0.5) / size - 0.5, 0.5 - (k / size + 0.5) / size) / pixels;
        got += (double)height[k] / pixels;
    }
    CHECK(fabs(got) < 1e-6, "the mean height is %g", got);
    for (int k = 0; k < size * size; k++) {
        const double want = relief((k % size + 0.5) / size - 0.5, 0.5 - (k / size + 0.5) / size) - mean;
        worst = farther(worst, fabs((double)height[k] - want));
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
        io_material m = new_material(size);
        for (int k = 0; k < size * size * MAP_CHANNELS; k++) m.maps[k] = extreme[ts_rng_int(&r, 8)];
        float height[400];
        ts_status st = {0};
        CHECK(io_height(&m, false, height, 0, &st) == TS_OK, "%s", st.message);
        for (int k = 0; k < size * size; k++)
            CHECK(isfinite(height[k]), "%d x %d, pixel %d: %g", size, size, k, (double)height[k]);
        io_material_free(&m);
    }
}

/* Of maps that repeat the heights do: waves that go around come back, with a border like every other place. */
TEST(height_of_what_repeats)
{
    enum { N = 60 };
    io_material m = new_material(N);
    float height[N * N];
    ts_status st = {0};
    for (int i = 0; i < N; i++)
        for (int j = 0; j < N; j++) {
            const double a = 2 * PI * (2 * (j + 0.5) - (i + 0.5)) / N + 0.7, slope = -0.01 * 2 * PI * sin(a);
            io_texel t = {.normal = {(float)(-2 * slope), (float)-slope, 1}}; /* rows go down, y up */
            io_texel_put(m.maps + (i * N + j) * MAP_CHANNELS, &t);
        }
    CHECK(io_height(&m, true, height, 0, &st) == TS_OK, "%s", st.message);
    for (int i = 0; i < N; i++)
        for (int j = 0; j < N; j++) {
            const double want = 0.01 * cos(2 * PI * (2 * (j + 0.5) - (i + 0.5)) / N + 0.7);
            CHECK(fabs((double)height[i * N + j] - want) < 3e-4, "(%d, %d): %g, not %g", i, j,
                  (double)height[i * N + j], want);
        }
    io_material_free(&m);
}

/* RMS of the differences of neighbours across the borders over those within, all maps or the heights. */
static double border_over_inside(int n, int channels, const float *v)
{
    double border = 0, inside = 0;
    for (int i = 0; i < n; i++)
        for (int j = 0; j < n; j++)
            for (int c = 0; c < channels; c++) {
                const double here = (double)v[(i * n + j) * channels + c],
                             right = (double)v[(i * n + (j + 1) % n) * channels + c] - here,
                             down = (double)v[((i + 1) % n * n + j) * channels + c] - here;
                *(j == n - 1 ? &border : &inside) += right * right;
                *(i == n - 1 ? &border : &inside) += down * down;
            }
    return sqrt(border / (2 * n)) / sqrt(inside / (2.0 * n * (n - 1)));
}

/* Maps and heights continue at the opposite border as they do within. */
TEST(seamless_borders_are_as_the_inside)
{
    static const int sizes[] = {16, 33, 64, 128, 200, 256};
    ts_status st = {0};
    for (size_t k = 0; k < sizeof sizes / sizeof *sizes; k++) {
        const int n = sizes[k];
        io_material m = new_material(n), tile, again;
        for (int i = 0; i < n; i++)
            for (int j = 0; j < n; j++) {
                /* a slope from border to border, waves that do not close, and grain */
                const double x = (double)j / n, y = (double)i / n,
                             wave = 0.2 * sin(17.3 * x + 5 * y) + 0.2 * cos(21.1 * y - 3 * x);
                float *v = m.maps + ((size_t)i * (size_t)n + (size_t)j) * MAP_CHANNELS;
                for (int c = 0; c < MAP_CHANNELS; c++)
                    v[c] = (float)(0.5 * (x + y - 1) + wave + 0.02 * sin(i * 12.9898 + j * 78.233 + c));
            }
        CHECK(border_over_inside(n, MAP_CHANNELS, m.maps) > 1.5, "%d: the maps repeat already", n);
        CHECK(io_seamless(&m, &tile, 0, &st) == TS_OK && io_seamless(&m, &again, 1, &st) == TS_OK, "%s", st.message);
        CHECK(tile.size == n && !memcmp(tile.maps, again.maps, sizeof(float) * MAP_CHANNELS * (size_t)n * (size_t)n),
              "%d: the number of threads changes the maps", n);
        const double ratio = border_over_inside(n, MAP_CHANNELS, tile.maps);
        CHECK(ratio <= 1, "%d: across the border %g times the inside", n, ratio);
        float *height = malloc(sizeof *height * (size_t)n * (size_t)n);
        CHECK(io_height(&tile, true, height, 0, &st) == TS_OK, "%s", st.message);
        const double steps = border_over_inside(n, 1, height);
        CHECK(steps <= 1, "%d: heights across the border %g times the inside", n, steps);
        free(height);
        io_material_free(&m), io_material_free(&tile), io_material_free(&again);
    }
    io_material small = new_material(IO_SEAMLESS_LEAST - 1), none;
    CHECK(io_seamless(&small, &none, 0, &st) == TS_INVALID && strstr(st.message, "16 at least") && !none.maps, "'%s'",
          st.message);
    io_material_free(&small);
}

/* What a metallic workflow can express comes back exactly; what it cannot is reported as an error. */
TEST(metallic_conversion_and_its_error)
{
    enum { N = 12 };
    io_material m = new_material(N);
    ts_rng r = ts_rng_make(6, TS_STREAM_TEST, 0);
    float base[N * N][3], metal[N * N], got_base[N * N * 3], got_metal[N * N], threes[N * N * 3], three[N * N];
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
    const io_metallic_error of_three = io_to_metallic(&m, threes, three, 3);
    io_metallic_error e = io_to_metallic(&m, got_base, got_metal, 1);
    CHECK(!memcmp(three, got_metal, sizeof three) && !memcmp(threes, got_base, sizeof threes) &&
              e.diffuse == of_three.diffuse && e.specular == of_three.specular,
          "the number of threads changes it");
    CHECK(e.diffuse < 1e-4 && e.specular < 1e-4, "RMS error of what can be expressed: %g and %g", e.diffuse,
          e.specular);
    for (int i = 0; i < N * N; i++) {
        CHECK(fabsf(got_metal[i] - metal[i]) < 2e-3f, "metalness %g became %g", (double)metal[i], (double)got_metal[i]);
        for (int c = 0; c < 3; c++)
            CHECK(fabsf(got_base[3 * i + c] - base[i][c]) < 5e-3f, "base %g became %g", (double)base[i][c],
                  (double)got_base[3 * i + c]);
    }
    for (int i = 0; i < N * N; i++) { /* dark dielectrics, whose F0 varies */
        io_texel t = {.normal = {0, 0, 1}, .roughness = 0.5f};
        for (int c = 0; c < 3; c++)
            t.diffuse[c] = ts_rng_range(&r, 0, 0.03f), t.specular[c] = ts_rng_range(&r, 0.01f, 0.06f);
        io_texel_put(m.maps + i * MAP_CHANNELS, &t);
    }
    e = io_to_metallic(&m, got_base, got_metal, 0);
    for (int i = 0; i < N * N; i++)
        CHECK(got_metal[i] < 0.05f, "a dark dielectric has a metalness of %g", (double)got_metal[i]);
    CHECK(e.diffuse < 0.02 && e.specular < 0.03, "RMS error of dark dielectrics: %g and %g", e.diffuse, e.specular);
    for (int i = 0; i < N * N; i++) { /* a dielectric with a blue reflection */
        const io_texel t = {.normal = {0, 0, 1}, .diffuse = {0.5f, 0.5f, 0.5f}, .specular = {0.04f, 0.04f, 0.3f}};
        io_texel_put(m.maps + i * MAP_CHANNELS, &t);
    }
    e = io_to_metallic(&m, got_base, got_metal, 0);
    CHECK(e.diffuse + e.specular > 0.05, "no error is reported for what cannot be expressed: %g and %g", e.diffuse,
          e.specular);
    io_material_free(&m);
}

/* Every letter is another picture, and none leaves its place. */
TEST(label_letters_differ)
{
    static const char letters[] = "abcdefghijklmnopqrstuvwxyz0123456789-";
    static float seen[sizeof letters - 1][IO_LABEL_HEIGHT * 8 * 3];
    for (size_t k = 0; k < sizeof letters - 1; k++) {
        const char text[2] = {letters[k], 0};
        io_image image = {.width = 8, .height = IO_LABEL_HEIGHT, .channels = 3, .data = seen[k]};
        io_label(&image, 1, 3, text);
        float sum = 0;
        for (int i = 0; i < IO_LABEL_HEIGHT * 8 * 3; i++) sum += seen[k][i];
        CHECK(sum >= 3 * 5, "'%s' is hardly there", text);
        for (size_t j = 0; j < k; j++)
            CHECK(memcmp(seen[j], seen[k], sizeof seen[k]), "'%s' is '%c'", text, letters[j]);
        io_label(&image, -3, -3, text);
        io_label(&image, 6, 9, text);
    }
}
