/* Panels of packed weights and the register tiles that multiply them: what the ways have in common. */
#include "tensor/conv/plan.h"

ptrdiff_t conv_panels_count(int ic, int oc, int k) { return (ptrdiff_t)conv_whole(oc) * ic * k * k; }

ts_tile conv_panel_tile(const conv_plan *p, int panel)
{
    const int o0 = panel * 2 * conv_lanes();
    return (ts_tile){.w = p->packed + (ptrdiff_t)o0 * p->ic * p->k * p->k,
                     .bias = p->bias ? p->bias + o0 : NULL,
                     .channels = p->oc - o0,
                     .add = p->base != NULL,
                     .leak = p->leak,
                     .y_stride = p->oc,
                     .fetch = {p->packed, p->packed}};
}

void conv_run_tile(ts_tile *t, int vectors, const float *a, float *y, int pixels, bool bf16)
{
    for (int g = 0; g < 3; g++) {
        const int at = g * TS_TILE_GROUP < pixels ? g * TS_TILE_GROUP : 0;
        t->a[g] = a + at * t->a_stride;
        t->y[g] = y + at * t->y_stride;
    }
    (bf16 ? ts_conv_k()->tile_bf16 : ts_conv_k()->tile)[vectors - 1][pixels](t);
}

enum { PANELS_TOGETHER = 8 };

/* Panels [panel0, panel1), at most PANELS_TOGETHER of them. */
static void run_together(const conv_plan *p, ptrdiff_t first, ptrdiff_t count, int panel0, int panel1)
{
    const ptrdiff_t tiles = (count + ts_conv_k()->pixels - 1) / ts_conv_k()->pixels,
                    step = (count + tiles - 1) / tiles; /* a short last tile would wait for its own sums */
    const ptrdiff_t panels = panel1 - panel0, calls = (p->ic + 3) / 4;
    const ts_segment segment = {0, 0, p->ic};
    ts_tile tile[PANELS_TOGETHER];
    /* Each panel fetches its share of the next tile's input and output: few k leave no time to wait for memory. */
    const ptrdiff_t x_part = step * p->ic / panels, y_part = step * p->oc / panels;
    for (int i = 0; i < panels; i++) {
        tile[i] = conv_panel_tile(p, panel0 + i);
        tile[i].segment = &segment;
        tile[i].segments = 1;
        tile[i].a_stride = p->ic;
        tile[i].fetch_step[0] = x_part * (ptrdiff_t)sizeof(float) / calls;
        tile[i].fetch_step[1] = y_part * (ptrdiff_t)sizeof(float) / calls;
    }
    for (ptrdiff_t j = 0; j < count; j += step) {
        const float *x = p->x + (first + j) * p->ic;
        float *y = p->y + (first + j) * p->oc;
        for (int i = 0; i < panels; i++) {
            tile[i].fetch[0] = x + step * p->ic + i * x_part;
            tile[i].fetch[1] = y + step * p->oc + i * y_part;
            conv_run_tile(&tile[i], conv_vectors(p->oc, panel0 + i), x, y + (panel0 + i) * 2 * conv_lanes(),
                          (int)(count - j < step ? count - j : step), p->bf16);
        }
    }
}

void conv_run_pixels(const conv_plan *p, ptrdiff_t first, ptrdiff_t count, int panel0, int panel1)
{
    ptrdiff_t together = CONV_CACHED_BYTES / ((ptrdiff_t)p->ic * 2 * conv_lanes() * (ptrdiff_t)sizeof(float));
    if (together < 1) together = 1;
    if (together > PANELS_TOGETHER) together = PANELS_TOGETHER;
    for (int base = panel0; base < panel1; base += (int)together)
        run_together(p, first, count, base, base + together < panel1 ? base + (int)together : panel1);
}
