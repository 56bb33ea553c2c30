/* Convolution row by row. Tiles of pixels inside the image read it where it is; for those at the left and right edge
 * the columns that they need are copied, with their padding, into strips of a few rows. bf16 tiles read strips alone.
 */
#include "tensor/conv/plan.h"
#include "tensor/scratch.h"
#include "tensor/team.h"
#include <string.h>

typedef struct band {
    int image, begin, end; /* rows of y */
    int panel_begin, panel_end;
    int next; /* panel whose weights will be needed after these, and are fetched meanwhile; -1: none is known */
} band;

/* Panels are taken together for a row, and the rows of taps in parts of ky, so that their weights stay in cache. */
typedef struct weight_part {
    int panels, ky;
} weight_part;

static weight_part choose_weight_part(const conv_plan *p)
{
    const ptrdiff_t line = (ptrdiff_t)p->k * p->ic * 2 * conv_lanes() *
        (ptrdiff_t)sizeof(float); /* a panel's bytes for one ky */
    ptrdiff_t ky = CONV_CACHED_BYTES / line;
    if (ky < 1) ky = 1;
    if (ky >= p->k) return (weight_part){(int)(CONV_CACHED_BYTES / (line * p->k)), p->k};
    const ptrdiff_t parts = (p->k + ky - 1) / ky;
    return (weight_part){1, (int)((p->k + parts - 1) / parts)};
}

/* A source of pixels for tiles [begin, end): a strip, or the image itself. */
typedef struct source {
    int begin, end;
    conv_window window;  /* rows == 0: the image */
    const float *pixel0; /* column that tap 0 of output column 0 reads, in memory terms */
    ptrdiff_t pixel;
    ts_segment segment[15 * 15];
    int segments;
} source;

typedef struct runner {
    const conv_plan *p;
    const band *b;
    int out_w, tiles, tile_size, larger; /* the first so many tiles have a pixel more */
    int sources;
    source source[3];
    float *extended; /* a row of the larger domain */
} runner;

static void tile_range(const runner *r, int tile, int *begin, int *end)
{
    *begin = tile * r->tile_size + (tile < r->larger ? tile : r->larger);
    *end = *begin + r->tile_size + (tile < r->larger);
}

enum { WHOLE_ROWS = 16 }; /* of an image that is not worth cutting into bands */

/* Which tiles lie inside, and strips for the others. */
static void make_sources(runner *r, int rows)
{
    const conv_plan *p = r->p;
    const int reach = (p->k - 1) * p->dilation;
    int inside = 0, outside = r->tiles, begin, end; /* tiles [inside, outside) read the image */
    while (inside < r->tiles && (tile_range(r, inside, &begin, &end), begin + p->first < 0)) inside++;
    while (outside > inside && (tile_range(r, outside - 1, &begin, &end), end - 1 + p->first + reach >= p->w))
        outside--;
    /* Strides of a multiple of 2 KiB put all pixels of a tile into two sets of the first cache: copy all. */
    if (inside >= outside || p->ic % 512 == 0 || p->bf16) inside = r->tiles, outside = r->tiles;
    const int cut[4] = {0, inside, outside, r->tiles};
    float *memory = NULL;
    size_t used = 0;
    r->sources = 0;
    for (int pass = 0; pass < 2; pass++) { /* sizes first, then places */
        if (pass) memory = ts_scratch(0, used * sizeof(float));
        used = 0;
        r->sources = 0;
        for (int i = 0; i < 3; i++) {
            if (cut[i] == cut[i + 1]) continue;
            source *s = &r->source[r->sources++];
            int first, last, unused;
            s->begin = cut[i];
            s->end = cut[i + 1];
            tile_range(r, s->begin, &first, &unused);
            tile_range(r, s->end - 1, &unused, &last);
            if (i == 1) {
                s->window.rows = 0;
                s->pixel = p->ic;
                s->pixel0 = p->x + (ptrdiff_t)r->b->image * p->h * p->w * p->ic + (ptrdiff_t)p->first * p->ic;
            } else {
                s->window = conv_window_make(p, rows, first + p->first, last - first + reach);
                s->pixel = s->window.pixel;
                if (pass) {
                    s->window.memory = memory + used;
                    s->pixel0 = s->window.memory - first * s->pixel;
                }
                used += conv_window_size(&s->window);
            }
        }
    }
}

/* The runs of k for extended output row e and kernel rows [ky0, ky1). */
static void make_segments(const runner *r, source *s, int e, int ky0, int ky1)
{
    const conv_plan *p = r->p;
    const bool merged = p->dilation == 1 && s->pixel == p->ic;
    s->segments = 0;
    for (int ky = ky0; ky < ky1; ky++) {
        int row = e + p->first + ky * p->dilation;
        if (p->replicate) row = conv_clamp(row, p->h);
        else if (row < 0 || row >= p->h) continue;
        const ptrdiff_t at = s->window.rows ? conv_window_row(&s->window, row) - s->window.memory
                                            : (ptrdiff_t)row * p->w * p->ic;
        const ptrdiff_t w = (ptrdiff_t)ky * p->k * p->ic;
        if (merged) s->segment[s->segments++] = (ts_segment){at, w, (ptrdiff_t)p->k * p->ic};
        else
            for (int kx = 0; kx < p->k; kx++)
                s->segment[s->segments++] = (ts_segment){at + kx * p->dilation * s->pixel, w + (ptrdiff_t)kx * p->ic,
                                                         p->ic};
    }
}

/* Whether y has a pixel of its own for all of the larger domain's columns [begin, end). */
static bool lies_inside(const conv_plan *p, int begin, int end) { return begin >= p->fold && end <= p->fold + p->w; }

/* Adds (or on first touch puts) the tiles of a row that do not lie inside to y's row: first the columns that y has,
 * then those beyond them, which belong to its border. */
static void fold_row(const runner *r, float *y, int channels, bool first)
{
    const conv_plan *p = r->p;
    for (int beyond = 0; beyond < 2; beyond++)
        for (int tile = 0; tile < r->tiles; tile++) {
            int begin, end;
            tile_range(r, tile, &begin, &end);
            if (lies_inside(p, begin, end)) continue;
            for (int e = begin; e < end; e++) {
                const float *from = r->extended + (ptrdiff_t)e * channels;
                float *to = y + (ptrdiff_t)conv_clamp(e - p->fold, p->w) * p->oc;
                if (lies_inside(p, e, e + 1) == beyond) continue;
                for (int o = 0; o < channels; o++) to[o] = first && !beyond ? from[o] : to[o] + from[o];
            }
        }
}

/* One output row of panels [panel0, panel1). first: nothing has been put into y's row yet. */
static void run_row(runner *r, int e, int ky0, int ky1, int panel0, int panel1, bool first)
{
    const conv_plan *p = r->p;
    const int reach = (p->k - 1) * p->dilation, lanes2 = 2 * conv_lanes();
    ptrdiff_t depth = 0;
    for (int i = 0; i < r->sources; i++) {
        source *s = &r->source[i];
        if (s->window.rows)
            conv_window_fill(&s->window, p, r->b->image, conv_clamp(e + p->first, p->h),
                             conv_clamp(e + p->first + reach, p->h));
        make_segments(r, s, e, ky0, ky1);
        depth = s->segments ? s->segments * s->segment[0].count : 0;
    }
    float *y = p->y + ((ptrdiff_t)r->b->image * p->h + conv_clamp(e - p->fold, p->h)) * p->w * p->oc;
    const ptrdiff_t calls = depth / 4 > 0 ? depth / 4 : 1;
    for (int panel = panel0; panel < panel1; panel++) {
        ts_tile t = conv_panel_tile(p, panel);
        const int o0 = panel * lanes2, channels = t.channels < lanes2 ? t.channels : lanes2;
        if (ky1 < p->k) t.leak = 1;
        /* The output of the next tile is fetched in time: stores that miss would hold up what follows. */
        t.fetch_step[1] = r->tile_size * (ptrdiff_t)p->oc * (ptrdiff_t)sizeof(float) / calls;
        for (int i = 0; i < r->sources; i++) {
            const source *s = &r->source[i];
            t.segment = s->segment;
            t.segments = s->segments;
            t.a_stride = s->pixel;
            /* So is its newest input row while the first panel passes by; a strip is in the cache. */
            const float *fresh = NULL;
            if (panel == panel0 && s->segments && !s->window.rows) {
                const ts_segment *newest = &s->segment[s->segments - 1];
                fresh = s->pixel0 + newest->a +
                    (newest->count == p->ic ? 0 : reach) *
                        s->pixel; /* it begins at the row's last tap, or at its first */
            }
            t.fetch_step[0] = fresh ? r->tile_size * s->pixel * (ptrdiff_t)sizeof(float) / calls : 0;
            const float *coming = NULL;
            ptrdiff_t share = 0; /* of the coming weights for a tile, in floats */
            if (!fresh && r->b->next >= 0) {
                share = (ptrdiff_t)p->k * p->k * p->ic * lanes2 / ((ptrdiff_t)p->n * p->h * r->tiles);
                coming = conv_panel_tile(p, r->b->next).w +
                    share * r->tiles * ((ptrdiff_t)r->b->image * p->h + conv_clamp(e - p->fold, p->h));
                t.fetch_step[0] = share * (ptrdiff_t)sizeof(float) / calls;
            }
            for (int tile = s->begin; tile < s->end; tile++) {
                int begin, end;
                tile_range(r, tile, &begin, &end);
                t.fetch[0] = fresh ? fresh + end * s->pixel : coming ? coming + share * tile : p->packed;
                t.fetch[1] = y + o0 + (ptrdiff_t)(end - p->fold) * p->oc;
                const bool inside = lies_inside(p, begin, end);
                t.add = inside && !first;
                t.y_stride = inside ? p->oc : channels;
                conv_run_tile(&t, conv_vectors(p->oc, panel), s->pixel0 + begin * s->pixel,
                              inside ? y + o0 + (ptrdiff_t)(begin - p->fold) * p->oc
                                     : r->extended + (ptrdiff_t)begin * channels,
                              end - begin, p->bf16);
            }
        }
        if (p->fold) fold_row(r, y + o0, channels, first);
    }
}

static void run_band(const conv_plan *p, weight_part part, const band *b)
{
    runner r = {.p = p, .b = b, .out_w = p->w + 2 * p->fold};
    const int reach = (p->k - 1) * p->dilation, step = ts_conv_k()->pixels;
    const int e0 = b->begin == 0 ? 0 : b->begin + p->fold, e1 = b->end == p->h ? p->h + 2 * p->fold : b->end + p->fold;
    r.tiles = (r.out_w + step - 1) / step;
    r.tile_size = r.out_w / r.tiles;
    r.larger = r.out_w % r.tiles;
    make_sources(&r, part.ky < p->k ? e1 - e0 + reach : reach + 1);
    if (p->fold) r.extended = ts_scratch(1, sizeof(float) * (size_t)r.out_w * (size_t)(2 * conv_lanes()));
    for (int panel0 = b->panel_begin; panel0 < b->panel_end; panel0 += part.panels) {
        const int panel1 = panel0 + part.panels < b->panel_end ? panel0 + part.panels : b->panel_end;
        if (part.ky == p->k)
            for (int i = 0; i < r.sources; i++) r.source[i].window.next = 0;
        for (int ky = 0; ky < p->k; ky += part.ky) {
            const int ky_end = ky + part.ky < p->k ? ky + part.ky : p->k;
            for (int e = e0, before = -1; e < e1; e++) {
                const int row = conv_clamp(e - p->fold, p->h);
                run_row(&r, e, ky, ky_end, panel0, panel1, !p->base && ky == 0 && row != before);
                before = row;
            }
        }
    }
}

typedef struct run_job {
    const conv_plan *p;
    weight_part part;
    int bands, groups, panels;
    bool weighty, fetches; /* a group fetches the weights of the next */
} run_job;

/* Neighbouring units share what there is more of: weights, or rows. */

static void run_unit(const void *job, int64_t unit)
{
    const run_job *j = job;
    const conv_plan *p = j->p;
    const int all = p->n * j->bands, g = (int)(j->weighty ? unit / all : unit % j->groups),
              i = (int)(j->weighty ? unit % all : unit / j->groups);
    band b = {.image = i / j->bands, .next = j->fetches && g + 1 < j->panels ? g + 1 : -1};
    conv_part(p->h, j->bands, i % j->bands, &b.begin, &b.end);
    conv_part(j->panels, j->groups, g, &b.panel_begin, &b.panel_end);
    run_band(p, j->part, &b);
}

void conv_run_direct(const conv_plan *p)
{
    const weight_part part = choose_weight_part(p);
    const int panels = conv_panels(p->oc);
    /* Bands as long as the number of units allows: each copies its halo anew. */
    int bands = (16 + p->n - 1) / p->n;
    if (bands > (p->h + 3) / 4) bands = (p->h + 3) / 4;
    int groups = p->n * bands < 8 ? (8 + p->n * bands - 1) / (p->n * bands) : 1;
    /* More weights than values: a part of them stays in the second cache while all images pass by, and where it is a
     * panel those who come to it next have it fetched. */
    const int parts = (panels + part.panels - 1) / part.panels;
    const bool weighty = (ptrdiff_t)p->k * p->k * p->oc > (ptrdiff_t)p->n * p->h * p->w;
    if (weighty && groups < parts) groups = parts;
    if (groups > panels) groups = panels;
    if (weighty && p->h <= WHOLE_ROWS && groups * p->n >= 8) bands = 1;
    const bool fetch = weighty && part.ky == p->k && bands == 1 && groups == panels;
    ts_spread_tasks(p->threads, (int64_t)groups * p->n * bands, run_unit,
                    &(run_job){p, part, bands, groups, panels, weighty, fetch});
}
