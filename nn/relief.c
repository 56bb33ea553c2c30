#include "nn/relief.h"
#include "autograd/log_scale.h"
#include "nn/model.h"
#include "tensor/maps.h"
#include "tensor/team.h"
#include <math.h>

enum { PARTS = 64, WORTH = 4096 }; /* of all pixels; pixels that another thread is worth */

typedef struct relief_job {
    int64_t pixels;
    int channels;
    const float *spread;
    float *maps, factor;
    double *slope, *error; /* [PARTS]: sums */
} relief_job;

static void sum_parts(const void *job, int64_t begin, int64_t end)
{
    const relief_job *j = job;
    for (int64_t part = begin; part < end; part++) {
        double slope = 0, error = 0;
        for (int64_t i = part * j->pixels / PARTS; i < (part + 1) * j->pixels / PARTS; i++) {
            const float *n = j->maps + i * j->channels + MAP_NORMAL;
            slope += (double)sqrtf(n[0] * n[0] + n[1] * n[1]);
            error += (double)(NN_SPREAD_UNIT * expf(ag_log_scale_held(j->spread[i * NN_SPREADS + GROUP_NORMAL])));
        }
        j->slope[part] = slope, j->error[part] = error;
    }
}

static void multiply(const void *job, int64_t begin, int64_t end)
{
    const relief_job *j = job;
    for (int64_t i = begin; i < end; i++)
        for (int k = 0; k < 2; k++) {
            float *n = &j->maps[i * j->channels + MAP_NORMAL + k];
            *n = fminf(fmaxf(*n * j->factor, -1), 1);
        }
}

void nn_weigh_relief(int64_t pixels, int channels, const float *spread, float steeper, int threads, float *maps)
{
    double slopes[PARTS], errors[PARTS], slope = 0, error = 0;
    relief_job j = {pixels, channels, spread, maps, 1, slopes, errors};
    ts_for(threads, PARTS, WORTH * PARTS / (pixels + 1) + 1, sum_parts, &j);
    for (int k = 0; k < PARTS; k++) slope += slopes[k], error += errors[k];
    const float shown = (float)(slope / fmax(error, 1e-30)),
                sure = fminf(fmaxf((shown - NN_RELIEF_NONE) / (NN_RELIEF_SURE - NN_RELIEF_NONE), 0), 1);
    j.factor = sure * steeper;
    if (j.factor != 1) ts_for(threads, pixels, WORTH, multiply, &j);
}
