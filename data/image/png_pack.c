/* PNG specification, third edition: chunks (5), the filter Average (9.2) and the zlib stream (10). libdeflate wants all
 * rows at once; of a picture that is too large for that they go through zlib's stream. */
#include "data/image/png_pack.h"
#include <libdeflate.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <zlib.h>

enum {
    AT_ONCE = 64 << 20, /* bytes of rows that are held together */
    PART = 1 << 20,     /* of the compressed stream, a chunk where it comes in parts */
    CHUNK = 12,         /* length, type, checksum */
    AVERAGE = 3         /* of left and above: what matches are found in is 3 to 10% smaller than by Paeth's */
};

struct io_png_pack {
    const char *name;
    size_t stride;        /* bytes of a row */
    int step;             /* of a pixel */
    unsigned char *above; /* the last row, behind a pixel of zeros */
    unsigned char *rows;  /* filtered, each behind its filter's number: all of them, or the one that is put */
    size_t filled, total; /* bytes of rows */
    unsigned char *file;
    size_t size, capacity;
    bool at_once;
    z_stream stream;
};

static ts_code no_memory(const io_png_pack *p, ts_status *st)
{
    return ts_fail(st, TS_NOMEM, "%s: out of memory", p->name);
}

static void put32(unsigned char *to, uint32_t v)
{
    for (int i = 0; i < 4; i++) to[i] = (unsigned char)(v >> (24 - 8 * i));
}

static bool reserve(io_png_pack *p, size_t more)
{
    if (p->size + more <= p->capacity) return true;
    const size_t capacity = p->size + more + p->capacity / 2;
    unsigned char *file = realloc(p->file, capacity);
    if (!file) return false;
    p->file = file;
    p->capacity = capacity;
    return true;
}

/* Round the data that stands 8 bytes behind the file's end; there is room for 12 bytes more than it. */
static void end_chunk(io_png_pack *p, const char *type, size_t size)
{
    unsigned char *at = p->file + p->size;
    put32(at, (uint32_t)size);
    memcpy(at + 4, type, 4);
    put32(at + 8 + size, libdeflate_crc32(0, at + 4, size + 4));
    p->size += size + CHUNK;
}

static void put_chunk(io_png_pack *p, const char *type, const unsigned char *data, size_t size)
{
    memcpy(p->file + p->size + 8, data, size);
    end_chunk(p, type, size);
}

static void put_head(io_png_pack *p, int width, int height, int channels, int bits, bool srgb)
{
    static const unsigned char type[] = {0, 4, 2, 6};
    static const uint32_t chromaticities[] = {31270, 32900, 64000, 33000, 30000, 60000, 15000, 6000};
    unsigned char data[32] = {0};
    memcpy(p->file, "\x89PNG\r\n\x1a\n", p->size = 8);
    put32(data, (uint32_t)width);
    put32(data + 4, (uint32_t)height);
    data[8] = (unsigned char)bits;
    data[9] = type[channels - 1];
    data[10] = data[11] = data[12] = 0;
    put_chunk(p, "IHDR", data, 13);
    if (!srgb) return;
    put32(data, 45455); /* what a reader without the sRGB chunk goes by */
    put_chunk(p, "gAMA", data, 4);
    put_chunk(p, "sRGB", (const unsigned char[]){3}, 1); /* absolute colorimetric */
    for (int i = 0; i < 8; i++) put32(data + 4 * i, chromaticities[i]);
    put_chunk(p, "cHRM", data, sizeof data);
}

io_png_pack *io_png_pack_begin(const char *name, int width, int height, int channels, int bits, bool srgb,
                               ts_status *st)
{
    const size_t step = (size_t)(channels * bits / 8), stride = (size_t)width * step;
    io_png_pack *p = calloc(1, sizeof *p);
    if (!p) return ts_fail(st, TS_NOMEM, "%s: out of memory", name), NULL;
    *p = (io_png_pack){.name = name, .stride = stride, .step = (int)step, .total = (stride + 1) * (size_t)height};
    p->at_once = p->total <= AT_ONCE;
    p->above = calloc(step + stride, 1);
    p->rows = malloc(p->at_once ? p->total : stride + 1);
    if (!p->above || !p->rows || !reserve(p, 4096) ||
        (!p->at_once && deflateInit2(&p->stream, 1, Z_DEFLATED, 15, 9, Z_RLE) != Z_OK)) {
        no_memory(p, st);
        io_png_pack_free(&p);
        return NULL;
    }
    put_head(p, width, height, channels, bits, srgb);
    return p;
}

/* What has come out of the stream, at the file's end, as a chunk. */
static void end_part(io_png_pack *p)
{
    const size_t size = (size_t)(p->stream.next_out - (p->file + p->size + 8));
    if (size) end_chunk(p, "IDAT", size);
    p->stream.next_out = NULL;
}

static ts_code stream(io_png_pack *p, unsigned char *from, size_t size, int flush, ts_status *st)
{
    p->stream.next_in = from;
    p->stream.avail_in = (uInt)size;
    for (;;) {
        if (!p->stream.next_out) {
            if (!reserve(p, PART + CHUNK)) return no_memory(p, st);
            p->stream.next_out = p->file + p->size + 8;
            p->stream.avail_out = PART;
        }
        const int state = deflate(&p->stream, flush);
        if (state == Z_STREAM_END) end_part(p);
        if (state == Z_STREAM_END || (flush == Z_NO_FLUSH && p->stream.avail_in == 0)) return TS_OK;
        if (p->stream.avail_out == 0) end_part(p);
    }
}

ts_code io_png_pack_row(io_png_pack *p, const unsigned char *row, ts_status *st)
{
    unsigned char *restrict to = p->rows + p->filled, *restrict above = p->above + p->step;
    const unsigned char *restrict x = row;
    const size_t step = (size_t)p->step;
    *to++ = AVERAGE;
    for (size_t i = 0; i < step; i++) to[i] = (unsigned char)(x[i] - above[i] / 2);
    for (size_t i = step; i < p->stride; i++) to[i] = (unsigned char)(x[i] - (x[i - step] + above[i]) / 2);
    memcpy(above, x, p->stride);
    if (!p->at_once) return stream(p, p->rows, p->stride + 1, Z_NO_FLUSH, st);
    p->filled += p->stride + 1;
    return TS_OK;
}

static ts_code compress_at_once(io_png_pack *p, ts_status *st)
{
    /* Higher levels find no more in filtered rows, and take longer. */
    struct libdeflate_compressor *c = libdeflate_alloc_compressor(1);
    const size_t most = c ? libdeflate_zlib_compress_bound(c, p->total) : 0;
    if (!c || !reserve(p, most + 2 * CHUNK)) {
        libdeflate_free_compressor(c);
        return no_memory(p, st);
    }
    const size_t size = libdeflate_zlib_compress(c, p->rows, p->total, p->file + p->size + 8, most);
    libdeflate_free_compressor(c);
    end_chunk(p, "IDAT", size);
    return TS_OK;
}

ts_code io_png_pack_end(io_png_pack *p, unsigned char **bytes, size_t *size, ts_status *st)
{
    ts_code code = p->at_once ? compress_at_once(p, st) : stream(p, p->rows, 0, Z_FINISH, st);
    if (!code && !reserve(p, CHUNK)) code = no_memory(p, st);
    if (code) return code;
    end_chunk(p, "IEND", 0);
    *bytes = p->file;
    *size = p->size;
    p->file = NULL;
    return TS_OK;
}

void io_png_pack_free(io_png_pack **pack)
{
    io_png_pack *p = *pack;
    *pack = NULL;
    if (!p) return;
    if (!p->at_once) deflateEnd(&p->stream);
    free(p->above);
    free(p->rows);
    free(p->file);
    free(p);
}
