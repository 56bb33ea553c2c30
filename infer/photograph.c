#include "infer/photograph.h"
#include "nn/weights.h"
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

ts_code lgd_photograph_read(const char *path, bool published, int64_t max_pixels, io_image *photo, ts_status *st)
{
    return published ? io_read_stored(path, max_pixels, rd_published.gamma, photo, st) : io_read_photo(path, max_pixels, photo, st);
}

ts_code lgd_photograph_square(const io_image *photo, bool published, int size, io_image *square, ts_status *st)
{
    if (!published) return io_centre_square(photo, size, square, st);
    const ts_code code = io_centre_square_scikit(photo, size, square, st);
    const int64_t values = code ? 0 : (int64_t)size * size * 3;
    for (int64_t i = 0; i < values; i++) square->data[i] = powf(square->data[i], (float)rd_published.gamma);
    return code;
}
