/* Internal to tensor/conv/gru*.c: the products of a backward band by the matrix unit. */
#ifndef TS_GRU_INTERNAL_H
#define TS_GRU_INTERNAL_H
#include "tensor/conv/gru.h"
#include "tensor/conv/plan.h"

enum {
    GRU_BAND = 8 * TS_TILE_PIXELS
}; /* pixels: with 64 and 32 channels, or 256 and 64, all that a band touches stays in the second cache */

/* A band's gradients before the activations, rounded, pixel by pixel and channel by channel. It lies in scratch slot 1.
 */
typedef struct gru_rounded {
    int c, count;
    float *pairs;     /* [count][2c] */
    uint16_t *planes; /* [4c][whole steps], zeros behind count */
    float *others;    /* memory for the pairs of pixels that weights are multiplied with */
} gru_rounded;

/* d [count][4c] = n, z, r, n' (tensor/conv/gru.c). */
gru_rounded gru_round(const ts_gru *g, const float *d, int count);
/* y [count][oc] (+)= the input's n, z, r or the hidden z, r, n' times weights packed for TS_CONV_DATA_GRADIENT_BF16. */
void gru_amx_product(const gru_rounded *r, bool hidden, const float *packed, int oc, float *y, bool add);
/* sum [3c][channels, whole vectors] += the same, of each pixel, times x [count][channels] */
void gru_amx_weights(const gru_rounded *r, bool hidden, const float *x, int channels, float *sum);
#endif
