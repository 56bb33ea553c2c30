/* The lattice of a network that makes squares of pixels. */
#include "nn/lattice.h"
#include "tensor/rng.h"
#include "tests/test.h"
#include <math.h>
#include <string.h>

enum { SIDE = 64, C = 3, VALUES = SIDE * SIDE * C, BORDER = 8 };
static float before[VALUES], after[VALUES];

static void take(int period, int threads)
{
    ts_status st = {0};
    ts_arena *arena = ts_arena_create(0, &st);
    memcpy(after, before, sizeof after);
    CHECK(arena && !nn_take_lattice(period, SIDE, C, threads, arena, after, &st), "%s", st.message);
    ts_arena_destroy(&arena);
}

static bool at_border(int i)
{
    const int y = i / C / SIDE, x = i / C % SIDE;
    return y < BORDER || x < BORDER || y >= SIDE - BORDER || x >= SIDE - BORDER;
}

/* Largest difference of after from want, away from the border. */
static double off(const float *want)
{
    double most = 0;
    for (int i = 0; i < VALUES; i++)
        if (!at_border(i)) most = farther(most, fabs((double)(after[i] - want[i])));
    return most;
}

/* What repeats with the squares goes, what rises evenly stays, for even and odd periods. */
TEST(lattice_goes_and_a_slope_stays)
{
    static float slope[VALUES];
    for (int period = 2; period <= 8; period++) {
        float pattern[8 * 8 * C], sum[C] = {0};
        ts_rng rng = ts_rng_make((uint64_t)period, 0, 0);
        for (int i = 0; i < period * period * C; i++) {
            pattern[i] = 0.008f * (ts_rng_uniform(&rng) - 0.5f);
            sum[i % C] += pattern[i];
        }
        double faint = 0;
        for (int i = 0; i < VALUES; i++) {
            const int y = i / C / SIDE, x = i / C % SIDE, c = i % C;
            const float own = pattern[(y % period * period + x % period) * C + c];
            slope[i] = 0.002f * (float)x - 0.003f * (float)y + 0.1f * (float)c;
            before[i] = slope[i] + own - sum[c] / (float)(period * period);
            faint = farther(faint, fabs((double)(before[i] - slope[i])));
        }
        take(period, 2);
        CHECK(faint > 0.002 && off(slope) < 0.15 * faint, "period %d: %g is left of a lattice of %g", period,
              off(slope), faint);
        memcpy(before, slope, sizeof before);
        take(period, 2);
        CHECK(off(slope) < 1e-6, "period %d: a slope was changed by %g", period, off(slope));
    }
}

/* An edge, and a weave with the very period, are of the photograph: neither is changed by more than is seen. */
TEST(lattice_leaves_edges_and_cloth)
{
    for (int cloth = 0; cloth < 2; cloth++) {
        for (int i = 0; i < VALUES; i++) {
            const int x = i / C % SIDE;
            before[i] = cloth ? 0.15f * (float)(x % 4 < 2) : 0.5f * (float)(x >= SIDE / 2 + 1);
        }
        take(4, 1);
        CHECK(off(before) < 0.005, "%s changed by %g", cloth ? "cloth" : "an edge", off(before));
    }
}

/* Noise has no lattice: what is taken of it by chance is little. Its bytes do not depend on threads. */
TEST(lattice_of_noise_is_next_to_nothing)
{
    static float one[VALUES];
    double squares = 0, changed = 0;
    ts_rng rng = ts_rng_make(5, 0, 0);
    for (int i = 0; i < VALUES; i++) before[i] = 0.02f * (ts_rng_uniform(&rng) - 0.5f);
    take(4, 1);
    memcpy(one, after, sizeof one);
    take(4, 3);
    CHECK(memcmp(one, after, sizeof one) == 0, "other bytes with three threads");
    for (int i = 0; i < VALUES; i++) {
        squares += (double)before[i] * (double)before[i];
        changed += ((double)after[i] - (double)before[i]) * ((double)after[i] - (double)before[i]);
    }
    CHECK(sqrt(changed / squares) < 0.25, "%g of the noise was taken", sqrt(changed / squares));
}

static double tap(int period, int k)
{
    const bool half = period % 2 == 0 && (k == -(period / 2) || k == period / 2);
    return (half ? 0.5 : 1) / period;
}

/* What S27 says of one number, with every sum written out. */
static double said(int period, int y, int x, int c)
{
    double weight = 0, weighted = 0, squares = 0;
    for (int v = -3; v <= 3; v++)
        for (int u = -3; u <= 3; u++) {
            const int b = y + v * period, a = x + u * period, reach = period / 2;
            if (b < 0 || a < 0 || b >= SIDE || a >= SIDE) continue;
            squares++;
            if (b < reach || b >= SIDE - reach || a < reach || a >= SIDE - reach) continue;
            double mean = 0;
            for (int k = -reach; k <= reach; k++)
                for (int l = -reach; l <= reach; l++)
                    mean += tap(period, k) * tap(period, l) * (double)before[((b + k) * SIDE + a + l) * C + c];
            const double differ = (double)before[(b * SIDE + a) * C + c] - mean, w = 1 / (1 + pow(differ / 0.02, 2));
            weight += w * w;
            weighted += w * w * differ;
        }
    return (double)before[(y * SIDE + x) * C + c] - weighted / (weight + 0.1 * squares);
}

TEST(lattice_is_what_its_equation_says)
{
    ts_rng rng = ts_rng_make(7, 0, 0);
    for (int i = 0; i < VALUES; i++) before[i] = 0.03f * (ts_rng_uniform(&rng) - 0.5f);
    for (int period = 2; period <= 5; period++) {
        double most = 0;
        take(period, 2);
        for (int i = 0; i < VALUES; i++) {
            const double want = said(period, i / C / SIDE, i / C % SIDE, i % C);
            most = farther(most, fabs(want - (double)after[i]));
        }
        CHECK(most < 1e-6, "period %d: %g from the equation", period, most);
    }
}
