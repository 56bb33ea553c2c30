#include "tensor/kernels/resample.h"
#include "tensor/kernels/vec.h"

static void rows(int64_t n, int count, const float *weight, const float *x, int64_t stride, float *y)
{
    int64_t i = 0;
    for (; i + 4 * VL <= n; i += 4 * VL) {
        vf s0 = {0}, s1 = {0}, s2 = {0}, s3 = {0};
        for (int k = 0; k < count; k++) {
            const float *p = x + k * stride + i;
            s0 += weight[k] * v_load(p);
            s1 += weight[k] * v_load(p + VL);
            s2 += weight[k] * v_load(p + 2 * VL);
            s3 += weight[k] * v_load(p + 3 * VL);
        }
        v_store(y + i, s0);
        v_store(y + i + VL, s1);
        v_store(y + i + 2 * VL, s2);
        v_store(y + i + 3 * VL, s3);
    }
    for (; i < n; i += VL) {
        vf s = {0};
        for (int k = 0; k < count; k++) s += weight[k] * v_load_part(x + k * stride + i, n - i);
        v_store_part(y + i, s, n - i);
    }
}

static void pixels(int w, int c, const int *first, const int *offset, const float *weight, const float *x, float *y,
                   bool accumulate)
{
    for (int j = 0; j < w; j++, y += c) {
        const float *p = x + (int64_t)first[j] * c, *q = weight + offset[j];
        const int count = offset[j + 1] - offset[j];
        for (int i = 0; i < c; i += VL) {
            vf s = {0};
            for (int k = 0; k < count; k++) s += q[k] * v_load_part(p + (int64_t)k * c + i, c - i);
            if (accumulate) s += v_load_part(y + i, c - i);
            v_store_part(y + i, s, c - i);
        }
    }
}

const struct ts_resample_kernels TS_TABLE(resample) = {.rows = rows, .pixels = pixels};
