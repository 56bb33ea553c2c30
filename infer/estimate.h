/* One estimate: g, the light's power, and the unrolled loop, whole or in tiles. */
#ifndef LGD_ESTIMATE_H
#define LGD_ESTIMATE_H
#include "infer/lgd.h"
#include "nn/model.h"

/* What an estimate is made with. The tape has no gradients, is frozen, and is reset. */
typedef struct lgd_estimator {
    const nn_model *net;
    ag_tape *tape;
} lgd_estimator;

/* As lgd_estimate_photos in infer/lgd.h, with arguments that were checked and a tolerance that is not the usual one;
 * threads, exact and precision are the calling thread's (tensor/threads.h, tensor/conv/conv.h), not those of options.
 */
ts_code lgd_estimator_run(const lgd_estimator *e, const lgd_photo *photo, int photos, int side, const lgd_options *o,
                          float *maps, ts_status *st);
#endif
