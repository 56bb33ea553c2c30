#include "tensor/kernels/amx_conv.h"
#include "tensor/kernels/transpose.h"
#include "tensor/kernels/vec.h"

#if defined(__AMX_BF16__)
#include "tensor/kernels/amx.h"

/* Tiles 0 .. 3 are sums, 4 and 5 rows of a, 6 and 7 columns of b. Their numbers are part of the instructions, so that
 * this cannot be a loop. */
#define PRODUCT(name, tall, wide)                                                        \
    static void name(const ts_amx_product *m)                                            \
    {                                                                                    \
        const size_t a_row = (size_t)m->a_row, b_row = (size_t)m->b_row * sizeof(float), \
                     c_row = (size_t)m->c_row * sizeof(float);                           \
        float *low = m->c + TS_AMX_SIDE * m->c_row;                                      \
        if (m->add) {                                                                    \
            _tile_loadd(0, m->c, c_row);                                                 \
            if (wide) _tile_loadd(1, m->c + TS_AMX_SIDE, c_row);                         \
            if (tall) _tile_loadd(2, low, c_row);                                        \
            if (tall && wide) _tile_loadd(3, low + TS_AMX_SIDE, c_row);                  \
        } else {                                                                         \
            _tile_zero(0);                                                               \
            if (wide) _tile_zero(1);                                                     \
            if (tall) _tile_zero(2);                                                     \
            if (tall && wide) _tile_zero(3);                                             \
        }                                                                                \
        const float *b = m->b;                                                           \
        for (int s = 0; s < m->steps; s++, b += TS_AMX_PAIRS * m->b_row) {               \
            const char *a = (const char *)m->a + m->a_at[s];                             \
            _tile_loadd(6, b, b_row);                                                    \
            _tile_loadd(4, a, a_row);                                                    \
            _tile_dpbf16ps(0, 4, 6);                                                     \
            if (wide) _tile_loadd(7, b + TS_AMX_SIDE, b_row);                            \
            if (wide) _tile_dpbf16ps(1, 4, 7);                                           \
            if (tall) _tile_loadd(5, a + TS_AMX_SIDE * a_row, a_row);                    \
            if (tall) _tile_dpbf16ps(2, 5, 6);                                           \
            if (tall && wide) _tile_dpbf16ps(3, 5, 7);                                   \
        }                                                                                \
        _tile_stored(0, m->c, c_row);                                                    \
        if (wide) _tile_stored(1, m->c + TS_AMX_SIDE, c_row);                            \
        if (tall) _tile_stored(2, low, c_row);                                           \
        if (tall && wide) _tile_stored(3, low + TS_AMX_SIDE, c_row);                     \
    }
PRODUCT(product_1_1, 0, 0)
PRODUCT(product_1_2, 0, 1)
PRODUCT(product_2_1, 1, 0)
PRODUCT(product_2_2, 1, 1)

static void finish(const float *c, ptrdiff_t c_row, int pixels, int channels, const float *bias, const float *base,
                   float leak, float *y, ptrdiff_t y_row)
{
    const vf slope = v_set(leak);
    for (int o = 0; o < channels; o += VL) {
        const int left = channels - o;
        const vf b = bias ? v_load_part(bias + o, left) : v_set(0);
        for (int p = 0; p < pixels; p++) {
            float *to = y + p * y_row + o;
            __builtin_prefetch(to + TS_AMX_BLOCK * y_row,
                               1); /* where the next product's go: stores that miss would hold up what follows */
            vf v = v_load(c + p * c_row + o) + b;
            if (base) v += v_load_part(base + p * y_row + o, left);
            v_store_part(to, v_max(slope * v, v), left);
        }
    }
}

/* Pairs of pixels are 16 channels of 32 bits; transposed, 32 pixels of a channel. */
static void planes(const float *x, ptrdiff_t x_row, int pixels, int channels, uint16_t *to, ptrdiff_t plane)
{
    for (int p = 0; p < pixels; p += 2 * VL)
        for (int c = 0; c < channels; c += VL) {
            const int count = pixels - p < 2 * VL ? pixels - p : 2 * VL;
            const float *from = x + p * x_row + c;
            vf r[VL];
            _Pragma("GCC unroll 16") for (int i = 0; i < VL; i++)
            {
                const int even = 2 * i < count ? 2 * i : 0, odd = 2 * i + 1 < count ? 2 * i + 1 : 0;
                r[i] = v_pairs(v_load_part(from + even * x_row, channels - c),
                               v_load_part(from + odd * x_row, channels - c));
            }
            v_turn(r);
            const __mmask32 exist = (__mmask32)(0xffffffffu >> (2 * VL - count));
            _Pragma("GCC unroll 16") for (int i = 0; i < VL; i++) if (i < channels - c)
                _mm512_mask_storeu_epi16(to + (c + i) * plane + p, exist, (__m512i)r[i]);
        }
}

static void pixel_pairs(const float *x, ptrdiff_t x_row, int pixels, int channels, float *to, ptrdiff_t to_row)
{
    for (int p = 0; p < pixels; p += 2, x += 2 * x_row, to += to_row)
        for (int c = 0; c < channels; c += VL)
            v_store(to + c,
                    v_pairs(v_load_part(x + c, channels - c),
                            p + 1 < pixels ? v_load_part(x + x_row + c, channels - c) : (vf){0}));
}

const struct ts_amx_kernels TS_TABLE(amx) = {.begin = tiles_begin,
                                             .end = tiles_end,
                                             .product = {{product_1_1, product_1_2}, {product_2_1, product_2_2}},
                                             .finish = finish,
                                             .planes = planes,
                                             .pixel_pairs = pixel_pairs};
#else
const struct ts_amx_kernels TS_TABLE(amx) = {.begin = NULL};
#endif
