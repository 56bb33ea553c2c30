/* Chunks of a PNG file (PNG specification, third edition, 5.3 and 11.3.2). */
#include "data/image/png_file.h"
#include <errno.h>
#include <isa-l/crc.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

static uint32_t be32(const uint8_t *p)
{
    return (uint32_t)p[0] << 24 | (uint32_t)p[1] << 16 | (uint32_t)p[2] << 8 | p[3];
}

/* NULL where the file is no PNG (or cannot be opened, which the caller has checked). *fault: NULL, or what is wrong
 * with the first eight bytes of one. */
static FILE *open_png(const char *path, const char **fault)
{
    static const char name[] = "\x89PNG", ends[] = "\r\n\x1a\n"; /* which a copy as text changes */
    uint8_t head[8];
    FILE *f = fopen(path, "rbe");
    const size_t size = f ? fread(head, 1, 8, f) : 0;
    if (f && (size < 4 || memcmp(head, name, 4))) {
        fclose(f);
        return NULL;
    }
    *fault = size < 8 ? "cut short" : memcmp(head + 4, ends, 4) ? "its first bytes were changed, copy it again" : NULL;
    return f;
}

ts_code io_check_png(const char *path, ts_status *st)
{
    const char *fault = NULL;
    FILE *f = open_png(path, &fault);
    if (!f) return TS_OK;
    uint8_t head[8], block[16384];
    for (bool end = false; !end && !fault;) {
        if (fread(head, 1, 8, f) != 8) {
            fault = "cut short";
            break;
        }
        uint32_t left = be32(head), crc = crc32_gzip_refl(0, head + 4, 4);
        if (left > 0x7fffffff) fault = "a chunk has no valid length";
        while (left && !fault) {
            size_t n = left < sizeof block ? left : sizeof block;
            if (fread(block, 1, n, f) != n) fault = "cut short";
            else crc = crc32_gzip_refl(crc, block, n);
            left -= (uint32_t)n;
        }
        if (!fault && fread(block, 1, 4, f) != 4) fault = "cut short";
        else if (!fault && be32(block) != crc) fault = "a checksum is wrong";
        end = !memcmp(head + 4, "IEND", 4);
    }
    bool failed = ferror(f);
    fclose(f);
    if (failed) return ts_fail(st, TS_IO, "%s: %s", path, strerror(EIO));
    return fault ? ts_fail(st, TS_FORMAT, "%s: damaged PNG file: %s", path, fault) : TS_OK;
}

static const float bt709[8] = {.64f, .33f, .3f, .6f, .15f, .06f, .3127f, .329f};

static void take_name(const uint8_t *d, size_t size, char name[IO_PNG_NAME])
{
    snprintf(name, IO_PNG_NAME, "%.*s", (int)size, (const char *)d);
    for (char *c = name; *c; c++)
        if ((unsigned char)*c < 32 || (unsigned char)*c > 126) *c = '?';
    if (!*name) snprintf(name, IO_PNG_NAME, "without a name");
}

bool io_space_png(const char *path, io_space *space, char named[IO_PNG_NAME])
{
    const char *fault;
    FILE *f = open_png(path, &fault);
    *named = 0;
    if (!f) return false;
    uint8_t head[8], d[IO_PNG_NAME];
    bool cicp = false, srgb = false, profile = false, primaries = false;
    float xy[8] = {0}, gamma = -1;
    while (!fault && fread(head, 1, 8, f) == 8 && memcmp(head + 4, "IDAT", 4)) {
        uint32_t length = be32(head);
        size_t take = length < sizeof d ? length : sizeof d;
        if (length > 0x7fffffff || fread(d, 1, take, f) != take) break;
        if (!memcmp(head + 4, "cICP", 4) && length == 4 && io_space_code_points((int[]){d[0], d[1]}, space))
            cicp = true;
        else if (!memcmp(head + 4, "sRGB", 4)) srgb = true;
        else if (!memcmp(head + 4, "iCCP", 4)) {
            profile = true;
            take_name(d, take, named);
        } else if (!memcmp(head + 4, "gAMA", 4) && length == 4 && be32(d) > 0) gamma = (float)(100000.0 / be32(d));
        else if (!memcmp(head + 4, "cHRM", 4) && length == 32) {
            primaries = true;
            for (int i = 0; i < 8; i++)
                xy[(i + 6) % 8] = (float)((int32_t)be32(d + 4 * i) / 100000.0); /* stored white first */
        }
        if (fseek(f, (long)(length - take) + 4, SEEK_CUR)) break;
    }
    fclose(f);
    if (cicp) return true;
    if (srgb && !profile) {
        *space = io_space_srgb();
        return true;
    }
    if (profile || (gamma < 0 && !primaries)) return false;
    /* 1/2.2 is how a PNG without an sRGB chunk says sRGB; with Adobe RGB's primaries it is Adobe RGB's curve. */
    const bool adobe = primaries && fabsf(xy[2] - .21f) < .005f && fabsf(xy[3] - .71f) < .005f;
    if (gamma < 0 || (!adobe && gamma > 2.15f && gamma < 2.25f)) gamma = 0;
    if (gamma > 0.98f && gamma < 1.02f) gamma = 1;
    if (gamma > 5 || (gamma > 0 && gamma < 0.2f)) return false; /* not a plausible encoding */
    return io_space_primaries(primaries ? xy : bt709, gamma, space);
}
