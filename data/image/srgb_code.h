/* The 8-bit codes of sRGB without a power for every value, and the same bytes as with it. */
#ifndef IO_SRGB_CODE_H
#define IO_SRGB_CODE_H
#include <stdint.h>

enum { IO_SRGB_STEPS = 4096 };

typedef struct io_srgb_codes {
    float threshold[257];             /* the least float that io_linear_to_srgb rounds to each code; of 256: infinity */
    float linear[256];                /* io_srgb_to_linear of each */
    uint8_t guess[IO_SRGB_STEPS + 1]; /* the code of the beginning of each of IO_SRGB_STEPS equal parts of 0 .. 1 */
} io_srgb_codes;

/* Made at the first call, for all threads. */
const io_srgb_codes *io_srgb_codes_made(void);

/* Of a linear v in [0, 1]. Thresholds are farther apart than parts, so that a part has one at most. */
static inline unsigned io_srgb_code(const io_srgb_codes *codes, float v)
{
    const unsigned k = codes->guess[(int)(v * IO_SRGB_STEPS)];
    return k + (v >= codes->threshold[k + 1]);
}
#endif
