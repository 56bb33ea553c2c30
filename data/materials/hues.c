#include "data/materials/hues.h"
#include <math.h>

void cv_other_hues(io_canvas *c, ts_rng *rng)
{
    static const int ways[6][3] = {{0, 1, 2}, {0, 2, 1}, {1, 0, 2}, {1, 2, 0}, {2, 0, 1}, {2, 1, 0}};
    const int *from = ways[ts_rng_int(rng, 6)];
    const float saturation = exp2f(ts_rng_range(rng, -0.737f, 1));
    for (int i = 0; i < c->count; i++) {
        const float v[3] = {c->diffuse[from[0]][i], c->diffuse[from[1]][i], c->diffuse[from[2]][i]};
        const float grey = 0.2126f * v[0] + 0.7152f * v[1] + 0.0722f * v[2];
        /* A colour that is darker or brighter than real albedos (0.004 .. 0.9) stays in the range that it had. */
        const float least = fminf(0.004f, fminf(v[0], fminf(v[1], v[2]))),
                    most = fmaxf(0.9f, fmaxf(v[0], fmaxf(v[1], v[2])));
        for (int k = 0; k < 3; k++) c->diffuse[k][i] = nz_clamp(grey + (v[k] - grey) * saturation, least, most);
    }
}
