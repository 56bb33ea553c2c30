/* Products of bf16 matrices by the CPU's matrix unit (Intel AMX: eight tiles of 16 rows of 64 bytes, and TDPBF16PS;
 * Intel 64 and IA-32 Architectures Software Developer's Manual vol. 1, chapter 18). product is NULL for an instruction
 * set without one. Denormals count as zeros, sums are f32. */
#ifndef TS_AMX_CONV_H
#define TS_AMX_CONV_H
#include "tensor/kernels/family.h"
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum {
    TS_AMX_SIDE = 16,              /* rows and columns of a tile of sums */
    TS_AMX_PAIRS = 16,             /* a step multiplies so many pairs of neighbouring k */
    TS_AMX_BLOCK = 2 * TS_AMX_SIDE /* rows and columns of the largest product */
};

/* c[m][n] (+)= sum over steps s and pairs i of a[m][s, 2i] b[s, 2i][n] + a[m][s, 2i + 1] b[s, 2i + 1][n], a pair of
 * bf16 values being kept where a float would be, the even one in the low half. */
typedef struct ts_amx_product {
    const void *a;
    const float *b;
    const ptrdiff_t *a_at; /* row m of a at step s: a + m a_row + a_at[s], in bytes */
    ptrdiff_t a_row;
    ptrdiff_t b_row; /* pair i of step s: b + (s 16 + i) b_row, a float for each column */
    int steps;
    float *c;
    ptrdiff_t c_row;
    bool add;
} ts_amx_product;

struct ts_amx_kernels {
    void (*begin)(void); /* on the thread that is to multiply */
    void (*end)(void);   /* gives the tiles back: until then the system saves them at every switch */
    /* [rows > 16][columns > 16]: all 16 or 32 of both are read and written. */
    void (*product[2][2])(const ts_amx_product *m);
    /* y[p y_row + o] = act(c[p c_row + o] + bias[o] + base[p y_row + o]), act as in tensor/conv/conv.h; bias and base
     * may be NULL, base may be y. */
    void (*finish)(const float *c, ptrdiff_t c_row, int pixels, int channels, const float *bias, const float *base,
                   float leak, float *y, ptrdiff_t y_row);
    /* to[c plane + p] = x[p x_row + c] and to[i to_row + c] = x[2i x_row + c], x[(2i + 1) x_row + c], as the nearest
     * bf16; behind an odd last pixel a zero. The second writes zeros for c up to a multiple of 16. */
    void (*planes)(const float *x, ptrdiff_t x_row, int pixels, int channels, uint16_t *to, ptrdiff_t plane);
    void (*pixel_pairs)(const float *x, ptrdiff_t x_row, int pixels, int channels, float *to, ptrdiff_t to_row);
};
TS_FAMILY(amx)
#endif
