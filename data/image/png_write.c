/* PNG files from rows that are made while they are written: a picture of many panels never lies in memory as floats. */
#include "data/file.h"
#include "data/image/image.h"
#include <png.h>
#include <math.h>
#include <pthread.h>
#include <stdlib.h>
#include <string.h>
#include <zlib.h>

/* The least float whose sRGB-encoded value rounds to each of the 256 levels, and the level of the middle of each of
 * GUESSES steps: eight bits without a power for every value, and the same bytes as with it. */
enum { GUESSES = 4096 };
static float threshold[257];
static unsigned char guess[GUESSES + 1];

static unsigned level_of(float v, float top) { return (unsigned)(io_linear_to_srgb(v) * top + 0.5f); }

static void make_levels(void)
{
    threshold[0] = -1;
    threshold[256] = INFINITY;
    for (unsigned k = 1; k < 256; k++) {
        float below = k == 1 ? 0 : threshold[k - 1], at = 1;
        for (;;) {
            const float middle = below + (at - below) * 0.5f;
            if (middle <= below || middle >= at) break;
            if (level_of(middle, 255) >= k) at = middle;
            else below = middle;
        }
        threshold[k] = at;
    }
    for (int i = 0, k = 0; i <= GUESSES; i++) {
        while (threshold[k + 1] <= (float)i / GUESSES) k++;
        guess[i] = (unsigned char)k;
    }
}

static unsigned srgb_level(float v)
{
    unsigned k = guess[(int)(v * GUESSES)];
    while (v >= threshold[k + 1]) k++;
    return k;
}

/* Values in [0, 1] (NaN to 0) to integers, rounded to nearest, big-endian. The alpha of four channels is never encoded.
 */
static void quantise(const float *values, size_t pixels, int channels, int bits, bool srgb, png_byte *out)
{
    static pthread_once_t once = PTHREAD_ONCE_INIT;
    if (srgb && bits == 8) pthread_once(&once, make_levels);
    for (size_t i = 0; i < pixels; i++)
        for (int c = 0; c < channels; c++) {
            float v = *values++;
            v = v > 0 ? v < 1 ? v : 1 : 0;
            const bool curve = srgb && c < 3;
            if (bits == 8) *out++ = (png_byte)(curve ? srgb_level(v) : (unsigned)(v * 255 + 0.5f));
            else {
                const unsigned level = curve ? level_of(v, 65535) : (unsigned)(v * 65535 + 0.5f);
                *out++ = (png_byte)(level >> 8);
                *out++ = (png_byte)(level & 255);
            }
        }
}

typedef struct writing {
    png_structp png;
    png_infop info;
    unsigned char *bytes;
    size_t size, capacity;
    float *values; /* [rows][width][channels] */
    png_byte *row;
    char message[128];
    ts_code code; /* of the row maker */
} writing;

static void on_error(png_structp png, png_const_charp message)
{
    writing *w = png_get_error_ptr(png);
    strncpy(w->message, message, sizeof w->message - 1);
    png_longjmp(png, 1);
}

static void on_warning(png_structp png, png_const_charp message)
{
    (void)png;
    (void)message;
}

static void on_write(png_structp png, png_bytep data, size_t size)
{
    writing *w = png_get_io_ptr(png);
    if (w->size + size > w->capacity) {
        const size_t capacity = (w->size + size) * 3 / 2 + 65536;
        unsigned char *bytes = realloc(w->bytes, capacity);
        if (!bytes) png_error(png, "out of memory");
        w->bytes = bytes;
        w->capacity = capacity;
    }
    memcpy(w->bytes + w->size, data, size);
    w->size += size;
}

static void on_flush(png_structp png) { (void)png; }

enum { ROWS = 16 }; /* made at once */

static bool work(writing *w, const io_rows *rows, int bits, bool srgb, ts_status *st)
{
    static const int type[] = {PNG_COLOR_TYPE_GRAY, PNG_COLOR_TYPE_GRAY_ALPHA, PNG_COLOR_TYPE_RGB,
                               PNG_COLOR_TYPE_RGB_ALPHA};
    const size_t width = (size_t)rows->width, values = width * (size_t)rows->channels;
    if (setjmp(png_jmpbuf(w->png))) return false;
    png_set_write_fn(w->png, w, on_write, on_flush);
    png_set_IHDR(w->png, w->info, (png_uint_32)rows->width, (png_uint_32)rows->height, bits, type[rows->channels - 1],
                 PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
    /* Rows predicted from their neighbours hardly repeat themselves: runs and Huffman codes alone are smaller than
     * matches and take half the time. */
    png_set_filter(w->png, PNG_FILTER_TYPE_BASE, PNG_FILTER_PAETH);
    png_set_compression_level(w->png, 1);
    png_set_compression_strategy(w->png, Z_RLE);
    if (srgb) png_set_sRGB_gAMA_and_cHRM(w->png, w->info, PNG_sRGB_INTENT_ABSOLUTE);
    png_write_info(w->png, w->info);
    for (int y = 0; y < rows->height; y += ROWS) {
        const int count = rows->height - y < ROWS ? rows->height - y : ROWS;
        w->code = rows->make(y, count, w->values, rows->user, st);
        if (w->code) return false;
        for (int i = 0; i < count; i++) {
            quantise(w->values + (size_t)i * values, width, rows->channels, bits, srgb, w->row);
            png_write_row(w->png, w->row);
        }
    }
    png_write_end(w->png, w->info);
    return true;
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
    const size_t values = (size_t)rows->width * (size_t)rows->channels;
    writing w = {.values = malloc(values * ROWS * sizeof(float)), .row = malloc(values * (size_t)(bits / 8))};
    bool done = false;
    if (w.values && w.row && (w.png = png_create_write_struct(PNG_LIBPNG_VER_STRING, &w, on_error, on_warning))) {
        png_set_user_limits(w.png, 0x7fffffff, 0x7fffffff);
        w.info = png_create_info_struct(w.png);
        done = w.info && work(&w, rows, bits, srgb, st);
        png_destroy_write_struct(&w.png, &w.info);
    }
    ts_code code = done ? TS_OK : w.code;
    if (!done && !code)
        code = w.message[0] ? ts_fail(st, TS_IO, "%s: %s", name, w.message)
                            : ts_fail(st, TS_NOMEM, "%s: out of memory", name);
    free(w.values);
    free(w.row);
    if (code) free(w.bytes);
    else *bytes = w.bytes, *size = w.size;
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
