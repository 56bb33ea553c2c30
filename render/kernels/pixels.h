/* Pixels with interleaved channels to lanes and back. */
#ifndef TS_PIXELS_H
#define TS_PIXELS_H
#include "tensor/kernels/vec_double.h"

#if VL >= 8
V_INLINE void v_transpose8(v8 r[8])
{
    v8 t[8], u[8];
    for (int i = 0; i < 4; i++) {
        t[2 * i] = __builtin_shufflevector(r[2 * i], r[2 * i + 1], 0, 8, 1, 9, 4, 12, 5, 13);
        t[2 * i + 1] = __builtin_shufflevector(r[2 * i], r[2 * i + 1], 2, 10, 3, 11, 6, 14, 7, 15);
    }
    for (int i = 0; i < 2; i++)
        for (int j = 0; j < 2; j++) {
            u[4 * i + 2 * j] = __builtin_shufflevector(t[4 * i + j], t[4 * i + j + 2], 0, 1, 8, 9, 4, 5, 12, 13);
            u[4 * i + 2 * j + 1] = __builtin_shufflevector(t[4 * i + j], t[4 * i + j + 2], 2, 3, 10, 11, 6, 7, 14, 15);
        }
    for (int i = 0; i < 4; i++) {
        r[i] = __builtin_shufflevector(u[i], u[i + 4], 0, 1, 2, 3, 8, 9, 10, 11);
        r[i + 4] = __builtin_shufflevector(u[i], u[i + 4], 4, 5, 6, 7, 12, 13, 14, 15);
    }
}
#endif

#if VL >= 8
#define V_MIX(a, b, ...) __builtin_shufflevector(a, b, __VA_ARGS__)

/* VL pixels of 3 channels one after the other in a, b, c: each lane is first taken from two of them, then from the
 * third where it lies there. */
V_INLINE void v_apart(vf a, vf b, vf c, vf out[3])
{
#if VL == 16
    out[0] = V_MIX(a, b, 0, 3, 6, 9, 12, 15, 18, 21, 24, 27, 30, -1, -1, -1, -1, -1);
    out[1] = V_MIX(a, b, 1, 4, 7, 10, 13, 16, 19, 22, 25, 28, 31, -1, -1, -1, -1, -1);
    out[2] = V_MIX(a, b, 2, 5, 8, 11, 14, 17, 20, 23, 26, 29, -1, -1, -1, -1, -1, -1);
    out[0] = V_MIX(out[0], c, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 17, 20, 23, 26, 29);
    out[1] = V_MIX(out[1], c, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 18, 21, 24, 27, 30);
    out[2] = V_MIX(out[2], c, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 16, 19, 22, 25, 28, 31);
#else
    out[0] = V_MIX(a, b, 0, 3, 6, 9, 12, 15, -1, -1);
    out[1] = V_MIX(a, b, 1, 4, 7, 10, 13, -1, -1, -1);
    out[2] = V_MIX(a, b, 2, 5, 8, 11, 14, -1, -1, -1);
    out[0] = V_MIX(out[0], c, 0, 1, 2, 3, 4, 5, 10, 13);
    out[1] = V_MIX(out[1], c, 0, 1, 2, 3, 4, 8, 11, 14);
    out[2] = V_MIX(out[2], c, 0, 1, 2, 3, 4, 9, 12, 15);
#endif
}
#endif

/* Some channels of n pixels, stride values apart, to lanes; lanes from n on repeat pixel 0, so that they are valid
 * numbers. */
V_INLINE void v_load_pixels(const float *p, int stride, int n, int channels, vf *out)
{
    int first = 0;
#if VL >= 8
    if (channels == 3 && stride == 3 && n == VL) {
        v_apart(v_load(p), v_load(p + VL), v_load(p + 2 * VL), out);
        return;
    }
    if (channels == 9) { /* eight by transposing rows of eight, the ninth with what follows */
        v8 r[VL];
        for (int i = 0; i < VL; i++) memcpy(&r[i], p + (i < n ? i : 0) * stride, sizeof(v8));
        for (int i = 0; i < VL; i += 8) v_transpose8(r + i);
        for (int c = 0; c < 8; c++)
#if VL == 16
            out[c] = __builtin_shufflevector(r[c], r[8 + c], V_LOW, V_HIGH);
#else
            out[c] = r[c];
#endif
        first = 8;
    }
#endif
    float t[9][VL];
    for (int i = 0; i < VL; i++)
        for (int c = first; c < channels; c++) t[c][i] = p[(i < n ? i : 0) * stride + c];
    for (int c = first; c < channels; c++) out[c] = v_load(t[c]);
}

/* The other way; what a pixel has beyond these channels becomes 0. */
V_INLINE void v_store_pixels(float *p, int stride, int n, int channels, const vf *in)
{
    int first = 0;
#if VL >= 8
    if (channels == 9) {
        v8 r[VL];
        for (int c = 0; c < 8; c++) {
#if VL == 16
            r[c] = __builtin_shufflevector(in[c], in[c], V_LOW);
            r[8 + c] = __builtin_shufflevector(in[c], in[c], V_HIGH);
#else
            r[c] = in[c];
#endif
        }
        for (int i = 0; i < VL; i += 8) v_transpose8(r + i);
        if (n == VL)
            for (int i = 0; i < VL; i++) memcpy(p + i * stride, &r[i], sizeof(v8));
        else
            for (int i = 0; i < n; i++) memcpy(p + i * stride, &r[i], sizeof(v8));
        first = 8;
    }
#endif
    float t[9][VL];
    for (int c = first; c < channels; c++) v_store(t[c], in[c]);
    for (int i = 0; i < n; i++)
        for (int c = first; c < channels; c++) p[i * stride + c] = t[c][i];
    for (int i = 0; i < n && channels < stride; i++)
        for (int c = channels; c < stride; c++) p[i * stride + c] = 0;
}
#endif
