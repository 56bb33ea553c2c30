#include "tensor/kernels/norm.h"
#include "tensor/kernels/vec.h"

enum { RUN = 64 }; /* pixels in one float partial sum */

static inline void into(double *sum, vf x, int left)
{
    for (int j = 0; j < VL && j < left; j++) sum[j] += x[j];
}

static void sums(int64_t pixels, int c, const float *x, double *sum)
{
    for (int64_t p0 = 0; p0 < pixels; p0 += RUN) {
        int64_t p1 = p0 + RUN < pixels ? p0 + RUN : pixels;
        for (int i = 0; i < c; i += VL) {
            vf s = {0};
            for (int64_t p = p0; p < p1; p++) s += v_load_part(x + p * c + i, c - i);
            into(sum + i, s, c - i);
        }
    }
}

static void moments(int64_t pixels, int c, const float *x, double *mean, double *m2)
{
    for (int i = 0; i < c; i++) mean[i] = m2[i] = 0;
    sums(pixels, c, x, mean);
    for (int i = 0; i < c; i += VL) {
        const int left = c - i;
        /* Around the mean rounded to float; what the rounding left is corrected at the end. */
        float shift[VL] = {0};
        double first[VL] = {0}, second[VL] = {0};
        for (int j = 0; j < VL && j < left; j++) shift[j] = (float)(mean[i + j] / (double)pixels);
        const vf s = v_load(shift);
        for (int64_t p0 = 0; p0 < pixels; p0 += RUN) {
            int64_t p1 = p0 + RUN < pixels ? p0 + RUN : pixels;
            vf d1 = {0}, d2 = {0};
            for (int64_t p = p0; p < p1; p++) {
                vf d = v_load_part(x + p * c + i, left) - s;
                d1 += d;
                d2 += d * d;
            }
            into(first, d1, left);
            into(second, d2, left);
        }
        for (int j = 0; j < VL && j < left; j++) {
            double rest = first[j] / (double)pixels;
            mean[i + j] = shift[j] + rest;
            m2[i + j] = second[j] - first[j] * rest;
            if (m2[i + j] < 0) m2[i + j] = 0; /* rounding of a constant channel */
        }
    }
}

static void normalise(int64_t pixels, int c, const float *x, const float *high, const float *low, const float *scale,
                      float *y)
{
    for (int64_t p = 0; p < pixels; p++, x += c, y += c)
        for (int i = 0; i < c; i += VL) {
            const int left = c - i;
            vf d = v_load_part(x + i, left) - v_load_part(high + i, left);
            v_store_part(y + i, (d - v_load_part(low + i, left)) * v_load_part(scale + i, left), left);
        }
}

static void gradient_sums(int64_t pixels, int c, const float *y, const float *dy, double *sum_dy, double *sum_dyy)
{
    for (int64_t p0 = 0; p0 < pixels; p0 += RUN) {
        int64_t p1 = p0 + RUN < pixels ? p0 + RUN : pixels;
        for (int i = 0; i < c; i += VL) {
            vf s1 = {0}, s2 = {0};
            for (int64_t p = p0; p < p1; p++) {
                vf d = v_load_part(dy + p * c + i, c - i);
                s1 += d;
                s2 += d * v_load_part(y + p * c + i, c - i);
            }
            into(sum_dy + i, s1, c - i);
            into(sum_dyy + i, s2, c - i);
        }
    }
}

static void gradient(int64_t pixels, int c, const float *y, const float *dy, const float *a, const float *b,
                     const float *scale, float *dx, bool accumulate)
{
    for (int64_t p = 0; p < pixels; p++, y += c, dy += c, dx += c)
        for (int i = 0; i < c; i += VL) {
            const int left = c - i;
            vf d = v_load_part(dy + i, left) - v_load_part(a + i, left) -
                v_load_part(b + i, left) * v_load_part(y + i, left);
            d = d * v_load_part(scale + i, left);
            v_store_part(dx + i, accumulate ? v_load_part(dx + i, left) + d : d, left);
        }
}

const struct ts_norm_kernels TS_TABLE(norm) = {
    .sums = sums,
    .moments = moments,
    .normalise = normalise,
    .gradient_sums = gradient_sums,
    .gradient = gradient,
};
