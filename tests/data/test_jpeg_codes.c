/* JPEG's losses in memory, beside the library's. */
#include "data/camera.h"
#include "data/image/image.h"
#include "tensor/rng.h"
#include "tests/test.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

static double psnr(const uint8_t *a, const uint8_t *b, int n)
{
    double sum = 1e-9;
    for (int i = 0; i < n; i++) sum += (a[i] - b[i]) * (a[i] - b[i]);
    return 10 * log10(255 * 255 * n / sum);
}

TEST(jpeg_keeps_what_a_jpeg_keeps)
{
    static const int sizes[] = {1, 2, 7, 8, 9, 16, 33, 64};
    static uint8_t picture[64 * 64 * 3], a[sizeof picture], b[sizeof picture];
    for (int s = 0; s < 8; s++)
        for (int halved = 0; halved < 2; halved++) {
            const int size = sizes[s], n = size * size * 3;
            for (int grey = 0; grey < 256;
                 grey += 15) { /* a flat grey has only a mean, in steps of two levels at most */
                memset(a, grey, (size_t)n);
                io_jpeg_codes(size, 90, halved, a);
                for (int i = 0; i < n; i++) CHECK(abs(a[i] - grey) <= 1, "%d^2: grey %d became %d", size, grey, a[i]);
            }
            for (int i = 0; i < n; i++)
                picture[i] = (uint8_t)(128 + 60 * sin(i / 3 % size * 0.21) + 40 * cos(i / 3 / size * 0.3 + i % 3));
            double before = 0;
            for (int quality = 10; quality <= 100; quality += 30) {
                memcpy(a, picture, (size_t)n);
                memcpy(b, picture, (size_t)n);
                io_jpeg_codes(size, quality, halved, a);
                io_jpeg_codes(size, quality, halved, b);
                CHECK(!memcmp(a, b, (size_t)n), "two results of one picture");
                const double now = psnr(a, picture, n);
                CHECK(size < 16 || now > before - 0.1, "%d^2: quality %d is worse (%.1f dB) than less (%.1f dB)", size,
                      quality, now, before);
                before = now;
            }
            CHECK(before > (halved ? 25 : 40), "%d^2: quality 100 keeps %.1f dB", size, before);
        }
}

/* Against a decoder and an encoder that are not ours: the file that io_write_jpeg makes, read back. */
TEST(jpeg_matches_the_library)
{
    enum { SIDE = 64, VALUES = SIDE * SIDE * 3 };
    static uint8_t picture[VALUES], ours[VALUES], theirs[VALUES];
    char path[4096];
    io_image image = {0}, back = {0};
    ts_status st = {0};
    snprintf(path, sizeof path, "%s/picture.jpg", test_folder());
    CHECK(io_image_create(&image, SIDE, SIDE, 3, &st) == TS_OK, "%s", st.message);
    ts_rng r = ts_rng_make(1, TS_STREAM_TEST, 1);
    for (int i = 0; i < VALUES; i++) {
        picture[i] = (uint8_t)(120 + 60 * sin(i / 3 % SIDE * 0.31) + 40 * cos(i / 3 / SIDE * 0.23 + i % 3) +
                               30 * ts_rng_uniform(&r));
        image.data[i] = io_srgb_to_linear((float)picture[i] / 255);
    }
    for (int quality = 40; quality <= 95; quality += 11) {
        CHECK(io_write_jpeg(path, &image, quality, &st) == TS_OK, "%s", st.message);
        CHECK(io_read_photo(path, IO_MAX_PIXELS_DEFAULT, &back, &st) == TS_OK, "%s", st.message);
        double loss = 0, apart = 0;
        for (int i = 0; i < VALUES; i++) theirs[i] = (uint8_t)(io_linear_to_srgb(back.data[i]) * 255 + 0.5f);
        double best = 0;
        for (int halved = 0; halved < 2; halved++) {
            memcpy(ours, picture, sizeof ours);
            io_jpeg_codes(SIDE, quality, halved, ours);
            const double same = psnr(ours, theirs, VALUES);
            if (same > best) {
                best = apart = same;
                loss = psnr(theirs, picture, VALUES);
            }
        }
        CHECK(apart > loss + 10, "quality %d: %.1f dB from the library's picture, which is %.1f dB from the original",
              quality, apart, loss);
        io_image_free(&back);
    }
    io_image_free(&image);
}
