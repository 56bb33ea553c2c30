#include "nn/weights/zip.h"
#include <stdlib.h>
#include <string.h>
#include <zlib.h>

enum {
    LOCAL = 30,
    CENTRAL = 46,
    END = 22,
    END64 = 56,
    LOCATOR = 20
}; /* sizes of the records without what is variable */

static uint64_t take(const unsigned char *p, int bytes)
{
    uint64_t v = 0;
    for (int i = bytes; i-- > 0;) v = v << 8 | p[i];
    return v;
}

static bool is(const unsigned char *p, const char signature[5]) { return memcmp(p, signature, 4) == 0; }

static ts_code damaged(const nn_file *f, ts_status *st, const char *what)
{
    return ts_fail(st, TS_FORMAT, "%s: ZIP archive: %s", f->path, what);
}

typedef struct directory {
    uint64_t begin, size, count;
} directory;

static ts_code find_directory(const nn_file *f, directory *d, ts_status *st)
{
    if (f->size < END) return damaged(f, st, "truncated");
    size_t at = f->size - END, last = f->size > END + 65535 ? f->size - END - 65535 : 0;
    while (!is(f->map + at, "PK\5\6") ||
           take(f->map + at + 20, 2) != f->size - at - END) /* the comment reaches to the end of the file */
        if (at-- == last) return damaged(f, st, "no directory at its end (is it truncated?)");
    const unsigned char *p = f->map + at;
    *d = (directory){take(p + 16, 4), take(p + 12, 4), take(p + 10, 2)};
    uint64_t end = at;
    if (d->count == 0xffff || d->size == 0xffffffff || d->begin == 0xffffffff) {
        if (at < LOCATOR || !is(p - LOCATOR, "PK\6\7")) return damaged(f, st, "its 64-bit directory is missing");
        uint64_t where = take(p - LOCATOR + 8, 8);
        if (at - LOCATOR < END64 || where > at - LOCATOR - END64 || !is(f->map + where, "PK\6\6"))
            return damaged(f, st, "its 64-bit directory is missing");
        p = f->map + where;
        *d = (directory){take(p + 48, 8), take(p + 40, 8), take(p + 32, 8)};
        end = where;
    }
    if (d->begin > end || d->size > end - d->begin) return damaged(f, st, "the directory lies outside the file");
    if (d->count > d->size / CENTRAL) return damaged(f, st, "more entries than the directory has room for");
    return TS_OK;
}

/* What did not fit into 32 bits stands in an extra field, in this order and only where it did not fit. */
static bool widen(const unsigned char *extra, size_t length, uint64_t *size, uint64_t *packed, uint64_t *header)
{
    uint64_t *field[3] = {size, packed, header};
    bool needed = *size == 0xffffffff || *packed == 0xffffffff || *header == 0xffffffff;
    while (needed && length >= 4) {
        size_t n = take(extra + 2, 2);
        if (n > length - 4) return false;
        if (take(extra, 2) == 1) {
            const unsigned char *p = extra + 4;
            for (int i = 0; i < 3; i++) {
                if (*field[i] != 0xffffffff) continue;
                if (n < 8) return false;
                *field[i] = take(p, 8);
                p += 8;
                n -= 8;
            }
            return true;
        }
        extra += 4 + n;
        length -= 4 + n;
    }
    return !needed;
}

static ts_code read_entry(const nn_file *f, const unsigned char **at, const unsigned char *end, uint64_t limit,
                          zip_entry *e, ts_status *st)
{
    const unsigned char *p = *at;
    if (end - p < CENTRAL || !is(p, "PK\1\2")) return damaged(f, st, "the directory is damaged");
    size_t name = take(p + 28, 2), extra = take(p + 30, 2), comment = take(p + 32, 2);
    if ((size_t)(end - p) < CENTRAL + name + extra + comment) return damaged(f, st, "the directory is truncated");
    *e = (zip_entry){(const char *)p + CENTRAL,
                     name,
                     take(p + 42, 4),
                     0,
                     take(p + 20, 4),
                     take(p + 24, 4),
                     (uint32_t)take(p + 16, 4),
                     false,
                     NULL};
    *at = p + CENTRAL + name + extra + comment;
    if (!widen(p + CENTRAL + name, extra, &e->size, &e->packed, &e->header))
        return damaged(f, st, "an entry lacks its 64-bit sizes");
    const uint64_t flags = take(p + 8, 2), method = take(p + 10, 2);
    if (flags & 1) return ts_fail(st, TS_UNSUPPORTED, "%s: ZIP archive: it is encrypted", f->path);
    if (method != 0 && method != 8)
        return ts_fail(st, TS_UNSUPPORTED,
                       "%s: ZIP archive: an entry has the compression method %d; stored and deflated ones are read",
                       f->path, (int)method);
    e->deflated = method == 8;
    if (!e->deflated && e->size != e->packed) return damaged(f, st, "a stored entry has two sizes");
    if (limit < LOCAL || e->header > limit - LOCAL || !is(f->map + e->header, "PK\3\4"))
        return damaged(f, st, "an entry lies outside the file");
    e->begin = e->header + LOCAL + take(f->map + e->header + 26, 2) + take(f->map + e->header + 28, 2);
    if (e->begin > limit || e->packed > limit - e->begin) return damaged(f, st, "an entry lies outside the file");
    /* deflate makes at most 258 bytes of 2 bits */
    if (e->deflated && e->size / 1032 > e->packed)
        return damaged(f, st, "an entry claims more than its compressed bytes can hold");
    return TS_OK;
}

static int by_place(const void *a, const void *b)
{
    const zip_entry *x = a, *y = b;
    return (x->header > y->header) - (x->header < y->header);
}

static int compare(const char *a, size_t an, const char *b, size_t bn)
{
    int c = memcmp(a, b, an < bn ? an : bn);
    return c ? c : (an > bn) - (an < bn);
}

static int by_name(const void *a, const void *b)
{
    const zip_entry *x = a, *y = b;
    return compare(x->name, x->length, y->name, y->length);
}

ts_code zip_open(nn_file *f, zip_archive *zip, ts_status *st)
{
    directory d = {0};
    *zip = (zip_archive){0};
    ts_code code = find_directory(f, &d, st);
    if (code) return code;
    if (d.count > 1 << 24) return damaged(f, st, "more than 16 million entries");
    zip->entry = malloc((d.count + 1) * sizeof *zip->entry);
    if (!zip->entry) return ts_fail(st, TS_NOMEM, "%s: no memory for the list of entries", f->path);
    const unsigned char *at = f->map + d.begin, *end = at + d.size;
    for (; !code && zip->entries < (int)d.count; zip->entries++)
        code = read_entry(f, &at, end, d.begin, &zip->entry[zip->entries], st);
    if (code) return code;
    qsort(zip->entry, (size_t)zip->entries, sizeof *zip->entry, by_place);
    for (int i = 1; i < zip->entries; i++) /* a few bytes that many entries share could unpack to any amount */
        if (zip->entry[i].header < zip->entry[i - 1].begin + zip->entry[i - 1].packed)
            return damaged(f, st, "two entries overlap");
    qsort(zip->entry, (size_t)zip->entries, sizeof *zip->entry, by_name);
    for (int i = 1; i < zip->entries; i++)
        if (by_name(&zip->entry[i - 1], &zip->entry[i]) == 0) return damaged(f, st, "an entry is there twice");
    return TS_OK;
}

void zip_free(zip_archive *zip)
{
    free(zip->entry);
    *zip = (zip_archive){0};
}

zip_entry *zip_find(const zip_archive *zip, const char *name, size_t length)
{
    int lo = 0, hi = zip->entries;
    while (lo < hi) {
        int middle = lo + (hi - lo) / 2;
        int c = compare(zip->entry[middle].name, zip->entry[middle].length, name, length);
        if (c == 0) return &zip->entry[middle];
        if (c < 0) lo = middle + 1;
        else hi = middle;
    }
    return NULL;
}

/* All of e's size bytes, no more and no less, with the right checksum. */
static bool inflate_all(const nn_file *f, const zip_entry *e, unsigned char *out)
{
    const uint64_t most = 1u << 30; /* zlib counts in 32 bits */
    z_stream z = {0};
    if (inflateInit2(&z, -MAX_WBITS) != Z_OK) return false;
    const unsigned char *in = f->map + e->begin;
    uint64_t in_left = e->packed, out_left = e->size;
    uint32_t crc = 0;
    unsigned char none;
    int code = Z_OK;
    z.next_out = out_left ? out : &none;
    while (code == Z_OK) {
        if (!z.avail_in && in_left) {
            z.next_in = (unsigned char *)(uintptr_t)in;
            z.avail_in = (uInt)(in_left < most ? in_left : most);
            in += z.avail_in;
            in_left -= z.avail_in;
        }
        if (!z.avail_out && out_left) {
            z.avail_out = (uInt)(out_left < most ? out_left : most);
            out_left -= z.avail_out;
        }
        unsigned char *from = z.next_out;
        code = inflate(&z, Z_NO_FLUSH);
        crc = (uint32_t)crc32_z(crc, from, (size_t)(z.next_out - from));
    }
    bool good = code == Z_STREAM_END && !z.avail_out && !out_left && crc == e->crc;
    inflateEnd(&z);
    return good;
}

const unsigned char *zip_data(nn_file *f, zip_entry *e, ts_status *st)
{
    if (e->data) return e->data;
    if (!e->deflated) return e->data = f->map + e->begin;
    void **grown = realloc(f->inflated, ((size_t)f->inflations + 1) * sizeof *grown);
    unsigned char *data = malloc(e->size + 1);
    if (grown) f->inflated = grown;
    if (!grown || !data) {
        free(data);
        ts_fail(st, TS_NOMEM, "%s: no memory to unpack %llu bytes", f->path, (unsigned long long)e->size);
        return NULL;
    }
    f->inflated[f->inflations++] = data;
    if (inflate_all(f, e, data)) return e->data = data;
    damaged(f, st, "a compressed entry is damaged");
    return NULL;
}
