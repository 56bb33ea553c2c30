/* A gated recurrent unit whose gates are 1 x 1 products, computed in bands of pixels: what lies between the products
 * and the new state stays in cache. Threaded; the same bytes for any number of threads.
 *
 * ih = x W_ih' + b_ih,  hh = old W_hh' + b_hh, both [3c] a pixel in chunks z, r, n;
 * z = sigmoid(ih_z + hh_z),  r = sigmoid(ih_r + hh_r),  n = tanh(ih_n + r hh_n),  y = (1 - z) old + z n
 * (Cho et al., "Learning Phrase Representations using RNN Encoder-Decoder", EMNLP 2014, with the reset gate applied
 * after hh's matrix and z weighing the new candidate). */
#ifndef TS_GRU_H
#define TS_GRU_H
#include "tensor/conv/conv.h"

typedef struct ts_gru {
    int64_t pixels;
    int ic, c;   /* channels of x and of the state */
    bool bf16;   /* both products of forward on rounded x, old and weights, as in tensor/conv/conv.h; weights packed for
                    TS_CONV_FORWARD_BF16; of backward where ts_gru_backward_bf16 says so */
    int threads; /* of the loops; 0: the process's number */
} ts_gru;

/* The products as convolutions: what ts_conv_pack packs the weights W_ih [3c][ic] and W_hh [3c][c] for. */
ts_conv ts_gru_input(const ts_gru *g);
ts_conv ts_gru_hidden(const ts_gru *g);

/* x [pixels][ic], old [pixels][c] or NULL = 0 (hh_packed may then be NULL), weights packed for TS_CONV_FORWARD, biases
 * [3c]. saved: [pixels][4c] = z, r, n, hh_n for backward, or NULL. y [pixels][c] may be old, and overlaps nothing
 * else. */
void ts_gru_forward(const ts_gru *g, const float *x, const float *old, const float *ih_packed, const float *ih_bias,
                    const float *hh_packed, const float *hh_bias, float *y, float *saved);

/* Where gradients go; each pointer may be NULL. dx and dold are overwritten unless their flag says to add, weights and
 * biases are added to. dold is made before dx, so that both may be the same memory when dx adds. */
typedef struct ts_gru_gradients {
    float *dx, *dold;
    bool dx_add, dold_add;
    float *ih_weight, *ih_bias, *hh_weight, *hh_bias; /* unpacked shapes */
} ts_gru_gradients;

/* Whether backward multiplies rounded values too: of g->bf16 on CPUs with a matrix unit, c a multiple of 16. */
bool ts_gru_backward_bf16(const ts_gru *g);

/* Weights packed for TS_CONV_DATA_GRADIENT, or TS_CONV_DATA_GRADIENT_BF16. */
void ts_gru_backward(const ts_gru *g, const float *x, const float *old, const float *ih_packed, const float *hh_packed,
                     const float *saved, const float *dy, const ts_gru_gradients *to);

/* Naive twins, sums in double, unpacked weights. */
void ts_gru_forward_naive(const ts_gru *g, const float *x, const float *old, const float *ih_weight,
                          const float *ih_bias, const float *hh_weight, const float *hh_bias, float *y, float *saved);
void ts_gru_backward_naive(const ts_gru *g, const float *x, const float *old, const float *ih_weight,
                           const float *hh_weight, const float *saved, const float *dy, const ts_gru_gradients *to);
#endif
