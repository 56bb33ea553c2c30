/* Counter-based random numbers (Philox 4x32-10; Salmon et al., "Parallel Random Numbers: As Easy as 1, 2, 3", SC 2011):
 * a stream is a function of (seed, stream, index), so that any thread can make any part of it. */
#ifndef TS_RNG_H
#define TS_RNG_H
#include <stdint.h>

typedef struct ts_rng {
    uint32_t key[2], counter[4], block[4];
    int left; /* values of block not yet given out */
} ts_rng;

/* Independent sequences for different (seed, stream, index); stream names the purpose (TS_STREAM_...). */
ts_rng ts_rng_make(uint64_t seed, uint32_t stream, uint64_t index);

enum {
    TS_STREAM_INIT = 1,
    TS_STREAM_MATERIAL,
    TS_STREAM_SCENE,
    TS_STREAM_CAMERA,
    TS_STREAM_TEST,
    TS_STREAM_EVAL,
    TS_STREAM_TRAIN,
    TS_STREAM_WINDOW,
    TS_STREAM_PHOTOGRAPH,
    TS_STREAM_CAPTURE,
    TS_STREAM_PHONE,
    TS_STREAM_KNOWN,
    TS_STREAM_HUES,
    TS_STREAM_SHEET,
    TS_STREAM_RELIEF,
    TS_STREAM_WINDOWS, /* under a printed sheet */
    TS_STREAM_BLEND,
    TS_STREAM_UNEVEN, /* materials that do not lie flat */
    TS_STREAM_DISTURB,
    TS_STREAM_HOMOGENEOUS,
    TS_STREAM_CLOSER,
    TS_STREAM_DARKER,
    TS_STREAM_LESSON,
    TS_STREAM_COLLECTED, /* parts of map sets */
    TS_STREAM_PLAIN,
    TS_STREAM_SMOOTHER,
    TS_STREAM_GIVEN, /* how many photographs of a material */
    TS_STREAM_STEEPER
};

uint32_t ts_rng_u32(ts_rng *r);
float ts_rng_uniform(ts_rng *r);                       /* [0, 1), 24 bits */
float ts_rng_range(ts_rng *r, float lo, float hi);     /* [lo, hi) */
int ts_rng_int(ts_rng *r, int n);                      /* 0 .. n-1, n >= 1, unbiased to 2^-32 */
float ts_rng_normal(ts_rng *r);                        /* mean 0, standard deviation 1 (Box-Muller in double) */
void ts_rng_normals(ts_rng *r, int64_t n, float *out); /* the next n of them, within 3e-4 and several times as fast; the
                                                          same bytes on every instruction set */
#endif
