#include "nn/kind.h"
#include "tensor/maps.h"
#include <math.h>

#define DIFFUSE_OF_METAL 0.05f
#define F0_OF_PLASTIC 0.04f

static float encoded(float v) { return 2 * fminf(fmaxf(v, 0), 1) - 1; }

bool nn_is_metal(int64_t pixels, int channels, const float *maps)
{
    double more = 0;
    for (int64_t i = 0; i < pixels; i++, maps += channels)
        for (int c = 0; c < 3; c++) more += (double)maps[MAP_SPECULAR + c] - (double)maps[MAP_DIFFUSE + c];
    return more > 0;
}

void nn_change_kind(bool metal, int64_t pixels, int channels, float *maps)
{
    for (int64_t i = 0; i < pixels; i++, maps += channels)
        for (int c = 0; c < 3; c++) {
            const float diffuse = (maps[MAP_DIFFUSE + c] + 1) / 2, f0 = (maps[MAP_SPECULAR + c] + 1) / 2;
            maps[MAP_DIFFUSE + c] = encoded(metal ? diffuse + f0 / NN_METAL_F0 : DIFFUSE_OF_METAL);
            maps[MAP_SPECULAR + c] = encoded(metal ? F0_OF_PLASTIC : f0 + NN_METAL_F0 * diffuse);
        }
}
