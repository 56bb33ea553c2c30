#include "train/disturb.h"
#include "nn/kind.h"
#include "tensor/maps.h"
#include "tensor/rng.h"
#include <math.h>

/* Standard deviations of the logarithms by which a whole map may be off. */
#define DIFFUSE_OFF 0.2f
#define RELIEF_OFF 0.4f
#define ROUGHNESS_OFF 0.35f
#define F0_OFF 0.45f
#define KIND_SHARE 0.06f /* of the materials that are taken for a metal, or for none */
#define STEEPEST 0.95f

static float value(float x) { return (fminf(fmaxf(x, -1), 1) + 1) / 2; }

void tr_disturb(double share, uint64_t seed, uint64_t index, int side, float *maps)
{
    ts_rng rng = ts_rng_make(seed, TS_STREAM_DISTURB, index);
    if (!((double)ts_rng_uniform(&rng) < share)) return;
    static const float off[MAP_GROUPS] = {DIFFUSE_OFF, RELIEF_OFF, ROUGHNESS_OFF, F0_OFF};
    float by[MAP_GROUPS];
    for (int g = 0; g < MAP_GROUPS; g++) by[g] = expf(off[g] * ts_rng_normal(&rng));
    const int64_t pixels = (int64_t)side * side;
    if (ts_rng_uniform(&rng) < KIND_SHARE)
        nn_change_kind(nn_is_metal(pixels, MAP_CHANNELS, maps), pixels, MAP_CHANNELS, maps);
    for (int64_t i = 0; i < pixels; i++) {
        float *m = maps + i * MAP_CHANNELS;
        for (int k = 0; k < 3; k++) {
            m[MAP_DIFFUSE + k] = map_stored(value(m[MAP_DIFFUSE + k]) * by[GROUP_DIFFUSE]);
            m[MAP_SPECULAR + k] = map_stored(value(m[MAP_SPECULAR + k]) * by[GROUP_SPECULAR]);
        }
        m[MAP_ROUGHNESS] = map_stored(value(m[MAP_ROUGHNESS]) * by[GROUP_ROUGHNESS]);
        for (int k = 0; k < 2; k++)
            m[MAP_NORMAL + k] = fminf(fmaxf(m[MAP_NORMAL + k] * by[GROUP_NORMAL], -STEEPEST), STEEPEST);
    }
}
