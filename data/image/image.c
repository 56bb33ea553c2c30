#include "data/image/image.h"
#include "data/image/resize_scikit.h"
#include "tensor/budget.h"
#include "tensor/resize.h"
#include <stdlib.h>
#include <string.h>

ts_code io_image_create(io_image *image, int width, int height, int channels, ts_status *st)
{
    memset(image, 0, sizeof *image);
    if (width < 1 || height < 1 || channels < 1)
        return ts_fail(st, TS_INVALID, "image of %d x %d pixels, %d channels", width, height, channels);
    size_t pixels = (size_t)width * (size_t)height,
           most = (size_t)1 << 37; /* floats: half a terabyte, beyond which no allocator need be asked */
    const double bytes = (double)pixels * channels * sizeof(float);
    if (bytes > IO_LARGE && ts_budget_check(bytes, st) != TS_OK)
        return ts_context(st, "an image of %d x %d pixels", width, height);
    if (pixels <= most / (size_t)channels) image->data = calloc(pixels, (size_t)channels * sizeof(float));
    if (!image->data) return ts_fail(st, TS_NOMEM, "no memory for an image of %d x %d pixels", width, height);
    image->width = width;
    image->height = height;
    image->channels = channels;
    return TS_OK;
}

void io_image_free(io_image *image)
{
    free(image->data);
    memset(image, 0, sizeof *image);
}

static ts_code resample(const io_image *in, int threads, io_image *out, ts_status *st)
{
    ts_arena *arena = ts_arena_create(0, st);
    if (!arena) return TS_NOMEM;
    ts_tensor src = ts_view(in->data, (ts_shape){1, in->height, in->width, in->channels});
    ts_tensor dst = ts_view(out->data, (ts_shape){1, out->height, out->width, out->channels});
    ts_code code = ts_resize(&dst, &src, arena, threads, st);
    ts_arena_destroy(&arena);
    return code;
}

static ts_code resample_scikit(const io_image *in, int threads, io_image *out, ts_status *st)
{
    ts_arena *arena = ts_arena_create(0, st);
    if (!arena) return TS_NOMEM;
    const ts_taps rows = io_taps_scikit(arena, in->height, out->height),
                  columns = io_taps_scikit(arena, in->width, out->width);
    const bool fine = rows.weight && columns.weight;
    if (fine) ts_resample(1, in->channels, &rows, &columns, in->data, out->data, false, threads);
    ts_arena_destroy(&arena);
    return fine ? TS_OK
                : ts_fail(st, TS_NOMEM, "no memory to resample an image of %d x %d pixels", in->width, in->height);
}

typedef ts_code resampler(const io_image *in, int threads, io_image *out, ts_status *st);

static ts_code centre_square(const io_image *in, int size, int threads, resampler *by, io_image *out, ts_status *st)
{
    int side = in->width < in->height ? in->width : in->height, x0 = (in->width - side) / 2,
        y0 = (in->height - side) / 2;
    size_t row = (size_t)side * (size_t)in->channels;
    if (size < 1) return ts_fail(st, TS_INVALID, "an image of %d x %d pixels", size, size);
    io_image square;
    if (io_image_create(&square, side, side, in->channels, st) != TS_OK) return TS_NOMEM;
    for (int y = 0; y < side; y++)
        memcpy(square.data + (size_t)y * row,
               in->data + ((size_t)(y + y0) * (size_t)in->width + (size_t)x0) * (size_t)in->channels,
               row * sizeof(float));
    if (side == size) {
        *out = square;
        return TS_OK;
    }
    ts_code code = io_image_create(out, size, size, in->channels, st);
    if (code == TS_OK) code = by(&square, threads, out, st);
    if (code != TS_OK) io_image_free(out);
    io_image_free(&square);
    return code;
}

ts_code io_centre_square(const io_image *in, int size, int threads, io_image *out, ts_status *st)
{
    return centre_square(in, size, threads, resample, out, st);
}

ts_code io_centre_square_scikit(const io_image *in, int size, int threads, io_image *out, ts_status *st)
{
    return centre_square(in, size, threads, resample_scikit, out, st);
}
