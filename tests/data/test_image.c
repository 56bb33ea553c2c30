/* Photographs of every kind that people have, and writing. */
#include "data/image/colour.h"
#include "data/image/image.h"
#include "tests/support/make_images.h"
#include "tests/test.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

static io_image photo(const char *path)
{
    ts_status st = {0};
    io_image image;
    CHECK(io_read_photo(path, IO_MAX_PIXELS_DEFAULT, &image, &st) == TS_OK, "%s", st.message);
    CHECK(image.channels == 3, "%d channels", image.channels);
    return image;
}

static const float *at(const io_image *image, int x, int y)
{
    return image->data + ((size_t)y * (size_t)image->width + (size_t)x) * (size_t)image->channels;
}

static void check_colour(const io_image *image, int x, int y, float r, float g, float b, float tolerance,
                         const char *what)
{
    const float *p = at(image, x, y);
    CHECK(fabsf(p[0] - r) <= tolerance && fabsf(p[1] - g) <= tolerance && fabsf(p[2] - b) <= tolerance,
          "%s: %g %g %g, not %g %g %g", what, (double)p[0], (double)p[1], (double)p[2], (double)r, (double)g,
          (double)b);
}

static void set(io_image *image, int x, int y, float r, float g, float b)
{
    float *p = image->data + ((size_t)y * (size_t)image->width + (size_t)x) * (size_t)image->channels;
    p[0] = r, p[1] = g, p[2] = b;
}

static io_image blank(int width, int height, int channels)
{
    ts_status st = {0};
    io_image image;
    CHECK(io_image_create(&image, width, height, channels, &st) == TS_OK, "%s", st.message);
    return image;
}

TEST(srgb_curve)
{
    float before = -1;
    for (int i = 0; i <= 1000; i++) {
        float v = (float)i / 1000, linear = io_srgb_to_linear(v);
        CHECK(fabsf(io_linear_to_srgb(linear) - v) < 1e-5f, "%g comes back as %g", (double)v,
              (double)io_linear_to_srgb(linear));
        CHECK(linear > before, "not rising at %g", (double)v);
        before = linear;
    }
    CHECK(fabsf(io_srgb_to_linear(0.5f) - 0.2140411f) < 1e-6f, "middle is %g", (double)io_srgb_to_linear(0.5f));
}

/* What is written is what is read: to a float's rounding for stored data, to the integers' rounding through the curve.
 */
TEST(png_round_trip)
{
    static const int channels[] = {1, 3};
    for (int k = 0; k < 8; k++) {
        int c = channels[k & 1], bits = k & 2 ? 16 : 8;
        bool srgb = k & 4;
        float top = bits == 16 ? 65535 : 255;
        io_image image = blank(37, 11, c);
        for (int i = 0; i < 37 * 11 * c; i++) image.data[i] = (float)(i * 7919 % (int)(top + 1)) / top;
        char path[512];
        ts_status st = {0};
        snprintf(path, sizeof path, "%s/%d.png", test_folder(), k);
        CHECK(io_write_png(path, &image, bits, srgb, &st) == TS_OK, "%s", st.message);
        io_image back;
        if (srgb) back = photo(path);
        else CHECK(io_read_data(path, c, IO_MAX_PIXELS_DEFAULT, &back, &st) == TS_OK, "%s", st.message);
        CHECK(back.width == 37 && back.height == 11, "%d x %d", back.width, back.height);
        for (int i = 0; i < 37 * 11; i++)
            for (int j = 0; j < back.channels; j++) {
                float v = image.data[i * c + (c == 1 ? 0 : j)], w = back.data[i * back.channels + j];
                /* The curve's slope is at most 2.28. */
                CHECK(fabsf(v - w) <= (srgb ? 1.2f / top : 1.2e-7f), "%d bits, %d channels: %.9g became %.9g", bits, c,
                      (double)v, (double)w);
            }
        io_image_free(&image);
        io_image_free(&back);
    }
}

TEST(writing_clamps)
{
    const float in[6] = {-1, 2, NAN, INFINITY, -INFINITY, 0.5f}, want[6] = {0, 1, 0, 1, 0, 0.5f};
    io_image image = blank(6, 1, 1), back;
    memcpy(image.data, in, sizeof in);
    char path[512];
    ts_status st = {0};
    snprintf(path, sizeof path, "%s/a.png", test_folder());
    CHECK(io_write_png(path, &image, 16, false, &st) == TS_OK, "%s", st.message);
    CHECK(io_read_data(path, 1, IO_MAX_PIXELS_DEFAULT, &back, &st) == TS_OK, "%s", st.message);
    for (int i = 0; i < 6; i++)
        CHECK(fabsf(back.data[i] - want[i]) < 1e-5f, "%g became %g", (double)in[i], (double)back.data[i]);
}

TEST(alpha_is_not_encoded)
{
    io_image image = blank(2, 2, 4);
    for (int i = 0; i < 4; i++) set(&image, i % 2, i / 2, 0.2f, 0.4f, 0.6f), image.data[4 * i + 3] = 0.5f;
    char path[512];
    ts_status st = {0};
    snprintf(path, sizeof path, "%s/a.png", test_folder());
    CHECK(io_write_png(path, &image, 16, true, &st) == TS_OK, "%s", st.message);
    io_image back = photo(path);
    check_colour(&back, 1, 1, 0.1f, 0.2f, 0.3f, 1e-4f, "half transparent over black");
    image = blank(1, 1, 2);
    image.data[0] = 0.4f, image.data[1] = 0.5f;
    CHECK(io_write_png(path, &image, 16, true, &st) == TS_OK, "%s", st.message);
    back = photo(path);
    check_colour(&back, 0, 0, 0.2f, 0.2f, 0.2f, 1e-4f, "half transparent grey over black");
}

/* EXIF orientation: which stored corner is seen at the upper left and at the upper right (corners clockwise from the
 * stored upper left). */
TEST(orientation)
{
    static const int left[9] = {0, 0, 1, 2, 3, 0, 3, 2, 1}, right[9] = {0, 1, 0, 3, 2, 3, 0, 1, 2};
    static const float corner[4][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {1, 1, 1}};
    io_image image = blank(64, 32, 3);
    for (int y = 0; y < 32; y++)
        for (int x = 0; x < 64; x++) {
            const float *c = corner[y < 16 ? x >= 32 : x < 32 ? 3 : 2];
            set(&image, x, y, c[0], c[1], c[2]);
        }
    ts_status st = {0};
    char path[512];
    snprintf(path, sizeof path, "%s/a.jpg", test_folder());
    CHECK(io_write_jpeg(path, &image, 95, &st) == TS_OK, "%s", st.message);
    for (int k = 1; k <= 8; k++) {
        bytes b = bytes_load(path);
        jpeg_orientation(&b, k);
        const char *turned_path = bytes_save(&b, test_folder(), "turned.jpg");
        io_image seen = photo(turned_path);
        CHECK(seen.width == (k < 5 ? 64 : 32) && seen.height == (k < 5 ? 32 : 64), "orientation %d: %d x %d", k,
              seen.width, seen.height);
        const float *l = corner[left[k]], *r = corner[right[k]];
        check_colour(&seen, 4, 4, l[0], l[1], l[2], 0.05f, "upper left");
        check_colour(&seen, seen.width - 5, 4, r[0], r[1], r[2], 0.05f, "upper right");
        io_image raw;
        CHECK(io_read_data(turned_path, 3, IO_MAX_PIXELS_DEFAULT, &raw, &st) == TS_OK && raw.width == 64,
              "data is turned");
        io_image_free(&raw);
        CHECK(io_read_mask(turned_path, IO_MAX_PIXELS_DEFAULT, &raw, &st) == TS_OK && raw.width == seen.width &&
                  raw.height == seen.height && raw.channels == 1,
              "a mask is not turned");
        for (int right_side = 0; right_side < 2; right_side++) {
            const float *c = right_side ? r : l, v = raw.data[4 * raw.width + (right_side ? raw.width - 5 : 4)];
            CHECK(fabsf(v - (c[0] + c[1] + c[2]) / 3) < 0.05f, "orientation %d: %g in the mask", k, v);
        }
        io_image_free(&seen);
        io_image_free(&raw);
    }
    /* The same in TIFF, where it is an ordinary tag. */
    static const uint8_t two[6] = {255, 0, 0, 0, 0, 255};
    bytes b = tiff_file(&(tiff_page){2, 1, 3, 8, 2, 1, -1, 6, two}, 1);
    io_image seen = photo(bytes_save(&b, test_folder(), "a.tif"));
    CHECK(seen.width == 1 && seen.height == 2, "TIFF is not turned");
    check_colour(&seen, 0, 0, 1, 0, 0, 1e-5f, "TIFF turned");
}

TEST(grey_alpha_palette_16_bit)
{
    const char *folder = test_folder();
    char path[512];
    const uint8_t grey[4] = {0, 128, 255, 64}, grey_alpha[4] = {128, 255, 255, 51},
                  rgba[8] = {255, 128, 0, 255, 255, 255, 255, 0};
    const uint8_t wide[6] = {0x80, 0, 0xff, 0xff, 0x01, 0x02}, index[2] = {1, 0}, palette[6] = {255, 0, 0, 0, 128, 255},
                  bits[1] = {0xa0};
    float middle = io_srgb_to_linear(128 / 255.0f);
    bytes b = {0};
    png_begin(&b, 4, 1, 8, 0), png_pixels(&b, grey, 4, 1), png_end(&b);
    io_image p = photo(bytes_save(&b, folder, "grey.png"));
    check_colour(&p, 1, 0, middle, middle, middle, 1e-6f, "grey");
    png_begin(&b, 2, 1, 8, 4), png_pixels(&b, grey_alpha, 4, 1), png_end(&b);
    p = photo(bytes_save(&b, folder, "grey_alpha.png"));
    check_colour(&p, 0, 0, middle, middle, middle, 1e-6f, "grey, opaque");
    check_colour(&p, 1, 0, 0.2f, 0.2f, 0.2f, 1e-6f, "white, a fifth opaque, in linear light");
    png_begin(&b, 2, 1, 8, 6), png_pixels(&b, rgba, 8, 1), png_end(&b);
    p = photo(bytes_save(&b, folder, "rgba.png"));
    check_colour(&p, 0, 0, 1, middle, 0, 1e-6f, "opaque");
    check_colour(&p, 1, 0, 0, 0, 0, 0, "transparent white over black");
    ts_status st = {0};
    snprintf(path, sizeof path, "%s/rgba.png", folder);
    CHECK(!io_read_mask(path, 4, &p, &st) && p.data[0] > 0.5f && p.data[1] == 0, "a mask is what is opaque: %s",
          st.message);
    io_image_free(&p);
    png_begin(&b, 1, 1, 16, 2), png_pixels(&b, wide, 6, 1), png_end(&b);
    p = photo(bytes_save(&b, folder, "wide.png"));
    check_colour(&p, 0, 0, io_srgb_to_linear(32768 / 65535.0f), 1, io_srgb_to_linear(258 / 65535.0f), 1e-6f, "16 bits");
    png_begin(&b, 2, 1, 8, 3), png_chunk(&b, "PLTE", palette, 6), png_pixels(&b, index, 2, 1), png_end(&b);
    p = photo(bytes_save(&b, folder, "palette.png"));
    check_colour(&p, 0, 0, 0, middle, 1, 1e-6f, "palette");
    png_begin(&b, 3, 1, 1, 0), png_pixels(&b, bits, 1, 1), png_end(&b);
    p = photo(bytes_save(&b, folder, "bits.png"));
    check_colour(&p, 0, 0, 1, 1, 1, 0, "one bit");
    check_colour(&p, 1, 0, 0, 0, 0, 0, "one bit");
    const uint8_t associated[8] = {128, 0, 0, 128, 0, 255, 0, 255};
    b = tiff_file(&(tiff_page){2, 1, 4, 8, 2, 1, 1, 1, associated}, 1);
    p = photo(bytes_save(&b, folder, "associated.tif"));
    check_colour(&p, 0, 0, middle, 0, 0, 1e-6f, "colours that alpha multiplies already");
}

TEST(cmyk)
{
    const uint8_t ink[8] = {255, 0, 0, 0, 0, 0, 0, 128};
    bytes b = tiff_file(&(tiff_page){2, 1, 4, 8, 5, 1, -1, 1, ink}, 1);
    io_image p = photo(bytes_save(&b, test_folder(), "cmyk.tif"));
    check_colour(&p, 0, 0, 0, 1, 1, 1e-5f, "cyan");
    float dark = io_srgb_to_linear(127 / 255.0f);
    check_colour(&p, 1, 0, dark, dark, dark, 0.01f, "half black");
    const uint8_t stored[4] = {255, 0, 255, 255}; /* inverted: full magenta */
    b = jpeg_cmyk(stored);
    p = photo(bytes_save(&b, test_folder(), "cmyk.jpg"));
    CHECK(p.width == 16 && p.height == 8, "%d x %d", p.width, p.height);
    check_colour(&p, 9, 3, 1, 0, 1, 0.02f, "magenta");
}

/* The published matrix from linear Display-P3 to linear sRGB (CSS Color 4, 10.11). */
static const float p3_to_srgb[3][3] = {
    {1.2249401f, -0.2249402f, 0}, {-0.0420569f, 1.0420571f, 0}, {-0.0196376f, -0.0786361f, 1.0982735f}};
/* The colour that each test stores: 200, 150, 100 of 255. */
static const uint8_t stored[3] = {200, 150, 100};

static void check_p3(const char *path, const char *what)
{
    io_image p = photo(path);
    float want[3] = {0};
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) want[i] += p3_to_srgb[i][j] * io_srgb_to_linear((float)stored[j] / 255);
    check_colour(&p, 0, 0, want[0], want[1], want[2], 2e-3f, what);
    io_image_free(&p);
}

static const char *png_with_profile(const double colorants[9], double gamma, const char *name)
{
    bytes b = {0}, profile = icc_profile(colorants, gamma);
    png_begin(&b, 1, 1, 8, 2), png_profile(&b, &profile), png_pixels(&b, stored, 3, 1), png_end(&b);
    bytes_free(&profile);
    return bytes_save(&b, test_folder(), name);
}

TEST(display_p3)
{
    check_p3(png_with_profile(icc_display_p3, 0, "p3.png"), "PNG, profile with parameters");
    check_p3(png_with_profile(icc_display_p3, -1, "p3_table.png"), "PNG, profile with tables");
    bytes b = {0}, profile = icc_profile(icc_display_p3, 0);
    static const uint32_t chrm[8] = {31270, 32900, 68000, 32000, 26500, 69000, 15000, 6000};
    bytes c = {0}, g = {0};
    for (int i = 0; i < 8; i++) put32(&c, chrm[i]);
    put32(&g, 45455);
    png_begin(&b, 1, 1, 8, 2), png_chunk(&b, "gAMA", g.data, 4), png_chunk(&b, "cHRM", c.data, 32),
        png_pixels(&b, stored, 3, 1), png_end(&b);
    check_p3(bytes_save(&b, test_folder(), "chrm.png"), "PNG, chromaticities");
    png_begin(&b, 1, 1, 8, 2), png_chunk(&b, "cICP", "\14\15\0\1", 4), png_pixels(&b, stored, 3, 1), png_end(&b);
    check_p3(bytes_save(&b, test_folder(), "cicp.png"), "PNG, code points");

    io_image flat = blank(16, 16, 3);
    for (int i = 0; i < 256 * 3; i++) flat.data[i] = io_srgb_to_linear((float)stored[i % 3] / 255);
    char path[512];
    ts_status st = {0};
    snprintf(path, sizeof path, "%s/flat.jpg", test_folder());
    CHECK(io_write_jpeg(path, &flat, 100, &st) == TS_OK, "%s", st.message);
    b = bytes_load(path);
    jpeg_profile(&b, &profile);
    io_image p = photo(bytes_save(&b, test_folder(), "p3.jpg"));
    check_colour(&p, 5, 5, 0.640577f, 0.294393f, 0.106785f, 0.01f, "JPEG, profile");
}

TEST(other_colour_spaces)
{
    io_image p = photo(png_with_profile(icc_srgb, -1, "srgb.png"));
    for (int c = 0; c < 3; c++)
        CHECK(p.data[c] == io_srgb_to_linear((float)stored[c] / 255), "an sRGB profile changes %d to %g", stored[c],
              (double)p.data[c]);
    /* Adobe RGB to sRGB, both with white D65: red 1.3984 r - 0.3984 g, green g, blue -0.0429 g + 1.0429 b. */
    p = photo(png_with_profile(icc_adobe_rgb, 563 / 256.0, "adobe.png"));
    float r = powf(200 / 255.f, 563 / 256.f), g = powf(150 / 255.f, 563 / 256.f), b = powf(100 / 255.f, 563 / 256.f);
    check_colour(&p, 0, 0, 1.3984f * r - 0.3984f * g, g, 1.0429f * b - 0.0429f * g, 2e-3f, "Adobe RGB");
    /* ACES2065-1 (SMPTE ST 2065-1), whose primaries are imaginary, by Bradford's adaptation of its white */
    static const float aces[8] = {.7347f, .2653f, 0, 1, .0001f, -.077f, .32168f, .33767f}, in[3] = {.5f, .3f, .2f};
    static const float to_srgb[3][3] = {
        {2.5217f, -1.1341f, -.3876f}, {-.2765f, 1.3727f, -.0962f}, {-.0154f, -.1530f, 1.1684f}};
    io_space space;
    float out[3];
    CHECK(io_space_primaries(aces, 1, &space), "ACES2065-1 is no space");
    io_space_apply(&space, in, out);
    for (int c = 0; c < 3; c++) {
        const float right = to_srgb[c][0] * in[0] + to_srgb[c][1] * in[1] + to_srgb[c][2] * in[2];
        CHECK(fabsf(out[c] - right) < 1e-3f, "ACES2065-1: channel %d is %g, not %g", c, (double)out[c], (double)right);
    }
    bytes f = {0}, gamma = {0};
    put32(&gamma, 100000);
    png_begin(&f, 1, 1, 8, 2), png_chunk(&f, "gAMA", gamma.data, 4), png_pixels(&f, stored, 3, 1), png_end(&f);
    p = photo(bytes_save(&f, test_folder(), "linear.png"));
    check_colour(&p, 0, 0, 200 / 255.f, 150 / 255.f, 100 / 255.f, 1e-5f, "linear PNG");
}

/* A damaged profile is no reason to refuse a photograph, and must not be read outside its bytes. */
TEST(damaged_profiles)
{
    bytes good = icc_profile(icc_display_p3, -1);
    unsigned state = 1;
    for (int round = 0; round < 20000; round++) {
        size_t size = good.size;
        uint8_t *copy = malloc(size);
        memcpy(copy, good.data, size);
        for (int k = 0; k < 3; k++) {
            state = state * 1664525 + 1013904223;
            copy[(state >> 8) % (k == 2 ? size : 300)] = (uint8_t)(state >> 24);
        }
        if (round % 3 == 0) {
            size = (state >> 4) % size + 1;
            copy = realloc(copy, size); /* so that a checker sees the end */
        }
        io_space space;
        if (io_space_icc(copy, size, &space)) {
            float out[3];
            io_space_apply(&space, (float[3]){0.2f, 0.5f, 1}, out);
            for (int c = 0; c < 3; c++)
                CHECK(out[c] >= 0 && out[c] <= 65504, "round %d gives %g", round, (double)out[c]);
        }
        free(copy);
    }
    bytes_free(&good);
}

static void check_all(const io_image *p, const float *want, const char *what)
{
    for (int i = 0; i < p->width * p->height * 3; i++)
        CHECK(fabsf(p->data[i] - want[i]) <= 0.005f * want[i], "%s: value %d is %g, not %g", what, i,
              (double)p->data[i], (double)want[i]);
}

TEST(linear_floats)
{
    const float in[12] = {5, 0.5f, 0, -1, NAN, 0.25f, INFINITY, -INFINITY, 1e-6f, 1, 2, 3},
                want[12] = {5, 0.5f, 0, 0, 0, 0.25f, 65504, 0, 1e-6f, 1, 2, 3};
    bytes b = exr_file(4, 1, in, NULL);
    io_image p = photo(bytes_save(&b, test_folder(), "a.exr"));
    check_all(&p, want, "EXR");
    b = tiff_file(&(tiff_page){2, 2, 3, 32, 2, 3, -1, 1, in}, 1);
    p = photo(bytes_save(&b, test_folder(), "a.tif"));
    check_all(&p, want, "float TIFF");
    static const uint8_t rgbe[8] = {128, 64, 0, 129, 128, 128, 255, 140};
    b = (bytes){0};
    const char *head = "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 2 +X 1\n";
    put(&b, head, strlen(head));
    put(&b, rgbe, 8);
    p = photo(bytes_save(&b, test_folder(), "a.hdr"));
    CHECK(p.width == 1 && p.height == 2, "HDR of %d x %d", p.width, p.height);
    check_colour(&p, 0, 0, 1, 0.5f, 0, 0.01f, "HDR");
    check_colour(&p, 0, 1, 2048, 2048, 4080, 17, "HDR over 1");
    static const float p3[8] = {.68f, .32f, .265f, .69f, .15f, .06f, .3127f, .329f}, one[3] = {0.5f, 0.5f, 0.25f};
    b = exr_file(1, 1, one, p3);
    p = photo(bytes_save(&b, test_folder(), "p3.exr"));
    check_colour(&p, 0, 0, 0.5f, 0.5f, 1.0982735f * 0.25f - 0.0982737f * 0.5f, 2e-3f, "EXR with chromaticities");
}

/* Layers of an EXR are not mixed. */
TEST(layers)
{
    static const char *const one[] = {"Depth.Z", "beauty.A", "beauty.B", "beauty.G", "beauty.R"},
                             *const two[] = {"a.B", "a.G", "a.R", "b.B", "b.G", "b.R"};
    const float of_one[] = {9, 1, 0.1f, 0.4f, 0.8f}, of_two[] = {1, 2, 3, 4, 5, 6};
    bytes b = exr_row(1, 5, one, of_one);
    io_image p = photo(bytes_save(&b, test_folder(), "one.exr"));
    check_colour(&p, 0, 0, 0.8f, 0.4f, 0.1f, 1e-6f, "the layer with colours");
    b = exr_row(1, 6, two, of_two);
    ts_status st = {0};
    CHECK(io_read_photo(bytes_save(&b, test_folder(), "two.exr"), 1 << 20, &p, &st) == TS_UNSUPPORTED &&
              strstr(st.message, "several layers have colours (a, b)"),
          "%s", st.message);
    static const char *const none[] = {"Depth.Z", "Normal.X", "Normal.Y", "Normal.Z"};
    b = exr_row(1, 4, none, of_two);
    CHECK(io_read_photo(bytes_save(&b, test_folder(), "none.exr"), 1 << 20, &p, &st) == TS_UNSUPPORTED &&
              strstr(st.message, "no layer has the channels R, G and B"),
          "%s", st.message);
}

TEST(first_page)
{
    static const uint8_t red[3] = {255, 0, 0}, green[6] = {0, 255, 0, 0, 255, 0};
    const tiff_page pages[2] = {{1, 1, 3, 8, 2, 1, -1, 1, red}, {2, 1, 3, 8, 2, 1, -1, 1, green}};
    bytes b = tiff_file(pages, 2);
    io_image p = photo(bytes_save(&b, test_folder(), "pages.tif"));
    CHECK(p.width == 1 && p.height == 1, "%d x %d", p.width, p.height);
    check_colour(&p, 0, 0, 1, 0, 0, 0, "first page");
}
