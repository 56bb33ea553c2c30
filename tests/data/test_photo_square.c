/* The centre square of a photograph at the size of the network. */
#include "data/image/image.h"
#include "tensor/threads.h"
#include "tests/support/make_images.h"
#include "tests/test.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

static io_image square_of(const io_image *in, int size)
{
    ts_status st = {0};
    io_image out;
    CHECK(io_centre_square(in, size, 0, &out, &st) == TS_OK, "%s", st.message);
    CHECK(out.width == size && out.height == size && out.channels == in->channels, "%d x %d", out.width, out.height);
    return out;
}

static io_image blank(int width, int height, int channels)
{
    ts_status st = {0};
    io_image image;
    CHECK(io_image_create(&image, width, height, channels, &st) == TS_OK, "%s", st.message);
    return image;
}

static const int shapes[][3] = {{1, 1, 1},    {1, 9, 4},    {9, 1, 3},  {2, 3, 5},    {64, 48, 16},
                                {61, 97, 13}, {40, 40, 40}, {5, 5, 64}, {300, 200, 7}};

TEST(photo_square_keeps_a_constant)
{
    for (int k = 0; k < 9; k++) {
        io_image in = blank(shapes[k][0], shapes[k][1], 3);
        for (int i = 0; i < in.width * in.height * 3; i++) in.data[i] = 0.25f * (float)(i % 3 + 1);
        io_image out = square_of(&in, shapes[k][2]);
        for (int i = 0; i < out.width * out.height * 3; i++)
            CHECK(fabsf(out.data[i] - 0.25f * (float)(i % 3 + 1)) < 1e-5f, "%d x %d to %d: %g", in.width, in.height,
                  out.width, (double)out.data[i]);
        io_image_free(&in), io_image_free(&out);
    }
}

/* An average: within the range of the values (no ringing), and what is shrunk by a whole factor keeps its mean but for
 * the edges' weight. */
TEST(photo_square_neither_rings_nor_aliases)
{
    io_image in = blank(240, 240, 1);
    for (int i = 0; i < 240 * 240; i++) in.data[i] = (i % 240 / 1 + i / 240) % 2 ? 1 : 0;
    io_image out = square_of(&in, 24);
    for (int i = 0; i < 24 * 24; i++)
        CHECK(fabsf(out.data[i] - 0.5f) < 0.03f, "a fine chessboard shows %g at %d", (double)out.data[i], i);
    io_image_free(&out);
    for (int i = 0; i < 240 * 240; i++) in.data[i] = i % 240 < 120 ? 0 : 100;
    for (int size = 1; size < 500; size += 83) {
        out = square_of(&in, size);
        for (int i = 0; i < size * size; i++)
            CHECK(out.data[i] >= 0 && out.data[i] <= 100.001f, "an edge rings: %g", (double)out.data[i]);
        io_image_free(&out);
    }
    io_image_free(&in);
}

/* The middle is taken, on both axes, and a ramp stays the same ramp. */
TEST(photo_square_is_centred)
{
    for (int tall = 0; tall < 2; tall++) {
        io_image in = blank(tall ? 40 : 120, tall ? 120 : 40, 2);
        for (int y = 0; y < in.height; y++)
            for (int x = 0; x < in.width; x++) {
                float *p = in.data + (y * in.width + x) * 2;
                p[0] = (float)x + 0.5f, p[1] = (float)y + 0.5f; /* the position */
            }
        static const int sizes[] = {40, 20, 80, 13};
        for (int k = 0; k < 4; k++) {
            io_image out = square_of(&in, sizes[k]);
            int middle = sizes[k] / 2, i = (middle * sizes[k] + middle) * 2;
            float want = 40 * ((float)middle + 0.5f) / (float)sizes[k];
            CHECK(fabsf(out.data[i] - want - (tall ? 0 : 40)) < 1e-3f &&
                      fabsf(out.data[i + 1] - want - (tall ? 40 : 0)) < 1e-3f,
                  "size %d: %g %g", sizes[k], (double)out.data[i], (double)out.data[i + 1]);
            io_image_free(&out);
        }
        io_image_free(&in);
    }
    ts_status st = {0};
    io_image in = blank(3, 3, 1), out = {0};
    CHECK(io_centre_square(&in, 0, 0, &out, &st) == TS_INVALID && !out.data, "size 0");
    io_image_free(&in);
}

TEST(image_sizes_without_sense)
{
    ts_status st = {0};
    io_image image;
    CHECK(io_image_create(&image, 0, 4, 3, &st) == TS_INVALID && !image.data, "0 wide");
    CHECK(io_image_create(&image, 4, -4, 3, &st) == TS_INVALID && !image.data, "-4 high");
    CHECK(io_image_create(&image, 2147483647, 2147483647, 2147483647, &st) == TS_NOMEM && !image.data && st.message[0],
          "larger than any memory");
    io_image_free(&image);
}

/* Read at once or cut from the whole: the same bytes, for any number of threads. */
static void same_square(const char *path, int size)
{
    io_image whole, cut, square;
    ts_status st = {0};
    io_photo_facts facts;
    CHECK(!io_read_photo(path, 1 << 20, &whole, &st) && !io_centre_square(&whole, size, 0, &cut, &st), "%s",
          st.message);
    for (int threads = 1; threads <= 3; threads++) {
        ts_threads_set(threads);
        CHECK(!io_read_photo_square(path, 1 << 20, size, 0, &square, &facts, &st), "%s", st.message);
        CHECK(facts.width == whole.width && facts.height == whole.height && square.width == size &&
                  square.height == size && square.channels == 3,
              "%s: %d x %d", path, facts.width, facts.height);
        CHECK(!memcmp(square.data, cut.data, (size_t)size * (size_t)size * 3 * sizeof(float)),
              "%s to %d pixels on %d threads: other values", path, size, threads);
        io_image_free(&square);
    }
    ts_threads_set(0);
    io_image_free(&cut), io_image_free(&whole);
}

TEST(photo_square_of_a_file_is_that_of_the_whole)
{
    static const int sizes[] = {1, 7, 16, 61, 64, 100};
    char path[512];
    ts_status st = {0};
    for (int k = 0; k < 9; k++) { /* 8 and 16 bits, grey, in colour, and with alpha over black */
        static const int channels[] = {3, 3, 1, 3, 4, 3, 4, 1, 3};
        io_image in = blank(shapes[k][0], shapes[k][1], channels[k]);
        for (int i = 0; i < in.width * in.height * in.channels; i++) in.data[i] = (float)(i * 7919 % 4099) / 4098;
        snprintf(path, sizeof path, "%s/p.png", test_folder());
        CHECK(!io_write_png(path, &in, k % 2 ? 16 : 8, true, &st), "%s", st.message);
        for (size_t i = 0; i < sizeof sizes / sizeof *sizes; i++) same_square(path, sizes[i]);
        io_image_free(&in);
    }
    io_image in = blank(97, 61, 3);
    for (int i = 0; i < 97 * 61 * 3; i++) in.data[i] = (float)(i * 7919 % 4099) / 4098;
    snprintf(path, sizeof path, "%s/upright.jpg", test_folder());
    CHECK(!io_write_jpeg(path, &in, 90, &st), "%s", st.message);
    for (int orientation = 1; orientation <= 8; orientation++) {
        bytes b = bytes_load(path);
        jpeg_orientation(&b, orientation);
        const char *name = bytes_save(&b, test_folder(), "turned.jpg");
        for (size_t i = 0; i < sizeof sizes / sizeof *sizes; i++) same_square(name, sizes[i]);
    }
    float pixels[5 * 9 * 3];
    for (int i = 0; i < 5 * 9 * 3; i++) pixels[i] = (float)(i * 7919 % 4099) / 512;
    bytes exr = exr_file(5, 9, pixels, NULL);
    const char *floats = bytes_save(&exr, test_folder(), "f.exr");
    for (size_t i = 0; i < sizeof sizes / sizeof *sizes; i++) same_square(floats, sizes[i]);
    snprintf(path, sizeof path, "%s/none.png", test_folder());
    io_image square = {0};
    CHECK(io_read_photo_square(path, 1 << 20, 8, 0, &square, NULL, &st) == TS_IO && !square.data, "a missing file");
    st = (ts_status){0};
    snprintf(path, sizeof path, "%s/upright.jpg", test_folder());
    CHECK(io_read_photo_square(path, 97 * 61 - 1, 8, 0, &square, NULL, &st) == TS_UNSUPPORTED && !square.data &&
              strstr(st.message, "97 x 61"),
          "the limit: %s", st.message);
    st = (ts_status){0};
    CHECK(io_read_photo_square(path, 1 << 20, 0, 0, &square, NULL, &st) == TS_INVALID && !square.data, "size 0");
    io_image_free(&in);
}
