/* Convolution of few inputs to few output channels, which would leave most lanes empty: lanes are pixels of a row
 * instead. A strip of columns goes down the image; its rows of input, transposed to [channel][column], stay in the
 * second cache, and a tile of output channels x pixels stays in registers over all taps and inputs.
 *
 * In the shipped models this is g.output.conv2, from 9 to 9 channels: .3 % of an estimate's time (LGD_TRACE=1). The
 * direct way would fill 9 of 16 lanes there, and add in another order, so that results would have other bytes. */
#include "tensor/conv/plan.h"
#include "tensor/scratch.h"
#include "tensor/team.h"
#include "tensor/threads.h"
#include <string.h>

/* Inputs whose rows stay in the first cache over all taps, three lines of each. */
static int chunk_of(int k) { return 84 / k; }

/* [part of the outputs][chunk of inputs][tap][input][output of the part] */
void conv_pack_pixel_lanes(int ic, int oc, int k, bool mirrored, const float *weight, ptrdiff_t i_step,
                           ptrdiff_t o_step, float *packed)
{
    const int rows = ts_conv_k()->rows, parts = (oc + rows - 1) / rows, taps = k * k, chunk = chunk_of(k);
    for (int part = 0; part < parts; part++) {
        int begin, end;
        conv_part(oc, parts, part, &begin, &end);
        for (int c = 0; c < ic; c += chunk)
            for (int t = 0; t < taps; t++)
                for (int i = c; i < c + chunk && i < ic; i++)
                    for (int o = begin; o < end; o++)
                        *packed++ = weight[i * i_step + o * o_step + (mirrored ? taps - 1 - t : t)];
    }
}

/* The rows of input that the columns [begin, begin + width) of output read. */
typedef struct rows {
    float *memory;
    ptrdiff_t plane, row; /* floats from channel to channel, and from row to row */
    int begin, width, count, next;
} rows;

enum { ROWS_BYTES = 384 << 10 };

static rows rows_make(const conv_plan *p, int pixels)
{
    const int reach = (p->k - 1) * p->dilation, lanes = conv_lanes();
    rows s = {.width = 4 * lanes, .count = reach + 1 < p->h ? reach + 1 : p->h};
    for (;; s.width = 2 * lanes) {
        if (s.width > pixels) s.width = pixels;
        s.plane = s.width + conv_whole(reach);
        s.row = s.plane * p->ic;
        if (s.width <= 2 * lanes || s.row * s.count * (ptrdiff_t)sizeof(float) <= ROWS_BYTES) return s;
    }
}

/* Makes the source rows first to last that are not there yet. */
static void fill(rows *s, const conv_plan *p, int image, int first, int last)
{
    const int left = s->begin + p->first; /* the source column of the first in memory */
    const int from = conv_clamp(left, p->w), end = left + (int)s->plane < p->w ? left + (int)s->plane : p->w;
    for (int r = s->next > first ? s->next : first; r <= last; r++) {
        float *to = s->memory + r % s->count * s->row;
        const float *x = p->x + ((ptrdiff_t)image * p->h + r) * p->w * p->ic;
        if (end > from)
            ts_conv_k()->transpose(x + (ptrdiff_t)from * p->ic, p->ic, end - from, p->ic, to + from - left, s->plane);
        if (left >= 0 && end == left + s->plane) continue;
        const float *before = x, *behind = x + (ptrdiff_t)(p->w - 1) * p->ic;
        for (int c = 0; c < p->ic; c++) {
            float *plane = to + c * s->plane;
            for (int j = left; j < 0; j++) plane[j - left] = p->replicate ? before[c] : 0;
            for (int j = end > left ? end : left; j < left + s->plane; j++)
                plane[j - left] = p->replicate ? behind[c] : 0;
        }
    }
    if (last >= s->next) s->next = last + 1;
}

/* The strip's outputs of extended row e as [channel][pixel]. */
static void sum_row(const conv_plan *p, const rows *s, int e, float *out)
{
    const struct ts_conv_kernels *kernels = ts_conv_k();
    const int lanes = kernels->lanes, parts = (p->oc + kernels->rows - 1) / kernels->rows, taps = p->k * p->k,
              chunk = chunk_of(p->k);
    int runs = 0, valid[15 * 15];
    ptrdiff_t at[15 * 15];
    for (int tap = 0; tap < taps; tap++) {
        int r = e + p->first + tap / p->k * p->dilation;
        if (p->replicate) r = conv_clamp(r, p->h);
        else if (r < 0 || r >= p->h) continue;
        at[runs] = r % s->count * s->row + tap % p->k * p->dilation;
        valid[runs++] = tap;
    }
    for (int o = 0; o < p->oc; o++)
        for (int j = 0; j < s->width; j++) out[(ptrdiff_t)o * s->width + j] = p->bias ? p->bias[o] : 0;
    const float *w = p->packed + conv_panels_count(p->ic, p->oc, p->k);
    for (int part = 0; part < parts; part++) {
        int begin, end;
        conv_part(p->oc, parts, part, &begin, &end);
        for (int c = 0; c < p->ic; c += chunk) {
            ptrdiff_t x_row[15 * 15], w_row[15 * 15];
            const int count = p->ic - c < chunk ? p->ic - c : chunk;
            for (int i = 0; i < runs; i++) {
                x_row[i] = at[i] + c * s->plane;
                w_row[i] = (ptrdiff_t)valid[i] * count * (end - begin);
            }
            for (int j = 0; j < s->width; j += 2 * lanes) {
                const ts_sum t = {.a = w,
                                  .b = s->memory + j,
                                  .a_row = w_row,
                                  .b_row = x_row,
                                  .rows = runs,
                                  .count = count,
                                  .a_stride = end - begin,
                                  .b_stride = s->plane,
                                  .c = out + (ptrdiff_t)begin * s->width + j,
                                  .c_stride = s->width};
                kernels->sum_near[s->width - j > lanes][end - begin](&t);
            }
            w += (ptrdiff_t)taps * count * (end - begin);
        }
    }
}

/* y's row from the strip's [channel][pixel]. first: nothing has been put into these columns of it yet. What the
 * extended domain has outside is added to the border pixel, which is there: it lies in this strip, or in the one
 * before. */
static void put_row(const conv_plan *p, const rows *s, const float *out, float *y, bool first)
{
    const int begin = s->begin > p->fold ? s->begin - p->fold : 0, inside = s->begin + s->width - p->fold,
              end = inside < p->w ? inside : p->w; /* columns of y */
    if (end > begin)
        ts_conv_k()->collect(out + begin + p->fold - s->begin, s->width, end - begin, p->oc,
                             p->fold ? !first : p->base != NULL, p->leak, y + (ptrdiff_t)begin * p->oc, p->oc);
    for (int j = 0; j < s->width; j++) {
        const int at = s->begin + j - p->fold;
        if ((at >= 0 && at < p->w) || at >= p->w + p->fold) continue;
        float *to = y + (at < 0 ? 0 : (ptrdiff_t)(p->w - 1) * p->oc);
        for (int o = 0; o < p->oc; o++) to[o] += out[(ptrdiff_t)o * s->width + j];
    }
}

static void run_band(const conv_plan *p, int image, int begin, int end)
{
    const int reach = (p->k - 1) * p->dilation, pixels = conv_whole(p->w + 2 * p->fold);
    const int e0 = begin == 0 ? 0 : begin + p->fold, e1 = end == p->h ? p->h + 2 * p->fold : end + p->fold;
    rows s = rows_make(p, pixels);
    s.memory = ts_scratch(0, sizeof(float) * (size_t)(s.row * s.count));
    float *out = ts_scratch(1, sizeof(float) * (size_t)p->oc * (size_t)s.width);
    for (; s.begin < pixels; s.begin += s.width) {
        if (s.width > pixels - s.begin) s.width = pixels - s.begin;
        s.next = 0;
        for (int e = e0, before = -1; e < e1; e++) {
            const int row = conv_clamp(e - p->fold, p->h);
            fill(&s, p, image, conv_clamp(e + p->first, p->h), conv_clamp(e + p->first + reach, p->h));
            sum_row(p, &s, e, out);
            put_row(p, &s, out, p->y + ((ptrdiff_t)image * p->h + row) * p->w * p->oc, !p->base && row != before);
            before = row;
        }
    }
}

typedef struct run_job {
    const conv_plan *p;
    int bands;
} run_job;

static void run_unit(const void *job, int64_t unit)
{
    const run_job *j = job;
    int begin, end;
    conv_part(j->p->h, j->bands, (int)(unit % j->bands), &begin, &end);
    run_band(j->p, (int)(unit / j->bands), begin, end);
}

void conv_run_pixel_lanes(const conv_plan *p)
{
    int bands = (4 * ts_threads_of(p->threads) + p->n - 1) / p->n; /* each makes the rows around it anew */
    if (bands > (p->h + 7) / 8) bands = (p->h + 7) / 8;
    ts_spread_tasks(p->threads, (int64_t)p->n * bands, run_unit, &(run_job){p, bands});
}
