/* Winograd's convolution F(4 x 4, 3 x 3): 36 products in place of 144 for 4 x 4 pixels (Lavin and Gray 2016). Some tiles at a time are
 * transformed, multiplied as 36 small matrix products, and transformed back. Dilation 2 is four interleaved images. */
#include "tensor/conv_plan.h"
#include "tensor/kernels/winograd.h"
#include "tensor/threads.h"
#include <stdatomic.h>
#include <string.h>

enum {
    SIDE = 4,
    AREA = 36,
    TILES = 28 /* two full register tiles; their 36 inputs and outputs stay in the second cache beside the weights */
};

static _Atomic bool exact = true;

void ts_conv_exact_set(bool on) { exact = on; }
bool ts_conv_exact(void) { return exact; }

/* Tiles along a side of the interleaved images, the largest of which has ceil(size / dilation) pixels. */
static int tiles_along(int size, int dilation) { return ((size + dilation - 1) / dilation + SIDE - 1) / SIDE; }

bool ts_conv_winograd(const ts_conv *c)
{
    if (c->k != 3 || c->ic < 16 || c->oc < 24) return false;
    /* Tiles that are mostly outside, and too few of them, cost what fewer products save. */
    const int64_t tiles = (int64_t)c->n * c->dilation * c->dilation * tiles_along(c->h, c->dilation) * tiles_along(c->w, c->dilation);
    return tiles >= TILES && 2 * tiles * SIDE * SIDE <= 3 * (int64_t)c->n * c->h * c->w;
}

/* packed: [36][panel][input][channel of the panel] = G g G' */
size_t conv_winograd_count(const ts_conv *c) { return (size_t)conv_panels_count(c->ic, c->oc, 1) * AREA; }

void conv_winograd_pack(const ts_conv *c, const float *weight, float *packed)
{
    static const double g[6][3] = {{1. / 4, 0, 0}, {-1. / 6, -1. / 6, -1. / 6}, {-1. / 6, 1. / 6, -1. / 6}, {1. / 24, 1. / 12, 1. / 6},
                                   {1. / 24, -1. / 12, 1. / 6}, {0, 0, 1}};
    const int panels = conv_panels(c->oc), lanes2 = 2 * conv_lanes();
    const ptrdiff_t plane = conv_panels_count(c->ic, c->oc, 1);
#pragma omp parallel for collapse(2) schedule(static) num_threads(ts_threads())
    for (int panel = 0; panel < panels; panel++)
        for (int i = 0; i < c->ic; i++) {
            const int width = conv_vectors(c->oc, panel) * conv_lanes(), o0 = panel * lanes2;
            float *to = packed + (ptrdiff_t)o0 * c->ic + (ptrdiff_t)i * width;
            for (int o = 0; o < width; o++) {
                const float *w = o0 + o < c->oc ? weight + ((ptrdiff_t)(o0 + o) * c->ic + i) * 9 : NULL;
                for (int a = 0; a < 6; a++) {
                    double row[3] = {0};
                    for (int s = 0; w && s < 3; s++)
                        for (int r = 0; r < 3; r++) row[s] += g[a][r] * w[3 * r + s];
                    for (int b = 0; b < 6; b++)
                        to[(6 * a + b) * plane + o] = (float)(row[0] * g[b][0] + row[1] * g[b][1] + row[2] * g[b][2]);
                }
            }
        }
}

typedef struct grid {
    const ts_conv *c;
    int rows, columns; /* tiles of one interleaved image */
} grid;

typedef struct place {
    int image, i, j; /* first output pixel; the others are dilation apart */
} place;

static place locate(const grid *g, int64_t tile)
{
    const int d = g->c->dilation;
    const int x = (int)(tile % g->columns), y = (int)(tile / g->columns % g->rows);
    const int64_t phase = tile / g->columns / g->rows;
    return (place){(int)(phase / (d * d)), y * SIDE * d + (int)(phase / d % d), x * SIDE * d + (int)(phase % d)};
}

/* The 6 x 6 pixels that a tile reads; nothing: a pixel of zeros. */
static void sources(const ts_conv *c, const float *x, const float *nothing, place at, const float *pixel[AREA])
{
    ptrdiff_t row[6], column[6]; /* offsets; -1: outside */
    for (int a = 0; a < 6; a++) {
        const int r = at.i + (a - 1) * c->dilation, i = conv_clamp(r, c->h), s = at.j + (a - 1) * c->dilation, j = conv_clamp(s, c->w);
        row[a] = c->pad == TS_PAD_ZERO && i != r ? -1 : ((ptrdiff_t)at.image * c->h + i) * c->w * c->ic;
        column[a] = c->pad == TS_PAD_ZERO && j != s ? -1 : (ptrdiff_t)j * c->ic;
    }
    for (int a = 0; a < 6; a++)
        for (int b = 0; b < 6; b++) pixel[6 * a + b] = row[a] < 0 || column[b] < 0 ? nothing : x + row[a] + column[b];
}

/* NULL: no such pixel */
static void targets(const ts_conv *c, float *y, place at, float *pixel[SIDE * SIDE])
{
    for (int a = 0; a < SIDE; a++) {
        const int i = at.i + a * c->dilation;
        float *row = y + ((ptrdiff_t)at.image * c->h + i) * c->w * c->oc;
        for (int b = 0; b < SIDE; b++) {
            const int j = at.j + b * c->dilation;
            pixel[SIDE * a + b] = i < c->h && j < c->w ? row + (ptrdiff_t)j * c->oc : NULL;
        }
    }
}

/* A plane's floats: whole lines and an odd number of them, or the 36 planes would meet in a few sets of the first cache. */
static ptrdiff_t plane_size(int channels) { return (((ptrdiff_t)TILES * channels + 15) / 16 | 1) * 16; }

/* m[36][tile][output] = v[36][tile][input] u[36][input][output] */
static void multiply(const ts_conv *c, const float *u, const float *v, int count, float *m)
{
    const int panels = conv_panels(c->oc), step = ts_conv_k()->pixels, groups = (count + step - 1) / step;
    const ptrdiff_t weights = conv_panels_count(c->ic, c->oc, 1);
    const ts_segment segment = {0, 0, c->ic};
    ts_tile t = {.segment = &segment, .segments = 1, .a_stride = c->ic, .y_stride = c->oc, .leak = 1};
    for (int q = 0; q < AREA; q++)
        for (int panel = 0; panel < panels; panel++) {
            const int o0 = panel * 2 * conv_lanes(), vectors = conv_vectors(c->oc, panel);
            const ptrdiff_t size = (ptrdiff_t)c->ic * vectors * conv_lanes();
            t.w = u + q * weights + (ptrdiff_t)o0 * c->ic;
            t.channels = c->oc - o0;
            /* Each group fetches its part of the next panel, a half of it by each of two. */
            const float *next = q == AREA - 1 && panel == panels - 1 ? u : t.w + size;
            t.fetch_step[0] = t.fetch_step[1] = size * (ptrdiff_t)sizeof(float) / groups / 2 / ((c->ic + 3) / 4);
            for (int i = 0; i < groups; i++) {
                int begin, end;
                conv_part(count, groups, i, &begin, &end);
                t.fetch[0] = next + i * (size / groups);
                t.fetch[1] = t.fetch[0] + size / groups / 2;
                conv_run_tile(&t, vectors, v + q * plane_size(c->ic) + (ptrdiff_t)begin * c->ic, m + q * plane_size(c->oc) + o0 + (ptrdiff_t)begin * c->oc,
                              end - begin, false);
            }
        }
}

void ts_conv_forward_winograd(const ts_conv *c, const float *x, const float *packed, const float *bias, float leak, float *y)
{
    const grid g = {c, tiles_along(c->h, c->dilation), tiles_along(c->w, c->dilation)};
    const int64_t tiles = (int64_t)c->n * c->dilation * c->dilation * g.rows * g.columns;
    const ptrdiff_t in = plane_size(c->ic), out = plane_size(c->oc);
    const struct ts_winograd_kernels *kernels = ts_winograd_k();
#pragma omp parallel for schedule(dynamic) num_threads(ts_threads())
    for (int64_t first = 0; first < tiles; first += TILES) {
        const int count = (int)(tiles - first < TILES ? tiles - first : TILES);
        float *v = ts_scratch(0, sizeof(float) * (size_t)(in * AREA)), *m = ts_scratch(1, sizeof(float) * (size_t)(out * AREA));
        float *nothing = ts_scratch(2, sizeof(float) * (size_t)c->ic);
        memset(nothing, 0, sizeof(float) * (size_t)c->ic);
        const float *from[2][AREA];
        sources(c, x, nothing, locate(&g, first), from[0]);
        for (int i = 0; i < count; i++) {
            sources(c, x, nothing, locate(&g, first + (i + 1 < count ? i + 1 : i)), from[(i + 1) & 1]);
            kernels->input(from[i & 1], from[(i + 1) & 1], c->ic, v + (ptrdiff_t)i * c->ic, in);
        }
        multiply(c, packed, v, count, m);
        float *to[2][SIDE * SIDE];
        targets(c, y, locate(&g, first), to[0]);
        for (int i = 0; i < count; i++) {
            targets(c, y, locate(&g, first + (i + 1 < count ? i + 1 : i)), to[(i + 1) & 1]);
            kernels->output(m + (ptrdiff_t)i * c->oc, out, c->oc, bias, leak, to[i & 1], to[(i + 1) & 1]);
        }
    }
}
