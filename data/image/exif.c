/* Orientation, interoperability index and lens from an Exif segment (Exif 2.3, 4.5 to 4.6: a TIFF header and its
 * directories). */
#include "data/image/common_read.h"
#include <stdio.h>
#include <string.h>
#include <strings.h>

typedef struct tiff {
    const unsigned char *bytes;
    size_t size;
    bool little, odd; /* odd: something does not lie where it must */
} tiff;

static unsigned get16(tiff *t, size_t at)
{
    if (at + 2 > t->size) return t->odd = true, 0u;
    const unsigned a = t->bytes[at], b = t->bytes[at + 1];
    return t->little ? b << 8 | a : a << 8 | b;
}

static uint32_t get32(tiff *t, size_t at)
{
    const uint32_t a = get16(t, at), b = get16(t, at + 2);
    return t->little ? b << 16 | a : a << 16 | b;
}

enum {
    MAKE = 0x10f,
    ORIENTATION = 0x112,
    FOCAL_LENGTH = 0x920a,
    PIXEL_X_DIMENSION = 0xa002,
    PIXEL_Y_DIMENSION = 0xa003,
    FOCAL_PLANE_X_RESOLUTION = 0xa20e,
    FOCAL_PLANE_RESOLUTION_UNIT = 0xa210,
    DIGITAL_ZOOM_RATIO = 0xa404,
    FOCAL_LENGTH_35MM = 0xa405,
    EXIF_DIRECTORY = 0x8769,
    INTEROPERABILITY_DIRECTORY = 0xa005,
    INTEROPERABILITY_INDEX = 1,
    ASCII = 2,
    SHORT = 3,
    LONG = 4,
    RATIONAL = 5
};

/* Where the directory's entry with that tag begins, or 0. Two with the same tag are odd. */
static size_t entry(tiff *t, size_t directory, unsigned tag)
{
    const unsigned count = get16(t, directory);
    size_t found = 0;
    for (unsigned i = 0; i < count && !t->odd; i++) {
        const size_t at = directory + 2 + 12 * (size_t)i;
        if (get16(t, at) != tag) continue;
        if (found) t->odd = true;
        found = at;
    }
    return found;
}

/* The directory that an entry points to, or 0. */
static size_t follow(tiff *t, size_t at)
{
    if (!at) return 0;
    if (get16(t, at + 2) != LONG || get32(t, at + 4) != 1) t->odd = true;
    const uint32_t to = get32(t, at + 8);
    if (to < 8 || to + (size_t)2 > t->size) t->odd = true;
    return t->odd ? 0 : to;
}

/* The number of the directory's entry with that tag, or 0. */
static double number(tiff t, size_t directory, unsigned tag)
{
    const size_t at = entry(&t, directory, tag);
    if (!at || get32(&t, at + 4) != 1) return 0;
    const unsigned type = get16(&t, at + 2);
    double v = type == SHORT ? get16(&t, at + 8) : type == LONG ? get32(&t, at + 8) : 0;
    if (type == RATIONAL) {
        const size_t pair = get32(&t, at + 8);
        const double over = get32(&t, pair), under = get32(&t, pair + 4);
        v = under > 0 ? over / under : 0;
    }
    return t.odd ? 0 : v;
}

/* t is a copy: what is odd here is no reason to distrust the rest. */
static void read_lens(tiff t, size_t first, size_t exif, io_lens *lens)
{
    const double millimetres[] = {[2] = 25.4, [3] = 10, [4] = 1, [5] = 1e-3};
    const double unit = number(t, exif, FOCAL_PLANE_RESOLUTION_UNIT), x = number(t, exif, PIXEL_X_DIMENSION),
                 y = number(t, exif, PIXEL_Y_DIMENSION);
    const int known = unit >= 2 && unit <= 5 ? (int)unit : 2; /* inches where it is not said */
    char make[8] = "";
    const size_t at = entry(&t, first, MAKE);
    const size_t length = at && get16(&t, at + 2) == ASCII ? get32(&t, at + 4) : 0,
                 text = length > 4 ? get32(&t, at + 8) : at + 8;
    if (!t.odd && length && text + length <= t.size)
        snprintf(make, sizeof make, "%.*s", (int)(length < 7 ? length : 7), (const char *)t.bytes + text);
    *lens = (io_lens){.focal_35mm = number(t, exif, FOCAL_LENGTH_35MM),
                      .focal = number(t, exif, FOCAL_LENGTH),
                      .plane = number(t, exif, FOCAL_PLANE_X_RESOLUTION) / millimetres[known],
                      .zoom = number(t, exif, DIGITAL_ZOOM_RATIO),
                      .width = x < 1e6 ? (int)x : 0,
                      .height = y < 1e6 ? (int)y : 0,
                      .zoom_in_focal35 = strncasecmp(make, "Apple", 5) == 0};
}

bool io_exif(const unsigned char *segment, size_t size, int *orientation, bool *adobe, io_lens *lens)
{
    *orientation = 1;
    *adobe = false;
    *lens = (io_lens){0};
    if (size < 14 || memcmp(segment, "Exif\0\0", 6) != 0) return false;
    tiff t = {segment + 6, size - 6, segment[6] == 'I', false};
    if (memcmp(t.bytes, t.little ? "II" : "MM", 2) != 0 || get16(&t, 2) != 42) return false;
    const size_t first = get32(&t, 4);
    if (first < 8) return false;
    const size_t at = entry(&t, first, ORIENTATION);
    if (at) {
        if (get16(&t, at + 2) != SHORT || get32(&t, at + 4) != 1) t.odd = true;
        const unsigned v = get16(&t, at + 8);
        *orientation = v >= 1 && v <= 8 ? (int)v : 1;
    }
    const size_t exif = follow(&t, entry(&t, first, EXIF_DIRECTORY));
    if (exif && !t.odd) read_lens(t, first, exif, lens);
    const size_t interoperability = exif && !t.odd ? follow(&t, entry(&t, exif, INTEROPERABILITY_DIRECTORY)) : 0;
    const size_t index = interoperability && !t.odd ? entry(&t, interoperability, INTEROPERABILITY_INDEX) : 0;
    if (index) {
        /* "R98" and a zero: in the entry itself, which may be cut off */
        if (get16(&t, index + 2) != ASCII || get32(&t, index + 4) != 4 || index + 12 > t.size) t.odd = true;
        *adobe = !t.odd && memcmp(t.bytes + index + 8, "R03", 3) == 0;
    }
    return !t.odd;
}
