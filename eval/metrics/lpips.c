#include "eval/metrics/lpips.h"
#include "nn/weights/file.h"
#include "tensor/conv/gemm.h"
#include "tensor/memory.h"
#include "tensor/team.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { STEP = 64 }; /* pixels at a time, at least */

/* Krizhevsky's network as torchvision has it ("features"): convolution with bias, ReLU; before the second and third a 3
 * x 3 maximum of stride 2. */
static const struct {
    int number, in, out, kernel, stride, padding;
    bool pool;
} layer[EV_LPIPS_TAPS] = {{0, 3, 64, 11, 4, 2, false},
                          {3, 64, 192, 5, 1, 2, true},
                          {6, 192, 384, 3, 1, 1, true},
                          {8, 384, 256, 3, 1, 1, false},
                          {10, 256, 256, 3, 1, 1, false}};

struct ev_lpips {
    float *weight[EV_LPIPS_TAPS]; /* [out, k, k, in]: as the pixels of a window lie in memory */
    float *bias[EV_LPIPS_TAPS], *head[EV_LPIPS_TAPS];
    float *work[3]; /* an image pair, another one, its windows */
    size_t capacity[3];
};

static size_t window(int l) { return (size_t)layer[l].kernel * (size_t)layer[l].kernel * (size_t)layer[l].in; }

static ts_code read_layer(const nn_file *trunk, const nn_file *linear, int l, ev_lpips *net, ts_status *st)
{
    const int out = layer[l].out, in = layer[l].in, k = layer[l].kernel;
    char name[64];
    float *planes = malloc((size_t)out * window(l) * sizeof *planes);
    net->weight[l] = ts_memory((size_t)out * window(l) * sizeof(float));
    net->bias[l] = malloc((size_t)out * sizeof(float));
    net->head[l] = malloc((size_t)out * sizeof(float));
    ts_code code = planes && net->weight[l] && net->bias[l] && net->head[l]
        ? TS_OK
        : ts_fail(st, TS_NOMEM, "out of memory for LPIPS");
    snprintf(name, sizeof name, "features.%d.weight", layer[l].number);
    if (!code) code = nn_file_read(trunk, name, 4, (int64_t[]){out, in, k, k}, planes, st);
    for (int o = 0; o < out && !code; o++)
        for (int i = 0; i < in; i++)
            for (int p = 0; p < k * k; p++)
                net->weight[l][(size_t)o * window(l) + (size_t)(p * in + i)] =
                    planes[(size_t)((o * in + i) * k * k + p)];
    snprintf(name, sizeof name, "features.%d.bias", layer[l].number);
    if (!code) code = nn_file_read(trunk, name, 1, (int64_t[]){out}, net->bias[l], st);
    snprintf(name, sizeof name, "lin%d.model.1.weight", l);
    if (!code) code = nn_file_read(linear, name, 4, (int64_t[]){1, out, 1, 1}, net->head[l], st);
    bool finite = true;
    for (size_t i = 0; !code && i < (size_t)out * window(l); i++) finite = finite && isfinite(planes[i]);
    for (int i = 0; !code && i < out; i++) finite = finite && isfinite(net->bias[l][i]) && isfinite(net->head[l][i]);
    if (!finite)
        code = ts_fail(st, TS_NUMERIC, "%s or %s: layer %d holds a value that is not finite", nn_file_path(trunk),
                       nn_file_path(linear), layer[l].number);
    free(planes);
    return code;
}

ev_lpips *ev_lpips_load(const char *trunk, const char *linear, ts_status *st)
{
    ev_lpips *net = calloc(1, sizeof *net);
    if (!net) return ts_fail(st, TS_NOMEM, "out of memory for LPIPS"), NULL;
    nn_file *t = nn_file_open(trunk, st), *l = t ? nn_file_open(linear, st) : NULL;
    bool good = t && l;
    for (int i = 0; i < EV_LPIPS_TAPS && good; i++) good = read_layer(t, l, i, net, st) == TS_OK;
    nn_file_close(&t);
    nn_file_close(&l);
    if (!good) ev_lpips_free(&net);
    return net;
}

void ev_lpips_free(ev_lpips **net)
{
    ev_lpips *n = *net;
    if (!n) return;
    for (int l = 0; l < EV_LPIPS_TAPS; l++) {
        free(n->weight[l]);
        free(n->bias[l]);
        free(n->head[l]);
    }
    for (int i = 0; i < 3; i++) free(n->work[i]);
    free(n);
    *net = NULL;
}

static float *work(ev_lpips *net, int slot, size_t floats)
{
    if (floats > net->capacity[slot]) {
        free(net->work[slot]);
        net->work[slot] = ts_memory(floats * sizeof(float));
        net->capacity[slot] = net->work[slot] ? floats : 0;
    }
    return net->work[slot];
}

/* Both pictures, one after the other: [2, h, w, channels]. */
typedef struct pair {
    int h, w, channels;
    float *data;
} pair;

/* row = y of the output, over both pictures. to: [w of the output, k, k, in], zero outside. */
static void window_row(const pair *x, int l, int out_h, int out_w, int row, float *to)
{
    const int k = layer[l].kernel, y0 = row % out_h * layer[l].stride - layer[l].padding;
    const size_t in = (size_t)x->channels;
    const float *picture = x->data + (size_t)(row / out_h) * (size_t)x->h * (size_t)x->w * in;
    for (int ox = 0; ox < out_w; ox++) {
        const int x0 = ox * layer[l].stride - layer[l].padding, left = x0 < 0 ? -x0 : 0,
                  right = x0 + k > x->w ? x->w - x0 : k; /* columns [left, right) are inside */
        for (int ky = 0; ky < k; ky++, to += (size_t)k * in) {
            const int y = y0 + ky;
            if (y < 0 || y >= x->h) {
                memset(to, 0, (size_t)k * in * sizeof *to);
                continue;
            }
            memset(to, 0, (size_t)left * in * sizeof *to);
            memcpy(to + (size_t)left * in, picture + ((size_t)y * (size_t)x->w + (size_t)(x0 + left)) * in,
                   (size_t)(right - left) * in * sizeof *to);
            memset(to + (size_t)right * in, 0, (size_t)(k - right) * in * sizeof *to);
        }
    }
}

typedef struct layer_job {
    const pair *x;
    int l, out_h, out_w;
    size_t row;
    float *windows;
    const pair *y;
    const float *bias;
} layer_job;

static void window_rows(const void *job, int64_t begin, int64_t end)
{
    const layer_job *j = job;
    for (int64_t r = begin; r < end; r++)
        window_row(j->x, j->l, j->out_h, j->out_w, (int)r, j->windows + (size_t)r * j->row);
}

static void relu_pixels(const void *job, int64_t begin, int64_t end)
{
    const layer_job *j = job;
    const size_t out = (size_t)j->y->channels;
    for (int64_t r = begin; r < end; r++) {
        float *v = j->y->data + (size_t)r * out;
        for (size_t c = 0; c < out; c++) v[c] = v[c] + j->bias[c] > 0 ? v[c] + j->bias[c] : 0;
    }
}

/* Windows as rows of a matrix, times the weights; + bias, ReLU. */
static bool convolve(ev_lpips *net, int l, const pair *x, pair *y, int slot)
{
    const int out_h = (x->h + 2 * layer[l].padding - layer[l].kernel) / layer[l].stride + 1;
    const int out_w = (x->w + 2 * layer[l].padding - layer[l].kernel) / layer[l].stride + 1, rows = 2 * out_h;
    const size_t row = (size_t)out_w * window(l), out = (size_t)layer[l].out;
    float *windows = work(net, 2, (size_t)rows * row);
    *y = (pair){out_h, out_w, layer[l].out, work(net, slot, (size_t)rows * (size_t)out_w * out)};
    if (!windows || !y->data) return false;
    const layer_job j = {x, l, out_h, out_w, row, windows, y, net->bias[l]};
    ts_for(0, rows, 1, window_rows, &j);
    ts_gemm(false, true, rows * out_w, layer[l].out, (int)window(l), 1, windows, net->weight[l], 0, y->data, 0);
    ts_for(0, (int64_t)rows * out_w, STEP, relu_pixels, &j);
    return true;
}

/* 3 x 3, stride 2, no padding, in place: what is written lies before what is still to be read. */
static void pool(pair *x)
{
    const int h = (x->h - 3) / 2 + 1, w = (x->w - 3) / 2 + 1;
    const size_t channels = (size_t)x->channels;
    float *to = x->data;
    for (int n = 0; n < 2; n++)
        for (int oy = 0; oy < h; oy++)
            for (int ox = 0; ox < w; ox++, to += channels) {
                const float *from = x->data +
                    (((size_t)n * (size_t)x->h + 2 * (size_t)oy) * (size_t)x->w + 2 * (size_t)ox) * channels;
                for (size_t c = 0; c < channels; c++) {
                    float most = from[c];
                    for (size_t i = 1; i < 9; i++) {
                        const float v = from[(i / 3 * (size_t)x->w + i % 3) * channels + c];
                        if (v > most) most = v;
                    }
                    to[c] = most;
                }
            }
    x->h = h;
    x->w = w;
}

static double norm(const float *v, int channels)
{
    double sum = 0;
    for (int c = 0; c < channels; c++) sum += (double)v[c] * (double)v[c];
    return sqrt(sum) + 1e-10;
}

typedef struct distance_job {
    const pair *y;
    const float *head;
    double *row;
} distance_job;

static void distance_of_rows(const void *job, int64_t begin, int64_t end)
{
    const distance_job *j = job;
    const pair *y = j->y;
    const size_t channels = (size_t)y->channels, picture = (size_t)y->h * (size_t)y->w * channels;
    for (int64_t r = begin; r < end; r++) {
        j->row[r] = 0;
        for (int x = 0; x < y->w; x++) {
            const float *a = y->data + ((size_t)r * (size_t)y->w + (size_t)x) * channels, *b = a + picture;
            const double na = norm(a, y->channels), nb = norm(b, y->channels);
            for (size_t c = 0; c < channels; c++) {
                const double d = (double)a[c] / na - (double)b[c] / nb;
                j->row[r] += (double)j->head[c] * d * d;
            }
        }
    }
}

/* One term; NaN without memory. */
static double distance(const pair *y, const float *head)
{
    double *row = malloc((size_t)y->h * sizeof *row), sum = 0;
    if (!row) return NAN;
    ts_for(0, y->h, 1, distance_of_rows, &(distance_job){y, head, row});
    for (int r = 0; r < y->h; r++) sum += row[r];
    free(row);
    return sum / ((double)y->h * y->w);
}

double ev_lpips_distance(ev_lpips *net, int h, int w, const float *a, const float *b, double tap[EV_LPIPS_TAPS])
{
    static const float shift[3] = {-.030f, -.088f, -.188f}, scale[3] = {.458f, .448f, .450f};
    const size_t values = (size_t)h * (size_t)w * 3;
    if (h < EV_LPIPS_SIDE || w < EV_LPIPS_SIDE) return NAN;
    pair x = {h, w, 3, work(net, 0, 2 * values)}, y;
    if (!x.data) return NAN;
    for (size_t i = 0; i < 2 * values; i++) {
        const float v = i < values ? a[i] : b[i - values];
        x.data[i] = (2 * v - 1 - shift[i % 3]) / scale[i % 3];
    }
    double sum = 0;
    for (int l = 0; l < EV_LPIPS_TAPS; l++) {
        if (layer[l].pool) pool(&x);
        if (!convolve(net, l, &x, &y, (l + 1) % 2)) return NAN;
        const double d = distance(&y, net->head[l]);
        if (tap) tap[l] = d;
        sum += d;
        x = y;
    }
    return sum;
}
