/* How something is computed: a tape is given one (ag_compute_set), its operations hand it on. */
#ifndef TS_COMPUTE_H
#define TS_COMPUTE_H
#include <stdbool.h>

/* TS_BF16: inputs and weights of products are rounded to bf16, sums stay f32. */
typedef enum ts_precision { TS_F32, TS_BF16, TS_PRECISION_COUNT } ts_precision;

typedef struct ts_compute {
    bool exact;             /* no Winograd, whose rounding errors are about ten times as large */
    ts_precision precision; /* of convolutions and gated units forward; of a convolution's gradients: of the input, and
                               of the weights by Winograd's way or where the CPU multiplies pairs (conv_choose.h); of a
                               gated unit's as tensor/conv/gru.h says */
    int threads;            /* of loops; 0: the process's number (tensor/threads.h) */
} ts_compute;
#endif
