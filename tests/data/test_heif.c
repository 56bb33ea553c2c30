/* What the boxes of a HEIF file say of its colours. */
#include "data/image/colour.h"
#include "data/image/common_read.h"
#include "tensor/rng.h"
#include "tests/support/make_images.h"
#include "tests/test.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { PROFILE = 200, ITEM = 0x1234 };

static void box(bytes *b, const char *type, bytes *content)
{
    put32(b, (uint32_t)content->size + 8), put(b, type, 4), put(b, content->data, content->size);
    bytes_free(content);
}

/* A colr property: a profile of PROFILE bytes of this value, or code points. */
static void profile(bytes *properties, uint8_t value)
{
    bytes c = {0};
    put(&c, "prof", 4);
    for (int i = 0; i < PROFILE; i++) put8(&c, value);
    box(properties, "colr", &c);
}

static void code_points(bytes *properties, uint8_t primaries, uint8_t transfer)
{
    const uint8_t of[] = {'n', 'c', 'l', 'x', 0, primaries, 0, transfer, 0, 1, 0x80};
    bytes c = {0};
    put(&c, of, sizeof of);
    box(properties, "colr", &c);
}

/* version 1: items of 32 bits, properties of 16. The primary item has the properties from first on, another one, its
 * tile where tiled, the first of all. apart: each item's are in a box of their own. */
static bytes file_of(bytes *properties, int first, int count, int version, bool tiled, bool apart)
{
    bytes b = {0}, c = {0}, inside = {0}, meta = {0}, references = {0};
    put(&c, "heic\0\0\0\0mif1", 12);
    box(&b, "ftyp", &c);
    put32(&c, 0), put(&c, "no handler", 10);
    put32(&meta, 0); /* version and flags */
    box(&meta, "hdlr", &c);
    put32(&c, (uint32_t)version << 24);
    if (version < 1) put16(&c, ITEM);
    else put32(&c, ITEM);
    box(&meta, "pitm", &c);
    const int from_to[][2] = {{ITEM - 1, ITEM}, {ITEM, ITEM - 1}};
    put32(&references, (uint32_t)version << 24);
    for (int k = 0; k < 2; k++) { /* a thumbnail's, then the tile's */
        if (version < 1) put16(&c, (unsigned)from_to[k][0]);
        else put32(&c, (uint32_t)from_to[k][0]);
        put16(&c, 1);
        if (version < 1) put16(&c, (unsigned)from_to[k][1]);
        else put32(&c, (uint32_t)from_to[k][1]);
        box(&references, k && tiled ? "dimg" : "thmb", &c);
    }
    box(&meta, "iref", &references);
    box(&inside, "ipco", properties);
    for (int item = ITEM - 1; item <= ITEM; item++) {
        if (apart || item < ITEM) put32(&c, (uint32_t)version << 24 | (uint32_t)version), put32(&c, apart ? 1 : 2);
        if (version < 1) put16(&c, (unsigned)item);
        else put32(&c, (uint32_t)item);
        const int begin = item == ITEM ? first : 1, end = item == ITEM ? first + count : 2;
        put8(&c, (uint8_t)(end - begin));
        for (int i = begin; i < end; i++) { /* the highest bit says that a reader must know it */
            if (version > 0) put8(&c, 0x80);
            put8(&c, (uint8_t)(i | (version > 0 ? 0 : 0x80)));
        }
        if (apart || item == ITEM) box(&inside, "ipma", &c);
    }
    box(&meta, "iprp", &inside);
    box(&b, "meta", &meta);
    put32(&b, 8), put(&b, "mdat", 4);
    return b;
}

static oi_image read_colours(bytes *b)
{
    oi_image image = {0};
    io_heif_colours(bytes_save(b, test_folder(), "a.heic"), &image);
    return image;
}

TEST(heif_profile_is_that_of_the_primary_image)
{
    for (int k = 0; k < 4; k++) {
        const int version = k % 2;
        bytes properties = {0}, size = {0};
        profile(&properties, 7);
        put32(&size, 0), put32(&size, 64), put32(&size, 64);
        box(&properties, "ispe", &size);
        profile(&properties, 9);
        bytes b = file_of(&properties, 2, 2, version, true, k > 1);
        const oi_image image = read_colours(&b);
        CHECK(image.icc && image.icc_size == PROFILE && !image.code_points, "version %d: no profile", version);
        for (int i = 0; i < PROFILE; i++)
            CHECK(image.icc[i] == 9, "version %d: byte %d is %d", version, i, image.icc[i]);
        free(image.icc);
    }
}

TEST(heif_profile_of_the_tiles_is_that_of_an_image_without)
{
    for (int k = 0; k < 4; k++) {
        bytes properties = {0}, size = {0};
        profile(&properties, 7);
        put32(&size, 0), put32(&size, 64), put32(&size, 64);
        box(&properties, "ispe", &size);
        const bool tiled = k % 2;
        bytes b = file_of(&properties, 2, 1, k / 2, tiled, false);
        const oi_image image = read_colours(&b);
        CHECK(tiled == (image.icc && image.icc[0] == 7), "case %d: a profile of %zu bytes", k, image.icc_size);
        free(image.icc);
    }
}

/* Both are kept, in whatever order; a profile that an image has already stays. */
TEST(heif_profile_and_code_points)
{
    for (int k = 0; k < 2; k++) {
        bytes properties = {0};
        if (k) code_points(&properties, 12, 13);
        profile(&properties, 9);
        if (!k) code_points(&properties, 12, 13);
        bytes b = file_of(&properties, 1, 2, 0, false, false);
        uint8_t own[PROFILE];
        oi_image image = {0}, with = {.icc = own, .icc_size = sizeof own};
        const char *path = bytes_save(&b, test_folder(), "a.heic");
        io_heif_colours(path, &image);
        io_heif_colours(path, &with);
        CHECK(image.icc && image.icc_size == PROFILE && image.code_points && image.code_point[0] == 12, "case %d", k);
        CHECK(with.icc == own && with.icc_size == sizeof own && with.code_points, "the image's own profile is gone");
        free(image.icc);
    }
}

TEST(heif_code_points_are_a_space)
{
    bytes properties = {0};
    profile(&properties, 7);
    code_points(&properties, 12, 13);
    bytes b = file_of(&properties, 2, 1, 0, true, false);
    const oi_image image = read_colours(&b);
    io_space space;
    CHECK(!image.icc && image.code_points && image.code_point[0] == 12 && image.code_point[1] == 13, "not as told");
    CHECK(io_space_code_points(image.code_point, &space), "Display P3 is no space");
    float out[3];
    io_space_apply(&space, (float[]){0.5f, 0.5f, 0.5f}, out);
    for (int k = 0; k < 3; k++) CHECK(fabsf(out[k] - 0.21404f) < 1e-4f, "grey has %g in channel %d", (double)out[k], k);
    io_space_apply(&space, (float[]){1, 0, 0}, out);
    CHECK(fabsf(out[0] - 1.2249f) < 2e-3f, "its red has %g of sRGB's, 1.2249 is right", (double)out[0]);
    CHECK(io_space_code_points((const int[]){2, 16}, &space) && !io_space_code_points((const int[]){2, 13}, &space),
          "primaries that are not said are BT.2020's of HDR alone");
    CHECK(!io_space_code_points((const int[]){9, 5}, &space), "a gamma of 2.8 is taken for another curve");
}

/* Signals and light of ITU-R BT.2100 and BT.2408, table 1, relative to the 203 cd/m² of reference white; HLG's of
 * BT.2100, table 5: (1/12) ^ (1/2) 3 ^ (1/2) is a half. */
TEST(heif_of_hdr)
{
    static const struct {
        int transfer;
        float signal, light, bound;
    } cases[] = {{16, 0, 0, 1e-6f},
                 {16, 0.58f, 1, 0.006f},          /* reference white, two digits of the signal */
                 {16, 0.38f, 26.0f / 203, 0.01f}, /* a grey card of 18% */
                 {16, 0.5080784f, 100 / 203.0f, 1e-4f},
                 {16, 1, 10000 / 203.0f, 1e-2f},
                 {18, 0, 0, 1e-6f},
                 {18, 0.5f, 0.3145f, 1e-4f}, /* 1/12 of the peak's light over .26496 */
                 {18, 0.75f, 1, 1e-6f},
                 {18, 0.38f, 0.1817f, 1e-4f},
                 {18, 1, 3.7742f, 1e-3f}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        io_space space;
        float out[3];
        CHECK(io_space_code_points((const int[]){9, cases[i].transfer}, &space), "no space of transfer %d",
              cases[i].transfer);
        io_space_apply(&space, (float[]){cases[i].signal, cases[i].signal, cases[i].signal}, out);
        for (int c = 0; c < 3; c++)
            CHECK(fabsf(out[c] - cases[i].light) <= cases[i].bound + 1e-3f * cases[i].light,
                  "transfer %d, signal %g: %g in channel %d, not %g", cases[i].transfer, (double)cases[i].signal,
                  (double)out[c], c, (double)cases[i].light);
    }
}

/* What is cut short or damaged says nothing and reads nothing beyond it. */
TEST(heif_that_is_damaged_says_nothing)
{
    bytes properties = {0};
    profile(&properties, 7);
    bytes whole = file_of(&properties, 1, 1, 0, false, false);
    uint8_t *copy = malloc(whole.size);
    const size_t size = whole.size;
    memcpy(copy, whole.data, size);
    bytes_free(&whole);
    ts_rng rng = ts_rng_make(4, 0, 0);
    for (size_t n = 0; n < size + 400; n++) {
        bytes b = {0};
        put(&b, copy, n < size ? n : size);
        if (n > size) b.data[ts_rng_int(&rng, (int)size)] ^= (uint8_t)(1 << ts_rng_int(&rng, 8));
        const oi_image image = read_colours(&b);
        if (n < size - 8) CHECK(!image.icc, "of %zu bytes of %zu a profile is read", n, size);
        if (n == size) CHECK(image.icc, "the whole file has none");
        free(image.icc);
    }
    free(copy);
}
