/* The most multiplications and additions that a core can do, as a yardstick for the benchmarks. */
#ifndef TS_KERNELS_PEAK_H
#define TS_KERNELS_PEAK_H
#include "tensor/kernels/family.h"

struct ts_peak_kernels {
    double (*run)(long rounds);      /* rounds of independent multiply-adds in registers; returns the FLOP done */
    double (*run_bf16)(long rounds); /* the same of tiles of the matrix unit, or of vdpbf16ps; NULL for an instruction
                                        set without them */
};
TS_FAMILY(peak)
#endif
