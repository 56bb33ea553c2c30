#include "data/materials/darker.h"
#include <math.h>

void cv_darker(io_canvas *c, ts_rng *rng)
{
    const float factor = exp2f(ts_rng_range(rng, -3, 0));
    for (int k = 0; k < 3; k++)
        for (int i = 0; i < c->count; i++) {
            float *v = &c->diffuse[k][i];
            *v = fmaxf(*v * factor, fminf(*v, 0.004f));
        }
}
