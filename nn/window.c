#include "nn/window.h"
#include "tensor/team.h"
#include <string.h>

bool nn_window_same(rd_grid a, rd_grid b) { return a.y0 == b.y0 && a.x0 == b.x0 && a.h == b.h && a.w == b.w; }
size_t nn_window_pixels(rd_grid g) { return (size_t)g.h * (size_t)g.w; }

static void grow(int by, int side, int *first, int *count)
{
    const int begin = *first > by ? *first - by : 0, end = *first + *count + by < side ? *first + *count + by : side;
    *first = begin;
    *count = end - begin;
}

rd_grid nn_window_grown(rd_grid g, int by)
{
    grow(by, g.side, &g.y0, &g.h);
    grow(by, g.side, &g.x0, &g.w);
    return g;
}

typedef struct crop {
    rd_grid whole, part;
    size_t pixel;
    const float *from;
    float *to;
} crop;

static void crop_rows(const void *job, int64_t begin, int64_t end)
{
    const crop *c = job;
    const size_t row = (size_t)c->part.w * c->pixel;
    for (int64_t i = begin; i < end; i++) {
        const size_t k = (size_t)(i / c->part.h), y = (size_t)(i % c->part.h + c->part.y0 - c->whole.y0);
        memmove(c->to + (size_t)i * row,
                c->from +
                    ((k * (size_t)c->whole.h + y) * (size_t)c->whole.w + (size_t)(c->part.x0 - c->whole.x0)) * c->pixel,
                row * sizeof *c->to);
    }
}

void nn_window_crop(rd_grid whole, rd_grid part, int count, int channels, const float *from, float *to)
{
    if (from == to && nn_window_same(whole, part)) return;
    /* In place a row moves towards the begin, over rows that were moved before: one after the other. */
    ts_for(from == to ? 1 : part.threads, (int64_t)count * part.h, 1, crop_rows,
           &(crop){whole, part, (size_t)channels, from, to});
}
