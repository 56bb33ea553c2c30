/* First values of the parameters. Every parameter draws from a stream of its own, named by the parameter, so that a
 * change elsewhere in the architecture leaves it alone. */
#include "nn/layers.h"
#include "tensor/rng.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* FNV-1a, 64 bits (Fowler, Noll, Vo; draft-eastlake-fnv). */
static uint64_t name_hash(const char *name)
{
    uint64_t h = 0xcbf29ce484222325u;
    for (; *name; name++) h = (h ^ (unsigned char)*name) * 0x100000001b3u;
    return h;
}

/* Fills the n x n matrix a with random orthonormal rows: Gram-Schmidt in double on normal numbers, twice, which is
 * enough for the rows to be orthogonal to rounding (Giraud et al., "On the round-off error analysis of the Gram-Schmidt
 * algorithm", 2005). */
static void orthogonal(ts_rng *rng, int n, float *a)
{
    for (int i = 0; i < n; i++) {
        float *row = a + (size_t)i * n;
        double length;
        do {
            for (int j = 0; j < n; j++) row[j] = ts_rng_normal(rng);
            for (int pass = 0; pass < 2; pass++)
                for (int k = 0; k < i; k++) {
                    const float *done = a + (size_t)k * n;
                    double dot = 0;
                    for (int j = 0; j < n; j++) dot += (double)row[j] * done[j];
                    for (int j = 0; j < n; j++) row[j] = (float)(row[j] - dot * done[j]);
                }
            length = 0;
            for (int j = 0; j < n; j++) length += (double)row[j] * row[j];
            length = sqrt(length);
        } while (length <
                 1e-3); /* nearly dependent on the rows before: what is left of it is rounding, so draw again */
        for (int j = 0; j < n; j++) row[j] = (float)(row[j] / length);
    }
}

void nn_model_init(nn_model *model, uint64_t seed)
{
    const nn_layers *l = model->layers;
    memset(model->value, 0,
           model->count * sizeof *model->value); /* padding included: saved blocks hold the same bytes */
    for (int i = 0; i < model->params; i++) {
        const nn_param *p = &model->param[i];
        float *v = model->value + p->offset;
        ts_rng rng = ts_rng_make(seed, TS_STREAM_INIT, name_hash(p->name));
        if (l->start[i] == NN_ORTHOGONAL) {
            int n = p->dim[1]; /* one n x n matrix for each gate */
            for (int gate = 0; gate < p->dim[0] / n; gate++) orthogonal(&rng, n, v + (size_t)gate * n * n);
        } else if (l->start[i] == NN_DESCENT_START) {
            const int channels = p->dim[0], images = p->dim[1] / channels;
            for (int j = 0; j < p->dim[1]; j++)
                v[(size_t)(j % channels) * (size_t)p->dim[1] + (size_t)j] = -0.003f / (float)images;
        } else if (l->start[i] == NN_NEWTON_START) {
            for (int j = 0; j < p->dim[0]; j++) v[j * p->dim[1] + j] = 0.5f;
        } else if (l->start[i] > 0) {
            for (size_t j = 0; j < p->count; j++) v[j] = (float)(l->start[i] * ts_rng_normal(&rng));
        }
    }
}
