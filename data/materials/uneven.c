#include "data/materials/uneven.h"
#include <math.h>

void cv_uneven(io_canvas *c)
{
    const float slope = cv_log_range(c, 0.01f, 0.2f), angle = cv_range(c, 0, 6.2831853f);
    const float right = slope * cosf(angle), up = slope * sinf(angle);
    for (int i = 0; i < c->count; i++) c->height[i] += right * c->x[i] + up * c->y[i];
    if (!cv_chance(c, 0.5f)) return;
    const int mark = c->used;
    const float steep = cv_log_range(c, 0.01f, 0.15f), cycles = cv_log_range(c, 0.3f, 2);
    const float stretch = cv_log_range(c, 0.5f, 2), turns = cv_range(c, 0, 1);
    const float *waves = cv_noise(c, cv_frame(c, 1, stretch, turns), NZ_SMOOTH, cycles, 2, 0.3f);
    cv_raise(c, waves, steep / (4.4f * cycles)); /* a wave of variance 1 has an RMS slope of 4.4 a cycle */
    cv_drop(c, mark);
}
