/* The size that a file's header claims, read before a library does: its releases refuse a claim with limits and words
 * of their own, or take memory first. What is not understood here is left to them. */
#include "data/image/header.h"
#include "tensor/budget.h"
#include <ctype.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { HEAD = 4096 };

typedef struct header {
    FILE *file;
    unsigned char head[HEAD + 1]; /* the file's beginning, and a zero */
    size_t size;
    bool big; /* endian */
    double width, height;
} header;

static uint64_t number(const header *h, const unsigned char *p, int bytes)
{
    uint64_t v = 0;
    for (int i = 0; i < bytes; i++) v |= (uint64_t)p[i] << 8 * (h->big ? bytes - 1 - i : i);
    return v;
}

static bool begins(const header *h, size_t at, const char *bytes, size_t size)
{
    return at + size <= h->size && memcmp(h->head + at, bytes, size) == 0;
}

/* The next word or number of a text header; comments run from # to the end of the line. NULL: there is none. */
static const char *word(const char **text)
{
    const char *p = *text;
    while (isspace((unsigned char)*p) || *p == '#') p += *p == '#' ? strcspn(p, "\n") : 1;
    *text = p + strcspn(p, " \t\r\n");
    return *p ? p : NULL;
}

static bool netpbm(header *h)
{
    if (h->head[0] != 'P' || !strchr("1234567Ff", h->head[1]) || !isspace(h->head[2])) return false;
    const char *text = (const char *)h->head + 2, *w = word(&text);
    if (h->head[1] == '7') { /* PAM: names and values */
        for (; w && strncmp(w, "ENDHDR", 6) != 0; w = word(&text)) {
            double *to = strncmp(w, "WIDTH", 5) == 0 ? &h->width : strncmp(w, "HEIGHT", 6) == 0 ? &h->height : NULL;
            if (to && (w = word(&text))) *to = atof(w);
            if (!w) break;
        }
        return true;
    }
    const char *second = w ? word(&text) : NULL;
    if (second) h->width = atof(w), h->height = atof(second);
    return true;
}

static bool radiance(header *h)
{
    if (!begins(h, 0, "#?", 2)) return false;
    const char *at = strstr((const char *)h->head, "\n\n");
    char a, b;
    if (at && sscanf(at, " %*c%c %lf %*c%c %lf", &a, &h->height, &b, &h->width) != 4) h->width = 0;
    return true;
}

/* Two letters alone do not make a bitmap: the size of its second header is one of those that exist. */
static bool bitmap(header *h)
{
    static const int sizes[] = {12, 16, 40, 52, 56, 64, 108, 124};
    if (!begins(h, 0, "BM", 2) || h->size < 26) return false;
    bool known = false;
    for (size_t i = 0; i < sizeof sizes / sizeof *sizes; i++) known |= number(h, h->head + 14, 4) == (uint64_t)sizes[i];
    if (!known) return false;
    if (number(h, h->head + 14, 4) == 12) {
        h->width = (double)number(h, h->head + 18, 2), h->height = (double)number(h, h->head + 20, 2);
    } else {
        const int32_t rows = (int32_t)number(h, h->head + 22, 4); /* negative: from the top */
        h->width = (double)number(h, h->head + 18, 4), h->height = rows < 0 ? -(double)rows : rows;
    }
    return true;
}

static bool gif(header *h)
{
    if (!begins(h, 0, "GIF8", 4) || h->size < 10) return false;
    h->width = (double)number(h, h->head + 6, 2), h->height = (double)number(h, h->head + 8, 2);
    return true;
}

static bool photoshop(header *h)
{
    if (!begins(h, 0, "8BPS", 4) || h->size < 22) return false;
    h->big = true;
    h->height = (double)number(h, h->head + 14, 4), h->width = (double)number(h, h->head + 18, 4);
    return true;
}

/* TIFF 6.0, and BigTIFF with its longer numbers: width and length in the first directory. */
static bool tiff(header *h)
{
    enum { WIDTH = 256, LENGTH = 257, SHORT = 3, LONG = 4 };
    if (!begins(h, 0, "II", 2) && !begins(h, 0, "MM", 2)) return false;
    h->big = h->head[0] == 'M';
    const uint64_t version = h->size < 16 ? 0 : number(h, h->head + 2, 2);
    if (version != 42 && version != 43) return false;
    const bool large = version == 43;
    const int counts = large ? 8 : 2, entry = large ? 20 : 12, value = large ? 12 : 8;
    const uint64_t first = large ? number(h, h->head + 8, 8) : number(h, h->head + 4, 4);
    unsigned char p[20];
    if (first > INT32_MAX || fseek(h->file, (long)first, SEEK_SET) || fread(p, (size_t)counts, 1, h->file) != 1)
        return true;
    for (uint64_t left = number(h, p, counts); left > 0 && fread(p, (size_t)entry, 1, h->file) == 1; left--) {
        const uint64_t tag = number(h, p, 2), type = number(h, p + 2, 2);
        if (tag > LENGTH) break; /* they are sorted */
        if (tag != WIDTH && tag != LENGTH) continue;
        const double v = (double)number(h, p + value, type == SHORT ? 2 : type == LONG ? 4 : large ? 8 : 4);
        *(tag == WIDTH ? &h->width : &h->height) = v;
    }
    return true;
}

/* OpenEXR's attributes, of the first part: name, type, size, value. */
static bool openexr(header *h)
{
    if (!begins(h, 0, "\x76\x2f\x31\x01", 4)) return false;
    for (size_t at = 8; at < h->size && h->head[at];) {
        const char *name = (const char *)h->head + at;
        at += strlen(name) + 1;
        const char *type = at < h->size ? (const char *)h->head + at : "";
        at += strlen(type) + 1;
        if (at + 4 > h->size) break;
        const uint64_t size = number(h, h->head + at, 4);
        at += 4;
        if (strcmp(name, "dataWindow") == 0 && size == 16 && at + 16 <= h->size) {
            int32_t corner[4];
            for (int i = 0; i < 4; i++) corner[i] = (int32_t)number(h, h->head + at + 4 * i, 4);
            h->width = (double)corner[2] - corner[0] + 1, h->height = (double)corner[3] - corner[1] + 1;
        }
        at += size;
    }
    return true;
}

ts_code io_check_claim(const char *path, double width, double height, int64_t max_pixels, double bytes, ts_status *st)
{
    if (width * height > (double)max_pixels)
        return ts_fail(st, TS_UNSUPPORTED,
                       "%s: %.0f x %.0f pixels are more than the limit of %lld; of "
                       "photographs --max-pixels raises it",
                       path, width, height, (long long)max_pixels);
    if (ts_budget_check(bytes, st) != TS_OK) return ts_context(st, "%s: %.0f x %.0f pixels", path, width, height);
    return TS_OK;
}

ts_code io_check_header(const char *path, int64_t max_pixels, ts_status *st)
{
    static bool (*const forms[])(header *) = {netpbm, radiance, bitmap, gif, photoshop, tiff, openexr};
    header h = {.file = fopen(path, "rbe")};
    if (!h.file) return TS_OK; /* the reader says why */
    h.size = fread(h.head, 1, HEAD, h.file);
    for (size_t i = 0; i < sizeof forms / sizeof *forms && h.size > 2; i++)
        if (forms[i](&h)) break;
    fclose(h.file);
    if (!(h.width > 0 && h.height > 0)) return TS_OK;
    return io_check_claim(path, h.width, h.height, max_pixels, 0, st);
}
