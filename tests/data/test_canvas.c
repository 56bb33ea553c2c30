/* What a family paints on: the whole patch and parts of it. */
#include "data/materials/relief.h"
#include "data/materials/weathering.h"
#include "tensor/maps.h"
#include "tests/data/grey_canvas.h"
#include "tests/test.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { PART = 64, WHOLE = 2 * PART };

/* Noise, cells and signs in the relief and the colours. */
static void paint(io_canvas *c)
{
    const nz_frame straight = cv_frame(c, 7, 1.3f, 0.1f), f = cv_bend(c, straight, 1, 2, 0.1f);
    const nz_cells cells = cv_cells(c);
    nz_cell(f, 1, 0.9f, 0, cv_seed(c), cells);
    cv_raise(c, cells.edge, 0.05f);
    cv_shade(c, cv_noise(c, straight, NZ_SMOOTH, 2, 4, 0.6f), 0.3f);
    cv_drop(c, 0);
    wear_decals(c);
    wear_scratches(c, 40, 0.5f, NULL);
}

/* What is seen from nearer is, pixel for pixel, that part of a picture of the whole with as many more pixels. */
TEST(canvas_of_a_part_is_that_part_of_the_whole)
{
    static const struct {
        float x, y;
        int left, top;
    } parts[] = {{0, 0, PART / 2, PART / 2}, {-0.5f, 0.5f, 0, 0}, {0.5f, -0.5f, PART, PART}, {0.125f, -0.25f, 48, 64}};
    float *memory = malloc((size_t)CANVAS_ALL * (WHOLE * WHOLE + PART * PART) * sizeof *memory),
          *maps = malloc((size_t)MAP_CHANNELS * (WHOLE * WHOLE + PART * PART) * sizeof *maps);
    float *seen = maps + (size_t)MAP_CHANNELS * WHOLE * WHOLE;
    for (uint64_t index = 0; index < 12; index++) {
        const size_t p = index % (sizeof parts / sizeof *parts);
        io_canvas whole = grey_canvas(memory, WHOLE, index),
                  part = grey_canvas(memory + (size_t)CANVAS_ALL * WHOLE * WHOLE, PART, index);
        cv_view(&part, 2, parts[p].x, parts[p].y);
        paint(&whole);
        paint(&part);
        cv_write(&whole, maps);
        cv_write(&part, seen);
        double changes = 0;
        for (int y = 1; y < PART - 1; y++) /* slopes at borders are of one side */
            for (int x = 1; x < PART - 1; x++)
                for (int k = 0; k < MAP_CHANNELS; k++) {
                    const float is = seen[(y * PART + x) * MAP_CHANNELS + k],
                                was = maps[((y + parts[p].top) * WHOLE + x + parts[p].left) * MAP_CHANNELS + k];
                    CHECK(is == was, "material %d, (%d, %d), value %d: %g, not %g", (int)index, x, y, k, (double)is,
                          (double)was);
                    changes += fabs((double)is - (double)seen[(y * PART + x - 1) * MAP_CHANNELS + k]);
                }
        CHECK(changes > 0, "material %d is one value", (int)index);
    }
    free(memory);
    free(maps);
}

/* Of an exchanged relief that keeps its shape what is broad is its own, steeper, and what is fine the other's. */
TEST(exchanged_relief_keeps_its_broad_shape)
{
    enum { SIZE = 128, BROAD = 2, FINE = 32 };
    float *memory = malloc((size_t)CANVAS_ALL * SIZE * SIZE * sizeof *memory),
          *other = malloc((size_t)SIZE * SIZE * sizeof *other);
    io_canvas c = grey_canvas(memory, SIZE, 1);
    for (int i = 0; i < c.count; i++) {
        c.height[i] = cosf(6.2831853f * BROAD * c.x[i]) + cosf(6.2831853f * FINE * c.y[i]);
        other[i] = cosf(6.2831853f * BROAD * c.y[i]) + 2 * cosf(6.2831853f * FINE * c.x[i]);
    }
    const cv_relief r = {.exchanged = true, .shape = 0.03f, .steeper = 3, .gain = 0.5f};
    cv_other_relief(&c, &r, other, c.roughness);
    double broad[2] = {0}, fine[2] = {0};
    for (int i = 0; i < c.count; i++) {
        const double at[2] = {c.x[i], c.y[i]}, height = 2 * (double)c.height[i] / c.count;
        for (int k = 0; k < 2; k++) {
            broad[k] += height * cos(6.2831853 * BROAD * at[k]);
            fine[k] += height * cos(6.2831853 * FINE * at[k]);
        }
    }
    CHECK(fabs(broad[0] - 1.5) < 0.2, "its own broad waves, 1, are %.2f, not 1.5", broad[0]);
    CHECK(fabs(broad[1]) < 0.1, "the other's broad waves are %.2f, not 0", broad[1]);
    CHECK(fabs(fine[0] - 1) < 0.05, "the other's fine waves, 2, are %.2f, not 1", fine[0]);
    CHECK(fabs(fine[1]) < 0.05, "its own fine waves are %.2f, not 0", fine[1]);
    free(memory);
    free(other);
}
