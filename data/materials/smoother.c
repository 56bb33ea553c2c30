#include "data/materials/smoother.h"
#include <math.h>

#define LOG_LEAST -0.8f /* log .45 */

void cv_smoother(io_canvas *c, ts_rng *rng)
{
    const float factor = expf(ts_rng_range(rng, LOG_LEAST, 0));
    for (int i = 0; i < c->count; i++) c->roughness[i] = factor * fminf(c->roughness[i], 1); /* the maps end at 1 */
}
