/* Internal to tensor/conv/: the layouts that the ways share, and the plan of a forward or a data gradient.
 *
 * Padded window (conv_window): rows of input with their padding columns, made when first needed, in a ring.
 *
 *      left                          columns
 *       | pad | x[r][0] x[r][1] ... x[r][w-1] | pad |      source row r      at memory + r % rows * row
 *       | pad | x[r+1][0] ...                 | pad |      source row r + 1
 *                      ^ one pixel: ic floats (of bf16: pairs of channels), pixel floats apart
 *
 * Panel: the weights of two vectors of output channels (the last of one, where that is enough).
 *
 *      packed: [panel][ky][kx][input channel][2 lanes outputs]          lanes = 16 with AVX-512, 8 with AVX2
 *
 * Register tile (ts_tile): sums that stay in registers over all taps and input channels.
 *
 *                        panel's outputs
 *                    +---------+---------+
 *      pixel 0       | vector  | vector  |     y[p][o] = act(bias[o] + sum_k a[p][k] w[k][o])
 *      pixel 1       |         |         |     k runs through segments: stretches of a and w that both are contiguous,
 *      ...           |         |         |     such as the taps of a kernel row
 *      pixel < TS_TILE_PIXELS            |
 *                    +---------+---------+
 */
#ifndef TS_CONV_PLAN_H
#define TS_CONV_PLAN_H
#include "tensor/conv/conv.h"
#include "tensor/kernels/conv.h"

/* y[n, i, j, o] = act(base[n, i, j, o] + bias[o] + sum x[n, i + first + d ky, j + first + d kx, c] w[ky, kx, c, o]).
 * The gradient under replicate padding is computed on a domain that is larger by fold on each side, and what falls
 * outside is added to the nearest border pixel: that is exactly the transpose of replicating it. */
typedef struct conv_plan {
    int n, h, w, ic; /* input; of bf16: pairs of channels */
    int oc, k, dilation;
    int first;      /* coordinate that tap 0 reads for output 0 */
    bool replicate; /* else zeros */
    int fold;       /* output domain [-fold, h + fold) x [-fold, w + fold), folded into [0, h) x [0, w) */
    const float *x, *more, *packed, *bias;
    const float *base; /* NULL or y; of the ways of ts_conv_adds any array */
    float *y;
    float leak;
    bool bf16;     /* weights, and x as tiles read it, are pairs of bf16 values, each where a float would be; */
    int channels;  /* x itself is floats, so many a pixel, */
    int constants; /* and behind them so many of more; of the ways of ts_conv_joins */
    int threads;
} conv_plan;

enum {
    CONV_CACHED_BYTES = 640 << 10, /* weights that stay in the second cache while pixels pass by */
    CONV_WINDOW_SLACK = 64         /* the weight gradient reads whole vectors past the last pixel */
};

/* n consecutive pixels of x as tiles read them, stride floats apart. */
void conv_put_pixels(const conv_plan *p, const float *from, ptrdiff_t n, float *to, ptrdiff_t stride);

/* A window of input rows with their padding columns, of which a row is made when first needed. */
typedef struct conv_window {
    float *memory;
    ptrdiff_t pixel, row; /* strides in floats */
    int rows, left, columns;
    int next; /* first source row that is not there yet */
} conv_window;

/* The layout of a window of rows and columns, the first column being input column left (may be negative). No memory
 * yet: the caller puts conv_window_size floats into memory. */
conv_window conv_window_make(const conv_plan *p, int rows, int left, int columns);
static inline size_t conv_window_size(const conv_window *s) { return (size_t)(s->row * s->rows) + CONV_WINDOW_SLACK; }
/* Makes source rows first to last of image n that are not there yet. */
void conv_window_fill(conv_window *s, const conv_plan *p, int n, int first, int last);
static inline const float *conv_window_row(const conv_window *s, int row) { return s->memory + row % s->rows * s->row; }

/* For output coordinate i: the source coordinates and taps that meet there, in order of the tap. Returns how many;
 * at most conv_pairs_max. */
typedef struct conv_pair {
    int source, tap;
} conv_pair;
int conv_pairs(const conv_plan *p, int i, int size, conv_pair *pair);
static inline int conv_pairs_max(const conv_plan *p) { return p->k * (p->fold + 1) + p->k * p->fold; }

/* Pixels of a map that the ways of a batch hold at a time. */
enum { CONV_BATCH_PIXELS = 64 };

/* Panels of 2 vectors of output channels; the last has one vector where that is enough. */
static inline int conv_lanes(void) { return ts_conv_k()->lanes; }
/* In whole vectors. */
static inline int conv_whole(int n) { return (n + conv_lanes() - 1) / conv_lanes() * conv_lanes(); }
static inline int conv_panels(int oc) { return (oc + 2 * conv_lanes() - 1) / (2 * conv_lanes()); }
static inline int conv_vectors(int oc, int panel) { return oc - panel * 2 * conv_lanes() > conv_lanes() ? 2 : 1; }

static inline int conv_clamp(int i, int size) { return i < 0 ? 0 : i >= size ? size - 1 : i; }

/* Part i of n parts of total, as even as can be: [*begin, *end). */
static inline void conv_part(int total, int parts, int i, int *begin, int *end)
{
    const int each = total / parts, larger = total % parts;
    *begin = i * each + (i < larger ? i : larger);
    *end = *begin + each + (i < larger);
}

/* A tile of the panel without its pixels; and one run on pixels from a to y. */
ts_tile conv_panel_tile(const conv_plan *p, int panel);
void conv_run_tile(ts_tile *t, int vectors, const float *a, float *y, int pixels, bool bf16);

/* Side 1, serial: pixels [first, first + count) of panels [panel0, panel1); p->x is as tiles read it. */
void conv_run_pixels(const conv_plan *p, ptrdiff_t first, ptrdiff_t count, int panel0, int panel1);

/* Weights to be packed, [oc][ic][k][k]: as floats, or as halves that are aligned to nothing. */
typedef struct conv_weights {
    const float *full;
    const unsigned char *half;
} conv_weights;
/* Numbers at .. at + count - 1 of them, at most CONV_TRANSPOSED, as floats. */
void conv_take(const conv_weights *w, ptrdiff_t at, int count, float *to);

/* Inputs [input, input + inputs) of a panel: to [input][tap][width], zeros where there is no channel; returns width, of
 * whole vectors. Of the forward or the gradient's way; inputs: at most conv_transposed_inputs. */
enum { CONV_TRANSPOSED = 225 }; /* taps of inputs that are transposed at once: those of the largest kernel */
static inline int conv_transposed_inputs(int taps) { return taps < 144 ? 144 / taps : 1; }
int conv_transpose(const ts_conv *c, const conv_weights *w, bool forward, int panel, int input, int inputs, float *to);

void conv_run_direct(const conv_plan *p);
void conv_run_pointwise(const conv_plan *p);
void conv_run_batch(const conv_plan *p);
void conv_run_pixel_lanes(const conv_plan *p);
void conv_run_col2im(const conv_plan *p);

/* bf16 where the CPU has a matrix unit: weights are packed for it alone. */
bool conv_amx_present(void);
size_t conv_amx_count(int ic, int oc, int k, int dilation);
void conv_amx_pack(const ts_conv *c, bool forward, const float *weight, float *packed);
void conv_run_amx(const conv_plan *p);
/* Side 1, serial: count pixels of pairs p->x, behind which CONV_AMX_SLACK pixels and 32 more values can be read and
 * are finite. */
enum { CONV_AMX_SLACK = 32 };
void conv_amx_pixels(const conv_plan *p, int count);
/* The same of steps of 32 channels that begin at bytes from a pixel, which are p->ic pairs apart. */
void conv_amx_steps(const conv_plan *p, const ptrdiff_t *at, int steps, int count);

static inline int conv_bf16_depth(int channels) { return (channels + 1) / 2; }
size_t conv_bf16_count(const ts_conv *c, int ic, int oc);
void conv_pack_bf16(const ts_conv *c, bool forward, const conv_weights *w, float *packed);

ptrdiff_t conv_panels_count(int ic, int oc, int k);
/* To few channels weights are packed behind the panels once more, for this way: TS_CONV_BY_COL2IM,
 * TS_CONV_BY_PIXEL_LANES, or TS_CONV_DIRECTLY where they are not. */
ts_conv_way conv_choose_narrow(int ic, int oc, int k);
ptrdiff_t conv_col2im_count(int ic, int oc, int k);
/* weight[i * i_step + o * o_step + tap] */
void conv_pack_col2im(int ic, int oc, int k, bool mirrored, const float *weight, ptrdiff_t i_step, ptrdiff_t o_step,
                      float *packed);
void conv_pack_pixel_lanes(int ic, int oc, int k, bool mirrored, const float *weight, ptrdiff_t i_step,
                           ptrdiff_t o_step, float *packed);

size_t conv_winograd_count(int ic, int oc, bool bf16);
void conv_winograd_pack(const ts_conv *c, bool forward, bool bf16, const conv_weights *w, float *packed);
void conv_winograd_forward(const ts_conv *c, bool bf16, const ts_conv_inputs *in, const float *packed, float leak,
                           float *y);
void conv_winograd_data_gradient(const ts_conv *c, bool bf16, const float *dy, const float *packed, float *dx,
                                 bool accumulate);
void conv_winograd_weight_gradient(const ts_conv *c, bool bf16, const ts_conv_inputs *x, const float *dy,
                                   float *dweight);

/* dweight += for at most CONV_BATCH_PIXELS pixels an image. */
void conv_batch_weight_gradient(const ts_conv *c, bool bf16, const float *x, const float *dy, float *dweight);
/* Either may be NULL; dbias is of dy as it is. */
void conv_direct_weight_gradient(const ts_conv *c, bool bf16, const float *x, const float *dy, float *dweight,
                                 float *dbias);
/* Where there is a matrix unit. */
void conv_amx_weight_gradient(const ts_conv *c, const ts_conv_inputs *x, const float *dy, float *dweight);
#endif
