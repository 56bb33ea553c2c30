/* Adam (Kingma and Ba, ICLR 2015) without weight decay, learning-rate schedule, gradient clipping and EMA, on whole
 * blocks. */
#ifndef NN_ADAM_H
#define NN_ADAM_H
#include "nn/model.h"

typedef struct nn_adam {
    float *m, *v, *ema; /* aligned blocks like the model's; ema NULL when ema_decay is 0 */
    size_t count;
    int64_t step; /* updates made so far; back to 0 (with zero moments) when the set of trained parameters changes */
    float beta1, beta2, epsilon, ema_decay;
} nn_adam;

ts_code nn_adam_create(nn_adam *adam, const nn_model *model, float ema_decay, ts_status *st);
void nn_adam_free(nn_adam *adam);

/* The norm of the gradient block's range [first, last), in double; NaN or infinity when any value is. */
double nn_gradient_norm(const nn_model *model, size_t first, size_t last);

/* One update of [first, last) with gradients multiplied by scale (for clipping), then the gradients are zeroed.
 * nn_adam_next comes first, once for all the ranges of an update. */
void nn_adam_step(const nn_adam *adam, nn_model *model, size_t first, size_t last, float rate, float scale);
void nn_adam_next(nn_adam *adam);

/* Linear warm-up over warmup steps, then a cosine from rate to rate * floor at total. step counts from 0. */
float nn_learning_rate(float rate, float floor, int64_t step, int64_t warmup, int64_t total);
#endif
