/* Convolution to few output channels, which would leave most lanes empty: lanes are pixels of a row instead. Rows of input are
 * transposed to [channel][column], and a block of output channels x pixels stays in registers over all taps and inputs. */
#include "tensor/conv_plan.h"
#include "tensor/threads.h"
#include <string.h>

/* In twelfths of an FMA per input, pixel and tap: panels of one vector are held back by their loads. */
static int64_t panel_cost(int oc, int pixels)
{
    const int vectors = (oc + conv_lanes() - 1) / conv_lanes();
    return (int64_t)vectors * conv_lanes() * pixels * (vectors == 1 ? 13 : 12);
}

static int padded_pixels(int pixels) { return (pixels + conv_lanes() - 1) / conv_lanes() * conv_lanes(); }

bool conv_few_channels(int oc, int k) { return k > 1 && oc <= 2 * conv_lanes() && (int64_t)15 * oc * 64 < panel_cost(oc, 64); }

bool conv_by_lanes(const conv_plan *p)
{
    const int out_w = p->w + 2 * p->fold;
    return !p->bf16 && conv_few_channels(p->oc, p->k) && (int64_t)14 * p->oc * padded_pixels(out_w) < panel_cost(p->oc, out_w);
}

/* [block of outputs][tap][input][output of the block] */
void conv_pack_few(int ic, int oc, int k, bool mirrored, const float *weight, ptrdiff_t i_step, ptrdiff_t o_step, float *packed)
{
    const int rows = ts_conv_k()->rows, blocks = (oc + rows - 1) / rows, taps = k * k;
    for (int block = 0; block < blocks; block++) {
        int begin, end;
        conv_part(oc, blocks, block, &begin, &end);
        for (int t = 0; t < taps; t++)
            for (int i = 0; i < ic; i++)
                for (int o = begin; o < end; o++) *packed++ = weight[i * i_step + o * o_step + (mirrored ? taps - 1 - t : t)];
    }
}

typedef struct rows {
    float *memory;
    ptrdiff_t plane, row; /* floats from channel to channel, and from row to row */
    int count, next;
} rows;

/* Makes the source rows first to last that are not there yet. */
static void fill(rows *s, const conv_plan *p, int image, int first, int last)
{
    const int left = -p->first, right = (p->k - 1) * p->dilation + p->first;
    for (int r = s->next > first ? s->next : first; r <= last; r++) {
        float *to = s->memory + r % s->count * s->row;
        const float *from = p->x + ((ptrdiff_t)image * p->h + r) * p->w * p->ic, *end = from + (ptrdiff_t)(p->w - 1) * p->ic;
        ts_conv_k()->transpose(from, p->w, p->ic, to + left, s->plane);
        for (int c = 0; p->replicate && c < p->ic; c++) {
            float *begin = to + c * s->plane, *behind = begin + left + p->w;
            for (int j = 0; j < left; j++) begin[j] = from[c];
            for (int j = 0; j < right; j++) behind[j] = end[c];
        }
    }
    if (last >= s->next) s->next = last + 1;
}

/* Columns outside the image are zero and stay so, but for those that padding replicates. */
static void clear_outside(const rows *s, const conv_plan *p)
{
    const int left = -p->first;
    const ptrdiff_t behind = left + p->w;
    for (ptrdiff_t i = 0; i < (ptrdiff_t)s->count * p->ic; i++) {
        float *plane = s->memory + i * s->plane;
        memset(plane, 0, sizeof(float) * (size_t)left);
        memset(plane + behind, 0, sizeof(float) * (size_t)(s->plane - behind));
    }
}

/* All outputs of extended row e as [channel][pixel]. */
static void sum_row(const conv_plan *p, const rows *s, int e, int pixels, float *out)
{
    const struct ts_conv_kernels *kernels = ts_conv_k();
    const int lanes = kernels->lanes, blocks = (p->oc + kernels->rows - 1) / kernels->rows, taps = p->k * p->k;
    ptrdiff_t x_row[15 * 15], w_row[15 * 15];
    int runs = 0, valid[15 * 15];
    for (int tap = 0; tap < taps; tap++) {
        int r = e + p->first + tap / p->k * p->dilation;
        if (p->replicate) r = conv_clamp(r, p->h);
        else if (r < 0 || r >= p->h) continue;
        x_row[runs] = r % s->count * s->row + tap % p->k * p->dilation;
        valid[runs++] = tap;
    }
    for (int o = 0; o < p->oc; o++)
        for (int j = 0; j < pixels; j++) out[(ptrdiff_t)o * pixels + j] = p->bias ? p->bias[o] : 0;
    const float *w = p->packed + conv_panels_count(p->ic, p->oc, p->k);
    for (int block = 0; block < blocks; block++) {
        int begin, end;
        conv_part(p->oc, blocks, block, &begin, &end);
        for (int i = 0; i < runs; i++) w_row[i] = (ptrdiff_t)valid[i] * p->ic * (end - begin);
        for (int j = 0; j < pixels; j += 2 * lanes) {
            const ts_sum t = {.a = w, .b = s->memory + j, .a_row = w_row, .b_row = x_row, .rows = runs, .count = p->ic, .a_stride = end - begin,
                              .b_stride = s->plane, .c = out + (ptrdiff_t)begin * pixels + j, .c_stride = pixels, .fetch = (const char *)out};
            kernels->sum[pixels - j > lanes][end - begin](&t);
        }
        w += (ptrdiff_t)taps * p->ic * (end - begin);
    }
}

/* y's row from [channel][pixel]. first: nothing has been put into it yet. */
static void put_row(const conv_plan *p, const float *out, int pixels, float *y, bool first)
{
    ts_conv_k()->collect(out + p->fold, pixels, p->w, p->oc, p->fold ? !first : p->add, p->leak, y, p->oc);
    float *end = y + (ptrdiff_t)(p->w - 1) * p->oc;
    for (int o = 0; o < p->oc; o++)
        for (int e = 0; e < p->fold; e++) {
            y[o] += out[(ptrdiff_t)o * pixels + e];
            end[o] += out[(ptrdiff_t)o * pixels + p->w + 2 * p->fold - 1 - e];
        }
}

static void run_band(const conv_plan *p, int image, int begin, int end)
{
    const int reach = (p->k - 1) * p->dilation, out_w = p->w + 2 * p->fold, pixels = padded_pixels(out_w);
    const int e0 = begin == 0 ? 0 : begin + p->fold, e1 = end == p->h ? p->h + 2 * p->fold : end + p->fold;
    rows s = {.plane = pixels + reach, .count = reach + 1 < p->h ? reach + 1 : p->h};
    s.row = s.plane * p->ic;
    s.memory = ts_scratch(0, sizeof(float) * (size_t)(s.row * s.count));
    clear_outside(&s, p);
    float *out = ts_scratch(1, sizeof(float) * (size_t)p->oc * (size_t)pixels);
    for (int e = e0, before = -1; e < e1; e++) {
        const int row = conv_clamp(e - p->fold, p->h);
        fill(&s, p, image, conv_clamp(e + p->first, p->h), conv_clamp(e + p->first + reach, p->h));
        sum_row(p, &s, e, pixels, out);
        put_row(p, out, pixels, p->y + ((ptrdiff_t)image * p->h + row) * p->w * p->oc, !p->add && row != before);
        before = row;
    }
}

void conv_run_lanes(const conv_plan *p)
{
    int bands = (16 + p->n - 1) / p->n;
    if (bands > (p->h + 7) / 8) bands = (p->h + 7) / 8;
#pragma omp parallel for collapse(2) schedule(dynamic) num_threads(ts_threads())
    for (int n = 0; n < p->n; n++)
        for (int i = 0; i < bands; i++) {
            int begin, end;
            conv_part(p->h, bands, i, &begin, &end);
            run_band(p, n, begin, end);
        }
}
