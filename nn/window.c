#include "nn/window.h"
#include "tensor/threads.h"
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

void nn_window_crop(rd_grid whole, rd_grid part, int count, int channels, const float *from, float *to)
{
    const size_t pixel = (size_t)channels, row = (size_t)part.w * pixel;
    if (from == to && nn_window_same(whole, part)) return;
        /* In place a row moves towards the begin, over rows that were moved before: one after the other. */
#pragma omp parallel for num_threads(ts_threads_of(part.threads)) schedule(static) if (from != to)
    for (int i = 0; i < count * part.h; i++) {
        const int k = i / part.h, y = i % part.h + part.y0 - whole.y0;
        memmove(
            to + (size_t)i * row,
            from + (((size_t)k * (size_t)whole.h + (size_t)y) * (size_t)whole.w + (size_t)(part.x0 - whole.x0)) * pixel,
            row * sizeof *to);
    }
}
