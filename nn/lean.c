#include "nn/lean.h"
#include "tensor/maps.h"
#include "tensor/team.h"
#include <math.h>

typedef struct lean_job {
    int channels;
    float lean[2], *maps;
} lean_job;

enum { WORTH = 4096 }; /* pixels that another thread is worth */

static void add_lean(const void *job, int64_t begin, int64_t end)
{
    const lean_job *j = job;
    for (int64_t i = begin; i < end; i++)
        for (int k = 0; k < 2; k++) {
            float *n = &j->maps[i * j->channels + MAP_NORMAL + k];
            const float x = *n + j->lean[k];
            *n = x < -1 ? -1 : x < 1 ? x : 1;
        }
}

void nn_share_lean(int64_t pixels, int channels, int threads, float number[RD_SCENE_NUMBERS], float *maps)
{
    const double twice = 2 * (double)RD_FLASH_DISTANCE * exp((double)number[RD_SCENE_DISTANCE]),
                 flash = NN_LEAN_FLASH / twice, share = NN_LEAN * NN_LEAN / (NN_LEAN * NN_LEAN + flash * flash);
    lean_job j = {.channels = channels, .maps = maps};
    for (int k = 0; k < 2; k++) {
        float *beside = &number[RD_SCENE_LIGHT_X + k];
        j.lean[k] = (float)(-share * (double)RD_SCENE_OFFSET * (double)*beside / twice);
        *beside *= (float)(1 - share);
    }
    ts_for(threads, pixels, WORTH, add_lean, &j);
}
