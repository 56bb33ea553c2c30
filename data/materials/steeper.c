#include "data/materials/steeper.h"
#include <math.h>

#define LOG_MOST 1.3862944f /* log 4 */

void cv_steeper(io_canvas *c, ts_rng *rng)
{
    const float factor = expf(ts_rng_range(rng, 0, LOG_MOST));
    for (int i = 0; i < c->count; i++) c->height[i] *= factor;
}
