/* The colours of a HEIF or AVIF file (ISO/IEC 23008-12, 14496-12), which OpenImageIO passes over: a phone's are mostly
 * Display P3. */
#include "data/image/common_read.h"
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { MOST_BOXES = 64, MOST = 1 << 24, PROFILE_LEAST = 128 };

typedef struct part {
    const uint8_t *at;
    size_t size;
} part;

static uint64_t big_endian(const uint8_t *p, int bytes)
{
    uint64_t v = 0;
    for (int i = 0; i < bytes; i++) v = v << 8 | p[i];
    return v;
}

/* The next box of rest. False: there is no whole one. */
static bool take_box(part *rest, const uint8_t **type, part *content)
{
    if (rest->size < 8) return false;
    uint64_t size = big_endian(rest->at, 4), head = 8;
    *type = rest->at + 4;
    if (size == 1) {
        if (rest->size < 16) return false;
        size = big_endian(rest->at + 8, 8), head = 16;
    } else if (size == 0) size = rest->size;
    if (size < head || size > rest->size) return false;
    *content = (part){rest->at + head, (size_t)(size - head)};
    rest->at += size, rest->size -= (size_t)size;
    return true;
}

static bool find_box(part within, const char *name, part *content)
{
    const uint8_t *type;
    while (take_box(&within, &type, content))
        if (!memcmp(type, name, 4)) return true;
    return false;
}

/* What a colr box says. A profile is taken before code points. */
static void take_colour(part colour, oi_image *image)
{
    if (colour.size < 4) return;
    const part of = {colour.at + 4, colour.size - 4};
    const bool profile = !memcmp(colour.at, "prof", 4) || !memcmp(colour.at, "rICC", 4);
    if (profile && !image->icc && of.size > PROFILE_LEAST && (image->icc = malloc(of.size))) {
        memcpy(image->icc, of.at, of.size);
        image->icc_size = of.size;
    } else if (!memcmp(colour.at, "nclx", 4) && of.size >= 4) {
        image->code_points = true;
        for (int k = 0; k < 2; k++) image->code_point[k] = (int)big_endian(of.at + 2 * k, 2);
    }
}

/* The nth property, from 1. */
static void take_property(part properties, int n, oi_image *image)
{
    const uint8_t *type;
    part content;
    for (int i = 1; i <= n && take_box(&properties, &type, &content); i++)
        if (i == n && !memcmp(type, "colr", 4)) take_colour(content, image);
}

/* Of an ipma box: the properties of an item. */
static void take_associated(part associations, uint64_t item, part properties, oi_image *image)
{
    if (associations.size < 8) return;
    const int id = associations.at[0] < 1 ? 2 : 4, index = associations.at[3] & 1 ? 2 : 1;
    const uint8_t *p = associations.at + 8, *end = associations.at + associations.size;
    for (uint64_t left = big_endian(associations.at + 4, 4); left > 0 && end - p > id; left--) {
        const bool wanted = big_endian(p, id) == item;
        int count = p[id];
        for (p += id + 1; count > 0 && end - p >= index; count--, p += index)
            if (wanted) take_property(properties, (int)big_endian(p, index) & (index == 2 ? 0x7fff : 0x7f), image);
        if (wanted) return;
    }
}

/* Of an iprp box, which may have several of associations: the properties of an item. */
static void take_properties(part within, uint64_t item, part properties, oi_image *image)
{
    const uint8_t *type;
    part associations;
    while (take_box(&within, &type, &associations))
        if (!memcmp(type, "ipma", 4)) take_associated(associations, item, properties, image);
}

/* Of an iref box: the first image that an item is put together of, a tile. False: it is none of tiles. */
static bool first_tile(part references, uint64_t item, uint64_t *tile)
{
    if (references.size < 4) return false;
    const int id = references.at[0] < 1 ? 2 : 4;
    part rest = {references.at + 4, references.size - 4}, of;
    const uint8_t *type;
    while (take_box(&rest, &type, &of)) {
        if (memcmp(type, "dimg", 4) || of.size < 2 * (size_t)id + 2 || big_endian(of.at, id) != item) continue;
        *tile = big_endian(of.at + id + 2, id);
        return true;
    }
    return false;
}

/* Of the primary image; of one of tiles where only they say it, as the first iPhones wrote. */
static void take_meta(part meta, oi_image *image)
{
    part primary, of, properties, references;
    if (!find_box(meta, "pitm", &primary) || !find_box(meta, "iprp", &of) || !find_box(of, "ipco", &properties) ||
        primary.size < 6)
        return;
    const int id = primary.at[0] < 1 ? 2 : 4;
    if (primary.size < 4 + (size_t)id) return;
    const uint64_t item = big_endian(primary.at + 4, id);
    uint64_t tile;
    take_properties(of, item, properties, image);
    if (!image->icc && !image->code_points && find_box(meta, "iref", &references) &&
        first_tile(references, item, &tile))
        take_properties(of, tile, properties, image);
}

/* The content of the meta box, malloced; NULL: there is none, or the file is of another format. */
static uint8_t *read_meta(FILE *f, size_t *size)
{
    uint8_t head[16];
    long at = 0;
    for (int n = 0; n < MOST_BOXES && !fseek(f, at, SEEK_SET) && fread(head, 1, 8, f) == 8; n++) {
        uint64_t length = big_endian(head, 4), used = 8;
        if (n == 0 && memcmp(head + 4, "ftyp", 4)) return NULL;
        if (length == 1) {
            if (fread(head + 8, 1, 8, f) != 8) return NULL;
            length = big_endian(head + 8, 8), used = 16;
        }
        if (length < used || length > (1ull << 40)) return NULL;
        if (!memcmp(head + 4, "meta", 4)) {
            *size = (size_t)(length - used);
            uint8_t *bytes = *size > 4 && *size <= MOST ? malloc(*size) : NULL;
            if (bytes && fread(bytes, 1, *size, f) == *size) return bytes;
            free(bytes);
            return NULL;
        }
        at += (long)length;
    }
    return NULL;
}

void io_heif_colours(const char *path, oi_image *image)
{
    FILE *f = fopen(path, "rbe");
    size_t size = 0;
    uint8_t *meta = f ? read_meta(f, &size) : NULL;
    if (meta) take_meta((part){meta + 4, size - 4}, image); /* after its version and flags */
    free(meta);
    if (f) fclose(f);
}
