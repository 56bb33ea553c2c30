/* Estimates with a model that others may be using, for programs: what lgd_estimate_photos of infer/lgd.h does, with a
 * ts_status. */
#ifndef LGD_API_MODEL_H
#define LGD_API_MODEL_H
#include "infer/lgd.h"
#include "tensor/status.h"
#include <stdbool.h>
#include <stdint.h>

/* Checks the arguments. encoded: maps are in the encoding of tensor/maps.h (infer/estimate.h), else as infer/lgd.h has
 * them. */
ts_code lgd_model_estimate(lgd_model *model, const lgd_photo *photo, int photos, int side, const lgd_options *options,
                           bool encoded, float *maps, ts_status *st);

/* Whether these weights can do what the options ask for: sample, mask, tolerance and iterations. TS_UNSUPPORTED. */
ts_code lgd_model_takes(const lgd_model *model, const lgd_options *options, ts_status *st);

/* "assumed: " or "estimated: ": what was done about a field of view that is not known, by where the photograph was
 * taken at last. */
const char *lgd_fov_assumption(const lgd_photo *taken);

/* Bytes that such an estimate of one photograph, or of as many as g reads, holds at once, at most, beside its
 * photographs and maps. */
double lgd_model_bytes(const lgd_model *model, int side, const lgd_options *options);

/* Of the bytes of its weights' file (tensor/hash.h). */
uint64_t lgd_model_hash(const lgd_model *model);

/* Called before any estimate: there will be a single one. Its packed weights of g are not kept. */
void lgd_model_single(lgd_model *model);
#endif
