#include "nn/lean.h"
#include "tensor/maps.h"
#include <math.h>

void nn_share_lean(int64_t pixels, int channels, float number[RD_SCENE_NUMBERS], float *maps)
{
    const double twice = 2 * (double)RD_FLASH_DISTANCE * exp((double)number[RD_SCENE_DISTANCE]),
                 flash = NN_LEAN_FLASH / twice, share = NN_LEAN * NN_LEAN / (NN_LEAN * NN_LEAN + flash * flash);
    for (int k = 0; k < 2; k++) {
        float *beside = &number[RD_SCENE_LIGHT_X + k];
        const float lean = (float)(-share * (double)RD_SCENE_OFFSET * (double)*beside / twice);
        for (int64_t i = MAP_NORMAL + k; i < pixels * channels; i += channels) {
            const float x = maps[i] + lean;
            maps[i] = x < -1 ? -1 : x < 1 ? x : 1;
        }
        *beside *= (float)(1 - share);
    }
}
