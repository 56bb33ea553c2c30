#include "data/materials/relief.h"

cv_relief cv_draw_relief(io_canvas *c)
{
    cv_relief r = {.gain = 1};
    r.exchanged = cv_chance(c, 0.6f);
    r.gloss = r.exchanged && cv_chance(c, 0.3f);
    if (r.exchanged && cv_chance(c, 0.7f)) {
        r.shape = cv_log_range(c, 0.01f, 0.03f);
        r.steeper = cv_log_range(c, 0.7f, 3);
    }
    if (cv_chance(c, r.exchanged ? 0.4f : 0.8f)) {
        r.waves = cv_log_range(c, 0.03f, 0.3f);
        r.cycles = cv_log_range(c, 1, 7);
    }
    if ((!r.exchanged && r.waves == 0) || cv_chance(c, 0.6f)) r.gain = cv_log_range(c, 0.3f, 2);
    return r;
}

/* Its own where it is broad, the other's where it is fine. */
static void mean_of_both(io_canvas *c, const cv_relief *r, const float *height)
{
    const int mark = c->used, pixels = (int)(r->shape * (float)c->size + 0.5f), radius = pixels < 1 ? 1 : pixels;
    float *own = cv_plane(c), *other = cv_plane(c), *work = cv_plane(c);
    nz_blur(c->size, radius, c->height, own, work);
    nz_blur(c->size, radius, height, other, work);
    for (int i = 0; i < c->count; i++) c->height[i] = r->steeper * own[i] + height[i] - other[i];
    cv_drop(c, mark);
}

void cv_other_relief(io_canvas *c, const cv_relief *r, const float *height, const float *roughness)
{
    if (r->shape > 0) mean_of_both(c, r, height);
    else
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
