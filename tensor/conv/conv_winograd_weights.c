/* The gradient of the weights by Winograd's way: with V = B' x B and M = A dy A' of each tile it is G' (sum of V M over
 * the tiles) G, 36 small matrix products over tiles in place of 9 over pixels. Chunks of tiles have sums of their own,
 * so that threads do not change them. */
#include "tensor/conv/conv_winograd.h"
#include "tensor/kernels/winograd.h"
#include "tensor/scratch.h"
#include "tensor/team.h"
#include <string.h>

enum {
    CHUNKS = 8,
    GROUP_TILES = 64,        /* transformed together: long runs for the sums, */
    GROUP_BYTES = 896 << 10, /* as many as stay in the second cache */
    GROUP_TILES_LEAST = 28,
    UNITS = 4,       /* of work, at least, where the shape allows: parts of the outputs transform x anew, */
    PART_INPUTS = 16 /* and parts of the inputs, of at least so many, dy */
};

typedef struct job {
    winograd_grid g;
    const ts_conv_inputs *x;
    const float *dy;
    int first;                      /* channels of x->x */
    int padded;                     /* output channels in whole vectors */
    int group, chunks;              /* tiles transformed together; chunks of tiles */
    int parts, input_parts;         /* of the panels of outputs; of the inputs */
    ptrdiff_t in, out, plane, size; /* planes of V and of M; of the sums; and all those of a chunk */
    float *sums;                    /* [chunk][36][input][padded] */
    float *dweight;
} job;

/* Of bf16, V and M hold pairs of tiles. */
static int rows_of(const job *j, int tiles) { return j->g.bf16 ? (tiles + 1) / 2 : tiles; }

static job make_job(const ts_conv *c, bool bf16, const ts_conv_inputs *x, const float *dy)
{
    job j = {
        .g = winograd_grid_forward(c, bf16), .x = x, .dy = dy, .first = x->constants ? ts_conv_variables(c) : c->ic};
    j.padded = conv_whole(c->oc);
    j.group = GROUP_BYTES / (WINOGRAD_AREA * (int)sizeof(float) * (c->ic + j.padded));
    if (j.group > GROUP_TILES) j.group = GROUP_TILES;
    if (j.group < GROUP_TILES_LEAST) j.group = GROUP_TILES_LEAST;
    if (bf16) j.group *= 2;
    const int64_t chunks = j.g.tiles / WINOGRAD_CHUNK_TILES;
    j.chunks = chunks > CHUNKS ? CHUNKS : chunks < 1 ? 1 : (int)chunks;
    j.parts = (UNITS + j.chunks - 1) / j.chunks;
    if (j.parts > conv_panels(c->oc)) j.parts = conv_panels(c->oc);
    j.input_parts = (UNITS + j.chunks * j.parts - 1) / (j.chunks * j.parts);
    if (j.input_parts > c->ic / PART_INPUTS) j.input_parts = c->ic / PART_INPUTS;
    if (j.input_parts < 1) j.input_parts = 1;
    j.in = winograd_plane(rows_of(&j, j.group), c->ic);
    j.out = winograd_plane(rows_of(&j, j.group), j.padded);
    j.plane = (ptrdiff_t)c->ic * j.padded;
    j.size = j.plane * WINOGRAD_AREA;
    return j;
}

/* Panels [panel, end) of the outputs, which begin with channel o0 and are count channels, and inputs [i0, i1). */
typedef struct part {
    int panel, end, o0, count, i0, i1;
} part;

static part make_part(const job *j, int i)
{
    part a;
    conv_part(conv_panels(j->g.oc), j->parts, i % j->parts, &a.panel, &a.end);
    conv_part(j->g.ic, j->input_parts, i / j->parts, &a.i0, &a.i1);
    a.o0 = a.panel * 2 * conv_lanes();
    a.count = a.end * 2 * conv_lanes() < j->g.oc ? (a.end - a.panel) * 2 * conv_lanes() : j->g.oc - a.o0;
    return a;
}

static void put_sources(const job *j, part of, winograd_place tile, const float *nothing,
                        const float *pixel[WINOGRAD_OUTPUTS])
{
    ptrdiff_t at[WINOGRAD_OUTPUTS];
    winograd_targets(&j->g, tile, at);
    for (int i = 0; i < WINOGRAD_OUTPUTS; i++) pixel[i] = at[i] < 0 ? nothing : j->dy + at[i] + of.o0;
}

static ts_winograd_form form_of(const job *j, int tile)
{
    return !j->g.bf16 ? TS_WINOGRAD_F32 : tile % 2 ? TS_WINOGRAD_ODD : TS_WINOGRAD_EVEN;
}

/* V of count channels of an array whose pixels have all of them. */
static void transform_inputs(const job *j, const float *x, int all, int count, const winograd_place *place, int tiles,
                             const float *nothing, float *v)
{
    const float *pixel[2][WINOGRAD_AREA];
    if (count < 1) return;
    winograd_sources(&j->g, x, all, nothing, place[0], pixel[0]);
    for (int i = 0; i < tiles; i++) {
        winograd_sources(&j->g, x, all, nothing, place[i + 1], pixel[(i + 1) & 1]);
        ts_winograd_k()->input[form_of(j, i)](pixel[i & 1], pixel[(i + 1) & 1], count,
                                              v + (ptrdiff_t)(j->g.bf16 ? i / 2 : i) * j->g.ic, j->in);
    }
}

/* V of a part of the inputs, and M of a part of the outputs, of some tiles. */
static void transform(const job *j, part of, int64_t first, int count, const float *nothing, float *v, float *m)
{
    const float *dy[2][WINOGRAD_OUTPUTS];
    winograd_place place[2 * GROUP_TILES + 1];
    winograd_locate(&j->g, first, count, place);
    place[count] = place[count - 1];
    const int middle = j->first < of.i0 ? of.i0 : j->first < of.i1 ? j->first : of.i1; /* where constants begin */
    transform_inputs(j, j->x->x + of.i0, j->first, middle - of.i0, place, count, nothing, v + of.i0);
    transform_inputs(j, j->x->constants ? j->x->constants + (middle - j->first) : NULL, j->g.ic - j->first,
                     of.i1 - middle, place, count, nothing, v + middle);
    put_sources(j, of, place[0], nothing, dy[0]);
    for (int i = 0; i < count; i++) {
        put_sources(j, of, place[i + 1], nothing, dy[(i + 1) & 1]);
        ts_winograd_k()->output_gradient[form_of(j, i)](
            dy[i & 1], dy[(i + 1) & 1], of.count, m + of.o0 + (ptrdiff_t)(j->g.bf16 ? i / 2 : i) * j->padded, j->out);
    }
}

/* first: nothing has been put into sums yet. */
static void add_products(const job *j, part of, int count, bool first, const float *v, const float *m, float *sums)
{
    const struct ts_conv_kernels *k = ts_conv_k();
    const int inputs = of.i1 - of.i0, parts = (inputs + k->rows - 1) / k->rows;
    const ptrdiff_t start = 0;
    for (int q = 0; q < WINOGRAD_AREA; q++)
        for (int panel = of.panel; panel < of.end; panel++) {
            const int o0 = panel * 2 * k->lanes, vectors = conv_vectors(j->g.oc, panel);
            for (int b = 0; b < parts; b++) {
                int begin, end;
                conv_part(inputs, parts, b, &begin, &end);
                begin += of.i0, end += of.i0;
                const ts_sum t = {.a = v + q * j->in + begin,
                                  .b = m + q * j->out + o0,
                                  .a_row = &start,
                                  .b_row = &start,
                                  .rows = 1,
                                  .count = rows_of(j, count),
                                  .a_stride = j->g.ic,
                                  .b_stride = j->padded,
                                  .begin = first,
                                  .c = sums + q * j->plane + (ptrdiff_t)begin * j->padded + o0,
                                  .c_stride = j->padded};
                (j->g.bf16 ? k->sum_bf16 : k->sum_near)[vectors - 1][end - begin](&t);
            }
        }
}

static void run_chunk(const job *j, int chunk, part of)
{
    const int64_t begin = j->g.tiles * chunk / j->chunks, end = j->g.tiles * (chunk + 1) / j->chunks;
    const int channels = j->g.ic > j->g.oc ? j->g.ic : j->g.oc;
    float *v = ts_scratch(0, sizeof(float) * (size_t)(j->in * WINOGRAD_AREA)),
          *m = ts_scratch(1, sizeof(float) * (size_t)(j->out * WINOGRAD_AREA));
    float *nothing = ts_scratch(3, sizeof(float) * (size_t)channels), *sums = j->sums + chunk * j->size;
    memset(nothing, 0, sizeof(float) * (size_t)channels);
    for (int64_t first = begin; first < end; first += j->group) {
        const int count = (int)(end - first < j->group ? end - first : j->group);
        transform(j, of, first, count, nothing, v, m);
        add_products(j, of, count, first == begin, v, m, sums);
    }
}

static void run_task(const void *made, int64_t i)
{
    const job *j = made;
    const int parts = j->parts * j->input_parts;
    run_chunk(j, (int)(i / parts), make_part(j, (int)(i % parts)));
}

static void reduce_inputs(const void *made, int64_t begin, int64_t end)
{
    const job *j = made;
    const int lanes = conv_lanes(), ic = j->g.ic, oc = j->g.oc;
    for (int64_t at = begin; at < end; at++) {
        const int o0 = (int)(at / ic) * lanes, i = (int)(at % ic);
        float tap[9 * 16]; /* no vector has more than 16 lanes */
        ts_winograd_k()->weights_gradient[j->g.bf16](j->sums + (ptrdiff_t)i * j->padded + o0, j->plane, j->chunks,
                                                     j->size, tap);
        for (int o = 0; o < lanes && o0 + o < oc; o++) {
            float *to = j->dweight + ((ptrdiff_t)(o0 + o) * ic + i) * 9;
            for (int t = 0; t < 9; t++) to[t] += tap[t * lanes + o];
        }
    }
}

void conv_winograd_weight_gradient(const ts_conv *c, bool bf16, const ts_conv_inputs *x, const float *dy,
                                   float *dweight)
{
    job j = make_job(c, bf16, x, dy);
    j.dweight = dweight;
    j.sums = ts_scratch(2, sizeof(float) * (size_t)(j.size * j.chunks));
    ts_spread_tasks(c->compute.threads, (int64_t)j.chunks * j.parts * j.input_parts, run_task, &j);
    ts_for(c->compute.threads, (int64_t)(j.padded / conv_lanes()) * c->ic, 1, reduce_inputs, &j);
}
