/* What time and use do to a plain sheet. */
#include "data/materials/finish.h"
#include "data/materials/palette.h"
#include "data/materials/weathering.h"
#include "tests/data/grey_canvas.h"
#include "tests/test.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { SIZE = 128, COUNT = SIZE * SIZE };

static io_canvas sheet(uint64_t index)
{
    static float *memory;
    if (!memory) memory = malloc((size_t)CANVAS_ALL * COUNT * sizeof *memory);
    return grey_canvas(memory, SIZE, index);
}

TEST(decals_cover_a_part_with_crisp_borders)
{
    int some = 0, inked = 0, border = 0;
    for (uint64_t index = 0; index < 60; index++) {
        io_canvas c = sheet(index);
        wear_decals(&c);
        CHECK(c.used == 0, "%d planes are still held", c.used);
        int changed = 0;
        for (int i = 0; i < COUNT; i++) {
            const bool here = c.diffuse[0][i] != 0.3f || c.roughness[i] != 0.5f;
            for (int k = 0; k < 3; k++)
                CHECK(c.diffuse[k][i] >= 0.0039f && c.diffuse[k][i] <= 0.9001f && c.specular[k][i] > 0.01f &&
                          c.specular[k][i] < 0.07f,
                      "decal %d is of no pigment: diffuse %g, specular %g", (int)index, c.diffuse[k][i],
                      c.specular[k][i]);
            CHECK(c.height[i] >= 0 && c.height[i] < 0.003f && (here || c.height[i] == 0), "decal %d is %g thick",
                  (int)index, c.height[i]);
            changed += here;
        }
        /* Ink meets sheet within a pixel or two: next to most covered pixels lies another of nearly the same coverage.
         */
        for (int i = 0; i + 1 < COUNT; i++) {
            const float a = fabsf(c.roughness[i] - 0.5f), b = fabsf(c.roughness[i + 1] - 0.5f);
            inked += a > 0.02f;
            border += a > 0.02f && fabsf(a - b) > 0.01f;
        }
        some += changed > 20 && changed < 0.7 * COUNT;
    }
    CHECK(some > 45, "only %d of 60 sheets have decals on a part of them", some);
    CHECK(border < 0.5 * inked, "%d of %d covered pixels differ from the next", border, inked);
}

TEST(texture_has_about_the_slope_that_was_asked_for)
{
    static const float frequency[] = {4, 8}, slope[] = {0.01f, 0.1f};
    for (int f = 0; f < 2; f++)
        for (int s = 0; s < 2; s++) {
            double sum = 0;
            for (uint64_t index = 0; index < 10; index++) {
                io_canvas c = sheet(index);
                wear_texture(&c, frequency[f], slope[s]);
                for (int i = 0; i + 1 < COUNT; i++)
                    if (i % SIZE != SIZE - 1) sum += pow((c.height[i + 1] - c.height[i]) * SIZE, 2);
            }
            const double rms = sqrt(sum / (10.0 * SIZE * (SIZE - 1)));
            CHECK(rms > 0.4 * slope[s] && rms < 2.5 * slope[s], "%g cycles, slope %g: an RMS of %g", frequency[f],
                  slope[s], rms);
        }
}

TEST(streaks_run)
{
    double along = 0, across = 0;
    int streaked = 0;
    for (uint64_t index = 0; index < 30; index++) {
        io_canvas c = sheet(index);
        wear_streaks(&c, 0.7f);
        CHECK(c.used == 0, "%d planes are still held", c.used);
        double down = 0, right = 0;
        for (int y = 0; y + 1 < SIZE; y++)
            for (int x = 0; x + 1 < SIZE; x++) {
                const int i = y * SIZE + x;
                down += fabsf(c.roughness[i + SIZE] - c.roughness[i]);
                right += fabsf(c.roughness[i + 1] - c.roughness[i]);
            }
        along += fmin(down, right);
        across += fmax(down, right);
        streaked += down + right > 0;
    }
    CHECK(streaked > 25 && across > 2.5 * along, "%d of 30 sheets are streaked; %g along, %g across", streaked, along,
          across);
}

TEST(finish_gives_relief_the_slope_that_it_is_told)
{
    io_canvas c = sheet(1);
    for (int i = 0; i < COUNT; i++) c.height[i] = 3 + 0.01f * sinf(6.2831853f * 4 * (c.x[i] + c.y[i]));
    fin_slope(&c, 0.2f);
    double slopes = 0, mean = 0;
    for (int y = 1; y + 1 < SIZE; y++)
        for (int x = 1; x + 1 < SIZE; x++) {
            const float *h = c.height + y * SIZE + x;
            const double p = (h[1] - h[-1]) * SIZE / 2, q = (h[-SIZE] - h[SIZE]) * SIZE / 2;
            slopes += p * p + q * q;
            mean += h[0];
        }
    const double count = (SIZE - 2.0) * (SIZE - 2);
    CHECK(fabs(sqrt(slopes / count) - 0.2) < 0.004, "slopes of %.4f", sqrt(slopes / count));
    CHECK(fabs(mean / count) < 1e-3, "mean height %g", mean / count);
}

TEST(finish_sets_the_level_of_dielectrics_alone)
{
    double least = 1, most = 0;
    int polished = 0;
    for (uint64_t index = 0; index < 400; index++) {
        io_canvas c = sheet(index);
        for (int i = 0; i < COUNT / 2; i++)
            for (int k = 0; k < 3; k++) c.specular[k][i] = 0.5f;
        fin_level(&c, 0.25f);
        const double f0 = c.specular[0][COUNT - 1];
        CHECK(c.specular[0][0] == 0.5f, "a metal's F0 went to %g", c.specular[0][0]);
        least = fmin(least, f0);
        most = fmax(most, f0);
        polished += f0 >= 0.0799;
    }
    CHECK(least >= 0.0199 && least < 0.022 && most <= 0.2001 && most > 0.19, "F0 from %g to %g", least, most);
    CHECK(polished > 70 && polished < 130, "%d of 400 are polished", polished);
}

TEST(finish_darkens_or_lightens_what_lies_deep)
{
    int darker = 0, lighter = 0, same = 0;
    for (uint64_t index = 0; index < 80; index++) {
        io_canvas c = sheet(index);
        for (int i = 0; i < COUNT; i++) c.height[i] = 0.02f * sinf(6.2831853f * 12 * c.x[i]);
        fin_crevices(&c);
        CHECK(c.used == 0, "%d planes are still held", c.used);
        double deep = 0, high = 0;
        for (int i = 0; i < COUNT; i++) *(c.height[i] < 0 ? &deep : &high) += c.diffuse[1][i];
        darker += deep < 0.97 * high;
        lighter += deep > 1.03 * high;
        same += fabs(deep - high) <= 0.03 * high;
    }
    CHECK(darker > 25 && lighter > 4 && same > 8, "of 80, %d darker, %d lighter, %d the same", darker, lighter, same);
}

TEST(finish_coats_shine_and_level)
{
    int smooth = 0, level = 0;
    for (uint64_t index = 0; index < 40; index++) {
        io_canvas c = sheet(index);
        for (int i = 0; i < COUNT; i++) {
            c.height[i] = 0.01f * sinf(6.2831853f * 30 * c.x[i]);
            c.roughness[i] = 0.8f;
        }
        fin_coat(&c);
        double before = 0, after = 0;
        for (int i = 0; i + 1 < COUNT; i++) {
            before += fabs(0.01 * (sin(6.2831853 * 30 * c.x[i + 1]) - sin(6.2831853 * 30 * c.x[i])));
            after += fabs((double)c.height[i + 1] - c.height[i]);
            CHECK(c.roughness[i] > 0.04f && c.roughness[i] < 0.81f, "roughness %g", c.roughness[i]);
            CHECK(c.specular[0][i] > 0.02f && c.specular[0][i] < 0.051f, "F0 %g", c.specular[0][i]);
        }
        smooth += c.roughness[COUNT / 2] < 0.4f;
        level += after < 0.9 * before;
    }
    CHECK(smooth > 20 && level > 12, "of 40, %d are smooth and %d more level", smooth, level);
}
