#include "nn/deviation.h"
#include "autograd/log_scale.h"
#include "tensor/kernels/vmath_arrays.h"
#include "tensor/maps.h"
#include "tensor/team.h"
#include <math.h>

enum { PIXELS = 1 << 11 }; /* at a time, at least */

/* Of F0's error, the part that a pixel may change by itself. What is not a level of the whole material is .35 of it; of
 * that, highlights leave the more in F0 the more is believed, and renderings do not tell .35 from .2. Several
 * photographs tell the level too, until h has found it from them. */
#define F0_DETAIL 0.2f
/* The same of the roughness once its level is found with the scene: highlights that a photograph cannot explain
 * otherwise leave disks and dots in it. */
#define ROUGHNESS_DETAIL 0.5f
/* The same of the normals: with the whole, one photograph's steps take them farther from the truth than R_0's are,
 * since what they read as slopes is often colour or gloss. */
#define NORMAL_DETAIL 0.5f
/* By which the deviations are multiplied at most where several photographs follow, and how much more it is for each
 * beyond the second. Much of R_0's error is one of the whole material, and of that the mean absolute error of a pixel
 * says too little; two photographs do not tell it. */
#define SEVERAL 1.5f
#define EACH_MORE 0.166666667f
/* By which they are multiplied after a revision: what h has read is not believed twice. What is finer than its pixels
 * it has not read. */
#define REVISED 0.5f

typedef struct job {
    const float *spread;
    float *to, factor[NN_SPREADS];
} job;

static void deviations(const void *of, int64_t begin, int64_t end)
{
    const job *j = of;
    const int64_t first = begin * NN_SPREADS, last = end * NN_SPREADS;
    for (int64_t i = first; i < last; i++) j->to[i] = ag_log_scale_held(j->spread[i]);
    ts_vmath_arrays_k()->exp(last - first, j->to + first, j->to + first);
    float factor[NN_SPREADS];
    for (int k = 0; k < NN_SPREADS; k++) factor[k] = j->factor[k] * NN_LAPLACE * NN_SPREAD_UNIT;
    for (int64_t i = begin; i < end; i++)
        for (int k = 0; k < NN_SPREADS; k++) j->to[i * NN_SPREADS + k] *= factor[k];
}

static float for_all_maps(nn_belief b)
{
    const float several = b.photographs > 1 ? fminf(1 + EACH_MORE * (float)(b.photographs - 2), SEVERAL) : 1;
    return several * (b.revised && !b.finer ? REVISED : 1);
}

void nn_deviations(int64_t pixels, const float *spread, nn_belief b, int threads, float *deviation)
{
    const bool several = b.photographs > 1, levels = several && b.revised;
    const float all = for_all_maps(b),
                factor[NN_SPREADS] = {[GROUP_NORMAL] = 1,
                                      [GROUP_DIFFUSE] = 1,
                                      [GROUP_ROUGHNESS] = levels ? ROUGHNESS_DETAIL : 1,
                                      [GROUP_SPECULAR] = several && !levels ? 1 : F0_DETAIL};
    job j = {.spread = spread, .to = deviation};
    for (int k = 0; k < NN_SPREADS; k++) j.factor[k] = all * factor[k];
    ts_for(threads, pixels, PIXELS, deviations, &j);
}

static void narrow(const void *of, int64_t begin, int64_t end)
{
    float *const *deviation = of;
    for (int64_t i = begin * NN_SPREADS; i < end * NN_SPREADS; i += NN_SPREADS) {
        (*deviation)[i + GROUP_NORMAL] *= NORMAL_DETAIL;
        (*deviation)[i + GROUP_ROUGHNESS] *= ROUGHNESS_DETAIL;
    }
}

void nn_deviations_of_found_scene(int64_t pixels, int threads, float *deviation)
{
    ts_for(threads, pixels, PIXELS, narrow, &(float *){deviation});
}
