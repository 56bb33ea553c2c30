#include "tensor/cpu.h"
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>
#if defined(__x86_64__)
#include <cpuid.h>
#include <stdbool.h>
#if defined(__linux__)
#include <sys/syscall.h>
#include <unistd.h>
#endif
#endif

static const char *const names[TS_ISA_COUNT] = {"base", "avx2", "avx512", "avx512bf16", "amx"};

#if defined(__x86_64__)
/* XCR0: which register files the operating system saves (Intel SDM vol. 1, 13.3). */
static unsigned xcr0(void)
{
    unsigned lo, hi;
    __asm__ volatile("xgetbv" : "=a"(lo), "=d"(hi) : "c"(0));
    return lo;
}

/* Linux saves the 8 KiB of a thread's tiles only for processes that ask for it (Documentation/arch/x86/xstate.rst).
 * Holds for all threads. */
static bool may_use_tiles(void)
{
#if defined(__linux__)
    enum {
        REQUEST_PERMISSION = 0x1023,
        TILE_DATA = 18
    }; /* ARCH_REQ_XCOMP_PERM, which older headers lack, and XFEATURE_XTILEDATA */
    return syscall(SYS_arch_prctl, REQUEST_PERMISSION, TILE_DATA) == 0;
#else
    return false;
#endif
}

static ts_isa detect(void)
{
    unsigned a, b, c, d;
    if (!__get_cpuid(1, &a, &b, &c, &d)) return TS_BASE;
    const unsigned osxsave = 1u << 27, avx = 1u << 28, fma = 1u << 12;
    if ((c & (osxsave | avx | fma)) != (osxsave | avx | fma)) return TS_BASE;
    const unsigned saved = xcr0();
    if ((saved & 0x6) != 0x6) return TS_BASE; /* xmm and ymm */
    if (!__get_cpuid_count(7, 0, &a, &b, &c, &d)) return TS_BASE;
    const unsigned avx2 = 1u << 5, bmi2 = 1u << 8;
    if ((b & (avx2 | bmi2)) != (avx2 | bmi2)) return TS_BASE;
    const unsigned f = 1u << 16, dq = 1u << 17, bw = 1u << 30, vl = 1u << 31;
    if ((b & (f | dq | bw | vl)) != (f | dq | bw | vl)) return TS_AVX2;
    if ((saved & 0xe6) != 0xe6) return TS_AVX2; /* mask registers and zmm */
    const unsigned bf16 = 1u << 5, tiles_bf16 = 1u << 22, tiles = 1u << 24, amx = d;
    if (!__get_cpuid_count(7, 1, &a, &b, &c, &d) || !(a & bf16)) return TS_AVX512;
    if ((amx & (tiles_bf16 | tiles)) != (tiles_bf16 | tiles) || (saved & 0x60000) != 0x60000 || !may_use_tiles())
        return TS_AVX512BF16;
    return TS_AMX;
}
#else
static ts_isa detect(void) { return TS_BASE; }
#endif

static atomic_int best = -1, now = -1;

ts_isa ts_isa_best(void)
{
    int b = atomic_load_explicit(&best, memory_order_relaxed);
    if (b < 0) atomic_store(&best, b = (int)detect());
    return (ts_isa)b;
}

ts_isa ts_isa_now(void)
{
    int n = atomic_load_explicit(&now, memory_order_relaxed);
    if (n < 0) {
        ts_isa_init(NULL);
        n = atomic_load(&now);
        if (n < 0) atomic_store(&now, n = (int)ts_isa_best());
    }
    return (ts_isa)n;
}

void ts_isa_use(ts_isa isa) { atomic_store(&now, (int)isa); }
const char *ts_isa_name(ts_isa isa) { return names[isa]; }

ts_code ts_isa_init(ts_status *st)
{
    const char *want = getenv("LGD_ISA");
    if (!want || !*want) {
        ts_isa_use(ts_isa_best());
        return TS_OK;
    }
    for (int i = 0; i < TS_ISA_COUNT; i++)
        if (!strcmp(want, names[i])) {
            if (i > (int)ts_isa_best())
                return ts_fail(st, TS_INVALID,
                               "LGD_ISA=%s: this CPU or its system has no more than %s; unset it or use that", want,
                               names[ts_isa_best()]);
            ts_isa_use((ts_isa)i);
            return TS_OK;
        }
    return ts_fail(st, TS_INVALID, "LGD_ISA=%s is not an instruction set; use base, avx2, avx512, avx512bf16 or amx",
                   want);
}
