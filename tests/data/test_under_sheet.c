/* What a printed sheet leaves wrong with photographs: each fault within what its number says. */
#include "data/under_sheet.h"
#include "tests/test.h"
#include <math.h>
#include <string.h>

enum { SIDE = 64, TRIALS = 200 };

TEST(under_sheet_moves_camera_and_light_by_its_pose)
{
    const io_under_sheet u = {.pose = 0.01f};
    const io_rig planned = {.camera = {0.3f, -0.2f, 1.8f}, .light = {0.4f, -0.2f, 1.8f}, .power = 5};
    double farthest = 0, together = 0;
    for (uint64_t i = 0; i < TRIALS; i++) {
        io_rig r = planned, again = planned;
        double far[2] = {0, 0}, apart = 0;
        io_under_sheet_move(&u, 3, i, &r);
        io_under_sheet_move(&u, 3, i, &again);
        CHECK(!memcmp(&r, &again, sizeof r) && r.power == planned.power, "rig %d is another the second time", (int)i);
        for (int k = 0; k < 3; k++) {
            const double c = (double)r.camera[k] - (double)planned.camera[k],
                         l = (double)r.light[k] - (double)planned.light[k];
            far[0] += c * c, far[1] += l * l, apart += (c - l) * (c - l);
        }
        for (int k = 0; k < 2; k++) {
            CHECK(far[k] <= 0.01 * 0.01 * 1.001, "rig %d is %g off", (int)i, sqrt(far[k]));
            farthest = fmax(farthest, sqrt(far[k]));
        }
        together += apart < 1e-12;
    }
    CHECK(farthest > 0.008 && together == 0, "the farthest of %d is %g off", TRIALS, farthest);
}

TEST(under_sheet_exposes_up_to_its_bracket)
{
    const io_under_sheet even = {0}, u = {.bracket = 0.3f};
    const double middle = (double)io_under_sheet_exposure(&even, 3, 0);
    double least = 2, most = 0;
    for (uint64_t i = 0; i < TRIALS; i++) {
        const double e = (double)io_under_sheet_exposure(&u, 3, i) / middle;
        least = fmin(least, e), most = fmax(most, e);
    }
    CHECK(least > 0.699 && least < 0.75 && most < 1.301 && most > 1.25, "from %g to %g", least, most);
}

static float image[SIDE][SIDE][3], moved[SIDE][SIDE][3];

/* A ramp in x and one in y say how far each pixel has moved. */
TEST(under_sheet_shifts_and_bends_up_to_its_shift)
{
    const double most = 4, pixels = most * SIDE / 512;
    const io_under_sheet none = {0}, u = {.shift = (float)most};
    double beside = 0, bent = 0;
    for (int y = 0; y < SIDE; y++)
        for (int x = 0; x < SIDE; x++) image[y][x][0] = (float)x, image[y][x][1] = (float)y, image[y][x][2] = 0.5f;
    memcpy(moved, image, sizeof moved);
    io_under_sheet_shift(&none, 3, 1, SIDE, moved[0][0]);
    CHECK(!memcmp(moved, image, sizeof moved), "a shift of 0 changes the picture");
    for (uint64_t i = 0; i < TRIALS; i++) {
        memcpy(moved, image, sizeof moved);
        io_under_sheet_shift(&u, 3, i, SIDE, moved[0][0]);
        const double right = (double)moved[SIDE / 2][SIDE / 2][0] - SIDE / 2,
                     down = (double)moved[SIDE / 2][SIDE / 2][1] - SIDE / 2;
        CHECK(hypot(right, down) < pixels * 1.01, "the centre moved by %g, %g pixels", right, down);
        beside = fmax(beside, hypot(right, down));
        for (int y = 4; y < SIDE - 4; y++)
            for (int x = 4; x < SIDE - 4; x++) {
                const double px = (x + 0.5) * 2 / SIDE - 1, py = (y + 0.5) * 2 / SIDE - 1, r = hypot(px, py);
                const double dx = (double)moved[y][x][0] - x - right, dy = (double)moved[y][x][1] - y - down;
                CHECK(hypot(dx, dy) < pixels * r * r * r * 1.02 + 1e-3 && fabs(dx * py - dy * px) < 0.01,
                      "%d, %d is bent by %g, %g pixels", x, y, dx, dy);
                CHECK(fabsf(moved[y][x][2] - 0.5f) < 1e-6f, "a flat colour is %g", (double)moved[y][x][2]);
                bent = fmax(bent, hypot(dx, dy) / (r * r * r + 1e-9) * (r > 0.5));
            }
    }
    CHECK(beside > 0.9 * pixels && bent > 0.9 * pixels, "at most %g beside and %g bent, of %g", beside, bent, pixels);
}
