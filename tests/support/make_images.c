#include "tests/support/make_images.h"
#include "tests/support/files.h"
#include "tests/test.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

void put(bytes *b, const void *data, size_t size)
{
    if (b->size + size > b->capacity) {
        b->capacity = (b->size + size) * 2 + 64;
        b->data = realloc(b->data, b->capacity);
        CHECK(b->data, "out of memory");
    }
    if (size) memcpy(b->data + b->size, data, size);
    b->size += size;
}

void put8(bytes *b, unsigned v) { put(b, &(uint8_t){(uint8_t)v}, 1); }
void put16(bytes *b, unsigned v) { put8(b, v >> 8), put8(b, v); }
void put32(bytes *b, uint32_t v) { put16(b, v >> 16), put16(b, v & 0xffff); }
void put16le(bytes *b, unsigned v) { put8(b, v), put8(b, v >> 8); }
void put32le(bytes *b, uint32_t v) { put16le(b, v & 0xffff), put16le(b, v >> 16); }

void bytes_free(bytes *b)
{
    free(b->data);
    *b = (bytes){0};
}

const char *bytes_save(bytes *b, const char *folder, const char *name)
{
    static char path[8][1024];
    static int next;
    char *p = path[next++ % 8];
    snprintf(p, sizeof path[0], "%s/%s", folder, name);
    spill(p, b->data, b->size);
    bytes_free(b);
    return p;
}

bytes bytes_load(const char *path)
{
    bytes b = {0};
    b.data = (uint8_t *)slurp(path, &b.size);
    b.capacity = b.size;
    return b;
}

/* --- PNG --- */

static uint32_t crc(const uint8_t *p, size_t n)
{
    uint32_t c = 0xffffffff;
    for (size_t i = 0; i < n; i++) {
        c ^= p[i];
        for (int k = 0; k < 8; k++) c = c & 1 ? c >> 1 ^ 0xedb88320 : c >> 1;
    }
    return ~c;
}

void png_chunk(bytes *b, const char *type, const void *data, size_t size)
{
    put32(b, (uint32_t)size);
    size_t start = b->size;
    put(b, type, 4);
    put(b, data, size);
    put32(b, crc(b->data + start, b->size - start));
}

void png_begin(bytes *b, uint32_t width, uint32_t height, int depth, int colour)
{
    bytes h = {0};
    put(b, "\x89PNG\r\n\x1a\n", 8);
    put32(&h, width), put32(&h, height);
    put8(&h, (unsigned)depth), put8(&h, (unsigned)colour), put8(&h, 0), put8(&h, 0), put8(&h, 0);
    png_chunk(b, "IHDR", h.data, h.size);
    bytes_free(&h);
}

/* A zlib stream of one stored block. */
static void deflate_stored(bytes *out, const uint8_t *data, size_t size)
{
    uint32_t a = 1, c = 0;
    CHECK(size < 65536, "too long for one stored block");
    put16(out, 0x7801), put8(out, 1);
    put16le(out, (unsigned)size), put16le(out, ~(unsigned)size);
    put(out, data, size);
    for (size_t i = 0; i < size; i++) a = (a + data[i]) % 65521, c = (c + a) % 65521;
    put32(out, c << 16 | a);
}

void png_pixels(bytes *b, const void *pixels, size_t row, int rows)
{
    bytes raw = {0}, z = {0};
    for (int y = 0; y < rows; y++) {
        put8(&raw, 0);
        put(&raw, (const uint8_t *)pixels + (size_t)y * row, row);
    }
    deflate_stored(&z, raw.data, raw.size);
    png_chunk(b, "IDAT", z.data, z.size);
    bytes_free(&raw), bytes_free(&z);
}

void png_profile(bytes *b, const bytes *profile)
{
    bytes d = {0};
    put(&d, "profile\0", 9);
    deflate_stored(&d, profile->data, profile->size);
    png_chunk(b, "iCCP", d.data, d.size);
    bytes_free(&d);
}

void png_end(bytes *b) { png_chunk(b, "IEND", NULL, 0); }

/* --- ICC: published colorants, rows X Y Z, columns red green blue --- */

const double icc_srgb[9] = {.4360747, .3850649, .1430804, .2225045, .7168786, .0606169, .0139322, .0971045, .7141733};
const double icc_display_p3[9] = {.515102, .291965, .157153, .241182, .692236, .0665819, -.00104941, .0418818, .784378};
const double icc_adobe_rgb[9] = {.6097559, .2052401, .1492240, .3111242, .6256560,
                                 .0632197, .0194811, .0608902, .7448387};

static void put_fixed(bytes *b, double v) { put32(b, (uint32_t)(int32_t)lround(v * 65536)); }

static void put_curve(bytes *b, double gamma)
{
    if (gamma == 0) {
        put(b, "para\0\0\0\0\0\3\0\0", 12);
        put_fixed(b, 2.4), put_fixed(b, 1 / 1.055), put_fixed(b, 0.055 / 1.055), put_fixed(b, 1 / 12.92),
            put_fixed(b, 0.04045);
    } else if (gamma < 0) {
        put(b, "curv\0\0\0\0", 8), put32(b, 1024);
        for (int i = 0; i < 1024; i++) {
            double v = i / 1023.0;
            put16(b, (unsigned)lround(65535 * (v <= 0.04045 ? v / 12.92 : pow((v + 0.055) / 1.055, 2.4))));
        }
    } else {
        put(b, "curv\0\0\0\0", 8), put32(b, 1), put16(b, (unsigned)lround(gamma * 256)), put16(b, 0);
    }
}

bytes icc_profile(const double colorants[9], double gamma)
{
    static const char *const tags[6] = {"rXYZ", "gXYZ", "bXYZ", "rTRC", "gTRC", "bTRC"};
    bytes curve = {0}, b = {0};
    put_curve(&curve, gamma);
    uint32_t table = 128 + 4 + 6 * 12, total = table + 60 + (uint32_t)curve.size;
    put32(&b, total);
    for (int i = 4; i < 128; i++) put8(&b, 0);
    b.data[8] = 2;
    memcpy(b.data + 12, "mntrRGB XYZ ", 12);
    memcpy(b.data + 36, "acsp", 4);
    put32(&b, 6);
    for (int i = 0; i < 6; i++) {
        put(&b, tags[i], 4);
        put32(&b, i < 3 ? table + 20 * (uint32_t)i : table + 60);
        put32(&b, i < 3 ? 20 : (uint32_t)curve.size);
    }
    for (int c = 0; c < 3; c++) {
        put(&b, "XYZ \0\0\0\0", 8);
        for (int i = 0; i < 3; i++) put_fixed(&b, colorants[3 * i + c]);
    }
    put(&b, curve.data, curve.size);
    bytes_free(&curve);
    return b;
}

/* --- JPEG --- */

void jpeg_insert(bytes *jpeg, int marker, const void *data, size_t size)
{
    bytes b = {0};
    put(&b, jpeg->data, 2);
    put8(&b, 0xff), put8(&b, (unsigned)marker), put16(&b, (unsigned)size + 2);
    put(&b, data, size);
    put(&b, jpeg->data + 2, jpeg->size - 2);
    bytes_free(jpeg);
    *jpeg = b;
}

void jpeg_orientation(bytes *jpeg, int orientation)
{
    bytes e = {0};
    put(&e, "Exif\0\0MM\0*\0\0\0\10", 14);
    put16(&e, 1), put16(&e, 0x112), put16(&e, 3), put32(&e, 1), put16(&e, (unsigned)orientation), put16(&e, 0),
        put32(&e, 0);
    jpeg_insert(jpeg, 0xe1, e.data, e.size);
    bytes_free(&e);
}

void jpeg_profile(bytes *jpeg, const bytes *profile)
{
    bytes d = {0};
    put(&d, "ICC_PROFILE\0\1\1", 14);
    put(&d, profile->data, profile->size);
    jpeg_insert(jpeg, 0xe2, d.data, d.size);
    bytes_free(&d);
}

static void put_bits(bytes *b, uint32_t *hold, int *held, unsigned v, int n)
{
    for (int i = n - 1; i >= 0; i--) {
        *hold = *hold << 1 | (v >> i & 1);
        if (++*held == 8) {
            put8(b, *hold & 255);
            if ((*hold & 255) == 255) put8(b, 0);
            *held = 0;
        }
    }
}

/* Two blocks a component, no frequency but the mean. DC codes: every size 0 .. 11 has the four-bit code of its own
 * number; AC: only the end. */
bytes jpeg_cmyk(const uint8_t stored[4])
{
    bytes b = {0};
    put16(&b, 0xffd8);
    put(&b, "\xff\xee\0\16Adobe\0\x64\0\0\0\0\0", 16);
    put(&b, "\xff\xdb\0\x43\0", 5);
    for (int i = 0; i < 64; i++) put8(&b, 1);
    put(&b, "\xff\xc0\0\x14\10\0\10\0\20\4", 10);
    for (unsigned c = 1; c <= 4; c++) put8(&b, c), put8(&b, 0x11), put8(&b, 0);
    put(&b, "\xff\xc4\0\x1f\0\0\0\0\14\0\0\0\0\0\0\0\0\0\0\0\0", 21);
    for (unsigned i = 0; i < 12; i++) put8(&b, i);
    put(&b, "\xff\xc4\0\x14\x10\1\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0", 22);
    put(&b, "\xff\xda\0\16\4\1\0\2\0\3\0\4\0\0\x3f\0", 16);
    uint32_t hold = 0;
    int held = 0;
    for (int block = 0; block < 2; block++)
        for (int c = 0; c < 4; c++) {
            int dc = block ? 0 : ((int)stored[c] - 128) * 8,
                size = 0; /* the mean times 8; the second block differs by 0 */
            while (abs(dc) >> size) size++;
            put_bits(&b, &hold, &held, (unsigned)size, 4);
            put_bits(&b, &hold, &held, (unsigned)(dc < 0 ? dc - 1 : dc) & ((1u << size) - 1), size);
            put_bits(&b, &hold, &held, 0, 1);
        }
    while (held) put_bits(&b, &hold, &held, 1, 1);
    put16(&b, 0xffd9);
    return b;
}

/* --- TIFF --- */

static void entry(bytes *b, unsigned tag, unsigned type, uint32_t count, uint32_t value)
{
    put16le(b, tag), put16le(b, type), put32le(b, count), put32le(b, value);
}

bytes tiff_file(const tiff_page *pages, int count)
{
    bytes b = {0};
    put(&b, "II*\0", 4);
    put32le(&b, 8);
    for (int i = 0; i < count; i++) {
        const tiff_page *p = &pages[i];
        unsigned entries = p->extra >= 0 ? 13 : 12, same = (unsigned)p->bits;
        size_t size = (size_t)p->width * (size_t)p->height * (size_t)p->samples * (size_t)p->bits / 8;
        uint32_t start = (uint32_t)b.size, lists = start + 2 + entries * 12 + 4, pixels = lists + 32,
                 next = pixels + (uint32_t)(size + size % 2);
        put16le(&b, entries);
        bool list = p->samples > 2;
        entry(&b, 256, 4, 1, (uint32_t)p->width);
        entry(&b, 257, 4, 1, (uint32_t)p->height);
        entry(&b, 258, 3, (uint32_t)p->samples, list ? lists : same | same << 16);
        entry(&b, 259, 3, 1, 1);
        entry(&b, 262, 3, 1, (uint32_t)p->photometric);
        entry(&b, 273, 4, 1, pixels);
        entry(&b, 274, 3, 1, (uint32_t)(p->orientation ? p->orientation : 1));
        entry(&b, 277, 3, 1, (uint32_t)p->samples);
        entry(&b, 278, 4, 1, (uint32_t)p->height);
        entry(&b, 279, 4, 1, (uint32_t)size);
        entry(&b, 284, 3, 1, 1);
        if (p->extra >= 0) entry(&b, 338, 3, 1, (uint32_t)p->extra);
        unsigned f = (unsigned)p->format;
        entry(&b, 339, 3, (uint32_t)p->samples, list ? lists + 16 : f | f << 16);
        put32le(&b, i + 1 < count ? next : 0);
        for (int k = 0; k < 8; k++) put16le(&b, same);
        for (int k = 0; k < 8; k++) put16le(&b, f);
        put(&b, p->pixels, p->pixels ? size : 0);
        if (p->pixels && size % 2) put8(&b, 0);
    }
    return b;
}

/* --- EXR --- */

static void attribute(bytes *b, const char *name, const char *type, const void *data, size_t size)
{
    put(b, name, strlen(name) + 1);
    put(b, type, strlen(type) + 1);
    put32le(b, (uint32_t)size);
    put(b, data, size);
}

static bytes exr_head(int width, int height, int channels, const char *const *names, const float *chromaticities)
{
    bytes b = {0}, list = {0};
    const int32_t box[4] = {0, 0, width - 1, height - 1};
    const float one = 1, centre[2] = {0, 0};
    put(&b, "\x76\x2f\x31\x01\2\0\0\0", 8);
    for (int c = 0; c < channels; c++) {
        put(&list, names[c], strlen(names[c]) + 1);
        put32le(&list, 2), put32le(&list, 0), put32le(&list, 1), put32le(&list, 1);
    }
    put8(&list, 0);
    attribute(&b, "channels", "chlist", list.data, list.size);
    attribute(&b, "compression", "compression", "\0", 1);
    attribute(&b, "dataWindow", "box2i", box, sizeof box);
    attribute(&b, "displayWindow", "box2i", box, sizeof box);
    attribute(&b, "lineOrder", "lineOrder", "\0", 1);
    attribute(&b, "pixelAspectRatio", "float", &one, 4);
    attribute(&b, "screenWindowCenter", "v2f", centre, 8);
    attribute(&b, "screenWindowWidth", "float", &one, 4);
    if (chromaticities) attribute(&b, "chromaticities", "chromaticities", chromaticities, 32);
    put8(&b, 0);
    bytes_free(&list);
    return b;
}

bytes exr_row(int width, int channels, const char *const *names, const float *pixels)
{
    bytes b = exr_head(width, 1, channels, names, NULL);
    put32le(&b, (uint32_t)b.size + 8), put32le(&b, 0);
    put32le(&b, 0), put32le(&b, (uint32_t)(width * channels) * 4);
    put(&b, pixels, (size_t)(width * channels) * 4);
    return b;
}

bytes exr_file(int width, int height, const float *pixels, const float *chromaticities)
{
    bytes b = exr_head(width, height, 3, (const char *const[]){"B", "G", "R"}, chromaticities);
    uint64_t row = 8 + (uint64_t)width * 12, first = b.size + 8 * (uint64_t)(pixels ? height : 0);
    for (int y = 0; y < height && pixels; y++) put32le(&b, (uint32_t)(first + row * (uint64_t)y)), put32le(&b, 0);
    for (int y = 0; y < height && pixels; y++) {
        put32le(&b, (uint32_t)y), put32le(&b, (uint32_t)width * 12);
        for (int c = 2; c >= 0; c--)
            for (int x = 0; x < width; x++)
                put(&b, &pixels[((size_t)y * (size_t)width + (size_t)x) * 3 + (size_t)c], 4);
    }
    return b;
}
