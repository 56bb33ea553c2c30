/* What roughness and F0 change around what is burnt out. */
#include "nn/burnt.h"
#include "tensor/maps.h"
#include "tests/support/networks.h"
#include <math.h>
#include <string.h>

enum { C = MAP_CHANNELS, EDGE = 96, PIXELS = EDGE * EDGE, VALUES = PIXELS * C };

static bool settles(int channel) { return channel >= MAP_ROUGHNESS; }

/* A dark photograph with a burnt-out spot, a value between at (20, 70), and one bright pixel in a corner. */
static void photograph(float *image)
{
    for (int i = 0; i < PIXELS * 3; i++) image[i] = 0.2f;
    for (int y = 40; y < 47; y++)
        for (int x = 50; x < 55; x++) image[(y * EDGE + x) * 3 + 1] = 1;
    image[(20 * EDGE + 70) * 3 + 2] = 0.9f;
    image[0] = 2;
}

/* Pixel (y, x) of v [EDGE, EDGE, channels] by the triangle filter, edges repeated. */
static double filtered(const double *v, int channels, int c, int y, int x)
{
    const int width = nn_burnt_reach(EDGE) + 1;
    double sum = 0;
    for (int i = -width; i <= width; i++)
        for (int j = -width; j <= width; j++) {
            const int at = y + i < 0 ? 0
                : y + i < EDGE       ? y + i
                                     : EDGE - 1,
                      across = x + j < 0 ? 0
                : x + j < EDGE           ? x + j
                                         : EDGE - 1;
            sum += (width - abs(i)) * (width - abs(j)) * v[(at * EDGE + across) * channels + c];
        }
    return sum / pow(width, 4);
}

static void plain_burnt(const float *image, double *burnt)
{
    double *t = malloc(PIXELS * sizeof *t);
    for (int i = 0; i < PIXELS; i++) {
        const float largest = fmaxf(image[3 * i], fmaxf(image[3 * i + 1], image[3 * i + 2]));
        t[i] = fmin(fmax(((double)largest - 0.85) / 0.15, 0), 1);
    }
    for (int i = 0; i < PIXELS; i++) burnt[i] = fmin(4 * filtered(t, 1, 0, i / EDGE, i % EDGE), 1);
    free(t);
}

typedef struct scene {
    float image[PIXELS * 3], mean[VALUES], maps[VALUES], step[VALUES];
} scene;

static scene *make(void)
{
    scene *s = malloc(sizeof *s);
    float *each[] = {s->mean, s->maps, s->step};
    photograph(s->image);
    for (int k = 0; k < 3; k++) {
        float *from = numbers(VALUES, 40 + (uint64_t)k, -0.3f, 0.3f);
        memcpy(each[k], from, sizeof s->mean);
        free(from);
    }
    return s;
}

TEST(burnt_as_plainly_written)
{
    ts_status st = {0};
    ts_arena *arena = ts_arena_create(0, &st);
    scene *s = make();
    double *burnt = malloc(PIXELS * sizeof *burnt), *change = malloc(VALUES * sizeof *change), far = 0;
    float *settled = malloc(sizeof s->step);
    plain_burnt(s->image, burnt);
    const float *found = nn_burnt_find(rd_grid_full(EDGE), s->image, arena);
    CHECK(found, "no memory");
    for (int i = 0; i < PIXELS; i++) far = farther(far, fabs((double)found[i] - burnt[i]));
    CHECK(far < 1e-6, "burnt is %g off", far);
    CHECK(burnt[43 * EDGE + 52] > 0.5 && burnt[60 * EDGE + 20] == 0, "the case has no spot");
    memcpy(settled, s->step, sizeof s->step);
    CHECK(nn_burnt_settle(rd_grid_full(EDGE), found, s->mean, s->maps, C, arena, settled), "no memory");
    for (int i = 0; i < VALUES; i++) change[i] = (double)s->maps[i] + (double)s->step[i] - (double)s->mean[i];
    far = 0;
    for (int i = 0; i < VALUES; i++) {
        const double to = settles(i % C)
            ? (double)s->step[i] + burnt[i / C] * (filtered(change, C, i % C, i / C / EDGE, i / C % EDGE) - change[i])
            : (double)s->step[i];
        far = farther(far, fabs((double)settled[i] - to));
    }
    CHECK(far < 1e-6, "a step is %g off", far);
    memcpy(settled, s->step, sizeof s->step);
    nn_burnt_hold(rd_grid_full(EDGE), found, C, settled);
    far = 0;
    for (int i = 0; i < VALUES; i++) {
        const double left = (double)s->step[i] * (settles(i % C) ? 1 - (double)found[i / C] : 1);
        far = farther(far, fabs((double)settled[i] - left));
    }
    CHECK(far < 1e-6, "a further step is %g off", far);
    free(settled), free(change), free(burnt), free(s);
    ts_arena_destroy(&arena);
}

/* Neighbours that change by more than a pixel's range leaves do not take it out of the range. */
TEST(burnt_stays_in_the_range_of_maps)
{
    ts_status st = {0};
    ts_arena *arena = ts_arena_create(0, &st);
    scene *s = make();
    for (int i = 0; i < PIXELS * 3; i++) s->image[i] = 1;
    for (int i = 0; i < VALUES; i++) {
        const bool odd = i / C % 2;
        s->mean[i] = s->maps[i] = odd ? 0.95f : 0;
        s->step[i] = odd ? 0 : 0.9f;
    }
    const float *burnt = nn_burnt_find(rd_grid_full(EDGE), s->image, arena);
    CHECK(burnt && nn_burnt_settle(rd_grid_full(EDGE), burnt, s->mean, s->maps, C, arena, s->step), "no memory");
    float most = -1;
    for (int i = 0; i < VALUES; i++) most = fmaxf(most, s->maps[i] + s->step[i]);
    CHECK(most == 1, "the largest is %g", (double)most);
    free(s);
    ts_arena_destroy(&arena);
}

/* A change that is the same everywhere stays, and where nothing is bright every change does. */
TEST(burnt_keeps_what_all_pixels_change)
{
    ts_status st = {0};
    ts_arena *arena = ts_arena_create(0, &st);
    scene *s = make();
    float *before = malloc(sizeof s->step);
    const float *burnt = nn_burnt_find(rd_grid_full(EDGE), s->image, arena);
    CHECK(nn_burnt_any(rd_grid_full(EDGE), s->image), "nothing is burnt out");
    CHECK(!nn_burnt_any((rd_grid){20, 20, 60, 10, EDGE, 1}, s->image), "a dark window is burnt out");
    for (int i = 0; i < VALUES; i++) s->step[i] = s->mean[i] + 0.1f - s->maps[i];
    memcpy(before, s->step, sizeof s->step);
    CHECK(burnt && nn_burnt_settle(rd_grid_full(EDGE), burnt, s->mean, s->maps, C, arena, s->step), "no memory");
    double far = 0;
    for (int i = 0; i < VALUES; i++) far = farther(far, fabs((double)(s->step[i] - before[i])));
    CHECK(far < 1e-6, "a step of all pixels changes by %g", far);
    for (int i = 0; i < PIXELS * 3; i++) s->image[i] = fminf(s->image[i], 0.85f);
    burnt = nn_burnt_find(rd_grid_full(EDGE), s->image, arena);
    CHECK(!nn_burnt_any(rd_grid_full(EDGE), s->image), "a dark photograph is burnt out");
    for (int i = 0; i < PIXELS; i++) CHECK(burnt[i] == 0, "pixel %d of a dark photograph is burnt out", i);
    free(before), free(s);
    ts_arena_destroy(&arena);
}

/* Of a window, away from its edges, the whole's bytes; on any number of threads. */
TEST(burnt_of_a_window)
{
    enum { Y0 = 29, X0 = 33, H = 37, W = 40 };
    ts_status st = {0};
    ts_arena *arena = ts_arena_create(0, &st);
    scene *s = make();
    const rd_grid grid = {H, W, Y0, X0, EDGE, 3};
    const int reach = nn_burnt_reach(EDGE);
    float *image = malloc(sizeof(float) * H * W * 3), *map[3];
    float *const from[3] = {s->mean, s->maps, s->step};
    for (int k = 0; k < 3; k++) map[k] = malloc(sizeof(float) * H * W * C);
    for (int y = 0; y < H; y++) {
        const int at = (Y0 + y) * EDGE + X0;
        memcpy(image + y * W * 3, s->image + at * 3, sizeof(float) * W * 3);
        for (int k = 0; k < 3; k++) memcpy(map[k] + y * W * C, from[k] + at * C, sizeof(float) * W * C);
    }
    const float *all = nn_burnt_find(rd_grid_full(EDGE), s->image, arena), *part = nn_burnt_find(grid, image, arena);
    CHECK(all && part, "no memory");
    CHECK(nn_burnt_settle(rd_grid_full(EDGE), all, s->mean, s->maps, C, arena, s->step) &&
              nn_burnt_settle(grid, part, map[0], map[1], C, arena, map[2]),
          "no memory");
    for (int y = 2 * reach; y < H - 2 * reach; y++) {
        const int at = (Y0 + y) * EDGE + X0;
        CHECK(!memcmp(part + y * W + reach, all + at + reach, sizeof(float) * (size_t)(W - 2 * reach)), "row %d", y);
        CHECK(!memcmp(map[2] + (y * W + 2 * reach) * C, s->step + (at + 2 * reach) * C,
                      sizeof(float) * (size_t)(W - 4 * reach) * C),
              "the step of row %d", y);
    }
    for (int k = 0; k < 3; k++) free(map[k]);
    free(image), free(s);
    ts_arena_destroy(&arena);
}
