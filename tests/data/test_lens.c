/* The field of view from a photograph's file. */
#include "data/image/common_read.h"
#include "data/image/image.h"
#include "tests/support/make_images.h"
#include "tests/test.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* What stands in the file; 0: no such tag. */
typedef struct tags {
    const char *make;
    unsigned focal_35mm, focal, plane, unit, zoom, width, height; /* focal, plane, zoom: hundredths */
} tags;

static void tag(bytes *b, bool little, unsigned id, unsigned type, unsigned count, uint32_t value)
{
    if (little) put16le(b, id), put16le(b, type), put32le(b, count);
    else put16(b, id), put16(b, type), put32(b, count);
    if (type == 3) { /* a short stands in the first two bytes */
        if (little) put16le(b, value), put16le(b, 0);
        else put16(b, value), put16(b, 0);
    } else if (little) put32le(b, value);
    else put32(b, value);
}

/* Directories, the maker's name, three fractions. */
static bytes exif(const tags *t, bool little)
{
    enum { FIRST = 8, SECOND = FIRST + 2 + 2 * 12 + 4, ROOM = SECOND + 2 + 8 * 12 + 4, NAME = ROOM + 24 };
    bytes b = {0};
    put(&b, "Exif\0\0", 6);
    put(&b, little ? "II*\0\10\0\0\0" : "MM\0*\0\0\0\10", 8);
    const unsigned length = (unsigned)strlen(t->make) + 1;
    put16le(&b, little ? 2 : 2 << 8);
    tag(&b, little, 0x10f, 2, length, NAME);
    tag(&b, little, 0x8769, 4, 1, SECOND);
    put32(&b, 0);
    put16le(&b, little ? 8 : 8 << 8);
    const unsigned absent = 0xfde0; /* a private tag in place of one that is 0 */
    tag(&b, little, t->focal ? 0x920a : absent, 5, 1, ROOM);
    tag(&b, little, t->width ? 0xa002 : absent + 1, 4, 1, t->width);
    tag(&b, little, t->height ? 0xa003 : absent + 2, 3, 1, t->height);
    tag(&b, little, t->plane ? 0xa20e : absent + 3, 5, 1, ROOM + 8);
    tag(&b, little, t->unit ? 0xa210 : absent + 4, 3, 1, t->unit);
    tag(&b, little, t->zoom ? 0xa404 : absent + 5, 5, 1, ROOM + 16);
    tag(&b, little, t->focal_35mm ? 0xa405 : absent + 6, 3, 1, t->focal_35mm);
    tag(&b, little, absent + 7, 4, 1, 0);
    put32(&b, 0);
    const unsigned over[3] = {t->focal, t->plane, t->zoom};
    for (int i = 0; i < 3; i++) {
        if (little) put32le(&b, over[i]), put32le(&b, 100);
        else put32(&b, over[i]), put32(&b, 100);
    }
    put(&b, t->make, length > 4 ? length : 5);
    return b;
}

static double from_file(const char *path, char why[128])
{
    io_image square;
    io_photo_facts facts;
    ts_status st = {0};
    CHECK(!io_read_photo_square(path, 1 << 20, 8, 0, &square, &facts, &st), "%s", st.message);
    io_image_free(&square);
    return io_lens_fov(&facts.lens, facts.width, facts.height, why, 128);
}

static double degrees(double side, double focal) { return 2 * 57.29577951308232 * atan(side / (2 * focal)); }

TEST(lens_field_of_view_from_exif)
{
    const double diagonal = 43.266615305567875, phone = degrees(30, 26 * 50 / diagonal);
    const struct {
        tags t;
        double want;
        const char *why;
    } cases[] = {{{"Maker", 26, 425, 0, 0, 0, 0, 0}, phone, "26 mm"},
                 {{"Maker", 26, 425, 0, 0, 0, 4000, 3000}, phone, "26 mm"}, /* reduced since */
                 {{"Maker", 26, 425, 0, 0, 100, 40, 30}, phone, "26 mm"},
                 {{"Maker", 26, 425, 0, 0, 200, 0, 0}, degrees(30, 52 * 50 / diagonal), "2 times"},
                 {{"Apple", 52, 425, 0, 0, 200, 0, 0}, degrees(30, 52 * 50 / diagonal), "52 mm"},
                 {{"Maker", 0, 425, 14400, 3, 0, 40, 30}, degrees(30, 4.25 * 14.4), "per mm"},
                 {{"Maker", 0, 425, 36576, 2, 0, 40, 30}, degrees(30, 4.25 * 14.4), "per mm"},
                 {{"Maker", 0, 425, 36576, 0, 0, 40, 30}, degrees(30, 4.25 * 14.4), "per mm"},
                 {{"Maker", 0, 425, 28800, 3, 200, 80, 60}, degrees(30, 2 * 4.25 * 14.4), "per mm"},
                 {{"Maker", 26, 425, 0, 0, 0, 4000, 2000}, 0, "cut from 4000 x 2000"},
                 {{"Maker", 0, 425, 0, 0, 0, 0, 0}, 0, "sensor's size"},
                 {{"Maker", 0, 0, 0, 0, 0, 40, 30}, 0, "no focal length"},
                 {{"Maker", 60000, 0, 0, 0, 0, 0, 0}, 0, "cannot be"},
                 {{"Maker", 1, 0, 0, 0, 0, 0, 0}, 0, "cannot be"}};
    char path[512], why[128];
    ts_status st = {0};
    io_image image;
    for (int turned = 0; turned < 2; turned++) {
        CHECK(!io_image_create(&image, turned ? 30 : 40, turned ? 40 : 30, 3, &st), "%s", st.message);
        snprintf(path, sizeof path, "%s/%d.jpg", test_folder(), turned);
        CHECK(!io_write_jpeg(path, &image, 90, &st), "%s", st.message);
        io_image_free(&image);
        for (size_t i = 0; i < sizeof cases / sizeof *cases; i++)
            for (int little = 0; little < 2; little++) {
                bytes jpeg = bytes_load(path), segment = exif(&cases[i].t, little);
                uint8_t *own = memmem(jpeg.data, jpeg.size, "Exif", 4); /* the writer's: two are unusual */
                if (own) memcpy(own, "none", 4);
                jpeg_insert(&jpeg, 0xe1, segment.data, segment.size);
                bytes_free(&segment);
                const char *name = bytes_save(&jpeg, test_folder(), "lens.jpg");
                const double fov = from_file(name, why);
                CHECK(fabs(fov - cases[i].want) < 1e-6 && strstr(why, cases[i].why), "case %zu: %g degrees, not %g: %s",
                      i, fov, cases[i].want, why);
                oi_image quick, library;
                bool read;
                CHECK(!io_read_jpeg_file(name, 1 << 20, &quick, &read, &st) && read, "case %zu is passed on", i);
                CHECK(!oi_read(name, 1 << 20, INFINITY, &library, &st), "%s", st.message);
                const io_lens a = quick.lens, b = library.lens;
                CHECK(fabs(a.focal_35mm - b.focal_35mm) + fabs(a.focal - b.focal) + fabs(a.zoom - b.zoom) < 1e-5 &&
                          fabs(a.plane - b.plane) < 1e-4 && a.width == b.width && a.height == b.height &&
                          a.zoom_in_focal35 == b.zoom_in_focal35,
                      "case %zu: the image library reads another lens", i);
                oi_free(&quick);
                oi_free(&library);
            }
    }
}
