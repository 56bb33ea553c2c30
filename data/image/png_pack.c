/* PNG specification, third edition: chunks (5), the filter Average (9.2) and the zlib stream (10). ISA-L deflates the
 * noise that filtered rows are in a fourth of the time that others take. */
#include "data/image/png_pack.h"
#include <isa-l/crc.h>
#include <isa-l/igzip_lib.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

enum {
    BATCH = 64 << 10, /* bytes of filtered rows that are compressed together */
    PART = 1 << 20,   /* of the compressed stream at most, a chunk */
    CHUNK = 12,       /* length, type, checksum */
    SPACE = 1024,     /* for the chunks before the pixels; and what a stream is longer by that cannot be compressed */
    LEVEL = 1,        /* higher ones find no more in filtered rows */
    AVERAGE = 3       /* of left and above: what matches are found in is 3 to 10% smaller than by Paeth's */
};

struct io_png_pack {
    const char *name;
    size_t stride;        /* bytes of a row */
    int step;             /* of a pixel */
    unsigned char *above; /* the last row, behind a pixel of zeros */
    unsigned char *rows;  /* filtered, each behind its filter's number, of a batch */
    size_t filled, batch; /* bytes of rows */
    size_t part;          /* bytes of the stream that a chunk has at most */
    unsigned char *file;
    size_t size, capacity;
    unsigned char *work; /* the compressor's */
    struct isal_zstream stream;
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
    put32(at + 8 + size, crc32_gzip_refl(0, at + 4, size + 4));
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
    const size_t total = (stride + 1) * (size_t)height;
    io_png_pack *p = calloc(1, sizeof *p);
    if (!p) return ts_fail(st, TS_NOMEM, "%s: out of memory", name), NULL;
    *p = (io_png_pack){.name = name, .stride = stride, .step = (int)step};
    p->batch = total < BATCH ? total : stride + 1 < BATCH ? BATCH : stride + 1;
    p->part = total < PART ? total + SPACE : PART;
    p->above = calloc(step + stride, 1);
    p->rows = malloc(p->batch);
    p->work = malloc(ISAL_DEF_LVL1_MEDIUM);
    if (!p->above || !p->rows || !p->work || !reserve(p, SPACE + p->part)) {
        no_memory(p, st);
        io_png_pack_free(&p);
        return NULL;
    }
    isal_deflate_init(&p->stream);
    p->stream.gzip_flag = IGZIP_ZLIB;
    p->stream.level = LEVEL;
    p->stream.level_buf = p->work;
    p->stream.level_buf_size = ISAL_DEF_LVL1_MEDIUM;
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

/* The rows that are filled in. */
static ts_code compress(io_png_pack *p, bool last, ts_status *st)
{
    struct isal_zstream *z = &p->stream;
    z->next_in = p->rows;
    z->avail_in = (uint32_t)p->filled;
    z->end_of_stream = last;
    for (bool full = true; full;) {
        if (!z->next_out) {
            if (!reserve(p, p->part + CHUNK)) return no_memory(p, st);
            z->next_out = p->file + p->size + 8;
            z->avail_out = (uint32_t)p->part;
        }
        if (isal_deflate(z) != COMP_OK) return ts_fail(st, TS_INVALID, "%s: the compressor refuses the rows", p->name);
        full = z->avail_out == 0;
        if (full) end_part(p);
    }
    if (last && z->next_out) end_part(p);
    p->filled = 0;
    return TS_OK;
}

ts_code io_png_pack_row(io_png_pack *p, const unsigned char *row, ts_status *st)
{
    if (p->filled + p->stride + 1 > p->batch && compress(p, false, st) != TS_OK) return st->code;
    unsigned char *restrict to = p->rows + p->filled, *restrict above = p->above + p->step;
    const unsigned char *restrict x = row;
    const size_t step = (size_t)p->step;
    *to++ = AVERAGE;
    for (size_t i = 0; i < step; i++) to[i] = (unsigned char)(x[i] - above[i] / 2);
    for (size_t i = step; i < p->stride; i++) to[i] = (unsigned char)(x[i] - (x[i - step] + above[i]) / 2);
    memcpy(above, x, p->stride);
    p->filled += p->stride + 1;
    return TS_OK;
}

ts_code io_png_pack_end(io_png_pack *p, unsigned char **bytes, size_t *size, ts_status *st)
{
    if (compress(p, true, st) != TS_OK) return st->code;
    if (!reserve(p, CHUNK)) return no_memory(p, st);
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
    free(p->above);
    free(p->rows);
    free(p->work);
    free(p->file);
    free(p);
}
