/* The batches of a training configuration as bytes, for bench/curve_torch.py. */
#ifndef BENCH_BATCHES_H
#define BENCH_BATCHES_H
#include "tensor/status.h"

/* Writes to standard output, for each step of the configuration's second phase as lgd-train has it, 32-bit floats:
 * images [batch][patch][patch][3], maps [batch][patch][patch][9], and light and camera of each of the loss's views
 * [batch][9][2][3]. */
ts_code bench_batches(const char *config, ts_status *st);
#endif
