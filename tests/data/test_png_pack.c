/* PNG files that are written, read back row by row with libpng: their rows at once and in parts. */
#include "data/image/image.h"
#include "tests/test.h"
#include <png.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Of pixel x, y: smooth, with steps and with noise. */
static unsigned value(int x, int y, unsigned top)
{
    const unsigned noise = (unsigned)(x * 7919 + y * 104729) * 2654435761u >> 29;
    return ((unsigned)(x / 3 + y) * 5 + noise + (x / 100 % 7 == 3 ? top / 2 : 0)) & top;
}

typedef struct picture {
    int width, height, channels, bits, wrong_row;
} picture;

static ts_code make(int y, int count, float *values, void *user, ts_status *st)
{
    const picture *p = user;
    const unsigned top = p->bits == 16 ? 65535 : 255;
    for (int i = 0; i < count; i++)
        for (int x = 0; x < p->width * p->channels; x++) *values++ = (float)value(x, y + i, top) / (float)top;
    return y <= p->wrong_row && p->wrong_row < y + count ? ts_fail(st, TS_IO, "the maker ends at row %d", p->wrong_row)
                                                         : TS_OK;
}

static void on_warning(png_structp png, png_const_charp message)
{
    (void)png;
    CHECK(false, "libpng warns: %s", message);
}

static void check_file(const char *path, const picture *p)
{
    const unsigned top = p->bits == 16 ? 65535 : 255;
    FILE *f = fopen(path, "rb");
    png_structp png = png_create_read_struct(PNG_LIBPNG_VER_STRING, NULL, NULL, on_warning);
    png_infop info = png_create_info_struct(png);
    CHECK(f && png && info, "%s cannot be read", path);
    CHECK(!setjmp(png_jmpbuf(png)), "%s: libpng refuses it", path);
    png_init_io(png, f);
    png_read_info(png, info);
    CHECK(png_get_image_width(png, info) == (unsigned)p->width && png_get_bit_depth(png, info) == p->bits &&
              png_get_channels(png, info) == p->channels,
          "another header");
    unsigned char *row = malloc(png_get_rowbytes(png, info));
    for (int y = 0; y < p->height; y++) {
        png_read_row(png, row, NULL);
        for (int x = 0; x < p->width * p->channels; x++) {
            const unsigned has = p->bits == 16 ? (unsigned)(row[2 * x] << 8 | row[2 * x + 1]) : row[x];
            CHECK(has == value(x, y, top), "%d bits, %d channels, row %d: value %d is %u, not %u", p->bits, p->channels,
                  y, x, has, value(x, y, top));
        }
    }
    png_read_end(png, info);
    png_destroy_read_struct(&png, &info, NULL);
    free(row);
    fclose(f);
}

static void check_picture(picture p)
{
    const io_rows rows = {p.width, p.height, p.channels, make, &p};
    char path[512];
    ts_status st = {0};
    snprintf(path, sizeof path, "%s/a.png", test_folder());
    CHECK(io_write_png_rows(path, &rows, p.bits, false, &st) == TS_OK, "%s", st.message);
    check_file(path, &p);
}

TEST(png_rows_at_once)
{
    for (int channels = 1; channels <= 4; channels++)
        for (int bits = 8; bits <= 16; bits += 8) {
            check_picture((picture){1, 1, channels, bits, -1});
            check_picture((picture){1, 37, channels, bits, -1});
            check_picture((picture){701, 3, channels, bits, -1});
            check_picture((picture){130, 97, channels, bits, -1});
        }
}

/* More than is held together. */
TEST(png_rows_in_parts) { check_picture((picture){8192, 8300, 1, 8, -1}); }

TEST(png_rows_that_fail)
{
    static const int heights[] = {40, 8300};
    for (int i = 0; i < 2; i++) {
        picture p = {8192, heights[i], 1, 8, 20};
        const io_rows rows = {p.width, p.height, p.channels, make, &p};
        char path[512];
        ts_status st = {0};
        snprintf(path, sizeof path, "%s/a.png", test_folder());
        CHECK(io_write_png_rows(path, &rows, p.bits, false, &st) == TS_IO, "%d rows are written", heights[i]);
        CHECK(fopen(path, "rb") == NULL, "a file is left");
        CHECK(strcmp(st.message, "the maker ends at row 20") == 0, "%s", st.message);
    }
}
