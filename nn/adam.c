#include "nn/adam.h"
#include "tensor/kernels/adam.h"
#include "tensor/memory.h"
#include "tensor/team.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { CHUNK = 1 << 14, PARTS = 256 }; /* fixed, so that sums do not depend on the number of threads */

static float *aligned(size_t count)
{
    float *p = ts_memory(count * sizeof *p); /* a block's count is a multiple of 16 */
    if (p) memset(p, 0, count * sizeof *p);
    return p;
}

ts_code nn_adam_create(nn_adam *adam, const nn_model *model, float ema_decay, ts_status *st)
{
    *adam = (nn_adam){.count = model->count, .beta1 = 0.9f, .beta2 = 0.999f, .epsilon = 1e-8f, .ema_decay = ema_decay};
    adam->m = aligned(model->count);
    adam->v = aligned(model->count);
    if (ema_decay > 0) adam->ema = aligned(model->count);
    if (!adam->m || !adam->v || (ema_decay > 0 && !adam->ema)) {
        nn_adam_free(adam);
        return ts_fail(st, TS_NOMEM, "no memory for Adam's moments (%.0f MB)",
                       (double)model->count * sizeof(float) * 2e-6);
    }
    if (adam->ema) memcpy(adam->ema, model->value, model->count * sizeof *adam->ema);
    return TS_OK;
}

void nn_adam_free(nn_adam *adam)
{
    free(adam->m);
    free(adam->v);
    free(adam->ema);
    *adam = (nn_adam){0};
}

typedef struct norm_job {
    const float *grad;
    size_t first, last, each;
    double *part;
} norm_job;

static void squares_of_parts(const void *job, int64_t begin, int64_t end)
{
    const norm_job *j = job;
    for (int64_t p = begin; p < end; p++) {
        const size_t from = j->first + (size_t)p * j->each, to = from + j->each < j->last ? from + j->each : j->last;
        j->part[p] = from < to ? ts_adam_k()->sum_of_squares(to - from, j->grad + from) : 0;
    }
}

double nn_gradient_norm(const nn_model *model, size_t first, size_t last)
{
    double part[PARTS], sum = 0;
    size_t each = ((last - first) / PARTS + 16) / 16 * 16;
    ts_for(0, PARTS, 1, squares_of_parts, &(norm_job){model->grad, first, last, each, part});
    for (int p = 0; p < PARTS; p++) sum += part[p];
    return sqrt(sum);
}

float nn_learning_rate(float rate, float floor, int64_t step, int64_t warmup, int64_t total)
{
    if (step < warmup) return (float)(rate * (double)(step + 1) / (double)warmup);
    if (step >= total) return rate * floor;
    double at = (double)(step - warmup) / (double)(total - warmup);
    return (float)(rate * (floor + (1 - floor) * 0.5 * (1 + cos(3.14159265358979323846 * at))));
}

void nn_adam_next(nn_adam *adam) { adam->step++; }

typedef struct step_job {
    const nn_adam *adam;
    nn_model *model;
    size_t first;
    float corrected, epsilon, scale, decay;
} step_job;

static void step_range(const void *job, int64_t begin, int64_t end)
{
    const step_job *j = job;
    const nn_adam *adam = j->adam;
    for (size_t at = j->first + (size_t)begin, last = j->first + (size_t)end; at < last; at += CHUNK) {
        const size_t count = last - at < CHUNK ? last - at : CHUNK; /* which stays in the cache */
        float *value = j->model->value + at, *grad = j->model->grad + at;
        ts_adam_k()->step(count, value, grad, adam->m + at, adam->v + at, adam->beta1, adam->beta2, j->corrected,
                          j->epsilon, j->scale);
        if (adam->ema) ts_adam_k()->average(count, adam->ema + at, value, j->decay);
        memset(grad, 0, count * sizeof *grad);
    }
}

void nn_adam_step(const nn_adam *adam, nn_model *model, size_t first, size_t last, float rate, float scale)
{
    /* The moments start at zero, which the corrections make up for (Kingma and Ba, section 3). The average's memory is
     * short at first, so that the first weights are soon forgotten. */
    double n = (double)adam->step, root = sqrt(1 - pow(adam->beta2, n)), ramp = (1 + n) / (10 + n);
    float corrected = (float)(rate * root / (1 - pow(adam->beta1, n))), epsilon = (float)(adam->epsilon * root);
    float decay = ramp < adam->ema_decay ? (float)ramp : adam->ema_decay;
    ts_for(0, (int64_t)(last - first), CHUNK, step_range,
           &(step_job){adam, model, first, corrected, epsilon, scale, decay});
}
