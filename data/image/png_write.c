/* PNG files from rows that are made while they are written: a picture of many panels never lies in memory as floats. */
#include "data/file.h"
#include "data/image/image.h"
#include "data/image/png_pack.h"
#include "data/image/srgb_code.h"
#include <stdlib.h>
#include <string.h>

static float within(float v) { return v > 0 ? v < 1 ? v : 1 : 0; }

/* Values in [0, 1] (NaN to 0) to integers, rounded to nearest, big-endian. The alpha of two and of four channels is
 * never encoded. */
static void quantise(const float *values, size_t pixels, int channels, int bits, bool srgb, unsigned char *out)
{
    const io_srgb_codes *codes = srgb && bits == 8 ? io_srgb_codes_made() : NULL;
    const size_t count = pixels * (size_t)channels;
    const int alpha = channels % 2 == 0 ? channels - 1 : channels;
    if (codes && alpha == channels) {
        for (size_t i = 0; i < count; i++) out[i] = (unsigned char)io_srgb_code(codes, within(values[i]));
        return;
    }
    if (!srgb && bits == 16) {
        for (size_t i = 0; i < count; i++) {
            const unsigned level = (unsigned)(within(values[i]) * 65535 + 0.5f);
            out[2 * i] = (unsigned char)(level >> 8);
            out[2 * i + 1] = (unsigned char)(level & 255);
        }
        return;
    }
    for (size_t i = 0; i < pixels; i++)
        for (int c = 0; c < channels; c++) {
            const float v = within(*values++);
            const bool curve = srgb && c < alpha;
            if (bits == 8) *out++ = (unsigned char)(curve ? io_srgb_code(codes, v) : (unsigned)(v * 255 + 0.5f));
            else {
                const unsigned level = (unsigned)((curve ? io_linear_to_srgb(v) : v) * 65535 + 0.5f);
                *out++ = (unsigned char)(level >> 8);
                *out++ = (unsigned char)(level & 255);
            }
        }
}

enum { ROWS = 16 }; /* made at once */

static ts_code make_all(const io_rows *rows, int bits, bool srgb, io_png_pack *pack, ts_status *st)
{
    const size_t width = (size_t)rows->width, values = width * (size_t)rows->channels;
    float *made = malloc(values * ROWS * sizeof *made);
    unsigned char *row = malloc(values * (size_t)(bits / 8));
    ts_code code = made && row ? TS_OK : ts_fail(st, TS_NOMEM, "out of memory for a picture's rows");
    for (int y = 0; y < rows->height && !code; y += ROWS) {
        const int count = rows->height - y < ROWS ? rows->height - y : ROWS;
        code = rows->make(y, count, made, rows->user, st);
        for (int i = 0; i < count && !code; i++) {
            quantise(made + (size_t)i * values, width, rows->channels, bits, srgb, row);
            code = io_png_pack_row(pack, row, st);
        }
    }
    free(made);
    free(row);
    return code;
}

/* The file in memory; name is for messages. bytes is malloced and the caller's. */
static ts_code encode(const char *name, const io_rows *rows, int bits, bool srgb, unsigned char **bytes, size_t *size,
                      ts_status *st)
{
    *bytes = NULL;
    *size = 0;
    if (bits != 8 && bits != 16) return ts_fail(st, TS_INVALID, "%s: PNG with %d bits", name, bits);
    if (rows->width < 1 || rows->height < 1 || rows->channels < 1 || rows->channels > 4)
        return ts_fail(st, TS_INVALID, "%s: PNG of %d x %d pixels with %d channels", name, rows->width, rows->height,
                       rows->channels);
    io_png_pack *pack = io_png_pack_begin(name, rows->width, rows->height, rows->channels, bits, srgb, st);
    if (!pack) return TS_NOMEM;
    ts_code code = make_all(rows, bits, srgb, pack, st);
    if (!code) code = io_png_pack_end(pack, bytes, size, st);
    io_png_pack_free(&pack);
    return code;
}

ts_code io_write_png_rows(const char *path, const io_rows *rows, int bits, bool srgb, ts_status *st)
{
    unsigned char *bytes;
    size_t size;
    ts_code code = encode(path, rows, bits, srgb, &bytes, &size, st);
    if (!code) code = io_write_bytes(path, bytes, size, st);
    free(bytes);
    return code;
}

static ts_code copy_rows(int y, int count, float *values, void *user, ts_status *st)
{
    const io_image *image = user;
    const size_t row = (size_t)image->width * (size_t)image->channels;
    (void)st;
    memcpy(values, image->data + (size_t)y * row, (size_t)count * row * sizeof *values);
    return TS_OK;
}

ts_code io_write_png(const char *path, const io_image *image, int bits, bool srgb, ts_status *st)
{
    io_image copy = *image; /* the row maker's pointer is not const */
    const io_rows rows = {image->width, image->height, image->channels, copy_rows, &copy};
    return io_write_png_rows(path, &rows, bits, srgb, st);
}

ts_code io_png_bytes(const io_image *image, int bits, bool srgb, unsigned char **bytes, size_t *size, ts_status *st)
{
    io_image copy = *image;
    const io_rows rows = {image->width, image->height, image->channels, copy_rows, &copy};
    return encode("a PNG in memory", &rows, bits, srgb, bytes, size, st);
}
