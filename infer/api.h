/* What the files behind lgd.h share. */
#ifndef LGD_INFER_API_H
#define LGD_INFER_API_H
#include "infer/lgd.h"
#include "tensor/status.h"
#include <stdbool.h>

enum {
    LGD_SIDE_MAX = 16384, /* 9.7 GB of maps: a larger number is a mistake */
    LGD_THREADS_MAX = 1024,
    LGD_STRUCT_MOST = 4096 /* a struct's larger size is a field that nobody set */
};

/* Copies st into error, which may be NULL. Returns its code. */
int lgd_report(lgd_error *error, const ts_status *st);

/* A struct whose first field is its size where the caller was compiled, in own, size bytes, which has the defaults;
 * given may be NULL. call: the function's name, for messages. least: a size below is none. TS_INVALID; TS_UNSUPPORTED
 * for a field that own does not have. */
ts_code lgd_take_struct(const char *call, const void *given, size_t least, void *own, size_t size, ts_status *st);

/* Whether light and camera stand above the sample, all is finite and the power above 0. */
bool lgd_photo_can_be(const lgd_photo *photo);

/* maps as in lgd.h, [side, side, 9], to the encoding of tensor/maps.h, the same shape. threads: 0: the process's
 * number. */
void lgd_encode(const float *maps, int side, int threads, float *encoded);
#endif
