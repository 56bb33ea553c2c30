#include "data/image/common_read.h"
#include "data/image/header.h"
#include "data/image/image.h"
#include "data/image/png_file.h"
#include "tests/fuzz/fuzz.h"
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <zlib.h>

enum { MOST_PIXELS = 1 << 16 };

static uint32_t take32(const uint8_t *p)
{
    return (uint32_t)p[0] << 24 | (uint32_t)p[1] << 16 | (uint32_t)p[2] << 8 | p[3];
}

/* Otherwise hardly a changed PNG would get past the checksums. */
static void mend_png(uint8_t *data, size_t size)
{
    for (size_t at = 8; at + 12 <= size;) {
        const size_t n = take32(data + at);
        if (n > size - at - 12) return;
        const uint32_t crc = (uint32_t)crc32(0, data + at + 4, (uInt)(n + 4));
        for (size_t i = 0; i < 4; i++) data[at + 8 + n + i] = (uint8_t)(crc >> (24 - 8 * i));
        at += 12 + n;
    }
}

void fuzz_photo(const uint8_t *data, size_t size)
{
    uint8_t *copy = malloc(size + 1);
    if (!copy) return;
    memcpy(copy, data, size);
    if (size > 8 && !memcmp(copy, "\x89PNG\r\n\x1a\n", 8)) mend_png(copy, size);
    const char *path = fuzz_file(copy, size);
    oi_image raw;
    io_image image;
    ts_status st = {0};
    bool read = false;
    if (!io_check_png(path, &st) && !io_read_png_file(path, MOST_PIXELS, &raw, &read, &st) && !read)
        io_read_jpeg_file(path, MOST_PIXELS, &raw, &read, &st);
    io_check_header(path, MOST_PIXELS, &st);
    if (st.code && (read || !*st.message || strchr(st.message, '\n'))) abort();
    if (read) {
        oi_free(&raw); /* what these do not take goes to OpenImageIO, which is not meant here */
        st = (ts_status){0};
        if (io_read_photo(path, MOST_PIXELS, &image, &st)) abort();
        for (int i = 0; i < image.width * image.height * image.channels; i++)
            if (!(image.data[i] >= 0)) abort(); /* a promise: no NaN, nothing negative */
        io_image_free(&image);
    }
    free(copy);
}

void fuzz_image(const uint8_t *data, size_t size)
{
    static const char *const name[] = {"i.tif", "i.exr", "i.hdr", "i.bmp", "i.tga", "i.ppm", "i.png", "i.jpg"};
    if (size < 1) return;
    const char *path = fuzz_named(name[data[0] % 8], data + 1, size - 1);
    oi_image raw;
    io_image image;
    ts_status st = {0};
    if (oi_read(path, MOST_PIXELS, 1e9, &raw, &st)) {
        if (!*st.message || strchr(st.message, '\n')) abort();
    } else oi_free(&raw);
    st = (ts_status){0};
    if (!io_read_photo(path, MOST_PIXELS, &image, &st)) io_image_free(&image);
    remove(path);
}
