/* JPEG files of linear images. */
#include "data/file.h"
#include "data/image/image.h"
#include "data/image/oiio.h"
#include "data/image/srgb_code.h"
#include <stdlib.h>

/* sRGB-encoded values in [0, 1] (NaN to 0), rounded to nearest. */
static void quantise(const io_image *image, int channels, uint8_t *out)
{
    const size_t pixels = (size_t)image->width * (size_t)image->height;
    const io_srgb_codes *codes = io_srgb_codes_made();
    for (size_t i = 0; i < pixels; i++)
        for (int c = 0; c < channels; c++) {
            float v = image->data[i * (size_t)image->channels + (size_t)c];
            v = v > 0 ? v < 1 ? v : 1 : 0;
            *out++ = (uint8_t)io_srgb_code(codes, v);
        }
}

ts_code io_write_jpeg(const char *path, const io_image *image, int quality, ts_status *st)
{
    if (quality < 1 || quality > 100)
        return ts_fail(st, TS_INVALID, "%s: JPEG quality %d is not in 1 .. 100", path, quality);
    const int channels = image->channels < 3 ? 1 : 3; /* JPEG has no alpha */
    const oi_encoding e = {image->width, image->height, channels, quality};
    uint8_t *pixels = malloc((size_t)e.width * (size_t)e.height * (size_t)e.channels);
    if (!pixels) return ts_fail(st, TS_NOMEM, "%s: out of memory", path);
    quantise(image, channels, pixels);
    unsigned char *bytes = NULL;
    size_t size = 0;
    ts_code code = oi_encode_jpeg(path, &e, pixels, &bytes, &size, st);
    free(pixels);
    if (code == TS_OK) code = io_write_bytes(path, bytes, size, st);
    free(bytes);
    return code;
}
