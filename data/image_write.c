#include "data/file.h"
#include "data/image.h"
#include "data/oiio.h"
#include <stdlib.h>

/* Values in [0, 1] (NaN to 0) to integers, rounded to nearest. The alpha of four channels is never encoded. */
static void quantise(const io_image *image, int channels, int bits, bool srgb, void *out)
{
    float top = bits == 16 ? 65535 : 255;
    size_t pixels = (size_t)image->width * (size_t)image->height;
    for (size_t i = 0; i < pixels; i++)
        for (int c = 0; c < channels; c++) {
            float v = image->data[i * (size_t)image->channels + (size_t)c];
            v = v > 0 ? v < 1 ? v : 1 : 0;
            if (srgb && c < 3) v = io_linear_to_srgb(v);
            unsigned level = (unsigned)(v * top + 0.5f);
            if (bits == 16) ((uint16_t *)out)[i * (size_t)channels + (size_t)c] = (uint16_t)level;
            else ((uint8_t *)out)[i * (size_t)channels + (size_t)c] = (uint8_t)level;
        }
}

static ts_code write_image(const char *path, const io_image *image, const oi_encoding *e, bool curve, ts_status *st)
{
    void *pixels = malloc((size_t)e->width * (size_t)e->height * (size_t)e->channels * (size_t)(e->bits / 8));
    if (!pixels) return ts_fail(st, TS_NOMEM, "%s: out of memory", path);
    quantise(image, e->channels, e->bits, curve, pixels);
    unsigned char *bytes = NULL;
    size_t size = 0;
    ts_code code = oi_encode(path, e, pixels, &bytes, &size, st);
    free(pixels);
    if (code == TS_OK) code = io_write_bytes(path, bytes, size, st);
    free(bytes);
    return code;
}

ts_code io_write_png(const char *path, const io_image *image, int bits, bool srgb, ts_status *st)
{
    if (bits != 8 && bits != 16) return ts_fail(st, TS_INVALID, "%s: PNG with %d bits", path, bits);
    oi_encoding e = {.format = "png", .width = image->width, .height = image->height, .channels = image->channels, .bits = bits, .srgb = srgb};
    return write_image(path, image, &e, srgb, st);
}

ts_code io_write_jpeg(const char *path, const io_image *image, int quality, ts_status *st)
{
    if (quality < 1 || quality > 100) return ts_fail(st, TS_INVALID, "%s: JPEG quality %d is not in 1 .. 100", path, quality);
    int channels = image->channels > 3 ? 3 : image->channels; /* JPEG has no alpha */
    oi_encoding e = {.format = "jpeg", .width = image->width, .height = image->height, .channels = channels, .bits = 8, .quality = quality, .srgb = true};
    return write_image(path, image, &e, true, st);
}
