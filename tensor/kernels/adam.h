/* One Adam update of n values (Kingma and Ba, ICLR 2015, section 2, "alpha_t" form), the average of the weights, and
 * the norm. */
#ifndef TS_ADAM_H
#define TS_ADAM_H
#include "tensor/kernels/family.h"
#include <stddef.h>

struct ts_adam_kernels {
    /* m = beta1 m + (1 - beta1) G, v = beta2 v + (1 - beta2) G^2, p -= rate_corrected m / (sqrt(v) +
     * epsilon_corrected), G = grad_scale g. At update t = 1, 2, …: rate_corrected = rate sqrt(1 - beta2^t) / (1 -
     * beta1^t), epsilon_corrected = epsilon sqrt(1 - beta2^t). */
    void (*step)(size_t n, float *p, const float *g, float *m, float *v, float beta1, float beta2, float rate_corrected,
                 float epsilon_corrected, float grad_scale);
    double (*sum_of_squares)(size_t n, const float *x);                 /* each square and their sum in double */
    void (*average)(size_t n, float *ema, const float *p, float decay); /* ema += (1 - decay) (p - ema) */
};
TS_FAMILY(adam)

/* The same in plain C, for tests. */
extern const struct ts_adam_kernels ts_adam_naive;
#endif
