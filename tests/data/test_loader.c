/* Materials made in the background. */
#include "data/loader.h"
#include "tests/test.h"
#include <stdlib.h>
#include <string.h>

enum { SIZE = 16, BATCH = 5, FIRST = 3 };

TEST(loader_gives_the_same_batches_for_any_number_of_threads)
{
    io_procedural p = {.seed = 11};
    ts_status st = {0};
    size_t values = (size_t)SIZE * SIZE * MAP_CHANNELS;
    static const int threads[] = {1, 3, 3, 2, 3}, depth[] = {2, 1, 4, 1, 3};
    float *expected = malloc(values * sizeof *expected);
    for (int k = 0; k < 5; k++) {
        const int from = k < 3 ? 0 : k == 3 ? 2 : 4, count = k < 3 ? BATCH : k == 3 ? 2 : 1; /* the whole, and shares */
        io_loader *l = io_loader_create(&p, SIZE, (io_share){BATCH, from, count}, FIRST, depth[k], threads[k], &st);
        CHECK(l, "%s", st.message);
        for (int b = 0; b < 9; b++) {
            const float *maps = io_loader_next(l, &st);
            CHECK(maps, "%s", st.message);
            for (int i = 0; i < count; i++) {
                io_material m = {.size = SIZE, .maps = expected};
                io_procedural_make(&p, (uint64_t)((FIRST + b) * BATCH + from + i), &m);
                CHECK(!memcmp(maps + (size_t)i * values, expected, values * sizeof *expected),
                      "material %d of batch %d differs with %d threads", i, b, threads[k]);
            }
        }
        io_loader_destroy(&l);
        CHECK(!l, "destroy leaves the pointer");
    }
    free(expected);
}

TEST(loader_stops_in_the_middle)
{
    io_procedural p = {.seed = 1};
    ts_status st = {0};
    for (int taken = 0; taken < 6; taken++)
        for (int threads = 1; threads <= 4; threads++) {
            io_loader *l = io_loader_create(&p, 24, (io_share){3, 0, 3}, 0, 1 + taken % 3, threads, &st);
            CHECK(l, "%s", st.message);
            for (int b = 0; b < taken; b++) CHECK(io_loader_next(l, &st), "%s", st.message);
            io_loader_destroy(&l);
        }
    io_loader *none = NULL;
    io_loader_destroy(&none);
}

TEST(loader_refuses_what_makes_no_sense)
{
    io_procedural p = {.seed = 1};
    static const int bad[][4] = {{0, 1, 1, 1}, {8, 0, 1, 1},  {8, 1, 0, 1},
                                 {8, 1, 1, 0}, {-5, 1, 1, 1}, {16384, 2000000000, 1000, 1}};
    static const io_share shares[] = {{4, -1, 2}, {4, 3, 2}, {4, 4, 1}, {4, 0, 0}, {4, 0, 5}};
    for (int i = 0; i < 5; i++) {
        ts_status st = {0};
        CHECK(!io_loader_create(&p, 8, shares[i], 0, 1, 1, &st) && st.message[0], "share %d was taken", i);
    }
    for (int i = 0; i < 6; i++) {
        ts_status st = {0};
        CHECK(!io_loader_create(&p, bad[i][0], (io_share){bad[i][1], 0, bad[i][1]}, 0, bad[i][2], bad[i][3], &st),
              "size %d, batch %d, depth %d, threads %d was taken", bad[i][0], bad[i][1], bad[i][2], bad[i][3]);
        CHECK(st.code != TS_OK && st.message[0], "refused without a message");
    }
}
