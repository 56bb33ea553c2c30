/* The estimator: what lgd.h, lgd-infer, lgd-eval and the bench estimate with. It decides the light's power, the number
 * of steps, the tolerance, and whether the photograph is one tile. */
#ifndef LGD_ESTIMATE_H
#define LGD_ESTIMATE_H
#include "infer/lgd.h"
#include "nn/model.h"

typedef struct lgd_estimator {
    const nn_model *net;
    ag_tape *tape; /* without gradients, frozen; it is reset */
    bool encoded;  /* the result is in the encoding of tensor/maps.h, each value clamped to what a map can say; else as
                      infer/lgd.h has it */
    bool g_alone;  /* R_0 is what g says: nothing is fitted to the photograph before the steps, and options.power
                      says that the light's power is not known but is not set. For options.iterations 0 alone. */
    /* Called after R_0 and every step, or NULL. maps: R_t as the network has it, [side][side][channels], valid during
     * the call; false: stop there. The photograph is then one tile, whatever its size; but where a mask or a tolerance
     * asks for several, only R_T is seen. */
    bool (*seen)(int step, const float *maps, int channels, void *user);
    void *user;
} lgd_estimator;

/* As lgd_estimate_photos in infer/lgd.h, with arguments that were checked. maps: [side][side][MAP_CHANNELS]. */
ts_code lgd_estimator_run(const lgd_estimator *e, const lgd_photo *photo, int photos, int side, const lgd_options *o,
                          float *maps, ts_status *st);

/* Bytes that such an estimate of one photograph holds at once, at most, beside it and its maps. Needs no tape. */
double lgd_estimator_bytes(const lgd_estimator *e, int side, const lgd_options *o);
#endif
