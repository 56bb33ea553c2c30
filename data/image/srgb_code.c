#include "data/image/srgb_code.h"
#include "data/image/image.h"
#include <math.h>
#include <pthread.h>

#define NEAR 1e-5f /* relative: farther from its equation no threshold is looked for at first */

static pthread_once_t once = PTHREAD_ONCE_INIT;
static io_srgb_codes codes;

static unsigned code_of(float v) { return (unsigned)(io_linear_to_srgb(v) * 255 + 0.5f); }

static void make(void)
{
    codes.threshold[256] = INFINITY;
    for (unsigned k = 1; k < 256; k++) {
        const float near = io_srgb_to_linear(((float)k - 0.5f) / 255);
        float below = near * (1 - NEAR), at = near * (1 + NEAR);
        if (code_of(below) >= k || code_of(at) < k) below = codes.threshold[k - 1], at = 1;
        for (;;) {
            const float middle = below + (at - below) * 0.5f;
            if (middle <= below || middle >= at) break;
            if (code_of(middle) >= k) at = middle;
            else below = middle;
        }
        codes.threshold[k] = at;
    }
    for (int k = 0; k < 256; k++) codes.linear[k] = io_srgb_to_linear((float)k / 255);
    for (int i = 0, k = 0; i <= IO_SRGB_STEPS; i++) {
        while (codes.threshold[k + 1] <= (float)i / IO_SRGB_STEPS) k++;
        codes.guess[i] = (uint8_t)k;
    }
}

const io_srgb_codes *io_srgb_codes_made(void)
{
    pthread_once(&once, make);
    return &codes;
}
