/* What the tests of shading share. */
#ifndef TESTS_SHADING_H
#define TESTS_SHADING_H
#include "render/brdf.h"
#include "render/render.h"
#include "tests/test.h"
#include <stdlib.h>

enum { C = MAP_CHANNELS };

static inline double dot3(const double a[3], const double b[3]) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

static inline float *floats(size_t count)
{
    float *p = malloc(count * sizeof *p);
    CHECK(p, "no memory");
    return p;
}

/* The i-th of eleven views: the nine of the training loss, the flash, and one of evaluation, which has
 * ambient light. */
static inline rd_view any_view(ts_rng *rng, int i)
{
    rd_view views[RD_LOSS_VIEWS + 2];
    rd_loss_views(rng, views);
    views[RD_LOSS_VIEWS] = rd_flash();
    rd_eval_views(rng, 1, views + RD_LOSS_VIEWS + 1);
    views[RD_LOSS_VIEWS + 1].ambient = 0.2f;
    return views[i % (RD_LOSS_VIEWS + 2)];
}

static inline void to_double(const float *m, double d[C])
{
    for (int i = 0; i < C; i++) d[i] = (double)m[i];
}
#endif
