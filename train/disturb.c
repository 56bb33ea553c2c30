#include "train/disturb.h"
#include "tensor/maps.h"
#include "tensor/rng.h"
#include <math.h>
#include <stdbool.h>

/* Standard deviations of the logarithms by which a whole map may be off. */
#define DIFFUSE_OFF 0.2f
#define RELIEF_OFF 0.4f
#define ROUGHNESS_OFF 0.35f
#define F0_OFF 0.45f
#define KIND_SHARE 0.06f /* of the materials that are taken for a metal, or for none */
#define METAL_F0 1.4f    /* as in infer/metal.h */
#define STEEPEST 0.95f

static float encoded(float v) { return 2 * fminf(fmaxf(v, 0), 1) - 1; }
static float value(float x) { return (fminf(fmaxf(x, -1), 1) + 1) / 2; }

/* Metal to dielectric, or the other way. */
static void change_kind(bool metal, float *m)
{
    for (int c = 0; c < 3; c++) {
        const float diffuse = value(m[MAP_DIFFUSE + c]), f0 = value(m[MAP_SPECULAR + c]);
        m[MAP_DIFFUSE + c] = encoded(metal ? diffuse + f0 / METAL_F0 : 0.05f);
        m[MAP_SPECULAR + c] = encoded(metal ? 0.04f : f0 + METAL_F0 * diffuse);
    }
}

static bool is_metal(int64_t pixels, const float *maps)
{
    double more = 0;
    for (int64_t i = 0; i < pixels; i++)
        for (int c = 0; c < 3; c++)
            more += (double)(maps[i * MAP_CHANNELS + MAP_SPECULAR + c] - maps[i * MAP_CHANNELS + MAP_DIFFUSE + c]);
    return more > 0;
}

void tr_disturb(double share, uint64_t seed, uint64_t index, int side, float *maps)
{
    ts_rng rng = ts_rng_make(seed, TS_STREAM_DISTURB, index);
    if (!((double)ts_rng_uniform(&rng) < share)) return;
    static const float off[MAP_GROUPS] = {DIFFUSE_OFF, RELIEF_OFF, ROUGHNESS_OFF, F0_OFF};
    float by[MAP_GROUPS];
    for (int g = 0; g < MAP_GROUPS; g++) by[g] = expf(off[g] * ts_rng_normal(&rng));
    const int64_t pixels = (int64_t)side * side;
    const bool other = ts_rng_uniform(&rng) < KIND_SHARE, metal = other && is_metal(pixels, maps);
    for (int64_t i = 0; i < pixels; i++) {
        float *m = maps + i * MAP_CHANNELS;
        if (other) change_kind(metal, m);
        for (int k = 0; k < 3; k++) {
            m[MAP_DIFFUSE + k] = encoded(value(m[MAP_DIFFUSE + k]) * by[GROUP_DIFFUSE]);
            m[MAP_SPECULAR + k] = encoded(value(m[MAP_SPECULAR + k]) * by[GROUP_SPECULAR]);
        }
        m[MAP_ROUGHNESS] = encoded(value(m[MAP_ROUGHNESS]) * by[GROUP_ROUGHNESS]);
        for (int k = 0; k < 2; k++)
            m[MAP_NORMAL + k] = fminf(fmaxf(m[MAP_NORMAL + k] * by[GROUP_NORMAL], -STEEPEST), STEEPEST);
    }
}
