/* The instruction sets that the CPU and the operating system both allow, and the one in use. */
#ifndef TS_CPU_H
#define TS_CPU_H
#include "tensor/status.h"

typedef enum ts_isa { TS_BASE = 0, TS_AVX2 = 1, TS_AVX512 = 2, TS_AVX512BF16 = 3, TS_AMX = 4, TS_ISA_COUNT = 5 } ts_isa;

/* Reads LGD_ISA (base, avx2, avx512, avx512bf16, amx) once and fixes the choice. TS_INVALID for another word or for
 * more than the CPU has. Every main calls it first; without the call the first kernel uses the best that is there and
 * ignores LGD_ISA's errors. */
ts_code ts_isa_init(ts_status *st);

ts_isa ts_isa_best(void);    /* what the CPU and the system allow */
ts_isa ts_isa_now(void);     /* what is in use */
void ts_isa_use(ts_isa isa); /* for tests and benchmarks: isa <= ts_isa_best() */
const char *ts_isa_name(ts_isa isa);
#endif
