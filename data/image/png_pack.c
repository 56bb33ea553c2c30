/* PNG specification, third edition: chunks (5), the filter Average (9.2) and the zlib stream (10). */
#include "data/image/png_pack.h"
#include "data/image/runs.h"
#include <libdeflate.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

enum {
    PART = 1 << 20, /* bytes of the compressed stream from which on a chunk ends */
    CHUNK = 12,     /* length, type, checksum */
    AVERAGE = 3     /* of left and above: what is left is 3 to 10% smaller than by Paeth's */
};

struct io_png_pack {
    const char *name;
    size_t stride;        /* bytes of a row */
    int step;             /* of a pixel */
    unsigned char *above; /* the last row, behind a pixel of zeros */
    unsigned char *rows;  /* filtered, each behind its filter's number, that are to be compressed together */
    size_t filled, room;  /* bytes of rows */
    unsigned char *file;
    size_t size, capacity;
    size_t part; /* of the stream, behind size and a chunk's head */
    io_runs stream;
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
    *p = (io_png_pack){.name = name, .stride = stride, .step = (int)step};
    p->room = stride + 1 > IO_RUNS_BLOCK ? stride + 1 : IO_RUNS_BLOCK / (stride + 1) * (stride + 1);
    p->above = calloc(step + stride, 1);
    p->rows = malloc(p->room);
    if (!p->above || !p->rows || !reserve(p, 4096)) {
        no_memory(p, st);
        io_png_pack_free(&p);
        return NULL;
    }
    put_head(p, width, height, channels, bits, srgb);
    return p;
}

/* The rows that are there go into the stream. */
static ts_code compress(io_png_pack *p, bool last, ts_status *st)
{
    if (!reserve(p, p->part + io_runs_most(p->filled) + 2 * CHUNK)) return no_memory(p, st);
    p->part += io_runs_put(&p->stream, p->rows, p->filled, last, p->file + p->size + 8 + p->part);
    p->filled = 0;
    if (last || p->part >= PART) {
        end_chunk(p, "IDAT", p->part);
        p->part = 0;
    }
    return TS_OK;
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
    p->filled += p->stride + 1;
    return p->filled == p->room ? compress(p, false, st) : TS_OK;
}

ts_code io_png_pack_end(io_png_pack *p, unsigned char **bytes, size_t *size, ts_status *st)
{
    if (compress(p, true, st)) return st->code;
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
    free(p->file);
    free(p);
}
