#include "data/materials/relief.h"

cv_relief cv_draw_relief(io_canvas *c)
{
    cv_relief r = {.gain = 1};
    r.exchanged = cv_chance(c, 0.6f);
    r.gloss = r.exchanged && cv_chance(c, 0.3f);
    if (cv_chance(c, r.exchanged ? 0.4f : 0.8f)) {
        r.waves = cv_log_range(c, 0.03f, 0.3f);
        r.cycles = cv_log_range(c, 1, 7);
    }
    if ((!r.exchanged && r.waves == 0) || cv_chance(c, 0.6f)) r.gain = cv_log_range(c, 0.3f, 2);
    return r;
}

void cv_other_relief(io_canvas *c, const cv_relief *r, const float *height, const float *roughness)
{
    for (int i = 0; r->exchanged && i < c->count; i++) c->height[i] = height[i];
    for (int i = 0; r->gloss && i < c->count; i++) c->roughness[i] = roughness[i];
    for (int i = 0; i < c->count; i++) c->height[i] *= r->gain;
    if (r->waves == 0) return;
    const int mark = c->used;
    const float turns = cv_range(c, 0, 1), stretch = cv_log_range(c, 0.5f, 2);
    const nz_kind kind = cv_chance(c, 0.6f) ? NZ_SMOOTH : cv_chance(c, 0.5f) ? NZ_RIDGED : NZ_BILLOW;
    const float *waves = cv_noise(c, cv_frame(c, 1, stretch, turns), kind, r->cycles, 3, 0.4f);
    cv_raise(c, waves, r->waves / (4.4f * r->cycles)); /* a wave of variance 1 has an RMS slope of 4.4 a cycle */
    cv_drop(c, mark);
}
