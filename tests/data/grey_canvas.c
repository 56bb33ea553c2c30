#include "tests/data/grey_canvas.h"

io_canvas grey_canvas(float *memory, int size, uint64_t index)
{
    const size_t count = (size_t)size * (size_t)size;
    io_canvas c = {.size = size,
                   .count = size * size,
                   .rng = ts_rng_make(1, TS_STREAM_TEST, index),
                   .x = memory,
                   .y = memory + count};
    float *plane = memory + 2 * count;
    c.height = plane;
    for (size_t k = 0; k < 3; k++) {
        c.diffuse[k] = plane + (1 + k) * count;
        c.specular[k] = plane + (4 + k) * count;
    }
    c.roughness = plane + 7 * count;
    c.planes = plane + CANVAS_PAINTED * count;
    cv_view(&c, 1, 0, 0);
    const io_substance grey = {{0.3f, 0.3f, 0.3f}, {0.04f, 0.04f, 0.04f}, 0.5f};
    cv_fill(&c, &grey);
    return c;
}
