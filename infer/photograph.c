#include "infer/photograph.h"
#include "nn/weights/weights.h"
#include "render/published.h"
#include <math.h>

ts_code lgd_weights_published(const char *path, bool *published, ts_status *st)
{
    nn_arch arch = {0};
    nn_file *f = nn_file_open(path, st);
    const ts_code code = f ? nn_arch_from_file(f, &arch, st) : st->code;
    *published = !code && arch.compat == NN_COMPAT_PUBLISHED;
    nn_file_close(&f);
    return code;
}

static ts_code published_square(const char *path, int64_t max_pixels, int size, int threads, io_image *square,
                                io_photo_facts *facts, ts_status *st)
{
    io_image whole;
    *square = (io_image){0};
    ts_code code = io_read_stored(path, max_pixels, rd_published.gamma, &whole, facts, st);
    if (code) return code;
    code = io_centre_square_scikit(&whole, size, threads, square, st);
    if (code) ts_context(st, "%s", path);
    const int64_t values = code ? 0 : (int64_t)size * size * 3;
    for (int64_t i = 0; i < values; i++) square->data[i] = powf(square->data[i], (float)rd_published.gamma);
    io_image_free(&whole);
    return code;
}

ts_code lgd_photograph_square(const char *path, bool published, int64_t max_pixels, int size, int threads,
                              io_image *square, io_photo_facts *facts, ts_status *st)
{
    return published ? published_square(path, max_pixels, size, threads, square, facts, st)
                     : io_read_photo_square(path, max_pixels, size, threads, square, facts, st);
}
